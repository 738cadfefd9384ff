//! How much work a call is given, so that it ends in time.

use std::time::Duration;

/// How fast work goes, learnt from the calls so far.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    /// How long a call should take.
    call: Duration,
    /// Samples of pixels per second.
    speed: Option<f64>,
    /// Samples of pixels per second, where no pixel leaves samples out.
    speed_of_all: f64,
    /// The most samples of pixels in a call, once a larger one has failed.
    most: f64,
}

impl Pace {
    /// A first call is small enough for the slowest device and scene.
    const FIRST_CALL: f64 = 16384.0;
    /// How much faster work may seem where pixels leave samples out: the next tile may have none that does.
    const MOST_LEFT_OUT: f64 = 8.0;
    /// The fewest samples of pixels in a call: a workgroup's.
    const LEAST: f64 = 64.0;

    /// Nothing is known yet. A call aims to take `call`.
    pub fn new(call: Duration) -> Pace {
        Pace {
            call,
            speed: None,
            speed_of_all: 0.0,
            most: f64::INFINITY,
        }
    }

    /// A call has ended.
    pub fn took(&mut self, work: f64, time: Duration, of_all: bool) {
        let speed = work / time.as_secs_f64().max(1e-6);
        let speed = self.speed.map_or(speed, |known| speed.min(2.0 * known));
        if of_all {
            self.speed_of_all = speed;
        }
        self.speed = Some(speed.min(Self::MOST_LEFT_OUT * self.speed_of_all));
    }

    /// A call has failed, which may be because it took too long: the next ones are half as large at most.
    pub fn failed(&mut self, work: f64) {
        self.most = self.most.min(work / 2.0);
    }

    /// Other work comes, or another device does it.
    pub fn forget(&mut self) {
        self.speed = None;
    }

    /// No pixel of a new film leaves samples out at first.
    pub fn start_film(&mut self) {
        self.speed = self.speed.map(|speed| speed.min(self.speed_of_all));
    }

    /// Samples of pixels per second, once a call has been made.
    pub fn speed(&self) -> Option<f64> {
        self.speed
    }

    /// The samples of pixels that fit a call.
    pub fn work(&self) -> f64 {
        let work = self
            .speed
            .map_or(Self::FIRST_CALL, |speed| speed * self.call.as_secs_f64());
        work.min(self.most).max(Self::LEAST)
    }
}
