//! Vertex colors, texture coordinate sets, tangents, texture factors and single-sided materials: closed-form
//! values, and equal bits on CPU and GPU.

use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec4};
use wgray::mesh::Mesh;
use wgray::scene::{Assets, Description, Geometry};
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use super::load;
use crate::pictures::{RenderMode, both, differing, exact_modes, first_hits, means, reference, render};
use crate::textures::{write_exr, write_png};

/// A square from (-1, -1) to (1, 1), with texture coordinates from 0 to 1.
const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n\
                    f 1/1/1 2/2/1 3/3/1 4/4/1\n";
/// A camera above the square; the square fills the image.
const CAMERA_ABOVE: &str =
    "camera = { type = 'orthographic', position = [0, 0, 9], look_at = [0, 0, 0], up = [0, 1, 0], height = 2 }\n";
const OBLIQUE_CAMERA: &str = "camera = { position = [0.4, -2.2, 1.9], look_at = [0, 0, 0], fov = 60 }\n";
const SHAPE: &str = "[[shapes]]\ntype = 'mesh'\nfile = 'quad.obj'\nmaterial = 'm'\n";
const COLORS: [[f32; 4]; 4] = [
    [1.0, 0.0, 0.25, 1.0],
    [0.5, 0.5, 0.25, 0.0],
    [0.0, 1.0, 0.25, 0.5],
    [0.5, 0.5, 0.25, 1.0],
];

/// Returns a scene of 20 x 20 pixels.
fn scene(folder: &Path, samples: u32, text: &str, edit: impl Fn(&mut Mesh)) -> Packed {
    std::fs::write(folder.join("quad.obj"), QUAD).unwrap();
    let text = format!(
        "image = {{ width = 20, height = 20 }}\n{text}\n\
         [render]\nintegrator = 'path'\nmax_depth = 4\npixel_samples = {{ count = {samples} }}\n"
    );
    let description = Description::parse(&text, "quad.toml").unwrap_or_else(|error| panic!("{error}"));
    let scene = description.validate_with(&Assets::beside(folder));
    let mut scene = scene.unwrap_or_else(|error| panic!("{error}"));
    for shape in &mut scene.shapes {
        if let Geometry::Mesh { mesh, .. } = &mut shape.geometry {
            let mut edited = (**mesh).clone();
            edit(&mut edited);
            *mesh = Arc::new(edited);
        }
    }
    pack(&scene)
}

fn set_colors(mesh: &mut Mesh) {
    mesh.colors = mesh
        .positions
        .iter()
        .map(|p| {
            let corner = match (p.x > 0.0, p.y > 0.0) {
                (false, false) => 0,
                (true, false) => 1,
                (true, true) => 2,
                (false, true) => 3,
            };
            Vec4::from_array(COLORS[corner])
        })
        .collect();
}

/// Returns the color at a point; the triangles are (0, 1, 2) and (0, 2, 3).
fn color_at(x: f64, y: f64) -> [f64; 4] {
    let [s, t] = [x, y].map(|x| (x + 1.0) / 2.0);
    let weights = match s > t {
        true => [1.0 - s, s - t, t, 0.0],
        false => [1.0 - t, 0.0, s, t - s],
    };
    std::array::from_fn(|k| (0..4).map(|i| weights[i] * f64::from(COLORS[i][k])).sum())
}

/// Returns the center of a pixel of the camera above.
fn pixel_center(i: usize) -> (f64, f64) {
    ((i % 20) as f64 / 10.0 - 0.95, 0.95 - (i / 20) as f64 / 10.0)
}

