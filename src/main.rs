//! The program `wgray`.
// `print!` and `eprint!` panic if the stream is closed or full.
#![warn(clippy::print_stderr, clippy::print_stdout)]

use wgray::cli::Allocator;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

fn main() -> std::process::ExitCode {
    wgray::cli::main()
}
