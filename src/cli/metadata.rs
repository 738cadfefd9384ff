//! What is told in pictures about how they came to be.

use std::time::Duration;

use wgray::device::DeviceInfo;
use wgray::image::Metadata;
use wgray::job::{hash_of_scene, hash_of_shaders};
use wgray::pack::Packed;
use wgray::scene::Scene;

/// What is known of a render before it begins.
pub struct RenderMetadata {
    metadata: Metadata,
}

impl RenderMetadata {
    /// What a scene says, and what the program is.
    pub fn of(scene: &Scene, packed: &Packed, time_limit: Option<Duration>) -> RenderMetadata {
        let mut pairs = vec![(
            Metadata::SOFTWARE.to_owned(),
            concat!("wgray ", env!("CARGO_PKG_VERSION")).to_owned(),
        )];
        let mut tell = |name: &str, text: String| pairs.push((name.to_owned(), text));
        tell("scene_hash", hash_of_scene(packed));
        if cfg!(feature = "gpu") {
            tell("shader_hash", hash_of_shaders());
        }
        let render = &scene.render;
        tell("integrator", render.integrator.name().to_owned());
        let samples = render.pixel_samples;
        tell("pixel_samples", format!("{} {}", samples.count, samples.pattern.name()));
        if let Some(adaptive) = render.adaptive {
            tell(
                "adaptive",
                format!("{}, up to {} samples", adaptive.error, adaptive.max_samples),
            );
        }
        tell("seed", render.seed.to_string());
        if let Some(limit) = time_limit {
            tell("time_limit", format!("{} s", limit.as_secs_f64()));
        }
        RenderMetadata {
            metadata: Metadata { pairs },
        }
    }

    /// What stays the same whatever renders it.
    pub fn lasting(&self) -> Metadata {
        self.metadata.clone()
    }

    /// With what renders it. A reproducible picture does not tell.
    pub fn on(&self, device: &DeviceInfo, reproducible: bool) -> Metadata {
        let mut metadata = self.metadata.clone();
        if !reproducible {
            let pairs = [("device", &device.name), ("driver", &device.driver)];
            let pairs = pairs.into_iter().filter(|(_, text)| !text.is_empty());
            let pairs = pairs.map(|(name, text)| (name.to_owned(), text.clone()));
            metadata.pairs.extend(pairs);
        }
        metadata
    }
}
