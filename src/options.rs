//! The options of a render.

use wgray_image::Region;
use wgray_render::output::{Aov, AovSource};
use wgray_render::pack::pack;
use wgray_render::records::Packed;
use wgray_scene::{Problem, Scene};

use crate::device::Device;

/// The options of a render. Size, samples and seed belong to the scene; [`Overrides`](crate::Overrides) change them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The device that renders.
    pub device: Device,
    /// The region to render; `None` renders the full image. The pixels are identical to those of the full image.
    pub crop: Option<Region>,
    /// The layers to render in addition to the radiance. Duplicates are ignored.
    pub aovs: Vec<Aov>,
    /// Round quotients and square roots correctly in software, because results of GPUs may be wrong by one unit in the
    /// last place. Requires Vulkan; has no effect on the CPU.
    pub exact_rounding: bool,
}

impl Options {
    /// Returns the region that these options request.
    ///
    /// # Errors
    ///
    /// The crop is empty or exceeds the image, or the scene cannot provide a requested layer.
    pub fn region(&self, scene: &Scene) -> Result<Region, Problem> {
        let (width, height) = (scene.width, scene.height);
        let region = self.crop.unwrap_or(Region::whole(width, height));
        let Region { x0, y0, x1, y1 } = region;
        let integrator = scene.render.integrator;
        let unsupported = self.aovs.iter().find_map(|aov| {
            let rule = aov.missing(integrator, scene.render.adaptive.is_some());
            rule.map(|rule| (aov, rule))
        });
        let rule = if x0 >= x1 || y0 >= y1 {
            "must have x0 < x1 and y0 < y1".to_string()
        } else if x1 > width || y1 > height {
            format!("must lie within the image of {width} x {height} pixels")
        } else if let Some((aov, rule)) = unsupported {
            return Err(Problem::of(aov.name(), rule).inside("aov"));
        } else {
            return Ok(region);
        };
        Err(Problem::of("crop", format!("{x0},{y0},{x1},{y1} {rule}")))
    }

    /// Returns true if the film must have layers: for alpha, or for requested layers that are means over samples.
    pub(crate) fn needs_layers(&self, scene: &Scene) -> bool {
        let integrator = scene.render.integrator;
        let is_mean = |aov: &Aov| aov.source(integrator) == AovSource::Samples;
        integrator.has_layers() && (scene.render.alpha || self.aovs.iter().any(is_mean))
    }

    pub(crate) fn pack(&self, scene: &Scene) -> Packed {
        let mut packed = pack(scene);
        packed.specialization.layers = self.needs_layers(scene).into();
        packed
    }
}
