//! The changes that this session made to the scene file, for undo and redo.

use wgray_scene::KeyPath;

/// Maximum number of steps.
const MOST: usize = 1000;

#[derive(Debug)]
pub struct Step {
    /// The changed key, for display.
    pub what: String,
    /// The table that contains the change.
    pub at: KeyPath,
    /// True if the camera was saved.
    pub is_camera: bool,
    /// Changes with the same gesture number form one step.
    gesture: Option<u64>,
    /// The offset of the change, and the bytes at this offset before and after the change.
    start: usize,
    before: Vec<u8>,
    after: Vec<u8>,
}

impl Step {
    /// Creates a step whose texts are not set yet.
    pub fn new(what: String, at: KeyPath, gesture: Option<u64>) -> Step {
        Step {
            what,
            at,
            is_camera: false,
            gesture,
            start: 0,
            before: Vec::new(),
            after: Vec::new(),
        }
    }

    /// Sets the texts of the step from the difference between two versions of the file.
    fn between(mut self, before: &str, after: &str) -> Step {
        let (a, b) = (before.as_bytes(), after.as_bytes());
        self.start = a.iter().zip(b).take_while(|(a, b)| a == b).count();
        let (a, b) = (&a[self.start..], &b[self.start..]);
        let end = a.iter().rev().zip(b.iter().rev()).take_while(|(a, b)| a == b).count();
        (self.before, self.after) = (a[..a.len() - end].to_vec(), b[..b.len() - end].to_vec());
        self
    }

    fn swapped(&self, text: &str, from: &[u8], to: &[u8]) -> Option<String> {
        let bytes = text.as_bytes();
        let (head, rest) = bytes.split_at_checked(self.start)?;
        let rest = rest.strip_prefix(from)?;
        String::from_utf8([head, to, rest].concat()).ok()
    }
}

/// Undo and redo steps of a file; cleared when another program changes the file.
#[derive(Debug, Default)]
pub struct History {
    done: Vec<Step>,
    undone: Vec<Step>,
}

impl History {
    pub fn add(&mut self, step: Step, before: &str, after: &str) {
        self.undone.clear();
        let is_same = |last: &Step| last.gesture.is_some() && last.gesture == step.gesture && last.what == step.what;
        let known = self.done.pop_if(|last| is_same(last));
        let first = known.and_then(|last| last.swapped(before, &last.after, &last.before));
        let step = step.between(first.as_deref().unwrap_or(before), after);
        if step.before != step.after {
            self.done.push(step);
        }
        if self.done.len() > MOST {
            self.done.remove(0);
        }
    }

    /// Drops all steps, because another program changed the file. Returns whether there were any steps.
    pub fn forget(&mut self) -> bool {
        let History { done, undone } = std::mem::take(self);
        !(done.is_empty() && undone.is_empty())
    }

    /// Returns the last change, or the last change that was undone.
    pub fn last(&self, again: bool) -> Option<&Step> {
        if again { self.undone.last() } else { self.done.last() }
    }

    /// Returns the text after undo or redo.
    pub fn turned(&self, text: &str, again: bool) -> Option<String> {
        let step = self.last(again)?;
        match again {
            false => step.swapped(text, &step.after, &step.before),
            true => step.swapped(text, &step.before, &step.after),
        }
    }

    /// Records that the text of [`Self::turned`] was written to the file.
    pub fn turn(&mut self, again: bool) {
        let (from, to) = match again {
            false => (&mut self.done, &mut self.undone),
            true => (&mut self.undone, &mut self.done),
        };
        to.extend(from.pop());
        // Later changes with the same gesture number must not be merged with a redone step.
        self.done
            .iter_mut()
            .last()
            .into_iter()
            .for_each(|step| step.gesture = None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(what: &str, gesture: Option<u64>) -> Step {
        Step::new(what.to_owned(), KeyPath::default(), gesture)
    }

    #[test]
    fn changes_are_undone_and_redone() {
        let mut history = History::default();
        let texts = ["é = 1", "é = 12", "é = 3", "ü = 3"];
        for pair in texts.windows(2) {
            history.add(step(pair[1], None), pair[0], pair[1]);
        }
        let mut text = texts[3].to_owned();
        for wanted in texts[..3].iter().rev() {
            text = history.turned(&text, false).unwrap();
            history.turn(false);
            assert_eq!(text, *wanted);
        }
        assert!(
            history.turned(&text, false).is_none(),
            "more steps were undone than exist"
        );
        for wanted in &texts[1..3] {
            text = history.turned(&text, true).unwrap();
            history.turn(true);
            assert_eq!(text, *wanted);
        }
        // A new change drops the undone changes.
        history.add(step("x", None), texts[2], "x");
        assert!(history.last(true).is_none());
        assert_eq!(history.turned("x", false).as_deref(), Some(texts[2]));
        assert!(
            history.turned("y", false).is_none(),
            "a change by another program was undone"
        );
    }

    #[test]
    fn a_gesture_is_one_step() {
        let mut history = History::default();
        for (gesture, what, before, after) in [
            (1, "a", "a = 1", "a = 10"),
            (1, "a", "a = 10", "a = 7"),
            (2, "a", "a = 7", "a = 8"),
            (2, "b", "a = 8", "a = 9"),
        ] {
            history.add(step(what, Some(gesture)), before, after);
        }
        let mut text = "a = 9".to_owned();
        for wanted in ["a = 8", "a = 7", "a = 1"] {
            text = history.turned(&text, false).unwrap();
            history.turn(false);
            assert_eq!(text, wanted);
        }
        assert!(history.last(false).is_none());
        // A gesture that ends where it began changes nothing.
        history.add(step("a", Some(3)), "a = 1", "a = 2");
        history.add(step("a", Some(3)), "a = 2", "a = 1");
        assert!(history.last(false).is_none());
    }
}
