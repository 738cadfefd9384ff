//! `--frames`: which frames are rendered, and the names of what each of them writes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::cli::Usage;

/// The largest number of a frame, and the most frames of a run: their names are all looked at before the first is rendered.
pub const LARGEST: u32 = 999_999_999;
const MOST: usize = 100_000;

/// Frames in the order in which they are named, each once: `5`, `1-10`, `1-10:2`, `1-3,7`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(Vec<u32>);

impl Frames {
    /// As many, from 1 on.
    pub fn first(count: u32) -> Frames {
        Frames((1..=count).collect())
    }

    /// The same frames in rising order, as few ranges: the first and the last of each, and the step.
    pub fn ranges(&self) -> Vec<(u32, u32, u32)> {
        let mut sorted = self.0.clone();
        sorted.sort_unstable();
        let (mut ranges, mut rest) = (Vec::new(), sorted.as_slice());
        while let [first, more @ ..] = rest {
            let step = more.first().map_or(1, |next| next - first);
            let mut count = 1;
            while rest.get(count).is_some_and(|next| *next - rest[count - 1] == step) {
                count += 1;
            }
            if count == 2 && step > 1 {
                count = 1; // the second may begin a range of another step
            }
            let range = &rest[..count];
            ranges.push((*first, range[count - 1], if count > 1 { step } else { 1 }));
            rest = &rest[count..];
        }
        ranges
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The one in the middle.
    pub fn middle(&self) -> Option<u32> {
        self.0.get(self.0.len() / 2).copied()
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Frames, String> {
        let mut frames = Vec::new();
        let mut known = BTreeSet::new();
        for part in text.split(',') {
            for frame in range(part.trim())? {
                if known.insert(frame) {
                    frames.push(frame);
                }
                if frames.len() > MOST {
                    return Err(format!("must be {MOST} frames at most"));
                }
            }
        }
        Ok(Frames(frames))
    }
}

/// `A`, `A-B` or `A-B:STEP`.
fn range(text: &str) -> Result<impl Iterator<Item = u32>, String> {
    let (ends, step) = match text.split_once(':') {
        Some((ends, step)) => (ends, Some(number(step)?)),
        None => (text, None),
    };
    let (first, last) = match ends.split_once('-') {
        Some((first, last)) => (number(first)?, number(last)?),
        None if step.is_some() => return Err(format!("{text} must have two ends, such as {ends}-100:2")),
        None => (number(ends)?, number(ends)?),
    };
    if first > last {
        return Err(format!("{text} must go upwards, from {last} to {first}"));
    }
    match step {
        Some(0) => Err(format!("{text} must have a step of 1 or more")),
        step => Ok((first..=last).step_by(step.unwrap_or(1) as usize)),
    }
}

fn number(text: &str) -> Result<u32, String> {
    let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let number = text.parse().ok().filter(|number| is_number && *number <= LARGEST);
    let rule = format!("must be whole numbers from 0 to {LARGEST}, such as 5, 1-10, 1-10:2 or 1-3,7");
    number.ok_or_else(|| match text {
        "" => rule,
        text => format!("{text}: {rule}"),
    })
}

/// One of the pictures of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Its number; none without `--frames`.
    pub number: Option<u32>,
    /// Which of all it is, from 1, and how many there are.
    pub place: (usize, usize),
}

impl Frame {
    /// All pictures of a run: one, if no frames are asked for.
    pub fn all(frames: Option<&Frames>) -> Vec<Frame> {
        let numbers = match frames {
            Some(frames) => frames.0.iter().copied().map(Some).collect(),
            None => vec![None],
        };
        let frame = |(i, number): (usize, &Option<u32>)| Frame {
            number: *number,
            place: (i + 1, numbers.len()),
        };
        numbers.iter().enumerate().map(frame).collect()
    }

    /// One by itself.
    pub fn one(number: Option<u32>) -> Frame {
        Frame { number, place: (1, 1) }
    }

    /// A file's name with the frame's number in place of its `#`, with zeros in front up to their count. Folders keep theirs.
    /// Where there are several frames, a name must tell them apart; `option` is what the name is of, in messages.
    pub fn name(&self, option: &str, pattern: &Path) -> Result<PathBuf, Usage> {
        let Some(number) = self.number else {
            return Ok(pattern.to_owned());
        };
        let refused = |rule: &str| Err(Usage(format!("{option}: {}: {rule}", pattern.display())));
        let name = pattern.file_name().unwrap_or_default();
        let has_mark = name.as_encoded_bytes().contains(&b'#');
        let count = self.place.1;
        if !has_mark && count == 1 {
            return Ok(pattern.to_owned());
        }
        if !has_mark {
            return refused(&format!(
                "must have # for the frame's number in its name, as in out.####.png, as there are {count} frames"
            ));
        }
        let Some(name) = name.to_str() else {
            return refused("must be UTF-8 for # to be the frame's number");
        };
        let marks = name.trim_start_matches(|c| c != '#').trim_end_matches(|c| c != '#');
        if marks.bytes().any(|byte| byte != b'#') {
            return refused("must have all its # in one place");
        }
        let width = marks.len();
        let name = name.replacen(marks, &format!("{number:0width$}"), 1);
        Ok(pattern.with_file_name(name))
    }

