//! Twin of `shaders/integrators/phong.wgsl`: the integrator `phong`, direct light with specular bounces.

use glam::{UVec2, Vec3};

use crate::cpu::differential::Differential;
use crate::cpu::geometry::{
    closest_hit, fetch_hit_primitive, hit_differential, material_of, occluded_samples, skip_camera_invisible,
    surface_of,
};
use crate::cpu::light::{segments_to_light, spot_falloff};
use crate::cpu::lobes::unlit_bits;
use crate::cpu::mesh::HitPrimitive;
use crate::cpu::path::{Path, SpecularSplit, glass_path, is_specular, mirrored_path, usable_normal};
use crate::cpu::phong::{Lobes, add_visible};
use crate::cpu::ray::{Hit, Ray};
use crate::cpu::rng::unit_float;
use crate::cpu::samples::{LEVEL, Samples};
use crate::cpu::sampling::{decision_bits, sample_key};
use crate::cpu::shadow::SampleBlock;
use crate::cpu::surface::Surface;
use crate::cpu::texture::evaluate_material;
use crate::cpu::traversal::Directions;
use crate::records::{
    EMITTER, GRID, Light, MAX_PATH_LEAVES, MAX_SPLIT_DEPTH, MIRROR, Material, NO_INDEX, NO_PRIMITIVE, Packed,
    ROTATED_GRID, SAMPLE_BLOCK, SPOT,
};

pub fn radiance(scene: &Packed, ray: Ray, differential: Differential, pixel: UVec2, sample: u32) -> Vec3 {
    let mut path = Path {
        ray,
        differential,
        throughput: Vec3::ONE,
        depth: 0,
        branch: 0,
        origin_prim: NO_PRIMITIVE,
        inside_prim: NO_PRIMITIVE,
    };
    if scene.specialization.camera_invisible != 0 {
        path = skip_camera_invisible(scene, path);
    }
    let hit = closest_hit(scene, path.ray, path.origin_prim, path.inside_prim);
    radiance_after(scene, path, hit, pixel, sample)
}

/// The part of [`radiance`] after the closest hit of the camera ray.
pub fn radiance_after(scene: &Packed, camera_path: Path, first_hit: Hit, pixel: UVec2, sample: u32) -> Vec3 {
    let bounces = scene.specialization.bounces;
    let (mut path, mut hit) = (camera_path, first_hit);
    if bounces == 0 {
        if hit.primitive == NO_INDEX {
            return scene.environment.background;
        }
        return radiance_from(scene, &fetch_hit_primitive(scene, hit), hit, path, pixel, sample);
    }
    let mut sum = Vec3::ZERO;
    let mut pending = [path; MAX_SPLIT_DEPTH as usize];
    let mut pending_count = 0;
    for _ in 0..MAX_PATH_LEAVES {
        let mut radiance = scene.environment.background;
        while path.depth <= bounces {
            if path.depth > 0 {
                hit = closest_hit(scene, path.ray, path.origin_prim, path.inside_prim);
            }
            if hit.primitive == NO_INDEX {
                break;
            }
            let prim = fetch_hit_primitive(scene, hit);
            if !is_specular(material_of(scene, &prim)) {
                radiance = radiance_from(scene, &prim, hit, path, pixel, sample);
                break;
            }
            if path.depth == bounces {
                break;
            }
            let split = scatter(scene, &prim, hit, path, pixel, sample);
            path = split.primary;
            if split.splits {
                pending[pending_count] = split.secondary;
                pending_count += 1;
            }
        }
        sum += path.throughput * radiance;
        if pending_count == 0 {
            break;
        }
        pending_count -= 1;
        path = pending[pending_count];
    }
    sum
}

