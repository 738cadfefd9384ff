//! Environment maps: irradiance compared with sums over texels, sampled directions compared with the PDF, and the
//! documented orientation.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, UVec2, Vec3};
use wgray::scene::{Assets, Description, Image, Texels};
use wgray_render::pack::pack;
use wgray_trace::cpu::environment::{environment_eval, sample_environment};
use wgray_trace::cpu::sequence::sobol_sample;
use wgray_trace::records::{ENVIRONMENT, Packed};

use super::mean;
use crate::pictures::{RenderMode, both, differing, exact_modes, render, render_with};
use crate::random::Random;
use crate::{adapter, sources};

/// A narrow view of a white ground.
const GROUND: &str = "camera = { position = [0, 0, 1], look_at = [0, 0.01, 0], fov = 10 }\n\
                      materials.m = { type = 'diffuse', color = [1, 1, 1] }\n\
                      [[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n";

fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) -> Image {
    let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    Image {
        width,
        height,
        texels: Texels::Floats(texels),
    }
}

fn with_map(image: &Image, keys: &str, (samples, depth): (u32, u32), objects: &str) -> Packed {
    with_environment(&format!("file = 'map'{keys}"), Some(image), (samples, depth), objects)
}

fn with_environment(environment: &str, image: Option<&Image>, (samples, depth): (u32, u32), objects: &str) -> Packed {
    let text = format!(
        "image = {{ width = 16, height = 16 }}\n{objects}\n[environment]\n{environment}\n\
         [render]\nintegrator = 'path'\nmax_depth = {depth}\npixel_samples = {{ count = {samples} }}\n"
    );
    let description = Description::parse(&text, "test").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut assets = Assets::beside(&sources::path("scenes"));
    assets
        .images
        .extend(image.map(|image| ("map".to_owned(), Arc::new(image.clone()))));
    pack(
        &description
            .validate_with(&assets)
            .unwrap_or_else(|problem| panic!("{problem}")),
    )
}

/// Returns the bilinear radiance at (u, v), where v is measured from the upper edge. The radiance at a pole is the mean
/// of the outermost row.
fn radiance(image: &Image, u: f64, v: f64) -> DVec3 {
    let Texels::Floats(texels) = &image.texels else {
        panic!("an image of bytes")
    };
    let (width, height) = (i64::from(image.width), i64::from(image.height));
    let texel = |x: i64, y: i64| {
        let wrapped_texel =
            |x: i64, y: i64| DVec3::from_array(texels[(y * width + x.rem_euclid(width)) as usize].map(f64::from));
        if (0..height).contains(&y) {
            return wrapped_texel(x, y);
        }
        (0..width)
            .map(|x| wrapped_texel(x, y.clamp(0, height - 1)))
            .sum::<DVec3>()
            / width as f64
    };
    let (s, t) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
    let (x, y) = (s.floor(), t.floor());
    // The pole is half a row from the centers of the outermost row.
    let row_weight = match t {
        t if t < 0.0 => 1.0 + 2.0 * t,
        t if t > height as f64 - 1.0 => 2.0 * (t - y),
        _ => t - y,
    };
    let row = |y: i64| texel(x as i64, y).lerp(texel(x as i64 + 1, y), s - x);
    row(y as i64).lerp(row(y as i64 + 1), row_weight)
}

/// Integrates over all directions, with `points` x `points` points per texel.
fn integrate(image: &Image, points: u32, mut value: impl FnMut(DVec3, DVec3) -> DVec3) -> DVec3 {
    let (columns, rows) = (image.width * points, image.height * points);
    let mut sum = DVec3::ZERO;
    for row in 0..rows {
        let v = (f64::from(row) + 0.5) / f64::from(rows);
        let (sine, cosine) = (PI * v).sin_cos();
        let solid_angle = TAU / f64::from(columns) * PI / f64::from(rows) * sine;
        for column in 0..columns {
            let u = (f64::from(column) + 0.5) / f64::from(columns);
            let azimuth = PI - TAU * u;
            let direction = DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine);
            sum += value(direction, radiance(image, u, v)) * solid_angle;
        }
    }
    sum
}

