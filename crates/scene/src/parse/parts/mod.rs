//! Splits scene files into parts that are parsed one at a time, because parsing needs about 30 times the memory of the
//! text. A part is a table of `[[shapes]]`, `[[lights]]`, `[materials.NAME]`, `[textures.NAME]`, `[meshes.NAME]` or
//! `[[instances]]`; all other text is parsed together.

use std::borrow::Cow;
use std::ops::Range;

use toml::de::Error;
use toml::{Table, Value};
use toml_parser::Source;
use toml_parser::lexer::{Token, TokenKind};

use super::syntax::{explain, syntax_error};
use crate::error::SceneError;
use crate::key_path::{KeyPath, Segment};

/// Maximum size in bytes of a part, and of a file that must be parsed as a whole.
pub const MAX_PART_BYTES: usize = 4 << 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Textures,
    Materials,
    Lights,
    Shapes,
    Meshes,
    Instances,
}

impl Kind {
    pub const ALL: [Kind; 6] = [
        Kind::Textures,
        Kind::Materials,
        Kind::Lights,
        Kind::Shapes,
        Kind::Meshes,
        Kind::Instances,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Kind::Textures => "textures",
            Kind::Materials => "materials",
            Kind::Lights => "lights",
            Kind::Shapes => "shapes",
            Kind::Meshes => "meshes",
            Kind::Instances => "instances",
        }
    }

    /// Returns true if the tables of this section have names.
    fn is_map(self) -> bool {
        matches!(self, Kind::Textures | Kind::Materials | Kind::Meshes)
    }
}

/// A table and the subtables that follow it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    pub kind: Kind,
    /// Range in the text, including the header.
    pub range: Range<usize>,
}

/// The parts of a text. Each part is a standalone TOML document.
pub struct Parts<'a> {
    pub text: &'a str,
    pub parts: Cow<'a, [Part]>,
}

/// An error in the text of a scene file.
#[derive(Debug)]
pub struct SyntaxFault {
    /// Byte offset in the file.
    pub offset: usize,
    message: String,
    /// True if the message is from the TOML parser, with a known location.
    is_syntax: bool,
}

impl SyntaxFault {
    /// Converts an error in the document that starts at byte `start` of the file.
    pub fn of(start: usize, error: &Error) -> SyntaxFault {
        SyntaxFault {
            offset: start + error.span().map_or(0, |span| span.start),
            message: error.message().to_owned(),
            is_syntax: error.span().is_some(),
        }
    }

    fn too_large(offset: usize, message: String) -> SyntaxFault {
        SyntaxFault {
            offset,
            message,
            is_syntax: false,
        }
    }

    pub fn into_error(self, text: &str, origin: &str) -> SceneError {
        let message = match self.is_syntax {
            true => explain(text, self.offset, &self.message),
            false => self.message,
        };
        syntax_error(text, origin, self.offset, &message)
    }

    /// Returns the error for a file that must be parsed as a whole but is too large.
    pub fn file_too_large(text: &str) -> SyntaxFault {
        let size = text.len() as f64 / f64::from(1 << 20);
        let rule =
            "every texture, material, light, shape, mesh and instance must have its own header, such as [[shapes]]";
        let message = format!(
            "in a file larger than {} MiB, {rule}; this file has {size:.1} MiB",
            MAX_PART_BYTES >> 20
        );
        SyntaxFault::too_large(0, message)
    }
}

/// The text outside of the parts, as a standalone document.
#[derive(Default)]
pub struct Rest {
    pub text: String,
    /// The start offset of each piece, in this document and in the file.
    pieces: Vec<(usize, usize)>,
}

impl Rest {
    /// Converts a byte offset in this document to a byte offset in the file.
    pub fn file_offset(&self, offset: usize) -> usize {
        let next = self.pieces.partition_point(|(start, _)| *start <= offset);
        let (start, file_start) = next.checked_sub(1).map_or((0, 0), |last| self.pieces[last]);
        file_start + (offset - start)
    }
}

/// The name of a part, if any, and its table.
pub type NamedTable = (Option<String>, Table);

