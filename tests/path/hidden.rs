//! Camera-invisible emitters: only camera rays pass through them.

use glam::UVec2;
use wgray_trace::cpu::geometry::pixel_first_hit;
use wgray_trace::records::{NO_INDEX, Packed};

use crate::pictures::{both, differing, exact_modes, means, reference, render};
use crate::scenes;

/// Returns a scene with an emitter in front of a wall, and a mirror that shows the emitter.
fn room(integrator: &str, light: &str) -> Packed {
    let (wall, depth) = match integrator {
        "path" => ("type = 'diffuse', color = [0.5, 0.5, 0.5]", 4),
        _ => ("type = 'phong', color = [0.5, 0.5, 0.5]", 4),
    };
    scenes::parse(&format!(
        "image = {{ width = 24, height = 24 }}\ncamera = {{ position = [0, -4, 0], look_at = [0, 0, 0], fov = 50 }}\n\
         materials.wall = {{ {wall} }}\nmaterials.mirror = {{ type = 'mirror' }}\n{light}\n\
         [[shapes]]\ntype = 'rectangle'\nmaterial = 'wall'\ncenter = [0, 2, 0]\nsize = [6, 6]\nnormal = [0, -1, 0]\ntangent = [1, 0, 0]\n\
         [[shapes]]\ntype = 'rectangle'\nmaterial = 'mirror'\ncenter = [1.2, 1, 0]\nsize = [1, 1.2]\nnormal = [-1, -2, 0]\ntangent = [2, -1, 0]\n\
         [render]\nintegrator = '{integrator}'\nmax_depth = {depth}\npixel_samples = {{ count = 64 }}\n"
    ))
}

const RECTANGLE: &str = "[[lights]]\ntype = 'rectangle'\ncenter = [0, 0, 0]\nsize = [0.6, 0.6]\nnormal = [0.2, 1, 0]\ntangent = [1, -0.2, 0]\n\
                         color = [4, 4, 4]\n";

fn sphere(visible: bool) -> String {
    format!(
        "materials.light = {{ type = 'diffuse', color = [0, 0, 0], emission = [4, 4, 4], visible = {visible} }}\n\
         [[shapes]]\ntype = 'sphere'\nmaterial = 'light'\ncenter = [0, 0, 0]\nradius = 0.3\n"
    )
}

#[test]
fn only_mirrors_show_camera_invisible_emitters() {
    let rectangle = |visible: bool| format!("{RECTANGLE}visible = {visible}\n");
    let cases = [
        ("path", rectangle as fn(bool) -> String),
        ("phong", rectangle),
        ("path", sphere),
    ];
    for (integrator, light) in cases {
        let (visible, hidden) = (room(integrator, &light(true)), room(integrator, &light(false)));
        let without_emitter = room(integrator, "");
        let expected = reference(&hidden);
        for mode in exact_modes() {
            assert_eq!(
                differing(&render(&hidden, mode), &expected),
                0,
                "{mode:?}, {integrator}"
            );
        }
        for mode in both() {
            let (visible, hidden) = (means(&render(&visible, mode)), means(&render(&hidden, mode)));
            // Pixels outside of the emitter are unchanged; some of these pixels show the emitter in the mirror.
            let is_covered = |i: usize| (i % 24).abs_diff(12) < 4 && (i / 24).abs_diff(12) < 4;
            let uncovered_pixels = || (0..24 * 24).filter(|i| !is_covered(*i));
            assert!(
                uncovered_pixels().all(|i| visible[i] == hidden[i]),
                "{mode:?}, {integrator}"
            );
            let bright = uncovered_pixels().filter(|i| hidden[*i][0] > 3.0).count();
            assert!(
                bright > 3,
                "{mode:?}, {integrator}: only {bright} pixels of the mirror show the emitter"
            );
            // Behind the camera-invisible emitter, the camera sees the wall.
            let center = 12 * 24 + 12;
            assert!(
                hidden[center][0] < 3.9 && hidden[center][0] > 0.0,
                "{mode:?}: {:?}",
                hidden[center]
            );
            assert!(
                visible[center] != hidden[center],
                "{mode:?}: the key `visible` has no effect"
            );
        }
        for i in 0..24 * 24 {
            let pixel = UVec2::new(i % 24, i / 24);
            let (a, b) = (
                pixel_first_hit(&hidden, pixel),
                pixel_first_hit(&without_emitter, pixel),
            );
            assert_eq!(a.shape == NO_INDEX, b.shape == NO_INDEX, "{pixel}");
            assert!(
                (a.depth - b.depth).abs() < 1e-5 && (a.normal - b.normal).length() < 1e-6,
                "{pixel}"
            );
            assert!((a.uv - b.uv).length() < 1e-5, "{pixel}: {}, expected {}", a.uv, b.uv);
        }
    }
}

#[test]
fn the_camera_skips_at_most_64_surfaces() {
    let sheet = |i: u32| {
        format!(
            "[[shapes]]\ntype = 'rectangle'\nmaterial = 'h'\ncenter = [0, {}, 0]\nsize = [9, 9]\nnormal = [0, 1, 0]\ntangent = [1, 0, 0]\n",
            f64::from(i) * 0.01
        )
    };
    for (count, sees_environment) in [(64, true), (65, false)] {
        let sheets: String = (0..count).map(sheet).collect();
        let packed = scenes::parse(&format!(
            "image = {{ width = 2, height = 2 }}\ncamera = {{ position = [0, -4, 0], look_at = [0, 0, 0], fov = 20 }}\n\
             materials.h = {{ type = 'diffuse', color = [0, 0, 0], visible = false }}\nenvironment = {{ color = [1, 1, 1] }}\n\
             {sheets}[render]\nintegrator = 'path'\npixel_samples = {{ count = 4 }}\n"
        ));
        for mode in both() {
            let found = means(&render(&packed, mode));
            let expected = if sees_environment { 1.0 } else { 0.0 };
            assert!(
                found.iter().all(|pixel| pixel[0] == expected),
                "{mode:?}, {count}: {found:?}"
            );
        }
    }
}
