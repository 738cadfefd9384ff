//! Timings of each kernel and of each stage of a frame.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use wgray_render::gpu::Dispatch;

/// Number of measurements over which the median is computed.
const KEPT: usize = 33;
/// The period over which shares are computed.
const WINDOW: Duration = Duration::from_secs(1);
/// Maximum number of measurements within this period.
const MOST: usize = 2048;

/// The stages of a frame, in order.
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

/// Timings that several threads record; a clone is a handle to the same timings.
#[derive(Clone, Debug, Default)]
pub struct Times(Arc<Mutex<Vec<TimeRecord>>>);

/// The timing of a kernel or a stage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Time {
    /// The entry point of the kernel, or the stage.
    pub name: &'static str,
    /// True for a kernel.
    pub kernel: bool,
    /// Number of measurements.
    pub count: u64,
    /// Seconds of the last measurement.
    pub last: f64,
    /// The median of the last measurements.
    pub median: f64,
    /// The fraction of the last second, from 0 to 1; more if several threads work at the same stage.
    pub share: f64,
    /// Samples of a kernel's last dispatch.
    pub samples: u64,
    /// True if the device measured the times; otherwise the times include notifying the host.
    pub by_device: bool,
}

#[derive(Debug)]
struct TimeRecord {
    time: Time,
    last: VecDeque<Duration>,
    /// End time and duration of the last measurements.
    ended: VecDeque<(Instant, Duration)>,
}

impl Times {
    /// Records a stage that has just ended.
    pub fn part(&self, name: &'static str, took: Duration) {
        debug_assert!(PARTS.contains(&name));
        self.note(name, took, None);
    }

    /// Runs and records a stage.
    pub fn of<T>(&self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        self.part(name, start.elapsed());
        done
    }

    /// Records a dispatch that has just ended.
    pub fn call(&self, call: &Dispatch) {
        self.note(call.kernel, call.took, Some(call));
    }

    fn note(&self, name: &'static str, took: Duration, call: Option<&Dispatch>) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = all
            .iter()
            .position(|kept| (kept.time.name, kept.time.kernel) == (name, call.is_some()));
        let at = known.unwrap_or_else(|| {
            all.push(TimeRecord::new(name, call.is_some()));
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

    /// Returns the timings: kernels first, then the stages in order.
    pub fn timings(&self) -> Vec<Time> {
        let now = Instant::now();
        let all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut timings: Vec<Time> = all.iter().map(|kept| kept.timing(now)).collect();
        let place = |time: &Time| (!time.kernel, PARTS.iter().position(|name| *name == time.name));
        timings.sort_by_key(place);
        timings
    }
}

impl TimeRecord {
    fn new(name: &'static str, kernel: bool) -> TimeRecord {
        TimeRecord {
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

    fn timing(&self, now: Instant) -> Time {
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
            times.call(&Dispatch {
                kernel: "render",
                took: Duration::from_millis(i),
                by_device: true,
                samples: 64 * i,
            });
        }
        let timings = times.timings();
        let names: Vec<_> = timings.iter().map(|time| time.name).collect();
        assert_eq!(names, ["render", "read files", "upload"]);
        let render = &timings[0];
        assert_eq!((render.count, render.samples, render.kernel), (100, 6400, true));
        assert_eq!((render.last, render.median), (0.1, 0.084));
        assert!(render.share > 0.5, "they ended just now: {}", render.share);
        assert!(render.by_device && !timings[1].by_device);
    }

    #[test]
    fn the_share_only_includes_time_within_the_last_second() {
        let now = Instant::now() + Duration::from_secs(5);
        let mut kept = TimeRecord::new("send", false);
        for (ago, took) in [(3000, 500), (800, 500), (100, 50), (0, 20)] {
            kept.ended
                .push_back((now - Duration::from_millis(ago), Duration::from_millis(took)));
        }
        let share = kept.timing(now).share;
        assert!((share - (0.2 + 0.05 + 0.02)).abs() < 1e-9, "{share}");
    }
}
