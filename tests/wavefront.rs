//! Tests that the wavefront of the CPU backend and the scalar integrator trace bit-identical paths.

use std::fmt::Write as _;
use std::sync::Arc;

use glam::{UVec2, Vec3, Vec4};
use proptest::strategy::{Strategy as _, ValueTree as _};
use proptest::test_runner::TestRunner;
use wgray::scene::Integrator;
use wgray_trace::cpu::decoded_bvhs::{are_decoded, decode_bvhs, decode_bvhs_up_to};
use wgray_trace::cpu::integrators::path::{path_layers, path_value};
use wgray_trace::cpu::pixel::{Layers, pixel_radiance};
use wgray_trace::cpu::wavefront::{LaneHits, MaterialKind, SurfaceKind, Wavefront};
use wgray_trace::records::{
    CULL_BACKFACE, CULL_BOTH_FACES, DIFFUSE, EMITTER, ENERGY_SIZE, GLASS, LOBE_ANISOTROPY, LOBE_COAT, LOBE_SHEEN,
    LOBE_SPECULAR, LOBE_TRANSMISSION, METAL, MIRROR, Material, NO_COLORS, NO_INDEX, OPAQUE, PRINCIPLED, Packed, RANDOM,
    ROUGH_GLASS, SOBOL, THIN,
};

use crate::random_scenes::any_scene;
use crate::scenes;

/// Number of generated scenes, about half of which use the integrator `path`.
const SCENES: usize = 600;

/// Bits of the radiance and of the layers of a path.
type PathBits = ([u32; 4], [[u32; 4]; 5]);

fn bits(value: Vec4, layers: Layers) -> PathBits {
    let words = |v: Vec4| v.to_array().map(f32::to_bits);
    let Layers {
        emission,
        direct,
        indirect,
        albedo,
        normal,
    } = layers;
    (words(value), [emission, direct, indirect, albedo, normal].map(words))
}

/// Returns `count` camera samples of every `step`-th pixel in every `step`-th row.
fn samples(packed: &Packed, step: u32, count: u32) -> Vec<(UVec2, u32)> {
    let (width, height) = (packed.camera.width, packed.camera.height);
    let rows = (0..height).step_by(step as usize);
    let pixels = rows.flat_map(|y| (0..width).step_by(step as usize).map(move |x| UVec2::new(x, y)));
    pixels
        .flat_map(|pixel| (0..count).map(move |sample| (pixel, sample)))
        .collect()
}

fn wavefront(packed: &Packed, samples: &[(UVec2, u32)], batch_size: usize) -> Vec<PathBits> {
    decode_bvhs(packed);
    wavefront_with_hits(packed, samples, batch_size).0
}

/// Returns the bits of the paths, and the numbers of hits shaded in lanes.
fn wavefront_with_hits(packed: &Packed, samples: &[(UVec2, u32)], batch_size: usize) -> (Vec<PathBits>, LaneHits) {
    let mut wavefront = Wavefront::new(packed);
    let mut paths = Vec::new();
    for samples in samples.chunks(batch_size) {
        let traced = wavefront.trace(packed, samples.iter().copied());
        paths.extend(traced.iter().map(|path| bits(path_value(path), path_layers(path))));
    }
    (paths, wavefront.lane_hits())
}

fn scalar(packed: &Packed, samples: &[(UVec2, u32)]) -> Vec<PathBits> {
    let path = |&(pixel, sample): &(UVec2, u32)| {
        let (value, layers) = pixel_radiance(packed, pixel, sample);
        bits(value, layers)
    };
    samples.iter().map(path).collect()
}

fn count_differing(paths: &[PathBits], expected: &[PathBits]) -> usize {
    assert_eq!(paths.len(), expected.len());
    paths.iter().zip(expected).filter(|(a, b)| a != b).count()
}

