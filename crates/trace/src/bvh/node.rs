//! A BVH node with up to 8 children, whose boxes are quantized to the grid of the node.

use bytemuck::{Pod, Zeroable};
use glam::{UVec3, Vec3};

use super::Aabb;

/// A node of a [`Tree`](super::Tree): in kernels, five rows of four 32-bit words.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Node {
    /// The origin of the grid.
    pub base: [f32; 3],
    /// Grid steps along x, y and z, powers of two, as biased exponents (bits 23 to 30) of an `f32`.
    pub exponents: [u8; 3],
    /// Bit c: child c is an inner node.
    pub inner: u8,
    /// Index of the first inner child. The other inner children follow in the order of their slots.
    pub first_child: u32,
    /// First item of the node's leaves in [`Tree::order`](super::Tree::order).
    pub first_item: u32,
    /// Per leaf: number of items in bits 5 to 7, and offset of the first item from `first_item` in bits 0 to 4; 0 for
    /// other slots.
    pub leaves: [u8; 8],
    /// Lower bounds along x, y and z in grid steps; 255 in an empty slot.
    pub low: [[u8; 8]; 3],
    /// Upper bounds along x, y and z in grid steps; 0 in an empty slot.
    pub high: [[u8; 8]; 3],
}

const _: () = assert!(size_of::<Node>() == 80);

impl Node {
    /// Returns a node without children whose grid covers the bounds.
    pub(super) fn around(bounds: &Aabb) -> Node {
        Node {
            base: bounds.low.to_array(),
            exponents: [0, 1, 2].map(|axis| exponent(bounds.low[axis], bounds.high[axis])),
            inner: 0,
            first_child: 0,
            first_item: 0,
            leaves: [0; 8],
            low: [[255; 8]; 3],
            high: [[0; 8]; 3],
        }
    }

    /// Sets a slot's box to the smallest box on the grid that contains the bounds.
    pub(super) fn set_bounds(&mut self, slot: usize, bounds: &Aabb) {
        let (base, scale) = (self.base(), self.scale());
        for axis in 0..3 {
            let decode = |q: u8| bound(base[axis], q, scale[axis]);
            let steps = |x: f32| (x - base[axis]) / scale[axis];
            // The casts saturate and map NaN to 0.
            let mut low = steps(bounds.low[axis]) as u8;
            while low > 0 && decode(low) > bounds.low[axis] {
                low -= 1;
            }
            let mut high = steps(bounds.high[axis]).ceil() as u8;
            while high < 255 && decode(high) < bounds.high[axis] {
                high += 1;
            }
            self.low[axis][slot] = low;
            self.high[axis][slot] = high;
        }
    }

    /// Returns the origin of the grid.
    pub fn base(&self) -> Vec3 {
        Vec3::from_array(self.base)
    }

    /// Returns the grid steps along x, y and z.
    pub fn scale(&self) -> Vec3 {
        Vec3::from_array(self.exponents.map(step))
    }

    /// Returns the lower corner of a child's box.
    pub fn low(&self, child: usize) -> Vec3 {
        self.corner(self.low.map(|axis| axis[child]))
    }

    /// Returns the upper corner of a child's box.
    pub fn high(&self, child: usize) -> Vec3 {
        self.corner(self.high.map(|axis| axis[child]))
    }

    fn corner(&self, q: [u8; 3]) -> Vec3 {
        self.base() + UVec3::from_array(q.map(u32::from)).as_vec3() * self.scale()
    }

    /// Returns a child's node index, or `None` if the child is not an inner node.
    pub fn child(&self, child: usize) -> Option<u32> {
        let preceding = self.inner & ((1 << child) - 1);
        (self.inner >> child & 1 == 1).then(|| self.first_child + preceding.count_ones())
    }

    /// Returns a child's items in [`Tree::order`](super::Tree::order); an empty range if the child is not a leaf.
    pub fn items(&self, child: usize) -> std::ops::Range<usize> {
        let leaf = self.leaves[child];
        let start = self.first_item as usize + usize::from(leaf & 31);
        start..start + usize::from(leaf >> 5)
    }
}

fn step(exponent: u8) -> f32 {
    f32::from_bits(u32::from(exponent) << 23)
}

/// Decodes a bound like the kernels: multiplication and addition are both rounded.
fn bound(base: f32, q: u8, scale: f32) -> f32 {
    base + f32::from(q) * scale
}

/// Returns the exponent of the smallest step that spans `low` to `high`.
fn exponent(low: f32, high: f32) -> u8 {
    let min_step = (high - low).min(f32::MAX) / 255.0;
    let mut exponent = (min_step.to_bits() >> 23) as u8;
    while bound(low, 255, step(exponent)) < high {
        exponent += 1; // at most 254: 255 * 2^127 is infinite
    }
    exponent
}
