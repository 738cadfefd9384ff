//! Twin of `shaders/integrator.wgsl`: radiance along a ray.

use bytemuck::Zeroable;
use glam::{UVec2, Vec3};

use super::camera::camera_ray;
use super::light::segments_to_light;
use super::phong::{Lobes, phong_block};
use super::ray::Ray;
use super::sampling::{sample_key, sample_square};
use super::shadow::Block;
use super::surface::{Surface, first_hit, surface_at};
use super::traverse::{closest_hit, hidden_samples};
use crate::pack::{BLOCK, EMITTER, FirstHit, GRID, Light, Material, NOTHING, Packed};

pub fn radiance(scene: &Packed, ray: Ray, pixel: UVec2, sample: u32) -> Vec3 {
    let s = &scene.specialization;
    let hit = closest_hit(scene, ray);
    if hit.primitive == NOTHING {
        return scene.environment.background;
    }
    let q = &scene.primitives[hit.primitive as usize];
    let material = &scene.materials[q.material as usize];
    if material.kind == EMITTER {
        return material.ambient;
    }
    let surface = surface_at(q, ray, hit.t, scene.environment.shadow_epsilon);
    let mut sum = scene.environment.ambient * material.ambient;
    let (area_lights, delta_lights) = scene.lights.split_at(s.area_lights as usize);
    for light in area_lights {
        let (pattern, side, count) = (s.light_pattern, s.light_side, s.light_samples);
        let lobes = lobes_of_light(scene, surface, material, light, pattern, side, count, pixel, sample);
        sum += reflected(material, light, lobes, scene.environment.light_weight);
    }
    for light in delta_lights {
        let lobes = lobes_of_light(scene, surface, material, light, GRID, 1, 1, pixel, sample);
        sum += reflected(material, light, lobes, 1.0);
    }
    sum
}

#[expect(clippy::too_many_arguments, reason = "the twin of a WGSL function has its arguments")]
pub fn lobes_of_light(
    scene: &Packed,
    surface: Surface,
    material: &Material,
    light: &Light,
    pattern: u32,
    side: u32,
    count: u32,
    pixel: UVec2,
    sample: u32,
) -> Lobes {
    let to = segments_to_light(light, surface.start);
    let key = sample_key(pixel, scene.camera.seed, 1 + light.number);
    let mut lobes = Lobes {
        diffuse: 0.0,
        specular: 0.0,
    };
    let mut first = 0;
    while first < count {
        let block = Block {
            pattern,
            side,
            first,
            count: BLOCK.min(count - first),
            group: sample,
            key,
        };
        let hidden = hidden_samples(scene, surface.start, light, block);
        lobes = phong_block(
            surface,
            material,
            to,
            block,
            hidden,
            scene.specialization.exponent_bits,
            lobes,
        );
        first += BLOCK;
    }
    lobes
}

pub fn reflected(material: &Material, light: &Light, lobes: Lobes, weight: f32) -> Vec3 {
    let light_color = light.color * weight;
    light_color * (material.diffuse * lobes.diffuse + material.specular * lobes.specular)
}

pub fn pixel_radiance(scene: &Packed, pixel: UVec2, sample: u32) -> Vec3 {
    let s = &scene.specialization;
    let key = sample_key(pixel, scene.camera.seed, 0);
    let at = sample_square(s.pixel_pattern, s.pixel_side, sample, 0, key);
    radiance(scene, camera_ray(&scene.camera, pixel.as_vec2() + at), pixel, sample)
}

pub fn pixel_first_hit(scene: &Packed, pixel: UVec2) -> FirstHit {
    let ray = camera_ray(&scene.camera, pixel.as_vec2() + 0.5);
    let hit = closest_hit(scene, ray);
    if hit.primitive == NOTHING {
        return FirstHit {
            shape: NOTHING,
            material: NOTHING,
            ..FirstHit::zeroed()
        };
    }
    first_hit(&scene.primitives[hit.primitive as usize], ray, hit.t)
}
