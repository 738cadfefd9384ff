//! Twin of `shaders/geometry.wgsl` and `shaders/meshes.wgsl`.

use bytemuck::Zeroable;
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4Swizzles as _};

use super::alpha::skip_transparent;
use super::bvh::{closest_in_bvh, is_occluded_by_bvh, occluded_by_bvh};
use super::camera::camera_ray;
use super::differential::{Differential, HitDifferential, primitive_hit_differential};
use super::footprint::{Footprint, surface_footprint};
use super::linear_primitives::{closest_primitive, is_occluded_by_primitives, occluded_by_primitives};
use super::math::dot;
use super::mesh::{
    HitPrimitive, face_first_hit, face_footprint, face_hit_differential, face_primitive, face_surface,
    normal_from_mesh, standalone_hit_primitive, vector_from_mesh,
};
use super::panorama::panorama_ray;
use super::path::{Path, pass_through_path};
use super::primitive::Tangents;
use super::ray::{Hit, Ray, standalone_prim};
use super::shadow::SampleBlock;
use super::surface::{Surface, first_hit, surface_at, with_coordinates};
use crate::records::{
    CULL_BACKFACE, FirstHit, Instance, Light, MAX_CAMERA_SKIPS, Material, NO_INDEX, NO_PRIMITIVE, NO_SHADOW, Packed,
    SOME_SHADOWS,
};

pub fn closest_hit(scene: &Packed, ray: Ray, origin_prim: UVec2, inside_prim: UVec2) -> Hit {
    if scene.specialization.tlas_kinds == 0 {
        return closest_primitive(scene, ray, origin_prim.y, inside_prim.y);
    }
    let hit = closest_primitive(scene, ray, standalone_prim(origin_prim), standalone_prim(inside_prim));
    closest_in_bvh(scene, hit, ray, origin_prim, inside_prim)
}

pub fn occluded_samples(scene: &Packed, surface: &Surface, light: &Light, block: SampleBlock, unlit: u32) -> u32 {
    let bits = occluded_by_primitives(scene, surface, light, block);
    if scene.specialization.tlas_kinds == 0 {
        return bits;
    }
    occluded_by_bvh(scene, bits | unlit, surface, light, block)
}

pub fn is_occluded(
    scene: &Packed,
    already_occluded: bool,
    surface: &Surface,
    to_light: Vec3,
    t_max: f32,
    target_prim: u32,
) -> bool {
    let occluded = already_occluded || is_occluded_by_primitives(scene, surface, to_light, t_max, target_prim);
    if scene.specialization.tlas_kinds == 0 {
        return occluded;
    }
    occluded || is_occluded_by_bvh(scene, surface, to_light, t_max, target_prim)
}

pub fn is_on_mesh(hit: Hit) -> bool {
    hit.instance != 0
}

/// Returns the instance of a hit on a mesh.
pub fn instance_of(scene: &Packed, hit: Hit) -> &Instance {
    &scene.bvh.instances[hit.instance as usize - 1]
}

pub fn group_word(scene: &Packed, i: &Instance, slot: u32) -> u32 {
    let groups = &scene.bvh.meshes[i.mesh as usize].groups;
    let group = groups.get(slot as usize).copied().unwrap_or(0);
    scene.bvh.group_words[(i.first_group_word + group) as usize]
}

pub fn triangle_casts(scene: &Packed, i: &Instance, slot: u32) -> bool {
    i.shadows != SOME_SHADOWS || group_word(scene, i, slot) & NO_SHADOW == 0
}

fn face_of(scene: &Packed, i: &Instance, hit: Hit) -> HitPrimitive {
    let mesh = &scene.bvh.meshes[i.mesh as usize];
    let UVec4 { x, y, z, .. } = mesh.triangles[hit.slot as usize];
    let corners = [x, y, z].map(|vertex| vertex as usize);
    let [p0, p1, p2] = corners.map(|vertex| mesh.vertices[vertex]);
    let v0 = p0.xyz();
    let edge_1 = vector_from_mesh(i, p1.xyz() - v0);
    let edge_2 = vector_from_mesh(i, p2.xyz() - v0);
    let mut face = HitPrimitive {
        primitive: face_primitive(i, v0, edge_1, edge_2, group_word(scene, i, hit.slot) & !NO_SHADOW),
        edge_1,
        edge_2,
        uv_0: Vec2::ZERO,
        uv_1: Vec2::X,
        uv_2: Vec2::Y,
        normal_0: Vec3::ZERO,
        normal_1: Vec3::ZERO,
        normal_2: Vec3::ZERO,
        tangents_0: Tangents::default(),
        tangents_1: Tangents::default(),
        tangents_2: Tangents::default(),
        anchor: i.anchor,
        condition_number: i.condition_number,
    };
    if i.attributes != NO_INDEX {
        let [n0, n1, n2] = corners.map(|vertex| mesh.attributes[vertex]);
        face.normal_0 = normal_from_mesh(i, n0.xyz());
        face.normal_1 = normal_from_mesh(i, n1.xyz());
        face.normal_2 = normal_from_mesh(i, n2.xyz());
        if i.has_uvs != 0 {
            face.uv_0 = Vec2::new(p0.w, n0.w);
            face.uv_1 = Vec2::new(p1.w, n1.w);
            face.uv_2 = Vec2::new(p2.w, n2.w);
        }
    }
    if i.tangents != NO_INDEX {
        let [t0, t1, t2] = corners.map(|vertex| {
            let [u, v] = mesh.tangents[vertex].map(|row| vector_from_mesh(i, row.xyz()));
            Tangents { u, v }
        });
        face.tangents_0 = t0;
        face.tangents_1 = t1;
        face.tangents_2 = t2;
    }
    face
}

