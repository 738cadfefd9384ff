//! From a scene to a picture in memory, by one call.

use tracing::warn;

use crate::device::{Device, Renderer};
use crate::error::{Error, RenderError};
use crate::film::{Film, Region};
use crate::image::{Aov, Layout};
use crate::job::{self, Backend, Cut};
use crate::pack::{Packed, pack};
use crate::picture::Picture;
use crate::scene::{Problem, Scene};

/// How a scene is rendered. The scene itself says its size, samples and seed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// What renders.
    pub device: Device,
    /// The pixels that are rendered, the same as in the whole picture; all if absent.
    pub crop: Option<Region>,
    /// The layers beside the radiance.
    pub aovs: Vec<Aov>,
    /// Whether quotients and square roots are rounded correctly in software, for the CPU's bits on GPUs whose own may be off
    /// in the last digit. Vulkan only; without effect on the CPU.
    pub exact_rounding: bool,
}

impl Options {
    /// The pixels that these options ask for.
    ///
    /// # Errors
    ///
    /// The first option that does not fit the scene.
    pub fn region(&self, scene: &Scene) -> Result<Region, Problem> {
        let (width, height) = (scene.width, scene.height);
        let whole = Region::whole(width, height);
        let region = self.crop.unwrap_or(whole);
        let Region { x0, y0, x1, y1 } = region;
        let rule = if x0 >= x1 || y0 >= y1 {
            "x0 must be less than x1, and y0 less than y1".to_string()
        } else if x1 > width || y1 > height {
            format!("must lie in the picture of {width} x {height} pixels")
        } else if let (Some(aov), None) = (self.aovs.iter().find(|aov| aov.is_of_film()), &scene.render.adaptive) {
            let rule = "is known under adaptive sampling alone";
            return Err(Problem::of(aov.name(), rule).inside("aov"));
        } else {
            return Ok(region);
        };
        Err(Problem::of("crop", format!("{x0},{y0},{x1},{y1} {rule}")))
    }
}

/// Renders a scene.
///
/// Where [`Device::Auto`] finds no adapter, or one that cannot do the work, the CPU renders, and a warning by `tracing`
/// says why; [`Picture::device`] tells what has rendered.
///
/// # Errors
///
/// Options that do not fit the scene, no such device, and what its driver refuses.
pub fn render(scene: &Scene, options: &Options) -> Result<Picture, Error> {
    let region = options.region(scene).map_err(Error::Option)?;
    let packed = pack(scene);
    let on_cpu = |why: &RenderError| warn!("rendering on the CPU: {why}");
    let mut renderer = Renderer::new(&packed, options, Box::new(on_cpu))?;
    let film = renderer.work(|backend| film(backend, region, packed.pixel_samples))?;
    let hits = match options.aovs.iter().any(|aov| !aov.is_of_film()) {
        true => renderer.work(|backend| job::first_hits(backend, region))?,
        false => Vec::new(),
    };
    Ok(Picture {
        film,
        hits,
        layout: Layout {
            picture: (scene.width, scene.height),
            region,
            aovs: options.aovs.clone(),
            middle_depth: renderer.work(|backend| middle_depth(&packed, &options.aovs, backend))?,
            most_samples: packed.pixel_samples,
        },
        device: renderer.info().clone(),
    })
}

/// All bands of a region in one film.
fn film(backend: &mut dyn Backend, region: Region, samples: u32) -> Result<Film, RenderError> {
    let mut whole = Film {
        region,
        sums: Vec::new(),
        moments: Vec::new(),
        looks: Vec::new(),
    };
    job::render(backend, region, samples, &Cut::default(), &mut |_| true, &mut |band| {
        whole.sums.extend(band.sums);
        whole.moments.extend(band.moments);
        whole.looks.extend(band.looks);
        Ok(())
    })?;
    Ok(whole)
}

/// The depth that looks half bright in a PNG: that in the middle of the whole picture, or 1 where nothing is.
///
/// # Errors
///
/// Those of the device.
pub fn middle_depth(scene: &Packed, aovs: &[Aov], backend: &mut dyn Backend) -> Result<f32, RenderError> {
    if !aovs.contains(&Aov::Depth) {
        return Ok(1.0);
    }
    let (x0, y0) = (scene.camera.width / 2, scene.camera.height / 2);
    let middle = Region {
        x0,
        y0,
        x1: x0 + 1,
        y1: y0 + 1,
    };
    let hits = backend.first_hits(middle)?;
    Ok(hits
        .first()
        .map(|hit| hit.depth)
        .filter(|depth| *depth > 0.0)
        .unwrap_or(1.0))
}
