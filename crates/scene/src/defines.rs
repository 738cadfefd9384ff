//! Applies overrides (`KEY=VALUE`, see `define.rs`) to the tables of a scene file.

use toml::{Table, Value};

use crate::define::{Define, matches_segment, parse_index, problem_at};
use crate::error::SceneError;
use crate::key_path::{KeyPath, Segment, cut, list};
use crate::problem::{At as _, Problem, Problems};
use crate::suggest;

impl Problems {
    /// Returns the error of the first problem that an override caused.
    pub(super) fn define_error(&self, defines: &Defines) -> Option<SceneError> {
        let problem = self.iter().find(|problem| defines.has_set(&problem.key))?;
        Some(SceneError::Override(problem.clone().at("define")))
    }
}

/// Overrides that are applied while a file is parsed. The paths of the overrides are recorded, so that errors can be
/// attributed to overrides.
pub(super) struct Defines<'a> {
    overrides: &'a [Define],
    /// Overrides that were applied or have failed.
    applied: Vec<AppliedDefine>,
}

struct AppliedDefine {
    /// Index of the override.
    index: usize,
    /// The key, with indices for list elements.
    path: Vec<Segment>,
    /// Path length of the outermost table or value that was created or replaced.
    replaced_len: usize,
}

impl<'a> Defines<'a> {
    pub fn new(overrides: &'a [Define]) -> Defines<'a> {
        Defines {
            overrides,
            applied: Vec::new(),
        }
    }

    /// Returns these overrides, none of which is recorded as applied.
    pub fn restarted(&self) -> Defines<'a> {
        Defines::new(self.overrides)
    }

    /// Forgets which overrides were applied.
    pub fn restart(&mut self) {
        self.applied.clear();
    }

    /// Returns true if an override set the value of this key, or of a table that contains the key.
    pub fn has_set(&self, key: &KeyPath) -> bool {
        let key = key.0.as_slice();
        self.applied.iter().any(|define| {
            let replaced = define.path.get(..define.replaced_len);
            let is_replaced = replaced.is_some_and(|replaced| key.starts_with(replaced));
            let rest = define.path.strip_prefix(key);
            is_replaced || rest.is_some_and(|rest| rest.iter().all(|segment| matches!(segment, Segment::Index(_))))
        })
    }

    /// Applies the overrides of the table at this path. With an empty path, applies all overrides whose first key is
    /// not excluded.
    pub fn apply(
        &mut self,
        table_path: &[Segment],
        table: &mut Table,
        is_excluded: impl Fn(&str) -> bool,
    ) -> Result<(), Problem> {
        let depth = table_path.len();
        let belongs = |define: &Define| match (define.key.0.first(), table_path) {
            (Some(Segment::Key(first)), []) => !is_excluded(first),
            (_, []) => true,
            _ => {
                let mut pairs = define.key.0.iter().zip(table_path);
                define.key.0.len() >= depth && pairs.all(|(written, segment)| matches_segment(written, segment))
            }
        };
        let (overrides, mut value) = (self.overrides, Value::Table(std::mem::take(table)));
        for (index, define) in overrides.iter().enumerate().filter(|(_, define)| belongs(define)) {
            let mut path = table_path.to_vec();
            let result = set_value(&mut value, &mut path, &define.key.0[depth..], &define.value);
            let replaced_len = match &result {
                Ok(replaced_len) => *replaced_len,
                Err(_) => path.len(),
            };
            let key = KeyPath(path.clone());
            self.applied.push(AppliedDefine {
                index,
                path,
                replaced_len,
            });
            result.map_err(|message| problem_at(&key, message))?;
        }
        match value {
            Value::Table(new_table) => *table = new_table,
            other => {
                let message = format!("{} must be a table", cut(&other.to_string()));
                return Err(problem_at(&KeyPath(table_path.to_vec()), message));
            }
        }
        Ok(())
    }

