//! Predicts how long the CPU and software Vulkan take for an image, to select the device of [`Device::Auto`].
//!
//! Software Vulkan first compiles a kernel. It then renders area lights about twice as fast as the CPU, paths about as
//! fast, textures more slowly, and scenes with a BVH many times more slowly. `scripts/figures-devices` compares the
//! prediction with measurements.
//!
//! [`Device::Auto`]: crate::Device::Auto
#![cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "the CPU is the only device"))]

use wgray_image::Region;
use wgray_render::records::Packed;
use wgray_scene::Integrator;

use crate::context::Context;
use crate::options::Options;

/// Seconds until software Vulkan starts to render: the device is opened, and a kernel compiled.
const START: f64 = 0.7;
/// CPU seconds for a sample, and for a light sample, on one thread.
const SAMPLE: f64 = 6e-7;
const LIGHT_SAMPLE: f64 = 1e-8;
/// Speed of software Vulkan relative to the CPU on the same number of threads.
const SPEED_OF_PHONG: f64 = 2.3;
const SPEED_OF_PATHS: f64 = 1.2;
const SPEED_OF_TEXTURES: f64 = 0.8;
/// Software Vulkan is selected if its time is at most this multiple of the CPU's.
const TOLERANCE: f64 = 1.2;

/// The images that a device is selected for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Workload {
    /// Pixels per image.
    pub pixels: u64,
    /// Number of images with the same kernel.
    pub images: u32,
}

/// Predicted seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prediction {
    cpu: f64,
    software_vulkan: f64,
}

impl Workload {
    /// Returns the workload of full images.
    #[cfg(feature = "cli")]
    pub fn image(scene: &Packed) -> Workload {
        let pixels = u64::from(scene.camera.width) * u64::from(scene.camera.height);
        Workload { pixels, images: 1 }
    }

    /// Returns the workload of images with these options.
    pub fn new(scene: &Packed, options: &Options, images: u32) -> Workload {
        let whole = Region::whole(scene.camera.width, scene.camera.height);
        let pixels = options.crop.unwrap_or(whole).pixels();
        Workload { pixels, images }
    }
}

impl Prediction {
    /// Predicts the times on `threads` threads for a scene without a BVH.
    fn of(scene: &Packed, workload: Workload, threads: usize) -> Prediction {
        let speed = match scene.integrator {
            _ if scene.specialization.texture_kinds != 0 => SPEED_OF_TEXTURES,
            Integrator::Phong => SPEED_OF_PHONG,
            Integrator::Path => SPEED_OF_PATHS,
        };
        let samples = workload.pixels as f64 * f64::from(workload.images) * f64::from(scene.sampling.pixel_samples);
        let sample = SAMPLE + LIGHT_SAMPLE * scene.light_samples() as f64;
        let cpu = samples * sample / threads.max(1) as f64;
        Prediction {
            cpu,
            software_vulkan: START + cpu / speed,
        }
    }

    fn is_faster_on_cpu(self) -> bool {
        self.software_vulkan > TOLERANCE * self.cpu
    }
}

/// Returns the reason if the CPU is faster than any adapter for this scene.
#[cfg(feature = "gpu")]
pub(crate) fn faster_on_cpu(context: &Context, scene: &Packed, workload: Workload) -> Option<String> {
    let name = &context.devices.best().filter(|adapter| adapter.is_software())?.name;
    let reason = if scene.specialization.tlas_kinds != 0 {
        format!("the CPU traverses the BVH faster than {name}")
    } else {
        let prediction = Prediction::of(scene, workload, rayon::current_num_threads());
        if !prediction.is_faster_on_cpu() {
            return None;
        }
        let Prediction { cpu, software_vulkan } = prediction;
        format!("the CPU should take {cpu:.1} s, and {name} {software_vulkan:.1} s")
    };
    Some(format!("no GPU found, and {reason}; use --device gpu to override"))
}

#[cfg(not(feature = "gpu"))]
pub(crate) fn faster_on_cpu(_: &Context, _: &Packed, _: Workload) -> Option<String> {
    None
}

#[cfg(test)]
mod tests {
    use wgray_scene::{Overrides, Scene};

    use super::*;

    fn packed(file: &str, samples: u32) -> Packed {
        let overrides = Overrides {
            pixel_samples: Some(samples),
            ..Overrides::default()
        };
        let scene = Scene::load_with(format!("scenes/{file}"), &overrides).expect("a scene");
        Options::default().pack(&scene)
    }

    fn is_faster_on_cpu(scene: &Packed, pixels: u64, threads: usize) -> bool {
        Prediction::of(scene, Workload { pixels, images: 1 }, threads).is_faster_on_cpu()
    }

    #[test]
    fn the_cpu_renders_small_images_and_textures() {
        let large = 1 << 24;
        for file in [
            "cornell.toml",
            "cornell-path.toml",
            "mirror-glass.toml",
            "textures.toml",
        ] {
            let scene = packed(file, 1);
            assert!(is_faster_on_cpu(&scene, 1, 2), "{file}");
            assert_eq!(is_faster_on_cpu(&scene, large, 2), file == "textures.toml", "{file}");
        }
    }

    #[test]
    fn the_decision_changes_once_as_the_workload_grows() {
        for file in ["cornell.toml", "cornell-path.toml", "ellipsoids.toml"] {
            for threads in [0, 1, 2, 1024] {
                let scene = packed(file, 4);
                let decisions: Vec<bool> = (0..40)
                    .map(|exponent| is_faster_on_cpu(&scene, 1 << exponent, threads))
                    .collect();
                let changes = decisions.windows(2).filter(|pair| pair[0] != pair[1]).count();
                assert!(decisions[0] && changes == 1, "{file}, {threads}: {decisions:?}");
            }
        }
    }

    #[test]
    fn predictions_are_finite() {
        let scene = packed("cornell.toml", 65_536);
        let workload = Workload {
            pixels: 1 << 32,
            images: u32::MAX,
        };
        let prediction = Prediction::of(&scene, workload, 1);
        assert!(
            prediction.cpu.is_finite() && prediction.software_vulkan.is_finite(),
            "{prediction:?}"
        );
    }
}