/// Makes most materials those of a kind, so that their hits are shaded in lanes. [`MaterialKind::Smooth`] stands for
/// smooth materials of all kinds. Half of these materials get no
/// emission, and two thirds get no textures. The maximum number of bounces is at least 3. A third of the scenes get a
/// pinhole camera with Sobol' points; in half of them, the camera does not see all surfaces.
fn with_lane_materials(mut packed: Packed, scene_index: usize, kind: MaterialKind) -> Packed {
    packed.specialization.bounces = packed.specialization.bounces.max(3);
    let energy_table = packed.textures.texels.len() as u32;
    let albedos = (0..2 * ENERGY_SIZE * ENERGY_SIZE).map(|i| (1.0 - 0.4 * (i % ENERGY_SIZE) as f32 / 31.0).to_bits());
    Arc::make_mut(&mut packed.textures.texels).extend(albedos);
    if scene_index.is_multiple_of(3) {
        let s = &mut packed.specialization;
        (s.pixel_pattern, s.pixel_side, s.filter_bins) = (SOBOL, s.pixel_samples, 0);
        (s.lens, s.panoramic) = (0, 0);
        s.camera_invisible = (scene_index % 2) as u32;
    }
    for (i, material) in packed.materials.iter_mut().enumerate() {
        if material.kind == EMITTER || (scene_index + i) % 4 == 3 {
            continue;
        }
        match kind {
            MaterialKind::Diffuse => {
                material.kind = DIFFUSE;
                material.diffuse = Vec3::new(0.9, 0.6, 0.3);
                material.roughness = 0.0;
            }
            MaterialKind::Principled => make_principled(material, energy_table, scene_index + i),
            MaterialKind::Metal => make_metal(material, scene_index + i),
            MaterialKind::Dielectric => make_dielectric(material, energy_table, scene_index + i),
            MaterialKind::Smooth(_) => make_smooth(material, scene_index + i),
        }
        material.alpha_mode = OPAQUE;
        if packed.specialization.camera_invisible != 0 {
            material.camera_culling = [0, CULL_BACKFACE, CULL_BACKFACE, CULL_BOTH_FACES][(scene_index + i) % 4];
        }
        if i % 2 == 0 {
            material.density = 0.0;
        }
        if (scene_index + i) % 4 != 2 {
            material.lookups.y = 0;
            material.vertex_colors = NO_COLORS;
        }
    }
    let s = &mut packed.specialization;
    s.materials |= 1 << PRINCIPLED | 1 << METAL | 1 << ROUGH_GLASS;
    if kind == MaterialKind::Principled {
        s.lobes |= LOBE_SPECULAR | LOBE_TRANSMISSION;
        s.lobes |= [LOBE_COAT, LOBE_SHEEN, LOBE_COAT | LOBE_SHEEN, 0][scene_index % 4];
        s.lobes |= if scene_index.is_multiple_of(5) {
            LOBE_ANISOTROPY
        } else {
            0
        };
    }
    if kind != MaterialKind::Diffuse && scene_index.is_multiple_of(5) {
        s.anisotropic = 1;
    }
    if matches!(kind, MaterialKind::Smooth(_)) && !scene_index.is_multiple_of(7) {
        s.differentials = 0;
    }
    packed
}

/// Makes a material `principled`; a third of the variants transmit light. `variant` selects the parameters.
fn make_principled(material: &mut Material, energy_table: u32, variant: usize) {
    let fraction = |step: usize| (variant * step % 8) as f32 / 7.0;
    material.kind = PRINCIPLED;
    material.diffuse = Vec3::new(0.9, 0.6, 0.3);
    material.specular = Vec3::new(1.0, 0.5, 1.5);
    material.sheen = Vec3::new(0.0, 0.5, 0.2) * fraction(5);
    (material.roughness, material.metallic, material.anisotropy) = (fraction(1), fraction(3), fraction(5));
    (material.clearcoat, material.clearcoat_roughness) = (fraction(3), fraction(7));
    (material.specular_weight, material.sheen_roughness, material.ior) = (fraction(7), fraction(3), 1.5);
    material.transmission = [0.0, 0.6, 0.0][variant % 3];
    material.thin = u32::from(variant.is_multiple_of(2));
    (material.energy, material.aniso_table) = (energy_table, 0);
}

/// Makes a material a rough dielectric. `variant` selects the parameters.
fn make_dielectric(material: &mut Material, energy_table: u32, variant: usize) {
    material.kind = ROUGH_GLASS;
    material.tint = Vec3::new(0.9, 0.6, 0.3);
    material.ior = [1.5, 1.1, 0.7, 2.4][variant % 4];
    material.roughness = [0.3, 0.05, 1.0, 0.6][variant % 4];
    material.anisotropy = if variant.is_multiple_of(3) { 0.7 } else { 0.0 };
    material.aniso_table = 0;
    material.energy = if variant.is_multiple_of(5) {
        NO_INDEX
    } else {
        energy_table
    };
}

