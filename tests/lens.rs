//! Thin lens camera: the circle of confusion in closed form, the aperture shape, the focus plane, and parameter limits.

use glam::{Vec2, Vec3};
use wgray::Scene;
use wgray_trace::cpu::camera::camera_ray;
use wgray_trace::cpu::lens::{lens_ray, lens_sample};
use wgray_trace::cpu::sequence::sobol_sample;
use wgray_trace::records::Packed;

use crate::pictures::{both, differing, exact_modes, means, render};
use crate::scenes::{self, parse};

/// Width and height of the image in pixels.
const SIDE: u32 = 64;
/// Field of view in degrees.
const FOV: f64 = 10.0;

/// Returns a scene with an emissive disk of radius 0.005 * `distance`. The camera is at the origin and looks along y;
/// `lens` contains more lines of the `[camera]` table.
fn disk_scene(distance: f64, lens: &str, samples: u32) -> Packed {
    let radius = 0.005 * distance;
    parse(&format!(
        "image = {{ width = {SIDE}, height = {SIDE} }}
        [camera]
        position = [0, 0, 0]
        look_at = [0, 4, 0]
        fov = {FOV}
        {lens}
        [render]
        integrator = 'path'
        pixel_samples = {{ count = {samples} }}
        [materials.light]
        type = 'diffuse'
        color = [0, 0, 0]
        emission = [1, 1, 1]
        [[shapes]]
        type = 'disk'
        material = 'light'
        center = [0, {distance}, 0]
        radius = {radius}
        normal = [0, -1, 0]
        tangent = [1, 0, 0]"
    ))
}

/// Returns the number of pixels per unit of length at distance 1.
fn pixels_per_unit() -> f64 {
    f64::from(SIDE) / 2.0 / (FOV / 2.0).to_radians().tan()
}

/// Returns the offset of a pixel center from the image center, in pixels to the right and up.
fn pixel_offset(i: usize) -> (f64, f64) {
    let side = SIDE as usize;
    let half_side = f64::from(SIDE) / 2.0;
    ((i % side) as f64 + 0.5 - half_side, half_side - (i / side) as f64 - 0.5)
}

/// Returns two relative errors in the image of a disk that is blurred to `radius` at distance 1: the maximum error of
/// the mean radiance in rings, and the error of the total radiance.
fn relative_errors(picture: &[[f64; 3]], radius: f64) -> (f64, f64) {
    let (circle_radius, disk_radius) = (radius * pixels_per_unit(), 0.005 * pixels_per_unit());
    // The fraction of the aperture that sees the disk.
    let aperture_fraction = disk_radius * disk_radius / (circle_radius * circle_radius);
    let mut max_ring_error = 0.0_f64;
    let mut total = 0.0;
    let rings = [0.0, 0.4, 0.7, 1.0].map(|fraction| fraction * (circle_radius - disk_radius - 1.0));
    let mut sums = [(0.0, 0.0); 3];
    for (i, mean) in picture.iter().enumerate() {
        let (x, y) = pixel_offset(i);
        let distance = x.hypot(y);
        total += mean[0];
        for (ring, sum) in rings.windows(2).zip(&mut sums) {
            if (ring[0]..ring[1]).contains(&distance) {
                *sum = (sum.0 + mean[0], sum.1 + 1.0);
            }
        }
        if distance > circle_radius + disk_radius + 1.0 {
            max_ring_error = max_ring_error.max(mean[0] / aperture_fraction);
        }
    }
    for (sum, count) in sums {
        max_ring_error = max_ring_error.max((sum / count / aperture_fraction - 1.0).abs());
    }
    let expected_total = std::f64::consts::PI * disk_radius * disk_radius;
    (max_ring_error, (total / expected_total - 1.0).abs())
}

