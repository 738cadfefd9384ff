//! The light tree: selection probabilities, sums over many lights, limits of the parameters.

use std::fmt::Write as _;

use glam::{UVec2, UVec4, Vec3};
use wgray::scene::{Description, PointLightDescription};
use wgray_trace::cpu::light_choice::{light_tree_pdf, light_tree_select};
use wgray_trace::cpu::ray::Hit;
use wgray_trace::cpu::rng::hash4;
use wgray_trace::records::{NO_INDEX, Packed};

use super::{mean, scene};
use crate::pictures::{both, differing, exact_modes, reference, render};
use crate::random::Random;

const CAMERA: &str = "camera = { position = [0, -3, 1], look_at = [0, 0, 0.3], fov = 50 }\n\
                      materials.m = { type = 'diffuse', color = [0.7, 0.7, 0.7] }\n\
                      materials.s = { type = 'diffuse', color = [0.2, 0.2, 0.2], emission = [3, 2, 1] }\n";
const FLOOR: &str =
    "[[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n";

fn light(i: u32, random: &Random) -> String {
    let coordinate = |scale: f64, low: f64| low + scale * random.unit();
    let (x, y, z) = (coordinate(2.0, -1.0), coordinate(2.0, -1.0), coordinate(0.8, 0.2));
    let intensity = 0.5 + random.unit();
    match i % 5 {
        0 => format!(
            "[[lights]]\ntype = 'point'\nposition = [{x}, {y}, {z}]\ncolor = [{intensity}, {intensity}, {intensity}]\n"
        ),
        1 => format!("[[shapes]]\ntype = 'sphere'\nmaterial = 's'\ncenter = [{x}, {y}, {z}]\nradius = 0.07\n"),
        2 => format!(
            "[[lights]]\ntype = 'rectangle'\ncenter = [{x}, {y}, {z}]\nsize = [0.2, 0.1]\nnormal = [{y}, {x}, -1]\n\
             tangent = [1, 0, 0]\ncolor = [{intensity}, 3, 2]\n"
        ),
        3 => format!(
            "[[lights]]\ntype = 'spot'\nposition = [{x}, {y}, {z}]\ndirection = [{y}, 0, -1]\ncolor = [{intensity}, 3, 2]\ncone_angle = 50\n"
        ),
        _ => format!(
            "[[shapes]]\ntype = 'triangle'\nmaterial = 's'\nvertices = [[{x}, {y}, {z}], [{}, {y}, {z}], [{x}, {}, {z}]]\n",
            x + 0.2,
            y + 0.1
        ),
    }
}

fn lights(count: u32) -> Vec<String> {
    let random = Random::new(5);
    (0..count).map(|i| light(i, &random)).collect()
}

struct Leaf {
    density: f32,
    instance: u32,
    index: u32,
}

fn leaves(packed: &Packed) -> Vec<Leaf> {
    let mut found = Vec::new();
    for node in &packed.lighting.nodes {
        for i in (0..4).filter(|i| node.intensity[*i] > 0.0 && node.children[*i] == NO_INDEX) {
            found.push(Leaf {
                density: node.density[i],
                instance: node.instance[i],
                index: node.index[i],
            });
        }
    }
    found
}

