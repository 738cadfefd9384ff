//! SIMD evaluation of `block_sample` and `segment` for all samples of a block.

use std::sync::LazyLock;

use fearless_simd::{Level, dispatch};

use super::light::LightSegments;
use super::shadow::{SampleBlock, block_sample};
use super::traversal::{Directions, MAX_SEGMENTS};
use crate::records::GRID;

/// Best instruction set of this processor.
pub static LEVEL: LazyLock<Level> = LazyLock::new(Level::new);

/// Samples on the unit square. Unused lanes repeat the first sample.
pub struct Samples {
    count: usize,
    x: [f32; MAX_SEGMENTS],
    y: [f32; MAX_SEGMENTS],
}

impl Samples {
    pub fn of(block: SampleBlock) -> Samples {
        let count = block.count as usize;
        let first = block_sample(block, 0);
        let mut samples = Samples {
            count,
            x: [first.x; MAX_SEGMENTS],
            y: [first.y; MAX_SEGMENTS],
        };
        if block.pattern == GRID {
            // Avoids a division per sample.
            let cell = 1.0 / block.side as f32;
            let (mut column, mut row) = (block.first % block.side, block.first / block.side);
            for (x, y) in samples.x.iter_mut().zip(&mut samples.y).take(count) {
                *x = (column as f32 + 0.5) * cell;
                *y = (row as f32 + 0.5) * cell;
                column += 1;
                if column == block.side {
                    (column, row) = (0, row + 1);
                }
            }
            return samples;
        }
        for i in 1..count {
            let sample = block_sample(block, i as u32);
            (samples.x[i], samples.y[i]) = (sample.x, sample.y);
        }
        samples
    }

    /// Returns the vectors to the samples on a light.
    pub fn segments(&self, level: Level, segments: LightSegments) -> Directions {
        dispatch!(level, _simd => {
            let mut components = [[0.0; MAX_SEGMENTS]; 3];
            for (k, components) in components.iter_mut().enumerate() {
                for ((d, x), y) in components.iter_mut().zip(&self.x).zip(&self.y) {
                    *d = segments.towards[k] + segments.u[k] * (2.0 * x - 1.0) + segments.v[k] * (2.0 * y - 1.0);
                }
            }
            Directions { count: self.count, components }
        })
    }
}
