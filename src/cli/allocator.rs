//! The global allocator. It wraps the system allocator; an allocation failure that no caller handles ends the program
//! with exit code 7. The standard library would abort instead, leaving temporary files behind.

use std::alloc::{GlobalAlloc, Layout, System};
use std::fmt::{self, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::log;

/// The system allocator, with a message when memory runs out.
#[derive(Debug)]
pub struct Allocator;

// SAFETY: the system allocator upholds the contract, and its results are returned unchanged.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller upholds the same contract for the system allocator.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        checked(unsafe { System.realloc(memory, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

fn checked(memory: *mut u8, size: usize) -> *mut u8 {
    if memory.is_null() && !wgray_image::memory::is_fallible() {
        end(size);
    }
    memory
}

/// Ends the program without allocating.
#[cold]
pub fn end(size: usize) -> ! {
    static ENDING: AtomicBool = AtomicBool::new(false);
    if ENDING.swap(true, Ordering::Relaxed) {
        // Another thread is printing the message and ending the program.
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
    let mut line = Line::default();
    let message = format_args!("out of memory: cannot allocate {size} bytes (--size, --crop, --threads)");
    let _ = match log::is_json() {
        true => writeln!(line, r#"{{"level":"error","message":"{message}","exit_code":7}}"#),
        false => writeln!(line, "error: {message}"),
    };
    wgray_image::remove_temporary_files();
    line.print();
    #[cfg(unix)]
    // SAFETY: `_exit` ends the process without running any more of its code.
    unsafe {
        libc::_exit(7)
    }
    #[cfg(not(unix))]
    std::process::exit(7)
}

/// Size in bytes of the signal stack that the standard library maps for each thread.
const SIGNAL_STACK_BYTES: usize = 8192;

/// Ends the program with exit code 7 if there is no memory for a thread's signal stack. The standard library maps this
/// stack without the allocator, and panics on failure.
pub fn catch_signal_stack_failures() {
    let previous_hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if panic
            .location()
            .is_some_and(|location| location.file().ends_with("stack_overflow.rs"))
        {
            end(SIGNAL_STACK_BYTES);
        }
        previous_hook(panic);
    }));
}

/// A line of text in a fixed-size buffer.
struct Line {
    bytes: [u8; 256],
    len: usize,
}

impl Default for Line {
    fn default() -> Line {
        Line {
            bytes: [0; 256],
            len: 0,
        }
    }
}

impl Line {
    /// Writes to standard error without the lock of `std::io::stderr`, which this thread may hold.
    fn print(&self) {
        let bytes = &self.bytes[..self.len];
        #[cfg(unix)]
        // SAFETY: the bytes are initialized; the result does not matter.
        unsafe {
            libc::write(libc::STDERR_FILENO, bytes.as_ptr().cast(), bytes.len());
        }
        #[cfg(not(unix))]
        let _ = std::io::Write::write_all(&mut std::io::stderr(), bytes);
    }
}

impl fmt::Write for Line {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let end = self.len + text.len();
        let destination = self.bytes.get_mut(self.len..end).ok_or(fmt::Error)?;
        destination.copy_from_slice(text.as_bytes());
        self.len = end;
        Ok(())
    }
}
