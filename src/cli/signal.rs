//! The signals that end a render, which then cleans up behind itself.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Set by the first signal that asks the program to end; the second one ends it at once. A signal that was ignored when the
/// program started stays so: that is how `nohup` and shells keep theirs from background jobs.
pub fn stop() -> io::Result<Arc<AtomicBool>> {
    let stopped = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, HANG_UP] {
        if !is_ignored(signal) {
            flag::register_conditional_shutdown(signal, super::INTERRUPTED.into(), Arc::clone(&stopped))?;
            flag::register(signal, Arc::clone(&stopped))?;
        }
    }
    Ok(stopped)
}

#[cfg(unix)]
const HANG_UP: i32 = signal_hook::consts::SIGHUP;
#[cfg(not(unix))]
const HANG_UP: i32 = SIGTERM; // there is none

/// Makes a file that grows beyond the limit of the process (`ulimit -f`) an error like a full disk, which is told and cleaned
/// up, rather than the program's end.
pub fn file_size_limit_is_an_error() {
    #[cfg(unix)]
    // SAFETY: nothing runs when the signal comes, and no other thread does yet.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}

#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: nothing is set, and what is there is written to a place of the right type; all zeros are a value of it too.
    unsafe {
        libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr());
        action.assume_init().sa_sigaction == libc::SIG_IGN
    }
}

#[cfg(not(unix))]
fn is_ignored(_: i32) -> bool {
    false
}
