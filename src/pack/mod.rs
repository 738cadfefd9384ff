//! The plain bytes that both backends read, and the constants that a kernel is compiled for.

mod appearance;
mod blocking;
mod bounds;
mod constants;
mod emitters;
mod energy;
mod extent_tree;
pub mod filter;
mod geometry;
mod layout;
pub mod light_tree;
mod mesh;
mod origin;
mod pyramid;
mod record;
mod specialization;
mod surroundings;
pub mod tree;

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;
use std::sync::Arc;

use bytemuck::Zeroable as _;
use glam::{DMat3, DVec3, UVec2, UVec4, Vec3, Vec4};

use self::appearance::Appearances;
pub use self::constants::*;
use self::emitters::Shining;
pub use self::geometry::MOST_OUTSIDE;
pub use self::layout::*;
pub use self::mesh::PackedMesh;
pub use self::record::{Field, Record};
pub use self::specialization::Specialization;
use self::surroundings::Surroundings;
use crate::cpu::lobe::is_polished;
use crate::film::Form;
use crate::scene::{
    self, Geometry, Integrator, Parallelogram, Pattern, PixelFilter, PixelFilterKind, Projection, Reflection, Samples,
    Scene,
};

/// How far shadow rays to a directional light go: beyond any scene, yet small enough to be squared.
const DISTANT: f32 = 1e10;

/// Rays start at least so far above a surface, relative to the largest coordinate, 32 units of rounding: what the
/// surface's own arithmetic and a neighbour's lose together (`docs/decisions/shadow-rays.md`).
const LEAST_EPSILON: f64 = 32.0 / 16_777_216.0;

/// Shadow rays end at least so far before a light's sample, as a part of the way: a light may lie on a surface.
const BEFORE_LIGHT: f64 = 1e-5;

/// A spot's light falls off over at least so much of the cosine.
const LEAST_FALLOFF: f64 = 1e-12;

/// A scene as both backends read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// Where coordinates are counted from: a point of the scene file's space.
    pub origin: DVec3,
    /// The camera.
    pub camera: Camera,
    /// What light is simulated.
    pub integrator: Integrator,
    /// What belongs to the scene as a whole.
    pub environment: Environment,
    /// The primitives, lights' rectangles among them: those outside of the tree, sorted by kind and in each kind by whether they
    /// can cast a shadow, then those in it.
    pub primitives: Vec<Primitive>,
    /// A sphere around each primitive.
    pub bounds: Vec<Sphere>,
    /// The tree over all instances of meshes, and over the bounded primitives where these are many.
    pub nodes: Vec<Node>,
    /// What it is over, in the order of its leaves.
    pub items: Vec<Item>,
    /// The meshes in the world.
    pub instances: Vec<Instance>,
    /// The meshes.
    pub meshes: Vec<Arc<PackedMesh>>,
    /// For each group of each instance its material, and [`NO_SHADOW`].
    pub group_words: Vec<u32>,
    /// The materials of the scene, then one for each area light.
    pub materials: Vec<Material>,
    /// The lights, rectangles first; each knows the primitive that shines. Under the integrator `path` every primitive that
    /// shines is one.
    pub lights: Vec<Light>,
    /// Under the integrator `path`, what light is sampled of: the table by which one is chosen.
    pub emitters: Vec<Emitter>,
    /// The tree over what shines where that is much, which is then one of the emitters.
    pub light_nodes: Vec<LightNode>,
    /// Of each primitive, and of each triangle of the instances of meshes that shine, the number of its node in that tree, else [`NOTHING`].
    pub light_leaves: Vec<u32>,
    /// How many there are of all these, and where.
    pub counts: Counts,
    /// What materials look up in textures.
    pub lookups: Vec<Lookup>,
    /// The textures that materials look up.
    pub textures: Vec<Texture>,
    /// Their images: tables of places, and texels.
    pub texels: Vec<u32>,
    /// The filter's bins ([`filter::table`]); none if it is the box of the pixel.
    pub filter_table: Vec<Vec4>,
    /// Samples of every pixel; under adaptive sampling the most that one gets.
    pub pixel_samples: u32,
    /// Whether sampling is adaptive.
    pub adaptive: bool,
    /// The constants.
    pub specialization: Specialization,
}

impl Packed {
    /// Samples of light at every hit, over all lights; a point or directional light counts 1. Under the integrator `path` one of all.
    pub fn light_samples(&self) -> u64 {
        if self.integrator == Integrator::Path {
            return u64::from(!self.emitters.is_empty());
        }
        let (area_lights, lights) = (self.counts.lights.x, self.counts.lights.y);
        u64::from(area_lights) * u64::from(self.specialization.light_samples) + u64::from(lights - area_lights)
    }