#[test]
fn vertex_colors_are_interpolated() {
    let folder = tempfile::tempdir().unwrap();
    // The mean of a linear color over a pixel is the color at the pixel's center, except on the diagonal of the square.
    let emission = "materials.m = { type = 'principled', base_color = [0, 0, 0], specular = 0, emission = [2, 2, 2], vertex_colors = 'emission' }\n";
    let base = "environment = { color = [1, 1, 1] }\n\
                materials.m = { type = 'principled', metallic = 0, specular = 0, vertex_colors = 'base_color' }\n";
    for (material, factor, tolerance) in [(emission, 2.0, 0.02), (base, 1.0, 0.02)] {
        let packed = scene(
            folder.path(),
            64,
            &format!("{CAMERA_ABOVE}{material}{SHAPE}"),
            set_colors,
        );
        let uncolored = scene(folder.path(), 64, &format!("{CAMERA_ABOVE}{material}{SHAPE}"), |_| ());
        for mode in both() {
            for (i, found) in means(&render(&packed, mode)).iter().enumerate() {
                let (x, y) = pixel_center(i);
                let expected = color_at(x, y);
                for k in 0..3 {
                    let expected = factor * expected[k];
                    assert!(
                        (found[k] - expected).abs() < tolerance,
                        "{mode:?} {x} {y}: {found:?} {expected}"
                    );
                }
                assert!((found[2] - 0.25 * factor).abs() < 1e-5, "{mode:?}: {found:?}");
            }
            // Without vertex colors, the emission is white.
            for found in means(&render(&uncolored, mode)) {
                assert!(found.iter().all(|x| (x - factor).abs() < 1e-5), "{mode:?}: {found:?}");
            }
        }
    }
}

#[test]
fn base_colors_above_one_are_clamped_and_emission_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let set_bright_colors = |mesh: &mut Mesh| mesh.colors = vec![Vec4::new(4.0, 0.5, 1e6, 1.0); mesh.positions.len()];
    let material = |keys: &str| {
        format!(
            "{CAMERA_ABOVE}environment = {{ color = [1, 1, 1] }}\nmaterials.m = {{ type = 'principled', specular = 0, metallic = 0, {keys} }}\n{SHAPE}"
        )
    };
    let base = scene(
        folder.path(),
        16,
        &material("vertex_colors = 'base_color', base_color = [0.5, 0.5, 0.5]"),
        set_bright_colors,
    );
    let emission = scene(
        folder.path(),
        16,
        &material("vertex_colors = 'emission', base_color = [0, 0, 0], emission = [1, 1, 1]"),
        set_bright_colors,
    );
    for mode in both() {
        for (packed, expected) in [(&base, [1.0, 0.25, 1.0]), (&emission, [4.0, 0.5, 1e6])] {
            for found in means(&render(packed, mode)) {
                let is_near = (0..3).all(|k| (found[k] / expected[k] - 1.0).abs() < 1e-4);
                assert!(is_near, "{mode:?}: {found:?} {expected:?}");
            }
        }
    }
}

#[test]
fn vertex_alpha_multiplies_the_alpha_of_the_material() {
    let folder = tempfile::tempdir().unwrap();
    let text = |colors: &str, mode: &str, alpha: f64| {
        format!(
            "{CAMERA_ABOVE}environment = {{ color = [1, 1, 1] }}\nmaterials.m = {{ type = 'principled', base_color = [0, 0, 0], metallic = 0, \
             specular = 0, alpha = {alpha}, alpha_mode = '{mode}', alpha_cutoff = 0.4, vertex_colors = '{colors}' }}\n{SHAPE}"
        )
    };
    for colors in ["base_color", "emission"] {
        let blended = scene(folder.path(), 256, &text(colors, "blend", 0.8), set_colors);
        let masked = scene(folder.path(), 4, &text(colors, "mask", 0.8), set_colors);
        let opaque = scene(folder.path(), 4, &text(colors, "opaque", 1.0), set_colors);
        for mode in both() {
            let blended_means = means(&render(&blended, mode));
            let hits = first_hits(&blended, mode);
            let masked_means = means(&render(&masked, mode));
            for i in 0..400 {
                let (x, y) = pixel_center(i);
                let alpha = 0.8 * color_at(x, y)[3];
                assert!(
                    (blended_means[i][0] - (1.0 - alpha)).abs() < 0.16,
                    "{mode:?} {x} {y}: {:?} {alpha}",
                    blended_means[i]
                );
                if (alpha - 0.5).abs() > 0.01 {
                    assert_eq!(hits[i].depth > 0.0, alpha > 0.5, "{mode:?} {x} {y} {alpha}");
                }
                if (alpha - 0.4).abs() > 0.08 {
                    assert_eq!(
                        masked_means[i][0],
                        if alpha > 0.4 { 0.0 } else { 1.0 },
                        "{mode:?} {x} {y} {alpha}"
                    );
                }
            }
            let mean = blended_means.iter().map(|pixel| pixel[0]).sum::<f64>() / 400.0;
            // The mean over two triangles, which share the two vertices on the diagonal.
            let alpha = 0.8 * (2.0 * (1.0 + 0.5) + 0.0 + 1.0) / 6.0;
            assert!((mean - (1.0 - alpha)).abs() < 0.01, "{mode:?}: {mean} {alpha}");
            assert!(means(&render(&opaque, mode)).iter().all(|pixel| pixel[0] == 0.0));
        }
    }
}