pub fn scatter(scene: &Packed, prim: &HitPrimitive, hit: Hit, path: Path, pixel: UVec2, sample: u32) -> SpecularSplit {
    let mut surface = surface_of(scene, prim, hit, path.ray);
    let hit_diff = hit_differential(scene, prim, hit, surface, path.ray, path.differential);
    let lookups = scene.specialization.specular_lookups;
    let shading = evaluate_material(scene, prim, hit, material_of(scene, prim), surface, hit_diff, lookups);
    let material = &shading.material;
    surface.shading_normal = usable_normal(surface, shading.normal);
    if material.kind == MIRROR {
        return mirrored_path(path, surface, hit_diff, material);
    }
    let bounce = path.depth * MAX_PATH_LEAVES + path.branch;
    let bits = decision_bits(pixel, scene.camera.seed, sample, bounce, NO_INDEX);
    glass_path(path, surface, hit_diff, material, unit_float(bits.x))
}

pub fn radiance_from(scene: &Packed, prim: &HitPrimitive, hit: Hit, path: Path, pixel: UVec2, sample: u32) -> Vec3 {
    let s = &scene.specialization;
    let untextured = material_of(scene, prim);
    if untextured.kind == EMITTER {
        return untextured.emission;
    }
    let mut surface = surface_of(scene, prim, hit, path.ray);
    let hit_diff = hit_differential(scene, prim, hit, surface, path.ray, path.differential);
    let shading = evaluate_material(scene, prim, hit, untextured, surface, hit_diff, s.lookups);
    let material = &shading.material;
    surface.shading_normal = shading.normal;
    if !scene.bvh.instances.is_empty() {
        surface.ray_origin += surface.terminator_offset;
    }
    let mut sum = scene.environment.ambient * material.ambient;
    let (area_lights, delta_lights) = scene.lighting.lights.split_at(scene.counts.lights.x as usize);
    for light in area_lights {
        let (pattern, side, count) = (s.light_pattern, s.light_side, s.light_samples);
        let lobes = lobes_of_light(
            scene, prim, &surface, material, light, pattern, side, count, pixel, sample,
        );
        sum += phong_radiance(material, light, lobes, scene.environment.light_weight);
    }
    for light in delta_lights {
        let mut light = *light;
        if light.kind == SPOT {
            light.color *= spot_falloff(&light, light.center - surface.position);
        }
        let lobes = lobes_of_light(scene, prim, &surface, material, &light, GRID, 1, 1, pixel, sample);
        sum += phong_radiance(material, &light, lobes, 1.0);
    }
    sum
}

#[expect(clippy::too_many_arguments, reason = "a twin has the arguments of its WGSL function")]
pub fn lobes_of_light(
    scene: &Packed,
    prim: &HitPrimitive,
    surface: &Surface,
    material: &Material,
    light: &Light,
    pattern: u32,
    side: u32,
    count: u32,
    pixel: UVec2,
    sample: u32,
) -> Lobes {
    let segments = segments_to_light(light, surface.position);
    let key = match pattern {
        GRID | ROTATED_GRID => UVec2::ZERO, // without effect
        _ => sample_key(pixel, scene.camera.seed, 1 + light.number),
    };
    let mut lobes = Lobes {
        diffuse: 0.0,
        specular: 0.0,
    };
    let mut first = 0;
    while first < count {
        let block = SampleBlock {
            pattern,
            side,
            first,
            count: SAMPLE_BLOCK.min(count - first),
            group: sample,
            key,
        };
        let mut directions = Directions::EMPTY;
        Samples::of(block).write_segments(*LEVEL, segments, &mut directions);
        let mut unlit = 0;
        if scene.specialization.tlas_kinds != 0 {
            unlit = unlit_bits(prim, surface, &directions);
        }
        let occluded = occluded_samples(scene, surface, light, block, unlit);
        lobes = add_visible(
            surface,
            material,
            &directions,
            occluded,
            scene.specialization.exponent_bits,
            lobes,
        );
        first += SAMPLE_BLOCK;
    }
    lobes
}

pub fn phong_radiance(material: &Material, light: &Light, lobes: Lobes, weight: f32) -> Vec3 {
    let light_color = light.color * weight;
    light_color * (material.diffuse * lobes.diffuse + material.specular * lobes.specular)
}
