//! What has been said on standard error: of several pictures each warning comes once.

use std::cell::RefCell;
use std::collections::BTreeSet;

use crate::cli::log::{Level, say};

/// The lines so far.
pub struct Said {
    quiet: bool,
    lines: RefCell<BTreeSet<String>>,
}

impl Said {
    /// Nothing is said yet; nothing ever is, if quiet.
    pub fn new(quiet: bool) -> Said {
        Said {
            quiet,
            lines: RefCell::default(),
        }
    }

    /// Whether nothing is said but errors.
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Says a line if it was not said before.
    pub fn once(&self, level: Level, line: &str) {
        if !self.quiet && self.lines.borrow_mut().insert(line.to_owned()) {
            say(level, line);
        }
    }

    /// Says a line.
    pub fn again(&self, level: Level, line: &str) {
        if !self.quiet {
            say(level, line);
        }
    }
}
