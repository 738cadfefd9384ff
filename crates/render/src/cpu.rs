//! The CPU backend, which renders on a thread pool.

use std::ops::{Deref, DerefMut, Range};

use glam::UVec2;
use rayon::prelude::*;
use wgray_image::Region;
use wgray_trace::cpu::accumulate::add_samples;
use wgray_trace::cpu::decoded_bvhs::decode_bvhs;
use wgray_trace::cpu::geometry::pixel_first_hit;
use wgray_trace::film::Film;
use wgray_trace::records::{Camera, FirstHit, Packed};

use crate::backend::{Backend, FilmState, Rules};
use crate::error::RenderError;

/// A scene's CPU backend. Dispatches run in [`Backend::poll`] or [`Backend::wait`], on the current rayon pool.
pub struct Cpu<P> {
    scene: P,
    rules: Rules,
    film: Option<(Film, FilmState)>,
    pending: Option<(Region, Range<u32>)>,
}

impl<P: Deref<Target = Packed>> Cpu<P> {
    /// Renders a scene, given by a reference or an `Arc`.
    pub fn new(scene: P) -> Cpu<P> {
        Cpu {
            rules: Rules::of(&scene),
            scene,
            film: None,
            pending: None,
        }
    }

    /// Returns the scene.
    pub fn scene(&self) -> &P {
        &self.scene
    }

    /// Returns the scene and drops the film.
    pub fn into_scene(self) -> P {
        self.scene
    }

    /// Edits the scene and discards the film.
    pub fn edit_scene(&mut self, edit: impl FnOnce(&mut P)) {
        edit(&mut self.scene);
        (self.rules, self.film, self.pending) = (Rules::of(&self.scene), None, None);
    }

    /// Returns the film, if rendering has begun.
    pub fn into_film(self) -> Option<Film> {
        self.film.map(|(film, _)| film)
    }

    /// Decodes the BVHs for fast traversal, which the first dispatch does otherwise.
    pub fn prepare(&self) {
        decode_bvhs(&self.scene);
    }

    fn check_idle(&self) -> Result<(), RenderError> {
        match self.pending {
            Some(_) => Err(RenderError::Pending),
            None => Ok(()),
        }
    }
}

impl<P: DerefMut<Target = Packed>> Cpu<P> {
    /// Changes the camera and discards the film.
    pub fn set_camera(&mut self, camera: &Camera) {
        self.scene.camera = *camera;
        (self.rules, self.film, self.pending) = (Rules::of(&self.scene), None, None);
    }
}

impl<P: Deref<Target = Packed>> Backend for Cpu<P> {
    fn begin(&mut self, region: Region) -> Result<(), RenderError> {
        self.check_idle()?;
        let state = self.rules.begin(region)?;
        self.film = Some((self.rules.empty_film(region), state));
        Ok(())
    }

    fn resume(&mut self, film: Film) -> Result<(), RenderError> {
        self.check_idle()?;
        let state = self.rules.resume(&film)?;
        self.film = Some((film, state));
        Ok(())
    }

    fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        self.check_idle()?;
        let (_, state) = self.film.as_mut().ok_or(RenderError::NoFilm)?;
        if self.rules.call(state, tile, &samples)? {
            self.pending = Some((tile, samples));
        }
        Ok(())
    }

    fn poll(&mut self) -> Result<bool, RenderError> {
        if let (Some((tile, mut samples)), Some((film, _))) = (self.pending.take(), &mut self.film) {
            let scene: &Packed = &self.scene;
            decode_bvhs(scene);
            while !samples.is_empty() {
                let end = self.rules.end_of_part(&samples);
                add_samples(scene, film, tile, samples.start..end);
                samples.start = end;
            }
        }
        Ok(true)
    }

    fn wait(&mut self) -> Result<(), RenderError> {
        self.poll().map(|_| ())
    }

    fn film(&mut self) -> Result<Film, RenderError> {
        self.check_idle()?;
        let (film, _) = self.film.as_ref().ok_or(RenderError::NoFilm)?;
        Ok(film.clone())
    }

    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        self.check_idle()?;
        self.rules.in_picture(region)?;
        let scene: &Packed = &self.scene;
        let rows = (region.y0..region.y1).into_par_iter();
        let pixels = rows.flat_map_iter(|y| (region.x0..region.x1).map(move |x| UVec2::new(x, y)));
        Ok(pixels.map(|pixel| pixel_first_hit(scene, pixel)).collect())
    }

    fn unskippable_samples(&self) -> u32 {
        self.rules.unskippable_samples()
    }

    fn around(&self, region: Region) -> Region {
        self.rules.around(region)
    }

    fn largest_film(&self) -> u64 {
        u64::MAX
    }
}
