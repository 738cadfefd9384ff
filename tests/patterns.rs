//! All sample patterns that a scene file can name, read from the source so that a new pattern is tested automatically.

use serde::Deserialize as _;
use serde::de::IntoDeserializer;
use serde::de::value::{Error, StrDeserializer};
use wgray::scene::{Pattern, SamplesDescription};

use crate::sources;

/// Returns all patterns with their names in scene files.
pub fn all() -> Vec<(String, Pattern)> {
    let file = sources::rust("crates/scene/src/description/render.rs");
    let names = file.items.iter().find_map(|item| match item {
        syn::Item::Enum(e) if e.ident == "Pattern" => Some(e.variants.iter().map(|v| snake_case(&v.ident.to_string()))),
        _ => None,
    });
    let pattern = |name: String| {
        let deserializer: StrDeserializer<Error> = name.as_str().into_deserializer();
        let pattern = Pattern::deserialize(deserializer).unwrap_or_else(|error| panic!("{name}: {error}"));
        (name, pattern)
    };
    let all: Vec<_> = names.expect("the patterns").map(pattern).collect();
    assert!(all.len() >= 2, "the patterns were not found");
    all
}

fn snake_case(name: &str) -> String {
    let mut result = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !result.is_empty() {
            result.push('_');
        }
        result.extend(c.to_lowercase());
    }
    result
}

/// Returns samples of a pattern: the largest permitted count up to `count`.
pub fn samples(pattern: Pattern, count: u32) -> SamplesDescription {
    let side = count.isqrt();
    SamplesDescription {
        pattern: Some(pattern),
        count: if pattern.needs_square() { side * side } else { count },
    }
}
