//! Ray tracing on the CPU: the records of a packed scene, its BVHs, the film, and the functions that trace rays and shade
//! paths. They have the bits of the WGSL functions of the same names.

pub mod bvh;
pub mod cpu;
pub mod film;
pub mod records;

/// Returns the number of cases for a test: without optimization a tenth, because the test would take long.
#[cfg(test)]
const fn cases(optimized: usize) -> usize {
    if cfg!(debug_assertions) {
        optimized / 10
    } else {
        optimized
    }
}
