//! Light selection probabilities, equal results for all kinds of emitters, occlusion by lights.

use std::fmt::Write as _;

use glam::UVec2;
use wgray_trace::cpu::emitter::select_emitter;
use wgray_trace::cpu::rng::hash4;

use super::{mean, scene};
use crate::pictures::{both, means, reference, render};

const CAMERA: &str = "camera = { position = [0, -3, 1], look_at = [0, 0, 0.3], fov = 50 }\n\
                      materials.m = { type = 'diffuse', color = [0.7, 0.7, 0.7] }\n";
const FLOOR: &str =
    "[[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n";

#[test]
fn selection_is_three_quarters_by_power_and_one_quarter_uniform() {
    // Lights of powers 1 to 16 and a black light: too few for a light tree.
    let mut text = format!("{CAMERA}{FLOOR}");
    for i in 0..=16 {
        let _ = write!(
            text,
            "[[lights]]\ntype = 'point'\nposition = [{i}, 0, 1]\ncolor = [{i}, {i}, {i}]\n"
        );
    }
    let packed = scene(1, 1, &text);
    assert_eq!(packed.lighting.emitters.len(), 16, "the black light is an emitter");
    let mut counts = vec![0.0; packed.lighting.lights.len()];
    let selection_count = 400_000;
    for i in 0..selection_count {
        let bits = hash4(glam::UVec4::new(i, 1, 2, 3));
        let emitter = select_emitter(&packed, UVec2::new(bits.x, bits.y));
        counts[emitter.index as usize] += 1.0;
    }
    let total = f64::from(16 * 17 / 2);
    let chi_square: f64 = (packed.lighting.lights.iter().zip(&counts))
        .map(|(light, count)| {
            let probability = 0.75 * f64::from(light.color.x) / total + 0.25 / 16.0;
            assert!(
                (f64::from(light.density) - probability).abs() < 1e-6,
                "the PDF is not the documented probability"
            );
            let expected = probability * f64::from(selection_count);
            (count - expected) * (count - expected) / expected
        })
        .sum();
    assert!(chi_square < 15.0 + 6.0 * (2.0_f64 * 15.0).sqrt(), "{chi_square}");
}

/// The added light is weak and directional, or a spot light that is a million times as strong but faces away.
#[test]
fn lights_without_local_effect_do_not_starve_others() {
    let light = "[[lights]]\ntype = 'point'\nposition = [0, 0, 1]\ncolor = [1, 1, 1]\n";
    let pebble = "[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [1e5, 0, 0]\nradius = 1\n";
    let sun = "[[lights]]\ntype = 'directional'\ndirection = [0, 0, -1]\ncolor = [1e-6, 1e-6, 1e-6]\n";
    let spot = "[[lights]]\ntype = 'spot'\nposition = [0, 0, 1]\ndirection = [0, 0, 1]\ncone_angle = 40\ncolor = [1e6, 1e6, 1e6]\n";
    let brightness = |added: &str| mean(&reference(&scene(256, 1, &format!("{CAMERA}{FLOOR}{light}{added}"))))[1];
    let expected = brightness("");
    for added in [format!("{pebble}{sun}"), spot.to_owned()] {
        let found = brightness(&added);
        assert!(
            (found / expected - 1.0).abs() < 0.05,
            "{found}, expected {expected}, with {added}"
        );
    }
}

#[test]
fn all_kinds_of_emitters_light_equally() {
    // The same square as a light, as a rectangle, as a textured rectangle and as two triangles, each alone and with a
    // distant point light.
    let square = "center = [0, 0, 1]\nsize = [1, 1]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\n";
    let emissive = "materials.s = { type = 'diffuse', color = [0, 0, 0], emission = [4, 4, 4] }\n";
    let textured = "textures.t = { type = 'checker', even = [4, 4, 4], odd = [4, 4, 4] }\n\
                    materials.s = { type = 'diffuse', color = [0, 0, 0], emission = { texture = 't' } }\n";
    let kinds = [
        format!("{CAMERA}[[lights]]\ntype = 'rectangle'\ncolor = [4, 4, 4]\n{square}{FLOOR}"),
        format!("{CAMERA}{emissive}[[shapes]]\ntype = 'rectangle'\nmaterial = 's'\n{square}{FLOOR}"),
        format!("{CAMERA}{textured}[[shapes]]\ntype = 'rectangle'\nmaterial = 's'\n{square}{FLOOR}"),
        format!(
            "{CAMERA}{emissive}[[shapes]]\ntype = 'triangle'\nmaterial = 's'\nvertices = [[-0.5, -0.5, 1], [0.5, -0.5, 1], [0.5, 0.5, 1]]\n\
             [[shapes]]\ntype = 'triangle'\nmaterial = 's'\nvertices = [[-0.5, -0.5, 1], [0.5, 0.5, 1], [-0.5, 0.5, 1]]\n{FLOOR}"
        ),
    ];
    let distant = "[[lights]]\ntype = 'point'\nposition = [0, 500, 1e5]\ncolor = [1e3, 1e3, 1e3]\n";
    let expected = mean(&render(&scene(1024, 1, &kinds[0]), both()[0]));
    for kind in &kinds {
        for text in [kind.clone(), format!("{kind}{distant}")] {
            let packed = scene(1024, 1, &text);
            for mode in both() {
                let found = mean(&render(&packed, mode));
                assert!(
                    (found[0] - expected[0]).abs() < 5e-3 * expected[0],
                    "{mode:?}: {found:?}, expected {expected:?}\n{text}"
                );
            }
        }
    }
}

#[test]
fn a_rectangle_light_is_one_sided_and_occludes() {
    let light = "[[lights]]\ntype = 'rectangle'\ncenter = [0, 0, 1]\nsize = [1, 1]\nnormal = [0, 0, NZ]\ntangent = [1, 0, 0]\ncolor = [4, 4, 4]\n";
    let sun = "[[lights]]\ntype = 'directional'\ndirection = [0, 0, -1]\ncolor = [2, 2, 2]\n";
    let camera = "camera = { type = 'orthographic', position = [0, 0, 0.5], look_at = [0, 0, 0], up = [0, 1, 0], height = 3 }\n\
                  materials.m = { type = 'diffuse', color = [0.5, 0.5, 0.5] }\n";
    // A rectangle light that faces away only casts a shadow.
    let packed = scene(1024, 1, &format!("{camera}{}{sun}{FLOOR}", light.replace("NZ", "1")));
    for mode in both() {
        let found = means(&render(&packed, mode));
        let red = |x: usize, y: usize| found[y * 16 + x][0];
        assert_eq!(red(8, 8), 0.0, "{mode:?}: the shadow is lit");
        let lit = red(1, 1);
        assert!(
            (lit - 1.0 / std::f64::consts::PI).abs() < 5e-3,
            "{mode:?}: {lit} outside the shadow"
        );
    }
    // From above, the back is black and the front is bright.
    for (nz, expected) in [(1.0, 4.0), (-1.0, 0.0)] {
        let camera = "camera = { type = 'orthographic', position = [0, 0, 2], look_at = [0, 0, 0], up = [0, 1, 0], height = 0.5 }\n";
        let packed = scene(4, 3, &format!("{camera}{}", light.replace("NZ", &nz.to_string())));
        for mode in both() {
            assert_eq!(mean(&render(&packed, mode))[0], expected, "{mode:?}");
        }
    }
}
