//! Random small scenes are bit-identical on both backends. A failing scene is minimized and saved.

pub mod any_scene;

use std::collections::BTreeSet;
use std::path::PathBuf;

use glam::DVec3;
use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};
use wgray::scene::{Description, Scene};
use wgray_render::gpu::compose::Shaders;

use crate::adapter::{self, bit_exact};
use crate::nearly::FilmDifference;
use crate::pictures::{RenderMode, differing, first_hits, reference, render_with};
use crate::{patterns, rounding, sources};

/// Environment variable: number of scenes. If set, each run has different scenes.
const CASES: &str = "WGRAY_TEST_CASES";

fn check(description: &Description, shaders: &Shaders) -> Result<(), String> {
    let mut packed = any_scene::packed(description);
    // Noise estimates and layers are compared only in some scenes.
    if description.render.seed % 3 == 1 {
        packed = packed.with_noise();
    }
    if description.render.seed % 9 == 1 {
        packed = packed.with_layers();
    }
    let cpu = reference(&packed);
    if !cpu.sums.iter().all(|sum| sum.is_finite()) {
        return Err("a pixel is NaN or infinite".into());
    }
    // One of the modes, because kernels take long to compile.
    let mode = match description.render.seed.is_multiple_of(2) {
        true => RenderMode::Baked,
        false => RenderMode::Buffers,
    };
    let differing_count = differing(&render_with(&packed, mode, shaders), &cpu);
    if differing_count > 0 {
        return Err(format!(
            "{differing_count} of {} pixels differ, {mode:?}",
            cpu.sums.len()
        ));
    }
    // First hits are compared only in some scenes, because they need another kernel.
    if description.render.seed.is_multiple_of(4) {
        let (gpu, cpu) = (
            first_hits(&packed, RenderMode::Buffers),
            first_hits(&packed, RenderMode::Cpu),
        );
        if bytemuck::cast_slice::<_, u8>(&gpu) != bytemuck::cast_slice::<_, u8>(&cpu) {
            return Err("the first hits differ".into());
        }
    }
    Ok(())
}

