//! Messages on standard error; each warning is printed once, even if it occurs in several frames.

use std::cell::RefCell;
use std::collections::BTreeSet;

use crate::cli::log::{Facts, Level, print, print_with};

/// Prints messages, and remembers those of `log_once`.
pub struct OnceLog {
    quiet: bool,
    lines: RefCell<BTreeSet<String>>,
}

impl OnceLog {
    /// With `quiet`, nothing is printed.
    pub fn new(quiet: bool) -> OnceLog {
        OnceLog {
            quiet,
            lines: RefCell::default(),
        }
    }

    pub fn log_once(&self, level: Level, line: &str) {
        if !self.quiet && self.lines.borrow_mut().insert(line.to_owned()) {
            print(level, line);
        }
    }

    pub fn log(&self, level: Level, line: &str) {
        self.log_with(level, line, Facts::new());
    }

    pub fn log_with(&self, level: Level, line: &str, facts: Facts) {
        if !self.quiet {
            print_with(level, line, facts);
        }
    }
}