fn irradiance(image: &Image, points: u32, normal: DVec3) -> DVec3 {
    integrate(image, points, |direction, radiance| {
        radiance * direction.dot(normal).max(0.0)
    })
}

fn noise_image(width: u32, height: u32) -> Image {
    let random = Random::new(7);
    image(width, height, |_, _| {
        [(); 3].map(|()| random.unit().powi(6) as f32 * 8.0)
    })
}

fn sunny_image() -> Image {
    image(64, 32, |x, y| match (x, y) {
        (20, 6) => [4000.0, 3000.0, 2000.0],
        (_, 0..16) => [0.3, 0.5, 0.9],
        _ => [0.1, 0.08, 0.05],
    })
}

fn one_bright_texel(width: u32, height: u32, position: (u32, u32)) -> Image {
    image(width, height, move |x, y| {
        [if (x, y) == position { 100.0 } else { 0.0 }; 3]
    })
}

#[test]
fn irradiance_matches_a_sum_over_all_directions() {
    let images = [
        (image(1, 1, |_, _| [0.5, 1.0, 2.0]), 64),
        (image(2, 1, |x, _| [f32::from(x as u8), 1.0, 0.5]), 128),
        (image(2, 2, |x, y| [x as f32, y as f32, 1.0]), 64),
        (noise_image(33, 17), 8),
        (one_bright_texel(16, 8, (5, 2)), 32),
        (one_bright_texel(16, 8, (15, 0)), 32),
        (sunny_image(), 8),
    ];
    // The ground normal in the space of the map.
    let sin_cos = |degrees: f64| degrees.to_radians().sin_cos();
    let tilted = DVec3::new(sin_cos(50.0).0, 0.0, sin_cos(50.0).1);
    for (image, points) in &images {
        for (rotation, normal) in [
            ("", DVec3::Z),
            // Rotating the map is equivalent to rotating the normal by the inverse rotation.
            ("\nrotate = { axis = [0, 1, 0], degrees = -50 }", tilted),
            ("\nrotate = [0, 90, 0]", DVec3::NEG_X),
        ] {
            let expected = irradiance(image, *points, normal) / PI;
            for mode in both() {
                let found = DVec3::from_array(mean(&render(&with_map(image, rotation, (256, 1), GROUND), mode)));
                if expected == DVec3::ZERO {
                    assert_eq!(found, expected, "a texel below the horizon lights the ground");
                    continue;
                }
                let ratio = found / expected;
                let size = (image.width, image.height);
                assert!(
                    (ratio - DVec3::ONE).abs().max_element() < 0.01,
                    "{size:?}{rotation}, {mode:?}: {found}, expected {expected}"
                );
            }
        }
    }
    // Negative control: the unrotated normal gives another irradiance.
    let unrotated_ratio = irradiance(&sunny_image(), 8, DVec3::Z) / irradiance(&sunny_image(), 8, tilted);
    assert!(
        (unrotated_ratio - DVec3::ONE).abs().min_element() > 0.05,
        "{unrotated_ratio}"
    );
}

