//! Key paths of values, and the quoting of names in messages.

use std::borrow::Cow;
use std::fmt::{self, Write as _};

/// Maximum length of a value or key in a message, in characters.
const MAX_VALUE_LEN: usize = 60;

/// Returns a value or key for a message, with the middle elided if the text is long.
pub fn cut(text: &str) -> Cow<'_, str> {
    cut_to(MAX_VALUE_LEN, text)
}

/// Elides the middle of a text that is longer than `max_len` characters.
pub fn cut_to(max_len: usize, text: &str) -> Cow<'_, str> {
    let count = text.chars().count();
    if count <= max_len {
        return text.into();
    }
    let kept_len = max_len - 3;
    let start: String = text.chars().take(kept_len - kept_len / 3).collect();
    let end: String = text.chars().skip(count - kept_len / 3).collect();
    format!("{start}...{end}").into()
}

/// Formats up to 24 names as `"a", "b", "c"`, and the number of the remaining names.
pub fn list<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    listed(names, 24)
}

/// Formats up to `max` names, and the number of the remaining names.
pub fn listed<S: AsRef<str>>(names: impl IntoIterator<Item = S>, max: usize) -> String {
    let mut text = String::new();
    let mut names = names.into_iter();
    for name in names.by_ref().take(max) {
        let comma = if text.is_empty() { "" } else { ", " };
        // Writing to a String cannot fail.
        let _ = write!(text, "{comma}{:?}", cut(name.as_ref()));
    }
    match names.count() {
        0 => text,
        remaining => format!("{text} and {remaining} more"),
    }
}

/// Maximum number of segments of a key path that are printed.
const MAX_SEGMENTS: usize = 20;

/// The key path of a value: `shapes[2].size`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyPath(pub Vec<Segment>);

/// A segment of a [`KeyPath`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Segment {
    /// A key of a table.
    Key(String),
    /// An index into a list.
    Index(usize),
}

impl From<&str> for Segment {
    fn from(key: &str) -> Self {
        Segment::Key(key.to_owned())
    }
}

impl From<usize> for Segment {
    fn from(index: usize) -> Self {
        Segment::Index(index)
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let end = self.0.len().saturating_sub(MAX_SEGMENTS / 2);
        for (i, segment) in self.0.iter().enumerate() {
            if self.0.len() > MAX_SEGMENTS && (MAX_SEGMENTS / 2..end).contains(&i) {
                if i == MAX_SEGMENTS / 2 {
                    f.write_str("...")?;
                }
                continue;
            }
            match segment {
                Segment::Index(index) => write!(f, "[{index}]")?,
                Segment::Key(key) => {
                    if i > 0 {
                        f.write_str(".")?;
                    }
                    let elided = cut(key);
                    if !key.is_empty() && key.chars().all(is_bare) {
                        f.write_str(&elided)?;
                    } else {
                        write!(f, "{elided:?}")?;
                    }
                }
            }
        }
        Ok(())
    }
}

impl KeyPath {
    /// Formats the complete path as in a scene file. Parsing the result returns the same path.
    pub fn exact(&self) -> String {
        let mut text = String::new();
        for segment in &self.0 {
            match segment {
                Segment::Index(index) => text.push_str(&format!("[{index}]")),
                Segment::Key(key) => {
                    if !text.is_empty() {
                        text.push('.');
                    }
                    text.push_str(&toml_key(key));
                }
            }
        }
        text
    }
}

/// Formats a key as in TOML: bare or quoted.
fn toml_key(key: &str) -> Cow<'_, str> {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(is_bare) {
        return key.into();
    }
    let escaped = key.chars().map(|c| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04X}", c as u32),
        c => c.to_string(),
    });
    format!("\"{}\"", escaped.collect::<String>()).into()
}
