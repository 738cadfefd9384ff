//! Packs lights into records.

use std::collections::BTreeMap;

use bytemuck::Zeroable as _;

use super::primitive::parallelogram;
use super::{CULL_BOTH_FACES, DIRECTIONAL, EMITTER, Light, Material, NO_INDEX, POINT, Primitive, RECTANGLE, SPOT};
use wgray_scene::{self as scene, Scene};

/// `t_max` of shadow rays to directional lights: beyond any scene, but with a finite square.
pub(super) const DISTANT_T_MAX: f32 = 1e10;

/// Minimum relative distance from the end of a shadow ray to the light sample, because lights may lie on surfaces.
const MIN_LIGHT_DISTANCE: f64 = 1e-5;

/// Minimum difference of the cosines between which a spot light falls off.
const MIN_FALLOFF: f64 = 1e-12;

/// Returns `t_max` of shadow rays, relative to the vector to the light sample.
pub(super) fn t_max(shadow_epsilon: f64) -> f32 {
    (1.0 - shadow_epsilon.max(MIN_LIGHT_DISTANCE)) as f32
}

/// Packs the lights, rectangles first, and counts the rectangles. Each rectangle adds a primitive and a material.
pub(super) fn pack_lights(
    scene: &Scene,
    primitives: &mut Vec<Primitive>,
    materials: &mut Vec<Material>,
) -> (Vec<Light>, usize) {
    let mut lights = Vec::new();
    for (number, light) in (0..).zip(&scene.lights) {
        if let scene::Light::Rectangle {
            rectangle,
            color,
            visible,
        } = light
        {
            let shape = scene.shapes.len() as u32 + number;
            primitives.push(parallelogram(RECTANGLE, rectangle, materials.len() as u32, shape));
            materials.push(Material {
                kind: EMITTER,
                emission: color.as_vec3(),
                camera_culling: if *visible { 0 } else { CULL_BOTH_FACES },
                ..Material::zeroed()
            });
        }
        lights.push(pack_light(light, number, scene.render.shadow_epsilon));
    }
    let has_area = |light: &Light| matches!(scene.lights[light.number as usize], scene::Light::Rectangle { .. });
    lights.sort_by_key(|light| !has_area(light));
    let area_lights = lights.iter().filter(|light| has_area(light)).count();
    (lights, area_lights)
}

fn pack_light(light: &scene::Light, number: u32, shadow_epsilon: f64) -> Light {
    let t_max = t_max(shadow_epsilon);
    let base = Light {
        finite: 1.0,
        t_max,
        primitive: NO_INDEX,
        number,
        ..Light::zeroed()
    };
    match light {
        scene::Light::Rectangle { rectangle, color, .. } => Light {
            center: rectangle.center.as_vec3(),
            u: rectangle.u.as_vec3(),
            v: rectangle.v.as_vec3(),
            color: color.as_vec3(),
            ..base
        },
        scene::Light::Point { position, color } => Light {
            center: position.as_vec3(),
            color: color.as_vec3(),
            kind: POINT,
            ..base
        },
        scene::Light::Directional { direction, color } => Light {
            center: -direction.as_vec3(),
            finite: 0.0,
            t_max: DISTANT_T_MAX,
            color: color.as_vec3(),
            kind: DIRECTIONAL,
            ..base
        },
        scene::Light::Spot {
            position,
            direction,
            color,
            cone,
            inner,
        } => Light {
            center: position.as_vec3(),
            color: color.as_vec3(),
            normal: direction.as_vec3(),
            kind: SPOT,
            cone: one_minus_cosine(*cone) as f32,
            falloff: (1.0 / (one_minus_cosine(*cone) - one_minus_cosine(*inner)).max(MIN_FALLOFF)) as f32,
            ..base
        },
    }
}

/// Returns 1 - cos(angle) without cancellation.
fn one_minus_cosine(angle: f64) -> f64 {
    2.0 * (angle / 2.0).sin().powi(2)
}

/// Sets the primitive of each light that has a rectangle.
pub(super) fn connect_lights(lights: &mut [Light], order: &[(Primitive, bool)], shapes: usize) {
    let mut light_indices: BTreeMap<u32, u32> = BTreeMap::new();
    for (i, light) in (0..).zip(&*lights) {
        light_indices.insert(light.number, i);
    }
    for (i, (primitive, _)) in (0..).zip(order) {
        let number = primitive.shape.checked_sub(shapes as u32);
        if let Some(light) = number.and_then(|number| light_indices.get(&number)) {
            lights[*light as usize].primitive = i;
        }
    }
}
