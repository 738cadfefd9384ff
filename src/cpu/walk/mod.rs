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
mod hidden;
mod line;

use std::ops::Range;

pub use fearless_simd::Level;
use fearless_simd::dispatch;
use glam::Vec3;

pub use self::line::Line;
use crate::pack::tree::Node;

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

/// Visits the leaves of a tree that a ray meets before `limit`, nearly in the order in which it does: `visit` is given a range of
/// the tree's order and the limit, and gives the limit from then on, which is not greater.
pub fn leaves(level: Level, nodes: &[Node], line: &Line, limit: f32, visit: impl FnMut(Range<usize>, f32) -> f32) {
    dispatch!(level, simd => closest::leaves(simd, nodes, line, limit, visit))
}

/// Up to 32 segments from one point.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    /// The point.
    pub o: Vec3,
    /// Boxes are tested as if they were larger by so much on all sides.
    pub pad: f32,
    /// From the point to the other ends, at most 32.
    pub directions: &'a [Vec3],
    /// Triangles at so many lengths of the direction, or beyond, hide nothing.
    pub reach: f32,
    /// The number of a triangle that hides nothing.
    pub skip: u32,
}

/// Which of some segments are hidden by a triangle, a bit for each; only those whose bits are in `asked`.
pub fn hidden(level: Level, mesh: &Mesh, segments: &Segments, asked: u32) -> u32 {
    dispatch!(level, simd => hidden::hidden(simd, mesh, segments, asked))
}

/// Visits the leaves of a tree that any of some segments meet: `visit` is given a range of the tree's order and the segments that
/// meet its box, and says which of these are hidden. Says which of all are.
pub fn hidden_leaves(
    level: Level,
    nodes: &[Node],
    segments: &Segments,
    asked: u32,
    visit: impl FnMut(Range<usize>, u32) -> u32,
) -> u32 {
    dispatch!(level, simd => hidden::leaves(simd, nodes, segments, asked, visit))
}

#[cfg(test)]
mod tests;
