//! Texture filtering: nearest, bilinear, trilinear and EWA.

use std::f64::consts::TAU;
use std::path::Path;

use glam::{DMat2, DVec2, DVec3, Vec2, Vec3};
use wgray_trace::cpu::footprint::{Footprint, footprint_ellipse, texture_footprint};
use wgray_trace::cpu::texel::{near_coordinate, srgb_to_linear, wrapped_index};
use wgray_trace::cpu::texture::{ewa_color, texture_color};
use wgray_trace::records::{CLAMP, MIRRORED, Packed, REPEAT};

use super::{scene, write_exr, write_png};
use crate::random::Random;

pub fn textured(folder: &Path, keys: &str) -> Packed {
    let text = format!(
        "image = {{ width = 4, height = 4 }}
        camera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}
        [textures.t]
        {keys}
        [materials.m]
        type = 'phong'
        color = {{ texture = 't' }}"
    );
    scene(&text, folder)
}

fn color(scene: &Packed, uv: Vec2, dx: Vec2, dy: Vec2) -> Vec3 {
    texture_color(scene, &scene.textures.records[0], Footprint { uv, dx, dy })
}

/// Returns footprints of all sizes and shapes, including grazing footprints.
fn footprints() -> Vec<(Vec2, Vec2, Vec2)> {
    let numbers = Random::new(1);
    let mut footprints = Vec::new();
    for i in 0..300 {
        let vector = |size: f64| Vec2::new(numbers.between(-size, size) as f32, numbers.between(-size, size) as f32);
        let size = 2f64.powi(i % 30 - 15);
        footprints.push((
            vector(3.0),
            vector(size),
            vector(size * if i % 3 == 0 { 0.01 } else { 1.0 }),
        ));
    }
    let (inf, nan) = (f32::INFINITY, f32::NAN);
    for dx in [0.0, 1e-30, 1e20, 1e38, inf, nan] {
        footprints.push((Vec2::splat(0.3), Vec2::new(dx, 0.1), Vec2::new(0.0, dx)));
        footprints.push((Vec2::new(dx, 0.7), Vec2::splat(dx), Vec2::splat(dx)));
    }
    footprints
}

const FILTERS: [&str; 4] = ["nearest", "bilinear", "trilinear", "ewa"];
const WRAPS: [&str; 3] = ["repeat", "clamp", "mirror"];

#[test]
fn a_constant_image_is_constant_under_every_filter_and_footprint() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_png(&path("even.png"), 16, 16, |_, _| [200, 31, 5]);
    write_png(&path("odd.png"), 7, 13, |_, _| [200, 31, 5]);
    write_exr(&path("line.exr"), 5, 1, |_, _| [0.1, 7.3, 1e-3]);
    write_png(&path("spot.png"), 7, 13, |x, y| {
        if (x, y) == (3, 6) { [0; 3] } else { [200, 31, 5] }
    });
    let mut changed_count = 0;
    for file in ["even.png", "odd.png", "line.exr", "spot.png"] {
        for filter in FILTERS {
            for wrap in WRAPS {
                let keys = format!("type = 'image'\nfile = '{file}'\nfilter = '{filter}'\nwrap = '{wrap}'");
                let scene = textured(folder.path(), &keys);
                let expected = color(&scene, Vec2::ZERO, Vec2::ZERO, Vec2::ZERO);
                for (uv, dx, dy) in footprints() {
                    let found = color(&scene, uv, dx, dy);
                    if file == "spot.png" {
                        changed_count += u32::from(found != expected); // negative control: a single texel is visible
                    } else {
                        assert_eq!(found, expected, "{keys}\n{uv} {dx} {dy}");
                    }
                }
            }
        }
    }
    // Clamped footprints beyond the edge do not cover the texel.
    assert!(changed_count > 800, "{changed_count}");
}

