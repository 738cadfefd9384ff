//! The cargo feature `formats`: OpenEXR, WebP, KTX 2, and the metadata of JPEG files.

use std::io;

/// Returns the rule that files of a format violate if the feature is disabled.
pub fn rule(format: &str) -> String {
    format!("{format} files need the cargo feature \"formats\"")
}

/// Returns the error for files of a format if the feature is disabled.
pub fn missing(format: &str) -> io::Error {
    io::Error::new(io::ErrorKind::Unsupported, rule(format))
}