    /// Returns the problem of an override whose key does not exist.
    pub fn missing_key(&mut self, key: &KeyPath) -> Problem {
        self.applied.push(AppliedDefine {
            index: self.overrides.len(),
            path: key.0.clone(),
            replaced_len: key.0.len(),
        });
        problem_at(key, "does not exist".to_owned())
    }

    /// Returns the key of an override that was not applied to any table.
    pub fn unapplied(&self) -> Option<&'a KeyPath> {
        let is_applied = |index: usize| self.applied.iter().any(|define| define.index == index);
        let mut unapplied = self
            .overrides
            .iter()
            .enumerate()
            .filter(|(index, _)| !is_applied(*index));
        unapplied.next().map(|(_, define)| &define.key)
    }
}

/// Returns true if the path leads to a sample count, which may be written as a plain number instead of a table.
fn is_samples(path: &[Segment]) -> bool {
    let names = ["pixel_samples", "light_samples"];
    matches!(path, [Segment::Key(section), Segment::Key(key)] if section == "render" && names.contains(&key.as_str()))
}

/// Sets a value in a tree of tables and lists. Creates missing tables, except named textures, materials and meshes.
/// Appends the path of the value or failure to `path`. Returns the path length of the outermost table that was created,
/// or of the value if no table was created.
fn set_value(root: &mut Value, path: &mut Vec<Segment>, key: &[Segment], new_value: &Value) -> Result<usize, String> {
    let mut replaced_len = None;
    let mut value = root;
    for (i, segment) in key.iter().enumerate() {
        let is_last = i + 1 == key.len();
        let is_named = matches!(path.as_slice(), [Segment::Key(kind)] if ["textures", "materials", "meshes"].contains(&kind.as_str()));
        if let (Value::Integer(count), true) = (&*value, is_samples(path)) {
            *value = Value::Table(Table::from_iter([("count".to_owned(), Value::from(*count))]));
        }
        let kind = kind_of(value);
        let next = match (value, segment) {
            (Value::Table(table), Segment::Key(name)) => {
                path.push(segment.clone());
                if !table.contains_key(name) {
                    if is_named && !is_last {
                        return Err(match table.is_empty() {
                            true => "does not exist; the scene has none".to_owned(),
                            false => match suggest::hint(name, table.keys().map(String::as_str)) {
                                hint if hint.is_empty() => {
                                    format!("does not exist; the scene has {}", list(table.keys()))
                                }
                                hint => format!("does not exist{hint}"),
                            },
                        });
                    }
                    if let Some(Segment::Index(_)) = key.get(i + 1) {
                        return Err("does not exist, so it has no elements".to_owned());
                    }
                    replaced_len.get_or_insert(path.len());
                    table.insert(name.clone(), Value::Table(Table::new()));
                }
                table.get_mut(name)
            }
            (Value::Array(list), segment) => {
                let index = match segment {
                    Segment::Index(index) => Some(*index),
                    Segment::Key(name) => parse_index(name),
                };
                let Some(index) = index else {
                    return Err("is a list; add the index of an element, such as [0]".to_owned());
                };
                path.push(Segment::Index(index));
                let count = list.len();
                match list.get_mut(index) {
                    None => {
                        return Err(format!(
                            "does not exist; the length of the list is {count}, and indices start at 0"
                        ));
                    }
                    element => element,
                }
            }
            _ => {
                return Err(format!(
                    "is {kind} and has no {segment}",
                    segment = KeyPath(vec![segment.clone()])
                ));
            }
        };
        match next {
            Some(next) => value = next,
            None => return Err("does not exist".to_owned()),
        }
    }
    *value = new_value.clone();
    Ok(replaced_len.unwrap_or(path.len()))
}

fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Table(_) => "a table",
        Value::Array(_) => "a list",
        Value::String(_) => "a string",
        Value::Integer(_) | Value::Float(_) => "a number",
        Value::Boolean(_) => "a boolean",
        Value::Datetime(_) => "a date or time",
    }
}
