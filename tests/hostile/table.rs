//! Each limit in `docs/reliability.md` has a message and a test.

use std::fs;
use std::path::Path;

use crate::sources::path as project_path;

fn append_sources(folder: &Path, source: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => append_sources(&path, source),
            false if path.extension().is_some_and(|extension| extension == "rs") => {
                // Joins the lines of string literals that continue after a backslash.
                let text = fs::read_to_string(&path).unwrap();
                let lines = text.split("\\\n").map(str::trim_start);
                source.push_str(&lines.collect::<String>());
            }
            false => {}
        }
    }
}

#[test]
fn every_limit_in_the_table_has_a_message_and_a_test() {
    let docs = fs::read_to_string(project_path("docs/reliability.md")).unwrap();
    let section = docs.split("## Untrusted files").nth(1).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let mut program_sources = String::new();
    for folder in ["src", "crates"] {
        append_sources(&project_path(folder), &mut program_sources);
    }
    let mut all_sources = program_sources.clone();
    append_sources(&project_path("tests"), &mut all_sources);
    let unquoted = |cell: &str| cell.trim().trim_matches('`').to_owned();
    let mut count = 0;
    for row in section.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        let [resource, _, message, test] = cells[..] else {
            continue;
        };
        if !test.contains('`') {
            continue; // the header row
        }
        count += 1;
        let message = message.trim();
        assert!(
            !message.starts_with('`') || program_sources.contains(&unquoted(message)),
            "{resource}: {message}"
        );
        assert!(
            all_sources.contains(&format!("fn {}()", unquoted(test))),
            "{resource}: {test}"
        );
    }
    assert!(count >= 20, "{count}");
}
