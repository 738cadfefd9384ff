//! Renders an image progressively: first at a coarse resolution, then all pixels with few samples, then with more
//! samples. An interruption waits for at most one dispatch.

use std::ops::Range;
use std::time::Duration;

use wgray_image::{Pixels, Region};
use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
use wgray_render::error::RenderError;
use wgray_render::gpu::{Dispatch, Gpu};
use wgray_render::job::{Order, Steps, WorkSplit};
use wgray_render::output::Aov;
use wgray_trace::film::Film;
use wgray_trace::records::{Camera, FirstHit, Packed};

use super::engine::Engine;
use super::film_layer::FilmLayer;
use super::picture::{Content, View};
use super::pixel_values::means;

/// Target duration of a dispatch; a save or a camera move waits up to this long.
const DISPATCH_DURATION: Duration = Duration::from_millis(30);
/// Target render time of a coarse image; including the display time, about 20 images are shown per second.
const COARSE_DURATION: Duration = Duration::from_millis(30);
/// Number of pixels of a coarse image while the speed is unknown.
const COARSE_PIXELS: f64 = 10_000.0;
/// Maximum scale of a coarse image.
const MAX_SCALE: u32 = 32;
/// Maximum number of displayed pixels, and maximum side length, because browsers do not show larger images.
const MAX_PIXELS: u64 = 1 << 24;
const MAX_SIDE: u32 = 1 << 14;
/// Number of samples from which an unfinished image is denoised. With fewer samples, the camera is probably moving.
const MIN_DENOISED_SAMPLES: u32 = 4;
/// Number of first hits per dispatch.
const HITS_PER_DISPATCH: u32 = 1 << 17;

pub struct Canvas {
    engine: Engine,
    /// The scene, with the camera of the current stage.
    scene: Packed,
    /// The camera of the full-size image.
    camera: Camera,
    /// The scale of the finished film; above 1 for a scaled preview, or if the image is too large to display.
    final_scale: u32,
    /// True if the CPU also renders the image, for [`View::Compare`].
    compare: bool,
    stage: Stage,
    steps: Steps,
    /// The most recent films of a lower resolution: the engine's film and, for [`View::Compare`], the CPU's film.
    coarser: Option<(Film, Option<Film>)>,
    /// For [`View::Compare`], the CPU's film of this stage.
    cpu: Film,
    /// The first hits of the rows rendered so far, top row first.
    hits: Vec<FirstHit>,
    /// True once the image has a result that can be shown.
    has_result: bool,
    limits: Limits,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Maximum number of samples per pixel, at least 1.
    pub samples: u32,
    /// The scale of the preview, at least 1: number of image pixels along each side of a displayed pixel.
    pub scale: u32,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            samples: u32::MAX,
            scale: 1,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stage {
    /// Number of image pixels along each side of a film pixel.
    scale: u32,
    width: u32,
    height: u32,
    /// True once a dispatch of this stage has ended.
    has_result: bool,
}

impl Canvas {
    pub fn new(engine: Engine, scene: Packed, view: View, limits: Limits) -> Result<Canvas, RenderError> {
        let camera = scene.camera;
        let stage = Stage {
            scale: 1,
            width: camera.width,
            height: camera.height,
            has_result: false,
        };
        let mut canvas = Canvas {
            engine,
            scene,
            camera,
            final_scale: 1,
            compare: false,
            stage,
            steps: Steps::new(&WorkSplit::default(), DISPATCH_DURATION, Order::Pixels),
            coarser: None,
            cpu: Film::new(Region::whole(0, 0)),
            hits: Vec::new(),
            has_result: false,
            limits,
        };
        canvas.restart(camera, view)?;
        Ok(canvas)
    }

    /// Returns true if the CPU renders the image.
    pub fn is_on_cpu(&self) -> bool {
        self.engine.is_cpu()
    }

    /// Continues the image of the CPU on an adapter that already has this scene and computes the bits of the CPU. If
    /// the adapter needs a different scale of the finished film, restarts the image.
    pub fn continue_on(&mut self, gpu: Box<Gpu>, view: View) -> Result<(), RenderError> {
        let film = self.engine.backend().film()?;
        self.engine = Engine::Gpu(gpu);
        self.steps.forget_pace();
        let largest_film = self.engine.backend().largest_film();
        if final_scale(self.camera.width, self.camera.height, largest_film, self.limits.scale) != self.final_scale {
            return self.restart(self.camera, view);
        }
        self.engine.set_camera(&self.scene.camera)?;
        self.engine.backend().resume(film)
    }