/// Makes a material a mirror, a conductor, a dielectric or a thin sheet without roughness. `variant` selects the kind.
fn make_smooth(material: &mut Material, variant: usize) {
    material.kind = [MIRROR, METAL, GLASS, ROUGH_GLASS, THIN][variant % 5];
    material.tint = Vec3::new(0.9, 0.6, 0.3);
    (material.eta, material.k) = (Vec3::new(0.2, 0.4, 1.4), Vec3::new(3.9, 2.4, 1.6));
    material.ior = [1.5, 1.1, 0.7, 2.4][variant % 4];
    (material.roughness, material.anisotropy) = (0.0, 0.0);
    (material.energy, material.aniso_table) = (NO_INDEX, 0);
}

/// Makes a material a rough conductor. `variant` selects the parameters.
fn make_metal(material: &mut Material, variant: usize) {
    material.kind = METAL;
    material.tint = Vec3::new(0.9, 0.6, 0.3);
    (material.eta, material.k) = match variant % 2 {
        0 => (Vec3::ZERO, Vec3::ZERO),
        _ => (Vec3::new(0.2, 0.4, 1.4), Vec3::new(3.9, 2.4, 1.6)),
    };
    material.roughness = [0.05, 0.3, 0.6, 1.0][variant % 4];
    material.anisotropy = if variant.is_multiple_of(3) { 0.7 } else { 0.0 };
    material.aniso_table = 0;
    material.energy = if variant.is_multiple_of(5) { NO_INDEX } else { 0 };
}

/// For each feature, the number of scenes with this feature in which hits are shaded in lanes.
#[derive(Debug, Default)]
struct LaneCoverage {
    /// Cameras with Sobol' points, and with other points.
    sobol_camera: usize,
    other_camera: usize,
    camera_invisible: usize,
    /// Scenes with hits on each kind of material (rows) and surface.
    kinds: [[usize; 3]; MaterialKind::ALL.len()],
    coat: usize,
    sheen: usize,
    anisotropy: usize,
    transmission: usize,
    absorption: usize,
    emission: usize,
    without_lights: usize,
    one_emitter: usize,
    several_emitters: usize,
    light_tree: usize,
    environment_map: usize,
    roulette: usize,
    random_pattern: usize,
    textures: usize,
    alpha: usize,
    layers: usize,
}

impl LaneCoverage {
    fn add(&mut self, packed: &Packed, hits: LaneHits) {
        let s = &packed.specialization;
        // SIMD lanes compute only the rays of these cameras.
        let has_pinhole = s.lens == 0 && s.panoramic == 0;
        let has_lane_camera = has_pinhole && s.filter_bins == 0;
        let has_sobol = s.pixel_pattern == SOBOL;
        if hits == LaneHits::default() {
            return;
        }
        let mut is_principled = false;
        for (material, counts) in MaterialKind::ALL.into_iter().zip(&mut self.kinds) {
            for (surface, count) in SurfaceKind::ALL.into_iter().zip(counts) {
                let has_hits = hits.count(material, surface) > 0;
                *count += usize::from(has_hits);
                is_principled |= has_hits && material == MaterialKind::Principled;
            }
        }
        for (count, has_feature) in [
            (&mut self.sobol_camera, has_lane_camera && has_sobol),
            (&mut self.other_camera, has_lane_camera && !has_sobol),
            (&mut self.camera_invisible, has_lane_camera && s.camera_invisible != 0),
            (&mut self.coat, is_principled && s.lobes & LOBE_COAT != 0),
            (&mut self.sheen, is_principled && s.lobes & LOBE_SHEEN != 0),
            (&mut self.anisotropy, is_principled && s.lobes & LOBE_ANISOTROPY != 0),
            (
                &mut self.transmission,
                is_principled && s.lobes & LOBE_TRANSMISSION != 0,
            ),
            (&mut self.absorption, s.absorption != 0),
            (&mut self.emission, s.emissive != 0),
            (&mut self.without_lights, s.emitters == 0),
            (&mut self.one_emitter, s.emitters == 1),
            (&mut self.several_emitters, s.emitters > 1 && s.light_tree == 0),
            (&mut self.light_tree, s.light_tree != 0),
            (&mut self.environment_map, s.has_environment_map()),
            (&mut self.roulette, s.rr_depth < s.bounces),
            (&mut self.random_pattern, s.pixel_pattern == RANDOM),
            (&mut self.textures, s.lookups != 0),
            (&mut self.alpha, s.alpha_surfaces != 0),
            (&mut self.layers, s.layers != 0),
        ] {
            *count += usize::from(has_feature);
        }
    }

