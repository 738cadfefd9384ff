//! Excerpts of source text for messages: a numbered, marked line.

/// Prefix of the lines of an excerpt that have no line number.
pub const NO_NUMBER: &str = "      |";
const WIDTH: usize = 160;
/// Number of characters before the marked location in a truncated line.
const BEFORE: usize = 60;

/// Returns a line with its line number, which counts from 1. Truncates a long line.
pub fn numbered(number: usize, line: &str) -> String {
    let (part, _) = window(line, 0);
    format!("{number:>5} | {part}").trim_end().to_string()
}

/// Returns a numbered line with marks below `length` characters from `start`. Truncates a long line around the marks.
pub fn marked(number: usize, line: &str, start: usize, length: usize) -> String {
    let (part, at) = window(line, start);
    let room = part.chars().count().saturating_sub(at).max(1);
    let (indent, marks) = (" ".repeat(at), "^".repeat(length.clamp(1, room)));
    format!("{number:>5} | {part}\n{NO_NUMBER} {indent}{marks}")
}

/// Returns the printed part of a line, and the position of `place` in it.
fn window(line: &str, place: usize) -> (String, usize) {
    let count = line.chars().count();
    let place = place.min(count);
    let first = place.saturating_sub(BEFORE).min(count.saturating_sub(WIDTH));
    let one_wide = |c: char| if c.is_control() { ' ' } else { c };
    let mut part: Vec<char> = line.chars().skip(first).take(WIDTH).map(one_wide).collect();
    if first > 0 {
        part[0] = '…';
    }
    if first + WIDTH < count {
        part[WIDTH - 1] = '…';
    }
    (part.into_iter().collect(), place - first)
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
        for place in [
            0, 1, 59, 60, 61, 100, 158, 159, 160, 2500, 4838, 4839, 4840, 4998, 4999, 5000,
        ] {
            let excerpt = marked(1, &line, place, 3);
            let (shown, marks) = excerpt.split_once('\n').unwrap();
            let (shown, marks) = (&shown["    1 | ".len()..], &marks[NO_NUMBER.len() + 1..]);
            assert_eq!(shown.chars().count(), WIDTH);
            assert!(marks.chars().count() <= WIDTH + 1);
            let at = marks.find('^').unwrap();
            let marked = shown.chars().nth(at);
            assert_eq!(marked, line.chars().nth(place), "{place}: {excerpt}");
            assert_eq!(shown.starts_with('…'), place > BEFORE, "{place}");
            assert_eq!(shown.ends_with('…'), place < 5000 - WIDTH + BEFORE, "{place}");
        }
    }
}