    /// Returns true if the canvas renders `scene`, from its camera.
    pub fn renders(&self, scene: &Packed) -> bool {
        scene.camera == self.camera && scene.same_but_camera(&self.scene)
    }

    /// Starts to render a changed scene. If the scene needs a different kernel, does nothing and returns false.
    pub fn update(&mut self, scene: &Packed, view: View) -> Result<bool, RenderError> {
        if scene.same_but_camera(&self.scene) {
            self.restart(scene.camera, view)?;
            return Ok(true);
        }
        let same_kernel = self.engine.update(scene)?;
        if same_kernel {
            self.scene = scene.clone();
            self.restart(scene.camera, view)?;
        }
        Ok(same_kernel)
    }

    /// Sets the slider values, given as bit patterns, and discards the film. The caller must start the image again.
    pub fn set_sliders(&mut self, values: &[u32]) -> Result<(), RenderError> {
        self.engine.set_sliders(values)
    }

    /// Returns the dispatches that have ended since the last call.
    pub fn dispatches(&mut self) -> Vec<Dispatch> {
        self.engine.dispatches()
    }

    pub fn restart(&mut self, camera: Camera, view: View) -> Result<(), RenderError> {
        self.camera = camera;
        if self.compare != view.is_rendered_twice() {
            self.steps.forget_pace();
        }
        self.compare = view.is_rendered_twice();
        self.coarser = None;
        self.hits.clear();
        self.has_result = false;
        let largest_film = self.engine.backend().largest_film();
        self.final_scale = final_scale(camera.width, camera.height, largest_film, self.limits.scale);
        let scale = if self.hit_layer(view).is_some() {
            self.final_scale
        } else {
            self.first_scale()
        };
        self.begin(scale)
    }

    pub fn change_view(&mut self, view: View) -> Result<(), RenderError> {
        let shows_film = self.hit_layer(view).is_none();
        let is_empty = self.stage.scale == self.final_scale && self.steps.samples() == 0;
        let backends_change = self.compare != view.is_rendered_twice();
        // The film may already contain a result for this view.
        self.has_result = shows_film && self.stage.scale == self.final_scale && !is_empty;
        if shows_film && (backends_change || is_empty) {
            self.restart(self.camera, view)
        } else if !shows_film && self.stage.scale > self.final_scale {
            self.begin(self.final_scale)
        } else {
            Ok(())
        }
    }

    /// Returns the first-hit layer that a view shows.
    fn hit_layer(&self, view: View) -> Option<Aov> {
        view.hit_layer(self.scene.integrator)
    }

    fn first_scale(&self) -> u32 {
        let pixels = f64::from(self.camera.width) * f64::from(self.camera.height);
        let affordable_pixels = self
            .steps
            .speed()
            .map_or(COARSE_PIXELS, |speed| speed * COARSE_DURATION.as_secs_f64());
        ((pixels / affordable_pixels.max(1.0)).sqrt().ceil() as u32)
            .next_power_of_two()
            .min(MAX_SCALE)
            .max(self.final_scale)
    }

    fn begin(&mut self, scale: u32) -> Result<(), RenderError> {
        let [width, height] = self.size_at(scale);
        let region = Region::whole(width, height);
        self.stage = Stage {
            scale,
            width,
            height,
            has_result: false,
        };
        self.scene.camera = Camera {
            width,
            height,
            ..self.camera
        };
        self.engine.set_camera(&self.scene.camera)?;
        self.engine.backend().begin(region)?;
        if self.compare {
            self.cpu = Film::of(region, self.scene.film_layout());
        }
        let samples = if scale > self.final_scale {
            1
        } else {
            self.scene.sampling.pixel_samples
        };
        self.steps.start(self.engine.backend(), region, samples);
        self.steps.stop_at(self.limits.samples);
        Ok(())
    }

    pub fn set_limits(&mut self, limits: Limits, view: View) -> Result<(), RenderError> {
        let (old, removes_samples) = (self.limits, limits.samples < self.steps.samples());
        self.limits = limits;
        if limits.scale != old.scale || (removes_samples && self.stage.scale == self.final_scale) {
            self.restart(self.camera, view) // samples cannot be removed from a film
        } else {
            self.steps.stop_at(limits.samples);
            Ok(())
        }
    }

    fn size_at(&self, scale: u32) -> [u32; 2] {
        [self.camera.width.div_ceil(scale), self.camera.height.div_ceil(scale)]
    }

    /// Returns true until the image has a result that can be shown.
    pub fn is_new(&self) -> bool {
        !self.has_result
    }

