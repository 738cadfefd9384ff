//! Twin of `shaders/footprint.wgsl`.

use glam::{Vec2, Vec3};

use super::math::{max, min};
use super::primitive::uv_derivative;
use super::ray::{point_to_local, vector_to_local};
use super::surface::Surface;
use crate::records::{CLAMP, Primitive, Texture};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    pub uv: Vec2,
    pub dx: Vec2,
    pub dy: Vec2,
}

pub fn surface_footprint(q: &Primitive, surface: Surface, dx: Vec3, dy: Vec3) -> Footprint {
    let local = point_to_local(q, surface.position);
    Footprint {
        uv: surface.uv,
        dx: uv_derivative(q, local, vector_to_local(q, dx)),
        dy: uv_derivative(q, local, vector_to_local(q, dy)),
    }
}

pub fn wrap_u(t: &Texture) -> u32 {
    t.wrap & 3
}

pub fn wrap_v(t: &Texture) -> u32 {
    t.wrap >> 2
}

pub fn texture_footprint(t: &Texture, f: Footprint) -> Footprint {
    let dx = Vec2::new(t.u.x * f.dx.x + t.u.y * f.dx.y, t.v.x * f.dx.x + t.v.y * f.dx.y);
    let dy = Vec2::new(t.u.x * f.dy.x + t.u.y * f.dy.y, t.v.x * f.dy.x + t.v.y * f.dy.y);
    let uv = Vec2::new(
        t.u.x * f.uv.x + t.u.y * f.uv.y + t.u.z,
        t.v.x * f.uv.x + t.v.y * f.uv.y + t.v.z,
    );
    let x = (wrap_u(t) == CLAMP) & ((uv.x < 0.0) | (uv.x > 1.0));
    let y = (wrap_v(t) == CLAMP) & ((uv.y < 0.0) | (uv.y > 1.0));
    let clamped = |d: Vec2| Vec2::new(if x { 0.0 } else { d.x }, if y { 0.0 } else { d.y });
    Footprint {
        uv,
        dx: clamped(dx),
        dy: clamped(dy),
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    pub m: Vec3,
    pub major: f32,
    pub minor: f32,
}

pub fn footprint_ellipse(dx: Vec2, dy: Vec2, anisotropy: f32) -> Ellipse {
    let p = dx.x * dx.x + dy.x * dy.x;
    let q = dx.x * dx.y + dy.x * dy.y;
    let r = dx.y * dx.y + dy.y * dy.y;
    let half = 0.5 * (p - r);
    let root = (half * half + q * q).sqrt();
    let large = 0.5 * (p + r) + root;
    let area = dx.x * dy.y - dx.y * dy.x;
    let lower_bound = large / (anisotropy * anisotropy);
    let small = min(max(area * area / max(large, 1e-30), lower_bound), large);
    let wide = half >= 0.0;
    let e = if wide {
        Vec2::new(half + root, q)
    } else {
        Vec2::new(q, root - half)
    };
    let e2 = e.x * e.x + e.y * e.y;
    let stretch = if e2 > 0.0 { (large - small) / e2 } else { 0.0 };
    let m = Vec3::new(
        small + stretch * (e.x * e.x),
        stretch * (e.x * e.y),
        small + stretch * (e.y * e.y),
    );
    Ellipse {
        m,
        major: large.sqrt(),
        minor: small.sqrt(),
    }
}
