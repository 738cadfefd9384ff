//! Overrides of values of a scene file by key: `shapes[2].radius=0.5`.

use std::fmt;
use std::str::FromStr;

use toml::{Table, Value};
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

use super::key_path::{KeyPath, Segment, cut};
use super::problem::Problem;

/// An override of the value of a key: `KEY=VALUE`.
///
/// `KEY` is a path from the top of the file, such as `render.seed`, `materials."dark red".color`, `shapes[2].radius` or
/// `shapes.2.radius`; list indices start at 0. `VALUE` is a TOML value; other text is taken as a string.
#[derive(Clone, Debug, PartialEq)]
pub struct Define {
    pub(super) key: KeyPath,
    pub(super) value: Value,
}

impl Define {
    /// Parses a key and a value.
    ///
    /// # Errors
    ///
    /// The path is invalid, or the value is empty or starts like TOML but is invalid.
    pub fn new(key: &str, value: &str) -> Result<Define, Problem> {
        let (path, rest) = read_key(key, syntax_problem)?;
        match rest {
            "" => Ok(Define {
                value: read_value(value).map_err(|message| problem_at(&path, message))?,
                key: path,
            }),
            _ => Err(syntax_problem(key)),
        }
    }
}

impl FromStr for Define {
    type Err = Problem;

    fn from_str(text: &str) -> Result<Define, Problem> {
        let (path, rest) = read_key(text, syntax_problem)?;
        let Some(value) = rest.strip_prefix('=') else {
            return Err(syntax_problem(text));
        };
        Ok(Define {
            value: read_value(value).map_err(|message| problem_at(&path, message))?,
            key: path,
        })
    }
}

impl Define {
    /// Returns true if the override sets this key, a part of its value, or a table that contains the key.
    pub(super) fn overrides_key(&self, key: &KeyPath) -> bool {
        self.key
            .0
            .iter()
            .zip(&key.0)
            .all(|(written, segment)| matches_segment(written, segment))
    }
}

impl fmt::Display for Define {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key, self.value)
    }
}

pub(super) fn problem_at(key: &KeyPath, message: String) -> Problem {
    let key = key.clone();
    Problem {
        key,
        ..Problem::new(message)
    }
}

fn syntax_problem(text: &str) -> Problem {
    let rule = "must be KEY=VALUE, such as render.seed=3 or shapes[2].radius=0.5";
    Problem::new(format!("{} {rule}", cut(text)))
}

impl FromStr for KeyPath {
    type Err = Problem;

    /// Parses a path with the syntax of a scene file: `materials."dark red".color`, `shapes[2].radius`.
    fn from_str(text: &str) -> Result<KeyPath, Problem> {
        match read_key(text, path_problem)? {
            (path, "") => Ok(path),
            _ => Err(path_problem(text)),
        }
    }
}

fn path_problem(text: &str) -> Problem {
    Problem::new(format!("{} must be a path, such as shapes[2].radius", cut(text)))
}

/// Maximum number of segments of a path: the nesting limit of a file.
const MAX_SEGMENTS: usize = 80;

fn too_deep(text: &str) -> Problem {
    Problem::new(format!("{} must have at most {MAX_SEGMENTS} segments", cut(text)))
}

/// Parses the path at the start of a text. Also returns the rest of the text, which is empty or starts with `=`.
/// `syntax_problem` creates the error.
fn read_key(text: &str, syntax_problem: fn(&str) -> Problem) -> Result<(KeyPath, &str), Problem> {
    let mut path = Vec::new();
    let (mut expects_name, mut expects_separator) = (true, false);
    let mut rest = "";
    let mut tokens = Source::new(text).lex();
    while let Some(token) = tokens.next() {
        let (start, end) = (token.span().start(), token.span().end());
        let token_text = text.get(start..end).unwrap_or_default();
        match token.kind() {
            TokenKind::Whitespace | TokenKind::Eof => {}
            TokenKind::Equals => {
                rest = text.get(start..).unwrap_or_default();
                break;
            }
            TokenKind::Atom if expects_name => {
                path.push(Segment::from(token_text));
                (expects_name, expects_separator) = (false, true);
            }
            TokenKind::BasicString | TokenKind::LiteralString if expects_name => {
                let quoted = format!("key = {token_text}").parse::<Table>().ok();
                let quoted = quoted.as_ref().and_then(|table| table.get("key")?.as_str());
                path.push(Segment::from(quoted.ok_or_else(|| syntax_problem(text))?));
                (expects_name, expects_separator) = (false, true);
            }
            TokenKind::Dot if expects_separator => (expects_name, expects_separator) = (true, false),
            TokenKind::LeftSquareBracket if expects_separator => {
                let inner = tokens.next().zip(tokens.next());
                let (number, _) = inner
                    .filter(|(number, bracket)| {
                        (number.kind(), bracket.kind()) == (TokenKind::Atom, TokenKind::RightSquareBracket)
                    })
                    .ok_or_else(|| syntax_problem(text))?;
                let index = text
                    .get(number.span().start()..number.span().end())
                    .and_then(parse_index);
                path.push(Segment::Index(index.ok_or_else(|| syntax_problem(text))?));
            }
            _ => return Err(syntax_problem(text)),
        }
    }
    match expects_separator && !path.is_empty() {
        true if path.len() > MAX_SEGMENTS => Err(too_deep(text)),
        true => Ok((KeyPath(path), rest)),
        false => Err(syntax_problem(text)),
    }
}

