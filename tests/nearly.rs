//! Image tolerances where identical bits are not guaranteed: relative pixel error, share of outliers on edges, and
//! mean.

use std::fmt;

use wgray_render::film::Film;
use wgray_render::records::Packed;

/// Maximum error of a pixel, relative to its largest channel: in dark channels, patterns subtract nearly equal
/// integrals.
const RELATIVE: f64 = 1e-4;
/// `RELATIVE` for scenes with textures on devices other than software Vulkan: a change of a coordinate by one ulp may
/// span many texels.
const TEXTURED: f64 = 1e-3;
/// Maximum share of outliers, which occur at edges where a comparison flips.
pub const EDGES: f64 = 1e-3;
/// Image side in pixels below which `EDGES` is scaled up on such devices, because the number of pixels on edges is
/// proportional to the side.
const SIDE: f64 = 400.0;
/// Maximum relative error of the mean. On such devices, images below `SIDE` ignore outliers.
const MEAN: f64 = 1e-5;

/// Accumulated differences of GPU and CPU films.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nearly {
    /// Non-finite pixels; must be 0.
    no_numbers: usize,
    /// Outliers, and their limit.
    edges: usize,
    budget: f64,
    /// Sums of the compared pixels: GPU, CPU.
    sums: [f64; 2],
}

impl Nearly {
    /// Compares on software Vulkan, where plain WGSL differs only by fused and reordered operations.
    pub fn by_plain_wgsl(gpu: &Film, cpu: &Film) -> Nearly {
        Nearly::within(RELATIVE, 0.0, gpu, cpu)
    }

    /// Compares on other devices.
    pub fn of(packed: &Packed, gpu: &Film, cpu: &Film) -> Nearly {
        let relative = if packed.textures.records.is_empty() {
            RELATIVE
        } else {
            TEXTURED
        };
        Nearly::within(relative, SIDE, gpu, cpu)
    }

    fn within(relative: f64, least_side: f64, gpu: &Film, cpu: &Film) -> Nearly {
        let side = (cpu.sums.len() as f64).sqrt();
        let mut all = Nearly {
            budget: EDGES * side * side.max(least_side),
            ..Nearly::default()
        };
        for (gpu, cpu) in gpu.sums.iter().zip(&cpu.sums) {
            let [a, b] = [gpu, cpu].map(|v| v.truncate().as_dvec3() / f64::from(v.w));
            let near = (a - b).abs().max_element() <= b.abs().max_element() * relative;
            all.no_numbers += usize::from(!a.is_finite());
            all.edges += usize::from(!near);
            if near || side >= least_side {
                all.sums[0] += a.element_sum();
                all.sums[1] += b.element_sum();
            }
        }
        all
    }

    pub fn add(&mut self, other: Nearly) {
        self.no_numbers += other.no_numbers;
        self.edges += other.edges;
        self.budget += other.budget;
        self.sums[0] += other.sums[0];
        self.sums[1] += other.sums[1];
    }

    pub fn judge(&self) -> Result<(), String> {
        if self.no_numbers > 0 {
            return Err(format!("{} pixels are NaN or infinite", self.no_numbers));
        }
        if self.edges as f64 > self.budget {
            return Err(format!("{} pixels differ; the limit is {:.0}", self.edges, self.budget));
        }
        if !(self.drift() <= MEAN) {
            return Err(format!("the mean differs by {:.1e}", self.drift()));
        }
        Ok(())
    }

    fn drift(&self) -> f64 {
        let [gpu, cpu] = self.sums;
        if gpu == cpu { 0.0 } else { (gpu - cpu).abs() / cpu }
    }
}

impl fmt::Display for Nearly {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (edges, budget, drift) = (self.edges, self.budget, self.drift());
        write!(
            f,
            "{edges} pixels are outliers, the limit is {budget:.0}; the mean differs by {drift:.1e}"
        )
    }
}
