//! Messages about invalid TOML: the key, the text and the rule.

use std::collections::BTreeMap;

use crate::scene::error::{KeyPath, SceneError, Segment, cut};
use crate::visible::visible;

/// The message about bytes that are not text.
pub(in crate::scene) const NOT_UTF8: &str = "not valid UTF-8";

/// Returns the message about bytes in an encoding other than UTF-8 that is recognized: UTF-16, by its byte order mark.
pub(in crate::scene) fn encoding(bytes: &[u8]) -> Option<String> {
    let name = match bytes {
        [0xff, 0xfe, ..] => "UTF-16 (little-endian)",
        [0xfe, 0xff, ..] => "UTF-16 (big-endian)",
        _ => return None,
    };
    Some(format!("the file is encoded in {name}; save it as UTF-8"))
}

/// Returns the error of a text at the byte `at`; `message` is the parser's.
pub(in crate::scene) fn syntax_error(text: &str, origin: &str, at: usize, message: &str) -> SceneError {
    let at = match message.contains(DEEP) && at == 0 {
        true => deepest_line(text), // for dotted keys the parser reports no location
        false => text.floor_char_boundary(at),
    };
    let line_start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    SceneError::Syntax {
        origin: origin.to_owned(),
        line: super::line_number(text, at),
        column: text[line_start..at].chars().count() + 1,
        message: visible(&explain(text, at, message)).into_owned(),
    }
}

/// Part of the parser's message about dotted keys with too many segments.
const DEEP: &str = "recursion limit";

/// Returns the start of the line with the most dots.
fn deepest_line(text: &str) -> usize {
    let points = |line: &str| line.bytes().filter(|byte| *byte == b'.').count();
    let (mut at, mut deepest) = (0, (0, 0));
    for line in text.split_inclusive('\n') {
        let count = points(line);
        if count > deepest.0 {
            deepest = (count, at);
        }
        at += line.len();
    }
    deepest.1
}

fn explain(text: &str, at: usize, message: &str) -> String {
    if message == NOT_UTF8 {
        return message.to_owned();
    }
    let place = Place::of(text, at);
    let token = token(text, at);
    let shown = cut(token);
    let rule = if message.contains(DEEP) || message.contains("recurse") {
        "tables and lists must be nested at most 80 levels deep".to_owned()
    } else if message == "duplicate key" {
        return twice(text, &place, name(text, at));
    } else if message.contains("mantissa") {
        let digits = token.trim_start_matches(['+', '-']);
        let sign = &token[..token.len() - digits.len()];
        format!(
            "{shown} must have a digit before the decimal point: {}",
            cut(&format!("{sign}0{digits}"))
        )
    } else if message.contains("fraction") {
        format!(
            "{shown} must have a digit after the decimal point: {}",
            cut(&format!("{token}0"))
        )
    } else if message.contains("exponent") {
        format!("{shown} must have a digit after the e, as in 1e3")
    } else if message.contains("leading zero") {
        format!("{shown} must not start with 0")
    } else if message.contains("invalid boolean") {
        format!("{shown} must be true or false, in lower case")
    } else if message.contains("number overflowed") || message.contains("as i128") {
        format!("{shown} must fit into 64 bits")
    } else if message.contains("key with no value") {
        return match line(text, at).trim() {
            comment if comment.starts_with("//") => {
                format!("{} must be KEY = VALUE; comments start with #", cut(comment))
            }
            line => format!("{} must be KEY = VALUE", cut(line)),
        };
    } else if message.contains("values must be quoted") && token.is_empty() {
        "has no value after the =".to_owned()
    } else if message.contains("values must be quoted") {
        let rest = line(text, at);
        let rest = rest.find(token).map_or(token, |start| {
            rest[start..].split('#').next().unwrap_or_default().trim()
        });
        let shown = match is_in_list(text, at) {
            true => shown,
            false => cut(rest),
        };
        format!("{shown} must be a number, true or false, a list [ ], a table {{ }}, or a string in \" \"")
    } else if message.contains("escaped value") {
        "a string in \" \" must have no single \\; write \\\\, use / in paths, or put the string in ' '".to_owned()
    } else if message.contains("unexpected key or value") && text[at..].starts_with(',') {
        format!("{shown} must be a single number with a decimal point, not a comma")
    } else if message.contains("basic string") || message.contains("literal string") {
        "the closing quote of the string is missing".to_owned()
    } else {
        let message = message.replace(", expected nothing", "").replace('`', "'");
        match token {
            _ if message.starts_with("unclosed") => message,
            "" => message,
            _ => format!("{shown}: {message}"),
        }
    };
    match place.path() {
        path if path.0.is_empty() => rule,
        path => format!("{path}: {rule}"),
    }
}

