//! What is promised where bits are not: pixels that are near, but for some on edges, and the same mean.

use std::fmt;

use wgray_render::film::Film;
use wgray_render::records::Packed;

/// A pixel is within this of its value, as a part of the largest of its colours: a pattern's share of a dark one is a difference of nearly
/// equal integrals ...
const RELATIVE: f64 = 1e-4;
/// ... or, on devices other than software Vulkan, this where textures are: they have many texels for each digit of a
/// coordinate ...
const TEXTURED: f64 = 1e-3;
/// ... but for this share of the pixels, on edges where a comparison flips ...
pub const EDGES: f64 = 1e-3;
/// ... on such devices of a picture with so many pixels on a side. Edges grow with the side, so that smaller pictures have
/// more of them.
const SIDE: f64 = 400.0;
/// ... and the mean is within this of its own: of all pixels; on such devices, in smaller pictures, of those not on edges.
const MEAN: f64 = 1e-5;

/// What is compared where bits are not promised; of one picture, or of several together.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nearly {
    /// Pixels that are no numbers: none may be.
    no_numbers: usize,
    /// Pixels that are not near, and how many may not be.
    edges: usize,
    budget: f64,
    /// Sums of the pixels whose means are compared, of both pictures.
    sums: [f64; 2],
}

impl Nearly {
    /// On software Vulkan, whose plain WGSL differs by what the driver fuses and reorders alone.
    pub fn by_plain_wgsl(gpu: &Film, cpu: &Film) -> Nearly {
        Nearly::within(RELATIVE, 0.0, gpu, cpu)
    }

    /// On any other device.
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
            return Err(format!("{} pixels are no numbers", self.no_numbers));
        }
        if self.edges as f64 > self.budget {
            return Err(format!("{} pixels differ, of {:.0} that may", self.edges, self.budget));
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
            "{edges} pixels are not near, of {budget:.0} that may; the mean differs by {drift:.1e}"
        )
    }
}
