//! Twin of `shaders/vertices.wgsl`.

use glam::{UVec4, Vec2, Vec3, Vec4};

use super::differential::HitDifferential;
use super::footprint::Footprint;
use super::geometry::{instance_of, is_on_mesh};
use super::mesh::{HitPrimitive, color_between, face_uv, face_uv_derivative};
use super::ray::Hit;
use crate::records::{COLORS_OF_BASE, COLORS_OF_EMISSION, Instance, Material, NO_COLORS, NO_INDEX, Packed};

pub fn vertex_color(scene: &Packed, hit: Hit) -> Vec4 {
    if is_on_mesh(hit) {
        let i = instance_of(scene, hit);
        if i.colors != NO_INDEX {
            let mesh = &scene.bvh.meshes[i.mesh as usize];
            let UVec4 { x, y, z, .. } = mesh.triangles[hit.slot as usize];
            let [c0, c1, c2] = [x, y, z].map(|vertex| mesh.colors[vertex as usize]);
            return color_between(c0, c1, c2, hit.barycentric);
        }
    }
    Vec4::ONE
}

pub fn with_vertex_colors(scene: &Packed, before: &Material, hit: Hit) -> Material {
    let mut material = *before;
    if material.vertex_colors != NO_COLORS {
        let color = vertex_color(scene, hit);
        let factor = Vec3::new(color.x, color.y, color.z);
        if material.vertex_colors == COLORS_OF_BASE {
            material.diffuse *= factor;
        }
        if material.vertex_colors == COLORS_OF_EMISSION {
            material.emission *= factor;
        }
        material.opacity *= color.w;
    }
    material
}

pub fn load_further_uv(scene: &Packed, i: &Instance, vertex: u32, uv_set: u32) -> Vec2 {
    let rows = i.uv_sets.div_ceil(2);
    let row = scene.bvh.meshes[i.mesh as usize].more_uvs[(rows * vertex + (uv_set - 1) / 2) as usize];
    if uv_set & 1 == 1 {
        Vec2::new(row.x, row.y)
    } else {
        Vec2::new(row.z, row.w)
    }
}

pub fn hit_primitive_in_uv_set(scene: &Packed, prim: &HitPrimitive, hit: Hit, uv_set: u32) -> HitPrimitive {
    let mut face = *prim;
    if is_on_mesh(hit) {
        let i = instance_of(scene, hit);
        let has_set = uv_set <= i.uv_sets;
        let UVec4 { x, y, z, .. } = scene.bvh.meshes[i.mesh as usize].triangles[hit.slot as usize];
        let uv = |vertex: u32| {
            if has_set {
                load_further_uv(scene, i, vertex, uv_set)
            } else {
                Vec2::ZERO
            }
        };
        face.uv_0 = uv(x);
        face.uv_1 = uv(y);
        face.uv_2 = uv(z);
    }
    face
}

pub fn uv_in_set(scene: &Packed, first: Vec2, prim: &HitPrimitive, hit: Hit, uv_set: u32) -> Vec2 {
    if uv_set == 0 {
        return first;
    }
    face_uv(&hit_primitive_in_uv_set(scene, prim, hit, uv_set), hit.barycentric)
}

pub fn footprint_in_set(
    scene: &Packed,
    first: Footprint,
    prim: &HitPrimitive,
    hit: Hit,
    hit_diff: HitDifferential,
    uv_set: u32,
) -> Footprint {
    if uv_set == 0 {
        return first;
    }
    let face = hit_primitive_in_uv_set(scene, prim, hit, uv_set);
    Footprint {
        uv: face_uv(&face, hit.barycentric),
        dx: face_uv_derivative(&face, hit_diff.x.position),
        dy: face_uv_derivative(&face, hit_diff.y.position),
    }
}
