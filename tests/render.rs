//! GPU and CPU images agree for all scenes, configurations, sizes, seeds and sample patterns, and for every work split.

use std::ops::Range;

use glam::Vec4;
use rayon::prelude::*;
use wgray::scene::{Description, Integrator, Pattern};
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::job::WorkSplit;
use wgray_trace::film::Film;
use wgray_trace::records::{FirstHit, Packed};

use crate::adapter::{self, KNOWN_DIFFERENCES, allowed, bit_exact, judge};
use crate::nearly::{FilmDifference, MAX_OUTLIER_FRACTION};
use crate::pictures::{
    RenderMode, backend, crop, differing, exact_modes, film, first_hits, reference, render, render_with, whole,
};
use crate::{patterns, scenes, sources};

/// Returns an error if a GPU image exceeds the guaranteed tolerance.
pub fn compare(mode: RenderMode, packed: &Packed, gpu: &Film, cpu: &Film) -> Result<(), String> {
    assert_eq!((gpu.region, gpu.sums.len()), (cpu.region, cpu.sums.len()));
    let device = adapter::device().expect("the device that rendered the image");
    if !bit_exact(device) {
        return FilmDifference::loose(packed, gpu, cpu).judge();
    }
    if mode == RenderMode::Plain {
        return FilmDifference::strict(gpu, cpu).judge();
    }
    let entry = allowed(KNOWN_DIFFERENCES, &device.info.name, &device.info.driver, "picture");
    judge(entry, "picture", differing(gpu, cpu) as f64 / cpu.sums.len() as f64)
}

/// Compares first hits. On devices other than software Vulkan, compares only the shape and material indices, and
/// tolerates differences at edges.
pub fn compare_hits(gpu: &[FirstHit], cpu: &[FirstHit]) -> Result<(), String> {
    let device = adapter::device().expect("the device that rendered the image");
    assert_eq!(gpu.len(), cpu.len());
    let are_equal: fn(&FirstHit, &FirstHit) -> bool = if bit_exact(device) {
        |a, b| bytemuck::bytes_of(a) == bytemuck::bytes_of(b)
    } else {
        |a, b| (a.shape, a.material) == (b.shape, b.material)
    };
    let fraction = gpu.iter().zip(cpu).filter(|(a, b)| !are_equal(a, b)).count() as f64 / gpu.len() as f64;
    if bit_exact(device) {
        let entry = allowed(KNOWN_DIFFERENCES, &device.info.name, &device.info.driver, "first hits");
        return judge(entry, "first hits", fraction);
    }
    if fraction > MAX_OUTLIER_FRACTION {
        Err(format!("a fraction of {fraction} of the first hits differs"))
    } else {
        Ok(())
    }
}

fn configured(
    description: &Description,
    size: (u32, u32),
    seed: u32,
    pattern: Pattern,
    counts: (u32, u32),
) -> Description {
    let mut description = description.clone();
    (description.image.width, description.image.height) = size;
    description.render.seed = seed;
    description.render.pixel_samples = patterns::samples(pattern, counts.0);
    description.render.light_samples = patterns::samples(pattern, counts.1);
    description
}

/// Returns all scenes at reduced size.
pub fn small_scenes() -> Vec<(String, Packed)> {
    let reduce = |(name, mut description): (String, Description)| {
        let scale = description.image.width.max(description.image.height).div_ceil(100);
        (description.image.width, description.image.height) =
            (description.image.width / scale, description.image.height / scale);
        description.render.pixel_samples =
            patterns::samples(description.render.pixel_samples.pattern(description.integrator()), 4);
        (name, scenes::packed(&description))
    };
    scenes::descriptions().into_iter().map(reduce).collect()
}