#[test]
fn selection_frequencies_and_hit_pdfs_match_the_tree() {
    let directional_light = "[[lights]]\ntype = 'directional'\ndirection = [0, 1, -1]\ncolor = [1, 1, 1]\n";
    for directional in ["", directional_light] {
        let packed = scene(1, 1, &format!("{CAMERA}{FLOOR}{directional}{}", lights(60).concat()));
        let leaves = leaves(&packed);
        assert_eq!(leaves.len(), 60);
        let tree_emitter = packed.lighting.emitters[0];
        assert_eq!(
            (packed.lighting.emitters.len(), tree_emitter.index),
            (1 + usize::from(!directional.is_empty()), NO_INDEX)
        );
        for (p, n) in [
            (Vec3::new(0.3, 0.2, 0.0), Vec3::Z),
            (Vec3::new(-0.9, 0.9, 0.5), Vec3::new(0.6, 0.0, -0.8)),
            (Vec3::new(5.0, 0.2, 0.1), Vec3::ZERO),
        ] {
            let sample_count = 60_000;
            let mut counts = vec![0_u32; leaves.len()];
            let mut densities = vec![0.0_f32; leaves.len()];
            for i in 0..sample_count {
                let key = hash4(UVec4::new(i, 7, 8, 9));
                let selection = light_tree_select(&packed, tree_emitter, p, n, UVec2::new(key.x, key.y), i % 64);
                let is_selected =
                    |leaf: &Leaf| (leaf.instance, leaf.index) == (selection.emitter.instance, selection.emitter.index);
                let leaf = leaves.iter().position(is_selected).expect("a leaf");
                counts[leaf] += 1;
                densities[leaf] = selection.density;
            }
            let (mut chi_square, mut term_count) = (0.0, 0.0);
            for (i, leaf) in leaves.iter().enumerate() {
                if counts[i] == 0 {
                    continue;
                }
                // A directional light outside of the tree scales all PDFs.
                let primitive = packed.lighting.lights[leaf.index as usize].primitive;
                if primitive != NO_INDEX {
                    let hit = Hit {
                        t: 1.0,
                        instance: 0,
                        primitive,
                        slot: 0,
                        barycentric: glam::Vec2::ZERO,
                    };
                    let pdf = light_tree_pdf(&packed, hit, true, p, n);
                    assert!(
                        (pdf - densities[i]).abs() < 1e-5 * pdf,
                        "{pdf}, expected {}",
                        densities[i]
                    );
                    assert_eq!(light_tree_pdf(&packed, hit, false, p, n), 0.0);
                }
                let expected = f64::from(densities[i] / leaf.density) * f64::from(sample_count);
                if expected > 5.0 {
                    chi_square += (f64::from(counts[i]) - expected).powi(2) / expected;
                    term_count += 1.0;
                }
            }
            // Samples are stratified in groups of 64, so chi-square is well below its value for independent samples.
            assert!(
                term_count > 5.0 && chi_square < term_count + 6.0 * (2.0_f64 * term_count).sqrt(),
                "chi-square {chi_square} for {term_count} leaves"
            );
        }
    }
}

#[test]
fn many_lights_are_the_sum_of_single_lights() {
    let sun = "[[lights]]\ntype = 'directional'\ndirection = [0, 1, -1]\ncolor = [1, 1, 1]\n".to_owned();
    for added in [vec![], vec![sun]] {
        let all: Vec<String> = lights(90)
            .into_iter()
            .filter(|light| light.starts_with("[[lights]]"))
            .chain(added)
            .collect();
        let camera = "camera = { type = 'orthographic', position = [0, 0, 0.05], look_at = [0, 0, 0], up = [0, 1, 0], height = 3 }\n\
                      materials.m = { type = 'diffuse', color = [0.7, 0.7, 0.7] }\n";
        // Rectangle lights are left out: they occlude, so images of single lights would not add up.
        let all: Vec<String> = all.into_iter().filter(|light| !light.contains("rectangle")).collect();
        let scene_of =
            |samples: u32, lights: &[String]| scene(samples, 1, &format!("{camera}{FLOOR}{}", lights.concat()));
        let mut expected = [0.0; 3];
        for light in &all {
            let found = mean(&reference(&scene_of(64, std::slice::from_ref(light))));
            expected = [0, 1, 2].map(|i| expected[i] + found[i]);
        }
        let packed = scene_of(4096, &all);
        assert!(packed.specialization.light_tree == 1 && leaves(&packed).len() > 16);
        for mode in both() {
            let found = mean(&render(&packed, mode));
            for i in 0..3 {
                assert!(
                    (found[i] - expected[i]).abs() < 1e-2 * expected[i],
                    "{mode:?}: {found:?}, expected {expected:?}"
                );
            }
        }
    }
}

#[test]
fn many_lights_give_the_same_bits_on_all_backends() {
    for count in [16, 17, 30, 90] {
        let text = format!("{CAMERA}{FLOOR}{}", lights(count).concat());
        let packed = scene(16, 4, &text);
        assert_eq!(packed.specialization.light_tree, u32::from(count > 16), "{count}");
        let expected = reference(&packed);
        for mode in exact_modes() {
            assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}, {count}");
        }
    }
}

