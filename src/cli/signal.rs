//! The signals that end a render, which then cleans up behind itself.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Whether a signal has asked the program to end.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    /// The last one, or 0.
    signal: Arc<AtomicUsize>,
    asked: Arc<AtomicBool>,
}

impl Stop {
    /// The signal that has come, if one has.
    pub fn signal(&self) -> Option<i32> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => i32::try_from(signal).ok(),
        }
    }

    /// Whether to end.
    #[cfg(feature = "dev")]
    pub fn flag(&self) -> &AtomicBool {
        &self.asked
    }
}

/// The exit code after a signal, as shells have it: 130 after SIGINT, 143 after SIGTERM.
pub fn exit_code(signal: i32) -> u8 {
    128_u8.saturating_add(u8::try_from(signal).unwrap_or(0))
}

/// Notes the first signal that asks the program to end; the second one ends it at once. A signal that was ignored when the
/// program started stays so: that is how `nohup` and shells keep theirs from background jobs.
pub fn stop() -> io::Result<Stop> {
    stop_with(None)
}

/// The same, where SIGTERM has another exit code.
fn stop_with(terminated: Option<u8>) -> io::Result<Stop> {
    let stop = Stop::default();
    for signal in [SIGINT, SIGTERM, HANG_UP] {
        if !is_ignored(signal) {
            let code = terminated.filter(|_| signal == SIGTERM).unwrap_or(exit_code(signal));
            flag::register_conditional_shutdown(signal, code.into(), Arc::clone(&stop.asked))?;
            flag::register(signal, Arc::clone(&stop.asked))?;
            flag::register_usize(signal, Arc::clone(&stop.signal), signal.unsigned_abs() as usize)?;
        }
    }
    Ok(stop)
}

/// The signals of a program that heeds them from some moment on, and is ended by them before.
pub struct Signals {
    /// The exit code after SIGTERM, if it is not its own.
    terminated: Option<u8>,
    /// Whether SIGTERM still ends the program with that code.
    ends: Arc<AtomicBool>,
    stop: Option<Stop>,
}

impl Signals {
    /// Signals that are not heeded yet.
    pub fn unheeded(terminated: Option<u8>) -> io::Result<Signals> {
        let ends = Arc::new(AtomicBool::new(true));
        if let Some(code) = terminated.filter(|_| !is_ignored(SIGTERM)) {
            flag::register_conditional_shutdown(SIGTERM, code.into(), Arc::clone(&ends))?;
        }
        Ok(Signals {
            terminated,
            ends,
            stop: None,
        })
    }

    /// What they ask for, if they are heeded.
    pub fn heeded(&self) -> Option<&Stop> {
        self.stop.as_ref()
    }

    /// Heeds them from now on.
    pub fn heed(&mut self) -> io::Result<&Stop> {
        let stop = match self.stop.take() {
            Some(stop) => stop,
            None => stop_with(self.terminated)?,
        };
        self.ends.store(false, Ordering::Relaxed);
        Ok(self.stop.insert(stop))
    }
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
