//! Twin of `shaders/mesh.wgsl`.

use glam::{UVec2, Vec2, Vec3, Vec4};

use super::differential::{Differential, HitDifferential, transferred};
use super::footprint::Footprint;
use super::lanes::{Real, Vector3, constant, select};
use super::math::{cross, dot, max, max4, min, normalize, positive_zero};
use super::primitive::Tangents;
use super::ray::{Hit, Ray, point_to_local, vector_to_local};
use super::slab::{Slabs, box_interval, interval_hits};
use super::surface::{Surface, largest, with_positive_zeros};
use crate::records::{BOX_PAD, FirstHit, INFINITE_T, Instance, Primitive, TRIANGLE};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shear {
    pub axis: u32,
    pub slope: Vec2,
    pub scale: f32,
}

pub fn shear_of(direction: Vec3) -> Shear {
    let size = direction.abs();
    let axis = match (size.x >= size.y) & (size.x >= size.z) {
        true => 0,
        false if size.y >= size.z => 1,
        false => 2,
    };
    let d = permuted(direction, axis);
    Shear {
        axis,
        slope: Vec2::new(d.x / d.z, d.y / d.z),
        scale: 1.0 / d.z,
    }
}

pub fn permuted(v: Vec3, axis: u32) -> Vec3 {
    match axis {
        0 => Vec3::new(v.y, v.z, v.x),
        1 => Vec3::new(v.z, v.x, v.y),
        _ => v,
    }
}

pub fn sheared(v: Vec3, shear: Shear) -> Vec3 {
    let p = permuted(v, shear.axis);
    Vec3::new(p.x - shear.slope.x * p.z, p.y - shear.slope.y * p.z, shear.scale * p.z)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    pub is_hit: bool,
    pub t: f32,
    pub barycentric: Vec2,
}

pub fn triangle_crossing(v0: Vec3, v1: Vec3, v2: Vec3, origin: Vec3, shear: Shear, s: Slabs) -> Crossing {
    let a = sheared(v0 - origin, shear);
    let b = sheared(v1 - origin, shear);
    let c = sheared(v2 - origin, shear);
    let u = c.x * b.y - c.y * b.x;
    let v = a.x * c.y - a.y * c.x;
    let w = b.x * a.y - b.y * a.x;
    let sum = u + v + w;
    let inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0));
    let t = (u * a.z + v * b.z + w * c.z) / sum;
    let interval = box_interval(lowest(v0, v1, v2), highest(v0, v1, v2), s);
    let is_hit = inside & (sum.abs() > 0.0) & interval_hits(interval, INFINITE_T);
    Crossing {
        is_hit,
        t: min(interval.y, max(interval.x, t)),
        barycentric: Vec2::new(v / sum, w / sum),
    }
}

pub fn lowest(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    Vec3::new(
        min(min(a.x, b.x), c.x),
        min(min(a.y, b.y), c.y),
        min(min(a.z, b.z), c.z),
    )
}

pub fn highest(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    Vec3::new(
        max(max(a.x, b.x), c.x),
        max(max(a.y, b.y), c.y),
        max(max(a.z, b.z), c.z),
    )
}

pub fn point_to_mesh(i: &Instance, p: Vec3) -> Vec3 {
    vector_to_mesh(i, p - i.anchor)
}

pub fn vector_to_mesh(i: &Instance, v: Vec3) -> Vec3 {
    Vec3::new(dot(i.x, v), dot(i.y, v), dot(i.z, v))
}

pub fn vector_from_mesh(i: &Instance, v: Vec3) -> Vec3 {
    i.u * v.x + i.v * v.y + i.w * v.z
}

pub fn normal_from_mesh(i: &Instance, n: Vec3) -> Vec3 {
    let v = i.x * n.x + i.y * n.y + i.z * n.z;
    let scaled = v / max(largest(v), f32::MIN_POSITIVE);
    scaled / max(dot(scaled, scaled), 0.5).sqrt()
}

