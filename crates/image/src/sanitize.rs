//! Escaping of untrusted text for terminals: control characters, direction marks and line separators are printed as
//! escapes such as `\u{1b}`.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Returns true for control characters, direction marks (Unicode UAX 9) and line separators.
fn is_control_or_mark(c: char) -> bool {
    let marks = ['\u{61c}', '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}'];
    c.is_control()
        || marks.contains(&c)
        || ('\u{202a}'..='\u{202e}').contains(&c)
        || ('\u{2066}'..='\u{2069}').contains(&c)
}

/// Escapes text, including line breaks.
pub fn escape_control(text: &str) -> Cow<'_, str> {
    escape(text, &[])
}

/// Escapes text with several lines; line breaks and tabs are kept.
pub fn escape_control_in_lines(text: &str) -> Cow<'_, str> {
    escape(text, &['\n', '\t'])
}

fn escape<'a>(text: &'a str, allowed: &[char]) -> Cow<'a, str> {
    let is_safe = |c: char| !is_control_or_mark(c) || allowed.contains(&c);
    if text.chars().all(is_safe) {
        return text.into();
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match is_safe(c) {
            true => escaped.push(c),
            false => drop(write!(escaped, "{}", c.escape_default())),
        }
    }
    escaped.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_and_direction_marks_are_escaped() {
        for (text, expected) in [
            ("a\u{1b}[31mb", "a\\u{1b}[31mb"),
            ("a\nerror: b\t\r", "a\\nerror: b\\t\\r"),
            ("\u{9b}31m\u{7f}\0", "\\u{9b}31m\\u{7f}\\u{0}"),
            ("\u{202e}gnp.exe\u{2066}\u{200f}", "\\u{202e}gnp.exe\\u{2066}\\u{200f}"),
            ("Größe 日本 é \"\\\" 🦀", "Größe 日本 é \"\\\" 🦀"),
        ] {
            assert_eq!(escape_control(text), expected);
        }
        assert!(matches!(escape_control("plain"), Cow::Borrowed("plain")));
        assert_eq!(escape_control_in_lines("a\n\tb\u{1b}\n"), "a\n\tb\\u{1b}\n");
    }
}