#[test]
fn emission_from_vertex_colors_lights_like_plain_emission() {
    // Constant emission and vertex colors of the same value give the same samples.
    let folder = tempfile::tempdir().unwrap();
    let text = |keys: &str| {
        format!(
            "camera = {{ type = 'orthographic', position = [0, 0, 0.5], look_at = [0, 0, 0], up = [0, 1, 0], height = 1 }}\n\
             materials.m = {{ type = 'principled', base_color = [0, 0, 0], specular = 0, {keys} }}\n\
             materials.floor = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\n\
             {SHAPE}translate = [0, 0, 1]\n[[shapes]]\ntype = 'rectangle'\nmaterial = 'floor'\ncenter = [0, 0, 0]\nsize = [9, 9]\n\
             normal = [0, 0, 1]\ntangent = [1, 0, 0]\n"
        )
    };
    let set_uniform_colors = |mesh: &mut Mesh| mesh.colors = vec![Vec4::new(0.5, 0.25, 1.0, 0.5); mesh.positions.len()];
    for (alpha, plain_alpha) in [
        ("", ""),
        (
            "alpha_mode = 'blend', alpha = 1, ",
            "alpha_mode = 'blend', alpha = 0.5, ",
        ),
    ] {
        let vertex_emission = scene(
            folder.path(),
            16,
            &text(&format!("{alpha}emission = [4, 4, 4], vertex_colors = 'emission'")),
            set_uniform_colors,
        );
        let constant_emission = scene(
            folder.path(),
            16,
            &text(&format!("{plain_alpha}emission = [2, 1, 4]")),
            |_| (),
        );
        let expected = reference(&constant_emission);
        assert!(means(&expected).iter().all(|pixel| pixel[0] > 0.1));
        for mode in exact_modes() {
            let found = means(&render(&vertex_emission, mode));
            for (found, expected) in found.iter().zip(means(&expected)) {
                let is_near = (0..3).all(|k| (found[k] / expected[k] - 1.0).abs() < 1e-5);
                assert!(is_near, "{mode:?}: {found:?} {expected:?}");
            }
        }
    }
}

fn set_uv_sets(mesh: &mut Mesh) {
    let mapped_uvs = |map: fn(Vec2) -> Vec2| mesh.uvs.iter().copied().map(map).collect::<Vec<_>>();
    mesh.more_uvs = vec![
        mapped_uvs(|uv| Vec2::new(3.0 * uv.y, 0.5 + uv.x)),
        mapped_uvs(|uv| Vec2::new(0.7 - uv.x, 2.0 * uv.x + 5.0 * uv.y)),
        mapped_uvs(|uv| uv * uv + Vec2::new(0.25, 0.125)),
    ];
}

