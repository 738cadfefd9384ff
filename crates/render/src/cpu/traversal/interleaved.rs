//! Traversal of meshes by several rays in turn: while the next node of a ray is loaded, other rays advance.

use fearless_simd::prelude::*;

use super::super::bits::bits_of;
use super::box_ray::BoxRay;
use super::line::maximum;
use super::node::Triangles as _;
use super::node_stack::NodeStack;
use super::{Line, Nearest, remaining_t_max};
use crate::bvh::{DecodedMesh, LEAF};

/// Number of interleaved rays. Traversal with 4 or 16 is slower.
pub const RAYS: usize = 8;

/// A ray in the object space of a mesh, with the arguments of [`closest`](super::closest).
#[derive(Clone, Copy, Debug)]
pub struct MeshRay {
    pub line: Line,
    pub start: f32,
    pub skip: u32,
    pub best: Nearest,
}

impl MeshRay {
    const NONE: MeshRay = MeshRay {
        line: Line {
            axes: [0, 1, 2],
            o: [0.0; 3],
            o_low: [0.0; 3],
            o_high: [0.0; 3],
            inverse: [1.0; 3],
            shear: [0.0; 3],
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

/// The rays of a batch.
pub trait RaySource<'a, S> {
    /// Stores the result of the ray that the lane has traced, if any. Returns what the lane does next.
    fn next(&mut self, simd: S, lane: usize, traced: Option<(&Line, Nearest)>) -> Next<'a>;
}

/// One of the interleaved rays.
struct Lane<'a, 's> {
    mesh: &'a DecodedMesh,
    ray: MeshRay,
    box_ray: BoxRay,
    best: Nearest,
    limit: f32,
    /// The node or leaf to visit, as in [`DecodedNode::children`](crate::bvh::DecodedNode::children).
    next: u32,
    stack: &'s mut NodeStack,
    state: LaneState,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LaneState {
    Waiting,
    Tracing,
    Done,
}

impl<'a> Lane<'a, '_> {
    #[inline(always)]
    fn start(&mut self, mesh: &'a DecodedMesh, ray: MeshRay) {
        self.mesh = mesh;
        self.box_ray = BoxRay::of(&ray.line);
        self.best = ray.best;
        self.limit = remaining_t_max(ray.start, ray.best.t);
        self.ray = ray;
        self.next = 0;
        self.state = LaneState::Tracing;
    }

    /// Visits the node or leaf `next`.
    #[inline(always)]
    fn step<S: Simd, const ANY: bool>(&mut self, simd: S) {
        if self.next & LEAF == 0 {
            let node = &self.mesh.nodes[self.next as usize];
            match ANY {
                true => self
                    .stack
                    .push_children::<S, false>(simd, node, &self.box_ray, self.limit),
                false => self
                    .stack
                    .push_children::<S, true>(simd, node, &self.box_ray, self.limit),
            }
            return;
        }
        let MeshRay { line, start, skip, .. } = &self.ray;
        let leaf = &self.mesh.leaves[(self.next & !LEAF) as usize];
        let (hits, t) = leaf.intersect(simd, line);
        for i in bits_of(hits) {
            let (t, triangle, slot) = (t[i], leaf.triangles[i], leaf.first + i as u32);
            if ANY {
                if t > 0.0 && t < self.best.t && triangle != *skip {
                    self.best = Nearest { t, triangle, slot };
                    self.limit = f32::NEG_INFINITY;
                }
                continue;
            }
            let t = start + maximum(t, 0.0);
            let nearer = t < self.best.t || (t == self.best.t && triangle < self.best.triangle);
            if nearer && t > 0.0 && triangle != *skip {
                self.best = Nearest { t, triangle, slot };
                self.limit = remaining_t_max(*start, t);
            }
        }
    }

    #[inline(always)]
    fn prefetch_next(&self) {
        if self.next & LEAF == 0 {
            prefetch(&self.mesh.nodes, self.next as usize);
        } else {
            prefetch(&self.mesh.leaves, (self.next & !LEAF) as usize);
        }
    }
}

/// Starts to load an item into the cache.
#[inline(always)]
fn prefetch<T>(items: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let address = items.as_ptr().wrapping_add(index).cast::<i8>();
        // SAFETY: a prefetch accepts any address, and changes no memory.
        unsafe {
            for offset in (0..size_of::<T>()).step_by(64) {
                _mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(offset));
            }
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, index);
}

/// Traces the rays of a batch: to the closest hit, like [`closest`](super::closest), or if `ANY` is true, to any hit
/// nearer than `best.t`, like [`any`](super::any). The stacks must be empty, and are empty again at the end.
#[inline(always)]
pub fn trace<'a, S: Simd, const ANY: bool>(simd: S, stacks: &mut [NodeStack; RAYS], rays: &mut impl RaySource<'a, S>) {
    let mut lanes = stacks.each_mut().map(
        #[inline(always)]
        |stack| Lane {
            mesh: &NO_MESH,
            ray: MeshRay::NONE,
            box_ray: BoxRay::of(&MeshRay::NONE.line),
            best: MeshRay::NONE.best,
            limit: 0.0,
            next: 0,
            stack,
            state: LaneState::Waiting,
        },
    );
    let mut active = RAYS;
    while active > 0 {
        for (i, lane) in lanes.iter_mut().enumerate() {
            let traced = match lane.state {
                LaneState::Done => continue,
                LaneState::Waiting => None,
                LaneState::Tracing => {
                    lane.step::<S, ANY>(simd);
                    if let Some(entry) = lane.stack.pop(lane.limit) {
                        lane.next = entry;
                        lane.prefetch_next();
                        continue;
                    }
                    Some((&lane.ray.line, lane.best))
                }
            };
            match rays.next(simd, i, traced) {
                Next::Trace(mesh, ray) => {
                    lane.start(mesh, ray);
                    lane.prefetch_next();
                }
                Next::Wait => lane.state = LaneState::Waiting,
                Next::Done => {
                    lane.state = LaneState::Done;
                    active -= 1;
                }
            }
        }
    }
}
