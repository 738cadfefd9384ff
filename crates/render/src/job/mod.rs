//! Scheduling of renders on any backend: bands that fit into memory, dispatches of bounded duration, progress,
//! cancellation, checkpoints and parts. Each dispatch adds its samples directly to the film's sums, for every pixel in
//! ascending order, so that the bits do not depend on how a render is divided.

mod bands;
pub mod checkpoint;
mod identity;
mod pace;
mod part;
mod piece;
mod pieces_file;
mod steps;

use std::time::Duration;

use crate::backend::Backend;
use crate::error::RenderError;
use wgray_image::Region;
use wgray_trace::film::{Film, FilmLayout};
use wgray_trace::records::FirstHit;

pub use bands::{Bands, FinishedBand, Flow, PassEnds, Watch, check_memory};
pub use identity::{Identity, hash_of_scene};
pub use part::{PartError, PartHeader, Parts, Tile, read_part, write_part};
pub use piece::{CheckpointStore, FilmPiece, INTERVAL, NoCheckpoint, StoredPiece};
pub use steps::{Order, SampleProgress, Steps};

/// Target duration of a dispatch: long enough to hide the overhead, short enough for watchdogs and cancellation.
const DISPATCH_DURATION: Duration = Duration::from_millis(60);

/// Division of a render into bands and dispatches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkSplit {
    /// Maximum film size in pixels.
    pub band_pixels: u64,
    /// Samples per dispatch; `None` adapts the number to the measured speed.
    pub samples_per_dispatch: Option<u32>,
    /// Rows per dispatch; `None` adapts the number to the measured speed.
    pub rows_per_dispatch: Option<u32>,
}

impl Default for WorkSplit {
    /// Films of at most 64 MiB, or 192 MiB with adaptive sampling.
    fn default() -> WorkSplit {
        WorkSplit {
            band_pixels: 4 << 20,
            samples_per_dispatch: None,
            rows_per_dispatch: None,
        }
    }
}

impl WorkSplit {
    /// Returns [`WorkSplit::default`], with smaller bands for layers, so that a film takes no more memory than with
    /// adaptive sampling.
    pub fn of(film_layout: FilmLayout) -> WorkSplit {
        const ADAPTIVE_LISTS: u64 = 3;
        let split = WorkSplit::default();
        WorkSplit {
            band_pixels: split.band_pixels * ADAPTIVE_LISTS / ADAPTIVE_LISTS.max(film_layout.lists() as u64),
            ..split
        }
    }
}

/// Splits a region into bands of whole rows that fit a film, from top to bottom; an empty region has no bands.
pub fn bands(region: Region, split: &WorkSplit, largest_film: u64) -> impl Iterator<Item = Region> + use<> {
    let [width, height] = [region.width(), region.height()].map(|n| u64::from(n.max(1)));
    let rows = (split.band_pixels.min(largest_film) / width).clamp(1, height) as u32;
    let end = if region.is_empty() { region.y0 } else { region.y1 };
    (region.y0..end).step_by(rows as usize).map(move |y0| Region {
        y0,
        y1: region.y1.min(y0 + rows),
        ..region
    })
}

/// Returns the first hits through a region's pixel centers, in row-major order, top row first. Dispatches have a
/// bounded size.
pub fn first_hits(backend: &mut dyn Backend, region: Region) -> Result<Vec<FirstHit>, RenderError> {
    const DISPATCH_PIXELS: u64 = 1 << 18;
    let split = WorkSplit {
        band_pixels: DISPATCH_PIXELS,
        ..WorkSplit::default()
    };
    let mut hits = Vec::new();
    for strip in bands(region, &split, backend.largest_film()) {
        hits.extend(backend.first_hits(strip)?);
    }
    Ok(hits)
}