#[test]
fn textures_use_the_selected_set_of_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("t.exr"), 8, 8, |x, y| {
        [
            x as f32 / 8.0,
            y as f32 / 8.0,
            if (x + y) % 2 == 0 { 1.0 } else { 0.25 },
        ]
    });
    let text = |set: u32, filter: &str, keys: &str| {
        format!(
            "{OBLIQUE_CAMERA}environment = {{ color = [0.5, 0.5, 0.5] }}\n\
             [textures.t]\ntype = 'image'\nfile = 't.exr'\nfilter = '{filter}'\nuv_set = {set}\n\
             [textures.first]\ntype = 'image'\nfile = 't.exr'\nfilter = '{filter}'\n\
             [materials.m]\ntype = 'principled'\nroughness = {{ texture = 'first', channel = 'g' }}\n{keys}\n{SHAPE}"
        )
    };
    let keys = [
        "base_color = { texture = 't' }",
        "emission = { texture = 't' }\nbase_color = [0, 0, 0]",
        "base_color = [0, 0, 0]\nalpha = { texture = 't', channel = 'b' }\nalpha_mode = 'blend'",
    ];
    for (keys, filter) in [
        (keys[0], "ewa"),
        (keys[0], "nearest"),
        (keys[1], "trilinear"),
        (keys[2], "bilinear"),
    ] {
        let by_set: Vec<_> = (0..5)
            .map(|set| scene(folder.path(), 4, &text(set, filter, keys), set_uv_sets))
            .collect();
        for set in 0..4 {
            // The expected mesh has only this set. The roughness texture is omitted, because it uses set 0.
            let without_roughness =
                |text: String| text.replace("roughness = { texture = 'first', channel = 'g' }\n", "");
            let keep_one_uv_set = |mesh: &mut Mesh| {
                set_uv_sets(mesh);
                let more_uvs = std::mem::take(&mut mesh.more_uvs);
                if set > 0 {
                    mesh.uvs = more_uvs[set - 1].clone();
                }
            };
            let expected = reference(&scene(
                folder.path(),
                4,
                &without_roughness(text(0, filter, keys)),
                keep_one_uv_set,
            ));
            let found = scene(
                folder.path(),
                4,
                &without_roughness(text(set as u32, filter, keys)),
                set_uv_sets,
            );
            // Not bit-identical: the microfacet frame is derived from the first set.
            let found = reference(&found);
            let is_near = means(&found)
                .iter()
                .zip(means(&expected))
                .all(|(a, b)| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-4));
            assert!(is_near, "{keys} {filter} {set}");
        }
        // The GPU renders only one set, because kernels with a BVH take seconds to compile.
        if filter != "nearest" && exact_modes().len() > 1 {
            let packed = &by_set[3];
            assert_eq!(
                differing(&render(packed, RenderMode::Baked), &reference(packed)),
                0,
                "{keys} {filter}"
            );
        }
        let pictures: Vec<_> = by_set.iter().map(reference).collect();
        for (i, a) in pictures.iter().enumerate() {
            for b in &pictures[..i] {
                assert!(differing(a, b) > 10, "{keys} {filter}");
            }
        }
    }
}

#[test]
fn textures_with_a_missing_uv_set_use_a_single_point() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("t.exr"), 4, 4, |x, y| [x as f32, y as f32, 1.0]);
    let text = format!(
        "{CAMERA_ABOVE}[textures.t]\ntype = 'image'\nfile = 't.exr'\nfilter = 'nearest'\nuv_set = 7\n\
         [materials.m]\ntype = 'principled'\nbase_color = [0, 0, 0]\nspecular = 0\nemission = {{ texture = 't' }}\n{SHAPE}"
    );
    for edit in [set_uv_sets, |_: &mut Mesh| ()] {
        let packed = scene(folder.path(), 1, &text, edit);
        for mode in both() {
            assert!(
                means(&render(&packed, mode))
                    .iter()
                    .all(|pixel| *pixel == [0.0, 3.0, 1.0]),
                "{mode:?}"
            );
        }
    }
}

