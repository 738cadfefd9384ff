//! Packs a validated scene into records, and into constants that specialize kernels.

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
mod shading;
mod shadow_casters;
mod specialize;

use std::sync::Arc;

use bytemuck::Zeroable as _;
use glam::{UVec2, UVec4, Vec3};

pub use self::camera::pack_camera;
use self::emitters::PackedEmitters;
use self::environment_map::EnvironmentMap;
pub use self::geometry::MAX_LINEAR_PRIMITIVES;
use self::light::{DISTANT_T_MAX, connect_lights, pack_lights, t_max};
use self::materials::Appearances;
use self::order::SortedPrimitives;
pub use self::origin::origin;
use self::primitive::pack_shapes;
pub use self::shading::PackedShading;
use self::specialize::Parts;
pub use self::specialize::with_camera_features;
use wgray_scene::{PixelFilter, PixelFilterKind, Scene};
use wgray_trace::records::*;

/// Minimum offset of ray origins, relative to the largest coordinate: 32 ulp, the rounding error of a surface and a
/// neighbor (`docs/decisions/shadow-rays.md`).
const MIN_EPSILON: f64 = 32.0 / 16_777_216.0;

/// Packs a scene.
pub fn pack(scene: &Scene) -> Packed {
    pack_with(scene, &PackedShading::of(scene))
}

/// Packs a scene, with materials, textures and environment map that are already packed.
pub fn pack_with(scene: &Scene, shading: &PackedShading) -> Packed {
    let PackedShading {
        appearances,
        environment_map,
        texels,
        ..
    } = shading;
    let _span = tracing::debug_span!("pack").entered();
    let origin = origin::origin(&scene.camera);
    let scene = &*origin::translated_to(scene, origin);
    let mut materials = appearances.materials.clone();
    let mut primitives = pack_shapes(scene);
    let (mut lights, mut area_lights) = pack_lights(scene, &mut primitives, &mut materials);
    let order = SortedPrimitives::of(scene, primitives);
    connect_lights(&mut lights[..area_lights], order.all(), scene.shapes.len());
    let (mut bvh, item_padding) = geometry::build_bvh(scene, &order.in_bvh(), |material| {
        shadow_casters::casts_shadow(scene, material)
    });
    let mut packed_emitters = PackedEmitters::default();
    if scene.render.integrator.needs_emitters() {
        let delta_lights = &lights[area_lights..];
        packed_emitters = emitters::emitters(
            scene,
            &mut materials,
            delta_lights,
            order.all(),
            &bvh,
            environment_map.sum(),
        );
        (area_lights, lights) = (0, std::mem::take(&mut packed_emitters.lighting.lights));
    }
    for (instance, leaves) in bvh.instances.iter_mut().zip(&packed_emitters.instance_leaves) {
        instance.leaves = *leaves;
    }
    let counts = Counts {
        tree: bvh.rows().into(),
        item_padding,
        ..counts(
            order.linear(),
            area_lights,
            lights.len(),
            materials.len(),
            appearances,
            (
                packed_emitters.lighting.emitters.len(),
                packed_emitters.lighting.nodes.len(),
            ),
        )
    };
    let filter_table = match is_one_pixel(scene.render.filter) {
        true => Vec::new(),
        false => filter::table(scene.render.filter),
    };
    let specialization = Parts {
        scene,
        appearances,
        materials: &materials,
        area_lights,
        lights: &lights,
        emitters: &packed_emitters,
        environment_map,
        bvh: &bvh,
        counts: &counts,
        filter_bins: filter_table.len(),
    }
    .specialization();
    let samples = scene.render.pixel_samples.count;
    let adaptive = scene.render.adaptive;
    let environment = environment(scene, environment_map, packed_emitters.environment_probability);
    let primitives = order.into_primitives();
    Packed {
        origin,
        camera: pack_camera(&scene.camera, origin, scene.width, scene.height, scene.render.seed),
        integrator: scene.render.integrator,
        environment,
        bounds: primitives.iter().map(primitive::bounding_sphere).collect(),
        primitives,
        bvh,
        materials,
        lighting: Lighting {
            lights,
            ..packed_emitters.lighting
        },
        counts,
        textures: PackedTextures {
            lookups: appearances.lookups.clone(),
            records: appearances.textures.clone(),
            texels: Arc::clone(texels),
        },
        sampling: Sampling {
            filter_table,
            pixel_samples: adaptive.map_or(samples, |adaptive| adaptive.max_samples),
            adaptive: adaptive.is_some(),
        },
        specialization,
    }
}

