//! `--stats`: timings and counts of a render, as JSON.

use std::io::{self, Write};

use crate::image::Pending;
use serde::Serialize;

#[derive(Debug, Serialize)]
pub struct Stats {
    /// The frame number, if `--frames` is given.
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
    /// Samples per pixel; the maximum if sampling is adaptive.
    pub pixel_samples: u32,
    /// Minimum number of samples per pixel.
    pub min_samples: u32,
    /// The former name of `min_samples`, kept until version 0.3.
    #[serde(rename = "least_samples")]
    pub former_min_samples: u32,
    /// Noise that 95 % of the pixels do not exceed, with `--noise`; null if a pixel has a single sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// Noise that half of the pixels do not exceed, with `--noise`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_median: Option<f64>,
    /// True if a signal ended a render with `--preview`.
    pub partial: bool,
    /// Light samples per hit, summed over all lights.
    pub light_samples: u64,
    /// Seconds until the device is ready, counted from the start of the process, or from the end of the previous frame.
    pub setup_s: f64,
    pub render_s: f64,
    /// Seconds until the image is written, counted like `setup_s`.
    pub total_s: f64,
    /// Camera rays of the image.
    pub camera_rays: u64,
    /// Fraction of the samples that this run rendered; the other samples come from a checkpoint.
    pub fraction_rendered: f64,
    /// The former name of `fraction_rendered`, kept until version 0.3.
    #[serde(rename = "share_rendered")]
    pub former_fraction_rendered: f64,
    /// Always `None`: kernels do not count shadow rays.
    pub shadow_rays: Option<u64>,
    /// camera_rays * fraction_rendered * (1 + light_samples) / render_s / 1e6
    pub nominal_mrays_per_s: f64,
}

impl Stats {
    /// Returns millions of rays per second, assuming that every camera ray hits a surface and every light sample traces
    /// a ray.
    pub fn nominal(camera_rays: f64, light_samples: u64, render_s: f64) -> f64 {
        camera_rays * (1.0 + light_samples as f64) / render_s / 1e6
    }

    pub fn write(&self, mut file: Pending) -> io::Result<()> {
        let text = serde_json::to_string_pretty(self)?;
        writeln!(file, "{text}")?;
        file.finish()
    }
}
