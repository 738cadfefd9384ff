//! A picture in the making: coarse at first, then all pixels with few samples, then more. What interrupts it waits for
//! one call at most.

use std::ops::Range;
use std::time::Duration;

use crate::backend::Backend;
use crate::cpu::Cpu;
use crate::error::RenderError;
use crate::film::{Film, Region};
use crate::gpu::{Call, Gpu, Live};
use crate::image::Aov;
use crate::job::{Cut, Order, Steps};
use crate::pack::{Camera, FirstHit, Packed};

use super::film_layer::FilmLayer;
use super::picture::{Content, View, means};

/// What one call aims to take: a save or a move of the camera waits so long.
const CALL: Duration = Duration::from_millis(30);
/// What a coarse picture aims to take: with what it takes to show it, 20 in a second.
const COARSE: Duration = Duration::from_millis(30);
/// Pixels of a coarse picture as long as nothing is known of the speed.
const COARSE_PIXELS: f64 = 10_000.0;
/// The coarsest picture has one pixel for so many along each side.
const COARSEST: u32 = 32;
/// The most pixels that are shown, and the most along a side: browsers show no larger pictures.
const MOST_PIXELS: u64 = 1 << 24;
const LONGEST_SIDE: u32 = 1 << 14;
/// First hits that are found in one call.
const HITS_PER_CALL: u32 = 1 << 17;

/// A scene on a device, seen by a camera.
pub struct Canvas {
    gpu: Gpu,
    /// The scene, with the camera of the stage under way.
    scene: Packed,
    /// The camera of the whole picture.
    camera: Camera,
    /// Pixels of the whole picture along each side of one of the finished film: more than one where it is too large.
    finest: u32,
    /// Whether the CPU renders the same.
    compare: bool,
    stage: Stage,
    steps: Steps,
    /// The last coarser film, by the GPU and by the CPU.
    under: Option<(Film, Option<Film>)>,
    /// What the CPU has of the stage.
    cpu: Film,
    /// The first rows' hits.
    hits: Vec<FirstHit>,
    shown: bool,
    limits: Limits,
}

/// How much of the picture is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Samples of a pixel at most, one at least.
    pub samples: u32,
    /// Pixels of the picture along each side of one that is shown, one at least.
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

/// Which picture the film is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stage {
    /// Pixels of the picture along each side of one of the film.
    scale: u32,
    width: u32,
    height: u32,
    /// Whether anything of it is rendered.
    begun: bool,
}

impl Canvas {
    /// Starts a picture of a scene that is on the device.
    pub fn new(gpu: Gpu, scene: Packed, view: View, limits: Limits) -> Result<Canvas, RenderError> {
        let camera = scene.camera;
        let stage = Stage {
            scale: 1,
            width: camera.width,
            height: camera.height,
            begun: false,
        };
        let mut canvas = Canvas {
            gpu,
            scene,
            camera,
            finest: 1,
            compare: false,
            stage,
            steps: Steps::new(&Cut::default(), CALL, Order::Pixels),
            under: None,
            cpu: Film::new(Region::whole(0, 0)),
            hits: Vec::new(),
            shown: false,
            limits,
        };
        canvas.restart(camera, view)?;
        Ok(canvas)
    }

    /// Whether it is this scene that is rendered.
    pub fn shows(&self, scene: &Packed) -> bool {
        scene.camera == self.camera && scene.same_but_camera(&self.scene)
    }

    /// Starts a picture of a changed scene. Returns false, and does nothing, if it takes another kernel.
    pub fn update(&mut self, scene: &Packed, view: View) -> Result<bool, RenderError> {
        let same_kernel = self.gpu.update(scene)?;
        if same_kernel {
            self.scene = scene.clone();
            self.restart(scene.camera, view)?;
        }
        Ok(same_kernel)
    }

    /// What the kernel has that is not as the files say.
    pub fn live(&self) -> &Live {
        self.gpu.live()
    }

    /// Gives the kernel's sliders their values. The picture must be started again.
    pub fn set_sliders(&mut self, values: &[[u32; 4]]) -> Result<(), RenderError> {
        self.gpu.set_sliders(values)
    }

    /// The calls that have ended since this was asked last.
    pub fn calls(&mut self) -> Vec<Call> {
        self.gpu.calls()
    }

    /// Starts the picture again, from a camera.
    pub fn restart(&mut self, camera: Camera, view: View) -> Result<(), RenderError> {
        self.camera = camera;
        if self.compare != view.is_by_both() {
            self.steps.forget_pace();
        }
        self.compare = view.is_by_both();
        self.under = None;
        self.hits.clear();
        self.shown = false;
        let largest = self.gpu.largest_film();
        self.finest = finest(camera.width, camera.height, largest, self.limits.scale);
        let scale = if self.hits_of(view).is_some() {
            self.finest
        } else {
            self.first_scale()
        };
        self.begin(scale)
    }

