//! Walks over a tree of boxes with triangles in its leaves: the nearest one that a ray meets, and which segments from a point are
//! hidden. The results are those of all triangles tested one by one ([`Line::triangle`]), whatever the tree is, for three reasons: a
//! triangle is only met where its own box is, a larger box is passed wherever a smaller one is since every step of the test is
//! monotone, and of equal distances the least number counts.
//!
//! Each function is compiled for several sets of instructions, and `fearless_simd` chooses among them; all give the same bits.
//! Nothing is contracted.
//!
//! Measured on an AMD EPYC with AVX-512, other work beside it, in processor time of one thread (a bumpy sphere of 70,000 triangles
//! on a floor, `benches/trees.rs`): 157 ns for a ray of the camera, 665 ns for 16 segments to a light. Plain loops over eight numbers
//! instead of `fearless_simd` made rays 8 % slower with AVX-512 and 30 % with AVX2.

mod closest;
mod four;
mod line;
mod occluded;

use std::ops::Range;

pub use fearless_simd::Level;
use fearless_simd::dispatch;
use glam::Vec3;

pub use self::line::Line;
use crate::bvh::{Aabb, Node};

/// Triangles below a tree.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// The tree's nodes.
    pub nodes: &'a [Node],
    /// Positions, each followed by a word of any meaning.
    pub vertices: &'a [[f32; 4]],
    /// In the order of the tree's leaves: the numbers of three vertices, and the triangle's own.
    pub triangles: &'a [[u32; 4]],
}

/// What a ray meets, or how far it is looked along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Along the ray, in lengths of its direction.
    pub t: f32,
    /// The triangle's own number.
    pub number: u32,
    /// The triangle's place in the order of the tree's leaves.
    pub slot: u32,
}

/// How far beyond `start` what is nearer than t can be: more than t - start by what the sum of both may be rounded.
pub fn limit_from(start: f32, t: f32) -> f32 {
    (t - start) + t * 4.7683716e-7
}

/// Finds the nearest triangle that is nearer than `best`, but for the one with the number `skip`. Distances are those from the line's
/// origin, 0 at least, plus `start`; they are above 0. Of several at the same place
/// it is the one with the least number.
pub fn closest(level: Level, mesh: &Mesh, line: &Line, start: f32, skip: u32, best: Nearest) -> Nearest {
    dispatch!(level, simd => closest::closest(simd, mesh, line, start, skip, best))
}

/// Whether a ray meets any triangle before `t_max` lengths of its direction, but for the one with the number `skip`.
pub fn any(level: Level, mesh: &Mesh, line: &Line, skip: u32, t_max: f32) -> bool {
    dispatch!(level, simd => closest::any(simd, mesh, line, skip, t_max))
}

/// Visits the leaves of a tree that a ray meets before `limit`, nearly in the order in which it does: `visit` is given a range of
/// the tree's order and the limit, and gives the limit from then on, which is not greater.
pub fn leaves(level: Level, nodes: &[Node], line: &Line, limit: f32, visit: impl FnMut(Range<usize>, f32) -> f32) {
    dispatch!(level, simd => closest::leaves(simd, nodes, line, limit, visit))
}

/// Segments at once, at most.
pub const MOST: usize = 32;

/// Up to 32 vectors, their x, y and z; the first stands in all places that are left.
#[derive(Clone, Debug)]
pub struct Directions {
    /// How many there are.
    pub count: usize,
    /// The components.
    pub along: [[f32; MOST]; 3],
}

impl Directions {
    /// These vectors, at most 32.
    pub fn new(vectors: &[Vec3]) -> Directions {
        let first = vectors.first().copied().unwrap_or(Vec3::Z);
        let mut directions = Directions {
            count: vectors.len().min(MOST),
            along: first.to_array().map(|x| [x; MOST]),
        };
        for (i, v) in vectors.iter().enumerate().take(MOST) {
            for k in 0..3 {
                directions.along[k][i] = v[k];
            }
        }
        directions
    }

    /// One of them.
    pub fn get(&self, i: usize) -> Vec3 {
        let [x, y, z] = &self.along;
        Vec3::new(x[i], y[i], z[i])
    }

    /// A bit for each.
    pub fn all(&self) -> u32 {
        ((1_u64 << self.count) - 1) as u32
    }
}

/// Up to 32 segments from one point.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    /// The point.
    pub o: Vec3,
    /// Boxes are tested as if they were larger by so much on all sides.
    pub pad: f32,
    /// From the point to the other ends.
    pub directions: &'a Directions,
    /// Triangles at so many lengths of the direction, or beyond, hide nothing.
    pub t_max: f32,
    /// The number of a triangle that hides nothing.
    pub skip: u32,
}

/// Which of some segments are hidden by a triangle, a bit for each; only those whose bits are in `asked`.
pub fn occluded(level: Level, mesh: &Mesh, segments: &Segments, asked: u32) -> u32 {
    dispatch!(level, simd => occluded::occluded(simd, mesh, segments, asked))
}

/// Visits the items below a tree whose boxes any of some segments pass: `boxes` gives the box of an item, or nothing if it
/// hides nothing; `visit` is given the item and the segments that pass its box, and says which of these are hidden. Says which of
/// all are.
pub fn occluded_items(
    level: Level,
    nodes: &[Node],
    segments: &Segments,
    asked: u32,
    boxes: impl Fn(usize) -> Option<Aabb>,
    visit: impl FnMut(usize, u32) -> u32,
) -> u32 {
    dispatch!(level, simd => occluded::items(simd, nodes, segments, asked, boxes, visit))
}

/// All levels of instructions that this machine has.
#[cfg(test)]
pub(crate) fn levels() -> Vec<Level> {
    let best = Level::new();
    #[allow(unused_mut, reason = "not all machines have several")]
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
