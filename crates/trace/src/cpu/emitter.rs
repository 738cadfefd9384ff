//! Twin of `shaders/emitter.wgsl`.

use glam::{UVec2, Vec2, Vec3};

use super::alpha::opacity_at;
use super::environment::sample_environment;
use super::footprint::Footprint;
use super::geometry::{fetch_hit_primitive, material_of};
use super::light::spot_falloff;
use super::light_choice::EmitterSelection;
use super::light_sample::{
    cylinder_sample, cylinder_share, ellipsoid_area, ellipsoid_pdf, ellipsoid_sample, solid_angle_pdf, uniform_below,
};
use super::math::{dot, normalize};
use super::mesh::{HitPrimitive, face_uv, standalone_hit_primitive};
use super::primitive::primitive_uv;
use super::ray::{Hit, Ray, point_to_local};
use super::rng::unit_float;
use super::texture::texture_color;
use super::vertices::{uv_in_set, vertex_color};
use super::warp::{disk_sample, triangle_sample};
use crate::records::{
    COLORS_OF_EMISSION, CYLINDER, DISK, ELLIPSOID, ENVIRONMENT, Emitter, FOR_EMISSION, Light, Material, NO_INDEX,
    POINT, Packed, RECTANGLE, SPOT, TRIANGLE,
};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    pub to: Vec3,
    pub radiance: Vec3,
    pub pdf: f32,
    pub is_delta: bool,
    pub t_max: f32,
    pub primitive: u32,
}

pub fn select_emitter(scene: &Packed, bits: UVec2) -> Emitter {
    if scene.lighting.emitters.len() == 1 {
        return scene.lighting.emitters[0];
    }
    let first = uniform_below(bits.x, scene.lighting.emitters.len() as u32);
    let emitter = scene.lighting.emitters[first as usize];
    if unit_float(bits.y) < emitter.threshold {
        emitter
    } else {
        scene.lighting.emitters[emitter.alias_index as usize]
    }
}

pub fn sample_emitter(scene: &Packed, selection: EmitterSelection, p: Vec3, normal: Vec3, u: Vec2) -> LightSample {
    let emitter = selection.emitter;
    if emitter.instance != 0 {
        return sample_face(scene, selection, p, u);
    }
    let light = &scene.lighting.lights[emitter.index as usize];
    if light.kind == ENVIRONMENT {
        return sample_environment(scene, light, normal, u);
    }
    if selection.density > 0.0 {
        let density = selection.density;
        return sample_light(scene, &Light { density, ..*light }, p, u);
    }
    sample_light(scene, light, p, u)
}

pub fn sample_light(scene: &Packed, light: &Light, p: Vec3, u: Vec2) -> LightSample {
    let position = match light.kind {
        RECTANGLE => u * 2.0 - 1.0,
        DISK => disk_sample(u),
        TRIANGLE => triangle_sample(u),
        _ => Vec2::ZERO,
    };
    let mut to_light = (light.center - p * light.finite) + light.u * position.x + light.v * position.y;
    let is_delta = light.kind >= POINT;
    let mut behind = false;
    let mut pdf = light.density;
    let mut radiance = light.color;
    if light.kind == POINT {
        radiance = light.color / dot(to_light, to_light);
    }
    if light.kind == SPOT {
        radiance = light.color * (spot_falloff(light, to_light) / dot(to_light, to_light));
    }
    if light.kind == ELLIPSOID {
        let q = &scene.primitives[light.primitive as usize];
        to_light = ellipsoid_sample(q, p, u);
        pdf = light.density * ellipsoid_area(q) * ellipsoid_pdf(q, p, normalize(to_light));
    } else if light.kind == CYLINDER {
        let q = &scene.primitives[light.primitive as usize];
        let point = cylinder_sample(q, p, u);
        to_light = point.to;
        pdf = solid_angle_pdf(light.density * cylinder_share(q, p), to_light, point.normal);
    } else if !is_delta {
        pdf = solid_angle_pdf(pdf, to_light, light.normal);
        behind = (light.sides == 1) & (dot(light.normal, to_light) >= 0.0);
    }
    if scene.specialization.emission_textures != 0 && !is_delta {
        let q = &scene.primitives[light.primitive as usize];
        let uv = primitive_uv(q, point_to_local(q, p + to_light));
        let (material, hit) = (&scene.materials[q.material as usize], hit_on_primitive(light.primitive));
        radiance = emission_at(scene, material, &standalone_hit_primitive(q), hit, uv);
    }
    if scene.specialization.alpha_surfaces != 0 && !is_delta {
        let q = &scene.primitives[light.primitive as usize];
        let uv = primitive_uv(q, point_to_local(q, p + to_light));
        let (material, hit) = (&scene.materials[q.material as usize], hit_on_primitive(light.primitive));
        radiance *= opacity_at(scene, material, &standalone_hit_primitive(q), hit, uv);
    }
    LightSample {
        to: to_light,
        radiance: if behind { Vec3::ZERO } else { radiance },
        pdf,
        is_delta,
        t_max: light.t_max,
        primitive: light.primitive,
    }
}

