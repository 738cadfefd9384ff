//! Packs a validated scene into records, and constants that specialize kernels.

mod camera;
mod emitters;
pub mod energy;
mod environment_map;
pub mod filter;
mod geometry;
mod light;
pub mod light_tree;
mod materials;
mod mesh;
mod order;
mod origin;
mod primitive;
mod pyramid;
mod shadow_casters;
mod specialize;

use bytemuck::Zeroable as _;
use glam::{UVec2, UVec4, Vec3};

pub use self::camera::pack_camera;
use self::emitters::PackedEmitters;
use self::environment_map::EnvironmentMap;
pub use self::geometry::MAX_LINEAR_PRIMITIVES;
use self::light::{DISTANT, connect_lights, pack_lights, t_max};
use self::materials::Appearances;
use self::order::SortedPrimitives;
use self::primitive::pack_shapes;
#[cfg(test)]
pub(crate) use self::primitive::primitive;
use self::specialize::Parts;
use crate::records::*;
use wgray_scene::{PixelFilter, PixelFilterKind, Scene};

/// Minimum offset of ray origins, relative to the largest coordinate: 32 ulp, the rounding error of a surface and a
/// neighbor (`docs/decisions/shadow-rays.md`).
const MIN_EPSILON: f64 = 32.0 / 16_777_216.0;

/// Packs a scene.
pub fn pack(scene: &Scene) -> Packed {
    let origin = origin::origin(&scene.camera);
    let scene = &*origin::translated_to(scene, origin);
    let mut appearances = Appearances::of(scene);
    let around = EnvironmentMap::of(scene, &mut appearances.texels);
    let mut materials = appearances.materials.clone();
    let mut primitives = pack_shapes(scene);
    let (mut lights, mut area_lights) = pack_lights(scene, &mut primitives, &mut materials);
    let order = SortedPrimitives::of(scene, primitives);
    connect_lights(&mut lights[..area_lights], order.all(), scene.shapes.len());
    let (mut trees, item_padding) = geometry::trees(scene, &order.in_bvh(), |material| {
        shadow_casters::casts_shadow(scene, material)
    });
    let mut shining = PackedEmitters::default();
    if scene.render.integrator.needs_emitters() {
        let delta_lights = &lights[area_lights..];
        shining = emitters::emitters(scene, &mut materials, delta_lights, order.all(), &trees, around.sum());
        (area_lights, lights) = (0, std::mem::take(&mut shining.lighting.lights));
    }
    for (instance, leaves) in trees.instances.iter_mut().zip(&shining.instance_leaves) {
        instance.leaves = *leaves;
    }
    let counts = Counts {
        tree: trees.rows().into(),
        item_padding,
        ..counts(
            order.outside(),
            area_lights,
            lights.len(),
            materials.len(),
            &appearances,
            (shining.lighting.emitters.len(), shining.lighting.nodes.len()),
        )
    };
    let filter_table = match is_pixel(scene.render.filter) {
        true => Vec::new(),
        false => filter::table(scene.render.filter),
    };
    let specialization = Parts {
        scene,
        appearances: &appearances,
        materials: &materials,
        area_lights,
        lights: &lights,
        shining: &shining,
        around: &around,
        trees: &trees,
        counts: &counts,
        filter_bins: filter_table.len(),
    }
    .specialization();
    let samples = scene.render.pixel_samples.count;
    let adaptive = scene.render.adaptive;
    let environment = environment(scene, &around, shining.environment);
    let primitives = order.into_primitives();
    Packed {
        origin,
        camera: pack_camera(&scene.camera, origin, scene.width, scene.height, scene.render.seed),
        integrator: scene.render.integrator,
        environment,
        bounds: primitives.iter().map(primitive::bounding_sphere).collect(),
        primitives,
        bvh: trees,
        materials,
        lighting: Lighting {
            lights,
            ..shining.lighting
        },
        counts,
        textures: PackedTextures {
            lookups: appearances.lookups,
            records: appearances.textures,
            texels: appearances.texels,
        },
        sampling: Sampling {
            filter_table,
            pixel_samples: adaptive.map_or(samples, |adaptive| adaptive.max_samples),
            adaptive: adaptive.is_some(),
        },
        specialization,
    }
}

/// Packs global values. `share` is the probability of sampling the environment map.
fn environment(scene: &Scene, around: &EnvironmentMap, share: f64) -> Environment {
    let environment = scene.environment.as_ref();
    let background = environment.and_then(|environment| environment.background);
    Environment {
        ambient: scene.render.ambient.as_vec3(),
        shadow_epsilon: scene.render.shadow_epsilon.max(MIN_EPSILON) as f32,
        background: background.unwrap_or(scene.render.background).as_vec3(),
        light_weight: 1.0 / scene.render.light_samples.count as f32,
        radiance: environment.map_or(Vec3::ZERO, |environment| environment.color.as_vec3()),
        t_max: t_max(scene.render.shadow_epsilon),
        ..around.record(share)
    }
}

/// Counts the sorted primitives of each kind, and the rows of tables.
fn counts(
    order: &[(Primitive, bool)],
    area_lights: usize,
    lights: usize,
    materials: usize,
    appearances: &Appearances,
    (emitters, light_nodes): (usize, usize),
) -> Counts {
    let mut first = 0;
    let primitives = std::array::from_fn(|kind| {
        let of_kind = order[first as usize..]
            .iter()
            .take_while(|(p, _)| p.kind == kind as u32);
        let (all, casting) = of_kind.fold((0, 0), |(all, casting), (_, casts)| {
            (all + 1, casting + u32::from(*casts))
        });
        let range = UVec4::new(first, first + casting, first + all, 0);
        first += all;
        range
    });
    let rows = |count: usize, size: usize| (count * size / size_of::<UVec4>()) as u32;
    let of_lights = rows(materials, size_of::<Material>());
    let of_textures = of_lights + rows(lights, size_of::<Light>());
    let of_emitters = of_textures + rows(appearances.textures.len(), size_of::<Texture>());
    let of_lookups = of_emitters + rows(emitters, size_of::<Emitter>());
    let of_light_nodes = of_lookups + rows(appearances.lookups.len(), size_of::<Lookup>());
    let of_leaves = of_light_nodes + rows(light_nodes, size_of::<LightNode>());
    Counts {
        primitives,
        lights: UVec2::new(area_lights as u32, lights as u32),
        tables: UVec2::new(of_lights, of_textures),
        emitters: UVec4::new(of_emitters, emitters as u32, of_light_nodes, of_leaves),
        lookups: UVec4::new(of_lookups, 0, 0, 0),
        ..Counts::zeroed()
    }
}

/// Returns true for the box filter of one pixel, which weights all samples equally.
fn is_pixel(filter: PixelFilter) -> bool {
    filter.kind == PixelFilterKind::Box && filter.radius == 0.5
}