    /// Returns true once every pixel of the finished image's size has a result.
    pub fn is_complete(&self, view: View) -> bool {
        match self.hit_layer(view) {
            Some(_) => self.is_done(view),
            None => self.stage.scale == self.final_scale && self.steps.samples() > 0,
        }
    }

    pub fn is_done(&self, view: View) -> bool {
        match self.hit_layer(view) {
            Some(_) => {
                let [width, height] = self.final_size();
                self.hits.len() as u64 == Region::whole(width, height).pixels()
            }
            None => self.stage.scale == self.final_scale && self.steps.is_done(),
        }
    }

    /// Performs one dispatch. Returns true if the result must be shown without delay.
    pub fn step(&mut self, view: View) -> Result<bool, RenderError> {
        let show = match self.hit_layer(view) {
            Some(_) => self.step_hits(view)?,
            None => self.step_film()?,
        };
        self.has_result |= show;
        Ok(show)
    }

    fn step_hits(&mut self, view: View) -> Result<bool, RenderError> {
        let [width, height] = self.final_size();
        let first_row = (self.hits.len() / width as usize) as u32;
        let rows = (HITS_PER_DISPATCH / width).max(1).min(height - first_row);
        let strip = Region {
            y0: first_row,
            y1: first_row + rows,
            ..Region::whole(width, height)
        };
        self.hits.extend(self.engine.backend().first_hits(strip)?);
        Ok(self.is_done(view))
    }

    fn step_film(&mut self) -> Result<bool, RenderError> {
        let samples_before = self.steps.samples();
        if self.compare {
            let film = std::mem::replace(&mut self.cpu, Film::new(Region::whole(0, 0)));
            let mut cpu = Cpu::new(&self.scene);
            cpu.resume(film)?;
            let mut backends = GpuAndCpu {
                gpu: self.engine.backend(),
                cpu,
            };
            let result = self.steps.step(&mut backends);
            self.cpu = backends.cpu.into_film().unwrap_or(Film::new(Region::whole(0, 0)));
            result?;
        } else {
            self.steps.step(self.engine.backend())?;
        }
        self.stage.has_result = true;
        if self.stage.scale > self.final_scale && self.steps.is_done() {
            let film = self.engine.backend().film()?;
            self.coarser = Some((film, self.compare.then(|| self.cpu.clone())));
            self.begin((self.stage.scale / 4).max(self.final_scale))?;
            return Ok(true);
        }
        let is_first_sample = samples_before == 0 && self.steps.samples() > 0;
        Ok(is_first_sample || self.steps.is_done())
    }

    /// Returns the current image with its width and height.
    pub fn content(&mut self, view: View) -> Result<(Content, [u32; 2]), RenderError> {
        if let Some(aov) = self.hit_layer(view) {
            return Ok((self.hits_so_far(aov), self.final_size()));
        }
        let size = [self.stage.width, self.stage.height];
        if view == View::Samples {
            let film = self.engine.backend().film()?;
            let counts = match self.scene.sampling.adaptive {
                true => film.sample_counts().collect(),
                false => (0..self.stage.height)
                    .flat_map(|y| std::iter::repeat_n(self.steps.samples_of_row(y), self.stage.width as usize))
                    .collect(),
            };
            return Ok((Content::Samples(counts, self.scene.sampling.pixel_samples), size));
        }
        if view == View::Denoised && self.has_noise_estimates() {
            let mut film = self.engine.backend().film()?;
            film.denoised = self.engine.denoise(&film)?;
            let pixels = Pixels {
                width: size[0],
                height: size[1],
                colors: (0..film.sums.len()).map(|i| film.color(i)).collect(),
            };
            return Ok((Content::Color(pixels), size));
        }
        let stage_film;
        let coarser = self.coarser.as_ref();
        // Until the stage has a result, the film of the lower resolution is shown.
        let (film, cpu_film, coarser) = match coarser.filter(|_| !self.stage.has_result) {
            Some((film, cpu_film)) => (film, cpu_film.as_ref(), None),
            None => {
                stage_film = self.engine.backend().film()?;
                (&stage_film, self.compare.then_some(&self.cpu), coarser)
            }
        };
        let size = [film.region.width(), film.region.height()];
        let has_samples = |y| self.steps.samples_of_row(y) > 0;
        let coarser_film = coarser.map(|(film, _)| film);
        if let Some(aov) = view.film_layer(self.scene.integrator) {
            return Ok((
                Content::Film(FilmLayer::of(aov, film, coarser_film, &has_samples)),
                size,
            ));
        }
        let colors = means(film, coarser_film, &has_samples);
        Ok(match cpu_film.filter(|_| view.is_rendered_twice()) {
            Some(cpu_film) => {
                let coarser_cpu_film = coarser.and_then(|(_, cpu_film)| cpu_film.as_ref());
                let cpu_colors = means(cpu_film, coarser_cpu_film, &has_samples);
                (Content::Compare(colors, cpu_colors), size)
            }
            None => (Content::Color(colors), size),
        })
    }

