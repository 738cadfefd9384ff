//! Limits of the path integrator: empty, dark, huge and tiny scenes, and zero or many bounces. All results are finite.

use super::{mean, scene};
use crate::pictures::{both, differing, exact_modes, reference, render};

const CAMERA: &str = "camera = { position = [0, -4, 0.5], look_at = [0, 0, 0], fov = 40 }\n";

#[test]
fn an_empty_scene_shows_the_environment() {
    for depth in [0, 1, 1024] {
        let packed = scene(
            4,
            depth,
            &format!("{CAMERA}environment = {{ color = [0.25, 0.5, 1e6] }}\n"),
        );
        for mode in both() {
            assert_eq!(mean(&render(&packed, mode)), [0.25, 0.5, 1e6], "{mode:?}");
        }
    }
    let packed = scene(4, 3, CAMERA);
    for mode in both() {
        assert_eq!(mean(&render(&packed, mode)), [0.0; 3], "{mode:?}");
    }
}

#[test]
fn without_bounces_only_emission_is_visible() {
    let packed = scene(
        16,
        0,
        &format!(
            "{CAMERA}materials.m = {{ type = 'diffuse', color = [1, 1, 1] }}\n\
             materials.s = {{ type = 'conductor', color = [1, 1, 1], emission = [2, 3, 4] }}\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [-1, 0, 0]\nradius = 0.5\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 's'\ncenter = [1, 0, 0]\nradius = 0.5\n\
             [[lights]]\ntype = 'point'\nposition = [0, -4, 3]\ncolor = [9, 9, 9]\n"
        ),
    );
    for mode in both() {
        let film = render(&packed, mode);
        let colors: Vec<[f32; 3]> = film.means().collect();
        assert_eq!(colors[8 * 16 + 4], [0.0; 3], "{mode:?}: the black sphere emits light");
        assert_eq!(
            colors[8 * 16 + 12],
            [2.0, 3.0, 4.0],
            "{mode:?}: the emissive sphere has another radiance"
        );
    }
}

#[test]
fn scaling_a_scene_does_not_change_radiance() {
    // The radiance differs only by the rounding of coordinates.
    let scaled_text = |s: f64| {
        format!(
            "camera = {{ position = [0, {}, {s}], look_at = [0, 0, {s}], fov = 40 }}\n\
             materials.m = {{ type = 'diffuse', color = [0.7, 0.7, 0.7] }}\nmaterials.s = {{ type = 'diffuse', color = [0.2, 0.2, 0.2], emission = [5, 5, 5] }}\n\
             materials.g = {{ type = 'dielectric', ior = 1.5 }}\n\
             [[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 's'\ncenter = [0, {s}, {}]\nradius = {}\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 'g'\ncenter = [{s}, 0, {s}]\nradius = {}\n\
             [[shapes]]\ntype = 'rectangle'\nmaterial = 'm'\ncenter = [0, {}, {s}]\nsize = [{}, {s}]\nnormal = [0, -1, 0]\ntangent = [1, 0, 0]\n",
            -4.0 * s,
            2.0 * s,
            0.3 * s,
            0.5 * s,
            2.0 * s,
            4.0 * s
        )
    };
    let expected = mean(&reference(&scene(1024, 6, &scaled_text(1.0))));
    for s in [1e-6, 1e-3, 1e3, 1e6] {
        let packed = scene(1024, 6, &scaled_text(s));
        for mode in both() {
            let found = mean(&render(&packed, mode));
            assert!(
                (found[1] - expected[1]).abs() < 1e-2 * expected[1],
                "{mode:?}, {s}: {found:?}, expected {expected:?}"
            );
        }
    }
}

#[test]
fn touching_and_grazing_lights_give_finite_values() {
    let packed = scene(
        256,
        8,
        "camera = { position = [0, -0.5, 0.02], look_at = [0, 0, 0], fov = 60 }\n\
         materials.m = { type = 'diffuse', color = [1, 1, 1], roughness = 1 }\n\
         materials.s = { type = 'phong', diffuse = [0.5, 0.5, 0.5], specular = [0.5, 0.5, 0.5], ambient = [0, 0, 0], shininess = 1e6, emission = [1, 1, 1] }\n\
         [[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n\
         [[shapes]]\ntype = 'sphere'\nmaterial = 's'\ncenter = [0, 0, 0]\nradius = 0.1\n\
         [[shapes]]\ntype = 'disk'\nmaterial = 's'\ncenter = [0.2, 0, 0]\nradius = 0.1\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n\
         [[shapes]]\ntype = 'triangle'\nmaterial = 's'\nvertices = [[-0.3, 0, 0], [-0.1, 0, 0], [-0.2, 0.2, 1e-6]]\n\
         [[lights]]\ntype = 'rectangle'\ncenter = [0, 0.1, 1e-9]\nsize = [1, 0.1]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\ncolor = [1, 1, 1]\n\
         [[lights]]\ntype = 'point'\nposition = [0, 0.3, 0]\ncolor = [1, 1, 1]\n\
         [[lights]]\ntype = 'point'\nposition = [0.1, 0.3, 1e-9]\ncolor = [1, 1, 1]\n\
         [[lights]]\ntype = 'directional'\ndirection = [1, 0, 0]\ncolor = [1, 1, 1]\n",
    );
    let expected = reference(&packed);
    for sum in &expected.sums {
        assert!(sum.is_finite() && sum.min_element() >= 0.0, "{sum}");
    }
    for mode in exact_modes() {
        assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}");
    }
}

