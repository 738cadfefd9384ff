//! The items of the scene's BVH along a ray, approximately front to back.

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
    leaf: Range<usize>,
}

impl Default for Items {
    fn default() -> Items {
        Items {
            box_ray: BoxRay::new([0.0; 3], [0.0; 3], [1.0; 3]),
            stack: Stack::default(),
            leaf: 0..0,
        }
    }
}

impl Items {
    /// Starts again with another ray.
    #[inline(always)]
    pub fn start(&mut self, slabs: Slabs) {
        self.leaf = 0..0;
        self.box_ray = BoxRay::new(
            slabs.low_origin.to_array(),
            slabs.high_origin.to_array(),
            slabs.inverse.to_array(),
        );
        self.stack.start();
    }

    /// Returns the next item. Omits items of leaves that are farther away than `limit`.
    #[inline(always)]
    pub fn next<S: Simd>(&mut self, simd: S, scene: &Packed, limit: f32) -> Option<usize> {
        loop {
            if let Some(item) = self.leaf.next() {
                return Some(item);
            }
            let entry = self.stack.pop(limit)?;
            if entry.count == 0 {
                let nodes: &[Node] = cast_slice(&scene.bvh.nodes);
                self.stack
                    .push_children(simd, &nodes[entry.first as usize], &self.box_ray, limit);
            } else {
                self.leaf = entry.first as usize..(entry.first + entry.count) as usize;
            }
        }
    }
}
