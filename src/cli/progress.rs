//! Progress of a render on standard error.

use std::io::IsTerminal;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};

use super::facts_of;
use super::log::{self, Level};
use super::numbers::significant;

/// The display of progress: a bar, lines or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    // A bar on a terminal; otherwise a line every ten seconds. JSON messages use the intervals of Plain.
    Auto,
    // A line after every tenth of the work and every ten seconds.
    Plain,
    // Lines that Open Job Description reads: openjd_progress: PERCENT.
    Openjd,
    None,
}

/// Time before the bar appears.
const BAR_DELAY: Duration = Duration::from_secs(1);
/// Interval between lines.
const INTERVAL: Duration = Duration::from_secs(10);
/// Time before the first estimate: the first pixels are rarely representative.
const ESTIMATE_DELAY: Duration = Duration::from_secs(3);
/// Number of steps of the bar.
const STEPS: f64 = 1000.0;

/// The progress of one render. Dropping it removes the bar.
pub struct Progress {
    display: Display,
    /// Label printed before each line, with a colon; empty if a single image is rendered.
    label: String,
    /// The frame number.
    frame: Option<u32>,
    start: Instant,
    /// The fraction at the first update; above 0 if the render was resumed from a checkpoint.
    first_fraction: Option<f64>,
    /// The noise of the image at the last decision, if the render has a noise limit.
    noise: Option<f64>,
    /// The tenths (or hundredths) that were completed when the last line was printed, and the time of this line.
    printed: (u32, Instant),
}

enum Display {
    Bar(Option<ProgressBar>),
    Lines { at_tenths: bool },
    Openjd,
    None,
}

impl Progress {
    /// Returns the progress of an image; `label` names the frame if several are rendered.
    pub fn new(mode: Mode, label: Option<String>, frame: Option<u32>) -> Progress {
        let display = match mode {
            Mode::Auto if log::is_json() => Display::Lines { at_tenths: true },
            Mode::Auto if !std::io::stderr().is_terminal() => Display::Lines { at_tenths: false },
            Mode::Auto => Display::Bar(None),
            Mode::Plain => Display::Lines { at_tenths: true },
            Mode::Openjd => Display::Openjd,
            Mode::None => Display::None,
        };
        let start = Instant::now();
        Progress {
            display,
            label: label.map(|label| format!("{label}: ")).unwrap_or_default(),
            frame,
            start,
            first_fraction: None,
            noise: None,
            printed: (0, start),
        }
    }

    /// Sets the noise to show.
    pub fn set_noise(&mut self, noise: f64) {
        self.noise = Some(noise);
    }

    /// Reports the fraction of the work that is done, from 0 to 1.
    pub fn update(&mut self, fraction: f64) {
        let elapsed = self.start.elapsed();
        let first_fraction = *self.first_fraction.get_or_insert(fraction);
        let remaining = remaining(elapsed, first_fraction, fraction);
        let noise = self.noise_text();
        match &mut self.display {
            // With several frames, the bar appears at once, so that short frames have a bar too.
            Display::Bar(bar) if elapsed > BAR_DELAY || !self.label.is_empty() => {
                let bar = bar.get_or_insert_with(|| new_bar(elapsed, &self.label));
                bar.set_position((fraction * STEPS) as u64);
                let left = remaining.map(|remaining| format!(", about {} left", format_duration(remaining)));
                if left.is_some() || !noise.is_empty() {
                    bar.set_message(noise + &left.unwrap_or_default());
                }
            }
            Display::Lines { at_tenths } => {
                let tenths = (fraction * 10.0) as u32;
                if (*at_tenths && tenths > self.printed.0) || self.printed.1.elapsed() > INTERVAL {
                    self.print(fraction, remaining);
                    self.printed = (tenths, Instant::now());
                }
            }
            Display::Openjd => {
                let hundredths = (fraction * 100.0) as u32;
                if hundredths > self.printed.0 {
                    log::print(Level::Progress, &format!("openjd_progress: {hundredths}"));
                    self.printed.0 = hundredths;
                }
            }
            Display::Bar(_) | Display::None => {}
        }
    }

    fn noise_text(&self) -> String {
        let text = self.noise.map(|noise| format!(", noise {}", significant(noise)));
        text.unwrap_or_default()
    }

