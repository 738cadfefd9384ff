//! `--stats`: what a render took, as JSON.

use std::io::{self, Write};

use serde::Serialize;
use wgray::image::Pending;

/// The fields of the file.
#[derive(Debug, Serialize)]
pub struct Stats {
    /// The frame's number, under `--frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<u32>,
    /// The adapter's name, or `cpu`.
    pub device: String,
    /// The driver's name and version.
    pub driver: String,
    /// The interface to the driver, such as `vulkan`, or `cpu`.
    pub backend: String,
    /// Columns that were rendered.
    pub width: u32,
    /// Rows that were rendered.
    pub height: u32,
    /// Samples of every pixel; under adaptive sampling the most of one.
    pub pixel_samples: u32,
    /// The samples that each pixel has at least: fewer than that where the time was up.
    pub min_samples: u32,
    /// Samples of light at every hit, over all lights.
    pub light_samples: u64,
    /// From the start of the process, or of a further frame, up to and with the warm-up dispatch.
    pub setup_s: f64,
    /// From there to the film on the host.
    pub render_s: f64,
    /// From that start to the written picture.
    pub total_s: f64,
    /// Rays from the camera for the picture's samples.
    pub camera_rays: u64,
    /// The share of the samples that were rendered, and not found in a checkpoint.
    pub fraction_rendered: f64,
    /// Rays to lights; the kernels do not count them.
    pub shadow_rays: Option<u64>,
    /// camera_rays * fraction_rendered * (1 + light_samples) / render_s / 1e6
    pub nominal_mrays_per_s: f64,
}

impl Stats {
    /// Millions of rays per second, if every camera ray hits a surface and every light sample takes a ray.
    pub fn nominal(camera_rays: f64, light_samples: u64, render_s: f64) -> f64 {
        camera_rays * (1.0 + light_samples as f64) / render_s / 1e6
    }

    pub fn write(&self, mut file: Pending) -> io::Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        writeln!(file, "{text}")?;
        file.finish()
    }
}
