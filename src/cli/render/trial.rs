//! Estimates the time of a job on this machine by rendering strips of one image for a few seconds.

use std::time::{Duration, Instant};

use crate::error::RenderError;
use anyhow::Context as _;
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::job::{self, Cut};

use super::plan::Plan;
use super::{Job, interrupted};
use crate::cli::frames::Frame;
use crate::cli::signal;

/// Number of strips, spread evenly over the image.
const STRIPS: u32 = 16;
/// Time limit per strip.
const PATIENCE: Duration = Duration::from_millis(250);
/// Maximum number of pixels of a strip: enough to fill a device.
const PIXELS: u64 = 1 << 16;

/// The result of a test render.
pub struct Trial {
    /// The name of the device.
    pub device: String,
    /// Startup time of each task: from the start of the program until the device is ready.
    pub fixed: Duration,
    /// Seconds to render all pixels.
    pub rendering: f64,
    /// Time of the slowest strip relative to the mean.
    pub unevenness: f64,
}

impl Trial {
    /// Renders strips of one frame. `start` is the start time of the program.
    pub fn of(job: &mut Job, frame: Frame, start: Instant) -> anyhow::Result<Trial> {
        job.go_to(frame)?;
        let plan = Plan::resolve(job.args, &job.scene, &job.log, frame, start)?;
        let stop = signal::stop().context("signal handler")?;
        let mut renderer = plan.renderer(&stop).map_err(|error| interrupted(error, &stop))?;
        let fixed = start.elapsed();
        let mut times = Vec::new();
        for strip in strips(plan.region()) {
            let work = renderer.work(|backend, _| {
                let mut stopped = || stop.signal().is_some();
                seconds_of_a_pixel(backend, strip, plan.scene.pixel_samples, &mut stopped)
            });
            times.push(work.map_err(|error| interrupted(error.into(), &stop))?);
        }
        let mean = times.iter().sum::<f64>() / times.len().max(1) as f64;
        let slowest = times.iter().copied().fold(0.0, f64::max);
        Ok(Trial {
            device: renderer.info().name.clone(),
            fixed,
            rendering: mean * plan.region().pixels() as f64,
            unevenness: slowest / mean.max(f64::MIN_POSITIVE),
        })
    }
}

/// Returns the strips, which consist of whole rows like parts.
fn strips(region: Region) -> impl Iterator<Item = Region> {
    let height = region.height();
    let count = height.min(STRIPS);
    let most = (PIXELS / u64::from(region.width().max(1))).max(1);
    (0..count).map(move |i| {
        let row = |i: u32| region.y0 + (u64::from(height) * u64::from(i) / u64::from(count.max(1))) as u32;
        let (y0, end) = (row(i), row(i + 1));
        let rows = u64::from(end - y0).min(most) as u32;
        let y0 = y0 + (end - y0 - rows) / 2;
        Region {
            y0,
            y1: y0 + rows,
            ..region
        }
    })
}

/// Returns the mean time of a pixel with all its samples, over a strip.
fn seconds_of_a_pixel(
    backend: &mut dyn Backend,
    strip: Region,
    samples: u32,
    stopped: &mut dyn FnMut() -> bool,
) -> Result<f64, RenderError> {
    let (start, mut done) = (Instant::now(), 0.0);
    let mut is_stopped = false;
    let mut progress = |fraction: f64| {
        done = fraction;
        is_stopped = stopped();
        !is_stopped && start.elapsed() < PATIENCE
    };
    let rendered = job::render(backend, strip, samples, &Cut::default(), &mut progress, &mut |_| Ok(()));
    match rendered {
        Err(RenderError::Cancelled) if !is_stopped && done > 0.0 => {}
        Err(error) => return Err(error),
        Ok(()) => done = 1.0,
    }
    Ok(start.elapsed().as_secs_f64() / (done * strip.pixels() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_lie_in_the_image_and_do_not_overlap() {
        for (width, height) in [
            (1, 1),
            (1, 16),
            (3, 17),
            (40, 30),
            (1920, 1080),
            (16384, 16384),
            (100_000, 2),
        ] {
            let region = Region {
                x0: 5,
                y0: 7,
                x1: 5 + width,
                y1: 7 + height,
            };
            let strips: Vec<Region> = strips(region).collect();
            assert_eq!(strips.len() as u32, height.min(STRIPS));
            let mut before = region.y0;
            for strip in strips {
                assert!(
                    strip.y0 >= before && strip.y1 > strip.y0 && strip.y1 <= region.y1,
                    "{strip:?}"
                );
                assert_eq!((strip.x0, strip.x1), (region.x0, region.x1));
                assert!(strip.height() == 1 || strip.pixels() <= PIXELS);
                before = strip.y1;
            }
        }
    }
}