#[test]
fn texture_factors_multiply_the_texels() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("t.png"), 2, 2, |_, _| [255, 51, 102]);
    image::RgbaImage::from_pixel(2, 2, image::Rgba([255, 255, 255, 51]))
        .save(folder.path().join("a.png"))
        .unwrap();
    let text = |keys: &str| {
        format!(
            "{CAMERA_ABOVE}environment = {{ color = [1, 1, 1] }}\n\
             textures.t = {{ type = 'image', file = 't.png', encoding = 'linear', factor = [0.5, 1, 0.25, 1] }}\n\
             textures.light = {{ type = 'image', file = 't.png', encoding = 'linear', factor = [20, 1000, 0, 0.5] }}\n\
             textures.a = {{ type = 'image', file = 'a.png', factor = [0, 0, 0, 0.5] }}\n\
             [materials.m]\ntype = 'principled'\nmetallic = 0\nspecular = 0\n{keys}\n{SHAPE}"
        )
    };
    for (keys, expected, tolerance) in [
        ("base_color = { texture = 't' }", [0.5, 0.2, 0.1], 1e-4),
        (
            "base_color = [0, 0, 0]\nemission = { texture = 'light' }",
            [20.0, 200.0, 0.0],
            1e-3,
        ),
        // Black with an opacity of 0.2 * 0.5.
        (
            "base_color = [0, 0, 0]\nalpha_mode = 'blend'\nalpha = { texture = 'a', channel = 'a' }",
            [0.9; 3],
            0.02,
        ),
        (
            "base_color = [0, 0, 0]\nalpha_mode = 'blend'\nalpha = { texture = 't', channel = 'b' }",
            [0.9; 3],
            0.02,
        ),
    ] {
        let packed = scene(folder.path(), 64, &text(keys), |_| ());
        for mode in both() {
            let found = means(&render(&packed, mode));
            let mean: [f64; 3] = std::array::from_fn(|k| found.iter().map(|pixel| pixel[k]).sum::<f64>() / 400.0);
            assert!(
                (0..3).all(|k| (mean[k] - expected[k]).abs() <= tolerance),
                "{keys} {mode:?}: {mean:?}"
            );
        }
    }
}

#[test]
fn invalid_factors_and_sets_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::from_pixel(2, 2, image::Rgba([255, 255, 255, 51]))
        .save(folder.path().join("a.png"))
        .unwrap();
    std::fs::write(folder.path().join("quad.obj"), QUAD).unwrap();
    let start = "image = { width = 1, height = 1 }\nrender = { integrator = 'path' }\ncamera = { position = [0, -5, 1], look_at = [0, 0, 0], fov = 40 }\n\
                 textures.t = { type = 'image', file = 'a.png', encoding = 'linear', factor = [0.5, 1.5, 1, 3] }\n\
                 textures.second = { type = 'image', file = 'a.png', uv_set = 1 }\n";
    let sphere = "[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n";
    let message = |keys: &str, shape: &str| {
        let text = format!("{start}materials.m = {{ type = 'principled', {keys} }}\n{shape}");
        let description = Description::parse(&text, "s.toml").unwrap();
        description
            .validate_with(&Assets::beside(folder.path()))
            .err()
            .map(|error| error.to_string())
    };
    for (keys, shape, expected) in [
        (
            "base_color = { texture = 't' }",
            SHAPE,
            "materials.m.base_color: the texture's factor of 1.5 must be from 0 to 1 here",
        ),
        (
            "sheen_color = { texture = 't' }",
            SHAPE,
            "materials.m.sheen_color: the texture's factor of 1.5 must be from 0 to 1 here",
        ),
        (
            "roughness = { texture = 't', channel = 'g' }",
            SHAPE,
            "materials.m.roughness: the texture's factor of 1.5 must be from 0 to 1 here",
        ),
        (
            "alpha_mode = 'mask', alpha = { texture = 't', channel = 'a' }",
            SHAPE,
            "materials.m.alpha: the texture's factor of 3 must be from 0 to 1 here",
        ),
        (
            "normal_map = { texture = 't' }",
            SHAPE,
            "materials.m.normal_map.texture: \"t\" is used as a normal map; its factor must be 1; use strength instead",
        ),
        (
            "base_color = { texture = 'second' }",
            sphere,
            "shapes[0].material: \"m\" must have no texture with uv_set = 1 here, because this shape has only UV set 0",
        ),
    ] {
        let message = message(keys, shape);
        assert!(
            message.as_deref().is_some_and(|message| message.contains(expected)),
            "{keys}: {message:?}"
        );
    }
    for (keys, shape) in [
        (
            "emission = { texture = 't' }, specular_color = { texture = 't' }",
            SHAPE,
        ),
        (
            "roughness = { texture = 't' }, metallic = { texture = 't', channel = 'b' }",
            SHAPE,
        ),
        ("base_color = { texture = 'second' }", SHAPE),
    ] {
        assert_eq!(message(keys, shape), None, "{keys}");
    }
}

