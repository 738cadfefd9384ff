//! Tokenizer of text formats: words with their line numbers.

use std::borrow::Cow;

use super::error::{Location, MeshFault, quoted};

/// Returns the text as UTF-8; UTF-16 with a byte order mark is converted.
pub(super) fn utf8(bytes: &[u8]) -> Cow<'_, [u8]> {
    let unit: fn([u8; 2]) -> u16 = match bytes {
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        _ => return Cow::Borrowed(bytes),
    };
    let (pairs, _) = bytes[2..].as_chunks::<2>();
    let text = char::decode_utf16(pairs.iter().map(|pair| unit(*pair)));
    let text: String = text.map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    Cow::Owned(text.into_bytes())
}

/// A text, which is split into words at blanks. `#` at the start of a word begins a comment. A backslash at the end of
/// a line joins the next line to the line.
pub(super) struct Tokens<'a> {
    bytes: &'a [u8],
    offset: usize,
    line: usize,
    /// Line terminator.
    terminator: u8,
}

impl<'a> Tokens<'a> {
    pub fn new(bytes: &'a [u8]) -> Tokens<'a> {
        let offset = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 }; // UTF-8 byte order mark
        // Old Mac texts only have carriage returns.
        let terminator = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
        Tokens {
            bytes,
            offset,
            line: 1,
            terminator,
        }
    }

    #[inline]
    pub fn next_on_line(&mut self) -> Option<&'a [u8]> {
        self.find_on_line().then(|| self.take_word())
    }

    /// Advances to the next word of the line. Returns false if the line has no further word.
    #[inline]
    fn find_on_line(&mut self) -> bool {
        loop {
            match self.bytes.get(self.offset) {
                None | Some(b'#') => return false,
                Some(byte) if *byte <= b' ' => {
                    if *byte == self.terminator {
                        return false;
                    }
                    self.offset += 1;
                }
                Some(b'\\') => match self.continuation(self.offset) {
                    Some(next) => {
                        self.line += usize::from(self.bytes[next - 1] == self.terminator);
                        self.offset = next;
                    }
                    None => return true,
                },
                Some(_) => return true,
            }
        }
    }

    fn take_word(&mut self) -> &'a [u8] {
        let start = self.offset;
        while let Some(byte) = self.bytes.get(self.offset) {
            if *byte <= b' ' || (*byte == b'\\' && self.continuation(self.offset).is_some()) {
                break;
            }
            self.offset += 1;
        }
        &self.bytes[start..self.offset]
    }

    /// Returns the start of the next line if the backslash joins that line.
    fn continuation(&self, backslash: usize) -> Option<usize> {
        match self.bytes[backslash + 1..] {
            [] => Some(backslash + 1),
            [byte, ..] if byte == self.terminator => Some(backslash + 2),
            [b'\r', b'\n', ..] => Some(backslash + 3),
            _ => None,
        }
    }

    #[inline]
    pub fn next_word(&mut self) -> Option<&'a [u8]> {
        self.find_next_word().then(|| self.take_word())
    }

    /// Advances to the next word. Returns false at the end of the text.
    #[inline]
    pub fn find_next_word(&mut self) -> bool {
        while !self.find_on_line() {
            if !self.skip_line() {
                return false;
            }
        }
        true
    }

    /// Returns the rest of the line; words are separated by single blanks. Names may contain `#`.
    pub fn name(&mut self) -> String {
        let mut name = String::new();
        loop {
            let word = match self.next_on_line() {
                Some(word) => word,
                None if self.bytes.get(self.offset) == Some(&b'#') => self.take_word(),
                None => return name,
            };
            if !name.is_empty() {
                name.push(' ');
            }
            name.push_str(&String::from_utf8_lossy(word));
        }
    }

    /// Advances to the next line. Returns false at the end of the text.
    #[inline]
    pub fn next_line(&mut self) -> bool {
        while self.next_on_line().is_some() {}
        self.skip_line()
    }

    /// Advances to the next line, even if the line ends with a backslash.
    pub fn skip_line(&mut self) -> bool {
        let rest = &self.bytes[self.offset..];
        match rest.iter().position(|byte| *byte == self.terminator) {
            Some(end) => {
                self.offset += end + 1;
                self.line += 1;
                self.offset < self.bytes.len()
            }
            None => {
                self.offset = self.bytes.len();
                false
            }
        }
    }

    /// Advances to the end of the line. Returns true if words were skipped.
    pub fn skip_rest(&mut self) -> bool {
        let has_more = self.next_on_line().is_some();
        while self.next_on_line().is_some() {}
        has_more
    }

    /// Returns the number of non-blank lines left.
    pub fn lines_left(&self) -> usize {
        let lines = self.bytes[self.offset..].split(|byte| *byte == self.terminator);
        lines.filter(|line| line.iter().any(|byte| *byte > b' ')).count()
    }

    /// Reads a number from the line. `name` is the name of the number in errors.
    #[inline]
    pub fn number(&mut self, name: &str) -> Result<f64, MeshFault> {
        match self.next_on_line() {
            Some(word) => number(word).ok_or_else(|| self.fault(format!("{name}: {} must be a number", quoted(word)))),
            None => Err(self.fault(format!("{name} is missing"))),
        }
    }

    pub fn offset(&self) -> usize {
        self.offset
    }

    /// Returns the number of bytes left.
    pub fn bytes_left(&self) -> usize {
        self.bytes.len() - self.offset
    }

    pub fn location(&self) -> Location {
        Location::Line(self.line)
    }

    pub fn line(&self) -> usize {
        self.line
    }

    pub fn fault(&self, message: impl Into<String>) -> MeshFault {
        self.location().fault(message)
    }
}

