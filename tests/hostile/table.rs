//! Each limit in `docs/reliability.md` has a message and a test.

use std::fs;
use std::path::Path;

use crate::sources::path as project;

fn append_sources(folder: &Path, source: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => append_sources(&path, source),
            false if path.extension().is_some_and(|extension| extension == "rs") => {
                // Joins continued lines of strings.
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
    let docs = fs::read_to_string(project("docs/reliability.md")).unwrap();
    let section = docs.split("## Untrusted files").nth(1).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let mut sources = [String::new(), String::new()];
    for folder in ["src", "crates"] {
        sources
            .iter_mut()
            .for_each(|source| append_sources(&project(folder), source));
    }
    append_sources(&project("tests"), &mut sources[1]);
    let code = |cell: &str| cell.trim().trim_matches('`').to_owned();
    let mut count = 0;
    for row in section.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        let [resource, _, message, test] = cells[..] else {
            continue;
        };
        if !test.contains('`') {
            continue; // the header
        }
        count += 1;
        let message = message.trim();
        assert!(
            !message.starts_with('`') || sources[0].contains(&code(message)),
            "{resource}: {message}"
        );
        assert!(
            sources[1].contains(&format!("fn {}()", code(test))),
            "{resource}: {test}"
        );
    }
    assert!(count >= 20, "{count}");
}
