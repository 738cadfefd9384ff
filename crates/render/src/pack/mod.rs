//! Packing: from a validated scene to the records that both backends read, and the constants that a kernel is compiled for.

mod appearance;
mod blocking;
mod bounds;
mod camera;
mod emitters;
pub mod energy;
mod extent_tree;
pub mod filter;
mod geometry;
mod kinds;
mod light;
pub mod light_tree;
mod mesh;
mod origin;
mod pyramid;
mod shape;
mod surroundings;

use bytemuck::Zeroable as _;
use glam::{UVec2, UVec4, Vec3};

use self::appearance::Appearances;
pub use self::camera::pack_camera;
use self::emitters::Shining;
pub use self::geometry::MOST_OUTSIDE;
use self::kinds::{exponent_bits, is_specular, of_paths};
use self::light::{DISTANT, connect_lights, pack_light, reach};
#[cfg(test)]
pub(crate) use self::shape::primitive;
use self::shape::{pack_shapes, parallelogram};
use self::surroundings::Surroundings;
use crate::records::*;
use wgray_scene::{self as scene, Integrator, Pattern, PixelFilter, PixelFilterKind, Projection, Samples, Scene};

/// Rays start at least so far above a surface, relative to the largest coordinate, 32 units of rounding: what the
/// surface's own arithmetic and a neighbour's lose together (`docs/decisions/shadow-rays.md`).
const LEAST_EPSILON: f64 = 32.0 / 16_777_216.0;