#[inline]
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<(usize, Vec<String>)> {
        let mut words = Tokens::new(text.as_bytes());
        let mut lines = Vec::new();
        loop {
            let mut line = Vec::new();
            while let Some(word) = words.next_on_line() {
                line.push(String::from_utf8_lossy(word).into_owned());
            }
            let Location::Line(number) = words.location() else {
                unreachable!("a text has lines")
            };
            if !line.is_empty() {
                lines.push((number, line));
            }
            if !words.next_line() {
                return lines;
            }
        }
    }

    fn line(number: usize, words: &str) -> (usize, Vec<String>) {
        (number, words.split(' ').map(str::to_string).collect())
    }

    #[test]
    fn lines_are_split_into_words() {
        assert_eq!(lines("a  b\t\r\n\n c"), [line(1, "a b"), line(3, "c")]);
        assert_eq!(lines("\u{feff}a\n"), [line(1, "a")]);
        assert_eq!(lines("\n\n"), []);
        // Line terminators of old Macs.
        assert_eq!(lines("a b\r\rc # d\re"), [line(1, "a b"), line(3, "c"), line(4, "e")]);
        assert_eq!(lines("a\rb\n"), [line(1, "a b")]);
    }

    #[test]
    fn a_backslash_joins_lines() {
        assert_eq!(lines("a \\\nb\\\r\nc\nd"), [line(3, "a b c"), line(4, "d")]);
        assert_eq!(lines("a\\b \\ \nc\\"), [line(1, "a\\b \\"), line(2, "c")]);
        assert_eq!(lines("a \\\rb\rc\\"), [line(2, "a b"), line(3, "c")]);
    }

    #[test]
    fn comments_end_a_line() {
        assert_eq!(lines("# a \\\nb # c\nd#e\n#\n"), [line(2, "b"), line(3, "d#e")]);
    }

    #[test]
    fn names_may_contain_blanks_and_number_signs() {
        let mut words = Tokens::new(b"usemtl  dark   red #2 \r\nusemtl #3");
        assert_eq!(words.next_on_line(), Some(&b"usemtl"[..]));
        assert_eq!(words.name(), "dark red #2");
        assert_eq!(words.next_word(), Some(&b"usemtl"[..]));
        assert_eq!(words.name(), "#3");
        assert_eq!(words.next_word(), None);
    }
}