impl<'a> Parts<'a> {
    pub fn of(text: &'a str) -> Parts<'a> {
        let mut parts: Vec<Part> = Vec::new();
        // Keys of the header of the current part.
        let mut open_keys: Option<Vec<&str>> = None;
        for header in Headers::of(text) {
            let is_subtable = |keys: &Vec<&str>| header.keys.len() > keys.len() && header.keys.starts_with(keys);
            if open_keys.as_ref().is_some_and(is_subtable) {
                continue;
            }
            if let (Some(_), Some(part)) = (open_keys.take(), parts.last_mut()) {
                part.range.end = header.start;
            }
            let kind = Kind::ALL.into_iter().find(|kind| {
                let length = if kind.is_map() { 2 } else { 1 };
                header.is_array != kind.is_map()
                    && header.keys.len() == length
                    && header.keys.first() == Some(&kind.name())
            });
            if let Some(kind) = kind {
                let range = header.start..text.len();
                parts.push(Part { kind, range });
                open_keys = Some(header.keys);
            }
        }
        Parts {
            text,
            parts: parts.into(),
        }
    }

    pub fn rest(&self) -> Rest {
        let mut rest = Rest::default();
        let mut end = 0;
        let ranges = self.parts.iter().map(|part| part.range.clone());
        for range in ranges.chain(std::iter::once(self.text.len()..self.text.len())) {
            if end < range.start {
                rest.pieces.push((rest.text.len(), end));
                rest.text.push_str(&self.text[end..range.start]);
            }
            end = range.end;
        }
        rest
    }

    /// Returns an error if a part, or the text outside of the parts, is larger than [`MAX_PART_BYTES`].
    pub fn too_large(&self) -> Option<SyntaxFault> {
        let large = self.parts.iter().find(|part| part.range.len() > MAX_PART_BYTES);
        if let Some(part) = large {
            let message = format!("the table that starts here is larger than {} MiB", MAX_PART_BYTES >> 20);
            return Some(SyntaxFault::too_large(part.range.start, message));
        }
        let part_bytes: usize = self.parts.iter().map(|part| part.range.len()).sum();
        let rest_bytes = self.text.len() - part_bytes;
        (rest_bytes > MAX_PART_BYTES).then(|| SyntaxFault::file_too_large(self.text))
    }

    pub fn read_rest(&self) -> Result<Table, SyntaxFault> {
        let rest = self.rest();
        toml::from_str(&rest.text).map_err(|error| {
            let fault = SyntaxFault::of(0, &error);
            SyntaxFault {
                offset: rest.file_offset(fault.offset),
                ..fault
            }
        })
    }

    /// Parses a part; `None` if the part is not a single element of its section, so that the file must be parsed as a
    /// whole.
    pub fn read(&self, part: &Part) -> Result<Option<NamedTable>, SyntaxFault> {
        let document = toml::from_str(self.text(part)).map_err(|error| SyntaxFault::of(part.range.start, &error));
        let mut document: Table = document?;
        Ok(match document.remove(part.kind.name()) {
            Some(Value::Array(mut tables)) if tables.len() == 1 => match tables.pop() {
                Some(Value::Table(table)) => Some((None, table)),
                _ => None,
            },
            Some(Value::Table(tables)) if part.kind.is_map() && tables.len() == 1 => match tables.into_iter().next() {
                Some((name, Value::Table(table))) => Some((Some(name), table)),
                _ => None,
            },
            _ => None,
        })
    }

    /// Returns the TOML error of two parts with the same name.
    pub fn duplicate_name(&self, name: &str, part: &Part) -> Option<SyntaxFault> {
        let path = [part.kind.name(), name].map(Segment::from);
        let (first, _) = self.find(&KeyPath(path.to_vec()))?;
        let texts = [self.text(first), self.text(part)];
        let error = toml::from_str::<Table>(&texts.concat()).err()?;
        let offset = error.span().map_or(0, |span| span.start);
        let file_offset = match offset.checked_sub(texts[0].len()) {
            Some(offset) => part.range.start + offset,
            None => first.range.start + offset,
        };
        Some(SyntaxFault {
            offset: file_offset,
            ..SyntaxFault::of(0, &error)
        })
    }

    /// Returns the part that contains a path, and the path relative to the part.
    pub fn find(&self, path: &KeyPath) -> Option<(&Part, KeyPath)> {
        let [Segment::Key(first), second, rest @ ..] = path.0.as_slice() else {
            return None;
        };
        let mut parts = self.parts.iter().filter(|part| part.kind.name() == first);
        let (part, second) = match second {
            Segment::Index(index) => (parts.nth(*index)?, Segment::Index(0)),
            Segment::Key(name) => {
                let part = parts.find(|part| {
                    let lines = self.text[part.range.clone()].lines();
                    let header: Option<Table> = lines.take(1).find_map(|line| toml::from_str(line).ok());
                    let tables = header.and_then(|mut header| header.remove(first));
                    tables.is_some_and(|tables| tables.get(name).is_some())
                });
                (part?, Segment::Key(name.clone()))
            }
        };
        let start = [Segment::Key(first.clone()), second];
        Some((part, KeyPath(start.into_iter().chain(rest.iter().cloned()).collect())))
    }

    pub fn text(&self, part: &Part) -> &'a str {
        &self.text[part.range.clone()]
    }
}

