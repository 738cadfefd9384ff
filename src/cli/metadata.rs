//! Metadata of images: the program, the scene and the settings of the render.

use std::path::Path;
use std::time::Duration;

use crate::device::DeviceInfo;
use crate::image::{Metadata, is_complete, read_metadata};
use crate::scene::Scene;
use wgray_render::job::hash_of_scene;
use wgray_render::noise::Noise;
use wgray_trace::records::Packed;

use super::numbers::significant;

/// Key of the metadata entry of an incomplete image, with a value such as `32 of 64 samples`.
const PARTIAL: &str = "partial";

/// Key of the metadata entry of an image rendered with a noise limit: samples, and 95th percentile and median of the
/// noise, such as `64 of 4096 samples, 0.0187, median 0.0041`.
const NOISE: &str = "noise";

/// Returns true if an image file is complete and contains all samples.
pub fn is_finished(path: &Path) -> bool {
    is_complete(path) && read_metadata(path).is_none_or(|metadata| metadata.get(PARTIAL).is_none())
}

/// Returns the samples per pixel of an image file, the maximum if sampling is adaptive; `None` if wgray did not write
/// the file.
pub fn samples_of(path: &Path) -> Option<u32> {
    let metadata = read_metadata(path)?;
    let text = match (metadata.get(PARTIAL).or(metadata.get(NOISE)), metadata.get("adaptive")) {
        (Some(samples), _) => samples,
        (None, Some(adaptive)) => adaptive.split_once("up to ")?.1,
        (None, None) => metadata.get("pixel_samples")?,
    };
    text.split(' ').next()?.parse().ok()
}

#[derive(Clone)]
pub struct RenderMetadata {
    metadata: Metadata,
}

impl RenderMetadata {
    pub fn of(
        scene: &Scene,
        packed: &Packed,
        time_limit: Option<Duration>,
        noise_limit: Option<f64>,
    ) -> RenderMetadata {
        let mut pairs = vec![(
            Metadata::SOFTWARE.to_owned(),
            concat!("wgray ", env!("CARGO_PKG_VERSION")).to_owned(),
        )];
        let mut add = |name: &str, text: String| pairs.push((name.to_owned(), text));
        add("scene_hash", hash_of_scene(packed));
        add("shader_hash", wgray_shaders::hash());
        let render = &scene.render;
        add("integrator", render.integrator.name().to_owned());
        let samples = render.pixel_samples;
        add("pixel_samples", format!("{} {}", samples.count, samples.pattern.name()));
        if let Some(adaptive) = render.adaptive {
            add(
                "adaptive",
                format!("{}, up to {} samples", adaptive.error, adaptive.max_samples),
            );
        }
        add("seed", render.seed.to_string());
        if let Some(limit) = time_limit {
            add("time_limit", format!("{} s", limit.as_secs_f64()));
        }
        if let Some(limit) = noise_limit {
            add("noise_limit", limit.to_string());
        }
        RenderMetadata {
            metadata: Metadata { pairs },
        }
    }

    /// Returns the metadata without the device and the driver.
    pub fn without_device(&self) -> Metadata {
        self.metadata.clone()
    }

    /// Adds the noise of an image with a noise limit, and its samples per pixel: so far, and the maximum.
    pub fn add_noise(&mut self, noise: &Noise, (samples, max): (u32, u32)) {
        let [percentile, median] = [noise.percentile_95, noise.median].map(significant);
        let text = format!("{samples} of {max} samples, {percentile}, median {median}");
        self.metadata.pairs.push((NOISE.to_owned(), text));
    }

    /// Like [`RenderMetadata::with_device`], for an image with fewer samples than requested.
    pub fn partial(&self, device: &DeviceInfo, reproducible: bool, (samples, requested): (u32, u32)) -> Metadata {
        let mut metadata = self.with_device(device, reproducible);
        metadata
            .pairs
            .push((PARTIAL.to_owned(), format!("{samples} of {requested} samples")));
        metadata
    }

    /// Returns the metadata, with the device and the driver unless `--reproducible` is given.
    pub fn with_device(&self, device: &DeviceInfo, reproducible: bool) -> Metadata {
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
