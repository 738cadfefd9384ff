//! What renders, and what it promises. The backends are below: [`Cpu`](crate::cpu::Cpu) and [`Gpu`](crate::gpu::Gpu).
//! The schedule of work is above: [`job`](crate::job).

use std::ops::Range;

use crate::error::RenderError;
use crate::film::{Film, Form};
use crate::records::{FirstHit, Packed};
use wgray_image::Region;

/// A scene on a device, with one film at a time.
///
/// This is the contract of every backend; `tests/contract.rs` holds each of them to it.
///
/// # Films
///
/// - There is no film at first. [`begin`](Backend::begin) starts an empty one, [`resume`](Backend::resume) goes on from
///   one that was read before, by whichever backend. Either takes the place of the film before.
/// - A film is a region of the picture. It may have no pixels.
/// - A film has the scene's [form](crate::film::Form): under adaptive sampling moments and looks beside its sums, and where
///   layers were asked for ([`Packed::with_layers`]) these too. With layers and without, all else has the same bits.
/// - [`film`](Backend::film) copies the film. It can be read at any time between two calls, as often as one likes, and
///   reading changes nothing.
///
/// # Calls
///
/// - [`submit`](Backend::submit) starts a call, which adds a range of samples to the pixels of a tile of the film. It does
///   not wait for the device. The call is pending until [`poll`](Backend::poll) returns true or [`wait`](Backend::wait)
///   returns. One call can be pending. [`render`](Backend::render) submits and waits.
/// - `poll` never waits for a device. A backend without a device of its own does the work in `poll` or `wait`, and then
///   either takes as long as the work does.
/// - With nothing pending, `poll` returns true and `wait` returns at once.
/// - Every cut of the work gives the same film, all of its lists, bit for bit: tiles of any shape in any order, and ranges of any length,
///   if every pixel gets each sample once, in ascending order.
/// - Under adaptive sampling all pixels of the film get their first [`samples_of_all`](Backend::samples_of_all) samples
///   before any pixel gets a further one. One range may hold both for the last tile that lacks first ones.
/// - An empty tile or an empty range of samples changes nothing, wherever it lies.
///
/// # First hits
///
/// - [`first_hits`](Backend::first_hits) needs no film, and leaves it as it is.
///
/// # Errors
///
/// Wrong calls are refused, and change nothing:
///
/// - [`RenderError::NoFilm`]: `submit` or `film` without a film;
/// - [`RenderError::Pending`]: anything but `poll` and `wait` while a call is pending;
/// - [`RenderError::Outside`]: a tile that is not inside the film, or a film or first hits that are not inside the picture;
/// - [`RenderError::FilmMismatch`]: `resume` with a film that is not of the scene's form;
/// - [`RenderError::PilotIncomplete`]: further samples before all pixels of the film have their first ones.
///
/// Any other error is the device's. After it nothing is pending and there is no film; `begin` and `resume` may work.
pub trait Backend {
    /// Starts an empty film of a region of the picture.
    fn begin(&mut self, region: Region) -> Result<(), RenderError>;

    /// Goes on from a film.
    fn resume(&mut self, film: Film) -> Result<(), RenderError>;

    /// Starts to add a range of samples to the pixels of a tile of the film.
    fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError>;

    /// Whether nothing is pending. A call that has ended is brought to its end here, or sent on if it needs several steps.
    fn poll(&mut self) -> Result<bool, RenderError>;

    /// Waits until nothing is pending.
    fn wait(&mut self) -> Result<(), RenderError>;

    /// Adds a range of samples to the pixels of a tile of the film, and returns when this is done.
    fn render(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        self.submit(tile, samples)?;
        self.wait()
    }

    /// A copy of the film as it is now. Waits until it is copied.
    fn film(&mut self) -> Result<Film, RenderError>;

    /// What the rays through the centres of a region's pixels meet first, row by row from the top. Waits until they are
    /// found; [`job::first_hits`](crate::job::first_hits) cuts a large region.
    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError>;

    /// The largest film that it can have, in pixels. It has room for the pixels [`around`](Backend::around) a film of this
    /// size.
    fn largest_film(&self) -> u64;

    /// How many samples all pixels get. Under adaptive sampling further ones are left out where they are not needed, as the
    /// first ones of the pixels around tell; else there is no such number, and this is the largest one.
    fn samples_of_all(&self) -> u32;