pub(super) fn parse_index(text: &str) -> Option<usize> {
    let is_number = text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|_| is_number)
}

/// Parses a TOML value or an unquoted string. Text that starts like a list, table or quoted string must be
/// valid TOML.
fn read_value(text: &str) -> Result<Value, String> {
    let text = text.trim();
    if text.is_empty() {
        return Err("has no value after the =; \"\" is an empty string".to_owned());
    }
    let parsed = format!("value = {text}").parse::<Table>();
    let error = match parsed {
        Ok(mut table) => match table.remove("value") {
            Some(value) if table.is_empty() => return Ok(value),
            _ => "there is text after the value".to_owned(),
        },
        Err(error) => error.message().replace('`', "'"),
    };
    match text.starts_with(['[', '{', '"', '\'']) || text.contains('\n') {
        true => Err(format!("{} must be TOML: {error}", cut(&text.replace('\n', " ")))),
        false => Ok(Value::from(text)),
    }
}

/// Compares a segment as written in a key with a segment of a path; an index may also be written as a name.
pub(super) fn matches_segment(written: &Segment, segment: &Segment) -> bool {
    match (written, segment) {
        (Segment::Key(name), Segment::Index(number)) => parse_index(name) == Some(*number),
        _ => written == segment,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Overrides, Scene, SceneError};

    const SCENE: &str = "\
image = { width = 4, height = 3 }
camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }
[materials.red]
type = 'phong'
color = [1, 0, 0]
[materials.\"dark red\"]
type = 'phong'
color = [0.5, 0, 0]
[[shapes]]
type = 'sphere'
material = 'red'
center = [0, 0, 0]
radius = 1
[[shapes]]
type = 'sphere'
material = 'dark red'
center = [0, 0, 1]
radius = 0.5
";

    fn parse(text: &str, defines: &[&str]) -> Result<Scene, SceneError> {
        let overrides = Overrides {
            define: defines.iter().map(|define| define.parse().unwrap()).collect(),
            ..Overrides::default()
        };
        Scene::parse_with(text, "s.toml", &overrides)
    }

    fn error_of(define: &str) -> String {
        parse(SCENE, &[define]).unwrap_err().to_string()
    }

    fn edited(from: &str, to: &str) -> Scene {
        assert_eq!(SCENE.matches(from).count(), 1, "{from}");
        parse(&SCENE.replace(from, to), &[]).unwrap()
    }

    #[test]
    fn a_define_equals_an_edit_of_the_file() {
        for (define, from, to) in [
            ("image.width=7", "width = 4", "width = 7"),
            ("camera.fov=50.5", "fov = 40", "fov = 50.5"),
            ("camera.position=[0, -9, 1]", "[0, -4, 0]", "[0, -9, 1]"),
            ("camera.position[1]=-9", "[0, -4, 0]", "[0, -9, 0]"),
            ("shapes[1].radius=0.25", "radius = 0.5", "radius = 0.25"),
            ("shapes.1.radius = 0.25", "radius = 0.5", "radius = 0.25"),
            ("shapes . 01 . radius=0.25", "radius = 0.5", "radius = 0.25"),
            ("shapes[1].material=red", "'dark red'", "'red'"),
            ("materials.\"dark red\".color=[0, 0, 1]", "[0.5, 0, 0]", "[0, 0, 1]"),
            ("materials.'dark red'.color[2]=1", "[0.5, 0, 0]", "[0.5, 0, 1]"),
            (
                "materials.\"dark red\"={ type = \"mirror\" }",
                "type = 'phong'\ncolor = [0.5, 0, 0]",
                "type = 'mirror'",
            ),
            (
                "render.seed=3",
                "[materials.red]",
                "[render]\nseed = 3\n[materials.red]",
            ),
            (
                "render.filter.type=gaussian",
                "[materials.red]",
                "[render]\nfilter.type = 'gaussian'\n[materials.red]",
            ),
            (
                "materials.new={type=\"mirror\"}",
                "[materials.red]",
                "[materials.new]\ntype = 'mirror'\n[materials.red]",
            ),
            (
                "shapes[0]={type=\"sphere\", material=\"red\", center=[0,0,0], radius=2}",
                "radius = 1\n",
                "radius = 2\n",
            ),
        ] {
            let expected = edited(from, to);
            assert_ne!(expected, parse(SCENE, &[]).unwrap(), "{define}");
            assert_eq!(parse(SCENE, &[define]).unwrap(), expected, "{define}");
        }
        assert_eq!(parse(SCENE, &["shapes=[]"]).unwrap().shapes, []);
    }

    #[test]
    fn later_defines_and_options_take_precedence() {
        let scene = parse(SCENE, &["render.seed=3", "image.width=9", "render={}", "render.seed=5"]).unwrap();
        assert_eq!((scene.render.seed, scene.width), (5, 9));
        let overrides = Overrides {
            define: vec!["render.seed=3".parse().unwrap()],
            seed: Some(8),
            ..Overrides::default()
        };
        assert_eq!(Scene::parse_with(SCENE, "s.toml", &overrides).unwrap().render.seed, 8);
        let scene = parse(SCENE, &["materials.new={type=\"mirror\"}", "shapes[0].material=new"]).unwrap();
        assert_eq!(scene.material_names[scene.shapes[0].material], "new");
    }

    #[test]
    fn errors_of_invalid_values_name_the_define() {
        for (define, message) in [
            ("camera.fov=x", "camera.fov: \"x\" must be a number"),
            ("camera.fov=180", "camera.fov: 180 must be from 0.001 to 179.999"),
            (
                "camera.position[0]=1e10",
                "camera.position: 1e10 must be from -1e9 to 1e9",
            ),
            (
                "camera.position[3]=1",
                "camera.position[3]: does not exist; the length of the list is 3, and indices start at 0",
            ),
            (
                "camera.position.x=1",
                "camera.position: is a list; add the index of an element",
            ),
            ("camera.fov.x=1", "camera.fov: is a number and has no x"),
            ("camera[0]=1", "camera: is a table and has no [0]"),
            (
                "shapes[2].radius=1",
                "shapes[2]: does not exist; the length of the list is 2, and indices start at 0",
            ),
            (
                "shapes[1].size=1",
                "shapes[1].size: unknown key; expected one of \"type\"",
            ),
            ("shapes.x=1", "shapes: is a list; add the index of an element"),
            (
                "shapes[1].material=blue",
                "shapes[1].material: there is no material \"blue\"",
            ),
            ("shapes[1]=3", "shapes[1]: 3 must be a table"),
            (
                "lights[0].color=[1,1,1]",
                "lights: does not exist, so it has no elements",
            ),
            (
                "materials.blue.color=[0,0,1]",
                "materials.blue: does not exist; the scene has \"dark red\", \"red\"",
            ),
            (
                "textures.a.file=a.png",
                "textures.a: does not exist; the scene has none",
            ),
            ("materials.blue={}", "materials.blue.type is missing"),
            ("render.sed=1", "render.sed: unknown key"),
            ("rendr.seed=1", "rendr: unknown key; did you mean \"render\"?"),
            ("seed=1", "seed: unknown key; did you mean render.seed?"),
            ("spp=16", "spp: unknown key; did you mean render.pixel_samples?"),
            ("fov=40", "fov: unknown key; did you mean camera.fov?"),
            ("width=40", "width: unknown key; did you mean image.width?"),
            ("sed=1", "sed: unknown key; expected one of"),
            ("render.adaptive.max_samples=9", "render.adaptive.error is missing"),
            ("image={width=4}", "image.height is missing"),
        ] {
            assert!(
                error_of(define).starts_with(&format!("define.{message}")),
                "{define}: {}",
                error_of(define)
            );
        }
        // Errors in values from the file are reported at their location in the file.
        let invalid = SCENE.replace("radius = 0.5", "radius = -1");
        let message = parse(&invalid, &["shapes[0].radius=2", "camera.fov=50"])
            .unwrap_err()
            .to_string();
        assert!(
            message.starts_with("s.toml:18: shapes[1].radius: -1 must be"),
            "{message}"
        );
        assert!(parse(&invalid, &["shapes[1].radius=1"]).is_ok());
    }

    #[test]
    fn invalid_keys_and_values_are_errors() {
        let rule = "must be KEY=VALUE, such as render.seed=3 or shapes[2].radius=0.5";
        for text in [
            "",
            "=",
            "=3",
            "render",
            "render.",
            "render.=3",
            ".render=3",
            "a..b=3",
            "a b=3",
            "a[=3",
            "a[]=3",
            "a[x]=3",
            "a[1=3",
            "a[-1]=3",
            "a[1.5]=3",
            "[0]=3",
            "a]=3",
            "a{}=3",
            "\"a=3",
            "a#=3",
            "a\n=3",
            "a[99999999999999999999]=3",
            "a.[0]=3",
        ] {
            let message = text.parse::<Define>().unwrap_err().to_string();
            assert!(message.ends_with(rule), "{text}: {message}");
        }
        for (text, message) in [
            ("a=", "a: has no value after the =; \"\" is an empty string"),
            ("a.b= ", "a.b: has no value after the ="),
            ("a=[1, 2", "a: [1, 2 must be TOML: unclosed array"),
            ("a={x=1", "a: {x=1 must be TOML: "),
            ("a=\"x", "a: \"x must be TOML: "),
            ("a=[1] x", "a: [1] x must be TOML: "),
            ("a=1\nb=2", "a: 1 b=2 must be TOML: there is text after the value"),
        ] {
            let error = text.parse::<Define>().unwrap_err().to_string();
            assert!(error.starts_with(message), "{text}: {error}");
        }
    }

    #[test]
    fn text_that_is_not_toml_is_a_string() {
        for (text, expected) in [
            ("3", Value::Integer(3)),
            ("-0.5", Value::Float(-0.5)),
            ("1e3", Value::Float(1000.0)),
            ("true", Value::Boolean(true)),
            ("True", Value::from("True")),
            ("sobol", Value::from("sobol")),
            ("\"3\"", Value::from("3")),
            ("dark red", Value::from("dark red")),
            ("a=b", Value::from("a=b")),
            ("2k/wood.png", Value::from("2k/wood.png")),
            (".5", Value::from(".5")),
            ("#fff", Value::from("#fff")),
            ("[1, 2]", Value::from(vec![1, 2])),
        ] {
            let parsed: Define = format!("key={text}").parse().unwrap();
            assert_eq!(parsed.value, expected, "{text}");
            assert_eq!(Define::new("key", text).unwrap(), parsed);
        }
        assert!(Define::new("a=b", "1").is_err());
    }

    #[test]
    fn path_depth_is_limited() {
        let path = |segments: usize| format!("{}=1", vec!["a"; segments].join("."));
        assert!(path(MAX_SEGMENTS).parse::<Define>().is_ok());
        for segments in [MAX_SEGMENTS + 1, 100_000] {
            let error = path(segments).parse::<Define>().unwrap_err().to_string();
            assert!(error.ends_with(".a=1 must have at most 80 segments"), "{error}");
            assert!(error.len() < 100, "{error}");
        }
        let indices = format!("a{}=1", "[0]".repeat(MAX_SEGMENTS));
        assert!(indices.parse::<Define>().is_err());
    }

    #[test]
    fn defines_apply_to_large_files() {
        let shape = "[[shapes]]\ntype = 'sphere'\nmaterial = 'red'\ncenter = [0, 0, 9]\nradius = 0.125\n";
        let large = format!("{SCENE}{}", shape.repeat((5 << 20) / shape.len()));
        assert!(large.len() > 4 << 20);
        let scene = parse(
            &large,
            &["shapes[3].radius=0.5", "materials.red.color[1]=1", "render.seed=4"],
        )
        .unwrap();
        assert_eq!(scene.render.seed, 4);
        assert_eq!(
            scene.shapes[3],
            parse(
                &large.replacen("radius = 0.125", "radius = 0.25", 1),
                &["shapes.3.radius=0.5"]
            )
            .unwrap()
            .shapes[3]
        );
        assert_ne!(scene.shapes[3].geometry, scene.shapes[4].geometry);
        for (define, message) in [
            (
                "shapes[999999].radius=1",
                "define.shapes[999999].radius: does not exist",
            ),
            (
                "materials.blue.color=[1, 1, 1]",
                "define.materials.blue.color: does not exist",
            ),
            ("shapes[3].radius=-1", "define.shapes[3].radius: -1 must be"),
            ("shapes[3].size=-1", "define.shapes[3].size: unknown key"),
        ] {
            let error = parse(&large, &[define]).unwrap_err().to_string();
            assert!(error.starts_with(message), "{define}: {error}");
        }
    }
}
