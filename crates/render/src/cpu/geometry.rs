//! Twin of `shaders/geometry.wgsl` and `shaders/meshes.wgsl`: the scene's geometry, as integrators know it.

use bytemuck::Zeroable;
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4Swizzles as _};

use super::alpha::first_seen;
use super::camera::camera_ray;
use super::differential::{Arrival, Differential, arrival};
use super::footprint::{Footprint, surface_footprint};
use super::math::dot;
use super::mesh::{
    Spot, face_arrival, face_first_hit, face_footprint, face_primitive, face_surface, normal_from_mesh, spot_by_itself,
    vector_from_mesh,
};
use super::panorama::panorama_ray;
use super::path::{Path, passed_path};
use super::primitive::Tangents;
use super::ray::{Hit, Ray, by_itself};
use super::shadow::Block;
use super::surface::{Surface, first_hit, surface_at, with_coordinates};
use super::traverse::{closest_primitive, hidden_by_primitives, is_hidden_by_primitives};
use super::tree::{closest_in_tree, hidden_by_tree, is_hidden_by_tree};
use crate::records::{
    FirstHit, HIDDEN_BACK, Instance, Light, MOST_HIDDEN, Material, NO_INDEX, NO_SHADOW, NOWHERE, Packed, SOME_SHADOWS,
};

pub fn closest_hit(scene: &Packed, ray: Ray, left: UVec2, wall: UVec2) -> Hit {
    if scene.specialization.in_tree == 0 {
        return closest_primitive(scene, ray, left.y, wall.y);
    }
    let hit = closest_primitive(scene, ray, by_itself(left), by_itself(wall));
    closest_in_tree(scene, hit, ray, left, wall)
}

pub fn hidden_samples(scene: &Packed, surface: &Surface, light: &Light, block: Block, unlit: u32) -> u32 {
    let bits = hidden_by_primitives(scene, surface, light, block);
    if scene.specialization.in_tree == 0 {
        return bits;
    }
    hidden_by_tree(scene, bits | unlit, surface, light, block)
}

pub fn is_hidden(scene: &Packed, before: bool, surface: &Surface, to: Vec3, reach: f32, goal: u32) -> bool {
    let hidden = before || is_hidden_by_primitives(scene, surface, to, reach, goal);
    if scene.specialization.in_tree == 0 {
        return hidden;
    }
    hidden || is_hidden_by_tree(scene, surface, to, reach, goal)
}

pub fn is_on_mesh(hit: Hit) -> bool {
    hit.instance != 0
}

/// The instance that a hit on a mesh is of.
pub fn instance_of(scene: &Packed, hit: Hit) -> &Instance {
    &scene.bvh.instances[hit.instance as usize - 1]
}

pub fn group_word(scene: &Packed, i: &Instance, slot: u32) -> u32 {
    let groups = &scene.bvh.meshes[i.mesh as usize].groups;
    let group = groups.get(slot as usize).copied().unwrap_or(0);
    scene.bvh.group_words[(i.materials + group) as usize]
}

pub fn triangle_casts(scene: &Packed, i: &Instance, slot: u32) -> bool {
    i.shadows != SOME_SHADOWS || group_word(scene, i, slot) & NO_SHADOW == 0
}

