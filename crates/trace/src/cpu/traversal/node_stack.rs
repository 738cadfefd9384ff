//! The stack of a ray in a batch: nodes and leaves of a decoded BVH. For closest hits, they are approximately in order of
//! distance, with the nearest on top.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, u8x32, u32x8};

use super::box_ray::BoxRay;
use super::closest::STACK;
use crate::bvh::DecodedNode;

/// Nodes and leaves to visit, as values of `DecodedNode::children`. Visiting a node removes an entry and adds up to 8,
/// so that there are at most `STACK` entries. The arrays have 8 spare elements, because 8 are written at a time.
#[derive(Clone, Debug)]
pub struct NodeStack {
    near: Box<[f32; STACK + 8]>,
    children: Box<[u32; STACK + 8]>,
    depth: usize,
}

impl Default for NodeStack {
    fn default() -> NodeStack {
        NodeStack {
            near: Box::new([0.0; STACK + 8]),
            children: Box::new([0; STACK + 8]),
            depth: 0,
        }
    }
}

/// For each octant of a ray's direction, byte indices that sort the children of a node back to front. The BVH is built
/// so that the child in slot c is approximately in octant c of the node.
static BACK_TO_FRONT: [[u8; 32]; 8] = {
    let mut table = [[0; 32]; 8];
    let mut i = 0;
    while i < 8 * 32 {
        let (octant, lane, byte) = (i / 32, i / 4 % 8, i % 4);
        table[octant][i % 32] = (4 * ((7 - lane) ^ octant) + byte) as u8;
        i += 1;
    }
    table
};

impl NodeStack {
    /// Removes all entries, and adds the root.
    #[inline(always)]
    pub fn start(&mut self) {
        (self.near[0], self.children[0], self.depth) = (0.0, 0, 1);
    }

    /// Removes all entries.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.depth = 0;
    }

    /// Removes entries from the top, down to the first whose distance is at most `limit`. Returns this entry.
    #[inline(always)]
    pub fn pop(&mut self, limit: f32) -> Option<u32> {
        Some(self.pop_with_distance(limit)?.0)
    }

    /// Like [`pop`](Self::pop). Also returns the distance to the box, at least 0.
    #[inline(always)]
    pub fn pop_with_distance(&mut self, limit: f32) -> Option<(u32, f32)> {
        while self.depth > 0 {
            self.depth -= 1;
            if self.near[self.depth] <= limit {
                return Some((self.children[self.depth], self.near[self.depth]));
            }
        }
        None
    }

    /// Adds those children of a node whose boxes the ray hits before `limit`. Sorts them if `SORTED`, with the nearest
    /// on top.
    #[inline(always)]
    pub fn push_children<S: Simd, const SORTED: bool>(
        &mut self,
        simd: S,
        node: &DecodedNode,
        ray: &BoxRay,
        limit: f32,
    ) {
        let mut near = f32x8::splat(simd, 0.0);
        let mut far = f32x8::splat(simd, limit);
        for k in 0..3 {
            let near_index = ray.near_side_index[k];
            let near_side = f32x8::simd_from(simd, node.planes[near_index][k]);
            let far_side = f32x8::simd_from(simd, node.planes[1 - near_index][k]);
            near = near.max((near_side - ray.origins[0][k]) * ray.inverse[k]);
            far = far.min((far_side - ray.origins[1][k]) * ray.inverse[k]);
        }
        let mut children = u32x8::simd_from(simd, node.children);
        if SORTED {
            let order = u8x32::simd_from(simd, BACK_TO_FRONT[ray.octant()]);
            near = near.swizzle_dyn(order);
            far = far.swizzle_dyn(order);
            children = children.swizzle_dyn(order);
        }
        let hits = near.simd_le(far);
        let lanes = self.depth..self.depth + 8;
        near.compress(hits).store_slice(&mut self.near[lanes.clone()]);
        children.compress(hits).store_slice(&mut self.children[lanes]);
        self.depth += (hits.to_bitmask() as u32).count_ones() as usize;
    }
}
