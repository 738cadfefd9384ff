//! The renderer of wgray. Scenes are packed into plain records, from which the CPU backend and the WGSL kernels compute
//! the same bits.

pub mod backend;
pub mod clock;
pub mod cpu;
pub mod denoise;
pub mod error;
pub mod excerpt;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod job;
pub mod noise;
pub mod output;
pub mod pack;

/// Returns the number of cases for a test: without optimization a tenth, because the test would take long.
#[cfg(test)]
const fn cases(optimized: usize) -> usize {
    if cfg!(debug_assertions) {
        optimized / 10
    } else {
        optimized
    }
}
