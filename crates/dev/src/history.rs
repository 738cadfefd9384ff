//! Undo and redo of the changes that this session made to the scene file.

use wgray_scene::KeyPath;

/// Maximum number of steps that can be undone.
const MAX_STEPS: usize = 1000;

#[derive(Debug)]
pub struct Step {
    /// The changed key, for display.
    pub key: String,
    /// The table that contains the changed key.
    pub table: KeyPath,
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
    pub fn new(key: String, table: KeyPath, gesture: Option<u64>) -> Step {
        Step {
            key,
            table,
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

    /// Replaces `old` by `new` at the offset of the change; `None` if the text does not contain `old` there.
    fn replace(&self, text: &str, old: &[u8], new: &[u8]) -> Option<String> {
        let bytes = text.as_bytes();
        let (before, rest) = bytes.split_at_checked(self.start)?;
        let after = rest.strip_prefix(old)?;
        String::from_utf8([before, new, after].concat()).ok()
    }
}

/// Undo and redo steps of a file; cleared when another program changes the file.
#[derive(Debug, Default)]
pub struct History {
    done: Vec<Step>,
    undone: Vec<Step>,
}

impl History {
    /// Adds a step that changed the text from `before` to `after`. Merges the steps of a gesture that change one key.
    pub fn add(&mut self, step: Step, before: &str, after: &str) {
        self.undone.clear();
        let is_same = |last: &Step| last.gesture.is_some() && last.gesture == step.gesture && last.key == step.key;
        let merged = self.done.pop_if(|last| is_same(last));
        let original = merged.and_then(|last| last.replace(before, &last.after, &last.before));
        let step = step.between(original.as_deref().unwrap_or(before), after);
        if step.before != step.after {
            self.done.push(step);
        }
        if self.done.len() > MAX_STEPS {
            self.done.remove(0);
        }
    }

    /// Drops all steps, because another program changed the file. Returns true if any steps existed.
    pub fn forget(&mut self) -> bool {
        let History { done, undone } = std::mem::take(self);
        !(done.is_empty() && undone.is_empty())
    }

    /// Returns the step that an undo reverts, or, with `redo`, the step that a redo repeats.
    pub fn last(&self, redo: bool) -> Option<&Step> {
        if redo { self.undone.last() } else { self.done.last() }
    }

    /// Returns the text after an undo or a redo.
    pub fn text_after(&self, text: &str, redo: bool) -> Option<String> {
        let step = self.last(redo)?;
        match redo {
            false => step.replace(text, &step.after, &step.before),
            true => step.replace(text, &step.before, &step.after),
        }
    }

    /// Records that the text of [`Self::text_after`] was written to the file.
    pub fn complete(&mut self, redo: bool) {
        let (from, to) = match redo {
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

    fn step(key: &str, gesture: Option<u64>) -> Step {
        Step::new(key.to_owned(), KeyPath::default(), gesture)
    }

    #[test]
    fn changes_are_undone_and_redone() {
        let mut history = History::default();
        let texts = ["é = 1", "é = 12", "é = 3", "ü = 3"];
        for pair in texts.windows(2) {
            history.add(step(pair[1], None), pair[0], pair[1]);
        }
        let mut text = texts[3].to_owned();
        for expected in texts[..3].iter().rev() {
            text = history.text_after(&text, false).unwrap();
            history.complete(false);
            assert_eq!(text, *expected);
        }
        assert!(
            history.text_after(&text, false).is_none(),
            "more steps were undone than exist"
        );
        for expected in &texts[1..3] {
            text = history.text_after(&text, true).unwrap();
            history.complete(true);
            assert_eq!(text, *expected);
        }
        // A new change drops the undone changes.
        history.add(step("x", None), texts[2], "x");
        assert!(history.last(true).is_none());
        assert_eq!(history.text_after("x", false).as_deref(), Some(texts[2]));
        assert!(
            history.text_after("y", false).is_none(),
            "a change by another program was undone"
        );
    }

    #[test]
    fn a_gesture_is_one_step() {
        let mut history = History::default();
        for (gesture, key, before, after) in [
            (1, "a", "a = 1", "a = 10"),
            (1, "a", "a = 10", "a = 7"),
            (2, "a", "a = 7", "a = 8"),
            (2, "b", "a = 8", "a = 9"),
        ] {
            history.add(step(key, Some(gesture)), before, after);
        }
        let mut text = "a = 9".to_owned();
        for expected in ["a = 8", "a = 7", "a = 1"] {
            text = history.text_after(&text, false).unwrap();
            history.complete(false);
            assert_eq!(text, expected);
        }
        assert!(history.last(false).is_none());
        // A gesture that ends where it began changes nothing.
        history.add(step("a", Some(3)), "a = 1", "a = 2");
        history.add(step("a", Some(3)), "a = 2", "a = 1");
        assert!(history.last(false).is_none());
    }
}
