//! Mirrors and glass: Fresnel reflectance, energy conservation, reflected lights, shadows and split paths.

use std::path::Path;

use glam::UVec4;
use wgray_trace::cpu::specular::{fresnel, refracted_cosine};
use wgray_trace::records::{ELLIPSOID, Packed};

use super::{cpu_picture, scene};

fn reflectance(degrees: f64, ior: f64) -> f64 {
    let cosine = degrees.to_radians().cos() as f32;
    let eta = (1.0 / ior) as f32;
    f64::from(fresnel(cosine, refracted_cosine(cosine, eta), eta))
}

#[test]
fn reflectances_match_the_fresnel_equations() {
    assert!((reflectance(0.0, 1.5) - 0.04).abs() < 1e-6);
    assert!((reflectance(0.0, 1.0 / 1.5) - 0.04).abs() < 1e-6);
    // Brewster's angle: the reflectance is ((n^2 - 1) / (n^2 + 1))^2 for one polarization and 0 for the other.
    let brewster = 1.5f64.atan().to_degrees();
    assert!((reflectance(brewster, 1.5) - 0.5 * (1.25f64 / 3.25).powi(2)).abs() < 1e-6);
    // Total internal reflection.
    let critical = (1.0 / 1.5f64).asin().to_degrees();
    assert_eq!(reflectance(critical + 0.1, 1.0 / 1.5), 1.0);
    assert!(reflectance(critical - 0.1, 1.0 / 1.5) < 0.9);
    assert!(reflectance(89.999, 1.5) > 0.999);
    for degrees in 0..90 {
        assert_eq!(reflectance(f64::from(degrees), 1.0), 0.0);
        let entering = reflectance(f64::from(degrees), 1.5);
        let refracted = (f64::from(degrees).to_radians().sin() / 1.5).asin().to_degrees();
        assert!((entering - reflectance(refracted, 1.0 / 1.5)).abs() < 1e-4);
    }
}

fn ball(background: &str, material: &str, extra: &str) -> Packed {
    let text = format!(
        "image = {{ width = 40, height = 40 }}
        camera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}
        [render]
        background = {background}
        ambient = [0.2, 0.2, 0.2]
        pixel_samples = {{ count = 4 }}
        shadows = 'transparent'
        [materials.ball]
        {material}
        [materials.gray]
        type = 'phong'
        color = [0.5, 0.6, 0.7]
        [[shapes]]
        type = 'ellipsoid'
        material = 'ball'
        center = [0, 0, 1]
        a = [0.9, 0, 0]
        b = [0.2, 0.8, 0]
        c = [0, 0.1, 0.7]
        {extra}"
    );
    scene(&text, Path::new("."))
}

const ROOM: &str = "
    [[lights]]
    type = 'rectangle'
    center = [0, 0, 2.5]
    size = [1, 1]
    normal = [0, 0, -1]
    tangent = [1, 0, 0]
    color = [0.8, 0.8, 0.8]
    [[shapes]]
    type = 'rectangle'
    material = 'gray'
    center = [0, 2, 1]
    size = [3, 3]
    normal = [0, -1, 0]
    tangent = [1, 0, 0]
    [[shapes]]
    type = 'rectangle'
    material = 'gray'
    center = [0, 0, 0]
    size = [4, 4]
    normal = [0, 0, 1]
    tangent = [1, 0, 0]";

fn max_differences(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<f32> {
    let pixels = a.iter().zip(b);
    pixels
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max))
        .collect()
}

#[test]
fn a_glass_ball_in_a_uniform_environment_conserves_energy() {
    for ior in [1.1, 1.5, 2.4, 0.7] {
        for background in [1.0f32, 0.3] {
            let colors = format!("[{background}, {background}, {background}]");
            let picture = cpu_picture(&ball(&colors, &format!("type = 'glass'\nior = {ior}"), ""));
            let error = picture
                .iter()
                .flatten()
                .map(|x| (x - background).abs())
                .fold(0.0, f32::max);
            assert!(error < 1e-6, "{ior}: {error}");
        }
    }
    let tinted = cpu_picture(&ball("[1, 1, 1]", "type = 'glass'\nior = 1.5\ntint = [0.9, 1, 1]", ""));
    assert!(tinted.iter().any(|pixel| pixel[0] < 0.85)); // 0.9 at entry and at exit
    assert!(tinted.iter().all(|pixel| (pixel[1] - 1.0).abs() < 1e-6));
}

#[test]
fn clear_glass_of_index_1_is_invisible() {
    let render_material = |material: &str| cpu_picture(&ball("[0.1, 0.2, 0.3]", material, ROOM));
    let clear = render_material("type = 'glass'\nior = 1");
    let dense = render_material("type = 'glass'\nior = 1.3");
    let without_ball = {
        let mut scene = ball("[0.1, 0.2, 0.3]", "type = 'glass'\nior = 1", ROOM);
        let count = scene.counts.primitives[ELLIPSOID as usize].x as usize;
        scene.primitives.truncate(count);
        scene.bounds.truncate(count);
        scene.counts.primitives[ELLIPSOID as usize] = UVec4::ZERO;
        cpu_picture(&scene)
    };
    let count_visible = |picture: &[[f32; 3]]| {
        max_differences(picture, &without_ball)
            .iter()
            .filter(|d| **d > 1e-3)
            .count()
    };
    assert!(count_visible(&clear) <= 2, "{}", count_visible(&clear)); // edges, due to ray offsets
    assert!(count_visible(&dense) > 100, "{}", count_visible(&dense));
}

