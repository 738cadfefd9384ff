//! Detection of truncated loops. The software Vulkan of Mesa 22.3 silently ends all loops of an invocation after a
//! total of 65,535 iterations; `shaders/completion.wgsl` detects the truncation. The tests also pass on other drivers.

use wgray::error::RenderError;
use wgray::scene::{AdaptiveDescription, Description, Pattern, PlaneDescription, ShapeDescription, SphereDescription};
use wgray_render::gpu::compose::Shaders;
use wgray_render::job::{self, WorkSplit};
use wgray_trace::film::Film;
use wgray_trace::records::Packed;

use crate::pictures::{RenderMode, backend_with, differing, exact_modes, reference, render, whole};
use crate::sources::{self, edited, edited_shaders, with};
use crate::{adapter, patterns, scenes};

fn small_scene(name: &str, size: (u32, u32), pixel_samples: u32, light_samples: u32) -> Description {
    let mut description = scenes::scene(name);
    (description.image.width, description.image.height) = size;
    description.render.pixel_samples = patterns::samples(Pattern::Grid, pixel_samples);
    description.render.light_samples = patterns::samples(Pattern::Grid, light_samples);
    description
}

fn spheres(count: u32) -> Description {
    let mut description = small_scene("cornell.toml", (4, 3), 1, 1);
    let Some(material) = description.materials.keys().next().cloned() else {
        panic!("a scene without materials")
    };
    description.shapes.extend((0..count).map(|i| {
        let coordinate = |k: u32| f64::from(i.wrapping_mul(k) % 1009) / 1009.0;
        ShapeDescription::Sphere(SphereDescription {
            material: material.clone(),
            center: [
                1.8 * coordinate(7) - 0.9,
                1.8 * coordinate(31) - 0.9,
                1.8 * coordinate(131) + 0.1,
            ]
            .into(),
            radius: 0.003,
        })
    }));
    description
}

/// Returns planes below the floor, which are not in the BVH.
fn planes(count: u32) -> Description {
    let mut description = small_scene("cornell.toml", (4, 3), 1, 1);
    let Some(material) = description.materials.keys().next().cloned() else {
        panic!("a scene without materials")
    };
    description.shapes.extend((0..count).map(|i| {
        let point = [0.0, 0.0, -1.0 - f64::from(i) * 1e-3];
        ShapeDescription::Plane(PlaneDescription::new(
            &material,
            point,
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
        ))
    }));
    description
}

fn try_render(packed: &Packed, mode: RenderMode, shaders: &Shaders) -> Result<Film, RenderError> {
    let mut backend = backend_with(packed, mode, shaders);
    let mut film = Film::new(whole(packed));
    let mut output = |rendered| {
        film = rendered;
        Ok(())
    };
    job::render(
        &mut *backend,
        whole(packed),
        packed.sampling.pixel_samples,
        &WorkSplit::default(),
        &mut |_| true,
        &mut output,
    )?;
    Ok(film)
}

/// Returns shaders that loop `rounds` times in the first dispatch and add the number of iterations to the
/// red channel.
fn looping(rounds: u32) -> Shaders {
    assert_eq!(rounds % 4, 0);
    let (file, store) = ("kernels/render.wgsl", "    film[index] = sum;");
    let looping = format!(
        "    var rounds = 0u;
    for (var i = 0u; i < params.loop_probe.y * params.samples.y * {}u; i++) {{
        rounds++;
    }}
    sum.r += f32(rounds);
{store}",
        rounds / 4
    );
    edited_shaders(file, store, &looping)
}

/// Returns true if the red sums of `film` exceed those of `unedited` by `rounds`, so that no iteration is missing.
fn has_rounds(film: &Film, unedited: &Film, rounds: u32) -> bool {
    let matches = |(a, b): (&glam::Vec4, &glam::Vec4)| a.x == b.x + rounds as f32 && a.y == b.y;
    film.sums.iter().zip(&unedited.sums).all(matches)
}

/// Returns true if the driver truncates loops, tested with shaders without the check.
fn driver_truncates_loops() -> bool {
    const ROUNDS: u32 = 1_000_000;
    let packed = scenes::packed(&small_scene("cornell.toml", (2, 2), 1, 1));
    let unchecked = without_check(&looping(ROUNDS));
    let film = try_render(&packed, RenderMode::Buffers, &unchecked).expect("a film without the check");
    !has_rounds(&film, &reference(&packed), ROUNDS)
}

/// Returns shaders that always report completion.
fn without_check(shaders: &Shaders) -> Shaders {
    let text = edited(
        shaders.text("completion.wgsl"),
        "atomicStore(&completion.truncated, 1u);",
        "",
    );
    with(shaders, "completion.wgsl", &text)
}