#[test]
fn only_camera_rays_skip_back_faces() {
    let folder = tempfile::tempdir().unwrap();
    // The wall occludes an area light behind the camera, whichever side faces the light.
    let text = |height: f64, side: &str, transform: &str| {
        format!(
            "camera = {{ type = 'orthographic', position = [0, 0, {height}], look_at = [0, 0, 0], up = [0, 1, 0], height = 1.5 }}\n\
             materials.m = {{ type = 'principled', base_color = [0.9, 0.2, 0.1], metallic = 0, {side} }}\n\
             materials.floor = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\n\
             {SHAPE}translate = [0, 0, 1]\n{transform}\n[[shapes]]\ntype = 'rectangle'\nmaterial = 'floor'\ncenter = [0, 0, 0]\nsize = [9, 9]\n\
             normal = [0, 0, 1]\ntangent = [1, 0, 0]\n[[lights]]\ntype = 'rectangle'\ncenter = [0.5, 0, 6]\nsize = [1, 1]\nnormal = [0, 0, -1]\n\
             tangent = [1, 0, 0]\ncolor = [9, 9, 9]\n"
        )
    };
    let rotated = "rotate = [180, 0, 0]";
    for (height, transform, is_visible) in [
        (5.0, "", true),
        (5.0, rotated, false),
        (5.0, "scale = [-1, 1, 1]", true),
        (5.0, "scale = [1, 1, -1]", false),
        (5.0, "rotate = [180, 0, 0]\nscale = [1, 1, -1]", true),
        (0.5, "", true),
    ] {
        let pack_with = |side: &str| scene(folder.path(), 8, &text(height, side, transform), |_| ());
        let packed = pack_with("double_sided = false");
        let expected = pack_with(if is_visible {
            "double_sided = true"
        } else {
            "visible = false"
        });
        let opposite = pack_with(if is_visible {
            "visible = false"
        } else {
            "double_sided = true"
        });
        let modes = match transform == rotated {
            true => exact_modes()
                .into_iter()
                .filter(|mode| *mode != RenderMode::Buffers)
                .collect(),
            false => vec![RenderMode::Cpu],
        };
        for mode in modes {
            let picture = render(&packed, mode);
            assert_eq!(
                differing(&picture, &reference(&expected)),
                0,
                "{height} {transform} {mode:?}"
            );
            // A camera below the wall sees the floor.
            assert!(
                height < 1.0 || differing(&picture, &reference(&opposite)) > 300,
                "{height} {transform} {mode:?}"
            );
            let hits: Vec<u32> = first_hits(&packed, mode).iter().map(|hit| hit.shape).collect();
            let shape = if is_visible && height > 1.0 { 0 } else { 1 };
            assert_eq!(hits, vec![shape; 400], "{height} {transform} {mode:?}");
        }
    }
}