fn find_failing(cases: u32, shrinks: u32, deterministic: bool, shaders: &Shaders) -> Option<(Description, String)> {
    let config = Config {
        cases,
        max_shrink_iters: shrinks,
        failure_persistence: None,
        ..Config::default()
    };
    let mut runner = if deterministic {
        TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
    } else {
        TestRunner::new(config)
    };
    let result = runner.run(&any_scene::description(), |description| {
        check(&description, shaders).map_err(TestCaseError::fail)
    });
    match result {
        Ok(()) => None,
        Err(TestError::Fail(reason, description)) => Some((description, reason.to_string())),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
}

/// Saves a scene for `wgray render`.
fn save(description: &Description, name: &str) -> PathBuf {
    let path = any_scene::folder().join(name);
    std::fs::write(&path, toml::to_string(description).expect("a scene as TOML")).expect("a file for the scene");
    path
}

#[test]
fn random_scenes_are_bit_identical_on_gpu_and_cpu() {
    if !adapter::device().is_some_and(bit_exact) {
        return;
    }
    let cases = std::env::var(CASES).ok();
    let count = cases
        .as_deref()
        .map_or(16, |n| n.parse().expect("WGRAY_TEST_CASES is a number"));
    if let Some((description, reason)) = find_failing(count, 300, cases.is_none(), sources::shaders()) {
        let path = save(&description, "failing-scene.toml");
        panic!("{reason}: wgray render {}", path.display());
    }
    println!("{count} random scenes, baked or with buffers: all pixels are bit-identical");
}

/// The scenes have so many samples that some drivers would terminate the loops of a dispatch.
#[test]
fn random_scenes_with_many_samples_are_bit_identical() {
    if !adapter::device().is_some_and(bit_exact) {
        return;
    }
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = any_scene::description();
    for case in 0..5 {
        let mut description = strategy.new_tree(&mut runner).expect("a scene").current();
        (description.image.width, description.image.height) = (3, 2);
        let integrator = description.integrator();
        let (pixel, light) = (&description.render.pixel_samples, &description.render.light_samples);
        let [pixel, light] = [pixel, light].map(|samples| samples.pattern(integrator));
        description.render.light_samples = patterns::samples(light, 256);
        match &mut description.render.adaptive {
            Some(adaptive) => adaptive.max_samples = Some(1024),
            None => description.render.pixel_samples = patterns::samples(pixel, 576),
        }
        if let Err(reason) = check(&description, sources::shaders()) {
            let path = save(&description, "failing-scene-of-many-samples.toml");
            panic!("case {case}: {reason}: wgray render {}", path.display());
        }
    }
}

/// All scenes together are within the tolerances with plain WGSL, on devices other than software Vulkan, and with
/// imprecise quotients and square roots. The scenes have only direct light, because one ulp may change a path after a
/// bounce.
#[test]
fn random_scenes_are_within_tolerance_without_guaranteed_bits() {
    let Some(device) = adapter::device() else { return };
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = any_scene::direct_light_description();
    let (mut plain, mut imprecise, mut shifted) = (
        FilmDifference::default(),
        FilmDifference::default(),
        FilmDifference::default(),
    );
    // The placements of a scene share its kernels.
    let placements = [
        (1.0, DVec3::ZERO),
        (1.25, DVec3::new(0.5, -0.25, 0.75)),
        (0.8, DVec3::new(-0.3, 0.6, 0.1)),
        (1.5, DVec3::new(-0.7, -0.4, 0.2)),
        (0.6, DVec3::new(0.9, 0.1, -0.5)),
    ];
    let scenes = (0..5).flat_map(|_| {
        let description = strategy.new_tree(&mut runner).expect("a scene").current();
        placements.map(|(scale, offset)| {
            let mut description = description.clone();
            any_scene::scale_and_translate(&mut description, scale, offset);
            description
        })
    });
    for description in scenes {
        let packed = any_scene::packed(&description);
        let cpu = reference(&packed);
        let with_plain_wgsl = render_with(&packed, RenderMode::Plain, sources::shaders());
        if bit_exact(device) {
            plain.add(FilmDifference::strict(&with_plain_wgsl, &cpu));
            let found = render_with(&packed, RenderMode::Rounded, rounding::imprecise_shaders());
            imprecise.add(FilmDifference::loose(&packed, &found, &cpu));
        } else {
            plain.add(FilmDifference::loose(&packed, &with_plain_wgsl, &cpu));
            imprecise.add(FilmDifference::loose(
                &packed,
                &render_with(&packed, RenderMode::Buffers, sources::shaders()),
                &cpu,
            ));
        }
        let mut shifted_film = cpu.clone();
        shifted_film.sums.rotate_right(1);
        shifted.add(FilmDifference::loose(&packed, &shifted_film, &cpu));
    }
    println!("random scenes: with plain WGSL {plain}; with imprecise quotients {imprecise}");
    assert!(plain.judge().is_ok(), "plain WGSL: {}", plain.judge().unwrap_err());
    assert!(
        imprecise.judge().is_ok(),
        "imprecise quotients: {}",
        imprecise.judge().unwrap_err()
    );
    assert!(shifted.judge().is_err(), "the comparison cannot fail");
}

/// One constant in a shader is changed by one ulp. The reported scene is valid.
#[test]
fn random_scenes_detect_a_difference_of_one_ulp() {
    if !adapter::device().is_some_and(bit_exact) {
        return;
    }
    let shaders = sources::edited_shaders("camera.wgsl", "y = 1.0 - at.y", "y = 1.0000001 - at.y");
    let (description, reason) = find_failing(40, 10, true, &shaders).expect("a scene that differs");
    assert!(reason.contains("pixels differ"), "{reason}");
    let path = save(&description, "scene-of-a-negative-control.toml");
    let scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(wgray_render::pack::pack(&scene), any_scene::packed(&description));
}

/// Random scenes contain every type of the parser, except `EXCLUDED`.
#[test]
fn random_scenes_cover_every_type() {
    const EXCLUDED: &[(&str, &str)] = &[
        ("image", "needs files; tests/textures compares images on both backends"),
        (
            "gltf",
            "needs files; tests/gltf compares the content of the files on both backends",
        ),
    ];
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = any_scene::description();
    let mut found = BTreeSet::new();
    for _ in 0..300 {
        let description = strategy.new_tree(&mut runner).expect("a scene").current();
        let text = toml::to_string(&description).expect("a scene as TOML");
        found.extend(
            text.lines()
                .filter_map(|line| line.strip_prefix("type = "))
                .map(|t| t.trim_matches('"').to_string()),
        );
        found.extend(
            text.lines()
                .filter_map(|l| l.strip_prefix("pattern = "))
                .map(|t| t.trim_matches('"').to_string()),
        );
    }
    let mut types: BTreeSet<String> = patterns::all().into_iter().map(|(name, _)| name).collect();
    let files = sources::path("crates/scene/src/description")
        .read_dir()
        .expect("the folder of the descriptions");
    let files = files.map(|entry| entry.expect("a file").path());
    for file in files {
        let text = std::fs::read_to_string(file).expect("the descriptions");
        let tags = text
            .lines()
            .filter_map(|line| line.trim().strip_prefix('"')?.split_once("\" => "));
        types.extend(
            tags.filter(|(_, variant)| variant.ends_with("Description),"))
                .map(|(tag, _)| tag.to_string()),
        );
    }
    assert!(types.len() > 15, "the types were not found: {types:?}");
    types.retain(|name| !EXCLUDED.iter().any(|(excluded, _)| excluded == name));
    let missing: Vec<_> = types.difference(&found).collect();
    assert!(missing.is_empty(), "no random scene contains {missing:?}");
}
