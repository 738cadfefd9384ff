//! Twin of `shaders/light_sample.wgsl`.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::cylinder::cylinder_levels;
use super::ellipsoid::{ellipsoid_discriminant, ellipsoid_level};
use super::lanes::{Real, Vector3, constant, select};
use super::math::{atan2, dot, max, min, normalize, sine};
use super::ray::{vector_to_local, vector_to_world};
use super::warp::{cap_sample, disk_sample, vector_around};
use crate::records::Primitive;

#[inline(always)]
pub fn solid_angle_pdf<V: Vector3>(density: V::Real, to_light: V, normal: V) -> V::Real {
    let d2 = dot(to_light, to_light);
    density * d2 * d2.sqrt() / dot(normal, to_light).abs()
}

pub fn ellipsoid_area(q: &Primitive) -> f32 {
    7.255_197_5 * (dot(q.x, q.x) + dot(q.y, q.y) + dot(q.z, q.z)).sqrt() / q.determinant.abs()
}

pub fn ellipsoid_cap(level: f32) -> f32 {
    let sine2 = 1.0 / (1.0 + level);
    if level > 0.0 {
        sine2 / (1.0 + max(1.0 - sine2, 0.0).sqrt())
    } else {
        2.0
    }
}

pub fn ellipsoid_sample(q: &Primitive, p: Vec3, u: Vec2) -> Vec3 {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let level = ellipsoid_level(q, from_anchor);
    let axis = if level > 0.0 { -normalize(o) } else { Vec3::Z };
    let direction = normalize(vector_around(axis, cap_sample(disk_sample(u), ellipsoid_cap(level))));
    let b = dot(o, direction);
    let root = max(ellipsoid_discriminant(o, direction, level), 0.0).sqrt();
    let t = if level > 0.0 {
        level / (root - b)
    } else if b > 0.0 {
        -level / (b + root)
    } else {
        root - b
    };
    vector_to_world(q, direction * t)
}

pub fn ellipsoid_pdf(q: &Primitive, p: Vec3, wi: Vec3) -> f32 {
    let cap = ellipsoid_cap(ellipsoid_level(q, vector_to_local(q, p - q.anchor)));
    let l = vector_to_local(q, wi);
    let l2 = dot(l, l);
    0.159_154_94 / cap * q.determinant.abs() / (l2 * l2.sqrt())
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderPart {
    pub arc: f32,
    pub middle: Vec2,
    pub side: f32,
    pub end: f32,
    pub start: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderPoint {
    pub to: Vec3,
    pub normal: Vec3,
}

pub fn cylinder_part(q: &Primitive, o: Vec3, levels: Vec2) -> CylinderPart {
    let inside = (levels.x <= 0.0) & (levels.y <= 0.0);
    let r2 = o.x * o.x + o.y * o.y;
    let direction = Vec2::new(o.x, o.y) / r2.sqrt();
    let arc = if inside {
        1.0
    } else if levels.x > 0.0 {
        max(atan2(max(levels.x, 0.0).sqrt(), 1.0) * FRAC_1_PI, 1e-6)
    } else {
        0.0
    };
    let is_beyond = levels.y > 0.0;
    let end = inside | (is_beyond & (o.z > 0.0));
    let start = inside | (is_beyond & !(o.z > 0.0));
    CylinderPart {
        arc,
        middle: if r2 > 0.0 { direction } else { Vec2::X },
        side: 4.0 * arc * cylinder_height_ratio(q),
        end: f32::from(u8::from(end)),
        start: f32::from(u8::from(start)),
    }
}

pub fn cylinder_height_ratio(q: &Primitive) -> f32 {
    (dot(q.x, q.x) / dot(q.z, q.z)).sqrt()
}

pub fn cylinder_sample(q: &Primitive, p: Vec3, u: Vec2) -> CylinderPoint {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let o = from_anchor - q.middle;
    let part = cylinder_part(q, o, cylinder_levels(q, from_anchor));
    let caps = part.end + part.start;
    let area = u.x * (part.side + caps);
    let (local, gradient) = if (area < part.side) | (caps == 0.0) {
        let angle = (2.0 * min(area / part.side, 1.0) - 1.0) * part.arc;
        let (sn, cs) = (sine(angle), sine(angle + 0.5));
        let m = part.middle;
        let (x, y) = (m.x * cs - m.y * sn, m.y * cs + m.x * sn);
        (Vec3::new(x, y, 2.0 * u.y - 1.0), Vec3::new(x, y, 0.0))
    } else {
        let cap_area = area - part.side;
        let on_end = cap_area < part.end;
        let disk = disk_sample(Vec2::new(min(cap_area - if on_end { 0.0 } else { part.end }, 1.0), u.y));
        let up = if on_end { 1.0 } else { -1.0 };
        (Vec3::new(disk.x, disk.y, up), Vec3::new(0.0, 0.0, up))
    };
    CylinderPoint {
        to: vector_to_world(q, local - o),
        normal: normalize(q.x * gradient.x + q.y * gradient.y + q.z * gradient.z),
    }
}

pub fn cylinder_share(q: &Primitive, p: Vec3) -> f32 {
    let from_anchor = vector_to_local(q, p - q.anchor);
    let part = cylinder_part(q, from_anchor - q.middle, cylinder_levels(q, from_anchor));
    (4.0 * cylinder_height_ratio(q) + 2.0) / (part.side + part.end + part.start)
}

#[inline(always)]
pub fn power_heuristic<F: Real>(pdf: F, other_pdf: F) -> F {
    let ratio = other_pdf / pdf;
    let weight = constant(1.0) / (constant(1.0) + ratio * ratio);
    select(pdf.splat(0.0), weight, pdf.gt(pdf.splat(0.0)))
}

pub fn uniform_below(bits: u32, count: u32) -> u32 {
    ((u64::from(bits) * u64::from(count)) >> 32) as u32
}