#[test]
fn the_map_has_the_documented_orientation() {
    // From left to right: -x, +y, +x, -y, -x. Top: +z.
    let picture = image(64, 32, |x, y| match (x, y) {
        (_, 0..8) => [0.0, 0.0, 1.0],
        (_, 24..) => [1.0, 1.0, 0.0],
        (24..40, _) => [1.0, 0.0, 0.0],
        (8..24, _) => [0.0, 1.0, 0.0],
        (40..56, _) => [1.0, 0.0, 1.0],
        _ => [0.0, 1.0, 1.0],
    });
    let colors = [
        (DVec3::X, [1.0, 0.0, 0.0]),
        (DVec3::Y, [0.0, 1.0, 0.0]),
        (DVec3::NEG_X, [0.0, 1.0, 1.0]),
        (DVec3::NEG_Y, [1.0, 0.0, 1.0]),
        (DVec3::Z, [0.0, 0.0, 1.0]),
        (DVec3::NEG_Z, [1.0, 1.0, 0.0]),
    ];
    let color_towards = |direction: DVec3, rotation: &str, mode: RenderMode| {
        let up = if direction.z == 0.0 { DVec3::Z } else { DVec3::X };
        let (DVec3 { x, y, z }, u) = (direction, up);
        let camera = format!(
            "camera = {{ position = [0, 0, 0], look_at = [{x}, {y}, {z}], up = [{}, {}, {}], fov = 20 }}\n",
            u.x, u.y, u.z
        );
        mean(&render(&with_map(&picture, rotation, (4, 0), &camera), mode))
    };
    for mode in both() {
        for (i, (direction, color)) in colors.into_iter().enumerate() {
            assert_eq!(color_towards(direction, "", mode), color, "{direction}, {mode:?}");
            // Counterclockwise from above: +x moves to +y.
            if i < 4 {
                let rotated_color = colors[(i + 3) % 4].1;
                assert_eq!(
                    color_towards(direction, "\nrotate = 90", mode),
                    rotated_color,
                    "{direction}, {mode:?}"
                );
            }
        }
        let about_x = "\nrotate = { axis = [1, 0, 0], degrees = 90 }";
        assert_eq!(
            color_towards(DVec3::Z, about_x, mode),
            colors[1].1,
            "+y does not move to +z"
        );
        assert_eq!(
            color_towards(DVec3::Z, "\nrotate = [90, 0, 0]", mode),
            colors[1].1,
            "+y does not move to +z"
        );
    }
}

#[test]
fn a_white_map_equals_a_constant_color() {
    let ball = "camera = { position = [0, -4, 0.3], look_at = [0, 0, 0], fov = 40 }\n\
                materials.m = { type = 'phong', diffuse = [0.5, 0.5, 0.5], specular = [0.3, 0.3, 0.3], shininess = 20, ambient = [0, 0, 0] }\n\
                materials.g = { type = 'dielectric', ior = 1.5 }\n\
                [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [-0.6, 0, 0]\nradius = 0.5\n\
                [[shapes]]\ntype = 'sphere'\nmaterial = 'g'\ncenter = [0.6, 0, 0]\nradius = 0.5\n";
    let white = image(8, 4, |_, _| [0.5, 1.0, 1.5]);
    for mode in both() {
        let expected = mean(&render(
            &with_environment("color = [1, 2, 3]", None, (1024, 6), ball),
            mode,
        ));
        let found = mean(&render(&with_map(&white, "\nscale = 2", (1024, 6), ball), mode));
        for (found, expected) in found.into_iter().zip(expected) {
            assert!(
                (found / expected - 1.0).abs() < 2e-3,
                "{mode:?}: {found}, expected {expected}"
            );
        }
    }
}

const EMITTERS: &str = "camera = { position = [0, -3, 1], look_at = [0, 0, 0.5], fov = 40 }\n\
    materials.source = { type = 'diffuse', color = [0.3, 0.3, 0.3], emission = [5, 3, 1] }\n\
    materials.gloss = { type = 'phong', diffuse = [0.4, 0.4, 0.4], specular = [0.5, 0.5, 0.5], shininess = 12, ambient = [0, 0, 0] }\n\
    materials.clay = { type = 'diffuse', color = [0.7, 0.6, 0.5] }\n\
    [[shapes]]\ntype = 'plane'\nmaterial = 'clay'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n\
    [[shapes]]\ntype = 'sphere'\nmaterial = 'gloss'\ncenter = [0.4, 0, 0.5]\nradius = 0.5\n\
    [[shapes]]\ntype = 'sphere'\nmaterial = 'source'\ncenter = [-0.5, 0, 0.3]\nradius = 0.2\n";

