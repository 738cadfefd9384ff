//! BVHs in a form for fast traversal on the CPU: boxes are decoded to floats. In a mesh, the triangles of a leaf are a
//! structure of arrays, about 130 bytes per triangle. In the BVH of a scene, the box of a leaf is that of its only item.

use std::ops::Range;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::huge_pages::vec_in_huge_pages;
use super::{Aabb, Node};

/// Bit of [`DecodedNode::children`] that is set for leaves.
pub const LEAF: u32 = 1 << 31;

/// A node with decoded boxes.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct DecodedNode {
    /// Lower and upper sides of the children's boxes along x, y and z. Empty slots have an empty box.
    pub planes: [[[f32; 8]; 3]; 2],
    /// For each child, the index of its node, or [`LEAF`] | index of its leaf.
    pub children: [u32; 8],
    /// Mask of the children that are nodes.
    pub inner: u32,
}

/// The triangles of a leaf. Unused lanes repeat the last triangle.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct DecodedLeaf {
    /// Coordinates of the triangles, indexed by vertex, axis and lane.
    pub corners: [[[f32; 4]; 3]; 3],
    /// Indices of the triangles.
    pub triangles: [u32; 4],
    /// Position of the first triangle in leaf order.
    pub first: u32,
    /// Mask of the used lanes.
    pub used: u32,
}

/// A mesh with its BVH.
#[derive(Clone, Debug)]
pub struct DecodedMesh {
    /// The nodes, root first.
    pub nodes: Vec<DecodedNode>,
    /// The leaves.
    pub leaves: Vec<DecodedLeaf>,
}

impl DecodedMesh {
    /// Decodes a BVH over triangles. `vertices` are positions, each followed by an unused word; `triangles` are three
    /// vertex indices and the triangle's index, in leaf order.
    pub fn new(nodes: &[Node], vertices: &[[f32; 4]], triangles: &[[u32; 4]]) -> DecodedMesh {
        let mut items_of_leaves = Vec::new();
        let mut first_leaves = Vec::with_capacity(nodes.len());
        for node in nodes {
            first_leaves.push(items_of_leaves.len() as u32);
            items_of_leaves.extend((0..8).map(|child| node.items(child)).filter(|items| !items.is_empty()));
        }
        let mut leaves = vec_in_huge_pages(items_of_leaves.len());
        items_of_leaves
            .into_par_iter()
            .map(|items| DecodedLeaf::new(vertices, triangles, items.start, items.len()))
            .collect_into_vec(&mut leaves);
        let mut decoded_nodes = vec_in_huge_pages(nodes.len());
        nodes
            .par_iter()
            .zip(first_leaves)
            .map(|(node, mut next_leaf)| {
                DecodedNode::new(node, |_, bounds| {
                    let leaf = next_leaf;
                    next_leaf += 1;
                    (leaf, bounds)
                })
            })
            .collect_into_vec(&mut decoded_nodes);
        DecodedMesh {
            nodes: decoded_nodes,
            leaves,
        }
    }
}

/// Decodes the BVH of a scene. A leaf is the index of its item, and has the box of the item. Returns no nodes if a leaf
/// has several items.
pub fn decode_items(nodes: &[Node], boxes: impl Fn(usize) -> Aabb) -> Vec<DecodedNode> {
    let mut has_several = false;
    let mut leaf = |items: Range<usize>, _: Aabb| {
        has_several |= items.len() > 1;
        (items.start as u32, boxes(items.start))
    };
    let decoded = nodes.iter().map(|node| DecodedNode::new(node, &mut leaf)).collect();
    if has_several { Vec::new() } else { decoded }
}

impl DecodedNode {
    /// `leaf` returns the index and the box of a leaf, given its items and its decoded box.
    fn new(node: &Node, mut leaf: impl FnMut(Range<usize>, Aabb) -> (u32, Aabb)) -> DecodedNode {
        let mut decoded = DecodedNode {
            planes: [[[f32::INFINITY; 8]; 3], [[f32::NEG_INFINITY; 8]; 3]],
            children: [LEAF; 8],
            inner: u32::from(node.inner),
        };
        for child in 0..8 {
            let items = node.items(child);
            let bounds = Aabb {
                low: node.low(child),
                high: node.high(child),
            };
            let (entry, Aabb { low, high }) = match node.child(child) {
                Some(index) => (index, bounds),
                None if items.is_empty() => continue,
                None => {
                    let (index, bounds) = leaf(items, bounds);
                    (LEAF | index, bounds)
                }
            };
            decoded.children[child] = entry;
            for axis in 0..3 {
                decoded.planes[0][axis][child] = low[axis];
                decoded.planes[1][axis][child] = high[axis];
            }
        }
        decoded
    }
}

impl DecodedLeaf {
    fn new(vertices: &[[f32; 4]], triangles: &[[u32; 4]], first: usize, count: usize) -> DecodedLeaf {
        let mut leaf = DecodedLeaf {
            corners: [[[0.0; 4]; 3]; 3],
            triangles: [0; 4],
            first: first as u32,
            used: (1 << count) - 1,
        };
        for lane in 0..4 {
            let triangle = triangles[first + lane.min(count - 1)];
            leaf.triangles[lane] = triangle[3];
            for (corner, vertex) in leaf.corners.iter_mut().zip(triangle) {
                for (axis, coordinates) in corner.iter_mut().enumerate() {
                    coordinates[lane] = vertices[vertex as usize][axis];
                }
            }
        }
        leaf
    }
}

/// The decoded form of a BVH, if it has been decoded. It is derived from the BVH: any two are equal, and a clone, which
/// may be changed, has none.
#[derive(Debug)]
pub struct DecodedOnce<T>(OnceLock<T>);

impl<T> DecodedOnce<T> {
    /// Returns the decoded form, if it exists.
    pub fn get(&self) -> Option<&T> {
        self.0.get()
    }

    /// Decodes the BVH unless it has been decoded. Several threads may do so at once: a lock would be held while rayon
    /// runs other tasks, which may need it.
    pub fn init(&self, decode: impl FnOnce() -> T) {
        if self.get().is_none() {
            _ = self.0.set(decode());
        }
    }
}

impl<T> Default for DecodedOnce<T> {
    fn default() -> DecodedOnce<T> {
        DecodedOnce(OnceLock::new())
    }
}

impl<T> Clone for DecodedOnce<T> {
    fn clone(&self) -> DecodedOnce<T> {
        DecodedOnce::default()
    }
}

impl<T> PartialEq for DecodedOnce<T> {
    fn eq(&self, _: &DecodedOnce<T>) -> bool {
        true
    }
}
