//! Iteration over the items of the scene's BVH along a ray, approximately front to back.

use fearless_simd::Simd;

use super::super::slab::Slabs;
use super::super::traversal::{BoxRay, NodeStack};
use crate::bvh::{DecodedNode, LEAF};

/// The items whose boxes a ray may hit.
pub struct Items {
    box_ray: BoxRay,
    stack: NodeStack,
}

impl Default for Items {
    fn default() -> Items {
        Items {
            box_ray: BoxRay::new([0.0; 3], [0.0; 3], [1.0; 3]),
            stack: NodeStack::default(),
        }
    }
}

impl Items {
    /// Restarts the traversal with another ray. `slabs` contains the terms of the ray for box tests.
    #[inline(always)]
    pub fn start(&mut self, slabs: Slabs) {
        self.box_ray = BoxRay::new(
            slabs.low_origin.to_array(),
            slabs.high_origin.to_array(),
            slabs.inverse.to_array(),
        );
        self.stack.start();
    }

    /// Visits the next node or leaf whose box the ray hits before `limit`.
    #[inline(always)]
    pub fn step<S: Simd, const SORTED: bool>(&mut self, simd: S, nodes: &[DecodedNode], limit: f32) -> ItemStep {
        let Some((child, near)) = self.stack.pop_with_distance(limit) else {
            return ItemStep::End;
        };
        if child & LEAF != 0 {
            return ItemStep::Found((child & !LEAF) as usize, near);
        }
        let node = &nodes[child as usize];
        self.stack.push_children::<S, SORTED>(simd, node, &self.box_ray, limit);
        ItemStep::Node
    }
}

/// A step of a traversal.
pub enum ItemStep {
    /// The children of a node have been queued.
    Node,
    /// The index of an item, and the distance to its box, at least 0.
    Found(usize, f32),
    /// There are no more items.
    End,
}
