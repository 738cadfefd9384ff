//! Twin of `shaders/integrator.wgsl`: radiance along a path.

use bytemuck::Zeroable;
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

use super::camera::{camera_differential, camera_ray};
use super::differential::{Arrival, Differential, arrival};
use super::filter::{filter_bin, filter_offset};
use super::light::segments_to_light;
use super::path::{Path, Scattered, glass_path, mirrored_path, usable_normal};
use super::phong::{Lobes, phong_block};
use super::ray::Hit;
use super::rng::{hash4, unit_float};
use super::sampling::{sample_key, sample_square};
use super::shadow::Block;
use super::surface::{Surface, first_hit, surface_at};
use super::texture::appearance;
use super::traverse::{closest_hit, hidden_samples};
use crate::pack::{
    BLOCK, EMITTER, FAR, FirstHit, GLASS, GRID, LEAVES, Light, MIRROR, Material, NOTHING, Packed, Primitive, SPLITS,
};

pub fn radiance(scene: &Packed, camera_path: Path, pixel: UVec2, sample: u32) -> Vec3 {
    let bounces = scene.specialization.bounces;
    let mut path = camera_path;
    if bounces == 0 {
        return radiance_from(
            scene,
            closest_hit(scene, path.ray, NOTHING, NOTHING),
            path,
            pixel,
            sample,
        );
    }
    let mut sum = Vec3::ZERO;
    let mut pending = [path; SPLITS as usize];
    let mut waiting = 0;
    for _ in 0..LEAVES {
        let mut hit = Hit {
            t: FAR,
            primitive: NOTHING,
        };
        while path.depth <= bounces {
            hit = closest_hit(scene, path.ray, path.left, path.wall);
            if !is_specular(scene, hit) {
                break;
            }
            if path.depth == bounces {
                hit.primitive = NOTHING;
                break;
            }
            let scattered = scatter(scene, hit, path, pixel, sample);
            path = scattered.onward;
            if scattered.splits {
                pending[waiting] = scattered.other;
                waiting += 1;
            }
        }
        sum += path.throughput * radiance_from(scene, hit, path, pixel, sample);
        if waiting == 0 {
            break;
        }
        waiting -= 1;
        path = pending[waiting];
    }
    sum
}

pub fn is_specular(scene: &Packed, hit: Hit) -> bool {
    if hit.primitive == NOTHING {
        return false;
    }
    let kind = scene.materials[scene.primitives[hit.primitive as usize].material as usize].kind;
    (kind == MIRROR) | (kind == GLASS)
}

pub fn scatter(scene: &Packed, hit: Hit, path: Path, pixel: UVec2, sample: u32) -> Scattered {
    let q = &scene.primitives[hit.primitive as usize];
    let mut surface = surface_at(q, hit.primitive, path.ray, hit.t, scene.environment.shadow_epsilon);
    let at = arrival_of(scene, q, path, hit.t, surface);
    let lookups = scene.specialization.specular_lookups;
    let look = appearance(scene, q, &scene.materials[q.material as usize], surface, at, lookups);
    let material = &look.material;
    surface.normal = usable_normal(surface, look.normal);
    if material.kind == MIRROR {
        return mirrored_path(path, surface, at, material);
    }
    let key = sample_key(pixel, scene.camera.seed, NOTHING);
    let random = unit_float(hash4(UVec4::new(key.x, key.y, sample, path.depth * LEAVES + path.branch)).x);
    glass_path(path, surface, at, material, random)
}

pub fn arrival_of(scene: &Packed, q: &Primitive, path: Path, t: f32, surface: Surface) -> Arrival {
    if scene.specialization.differentials == 0 {
        return Arrival::default();
    }
    arrival(q, path.differential, path.ray, t, surface)
}

pub fn radiance_from(scene: &Packed, hit: Hit, path: Path, pixel: UVec2, sample: u32) -> Vec3 {
    let s = &scene.specialization;
    if hit.primitive == NOTHING {
        return scene.environment.background;
    }
    let q = &scene.primitives[hit.primitive as usize];
    let plain = &scene.materials[q.material as usize];
    if plain.kind == EMITTER {
        return plain.ambient;
    }
    let mut surface = surface_at(q, hit.primitive, path.ray, hit.t, scene.environment.shadow_epsilon);
    let at = arrival_of(scene, q, path, hit.t, surface);
    let look = appearance(scene, q, plain, surface, at, s.lookups);
    let material = &look.material;
    surface.normal = look.normal;
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
    let to = segments_to_light(light, surface.position);
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
        let hidden = hidden_samples(scene, surface, light, block);
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

pub fn pixel_radiance(scene: &Packed, pixel: UVec2, sample: u32) -> Vec4 {
    let s = &scene.specialization;
    let (round, index) = (sample / s.pixel_samples, sample % s.pixel_samples);
    let key = sample_key(pixel, scene.camera.seed, 0);
    let u = sample_square(s.pixel_pattern, s.pixel_side, index, round, key);
    let at = filtered(scene, u);
    let path = camera_path(scene, pixel.as_vec2() + at.truncate());
    (radiance(scene, path, pixel, sample) * at.z).extend(at.z)
}

pub fn camera_path(scene: &Packed, place: Vec2) -> Path {
    let s = &scene.specialization;
    let mut differential = Differential::default();
    if s.differentials == 1 {
        differential = camera_differential(&scene.camera, place, 1.0 / (s.pixel_samples as f32).sqrt());
    }
    Path {
        ray: camera_ray(&scene.camera, place),
        differential,
        throughput: Vec3::ONE,
        depth: 0,
        branch: 0,
        left: NOTHING,
        wall: NOTHING,
    }
}

pub fn filtered(scene: &Packed, u: Vec2) -> Vec3 {
    let (bins, table) = (scene.specialization.filter_bins, &scene.filter_table);
    if bins == 0 {
        return u.extend(1.0);
    }
    let (i, j) = (filter_bin(u.x, bins), filter_bin(u.y, bins));
    let (of_x, of_y) = (table[i as usize], table[j as usize]);
    let x = filter_offset(u.x, i, bins, of_x.x, of_x.y);
    let y = filter_offset(u.y, j, bins, of_y.x, of_y.y);
    Vec3::new(0.5 + x, 0.5 + y, of_x.z * of_y.z)
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