#[test]
fn long_paths_terminate() {
    // Without absorption, each path reaches the maximum depth.
    let text = |color: &str| {
        format!(
            "camera = {{ position = [0.3, 0, 0], look_at = [1, 0.1, 0], fov = 40 }}\nmaterials.m = {{ type = 'mirror', tint = {color} }}\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n"
        )
    };
    for color in ["[1, 1, 1]", "[0, 0, 0]", "[1, 1e-30, 0]"] {
        let packed = scene(1, 1024, &text(color));
        for mode in both() {
            assert_eq!(mean(&render(&packed, mode)), [0.0; 3], "{mode:?}");
        }
    }
}

#[test]
fn reflectances_above_one_are_clamped() {
    for key in ["color", "roughness"] {
        let color = if key == "color" {
            ""
        } else {
            "color = [0.5, 0.5, 0.5], "
        };
        let packed = scene(
            64,
            20,
            &format!(
                "{CAMERA}environment = {{ color = [1, 1, 1] }}\ntextures.t = {{ type = 'constant', color = [7, 7, 7] }}\n\
                 textures.c = {{ type = 'checker', even = [9, 9, 9], odd = [7, 7, 7] }}\n\
                 materials.m = {{ type = 'diffuse', {color}{key} = {{ texture = 'c' }} }}\n\
                 [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 9\n"
            ),
        );
        let text = format!(
            "camera = {{ position = [0, -4, 0], look_at = [0, 0, 0], fov = 5 }}\nenvironment = {{ color = [1, 1, 1] }}\n\
             textures.c = {{ type = 'checker', even = [9, 9, 9], odd = [7, 7, 7] }}\n\
             materials.m = {{ type = 'diffuse', {color}{key} = {{ texture = 'c' }} }}\n\
             [[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n"
        );
        // Values above 1 are clamped.
        let equivalent = match key {
            "color" => text.replace("{ texture = 'c' }", "[1, 1, 1]"),
            _ => text.replace("{ texture = 'c' }", "1"),
        };
        let (body, expected) = (scene(256, 20, &text), mean(&reference(&scene(256, 20, &equivalent))));
        for mode in both() {
            assert_eq!(
                mean(&render(&packed, mode)),
                [0.0; 3],
                "{mode:?}: light inside a closed sphere"
            );
            let found = mean(&render(&body, mode));
            assert_eq!(found, expected, "{mode:?}, {key}");
        }
    }
}

#[test]
fn glass_with_shading_normals_creates_no_energy() {
    // White furnace: a cube and a coarse sphere of glass with smooth normals.
    let folder = tempfile::tempdir().expect("a folder");
    let cube = crate::meshes::procedural::TriangleMesh::cube();
    let ball = crate::meshes::procedural::TriangleMesh::icosphere(1);
    for (name, triangle_mesh) in [("cube", cube), ("ball", ball)] {
        let normals: Vec<_> = triangle_mesh.points.iter().map(|p| p.normalize()).collect();
        std::fs::write(
            folder.path().join(format!("{name}.obj")),
            triangle_mesh.obj(Some(&normals), None),
        )
        .expect("a mesh");
        for ior in [0.5, 1.5, 2.4] {
            let text = format!(
                "image = {{ width = 16, height = 16 }}\ncamera = {{ position = [0.3, -6, 0.5], look_at = [0, 0, 0], fov = 25 }}\n\
                 render = {{ integrator = 'path', max_depth = 200, rr_depth = 200, pixel_samples = {{ count = 64 }} }}\n\
                 environment = {{ color = [1, 1, 1] }}\nmaterials.m = {{ type = 'dielectric', ior = {ior} }}\n\
                 [[shapes]]\ntype = 'mesh'\nmaterial = 'm'\nfile = '{name}.obj'\nnormals = 'smooth'\n"
            );
            let description = wgray::scene::Description::parse(&text, "test").expect("a scene");
            let assets = wgray::scene::Assets::beside(folder.path());
            let packed = wgray_render::pack::pack(&description.validate_with(&assets).expect("a valid scene"));
            for mode in both() {
                let film = render(&packed, mode);
                let found = mean(&film)[0];
                // Some paths remain trapped by inconsistent shading normals.
                assert!(found < 1.0 + 1e-3 && found > 0.85, "{name}, {ior}, {mode:?}: {found}");
            }
        }
    }
}
