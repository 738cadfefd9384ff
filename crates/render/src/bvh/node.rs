//! A node: up to 8 children, whose boxes lie on a grid of its own.

use bytemuck::{Pod, Zeroable};
use glam::{UVec3, Vec3};

use super::Aabb;

/// A node of a [`Tree`](super::Tree). The kernels read it as five rows of four words.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Node {
    /// The grid's point 0, from which boxes are counted.
    pub base: [f32; 3],
    /// The steps of the grid along x, y and z, as the exponents of powers of two: the bits 23 to 30 of an `f32`.
    pub exponents: [u8; 3],
    /// Bit c is set where child c is a node.
    pub inner: u8,
    /// The number of the first child that is a node. The others follow, in the order of their slots.
    pub first_child: u32,
    /// Where the items of the node's leaves begin in the tree's order.
    pub first_item: u32,
    /// Of a leaf, the number of its items in bits 5 to 7, and in bits 0 to 4 where they begin, counted from `first_item`;
    /// of any other slot 0.
    pub leaves: [u8; 8],
    /// The children's least x, y and z in steps of the grid; 255 in an empty slot.
    pub low: [[u8; 8]; 3],
    /// The children's greatest x, y and z in steps of the grid; 0 in an empty slot.
    pub high: [[u8; 8]; 3],
}

const _: () = assert!(size_of::<Node>() == 80);

impl Node {
    /// A node without children, for boxes inside of this one.
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

    /// Sets the box of a slot to the least of the grid that has this one in it.
    pub(super) fn set_bounds(&mut self, slot: usize, bounds: &Aabb) {
        let (base, scale) = (self.base(), self.scale());
        for axis in 0..3 {
            let at = |q: u8| bound(base[axis], q, scale[axis]);
            let steps = |x: f32| (x - base[axis]) / scale[axis];
            // The casts saturate, and make 0 of NaN.
            let mut low = steps(bounds.low[axis]) as u8;
            while low > 0 && at(low) > bounds.low[axis] {
                low -= 1;
            }
            let mut high = steps(bounds.high[axis]).ceil() as u8;
            while high < 255 && at(high) < bounds.high[axis] {
                high += 1;
            }
            self.low[axis][slot] = low;
            self.high[axis][slot] = high;
        }
    }

    /// The grid's point 0.
    pub fn base(&self) -> Vec3 {
        Vec3::from_array(self.base)
    }

    /// The steps of the grid along each axis.
    pub fn scale(&self) -> Vec3 {
        Vec3::from_array(self.exponents.map(step))
    }

    /// The least corner of a child's box.
    pub fn low(&self, child: usize) -> Vec3 {
        self.corner(self.low.map(|axis| axis[child]))
    }

    /// The greatest corner of a child's box.
    pub fn high(&self, child: usize) -> Vec3 {
        self.corner(self.high.map(|axis| axis[child]))
    }

    fn corner(&self, q: [u8; 3]) -> Vec3 {
        self.base() + UVec3::from_array(q.map(u32::from)).as_vec3() * self.scale()
    }

    /// The number of the child's node, if it is one.
    pub fn child(&self, child: usize) -> Option<u32> {
        let before = self.inner & ((1 << child) - 1);
        (self.inner >> child & 1 == 1).then(|| self.first_child + before.count_ones())
    }

    /// The items of the child in the tree's order; none if it is not a leaf.
    pub fn items(&self, child: usize) -> std::ops::Range<usize> {
        let leaf = self.leaves[child];
        let start = self.first_item as usize + usize::from(leaf & 31);
        start..start + usize::from(leaf >> 5)
    }
}

fn step(exponent: u8) -> f32 {
    f32::from_bits(u32::from(exponent) << 23)
}

/// A bound as it is decoded: a multiplication and an addition, both rounded.
fn bound(base: f32, q: u8, scale: f32) -> f32 {
    base + f32::from(q) * scale
}

/// The exponent of the least step with which the grid reaches from `low` to `high`.
fn exponent(low: f32, high: f32) -> u8 {
    let step_at_least = (high - low).min(f32::MAX) / 255.0;
    let mut exponent = (step_at_least.to_bits() >> 23) as u8;
    while bound(low, 255, step(exponent)) < high {
        exponent += 1; // ends at 254 at the latest: 255 * 2^127 is infinite
    }
    exponent
}
