//! Panoramic camera: directions, poles and seam, solid angles, differentials, crops.

use glam::{DVec3, Vec2, Vec3};
use wgray::Scene;
use wgray_image::Region;
use wgray_render::job::WorkSplit;
use wgray_trace::cpu::panorama::{panorama_differential, panorama_ray};
use wgray_trace::records::{NO_INDEX, Packed};

use crate::pictures::{backend, both, crop, differing, film, first_hits, means, render};
use crate::scenes::parse;

const WIDTH: u32 = 128;
const HEIGHT: u32 = 64;

/// Returns emissive spheres at distance 10 around a camera at (1, 2, 3).
fn spheres(directions: &[DVec3], radius: f64) -> Packed {
    let shapes: String = directions
        .iter()
        .map(|direction| {
            let center = DVec3::new(1.0, 2.0, 3.0) + *direction * 10.0;
            format!(
                "[[shapes]]\ntype = 'sphere'\nmaterial = 'light'\ncenter = [{}, {}, {}]\nradius = {radius}\n",
                center.x, center.y, center.z
            )
        })
        .collect();
    parse(&format!(
        "image = {{ width = {WIDTH}, height = {HEIGHT} }}
        camera = {{ type = 'panorama', position = [1, 2, 3], look_at = [1, 5, 3] }}
        [render]
        integrator = 'path'
        pixel_samples = {{ count = 64 }}
        [materials.light]
        type = 'diffuse'
        color = [0, 0, 0]
        emission = [1, 1, 1]
        {shapes}"
    ))
}

/// Returns the direction `east` degrees to the right of the view direction and `north` degrees above the horizon.
fn direction(east: f64, north: f64) -> DVec3 {
    let (east, north) = (east.to_radians(), north.to_radians());
    DVec3::new(east.sin() * north.cos(), east.cos() * north.cos(), north.sin())
}