#[test]
fn an_out_of_focus_disk_blurs_to_its_circle_of_confusion() {
    // An aperture of radius r focused at f blurs a point at z to a circle of radius r |1 / f - 1 / z| at distance 1.
    let lens = "aperture = 0.4\nfocus_distance = 4";
    for mode in both() {
        for distance in [12.0, 2.5] {
            let radius = 0.2 * (1.0_f64 / 4.0 - 1.0 / distance).abs();
            let packed = disk_scene(distance, lens, 1024);
            let picture = means(&render(&packed, mode));
            let (max_ring_error, total_error) = relative_errors(&picture, radius);
            assert!(max_ring_error < 0.03, "{mode:?} {distance}: {max_ring_error}");
            assert!(total_error < 0.02, "{mode:?} {distance}: {total_error}");
            assert!(
                relative_errors(&picture, 1.1 * radius).0 > 0.1,
                "a larger circle is accepted"
            );
            assert!(
                relative_errors(&picture, 0.9 * radius).0 > 0.1,
                "a smaller circle is accepted"
            );
        }
    }
}

#[test]
fn an_f_number_sets_the_aperture() {
    // The default focus distance is the distance to `look_at`.
    let camera_with = |lens: &str| disk_scene(12.0, lens, 1).camera;
    assert_eq!(
        camera_with("focal_length = 0.8\nf_number = 2"),
        camera_with("aperture = 0.4\nfocus_distance = 4")
    );
    assert_ne!(
        camera_with("focal_length = 0.8\nf_number = 4"),
        camera_with("aperture = 0.4\nfocus_distance = 4")
    );
}

#[test]
fn the_focus_plane_is_sharp() {
    let lens = "aperture = 0.4\nfocus_distance = 5";
    for mode in both() {
        let focused = means(&render(&disk_scene(5.0, lens, 256), mode));
        let pinhole = means(&render(&disk_scene(5.0, "", 256), mode));
        let defocused = means(&render(&disk_scene(5.5, lens, 256), mode));
        // In focus, the images differ only by rounding at the edge of the disk, because the pixel samples are the same.
        let difference = |a: &[[f64; 3]]| a.iter().zip(&pinhole).map(|(a, b)| (a[0] - b[0]).abs()).sum::<f64>();
        assert!(difference(&focused) < 0.05, "{mode:?}: {}", difference(&focused));
        assert!(difference(&defocused) > 1.0, "{mode:?}: {}", difference(&defocused));
    }
}

#[test]
fn blades_give_a_polygon_with_a_corner_at_the_top() {
    let lens = "aperture = 0.4\nfocus_distance = 4\nblades = 3\nblade_rotation = ";
    let is_lit = |packed: &Packed, (x, y): (f64, f64), mode| {
        let picture = means(&render(packed, mode));
        let is_near = |i: usize| (pixel_offset(i).0 - x).hypot(pixel_offset(i).1 - y) < 2.0;
        (0..picture.len())
            .filter(|i| is_near(*i))
            .map(|i| picture[i][0])
            .sum::<f64>()
            > 0.0
    };
    for mode in both() {
        let circle_radius = 0.2 * (1.0 / 4.0 - 1.0 / 12.0) * pixels_per_unit();
        let point_at = |degrees: f64| {
            let (sin, cos) = (90.0 + degrees).to_radians().sin_cos();
            (0.8 * circle_radius * cos, 0.8 * circle_radius * sin)
        };
        // Far points show the aperture upright. The middle of a side, 60 degrees from a corner, is half as far from the
        // center as a corner.
        for degrees in [0.0, 30.0, -100.0] {
            let far = disk_scene(12.0, &format!("{lens}{degrees}"), 64);
            assert!(is_lit(&far, point_at(degrees), mode), "{mode:?} {degrees}");
            assert!(!is_lit(&far, point_at(degrees + 60.0), mode), "{mode:?} {degrees}");
            assert!(is_lit(&far, point_at(degrees + 120.0), mode), "{mode:?} {degrees}");
        }
        // Near points show the aperture upside down. Their circle of confusion has nearly the same radius.
        let near = disk_scene(2.4, &format!("{lens}0"), 64);
        assert!(is_lit(&near, point_at(180.0), mode), "{mode:?}");
        assert!(!is_lit(&near, point_at(0.0), mode), "{mode:?}");
    }
}