/// Returns the token at a byte: up to the next space or punctuation on both sides.
fn token(text: &str, at: usize) -> &str {
    let ends = |c: char| c.is_whitespace() || "[]{}=#\"'".contains(c);
    let start = text[..at]
        .rfind(ends)
        .map_or(0, |end| end + text[end..].chars().next().map_or(1, char::len_utf8));
    // In a list it starts after the last comma.
    let start = match is_in_list(text, start) {
        true => text[start..at].rfind(',').map_or(start, |comma| start + comma + 1),
        false => start,
    };
    // A comma separates the values of a list, but elsewhere it may be meant as a decimal point.
    let end = text[at..].find(ends).map_or(text.len(), |end| at + end);
    let all = &text[start..end];
    match all.split_once(',') {
        Some((first, _)) if is_in_list(text, start) => first,
        Some((first, "")) => first,
        _ => all,
    }
}

/// Returns true if the token here is an element of a list.
fn is_in_list(text: &str, at: usize) -> bool {
    text[..at].trim_end().ends_with(['[', ','])
}

/// Returns the line of a byte.
fn line(text: &str, at: usize) -> &str {
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    text[start..].lines().next().unwrap_or_default()
}

/// The table and key of a line, found line by line without parsing.
struct Place<'a> {
    /// The header above, and the number of equal headers before it, for arrays of tables.
    header: Option<(Header<'a>, usize)>,
    /// The first line after the header.
    line: usize,
    /// The text before the last `=`, or the line.
    key: Option<&'a str>,
}

#[derive(Clone, Copy)]
struct Header<'a> {
    name: &'a str,
    is_list: bool,
}