/// Packs a scene.
pub fn pack(scene: &Scene) -> Packed {
    let origin = origin::origin(&scene.camera);
    let scene = &*origin::seen_from(scene, origin);
    let mut appearances = Appearances::of(scene);
    let around = Surroundings::of(scene, &mut appearances.texels);
    let mut materials = appearances.materials.clone();
    let exponent_bits = exponent_bits(&scene.materials, &materials);
    let mut primitives = pack_shapes(scene);
    let mut lights = Vec::new();
    for (number, light) in scene.lights.iter().enumerate() {
        let number = number as u32;
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
                hidden: (!visible).into(),
                ..Material::zeroed()
            });
        }
        lights.push(pack_light(light, number, scene.render.shadow_epsilon));
    }
    let has_area = |light: &Light| matches!(scene.lights[light.number as usize], scene::Light::Rectangle { .. });
    lights.sort_by_key(|light| !has_area(light));
    let blocking = blocking::can_cast_shadow(scene, &primitives);
    let bounded = primitives.iter().filter(|primitive| primitive.kind != PLANE).count();
    let is_in_tree = |primitive: &Primitive| bounded > MOST_OUTSIDE && primitive.kind != PLANE;
    let mut order: Vec<(Primitive, bool)> = primitives.into_iter().zip(blocking).collect();
    order.sort_by_key(|(primitive, blocking)| (is_in_tree(primitive), primitive.kind, !blocking));
    let outside = order.partition_point(|(primitive, _)| !is_in_tree(primitive));
    let area_lights = lights.iter().filter(|light| has_area(light)).count();
    connect_lights(&mut lights[..area_lights], &order, scene.shapes.len());
    let in_tree: Vec<_> = (outside as u32..)
        .zip(&order[outside..])
        .map(|(i, (p, casts))| (i, p, *casts))
        .collect();
    let mut trees = geometry::trees(scene, &in_tree, |material| blocking::casts_shadow(scene, material));
    let is_path = scene.render.integrator == Integrator::Path;
    let mut shining = match is_path {
        true => emitters::emitters(
            scene,
            &mut materials,
            &lights[area_lights..],
            &order,
            &trees,
            around.sum(),
        ),
        false => Shining::default(),
    };
    for (instance, leaves) in trees.instances.iter_mut().zip(&shining.of_instances) {
        instance.leaves = *leaves;
    }
    let (area_lights, lights) = match is_path {
        true => (0, std::mem::take(&mut shining.lights)),
        false => (area_lights, lights),
    };
    let kinds_in_tree = trees.items.iter().fold(0, |bits, item| bits | 1 << (item.kind & 0xff));
    let counts = Counts {
        tree: trees.rows().into(),
        room: trees.room,
        ..counts(
            &order[..outside],
            area_lights,
            lights.len(),
            materials.len(),
            &appearances,
            (shining.emitters.len(), shining.nodes.len()),
        )
    };
    let kinds = |end: fn(UVec4) -> u32| {
        let kinds = (0..).zip(counts.primitives);
        kinds.fold(0, |bits, (kind, range)| bits | u32::from(end(range) > range.x) << kind)
    };
    let (pixels, light_samples) = (scene.render.pixel_samples, scene.render.light_samples);
    let adaptive = scene.render.adaptive;
    let filter_table = match is_pixel(scene.render.filter) {
        true => Vec::new(),
        false => filter::table(scene.render.filter),
    };
    let specialization = Specialization {
        primitives: kinds(|range| range.z),
        shadow_casters: kinds(|range| range.y),
        in_tree: kinds_in_tree,
        lights: u32::from(area_lights > 0)
            | u32::from(lights.len() > area_lights) << 1
            | u32::from(lights.iter().any(|light| light.kind == SPOT)) << 2,
        lens: scene.camera.lens.is_some().into(),
        panoramic: (scene.camera.projection == Projection::Panorama).into(),
        hidden: materials.iter().any(|material| material.hidden != 0).into(),
        pixel_pattern: pattern(pixels),
        pixel_side: side(pixels),
        pixel_samples: pixels.count,
        light_pattern: pattern(light_samples),
        light_side: side(light_samples),
        light_samples: light_samples.count,
        filter_bins: filter_table.len() as u32,
        first_look: adaptive.map_or(pixels.count, |adaptive| {
            first_look(scene.render.integrator, pixels.count, adaptive.max_samples)
        }),
        squared_error: adaptive
            .map_or(0.0, |adaptive| (adaptive.error * adaptive.error) as f32)
            .to_bits(),
        exponent_bits,
        bounces: if is_path || scene.materials.iter().any(is_specular) {
            scene.render.max_depth
        } else {
            0
        },
        differentials: (scene.render.ray_differentials && appearances.needs_footprints()).into(),
        lookups: appearances.lookups(scene.render.integrator).0,
        specular_lookups: appearances.lookups(scene.render.integrator).1,
        normal_maps: appearances.has_normal_maps().into(),
        uv_sets: appearances.lookups.iter().any(|lookup| lookup.uv_set != 0).into(),
        vertex_colors: (materials.iter().any(|material| material.vertex_colors != NO_COLORS)
            && trees.meshes.iter().any(|mesh| !mesh.colors.is_empty()))
        .into(),
        texture_kinds: appearances.kinds(),
        texel_formats: appearances.formats(),
        ..match is_path {
            true => Specialization {
                surroundings: around.bits(scene),
                ..of_paths(scene, &materials, &appearances, &shining, &lights)
            },
            false => Specialization::default(),
        }
    };
    let primitives: Vec<Primitive> = order.into_iter().map(|(primitive, _)| primitive).collect();
    Packed {
        origin,
        camera: pack_camera(&scene.camera, origin, scene.width, scene.height, scene.render.seed),
        integrator: scene.render.integrator,
        environment: Environment {
            ambient: scene.render.ambient.as_vec3(),
            shadow_epsilon: scene.render.shadow_epsilon.max(LEAST_EPSILON) as f32,
            background: (scene.environment.as_ref())
                .and_then(|environment| environment.background)
                .unwrap_or(scene.render.background)
                .as_vec3(),
            light_weight: 1.0 / light_samples.count as f32,
            radiance: scene
                .environment
                .as_ref()
                .map_or(Vec3::ZERO, |environment| environment.color.as_vec3()),
            reach: reach(scene.render.shadow_epsilon),
            ..around.record(shining.environment)
        },
        bounds: primitives.iter().map(bounds::sphere).collect(),
        primitives,
        nodes: trees.nodes,
        items: trees.items,
        instances: trees.instances,
        meshes: trees.meshes,
        group_words: trees.group_words,
        materials,
        lights,
        emitters: shining.emitters,
        light_nodes: shining.nodes,
        light_leaves: shining.leaves,
        counts,
        lookups: appearances.lookups,
        textures: appearances.textures,
        texels: appearances.texels,
        filter_table,
        pixel_samples: adaptive.map_or(pixels.count, |adaptive| adaptive.max_samples),
        adaptive: adaptive.is_some(),
        specialization,
    }
}

/// How many primitives of each kind there are, of those that are sorted by kind and by whether they cast shadows; and how
/// many rows the tables of records have.
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

/// The samples that adaptive sampling gives all pixels before it decides on more: a round, or as many as it takes for an
/// estimate of the variance. Where light bounces, some of it is rarely found, and few samples do not know of it.
fn first_look(integrator: Integrator, round: u32, most: u32) -> u32 {
    let least: u32 = match integrator {
        Integrator::Phong => 16,
        Integrator::Path => 64,
    };
    least.next_multiple_of(round).max(round).min(most)
}

/// Whether a filter is the pixel itself: the same weight for all samples inside.
fn is_pixel(filter: PixelFilter) -> bool {
    filter.kind == PixelFilterKind::Box && filter.radius == 0.5
}

fn pattern(samples: Samples) -> u32 {
    match samples.pattern {
        Pattern::Grid => GRID,
        Pattern::Random => RANDOM,
        Pattern::RotatedGrid => ROTATED_GRID,
        Pattern::Jittered => JITTERED,
        Pattern::Halton => HALTON,
        Pattern::Sobol => SOBOL,
    }
}

/// The side of a pattern's grid of cells, or else the number of its samples.
fn side(samples: Samples) -> u32 {
    if samples.pattern.needs_square() {
        samples.count.isqrt()
    } else {
        samples.count
    }
}
