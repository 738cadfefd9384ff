//! Parses the values of tables; reports all errors of a table at once.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::Integrator;
use crate::description::tables::{self, ReadError};
use crate::description::tagged::Tagged;
use crate::key_path::{KeyPath, Segment, cut, list, listed};
use crate::limits::{BLADES, MAX_COUNT, MAX_DEPTH, UV_SETS};
use crate::problem::{At, Problem, Problems};
use crate::suggest;

pub(super) type Read<T> = Result<T, Problems>;

pub(super) fn tagged<T: Tagged>(table: Table) -> Read<T> {
    read_tagged(table, None)
}

pub(super) fn read<T: DeserializeOwned>(table: Table) -> Read<T> {
    let is_named = |integrator: &Integrator| table.get("integrator").and_then(Value::as_str) == Some(integrator.name());
    let integrator = Integrator::ALL.into_iter().find(is_named);
    read_for(table, integrator.unwrap_or(Integrator::Phong))
}

/// Parses a table. The ranges in messages depend on the integrator.
pub fn read_for<T: DeserializeOwned>(table: Table, integrator: Integrator) -> Read<T> {
    read_keys(table, false, integrator, tables::read)
}

pub(super) fn read_tagged<T: Tagged>(mut table: Table, default: Option<&str>) -> Read<T> {
    let tag = match (table.remove("type"), default) {
        (Some(tag), _) => tag,
        (None, Some(default)) => Value::from(default),
        (None, None) => {
            let message = format!("is missing; it must be one of {}", list(T::TYPES));
            return Err(Problem::predicate(message).at("type").into());
        }
    };
    match tag.as_str().filter(|tag| T::TYPES.contains(tag)) {
        Some(tag) => read_keys(table, true, Integrator::Phong, |body| {
            T::read(tag, body).expect("a type of the list can be read")
        }),
        None => {
            let hint = tag.as_str().map(|tag| suggest::hint(tag, T::TYPES.iter().copied()));
            let hint = hint.unwrap_or_default();
            let message = format!("{} must be one of {}{hint}", show(&tag), list(T::TYPES));
            Err(Problem::new(message).at("type").into())
        }
    }
}

/// Parses a table. If `is_tagged` is true, the key `type` of the table was removed. serde stops at the first error, so
/// the invalid value is removed and the table is parsed again.
fn read_keys<T>(
    mut table: Table,
    is_tagged: bool,
    integrator: Integrator,
    read: impl Fn(Table) -> Result<T, ReadError>,
) -> Read<T> {
    let mut problems: Option<Problems> = None;
    loop {
        let error = match (read(table.clone()), problems) {
            (Ok(value), None) => return Ok(value),
            (Ok(_), Some(found)) => return Err(found),
            (Err(error), found) => {
                problems = found;
                error
            }
        };
        let error = list_names(error, &table, |table| read(table).err());
        let problem = explain(error, &table, is_tagged, integrator);
        let path = problem.key.0.clone();
        let is_missing = find(&table, &path).is_none();
        let is_removed = !is_missing && remove(&mut table, &path) || remove(&mut table, &path[..path.len().min(1)]);
        let found = match problems {
            Some(found) if is_missing && found.iter().any(|problem| explains_missing(&problem.key.0, &path)) => found,
            Some(mut found) => {
                found.add(problem);
                found
            }
            None => problem.into(),
        };
        if !is_removed || found.is_full() {
            return Err(found);
        }
        problems = Some(found);
    }
}

/// Returns true if a key may be missing because of the error at a different key: the value was removed, or the name is
/// misspelled.
fn explains_missing(error_path: &[Segment], missing: &[Segment]) -> bool {
    let table = &missing[..missing.len().saturating_sub(1)];
    error_path.starts_with(missing) || error_path.split_last().is_some_and(|(_, parent)| parent == table)
}

fn find<'a>(table: &'a Table, path: &[Segment]) -> Option<&'a Value> {
    let (Segment::Key(key), path) = path.split_first()? else {
        return None;
    };
    path.iter().try_fold(table.get(key)?, |value, segment| match segment {
        Segment::Key(key) => value.get(key),
        Segment::Index(index) => value.get(*index),
    })
}

pub(super) fn remove(table: &mut Table, path: &[Segment]) -> bool {
    let Some((Segment::Key(key), path)) = path.split_last() else {
        return false;
    };
    let Some((Segment::Key(first), path)) = path.split_first() else {
        return table.remove(key).is_some();
    };
    let inner = path.iter().fold(table.get_mut(first), |value, segment| match segment {
        Segment::Key(key) => value?.get_mut(key),
        Segment::Index(index) => value?.get_mut(*index),
    });
    let inner = inner.and_then(Value::as_table_mut);
    inner.is_some_and(|inner| inner.remove(key).is_some())
}

/// Maximum number of keys in a message; no table has more keys.
const MAX_KEYS: usize = 64;

/// Formats a value as TOML on one line, truncated if the text is long.
fn show(value: &Value) -> String {
    cut(&value.to_string().replace('\n', " ")).into_owned()
}

