//! Closed-form radiance on both backends. The negative controls check that wrong values are rejected.

use std::f64::consts::PI;

use super::{mean, scene};
use crate::pictures::{both, means, render};

/// A camera near the origin that looks roughly along +x.
const CAMERA_INSIDE: &str = "camera = { position = [0.1, 0, 0.05], look_at = [1, 0, 0.2], fov = 60 }\n";

fn camera_above(x: f64, y: f64, z: f64, height: f64) -> String {
    format!(
        "camera = {{ type = 'orthographic', position = [{x}, {y}, {z}], look_at = [{x}, {y}, 0], up = [0, 1, 0], height = {height} }}\n"
    )
}

const FLOOR: &str =
    "[[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n";

fn is_near(found: f64, expected: f64, relative_tolerance: f64) -> bool {
    (found - expected).abs() <= relative_tolerance * expected.abs()
}

#[test]
fn a_convex_body_in_a_furnace_shows_its_albedo() {
    // Each sample equals the albedo, so the variance is zero.
    for (material, albedo, tolerance) in [
        ("type = 'diffuse', color = [0.8, 0.5, 1]", [0.8, 0.5, 1.0], 1e-5),
        ("type = 'diffuse', color = [1, 1, 1], roughness = 1", [1.0; 3], 3e-2),
        ("type = 'conductor', color = [0.8, 0.5, 1]", [0.8, 0.5, 1.0], 1e-5),
        ("type = 'mirror', tint = [0.8, 0.5, 1]", [0.8, 0.5, 1.0], 1e-5),
        ("type = 'dielectric', ior = 1.5", [1.0; 3], 2e-3),
        ("type = 'glass', ior = 0.7", [1.0; 3], 2e-3),
        ("type = 'conductor', roughness = 0.7", [1.0; 3], 1e-2),
        ("type = 'dielectric', ior = 1.5, roughness = 0.5", [1.0; 3], 1e-2),
        ("type = 'dielectric', ior = 1.5, thin = true", [1.0; 3], 1e-5),
        (
            "type = 'dielectric', ior = 1.5, thin = true, roughness = 0.6",
            [1.0; 3],
            1e-2,
        ),
        (
            "type = 'phong', diffuse = [0.8, 0.5, 1], specular = [0, 0, 0], ambient = [0, 0, 0]",
            [0.8, 0.5, 1.0],
            1e-5,
        ),
    ] {
        for shape in [
            "type = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1",
            "type = 'ellipsoid'\nmaterial = 'm'\ncenter = [0, 0, 0]\na = [1, 0.2, 0]\nb = [0, 0.7, 0]\nc = [0, 0, 2]",
        ] {
            let text = format!(
                "camera = {{ position = [0, -4, 0.3], look_at = [0, 0, 0], fov = 10 }}\nenvironment = {{ color = [1, 1, 1] }}\n\
                 materials.m = {{ {material} }}\n[[shapes]]\n{shape}\n"
            );
            let packed = scene(64, 1024, &text);
            for mode in both() {
                let found = mean(&render(&packed, mode));
                for (found, expected) in found.into_iter().zip(albedo) {
                    assert!(is_near(found, expected, tolerance), "{material}, {mode:?}: {found}");
                    assert!(!is_near(found, expected * 1.04, tolerance), "a wrong value is accepted");
                }
            }
        }
    }
}