    fn print(&self, fraction: f64, remaining: Option<Duration>) {
        let seconds = self.start.elapsed().as_secs_f64();
        let width = if log::is_json() { 0 } else { 3 }; // aligns the lines
        let remaining_text = remaining.map(|remaining| format!(", about {} left", format_duration(remaining)));
        let line = format!(
            "{}{:width$.0} % done after {seconds:.1} s{}{}",
            self.label,
            fraction * 100.0,
            self.noise_text(),
            remaining_text.unwrap_or_default()
        );
        let mut facts = facts_of([
            ("fraction", fraction.into()),
            ("share", fraction.into()), // the former name, kept until version 0.3
            ("seconds", seconds.into()),
        ]);
        facts.extend(self.noise.map(|noise| ("noise".to_owned(), noise.into())));
        facts.extend(self.frame.map(|frame| ("frame".to_owned(), frame.into())));
        log::print_with(Level::Progress, &line, facts);
    }
}

/// Estimates the remaining time from the mean speed so far; `None` while the estimate would be unreliable.
fn remaining(elapsed: Duration, first_fraction: f64, fraction: f64) -> Option<Duration> {
    let done = fraction - first_fraction;
    if elapsed < ESTIMATE_DELAY || done < 0.01 || fraction >= 1.0 {
        return None;
    }
    Duration::try_from_secs_f64(elapsed.as_secs_f64() * (1.0 - fraction) / done).ok()
}

/// Returns a duration in at most two units: `45 s`, `3 m 20 s`, `2 h 5 m`.
fn format_duration(duration: Duration) -> String {
    let seconds = duration.as_secs_f64().ceil() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} m {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} m", seconds / 3600, seconds / 60 % 60),
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Display::Bar(Some(bar)) = &self.display {
            bar.finish_and_clear();
        }
    }
}

/// Runs work whose progress cannot be measured. On a terminal, a spinner with the name of the work and the elapsed time
/// appears after a second.
pub fn with_spinner<T>(mode: Mode, name: &'static str, work: impl FnOnce() -> T) -> T {
    if mode != Mode::Auto || log::is_json() || !std::io::stderr().is_terminal() {
        return work();
    }
    let (work_guard, work_end) = mpsc::channel::<()>();
    let spinner = thread::Builder::new().spawn(move || {
        if work_end.recv_timeout(BAR_DELAY) == Err(RecvTimeoutError::Timeout) {
            let bar = ProgressBar::new_spinner().with_elapsed(BAR_DELAY);
            bar.set_style(spinner_style());
            bar.set_message(name);
            bar.enable_steady_tick(Duration::from_millis(100));
            let _ = work_end.recv(); // returns when `work_guard` is dropped
            bar.finish_and_clear();
        }
    });
    let result = work();
    drop(work_guard);
    if let Ok(spinner) = spinner {
        let _ = spinner.join();
    }
    result
}

fn spinner_style() -> ProgressStyle {
    ProgressStyle::with_template("{spinner} {msg}, {elapsed}").unwrap_or_else(|_| ProgressStyle::default_spinner())
}

fn new_bar(elapsed: Duration, label: &str) -> ProgressBar {
    let bar = ProgressBar::new(STEPS as u64)
        .with_elapsed(elapsed)
        .with_prefix(label.to_owned());
    let style = ProgressStyle::with_template("{prefix}rendering {wide_bar} {percent:>3} %  {elapsed}{msg}");
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar, // the default style
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_need_elapsed_time_and_progress() {
        let estimate = |seconds, first, fraction| {
            remaining(Duration::from_secs(seconds), first, fraction).map(|time| time.as_secs_f64().round())
        };
        assert_eq!(estimate(2, 0.0, 0.5), None);
        assert_eq!(estimate(5, 0.0, 0.005), None);
        assert_eq!(estimate(5, 0.0, 0.25), Some(15.0));
        assert_eq!(estimate(5, 0.5, 0.75), Some(5.0)); // after a resume
        assert_eq!(estimate(5, 0.0, 1.0), None);
        assert_eq!(estimate(5, 0.0, f64::NAN), None);
    }

    #[test]
    fn durations_have_at_most_two_units() {
        for (seconds, text) in [(0.2, "1 s"), (59.0, "59 s"), (60.0, "1 m 0 s"), (7325.0, "2 h 2 m")] {
            assert_eq!(format_duration(Duration::from_secs_f64(seconds)), text);
        }
    }
}