    /// What messages call it, if it is one of several.
    pub fn label(&self) -> Option<String> {
        let (place, count) = self.place;
        let number = self.number.filter(|_| count > 1)?;
        Some(format!("frame {number} ({place} of {count})"))
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
        for (text, wanted) in [
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
            assert_eq!(frames(text).unwrap(), wanted, "{text}");
        }
        assert_eq!(frames("1-100000").unwrap().len(), 100_000);
        assert_eq!(frames("0-999999999:10000").unwrap().len(), 100_000);
    }

    #[test]
    fn frames_are_told_in_few_ranges() {
        for (text, wanted) in [
            ("5", vec![(5, 5, 1)]),
            ("1-4", vec![(1, 4, 1)]),
            ("9,1-7:2", vec![(1, 9, 2)]),
            ("1-10:9", vec![(1, 1, 1), (10, 10, 1)]),
            ("3,1-2,7,9,11", vec![(1, 3, 1), (7, 11, 2)]),
            ("1,5,6,7", vec![(1, 1, 1), (5, 7, 1)]),
            ("0,999999999", vec![(0, 0, 1), (999_999_999, 999_999_999, 1)]),
        ] {
            let frames: Frames = text.parse().unwrap();
            assert_eq!(frames.ranges(), wanted, "{text}");
            let all = wanted
                .into_iter()
                .flat_map(|(first, last, step)| (first..=last).step_by(step as usize));
            let mut sorted = frames.0.clone();
            sorted.sort_unstable();
            assert_eq!(all.collect::<Vec<_>>(), sorted, "{text}");
        }
    }

    #[test]
    fn what_is_no_range_of_frames_is_told() {
        for (text, told) in [
            ("", "must be whole numbers from 0 to 999999999"),
            ("1,,2", "must be whole numbers"),
            ("-5", "must be whole numbers"),
            ("-5-5", "must be whole numbers"),
            ("1-", "must be whole numbers"),
            ("1-2-3", "2-3: must be whole numbers"),
            ("+1", "+1: must be whole numbers"),
            ("1.5", "1.5: must be whole numbers"),
            ("a", "a: must be whole numbers"),
            ("1000000000", "1000000000: must be whole numbers"),
            ("99999999999999999999", "99999999999999999999: must be"),
            ("1-10:", "must be whole numbers"),
            ("1-10:2:3", "2:3: must be whole numbers"),
            ("1-10:-1", "-1: must be whole numbers"),
            ("1-10:0", "1-10:0 must have a step of 1 or more"),
            ("5:2", "5:2 must have two ends"),
            ("10-1", "10-1 must go upwards, from 1 to 10"),
            ("0-999999999", "must be 100000 frames at most"),
            ("1-100000,0", "must be 100000 frames at most"),
        ] {
            let message = frames(text).unwrap_err();
            assert!(message.starts_with(told), "{text}: {message}");
        }
    }

    #[test]
    fn numbers_take_the_place_of_their_marks() {
        let one = |number, count| Frame {
            number: Some(number),
            place: (1, count),
        };
        let name = |frame: Frame, pattern: &str| {
            let name = frame.name("--output", Path::new(pattern));
            name.map(|name| name.display().to_string())
                .map_err(|error| error.to_string())
        };
        for (number, pattern, wanted) in [
            (7, "out.####.png", "out.0007.png"),
            (7, "#.png", "7.png"),
            (12345, "##", "12345"),
            (0, "a/b#c/x##y.exr", "a/b#c/x00y.exr"),
            (3, "-###", "-003"),
            (3, "é#.png", "é3.png"),
        ] {
            assert_eq!(name(one(number, 2), pattern).unwrap(), wanted);
            assert_eq!(name(one(number, 1), pattern).unwrap(), wanted);
        }
        let bad = "--output: a#/out.png: must have # for the frame's number in its name, as in out.####.png, as there are 2 frames";
        assert_eq!(name(one(1, 2), "a#/out.png").unwrap_err(), bad);
        assert_eq!(name(one(1, 1), "a#/out.png").unwrap(), "a#/out.png");
        assert!(name(one(1, 2), "-").is_err());
        assert!(
            name(one(1, 2), "a#b#")
                .unwrap_err()
                .ends_with("must have all its # in one place")
        );
        let none = Frame {
            number: None,
            place: (1, 1),
        };
        assert_eq!(name(none, "a#b##").unwrap(), "a#b##");
    }
}