/// Adds the allowed names to an error. serde lists names only if the value is a string, so the value is replaced by a
/// string.
fn list_names(error: ReadError, table: &Table, read: impl Fn(Table) -> Option<ReadError>) -> ReadError {
    if !error.inner().message().ends_with(NAMES_EXPECTED) {
        return error;
    }
    let mut with_text = Value::Table(table.clone());
    let mut value = Some(&mut with_text);
    for segment in segments(error.path()) {
        value = match segment {
            Segment::Key(key) => value.and_then(|value| value.get_mut(key)),
            Segment::Index(index) => value.and_then(|value| value.get_mut(index)),
        };
    }
    if let Some(value) = value {
        *value = Value::from("?");
    }
    let listing = match with_text {
        Value::Table(table) => read(table),
        _ => None,
    };
    let has_same_path = |listing: &ReadError| listing.path().to_string() == error.path().to_string();
    listing.filter(has_same_path).unwrap_or(error)
}

/// End of serde's message about a value that must name a variant.
const NAMES_EXPECTED: &str = ", expected string only";

/// Converts serde's error about `table`. If `is_tagged` is true, the key `type` of the table was removed.
fn explain(error: ReadError, table: &Table, is_tagged: bool, integrator: Integrator) -> Problem {
    let mut path = segments(error.path());
    let value = find(table, &path);
    let message = error.inner().message();
    // serde provides the name and the rule only as text.
    let quoted = |text: &str| {
        text.split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let is_unknown_key = message.starts_with("unknown field");
    let message = if is_unknown_key {
        // The first quoted name is the unknown key.
        let names = quoted(message).into_iter().skip(1);
        let type_key = (is_tagged && path.len() == 1).then(|| "type".to_owned());
        let names: Vec<String> = type_key.into_iter().chain(names).collect();
        let hint = match path.last() {
            Some(Segment::Key(unknown)) => suggest::hint(unknown, names.iter().map(String::as_str)),
            _ => String::new(),
        };
        match hint.is_empty() {
            true => format!("unknown key; expected one of {}", listed(names, MAX_KEYS)),
            false => format!("unknown key{hint}"),
        }
    } else if message.starts_with("missing field") {
        let name = quoted(message).into_iter().next().unwrap_or_default();
        if path.is_empty() && ["image", "camera"].contains(&name.as_str()) {
            return Problem::new(format!("the scene has no [{name}] table"));
        }
        path.push(Segment::Key(name));
        let mut problem = Problem::predicate("is missing");
        problem.key = KeyPath(path);
        return problem;
    } else if let (Some((_, expected)), Some(value)) = (message.rsplit_once(", expected "), value) {
        let rule = match expected {
            "f64" => "a number",
            "a boolean" => "true or false",
            "u32" => &integer_rule(path.last(), integrator),
            "a sequence of 3 f64 values" => "a list of 3 numbers",
            "an array of length 2" => "a list of 2 numbers",
            "an array of length 3" => "a list of 3 points",
            "an array of length 4"
                if ["matrix", "factor"]
                    .iter()
                    .any(|key| path.contains(&Segment::from(*key))) =>
            {
                "a list of 4 numbers"
            }
            "an array of length 4" => "a list of 4 points",
            "fewer elements in array" => "a list with fewer elements",
            "a map" => "a table",
            table if table.starts_with("struct ") => "a table",
            "a sequence" => "a list of tables, each under its own [[header]]",
            other => &other.replace('`', "\""),
        };
        format!("{} must be {rule}", show(value))
    } else if let (true, Some(value)) = (message.starts_with("must be"), value) {
        format!("{} {message}", show(value))
    } else {
        message.to_owned()
    };
    Problem {
        key: KeyPath(path),
        is_unknown_key,
        ..Problem::new(message)
    }
}

pub fn segments(path: &serde_path_to_error::Path) -> Vec<Segment> {
    use serde_path_to_error::Segment as PathSegment;
    let segments = path.iter().filter_map(|segment| match segment {
        PathSegment::Map { key } => Some(Segment::Key(key.clone())),
        PathSegment::Seq { index } => Some(Segment::Index(*index)),
        PathSegment::Enum { .. } | PathSegment::Unknown => None,
    });
    segments.collect()
}

/// Returns the rule for an integer key, without limits that depend on other keys.
fn integer_rule(key: Option<&Segment>, integrator: Integrator) -> String {
    if key == Some(&Segment::from("blades")) {
        return format!("0 or a whole number from {} to {}", BLADES.0, BLADES.1);
    }
    let (low, high) = match key {
        Some(Segment::Key(key)) if key == "seed" => (0, u32::MAX),
        Some(Segment::Key(key)) if key == "uv_set" => (0, UV_SETS - 1),
        Some(Segment::Key(key)) if key == "max_depth" => integrator.depths(),
        Some(Segment::Key(key)) if key == "rr_depth" => (0, MAX_DEPTH),
        _ => (1, MAX_COUNT),
    };
    format!("a whole number from {low} to {high}")
}
