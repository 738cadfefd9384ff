//! `--stats`: timings and counts of a render, as JSON.

use std::io::{self, Write};

use crate::image::Pending;
use serde::Serialize;

#[derive(Debug, Serialize)]
pub struct Stats {
    /// The number of the frame, under `--frames`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<u32>,
    /// The name of the adapter, or `cpu`.
    pub device: String,
    /// The name and version of the driver.
    pub driver: String,
    /// The interface to the driver, such as `vulkan`, or `cpu`.
    pub backend: String,
    /// Number of rendered columns.
    pub width: u32,
    /// Number of rendered rows.
    pub height: u32,
    /// Samples per pixel; under adaptive sampling the maximum.
    pub pixel_samples: u32,
    /// Minimum samples per pixel.
    pub min_samples: u32,
    /// The former name of `min_samples`, until 0.3.
    #[serde(rename = "least_samples")]
    pub former_min_samples: u32,
    /// True if a signal ended the render under `--preview`.
    pub partial: bool,
    /// Light samples at every hit, over all lights.
    pub light_samples: u64,
    /// Seconds from the start of the process, or of later frames, until the device is ready.
    pub setup_s: f64,
    pub render_s: f64,
    /// Seconds from the same start until the image is written.
    pub total_s: f64,
    /// Camera rays of the image.
    pub camera_rays: u64,
    /// Fraction of the samples not read from a checkpoint.
    pub fraction_rendered: f64,
    /// The former name of `fraction_rendered`, until 0.3.
    #[serde(rename = "share_rendered")]
    pub former_fraction_rendered: f64,
    /// `None`: kernels do not count them.
    pub shadow_rays: Option<u64>,
    /// camera_rays * fraction_rendered * (1 + light_samples) / render_s / 1e6
    pub nominal_mrays_per_s: f64,
}

impl Stats {
    /// Returns millions of rays per second, as if every camera ray hit and every light sample traced a ray.
    pub fn nominal(camera_rays: f64, light_samples: u64, render_s: f64) -> f64 {
        camera_rays * (1.0 + light_samples as f64) / render_s / 1e6
    }

    pub fn write(&self, mut file: Pending) -> io::Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        writeln!(file, "{text}")?;
        file.finish()
    }
}
