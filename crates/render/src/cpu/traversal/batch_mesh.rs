//! A mesh and its BVH for traversal by batches of rays: boxes are decoded to floats, and the triangles of a leaf are a
//! structure of arrays. A mesh takes about 130 bytes per triangle.

use fearless_simd::f32x4;
use fearless_simd::prelude::*;

use super::four::intersect;
use super::{Line, Mesh};
use crate::bvh::Node;

/// Bit of [`BatchNode::children`] that is set for leaves.
pub const LEAF: u32 = 1 << 31;

/// A node with decoded boxes.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct BatchNode {
    /// Lower and upper sides of the children's boxes along x, y and z. Empty slots have an empty box.
    pub planes: [[[f32; 8]; 3]; 2],
    /// For each child, the index of its node, or [`LEAF`] | index of its leaf.
    pub children: [u32; 8],
}

/// The triangles of a leaf. Unused lanes repeat the last triangle.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// Coordinates of the triangles, indexed by vertex, axis and lane.
    corners: [[[f32; 4]; 3]; 3],
    /// Indices of the triangles.
    pub triangles: [u32; 4],
    /// Position of the first triangle in leaf order.
    pub first: u32,
    /// Mask of the used lanes.
    used: u32,
}

/// A mesh with its BVH, for batches of rays.
#[derive(Clone, Debug)]
pub struct BatchMesh {
    pub nodes: Vec<BatchNode>,
    pub leaves: Vec<Leaf>,
}

impl BatchMesh {
    pub fn new(mesh: &Mesh) -> BatchMesh {
        let mut leaves = Vec::new();
        let nodes = mesh
            .nodes
            .iter()
            .map(|node| batch_node(mesh, node, &mut leaves))
            .collect();
        BatchMesh { nodes, leaves }
    }
}

fn batch_node(mesh: &Mesh, node: &Node, leaves: &mut Vec<Leaf>) -> BatchNode {
    let mut decoded = BatchNode {
        planes: [[[f32::INFINITY; 8]; 3], [[f32::NEG_INFINITY; 8]; 3]],
        children: [LEAF; 8],
    };
    for child in 0..8 {
        let items = node.items(child);
        decoded.children[child] = match node.child(child) {
            Some(index) => index,
            None if items.is_empty() => continue,
            None => {
                leaves.push(Leaf::new(mesh, items.start, items.len()));
                LEAF | (leaves.len() - 1) as u32
            }
        };
        let (low, high) = (node.low(child), node.high(child));
        for axis in 0..3 {
            decoded.planes[0][axis][child] = low[axis];
            decoded.planes[1][axis][child] = high[axis];
        }
    }
    decoded
}

impl Leaf {
    fn new(mesh: &Mesh, first: usize, count: usize) -> Leaf {
        let mut leaf = Leaf {
            corners: [[[0.0; 4]; 3]; 3],
            triangles: [0; 4],
            first: first as u32,
            used: (1 << count) - 1,
        };
        for lane in 0..4 {
            let triangle = mesh.triangles[first + lane.min(count - 1)];
            leaf.triangles[lane] = triangle[3];
            for (corner, vertex) in leaf.corners.iter_mut().zip(triangle) {
                for (axis, coordinates) in corner.iter_mut().enumerate() {
                    coordinates[lane] = mesh.vertices[vertex as usize][axis];
                }
            }
        }
        leaf
    }

    /// See [`intersect`].
    #[inline(always)]
    pub fn intersect<S: Simd>(&self, simd: S, line: &Line) -> (u32, f32x4<S>) {
        intersect(
            simd,
            line,
            self.used,
            #[inline(always)]
            |corner, axis| f32x4::simd_from(simd, self.corners[corner][axis]),
        )
    }
}