    /// Goes over to another view of the same picture.
    pub fn change_view(&mut self, view: View) -> Result<(), RenderError> {
        let film = self.hits_of(view).is_none();
        let nothing_there = self.stage.scale == self.finest && self.steps.samples() == 0;
        let other_film = self.compare != view.is_by_both();
        self.shown = film && self.stage.scale == self.finest && !nothing_there; // the film has it already
        if film && (other_film || nothing_there) {
            self.restart(self.camera, view)
        } else if !film && self.stage.scale > self.finest {
            self.begin(self.finest)
        } else {
            Ok(())
        }
    }

    /// What a view shows of the first hits.
    fn hits_of(&self, view: View) -> Option<Aov> {
        view.of_hits(self.scene.integrator)
    }

    fn first_scale(&self) -> u32 {
        let pixels = f64::from(self.camera.width) * f64::from(self.camera.height);
        let affordable = self
            .steps
            .speed()
            .map_or(COARSE_PIXELS, |speed| speed * COARSE.as_secs_f64());
        ((pixels / affordable.max(1.0)).sqrt().ceil() as u32)
            .next_power_of_two()
            .min(COARSEST)
            .max(self.finest)
    }

    fn begin(&mut self, scale: u32) -> Result<(), RenderError> {
        let [width, height] = self.size_at(scale);
        let region = Region::whole(width, height);
        self.stage = Stage {
            scale,
            width,
            height,
            begun: false,
        };
        self.scene.camera = Camera {
            width,
            height,
            ..self.camera
        };
        self.gpu.set_camera(&self.scene.camera)?;
        self.gpu.begin(region)?;
        if self.compare {
            self.cpu = Film::of(region, self.scene.form());
        }
        let samples = if scale > self.finest {
            1
        } else {
            self.scene.pixel_samples
        };
        self.steps.start(&self.gpu, region, samples);
        self.steps.stop_at(self.limits.samples);
        Ok(())
    }

    /// Renders more or less of the picture from now on.
    pub fn set_limits(&mut self, limits: Limits, view: View) -> Result<(), RenderError> {
        let (old, fewer) = (self.limits, limits.samples < self.steps.samples());
        self.limits = limits;
        if limits.scale != old.scale || (fewer && self.stage.scale == self.finest) {
            self.restart(self.camera, view) // samples that a pixel has are not taken from it
        } else {
            self.steps.stop_at(limits.samples);
            Ok(())
        }
    }

    fn size_at(&self, scale: u32) -> [u32; 2] {
        [self.camera.width.div_ceil(scale), self.camera.height.div_ceil(scale)]
    }

    /// Whether nothing of the picture has been worth showing yet.
    pub fn is_new(&self) -> bool {
        !self.shown
    }

    /// Whether there is nothing left to do for a view.
    pub fn is_done(&self, view: View) -> bool {
        match self.hits_of(view) {
            Some(_) => {
                let [width, height] = self.finest_size();
                self.hits.len() as u64 == Region::whole(width, height).pixels()
            }
            None => self.stage.scale == self.finest && self.steps.is_done(),
        }
    }

    /// Makes one call. Returns whether there is something new that must not wait to be shown.
    pub fn step(&mut self, view: View) -> Result<bool, RenderError> {
        let show = match self.hits_of(view) {
            Some(_) => self.step_hits(view)?,
            None => self.step_film()?,
        };
        self.shown |= show;
        Ok(show)
    }

    fn step_hits(&mut self, view: View) -> Result<bool, RenderError> {
        let [width, height] = self.finest_size();
        let first = (self.hits.len() / width as usize) as u32;
        let rows = (HITS_PER_CALL / width).max(1).min(height - first);
        let strip = Region {
            y0: first,
            y1: first + rows,
            ..Region::whole(width, height)
        };
        self.hits.extend(self.gpu.first_hits(strip)?);
        Ok(self.is_done(view))
    }

    fn step_film(&mut self) -> Result<bool, RenderError> {
        let passes = self.steps.samples();
        if self.compare {
            let film = std::mem::replace(&mut self.cpu, Film::new(Region::whole(0, 0)));
            let mut cpu = Cpu::new(&self.scene);
            cpu.resume(film)?;
            let mut both = Both {
                gpu: &mut self.gpu,
                cpu,
            };
            let result = self.steps.step(&mut both);
            self.cpu = both.cpu.into_film().unwrap_or(Film::new(Region::whole(0, 0)));
            result?;
        } else {
            self.steps.step(&mut self.gpu)?;
        }
        self.stage.begun = true;
        if self.stage.scale > self.finest && self.steps.is_done() {
            let gpu = self.gpu.film()?;
            self.under = Some((gpu, self.compare.then(|| self.cpu.clone())));
            self.begin((self.stage.scale / 4).max(self.finest))?;
            return Ok(true);
        }
        let first_pass = passes == 0 && self.steps.samples() > 0;
        Ok(first_pass || self.steps.is_done())
    }

