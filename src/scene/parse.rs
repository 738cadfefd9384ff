//! From the text of a scene file to its [`Description`], and from a key path to its line.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use super::description::{Description, ReadError, Tagged};
use super::error::{At, KeyPath, Problem, SceneError, Segment};

impl Description {
    /// Reads the text of a scene file; `origin` is the file's name in messages. Values are not checked yet.
    ///
    /// # Errors
    ///
    /// Text that is no TOML, unknown and missing keys, unknown types, and values of the wrong type.
    pub fn parse(text: &str, origin: &str) -> Result<Self, SceneError> {
        let table = toml::from_str(text).map_err(|error: toml::de::Error| {
            let start = error.span().map_or(0, |span| span.start);
            syntax_error(text, origin, start, error.message())
        })?;
        read_file(table).map_err(|problem| invalid(text, origin, problem))
    }
}

/// The error of a text that goes wrong at the byte `at`.
pub(super) fn syntax_error(text: &str, origin: &str, at: usize, message: &str) -> SceneError {
    let before = text.get(..at).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    SceneError::Syntax {
        origin: origin.to_owned(),
        line: line_number(text, at),
        column: before[line_start..].chars().count() + 1,
        message: message.to_owned(),
    }
}

/// The error of a text whose value at the problem's path is bad.
pub(super) fn invalid(text: &str, origin: &str, problem: Problem) -> SceneError {
    SceneError::Invalid {
        origin: origin.to_owned(),
        line: locate(text, &problem.key),
        problem,
    }
}

/// The line, from 1, of the key at the end of a path; of its innermost table that is there if it is not.
fn locate(text: &str, path: &KeyPath) -> usize {
    let Ok(document) = DeTable::parse(text) else {
        return 1;
    };
    let mut at = 0;
    let mut value = &DeValue::Table(document.into_inner());
    for segment in &path.0 {
        let step = match (segment, value) {
            (Segment::Key(name), DeValue::Table(table)) => {
                let entry = table.iter().find(|(key, _)| key.get_ref() == name);
                entry.map(|(key, value)| (key.span(), value))
            }
            (Segment::Index(index), DeValue::Array(array)) => array.get(*index).map(|value| (value.span(), value)),
            _ => None,
        };
        let Some((span, inner)) = step else { break };
        at = span.start;
        value = inner.get_ref();
    }
    line_number(text, at)
}

fn line_number(text: &str, at: usize) -> usize {
    let newlines = text.bytes().take(at).filter(|&byte| byte == b'\n');
    1 + newlines.count()
}

/// The sections of a file, before they are looked into.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sections {
    image: Table,
    camera: Table,
    #[serde(default)]
    render: Table,
    #[serde(default)]
    materials: BTreeMap<String, Table>,
    #[serde(default)]
    lights: Vec<Table>,
    #[serde(default)]
    shapes: Vec<Table>,
}

fn read_file(file: Table) -> Result<Description, Problem> {
    let sections: Sections = read(file)?;
    let material = |(name, table): (String, Table)| {
        let material = read_tagged(table, None).at(name.as_str());
        material.map(|material| (name, material))
    };
    Ok(Description {
        image: read(sections.image).at("image")?,
        camera: read_tagged(sections.camera, Some("perspective")).at("camera")?,
        render: read(sections.render).at("render")?,
        materials: (sections.materials.into_iter().map(material))
            .collect::<Result<_, _>>()
            .at("materials")?,
        lights: read_list(sections.lights).at("lights")?,
        shapes: read_list(sections.shapes).at("shapes")?,
    })
}

fn read_list<T: Tagged>(tables: Vec<Table>) -> Result<Vec<T>, Problem> {
    let tables = tables.into_iter().enumerate();
    tables.map(|(i, table)| read_tagged(table, None).at(i)).collect()
}

fn read<T: DeserializeOwned>(table: Table) -> Result<T, Problem> {
    // The copy is for the message: reading consumes the values.
    serde_path_to_error::deserialize(table.clone()).map_err(|error| explain(error, table, false))
}

