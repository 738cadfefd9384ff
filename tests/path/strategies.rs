//! Light sampling, BSDF sampling and MIS converge to the same mean, so PDFs and weights are consistent.

use wgray_render::gpu::compose::Shaders;

use super::{mean, scene};
use crate::pictures::{RenderMode, render_with};
use crate::{adapter, sources};

const FILE: &str = "integrators/path.wgsl";

/// The seed of the camera selects the strategy, so that each scene needs only one kernel.
const MIS: u32 = 0;
const LIGHT: u32 = 1;
const BSDF: u32 = 2;
/// MIS with a wrong weight for light samples.
const WRONG: u32 = 3;
/// Emission that the camera sees directly.
const DIRECT: u32 = 4;

fn shaders_with_strategies() -> Shaders {
    const LIGHT_WEIGHT: &str = "select(power_heuristic(light.pdf, reflected.pdf), 1.0, light.is_delta)";
    const BSDF_WEIGHT: &str =
        "power_heuristic(state.pdf, emitter_pdf(prim, from_previous, density, ray, surface.normal))";
    let mut text = sources::shaders().text(FILE).to_owned();
    for (weight, alternatives) in [(LIGHT_WEIGHT, "1.0, 0.0, 0.9"), (BSDF_WEIGHT, "0.0, 1.0, 1.0")] {
        assert!(text.contains(weight), "{weight} not found");
        text = text.replace(weight, &format!("strategy_weight({weight}, {alternatives})"));
    }
    text += &format!(
        "fn strategy_weight(mis: f32, light: f32, bsdf: f32, wrong: f32) -> f32 {{
            switch camera.seed {{
                case {MIS}u: {{ return mis; }}
                case {LIGHT}u: {{ return light; }}
                case {BSDF}u: {{ return bsdf; }}
                case {WRONG}u: {{ return wrong * mis; }}
                default: {{ return 0.0; }}
            }}
        }}\n"
    );
    sources::shaders_with(FILE, &text)
}

/// Returns lights of every kind, enough for a light tree.
fn many_lights() -> String {
    let light = |i: u32| {
        let [x, y, z] = [
            f64::from(i % 6) * 0.45 - 1.1,
            f64::from(i / 6) * 0.45 - 0.7,
            0.7 + f64::from(i % 4) * 0.05,
        ];
        match i % 5 {
            4 => format!(
                "[[shapes]]\ntype = 'cylinder'\nmaterial = 'dim'\nstart = [{x}, {y}, {z}]\nend = [{}, {y}, {z}]\nradius = 0.1\n",
                x + 0.2
            ),
            0 => format!("[[shapes]]\ntype = 'sphere'\nmaterial = 'source'\ncenter = [{x}, {y}, {z}]\nradius = 0.15\n"),
            1 => format!(
                "[[shapes]]\ntype = 'disk'\nmaterial = 'dim'\ncenter = [{x}, {y}, {z}]\nradius = 0.2\nnormal = [{x}, 0.3, -1]\n"
            ),
            2 => format!(
                "[[shapes]]\ntype = 'tetrahedron'\nmaterial = 'source'\n\
                 vertices = [[{x}, {y}, {z}], [{}, {y}, {z}], [{x}, {}, {z}], [{x}, {y}, {}]]\n",
                x + 0.25,
                y + 0.25,
                z + 0.25
            ),
            _ => format!(
                "[[lights]]\ntype = 'rectangle'\ncenter = [{x}, {y}, {z}]\nsize = [0.3, 0.2]\nnormal = [{x}, {y}, -3]\n\
                 tangent = [0, 1, 0.1]\ncolor = [4, 3, 2]\n"
            ),
        }
    };
    (0..24).map(light).collect()
}