#[test]
fn cached_weights_give_the_colors_of_the_reference() {
    let bits = |color: Vec3| color.to_array().map(f32::to_bits);
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let byte = |x: u32, y: u32, i: u32| ((37 * x + 101 * y + 59 * i) % 256) as u8;
    write_png(&path("a.png"), 16, 8, |x, y| [0, 1, 2].map(|i| byte(x, y, i)));
    write_png(&path("b.png"), 16, 8, |x, y| [3, 4, 5].map(|i| byte(y, x, i)));
    write_png(&path("c.png"), 8, 16, |x, y| [6, 7, 8].map(|i| byte(x, y, i)));
    write_exr(&path("d.exr"), 16, 8, |x, y| [x as f32, y as f32, 0.5]);
    let scenes = [
        "file = 'a.png'",
        "file = 'b.png'",
        "file = 'a.png'\nencoding = 'linear'",
        "file = 'a.png'\nwrap = 'clamp'",
        "file = 'a.png'\nmax_anisotropy = 2",
        "file = 'c.png'",
        "file = 'd.exr'",
    ]
    .map(|keys| textured(folder.path(), &format!("type = 'image'\nfilter = 'ewa'\n{keys}")));
    let mut differing_count = 0;
    for (uv, dx, dy) in footprints() {
        let colors = scenes.each_ref().map(|scene| color(scene, uv, dx, dy));
        for (scene, found) in scenes.iter().zip(colors) {
            let t = &scene.textures.records[0];
            let expected = ewa_color(scene, t, texture_footprint(t, Footprint { uv, dx, dy }));
            assert_eq!(
                bits(found),
                bits(t.first + (t.second - t.first) * expected),
                "{uv} {dx} {dy}"
            );
        }
        differing_count += u32::from((1..colors.len()).all(|i| colors[i] != colors[0]));
    }
    assert!(differing_count > 100, "{differing_count}"); // negative control: the lookups differ
}

#[test]
fn srgb_decoding_matches_the_standard() {
    for byte in 0..=255 {
        let x = f64::from(byte) / 255.0;
        let exact = if x <= 0.04045 {
            x / 12.92
        } else {
            ((x + 0.055) / 1.055).powf(2.4)
        };
        let found = f64::from(srgb_to_linear(byte as f32 / 255.0));
        assert!(
            (found - exact).abs() <= 1e-6 * exact.max(1e-3),
            "{byte}: {found} {exact}"
        );
    }
}

#[test]
fn nearest_filtering_returns_the_texels() {
    let folder = tempfile::tempdir().unwrap();
    let texel = |x: u32, y: u32| [x as f32, y as f32, 10.0 * y as f32 + x as f32];
    write_exr(&folder.path().join("t.exr"), 5, 3, texel);
    let scene = textured(folder.path(), "type = 'image'\nfile = 't.exr'\nfilter = 'nearest'");
    for y in 0..3 {
        for x in 0..5 {
            // Row 0 is the top.
            let uv = Vec2::new((x as f32 + 0.5) / 5.0, 1.0 - (y as f32 + 0.5) / 3.0);
            assert_eq!(color(&scene, uv, Vec2::ZERO, Vec2::ZERO), Vec3::from(texel(x, y)));
        }
    }
    let bilinear = textured(folder.path(), "type = 'image'\nfile = 't.exr'\nfilter = 'bilinear'");
    let middle = color(&bilinear, Vec2::new(0.4, 0.5), Vec2::ZERO, Vec2::ZERO);
    assert!((middle - Vec3::new(1.5, 1.0, 11.5)).length() < 1e-5, "{middle}");
}

