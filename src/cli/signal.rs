//! Signal handling: the program removes its temporary files before it ends.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

#[derive(Clone, Debug, Default)]
pub struct Stop {
    /// The first signal, or 0 before a signal.
    signal: Arc<AtomicUsize>,
    /// True after the first signal.
    requested: Arc<AtomicBool>,
}

impl Stop {
    pub fn signal(&self) -> Option<i32> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => i32::try_from(signal).ok(),
        }
    }
}

pub fn name(signal: i32) -> &'static str {
    match signal {
        SIGINT => "Ctrl+C (SIGINT)",
        SIGTERM => "SIGTERM",
        HANG_UP => "SIGHUP",
        _ => "a signal",
    }
}

/// Returns the exit code after a signal, as in shells: 130 after SIGINT, 143 after SIGTERM.
pub fn exit_code(signal: i32) -> u8 {
    128_u8.saturating_add(u8::try_from(signal).unwrap_or(0))
}

/// Installs handlers that record the first signal; a second signal ends the program immediately. Signals that are
/// ignored when the program starts stay ignored, as `nohup` and background jobs require.
pub fn install_handlers() -> io::Result<Stop> {
    install_handlers_with(None)
}

/// Like [`install_handlers`], with another exit code for SIGTERM.
fn install_handlers_with(sigterm_code: Option<u8>) -> io::Result<Stop> {
    let stop = Stop::default();
    for signal in [SIGINT, SIGTERM, HANG_UP] {
        if !is_ignored(signal) {
            let code = sigterm_code.filter(|_| signal == SIGTERM).unwrap_or(exit_code(signal));
            flag::register_conditional_shutdown(signal, code.into(), Arc::clone(&stop.requested))?;
            flag::register(signal, Arc::clone(&stop.requested))?;
            flag::register_usize(signal, Arc::clone(&stop.signal), signal.unsigned_abs() as usize)?;
        }
    }
    Ok(stop)
}

/// Signal handlers that end the program immediately. After [`Signals::defer`], the handlers only record the signal.
pub struct Signals {
    /// The exit code after SIGTERM, if it differs from 143.
    sigterm_code: Option<u8>,
    /// True while SIGTERM ends the program immediately, with `sigterm_code`.
    is_immediate: Arc<AtomicBool>,
    stop: Option<Stop>,
}

impl Signals {
    /// Registers handlers that end the program immediately.
    pub fn immediate(sigterm_code: Option<u8>) -> io::Result<Signals> {
        let is_immediate = Arc::new(AtomicBool::new(true));
        if let Some(code) = sigterm_code.filter(|_| !is_ignored(SIGTERM)) {
            flag::register_conditional_shutdown(SIGTERM, code.into(), Arc::clone(&is_immediate))?;
        }
        Ok(Signals {
            sigterm_code,
            is_immediate,
            stop: None,
        })
    }

    pub fn deferred(&self) -> Option<&Stop> {
        self.stop.as_ref()
    }

    pub fn defer(&mut self) -> io::Result<&Stop> {
        let stop = match self.stop.take() {
            Some(stop) => stop,
            None => install_handlers_with(self.sigterm_code)?,
        };
        self.is_immediate.store(false, Ordering::Relaxed);
        Ok(self.stop.insert(stop))
    }
}

#[cfg(unix)]
const HANG_UP: i32 = signal_hook::consts::SIGHUP;
#[cfg(not(unix))]
const HANG_UP: i32 = SIGTERM; // SIGHUP does not exist

/// Ignores the signal for writing beyond the file size limit (`ulimit -f`), so that the write returns an error.
pub fn ignore_file_size_signal() {
    #[cfg(unix)]
    // SAFETY: no handler runs for the signal, and no other thread exists yet.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}

#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: the call changes nothing; it writes the current action to a value of the right type, for which zeros are
    // valid.
    unsafe {
        libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr());
        action.assume_init().sa_sigaction == libc::SIG_IGN
    }
}

#[cfg(not(unix))]
fn is_ignored(_: i32) -> bool {
    false
}
