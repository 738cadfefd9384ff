//! Spot lights, compared with closed-form values.

use wgray_trace::records::Packed;

use super::mean;
use crate::pictures::{both, means, render};
use crate::scenes;

/// Returns a scene with a white floor of 3 x 3 units, seen from above in 16 x 16 pixels.
fn floor(integrator: &str, light: &str) -> Packed {
    let material = match integrator {
        "path" => "type = 'diffuse', color = [1, 1, 1]",
        _ => "type = 'phong', diffuse = [1, 1, 1], ambient = [0, 0, 0], specular = [0, 0, 0]",
    };
    scenes::parse(&format!(
        "image = {{ width = 16, height = 16 }}\n\
         camera = {{ type = 'orthographic', position = [0, 0, 0.5], look_at = [0, 0, 0], up = [0, 1, 0], height = 3 }}\n\
         materials.m = {{ {material} }}\nrender = {{ integrator = '{integrator}', max_depth = 1, pixel_samples = {{ count = 256 }} }}\n\
         [[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n{light}\n"
    ))
}

/// Evaluates the documented formula of a spot light of color 1 above (0.2, 0.1, 0) that points down.
fn expected(point: [f64; 2], height: f64, cone: f64, inner: f64, is_path: bool) -> f64 {
    let (x, y) = (point[0] - 0.2, point[1] - 0.1);
    let distance = (x * x + y * y + height * height).sqrt();
    let cosine = height / distance;
    let (outer, inner) = (cone.to_radians().cos(), inner.to_radians().cos());
    let ramp = ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0);
    let falloff = if is_path {
        distance * distance * std::f64::consts::PI
    } else {
        1.0
    };
    ramp * ramp * cosine / falloff
}

#[test]
fn a_spot_light_matches_the_documented_formula() {
    for (integrator, cone, inner) in [
        ("path", 40.0, 10.0),
        ("path", 60.0, 0.0),
        ("path", 120.0, 20.0),
        ("phong", 40.0, 10.0),
        ("phong", 60.0, 55.0),
    ] {
        let light = format!(
            "[[lights]]\ntype = 'spot'\nposition = [0.2, 0.1, 0.9]\nlook_at = [0.2, 0.1, 0]\ncolor = [1, 1, 1]\n\
             cone_angle = {cone}\ninner_angle = {inner}"
        );
        let packed = floor(integrator, &light);
        for mode in both() {
            let found = means(&render(&packed, mode));
            let (mut error, mut wider_error) = (0.0_f64, 0.0_f64);
            for (i, pixel) in found.iter().enumerate() {
                // Mean over 32 x 32 points of the pixel.
                let mean = |cone: f64| {
                    let coordinate = |k: usize, sub: usize| (k as f64 + (sub as f64 + 0.5) / 32.0) * 3.0 / 16.0 - 1.5;
                    let points = (0..1024).map(|k| [coordinate(i % 16, k % 32), -coordinate(i / 16, k / 32)]);
                    points
                        .map(|point| expected(point, 0.9, cone, inner, integrator == "path"))
                        .sum::<f64>()
                        / 1024.0
                };
                error = error.max((pixel[0] - mean(cone)).abs());
                wider_error = wider_error.max((pixel[0] - mean(cone + 2.0)).abs());
            }
            assert!(error < 4e-3, "{mode:?}, {integrator}, {cone}, {inner}: {error}");
            assert!(
                wider_error > error,
                "{mode:?}: a cone that is wider by 2 degrees is accepted: {wider_error}"
            );
        }
    }
}

#[test]
fn a_180_degree_spot_equals_a_point_light_and_a_tiny_cone_lights_almost_nothing() {
    for integrator in ["path", "phong"] {
        let scene_with = |light: &str| {
            floor(
                integrator,
                &format!("[[lights]]\nposition = [0.2, 0.1, 0.9]\ncolor = [1, 1, 1]\n{light}"),
            )
        };
        let point = scene_with("type = 'point'");
        let wide = scene_with("type = 'spot'\ndirection = [1, 2, 3]\ncone_angle = 180\ninner_angle = 180");
        let narrow = scene_with("type = 'spot'\ndirection = [0, 0, -1]\ncone_angle = 0.01\ninner_angle = 0.01");
        let away = scene_with("type = 'spot'\ndirection = [0, 0, 1]\ncone_angle = 90");
        for mode in both() {
            let expected = means(&render(&point, mode));
            for (a, b) in means(&render(&wide, mode)).iter().zip(&expected) {
                assert!(
                    (a[0] - b[0]).abs() < 1e-6 && a[0] > 0.0,
                    "{mode:?}: {a:?}, expected {b:?}"
                );
            }
            // The cone lights a disk of radius 0.00016, about 1e-8 of the floor.
            assert!(mean(&render(&narrow, mode))[0] < 1e-4, "{mode:?}");
            assert_eq!(
                mean(&render(&away, mode)),
                [0.0; 3],
                "{mode:?}: a spot light that faces away lights the floor"
            );
        }
    }
}
