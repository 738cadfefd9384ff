//! Predicts how long the CPU and lavapipe take for images, to select the device of [`Device::Auto`] without a GPU.
//!
//! Lavapipe first compiles a kernel. It then renders `phong` about twice as fast as the CPU, paths about as fast,
//! textures more slowly, and scenes with a BVH many times more slowly. `scripts/figures-devices` compares the prediction
//! with measurements.
//!
//! [`Device::Auto`]: crate::Device::Auto
#![cfg_attr(
    all(not(feature = "gpu"), not(test)),
    expect(dead_code, reason = "the CPU is the only device")
)]

use std::time::Duration;

use wgray_image::Region;
use wgray_scene::Integrator;
use wgray_trace::records::Packed;

use crate::context::Context;
use crate::options::Options;

/// Seconds until lavapipe starts to render: a device is opened, and a kernel of typical size compiled.
const START: f64 = 0.7;
/// CPU seconds for a sample, and for a light sample, on one thread.
const SAMPLE: f64 = 6e-7;
const LIGHT_SAMPLE: f64 = 7e-9;
/// Speed of lavapipe relative to the CPU on the same number of threads.
const SPEED_OF_PHONG: f64 = 2.0;
const SPEED_OF_PATHS: f64 = 1.2;
const SPEED_OF_TEXTURES: f64 = 0.8;
/// Factor of the speed if division and square root are computed in software, which takes 2.1 to 5.9 times as long.
const EXACT_ROUNDING: f64 = 0.28;
/// Lavapipe is selected if its time is at most this multiple of the CPU's: with AVX-512 it is faster than predicted.
const TOLERANCE: f64 = 1.2;
/// Maximum number of lavapipe's threads (`LP_MAX_THREADS`).
const MAX_THREADS: usize = 32;

/// The work that a device is selected for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Workload {
    /// Pixels per image.
    pub pixels: u64,
    /// Samples per pixel.
    pub samples: u32,
    /// Number of images with the same kernel.
    pub images: usize,
    /// True if division and square root are computed in software on an adapter.
    pub exact_rounding: bool,
    /// Limit for each image.
    pub time_limit: Option<Duration>,
}

/// The device that was selected without a GPU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Selection {
    pub is_cpu: bool,
    pub reason: String,
}

/// Predicted seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prediction {
    cpu: f64,
    lavapipe: f64,
}

impl Workload {
    /// Returns the workload of images with these options. With adaptive sampling, only the pilot samples count.
    pub fn new(scene: &Packed, options: &Options, images: usize) -> Workload {
        let whole = Region::whole(scene.camera.width, scene.camera.height);
        Workload {
            pixels: options.crop.unwrap_or(whole).pixels(),
            samples: scene.specialization.pilot_samples,
            images,
            exact_rounding: options.exact_rounding,
            time_limit: None,
        }
    }
}

impl Prediction {
    /// Predicts the times on `threads` threads for a scene without a BVH.
    fn of(scene: &Packed, workload: Workload, threads: usize) -> Prediction {
        let kernel_speed = match scene.integrator {
            _ if scene.specialization.texture_kinds != 0 => SPEED_OF_TEXTURES,
            Integrator::Phong => SPEED_OF_PHONG,
            Integrator::Path => SPEED_OF_PATHS,
        };
        let rounding = if workload.exact_rounding { EXACT_ROUNDING } else { 1.0 };
        let threads = threads.max(1);
        let speed = kernel_speed * rounding * threads.min(MAX_THREADS) as f64 / threads as f64;
        let samples = workload.pixels as f64 * f64::from(workload.samples);
        let sample = SAMPLE + LIGHT_SAMPLE * scene.light_samples() as f64;
        let limit = workload.time_limit.map_or(f64::INFINITY, |limit| limit.as_secs_f64());
        let image = (samples * sample / threads as f64).min(limit);
        let cpu = image * workload.images as f64;
        Prediction {
            cpu,
            lavapipe: START + cpu / speed,
        }
    }

    fn is_faster_on_cpu(self) -> bool {
        self.lavapipe > TOLERANCE * self.cpu
    }
}