/// Returns each scene and pattern at least once, with varied sizes, seeds and sample counts.
pub fn variations() -> Vec<(String, Packed)> {
    let (mut scenes, patterns) = (scenes::descriptions(), patterns::all());
    // Path-traced scenes are last, so that the other scenes keep their indices.
    scenes.sort_by_key(|(_, description)| description.integrator() == Integrator::Path);
    let vary = |i: usize| {
        let (name, description) = &scenes[i % scenes.len()];
        let (size, counts) = (
            [(33, 17), (64, 3), (1, 1), (8, 40)][i % 4],
            [(1, 1), (9, 4), (2, 36), (4, 100)][i % 4],
        );
        let seed = [0, 1, u32::MAX][i % 3];
        let (pattern_name, pattern) = &patterns[i % patterns.len()];
        let name = format!("{name}, {pattern_name}, seed {seed}, {size:?}, {counts:?} samples");
        (
            name,
            scenes::packed(&configured(description, size, seed, *pattern, counts)),
        )
    };
    (0..scenes.len().max(patterns.len())).map(vary).collect()
}

/// Compares the images of scenes in the given modes.
fn check_images(scenes: &[((String, Packed), &[RenderMode])]) {
    // Scenes are rendered in parallel, because a driver compiles a kernel on one thread.
    let compared = scenes.par_iter().map(|((name, packed), modes)| {
        let cpu = reference(packed);
        let (mut pixels, mut images, mut plain) = (0, 0, FilmDifference::default());
        for &mode in *modes {
            let gpu = render(packed, mode);
            let problem = compare(mode, packed, &gpu, &cpu);
            assert!(problem.is_ok(), "{name}, {mode:?}: {}", problem.unwrap_err());
            if mode == RenderMode::Plain {
                plain.add(FilmDifference::strict(&gpu, &cpu));
            } else {
                (pixels, images) = (pixels + cpu.sums.len(), images + 1);
            }
        }
        (pixels, images, plain)
    });
    let (mut pixels, mut images, mut plain) = (0, 0, FilmDifference::default());
    for result in compared.collect::<Vec<_>>() {
        (pixels, images) = (pixels + result.0, images + result.1);
        plain.add(result.2);
    }
    println!("{images} images, {pixels} pixels: within the guarantees; with plain WGSL: {plain}");
}

#[test]
fn images_of_all_scenes_agree() {
    if adapter::device().is_none() {
        return;
    }
    const MODES: &[RenderMode] = &[RenderMode::Baked, RenderMode::Buffers, RenderMode::Plain];
    let scenes: Vec<_> = small_scenes().into_iter().map(|scene| (scene, MODES)).collect();
    check_images(&scenes);
}

#[test]
fn variations_of_all_scenes_agree() {
    if adapter::device().is_none() {
        return;
    }
    // Each variation in one mode, because kernels take long to compile. The size repeats after four variations.
    const MODES: [&[RenderMode]; 2] = [&[RenderMode::Baked], &[RenderMode::Buffers]];
    let scenes = variations().into_iter().enumerate();
    let scenes: Vec<_> = scenes.map(|(i, scene)| (scene, MODES[(i + i / 4) % 2])).collect();
    check_images(&scenes);
}

#[test]
fn first_hits_of_all_scenes_agree() {
    if adapter::device().is_none() {
        return;
    }
    // Each scene in one mode, because kernels take long to compile. Random scenes are also compared with buffers.
    small_scenes().par_iter().enumerate().for_each(|(i, (name, packed))| {
        let mode = [RenderMode::Baked, RenderMode::Buffers][i % 2];
        let cpu = first_hits(packed, RenderMode::Cpu);
        let problem = compare_hits(&first_hits(packed, mode), &cpu);
        assert!(problem.is_ok(), "{name}, {mode:?}: {}", problem.unwrap_err());
    });
}

