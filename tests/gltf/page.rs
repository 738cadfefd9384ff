//! Each feature in `docs/gltf.md` has an existing test in `docs/decisions/gltf-import.md`, and each known extension has a
//! row.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn quoted(line: &str) -> Vec<&str> {
    line.split('`').skip(1).step_by(2).collect()
}

/// Returns the first cells of the tables after a heading.
fn first_cells<'a>(page: &'a str, heading: &str) -> BTreeSet<&'a str> {
    let section = page.split(heading).nth(1).unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| "));
    rows.map(|row| row.split(" | ").next().unwrap()).collect()
}

#[test]
fn every_feature_has_a_row_of_tests() {
    let (page, tests) = (read("docs/gltf.md"), read("docs/decisions/gltf-import.md"));
    assert_eq!(
        first_cells(&page, "\n## Supported features\n"),
        first_cells(&tests, "\n## Tests\n")
    );
}

#[test]
fn every_row_names_an_existing_test() {
    let page = read("docs/decisions/gltf-import.md");
    let rows = page
        .lines()
        .filter(|line| line.starts_with("| ") && line.contains(".rs`"));
    let mut count = 0;
    for row in rows {
        let cell = row.trim_end_matches(" |").rsplit(" | ").next().unwrap();
        let mut file = None;
        for name in quoted(cell) {
            if name.ends_with(".rs") {
                file = Some(read(name));
            } else {
                let text = file.as_ref().unwrap_or_else(|| panic!("no file name precedes {name}"));
                assert!(text.contains(&format!("#[test]\nfn {name}()")), "{name}");
                count += 1;
            }
        }
    }
    assert!(count > 40, "{count}");
}

#[test]
fn every_known_extension_has_a_row() {
    let source = read("crates/scene/src/gltf/extension.rs");
    let list = source
        .split("KNOWN: &[&str] = &[")
        .nth(1)
        .unwrap()
        .split("];")
        .next()
        .unwrap();
    let supported: BTreeSet<&str> = list.split('"').skip(1).step_by(2).collect();
    let page = read("docs/gltf.md");
    let table = page
        .split("## Extensions")
        .nth(1)
        .unwrap()
        .split("\n## ")
        .next()
        .unwrap();
    let rows = table.lines().filter(|line| line.starts_with("| `"));
    let documented: BTreeSet<&str> = rows.flat_map(|row| quoted(row.split(" | ").next().unwrap())).collect();
    assert_eq!(supported, documented);
}