    fn assert_all_covered(&self) {
        let LaneCoverage {
            sobol_camera,
            other_camera,
            camera_invisible,
            kinds,
            coat,
            sheen,
            anisotropy,
            transmission,
            absorption,
            emission,
            without_lights,
            one_emitter,
            several_emitters,
            light_tree,
            environment_map,
            roulette,
            random_pattern,
            textures,
            alpha,
            layers,
        } = *self;
        let features = [
            sobol_camera,
            other_camera,
            camera_invisible,
            coat,
            sheen,
            anisotropy,
            transmission,
            absorption,
            emission,
            one_emitter,
            several_emitters,
            light_tree,
            environment_map,
            roulette,
            without_lights,
            random_pattern,
            textures,
            alpha,
            layers,
        ];
        let [diffuse, principled, metal, [0, 0, dielectrics], smooth @ ..] = kinds else {
            panic!("rough dielectrics are evaluated one by one: {self:?}");
        };
        let other_kinds = [diffuse, principled, metal];
        assert!(other_kinds.as_flattened().iter().all(|count| *count > 10), "{self:?}");
        assert!(dielectrics > 10, "{self:?}");
        assert!(smooth.as_flattened().iter().all(|count| *count > 5), "{self:?}");
        assert!(features.into_iter().all(|count| count > 5), "{self:?}");
    }
}

fn random_path_scenes() -> impl Iterator<Item = Packed> {
    let mut runner = TestRunner::deterministic();
    let scenes = (0..SCENES).map(move |_| {
        let description = any_scene::description().new_tree(&mut runner).expect("a scene");
        any_scene::packed(&description.current())
    });
    scenes.filter(|packed| packed.integrator == Integrator::Path)
}

/// Returns a scene of eight instances of a mesh and 80 spheres on a floor. The items are in a BVH.
fn scene_with_many_items() -> Packed {
    let mut text = String::from(
        r#"
        [image]
        width = 48
        height = 40
        [camera]
        position = [0, -6, 2]
        look_at = [0, 0, 0.8]
        fov = 40
        [render]
        integrator = "path"
        max_depth = 6
        pixel_samples = { count = 4 }
        [environment]
        color = [0.2, 0.3, 0.4]
        [materials.grey]
        type = "diffuse"
        color = [0.6, 0.6, 0.6]
        [materials.glass]
        type = "dielectric"
        ior = 1.5
        [[lights]]
        type = "rectangle"
        center = [0, 0, 4]
        size = [1, 1]
        normal = [0, 0, -1]
        tangent = [1, 0, 0]
        color = [9, 9, 9]
        [[shapes]]
        type = "rectangle"
        material = "grey"
        center = [0, 0, 0]
        size = [8, 8]
        normal = [0, 0, 1]
        tangent = [1, 0, 0]
        [meshes.knot]
        file = "meshes/knot.obj"
        "#,
    );
    for i in 0..8 {
        let (x, y, scale) = (f64::from(i % 4) - 1.5, f64::from(i / 4), 0.3 + 0.1 * f64::from(i));
        let material = ["grey", "glass"][i as usize % 2];
        write!(
            text,
            "[[instances]]\nmesh = \"knot\"\nmaterial = \"{material}\"\ntranslate = [{x}, {y}, 0.5]\n\
             rotate = [{0}, 20, {0}]\nscale = {scale}\n",
            40 * i
        )
        .expect("text");
    }
    for i in 0..80 {
        let (x, y) = (0.4 * f64::from(i % 10) - 1.8, 0.5 * f64::from(i / 10) - 2.0);
        write!(
            text,
            "[[shapes]]\ntype = \"sphere\"\nmaterial = \"grey\"\ncenter = [{x}, {y}, 0.15]\nradius = 0.15\n"
        )
        .expect("text");
    }
    scenes::parse(&text)
}

