//! Errors of texts that are not valid TOML: the parser's message, a hint and the line.

use crate::content::binary_format;
use crate::error::SceneError;
use crate::key_path::cut;
use wgray_image::sanitize::escape_control;

pub const NOT_UTF8: &str = "not valid UTF-8";

/// Returns a message if the bytes are UTF-16, which is recognized by the byte order mark, or a binary file of a known
/// format.
pub fn encoding(bytes: &[u8]) -> Option<String> {
    let name = match bytes {
        [0xff, 0xfe, ..] => "UTF-16 (little-endian)",
        [0xfe, 0xff, ..] => "UTF-16 (big-endian)",
        _ => return binary_format(bytes).map(|name| format!("the file has the format {name}, not TOML or JSON")),
    };
    Some(format!("the file is encoded in {name}; save it as UTF-8"))
}

/// Returns a syntax error at a byte offset in a text.
pub fn syntax_error(text: &str, origin: &str, offset: usize, message: &str) -> SceneError {
    let offset = text.floor_char_boundary(offset);
    SceneError::Syntax {
        origin: origin.to_owned(),
        line: line_number(text, offset),
        column: text[line_start(text, offset)..offset].chars().count() + 1,
        message: escape_control(message).into_owned(),
    }
}

/// Returns the parser's message about the byte at `offset`, with a hint for common mistakes, and the line.
pub fn explain(text: &str, offset: usize, message: &str) -> String {
    let offset = text.floor_char_boundary(offset);
    let line = text[line_start(text, offset)..]
        .lines()
        .next()
        .unwrap_or_default()
        .trim();
    let message = message.trim_end_matches(", expected nothing").replace('`', "'");
    let hint = hint(line, &text[..offset], &text[offset..]);
    match line.is_empty() {
        true => format!("{message}{hint}"),
        false => format!("{message}{hint}: {}", cut(line)),
    }
}

fn hint(line: &str, before: &str, after: &str) -> &'static str {
    let follows_digit = before.ends_with(|c: char| c.is_ascii_digit());
    if line.starts_with("//") {
        "; comments start with #"
    } else if before.ends_with('\\') {
        "; write \\\\ for a backslash, use / in paths, or put the string in ' '"
    } else if before.ends_with('.') || after.trim_start_matches(['-', '+']).starts_with('.') {
        "; a number has digits on both sides of the decimal point"
    } else if follows_digit && after.starts_with(',') {
        "; the decimal separator is a point"
    } else {
        ""
    }
}

fn line_start(text: &str, offset: usize) -> usize {
    text[..offset].rfind('\n').map_or(0, |newline| newline + 1)
}

/// Returns the line of a byte offset, counted from 1.
pub(super) fn line_number(text: &str, offset: usize) -> usize {
    let newlines = text.bytes().take(offset).filter(|&byte| byte == b'\n');
    1 + newlines.count()
}

#[cfg(test)]
mod tests {
    use crate::Scene;

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
    fn errors_have_location_message_hint_and_line() {
        for (added, expected) in [
            (
                "focal_length = .5",
                "8:16: invalid mantissa, expected digits; a number has digits on both sides of the decimal point: focal_length = .5",
            ),
            (
                "up = [1,2.,0]",
                "8:11: invalid fraction, expected digits; a number has digits on both sides of the decimal point: up = [1,2.,0]",
            ),
            ("up = [1,05,0]", "8:9: unexpected leading zero: up = [1,05,0]"),
            ("up = [1,,0]", "8:9: extra comma in array, expected value: up = [1,,0]"),
            ("a\u{1b}[31m=1", "8:3: key with no value, expected '=': a\\u{1b}[31m=1"),
            (
                "focal_length = 0,5",
                "8:17: unexpected key or value, expected newline, '#'; the decimal separator is a point: focal_length = 0,5",
            ),
            (
                "focal_length = 1e",
                "8:18: invalid exponent, expected digits: focal_length = 1e",
            ),
            (
                "focal_length = 1e999",
                "8:16: floating-point number overflowed: focal_length = 1e999",
            ),
            (
                "focal_length = ",
                "8:16: string values must be quoted, expected literal string: focal_length =",
            ),
            (
                "type = perspective",
                "8:8: string values must be quoted, expected literal string: type = perspective",
            ),
            (
                "[textures.t]\nfile = \"a\\quarry.png\"",
                "9:11: missing escaped value, expected 'b', 'e', 'f', 'n', 'r', '\\', '\"', 'x', 'u', 'U'; write \\\\ for a backslash, use / in \
                 paths, or put the string in ' ': file = \"a\\quarry.png\"",
            ),
            ("fov = 46", "8:1: duplicate key: fov = 46"),
            ("[image]", "8:2: duplicate key: [image]"),
            ("up = [0, 0, 1", "8:14: unclosed array, expected ']': up = [0, 0, 1"),
            (
                "// a comment",
                "8:4: key with no value, expected '='; comments start with #: // a comment",
            ),
            ("type = \"a", "8:10: invalid basic string, expected '\"': type = \"a"),
            ("é = 3", "8:1: "),
        ] {
            let error = Scene::parse(&format!("{START}{added}"), "s.toml").unwrap_err();
            let message = error.to_string();
            assert!(
                message.starts_with(&format!("s.toml:{expected}")),
                "{message}\n{expected}"
            );
            assert_eq!(message.lines().count(), 1, "{message}");
        }
    }

    #[test]
    fn arbitrary_text_causes_no_panic() {
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