    /// Returns true if all pixels of the full-size film have enough samples to be denoised.
    fn has_noise_estimates(&self) -> bool {
        let (samples, total) = self.samples();
        samples > 0 && samples >= MIN_DENOISED_SAMPLES.min(total)
    }

    fn hits_so_far(&self, aov: Aov) -> Content {
        let miss = FirstHit {
            shape: wgray_trace::records::NO_INDEX,
            ..bytemuck::Zeroable::zeroed()
        };
        let mut hits = self.hits.clone();
        let [width, height] = self.final_size();
        hits.resize(Region::whole(width, height).pixels() as usize, miss);
        Content::Hits(aov, hits)
    }

    /// Returns the width and height of the full-size image.
    pub fn size(&self) -> [u32; 2] {
        [self.camera.width, self.camera.height]
    }

    /// Returns the width and height of the finished image as displayed.
    pub fn final_size(&self) -> [u32; 2] {
        self.size_at(self.final_scale)
    }

    /// Returns the current and the final number of samples per pixel.
    pub fn samples(&self) -> (u32, u32) {
        let samples = if self.stage.scale == self.final_scale {
            self.steps.samples()
        } else {
            0
        };
        (samples, self.scene.sampling.pixel_samples.min(self.limits.samples))
    }

    /// Returns the number of samples per second; `None` while it is unknown.
    pub fn speed(&self) -> Option<f64> {
        self.steps.speed()
    }
}

/// Returns the smallest scale, at least `min_scale`, at which the image can be displayed.
fn final_scale(width: u32, height: u32, largest_film: u64, min_scale: u32) -> u32 {
    let max_pixels = largest_film.min(MAX_PIXELS);
    let fits = |scale: &u32| {
        let (width, height) = (width.div_ceil(*scale), height.div_ceil(*scale));
        Region::whole(width, height).pixels() <= max_pixels && width.max(height) <= MAX_SIDE
    };
    (min_scale..).find(fits).unwrap_or(1) // an image of one pixel fits
}

/// Submits each dispatch to both the GPU and the CPU, so that their films can be compared.
struct GpuAndCpu<'a> {
    gpu: &'a mut dyn Backend,
    cpu: Cpu<&'a Packed>,
}

impl Backend for GpuAndCpu<'_> {
    fn begin(&mut self, region: Region) -> Result<(), RenderError> {
        self.gpu.begin(region)?;
        self.cpu.begin(region)
    }

    fn resume(&mut self, film: Film) -> Result<(), RenderError> {
        self.gpu.resume(film.clone())?;
        self.cpu.resume(film)
    }

    fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        self.gpu.submit(tile, samples.clone())?;
        self.cpu.submit(tile, samples)
    }

    fn poll(&mut self) -> Result<bool, RenderError> {
        Ok(self.cpu.poll()? & self.gpu.poll()?)
    }

    fn wait(&mut self) -> Result<(), RenderError> {
        self.cpu.wait()?;
        self.gpu.wait()
    }

    fn film(&mut self) -> Result<Film, RenderError> {
        self.gpu.film()
    }

    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        self.gpu.first_hits(region)
    }

    fn largest_film(&self) -> u64 {
        self.gpu.largest_film()
    }

    fn unskippable_samples(&self) -> u32 {
        self.gpu.unskippable_samples()
    }

    fn around(&self, region: Region) -> Region {
        self.gpu.around(region)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_images_get_the_smallest_scale_that_fits() {
        for (width, height, largest_film, scale) in [
            (2048, 2048, 1 << 22, 1),
            (2049, 2048, 1 << 22, 2),
            (3000, 3000, 1 << 22, 2),
            (3000, 3000, 1 << 30, 1),
            (4097, 4096, u64::MAX, 2),
            (1, 16_384, 1 << 22, 1),
            (16_385, 1, 1 << 22, 2),
            (65_536, 1, 1 << 22, 4),
            (65_536, 65_536, 1 << 22, 32),
            (1, 1, 1, 1),
        ] {
            assert_eq!(final_scale(width, height, largest_film, 1), scale, "{width} x {height}");
            assert_eq!(
                final_scale(width, height, largest_film, 4),
                scale.max(4),
                "{width} x {height}"
            );
        }
    }
}