fn read_tagged<T: Tagged>(mut table: Table, default: Option<&str>) -> Result<T, Problem> {
    let tag = match (table.remove("type"), default) {
        (Some(tag), _) => tag,
        (None, Some(default)) => Value::from(default),
        (None, None) => {
            let message = format!("is missing; it is one of {}", list(T::TYPES));
            return Err(Problem::new(message).at("type"));
        }
    };
    let body = table.clone();
    match tag.as_str().and_then(|tag| T::read(tag, body)) {
        Some(result) => result.map_err(|error| explain(error, table, true)),
        None => {
            let message = format!("{} must be one of {}", show(&tag), list(T::TYPES));
            Err(Problem::new(message).at("type"))
        }
    }
}

/// `"a", "b", "c"`
pub(super) fn list<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let mut text = String::new();
    for name in names {
        let comma = if text.is_empty() { "" } else { ", " };
        // Writing to a String cannot fail.
        let _ = write!(text, "{comma}{:?}", name.as_ref());
    }
    text
}

/// A value as the file has it, on one line, cut short where it is long.
fn show(value: &Value) -> String {
    const LONGEST: usize = 60;
    let text = value.to_string().replace('\n', " ");
    if text.chars().count() <= LONGEST {
        return text;
    }
    let start: String = text.chars().take(LONGEST).collect();
    format!("{start}...")
}