#[test]
fn light_and_bsdf_sampling_of_the_map_agree() {
    if adapter::device().is_none() {
        return;
    }
    let edited_shaders = |changes: [(&str, &str, &str); 2]| {
        let mut shaders = sources::shaders().clone();
        for (file, from, to) in changes {
            let text = shaders.text(file).to_owned();
            assert!(text.contains(from), "{from} not found");
            shaders = sources::with(&shaders, file, &text.replace(from, to));
        }
        shaders
    };
    const PATH_FILE: &str = "integrators/path.wgsl";
    const ENVIRONMENT_FILE: &str = "environment.wgsl";
    const LIGHT_WEIGHT: &str = "select(power_heuristic(light.pdf, reflected.pdf), 1.0, light.is_delta)";
    const BSDF_WEIGHT: &str = "select(1.0, power_heuristic(pdf, eval.pdf), pdf > 0.0)";
    let light_sampling = edited_shaders([
        (PATH_FILE, LIGHT_WEIGHT, "1.0"),
        (ENVIRONMENT_FILE, BSDF_WEIGHT, "select(1.0, 0.0, pdf > 0.0)"),
    ]);
    let bsdf_sampling = edited_shaders([(PATH_FILE, LIGHT_WEIGHT, "0.0"), (ENVIRONMENT_FILE, BSDF_WEIGHT, "1.0")]);
    let wrong = edited_shaders([
        (PATH_FILE, LIGHT_WEIGHT, "1.1"),
        (ENVIRONMENT_FILE, BSDF_WEIGHT, "select(1.0, 0.0, pdf > 0.0)"),
    ]);
    // The scene has no area light, because area lights have their own MIS weights.
    let text = EMITTERS.replace(", emission = [5, 3, 1]", "");
    for image in [
        noise_image(16, 8),
        one_bright_texel(16, 8, (4, 1)),
        image(2, 1, |x, _| [x as f32, 1.0, 2.0]),
    ] {
        let packed = with_map(&image, "\nvisible = false", (4096, 2), &text);
        let mean_with = |shaders| mean(&render_with(&packed, RenderMode::Baked, shaders));
        let with_mis = mean_with(sources::shaders());
        let [light, bsdf, wrong] = [&light_sampling, &bsdf_sampling, &wrong].map(mean_with);
        for i in 0..3 {
            let is_near = |x: f64| (x - with_mis[i]).abs() < 1e-2 * with_mis[i];
            assert!(
                is_near(light[i]),
                "light sampling alone differs: {light:?}, expected {with_mis:?}"
            );
            assert!(
                is_near(bsdf[i]),
                "BSDF sampling alone differs: {bsdf:?}, expected {with_mis:?}"
            );
            assert!(
                !is_near(wrong[i]),
                "a wrong weight is accepted: {wrong:?}, expected {with_mis:?}"
            );
        }
    }
}

#[test]
fn light_of_the_map_and_of_other_emitters_adds_up() {
    let image = sunny_image();
    let lights = "[[lights]]\ntype = 'point'\nposition = [1, -1, 2]\ncolor = [2, 2, 2]\n\
                 [[lights]]\ntype = 'directional'\ndirection = [1, 2, -3]\ncolor = [1, 1, 0.5]\n\
                 [[lights]]\ntype = 'rectangle'\ncenter = [0, 0.5, 1.5]\nsize = [0.5, 0.5]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\ncolor = [3, 3, 3]\n";
    let text = format!("{EMITTERS}{lights}");
    let dark = EMITTERS.replace(", emission = [5, 3, 1]", "");
    for mode in both() {
        let mean_radiance = |packed: Packed| mean(&render(&packed, mode));
        // The rectangle of the area light occludes other light, so the scene with only the map has a black rectangle.
        let rectangle = lights.split("[[lights]]").last().unwrap_or_default();
        let black_rectangle = format!(
            "[[lights]]{}",
            rectangle.replace("color = [3, 3, 3]", "color = [0, 0, 0]")
        );
        let map_light = mean_radiance(with_map(&image, "", (1024, 3), &format!("{dark}{black_rectangle}")));
        let other_light = mean_radiance(with_environment("color = [0, 0, 0]", None, (1024, 3), &text));
        let combined = mean_radiance(with_map(&image, "", (1024, 3), &text));
        for i in 0..3 {
            let expected = map_light[i] + other_light[i];
            assert!(
                (combined[i] / expected - 1.0).abs() < 0.01,
                "{mode:?}: {combined:?}, expected {map_light:?} + {other_light:?}"
            );
        }
    }
}