impl<'a> Header<'a> {
    /// Parses `[name]` or `[[name]]`, but not a row of numbers in a list.
    fn of(line: &'a str) -> Option<Header<'a>> {
        let inner = line.trim().strip_prefix('[')?;
        let (inner, is_list) = match inner.strip_prefix('[') {
            Some(inner) => (inner, true),
            None => (inner, false),
        };
        let name = inner.split([']', '#', ',']).next()?.trim();
        let is_name = |c: char| c.is_alphabetic() || "_\"'".contains(c);
        name.starts_with(is_name).then_some(Header { name, is_list })
    }
}

/// Returns the key that is assigned on a line.
fn key(line: &str) -> Option<&str> {
    let key = line.split(['=', '#']).next()?.trim();
    let is_key =
        key.starts_with(|c: char| c.is_alphanumeric() || "_-\"'".contains(c)) && !key.contains(['[', '{', ',']);
    is_key.then_some(key)
}

impl<'a> Place<'a> {
    fn of(text: &'a str, at: usize) -> Place<'a> {
        let number = super::line_number(text, at) - 1;
        let mut place = Place {
            header: None,
            line: 0,
            key: None,
        };
        let mut before: BTreeMap<&str, usize> = BTreeMap::new();
        // Open brackets since the key, whose value continues on the next line.
        let mut open = 0;
        for (i, line) in text.lines().take(number + 1).enumerate() {
            if let Some(header) = Header::of(line).filter(|_| open <= 0) {
                let count = before.entry(header.name).or_default();
                place = Place {
                    header: Some((header, *count)),
                    line: i + 1,
                    key: None,
                };
                *count += 1;
                continue;
            }
            if open <= 0 {
                place.key = key(line).filter(|_| line.contains('=') || i == number);
                open = 0;
            }
            let count = |marks: [char; 2]| line.matches(marks).count() as isize;
            open += count(['[', '{']) - count([']', '}']);
        }
        place
    }

    fn path(&self) -> KeyPath {
        let mut path = Vec::new();
        if let Some((header, before)) = self.header {
            path.extend(segments(header.name));
            path.extend(header.is_list.then_some(Segment::Index(before)));
        }
        path.extend(self.key.into_iter().flat_map(segments));
        KeyPath(path)
    }
}

fn segments(dotted: &str) -> impl Iterator<Item = Segment> {
    let parts = dotted.split('.').map(|part| part.trim().trim_matches(['"', '\'']));
    parts.map(Segment::from)
}

/// Returns the segment of a dotted key at a byte.
fn name(text: &str, at: usize) -> &str {
    let rest = &text[at..];
    let quote = rest.chars().next().filter(|c| "\"'".contains(*c));
    let quoted = quote.and_then(|quote| rest[1..].split(quote).next());
    quoted.unwrap_or_else(|| {
        rest.split(|c: char| c.is_whitespace() || ".=]".contains(c))
            .next()
            .unwrap_or_default()
    })
}

/// Returns the message about a key or table that is defined twice.
fn twice(text: &str, place: &Place, name: &str) -> String {
    let lines = || text.lines().enumerate();
    let first = match (&place.header, place.key) {
        (Some((header, _)), None) => lines().find(|(_, line)| {
            Header::of(line).is_some_and(|other| other.name == header.name) || key(line) == Some(header.name)
        }),
        (_, Some(own)) => lines().skip(place.line).find(|(_, line)| key(line) == Some(own)),
        (None, None) => None,
    };
    let mut path = place.path();
    if place
        .key
        .is_some_and(|key| !key.trim_end_matches(['"', '\'']).ends_with(name))
    {
        path.0.push(Segment::from(name)); // in a table in { }
    }
    match first {
        Some((line, _)) => format!("{path}: is defined twice, first on line {}; remove one", line + 1),
        None => format!("{path}: is defined twice; remove one"),
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;

    const START: &str = "\
[image]
width = 4
height = 4
[camera]
position = [0, -3, 1]
look_at = [0, 0, 1]
fov = 45
";

    #[test]
    fn place_key_value_and_rule_are_told() {
        for (added, told) in [
            (
                "focal_length = .5",
                "8:16: camera.focal_length: .5 must have a digit before the decimal point: 0.5",
            ),
            (
                "focal_length = -.5",
                "8:16: camera.focal_length: -.5 must have a digit before the decimal point: -0.5",
            ),
            (
                "up = [.1, .2, 1]",
                "8:7: camera.up: .1 must have a digit before the decimal point: 0.1",
            ),
            (
                "up = [1,.5,0]",
                "8:9: camera.up: .5 must have a digit before the decimal point: 0.5",
            ),
            (
                "up = [1,2.,0]",
                "8:11: camera.up: 2. must have a digit after the decimal point: 2.0",
            ),
            (
                "up = [0,-.5,0]",
                "8:9: camera.up: -.5 must have a digit before the decimal point: -0.5",
            ),
            ("up = [1,05,0]", "8:9: camera.up: 05 must not start with 0"),
            ("up = [1,,0]", "8:9: camera.up: extra comma in array, expected value"),
            ("a\u{1b}[31m=1", "8:3: a\\u{1b}[31m=1 must be KEY = VALUE"),
            (
                "up = [\n  0, # none\n  .1, 1]",
                "10:3: camera.up: .1 must have a digit before the decimal point: 0.1",
            ),
            (
                "focal_length = 1.",
                "8:18: camera.focal_length: 1. must have a digit after the decimal point: 1.0",
            ),
            (
                "up = [1., 0, 0]",
                "8:9: camera.up: 1. must have a digit after the decimal point: 1.0",
            ),
            (
                "focal_length = 0,5",
                "8:17: camera.focal_length: 0,5 must be a single number with a decimal point, not a comma",
            ),
            (
                "focal_length = 1e",
                "8:18: camera.focal_length: 1e must have a digit after the e, as in 1e3",
            ),
            (
                "focal_length = 08",
                "8:16: camera.focal_length: 08 must not start with 0",
            ),
            (
                "focal_length = 1e999",
                "8:16: camera.focal_length: 1e999 must fit into 64 bits",
            ),
            (
                "[render]\nseed = 99999999999999999999",
                "9:8: render.seed: 99999999999999999999 must fit into 64 bits",
            ),
            (
                "[render]\nray_differentials = True",
                "9:21: render.ray_differentials: True must be true or false, in lower",
            ),
            ("focal_length = ", "8:16: camera.focal_length: has no value after the ="),
            ("focal_length", "8:13: focal_length must be KEY = VALUE"),
            (
                "type = perspective",
                "8:8: camera.type: perspective must be a number, true or false, a list [ ], a table",
            ),
            (
                "[[shapes]]\n[[shapes]]\ntype = sphere",
                "10:8: shapes[1].type: sphere must be a number",
            ),
            (
                "[textures.t]\nfile = \"a\\quarry.png\"",
                "9:11: textures.t.file: a string in \" \" must have no single \\; write",
            ),
            (
                "fov = 46",
                "8:1: camera.fov: is defined twice, first on line 7; remove one",
            ),
            ("[image]", "8:2: image: is defined twice, first on line 1; remove one"),
            (
                "[render]\nseed = 1\n[materials.a]\n[materials.a]",
                "11:12: materials.a: is defined twice, first on line 10;",
            ),
            (
                "[render]\nfilter = { type = 'box', type = 'box' }",
                "9:26: render.filter.type: is defined twice",
            ),
            ("up = [0, 0, 1", "8:14: camera.up: unclosed array, expected ']'"),
            (
                "// a comment",
                "8:4: // a comment must be KEY = VALUE; comments start with #",
            ),
            ("= 3", "8:1: camera: unquoted keys cannot be empty"),
            (
                "focal_length = 1 2 # a",
                "8:16: camera.focal_length: 1 2 must be a number, true or false",
            ),
            ("up = [1 2, 3]", "8:7: camera.up: 1 must be a number, true or false"),
            (
                "type = \"a",
                "8:10: camera.type: the closing quote of the string is missing",
            ),
            ("é = 3", "8:1: "),
        ] {
            let error = Scene::parse(&format!("{START}{added}"), "s.toml").unwrap_err();
            let message = error.to_string();
            assert!(message.starts_with(&format!("s.toml:{told}")), "{message}\n{told}");
            assert_eq!(message.lines().count(), 1, "{message}");
        }
    }

    #[test]
    fn any_text_is_told_without_panic() {
        let texts = [
            "=", "[", "]", "é", "'", "\"", ",", ".", "#", "\n", "\r", "0", "a", " ", "{", "}", "\u{feff}", "\0",
        ];
        for a in texts {
            for b in texts {
                for c in texts {
                    let _ = Scene::parse(&format!("a{a}{b}{c}"), "s.toml");
                    let _ = Scene::parse(&format!("x = {a}{b}{c}"), "s.toml");
                }
            }
        }
    }
}
