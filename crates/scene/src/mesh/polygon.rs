//! Triangulation of polygons.
//!
//! Readers store each polygon as a fan of triangles from its first corner. If the fan extends outside of the polygon,
//! ear clipping in the polygon's plane replaces the triangles. The normal of the plane is Newell's normal, the sum of
//! the fan's cross products (Tampieri, "Newell's Method for Computing the Plane Equation of a Polygon", Graphics Gems
//! III, 1992).

use earcut::Earcut;
use glam::DVec3;
use rayon::prelude::*;

use super::raw_mesh::{RawMesh, counted};

/// Maximum area of a kept fan outside of its polygon, relative to the polygon's area.
const AREA_TOLERANCE: f64 = 1e-6;
/// Maximum deviation of a planar polygon's corners from the plane, relative to the distance of the farthest corner.
const PLANE_TOLERANCE: f64 = 0.05;
/// Maximum length of Newell's normal of a polygon whose signed areas cancel, relative to the root of the sum of the
/// squared cross products of the fan.
const CANCELLATION: f64 = 1e-6;
/// Maximum number of corners for ear clipping, which takes quadratic time at worst.
const MAX_CORNERS: usize = 1 << 14;

/// A polygon of four corners or more, as a fan among the triangles of a [`RawMesh`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    /// The fan's first triangle.
    pub first: u32,
    /// Number of triangles of the fan.
    pub count: u32,
}

/// Properties of a polygon that determine the triangulation.
struct PolygonTraits {
    normal: DVec3,
    /// A corner has a non-finite position.
    is_damaged: bool,
    /// The fan extends outside of the polygon.
    is_concave: bool,
    /// The signed areas of the fan's triangles cancel, so the polygon has no plane.
    cancels: bool,
    is_planar: bool,
}

/// Replaces the fans of concave polygons, and adds notes about polygons without a unique triangulation.
pub(super) fn triangulate(raw: &mut RawMesh) {
    let all_traits: Vec<PolygonTraits> = (raw.polygons.par_iter())
        .map(|polygon| polygon_traits(fan(&raw.triangles, polygon), &raw.positions))
        .collect();
    let mut clipper = Clipper::default();
    let (mut non_planar, mut self_intersecting, mut too_large) = (0, 0, 0);
    for (polygon, traits) in raw.polygons.iter().zip(&all_traits) {
        let (first, count) = (polygon.first as usize, polygon.count as usize);
        let fan = &mut raw.triangles[first..first + count];
        non_planar += usize::from(!traits.is_planar);
        if traits.is_damaged {
            mark_damaged(fan, &raw.positions);
        } else if traits.cancels {
            self_intersecting += 1;
        } else if traits.is_concave && count + 2 > MAX_CORNERS {
            too_large += 1;
        } else if traits.is_concave && !clipper.clip(fan, traits.normal, &raw.positions) {
            self_intersecting += 1;
        }
    }
    let notes = [
        (
            non_planar,
            "polygon is not planar; split into triangles",
            "polygons are not planar; split into triangles",
        ),
        (
            self_intersecting,
            "polygon intersects itself; split into a triangle fan",
            "polygons intersect themselves; split into triangle fans",
        ),
        (
            too_large,
            "concave polygon has more than 16384 corners; split into a triangle fan",
            "concave polygons have more than 16384 corners; split into triangle fans",
        ),
    ];
    let notes = notes.into_iter().filter(|(count, ..)| *count > 0);
    raw.notes
        .extend(notes.map(|(count, singular, plural)| counted(count, singular, plural)));
}

fn fan<'a>(triangles: &'a [[u32; 3]], polygon: &Polygon) -> &'a [[u32; 3]] {
    &triangles[polygon.first as usize..][..polygon.count as usize]
}

fn polygon_traits(fan: &[[u32; 3]], positions: &[DVec3]) -> PolygonTraits {
    let first = positions[fan[0][0] as usize];
    let from_first = |vertex: u32| positions[vertex as usize] - first;
    let cross = |[_, a, b]: &[u32; 3]| from_first(*a).cross(from_first(*b));
    let normal: DVec3 = fan.iter().map(cross).sum();
    let squares: f64 = fan.iter().map(|triangle| cross(triangle).length_squared()).sum();
    let outside: f64 = fan.iter().map(|triangle| cross(triangle).dot(normal).min(0.0)).sum();
    let square = normal.length_squared();
    let corners = || fan.iter().flat_map(|[_, a, b]| [*a, *b]).map(from_first);
    let farthest = corners().map(DVec3::length_squared).fold(0.0, f64::max);
    let (low, high) = corners()
        .map(|corner| corner.dot(normal))
        .fold((0.0_f64, 0.0_f64), |(low, high), height| {
            (low.min(height), high.max(height))
        });
    PolygonTraits {
        normal,
        is_damaged: !first.is_finite() || corners().any(|corner| !corner.is_finite()),
        is_concave: outside < -AREA_TOLERANCE * square,
        cancels: squares > 0.0 && square <= CANCELLATION * CANCELLATION * squares,
        is_planar: !((high - low).powi(2) > PLANE_TOLERANCE * PLANE_TOLERANCE * square * farthest),
    }
}

/// Makes all triangles of a fan refer to a corner with a non-finite position, so that the entire face is removed.
fn mark_damaged(fan: &mut [[u32; 3]], positions: &[DVec3]) {
    let is_invalid = |vertex: &u32| !positions[*vertex as usize].is_finite();
    if let Some(invalid) = fan.iter().flatten().copied().find(is_invalid) {
        fan.fill([invalid; 3]);
    }
}

#[derive(Default)]
struct Clipper {
    earcut: Earcut<f64>,
    corners: Vec<u32>,
    points: Vec<[f64; 2]>,
    indices: Vec<u32>,
}

impl Clipper {
    /// Replaces a fan by the result of ear clipping. Returns false if the polygon intersects itself: then the triangles
    /// do not cover the area of the polygon exactly.
    fn clip(&mut self, fan: &mut [[u32; 3]], normal: DVec3, positions: &[DVec3]) -> bool {
        self.corners.clear();
        self.corners.extend([fan[0][0], fan[0][1]]);
        self.corners.extend(fan.iter().map(|[_, _, last]| *last));
        let normal = normal.normalize();
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        let first = positions[fan[0][0] as usize];
        self.points.clear();
        self.points.extend(self.corners.iter().map(|corner| {
            let p = positions[*corner as usize] - first;
            [p.dot(u), p.dot(v)]
        }));
        self.earcut.earcut_slice(&self.points, &[], &mut self.indices);
        if self.indices.is_empty() {
            return false;
        }
        let point = |i: u32| self.points[i as usize];
        let mut covered = 0.0;
        let mut clipped = self.indices.chunks_exact(3).map(|triangle| {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
            let area = area(point(a), point(b), point(c));
            covered += area.abs();
            // Reorders the corners to counter-clockwise, the winding of the polygon.
            let ordered = if area < 0.0 { [a, c, b] } else { [a, b, c] };
            ordered.map(|i| self.corners[i as usize])
        });
        let unused = [fan[0][0]; 3];
        for triangle in fan.iter_mut() {
            *triangle = clipped.next().unwrap_or(unused);
        }
        let total: f64 = (1..self.points.len() - 1)
            .map(|i| area(self.points[0], self.points[i], self.points[i + 1]))
            .sum();
        (covered - total).abs() <= AREA_TOLERANCE * total
    }
}

/// Returns twice the signed area of a triangle.
fn area([ax, ay]: [f64; 2], [bx, by]: [f64; 2], [cx, cy]: [f64; 2]) -> f64 {
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
}
