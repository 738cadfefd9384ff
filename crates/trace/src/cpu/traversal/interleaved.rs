//! Traversal of meshes by several rays in turn: while the next node of a ray is loaded, other rays advance.

use fearless_simd::prelude::*;
use glam::Vec3;

use super::super::bits::bits_of;
use super::super::prefetch::prefetch_line;
use super::box_ray::BoxRay;
use super::line::maximum;
use super::node::Triangles as _;
use super::node_stack::NodeStack;
use super::{Line, Nearest, remaining_t_max};
use crate::bvh::{DecodedLeaf, DecodedMesh, DecodedNode, LEAF};

/// Number of interleaved rays. With 8, meshes that exceed the caches take 15 to 20 % longer.
pub const RAYS: usize = 16;

/// A ray in the object space of a mesh, with the arguments of [`closest`](super::closest).
#[derive(Clone, Copy, Debug)]
pub struct MeshRay {
    pub line: Line,
    pub box_ray: BoxRay,
    pub start: f32,
    pub skip: u32,
    pub best: Nearest,
}

impl MeshRay {
    /// Creates a ray from `o` along `d`. Box tests enlarge boxes by `pad`.
    #[inline(always)]
    pub fn new(o: Vec3, d: Vec3, pad: f32, start: f32, skip: u32, best: Nearest) -> MeshRay {
        let (line, box_ray) = Line::with_box_ray(o, d, pad);
        MeshRay {
            line,
            box_ray,
            start,
            skip,
            best,
        }
    }

    const NONE: MeshRay = MeshRay {
        line: Line {
            axes: [0, 1, 2],
            o: [0.0; 3],
            o_low: [0.0; 3],
            o_high: [0.0; 3],
            inverse: [1.0; 3],
            shear: [0.0; 3],
        },
        box_ray: BoxRay {
            near_side_index: [0; 3],
            origins: [[0.0; 3]; 2],
            inverse: [1.0; 3],
        },
        start: 0.0,
        skip: 0,
        best: Nearest {
            t: 0.0,
            triangle: 0,
            slot: 0,
        },
    };
}

static NO_MESH: DecodedMesh = DecodedMesh {
    nodes: Vec::new(),
    leaves: Vec::new(),
};

/// The next step of a lane.
pub enum Next<'a> {
    /// It traces a ray through a mesh.
    Trace(&'a DecodedMesh, MeshRay),
    /// It waits until the other lanes have advanced, and is then asked again.
    Wait,
    /// It has no more rays.
    Done,
}

impl<'a> Next<'a> {
    /// Traces a ray through a mesh, if it is decoded.
    #[inline(always)]
    pub fn trace(mesh: Option<&'a DecodedMesh>, ray: MeshRay) -> Next<'a> {
        mesh.map_or(Next::Done, |mesh| Next::Trace(mesh, ray))
    }
}

/// The result of a traced ray.
#[derive(Clone, Copy, Debug)]
pub struct Traced<'r> {
    pub line: &'r Line,
    /// The closest hit; the initial value of [`MeshRay::best`] if the ray hits nothing nearer.
    pub best: Nearest,
    mesh: &'r DecodedMesh,
    leaf: u32,
}

impl Traced<'_> {
    /// Returns the barycentric coordinates of the second and the third vertex at the closest hit. The ray must have one;
    /// `trace` does not store the leaf of any other hit.
    #[inline(always)]
    pub fn barycentric(&self) -> [f32; 2] {
        // The leaf is still in the cache, unlike the mesh's vertices.
        let leaf = &self.mesh.leaves[self.leaf as usize];
        let [a, b, c] = leaf.corners((self.best.slot - leaf.first) as usize);
        self.line.barycentric([&a, &b, &c])
    }
}

/// The rays of a batch.
pub trait RaySource<'a, S> {
    /// Stores the result of the ray that the lane has traced, if any. Returns what the lane does next.
    fn next(&mut self, simd: S, lane: usize, traced: Option<Traced>) -> Next<'a>;
}

/// One of the interleaved rays.
struct Lane<'a, 's> {
    mesh: &'a DecodedMesh,
    ray: MeshRay,
    best: Nearest,
    /// Index of the leaf that contains the triangle of `best`.
    best_leaf: u32,
    limit: f32,
    /// The node or leaf to visit, as in [`DecodedNode::children`](crate::bvh::DecodedNode::children).
    next: u32,
    stack: &'s mut NodeStack,
}

