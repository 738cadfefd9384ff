//! Size of dispatches, adapted to the measured speed.

use std::time::Duration;

/// Measured speed: work (samples over all pixels) per second.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    /// Target duration of a dispatch.
    call: Duration,
    speed: Option<f64>,
    /// Speed if no pixel skips samples.
    speed_of_all: f64,
    /// Maximum work, after a larger dispatch has failed.
    most: f64,
}

impl Pace {
    /// Small enough for the slowest device and scene.
    const FIRST_CALL: f64 = 16384.0;
    /// Maximum speedup from skipped samples with adaptive sampling. It is limited because in the next tile, maybe no
    /// pixel skips samples.
    const MAX_OUTLIER_RATIO: f64 = 8.0;
    /// Minimum work: one workgroup.
    const LEAST: f64 = 64.0;

    pub fn new(call: Duration) -> Pace {
        Pace {
            call,
            speed: None,
            speed_of_all: 0.0,
            most: f64::INFINITY,
        }
    }

    /// Records a finished dispatch. `of_all` is true if no pixel skipped samples.
    pub fn took(&mut self, work: f64, time: Duration, of_all: bool) {
        let speed = work / time.as_secs_f64().max(1e-6);
        let speed = self.speed.map_or(speed, |known| speed.min(2.0 * known));
        if of_all {
            self.speed_of_all = speed;
        }
        self.speed = Some(speed.min(Self::MAX_OUTLIER_RATIO * self.speed_of_all));
    }

    /// Halves the maximum: a failed dispatch may have taken too long.
    pub fn failed(&mut self, work: f64) {
        self.most = self.most.min(work / 2.0);
    }

    /// Discards the speed of other work or of another device.
    pub fn forget(&mut self) {
        self.speed = None;
    }

    /// Prepares for a film, in which no pixel skips samples at first.
    pub fn start_film(&mut self) {
        self.speed = self.speed.map(|speed| speed.min(self.speed_of_all));
    }

    pub fn speed(&self) -> Option<f64> {
        self.speed
    }

    /// Returns the work of the next dispatch.
    pub fn work(&self) -> f64 {
        let work = self
            .speed
            .map_or(Self::FIRST_CALL, |speed| speed * self.call.as_secs_f64());
        work.min(self.most).max(Self::LEAST)
    }
}
