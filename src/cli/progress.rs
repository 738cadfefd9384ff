//! How far a render is, on standard error.

use std::io::IsTerminal;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};

use super::facts_of;
use super::log::{self, Level};

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// A bar, if standard error is a terminal and the render takes more than a second; lines where messages are JSON
    Auto,
    /// Lines, at every tenth of the work and every ten seconds
    Plain,
    /// Lines that Open Job Description takes progress from, openjd_progress: PERCENT
    Openjd,
    /// Nothing
    None,
}

/// What takes no longer than this needs no bar.
const PATIENCE: Duration = Duration::from_secs(1);
/// The longest time between two lines.
const SILENCE: Duration = Duration::from_secs(10);
/// Steps of the bar.
const STEPS: f64 = 1000.0;

/// The progress of one render. The bar goes away when this is dropped.
pub struct Progress {
    mode: Mode,
    /// What it is of, in front of each line, and a colon; nothing where there is one picture.
    label: String,
    /// The number of the frame that it is of.
    frame: Option<u32>,
    start: Instant,
    bar: Option<ProgressBar>,
    /// The tenths, or hundredths, that lines have told of, and when the last one did.
    told: (u32, Instant),
}

impl Progress {
    /// The progress of what `label` says, if there are several.
    pub fn new(mode: Mode, label: Option<String>, frame: Option<u32>) -> Progress {
        let mode = match mode {
            Mode::Auto if log::is_json() => Mode::Plain,
            Mode::Auto if !std::io::stderr().is_terminal() => Mode::None,
            mode => mode,
        };
        let start = Instant::now();
        Progress {
            mode,
            label: label.map(|label| format!("{label}: ")).unwrap_or_default(),
            frame,
            start,
            bar: None,
            told: (0, start),
        }
    }

    /// Tells the share of the work that is done, from 0 to 1.
    pub fn update(&mut self, share: f64) {
        match self.mode {
            // Of several pictures each may be quick.
            Mode::Auto if self.start.elapsed() > PATIENCE || !self.label.is_empty() => {
                let bar = self
                    .bar
                    .get_or_insert_with(|| new_bar(self.start.elapsed(), &self.label));
                bar.set_position((share * STEPS) as u64);
            }
            Mode::Plain => {
                let tenths = (share * 10.0) as u32;
                if tenths > self.told.0 || self.told.1.elapsed() > SILENCE {
                    self.tell(share);
                    self.told = (tenths, Instant::now());
                }
            }
            Mode::Openjd => {
                let hundredths = (share * 100.0) as u32;
                if hundredths > self.told.0 {
                    log::say(Level::Progress, &format!("openjd_progress: {hundredths}"));
                    self.told.0 = hundredths;
                }
            }
            Mode::Auto | Mode::None => {}
        }
    }
}

impl Progress {
    /// A line.
    fn tell(&self, share: f64) {
        let seconds = self.start.elapsed().as_secs_f64();
        let width = if log::is_json() { 0 } else { 3 }; // so that lines below each other are easy to read
        let line = format!("{}{:width$.0} % done after {seconds:.1} s", self.label, share * 100.0);
        let mut facts = facts_of([("share", share.into()), ("seconds", seconds.into())]);
        facts.extend(self.frame.map(|frame| ("frame".to_owned(), frame.into())));
        log::tell(Level::Progress, &line, facts);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Does work that has no shares to tell of. On a terminal it is named, with its time, while it takes longer than a second.
pub fn named<T>(mode: Mode, name: &'static str, work: impl FnOnce() -> T) -> T {
    if mode != Mode::Auto || log::is_json() || !std::io::stderr().is_terminal() {
        return work();
    }
    let (done, ended) = mpsc::channel::<()>();
    let watch = thread::spawn(move || {
        if ended.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
            let bar = ProgressBar::new_spinner().with_elapsed(PATIENCE);
            bar.set_style(spinner_style());
            bar.set_message(name);
            bar.enable_steady_tick(Duration::from_millis(100));
            let _ = ended.recv(); // until the work has ended
            bar.finish_and_clear();
        }
    });
    let result = work();
    drop(done);
    let _ = watch.join();
    result
}

fn spinner_style() -> ProgressStyle {
    ProgressStyle::with_template("{spinner} {msg}, {elapsed}").unwrap_or_else(|_| ProgressStyle::default_spinner())
}

fn new_bar(elapsed: Duration, label: &str) -> ProgressBar {
    let bar = ProgressBar::new(STEPS as u64)
        .with_elapsed(elapsed)
        .with_prefix(label.to_owned());
    let style = ProgressStyle::with_template("{prefix}{wide_bar} {percent:>3} %  {elapsed} of {duration}");
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar, // the library's own style
    }
}