#[test]
fn coordinates_wrap_as_specified_beyond_the_image() {
    let found = |wrap: u32| (-7..8).map(|i| wrapped_index(i, 3, wrap)).collect::<Vec<_>>();
    assert_eq!(found(REPEAT), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]);
    assert_eq!(found(CLAMP), [0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]);
    assert_eq!(found(MIRRORED), [0, 0, 1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
    assert_eq!(near_coordinate(-0.25, REPEAT), 0.75);
    assert_eq!(near_coordinate(-0.25, MIRRORED), 1.75);
    assert_eq!(near_coordinate(-0.25, CLAMP), -0.25);
    for wrap in [REPEAT, MIRRORED, CLAMP] {
        for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30] {
            assert!(near_coordinate(u, wrap).abs() <= 9.0);
        }
    }
}

fn noise(folder: &Path, width: u32, height: u32) -> Vec<f64> {
    let numbers = Random::new(5);
    let texels: Vec<f32> = (0..width * height).map(|_| numbers.unit() as f32).collect();
    write_exr(&folder.join("noise.exr"), width, height, |x, y| {
        [texels[(y * width + x) as usize]; 3]
    });
    // Bottom row first, as v points up.
    let rows = texels.chunks(width as usize).rev();
    rows.flatten().map(|&texel| f64::from(texel)).collect()
}

#[test]
fn ewa_is_a_gaussian_mean_over_the_ellipse() {
    let folder = tempfile::tempdir().unwrap();
    let n = 32;
    let texels = noise(folder.path(), n, n);
    let scene = textured(folder.path(), "type = 'image'\nfile = 'noise.exr'\nfilter = 'ewa'");
    // The weight is exp(-2 q) - exp(-2) if q = p^T (M + I)^-1 p < 1, where M is the footprint and I the reconstruction
    // filter, in texels.
    let exact_color = |uv: DVec2, dx: DVec2, dy: DVec2| {
        let edges = DMat2::from_cols(dx, dy) * f64::from(n);
        let inverse = (edges * edges.transpose() + DMat2::IDENTITY).inverse();
        let (mut sum, mut total) = (0.0, 0.0);
        for y in -10..n as i32 + 10 {
            for x in -10..n as i32 + 10 {
                let p = DVec2::new(f64::from(x), f64::from(y)) + 0.5 - uv * f64::from(n);
                let q = p.dot(inverse * p);
                if q < 1.0 {
                    let weight = (-2.0 * q).exp() - (-2f64).exp();
                    let (x, y) = (x.rem_euclid(n as i32), y.rem_euclid(n as i32));
                    sum += weight * texels[(y * n as i32 + x) as usize];
                    total += weight;
                }
            }
        }
        sum / total
    };
    let numbers = Random::new(9);
    let texel = 1.0 / f64::from(n);
    // The ellipses are less than three texels wide, so that only the finest level is used.
    for (max_ratio, minor_axis) in [(1.0, 1.0), (6.0, 0.8), (7.0, 2.9)] {
        let (mut changed_by_size, mut changed_by_mirroring) = (0, 0);
        for _ in 0..200 {
            let uv = Vec2::new(numbers.unit() as f32, numbers.unit() as f32);
            let axis = DVec2::from_angle(numbers.between(0.0, TAU)) * texel;
            let (dx, dy) = (
                (axis * numbers.between(1.0, max_ratio)).as_vec2(),
                (axis.perp() * minor_axis).as_vec2(),
            );
            let found = f64::from(color(&scene, uv, dx, dy).x);
            let (uv, dx, dy) = (uv.as_dvec2(), dx.as_dvec2(), dy.as_dvec2());
            let expected = exact_color(uv, dx, dy);
            assert!((found - expected).abs() < 2e-5, "{uv} {dx} {dy}: {found} {expected}");
            changed_by_size += u32::from((found - exact_color(uv, dx * 0.7, dy * 0.7)).abs() > 0.01);
            let mirror = DVec2::new(-1.0, 1.0);
            changed_by_mirroring += u32::from((found - exact_color(uv, dx * mirror, dy * mirror)).abs() > 0.01);
        }
        assert!(changed_by_size > 20, "{changed_by_size}");
        // A circle is its own mirror image.
        assert_eq!(changed_by_mirroring > 20, max_ratio > 1.0, "{changed_by_mirroring}");
    }
}

