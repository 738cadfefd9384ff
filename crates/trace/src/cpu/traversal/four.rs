//! Intersection of a ray with up to four triangles at once.

use fearless_simd::f32x4;
use fearless_simd::prelude::*;

use super::{Line, Mesh};

/// Up to four triangles of a leaf. Unused lanes repeat the last triangle.
pub struct Four<S: Simd> {
    corners: [[f32x4<S>; 3]; 3],
    /// Mask of the used lanes.
    used: u32,
}

impl<S: Simd> Four<S> {
    /// Loads one to four triangles.
    #[inline(always)]
    pub fn new(simd: S, mesh: &Mesh, triangles: &[[u32; 4]]) -> Four<S> {
        let last = triangles.len().min(4) - 1;
        let lanes = [0, 1.min(last), 2.min(last), last];
        let mut corners = [[f32x4::splat(simd, 0.0); 3]; 3];
        for (i, corner) in corners.iter_mut().enumerate() {
            let mut rows = [f32x4::splat(simd, 0.0); 4];
            for (row, lane) in rows.iter_mut().zip(lanes) {
                *row = f32x4::simd_from(simd, mesh.vertices[triangles[lane][i] as usize]);
            }
            let [a, b, c, d] = rows;
            let (low, high) = (a.zip_low(c), b.zip_low(d));
            *corner = [
                low.zip_low(high),
                low.zip_high(high),
                a.zip_high(c).zip_low(b.zip_high(d)),
            ];
        }
        Four {
            corners,
            used: (2 << last) - 1,
        }
    }

    /// See [`intersect`].
    #[inline(always)]
    pub fn intersect(&self, simd: S, line: &Line) -> (u32, f32x4<S>) {
        intersect(
            simd,
            line,
            self.used,
            #[inline(always)]
            |corner, axis| self.corners[corner][axis],
        )
    }
}

/// Returns the mask of the triangles that the ray hits, and the distances, like [`Line::triangle`] for each triangle.
/// Unlike there, hits may have negative distances, because boxes are padded. `coordinates(i, axis)` returns a
/// coordinate of corner i of each triangle. `used` is the mask of the used lanes.
#[inline(always)]
pub fn intersect<S: Simd>(
    simd: S,
    line: &Line,
    used: u32,
    coordinates: impl Fn(usize, usize) -> f32x4<S>,
) -> (u32, f32x4<S>) {
    let zero = f32x4::splat(simd, 0.0);
    // Written out, because a loop would keep the corners in memory.
    let corners = [
        corner(line, 0, &coordinates),
        corner(line, 1, &coordinates),
        corner(line, 2, &coordinates),
    ];
    let [a, b, c] = [
        sheared(line, corners[0]),
        sheared(line, corners[1]),
        sheared(line, corners[2]),
    ];
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let inside =
        (u.simd_ge(zero) & v.simd_ge(zero) & w.simd_ge(zero)) | (u.simd_le(zero) & v.simd_le(zero) & w.simd_le(zero));
    if inside.to_bitmask() as u32 & used == 0 {
        return (0, zero);
    }
    let determinant = u + v + w;
    let t = (u * (a[2] * line.shear[2]) + v * (b[2] * line.shear[2]) + w * (c[2] * line.shear[2])) / determinant;
    let (mut near, mut far) = (f32x4::splat(simd, f32::NEG_INFINITY), f32x4::splat(simd, f32::INFINITY));
    let [first_corner, second_corner, third_corner] = corners;
    for k in 0..3 {
        let (a, b, c) = (first_corner[k], second_corner[k], third_corner[k]);
        let first = (a.min(b).min(c) - line.o_low[k]) * line.inverse[k];
        let second = (a.max(b).max(c) - line.o_high[k]) * line.inverse[k];
        near = near.max(first.min(second));
        far = far.min(first.max(second));
    }
    // This order of operands preserves a NaN of `t`.
    let t = near.simd_gt(t).select(near, t);
    let t = far.simd_lt(t).select(far, t);
    let hits = inside & determinant.simd_ne(zero) & near.simd_le(far) & far.simd_ge(zero);
    (hits.to_bitmask() as u32 & used, t)
}

/// Returns corner i of each triangle, with the axes of the line.
#[inline(always)]
fn corner<S: Simd>(line: &Line, i: usize, coordinates: &impl Fn(usize, usize) -> f32x4<S>) -> [f32x4<S>; 3] {
    let [x, y, z] = line.axes;
    [coordinates(i, x), coordinates(i, y), coordinates(i, z)]
}

/// Returns corners relative to the origin, sheared so that the direction is the last axis, but not scaled.
#[inline(always)]
fn sheared<S: Simd>(line: &Line, corner: [f32x4<S>; 3]) -> [f32x4<S>; 3] {
    let [x, y, z] = [corner[0] - line.o[0], corner[1] - line.o[1], corner[2] - line.o[2]];
    [x - z * line.shear[0], y - z * line.shear[1], z]
}
