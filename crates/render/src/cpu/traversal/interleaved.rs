//! Traversal of meshes by several rays in turn: while the processor waits for a ray's next node, it advances the others.

use fearless_simd::prelude::*;

use super::four::Four;
use super::line::maximum;
use super::stack::{BoxRay, Entry, Stack};
use super::{Line, Mesh, Nearest, remaining_t_max};

/// Number of interleaved rays. With 4 or 16 the rays take longer.
pub const RAYS: usize = 8;

/// A ray in the object space of a mesh, with the arguments of [`closest`](super::closest).
#[derive(Clone, Copy, Debug)]
pub struct MeshRay<'a> {
    pub mesh: Mesh<'a>,
    pub line: Line,
    pub start: f32,
    pub skip: u32,
    pub best: Nearest,
}

impl MeshRay<'_> {
    const NONE: MeshRay<'static> = MeshRay {
        mesh: Mesh {
            nodes: &[],
            vertices: &[],
            triangles: &[],
        },
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

/// The rays of a batch.
pub trait RaySource<'a, S> {
    /// Takes a traced ray and its result, if any, and returns the next ray of the lane, if any.
    fn next(&mut self, simd: S, lane: usize, traced: Option<(&MeshRay<'a>, Nearest)>) -> Option<MeshRay<'a>>;
}

struct Lane<'a, 's> {
    ray: MeshRay<'a>,
    box_ray: BoxRay,
    best: Nearest,
    limit: f32,
    next: Entry,
    stack: &'s mut Stack,
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
    fn start(&mut self, ray: MeshRay<'a>) {
        self.ray = ray;
        self.box_ray = BoxRay::of(&ray.line);
        self.best = ray.best;
        self.limit = remaining_t_max(ray.start, ray.best.t);
        self.next = Entry::ROOT;
        self.state = LaneState::Tracing;
    }

    /// Visits a node or a leaf.
    #[inline(always)]
    fn step<S: Simd, const ANY: bool>(&mut self, simd: S) {
        let Entry { first, count, .. } = self.next;
        let MeshRay {
            mesh,
            line,
            start,
            skip,
            ..
        } = &self.ray;
        if count == 0 {
            let node = &mesh.nodes[first as usize];
            self.stack.push_children(simd, node, &self.box_ray, self.limit);
            return;
        }
        let triangles = &mesh.triangles[first as usize..(first + count) as usize];
        let (mut hits, t) = Four::new(simd, mesh, triangles).intersect(simd, line);
        while hits != 0 {
            let i = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let (t, triangle, slot) = (t[i], triangles[i][3], first + i as u32);
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
        let Entry { first, count, .. } = self.next;
        if count == 0 {
            prefetch(self.ray.mesh.nodes, first as usize);
        } else {
            prefetch(self.ray.mesh.triangles, first as usize);
        }
    }
}

/// Starts to load an item and the bytes after it into the cache.
#[inline(always)]
fn prefetch<T>(items: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let address = items.as_ptr().wrapping_add(index).cast::<i8>();
        // SAFETY: a prefetch accepts any address, and changes no memory.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(address);
            _mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(64));
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, index);
}

/// Traces the rays of a batch: like [`closest`](super::closest), or if `ANY` is true, up to any hit nearer than
/// `best.t`, like [`any`](super::any). The stacks are empty, before and after.
#[inline(always)]
pub fn trace<'a, S: Simd, const ANY: bool>(simd: S, stacks: &mut [Stack; RAYS], rays: &mut impl RaySource<'a, S>) {
    let mut lanes = stacks.each_mut().map(
        #[inline(always)]
        |stack| Lane {
            ray: MeshRay::NONE,
            box_ray: BoxRay::of(&MeshRay::NONE.line),
            best: MeshRay::NONE.best,
            limit: 0.0,
            next: Entry::ROOT,
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
                    Some((&lane.ray, lane.best))
                }
            };
            match rays.next(simd, i, traced) {
                Some(ray) => {
                    lane.start(ray);
                    lane.prefetch_next();
                }
                None => {
                    lane.state = LaneState::Done;
                    active -= 1;
                }
            }
        }
    }
}