#[test]
fn the_floor_occludes_light_from_below() {
    // For area lights, the renderer would skip the floor as an occluder, because no shape is below the floor. The lower
    // half of the ball is lit only from below.
    let map_bright_below = image(8, 4, |_, y| [if y > 2 { 5.0 } else { 0.0 }; 3]);
    let floors = [
        "type = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]",
        "type = 'rectangle'\nmaterial = 'm'\ncenter = [0, 0, 0]\nsize = [1e4, 1e4]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]",
        "type = 'disk'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1e4\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]",
    ];
    let ball = "camera = { position = [0, -4, 1], look_at = [0, 0, 0.6], fov = 30 }\n\
                materials.m = { type = 'diffuse', color = [1, 1, 1] }\n\
                [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0.6]\nradius = 0.5\n";
    for mode in both() {
        let brightness = |floor: &str| {
            mean(&render(
                &with_map(
                    &map_bright_below,
                    "\nvisible = false",
                    (64, 1),
                    &format!("{ball}{floor}"),
                ),
                mode,
            ))
        };
        for floor in floors {
            assert!(
                brightness(&format!("[[shapes]]\n{floor}\n"))[0] < 1e-3,
                "{floor}, {mode:?}"
            );
        }
        assert!(brightness("")[0] > 0.1, "the ball is dark without a floor, {mode:?}");
    }
}

#[test]
fn an_invisible_map_emits_and_is_reflected() {
    let ball = "camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }\n\
                 materials.m = { type = 'conductor', color = [1, 1, 1] }\n\
                 [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 0.7\n";
    let white = image(4, 2, |_, _| [1.0; 3]);
    for environment in ["file = 'map'", "color = [1, 1, 1]"] {
        for mode in both() {
            let picture = |visible: bool| {
                let keys = format!("{environment}\nvisible = {visible}");
                render(&with_environment(&keys, Some(&white), (16, 4), ball), mode)
            };
            let (shown, hidden) = (picture(true), picture(false));
            let pixel = |film: &wgray_trace::film::Film, i: usize| film.means().nth(i).unwrap_or_default();
            assert_eq!(pixel(&shown, 0), [1.0; 3], "{environment}, {mode:?}");
            assert_eq!(pixel(&hidden, 0), [0.0; 3], "{environment}, {mode:?}");
            let center = 8 * 16 + 8;
            for film in [&shown, &hidden] {
                let [x, ..] = pixel(film, center);
                assert!((x - 1.0).abs() < 1e-5, "{environment}, {mode:?}: {x}");
            }
        }
    }
}

#[test]
fn only_the_camera_sees_the_background() {
    let ball = "camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }\n\
                 materials.m = { type = 'conductor', color = [1, 1, 1] }\n\
                 [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 0.7\n";
    let white = image(4, 2, |_, _| [1.0; 3]);
    for environment in ["file = 'map'", "color = [1, 1, 1]", "color = [0, 0, 0]"] {
        let expected = if environment.contains("[0") { 0.0 } else { 1.0 };
        let modes = exact_modes().into_iter();
        let films: Vec<_> = modes
            .map(|mode| {
                let keys = format!("{environment}\nbackground = [0.5, 0.25, 8]");
                let film = render(&with_environment(&keys, Some(&white), (16, 4), ball), mode);
                let pixel = |i: usize| film.means().nth(i).unwrap_or_default();
                assert_eq!(pixel(0), [0.5, 0.25, 8.0], "{environment}, {mode:?}");
                let [x, ..] = pixel(8 * 16 + 8);
                assert!(
                    (x - expected).abs() < 1e-5,
                    "the mirror does not show the environment map: {environment}, {mode:?}: {x}"
                );
                film
            })
            .collect();
        let [first, .., last] = &films[..] else { continue };
        assert_eq!(differing(first, last), 0, "{environment}");
    }
}