    /// The pixels whose samples decide on those of a region's pixels: itself, and under adaptive sampling the pixels beside
    /// it.
    fn around(&self, region: Region) -> Region;
}

/// What a backend refuses, and what it tells, by its scene alone: the same for all of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    picture: Region,
    form: Form,
    first_look: u32,
}

/// A film as far as the rules see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Started {
    pub region: Region,
    /// Samples of the first look that were added, over all pixels.
    first_samples: u64,
}

impl Rules {
    pub fn of(scene: &Packed) -> Rules {
        Rules {
            picture: Region::whole(scene.camera.width, scene.camera.height),
            form: scene.form(),
            first_look: scene.specialization.first_look,
        }
    }

    /// What a film has beside its sums.
    #[cfg(feature = "gpu")]
    pub fn form(&self) -> Form {
        self.form
    }

    /// The whole picture.
    #[cfg(feature = "gpu")]
    pub fn picture(&self) -> Region {
        self.picture
    }

    /// A picture of another size.
    #[cfg(feature = "gpu")]
    pub fn set_size(&mut self, width: u32, height: u32) {
        self.picture = Region::whole(width, height);
    }

    pub fn samples_of_all(&self) -> u32 {
        match self.form.adaptive {
            true => self.first_look,
            false => u32::MAX,
        }
    }

    pub fn around(&self, region: Region) -> Region {
        match self.form.adaptive {
            true => region.with_neighbors().within(self.picture),
            false => region,
        }
    }

    /// A film of a region without any sample.
    pub fn empty_film(&self, region: Region) -> Film {
        Film::of(region, self.form)
    }

    pub fn in_picture(&self, region: Region) -> Result<(), RenderError> {
        inside("region", region, "picture", self.picture)
    }

    pub fn begin(&self, region: Region) -> Result<Started, RenderError> {
        self.in_picture(region)?;
        Ok(Started {
            region,
            first_samples: 0,
        })
    }

    pub fn resume(&self, film: &Film) -> Result<Started, RenderError> {
        self.in_picture(film.region)?;
        let pixels = film.region.pixels();
        let of = |there: bool| if there { pixels } else { 0 };
        let Form { adaptive, layers } = self.form;
        let with = |there: bool| if there { "with" } else { "without" };
        let sampling = format!("a scene {} adaptive sampling", with(adaptive));
        let asked = format!("a scene {} layers", with(layers));
        let known = [
            ("sums", pixels, &sampling),
            ("moments", of(adaptive), &sampling),
            ("pilot samples", of(adaptive), &sampling),
        ];
        let of_layers = std::iter::repeat(("pixels of a layer", of(layers), &asked));
        for (list, (what, wanted, scene)) in film.lists().zip(known.into_iter().chain(of_layers)) {
            let found = list.len() as u64;
            if found != wanted {
                return Err(RenderError::FilmMismatch(format!(
                    "{found} {what} for {pixels} pixels; {scene} has {wanted}"
                )));
            }
        }
        let first = |count: u32| u64::from(count.min(self.first_look));
        Ok(Started {
            region: film.region,
            first_samples: film.sample_counts().map(first).sum(),
        })
    }

    /// Whether there is anything to do.
    pub fn call(&self, film: &mut Started, tile: Region, samples: &Range<u32>) -> Result<bool, RenderError> {
        if tile.is_empty() || samples.is_empty() {
            return Ok(false);
        }
        inside("tile", tile, "film", film.region)?;
        if self.form.adaptive {
            let first = samples.end.min(self.first_look).saturating_sub(samples.start);
            let there = film.first_samples + tile.pixels() * u64::from(first);
            if samples.end > self.first_look && there < film.region.pixels() * u64::from(self.first_look) {
                return Err(RenderError::PilotIncomplete {
                    samples: samples.clone(),
                    first: self.first_look,
                });
            }
            film.first_samples = there;
        }
        Ok(true)
    }

    /// The end of what one kernel can do of a range of samples: first ones or further ones.
    pub fn end_of_part(&self, samples: &Range<u32>) -> u32 {
        match self.form.adaptive && samples.start < self.first_look {
            true => samples.end.min(self.first_look),
            false => samples.end,
        }
    }
}

fn inside(what: &'static str, region: Region, of: &'static str, limits: Region) -> Result<(), RenderError> {
    if region.is_empty() || (!limits.is_empty() && region.within(limits) == region) {
        return Ok(());
    }
    Err(RenderError::Outside {
        what,
        region,
        of,
        limits,
    })
}