#[test]
fn long_renders_are_complete() {
    let mut adaptive = small_scene("cornell.toml", (5, 4), 64, 64);
    adaptive.render.pixel_samples.pattern = Some(Pattern::Sobol);
    adaptive.render.adaptive = Some(AdaptiveDescription {
        error: 0.0,
        max_samples: Some(512),
    });
    for (name, description) in [
        ("many samples", small_scene("cornell.toml", (8, 4), 1024, 256)),
        ("many light samples", small_scene("cornell.toml", (6, 5), 2, 4096)),
        ("three lights", small_scene("lights.toml", (8, 5), 144, 64)),
        ("mirrors and glass", small_scene("mirror-glass.toml", (8, 6), 100, 64)),
        ("textures", small_scene("textures.toml", (8, 6), 100, 64)),
        ("many spheres", {
            let mut description = spheres(100);
            description.render.pixel_samples = patterns::samples(Pattern::Grid, 256);
            description.render.light_samples = patterns::samples(Pattern::Grid, 64);
            description
        }),
        ("adaptive", adaptive),
    ] {
        let packed = scenes::packed(&description);
        let cpu = reference(&packed);
        for mode in exact_modes().into_iter().skip(1) {
            assert_eq!(differing(&render(&packed, mode), &cpu), 0, "{name}, {mode:?}");
        }
    }
    // Software division and square roots may contain loops.
    if adapter::device().is_some_and(adapter::bit_exact) {
        let packed = scenes::packed(&small_scene("cornell.toml", (2, 2), 256, 64));
        assert_eq!(differing(&render(&packed, RenderMode::Rounded), &reference(&packed)), 0);
    }
}

#[test]
fn samples_with_too_many_iterations_are_errors_or_correct() {
    if adapter::device().is_none() {
        return;
    }
    let truncates = driver_truncates_loops();
    for (name, description, mode) in [
        (
            "light samples",
            small_scene("cornell.toml", (2, 2), 1, 65_536),
            RenderMode::Baked,
        ),
        (
            "light samples",
            small_scene("cornell.toml", (2, 2), 1, 65_536),
            RenderMode::Buffers,
        ),
        ("planes", planes(70_000), RenderMode::Buffers),
    ] {
        let packed = scenes::packed(&description);
        match try_render(&packed, mode, sources::shaders()) {
            Ok(film) => {
                assert!(!truncates, "{name}, {mode:?}: the driver truncates a loop");
                assert_eq!(differing(&film, &reference(&packed)), 0, "{name}, {mode:?}");
            }
            Err(RenderError::LoopTruncated { .. }) => assert!(
                truncates,
                "{name}, {mode:?}: truncation reported by a driver that does not truncate"
            ),
            Err(error) => panic!("{name}, {mode:?}: {error}"),
        }
    }
    let packed = scenes::packed(&planes(70_000));
    let mut backend = backend_with(&packed, RenderMode::Buffers, sources::shaders());
    match job::first_hits(&mut *backend, whole(&packed)) {
        Ok(hits) => {
            assert!(
                !truncates,
                "the driver truncates the loop over the planes of the first hits"
            );
            let cpu = crate::pictures::first_hits(&packed, RenderMode::Cpu);
            assert_eq!(
                bytemuck::cast_slice::<_, u8>(&hits),
                bytemuck::cast_slice::<_, u8>(&cpu)
            );
        }
        Err(error) => assert!(
            truncates && matches!(error, RenderError::LoopTruncated { .. }),
            "{error}"
        ),
    }
}

#[test]
fn long_loops_of_edited_shaders_are_errors_or_correct() {
    if adapter::device().is_none() {
        return;
    }
    let packed = scenes::packed(&small_scene("cornell.toml", (3, 2), 1, 1));
    let unedited = reference(&packed);
    let truncates = driver_truncates_loops();
    for (rounds, too_long) in [(4, false), (60_000, false), (66_000, true), (1_000_000, true)] {
        match try_render(&packed, RenderMode::Buffers, &looping(rounds)) {
            Ok(film) => {
                assert!(!(truncates && too_long), "{rounds} rounds: truncation not detected");
                assert!(has_rounds(&film, &unedited, rounds), "{rounds} rounds: wrong image");
            }
            Err(RenderError::LoopTruncated { .. }) => {
                assert!(
                    truncates && too_long,
                    "{rounds} rounds: truncation reported for complete loops"
                )
            }
            Err(error) => panic!("{rounds} rounds: {error}"),
        }
    }
    // Shaders that do not report completion are rejected on every driver.
    let unreported = edited_shaders("completion.wgsl", "atomicAdd(&completion.groups_done, 1u);", "");
    let device = adapter::device().expect("a device");
    let options = wgray_render::gpu::Options {
        exact: None,
        baked: false,
    };
    let error = wgray_render::gpu::Gpu::new(device, &packed, &unreported, options).err();
    assert!(matches!(error, Some(RenderError::LoopTruncated { .. })), "{error:?}");
}

#[test]
fn without_the_check_truncated_images_are_wrong() {
    if adapter::device().is_none() || !driver_truncates_loops() {
        return;
    }
    let packed = scenes::packed(&small_scene("cornell.toml", (2, 2), 1, 65_536));
    let film =
        try_render(&packed, RenderMode::Baked, &without_check(sources::shaders())).expect("a film without the check");
    assert!(differing(&film, &reference(&packed)) > 0);
}
