//! The mutations of `scripts/mutation/twins.toml` are applicable: every text that a mutation replaces occurs in the
//! shader or twin.

use std::fs;

use crate::sources;

/// Returns the code of a file before its tests, without comments, with single spaces.
fn code(text: &str) -> String {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    words(&lines.collect::<Vec<_>>().join("\n"))
}

fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the missing texts, and the number of all texts.
fn missing(table: &toml::Table, read: impl Fn(&str) -> String) -> (Vec<String>, usize) {
    let (mut missing, mut count) = (Vec::new(), 0);
    for (file, mutations) in table {
        let sources = ["wgsl", "rust"].map(|language| (language, code(&read(&format!("{file}.{language}")))));
        for mutation in mutations.as_array().unwrap() {
            for (language, source) in &sources {
                let replacement = mutation.get(language).or_else(|| mutation.get("both")).unwrap();
                let text = replacement[0].as_str().unwrap();
                count += 1;
                if !source.contains(&words(text)) {
                    missing.push(format!("{file}.{language}: {text}"));
                }
            }
        }
    }
    (missing, count)
}

#[test]
fn every_mutation_is_applicable() {
    let table = fs::read_to_string(sources::path("scripts/mutation/twins.toml")).unwrap();
    let read = |name: &str| {
        let path = match name.strip_suffix(".rust") {
            Some(twin) => format!("crates/trace/src/cpu/{twin}.rs"),
            None => format!("shaders/{name}"),
        };
        fs::read_to_string(sources::path(&path)).unwrap()
    };
    let (missing, count) = missing(&table.parse().unwrap(), read);
    assert!(
        missing.is_empty(),
        "texts that a mutation replaces, but that are not in the source:\n{}",
        missing.join("\n")
    );
    assert!(count > 100, "{count}");
}

#[test]
fn a_missing_text_is_detected() {
    let table = "[[a]]\nboth = ['x + y', 'x - y']\n[[a]]\nwgsl = ['p', 'q']\nrust = ['r', 's']"
        .parse()
        .unwrap();
    let result = missing(&table, |name| match name {
        "a.wgsl" => "x +\n    y // p\np".to_owned(),
        _ => "x * y // x + y\nr #[cfg(test)] x + y".to_owned(),
    });
    assert_eq!(result, (vec!["a.rust: x + y".to_owned()], 4));
}