pub fn fetch_hit_primitive(scene: &Packed, hit: Hit) -> HitPrimitive {
    if is_on_mesh(hit) {
        return face_of(scene, instance_of(scene, hit), hit);
    }
    standalone_hit_primitive(&scene.primitives[hit.primitive as usize])
}

pub fn surface_of(scene: &Packed, prim: &HitPrimitive, hit: Hit, ray: Ray) -> Surface {
    let s = &scene.specialization;
    let epsilon = scene.environment.shadow_epsilon;
    if is_on_mesh(hit) {
        let prim_id = UVec2::new(hit.instance, hit.primitive);
        return face_surface(prim, prim_id, hit.barycentric, ray.direction, epsilon);
    }
    let q = &prim.primitive;
    let surface = surface_at(q, hit.primitive, ray, hit.t, epsilon);
    if s.lookups + s.specular_lookups + s.anisotropic == 0 {
        return surface;
    }
    with_coordinates(surface, q)
}

pub fn material_of<'a>(scene: &'a Packed, prim: &HitPrimitive) -> &'a Material {
    &scene.materials[prim.primitive.material as usize]
}

pub fn hit_differential(
    scene: &Packed,
    prim: &HitPrimitive,
    hit: Hit,
    surface: Surface,
    ray: Ray,
    differential: Differential,
) -> HitDifferential {
    if scene.specialization.differentials == 0 {
        return HitDifferential::default();
    }
    if is_on_mesh(hit) {
        return face_hit_differential(prim, hit.barycentric, differential, ray, hit.t, surface);
    }
    primitive_hit_differential(&prim.primitive, differential, ray, hit.t, surface)
}

pub fn footprint_of(prim: &HitPrimitive, hit: Hit, surface: Surface, hit_diff: HitDifferential) -> Footprint {
    if is_on_mesh(hit) {
        return face_footprint(prim, surface, hit_diff.x.position, hit_diff.y.position);
    }
    surface_footprint(&prim.primitive, surface, hit_diff.x.position, hit_diff.y.position)
}

pub fn view_ray(scene: &Packed, raster: Vec2) -> Ray {
    if scene.specialization.panoramic != 0 {
        return panorama_ray(&scene.camera, raster);
    }
    camera_ray(&scene.camera, raster)
}

pub fn skip_camera_invisible(scene: &Packed, start: Path) -> Path {
    let mut path = start;
    for _ in 0..MAX_CAMERA_SKIPS {
        let hit = closest_hit(scene, path.ray, path.origin_prim, path.inside_prim);
        if hit.primitive == NO_INDEX {
            break;
        }
        let prim = fetch_hit_primitive(scene, hit);
        let culling = material_of(scene, &prim).camera_culling;
        if culling == 0 {
            break;
        }
        let surface = surface_of(scene, &prim, hit, path.ray);
        if (culling == CULL_BACKFACE) & (surface.side > 0.0) {
            break;
        }
        let hit_diff = hit_differential(scene, &prim, hit, surface, path.ray, path.differential);
        path = pass_through_path(path, surface, hit_diff);
    }
    path
}

pub fn pixel_first_hit(scene: &Packed, pixel: UVec2) -> FirstHit {
    let start = view_ray(scene, pixel.as_vec2() + 0.5);
    let mut path = Path {
        ray: start,
        differential: Differential::default(),
        throughput: Vec3::ONE,
        depth: 0,
        branch: 0,
        origin_prim: NO_PRIMITIVE,
        inside_prim: NO_PRIMITIVE,
    };
    let has_invisible = scene.specialization.camera_invisible != 0;
    if has_invisible {
        path = skip_camera_invisible(scene, path);
    }
    let mut found = path_first_hit(scene, path);
    if has_invisible && found.shape != NO_INDEX {
        found.depth += dot(path.ray.origin - start.origin, start.direction);
    }
    found
}

pub fn path_first_hit(scene: &Packed, path: Path) -> FirstHit {
    let ray = path.ray;
    let mut hit = closest_hit(scene, ray, path.origin_prim, path.inside_prim);
    if scene.specialization.alpha_surfaces != 0 {
        hit = skip_transparent(scene, ray, hit);
    }
    if hit.primitive == NO_INDEX {
        return FirstHit {
            shape: NO_INDEX,
            material: NO_INDEX,
            primitive: NO_INDEX,
            ..FirstHit::zeroed()
        };
    }
    let prim = fetch_hit_primitive(scene, hit);
    if is_on_mesh(hit) {
        return face_first_hit(&prim, hit);
    }
    first_hit(&prim.primitive, ray, hit.t)
}