#[test]
fn apertures_are_sampled_uniformly() {
    for blades in [0, 3, 4, 5, 6, 7, 16] {
        let corners = f64::from(blades);
        let turn = std::f64::consts::TAU / corners;
        let count = 1 << 14;
        // Polar second moment over area: Young and Budynas, "Roark's Formulas for Stress and Strain", table A.1.
        let expected = if blades == 0 { 0.5 } else { (2.0 + turn.cos()) / 6.0 };
        let (mut mean, mut moment, mut inner, mut farthest) = (Vec2::ZERO.as_dvec2(), 0.0, 0.0, 0.0_f64);
        for i in 0..count {
            let p = lens_sample(blades, sobol_sample(i, glam::UVec2::new(3, 7))).as_dvec2();
            mean += p / f64::from(count);
            moment += p.length_squared() / f64::from(count);
            // Distance from the center as a fraction of the distance to the edge.
            let edge_fraction = match blades {
                0 => p.length(),
                _ => (0..blades)
                    .map(|side| {
                        let (sin, cos) = ((f64::from(side) + 0.5) * turn).sin_cos();
                        (p.x * cos + p.y * sin) / (turn / 2.0).cos()
                    })
                    .fold(0.0, f64::max),
            };
            assert!(edge_fraction < 1.0 + 1e-6, "{blades}: {p}");
            inner += f64::from(u8::from(edge_fraction < 0.5)) / f64::from(count);
            farthest = farthest.max(p.length());
        }
        assert!(mean.length() < 2e-3, "{blades}: {mean}");
        assert!((moment - expected).abs() < 2e-3, "{blades}: {moment} {expected}");
        assert!((inner - 0.25).abs() < 3e-3, "{blades}: {inner}");
        assert!(farthest > 0.98 && farthest < 1.0 + 1e-6, "{blades}: {farthest}");
    }
}

#[test]
fn lens_samples_are_stratified_and_independent_of_pixel_samples() {
    // Each quarter of the lens gets about 4 of the 16 samples of a pixel. Over 64 pixels, each pair of a pixel quarter
    // and a lens quarter gets about 64 samples.
    let packed = disk_scene(12.0, "aperture = 2\nfocus_distance = 1", 16);
    let mut counts = [[0_u32; 4]; 4];
    for pixel in 0..64 {
        let mut lens_counts = [0; 4];
        for sample in 0..16 {
            let pixel = glam::UVec2::new(pixel, 9);
            let ray = wgray_trace::cpu::pixel::camera_sample(&packed, pixel, sample).ray;
            let lens = ray.origin / packed.camera.lens_u.length();
            let image_point =
                (ray.direction / ray.direction.y + ray.origin * packed.camera.inverse_focus) * pixels_per_unit() as f32;
            let sample_point =
                Vec2::new(image_point.x + SIDE as f32 / 2.0, SIDE as f32 / 2.0 - image_point.z) - pixel.as_vec2();
            // The square-to-disk mapping preserves the sectors between the diagonals, which have equal areas.
            let sector = usize::from(lens.x > lens.z) + 2 * usize::from(lens.x > -lens.z);
            let quarter = usize::from(sample_point.x > 0.5) + 2 * usize::from(sample_point.y > 0.5);
            lens_counts[sector] += 1;
            counts[sector][quarter] += 1;
        }
        assert!(
            lens_counts.iter().all(|count| (2..=6).contains(count)),
            "{lens_counts:?}"
        );
    }
    for count in counts.iter().flatten() {
        assert!(
            (40..=88).contains(count),
            "expected about 64 samples for each pair of quarters: {counts:?}"
        );
    }
}

#[test]
fn lens_rays_converge_in_the_focus_plane() {
    let packed = disk_scene(12.0, "aperture = 0.4\nfocus_distance = 4", 1);
    for pixel_point in [Vec2::new(1.0, 60.0), Vec2::new(40.5, 3.25)] {
        let center_direction = camera_ray(&packed.camera, pixel_point).direction;
        for p in [Vec2::X, Vec2::new(-0.3, 0.9), Vec2::ZERO] {
            let ray = lens_ray(&packed.camera, pixel_point, p);
            let lens_point = ray.origin - packed.camera.position;
            let point = lens_point + ray.direction * (4.0 / ray.direction.y);
            assert!(
                point.distance(center_direction * (4.0 / center_direction.y)) < 2e-6,
                "{pixel_point} {p}: {point}"
            );
            assert!((lens_point - Vec3::new(0.2 * p.x, 0.0, 0.2 * p.y)).length() < 1e-6);
        }
    }
}

