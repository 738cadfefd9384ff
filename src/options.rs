//! The options of a render.

use wgray_image::Region;
use wgray_render::output::{Aov, AovSource};
use wgray_render::pack::pack;
use wgray_render::records::Packed;
use wgray_scene::{Problem, Scene};

use crate::device::Device;

/// How a scene is rendered. Size, samples and seed are the scene's, which [`Overrides`](crate::Overrides) can change.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// What renders.
    pub device: Device,
    /// The pixels that are rendered, the same as in the whole picture; all if absent.
    pub crop: Option<Region>,
    /// The layers beside the radiance; each is there once, however often it is named.
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
        let integrator = scene.render.integrator;
        let unknown = self.aovs.iter().find_map(|aov| {
            let rule = aov.missing(integrator, scene.render.adaptive.is_some());
            rule.map(|rule| (aov, rule))
        });
        let rule = if x0 >= x1 || y0 >= y1 {
            "must have x0 < x1 and y0 < y1".to_string()
        } else if x1 > width || y1 > height {
            format!("must lie within the image of {width} x {height} pixels")
        } else if let Some((aov, rule)) = unknown {
            return Err(Problem::of(aov.name(), rule).inside("aov"));
        } else {
            return Ok(region);
        };
        Err(Problem::of("crop", format!("{x0},{y0},{x1},{y1} {rule}")))
    }

    /// The scene as backends read it, with what these options ask for.
    pub(crate) fn pack(&self, scene: &Scene) -> Packed {
        let plain = pack(scene);
        let of_samples = |aov: &Aov| aov.source(plain.integrator) == AovSource::Samples;
        match self.aovs.iter().any(of_samples) {
            true => plain.with_layers(),
            false => plain,
        }
    }
}
