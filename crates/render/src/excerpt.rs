//! Excerpts of source text for messages: a numbered, marked line.

/// Prefix of the lines of an excerpt that have no line number.
pub const NO_NUMBER: &str = "      |";
/// Maximum width of a printed line, in characters.
const WIDTH: usize = 160;
/// Number of characters before the marks in a truncated line.
const CONTEXT: usize = 60;

/// Returns a line with its line number, which counts from 1. Truncates a long line.
pub fn numbered(number: usize, line: &str) -> String {
    let (printed, _) = window(line, 0);
    format!("{number:>5} | {printed}").trim_end().to_string()
}

/// Returns a numbered line with marks below `length` characters from `start`. Truncates a long line around the marks.
pub fn marked(number: usize, line: &str, start: usize, length: usize) -> String {
    let (printed, mark) = window(line, start);
    let available = printed.chars().count().saturating_sub(mark).max(1);
    let (indent, marks) = (" ".repeat(mark), "^".repeat(length.clamp(1, available)));
    format!("{number:>5} | {printed}\n{NO_NUMBER} {indent}{marks}")
}

/// Returns the printed part of a line, and `position` relative to the start of this part.
fn window(line: &str, position: usize) -> (String, usize) {
    let count = line.chars().count();
    let position = position.min(count);
    let first = position.saturating_sub(CONTEXT).min(count.saturating_sub(WIDTH));
    let blank_control = |c: char| if c.is_control() { ' ' } else { c };
    let mut printed: Vec<char> = line.chars().skip(first).take(WIDTH).map(blank_control).collect();
    if first > 0 {
        printed[0] = '…';
    }
    if first + WIDTH < count {
        printed[WIDTH - 1] = '…';
    }
    (printed.into_iter().collect(), position - first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_lines_are_truncated_at_the_end() {
        assert_eq!(numbered(7, "a = b"), "    7 | a = b");
        assert_eq!(numbered(7, ""), "    7 |");
        let long = numbered(1, &"ab".repeat(5000));
        assert!(long.starts_with("    1 | abab") && long.ends_with('…') && long.chars().count() == 8 + WIDTH);
    }

    #[test]
    fn short_lines_are_not_truncated() {
        assert_eq!(marked(12, "a = é c", 4, 1), "   12 | a = é c\n      |     ^");
        assert_eq!(
            marked(1, "ab", 2, 1),
            "    1 | ab\n      |   ^",
            "after the last character"
        );
        assert_eq!(marked(1, "ab", 0, 99), "    1 | ab\n      | ^^");
        assert_eq!(
            marked(1, "\ta b", 1, 1),
            "    1 |  a b\n      |  ^",
            "a tab and its mark have different widths"
        );
    }

    #[test]
    fn long_lines_are_truncated_around_the_marks() {
        let line: String = (0..5000).map(|i| char::from(b'a' + (i % 26) as u8)).collect();
        for position in [
            0, 1, 59, 60, 61, 100, 158, 159, 160, 2500, 4838, 4839, 4840, 4998, 4999, 5000,
        ] {
            let excerpt = marked(1, &line, position, 3);
            let (printed, marks) = excerpt.split_once('\n').unwrap();
            let (printed, marks) = (&printed["    1 | ".len()..], &marks[NO_NUMBER.len() + 1..]);
            assert_eq!(printed.chars().count(), WIDTH);
            assert!(marks.chars().count() <= WIDTH + 1);
            let mark = marks.find('^').unwrap();
            let marked = printed.chars().nth(mark);
            assert_eq!(marked, line.chars().nth(position), "{position}: {excerpt}");
            assert_eq!(printed.starts_with('…'), position > CONTEXT, "{position}");
            assert_eq!(printed.ends_with('…'), position < 5000 - WIDTH + CONTEXT, "{position}");
        }
    }
}