#[test]
fn tangents_of_a_mesh_override_its_texture_coordinates() {
    // The map tilts the normal along u; the tangents of the mesh contradict the texture coordinates.
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("n.exr"), 2, 2, |_, _| [0.8, 0.6, 0.9]);
    let text = format!(
        "{CAMERA_ABOVE}[textures.n]\ntype = 'image'\nfile = 'n.exr'\n\
         [materials.m]\ntype = 'principled'\nmetallic = 0\nspecular = 0\nnormal_map = {{ texture = 'n' }}\n\
         [[lights]]\ntype = 'directional'\ndirection = [-0.6, 0, -0.8]\ncolor = [3, 3, 3]\n{SHAPE}"
    );
    let set_tangents = |tangent: Vec4| move |mesh: &mut Mesh| mesh.tangents = vec![tangent; mesh.positions.len()];
    let n = glam::DVec3::new(0.6, 0.2, 0.8).normalize();
    for (tangent, x) in [
        (Vec4::new(1.0, 0.0, 0.0, 1.0), n.x),
        (Vec4::new(-1.0, 0.0, 0.0, 1.0), -n.x),
        (Vec4::new(0.0, 1.0, 0.0, 1.0), -n.y), // n x t = -x
        (Vec4::new(0.0, 1.0, 0.0, -1.0), n.y),
        (Vec4::new(0.0, 0.5, 0.0, -1.0), n.y), // any length
        (Vec4::ZERO, n.x),                     // from the texture coordinates
        (Vec4::NAN, n.x),
    ] {
        let packed = scene(folder.path(), 1, &text, set_tangents(tangent));
        // A Lambertian surface with an albedo of 1 and an irradiance of 3.
        let expected = 3.0 / std::f64::consts::PI * (0.6 * x + 0.8 * n.z).max(0.0);
        for mode in both() {
            for pixel in means(&render(&packed, mode)) {
                assert!(
                    (pixel[0] - expected).abs() < 1e-4,
                    "{tangent} {mode:?}: {pixel:?} {expected}"
                );
            }
        }
    }
}

#[test]
fn colors_of_ply_files_are_read() {
    let file = |types: [&str; 4], rows: [&str; 3]| {
        let names = ["red", "green", "blue", "alpha"];
        let colors: String = types
            .iter()
            .zip(names)
            .filter(|(t, _)| !t.is_empty())
            .map(|(t, name)| format!("property {t} {name}\n"))
            .collect();
        let points = ["0 0 0", "1 0 0", "0 1 0"];
        let rows: String = points
            .iter()
            .zip(rows)
            .map(|(point, row)| format!("{point} {row}\n"))
            .collect();
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{colors}\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n"
        )
    };
    let read_colors = |types, rows| load("a.ply", file(types, rows), None).unwrap().colors;
    let assert_near = |found: Vec<Vec4>, expected: [[f32; 4]; 3]| {
        let expected: Vec<Vec4> = expected.into_iter().map(Vec4::from_array).collect();
        assert_eq!(found.len(), 3);
        assert!(
            found.iter().zip(&expected).all(|(a, b)| a.abs_diff_eq(*b, 1e-5)),
            "{found:?} {expected:?}"
        );
    };
    // IEC 61966-2-1: 188 decodes to 0.5029, 10 to 10 / 255 / 12.92.
    assert_near(
        read_colors(["uchar"; 4], ["255 188 10 51", "0 0 0 0", "300 -7 255 255"]),
        [[1.0, 0.502_886_5, 0.003_035_27, 0.2], [0.0; 4], [1.0, 0.0, 1.0, 1.0]],
    );
    assert_near(
        read_colors(["float", "float", "double", ""], ["0.5 2 0", "nan -1 1e9", "inf 1 1"]),
        [[0.5, 2.0, 0.0, 1.0], [1.0; 4], [1.0; 4]], // white if a component is not finite
    );
    assert_near(
        read_colors(
            ["ushort", "ushort", "ushort", "float"],
            ["65535 0 0 0.25", "0 65535 0 7", "0 0 65535 -1"],
        ),
        [[1.0, 0.0, 0.0, 0.25], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]],
    );
    // All three components are required.
    assert_eq!(read_colors(["uchar", "uchar", "", "uchar"], ["1 2 3"; 3]), vec![]);
}

