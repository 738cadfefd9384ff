//! Timings of each kernel and of each stage of a frame.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use wgray_render::gpu::Dispatch;

/// Number of measurements over which the median is computed.
const MEDIAN_COUNT: usize = 33;
/// The period over which [`Time::share`] is computed.
const WINDOW: Duration = Duration::from_secs(1);
/// Maximum number of measurements within this period.
const MAX_RECENT: usize = 2048;

/// The stages of a frame, in order.
pub const STAGES: [&str; 9] = [
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
    /// True for a kernel, false for a stage.
    pub kernel: bool,
    /// Number of measurements.
    pub count: u64,
    /// Duration of the last measurement in seconds.
    pub last: f64,
    /// The median of the last measurements, in seconds.
    pub median: f64,
    /// The fraction of the last second spent in the kernel or stage; above 1 if several threads work at the same stage.
    pub share: f64,
    /// Number of pixel samples in a kernel's last dispatch, or number of pixels for kernels that take no samples; 0 for
    /// a stage.
    pub samples: u64,
    /// True if the device measured the times; otherwise, the times include the notification of the host.
    pub by_device: bool,
}

#[derive(Debug)]
struct TimeRecord {
    time: Time,
    /// Durations of the last measurements, for the median.
    durations: VecDeque<Duration>,
    /// End time and duration of the measurements in the last second, for `Time::share`.
    ended: VecDeque<(Instant, Duration)>,
}

impl Times {
    /// Records a stage that has just ended.
    pub fn record_stage(&self, name: &'static str, duration: Duration) {
        debug_assert!(STAGES.contains(&name));
        self.record(name, duration, None);
    }

    /// Runs and records a stage.
    pub fn measure<T>(&self, name: &'static str, run: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = run();
        self.record_stage(name, start.elapsed());
        result
    }

    /// Records a dispatch that has just ended.
    pub fn record_dispatch(&self, dispatch: &Dispatch) {
        self.record(dispatch.kernel, dispatch.took, Some(dispatch));
    }

    fn record(&self, name: &'static str, duration: Duration, dispatch: Option<&Dispatch>) {
        let mut records = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = records
            .iter()
            .position(|record| (record.time.name, record.time.kernel) == (name, dispatch.is_some()));
        let index = found.unwrap_or_else(|| {
            records.push(TimeRecord::new(name, dispatch.is_some()));
            records.len() - 1
        });
        let record = &mut records[index];
        record.time.count += 1;
        record.time.last = duration.as_secs_f64();
        if let Some(dispatch) = dispatch {
            (record.time.samples, record.time.by_device) = (dispatch.samples, dispatch.by_device);
        }
        record.durations.push_back(duration);
        record.ended.push_back((Instant::now(), duration));
        while record.durations.len() > MEDIAN_COUNT {
            record.durations.pop_front();
        }
        let has_old = |ended: &VecDeque<(Instant, Duration)>| {
            ended.len() > MAX_RECENT || ended.front().is_some_and(|(end, _)| end.elapsed() > WINDOW)
        };
        while has_old(&record.ended) {
            record.ended.pop_front();
        }
    }

    /// Returns the timings: kernels first, then the stages in order.
    pub fn timings(&self) -> Vec<Time> {
        let now = Instant::now();
        let records = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut timings: Vec<Time> = records.iter().map(|record| record.timing(now)).collect();
        let order = |time: &Time| (!time.kernel, STAGES.iter().position(|name| *name == time.name));
        timings.sort_by_key(order);
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
            durations: VecDeque::new(),
            ended: VecDeque::new(),
        }
    }

    fn timing(&self, now: Instant) -> Time {
        let mut durations: Vec<Duration> = self.durations.iter().copied().collect();
        durations.sort();
        let seconds_in_window = |(end, duration): &(Instant, Duration)| {
            let since_start = WINDOW.saturating_sub(now.saturating_duration_since(*end));
            (*duration).min(since_start).as_secs_f64()
        };
        Time {
            median: durations.get(durations.len() / 2).map_or(0.0, Duration::as_secs_f64),
            share: self.ended.iter().map(seconds_in_window).sum::<f64>() / WINDOW.as_secs_f64(),
            ..self.time.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_come_first_with_the_median_of_their_last_dispatches() {
        let times = Times::default();
        times.record_stage("upload", Duration::from_millis(3));
        times.record_stage("read files", Duration::from_millis(1));
        for i in 1..=100 {
            times.record_dispatch(&Dispatch {
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
        assert!(render.share > 0.5, "the dispatches ended just now: {}", render.share);
        assert!(render.by_device && !timings[1].by_device);
    }

    #[test]
    fn the_share_includes_only_time_within_the_last_second() {
        let now = Instant::now() + Duration::from_secs(5);
        let mut record = TimeRecord::new("send", false);
        for (age, duration) in [(3000, 500), (800, 500), (100, 50), (0, 20)] {
            record
                .ended
                .push_back((now - Duration::from_millis(age), Duration::from_millis(duration)));
        }
        let share = record.timing(now).share;
        assert!((share - (0.2 + 0.05 + 0.02)).abs() < 1e-9, "{share}");
    }
}
