//! An integrator is a single file that only uses shared functions. This test replaces `phong` by another integrator and
//! its twin: the diffuse color times a sum over the unoccluded lights (color times cosine), plus 0.5 in the sum if a
//! random ray near the normal leaves the scene.

use glam::{UVec2, Vec3, Vec4};
use wgray_trace::cpu::camera::camera_ray;
use wgray_trace::cpu::geometry::{closest_hit, fetch_hit_primitive, material_of, occluded_samples, surface_of};
use wgray_trace::cpu::light::{segment, segments_to_light};
use wgray_trace::cpu::math::{dot, normalize};
use wgray_trace::cpu::ray::Ray;
use wgray_trace::cpu::rng::unit_float;
use wgray_trace::cpu::sampling::{decision_bits, sample_key, sample_square};
use wgray_trace::cpu::shadow::SampleBlock;
use wgray_trace::records::{NO_INDEX, NO_PRIMITIVE, Packed, RANDOM};

use crate::pictures::{RenderMode, differing, exact_modes, reference, render_with};
use crate::{scenes, sources};

const FILE: &str = "integrators/phong.wgsl";

const WGSL: &str = "
fn radiance(ray: Ray, differential: Differential, pixel: vec2u, sample: u32) -> vec3f {
    let hit = closest_hit(ray, NO_PRIMITIVE, NO_PRIMITIVE);
    if hit.primitive == NO_INDEX {
        return environment.background;
    }
    let prim = fetch_hit_primitive(hit);
    let surface = surface_of(prim, hit, ray);
    let bits = decision_bits(pixel, camera.seed, sample, 1u, 77u);
    let random = vec3f(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z)) - 0.5;
    let up = normalize(surface.shading_normal + random);
    let next = closest_hit(Ray(surface.ray_origin, up), surface.exclude_front, surface.exclude_back);
    var sum = vec3f(select(0.0, 0.5, next.primitive == NO_INDEX));
    for (var i = 0u; i < light_counts().y; i++) {
        let light = load_light(i);
        let block = SampleBlock(RANDOM, 1u, 0u, 1u, sample, sample_key(pixel, camera.seed, 1u + light.number));
        let is_lit = (occluded_samples(surface, light, block, 0u) & 1u) == 0u;
        let to_light = segment(segments_to_light(light, surface.position), sample_square(RANDOM, 1u, 0u, sample, block.key));
        sum += light.color * select(0.0, abs(dot(normalize(to_light), surface.normal)), is_lit);
    }
    return sum * material_of(prim).diffuse;
}
";

/// The twin of `radiance` in [`WGSL`].
fn radiance(scene: &Packed, ray: Ray, pixel: UVec2, sample: u32) -> Vec3 {
    let hit = closest_hit(scene, ray, NO_PRIMITIVE, NO_PRIMITIVE);
    if hit.primitive == NO_INDEX {
        return scene.environment.background;
    }
    let prim = fetch_hit_primitive(scene, hit);
    let surface = surface_of(scene, &prim, hit, ray);
    let bits = decision_bits(pixel, scene.camera.seed, sample, 1, 77);
    let random = Vec3::new(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z)) - 0.5;
    let up = Ray {
        origin: surface.ray_origin,
        direction: normalize(surface.shading_normal + random),
    };
    let next = closest_hit(scene, up, surface.exclude_front, surface.exclude_back);
    let mut sum = Vec3::splat(if next.primitive == NO_INDEX { 0.5 } else { 0.0 });
    for light in &scene.lighting.lights {
        let key = sample_key(pixel, scene.camera.seed, 1 + light.number);
        let block = SampleBlock {
            pattern: RANDOM,
            side: 1,
            first: 0,
            count: 1,
            group: sample,
            key,
        };
        let is_lit = occluded_samples(scene, &surface, light, block, 0) & 1 == 0;
        let point = sample_square(RANDOM, 1, 0, sample, key);
        let to_light = segment(segments_to_light(light, surface.position), point);
        let cosine = dot(normalize(to_light), surface.normal).abs();
        sum += light.color * if is_lit { cosine } else { 0.0 };
    }
    sum * material_of(scene, &prim).diffuse
}

#[test]
fn an_integrator_is_a_single_file() {
    let mut description = scenes::scene("turntable.toml");
    (description.image.width, description.image.height) = (96, 72);
    description.render.pixel_samples = crate::patterns::samples(wgray::scene::Pattern::Grid, 4);
    let packed = scenes::packed(&description);
    let shaders = sources::shaders_with(FILE, WGSL);
    let mut expected = reference(&packed);
    for (i, sum) in (0..).zip(&mut expected.sums) {
        let pixel = UVec2::new(i % 96, i / 96);
        *sum = Vec4::ZERO;
        for sample in 0..4 {
            let point = sample_square(0, 2, sample, 0, UVec2::ZERO);
            let ray = camera_ray(&packed.camera, pixel.as_vec2() + point);
            *sum += radiance(&packed, ray, pixel, sample).extend(1.0);
        }
    }
    for mode in exact_modes().into_iter().filter(|mode| *mode != RenderMode::Cpu) {
        let found = render_with(&packed, mode, &shaders);
        assert_eq!(differing(&found, &expected), 0, "{mode:?}");
        let phong = render_with(&packed, mode, sources::shaders());
        assert!(
            differing(&phong, &expected) > 1000,
            "{mode:?}: the integrator is not replaced"
        );
        let other_random_numbers = sources::shaders_with(FILE, &WGSL.replace("77u", "78u"));
        assert!(
            differing(&render_with(&packed, mode, &other_random_numbers), &expected) > 1000,
            "{mode:?}"
        );
    }
}
