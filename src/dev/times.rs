//! Where the time goes: how long each kernel's calls and each part of a frame took last.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::gpu::Call;

/// So many of the last times of each kind are kept for their median.
const KEPT: usize = 33;
/// The time of which shares are told.
const WINDOW: Duration = Duration::from_secs(1);
/// At most so many ends are kept for a share: as many as can end within that time.
const MOST: usize = 2048;

/// The parts of a frame, in their order.
pub const PARTS: [&str; 9] = [
    "read files",
    "pack",
    "check shaders",
    "compile",
    "upload",
    "render",
    "read back",
    "make PNG",
    "send",
];

/// Times that several threads note; a clone is another handle to them.
#[derive(Clone, Debug, Default)]
pub struct Times(Arc<Mutex<Vec<Kept>>>);

/// What is told of a kernel or a part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Time {
    /// The kernel's entry point, or the part.
    pub name: &'static str,
    /// Whether it is a kernel.
    pub kernel: bool,
    /// How many there were.
    pub count: u64,
    /// Seconds of the last one.
    pub last: f64,
    /// The median of the last ones.
    pub median: f64,
    /// How much of the last second, from 0 to 1; more where several threads do the same.
    pub share: f64,
    /// Samples of pixels of a kernel's last call.
    pub samples: u64,
    /// Whether the device has told the times; else they are from the call to the news of its end.
    pub by_device: bool,
}

#[derive(Debug)]
struct Kept {
    time: Time,
    last: VecDeque<Duration>,
    /// When the last ones ended, and how long they took.
    ended: VecDeque<(Instant, Duration)>,
}

impl Times {
    /// A part of a frame took so long, and has just ended.
    pub fn part(&self, name: &'static str, took: Duration) {
        debug_assert!(PARTS.contains(&name));
        self.note(name, took, None);
    }

    /// Does a part of a frame.
    pub fn of<T>(&self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        self.part(name, start.elapsed());
        done
    }

    /// A kernel's call has just ended.
    pub fn call(&self, call: &Call) {
        self.note(call.kernel, call.took, Some(call));
    }

    fn note(&self, name: &'static str, took: Duration, call: Option<&Call>) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = all
            .iter()
            .position(|kept| (kept.time.name, kept.time.kernel) == (name, call.is_some()));
        let at = known.unwrap_or_else(|| {
            all.push(Kept::new(name, call.is_some()));
            all.len() - 1
        });
        let kept = &mut all[at];
        kept.time.count += 1;
        kept.time.last = took.as_secs_f64();
        if let Some(call) = call {
            (kept.time.samples, kept.time.by_device) = (call.samples, call.by_device);
        }
        kept.last.push_back(took);
        kept.ended.push_back((Instant::now(), took));
        while kept.last.len() > KEPT {
            kept.last.pop_front();
        }
        let old = |ended: &VecDeque<(Instant, Duration)>| {
            ended.len() > MOST || ended.front().is_some_and(|(end, _)| end.elapsed() > WINDOW)
        };
        while old(&kept.ended) {
            kept.ended.pop_front();
        }
    }

    /// What is known now: kernels first, then the parts in their order.
    pub fn told(&self) -> Vec<Time> {
        let now = Instant::now();
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut told: Vec<Time> = all.iter().map(|kept| kept.told(now)).collect();
        let place = |time: &Time| (!time.kernel, PARTS.iter().position(|name| *name == time.name));
        told.sort_by_key(place);
        told
    }
}

impl Kept {
    fn new(name: &'static str, kernel: bool) -> Kept {
        Kept {
            time: Time {
                name,
                kernel,
                count: 0,
                last: 0.0,
                median: 0.0,
                share: 0.0,
                samples: 0,
                by_device: false,
            },
            last: VecDeque::new(),
            ended: VecDeque::new(),
        }
    }

    fn told(&self, now: Instant) -> Time {
        let mut last: Vec<Duration> = self.last.iter().copied().collect();
        last.sort();
        let within = |(end, took): &(Instant, Duration)| {
            let left = WINDOW.saturating_sub(now.saturating_duration_since(*end));
            (*took).min(left).as_secs_f64()
        };
        Time {
            median: last.get(last.len() / 2).map_or(0.0, Duration::as_secs_f64),
            share: self.ended.iter().map(within).sum::<f64>() / WINDOW.as_secs_f64(),
            ..self.time.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_come_first_with_the_median_of_their_last_calls() {
        let times = Times::default();
        times.part("upload", Duration::from_millis(3));
        times.part("read files", Duration::from_millis(1));
        for i in 1..=100 {
            times.call(&Call {
                kernel: "render",
                took: Duration::from_millis(i),
                by_device: true,
                samples: 64 * i,
            });
        }
        let told = times.told();
        let names: Vec<_> = told.iter().map(|time| time.name).collect();
        assert_eq!(names, ["render", "read files", "upload"]);
        let render = &told[0];
        assert_eq!((render.count, render.samples, render.kernel), (100, 6400, true));
        assert_eq!((render.last, render.median), (0.1, 0.084));
        assert!(render.share > 0.5, "they ended just now: {}", render.share);
        assert!(render.by_device && !told[1].by_device);
    }

    #[test]
    fn of_the_last_second_counts_what_lies_in_it() {
        let now = Instant::now() + Duration::from_secs(5);
        let mut kept = Kept::new("send", false);
        for (ago, took) in [(3000, 500), (800, 500), (100, 50), (0, 20)] {
            kept.ended
                .push_back((now - Duration::from_millis(ago), Duration::from_millis(took)));
        }
        let share = kept.told(now).share;
        assert!((share - (0.2 + 0.05 + 0.02)).abs() < 1e-9, "{share}");
    }
}
