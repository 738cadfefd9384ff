//! Escaping of untrusted text for terminals: control characters and direction marks are printed as escapes such as
//! `\u{1b}`.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Returns true for control characters and direction marks (Unicode UAX 9).
fn acts(c: char) -> bool {
    let turns = ['\u{61c}', '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}'];
    c.is_control()
        || turns.contains(&c)
        || ('\u{202a}'..='\u{202e}').contains(&c)
        || ('\u{2066}'..='\u{2069}').contains(&c)
}

/// Escapes text, including line breaks.
pub fn escape_control(text: &str) -> Cow<'_, str> {
    shown(text, &[])
}

/// Escapes text with several lines; line breaks and tabs are kept.
pub fn escape_control_in_lines(text: &str) -> Cow<'_, str> {
    shown(text, &['\n', '\t'])
}

fn shown<'a>(text: &'a str, kept: &[char]) -> Cow<'a, str> {
    let is_shown = |c: char| !acts(c) || kept.contains(&c);
    if text.chars().all(is_shown) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match is_shown(c) {
            true => shown.push(c),
            false => drop(write!(shown, "{}", c.escape_default())),
        }
    }
    shown.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_acts_on_a_terminal_is_shown() {
        for (text, wanted) in [
            ("a\u{1b}[31mb", "a\\u{1b}[31mb"),
            ("a\nerror: b\t\r", "a\\nerror: b\\t\\r"),
            ("\u{9b}31m\u{7f}\0", "\\u{9b}31m\\u{7f}\\u{0}"),
            ("\u{202e}gnp.exe\u{2066}\u{200f}", "\\u{202e}gnp.exe\\u{2066}\\u{200f}"),
            ("Größe 日本 é \"\\\" 🦀", "Größe 日本 é \"\\\" 🦀"),
        ] {
            assert_eq!(escape_control(text), wanted);
        }
        assert!(matches!(escape_control("plain"), Cow::Borrowed("plain")));
        assert_eq!(escape_control_in_lines("a\n\tb\u{1b}\n"), "a\n\tb\\u{1b}\n");
    }
}