fn face_of(scene: &Packed, i: &Instance, hit: Hit) -> Spot {
    let mesh = &scene.bvh.meshes[i.mesh as usize];
    let UVec4 { x, y, z, .. } = mesh.triangles[hit.slot as usize];
    let corners = [x, y, z].map(|vertex| vertex as usize);
    let [p0, p1, p2] = corners.map(|vertex| mesh.vertices[vertex]);
    let v0 = p0.xyz();
    let edge_1 = vector_from_mesh(i, p1.xyz() - v0);
    let edge_2 = vector_from_mesh(i, p2.xyz() - v0);
    let mut face = Spot {
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
        condition: i.condition,
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

pub fn spot_of(scene: &Packed, hit: Hit) -> Spot {
    if is_on_mesh(hit) {
        return face_of(scene, instance_of(scene, hit), hit);
    }
    spot_by_itself(&scene.primitives[hit.primitive as usize])
}

pub fn surface_of(scene: &Packed, spot: &Spot, hit: Hit, ray: Ray) -> Surface {
    let s = &scene.specialization;
    let epsilon = scene.environment.shadow_epsilon;
    if is_on_mesh(hit) {
        let place = UVec2::new(hit.instance, hit.primitive);
        return face_surface(spot, place, hit.barycentric, ray.direction, epsilon);
    }
    let q = &spot.primitive;
    let surface = surface_at(q, hit.primitive, ray, hit.t, epsilon);
    if s.lookups + s.specular_lookups + s.anisotropic == 0 {
        return surface;
    }
    with_coordinates(surface, q)
}

pub fn material_of<'a>(scene: &'a Packed, spot: &Spot) -> &'a Material {
    &scene.materials[spot.primitive.material as usize]
}

pub fn arrival_of(
    scene: &Packed,
    spot: &Spot,
    hit: Hit,
    surface: Surface,
    ray: Ray,
    differential: Differential,
) -> Arrival {
    if scene.specialization.differentials == 0 {
        return Arrival::default();
    }
    if is_on_mesh(hit) {
        return face_arrival(spot, hit.barycentric, differential, ray, hit.t, surface);
    }
    arrival(&spot.primitive, differential, ray, hit.t, surface)
}

pub fn footprint_of(spot: &Spot, hit: Hit, surface: Surface, at: Arrival) -> Footprint {
    if is_on_mesh(hit) {
        return face_footprint(spot, surface, at.x.position, at.y.position);
    }
    surface_footprint(&spot.primitive, surface, at.x.position, at.y.position)
}

pub fn view_ray(scene: &Packed, place: Vec2) -> Ray {
    if scene.specialization.panoramic != 0 {
        return panorama_ray(&scene.camera, place);
    }
    camera_ray(&scene.camera, place)
}

pub fn seen_path(scene: &Packed, start: Path) -> Path {
    let mut path = start;
    for _ in 0..MOST_HIDDEN {
        let hit = closest_hit(scene, path.ray, path.left, path.wall);
        if hit.primitive == NO_INDEX {
            break;
        }
        let spot = spot_of(scene, hit);
        let hidden = material_of(scene, &spot).hidden;
        if hidden == 0 {
            break;
        }
        let surface = surface_of(scene, &spot, hit, path.ray);
        if (hidden == HIDDEN_BACK) & (surface.side > 0.0) {
            break;
        }
        let at = arrival_of(scene, &spot, hit, surface, path.ray, path.differential);
        path = passed_path(path, surface, at);
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
        left: NOWHERE,
        wall: NOWHERE,
    };
    let is_hidden = scene.specialization.hidden != 0;
    if is_hidden {
        path = seen_path(scene, path);
    }
    let mut found = path_first_hit(scene, path);
    if is_hidden && found.shape != NO_INDEX {
        found.depth += dot(path.ray.origin - start.origin, start.direction);
    }
    found
}

pub fn path_first_hit(scene: &Packed, path: Path) -> FirstHit {
    let ray = path.ray;
    let mut hit = closest_hit(scene, ray, path.left, path.wall);
    if scene.specialization.sees_through != 0 {
        hit = first_seen(scene, ray, hit);
    }
    if hit.primitive == NO_INDEX {
        return FirstHit {
            shape: NO_INDEX,
            material: NO_INDEX,
            primitive: NO_INDEX,
            ..FirstHit::zeroed()
        };
    }
    let spot = spot_of(scene, hit);
    if is_on_mesh(hit) {
        return face_first_hit(&spot, hit);
    }
    first_hit(&spot.primitive, ray, hit.t)
}