#[test]
fn light_and_bsdf_sampling_agree() {
    if adapter::device().is_none() {
        return;
    }
    let shaders = shaders_with_strategies();
    let camera = "camera = { position = [0, -3, 1], look_at = [0, 0, 0.5], fov = 40 }\n\
                  materials.source = { type = 'diffuse', color = [0.3, 0.3, 0.3], emission = [5, 3, 1] }\n\
                  materials.dim = { type = 'phong', diffuse = [0.3, 0.3, 0.3], specular = [0.3, 0.3, 0.3], shininess = 5, ambient = [0, 0, 0], emission = [1, 2, 1] }\n\
                  [[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n";
    let shapes = [
        "[[shapes]]\ntype = 'sphere'\nmaterial = 'source'\ncenter = [0.2, 0, 0.9]\nradius = 0.5\n",
        "[[shapes]]\ntype = 'ellipsoid'\nmaterial = 'source'\ncenter = [0, 0, 0.6]\na = [0.8, 0.1, 0]\nb = [0, 0.3, 0.1]\nc = [0, 0.1, 0.3]\n",
        "[[shapes]]\ntype = 'disk'\nmaterial = 'source'\ncenter = [0, 0.4, 0.8]\nradius = 0.6\nnormal = [0.3, -0.5, 0.4]\ntangent = [0.5, 0.3, 0]\n",
        "[[shapes]]\ntype = 'cylinder'\nmaterial = 'source'\nstart = [-0.6, 0.3, 0.5]\nend = [0.5, -0.1, 0.8]\nradius = 0.3\n",
        "[[shapes]]\ntype = 'tetrahedron'\nmaterial = 'source'\nvertices = [[-0.5, 0, 0.3], [0.5, 0, 0.3], [0, 0.6, 0.3], [0, 0.2, 0.9]]\n",
        "[[lights]]\ntype = 'rectangle'\ncenter = [0, 0.2, 1.1]\nsize = [1, 0.5]\nnormal = [0.1, -0.3, -1]\ntangent = [10, 0, 1]\ncolor = [5, 3, 1]\n",
        // Several emitters of different powers, some behind others.
        "[[shapes]]\ntype = 'sphere'\nmaterial = 'source'\ncenter = [-0.6, 0, 0.7]\nradius = 0.3\n\
         [[shapes]]\ntype = 'disk'\nmaterial = 'dim'\ncenter = [0.6, 0.4, 0.7]\nradius = 0.3\nnormal = [-1, -1, 0]\ntangent = [1, -1, 0]\n\
         [[shapes]]\ntype = 'triangle'\nmaterial = 'dim'\nvertices = [[-1, 1, 0.1], [1, 1, 0.1], [0, 1, 1.5]]\n\
         [[lights]]\ntype = 'rectangle'\ncenter = [0, 0.2, 1.3]\nsize = [1, 0.5]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\ncolor = [2, 3, 4]\n",
    ];
    let many_lights_text = many_lights();
    // The last shape and the many lights are tested with all materials, the other shapes with one material each.
    let (single_material_count, many_lights_index) = (shapes.len() - 1, shapes.len());
    let shapes = shapes.into_iter().chain([many_lights_text.as_str()]);
    for (i, shape) in shapes.enumerate() {
        let materials = [
            "type = 'diffuse', color = [0.7, 0.6, 0.5]",
            "type = 'diffuse', color = [0.7, 0.6, 0.5], roughness = 0.8",
            "type = 'phong', diffuse = [0.4, 0.4, 0.4], specular = [0.5, 0.5, 0.5], shininess = 12, ambient = [0, 0, 0]",
            "type = 'conductor', metal = 'copper', roughness = 0.6, anisotropy = 0.5",
            "type = 'principled', base_color = [0.7, 0.6, 0.5], metallic = 0.3, roughness = 0.6, clearcoat = 0.5, clearcoat_roughness = 0.5, sheen_color = [0.2, 0.3, 0.4], sheen_roughness = 0.5",
        ];
        let materials = match i < single_material_count {
            true => &materials[i % 5..][..1],
            false => &materials[..],
        };
        for material in materials {
            let text = format!("materials.m = {{ {material} }}\n{camera}{shape}");
            let packed = scene(4096, 2, &text);
            assert_eq!(
                packed.specialization.light_tree != 0,
                i == many_lights_index,
                "a light tree is missing or was built over few lights"
            );
            let rendered = |strategy: u32| {
                let mut packed = packed.clone();
                packed.camera.seed = strategy;
                mean(&render_with(&packed, RenderMode::Baked, &shaders))
            };
            let direct = rendered(DIRECT);
            let reflected = |strategy: u32| {
                let found = rendered(strategy);
                [0, 1, 2].map(|i| found[i] - direct[i])
            };
            let [with_mis, light, bsdf, wrong] = [MIS, LIGHT, BSDF, WRONG].map(reflected);
            for i in 0..3 {
                let is_near = |x: f64, tolerance: f64| (x - with_mis[i]).abs() < tolerance * with_mis[i];
                assert!(
                    is_near(light[i], 1e-2),
                    "light sampling alone differs: {light:?}, expected {with_mis:?}\n{shape}{material}"
                );
                assert!(
                    is_near(bsdf[i], 1e-2),
                    "BSDF sampling alone differs: {bsdf:?}, expected {with_mis:?}\n{shape}{material}"
                );
                assert!(
                    !is_near(wrong[i], 1e-2),
                    "a wrong weight is accepted: {wrong:?}, expected {with_mis:?}\n{shape}{material}"
                );
            }
        }
    }
}
