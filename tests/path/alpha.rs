//! Alpha-tested and alpha-blended surfaces: closed-form values, shadows of masks, identical bits on both backends.

use wgray::scene::{Assets, Description};
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use super::{mean, scene};
use crate::pictures::{both, differing, exact_modes, first_hits, means, reference, render};

/// Camera above the square of side 2 around the origin.
const CAMERA_DOWN: &str =
    "camera = { type = 'orthographic', position = [0, 0, 9], look_at = [0, 0, 0], up = [0, 1, 0], height = 2 }\n";

fn black_material(keys: &str) -> String {
    format!("{{ type = 'principled', base_color = [0, 0, 0], metallic = 0, specular = 0, {keys} }}")
}

fn square(z: f64, size: f64, material: &str) -> String {
    format!(
        "[[shapes]]\ntype = 'rectangle'\nmaterial = '{material}'\ncenter = [0, 0, {z}]\nsize = [{size}, {size}]\n\
         normal = [0, 0, 1]\ntangent = [1, 0, 0]\n"
    )
}

#[test]
fn blended_layers_transmit_one_minus_alpha() {
    for (alpha, layers) in [(0.5, 1), (0.3, 1), (0.5, 3), (0.0, 2), (1.0, 2)] {
        let head = format!(
            "{CAMERA_DOWN}environment = {{ color = [1, 1, 1] }}\nmaterials.surface = {}\n",
            black_material(&format!("alpha = {alpha}, alpha_mode = 'blend'"))
        );
        let text: String = (0..layers).map(|i| square(f64::from(i), 4.0, "surface")).collect();
        let packed = scene(256, 4, &format!("{head}{text}"));
        // Each layer independently transmits 1 - alpha.
        let expected = (1.0f64 - alpha).powi(layers);
        for mode in both() {
            let found = mean(&render(&packed, mode))[0];
            let standard_error = (expected * (1.0 - expected) / (256.0 * 256.0)).sqrt();
            assert!(
                (found - expected).abs() <= 5.0 * standard_error,
                "{alpha} {layers} {mode:?}: {found} {expected}"
            );
        }
    }
}

#[test]
fn a_blended_sphere_is_crossed_twice() {
    // Entry and exit are blended independently.
    let text = format!(
        "{CAMERA_DOWN}environment = {{ color = [1, 1, 1] }}\nmaterials.surface = {}\n[[shapes]]\ntype = 'sphere'\nmaterial = 'surface'\n\
         center = [0, 0, 0]\nradius = 3\n",
        black_material("alpha = 0.5, alpha_mode = 'blend'")
    );
    let packed = scene(256, 4, &text);
    for mode in both() {
        let found = mean(&render(&packed, mode))[0];
        assert!((found - 0.25).abs() < 0.009, "{mode:?}: {found}");
    }
}

#[test]
fn shadows_scale_with_alpha() {
    let scene_with = |alpha: f64, light: &str| {
        let material = black_material(&format!("alpha = {alpha}, alpha_mode = 'blend'"));
        // The camera is below the surface and sees the shadow on the floor.
        let text = format!(
            "camera = {{ type = 'orthographic', position = [0, 0, 0.4], look_at = [0, 0, 0], up = [0, 1, 0], height = 0.2 }}\n\
             materials.surface = {material}\nmaterials.floor = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\n{}{}{light}",
            square(0.0, 4.0, "floor"),
            square(0.5, 4.0, "surface")
        );
        scene(256, 1, &text)
    };
    for light in [
        "[[lights]]\ntype = 'point'\nposition = [0, 0, 1]\ncolor = [1, 1, 1]\n",
        "[[lights]]\ntype = 'directional'\ndirection = [0, 0, -1]\ncolor = [1, 1, 1]\n",
        "[[lights]]\ntype = 'rectangle'\ncenter = [0, 0, 2]\nsize = [1, 1]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\ncolor = [1, 1, 1]\n",
    ] {
        for mode in both() {
            let found = |alpha: f64| mean(&render(&scene_with(alpha, light), mode))[0];
            let (transparent, blended, opaque) = (found(0.0), found(0.6), found(1.0));
            assert!(transparent > 0.0 && opaque == 0.0, "{light}: {transparent} {opaque}");
            assert!(
                (blended / transparent - 0.4).abs() < 0.02,
                "{light} {mode:?}: {}",
                blended / transparent
            );
        }
    }
}

