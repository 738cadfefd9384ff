//! Comparison of GPU and CPU films that need not be bit-identical, with tolerances for the relative error of pixels,
//! the fraction of outliers at edges, and the error of the mean.

use std::fmt;

use wgray_trace::film::Film;
use wgray_trace::records::Packed;

/// Maximum error of a pixel, relative to the largest channel of the pixel, because procedural patterns subtract nearly
/// equal integrals in dark channels.
const MAX_PIXEL_ERROR: f64 = 1e-4;
/// Replaces `MAX_PIXEL_ERROR` for scenes with textures on devices other than software Vulkan, where a texture
/// coordinate that differs by one ulp may select another texel.
const MAX_PIXEL_ERROR_TEXTURED: f64 = 1e-3;
/// Maximum fraction of outliers, which occur at edges where a comparison flips.
pub const MAX_OUTLIER_FRACTION: f64 = 1e-3;
/// Image side in pixels below which `MAX_OUTLIER_FRACTION` is scaled up on devices other than software Vulkan,
/// because the number of pixels on edges is proportional to the side.
const MIN_SIDE: f64 = 400.0;
/// Maximum relative error of the mean. On devices other than software Vulkan, the mean of images below `MIN_SIDE`
/// ignores outliers.
const MAX_MEAN_ERROR: f64 = 1e-5;

/// Difference of a GPU film from a CPU film, or the sum over several pairs of films.
#[derive(Clone, Copy, Debug, Default)]
pub struct FilmDifference {
    /// Number of GPU pixels that are not finite; must be 0.
    non_finite: usize,
    /// Number of outliers.
    outliers: usize,
    /// Tolerated number of outliers.
    max_outliers: f64,
    /// Sums of the compared pixels on the GPU and on the CPU.
    sums: [f64; 2],
}

impl FilmDifference {
    /// Uses the tolerances for plain WGSL on software Vulkan, which only fuses and reorders operations.
    pub fn strict(gpu: &Film, cpu: &Film) -> FilmDifference {
        FilmDifference::with_limits(MAX_PIXEL_ERROR, 0.0, gpu, cpu)
    }

    /// Uses the tolerances for devices other than software Vulkan, which are larger for textures and small images.
    pub fn loose(packed: &Packed, gpu: &Film, cpu: &Film) -> FilmDifference {
        let max_pixel_error = if packed.textures.records.is_empty() {
            MAX_PIXEL_ERROR
        } else {
            MAX_PIXEL_ERROR_TEXTURED
        };
        FilmDifference::with_limits(max_pixel_error, MIN_SIDE, gpu, cpu)
    }

    fn with_limits(max_pixel_error: f64, min_side: f64, gpu: &Film, cpu: &Film) -> FilmDifference {
        let side = (cpu.sums.len() as f64).sqrt();
        let mut result = FilmDifference {
            max_outliers: MAX_OUTLIER_FRACTION * side * side.max(min_side),
            ..FilmDifference::default()
        };
        for (gpu, cpu) in gpu.sums.iter().zip(&cpu.sums) {
            let [a, b] = [gpu, cpu].map(|v| v.truncate().as_dvec3() / f64::from(v.w));
            let is_near = (a - b).abs().max_element() <= b.abs().max_element() * max_pixel_error;
            result.non_finite += usize::from(!a.is_finite());
            result.outliers += usize::from(!is_near);
            if is_near || side >= min_side {
                result.sums[0] += a.element_sum();
                result.sums[1] += b.element_sum();
            }
        }
        result
    }

    pub fn add(&mut self, other: FilmDifference) {
        self.non_finite += other.non_finite;
        self.outliers += other.outliers;
        self.max_outliers += other.max_outliers;
        self.sums[0] += other.sums[0];
        self.sums[1] += other.sums[1];
    }

    /// Returns an error if the difference exceeds a tolerance.
    pub fn judge(&self) -> Result<(), String> {
        if self.non_finite > 0 {
            return Err(format!("{} pixels are NaN or infinite", self.non_finite));
        }
        if self.outliers as f64 > self.max_outliers {
            return Err(format!(
                "{} pixels differ; the limit is {:.0}",
                self.outliers, self.max_outliers
            ));
        }
        if !(self.mean_error() <= MAX_MEAN_ERROR) {
            return Err(format!("the mean differs by {:.1e}", self.mean_error()));
        }
        Ok(())
    }

    /// Returns the relative error of the mean.
    fn mean_error(&self) -> f64 {
        let [gpu, cpu] = self.sums;
        if gpu == cpu { 0.0 } else { (gpu - cpu).abs() / cpu }
    }
}

impl fmt::Display for FilmDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (outliers, max_outliers, mean_error) = (self.outliers, self.max_outliers, self.mean_error());
        write!(
            f,
            "number of outliers: {outliers} (limit {max_outliers:.0}); the mean differs by {mean_error:.1e}"
        )
    }
}