    /// The picture as it is now, and its width and height.
    pub fn content(&mut self, view: View) -> Result<(Content, [u32; 2]), RenderError> {
        if let Some(aov) = self.hits_of(view) {
            return Ok((self.hits_so_far(aov), self.finest_size()));
        }
        let size = [self.stage.width, self.stage.height];
        if view == View::Samples {
            let film = self.gpu.film()?;
            let counts = match self.scene.adaptive {
                true => film.sample_counts().collect(),
                false => (0..self.stage.height)
                    .flat_map(|y| std::iter::repeat_n(self.steps.samples_of_row(y), self.stage.width as usize))
                    .collect(),
            };
            return Ok((Content::Samples(counts, self.scene.pixel_samples), size));
        }
        let film;
        let under = self.under.as_ref();
        // Before the next stage has anything the last one is sent, which is smaller.
        let (gpu, cpu, under) = match under.filter(|_| !self.stage.begun) {
            Some((gpu, cpu)) => (gpu, cpu.as_ref(), None),
            None => {
                film = self.gpu.film()?;
                (&film, self.compare.then_some(&self.cpu), under)
            }
        };
        let size = [gpu.region.width(), gpu.region.height()];
        let has_samples = |y| self.steps.samples_of_row(y) > 0;
        let under_gpu = under.map(|(gpu, _)| gpu);
        if let Some(aov) = view.of_film(self.scene.integrator) {
            return Ok((Content::Film(FilmLayer::of(aov, gpu, under_gpu, &has_samples)), size));
        }
        let colors = means(gpu, under_gpu, &has_samples);
        Ok(match cpu.filter(|_| view.is_by_both()) {
            Some(cpu) => {
                let under = under.and_then(|(_, cpu)| cpu.as_ref());
                (Content::Compare(colors, means(cpu, under, &has_samples)), size)
            }
            None => match self.gpu.live().layer() {
                Some(layer) => (Content::Layer(colors, layer.numbers), size),
                None => (Content::Color(colors), size),
            },
        })
    }

    fn hits_so_far(&self, aov: Aov) -> Content {
        let nothing = FirstHit {
            shape: crate::pack::NOTHING,
            ..bytemuck::Zeroable::zeroed()
        };
        let mut hits = self.hits.clone();
        let [width, height] = self.finest_size();
        hits.resize(Region::whole(width, height).pixels() as usize, nothing);
        Content::Hits(aov, hits)
    }

    /// Width and height of the whole picture.
    pub fn size(&self) -> [u32; 2] {
        [self.camera.width, self.camera.height]
    }

    /// Width and height of what is shown of it at the end.
    pub fn finest_size(&self) -> [u32; 2] {
        self.size_at(self.finest)
    }

    /// Samples that every pixel of the whole picture has, and will have.
    pub fn samples(&self) -> (u32, u32) {
        let so_far = if self.stage.scale == self.finest {
            self.steps.samples()
        } else {
            0
        };
        (so_far, self.scene.pixel_samples.min(self.limits.samples))
    }

    /// Samples of pixels per second.
    pub fn speed(&self) -> Option<f64> {
        self.steps.speed()
    }
}

/// The least scale from `least` on at which a picture can be shown.
fn finest(width: u32, height: u32, largest_film: u64, least: u32) -> u32 {
    let most = largest_film.min(MOST_PIXELS);
    let fits = |scale: &u32| {
        let (width, height) = (width.div_ceil(*scale), height.div_ceil(*scale));
        Region::whole(width, height).pixels() <= most && width.max(height) <= LONGEST_SIDE
    };
    (least..).find(fits).unwrap_or(1) // the picture of one pixel fits
}

/// The same work done by both backends.
struct Both<'a> {
    gpu: &'a mut Gpu,
    cpu: Cpu<'a>,
}

impl Backend for Both<'_> {
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

    fn samples_of_all(&self) -> u32 {
        self.gpu.samples_of_all()
    }

    fn around(&self, region: Region) -> Region {
        self.gpu.around(region)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_that_is_too_large_gets_smaller_as_little_as_it_can() {
        for (width, height, film, scale) in [
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
            assert_eq!(finest(width, height, film, 1), scale, "{width} x {height}");
            assert_eq!(finest(width, height, film, 4), scale.max(4), "{width} x {height}");
        }
    }
}