pub fn hit_on_primitive(primitive: u32) -> Hit {
    Hit {
        t: 0.0,
        instance: 0,
        primitive,
        slot: 0,
        barycentric: Vec2::ZERO,
    }
}

pub fn sample_face(scene: &Packed, selection: EmitterSelection, p: Vec3, u: Vec2) -> LightSample {
    let emitter = selection.emitter;
    let b = triangle_sample(u);
    let hit = Hit {
        t: 0.0,
        instance: emitter.instance,
        primitive: 0,
        slot: emitter.index,
        barycentric: b,
    };
    let face = fetch_hit_primitive(scene, hit);
    let material = material_of(scene, &face);
    let to_light = face.primitive.anchor + (face.edge_1 * b.x + face.edge_2 * b.y) - p;
    let mut radiance = material.emission;
    if scene.specialization.emission_textures != 0 {
        radiance = emission_at(scene, material, &face, hit, face_uv(&face, b));
    }
    if scene.specialization.vertex_colors != 0 && material.vertex_colors == COLORS_OF_EMISSION {
        let color = vertex_color(scene, hit);
        radiance *= Vec3::new(color.x, color.y, color.z);
    }
    if scene.specialization.alpha_surfaces != 0 {
        radiance *= opacity_at(scene, material, &face, hit, face_uv(&face, b));
    }
    let density = if scene.specialization.light_tree != 0 {
        selection.density
    } else {
        material.density
    };
    LightSample {
        to: to_light,
        radiance,
        pdf: solid_angle_pdf(density, to_light, face.primitive.z),
        is_delta: false,
        t_max: scene.environment.t_max,
        primitive: NO_INDEX,
    }
}

pub fn emission_at(scene: &Packed, material: &Material, prim: &HitPrimitive, hit: Hit, uv: Vec2) -> Vec3 {
    let mut emission = material.emission;
    for i in 0..material.lookups.y {
        let lookup = &scene.textures.lookups[(material.lookups.x + i) as usize];
        if lookup.purposes & FOR_EMISSION != 0 {
            let texture = &scene.textures.records[lookup.texture as usize];
            let footprint = Footprint {
                uv: uv_in_set(scene, uv, prim, hit, lookup.uv_set),
                dx: Vec2::ZERO,
                dy: Vec2::ZERO,
            };
            emission = texture_color(scene, texture, footprint);
        }
    }
    emission
}

pub fn emitter_pdf(prim: &HitPrimitive, hit: Hit, density: f32, ray: Ray, normal: Vec3) -> f32 {
    let q = &prim.primitive;
    if q.kind == ELLIPSOID {
        return density * ellipsoid_area(q) * ellipsoid_pdf(q, ray.origin, ray.direction);
    }
    let density = if q.kind == CYLINDER {
        density * cylinder_share(q, ray.origin)
    } else {
        density
    };
    solid_angle_pdf(density, ray.direction * hit.t, normal)
}
