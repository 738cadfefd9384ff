//! Twin of `shaders/warp.wgsl`.

use super::lanes::{Real, Vector2, Vector3, constant, select};
use super::math::max;
use super::primitive::Tangents;

#[expect(
    clippy::approx_constant,
    clippy::excessive_precision,
    reason = "coefficients are written as in WGSL"
)]
#[inline(always)]
pub fn disk_sample<V: Vector2>(u: V) -> V {
    let a = constant(2.0) * u.x() - 1.0;
    let b = constant(2.0) * u.y() - 1.0;
    let wide = a.abs().gt(b.abs());
    let r = select(b, a, wide);
    let part = select(a, b, wide) / select(r, r.splat(1.0), r.eq(r.splat(0.0)));
    let p2 = part * part;
    let y_tail = constant(0.0024903945) - p2 * (constant(0.000036576205) - p2 * 3.1336164e-7);
    let y = part * (constant(0.785_398_2) - p2 * (constant(0.080745511) - p2 * y_tail));
    let x_tail = constant(0.00032599189) - p2 * 3.5908605e-6;
    let x = constant(1.0) - p2 * (constant(0.30842513) - p2 * (constant(0.015854344) - p2 * x_tail));
    V::new(select(y, x, wide), select(x, y, wide)) * r
}

#[inline(always)]
pub fn triangle_sample<V: Vector2>(u: V) -> V {
    let upper = u.y().gt(u.x());
    let x = select(u.x() - constant(0.5) * u.y(), constant(0.5) * u.x(), upper);
    let y = select(constant(0.5) * u.y(), u.y() - constant(0.5) * u.x(), upper);
    V::new(x, y)
}

#[inline(always)]
pub fn frame_around<V: Vector3>(n: V) -> Tangents<V> {
    let (x, y, z) = (n.x(), n.y(), n.z());
    let sign = select(z.splat(-1.0), z.splat(1.0), z.ge(z.splat(0.0)));
    let a = constant(-1.0) / (sign + z);
    let b = x * y * a;
    Tangents {
        u: V::new(constant(1.0) + sign * x * x * a, sign * b, -sign * x),
        v: V::new(b, sign + y * y * a, -y),
    }
}

#[inline(always)]
pub fn vector_around<V: Vector3>(n: V, v: V) -> V {
    let frame = frame_around(n);
    frame.u * v.x() + frame.v * v.y() + n * v.z()
}

#[inline(always)]
pub fn hemisphere_sample<V: Vector3>(n: V, u: <V::Real as Real>::Vec2) -> V {
    let p = disk_sample(u);
    let (x, y) = (p.x(), p.y());
    let height2 = constant(1.0) - x * x - y * y;
    vector_around(n, V::new(x, y, max(height2, height2.splat(0.0)).sqrt()))
}

#[inline(always)]
pub fn cap_sample<V: Vector2>(p: V, cap_height: V::Real) -> <V::Real as Real>::Vec3 {
    let h = (p.x() * p.x() + p.y() * p.y()) * cap_height;
    let q = p * max(cap_height * (constant(2.0) - h), h.splat(0.0)).sqrt();
    Vector3::new(q.x(), q.y(), constant(1.0) - h)
}