/// Renders an image band by band, from top to bottom, and passes each band to `output`. `progress` receives the
/// finished fraction of the samples, 0 to 1, and returns true to continue.
pub fn render(
    backend: &mut dyn Backend,
    region: Region,
    samples: u32,
    split: &WorkSplit,
    progress: &mut dyn FnMut(f64) -> bool,
    output: &mut dyn FnMut(Film) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let mut no_checkpoint = NoCheckpoint;
    let mut bands = Bands::new(
        region,
        samples,
        split,
        Order::Rows,
        backend.largest_film(),
        &mut no_checkpoint,
    );
    let mut watch = |_: &mut dyn Backend, _: Region, fraction: f64| Ok(progress(fraction).into());
    while let Some(band) = bands.render_next(backend, &mut watch, &mut || {})? {
        output(band.film)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;

    /// A backend that records its dispatches.
    struct Recorder(Vec<(Region, Range<u32>)>);

    impl Backend for Recorder {
        fn begin(&mut self, _: Region) -> Result<(), RenderError> {
            Ok(())
        }

        fn resume(&mut self, _: Film) -> Result<(), RenderError> {
            Ok(())
        }

        fn poll(&mut self) -> Result<bool, RenderError> {
            Ok(true)
        }

        fn wait(&mut self) -> Result<(), RenderError> {
            Ok(())
        }

        fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
            self.0.push((tile, samples));
            Ok(())
        }

        fn film(&mut self) -> Result<Film, RenderError> {
            Err(RenderError::Cancelled)
        }

        fn first_hits(&mut self, _: Region) -> Result<Vec<FirstHit>, RenderError> {
            Ok(Vec::new())
        }

        fn largest_film(&self) -> u64 {
            u64::MAX
        }

        fn unskippable_samples(&self) -> u32 {
            u32::MAX
        }

        fn around(&self, region: Region) -> Region {
            region
        }
    }

    #[test]
    fn both_orders_give_every_pixel_each_sample_once() {
        for (order, first) in [(Order::Rows, 0..16), (Order::Pixels, 0..4)] {
            let (mut recorder, region) = (Recorder(Vec::new()), Region::whole(64, 64));
            let mut steps = Steps::new(&WorkSplit::default(), DISPATCH_DURATION, order);
            steps.start(&recorder, region, 16);
            while steps.step(&mut recorder).unwrap().is_some() {}
            assert_eq!(recorder.0[0].1, first, "{order:?}");
            // Every pixel gets each sample once, in ascending order.
            let mut samples = [0; 64];
            for (tile, range) in recorder.0 {
                assert_eq!((tile.x0, tile.x1), (0, 64));
                for done in &mut samples[tile.y0 as usize..tile.y1 as usize] {
                    assert_eq!(*done, range.start);
                    *done = range.end;
                }
            }
            assert_eq!(samples, [16; 64], "{order:?}");
        }
    }

    /// Like `Recorder`, with adaptive sampling and four pilot samples.
    #[derive(Default)]
    struct AdaptiveRecorder {
        film: Option<Region>,
        dispatches: Vec<(Region, Range<u32>)>,
    }

    impl Backend for AdaptiveRecorder {
        fn begin(&mut self, region: Region) -> Result<(), RenderError> {
            self.film = Some(region);
            Ok(())
        }

        fn resume(&mut self, _: Film) -> Result<(), RenderError> {
            Ok(())
        }

        fn poll(&mut self) -> Result<bool, RenderError> {
            Ok(true)
        }

        fn wait(&mut self) -> Result<(), RenderError> {
            Ok(())
        }

        fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
            self.dispatches.push((tile, samples));
            Ok(())
        }

        fn film(&mut self) -> Result<Film, RenderError> {
            self.film.map(Film::adaptive).ok_or(RenderError::Cancelled)
        }

        fn first_hits(&mut self, _: Region) -> Result<Vec<FirstHit>, RenderError> {
            Ok(Vec::new())
        }

        fn largest_film(&self) -> u64 {
            u64::MAX
        }

        fn unskippable_samples(&self) -> u32 {
            4
        }

        fn around(&self, region: Region) -> Region {
            region.with_border(1).within(Region::whole(64, 64))
        }
    }

    #[test]
    fn pilot_samples_of_a_region_and_its_neighbors_precede_further_samples() {
        let (region, film) = (
            Region {
                x0: 5,
                y0: 10,
                x1: 64,
                y1: 64,
            },
            Region {
                x0: 4,
                y0: 9,
                x1: 64,
                y1: 64,
            },
        );
        for samples_per_dispatch in [None, Some(3)] {
            let split = WorkSplit {
                samples_per_dispatch,
                ..WorkSplit::default()
            };
            let (mut backend, mut finished, mut outputs) = (AdaptiveRecorder::default(), 0.0, Vec::new());
            let mut progress = |fraction| {
                finished = fraction;
                true
            };
            let mut output = |film: Film| {
                outputs.push((film.region, film.sums.len(), film.moments.len()));
                Ok(())
            };
            render(&mut backend, region, 16, &split, &mut progress, &mut output).unwrap();
            assert_eq!((backend.film, outputs.len()), (Some(film), 1));
            assert_eq!(outputs[0], (region, region.pixels() as usize, region.pixels() as usize));
            let further = backend
                .dispatches
                .iter()
                .position(|(_, samples)| samples.start >= 4)
                .unwrap();
            let check = |dispatches: &[(Region, Range<u32>)], part: Region, samples: Range<u32>| {
                for (tile, range) in dispatches {
                    assert_eq!((tile.x0, tile.x1), (part.x0, part.x1));
                    assert!(range.start >= samples.start && range.end <= samples.end);
                    assert_eq!(*tile, tile.within(part));
                }
                let pixels = dispatches
                    .iter()
                    .map(|(tile, range)| tile.pixels() * range.len() as u64);
                assert_eq!(pixels.sum::<u64>(), part.pixels() * samples.len() as u64);
            };
            check(&backend.dispatches[..further], film, 0..4);
            check(&backend.dispatches[further..], region, 4..16);
            assert!((finished - 1.0).abs() < 1e-12, "{finished}");
        }
    }
}