/// A table header: `[a.b]` or `[[a.b]]`.
struct Header<'a> {
    start: usize,
    is_array: bool,
    keys: Vec<&'a str>,
}

/// The headers of a text, in order. Invalid headers are skipped.
struct Headers<'a, T: Iterator<Item = Token>> {
    text: &'a str,
    tokens: T,
    /// True if a statement may begin at the next token: at the start of the text, or on a new line.
    at_statement_start: bool,
}

impl<'a> Headers<'a, toml_parser::lexer::Lexer<'a>> {
    fn of(text: &'a str) -> Self {
        Headers {
            text,
            tokens: Source::new(text).lex(),
            at_statement_start: true,
        }
    }
}

impl<'a, T: Iterator<Item = Token>> Headers<'a, T> {
    fn header(&mut self, start: usize) -> Option<Header<'a>> {
        let mut keys = Vec::new();
        let mut brackets = [1, 0]; // numbers of opening and closing brackets
        for token in self.tokens.by_ref() {
            let (begin, end) = (token.span().start(), token.span().end());
            match token.kind() {
                TokenKind::LeftSquareBracket if keys.is_empty() && brackets[0] == 1 => brackets[0] = 2,
                TokenKind::RightSquareBracket => brackets[1] += 1,
                TokenKind::Atom | TokenKind::BasicString | TokenKind::LiteralString => {
                    keys.push(self.text.get(begin..end)?);
                }
                TokenKind::Dot | TokenKind::Whitespace => {}
                _ => return None,
            }
            if brackets[0] == brackets[1] {
                return Some(Header {
                    start,
                    is_array: brackets[0] == 2,
                    keys,
                });
            }
        }
        None
    }
}

impl<'a, T: Iterator<Item = Token>> Iterator for Headers<'a, T> {
    type Item = Header<'a>;

    fn next(&mut self) -> Option<Header<'a>> {
        let mut depth = 0_usize; // nesting depth of brackets in a value
        while let Some(token) = self.tokens.next() {
            match token.kind() {
                TokenKind::Newline if depth == 0 => self.at_statement_start = true,
                TokenKind::Whitespace | TokenKind::Newline | TokenKind::Comment => {}
                TokenKind::LeftSquareBracket if self.at_statement_start => {
                    self.at_statement_start = false;
                    match self.header(token.span().start()) {
                        Some(header) => return Some(header),
                        None => self.at_statement_start = true, // a line break in the header, or invalid text
                    }
                }
                TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => {
                    self.at_statement_start = false;
                    depth += 1;
                }
                TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => depth = depth.saturating_sub(1),
                _ => self.at_statement_start = false,
            }
        }
        None
    }
}

#[cfg(test)]
mod tests;
