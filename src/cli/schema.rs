//! `wgray schema`: prints the JSON Schema of scene files.

use std::io::{self, Write as _};
use std::process::ExitCode;

pub fn run() -> ExitCode {
    let schema = crate::scene::schema();
    super::finish_output(io::stdout().lock().write_all(schema.as_bytes()), ExitCode::SUCCESS)
}