#[test]
fn parameter_limits_of_lights_give_finite_values() {
    let mut text =
        format!("{CAMERA}materials.dark = {{ type = 'diffuse', color = [0, 0, 0], emission = [0, 0, 0] }}\n{FLOOR}");
    for i in 0..12 {
        // Pairs of coincident lights: tiny and huge, with minimum, maximum and zero color.
        let radius = if i % 2 == 0 { 1e-6 } else { 1e6 };
        let color = [1e-30, 1e6, 0.0, 1.0][i % 4];
        for _ in 0..2 {
            let _ = write!(
                text,
                "[[shapes]]\ntype = 'sphere'\nmaterial = 's'\ncenter = [0, 0, {}]\nradius = {radius}\n\
                 [[shapes]]\ntype = 'disk'\nmaterial = 'dark'\ncenter = [0, 0, 1]\nradius = {radius}\nnormal = [0, 0, 1]\n\
                 [[lights]]\ntype = 'point'\nposition = [0, 0, 0]\ncolor = [{color}, {color}, 0]\n\
                 [[lights]]\ntype = 'spot'\nposition = [0, 0, 1]\ndirection = [0, 0, -1]\ncolor = [{color}, 1, 1]\ncone_angle = 0.01\n\
                 [[lights]]\ntype = 'rectangle'\ncenter = [0, 0, 1e-9]\nsize = [1e-9, 1e9]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n\
                 color = [{color}, {color}, {color}]\n",
                if radius > 1.0 { -2.0 * radius } else { 0.5 },
            );
        }
    }
    let packed = scene(64, 6, &text);
    assert_eq!(packed.specialization.light_tree, 1);
    for node in &packed.lighting.nodes {
        let bounds = [
            node.x,
            node.y,
            node.z,
            node.radius,
            node.axis_x,
            node.axis_y,
            node.axis_z,
        ];
        let light = [node.cosine, node.edge, node.intensity, node.density];
        assert!(
            bounds.iter().chain(&light).all(|numbers| numbers.is_finite()),
            "{node:?}"
        );
    }
    let expected = reference(&packed);
    for sum in &expected.sums {
        assert!(sum.is_finite() && sum.min_element() >= 0.0, "{sum}");
    }
    for mode in exact_modes() {
        assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}");
    }
}

#[test]
fn a_hundred_thousand_lights_render() {
    let text = format!(
        "image = {{ width = 16, height = 16 }}\n{CAMERA}{FLOOR}[render]\nintegrator = 'path'\nmax_depth = 2\npixel_samples = {{ count = 4 }}\n"
    );
    let mut description = Description::parse(&text, "test").expect("a scene");
    let random = Random::new(3);
    for _ in 0..100_000 {
        let position = [
            random.unit() * 20.0 - 10.0,
            random.unit() * 20.0 - 10.0,
            random.unit() * 2.0 + 0.1,
        ];
        description = description.with_light(PointLightDescription::new(position, [1e-3; 3]));
    }
    let started = std::time::Instant::now();
    let packed: Packed = wgray_render::pack::pack(&description.validate().expect("a valid scene"));
    println!("100,000 lights packed in {:?}", started.elapsed());
    assert_eq!(leaves(&packed).len(), 100_000);
    let expected = reference(&packed);
    assert!(mean(&expected)[0] > 0.0);
    for mode in both() {
        assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}");
    }
}

#[test]
fn emissive_meshes_are_in_the_light_tree() {
    let folder = tempfile::tempdir().expect("a folder");
    let ball = crate::meshes::procedural::TriangleMesh::icosphere(1);
    std::fs::write(folder.path().join("ball.obj"), ball.obj(None, None)).expect("a mesh");
    let text = |shapes: &str, samples: u32| {
        format!(
            "image = {{ width = 16, height = 16 }}\n{CAMERA}{FLOOR}{shapes}\n\
             [render]\nintegrator = 'path'\nmax_depth = 3\npixel_samples = {{ count = {samples} }}\n"
        )
    };
    let load = |text: &str| {
        let description = Description::parse(text, "test").expect("a scene");
        let assets = wgray::scene::Assets::beside(folder.path());
        wgray_render::pack::pack(&description.validate_with(&assets).expect("a valid scene"))
    };
    let mesh = |material: &str, x: f64| {
        format!(
            "[[shapes]]\ntype = 'mesh'\nmaterial = '{material}'\nfile = 'ball.obj'\nscale = 0.3\ntranslate = [{x}, 0, 0.6]\n"
        )
    };
    let packed = load(&text(&[mesh("s", -0.7), mesh("m", 9.0), mesh("s", 0.7)].concat(), 16));
    assert_eq!(leaves(&packed).len(), 160);
    let first_leaves: Vec<u32> = packed.bvh.instances.iter().map(|instance| instance.leaves).collect();
    assert_eq!(first_leaves[1], NO_INDEX);
    assert!(first_leaves[0] != NO_INDEX && first_leaves[2] != NO_INDEX);
    let expected = reference(&packed);
    for mode in exact_modes() {
        assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}");
    }
    // BSDF sampling alone gives the same mean.
    let packed = load(&text(&[mesh("s", -0.7), mesh("m", 9.0), mesh("s", 0.7)].concat(), 1024));
    let mut bsdf_only = packed.clone();
    bsdf_only.specialization.emitters = 0;
    let (found, expected) = (mean(&reference(&packed)), mean(&reference(&bsdf_only)));
    for i in 0..3 {
        assert!(
            (found[i] - expected[i]).abs() < 1e-2 * expected[i],
            "{found:?}, expected {expected:?}"
        );
    }
}