#[test]
fn anisotropy_directions_come_from_an_image() {
    let folder = tempfile::tempdir().unwrap();
    let text = |keys: &str| {
        format!(
            "{OBLIQUE_CAMERA}environment = {{ color = [0.1, 0.1, 0.1] }}\n\
             textures.d = {{ type = 'image', file = 'd.exr', factor = [1, 1, 0.8, 1], rotate = 40, filter = 'nearest' }}\n\
             [[lights]]\ntype = 'point'\nposition = [0.2, 1.5, 1]\ncolor = [1, 1, 1]\n\
             [materials.m]\ntype = 'principled'\nroughness = 0.3\n{keys}\n{SHAPE}"
        )
    };
    let constant_rotation = |degrees: f64| {
        let keys = format!("anisotropy = {{ texture = 'd', channel = 'b' }}\nanisotropy_rotation = {degrees}");
        means(&reference(&scene(folder.path(), 4, &text(&keys), |_| ())))
    };
    let is_near =
        |a: &[[f64; 3]], b: &[[f64; 3]]| a.iter().zip(b).all(|(a, b)| (a[0] - b[0]).abs() < 1e-3 * (1.0 + a[0]));
    for (degrees, extra_degrees, length) in [
        (0.0, 0.0, 1.0),
        (35.0, 0.0, 0.3),
        (-100.0, 20.0, 1.0),
        (170.0, -360.0, 1.0),
    ] {
        let direction = glam::DVec2::from_angle(f64::to_radians(degrees)) * length * 0.5 + 0.5;
        write_exr(&folder.path().join("d.exr"), 2, 2, |_, _| {
            [direction.x as f32, direction.y as f32, 1.0]
        });
        // Strength and direction share a lookup.
        let keys = format!(
            "anisotropy = {{ texture = 'd', channel = 'b' }}\nanisotropy_rotation = {extra_degrees}\nanisotropy_direction = {{ texture = 'd' }}"
        );
        let packed = scene(folder.path(), 4, &text(&keys), |_| ());
        assert_eq!(packed.textures.lookups.len(), 1);
        let found = means(&reference(&packed));
        let expected = constant_rotation(if degrees + extra_degrees < -360.0 {
            degrees
        } else {
            degrees + extra_degrees
        });
        assert!(is_near(&found, &expected), "{degrees} {extra_degrees}");
        assert!(
            !is_near(&found, &constant_rotation(degrees + 90.0)),
            "{degrees} {extra_degrees}"
        );
        if extra_degrees != 0.0 {
            for mode in exact_modes().into_iter().filter(|mode| *mode == RenderMode::Baked) {
                assert_eq!(
                    differing(&render(&packed, mode), &reference(&packed)),
                    0,
                    "{degrees} {mode:?}"
                );
            }
        }
    }
}

#[test]
fn invalid_direction_maps_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("t.png"), 2, 2, |_, _| [255, 51, 102]);
    let message = |texture: &str| {
        let text = format!(
            "image = {{ width = 1, height = 1 }}\nrender = {{ integrator = 'path' }}\ncamera = {{ position = [0, -5, 1], look_at = [0, 0, 0], fov = 40 }}\n\
             textures.t = {{ {texture} }}\nmaterials.m = {{ type = 'principled', anisotropy = 1, anisotropy_direction = {{ texture = 't' }} }}\n"
        );
        let description = Description::parse(&text, "s.toml").unwrap();
        description
            .validate_with(&Assets::beside(folder.path()))
            .err()
            .map(|error| error.to_string())
    };
    let prefix = "materials.m.anisotropy_direction.texture: \"t\"";
    for (texture, rule) in [
        (
            "type = 'constant', color = [1, 1, 1]",
            "must be a texture of type \"image\"",
        ),
        (
            "type = 'image', file = 't.png'",
            "is used as an anisotropy direction; its encoding must be \"linear\"",
        ),
        (
            "type = 'image', file = 't.png', encoding = 'linear', factor = [1, 0.5, 1, 1]",
            "is used as an anisotropy direction; the red and green components of its factor must be 1",
        ),
    ] {
        let message = message(texture);
        assert!(
            message
                .as_deref()
                .is_some_and(|m| m.contains(&format!("{prefix} {rule}"))),
            "{message:?}"
        );
    }
    assert_eq!(
        message("type = 'image', file = 't.png', encoding = 'linear', factor = [1, 1, 0.5, 1]"),
        None
    );
}
