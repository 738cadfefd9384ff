//! Random mutation of JSON, for tests and fuzz targets.

use serde_json::{Value, json};

fn collect_pointers(value: &Value, pointer: &mut String, pointers: &mut Vec<String>) {
    pointers.push(pointer.clone());
    let length = pointer.len();
    let mut visit = |key: &str, value: &Value| {
        pointer.push('/');
        pointer.push_str(key);
        collect_pointers(value, pointer, pointers);
        pointer.truncate(length);
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| visit(key, value)),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .for_each(|(i, value)| visit(&i.to_string(), value)),
        _ => {}
    }
}

/// Replaces a random value, removes a key of an object, or removes or repeats the last element of a list. `below(n)`
/// returns a random number less than `n`.
pub fn changed(json: &mut Value, below: &mut dyn FnMut(usize) -> usize) {
    let mut pointers = Vec::new();
    collect_pointers(json, &mut String::new(), &mut pointers);
    let replacement = json.pointer(&pointers[below(pointers.len())]).cloned();
    let pointer = &pointers[1 + below(pointers.len() - 1)];
    let (outer, key) = pointer.rsplit_once('/').unwrap_or_default();
    let values = [
        json!(0),
        json!(1),
        json!(2),
        json!(3),
        json!(-1),
        json!(7),
        json!(1000),
        json!(u32::MAX),
        json!(1u64 << 32),
        json!(u64::MAX),
        json!(0.5),
        json!(-0.25),
        json!(3e38),
        json!(-3e38),
        json!(1e-45),
        json!(1e39),
        json!(4_194_304),
        json!(5126),
        json!(5121),
        json!(5123),
        json!(5125),
        json!(null),
        json!(true),
        json!(""),
        json!("x"),
        json!("SCALAR"),
        json!("VEC4"),
        json!([]),
        json!({}),
        json!([0]),
        json!([1e38, 1e38, 1e38]),
        json!([0, 0, 0]),
        json!([0, 0, 0, 0]),
    ];
    let choice = below(10);
    if choice < 2 {
        match json.pointer_mut(outer) {
            Some(Value::Object(map)) => drop(map.remove(key)),
            Some(Value::Array(list)) if choice == 0 => drop(list.pop()),
            Some(Value::Array(list)) => list.extend(list.last().cloned()),
            _ => {}
        }
    } else if let Some(value) = json.pointer_mut(pointer) {
        *value = match (choice, replacement) {
            (2, Some(replacement)) => replacement,
            // A number is usually replaced by a number: the first 21 elements of `values`.
            (3..7, _) if value.is_number() => values[below(21)].clone(),
            _ => values[below(values.len())].clone(),
        };
    }
}