/// Makes a problem of serde's error while reading `table`, which has lost its key `type` if it is `tagged`.
fn explain(error: ReadError, table: Table, tagged: bool) -> Problem {
    let mut path = Vec::new();
    let mut value = Some(&Value::Table(table));
    for segment in error.path() {
        use serde_path_to_error::Segment as Step;
        match segment {
            Step::Map { key } => {
                path.push(Segment::Key(key.clone()));
                value = value.and_then(|value| value.get(key));
            }
            Step::Seq { index } => {
                path.push(Segment::Index(*index));
                value = value.and_then(|value| value.get(*index));
            }
            Step::Enum { .. } | Step::Unknown => {}
        }
    }
    let message = error.inner().message();
    // serde tells the name and the rule in text only.
    let quoted = |text: &str| {
        text.split('`')
            .skip(1)
            .step_by(2)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let message = if message.starts_with("unknown field") {
        let mut names = quoted(message).into_iter();
        path.extend(names.next().map(Segment::Key));
        let tag = (tagged && path.len() == 1).then(|| "type".to_owned());
        format!("unknown key; the keys here are {}", list(tag.into_iter().chain(names)))
    } else if message.starts_with("missing field") {
        path.extend(quoted(message).into_iter().map(Segment::Key));
        "is missing".to_owned()
    } else if let (Some((_, expected)), Some(value)) = (message.split_once(", expected "), value) {
        let rule = match expected {
            "f64" => "a number",
            "u32" => "a whole number from 0 to 4294967295",
            "a sequence of 3 f64 values" => "a list of 3 numbers",
            "an array of length 2" => "a list of 2 numbers",
            "an array of length 3" => "a list of 3 points",
            "an array of length 4" => "a list of 4 points",
            "fewer elements in array" => "a shorter list",
            "a map" => "a table",
            "a sequence" => "a list of tables, each under its own [[header]]",
            other => &other.replace('`', "\""),
        };
        format!("{} must be {rule}", show(value))
    } else {
        message.to_owned()
    };
    Problem {
        key: KeyPath(path),
        message,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CameraDescription, LightDescription, MaterialDescription, Overrides, Scene, ShapeDescription};
    use super::*;

    const PAGE: &str = include_str!("../../docs/scene-format.md");

    /// A text that is one of a scene but for what stands at its end.
    const START: &str = "\
[image]
width = 4
height = 4
[camera]
position = [0, -3, 1]
look_at = [0, 0, 1]
fov = 45
";

    fn message(text: &str) -> String {
        Scene::parse(text, "s.toml", &Overrides::default())
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn bad_text_is_told_with_its_line() {
        Scene::parse(START, "s.toml", &Overrides::default()).unwrap();
        // What is added, the line in it, and what is told.
        for (added, line, told) in [
            (
                "far = 3",
                1,
                "camera.far: unknown key; the keys here are \"type\", \"position\", \"look_at\", \"up\", \"fov\", \"focal_length\"",
            ),
            (
                "[film]\n",
                1,
                "film: unknown key; the keys here are \"image\", \"camera\", \"render\", \"materials\", \"lights\", \"shapes\"",
            ),
            (
                "type = 'fisheye'",
                1,
                "camera.type: \"fisheye\" must be one of \"perspective\", \"orthographic\"",
            ),
            (
                "type = 3",
                1,
                "camera.type: 3 must be one of \"perspective\", \"orthographic\"",
            ),
            ("focal_length = '1'", 1, "camera.focal_length: \"1\" must be a number"),
            ("up = [0, 1]", 1, "camera.up: [0, 1] must be a list of 3 numbers"),
            ("up = [0, 0, 1, 0]", 1, "camera.up: [0, 0, 1, 0] must be a shorter list"),
            ("up = [0, 0, true]", 1, "camera.up[2]: true must be a number"),
            ("up = { z = 1 }", 1, "camera.up: { z = 1 } must be a list of 3 numbers"),
            (
                "[render]\nseed = -1",
                2,
                "render.seed: -1 must be a whole number from 0 to 4294967295",
            ),
            (
                "[render]\nseed = 1.5",
                2,
                "render.seed: 1.5 must be a whole number from 0 to 4294967295",
            ),
            (
                "[render]\nintegrator = 'path'",
                2,
                "render.integrator: \"path\" must be \"phong\"",
            ),
            (
                "[render]\n\npixel_samples = { pattern = 'hex', count = 4 }",
                3,
                "render.pixel_samples.pattern: \"hex\" must be \"grid\" or \"random\"",
            ),
            (
                "[render]\npixel_samples = { pattern = 'grid' }",
                2,
                "render.pixel_samples.count: is missing",
            ),
            (
                "[render.light_samples]\ncount = 4\nn = 2",
                3,
                "render.light_samples.n: unknown key; the keys here are \"pattern\", \"count\"",
            ),
            ("[materials]\nred = 3", 2, "materials.red: 3 must be a table"),
            (
                "[materials.red]\ncolor = [1, 0, 0]",
                1,
                "materials.red.type: is missing; it is one of \"phong\"",
            ),
            (
                "[materials.\"a b\"]\ntype = 'phong'\nshininess = 'x'",
                3,
                "materials.\"a b\".shininess: \"x\" must be a number",
            ),
            (
                "[lights]\ntype = 'point'",
                1,
                "lights: { type = \"point\" } must be a list of tables, each under its own [[header]]",
            ),
            (
                "[[shapes]]\ntype = 'sphere'\nmaterial = 'a'\ncenter = [0, 0, 0]\n",
                1,
                "shapes[0].radius: is missing",
            ),
            (
                "[[shapes]]\n[[shapes]]",
                1,
                "shapes[0].type: is missing; it is one of \"rectangle\", \"ellipsoid\", \"sphere\", \"triangle\", \"tetrahedron\", \"plane\"",
            ),
            (
                "[[lights]]\ntype = 'directional'\ndirection = [0, 0, 1]\ncolor = [1, 1, 1]\n[[lights]]\ntype = 'point'\nvertex = 3",
                7,
                "lights[1].vertex: unknown key; the keys here are \"type\", \"position\", \"color\"",
            ),
            (
                "[[shapes]]\ntype = 'triangle'\nmaterial = 'a'\nvertices = [\n[0, 0, 0],\n[1, 'x', 0],\n[0, 1, 0]]",
                6,
                "shapes[0].vertices[1][1]: \"x\" must be a number",
            ),
            (
                "[[shapes]]\ntype = 'triangle'\nmaterial = 'a'\nvertices = [[0, 0, 0], [1, 0, 0]]",
                4,
                "shapes[0].vertices: [[0, 0, 0], [1, 0, 0]] must be a list of 3 points",
            ),
        ] {
            let line = START.lines().count() + line;
            assert_eq!(message(&format!("{START}{added}")), format!("s.toml:{line}: {told}"));
        }
    }

    #[test]
    fn a_missing_section_or_key_is_told_at_the_table_it_belongs_to() {
        assert_eq!(message(""), "s.toml:1: image: is missing");
        assert_eq!(
            message(&START.replace("fov = 45", "")),
            "s.toml:4: camera.fov: is missing"
        );
        assert_eq!(message("image = 3"), "s.toml:1: image: 3 must be a table");
    }

    #[test]
    fn text_that_is_no_toml_is_told_with_line_and_column() {
        for (added, told) in [
            ("é = 3", "8:1: "),
            ("up = [0, 1", "8:11: "),
            ("fov = 46", "8:1: duplicate key"),
            ("focal_length = ", "8:15: "),
            ("focal_length = 1e999", "8:16: "),
        ] {
            let message = message(&format!("{START}{added}"));
            assert!(message.starts_with(&format!("s.toml:{told}")), "{message}");
            assert_eq!(message.lines().count(), 1, "{message}");
        }
    }

    #[test]
    fn every_prefix_of_a_scene_is_read_or_refused_without_panic() {
        let text = include_str!("../../scenes/cornell.toml");
        let good = |end: usize| Scene::parse(&text[..end], "s.toml", &Overrides::default()).is_ok();
        let count = (0..text.len())
            .filter(|&end| text.is_char_boundary(end) && good(end))
            .count();
        assert!(count > 0 && count < text.len());
    }

    #[test]
    fn a_scene_written_and_read_back_is_the_same() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
        let mut count = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let description = Description::parse(&text, "s.toml").unwrap();
            let written = toml::to_string(&description).unwrap();
            assert_eq!(
                Description::parse(&written, "s.toml").unwrap(),
                description,
                "{}",
                path.display()
            );
            description.validate().unwrap();
            assert!(text.starts_with("# "), "{} does not say what it shows", path.display());
            count += 1;
        }
        assert!(count >= 4);
    }

    #[test]
    fn the_example_of_the_page_is_a_scene() {
        let example = PAGE.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
        let scene = Scene::parse(example, "scene-format.md", &Overrides::default()).unwrap();
        assert_eq!(scene.shapes.len(), 1);
    }

    /// The part of the page under a heading, without its subsections.
    fn section(heading: &str) -> &'static str {
        let (_, rest) = PAGE
            .split_once(&format!("\n{heading}\n"))
            .unwrap_or_else(|| panic!("no {heading}"));
        rest.split("\n#").next().unwrap()
    }

    /// The names, with their quotes, that the first column of a section's tables has.
    fn rows(heading: &str) -> Vec<&'static str> {
        let lines = section(heading).lines();
        let names = lines.filter_map(|line| Some(line.strip_prefix("| `")?.split_once('`')?.0));
        names.collect()
    }

    /// Whether the page has a row for every key that is allowed at the end of the text, and for no other: an
    /// unknown key there makes the reader list them.
    fn check_keys(text: &str, heading: &str) {
        let message = message(&format!("{text}\n'?' = 1"));
        let (_, keys) = message
            .split_once("the keys here are ")
            .unwrap_or_else(|| panic!("{message}"));
        let mut keys: Vec<_> = keys.split(", ").map(|key| key.trim_matches('"')).collect();
        let mut rows = rows(heading);
        rows.retain(|name| !name.starts_with('"'));
        keys.sort_unstable();
        rows.sort_unstable();
        assert_eq!(rows, keys, "under {heading}");
    }

    fn check_types<T: Tagged>(before: &str, header: &str, title: &str) {
        for tag in T::TYPES {
            let text = format!("{before}\n{header}\ntype = '{tag}'");
            check_keys(&text, &format!("### `{title}` of type `\"{tag}\"`"));
        }
    }

    #[test]
    fn the_page_has_every_key() {
        let image = "[image]\nwidth = 1\nheight = 1";
        check_keys("[camera]\n[image]", "## `[image]`");
        check_keys(&format!("{START}[render]"), "## `[render]`");
        check_keys(&format!("{START}[render.pixel_samples]"), "### Samples");
        check_types::<CameraDescription>(image, "[camera]", "[camera]");
        check_types::<MaterialDescription>(START, "[materials.a]", "[materials.NAME]");
        check_types::<LightDescription>(START, "[[lights]]", "[[lights]]");
        check_types::<ShapeDescription>(START, "[[shapes]]", "[[shapes]]");
    }

    #[test]
    fn the_page_has_every_pattern() {
        let message = message(&format!(
            "{START}[render]\nlight_samples = {{ count = 1, pattern = '?' }}"
        ));
        let (_, names) = message.split_once("must be ").unwrap();
        let names: Vec<_> = names.split('"').skip(1).step_by(2).collect();
        let mut rows = rows("### Samples");
        rows.retain(|name| name.starts_with('"'));
        let rows: Vec<_> = rows.into_iter().map(|name| name.trim_matches('"')).collect();
        assert_eq!(rows, names);
    }

    #[test]
    #[should_panic(expected = "under ## `[image]`")]
    fn a_key_that_is_not_in_the_page_is_noticed() {
        check_keys(&format!("{START}[render]"), "## `[image]`");
    }
}