    /// The same scene, and a film that has layers. Without effect under another integrator than `path`, which alone has them.
    #[must_use]
    pub fn with_layers(mut self) -> Packed {
        self.specialization.layers = (self.integrator == Integrator::Path).into();
        self
    }

    /// The same scene, and a film without layers. The colours are the same.
    #[must_use]
    pub fn without_layers(mut self) -> Packed {
        self.specialization.layers = 0;
        self
    }

    /// Whether the picture has alpha: its background is transparent.
    pub fn has_alpha(&self) -> bool {
        self.specialization.alpha != 0
    }

    /// What its film has beside the sums.
    pub fn form(&self) -> Form {
        Form {
            adaptive: self.adaptive,
            layers: self.specialization.layers != 0,
        }
    }

    /// Whether another scene is the same, seen by whatever camera.
    pub fn same_but_camera(&self, other: &Packed) -> bool {
        let Packed {
            origin,
            camera: _,
            integrator,
            environment,
            primitives,
            bounds,
            nodes,
            items,
            instances,
            meshes,
            group_words,
            materials,
            lights,
            emitters,
            light_nodes,
            light_leaves,
            counts,
            lookups,
            textures,
            texels,
            filter_table,
            pixel_samples,
            adaptive,
            specialization,
        } = self;
        let same_meshes = || {
            let mut pairs = meshes.iter().zip(&other.meshes);
            meshes.len() == other.meshes.len() && pairs.all(|(a, b)| Arc::ptr_eq(a, b) || a == b)
        };
        (origin, environment, counts, specialization)
            == (&other.origin, &other.environment, &other.counts, &other.specialization)
            && (primitives, bounds, materials, lights, emitters)
                == (
                    &other.primitives,
                    &other.bounds,
                    &other.materials,
                    &other.lights,
                    &other.emitters,
                )
            && (light_nodes, light_leaves) == (&other.light_nodes, &other.light_leaves)
            && (lookups, textures, texels, filter_table)
                == (&other.lookups, &other.textures, &other.texels, &other.filter_table)
            && (integrator, pixel_samples, adaptive) == (&other.integrator, &other.pixel_samples, &other.adaptive)
            && (nodes, items, instances, group_words)
                == (&other.nodes, &other.items, &other.instances, &other.group_words)
            && same_meshes()
    }

    /// The kinds of primitives that there are, each with where its primitives are.
    pub fn kinds(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.z as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }

    /// The kinds of primitives that can cast a shadow, each with where these are.
    pub fn shadow_casters(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        let kinds = (0..).zip(self.counts.primitives);
        let ranges = kinds.map(|(kind, range)| (kind, range.x as usize..range.y as usize));
        ranges.filter(|(_, range)| !range.is_empty())
    }
}

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
            background: scene.render.background.as_vec3(),
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

