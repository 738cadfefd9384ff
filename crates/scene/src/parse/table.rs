//! Parses the values of tables; reports all errors of a table at once.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::Integrator;
use crate::description::tagged::Tagged;
use crate::key_path::{KeyPath, Segment, cut, list, listed};
use crate::limits::{BLADES, MAX_COUNT, MAX_DEPTH, UV_SETS};
use crate::problem::{At, Problem, Problems};
use crate::suggest;
use crate::tree::{self, Fault, ReadError};

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
    read_keys(table, false, integrator, |table| tree::read(Value::Table(table)))
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

/// Converts serde's error about `table`. If `is_tagged` is true, the key `type` of the table was removed.
fn explain(error: ReadError, table: &Table, is_tagged: bool, integrator: Integrator) -> Problem {
    let ReadError {
        key: KeyPath(mut path),
        fault,
    } = error;
    let value = find(table, &path);
    let is_unknown_key = matches!(fault, Fault::UnknownKey(_));
    let message = match (fault, value) {
        (Fault::UnknownKey(keys), _) => {
            let type_key = (is_tagged && path.len() == 1).then_some("type");
            let keys = || type_key.into_iter().chain(keys.iter().copied());
            let hint = match path.last() {
                Some(Segment::Key(unknown)) => suggest::hint(unknown, keys()),
                _ => String::new(),
            };
            match hint.is_empty() {
                true => format!("unknown key; expected one of {}", listed(keys(), MAX_KEYS)),
                false => format!("unknown key{hint}"),
            }
        }
        (Fault::MissingKey(key), _) => {
            if path.is_empty() && ["image", "camera"].contains(&key) {
                return Problem::new(format!("the scene has no [{key}] table"));
            }
            path.push(Segment::from(key));
            let mut problem = Problem::predicate("is missing");
            problem.key = KeyPath(path);
            return problem;
        }
        (Fault::Mismatch { expected, .. }, Some(value)) => {
            let rule = match &*expected {
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
                other => other,
            };
            format!("{} must be {rule}", show(value))
        }
        (Fault::Other(message), Some(value)) if message.starts_with("must be") => format!("{} {message}", show(value)),
        (Fault::Other(message), _) => message,
        (fault @ Fault::Mismatch { .. }, None) => ReadError::from(fault).to_string(),
    };
    Problem {
        key: KeyPath(path),
        is_unknown_key,
        ..Problem::new(message)
    }
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
