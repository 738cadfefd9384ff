//! A ray with precomputed values for tests against boxes and triangles.

use glam::Vec3;

use super::box_ray::BoxRay;

/// Minimum magnitude of direction components in box tests, so that reciprocals are finite.
pub const MIN_COMPONENT: f32 = f32::from_bits((127 - 100) << 23);

/// A ray with precomputed values that box and triangle tests share.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Permutation of the axes, applied to all other fields; the direction's largest component comes last.
    pub axes: [usize; 3],
    pub o: [f32; 3],
    /// Origin for tests of lower sides, offset to pad the boxes.
    pub o_low: [f32; 3],
    /// Origin for tests of upper sides, offset to pad the boxes.
    pub o_high: [f32; 3],
    pub inverse: [f32; 3],
    /// Shear and scale that map the direction to the last axis.
    pub shear: [f32; 3],
}

/// Returns `x`, with a magnitude of at least [`MIN_COMPONENT`].
#[inline(always)]
pub fn away_from_zero(x: f32) -> f32 {
    match () {
        _ if x.abs() >= MIN_COMPONENT => x,
        _ if x < 0.0 => -MIN_COMPONENT,
        _ => MIN_COMPONENT,
    }
}

/// Returns the permutation of axes whose last axis is that of the largest component of `d`.
#[inline(always)]
pub fn axes(d: Vec3) -> [usize; 3] {
    let [x, y, z] = d.abs().to_array();
    let third = match () {
        _ if x >= y && x >= z => 0,
        _ if y >= z => 1,
        _ => 2,
    };
    axes_from(third)
}

/// Returns the cyclic permutation that ends with an axis.
#[inline(always)]
pub fn axes_from(third: usize) -> [usize; 3] {
    [(third + 1) % 3, (third + 2) % 3, third]
}

impl Line {
    /// Creates a ray from `o` along `d`, which may have any length. Box tests enlarge boxes by `pad`.
    #[inline(always)]
    pub fn new(o: Vec3, d: Vec3, pad: f32) -> Line {
        Line::with_box_ray(o, d, pad).0
    }

    /// Creates a ray like [`new`](Self::new), also in the form for tests of single boxes.
    #[inline(always)]
    pub fn with_box_ray(o: Vec3, d: Vec3, pad: f32) -> (Line, BoxRay) {
        let axes = axes(d);
        let low = [o.x + pad, o.y + pad, o.z + pad];
        let high = [o.x - pad, o.y - pad, o.z - pad];
        let inverse = [
            1.0 / away_from_zero(d.x),
            1.0 / away_from_zero(d.y),
            1.0 / away_from_zero(d.z),
        ];
        let d = in_order(d.as_ref(), axes);
        let line = Line {
            axes,
            o: in_order(o.as_ref(), axes),
            o_low: in_order(&low, axes),
            o_high: in_order(&high, axes),
            inverse: in_order(&inverse, axes),
            shear: [d[0] / d[2], d[1] / d[2], 1.0 / d[2]],
        };
        (line, BoxRay::new(low, high, inverse))
    }

    /// Returns the ray's interval inside a box, whose coordinates are permuted by `self.axes`.
    #[inline(always)]
    pub fn slab(&self, low: [f32; 3], high: [f32; 3]) -> [f32; 2] {
        let mut interval = [f32::NEG_INFINITY, f32::INFINITY];
        for k in 0..3 {
            let a = (low[k] - self.o_low[k]) * self.inverse[k];
            let b = (high[k] - self.o_high[k]) * self.inverse[k];
            interval = [maximum(interval[0], minimum(a, b)), minimum(interval[1], maximum(a, b))];
        }
        interval
    }

    /// Returns a vertex relative to the origin, sheared so that the direction is the last axis.
    #[inline(always)]
    fn sheared(&self, v: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = [v[0] - self.o[0], v[1] - self.o[1], v[2] - self.o[2]];
        [x - self.shear[0] * z, y - self.shear[1] * z, self.shear[2] * z]
    }

    /// Returns the barycentric coordinates of the second and the third vertex where the ray hits the triangle.
    #[inline(always)]
    pub fn barycentric<const N: usize>(&self, vertices: [&[f32; N]; 3]) -> [f32; 2] {
        let [a, b, c] = [
            self.sheared(in_order(vertices[0], self.axes)),
            self.sheared(in_order(vertices[1], self.axes)),
            self.sheared(in_order(vertices[2], self.axes)),
        ];
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let sum = u + v + w;
        [v / sum, w / sum]
    }

    /// Returns the distance of the hit with a triangle, if any (Woop, Benthin and Wald, "Watertight Ray/Triangle
    /// Intersection", JCGT 2(1), 2013). Hits outside the triangle's box do not count.
    #[inline(always)]
    pub fn triangle(&self, vertices: [&[f32; 4]; 3]) -> Option<f32> {
        let corners = [
            in_order(vertices[0], self.axes),
            in_order(vertices[1], self.axes),
            in_order(vertices[2], self.axes),
        ];
        let [a, b, c] = [
            self.sheared(corners[0]),
            self.sheared(corners[1]),
            self.sheared(corners[2]),
        ];
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
        let determinant = u + v + w;
        if !inside || determinant == 0.0 {
            return None;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) / determinant;
        let [mut low, mut high] = [corners[0]; 2];
        for corner in &corners[1..] {
            for k in 0..3 {
                low[k] = minimum(low[k], corner[k]);
                high[k] = maximum(high[k], corner[k]);
            }
        }
        let [near, far] = self.slab(low, high);
        // This order of operands preserves a NaN of `t`.
        let t = minimum(far, maximum(near, t));
        (near <= far && t > 0.0).then_some(t)
    }
}

#[inline(always)]
pub fn in_order<const N: usize>(v: &[f32; N], axes: [usize; 3]) -> [f32; 3] {
    [v[axes[0]], v[axes[1]], v[axes[2]]]
}

/// Returns the minimum; `b` if either number is NaN.
#[inline(always)]
pub fn minimum(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Returns the maximum; `b` if either number is NaN.
#[inline(always)]
pub fn maximum(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