impl<'a> Lane<'a, '_> {
    #[inline(always)]
    fn start(&mut self, mesh: &'a DecodedMesh, ray: MeshRay) {
        self.mesh = mesh;
        self.best = ray.best;
        self.limit = remaining_t_max(ray.start, ray.best.t);
        self.ray = ray;
        self.next = 0;
        self.prefetch_next();
    }

    #[inline(always)]
    fn visit_node<S: Simd, const ANY: bool>(&mut self, simd: S) {
        let node = &self.mesh.nodes[self.next as usize];
        let (ray, limit) = (&self.ray.box_ray, self.limit);
        match ANY {
            true => self.stack.push_children::<S, false>(simd, node, ray, limit),
            false => self.stack.push_children::<S, true>(simd, node, ray, limit),
        }
    }

    #[inline(always)]
    fn visit_leaf<S: Simd, const ANY: bool>(&mut self, simd: S) {
        let MeshRay { line, start, skip, .. } = &self.ray;
        let leaf_index = self.next & !LEAF;
        let leaf = &self.mesh.leaves[leaf_index as usize];
        let (hits, t) = leaf.intersect(simd, line);
        for i in bits_of(hits) {
            let (t, triangle, slot) = (t[i], leaf.triangles[i], leaf.first + i as u32);
            if ANY {
                if t > 0.0 && t < self.best.t && triangle != *skip {
                    self.best = Nearest { t, triangle, slot };
                    self.stack.clear();
                }
                continue;
            }
            let t = start + maximum(t, 0.0);
            let nearer = t < self.best.t || (t == self.best.t && triangle < self.best.triangle);
            if nearer && t > 0.0 && triangle != *skip {
                self.best = Nearest { t, triangle, slot };
                self.best_leaf = leaf_index;
                self.limit = remaining_t_max(*start, t);
            }
        }
    }

    /// Takes the next node or leaf from the stack. Returns false if the stack is empty.
    #[inline(always)]
    fn advance(&mut self) -> bool {
        let Some(next) = self.stack.pop(self.limit) else {
            return false;
        };
        self.next = next;
        self.prefetch_next();
        true
    }

    /// Returns 1 if the lane visits a leaf next, 0 if it visits a node.
    #[inline(always)]
    fn is_at_leaf(&self) -> u32 {
        const { assert!(LEAF == 1 << 31) };
        self.next >> 31
    }

    /// Starts to load the next node or leaf into the cache, without a branch, which would be mispredicted.
    #[inline(always)]
    fn prefetch_next(&self) {
        let index = (self.next & !LEAF) as usize;
        let node = self.mesh.nodes.as_ptr().wrapping_add(index).cast::<u8>();
        let leaf = self.mesh.leaves.as_ptr().wrapping_add(index).cast::<u8>();
        let (address, size) = match self.next & LEAF {
            0 => (node, size_of::<DecodedNode>()),
            _ => (leaf, size_of::<DecodedLeaf>()),
        };
        prefetch_line(address);
        prefetch_line(address.wrapping_add(64));
        prefetch_line(address.wrapping_add(128));
        prefetch_line(address.wrapping_add(size - 64));
    }
}

/// Masks of the lanes that take part in a turn.
#[derive(Default)]
struct Turn {
    /// They visit a node.
    at_nodes: u32,
    /// They visit a leaf.
    at_leaves: u32,
    /// Their rays have ended.
    ended: u32,
    /// They have no ray.
    idle: u32,
}

impl Turn {
    fn is_empty(&self) -> bool {
        self.at_nodes | self.at_leaves | self.ended | self.idle == 0
    }

    /// Adds lane `i`, which has visited a node or leaf.
    #[inline(always)]
    fn advance(&mut self, i: usize, lane: &mut Lane) {
        if lane.advance() {
            self.at_nodes |= (1 - lane.is_at_leaf()) << i;
            self.at_leaves |= lane.is_at_leaf() << i;
        } else {
            self.ended |= 1 << i;
        }
    }
}

/// Traces the rays of a batch: to the closest hit, like [`closest`](super::closest), or if `ANY` is true, to any hit
/// nearer than `best.t`, like [`any`](super::any). The stacks must be empty, and are empty again at the end.
///
/// In each turn, first all rays at nodes visit their node, then all rays at leaves visit their leaf, then rays that have
/// ended are replaced. A branch for each ray would often be mispredicted.
#[inline(always)]
pub fn trace<'a, S: Simd, const ANY: bool>(simd: S, stacks: &mut [NodeStack; RAYS], rays: &mut impl RaySource<'a, S>) {
    let mut lanes = stacks.each_mut().map(
        #[inline(always)]
        |stack| Lane {
            mesh: &NO_MESH,
            ray: MeshRay::NONE,
            best: MeshRay::NONE.best,
            best_leaf: 0,
            limit: 0.0,
            next: 0,
            stack,
        },
    );
    let mut turn = Turn {
        idle: (1 << RAYS) - 1,
        ..Turn::default()
    };
    while !turn.is_empty() {
        let Turn {
            at_nodes,
            at_leaves,
            ended,
            idle,
        } = std::mem::take(&mut turn);
        for i in bits_of(at_nodes) {
            lanes[i].visit_node::<S, ANY>(simd);
            turn.advance(i, &mut lanes[i]);
        }
        for i in bits_of(at_leaves) {
            lanes[i].visit_leaf::<S, ANY>(simd);
            turn.advance(i, &mut lanes[i]);
        }
        for i in bits_of(ended | idle) {
            let lane = &mut lanes[i];
            let traced = Traced {
                line: &lane.ray.line,
                best: lane.best,
                mesh: lane.mesh,
                leaf: lane.best_leaf,
            };
            match rays.next(simd, i, (ended >> i & 1 == 1).then_some(traced)) {
                Next::Trace(mesh, ray) => {
                    lane.start(mesh, ray);
                    turn.at_nodes |= 1 << i;
                }
                Next::Wait => turn.idle |= 1 << i,
                Next::Done => {}
            }
        }
    }
}
