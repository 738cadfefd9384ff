//! Twin of `shaders/geometry.wgsl`: what a hit is like.

use bytemuck::Zeroable;
use glam::UVec2;

use super::camera::camera_ray;
use super::differential::{Arrival, Differential, arrival};
use super::footprint::{Footprint, surface_footprint};
use super::ray::{Hit, Ray};
use super::surface::{Surface, first_hit, surface_at, with_coordinates};
use super::traverse::closest_hit;
use crate::pack::{FirstHit, Material, NOTHING, Packed};

pub fn surface_of(scene: &Packed, hit: Hit, ray: Ray) -> Surface {
    let s = &scene.specialization;
    let q = &scene.primitives[hit.primitive as usize];
    let surface = surface_at(q, hit.primitive, ray, hit.t, scene.environment.shadow_epsilon);
    if s.lookups + s.specular_lookups == 0 {
        return surface;
    }
    with_coordinates(surface, q)
}

pub fn material_of(scene: &Packed, hit: Hit) -> &Material {
    &scene.materials[scene.primitives[hit.primitive as usize].material as usize]
}

pub fn arrival_of(scene: &Packed, hit: Hit, surface: Surface, ray: Ray, differential: Differential) -> Arrival {
    if scene.specialization.differentials == 0 {
        return Arrival::default();
    }
    let q = &scene.primitives[hit.primitive as usize];
    arrival(q, differential, ray, hit.t, surface)
}

pub fn footprint_of(scene: &Packed, hit: Hit, surface: Surface, at: Arrival) -> Footprint {
    let q = &scene.primitives[hit.primitive as usize];
    surface_footprint(q, surface, at.x.position, at.y.position)
}

pub fn pixel_first_hit(scene: &Packed, pixel: UVec2) -> FirstHit {
    let ray = camera_ray(&scene.camera, pixel.as_vec2() + 0.5);
    let hit = closest_hit(scene, ray, NOTHING, NOTHING);
    if hit.primitive == NOTHING {
        return FirstHit {
            shape: NOTHING,
            material: NOTHING,
            ..FirstHit::zeroed()
        };
    }
    first_hit(&scene.primitives[hit.primitive as usize], ray, hit.t)
}