#[test]
fn parameter_limits_render_equally_in_all_modes() {
    let pinhole = disk_scene(12.0, "", 16);
    for aperture in ["0", "1e-300", "1e-9", "1", "1e9"] {
        for focus in ["1e-9", "1e-3", "1e9"] {
            let packed = disk_scene(12.0, &format!("aperture = {aperture}\nfocus_distance = {focus}"), 16);
            assert_eq!(packed.specialization.lens == 0, aperture == "0");
            let films: Vec<_> = exact_modes().into_iter().map(|mode| render(&packed, mode)).collect();
            for film in &films {
                assert!(film.sums.iter().all(|sum| sum.is_finite()), "{aperture} {focus}");
                assert_eq!(differing(film, &films[0]), 0, "{aperture} {focus}");
            }
            if aperture == "0" {
                assert_eq!(packed.camera, pinhole.camera);
                assert_eq!(packed.specialization, pinhole.specialization);
            }
        }
    }
}

#[test]
fn invalid_lenses_are_rejected() {
    for (lens, message) in [
        ("aperture = -0.1", "camera.aperture: -0.1 must be from 0 to 1e9"),
        ("aperture = nan", "camera.aperture: nan must be from 0 to 1e9"),
        ("aperture = 2e9", "camera.aperture: 2e9 must be from 0 to 1e9"),
        ("f_number = 0", "camera.f_number: 0 must be from 0.1 to 1e9"),
        (
            "f_number = 2\naperture = 0.1",
            "camera.f_number: cannot be combined with aperture: both set the diameter of the lens",
        ),
        (
            "focus_distance = 0",
            "camera.focus_distance: 0 must be from 1e-9 to 1e9",
        ),
        (
            "blades = 2",
            "camera.blades: 2 must be 0 or a whole number from 3 to 16",
        ),
        (
            "blades = -1",
            "camera.blades: -1 must be 0 or a whole number from 3 to 16",
        ),
        (
            "blades = 17",
            "camera.blades: 17 must be 0 or a whole number from 3 to 16",
        ),
        (
            "blade_rotation = 361",
            "camera.blade_rotation: 361 must be from -360 to 360",
        ),
        (
            "type = 'orthographic'\nheight = 1\naperture = 1",
            "camera.aperture: unknown key",
        ),
    ] {
        let fov = if lens.contains("height") { "" } else { "fov = 40\n" };
        let text = format!(
            "image = {{ width = 4, height = 4 }}\n[camera]\nposition = [0, 0, 0]\nlook_at = [0, 1, 0]\n{fov}{lens}\n"
        );
        let error = Scene::parse(&text, "s.toml").expect_err(lens).to_string();
        assert!(error.contains(message), "{lens}: {error}");
    }
}

#[test]
fn a_path_animates_focus_and_aperture() {
    let text = "image = { width = 4, height = 4 }
        [camera]
        position = [0, 0, 0]
        look_at = [0, 1, 0]
        fov = 40
        f_number = 10
        path.keys = [{ frame = 1, focus_distance = 2 }, { frame = 2, aperture = 0 }, { frame = 3, focus_distance = 4, aperture = 1 }]
        ";
    let scene = Scene::parse(text, "s.toml").unwrap();
    let still_lens = scene.camera.lens.unwrap();
    assert_eq!(
        (still_lens.radius, still_lens.focus),
        (0.05, 2.0),
        "a still image does not use the lens of the camera"
    );
    assert_eq!(
        scene.camera_at(1.0).unwrap().lens,
        None,
        "a frame of the path does not use the lens of the keys"
    );
    let lens = scene.camera_at(2.5).unwrap().lens.unwrap();
    assert_eq!((lens.radius, lens.focus), (0.25, 3.5));
    for (key, message) in [
        (
            "aperture = -1",
            "camera.path.keys[0].aperture: -1 must be from 0 to 1e9",
        ),
        (
            "focus_distance = 0",
            "camera.path.keys[0].focus_distance: 0 must be from 1e-9 to 1e9",
        ),
        (
            "height = 1",
            "camera.path.keys[0].height: does not apply to a camera of this type",
        ),
    ] {
        let text = text.replace("focus_distance = 2 }", &format!("{key} }}"));
        let error = Scene::parse(&text, "s.toml").expect_err(key).to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn the_lens_scene_has_a_lens() {
    let scene = scenes::scene("lens.toml");
    let packed = scenes::packed(&scene);
    assert_eq!(packed.specialization.lens, 1);
}