#[test]
fn a_scale_of_two_doubles_every_pixel_exactly() {
    for mode in both() {
        let film = |scale: f64| {
            render(
                &with_map(&noise_image(16, 8), &format!("\nscale = {scale}"), (16, 3), GROUND),
                mode,
            )
        };
        let (single, doubled) = (film(1.0), film(2.0));
        for (single, doubled) in single.means().zip(doubled.means()) {
            assert_eq!(single.map(|x| 2.0 * x), doubled, "{mode:?}");
        }
        assert_eq!(mean(&film(0.0)), [0.0; 3]);
        assert!(mean(&film(1e6)).iter().all(|x| x.is_finite()));
    }
}

#[test]
fn all_backends_give_the_same_bits() {
    let text = format!("{EMITTERS}[[lights]]\ntype = 'point'\nposition = [1, -1, 2]\ncolor = [2, 2, 2]\n");
    for image in [noise_image(33, 17), sunny_image(), image(1, 1, |_, _| [1.0; 3])] {
        for rotation in ["", "\nrotate = [10, 20, 30]"] {
            let packed = with_map(&image, rotation, (64, 5), &text);
            let expected = render(&packed, RenderMode::Cpu);
            for mode in exact_modes() {
                assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}");
            }
        }
    }
}

fn samples(packed: &Packed, normal: Vec3, count: u32) -> impl Iterator<Item = Vec3> {
    let light = packed
        .lighting
        .lights
        .iter()
        .find(|light| light.kind == ENVIRONMENT)
        .expect("an environment map");
    (0..count).map(move |i| {
        let u = sobol_sample(i, UVec2::new(5, 6));
        let sample = sample_environment(packed, light, normal, u);
        let eval = environment_eval(packed, sample.to, normal);
        assert_eq!((sample.radiance, sample.pdf), (eval.radiance, eval.pdf));
        sample.to
    })
}

#[test]
fn sampled_directions_follow_their_pdf() {
    const COLUMNS: usize = 24;
    const ROWS: usize = 13;
    const COUNT: u32 = 1 << 18;
    let bin = |direction: Vec3| {
        let d = direction.as_dvec3().normalize();
        let u = 0.5 - d.y.atan2(d.x) / TAU;
        let v = d.z.clamp(-1.0, 1.0).acos() / PI;
        ((v * ROWS as f64) as usize).min(ROWS - 1) * COLUMNS + ((u * COLUMNS as f64) as usize).min(COLUMNS - 1)
    };
    let images = [
        image(1, 1, |_, _| [1.0; 3]),
        image(2, 1, |x, _| [x as f32; 3]),
        image(3, 5, |x, y| [(x + 2 * y) as f32; 3]),
        noise_image(33, 17),
        noise_image(130, 70),
        one_bright_texel(16, 8, (3, 0)),
        sunny_image(),
    ];
    // A zero normal selects all directions.
    let normals = [Vec3::ZERO, Vec3::Z, Vec3::new(0.6, -0.48, -0.64)];
    for (image, normal) in (images.iter()).flat_map(|image| normals.map(|normal| (image, normal))) {
        let packed = with_map(image, "", (1, 1), GROUND);
        let mut counts = vec![0.0; COLUMNS * ROWS];
        samples(&packed, normal, COUNT).for_each(|direction| counts[bin(direction)] += 1.0);
        // The expected counts are integrated on a grid much finer than the texels, because bins and texels do not
        // align.
        let mut expected = [0.0, 0.08].map(|_| vec![0.0; COLUMNS * ROWS]);
        let fine = image.width.max(image.height).max(24) * 16;
        for row in 0..fine {
            let v = (f64::from(row) + 0.5) / f64::from(fine);
            let (sine, cosine) = (PI * v).sin_cos();
            for column in 0..2 * fine {
                let azimuth = PI - TAU * (f64::from(column) + 0.5) / f64::from(2 * fine);
                let direction = DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine).as_vec3();
                let pdf = f64::from(environment_eval(&packed, direction, normal).pdf);
                let cell_count = pdf * sine * PI / f64::from(fine) * TAU / f64::from(2 * fine) * f64::from(COUNT);
                let index = bin(direction);
                expected[0][index] += cell_count;
                expected[1][index] += cell_count * if direction.x > 0.0 { 1.08 } else { 0.92 };
            }
        }
        let size = (image.width, image.height, normal);
        let total: f64 = expected[0].iter().sum::<f64>() / f64::from(COUNT);
        assert!((total - 1.0).abs() < 2e-3, "{size:?}: the PDF integrates to {total}");
        let statistic = |expected: &[f64]| {
            let (mut sum, mut degrees_of_freedom) = (0.0, -1.0_f64);
            for (count, expected) in counts.iter().zip(expected) {
                if *expected >= 20.0 {
                    sum += (count - expected) * (count - expected) / expected;
                    degrees_of_freedom += 1.0;
                } else {
                    assert!(*count < 60.0, "{size:?}: {count} samples; expected {expected}");
                }
            }
            (sum, degrees_of_freedom)
        };
        let (sum, degrees_of_freedom) = statistic(&expected[0]);
        // The mean plus six standard deviations, plus the error of the grid.
        let max_sum = degrees_of_freedom + 6.0 * (2.0 * degrees_of_freedom).sqrt() + 20.0;
        assert!(
            degrees_of_freedom > 2.0 && sum < max_sum,
            "{size:?}: chi-square {sum} for {degrees_of_freedom} degrees of freedom"
        );
        let (wrong, _) = statistic(&expected[1]);
        assert!(
            wrong > max_sum,
            "{size:?}: a wrong PDF is accepted: chi-square {wrong} for {degrees_of_freedom} degrees of freedom"
        );
    }
}

