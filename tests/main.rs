//! All tests that see the library and the program from outside, in one binary: one file a subject.

#[cfg(feature = "dev")]
mod dev;
