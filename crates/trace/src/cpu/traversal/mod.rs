//! Closest-hit and occlusion queries over a BVH of triangles or other items.
//!
//! A [`Line`] is a ray prepared for box and triangle tests. The results do not depend on the BVH: they equal those of
//! testing every triangle with [`Line::triangle`]. A ray hits a triangle only where it hits the triangle's box. Every
//! step of the box test is monotone, so that a ray that hits a box also hits every enclosing box. At equal distance,
//! the smallest index wins.
//!
//! Each function is compiled for several instruction sets (`fearless_simd`). All versions give the same bits, since no
//! operation is contracted to a fused multiply-add.
//!
//! Measured with `benches/trees.rs` (a bumpy sphere of 70,000 triangles on a floor) on a loaded AMD EPYC with AVX-512,
//! in CPU time of one thread: 157 ns per camera ray, 665 ns per query of 16 shadow segments. With plain loops instead
//! of `fearless_simd`, queries by rays took 8 % longer with AVX-512 and 30 % longer with AVX2.

mod box_ray;
mod closest;
mod four;
mod interleaved;
mod line;
mod node;
mod node_stack;
mod occluded;

use std::ops::Range;

pub use fearless_simd::Level;
use fearless_simd::dispatch;
use glam::Vec3;

pub use self::box_ray::BoxRay;
pub use self::interleaved::{MeshRay, Next, RAYS, RaySource, Traced, trace};
pub use self::line::Line;
pub use self::node_stack::NodeStack;
use crate::bvh::{Aabb, DecodedMesh, Node};

/// The BVH of a mesh, and its triangles.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    pub nodes: &'a [Node],
    /// Positions, each followed by an unused word.
    pub vertices: &'a [[f32; 4]],
    /// Vertex indices and the triangle's index, in leaf order.
    pub triangles: &'a [[u32; 4]],
    /// The same BVH and triangles, decoded. They are traversed instead, if available.
    pub decoded: Option<&'a DecodedMesh>,
}

/// The closest hit so far, or the upper bound of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Distance, as a multiple of the length of the ray's direction.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: u32,
    /// Position of the triangle in leaf order.
    pub slot: u32,
}

/// Returns an upper bound on the distance from `start` to hits nearer than `t`, with a margin for rounding.
pub fn remaining_t_max(start: f32, t: f32) -> f32 {
    (t - start) + t * 4.7683716e-7
}

/// Returns the closest hit nearer than `best`, except on the triangle with index `skip`; `best` if no such hit exists.
/// `start` is the distance along the full ray at which `line` begins: a hit at distance t along `line` has the distance
/// `start + max(t, 0)`. Hits at distance 0 do not count. At equal distance, the smallest index wins.
pub fn closest(level: Level, mesh: &Mesh, line: &Line, start: f32, skip: u32, best: Nearest) -> Nearest {
    match mesh.decoded {
        Some(mesh) => dispatch!(level, simd => closest::closest(simd, mesh, line, start, skip, best)),
        None => dispatch!(level, simd => closest::closest(simd, mesh, line, start, skip, best)),
    }
}

/// Returns true if the ray hits a triangle nearer than `t_max`, except the triangle with index `skip`.
pub fn any(level: Level, mesh: &Mesh, line: &Line, skip: u32, t_max: f32) -> bool {
    match mesh.decoded {
        Some(mesh) => dispatch!(level, simd => closest::any(simd, mesh, line, skip, t_max)),
        None => dispatch!(level, simd => closest::any(simd, mesh, line, skip, t_max)),
    }
}

/// Visits the leaves that the ray hits before `limit`, approximately front to back. `visit` gets a leaf's items and the
/// limit, and returns the new limit, which must not be larger.
pub fn leaves(level: Level, nodes: &[Node], line: &Line, limit: f32, visit: impl FnMut(Range<usize>, f32) -> f32) {
    dispatch!(level, simd => closest::leaves(simd, nodes, line, limit, visit))
}

/// Maximum number of segments per query.
pub const MAX_SEGMENTS: usize = 32;

/// Up to [`MAX_SEGMENTS`] vectors as a structure of arrays. Unused lanes repeat the first vector.
#[derive(Clone, Debug)]
pub struct Directions {
    pub count: usize,
    pub components: [[f32; MAX_SEGMENTS]; 3],
}

impl Directions {
    /// No vectors.
    pub const EMPTY: Directions = Directions {
        count: 0,
        components: [[0.0; MAX_SEGMENTS]; 3],
    };

    /// Creates the structure from the first [`MAX_SEGMENTS`] vectors.
    pub fn new(vectors: &[Vec3]) -> Directions {
        let first = vectors.first().copied().unwrap_or(Vec3::Z);
        let mut directions = Directions {
            count: vectors.len().min(MAX_SEGMENTS),
            components: first.to_array().map(|x| [x; MAX_SEGMENTS]),
        };
        for (i, v) in vectors.iter().enumerate().take(MAX_SEGMENTS) {
            for k in 0..3 {
                directions.components[k][i] = v[k];
            }
        }
        directions
    }

    pub fn get(&self, i: usize) -> Vec3 {
        let [x, y, z] = &self.components;
        Vec3::new(x[i], y[i], z[i])
    }

    /// Returns the mask of all vectors.
    pub fn all(&self) -> u32 {
        ((1_u64 << self.count) - 1) as u32
    }
}

/// Up to [`MAX_SEGMENTS`] segments from one point.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    pub o: Vec3,
    /// Padding of boxes.
    pub pad: f32,
    pub directions: &'a Directions,
    /// Occluders are nearer than this distance, as a multiple of the length of a segment's direction.
    pub t_max: f32,
    /// Index of a triangle that occludes nothing.
    pub skip: u32,
}

/// Returns the mask of the segments that a triangle occludes, among those in `mask`.
pub fn occluded(level: Level, mesh: &Mesh, segments: &Segments, mask: u32) -> u32 {
    match mesh.decoded {
        Some(mesh) => dispatch!(level, simd => occluded::occluded(simd, mesh, segments, mask)),
        None => dispatch!(level, simd => occluded::occluded(simd, mesh, segments, mask)),
    }
}

/// Returns the mask of the segments that an item occludes, among those in `mask`. `bounds` returns an item's bounds, or
/// `None` if the item occludes nothing. `visit` gets an item and the mask of the segments that hit the item's bounds,
/// and returns the mask of the segments that the item occludes.
pub fn occluded_items(
    level: Level,
    nodes: &[Node],
    segments: &Segments,
    mask: u32,
    bounds: impl Fn(usize) -> Option<Aabb>,
    visit: impl FnMut(usize, u32) -> u32,
) -> u32 {
    dispatch!(level, simd => occluded::items(simd, nodes, segments, mask, bounds, visit))
}

/// Returns the instruction sets that this processor supports.
#[cfg(test)]
pub(crate) fn levels() -> Vec<Level> {
    let best = Level::new();
    #[allow(unused_mut, reason = "changed only on x86")]
    let mut levels = vec![best];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(best.as_avx2().map(Level::Avx2));
        levels.extend(best.as_sse4_2().map(Level::Sse4_2));
        levels.extend(best.as_sse2().map(Level::Sse2));
    }
    levels
}

#[cfg(test)]
mod tests;
