//! The two forms of a BVH that rays traverse: compact nodes, and decoded nodes of meshes.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8};

use super::super::prefetch::prefetch_item;
use super::four::{Four, intersect};
use super::{Line, Mesh};
use crate::bvh::{DecodedLeaf, DecodedMesh, DecodedNode, LEAF, Node};

/// A node with up to 8 children.
pub trait WideNode {
    /// The children that are not nodes.
    type Leaf;

    /// Returns a side of the children's boxes along an axis: 0 for the lower side, 1 for the upper side.
    fn planes<S: Simd>(&self, simd: S, side: usize, axis: usize) -> f32x8<S>;

    /// Returns the mask of the children that are nodes.
    fn inner(&self) -> u32;

    /// Returns the index of the node in a slot.
    fn node(&self, slot: usize) -> u32;

    /// Returns the leaf in a slot.
    fn leaf(&self, slot: usize) -> Self::Leaf;
}

impl WideNode for Node {
    type Leaf = Range<usize>;

    #[inline(always)]
    fn planes<S: Simd>(&self, simd: S, side: usize, axis: usize) -> f32x8<S> {
        let mut steps = [0.0; 8];
        for (x, step) in steps.iter_mut().zip(&[&self.low, &self.high][side][axis]) {
            *x = f32::from(*step);
        }
        f32x8::simd_from(simd, steps) * self.scale()[axis] + self.base[axis]
    }

    #[inline(always)]
    fn inner(&self) -> u32 {
        u32::from(self.inner)
    }

    #[inline(always)]
    fn node(&self, slot: usize) -> u32 {
        let lower_slots = u32::from(self.inner) & ((1 << slot) - 1);
        self.first_child + lower_slots.count_ones()
    }

    #[inline(always)]
    fn leaf(&self, slot: usize) -> Range<usize> {
        self.items(slot)
    }
}

impl WideNode for DecodedNode {
    type Leaf = u32;

    #[inline(always)]
    fn planes<S: Simd>(&self, simd: S, side: usize, axis: usize) -> f32x8<S> {
        f32x8::simd_from(simd, self.planes[side][axis])
    }

    #[inline(always)]
    fn inner(&self) -> u32 {
        self.inner
    }

    #[inline(always)]
    fn node(&self, slot: usize) -> u32 {
        self.children[slot]
    }

    #[inline(always)]
    fn leaf(&self, slot: usize) -> u32 {
        self.children[slot] & !LEAF
    }
}

/// One to four triangles of a leaf.
pub trait Triangles {
    /// Intersects a ray with all triangles, like [`intersect`].
    fn intersect<S: Simd>(&self, simd: S, line: &Line) -> (u32, f32x4<S>);

    /// Returns the number of triangles.
    fn count(&self) -> usize;

    /// Returns the index of a triangle.
    fn index(&self, lane: usize) -> u32;

    /// Returns the position of a triangle in leaf order.
    fn slot(&self, lane: usize) -> u32;

    /// Returns the corners of a triangle.
    fn corners(&self, lane: usize) -> [[f32; 3]; 3];
}

impl Triangles for &DecodedLeaf {
    #[inline(always)]
    fn intersect<S: Simd>(&self, simd: S, line: &Line) -> (u32, f32x4<S>) {
        intersect(
            simd,
            line,
            self.used,
            #[inline(always)]
            |corner, axis| f32x4::simd_from(simd, self.corners[corner][axis]),
        )
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.used.count_ones() as usize
    }

    #[inline(always)]
    fn index(&self, lane: usize) -> u32 {
        self.triangles[lane]
    }

    #[inline(always)]
    fn slot(&self, lane: usize) -> u32 {
        self.first + lane as u32
    }

    #[inline(always)]
    fn corners(&self, lane: usize) -> [[f32; 3]; 3] {
        self.corners.map(|corner| corner.map(|coordinates| coordinates[lane]))
    }
}

/// The triangles of a leaf of compact nodes.
pub struct CompactLeaf<'a> {
    mesh: &'a Mesh<'a>,
    items: Range<usize>,
}

impl Triangles for CompactLeaf<'_> {
    #[inline(always)]
    fn intersect<S: Simd>(&self, simd: S, line: &Line) -> (u32, f32x4<S>) {
        Four::new(simd, self.mesh, &self.mesh.triangles[self.items.clone()]).intersect(simd, line)
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.items.len()
    }

    #[inline(always)]
    fn index(&self, lane: usize) -> u32 {
        self.mesh.triangles[self.items.start + lane][3]
    }

    #[inline(always)]
    fn slot(&self, lane: usize) -> u32 {
        (self.items.start + lane) as u32
    }

    #[inline(always)]
    fn corners(&self, lane: usize) -> [[f32; 3]; 3] {
        let [a, b, c, _] = self.mesh.triangles[self.items.start + lane];
        [a, b, c].map(|vertex| {
            let [x, y, z, _] = self.mesh.vertices[vertex as usize];
            [x, y, z]
        })
    }
}

/// A BVH over triangles.
pub trait TriangleBvh {
    type Node: WideNode;

    /// Returns the nodes, root first.
    fn nodes(&self) -> &[Self::Node];

    /// Returns the triangles of a leaf. An empty leaf has none.
    fn triangles(&self, leaf: <Self::Node as WideNode>::Leaf) -> Option<impl Triangles>;

    /// Starts to load a leaf.
    #[inline(always)]
    fn prefetch_leaf(&self, _leaf: <Self::Node as WideNode>::Leaf) {}
}

impl TriangleBvh for Mesh<'_> {
    type Node = Node;

    #[inline(always)]
    fn nodes(&self) -> &[Node] {
        self.nodes
    }

    #[inline(always)]
    fn triangles(&self, leaf: Range<usize>) -> Option<impl Triangles> {
        // A large padding turns the inverted box of an empty slot into a box that rays hit.
        (!leaf.is_empty()).then_some(CompactLeaf {
            mesh: self,
            items: leaf,
        })
    }
}

impl TriangleBvh for DecodedMesh {
    type Node = DecodedNode;

    #[inline(always)]
    fn nodes(&self) -> &[DecodedNode] {
        &self.nodes
    }

    /// Empty slots refer to the first leaf. They are hit only by directions with both signs along all axes.
    #[inline(always)]
    fn triangles(&self, leaf: u32) -> Option<impl Triangles> {
        self.leaves.get(leaf as usize)
    }

    #[inline(always)]
    fn prefetch_leaf(&self, leaf: u32) {
        prefetch_item(&self.leaves, leaf);
    }
}