#[test]
fn random_scenes_have_the_paths_of_the_scalar_integrator() {
    let (mut scenes, mut meshes, mut alpha) = (0, 0, 0);
    let mut coverage = LaneCoverage::default();
    for (i, packed) in random_path_scenes().enumerate() {
        let packed = if i % 2 == 0 { packed.with_layers() } else { packed };
        let packed = if i % 3 == 0 { packed.with_noise() } else { packed }; // layers then contain the depth
        let batch_size = [1, 7, 64, 1024][i % 4];
        let kinds = &MaterialKind::ALL[..5]; // the last one stands for all smooth materials
        let with_lanes: Vec<Packed> = kinds
            .iter()
            .map(|kind| with_lane_materials(packed.clone(), i, *kind))
            .collect();
        for (packed, step) in with_lanes.iter().map(|packed| (packed, 3)).chain([(&packed, 2)]) {
            let samples = samples(packed, step, 3);
            let expected = scalar(packed, &samples);
            decode_bvhs(packed);
            let (paths, lane_hits) = wavefront_with_hits(packed, &samples, batch_size);
            let differing = count_differing(&paths, &expected);
            assert_eq!(
                differing,
                0,
                "differing paths of {} in scene {i}; {lane_hits:?}",
                samples.len()
            );
            coverage.add(packed, lane_hits);
        }
        scenes += 1;
        meshes += usize::from(!packed.bvh.meshes.is_empty());
        alpha += usize::from(packed.specialization.alpha_surfaces != 0);
    }
    assert!(
        scenes > 100 && meshes > 20 && alpha > 5,
        "{scenes} scenes: {meshes} with meshes, {alpha} with alpha"
    );
    coverage.assert_all_covered();
}

#[test]
fn scenes_have_the_paths_of_the_scalar_integrator() {
    let mut scenes = scenes::all();
    scenes.retain(|(_, packed)| packed.integrator == Integrator::Path);
    assert!(scenes.len() >= 2);
    scenes.push(("many items".into(), scene_with_many_items()));
    for (name, packed) in scenes {
        let samples = samples(&packed, packed.camera.width.div_ceil(48), 4);
        let differing = count_differing(&wavefront(&packed, &samples, 1024), &scalar(&packed, &samples));
        assert_eq!(differing, 0, "differing paths of {} in {name}", samples.len());
    }
}

#[test]
fn paths_do_not_depend_on_the_limit_of_decoding() {
    let packed = scene_with_many_items();
    let triangles: usize = packed.bvh.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let leaves = packed.bvh.items.len() + triangles;
    let samples = samples(&packed, 2, 2);
    let expected = scalar(&packed, &samples);
    for (limit, is_decoded) in [(leaves - 1, false), (leaves, true)] {
        decode_bvhs_up_to(&packed, limit);
        assert_eq!(are_decoded(&packed), is_decoded);
        let (paths, _) = wavefront_with_hits(&packed, &samples, 256);
        assert_eq!(count_differing(&paths, &expected), 0);
    }
    assert_eq!(count_differing(&scalar(&packed, &samples), &expected), 0);
}

#[test]
fn changed_scenes_are_detected() {
    let packed = scene_with_many_items();
    assert!(packed.bvh.items.len() > 70 && packed.bvh.instances.len() == 8);
    let samples = samples(&packed, 1, 2);
    let expected = scalar(&packed, &samples);
    decode_bvhs(&packed);
    let (paths, lane_hits) = wavefront_with_hits(&packed, &samples, 256);
    assert_eq!(count_differing(&paths, &expected), 0);
    for surface in SurfaceKind::ALL {
        assert!(lane_hits.count(MaterialKind::Diffuse, surface) > 50, "{lane_hits:?}");
    }
    let count_after = |change: fn(&mut Packed)| {
        let mut packed = packed.clone();
        change(&mut packed);
        count_differing(&wavefront(&packed, &samples, 256), &expected)
    };
    let found = [
        count_after(|packed| packed.camera.seed += 1),
        count_after(|packed| packed.bvh.instances[3].anchor.x += 1e-4),
        count_after(|packed| packed.environment.shadow_epsilon *= 1.5),
        count_after(|packed| packed.primitives[0].anchor.z += 1e-5),
        count_after(|packed| {
            packed
                .materials
                .iter_mut()
                .for_each(|material| material.diffuse.y *= 1.000_001)
        }),
        count_after(|packed| packed.lighting.lights[0].center.x += 1e-5),
    ];
    assert!(found.iter().all(|count| *count > 0), "{found:?}");
}