#[test]
fn transparent_surfaces_do_not_change_mis_weights() {
    // NEE and BSDF sampling both contribute, with and without a fully transparent surface.
    let scene_with = |has_surface: bool| {
        let shape = if has_surface {
            square(0.5, 4.0, "surface")
        } else {
            String::new()
        };
        let text = format!(
            "camera = {{ type = 'orthographic', position = [0, 0, 0.4], look_at = [0, 0, 0], up = [0, 1, 0], height = 0.2 }}\n\
             materials.surface = {}\nmaterials.floor = {{ type = 'diffuse', color = [0.5, 0.5, 0.5] }}\n{}{shape}\
             [[lights]]\ntype = 'rectangle'\ncenter = [0, 0, 1]\nsize = [3, 3]\nnormal = [0, 0, -1]\ntangent = [1, 0, 0]\ncolor = [1, 1, 1]\n",
            black_material("alpha = 0, alpha_mode = 'blend'"),
            square(0.0, 4.0, "floor")
        );
        scene(1024, 1, &text)
    };
    for mode in both() {
        let [without_surface, with_surface] =
            [false, true].map(|has_surface| mean(&render(&scene_with(has_surface), mode))[0]);
        assert!(
            (with_surface / without_surface - 1.0).abs() < 2e-3,
            "{mode:?}: {without_surface} {with_surface}"
        );
    }
}

/// Returns a scene with a quad above a floor. The alpha of the quad is 1 in a disk, otherwise 0.
fn leaf(folder: &std::path::Path, mode: &str, camera: &str) -> Packed {
    let size = 64u32;
    let texel = |x: u32, y: u32| {
        let [x, y] = [x, y].map(|i| f64::from(i) + 0.5 - f64::from(size) / 2.0);
        let inside = x.hypot(y) < f64::from(size) / 4.0;
        image::Rgba([40, 200, 60, if inside { 255 } else { 0 }])
    };
    image::RgbaImage::from_fn(size, size, texel)
        .save(folder.join("leaf.png"))
        .unwrap();
    let quad = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.join("quad.obj"), quad).unwrap();
    let text = format!(
        "image = {{ width = 40, height = 40 }}\n{camera}\
         [render]\nintegrator = 'path'\nmax_depth = 3\npixel_samples = {{ count = 16 }}\n\
         [textures.leaf]\ntype = 'image'\nfile = 'leaf.png'\nfilter = 'nearest'\n\
         [materials.leaf]\ntype = 'principled'\nmetallic = 0\nroughness = 0.6\nbase_color = {{ texture = 'leaf' }}\n\
         alpha = {{ texture = 'leaf', channel = 'a' }}\nalpha_mode = '{mode}'\n\
         [materials.floor]\ntype = 'diffuse'\ncolor = [0.5, 0.5, 0.5]\n\
         [[lights]]\ntype = 'directional'\ndirection = [0, 0, -1]\ncolor = [1, 1, 1]\n{}\
         [[shapes]]\ntype = 'mesh'\nfile = 'quad.obj'\nmaterial = 'leaf'\ntranslate = [0, 0, 1]\n",
        square(0.0, 8.0, "floor")
    );
    let description = Description::parse(&text, "leaf.toml").expect("a scene");
    pack(&description.validate_with(&Assets::beside(folder)).expect("valid"))
}

#[test]
fn a_masked_surface_casts_the_shadow_of_its_mask() {
    let folder = tempfile::tempdir().unwrap();
    let camera_below =
        "camera = { type = 'orthographic', position = [0, 0, 0.5], look_at = [0, 0, 0], up = [0, 1, 0], height = 2 }\n";
    for mode in ["mask", "blend", "opaque"] {
        let packed = leaf(folder.path(), mode, camera_below);
        for render_mode in both() {
            let found = means(&render(&packed, render_mode));
            for (i, pixel) in found.iter().enumerate() {
                let [x, y] = [i % 40, i / 40].map(|i| (i as f64 + 0.5) / 20.0 - 1.0);
                let r = x.hypot(y);
                if (r - 0.5).abs() > 0.08 {
                    // The limit is above 0 because leaf and floor reflect light onto each other.
                    let is_dark = pixel[0] < 0.05;
                    assert_eq!(
                        is_dark,
                        r < 0.5 || mode == "opaque",
                        "{mode} {render_mode:?} {x} {y}: {pixel:?}"
                    );
                }
            }
        }
    }
    let camera_above = "camera = { position = [0.3, -2.5, 2.5], look_at = [0, 0, 0.5], fov = 45 }\n";
    for mode in ["mask", "blend"] {
        let packed = leaf(folder.path(), mode, camera_above);
        let expected = reference(&packed);
        for render_mode in exact_modes() {
            assert_eq!(
                differing(&render(&packed, render_mode), &expected),
                0,
                "{mode} {render_mode:?}"
            );
        }
    }
    let packed = leaf(folder.path(), "mask", CAMERA_DOWN);
    for render_mode in both() {
        let hits = first_hits(&packed, render_mode);
        for (i, hit) in hits.iter().enumerate() {
            let [x, y] = [i % 40, i / 40].map(|i| (i as f64 + 0.5) / 20.0 - 1.0);
            let r = x.hypot(y);
            if (r - 0.5).abs() > 0.08 {
                let depth = if r < 0.5 { 8.0 } else { 9.0 };
                assert!(
                    (f64::from(hit.depth) - depth).abs() < 1e-4,
                    "{render_mode:?} {x} {y}: {hit:?}"
                );
            }
        }
    }
}