/// One number in a shader differs by one ulp, or one pixel by one bit.
#[test]
fn a_different_image_is_detected() {
    let Some(device) = adapter::device() else { return };
    let (_, packed) = small_scenes()
        .into_iter()
        .find(|(name, _)| name == "cornell.toml")
        .expect("the scene");
    let cpu = reference(&packed);
    let judge_film = |film: &Film| FilmDifference::strict(film, &cpu).judge();
    assert!(compare(RenderMode::Baked, &packed, &cpu, &cpu).is_ok());
    for (file, from, to) in [
        ("light.wgsl", "(2.0 * at.x - 1.0)", "(2.0000002 * at.x - 1.0)"),
        (
            "camera.wgsl",
            "(2.0 / f32(camera.width))",
            "(2.0000002 / f32(camera.width))",
        ),
        ("math.wgsl", "v * (1.0 / sqrt(dot(v, v)))", "v / sqrt(dot(v, v))"),
    ] {
        let shaders = sources::edited_shaders(file, from, to);
        let film = render_with(&packed, RenderMode::Baked, &shaders);
        if bit_exact(device) {
            assert!(
                compare(RenderMode::Baked, &packed, &film, &cpu).is_err(),
                "'{to}' in place of '{from}'"
            );
        }
        // The image is still within the tolerances.
        assert!(judge_film(&film).is_ok(), "'{to}' in place of '{from}'");
    }
    let mut changed = cpu.clone();
    changed.sums[77].y = f32::from_bits(changed.sums[77].y.to_bits() + 1);
    assert!(
        !bit_exact(device) || compare(RenderMode::Baked, &packed, &changed, &cpu).is_err(),
        "a difference of one bit is accepted"
    );
    let mut changed = cpu.clone();
    changed.sums.rotate_right(1);
    assert!(judge_film(&changed).is_err(), "a shifted pixel is accepted");
    let mut changed = cpu.clone();
    changed
        .sums
        .iter_mut()
        .for_each(|sum| *sum *= Vec4::new(1.00002, 1.00002, 1.00002, 1.0));
    assert!(judge_film(&changed).is_err(), "a brighter image is accepted");
    let mut changed = cpu.clone();
    changed.sums[5].x = f32::NAN;
    assert!(judge_film(&changed).is_err(), "NaN is accepted");
    let hits = first_hits(&packed, RenderMode::Cpu);
    let mut changed = hits.clone();
    changed.iter_mut().take(20).for_each(|hit| hit.shape ^= 1);
    assert!(
        compare_hits(&changed, &hits).is_err(),
        "a different shape index is accepted"
    );
}

#[test]
fn a_larger_image_agrees_on_gpu_and_cpu() {
    if adapter::device().is_none() {
        return;
    }
    let mut description = scenes::scene("cornell.toml");
    (description.image.width, description.image.height) = (401, 397);
    description.render.pixel_samples.count = 4;
    let packed = scenes::packed(&description);
    let cpu = reference(&packed);
    for mode in [RenderMode::Baked, RenderMode::Plain] {
        let gpu = render(&packed, mode);
        println!(
            "cornell.toml, 401 x 397, {mode:?}: {} of {} pixels differ; {}",
            differing(&gpu, &cpu),
            cpu.sums.len(),
            FilmDifference::strict(&gpu, &cpu)
        );
        let problem = compare(mode, &packed, &gpu, &cpu);
        assert!(problem.is_ok(), "{mode:?}: {}", problem.unwrap_err());
    }
}

/// Renders a sequence of tiles, each with a range of samples.
fn render_pieces(backend: &mut dyn Backend, region: Region, pieces: &[(Region, Range<u32>)]) -> Film {
    let mut run = || {
        backend.begin(region)?;
        for (tile, samples) in pieces {
            backend.render(*tile, samples.clone())?;
        }
        backend.film()
    };
    run().unwrap_or_else(|error: wgray::error::RenderError| panic!("{error}"))
}

fn tile(x0: u32, y0: u32, x1: u32, y1: u32) -> Region {
    Region { x0, y0, x1, y1 }
}