#[test]
fn wide_footprints_average_the_full_image() {
    let folder = tempfile::tempdir().unwrap();
    for (width, height) in [(32, 32), (13, 7), (1, 9)] {
        let texels = noise(folder.path(), width, height);
        let mean = texels.iter().sum::<f64>() / texels.len() as f64;
        for filter in ["trilinear", "ewa"] {
            let scene = textured(
                folder.path(),
                &format!("type = 'image'\nfile = 'noise.exr'\nfilter = '{filter}'"),
            );
            for size in [20.0, 1e6, f32::INFINITY] {
                let found = color(&scene, Vec2::new(0.2, 0.4), Vec2::new(size, 0.0), Vec2::new(0.0, size)).x;
                assert!(
                    (f64::from(found) - mean).abs() < 1e-6,
                    "{width} x {height}, {filter}: {found} {mean}"
                );
            }
            let narrow = color(&scene, Vec2::new(0.2, 0.4), Vec2::ZERO, Vec2::ZERO).x;
            assert!((f64::from(narrow) - mean).abs() > 1e-3);
        }
    }
}

/// Negative control: trilinear filtering blurs the detail.
#[test]
fn ewa_keeps_detail_across_a_long_footprint() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("stripes.exr"), 64, 64, |x, _| {
        [if x % 16 < 8 { 1.0 } else { 0.0 }; 3]
    });
    let contrast = |filter: &str| {
        let scene = textured(
            folder.path(),
            &format!("type = 'image'\nfile = 'stripes.exr'\nfilter = '{filter}'"),
        );
        let (dx, dy) = (Vec2::new(1.0 / 64.0, 0.0), Vec2::new(0.0, 14.0 / 64.0));
        color(&scene, Vec2::new(4.0 / 64.0, 0.5), dx, dy).x - color(&scene, Vec2::new(12.0 / 64.0, 0.5), dx, dy).x
    };
    assert!(contrast("ewa") > 0.99, "{}", contrast("ewa"));
    assert!(contrast("trilinear") < 0.3, "{}", contrast("trilinear"));
}

/// Returns two scenes with a texture of 128 x 128 gray texels, one with EWA and one with trilinear filtering, and the
/// texels, bottom row first.
fn gray(folder: &Path, name: &str, texel: impl Fn(usize, usize) -> f32) -> (Packed, Packed, Vec<f64>) {
    write_exr(&folder.join(name), 128, 128, |x, y| {
        [texel(x as usize, 127 - y as usize); 3]
    });
    let texels = (0..128 * 128).map(|i| f64::from(texel(i % 128, i / 128))).collect();
    let scene = |filter: &str| textured(folder, &format!("type = 'image'\nfile = '{name}'\nfilter = '{filter}'"));
    (scene("ewa"), scene("trilinear"), texels)
}

fn texel_at(texels: &[f64], x: i64, y: i64) -> f64 {
    texels[(y.rem_euclid(128) * 128 + x.rem_euclid(128)) as usize]
}

/// Integrates the bilinear interpolation over a parallelogram with coordinates in texels.
fn mean_over(texels: &[f64], p: DVec2, dx: DVec2, dy: DVec2) -> f64 {
    let point_count = |edge: DVec2| (edge.length() * 1.5).ceil().max(16.0);
    let (columns, rows) = (point_count(dx), point_count(dy));
    let mut sum = 0.0;
    for i in 0..columns as u32 {
        for j in 0..rows as u32 {
            let point =
                p + dx * ((f64::from(i) + 0.5) / columns - 0.5) + dy * ((f64::from(j) + 0.5) / rows - 0.5) - 0.5;
            let (x, y, t) = (point.x.floor() as i64, point.y.floor() as i64, point - point.floor());
            let row = |y: i64| texel_at(texels, x, y) * (1.0 - t.x) + texel_at(texels, x + 1, y) * t.x;
            sum += row(y) * (1.0 - t.y) + row(y + 1) * t.y;
        }
    }
    sum / (columns * rows)
}

