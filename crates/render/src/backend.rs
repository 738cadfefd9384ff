//! The [`Backend`] trait with its contract, and the argument checks that its implementations share.

use std::ops::Range;

use crate::error::RenderError;
use wgray_image::Region;
use wgray_trace::cpu::accumulate::neighbor_radius;
use wgray_trace::film::{Film, FilmLayout, Layer};
use wgray_trace::records::{FirstHit, Packed};

/// A scene on a device, with at most one film at a time.
///
/// `tests/contract.rs` tests every backend against this contract.
///
/// # Films
///
/// - [`begin`](Backend::begin) creates an empty film. [`resume`](Backend::resume) continues one, possibly from another
///   backend. Both replace the current film.
/// - A film covers a region of the image, which may be empty.
/// - A film has the scene's [layout](FilmLayout): sums; with adaptive sampling, also moments and pilot statistics; if
///   requested, layers ([`Packed::with_layers`]) and noise estimates ([`Packed::with_noise`]). Layers do not change the
///   bits of other lists, noise estimates do not change the bits of sums, moments, pilot statistics and colors of layers.
/// - [`film`](Backend::film) returns a copy of the film. It fails while a dispatch is pending.
///
/// # Dispatches
///
/// - [`submit`](Backend::submit) starts a dispatch, which adds samples to the pixels of a tile. At most one dispatch is
///   pending, until [`poll`](Backend::poll) returns true or [`wait`](Backend::wait) returns.
///   [`render`](Backend::render) submits and waits.
/// - `submit` and `poll` never wait for a device. A backend without a device computes the samples in `poll` or `wait`.
/// - If no dispatch is pending, `poll` returns true and `wait` returns immediately.
/// - Every partition of a render into tiles and sample ranges gives a film with the same bits, provided that every
///   pixel gets each sample once, in ascending order.
/// - With adaptive sampling, all pixels get their first [`unskippable_samples`](Backend::unskippable_samples) samples
///   before any pixel gets further samples. The dispatch that completes the pilot samples may add further samples
///   to its tile.
/// - An empty tile or an empty range of samples changes nothing, regardless of its position.
///
/// # First hits
///
/// - [`first_hits`](Backend::first_hits) neither needs nor changes a film.
///
/// # Errors
///
/// Calls that violate the contract fail and change nothing:
///
/// - [`RenderError::NoFilm`]: `submit` or `film` without a film;
/// - [`RenderError::Pending`]: any method except `poll` and `wait` while a dispatch is pending;
/// - [`RenderError::Outside`]: a tile outside the film, or a film or first hits outside the image;
/// - [`RenderError::FilmMismatch`]: `resume` with a film whose layout differs from the scene's;
/// - [`RenderError::PilotIncomplete`]: further samples before all pixels of the film have their pilot samples.
///
/// All other errors come from the device. After such an error, no dispatch is pending and no film exists; `begin` and
/// `resume` may still succeed.
pub trait Backend {
    /// Creates an empty film of a region of the image.
    fn begin(&mut self, region: Region) -> Result<(), RenderError>;

    /// Continues a film.
    fn resume(&mut self, film: Film) -> Result<(), RenderError>;

    /// Starts to add a range of samples to the pixels of a tile.
    fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError>;

    /// Returns true if no dispatch is pending. Completes a finished dispatch, or submits its next part.
    fn poll(&mut self) -> Result<bool, RenderError>;

    /// Waits until no dispatch is pending.
    fn wait(&mut self) -> Result<(), RenderError>;

    /// Adds samples to the pixels of a tile, and waits.
    fn render(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        self.submit(tile, samples)?;
        self.wait()
    }

    /// Copies the film.
    fn film(&mut self) -> Result<Film, RenderError>;

    /// Returns the first hits through the pixel centers, in row-major order, top row first. Waits until they are
    /// available; [`job::first_hits`](crate::job::first_hits) splits a large region.
    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError>;

    /// Returns the maximum number of pixels of a region whose film, with the pixels that [`around`](Backend::around)
    /// adds, fits into the device's buffers.
    fn largest_film(&self) -> u64;

    /// Returns the number of leading samples that no pixel skips: the pilot samples with adaptive sampling, else
    /// `u32::MAX`.
    fn unskippable_samples(&self) -> u32;

    /// Returns the region that the film of `region` must cover: `region`, and with adaptive sampling also its
    /// neighbors, which affect the sample counts of its pixels.
    fn around(&self, region: Region) -> Region;
}

/// Argument checks and scene-derived limits shared by all backends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    picture: Region,
    film_layout: FilmLayout,
    pilot_samples: u32,
    neighbor_radius: u32,
}

/// The state of a film that the checks depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FilmState {
    pub region: Region,
    /// Pilot samples so far, over all pixels.
    pilot_total: u64,
}

