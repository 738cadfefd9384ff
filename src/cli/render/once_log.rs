//! Messages on standard error; over several frames each warning is printed once.

use std::cell::RefCell;
use std::collections::BTreeSet;

use crate::cli::log::{Facts, Level, print, print_with};

/// A log of messages that remembers the lines it printed.
pub struct OnceLog {
    quiet: bool,
    lines: RefCell<BTreeSet<String>>,
}

impl OnceLog {
    /// Returns a log that prints nothing if `quiet`.
    pub fn new(quiet: bool) -> OnceLog {
        OnceLog {
            quiet,
            lines: RefCell::default(),
        }
    }

    /// Prints a line unless it was printed before.
    pub fn log_once(&self, level: Level, line: &str) {
        if !self.quiet && self.lines.borrow_mut().insert(line.to_owned()) {
            print(level, line);
        }
    }

    /// Prints a line.
    pub fn log(&self, level: Level, line: &str) {
        self.log_with(level, line, Facts::new());
    }

    /// Prints a line with additional JSON fields.
    pub fn log_with(&self, level: Level, line: &str, facts: Facts) {
        if !self.quiet {
            print_with(level, line, facts);
        }
    }
}
