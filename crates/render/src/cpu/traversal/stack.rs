//! The stack of a traversal that can pause after each node: nodes and leaves, with the nearest on top.

use arrayvec::ArrayVec;
use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::Line;
use super::closest::STACK;
use super::node::WideNode as _;
use crate::bvh::Node;

/// A ray with precomputed values for tests against boxes.
#[derive(Clone, Copy, Debug)]
pub struct BoxRay {
    /// For each axis, the side of boxes that the ray enters: 0 for the lower side, 1 for the upper side.
    pub(super) near_side_index: [usize; 3],
    /// The ray's origin, shifted to pad the boxes: for tests of near sides, and of far sides.
    pub(super) origins: [[f32; 3]; 2],
    pub(super) inverse: [f32; 3],
}

impl BoxRay {
    /// Creates a ray from its origin, shifted to pad the boxes for tests of lower and of upper sides, and the
    /// reciprocals of the direction's components.
    #[inline(always)]
    pub fn new(low_origin: [f32; 3], high_origin: [f32; 3], inverse: [f32; 3]) -> BoxRay {
        let mut near_side_index = [0; 3];
        let mut origins = [low_origin, high_origin];
        for k in 0..3 {
            if inverse[k] < 0.0 {
                near_side_index[k] = 1;
                (origins[0][k], origins[1][k]) = (high_origin[k], low_origin[k]);
            }
        }
        BoxRay {
            near_side_index,
            origins,
            inverse,
        }
    }

    /// Returns the octant of the direction: bit k is set if component k is negative.
    #[inline(always)]
    pub fn octant(&self) -> usize {
        let [x, y, z] = self.near_side_index;
        x | y << 1 | z << 2
    }

    #[inline(always)]
    pub fn of(line: &Line) -> BoxRay {
        let mut values = [[0.0; 3]; 3];
        for (i, axis) in line.axes.into_iter().enumerate() {
            values[0][axis] = line.o_low[i];
            values[1][axis] = line.o_high[i];
            values[2][axis] = line.inverse[i];
        }
        let [low_origin, high_origin, inverse] = values;
        BoxRay::new(low_origin, high_origin, inverse)
    }
}

/// A node, or the items of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Distance to the box.
    near: f32,
    /// Index of the node, or of the first item.
    pub first: u32,
    /// Number of items; 0 for a node.
    pub count: u32,
}

impl Entry {
    pub const ROOT: Entry = Entry {
        near: f32::NEG_INFINITY,
        first: 0,
        count: 0,
    };
}

/// Nodes and leaves to visit. Visiting a node removes an entry and adds up to 8, so that there are at most `STACK`.
#[derive(Clone, Debug, Default)]
pub struct Stack {
    entries: ArrayVec<Entry, STACK>,
}

impl Stack {
    pub fn start(&mut self) {
        self.entries.clear();
        self.entries.push(Entry::ROOT);
    }

    /// Removes entries from the top, down to the first whose distance is at most `limit`. Returns this entry.
    #[inline(always)]
    pub fn pop(&mut self, limit: f32) -> Option<Entry> {
        while let Some(entry) = self.entries.pop() {
            if entry.near <= limit {
                return Some(entry);
            }
        }
        None
    }

    /// Adds those children of a node whose boxes the ray hits before `limit`.
    #[inline(always)]
    pub fn push_children<S: Simd>(&mut self, simd: S, node: &Node, ray: &BoxRay, limit: f32) {
        let mut near = f32x8::splat(simd, f32::NEG_INFINITY);
        let mut far = f32x8::splat(simd, limit);
        for k in 0..3 {
            let near_side = node.planes(simd, ray.near_side_index[k], k);
            let far_side = node.planes(simd, 1 - ray.near_side_index[k], k);
            near = near.max((near_side - ray.origins[0][k]) * ray.inverse[k]);
            far = far.min((far_side - ray.origins[1][k]) * ray.inverse[k]);
        }
        let mut hits = (near.simd_le(far) & far.simd_ge(f32x8::splat(simd, 0.0))).to_bitmask() as u32;
        let first = self.entries.len();
        while hits != 0 {
            let slot = hits.trailing_zeros();
            hits &= hits - 1;
            let leaf = u32::from(node.leaves[slot as usize]);
            let lower_slots = u32::from(node.inner) & ((1 << slot) - 1);
            let is_inner = u32::from(node.inner) >> slot & 1 == 1;
            // A large padding turns the inverted box of an empty slot into a box that rays hit.
            if !is_inner && leaf == 0 {
                continue;
            }
            let child = Entry {
                near: near[slot as usize],
                first: if is_inner {
                    node.first_child + lower_slots.count_ones()
                } else {
                    node.first_item + (leaf & 31)
                },
                count: leaf >> 5,
            };
            let mut i = self.entries.len();
            self.entries.push(child);
            while i > first && self.entries[i - 1].near < child.near {
                self.entries[i] = self.entries[i - 1];
                i -= 1;
            }
            self.entries[i] = child;
        }
    }
}
