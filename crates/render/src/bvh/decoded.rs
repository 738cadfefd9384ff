//! A mesh and its BVH in a form for fast traversal on the CPU: boxes are decoded to floats, and the triangles of a leaf
//! are a structure of arrays. A mesh takes about 130 bytes per triangle.

use std::sync::OnceLock;

use super::Node;

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
        let mut leaves = Vec::new();
        let mut leaf = |first: usize, count: usize| {
            leaves.push(DecodedLeaf::new(vertices, triangles, first, count));
            LEAF | (leaves.len() - 1) as u32
        };
        let nodes = nodes.iter().map(|node| DecodedNode::new(node, &mut leaf)).collect();
        DecodedMesh { nodes, leaves }
    }
}

impl DecodedNode {
    /// `leaf` adds a leaf, given its first triangle and its number of triangles, and returns its entry for `children`.
    fn new(node: &Node, leaf: &mut impl FnMut(usize, usize) -> u32) -> DecodedNode {
        let mut decoded = DecodedNode {
            planes: [[[f32::INFINITY; 8]; 3], [[f32::NEG_INFINITY; 8]; 3]],
            children: [LEAF; 8],
            inner: u32::from(node.inner),
        };
        for child in 0..8 {
            let items = node.items(child);
            decoded.children[child] = match node.child(child) {
                Some(index) => index,
                None if items.is_empty() => continue,
                None => leaf(items.start, items.len()),
            };
            let (low, high) = (node.low(child), node.high(child));
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

/// The decoded form of a mesh, if it has been decoded. It is derived from the mesh: any two are equal, and a clone, which
/// may be changed, has none.
#[derive(Debug, Default)]
pub struct DecodedOnce(OnceLock<DecodedMesh>);

impl DecodedOnce {
    /// Returns the decoded form, if it exists.
    pub fn get(&self) -> Option<&DecodedMesh> {
        self.0.get()
    }

    /// Returns the decoded form, after decoding the mesh if necessary.
    pub fn get_or_init(&self, decode: impl FnOnce() -> DecodedMesh) -> &DecodedMesh {
        self.0.get_or_init(decode)
    }
}

impl Clone for DecodedOnce {
    fn clone(&self) -> DecodedOnce {
        DecodedOnce::default()
    }
}

impl PartialEq for DecodedOnce {
    fn eq(&self, _: &DecodedOnce) -> bool {
        true
    }
}
