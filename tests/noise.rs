//! Noise estimates of films: half sums and variances from independent computations, and equal bits on all backends.

use glam::{DVec4, UVec2, Vec3, Vec4};
use wgray::scene::{Overrides, Scene};
use wgray::{Aov, CancelToken, ChannelValues, Context, Device, Options, Picture, Session, Status};
use wgray_image::Region;
use wgray_render::job::WorkSplit;
use wgray_trace::cpu::pixel::pixel_radiance;
use wgray_trace::film::{Film, FilmLayout, Half, Layer};
use wgray_trace::records::Packed;

use crate::layers::{ADAPTIVE, SCENE, scene_with};
use crate::pictures::{backend, crop, differing, exact_modes, film, reference, render, whole};
use crate::scenes::parse;

const RANDOM: &str = "pixel_samples = { pattern = \"random\", count = 9 }";

/// The scene with direct light only, without layers.
fn phong() -> String {
    let text = SCENE
        .replace("\"path\"", "\"phong\"")
        .replace("\"diffuse\"", "\"phong\"")
        .replace("[environment]\ncolor = [0.2, 0.3, 0.5]\n", "");
    let lines = text.lines().filter(|line| !line.starts_with("emission"));
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns scenes with noise estimates, crossed with adaptive sampling, layers, integrators and filters.
fn subjects() -> Vec<(&'static str, Packed)> {
    let adaptive_phong = phong().replace("[render]", &format!("[render]\n{ADAPTIVE}"));
    let mitchell = format!("{RANDOM}\nfilter = {{ type = \"mitchell\" }}");
    let subjects = [
        ("phong", parse(&phong())),
        ("adaptive phong", parse(&adaptive_phong)),
        ("path", parse(&scene_with(RANDOM))),
        ("adaptive path", parse(&scene_with(ADAPTIVE))),
        ("path with layers", parse(SCENE).with_layers()),
        ("adaptive path with layers", parse(&scene_with(ADAPTIVE)).with_layers()),
        ("mitchell", parse(&scene_with(&mitchell)).with_layers()),
        ("alpha", parse(&scene_with("alpha = true"))),
    ];
    subjects.map(|(name, packed)| (name, packed.with_noise())).into()
}

#[test]
fn noise_estimates_do_not_depend_on_backend_or_work_split() {
    let split = |band_pixels, samples_per_dispatch, rows_per_dispatch| WorkSplit {
        band_pixels,
        samples_per_dispatch,
        rows_per_dispatch,
    };
    for (name, packed) in subjects() {
        let expected = reference(&packed);
        assert!(expected.has_noise(), "{name}");
        assert_eq!(expected.film_layout(), packed.film_layout(), "{name}");
        assert_eq!(
            expected.film_layout().lists(),
            expected.lists().filter(|list| !list.is_empty()).count()
        );
        for mode in exact_modes() {
            let mut backend = backend(&packed, mode);
            for split in [split(24 * 5, Some(3), Some(2)), split(1, Some(1), None)] {
                let found = film(&mut *backend, &packed, whole(&packed), &split);
                assert_eq!(differing(&found, &expected), 0, "{name}, {mode:?}, {split:?}");
            }
            for (x0, y0, x1, y1) in [(0, 0, 1, 1), (3, 2, 20, 11)] {
                let region = Region { x0, y0, x1, y1 };
                let found = film(&mut *backend, &packed, region, &WorkSplit::default());
                assert_eq!(
                    differing(&found, &crop(&expected, region)),
                    0,
                    "{name}, {mode:?}, {region}"
                );
            }
        }
        // Every list matters to the comparison.
        for i in 0..expected.lists().count() {
            let mut changed = expected.clone();
            let list = changed.lists_mut().nth(i).expect("a list");
            let Some(value) = list.last_mut().filter(|_| i != 2) else {
                continue; // `differing` ignores the pilot statistics
            };
            value.y += 1.0;
            assert_eq!(differing(&changed, &expected), 1, "{name}, list {i}");
        }
    }
}

#[test]
fn noise_estimates_do_not_change_the_image() {
    for (name, packed) in subjects() {
        let expected = reference(&packed.clone().without_noise());
        assert!(!expected.has_noise());
        for mode in exact_modes() {
            let mut found = render(&packed, mode);
            (found.half_sums, found.albedo_moments, found.normal_moments) = Default::default();
            // Only estimates of the noise use the depth.
            let normals = &mut found.layers[Layer::Normal as usize];
            normals.iter_mut().for_each(|normal| normal.w = 0.0);
            if !packed.sampling.adaptive {
                found.moments.clear();
            }
            let mut expected = expected.clone();
            let normals = &mut expected.layers[Layer::Normal as usize];
            normals.iter_mut().for_each(|normal| normal.w = 0.0); // -0 with negative weights
            assert_eq!(differing(&found, &expected), 0, "{name}, {mode:?}");
        }
    }
}

/// The values of a sample in f64, which are radiance, albedo, and normal with depth; and its weight.
type Sample = ([DVec4; 3], f64);

/// Returns each sample of a pixel.
fn samples(packed: &Packed, position: UVec2, count: u32) -> Vec<Sample> {
    let samples = (0..count).map(|sample| {
        let (value, layers) = pixel_radiance(packed, position, sample);
        let values = [value, layers.albedo, layers.normal].map(|value| value.as_dvec4());
        (values, f64::from(value.w))
    });
    samples.collect()
}

/// Returns the variances of the means of the three values, from two passes over samples of weight 1.
fn variances(samples: &[Sample]) -> [DVec4; 3] {
    let n = samples.len() as f64;
    std::array::from_fn(|k| {
        let mean = samples.iter().map(|(values, _)| values[k]).sum::<DVec4>() / n;
        let squares = samples
            .iter()
            .map(|(values, _)| (values[k] - mean) * (values[k] - mean));
        squares.sum::<DVec4>() / (n * (n - 1.0))
    })
}

fn is_close(found: &[f32], expected: DVec4, tolerance: f64) -> bool {
    let pairs = found.iter().zip(expected.to_array());
    pairs.into_iter().all(|(found, expected)| {
        let error = (f64::from(*found) - expected).abs();
        error <= tolerance * expected.abs() + 1e-9
    })
}

#[test]
fn variances_and_halves_match_the_samples() {
    for (name, packed) in subjects() {
        let film = reference(&packed);
        let has_unit_weights = name != "mitchell";
        let (mut differ_without_last, mut differ_from_other_half) = (0, 0);
        for (i, sum) in film.sums.iter().enumerate() {
            let position = UVec2::new(i as u32 % 24, i as u32 / 24);
            let samples = samples(&packed, position, film.sample_count(i));
            assert!(samples.len() >= 8, "{name}");
            let half_count = samples.len().next_power_of_two() / 2;
            let half = |samples: &[Sample]| samples.iter().map(|(values, _)| values[0]).sum::<DVec4>();
            let [first, second] = [half(&samples[..half_count]), half(&samples[half_count..])];
            assert!(
                is_close(&film.half_sums[i].to_array(), first, 1e-4),
                "{name}, pixel {i}"
            );
            assert!(
                is_close(&(*sum - film.half_sums[i]).to_array(), second, 1e-4),
                "{name}, pixel {i}"
            );
            differ_from_other_half += usize::from(!is_close(&film.half_sums[i].to_array(), second, 1e-3));
            if !has_unit_weights {
                continue;
            }
            for (half, sums) in [(Half::First, first), (Half::Second, second)] {
                assert!(
                    is_close(&film.half_mean(half, i), sums / sums.w, 1e-4),
                    "{name}, pixel {i}"
                );
            }
            let matches = |variances: [DVec4; 3]| {
                let [color, albedo, normal] = variances;
                let mut is_match = is_close(&film.variance(i), color, 2e-3);
                if film.has_layers() {
                    is_match &= is_close(&film.albedo_variance(i), albedo, 2e-3);
                    is_match &= is_close(&film.normal_variance(i), normal, 2e-3);
                    is_match &= is_close(&[film.depth_variance(i)], DVec4::splat(normal.w), 2e-3);
                }
                is_match
            };
            assert!(matches(variances(&samples)), "{name}, pixel {i}");
            differ_without_last += usize::from(!matches(variances(&samples[1..])));
        }
        assert!(differ_from_other_half > 100, "{name}: {differ_from_other_half}");
        assert!(
            !has_unit_weights || differ_without_last > 100,
            "{name}: {differ_without_last}"
        );
    }
}

/// With unequal weights, the moments follow the weighted recurrence.
#[test]
fn moments_of_layers_follow_the_weighted_recurrence() {
    let (_, packed) = subjects().swap_remove(6);
    let film = reference(&packed);
    for i in 0..film.sums.len() {
        let position = UVec2::new(i as u32 % 24, i as u32 / 24);
        let (mut sums, mut weight_sum, mut moments) = ([DVec4::ZERO; 3], 0.0, [DVec4::ZERO; 3]);
        for (values, weight) in samples(&packed, position, film.sample_count(i)) {
            for k in 0..3 {
                let mean = |sum: DVec4, weights: f64| if weights == 0.0 { DVec4::ZERO } else { sum / weights };
                let before = values[k] - mean(sums[k], weight_sum) * weight;
                sums[k] += values[k];
                let after = values[k] - mean(sums[k], weight_sum + weight) * weight;
                moments[k] += (before * after).max(DVec4::ZERO);
            }
            weight_sum += weight;
        }
        let found = [film.moments[i], film.albedo_moments[i], film.normal_moments[i]];
        for (k, found) in found.into_iter().enumerate() {
            let components = if k == 2 { 4 } else { 3 };
            let error = (found.as_dvec4() - moments[k]).abs().to_array();
            let scale = 1e-3 * (1.0 + moments[k].max_element());
            assert!(
                error[..components].iter().all(|error| *error < scale),
                "pixel {i}: {found}, {}",
                moments[k]
            );
        }
    }
}

/// Returns a scene of one pixel, fully covered by a rectangle at a distance of 5; `more` is nearer to the camera.
fn covered_pixel(count: u32, more: &str) -> String {
    format!(
        r#"
image = {{ width = 1, height = 1 }}
camera = {{ type = "orthographic", position = [0, -5, 0], look_at = [0, 0, 0], height = 1 }}
[render]
integrator = "path"
max_depth = 1
pixel_samples = {{ pattern = "random", count = {count} }}
[materials.m]
type = "diffuse"
color = [0.5, 0.5, 0.5]
emission = [0.5, 0.25, 4]
[materials.transparent]
type = "principled"
alpha = 0
alpha_mode = "blend"
[materials.hidden]
type = "diffuse"
color = [0.5, 0.5, 0.5]
visible = false
[[shapes]]
type = "rectangle"
material = "m"
center = [0, 0, 0]
size = [9, 9]
normal = [0, -1, 0]
tangent = [1, 0, 0]
{more}
"#
    )
}

fn rectangle(material: &str, y: f64) -> String {
    format!(
        "[[shapes]]\ntype = \"rectangle\"\nmaterial = \"{material}\"\ncenter = [0, {y}, 0]\nsize = [9, 9]\n\
         normal = [0, -1, 0]\ntangent = [1, 0, 0]\n"
    )
}

#[test]
fn the_depth_is_the_distance_along_the_camera_ray() {
    let transparent = rectangle("transparent", -1.5);
    let hidden = rectangle("hidden", -3.0);
    let both = format!("{transparent}{hidden}{}", rectangle("transparent", -4.25));
    for (more, expected) in [
        (String::new(), 5.0),
        (transparent, 5.0),
        (hidden, 5.0),
        (both, 5.0),
        (rectangle("m", -2.0), 3.0),
    ] {
        let packed = parse(&covered_pixel(4, &more)).with_layers().with_noise();
        for mode in exact_modes() {
            let film = render(&packed, mode);
            assert!(
                (film.depth(0) - expected).abs() < 1e-4,
                "{mode:?}: {}, {more}",
                film.depth(0)
            );
            assert!(film.depth_variance(0) < 1e-10, "{mode:?}: {}", film.depth_variance(0));
        }
    }
    // Samples that hit nothing have depth 0: half of the samples hit, in order of the random numbers.
    let text = covered_pixel(64, "").replace("size = [9, 9]", "size = [0.5, 9]");
    let film = reference(&parse(&text).with_layers().with_noise());
    let coverage = f64::from(film.alpha(0));
    assert!((0.25..0.75).contains(&coverage), "{coverage}");
    let (depth, variance) = (f64::from(film.depth(0)), f64::from(film.depth_variance(0)));
    assert!((depth - 5.0 * coverage).abs() < 1e-5, "{depth}");
    let expected = 25.0 * coverage * (1.0 - coverage) / 63.0;
    assert!(
        (variance / expected - 1.0).abs() < 1e-4,
        "{variance}, expected {expected}"
    );
}

/// The variance of a single sample is unknown.
#[test]
fn a_single_sample_has_an_infinite_variance() {
    for count in [1, 2] {
        let packed = parse(&covered_pixel(count, "")).with_layers().with_noise();
        for mode in exact_modes() {
            let film = render(&packed, mode);
            let expected = if count == 1 { f32::INFINITY } else { 0.0 };
            assert_eq!(film.variance(0), [expected; 3], "{mode:?}");
            assert_eq!(film.albedo_variance(0), [expected; 3], "{mode:?}");
            assert_eq!(film.normal_variance(0), [expected; 3], "{mode:?}");
            assert_eq!(film.depth_variance(0), expected, "{mode:?}");
            let first = if count == 1 { [0.0; 3] } else { [0.5, 0.25, 4.0] };
            assert_eq!(film.half_mean(Half::First, 0), first, "{mode:?}");
            assert_eq!(film.half_mean(Half::Second, 0), [0.5, 0.25, 4.0], "{mode:?}");
        }
    }
    let empty = Film::of(
        Region::whole(1, 1),
        FilmLayout {
            noise: true,
            ..FilmLayout::default()
        },
    );
    assert_eq!(
        (empty.variance(0), empty.half_mean(Half::First, 0)),
        ([f32::INFINITY; 3], [0.0; 3])
    );
    let mut invalid = empty;
    (invalid.sums[0], invalid.moments[0]) = (Vec4::splat(3.0), Vec4::new(f32::NAN, 1.0, 0.0, 3.0));
    assert_eq!(invalid.variance(0), [f32::INFINITY, 3.0 / 2.0 / 9.0, 0.0]);
}

/// The errors of the variances cancel over many pixels, because the estimate is unbiased; stratified samples have less
/// noise than the estimate.
#[test]
fn variances_are_unbiased_for_independent_samples_and_upper_bounds_for_stratified_samples() {
    let squares = |pattern: &str| {
        let settings = format!("pixel_samples = {{ pattern = \"{pattern}\", count = 16 }}");
        let packed = parse(&scene_with(&settings)).with_noise();
        let expected = reference(&parse(&scene_with(
            "pixel_samples = { pattern = \"sobol\", count = 1024 }",
        )));
        let (mut squared_error, mut estimate) = (0.0, 0.0);
        for seed in 0..8 {
            let mut packed = packed.clone();
            packed.camera.seed = seed;
            let film = reference(&packed);
            for (i, (mean, expected)) in film.means().zip(expected.means()).enumerate() {
                squared_error += f64::from((Vec3::from(mean) - Vec3::from(expected)).length_squared());
                estimate += f64::from(Vec3::from(film.variance(i)).element_sum());
            }
        }
        squared_error / estimate
    };
    let (random, sobol) = (squares("random"), squares("sobol"));
    assert!((0.85..1.15).contains(&random), "squared error per variance: {random}");
    assert!(sobol < 0.8, "squared error per variance: {sobol}");
}

/// Renders with the library, which adds noise estimates for requested statistics.
fn picture(text: &str, aovs: &[Aov], samples: u32) -> Picture {
    let overrides = Overrides {
        pixel_samples: Some(samples),
        ..Overrides::default()
    };
    let scene = Scene::parse_with(text, "s.toml", &overrides).unwrap_or_else(|error| panic!("{error}"));
    let options = Options {
        device: Device::Cpu,
        aovs: aovs.to_vec(),
        ..Options::default()
    };
    wgray::render(&scene, &options).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn statistics_need_no_adaptive_sampling() {
    let aovs = [Aov::Variance, Aov::SampleCount, Aov::Depth];
    let [picture, without_statistics] = [&aovs[..], &[]].map(|aovs| picture(SCENE, aovs, 8));
    let film = reference(&parse(SCENE).with_noise());
    let floats = |name: &str| match picture.channel(name) {
        Some(ChannelValues::Floats(values)) => values,
        _ => panic!("no floats of {name}"),
    };
    for (channel, name) in ["variance.R", "variance.G", "variance.B"].into_iter().enumerate() {
        let expected: Vec<f32> = (0..film.sums.len()).map(|i| film.variance(i)[channel]).collect();
        assert_eq!(floats(name), expected, "{name}");
    }
    assert!(floats("variance.R").iter().any(|variance| *variance > 0.0));
    let counts = picture.channel("sample_count.N");
    assert_eq!(counts, Some(ChannelValues::Whole(vec![8; film.sums.len()])));
    assert_eq!(picture.rgba8(), without_statistics.rgba8());
}

/// The variance of a single sample is infinite, in EXR files too, and white in PNG files.
#[test]
fn files_of_a_single_sample_have_an_infinite_variance() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let picture = picture(SCENE, &[Aov::Variance], 1);
    picture.save(path("a.exr")).expect("an EXR");
    let image = exr::prelude::read_first_flat_layer_from_file(path("a.exr")).expect("an EXR");
    let mut channels = image.layer_data.channel_data.list.iter();
    let variance = channels
        .find(|channel| channel.name.to_string() == "variance.G")
        .expect("the variance");
    match &variance.sample_data {
        exr::prelude::FlatSamples::F32(values) => assert!(values.iter().all(|value| *value == f32::INFINITY)),
        _ => panic!("not floats"),
    }
    picture.save(path("a.png")).expect("a PNG");
    let layer = image::open(path("a.variance.png")).expect("a PNG").to_rgb8();
    assert!(layer.pixels().all(|pixel| pixel.0 == [255; 3]));
}

/// Returns the noise of each pixel from its samples, in f64.
fn pixel_noise(packed: &Packed, count: u32, exposure: f64) -> Vec<f64> {
    let luminance = |color: DVec4| 0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z;
    let pixels = (0..packed.camera.width * packed.camera.height).map(|i| {
        let position = UVec2::new(i % packed.camera.width, i / packed.camera.width);
        let samples = samples(packed, position, count);
        let mean = samples.iter().map(|(values, _)| values[0]).sum::<DVec4>() / f64::from(count);
        let [variance, ..] = variances(&samples);
        let error = DVec4::from_array(variance.to_array().map(f64::sqrt));
        luminance(error) * exposure.exp2() / (luminance(mean) * exposure.exp2()).max(0.01)
    });
    pixels.collect()
}

#[test]
fn the_noise_matches_the_samples() {
    for exposure in [0.0, -5.0, 3.5] {
        let text = SCENE.replace("height = 16 }", &format!("height = 16, exposure = {exposure} }}"));
        let scene = Scene::parse(&text, "s.toml").unwrap_or_else(|error| panic!("{error}"));
        let options = Options {
            device: Device::Cpu,
            noise: true,
            ..Options::default()
        };
        let picture = wgray::render(&scene, &options).unwrap_or_else(|error| panic!("{error}"));
        let found = picture.noise().expect("estimates");
        let mut pixels = pixel_noise(&parse(&text), 8, exposure);
        pixels.sort_by(f64::total_cmp);
        // 384 pixels: 95 % are 364.8, half are 192.
        for (found, expected) in [(found.percentile_95, pixels[364]), (found.median, pixels[191])] {
            assert!(
                (found - expected).abs() < 1e-3 * expected + 1e-6,
                "{exposure}: {found}, expected {expected}"
            );
        }
        assert!(
            (found.percentile_95 / pixels[360] - 1.0).abs() > 1e-3,
            "the comparison cannot fail"
        );
    }
    assert_eq!(picture(SCENE, &[], 8).noise(), None);
}

#[test]
fn the_library_renders_until_the_noise_is_low() {
    let scene = |count: u32| {
        let overrides = Overrides {
            pixel_samples: Some(count),
            ..Overrides::default()
        };
        Scene::parse_with(SCENE, "s.toml", &overrides).unwrap_or_else(|error| panic!("{error}"))
    };
    let options = Options {
        device: Device::Cpu,
        noise: true,
        ..Options::default()
    };
    let cancel = CancelToken::new();
    let mut session = Session::new(&Context::new(), scene(512));
    let mut render = session.start(&options, &cancel).expect("a render");
    let before = render.noise().expect("the noise");
    assert_eq!([before.percentile_95, before.median], [f64::INFINITY; 2]);
    assert_eq!(
        render.run_until_noise(0.2, &cancel).expect("samples"),
        Status::Converged
    );
    let (count, noise) = (render.samples(), render.noise().expect("the noise"));
    assert!(
        count >= 16 && count.is_power_of_two() && noise.percentile_95 < 0.2,
        "{count}: {noise:?}"
    );
    let picture = render.snapshot();
    assert_eq!(picture.noise(), Some(noise));
    let plain = wgray::render(&scene(count), &options).expect("an image");
    assert_eq!(picture.pixels().colors, plain.pixels().colors);
    let half = wgray::render(&scene(count / 2), &options).expect("an image");
    assert!(half.noise().expect("the noise").percentile_95 >= 0.2);
    // The limit may be reached by the last sample.
    let mut session_of_count = Session::new(&Context::new(), scene(count));
    let mut render_of_count = session_of_count.start(&options, &cancel).expect("a render");
    assert_eq!(
        render_of_count.run_until_noise(0.2, &cancel).expect("samples"),
        Status::Converged
    );
    assert_eq!(render_of_count.samples(), count);
    // A lower limit continues; a limit that is not reached ends with all samples.
    assert_eq!(
        render.run_until_noise(0.15, &cancel).expect("samples"),
        Status::Converged
    );
    assert!(render.samples() >= count);
    assert_eq!(
        render.run_until_noise(1e-6, &cancel).expect("samples"),
        Status::Finished
    );
    assert_eq!(render.samples(), 512);
    for (limit, rule) in [
        (0.0, "noise: 0 must be greater than 0"),
        (f64::NAN, "noise: NaN must be greater than 0"),
    ] {
        let message = render
            .run_until_noise(limit, &cancel)
            .map_err(|error| error.to_string());
        assert_eq!(message, Err(rule.to_owned()));
    }
    let mut session = Session::new(&Context::new(), scene(512));
    let plain_options = Options {
        noise: false,
        ..options
    };
    let mut render = session.start(&plain_options, &cancel).expect("a render");
    assert_eq!(render.noise(), None);
    let message = render.run_until_noise(0.1, &cancel).map_err(|error| error.to_string());
    assert_eq!(message, Err("noise: 0.1 needs Options::noise".to_owned()));
}

#[test]
fn a_snapshot_into_a_denoised_picture_is_not_denoised() {
    let scene = Scene::parse_with(SCENE, "s.toml", &Overrides::default()).unwrap_or_else(|error| panic!("{error}"));
    let options_with = |aov: Aov| Options {
        device: Device::Cpu,
        noise: true,
        aovs: vec![aov],
        ..Options::default()
    };
    let cancel = CancelToken::new();
    let mut session = Session::new(&Context::new(), scene);
    let mut rendered = |aov: Aov| {
        let mut render = session.start(&options_with(aov), &cancel).expect("a render");
        render.run(&cancel).expect("samples");
        render.snapshot()
    };
    let (denoised, plain) = (rendered(Aov::Denoised), rendered(Aov::Albedo));
    assert_ne!(denoised.rgb8(), plain.rgb8());
    let mut render = session.start(&options_with(Aov::Albedo), &cancel).expect("a render");
    render.run(&cancel).expect("samples");
    let mut reused = denoised;
    render.snapshot_into(&mut reused);
    assert!(reused == plain && reused.rgb8() == plain.rgb8());
}