#[test]
fn bounces_in_a_closed_emitter_are_a_geometric_series() {
    // In a closed emitter of albedo a and emission e, paths of up to n bounces give e times the sum of a^k up to k = n.
    let (albedo, emission) = (0.6, 0.5);
    let bodies = [
        "[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 2\n".to_owned(),
        "[[shapes]]\ntype = 'ellipsoid'\nmaterial = 'm'\ncenter = [0, 0, 0]\na = [1.5, 0.2, 0]\nb = [0, 0.7, 0]\nc = [0, 0, 2]\n".to_owned(),
        {
            let wall = |center: &str, normal: &str, tangent: &str| {
                format!(
                    "[[shapes]]\ntype = 'rectangle'\nmaterial = 'm'\ncenter = {center}\nsize = [2, 2]\nnormal = {normal}\ntangent = {tangent}\n"
                )
            };
            [
                wall("[1, 0, 0]", "[-1, 0, 0]", "[0, 1, 0]"),
                wall("[-1, 0, 0]", "[1, 0, 0]", "[0, 1, 0]"),
                wall("[0, 1, 0]", "[0, -1, 0]", "[1, 0, 0]"),
                wall("[0, -1, 0]", "[0, 1, 0]", "[1, 0, 0]"),
                wall("[0, 0, 1]", "[0, 0, -1]", "[1, 0, 0]"),
                wall("[0, 0, -1]", "[0, 0, 1]", "[1, 0, 0]"),
            ]
            .concat()
        },
    ];
    for body in bodies {
        for depth in [0, 1, 2, 5, 40] {
            let text = format!(
                "{CAMERA_INSIDE}materials.m = {{ type = 'diffuse', color = [{albedo}, {albedo}, {albedo}], \
                 emission = [{emission}, {emission}, {emission}] }}\n{body}"
            );
            let packed = scene(256, depth, &text);
            let expected = emission * (1.0 - f64::powi(albedo, depth as i32 + 1)) / (1.0 - albedo);
            for mode in both() {
                let found = mean(&render(&packed, mode))[0];
                assert!(
                    is_near(found, expected, 4e-3),
                    "{mode:?}, {depth}: {found}, expected {expected}\n{body}"
                );
                assert!(!is_near(found, expected * 1.02, 4e-3), "a wrong value is accepted");
            }
        }
    }
}

/// Returns the form factor from a point on the floor to a parallel rectangle of size a x b at height h, one corner of
/// which is straight above the point: Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", B-3.
fn corner_factor(a: f64, b: f64, h: f64) -> f64 {
    let (x, y) = (a / h, b / h);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
}

#[test]
fn a_rectangle_lights_the_floor_by_its_form_factor() {
    let (width, height, h) = (1.5, 0.5, 0.8);
    let factor = |x: f64, y: f64| {
        let mut sum = 0.0;
        for (sx, sy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let (a, b) = (width / 2.0 + sx * x, height / 2.0 + sy * y);
            sum += a.signum() * b.signum() * corner_factor(a.abs(), b.abs(), h);
        }
        sum
    };
    let light = format!(
        "[[lights]]\ntype = 'rectangle'\ncenter = [0, 0, {h}]\nsize = [{width}, {height}]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\ncolor = [3, 2, 1]\n"
    );
    let shape = format!(
        "materials.s = {{ type = 'diffuse', color = [0, 0, 0], emission = [3, 2, 1] }}\n[[shapes]]\ntype = 'rectangle'\nmaterial = 's'\ncenter = [0, 0, {h}]\nsize = [{width}, {height}]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\n"
    );
    for emitter in [light, shape] {
        // Points below the light, beside the light, and far from the light.
        for (x, y) in [(0.0, 0.0), (0.6, 0.1), (2.0, 1.5)] {
            let camera = camera_above(x, y, 0.4, 0.02);
            let packed = scene(
                1024,
                1,
                &format!("{camera}materials.m = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\n{emitter}{FLOOR}"),
            );
            let expected = 0.5 * factor(x, y);
            for mode in both() {
                let found = mean(&render(&packed, mode));
                for (found, radiance) in found.into_iter().zip([3.0, 2.0, 1.0]) {
                    assert!(
                        is_near(found, expected * radiance, 2e-3),
                        "{mode:?}, {x} {y}: {found}, expected {expected}"
                    );
                    assert!(
                        !is_near(found, expected * radiance * 1.01, 2e-3),
                        "a wrong value is accepted"
                    );
                }
            }
        }
    }
}