#[test]
fn mirrors_show_lights_in_their_color() {
    let light = "
        [[lights]]
        type = 'rectangle'
        center = [0, -9, 1]
        size = [90, 90]
        normal = [0, 1, 0]
        tangent = [1, 0, 0]
        color = [0.25, 0.5, 0.75]";
    let wall = "
        [[shapes]]
        type = 'rectangle'
        material = 'ball'
        center = [0, 4, 1]
        size = [50, 50]
        normal = [0, -1, 0]
        tangent = [1, 0, 0]";
    let picture = cpu_picture(&ball(
        "[0, 0, 0]",
        "type = 'mirror'\ntint = [1, 0.5, 1]",
        &format!("{light}{wall}"),
    ));
    assert!(picture.iter().filter(|pixel| **pixel == [0.25, 0.25, 0.75]).count() > 600);
}

#[test]
fn a_truncated_path_returns_the_background() {
    for depth in [1, 2, 5, 64] {
        let text = format!(
            "image = {{ width = 4, height = 4 }}
            camera = {{ position = [0, 0, 0], look_at = [0, 1, 0], fov = 10 }}
            [render]
            background = [1, 2, 0]
            max_depth = {depth}
            [materials.m]
            type = 'mirror'
            tint = [0.5, 1, 1]
            [[shapes]]
            type = 'plane'
            material = 'm'
            point = [0, 1, 0]
            normal = [0, 1, 0]
            tangent = [1, 0, 0]
            [[shapes]]
            type = 'plane'
            material = 'm'
            point = [0, -1, 0]
            normal = [0, 1, 0]
            tangent = [1, 0, 0]"
        );
        for pixel in cpu_picture(&scene(&text, Path::new("."))) {
            assert_eq!(pixel, [0.5f32.powi(depth), 2.0, 0.0]);
        }
    }
}

#[test]
fn glass_casts_a_shadow_unless_shadows_are_transparent() {
    let floor_radiance = |shadows: &str, material: &str| {
        let text = format!(
            "image = {{ width = 8, height = 8 }}
            camera = {{ position = [0, 0, 0.5], look_at = [0, 0, 0], up = [0, 1, 0], fov = 20 }}
            render = {{ shadows = '{shadows}' }}
            [materials.ball]
            {material}
            [materials.gray]
            type = 'phong'
            color = [0.5, 0.5, 0.5]
            specular = [0, 0, 0]
            [[lights]]
            type = 'point'
            position = [0, 0, 9]
            color = [1, 1, 1]
            [[shapes]]
            type = 'sphere'
            material = 'ball'
            center = [0, 0, 2]
            radius = 0.5
            [[shapes]]
            type = 'tetrahedron'
            material = 'ball'
            vertices = [[-1, -1, 3], [1, -1, 3], [0, 1, 3], [0, 0, 4]]
            [[shapes]]
            type = 'rectangle'
            material = 'ball'
            center = [0, 0, 5]
            size = [2, 2]
            normal = [0, 0, 1]
            tangent = [1, 0, 0]
            [[shapes]]
            type = 'plane'
            material = 'gray'
            point = [0, 0, 0]
            normal = [0, 0, 1]
            tangent = [1, 0, 0]"
        );
        cpu_picture(&scene(&text, Path::new(".")))[27][0]
    };
    let glass = "type = 'glass'\nior = 1.5";
    assert_eq!(floor_radiance("opaque", glass), 0.0);
    assert!(floor_radiance("transparent", glass) > 0.4);
    assert_eq!(floor_radiance("transparent", "type = 'mirror'"), 0.0);
}

/// After the last split, one branch is chosen at random. The mean equals the mean of a render that follows both
/// branches.
#[test]
fn branches_chosen_at_random_have_the_expected_mean() {
    // A geometric series of reflections between the plates.
    let text = |depth: u32| {
        format!(
            "image = {{ width = 1, height = 1 }}
            camera = {{ position = [0, 0, 5], look_at = [0, 0, 0], up = [0, 1, 0], fov = 0.01 }}
            [render]
            max_depth = {depth}
            pixel_samples = {{ pattern = 'random', count = 60000 }}
            ambient = [1, 1, 1]
            [materials.g]
            type = 'glass'
            ior = 10
            [materials.white]
            type = 'phong'
            color = [1, 1, 1]
            [[shapes]]
            type = 'plane'
            material = 'g'
            point = [0, 0, 1]
            normal = [0, 0, 1]
            tangent = [1, 0, 0]
            [[shapes]]
            type = 'plane'
            material = 'g'
            point = [0, 0, 0]
            normal = [0, 0, -1]
            tangent = [1, 0, 0]
            [[shapes]]
            type = 'plane'
            material = 'white'
            point = [0, 0, -1]
            normal = [0, 0, 1]
            tangent = [1, 0, 0]"
        )
    };
    let r = (9.0f64 / 11.0).powi(2);
    let plate = (1.0 - r) / (1.0 + r); // the sum over all internal reflections
    let found = f64::from(cpu_picture(&scene(&text(64), Path::new(".")))[0][0]);
    assert!((found - plate).abs() < 4e-3, "{found} {plate}");
    // Negative control: 3 bounces are too few.
    let truncated = f64::from(cpu_picture(&scene(&text(3), Path::new(".")))[0][0]);
    assert!(plate - truncated > 0.03, "{truncated}");
}
