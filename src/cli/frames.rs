//! `--frames`: the frames to render, and the names of their files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::cli::Usage;

/// Largest frame number.
pub const MAX_NUMBER: u32 = 999_999_999;
/// Maximum number of frames. It is limited because all file names are checked before rendering.
const MAX_COUNT: usize = 100_000;

/// Frame numbers in the order given, without duplicates: `5`, `1-10`, `1-10:2`, `1-3,7`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(Vec<u32>);

impl Frames {
    /// Returns the frames from 1 to `count`.
    pub fn first(count: u32) -> Frames {
        Frames((1..=count).collect())
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Frames, String> {
        let mut frames = Vec::new();
        let mut unique_frames = BTreeSet::new();
        for part in text.split(',') {
            for frame in range(part.trim())? {
                if unique_frames.insert(frame) {
                    frames.push(frame);
                }
                if frames.len() > MAX_COUNT {
                    return Err(format!("must be at most {MAX_COUNT} frames"));
                }
            }
        }
        Ok(Frames(frames))
    }
}

/// Parses `A`, `A-B` or `A-B:STEP`.
fn range(text: &str) -> Result<impl Iterator<Item = u32>, String> {
    let (bounds, step) = match text.split_once(':') {
        Some((bounds, step)) => (bounds, Some(number(step)?)),
        None => (text, None),
    };
    let (first, last) = match bounds.split_once('-') {
        Some((first, last)) => (number(first)?, number(last)?),
        None if step.is_some() => return Err(format!("{text} needs a range before the step, such as {bounds}-100:2")),
        None => (number(bounds)?, number(bounds)?),
    };
    if first > last {
        return Err(format!("{text} must be in ascending order, {last}-{first}"));
    }
    match step {
        Some(0) => Err(format!("{text} needs a step of at least 1")),
        step => Ok((first..=last).step_by(step.unwrap_or(1) as usize)),
    }
}

fn number(text: &str) -> Result<u32, String> {
    let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let number = text.parse().ok().filter(|number| is_number && *number <= MAX_NUMBER);
    let rule = format!("frames and steps are whole numbers from 0 to {MAX_NUMBER}, such as 5, 1-10, 1-10:2 or 1-3,7");
    number.ok_or_else(|| match text {
        "" => rule,
        text => format!("{text}: {rule}"),
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The frame number; `None` if `--frames` is not given.
    pub number: Option<u32>,
    /// Position in the run, counted from 1, and the number of frames.
    pub position: (usize, usize),
}

impl Frame {
    /// Returns the frames of a run: a single frame without a number if `frames` is `None`.
    pub fn all(frames: Option<&Frames>) -> Vec<Frame> {
        let numbers = match frames {
            Some(frames) => frames.0.iter().copied().map(Some).collect(),
            None => vec![None],
        };
        let frame = |(i, number): (usize, &Option<u32>)| Frame {
            number: *number,
            position: (i + 1, numbers.len()),
        };
        numbers.iter().enumerate().map(frame).collect()
    }

    pub fn single(number: Option<u32>) -> Frame {
        Frame {
            number,
            position: (1, 1),
        }
    }

    /// Replaces a group of `#` in the file name with the frame number, zero-padded to the length of the group. If there
    /// are several frames, the name must contain a group, so that the names differ. Error messages contain `option`.
    pub fn name(&self, option: &str, pattern: &Path) -> Result<PathBuf, Usage> {
        let Some(number) = self.number else {
            return Ok(pattern.to_owned());
        };
        let error = |rule: &str| Err(Usage(format!("{option}: {}: {rule}", pattern.display())));
        let name = pattern.file_name().unwrap_or_default();
        let has_mark = name.as_encoded_bytes().contains(&b'#');
        let count = self.position.1;
        if !has_mark && count == 1 {
            return Ok(pattern.to_owned());
        }
        if !has_mark {
            return error(&format!(
                "needs # for the frame number, such as out.####.png, with {count} frames"
            ));
        }
        let Some(name) = name.to_str() else {
            return error("must be UTF-8 to contain a frame number");
        };
        let marks = name.trim_start_matches(|c| c != '#').trim_end_matches(|c| c != '#');
        if marks.bytes().any(|byte| byte != b'#') {
            return error("must have a single group of #");
        }
        let width = marks.len();
        let name = name.replacen(marks, &format!("{number:0width$}"), 1);
        Ok(pattern.with_file_name(name))
    }

    /// Returns a label if this is one of several frames.
    pub fn label(&self) -> Option<String> {
        let (position, count) = self.position;
        let number = self.number.filter(|_| count > 1)?;
        Some(format!("frame {number} ({position} of {count})"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str) -> Result<Vec<u32>, String> {
        text.parse::<Frames>().map(|frames| frames.0)
    }

    #[test]
    fn frames_are_lists_of_ranges_with_steps() {
        for (text, expected) in [
            ("5", vec![5]),
            ("0", vec![0]),
            ("007", vec![7]),
            ("1-4", vec![1, 2, 3, 4]),
            ("3-3", vec![3]),
            ("1-10:2", vec![1, 3, 5, 7, 9]),
            ("1-10:3", vec![1, 4, 7, 10]),
            ("1-10:9", vec![1, 10]),
            ("1-10:10", vec![1]),
            ("1-10:999999999", vec![1]),
            ("1-3,7", vec![1, 2, 3, 7]),
            ("7,1-3, 2-4", vec![7, 1, 2, 3, 4]),
            ("999999998-999999999", vec![999_999_998, 999_999_999]),
        ] {
            assert_eq!(frames(text).unwrap(), expected, "{text}");
        }
        assert_eq!(frames("1-100000").unwrap().len(), 100_000);
        assert_eq!(frames("0-999999999:10000").unwrap().len(), 100_000);
    }

    #[test]
    fn invalid_ranges_are_rejected() {
        for (text, message) in [
            ("", "frames and steps are whole numbers from 0 to 999999999"),
            ("1,,2", "frames and steps are whole numbers"),
            ("-5", "frames and steps are whole numbers"),
            ("-5-5", "frames and steps are whole numbers"),
            ("1-", "frames and steps are whole numbers"),
            ("1-2-3", "2-3: frames and steps are whole numbers"),
            ("+1", "+1: frames and steps are whole numbers"),
            ("1.5", "1.5: frames and steps are whole numbers"),
            ("a", "a: frames and steps are whole numbers"),
            ("1000000000", "1000000000: frames and steps are whole numbers"),
            (
                "99999999999999999999",
                "99999999999999999999: frames and steps are whole numbers",
            ),
            ("1-10:", "frames and steps are whole numbers"),
            ("1-10:2:3", "2:3: frames and steps are whole numbers"),
            ("1-10:-1", "-1: frames and steps are whole numbers"),
            ("1-10:0", "1-10:0 needs a step of at least 1"),
            ("5:2", "5:2 needs a range before the step"),
            ("10-1", "10-1 must be in ascending order, 1-10"),
            ("0-999999999", "must be at most 100000 frames"),
            ("1-100000,0", "must be at most 100000 frames"),
        ] {
            let error = frames(text).unwrap_err();
            assert!(error.starts_with(message), "{text}: {error}");
        }
    }

    #[test]
    fn number_signs_are_replaced_by_the_frame_number() {
        let frame = |number, count| Frame {
            number: Some(number),
            position: (1, count),
        };
        let name = |frame: Frame, pattern: &str| {
            let name = frame.name("--output", Path::new(pattern));
            name.map(|name| name.display().to_string())
                .map_err(|error| error.to_string())
        };
        for (number, pattern, expected) in [
            (7, "out.####.png", "out.0007.png"),
            (7, "#.png", "7.png"),
            (12345, "##", "12345"),
            (0, "a/b#c/x##y.exr", "a/b#c/x00y.exr"),
            (3, "-###", "-003"),
            (3, "é#.png", "é3.png"),
        ] {
            assert_eq!(name(frame(number, 2), pattern).unwrap(), expected);
            assert_eq!(name(frame(number, 1), pattern).unwrap(), expected);
        }
        let message = "--output: a#/out.png: needs # for the frame number, such as out.####.png, with 2 frames";
        assert_eq!(name(frame(1, 2), "a#/out.png").unwrap_err(), message);
        assert_eq!(name(frame(1, 1), "a#/out.png").unwrap(), "a#/out.png");
        assert!(name(frame(1, 2), "-").is_err());
        assert!(
            name(frame(1, 2), "a#b#")
                .unwrap_err()
                .ends_with("must have a single group of #")
        );
        let without_number = Frame {
            number: None,
            position: (1, 1),
        };
        assert_eq!(name(without_number, "a#b##").unwrap(), "a#b##");
    }
}
