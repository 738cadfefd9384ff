//! Applies the overrides of a scene file to its tables.

use toml::{Table, Value};

use crate::define::{Define, about, index, is_step};
use crate::error::SceneError;
use crate::key_path::{KeyPath, Segment, cut, list};
use crate::problem::{At as _, Problem, Problems};
use crate::suggest;

impl Problems {
    /// Returns the error of the first problem that an override caused.
    pub(super) fn of_define(&self, defines: &Defines) -> Option<SceneError> {
        let problem = self.iter().find(|problem| defines.has_set(&problem.key))?;
        Some(SceneError::Override(problem.clone().at("define")))
    }
}

/// Overrides that are applied while a file is parsed. Their paths are recorded, so that errors can be attributed to
/// them.
pub(super) struct Defines<'a> {
    given: &'a [Define],
    /// Overrides that were applied or have failed.
    put: Vec<Put>,
}

struct Put {
    number: usize,
    /// The key, with indices for list elements.
    path: Vec<Segment>,
    /// Path length of the outermost table or value that was created or replaced.
    own: usize,
}

impl<'a> Defines<'a> {
    pub fn new(given: &'a [Define]) -> Defines<'a> {
        Defines { given, put: Vec::new() }
    }

    pub fn restarted(&self) -> Defines<'a> {
        Defines::new(self.given)
    }

    pub fn restart(&mut self) {
        self.put.clear();
    }

    /// Returns true if an override set the value of this key, or of a table that contains it.
    pub fn has_set(&self, key: &KeyPath) -> bool {
        let key = key.0.as_slice();
        self.put.iter().any(|put| {
            let is_below = put.path.get(..put.own).is_some_and(|own| key.starts_with(own));
            let rest = put.path.strip_prefix(key);
            is_below || rest.is_some_and(|rest| rest.iter().all(|step| matches!(step, Segment::Index(_))))
        })
    }

    /// Applies the overrides of the table at this path; with an empty path, the overrides for which `is_elsewhere` is
    /// false.
    pub fn put(
        &mut self,
        at: &[Segment],
        whole: &mut Table,
        is_elsewhere: impl Fn(&str) -> bool,
    ) -> Result<(), Problem> {
        let belongs = |define: &Define| match (define.key.0.first(), at) {
            (Some(Segment::Key(first)), []) => !is_elsewhere(first),
            (_, []) => true,
            _ => define.key.0.len() >= at.len() && define.key.0.iter().zip(at).all(|(a, b)| is_step(a, b)),
        };
        let (given, mut value) = (self.given, Value::Table(std::mem::take(whole)));
        for (number, define) in given.iter().enumerate().filter(|(_, define)| belongs(define)) {
            let mut path = at.to_vec();
            let put = put(&mut value, &mut path, &define.key.0[at.len()..], &define.value);
            let own = match &put {
                Ok(own) => *own,
                Err(_) => path.len(),
            };
            let key = KeyPath(path.clone());
            self.put.push(Put { number, path, own });
            put.map_err(|message| about(&key, message))?;
        }
        match value {
            Value::Table(table) => *whole = table,
            other => {
                let message = format!("{} must be a table", cut(&other.to_string()));
                return Err(about(&KeyPath(at.to_vec()), message));
            }
        }
        Ok(())
    }

    pub fn not_there(&mut self, key: &KeyPath) -> Problem {
        self.put.push(Put {
            number: self.given.len(),
            path: key.0.clone(),
            own: key.0.len(),
        });
        about(key, "does not exist".to_owned())
    }

    /// Returns a key that was not applied to any table.
    pub fn left(&self) -> Option<&'a KeyPath> {
        let is_put = |number: usize| self.put.iter().any(|put| put.number == number);
        let mut left = self.given.iter().enumerate().filter(|(number, _)| !is_put(*number));
        left.next().map(|(_, define)| &define.key)
    }
}

/// Returns true if the path leads to a sample count, which may be written as a plain number instead of a table.
fn is_samples(path: &[Segment]) -> bool {
    let names = ["pixel_samples", "light_samples"];
    matches!(path, [Segment::Key(section), Segment::Key(key)] if section == "render" && names.contains(&key.as_str()))
}

/// Sets a value in a tree of tables and lists. Creates missing tables, except named textures, materials and meshes.
/// Appends the path of the value or failure to `path`. Returns the path length of the outermost table that was created,
/// or of the value if none was.
fn put(root: &mut Value, path: &mut Vec<Segment>, key: &[Segment], new: &Value) -> Result<usize, String> {
    let mut own = None;
    let mut value = root;
    for (i, step) in key.iter().enumerate() {
        let is_last = i + 1 == key.len();
        let is_named = matches!(path.as_slice(), [Segment::Key(kind)] if ["textures", "materials", "meshes"].contains(&kind.as_str()));
        if let (Value::Integer(count), true) = (&*value, is_samples(path)) {
            *value = Value::Table(Table::from_iter([("count".to_owned(), Value::from(*count))]));
        }
        let kind = kind_of(value);
        let next = match (value, step) {
            (Value::Table(table), Segment::Key(name)) => {
                path.push(step.clone());
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
                    own.get_or_insert(path.len());
                    table.insert(name.clone(), Value::Table(Table::new()));
                }
                table.get_mut(name)
            }
            (Value::Array(list), step) => {
                let number = match step {
                    Segment::Index(number) => Some(*number),
                    Segment::Key(name) => index(name),
                };
                let Some(number) = number else {
                    return Err("is a list; add the index of an element, such as [0]".to_owned());
                };
                path.push(Segment::Index(number));
                let count = list.len();
                match list.get_mut(number) {
                    None => return Err(format!("does not exist; the list has {count} elements, counted from 0")),
                    found => found,
                }
            }
            _ => {
                return Err(format!(
                    "is {kind} and has no {step}",
                    step = KeyPath(vec![step.clone()])
                ));
            }
        };
        match next {
            Some(next) => value = next,
            None => return Err("does not exist".to_owned()),
        }
    }
    *value = new.clone();
    Ok(own.unwrap_or(path.len()))
}

fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Table(_) => "a table",
        Value::Array(_) => "a list",
        Value::String(_) => "a text",
        Value::Integer(_) | Value::Float(_) => "a number",
        Value::Boolean(_) => "true or false",
        Value::Datetime(_) => "a time",
    }
}