#[test]
fn images_do_not_depend_on_the_work_split() {
    let description = scenes::scene("lights.toml");
    for pattern in [Pattern::Grid, Pattern::Random] {
        let packed = scenes::packed(&configured(&description, (45, 37), 3, pattern, (9, 4)));
        let expected = reference(&packed);
        for mode in exact_modes() {
            let mut backend = backend(&packed, mode);
            let split = |band_pixels, samples_per_dispatch, rows_per_dispatch| WorkSplit {
                band_pixels,
                samples_per_dispatch,
                rows_per_dispatch,
            };
            for split in [
                split(45 * 10, Some(1), Some(3)),
                split(1, Some(4), None), // a band has at least one row
                split(45 * 36, None, Some(1)),
                split(u64::MAX, None, Some(40)),
            ] {
                assert_eq!(
                    differing(&film(&mut *backend, &packed, whole(&packed), &split), &expected),
                    0,
                    "{mode:?}, {split:?}"
                );
            }
            // Tiles of any shape and in any order, interrupted and resumed.
            let tiles = [
                tile(13, 20, 45, 37),
                tile(0, 0, 45, 7),
                tile(0, 7, 13, 37),
                tile(13, 7, 45, 20),
            ];
            let ranges = [0..2, 2..3, 3..9];
            let mut order: Vec<_> = tiles
                .iter()
                .flat_map(|tile| ranges.clone().map(|range| (*tile, range)))
                .collect();
            assert_eq!(
                differing(&render_pieces(&mut *backend, whole(&packed), &order), &expected),
                0,
                "{mode:?}, tiles"
            );
            order.sort_by_key(|(_, range)| range.start);
            assert_eq!(
                differing(&render_pieces(&mut *backend, whole(&packed), &order), &expected),
                0,
                "{mode:?}, samples"
            );
            // Another order of samples rounds differently.
            let film = render_pieces(
                &mut *backend,
                whole(&packed),
                &[(whole(&packed), 5..9), (whole(&packed), 0..5)],
            );
            assert!(differing(&film, &expected) > 0, "{mode:?}: the comparison cannot fail");
        }
    }
}

#[test]
fn a_crop_equals_the_region_of_the_full_image() {
    let packed = scenes::packed(&configured(
        &scenes::scene("ellipsoids.toml"),
        (67, 41),
        3,
        Pattern::Random,
        (4, 4),
    ));
    let expected = reference(&packed);
    for mode in exact_modes() {
        let mut backend = backend(&packed, mode);
        for region in [
            tile(0, 0, 1, 1),
            tile(3, 7, 60, 29),
            tile(66, 0, 67, 41),
            tile(0, 40, 67, 41),
            tile(11, 5, 30, 37),
        ] {
            let found = film(&mut *backend, &packed, region, &WorkSplit::default());
            assert_eq!(differing(&found, &crop(&expected, region)), 0, "{mode:?}, {region:?}");
        }
    }
    let moved = Film {
        region: tile(4, 7, 61, 29),
        ..crop(&expected, tile(3, 7, 60, 29))
    };
    assert!(
        differing(&moved, &crop(&expected, moved.region)) > 0,
        "the adjacent crop is equal"
    );
}

#[test]
fn images_do_not_depend_on_the_number_of_threads() {
    let description = scenes::scene("cornell.toml");
    let packed = scenes::packed(&configured(&description, (70, 31), 3, Pattern::Random, (3, 4)));
    let expected = reference(&packed);
    for threads in [1, 2, 3, 7] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        assert_eq!(
            differing(&pool.install(|| reference(&packed)), &expected),
            0,
            "{threads} threads"
        );
    }
    // Negative control: another seed gives another image.
    let reseeded = reference(&scenes::packed(&configured(
        &description,
        (70, 31),
        4,
        Pattern::Random,
        (3, 4),
    )));
    assert!(differing(&reseeded, &expected) > 0, "the comparison cannot fail");
}