impl Rules {
    pub fn of(scene: &Packed) -> Rules {
        Rules {
            picture: Region::whole(scene.camera.width, scene.camera.height),
            film_layout: scene.film_layout(),
            pilot_samples: scene.specialization.pilot_samples,
            neighbor_radius: neighbor_radius(scene.specialization.smooth_noise != 0),
        }
    }

    #[cfg(feature = "gpu")]
    pub fn film_layout(&self) -> FilmLayout {
        self.film_layout
    }

    #[cfg(feature = "gpu")]
    pub fn neighbor_radius(&self) -> u32 {
        self.neighbor_radius
    }

    #[cfg(feature = "gpu")]
    pub fn picture(&self) -> Region {
        self.picture
    }

    #[cfg(feature = "gpu")]
    pub fn set_size(&mut self, width: u32, height: u32) {
        self.picture = Region::whole(width, height);
    }

    pub fn unskippable_samples(&self) -> u32 {
        match self.film_layout.adaptive {
            true => self.pilot_samples,
            false => u32::MAX,
        }
    }

    pub fn around(&self, region: Region) -> Region {
        match self.film_layout.adaptive {
            true => region.with_border(self.neighbor_radius).within(self.picture),
            false => region,
        }
    }

    pub fn empty_film(&self, region: Region) -> Film {
        Film::of(region, self.film_layout)
    }

    pub fn in_picture(&self, region: Region) -> Result<(), RenderError> {
        inside("region", region, "image", self.picture)
    }

    pub fn begin(&self, region: Region) -> Result<FilmState, RenderError> {
        self.in_picture(region)?;
        Ok(FilmState { region, pilot_total: 0 })
    }

    pub fn resume(&self, film: &Film) -> Result<FilmState, RenderError> {
        self.in_picture(film.region)?;
        let pixels = film.region.pixels();
        let length_if = |exists: bool| if exists { pixels } else { 0 };
        let film_layout = self.film_layout;
        let FilmLayout {
            adaptive,
            layers,
            noise,
        } = film_layout;
        let with_or_without = |exists: bool| if exists { "with" } else { "without" };
        let sampling = format!("a scene {} adaptive sampling", with_or_without(adaptive));
        let layering = format!("a scene {} layers", with_or_without(layers));
        let estimating = format!("a scene {} noise estimates", with_or_without(noise));
        let moments = if adaptive { &sampling } else { &estimating };
        let first_lists = [
            ("sums", pixels, &sampling),
            ("moments", length_if(film_layout.has_moments()), moments),
            ("pilot statistics", length_if(adaptive), &sampling),
        ];
        let layer_lists = [("pixels of a layer", length_if(layers), &layering); Layer::ALL.len()];
        let noise_lists = [
            ("half sums", length_if(noise), &estimating),
            (
                "moments of the albedo",
                length_if(film_layout.has_layer_moments()),
                &estimating,
            ),
            (
                "moments of the normal",
                length_if(film_layout.has_layer_moments()),
                &estimating,
            ),
        ];
        let expected_lists = first_lists.into_iter().chain(layer_lists).chain(noise_lists);
        for (list, (name, expected, scene)) in film.lists().zip(expected_lists) {
            let found = list.len() as u64;
            if found != expected {
                return Err(RenderError::FilmMismatch(format!(
                    "{name}: found {found}, expected {expected} for {scene}"
                )));
            }
        }
        let pilot_count = |count: u32| u64::from(count.min(self.pilot_samples));
        Ok(FilmState {
            region: film.region,
            pilot_total: film.sample_counts().map(pilot_count).sum(),
        })
    }

    /// Checks a dispatch and counts its pilot samples. Returns false if the dispatch is empty.
    pub fn call(&self, film: &mut FilmState, tile: Region, samples: &Range<u32>) -> Result<bool, RenderError> {
        if tile.is_empty() || samples.is_empty() {
            return Ok(false);
        }
        inside("tile", tile, "film", film.region)?;
        if self.film_layout.adaptive {
            let added = samples.end.min(self.pilot_samples).saturating_sub(samples.start);
            let pilot_total = film.pilot_total + tile.pixels() * u64::from(added);
            if samples.end > self.pilot_samples && pilot_total < film.region.pixels() * u64::from(self.pilot_samples) {
                return Err(RenderError::PilotIncomplete {
                    samples: samples.clone(),
                    pilot_samples: self.pilot_samples,
                });
            }
            film.pilot_total = pilot_total;
        }
        Ok(true)
    }

    /// Returns the end of the samples that one execution of a kernel can add: either pilot samples or further samples.
    pub fn end_of_part(&self, samples: &Range<u32>) -> u32 {
        match self.film_layout.adaptive && samples.start < self.pilot_samples {
            true => samples.end.min(self.pilot_samples),
            false => samples.end,
        }
    }
}

fn inside(name: &'static str, region: Region, container: &'static str, limits: Region) -> Result<(), RenderError> {
    if region.is_empty() || (!limits.is_empty() && region.within(limits) == region) {
        return Ok(());
    }
    Err(RenderError::Outside {
        what: name,
        region,
        of: container,
        limits,
    })
}