/// Replaces the camera of a packed scene by the camera of `scene`, whose [`origin`] must be `packed.origin`. A compiled
/// kernel can be kept if [`with_camera_features`] does not change the specialization.
pub fn set_camera(packed: &mut Packed, scene: &Scene) {
    packed.camera = pack_camera(
        &scene.camera,
        packed.origin,
        scene.width,
        scene.height,
        scene.render.seed,
    );
    packed.specialization = with_camera_features(&packed.specialization, &scene.camera);
}

/// Packs values that apply to the whole scene. `probability` is the probability of sampling the environment map.
fn environment(scene: &Scene, environment_map: &EnvironmentMap, probability: f64) -> Environment {
    let environment = scene.environment.as_ref();
    let background = environment.and_then(|environment| environment.background);
    Environment {
        ambient: scene.render.ambient.as_vec3(),
        shadow_epsilon: scene.render.shadow_epsilon.max(MIN_EPSILON) as f32,
        background: background.unwrap_or(scene.render.background).as_vec3(),
        light_weight: 1.0 / scene.render.light_samples.count as f32,
        radiance: environment.map_or(Vec3::ZERO, |environment| environment.color.as_vec3()),
        t_max: t_max(scene.render.shadow_epsilon),
        ..environment_map.record(probability)
    }
}

/// Counts the primitives of each kind outside of the BVH, and the rows of tables. `linear_primitives` must be sorted by
/// kind; within a kind, shadow casters must come first.
fn counts(
    linear_primitives: &[(Primitive, bool)],
    area_lights: usize,
    lights: usize,
    materials: usize,
    appearances: &Appearances,
    (emitters, light_nodes): (usize, usize),
) -> Counts {
    let mut first_index = 0;
    let primitives = std::array::from_fn(|kind| {
        let primitives_of_kind = linear_primitives[first_index as usize..]
            .iter()
            .take_while(|(p, _)| p.kind == kind as u32);
        let (count, casters) = primitives_of_kind.fold((0, 0), |(count, casters), (_, casts)| {
            (count + 1, casters + u32::from(*casts))
        });
        let range = UVec4::new(first_index, first_index + casters, first_index + count, 0);
        first_index += count;
        range
    });
    let rows = |count: usize, size: usize| (count * size / size_of::<UVec4>()) as u32;
    // First row of each table.
    let light_row = rows(materials, size_of::<Material>());
    let texture_row = light_row + rows(lights, size_of::<Light>());
    let emitter_row = texture_row + rows(appearances.textures.len(), size_of::<Texture>());
    let lookup_row = emitter_row + rows(emitters, size_of::<Emitter>());
    let light_node_row = lookup_row + rows(appearances.lookups.len(), size_of::<Lookup>());
    let leaf_row = light_node_row + rows(light_nodes, size_of::<LightNode>());
    Counts {
        primitives,
        lights: UVec2::new(area_lights as u32, lights as u32),
        tables: UVec2::new(light_row, texture_row),
        emitters: UVec4::new(emitter_row, emitters as u32, light_node_row, leaf_row),
        lookups: UVec4::new(lookup_row, 0, 0, 0),
        ..Counts::zeroed()
    }
}

/// Returns true for the box filter of one pixel, which weights all samples equally.
fn is_one_pixel(filter: PixelFilter) -> bool {
    filter.kind == PixelFilterKind::Box && filter.radius == 0.5
}