/// Selects a device for [`Device::Auto`](crate::Device::Auto) if there is no GPU, but software Vulkan.
#[cfg(feature = "gpu")]
pub(crate) fn select_without_gpu(context: &Context, scene: &Packed, workload: Workload) -> Option<Selection> {
    let adapter = context.devices.best().filter(|adapter| adapter.is_software())?;
    let name = &adapter.name;
    let prediction = Prediction::of(scene, workload, rayon::current_num_threads());
    let (is_cpu, reason) = if scene.specialization.tlas_kinds != 0 {
        (true, format!("the CPU traverses the BVH faster than {name}"))
    } else if !wgray_render::gpu::is_lavapipe(name) {
        (true, format!("the CPU is faster than {name}"))
    } else {
        let [cpu, lavapipe] = [prediction.cpu, prediction.lavapipe].map(seconds);
        let reason = format!("the CPU is predicted to take {cpu}, {name} {lavapipe}");
        (prediction.is_faster_on_cpu(), reason)
    };
    let advice = if is_cpu { "; use --device gpu to override" } else { "" };
    Some(Selection {
        is_cpu,
        reason: format!("no GPU found, and {reason}{advice}"),
    })
}

#[cfg(not(feature = "gpu"))]
pub(crate) fn select_without_gpu(_: &Context, _: &Packed, _: Workload) -> Option<Selection> {
    None
}

fn seconds(value: f64) -> String {
    match value < 0.05 {
        true => "less than 0.1 s".to_owned(),
        false => format!("{value:.1} s"),
    }
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

    fn workload(scene: &Packed, pixels: u64) -> Workload {
        Workload {
            pixels,
            ..Workload::new(scene, &Options::default(), 1)
        }
    }

    fn is_faster_on_cpu(scene: &Packed, pixels: u64, threads: usize) -> bool {
        Prediction::of(scene, workload(scene, pixels), threads).is_faster_on_cpu()
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
            for threads in [0, 1, 2, MAX_THREADS] {
                let scene = packed(file, 4);
                let decisions: Vec<bool> = (0..40)
                    .map(|exponent| is_faster_on_cpu(&scene, 1 << exponent, threads))
                    .collect();
                let changes = decisions.windows(2).filter(|pair| pair[0] != pair[1]).count();
                assert!(decisions[0] && changes == 1, "{file}, {threads}: {decisions:?}");
            }
        }
        // Lavapipe cannot use as many threads as the CPU.
        assert!(is_faster_on_cpu(&packed("cornell-path.toml", 4), 1 << 30, 1024));
    }

    #[test]
    fn every_part_of_the_workload_counts() {
        let scene = packed("mirror-glass.toml", 4);
        let is_faster_on_cpu = |workload: Workload| Prediction::of(&scene, workload, 2).is_faster_on_cpu();
        let small = workload(&scene, 1 << 16);
        let large = workload(&scene, 1 << 20);
        assert!(is_faster_on_cpu(small) && !is_faster_on_cpu(large));
        assert!(!is_faster_on_cpu(Workload { images: 16, ..small }));
        assert!(!is_faster_on_cpu(Workload { samples: 64, ..small }));
        let (exact_rounding, time_limit) = (true, Some(Duration::from_millis(500)));
        assert!(is_faster_on_cpu(Workload {
            exact_rounding,
            ..large
        }));
        assert!(is_faster_on_cpu(Workload { time_limit, ..large }));
        let crop = Some(Region::whole(3, 2));
        let cropped = Workload::new(
            &scene,
            &Options {
                crop,
                ..Options::default()
            },
            1,
        );
        assert_eq!(cropped.pixels, 6);
        assert_eq!(cropped.samples, 4);
    }

    #[test]
    fn the_time_limit_is_for_each_image() {
        let scene = packed("mirror-glass.toml", 4);
        let limited = Workload {
            time_limit: Some(Duration::from_millis(500)),
            images: 16,
            ..workload(&scene, 1 << 24)
        };
        assert_eq!(Prediction::of(&scene, limited, 2).cpu, 8.0);
    }

    #[test]
    fn predictions_are_finite() {
        let scene = packed("cornell.toml", 65_536);
        let prediction = Prediction::of(
            &scene,
            Workload {
                images: usize::MAX,
                ..workload(&scene, 1 << 32)
            },
            1,
        );
        assert!(
            prediction.cpu.is_finite() && prediction.lavapipe.is_finite(),
            "{prediction:?}"
        );
    }

    #[test]
    fn short_times_are_printed_as_an_upper_bound() {
        assert_eq!(
            [0.0, 0.049, 0.051, 12.34].map(seconds),
            ["less than 0.1 s", "less than 0.1 s", "0.1 s", "12.3 s"]
        );
    }
}
