//! Iteration over the items of the scene's BVH along a ray, approximately front to back.

use std::ops::Range;

use bytemuck::cast_slice;
use fearless_simd::Simd;

use super::super::slab::Slabs;
use super::super::traversal::{BoxRay, Stack};
use crate::bvh::Node;
use crate::records::Packed;

/// The items whose boxes a ray may hit.
pub struct Items {
    box_ray: BoxRay,
    stack: Stack,
    leaf_items: Range<usize>,
}

impl Default for Items {
    fn default() -> Items {
        Items {
            box_ray: BoxRay::new([0.0; 3], [0.0; 3], [1.0; 3]),
            stack: Stack::default(),
            leaf_items: 0..0,
        }
    }
}

impl Items {
    /// Restarts the traversal with another ray. `slabs` contains the terms of the ray for box tests.
    #[inline(always)]
    pub fn start(&mut self, slabs: Slabs) {
        self.leaf_items = 0..0;
        self.box_ray = BoxRay::new(
            slabs.low_origin.to_array(),
            slabs.high_origin.to_array(),
            slabs.inverse.to_array(),
        );
        self.stack.start();
    }

    /// Returns the index of the next item. Skips nodes and leaves that are farther away than `limit`.
    #[inline(always)]
    pub fn next<S: Simd>(&mut self, simd: S, scene: &Packed, limit: f32) -> Option<usize> {
        loop {
            if let Some(item) = self.leaf_items.next() {
                return Some(item);
            }
            let entry = self.stack.pop(limit)?;
            if entry.count == 0 {
                let nodes: &[Node] = cast_slice(&scene.bvh.nodes);
                self.stack
                    .push_children(simd, &nodes[entry.first as usize], &self.box_ray, limit);
            } else {
                self.leaf_items = entry.first as usize..(entry.first + entry.count) as usize;
            }
        }
    }
}