fn finest_ewa(texels: &[f64], p: DVec2, dx: DVec2, dy: DVec2) -> f64 {
    let edges = DMat2::from_cols(dx, dy);
    let m = edges * edges.transpose() + DMat2::IDENTITY;
    let (inverse, extent) = (m.inverse(), DVec2::new(m.x_axis.x.sqrt(), m.y_axis.y.sqrt()));
    let (low, high) = ((p - extent - 0.5).floor(), (p + extent).ceil());
    let (mut sum, mut total) = (0.0, 0.0);
    for y in low.y as i64..=high.y as i64 {
        for x in low.x as i64..=high.x as i64 {
            let d = DVec2::new(x as f64, y as f64) + 0.5 - p;
            let weight = ((-2.0 * d.dot(inverse * d)).exp() - (-2f64).exp()).max(0.0);
            sum += weight * texel_at(texels, x, y);
            total += weight;
        }
    }
    sum / total
}

/// The documented bound is 1.4 times the error of EWA over the finest level, at any aspect and angle. Negative control:
/// trilinear filtering is nearly always worse.
#[test]
fn ewa_over_the_pyramid_nearly_equals_ewa_over_the_finest_level() {
    let folder = tempfile::tempdir().unwrap();
    let numbers = Random::new(21);
    let noise: Vec<f32> = (0..128 * 128).map(|_| numbers.unit() as f32).collect();
    let sparse: Vec<f32> = (0..128 * 128)
        .map(|_| f32::from(u8::from(numbers.once_in(64))))
        .collect();
    let stripes = |period: f64| move |x: usize, _: usize| (0.5 + 0.5 * ((x as f64 + 0.5) * TAU / period).sin()) as f32;
    let textures = [
        ("noise", gray(folder.path(), "noise.exr", |x, y| noise[y * 128 + x])),
        ("sparse", gray(folder.path(), "sparse.exr", |x, y| sparse[y * 128 + x])),
        (
            "tiles",
            gray(folder.path(), "tiles.exr", |x, y| {
                let dark = x % 16 < 1 || y % 16 < 1;
                if dark {
                    0.1
                } else {
                    0.4 + 0.4 * ((x / 16 + y / 16) % 2) as f32
                }
            }),
        ),
        ("wide stripes", gray(folder.path(), "wide.exr", stripes(128.0 / 6.0))),
        ("stripes", gray(folder.path(), "stripes.exr", stripes(128.0 / 16.0))),
        (
            "narrow stripes",
            gray(folder.path(), "narrow.exr", stripes(128.0 / 50.0)),
        ),
    ];
    let (mut max_ratio, mut worse_cases, mut cases) = (0.0f64, 0, 0);
    for anisotropy in [1.0, 2.0, 4.0, 8.0, 16.0] {
        for width in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 16.0] {
            if width * anisotropy > 64.0 {
                continue;
            }
            let mut errors = vec![[0.0; 3]; textures.len()];
            for _ in 0..80 {
                let p = DVec2::new(numbers.between(0.0, 128.0), numbers.between(0.0, 128.0));
                let axis = DVec2::from_angle(numbers.between(0.0, TAU)) * width;
                let (dx, dy) = (axis, axis.perp() * anisotropy);
                for ((_, (ewa, trilinear, texels)), errors) in textures.iter().zip(&mut errors) {
                    let expected = mean_over(texels, p, dx, dy);
                    let [uv, du, dv] = [p, dx, dy].map(|v| (v / 128.0).as_vec2());
                    let found = |scene: &Packed| f64::from(color(scene, uv, du, dv).x);
                    let values = [found(ewa), finest_ewa(texels, p, dx, dy), found(trilinear)];
                    for (error, value) in errors.iter_mut().zip(values) {
                        *error += (value - expected).powi(2) / 80.0;
                    }
                }
            }
            for ((name, _), errors) in textures.iter().zip(&errors) {
                let [ewa, finest, trilinear] = errors.map(f64::sqrt);
                let stripes = name.ends_with("stripes");
                // At some sizes, stripes have almost no error.
                let limit = 1.4 * finest + if stripes { 0.05 } else { 0.0005 };
                assert!(
                    ewa <= limit,
                    "{name}, width {width}, anisotropy {anisotropy}: error {ewa} (finest level {finest}, trilinear {trilinear})"
                );
                max_ratio = max_ratio.max(if stripes { 0.0 } else { ewa / finest });
                cases += u32::from(!stripes);
                worse_cases += u32::from(!stripes && trilinear > limit);
                if (width, anisotropy, *name) == (1.0, 8.0, "noise") {
                    assert!(ewa < 0.5 * trilinear, "{ewa} {trilinear}");
                }
            }
        }
    }
    println!("EWA over the pyramid: at most {max_ratio:.3} times the error of EWA over the finest level");
    assert!(worse_cases > cases / 2, "{worse_cases} of {cases}");
}