#[test]
fn spheres_and_disks_light_the_floor_by_their_form_factors() {
    // Form factors of shapes of radius r centered at height h above a point: sphere (r / h)^2, disk r^2 / (r^2 + h^2).
    for scale in [1e-3, 1.0, 1e3] {
        for r in [1e-3, 0.3, 0.999] {
            let h = 1.0;
            let (r, h) = (r * scale, h * scale);
            let factor_sphere = (r / h) * (r / h);
            let factor_disk = r * r / (r * r + h * h);
            for (shape, factor) in [
                (
                    format!("type = 'sphere'\ncenter = [0, 0, {h}]\nradius = {r}"),
                    factor_sphere,
                ),
                (
                    format!(
                        "type = 'disk'\ncenter = [0, 0, {h}]\nradius = {r}\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]"
                    ),
                    factor_disk,
                ),
            ] {
                let camera = camera_above(0.0, 0.0, 1e-4 * scale, 1e-6 * scale);
                let packed = scene(
                    1024,
                    1,
                    &format!(
                        "{camera}materials.m = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\nmaterials.s = {{ type = 'diffuse', color = [0, 0, 0], emission = [10, 10, 10] }}\n[[shapes]]\nmaterial = 's'\n{shape}\n{FLOOR}"
                    ),
                );
                for mode in both() {
                    let found = mean(&render(&packed, mode))[1];
                    let expected = 5.0 * factor;
                    assert!(
                        is_near(found, expected, 3e-3),
                        "{mode:?}, {r} {scale}: {found}, expected {expected}, {shape}"
                    );
                }
            }
        }
    }
}

/// Returns the form factor of a horizontal cylinder whose center is straight above a point, by the midpoint rule over
/// the surface.
fn cylinder_factor(height: f64, radius: f64, length: f64) -> f64 {
    let (arcs, slices) = (400, 400);
    let mut sum = 0.0;
    for i in 0..arcs {
        let angle = 2.0 * PI * (f64::from(i) + 0.5) / f64::from(arcs);
        let normal = [0.0, angle.cos(), angle.sin()];
        for j in 0..slices {
            let x = length * ((f64::from(j) + 0.5) / f64::from(slices) - 0.5);
            let p = [x, radius * normal[1], height + radius * normal[2]];
            let d2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
            let cosine = -(p[1] * normal[1] + p[2] * normal[2]) / d2.sqrt();
            if cosine > 0.0 {
                let area = radius * (2.0 * PI / f64::from(arcs)) * (length / f64::from(slices));
                sum += cosine * (p[2] / d2.sqrt()) / d2 * area;
            }
        }
    }
    sum / PI
}

#[test]
fn cylinders_light_the_floor_by_their_form_factors() {
    // The form factor of a long cylinder is radius / height (Siegel and Howell, "Thermal Radiation Heat Transfer").
    assert!(is_near(cylinder_factor(1.0, 0.3, 60.0), 0.3, 2e-3));
    for scale in [1e-3, 1.0, 1e3] {
        let shapes = [
            // An upright cylinder, of which only the cap is visible.
            ([0.0, 0.0, 1.0], [0.0, 0.0, 4.0], 0.5, 0.25 / 1.25),
            ([-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], 0.3, cylinder_factor(1.0, 0.3, 2.0)),
            ([-0.05, 0.0, 1.0], [0.05, 0.0, 1.0], 0.7, cylinder_factor(1.0, 0.7, 0.1)),
            (
                [-9.0, 0.0, 1.0],
                [9.0, 0.0, 1.0],
                0.01,
                cylinder_factor(1.0, 0.01, 18.0),
            ),
            // The point is inside the cylinder.
            ([0.0, 0.0, -1.0], [0.0, 0.0, 2.0], 0.8, 1.0),
        ];
        for (start, end, radius, factor) in shapes {
            let [start, end] = [start, end].map(|p| p.map(|x: f64| x * scale));
            let radius = radius * scale;
            let camera = camera_above(0.0, 0.0, 1e-4 * scale, 1e-6 * scale);
            let packed = scene(
                4096,
                1,
                &format!(
                    "{camera}materials.m = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\nmaterials.s = {{ type = 'diffuse', color = [0, 0, 0], emission = [10, 10, 10] }}\n[[shapes]]\nmaterial = 's'\ntype = 'cylinder'\nstart = {start:?}\nend = {end:?}\nradius = {radius}\n{FLOOR}"
                ),
            );
            for mode in both() {
                let found = mean(&render(&packed, mode))[1];
                let expected = 5.0 * factor;
                assert!(
                    is_near(found, expected, 5e-3),
                    "{mode:?}, {start:?} {end:?} {radius}: {found}, expected {expected}"
                );
                assert!(!is_near(found, expected * 1.02, 5e-3), "a wrong value is accepted");
            }
        }
    }
}

