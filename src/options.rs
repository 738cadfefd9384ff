//! The options of a render.

use wgray_image::Region;
use wgray_render::output::{Aov, AovSource};
use wgray_render::pack::pack;
use wgray_scene::{Problem, Scene};
use wgray_trace::film::FilmLayout;
use wgray_trace::records::Packed;

use crate::device::Device;

/// The options of a render. Size, samples and seed belong to the scene; [`Overrides`](crate::Overrides) change them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The device that renders.
    pub device: Device,
    /// The region to render; `None` renders the full image. The pixels are identical to those of the full
    /// image; denoised pixels differ near the edges of the region.
    pub crop: Option<Region>,
    /// The layers to render in addition to the radiance. Duplicates are ignored.
    pub aovs: Vec<Aov>,
    /// Keep noise estimates in the film, for the noise of the image and for
    /// [`run_until_noise`](crate::ProgressiveRender::run_until_noise). Renders take 2 to 3 % longer on the CPU, and up
    /// to 10 % on software Vulkan.
    pub noise: bool,
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
            let rule = aov.missing(integrator);
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

    /// Returns the layout of the film. The film has layers if the image has alpha, is denoised, or includes an AOV that
    /// is a mean over samples. It has noise estimates if the options ask for them, if the image is denoised, or if an
    /// AOV needs sample statistics; films of adaptive sampling have these statistics anyway.
    pub(crate) fn film_layout(&self, scene: &Scene) -> FilmLayout {
        let integrator = scene.render.integrator;
        let aovs = self.layers(scene);
        let requests = |source: AovSource| aovs.iter().any(|aov| aov.source(integrator) == source);
        let denoise = aovs.contains(&Aov::Denoised);
        let adaptive = scene.render.adaptive.is_some();
        FilmLayout {
            adaptive,
            layers: integrator.has_layers() && (scene.render.alpha || denoise || requests(AovSource::Samples)),
            noise: self.noise || denoise || (requests(AovSource::Statistics) && !adaptive),
        }
    }

    /// Returns the layers to render, each once: the requested layers, and the denoised image if the scene requests it.
    pub(crate) fn layers(&self, scene: &Scene) -> Vec<Aov> {
        let denoised = scene.render.denoise.then_some(Aov::Denoised);
        let mut aovs: Vec<Aov> = Vec::new();
        for aov in self.aovs.iter().copied().chain(denoised) {
            if !aovs.contains(&aov) {
                aovs.push(aov);
            }
        }
        aovs
    }

    pub(crate) fn pack(&self, scene: &Scene) -> Packed {
        let mut packed = pack(scene);
        set_film_layout(&mut packed, self.film_layout(scene));
        packed
    }
}

/// Sets the layers and noise estimates of a scene's films.
pub(crate) fn set_film_layout(packed: &mut Packed, film_layout: FilmLayout) {
    packed.specialization.layers = film_layout.layers.into();
    packed.specialization.noise = film_layout.noise.into();
}
