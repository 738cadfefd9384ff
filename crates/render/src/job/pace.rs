//! The amount of work per dispatch, adapted to the measured speed.

use std::time::Duration;

/// Measured speed: total samples of all pixels per second.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    /// Target duration of a dispatch.
    dispatch_duration: Duration,
    speed: Option<f64>,
    /// Speed if no pixel skips samples.
    full_speed: f64,
    /// Maximum work of a dispatch, after a larger dispatch has failed.
    max_work: f64,
}

impl Pace {
    /// Work of the first dispatch: small enough for the slowest device and scene.
    const FIRST_DISPATCH: f64 = 16384.0;
    /// Maximum speedup from samples that adaptive sampling skips. The speedup is limited because the pixels of the next
    /// tile may skip no samples.
    const MAX_SPEEDUP: f64 = 8.0;
    /// Minimum work of a dispatch: one workgroup.
    const MIN_WORK: f64 = 64.0;

    pub fn new(dispatch_duration: Duration) -> Pace {
        Pace {
            dispatch_duration,
            speed: None,
            full_speed: 0.0,
            max_work: f64::INFINITY,
        }
    }

    /// Records a finished dispatch. `is_full` is true if no pixel skipped samples.
    pub fn record(&mut self, work: f64, time: Duration, is_full: bool) {
        let speed = work / time.as_secs_f64().max(1e-6);
        let speed = self.speed.map_or(speed, |previous| speed.min(2.0 * previous));
        if is_full {
            self.full_speed = speed;
        }
        self.speed = Some(speed.min(Self::MAX_SPEEDUP * self.full_speed));
    }

    /// Limits further dispatches to half the work of a failed dispatch, which may have taken too long.
    pub fn failed(&mut self, work: f64) {
        self.max_work = self.max_work.min(work / 2.0);
    }

    /// Discards the measured speed, when the work or the device changes.
    pub fn forget(&mut self) {
        self.speed = None;
    }

    /// Prepares for a new film, in which no pixel skips samples at first.
    pub fn start_film(&mut self) {
        self.speed = self.speed.map(|speed| speed.min(self.full_speed));
    }

    pub fn speed(&self) -> Option<f64> {
        self.speed
    }

    /// Returns the work of the next dispatch.
    pub fn work(&self) -> f64 {
        let work = self.speed.map_or(Self::FIRST_DISPATCH, |speed| {
            speed * self.dispatch_duration.as_secs_f64()
        });
        work.min(self.max_work).max(Self::MIN_WORK)
    }
}