pub fn mesh_pad(i: &Instance, origin: Vec3) -> f32 {
    BOX_PAD * (largest(origin) + i.size)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitPrimitive {
    pub primitive: Primitive,
    pub edge_1: Vec3,
    pub edge_2: Vec3,
    pub uv_0: Vec2,
    pub uv_1: Vec2,
    pub uv_2: Vec2,
    pub normal_0: Vec3,
    pub normal_1: Vec3,
    pub normal_2: Vec3,
    pub tangents_0: Tangents,
    pub tangents_1: Tangents,
    pub tangents_2: Tangents,
    pub anchor: Vec3,
    pub condition_number: f32,
}

pub fn standalone_hit_primitive(q: &Primitive) -> HitPrimitive {
    HitPrimitive {
        primitive: *q,
        edge_1: Vec3::ZERO,
        edge_2: Vec3::ZERO,
        uv_0: Vec2::ZERO,
        uv_1: Vec2::ZERO,
        uv_2: Vec2::ZERO,
        normal_0: Vec3::ZERO,
        normal_1: Vec3::ZERO,
        normal_2: Vec3::ZERO,
        tangents_0: Tangents::default(),
        tangents_1: Tangents::default(),
        tangents_2: Tangents::default(),
        anchor: Vec3::ZERO,
        condition_number: 0.0,
    }
}

pub fn face_primitive(i: &Instance, v0: Vec3, edge_1: Vec3, edge_2: Vec3, material: u32) -> Primitive {
    let min_positive = f32::MIN_POSITIVE;
    let scaled_normal = cross(
        edge_1 / max(largest(edge_1), min_positive),
        edge_2 / max(largest(edge_2), min_positive),
    );
    let is_valid = dot(scaled_normal, scaled_normal) > 1e-30;
    let normal = if is_valid { normalize(scaled_normal) } else { Vec3::Z } * i.side;
    let area = dot(cross(edge_1, edge_2), normal);
    let determinant = if area.abs() > min_positive { area } else { min_positive };
    let anchor = i.anchor + vector_from_mesh(i, v0);
    Primitive {
        anchor,
        material,
        x: cross(edge_2, normal) / determinant,
        shape: i.shape,
        y: cross(normal, edge_1) / determinant,
        kind: TRIANGLE,
        z: normal,
        determinant: 1.0 / determinant,
        middle: Vec3::ZERO,
        level: 0.0,
    }
}

pub fn face_surface(face: &HitPrimitive, prim_id: UVec2, b: Vec2, d: Vec3, epsilon: f32) -> Surface {
    let q = &face.primitive;
    let from_anchor = face.edge_1 * b.x + face.edge_2 * b.y;
    let position = q.anchor + from_anchor;
    let side = if dot(q.z, d) > 0.0 { -1.0 } else { 1.0 };
    let normal = q.z * side;
    let edge = max(
        max(largest(face.edge_1), largest(face.edge_2)),
        largest(face.edge_2 - face.edge_1),
    );
    let size = max(max(largest(position), largest(position - face.anchor)), 0.25 * edge)
        * max(1.0, 0.125 * face.condition_number);
    let ray_origin = position + (normal - d) * (epsilon * size);
    let tangents = face_frame(face, b);
    let smooth_normal = face_normal(face, b) * side;
    Surface {
        position,
        normal,
        smooth_normal,
        shading_normal: smooth_normal,
        wo: -d,
        ray_origin,
        terminator_offset: face_terminator_offset(face, b, side),
        side,
        exclude_front: prim_id,
        exclude_back: prim_id,
        uv: face_uv(face, b),
        du: tangents.u,
        dv: tangents.v,
    }
}

pub fn face_uv(face: &HitPrimitive, b: Vec2) -> Vec2 {
    face.uv_0 + (face.uv_1 - face.uv_0) * b.x + (face.uv_2 - face.uv_0) * b.y
}

pub fn color_between(c0: Vec4, c1: Vec4, c2: Vec4, b: Vec2) -> Vec4 {
    max4(c0 + (c1 - c0) * b.x + (c2 - c0) * b.y, Vec4::ZERO)
}

pub fn face_normal(face: &HitPrimitive, b: Vec2) -> Vec3 {
    let n = face.normal_0 * (1.0 - b.x - b.y) + face.normal_1 * b.x + face.normal_2 * b.y;
    let length2 = dot(n, n);
    let unit = n / max(length2, 1e-12).sqrt();
    if length2 > 1e-12 {
        flipped_to(unit, face.primitive.z)
    } else {
        face.primitive.z
    }
}

#[inline(always)]
pub fn flipped_to<V: Vector3>(v: V, side: V) -> V {
    let cosine = dot(v, side);
    v * select(cosine.splat(1.0), cosine.splat(-1.0), cosine.lt(cosine.splat(0.0)))
}

pub fn face_terminator_offset(face: &HitPrimitive, b: Vec2, side: f32) -> Vec3 {
    let p = face.edge_1 * b.x + face.edge_2 * b.y;
    let up = face.primitive.z * side;
    let lift_0 = lift(flipped_to(face.normal_0, up), p, up);
    let lift_1 = lift(flipped_to(face.normal_1, up), p - face.edge_1, up);
    let lift_2 = lift(flipped_to(face.normal_2, up), p - face.edge_2, up);
    lift_0 * (1.0 - b.x - b.y) + lift_1 * b.x + lift_2 * b.y
}

#[inline(always)]
pub fn lift<V: Vector3>(n: V, from_vertex: V, up: V) -> V {
    let cosine = dot(n, up);
    let zero = cosine.splat(0.0);
    n * select(zero, max(-dot(n, from_vertex), zero), cosine.gt(cosine.splat(0.8)))
}

#[inline(always)]
pub fn face_direction_allowed<V: Vector3>(
    face: &HitPrimitive,
    surface: &Surface,
    direction: V,
) -> <V::Real as Real>::Mask {
    let fall = -dot(direction.broadcast(surface.normal), direction);
    let (zero, one) = (fall.splat(0.0), fall.splat(1.0));
    let height = dot(surface.normal, surface.terminator_offset);
    let lifted = direction.broadcast(surface.position + surface.terminator_offset);
    let crossing = lifted + direction * (constant(height) / max(fall, fall.splat(1e-30)));
    let b = point_to_local(&face.primitive, crossing);
    fall.le(zero) | b.x().lt(zero) | b.y().lt(zero) | (b.x() + b.y()).gt(one)
}

pub fn face_tangents(face: &HitPrimitive) -> Tangents {
    let a = face.uv_1 - face.uv_0;
    let b = face.uv_2 - face.uv_0;
    let area = a.x * b.y - a.y * b.x;
    let is_valid = area.abs() > 1e-30;
    let scale = 1.0 / if is_valid { area } else { 1.0 };
    let u = (face.edge_1 * b.y - face.edge_2 * a.y) * scale;
    let v = (face.edge_2 * a.x - face.edge_1 * b.x) * scale;
    Tangents {
        u: if is_valid { u } else { face.edge_1 },
        v: if is_valid {
            v
        } else {
            cross(face.primitive.z, face.edge_1)
        },
    }
}

pub fn face_frame(face: &HitPrimitive, b: Vec2) -> Tangents {
    let a = 1.0 - b.x - b.y;
    let u = face.tangents_0.u * a + face.tangents_1.u * b.x + face.tangents_2.u * b.y;
    let v = face.tangents_0.v * a + face.tangents_1.v * b.x + face.tangents_2.v * b.y;
    let has_tangents = (largest(u) > 1e-12) & (largest(v) > 1e-12);
    if has_tangents {
        return Tangents { u, v };
    }
    face_tangents(face)
}

pub fn face_uv_derivative(face: &HitPrimitive, d: Vec3) -> Vec2 {
    let b = vector_to_local(&face.primitive, d);
    (face.uv_1 - face.uv_0) * b.x + (face.uv_2 - face.uv_0) * b.y
}

pub fn face_normal_derivative(face: &HitPrimitive, b: Vec2, d: Vec3) -> Vec3 {
    let db = vector_to_local(&face.primitive, d);
    let n = face.normal_0 * (1.0 - b.x - b.y) + face.normal_1 * b.x + face.normal_2 * b.y;
    let dn = (face.normal_1 - face.normal_0) * db.x + (face.normal_2 - face.normal_0) * db.y;
    let length2 = dot(n, n);
    let scale = 1.0 / max(length2, 1e-12).sqrt();
    let unit = n * scale;
    let tangential = (dn - unit * dot(unit, dn)) * scale;
    let outward = tangential * if dot(unit, face.primitive.z) < 0.0 { -1.0 } else { 1.0 };
    if length2 > 1e-12 { outward } else { Vec3::ZERO }
}

pub fn face_hit_differential(
    face: &HitPrimitive,
    b: Vec2,
    differential: Differential,
    ray: Ray,
    t: f32,
    surface: Surface,
) -> HitDifferential {
    let x = transferred(differential.x, ray, t, surface.normal);
    let y = transferred(differential.y, ray, t, surface.normal);
    let normal_x = face_normal_derivative(face, b, x.position) * surface.side;
    let normal_y = face_normal_derivative(face, b, y.position) * surface.side;
    HitDifferential {
        x,
        y,
        normal_x,
        normal_y,
    }
}

pub fn face_footprint(face: &HitPrimitive, surface: Surface, dx: Vec3, dy: Vec3) -> Footprint {
    Footprint {
        uv: surface.uv,
        dx: face_uv_derivative(face, dx),
        dy: face_uv_derivative(face, dy),
    }
}

pub fn face_first_hit(face: &HitPrimitive, hit: Hit) -> FirstHit {
    let b = hit.barycentric;
    let normal = with_positive_zeros(face.primitive.z);
    let shading_normal = with_positive_zeros(face_normal(face, b));
    let uv = face_uv(face, b);
    FirstHit {
        normal,
        depth: hit.t,
        uv: Vec2::new(positive_zero(uv.x), positive_zero(uv.y)),
        shape: face.primitive.shape,
        material: face.primitive.material,
        shading_normal,
        primitive: hit.primitive,
        barycentric: b,
        unused: UVec2::ZERO,
    }
}