/// Tells the lights that have an area which primitives shine.
fn connect_lights(lights: &mut [Light], order: &[(Primitive, bool)], shapes: usize) {
    let mut of_number: BTreeMap<u32, u32> = BTreeMap::new();
    for (i, light) in (0..).zip(&*lights) {
        of_number.insert(light.number, i);
    }
    for (i, (primitive, _)) in (0..).zip(order) {
        let number = primitive.shape.checked_sub(shapes as u32);
        if let Some(light) = number.and_then(|number| of_number.get(&number)) {
            lights[*light as usize].primitive = i;
        }
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

/// A camera for a picture of `width` x `height` pixels, by coordinates from `origin`.
pub fn pack_camera(camera: &scene::Camera, origin: DVec3, width: u32, height: u32, seed: u32) -> Camera {
    let aspect = match camera.projection {
        Projection::Panorama => 1.0, // right and up are unit vectors
        _ => f64::from(width) / f64::from(height),
    };
    let (projection, half_height) = match camera.projection {
        Projection::Perspective { fov } => (PERSPECTIVE, (fov / 2.0).tan()),
        Projection::Orthographic { height } => (ORTHOGRAPHIC, height / 2.0),
        Projection::Panorama => (PANORAMA, 1.0),
    };
    let lens = camera.lens;
    // A polygon's first corner is at its top.
    let (sin, cos) = lens
        .filter(|lens| lens.blades > 0)
        .map_or((0.0, 1.0), |lens| (FRAC_PI_2 + lens.rotation).sin_cos());
    let radius = lens.map_or(0.0, |lens| lens.radius);
    Camera {
        position: (camera.position - origin).as_vec3(),
        projection,
        right: (camera.right * half_height * aspect).as_vec3(),
        width,
        up: (camera.up * half_height).as_vec3(),
        height,
        forward: camera.forward.as_vec3(),
        seed,
        lens_u: ((camera.right * cos + camera.up * sin) * radius).as_vec3(),
        blades: lens.map_or(0, |lens| lens.blades),
        lens_v: ((camera.up * cos - camera.right * sin) * radius).as_vec3(),
        inverse_focus: lens.map_or(0.0, |lens| 1.0 / lens.focus) as f32,
    }
}

fn is_specular(material: &scene::Material) -> bool {
    match material.reflection {
        Reflection::Phong { .. } | Reflection::Diffuse { .. } => false,
        Reflection::Mirror { .. } | Reflection::Glass { .. } => true,
        Reflection::Conductor { .. } | Reflection::Dielectric { .. } => true,
        Reflection::Principled(_) => false,
    }
}

/// Bits of the largest shininess, if all are whole numbers so small that squaring beats the general power.
fn exponent_bits(described: &[scene::Material], packed: &[Material]) -> u32 {
    let whole = described.iter().all(|material| {
        if let Reflection::Phong { shininess, .. } = &material.reflection {
            return shininess.fract() == 0.0 && *shininess <= 4096.0;
        }
        true
    });
    let largest = packed.iter().map(|material| material.exponent).max().unwrap_or(1);
    if whole { u32::BITS - largest.leading_zeros() } else { 0 }
}

/// Bits of the kinds of materials that may mirror or refract alone.
fn delta_kinds(materials: &[Material], appearances: &Appearances) -> u32 {
    let may = |material: &&Material| {
        let textured = appearances.has_lookup(material, FOR_ROUGHNESS);
        let faceted = FACET_KINDS >> material.kind & 1 != 0;
        SPECULAR_KINDS >> material.kind & 1 != 0 || faceted && (textured || is_polished(material))
    };
    materials
        .iter()
        .filter(may)
        .fold(0, |bits, material| bits | 1 << material.kind)
}

/// What the integrator `path` takes as constants, of itself.
fn of_paths(
    scene: &Scene,
    materials: &[Material],
    appearances: &Appearances,
    shining: &Shining,
    lights: &[Light],
) -> Specialization {
    let any = |test: fn(&Material) -> bool| u32::from(materials.iter().any(test));
    let has_lookup = |purpose: u32| u32::from(appearances.have_lookup(purpose));
    let emitters = &shining.emitters;
    let meshes_shine =
        emitters.iter().any(|emitter| emitter.instance != 0) || shining.nodes.iter().any(|node| node.instance != 0);
    Specialization {
        materials: materials.iter().fold(0, |bits, material| bits | 1 << material.kind),
        rough: any(|material| material.kind == DIFFUSE && material.roughness > 0.0) | has_lookup(FOR_ROUGHNESS),
        delta_kinds: delta_kinds(materials, appearances),
        anisotropic: any(|material| material.anisotropy > 0.0) | has_lookup(FOR_ANISOTROPY),
        lobes: lobes(materials, appearances),
        sees_through: any(|material| material.alpha_mode != OPAQUE),
        absorption: any(|material| material.absorption != Vec3::ZERO),
        shines: any(|material| material.density > 0.0),
        emitters: emitters.len().min(2) as u32,
        light_tree: (!shining.nodes.is_empty()).into(),
        emitter_kinds: lights.iter().fold(u32::from(meshes_shine) << INSTANCE, |bits, light| {
            bits | 1 << light.kind
        }),
        emission_textures: has_lookup(FOR_EMISSION),
        rr_depth: scene.render.rr_depth,
        most_indirect: scene.render.clamp.map_or(0, |clamp| (clamp as f32).to_bits()),
        alpha: scene.render.alpha.into(),
        layers: scene.render.alpha.into(),
        ..Specialization::default()
    }
}

/// The lobes that any principled material has.
fn lobes(materials: &[Material], appearances: &Appearances) -> u32 {
    let principled = || materials.iter().filter(|material| material.kind == PRINCIPLED);
    let lobe = |lobe: u32, textured: u32, has: fn(&Material) -> bool| {
        let there = principled().any(has) || principled().next().is_some() && appearances.have_lookup(textured);
        if there { lobe } else { 0 }
    };
    lobe(LOBE_SPECULAR, FOR_METALLIC | FOR_WEIGHT, |m| {
        m.metallic > 0.0 || m.specular_weight > 0.0
    }) | lobe(LOBE_TRANSMISSION, FOR_TRANSMISSION, |m| m.transmission > 0.0)
        | lobe(LOBE_COAT, FOR_COAT, |m| m.clearcoat > 0.0)
        | lobe(LOBE_SHEEN, FOR_SHEEN, |m| m.sheen != Vec3::ZERO)
        | lobe(LOBE_ANISOTROPY, FOR_ANISOTROPY, |m| m.anisotropy > 0.0)
}

/// Where shadow rays to a point of a light end, as a multiple of the way.
fn reach(shadow_epsilon: f64) -> f32 {
    (1.0 - shadow_epsilon.max(BEFORE_LIGHT)) as f32
}

fn pack_light(light: &scene::Light, number: u32, shadow_epsilon: f64) -> Light {
    let reach = reach(shadow_epsilon);
    let unit = Light {
        finite: 1.0,
        reach,
        primitive: NOTHING,
        number,
        ..Light::zeroed()
    };
    match light {
        scene::Light::Rectangle { rectangle, color, .. } => Light {
            center: rectangle.center.as_vec3(),
            u: rectangle.u.as_vec3(),
            v: rectangle.v.as_vec3(),
            color: color.as_vec3(),
            ..unit
        },
        scene::Light::Point { position, color } => Light {
            center: position.as_vec3(),
            color: color.as_vec3(),
            kind: POINT,
            ..unit
        },
        scene::Light::Directional { direction, color } => Light {
            center: -direction.as_vec3(),
            finite: 0.0,
            reach: DISTANT,
            color: color.as_vec3(),
            kind: DIRECTIONAL,
            ..unit
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
            cone: below_one(*cone) as f32,
            falloff: (1.0 / (below_one(*cone) - below_one(*inner)).max(LEAST_FALLOFF)) as f32,
            ..unit
        },
    }
}

/// 1 minus the cosine of an angle, without what that loses of small ones.
pub(crate) fn below_one(angle: f64) -> f64 {
    2.0 * (angle / 2.0).sin().powi(2)
}

fn pack_shapes(scene: &Scene) -> Vec<Primitive> {
    let mut primitives = Vec::new();
    for (number, shape) in scene.shapes.iter().enumerate() {
        let (material, number) = (shape.material as u32, number as u32);
        match &shape.geometry {
            Geometry::Rectangle(rectangle) => {
                primitives.push(parallelogram(RECTANGLE, rectangle, material, number));
            }
            Geometry::Disk(disk) => primitives.push(parallelogram(DISK, disk, material, number)),
            Geometry::Ellipsoid { center, axes } => {
                let [a, b, c] = *axes;
                primitives.push(primitive(
                    ELLIPSOID,
                    *center,
                    DMat3::from_cols(a, b, c),
                    material,
                    number,
                ));
            }
            Geometry::Triangles(triangles) => {
                for &[v0, v1, v2] in triangles {
                    let (a, b) = (v1 - v0, v2 - v0);
                    let columns = DMat3::from_cols(a, b, a.cross(b).normalize());
                    primitives.push(primitive(TRIANGLE, v0, columns, material, number));
                }
            }
            Geometry::Mesh { .. } => {}
            Geometry::Plane {
                point,
                tangent,
                bitangent,
            } => {
                let columns = DMat3::from_cols(*tangent, *bitangent, tangent.cross(*bitangent));
                primitives.push(primitive(PLANE, *point, columns, material, number));
            }
        }
    }
    primitives
}

fn parallelogram(kind: u32, p: &Parallelogram, material: u32, shape: u32) -> Primitive {
    primitive(
        kind,
        p.center,
        DMat3::from_cols(p.u, p.v, p.u.cross(p.v).normalize()),
        material,
        shape,
    )
}

/// The primitive whose local space is mapped to the world by `columns` and then `center`. An ellipsoid's anchor is the
/// point of it on the way from its centre to the origin.
pub(crate) fn primitive(kind: u32, center: DVec3, columns: DMat3, material: u32, shape: u32) -> Primitive {
    let to_local = columns.inverse();
    let rows = to_local.transpose();
    let (mut anchor, mut middle) = (center.as_vec3(), DVec3::ZERO);
    if kind == ELLIPSOID {
        let outwards = (to_local * -center).normalize_or(DVec3::X);
        anchor = (center + columns * outwards).as_vec3();
        middle = to_local * (center - anchor.as_dvec3());
    }
    Primitive {
        anchor,
        material,
        x: rows.x_axis.as_vec3(),
        shape,
        y: rows.y_axis.as_vec3(),
        kind,
        z: rows.z_axis.as_vec3(),
        determinant: rows.determinant() as f32,
        middle: middle.as_vec3(),
        level: (middle.length_squared() - 1.0) as f32,
    }
}