#[test]
fn point_lights_fall_off_and_directional_lights_do_not() {
    for (light, expected) in [
        (
            "type = 'point'\nposition = [0, 0, 2]\ncolor = [8, 8, 8]",
            0.5 / PI * 8.0 / 4.0,
        ),
        (
            "type = 'directional'\ndirection = [0, 3, -4]\ncolor = [8, 8, 8]",
            0.5 / PI * 8.0 * 0.8,
        ),
    ] {
        let packed = scene(
            4,
            1,
            &format!(
                "{}materials.m = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\n[[lights]]\n{light}\n{FLOOR}",
                camera_above(0.0, 0.0, 1.0, 1e-3)
            ),
        );
        for mode in both() {
            for found in means(&render(&packed, mode)) {
                assert!(
                    is_near(found[0], expected, 1e-5),
                    "{mode:?}: {}, expected {expected}",
                    found[0]
                );
            }
        }
    }
}

#[test]
fn a_glass_slab_transmits_by_fresnel_and_beer() {
    // Normal incidence: each face reflects r = ((n - 1) / (n + 1))^2, and the slab attenuates each pass by
    // exp(-absorption * thickness).
    let n = 1.5_f64;
    let r = ((n - 1.0) / (n + 1.0)).powi(2);
    for (absorption, thickness) in [(0.0, 0.5), (0.7, 0.5), (3.0, 1.0)] {
        let attenuation = f64::exp(-absorption * thickness);
        let transmitted = (1.0 - r).powi(2) * attenuation / (1.0 - r * r * attenuation * attenuation);
        let text = format!(
            "{}environment = {{ color = [0, 0, 0] }}\n\
             materials.m = {{ type = 'dielectric', ior = {n}, absorption = [{absorption}, {absorption}, {absorption}] }}\n\
             materials.s = {{ type = 'diffuse', color = [0, 0, 0], emission = [1, 1, 1] }}\n\
             [[shapes]]\ntype = 'rectangle'\nmaterial = 'm'\ncenter = [0, 0, {thickness}]\nsize = [9, 9]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n\
             [[shapes]]\ntype = 'rectangle'\nmaterial = 'm'\ncenter = [0, 0, 0]\nsize = [9, 9]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\n\
             [[shapes]]\ntype = 'rectangle'\nmaterial = 's'\ncenter = [0, 0, -1]\nsize = [9, 9]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n",
            camera_above(0.0, 0.0, 3.0, 1.0)
        );
        let packed = scene(1024, 1000, &text);
        for mode in both() {
            let found = mean(&render(&packed, mode))[2];
            assert!(
                is_near(found, transmitted, 1e-3),
                "{mode:?}, {absorption}: {found}, expected {transmitted}"
            );
            assert!(!is_near(found, transmitted * 1.01, 1e-3), "a wrong value is accepted");
        }
    }
}

#[test]
fn radiance_in_glass_is_scaled_by_the_squared_index() {
    // With radiance 1 outside, the radiance in glass is n^2, internal reflections included.
    let text = format!(
        "{CAMERA_INSIDE}environment = {{ color = [1, 1, 1] }}\nmaterials.m = {{ type = 'dielectric', ior = 1.5 }}\n\
         [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 3\n"
    );
    let packed = scene(256, 1000, &text);
    for mode in both() {
        let found = mean(&render(&packed, mode))[0];
        assert!(is_near(found, 2.25, 2e-3), "{mode:?}: {found}");
    }
}