#[test]
fn an_unoccluded_wall_has_little_noise() {
    // All pixels have the same expected value.
    let noise = |normal: [f64; 3], (samples, pattern): (u32, &str)| {
        let [x, y, z] = normal;
        let text = format!(
            "image = {{ width = 32, height = 32 }}\n\
             camera = {{ position = [{x}, {y}, {z}], look_at = [0, 0, 0], up = [0.3, 0.5, 0.7], fov = 10 }}\n\
             materials.m = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\n\
             render = {{ integrator = 'path', max_depth = 1, pixel_samples = {{ count = {samples}, pattern = '{pattern}' }} }}\n\
             environment = {{ name = 'studio' }}\n\
             [[shapes]]\ntype = 'rectangle'\nmaterial = 'm'\ncenter = [0, 0, 0]\nsize = [9, 9]\nnormal = [{x}, {y}, {z}]\n\
             tangent = [0.3, 0.5, 0.7]\n"
        );
        let film = render(&crate::scenes::parse(&text), RenderMode::Cpu);
        let values: Vec<f64> = film.means().map(|[_, green, _]| f64::from(green)).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        (squares / values.len() as f64).sqrt() / mean
    };
    let normals = [
        [0.0, -1.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.36, -0.48, 0.8],
        [-0.6, 0.64, -0.48],
    ];
    for normal in normals {
        let found = noise(normal, (64, "sobol"));
        assert!(found < 0.035, "{normal:?}: {found}");
    }
    // Negative controls: unstratified samples, and few samples.
    assert!(noise([0.0, -1.0, 0.0], (64, "random")) > 0.035);
    assert!(noise([0.0, -1.0, 0.0], (4, "sobol")) > 0.035);
}

#[test]
fn directions_in_a_cell_map_back_to_the_cell() {
    use wgray_trace::cpu::equirect::{cell_towards, direction_in_cell};
    for (width, height) in [(1, 1), (2, 1), (3, 2), (16, 8), (8192, 4096)] {
        for column in [0, width / 3, width / 2, width - 1] {
            for row in [0, 1, height / 3, height / 2, height - 1, height] {
                if row > height {
                    continue;
                }
                let u = glam::Vec2::new(0.5, 0.5);
                let d = direction_in_cell(column, row, u, width, height);
                let cell = cell_towards(d, width, height);
                assert_eq!((cell.column, cell.row), (column, row), "{width} x {height}: {d}");
                assert!((d.length() - 1.0).abs() < 1e-6, "{d}");
            }
        }
        for pole in [Vec3::Z, Vec3::NEG_Z, Vec3::ZERO] {
            let cell = cell_towards(pole, width, height);
            assert!(cell.column < width && cell.row <= height, "{pole}");
        }
    }
}
