//! Twin of `shaders/warp.wgsl`.

use glam::{Vec2, Vec3};

use super::math::max;
use super::primitive::Tangents;

#[expect(
    clippy::approx_constant,
    clippy::excessive_precision,
    reason = "coefficients as the WGSL has them"
)]
pub fn disk_sample(u: Vec2) -> Vec2 {
    let a = 2.0 * u.x - 1.0;
    let b = 2.0 * u.y - 1.0;
    let wide = a.abs() > b.abs();
    let r = if wide { a } else { b };
    let part = if wide { b } else { a } / if r == 0.0 { 1.0 } else { r };
    let p2 = part * part;
    let y_tail = 0.0024903945 - p2 * (0.000036576205 - p2 * 3.1336164e-7);
    let y = part * (0.785_398_2 - p2 * (0.080745511 - p2 * y_tail));
    let x_tail = 0.00032599189 - p2 * 3.5908605e-6;
    let x = 1.0 - p2 * (0.30842513 - p2 * (0.015854344 - p2 * x_tail));
    let unit = if wide { Vec2::new(x, y) } else { Vec2::new(y, x) };
    unit * r
}

pub fn triangle_sample(u: Vec2) -> Vec2 {
    let upper = u.y > u.x;
    let x = if upper { 0.5 * u.x } else { u.x - 0.5 * u.y };
    let y = if upper { u.y - 0.5 * u.x } else { 0.5 * u.y };
    Vec2::new(x, y)
}

pub fn frame_around(n: Vec3) -> Tangents {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    Tangents {
        u: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        v: Vec3::new(b, sign + n.y * n.y * a, -n.y),
    }
}

pub fn vector_around(n: Vec3, v: Vec3) -> Vec3 {
    let frame = frame_around(n);
    frame.u * v.x + frame.v * v.y + n * v.z
}

pub fn hemisphere_sample(n: Vec3, u: Vec2) -> Vec3 {
    let p = disk_sample(u);
    vector_around(n, p.extend(max(1.0 - p.x * p.x - p.y * p.y, 0.0).sqrt()))
}

pub fn cap_sample(p: Vec2, cap_height: f32) -> Vec3 {
    let h = (p.x * p.x + p.y * p.y) * cap_height;
    (p * max(cap_height * (2.0 - h), 0.0).sqrt()).extend(1.0 - h)
}
