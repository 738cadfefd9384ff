//! Random numbers for tests, from a generator other than the renderer's.

use std::cell::Cell;

/// SplitMix64: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
pub struct Random(Cell<u64>);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(Cell::new(seed))
    }

    pub fn bits(&self) -> u64 {
        let mut z = self.0.get().wrapping_add(0x9e37_79b9_7f4a_7c15);
        self.0.set(z);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns an integer from 0 to n - 1.
    pub fn below(&self, n: u32) -> u32 {
        (self.bits() >> 32) as u32 % n
    }

    /// Returns a number in [0, 1).
    pub fn unit(&self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns true with probability 1 / n.
    pub fn once_in(&self, n: u32) -> bool {
        self.below(n) == 0
    }

    /// Returns a log-uniform number from 10^low to 10^high.
    pub fn magnitude(&self, low: f64, high: f64) -> f64 {
        10f64.powf(self.between(low, high))
    }

    pub fn pick<T: Copy>(&self, values: &[T]) -> T {
        values[self.below(values.len() as u32) as usize]
    }
}