/// The cost is bounded for images of any shape.
#[test]
fn the_cost_of_ewa_is_bounded_for_narrow_images() {
    let folder = tempfile::tempdir().unwrap();
    let start = std::time::Instant::now();
    for (width, height) in [(4096, 1), (1, 4096), (4095, 2), (3, 4096)] {
        let mean = noise(folder.path(), width, height).iter().sum::<f64>() / f64::from(width * height);
        let keys = "type = 'image'\nfile = 'noise.exr'\nfilter = 'ewa'\nmax_anisotropy = 64";
        let scene = textured(folder.path(), keys);
        let numbers = Random::new(2);
        for i in 0..2000 {
            let size = 2f64.powi(i % 14) / 4096.0;
            let edge = |factor: f64| {
                let v = DVec2::from_angle(numbers.between(0.0, TAU)) * size * factor;
                (v / DVec2::new(f64::from(width), f64::from(height)) * 4096.0).as_vec2()
            };
            let found = color(&scene, Vec2::splat(0.3), edge(1.0), edge(0.1)).x;
            assert!((0.0..=1.0).contains(&found));
            if size > 1.0 {
                assert!(
                    (f64::from(found) - mean).abs() < 0.2,
                    "{width} x {height}: found {found}, expected about {mean}"
                );
            }
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    assert!(seconds < 20.0, "{seconds} s"); // without the bound, the lookups take minutes
}

/// Texels of 8-bit images are exact, and mip levels keep the mean: a white texel among dark texels is never lost.
#[test]
fn mip_levels_of_8_bit_images_keep_the_mean() {
    let folder = tempfile::tempdir().unwrap();
    let value = |x: u32, y: u32| if (x, y) == (77, 130) { [255; 3] } else { [2, 0, 1] };
    write_png(&folder.path().join("dark.png"), 256, 256, value);
    let ramp = |x: u32, _: u32| [x as u8, 255 - x as u8, (x / 2) as u8];
    write_png(&folder.path().join("ramp.png"), 256, 2, ramp);
    for (encoding, decode) in [("srgb", srgb_to_linear as fn(f32) -> f32), ("linear", |x| x)] {
        let scene = |file: &str, filter: &str| {
            let keys = format!("type = 'image'\nfile = '{file}'\nfilter = '{filter}'\nencoding = '{encoding}'");
            textured(folder.path(), &keys)
        };
        let exact = scene("ramp.png", "nearest");
        for x in 0..256 {
            let expected = ramp(x, 0).map(|byte| decode(f32::from(byte) / 255.0));
            let uv = Vec2::new((x as f32 + 0.5) / 256.0, 0.5);
            assert_eq!(color(&exact, uv, Vec2::ZERO, Vec2::ZERO).to_array(), expected);
        }
        let dark = scene("dark.png", "trilinear");
        for level in 0..=8 {
            let count = 4f64.powi(level);
            let mean = [2, 0, 1].map(|byte| {
                let background = f64::from(decode(byte as f32 / 255.0));
                background + (1.0 - background) / count
            });
            let uv = Vec2::new(
                0.5 + ((77 >> level) << level) as f32,
                0.5 + (((255 - 130) >> level) << level) as f32,
            );
            let level_center = (f32::powi(2.0, level) - 1.0) / 2.0;
            let size = f32::powi(2.0, level) / 256.0;
            let found = color(
                &dark,
                (uv + level_center) / 256.0,
                Vec2::new(size, 0.0),
                Vec2::new(0.0, size),
            );
            let max_mean = mean.into_iter().fold(0.0, f64::max);
            for (found, mean) in found.to_array().into_iter().zip(mean) {
                let error = (f64::from(found) - mean).abs();
                assert!(error < 0.005 * max_mean, "{encoding} {level}: {found} {mean}");
            }
        }
    }
}

#[test]
fn the_ellipse_of_a_footprint_has_the_footprint_as_conjugate_diameters() {
    let numbers = Random::new(3);
    let mut clamped = 0;
    for _ in 0..1000 {
        let vector = || Vec2::new(numbers.between(-9.0, 9.0) as f32, numbers.between(-9.0, 9.0) as f32);
        let (dx, dy) = (vector(), vector());
        let (a, b) = (dx.as_dvec2(), dy.as_dvec2());
        let m = DVec3::new(a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);
        let root = ((m.x - m.z).powi(2) / 4.0 + m.y * m.y).sqrt();
        let (major, minor) = (
            ((m.x + m.z) / 2.0 + root).sqrt(),
            a.perp_dot(b).abs() / ((m.x + m.z) / 2.0 + root).sqrt(),
        );
        let ellipse = footprint_ellipse(dx, dy, 1e3);
        assert!((f64::from(ellipse.major) - major).abs() < 1e-5 * major);
        if minor > 0.02 * major {
            assert!((f64::from(ellipse.minor) - minor).abs() < 1e-3 * minor, "{dx} {dy}");
            assert!((ellipse.m.as_dvec3() - m).length() < 1e-4 * major * major, "{dx} {dy}");
        }
        let limited = footprint_ellipse(dx, dy, 2.0);
        assert!(limited.minor >= 0.49999 * limited.major);
        clamped += u32::from(limited.minor > 1.001 * ellipse.minor);
    }
    assert!(clamped > 100);
}

/// The color does not depend on the distance to the edge or on the size of the footprint.
#[test]
fn beyond_a_clamped_edge_only_the_color_of_the_edge_is_visible() {
    let folder = tempfile::tempdir().unwrap();
    let is_border = |i: u32| !(4..60).contains(&i);
    let framed = |x, y| if is_border(x) || is_border(y) { [0; 3] } else { [255; 3] };
    write_png(&folder.path().join("framed.png"), 64, 64, framed);
    for filter in ["bilinear", "trilinear", "ewa"] {
        for (wrap, inside) in [("clamp", 0.0), ("repeat", 1.0)] {
            let found = |uv: Vec2, size: f32| {
                let texture = format!("type = 'image'\nfile = 'framed.png'\nfilter = '{filter}'\nwrap = '{wrap}'");
                let scene = textured(folder.path(), &texture);
                color(&scene, uv, Vec2::new(size, 0.0), Vec2::new(0.0, size)).x
            };
            for size in [1e-3, 0.1, 0.4, 20.0] {
                let far = found(Vec2::new(-3.5, 2.5), size);
                if wrap == "clamp" {
                    assert_eq!(far, inside, "{filter}, {size}");
                } else {
                    assert!(
                        far > 0.5,
                        "{filter}, {size}: a repeated texture is as dark as a clamped texture: {far}"
                    );
                }
            }
        }
    }
}