#[test]
fn directions_match_the_mapping() {
    let packed = spheres(&[], 1.0);
    let (w, h) = (WIDTH as f32, HEIGHT as f32);
    for (point, expected) in [
        ((0.5, 0.5), Vec3::Y),
        ((0.0, 0.5), Vec3::NEG_Y),
        ((1.0, 0.5), Vec3::NEG_Y),
        ((0.25, 0.5), Vec3::NEG_X),
        ((0.75, 0.5), Vec3::X),
        ((0.5, 0.0), Vec3::Z),
        ((0.1, 0.0), Vec3::Z),
        ((0.5, 1.0), Vec3::NEG_Z),
        ((0.5, 0.25), Vec3::new(0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt())),
        ((0.5, -0.25), Vec3::new(0.0, -(0.5_f32.sqrt()), 0.5_f32.sqrt())), // beyond the pole, within the support of the pixel filter
        ((1.25, 0.5), Vec3::NEG_X),                                        // filter support beyond the seam
    ] {
        let ray = panorama_ray(&packed.camera, Vec2::new(point.0 * w, point.1 * h));
        assert_eq!(ray.origin, packed.camera.position);
        assert!(ray.direction.distance(expected) < 1e-6, "{point:?}: {}", ray.direction);
        assert!((ray.direction.length() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn spheres_appear_at_their_direction_with_their_solid_angle() {
    // Directions of the sphere: center, seam, general position, pole, near the pole.
    for (east, north) in [(0.0, 0.0), (180.0, 0.0), (77.0, -31.0), (0.0, 90.0), (33.0, -86.0)] {
        let sphere_direction = direction(east, north);
        let packed = spheres(&[sphere_direction], 3.0);
        for mode in both() {
            let hits = first_hits(&packed, mode);
            let picture = means(&render(&packed, mode));
            let mut solid_angle = 0.0;
            for (i, (hit, mean)) in hits.iter().zip(&picture).enumerate() {
                let (x, y) = (i as u32 % WIDTH, i as u32 / WIDTH);
                let center = direction(
                    (f64::from(x) + 0.5) * 360.0 / f64::from(WIDTH) - 180.0,
                    90.0 - (f64::from(y) + 0.5) * 180.0 / f64::from(HEIGHT),
                );
                let sine = center.cross(sphere_direction).length();
                if (sine - 0.3).abs() > 1e-5 {
                    let is_covered = sine < 0.3 && center.dot(sphere_direction) > 0.0;
                    assert_eq!(
                        hit.shape != NO_INDEX,
                        is_covered,
                        "{mode:?} {east} {north}: pixel {x}, {y}"
                    );
                }
                if hit.shape != NO_INDEX {
                    // The depth is the distance along the ray to the nearer side.
                    let distance = 10.0
                        * (center.dot(sphere_direction) - (center.dot(sphere_direction).powi(2) - 1.0 + 0.09).sqrt());
                    assert!(
                        (f64::from(hit.depth) - distance).abs() < 1e-3,
                        "{} {distance}",
                        hit.depth
                    );
                }
                let turn = std::f64::consts::TAU / f64::from(WIDTH);
                let row_cosine = |row: u32| (f64::from(row) * std::f64::consts::PI / f64::from(HEIGHT)).cos();
                solid_angle += mean[0] * turn * (row_cosine(y) - row_cosine(y + 1));
            }
            let expected = std::f64::consts::TAU * (1.0 - (1.0 - 0.09_f64).sqrt());
            // The tolerance includes the variation within rows near a pole.
            assert!(
                (solid_angle / expected - 1.0).abs() < 0.015,
                "{mode:?} {east} {north}: {solid_angle} {expected}"
            );
        }
    }
}

#[test]
fn differentials_match_adjacent_rays() {
    let packed = spheres(&[], 1.0);
    let exact_direction = |x: f64, y: f64| {
        direction(
            x * 360.0 / f64::from(WIDTH) - 180.0,
            90.0 - y * 180.0 / f64::from(HEIGHT),
        )
    };
    for (x, y) in [(64.0, 32.0), (3.25, 7.5), (127.9, 60.0), (10.0, 0.01), (20.0, 63.99)] {
        let found = panorama_differential(&packed.camera, Vec2::new(x as f32, y as f32), 0.5);
        let h = 1e-4;
        let dx = (exact_direction(x + h, y) - exact_direction(x - h, y)) * (0.5 / (2.0 * h));
        let dy = (exact_direction(x, y + h) - exact_direction(x, y - h)) * (0.5 / (2.0 * h));
        assert!(
            found.x.direction.as_dvec3().distance(dx) < 1e-6,
            "{x} {y}: {found:?} {dx}"
        );
        assert!(
            found.y.direction.as_dvec3().distance(dy) < 1e-6,
            "{x} {y}: {found:?} {dy}"
        );
        assert_eq!((found.x.position, found.y.position), (Vec3::ZERO, Vec3::ZERO));
    }
}

#[test]
fn a_crop_has_the_pixels_of_the_full_image() {
    let packed = spheres(&[direction(10.0, 20.0), direction(180.0, 0.0)], 3.0);
    let full = render(&packed, both()[0]);
    let region = Region {
        x0: 0,
        y0: 5,
        x1: 90,
        y1: 17,
    };
    for mode in both() {
        let found = film(&mut *backend(&packed, mode), &packed, region, &WorkSplit::default());
        assert_eq!(differing(&found, &crop(&full, region)), 0, "{mode:?}");
    }
}

#[test]
fn inapplicable_camera_keys_are_rejected() {
    let camera =
        "image = { width = 4, height = 2 }\n[camera]\ntype = 'panorama'\nposition = [0, 0, 0]\nlook_at = [0, 1, 0]\n";
    Scene::parse(camera, "s.toml").unwrap();
    for (keys, message) in [
        ("fov = 40", "camera.fov: unknown key"),
        ("aperture = 1", "camera.aperture: unknown key"),
        (
            "up = [0, 1, 0]",
            "camera.look_at: [0, 1, 0] makes the view parallel to up",
        ),
        (
            "path.keys = [{ frame = 1, fov = 40 }]",
            "camera.path.keys[0].fov: does not apply to a camera of this type",
        ),
        (
            "path.keys = [{ frame = 1 }]",
            "camera.path.keys[0]: must have \"position\", \"look_at\" or \"up\"",
        ),
    ] {
        let error = Scene::parse(&format!("{camera}{keys}\n"), "s.toml")
            .expect_err(keys)
            .to_string();
        assert!(error.contains(message), "{keys}: {error}");
    }
    let moving =
        format!("{camera}path.keys = [{{ frame = 1, position = [0, 0, 1] }}, {{ frame = 3, position = [0, 0, 3] }}]\n");
    let scene = Scene::parse(&moving, "s.toml").unwrap();
    assert_eq!(scene.camera_at(2.0).unwrap().position, DVec3::Z * 2.0);
}
