//! Damaged images cause a warning and are replaced or repaired; with `strict`, they are rejected.

use std::path::Path;

use glam::DVec3;
use wgray::scene::{Color, Overrides, Reflection, Scene, Texels, TextureKind};

use super::{write_exr, write_png};

const SCENE_START: &str = "\
image = { width = 4, height = 4 }
camera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }
[render]
integrator = 'path'
";

fn load(folder: &Path, text: &str, strict: bool) -> Result<Scene, String> {
    let path = folder.join("s.toml");
    std::fs::write(&path, format!("{SCENE_START}{text}")).unwrap();
    let overrides = Overrides {
        strict,
        ..Overrides::default()
    };
    Scene::load_with(&path, &overrides).map_err(|error| error.to_string())
}

const MATERIAL: &str = "
[textures.wood]
type = 'image'
file = 'FILE'
factor = [0.5, 0.25, 1, 1]
[textures.bumps]
type = 'image'
encoding = 'linear'
file = 'FILE'
[materials.m]
type = 'diffuse'
color = { texture = 'wood' }
emission = { texture = 'wood' }
normal_map = { texture = 'bumps' }
";

#[test]
fn an_unreadable_image_is_replaced_by_its_factor() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_png(&path("good.png"), 4, 4, |_, _| [90; 3]);
    let png = std::fs::read(path("good.png")).unwrap();
    std::fs::write(path("cut.png"), &png[..png.len() / 2]).unwrap();
    std::fs::write(path("empty.png"), b"").unwrap();
    for (file, reason) in [
        ("none.png", "cannot be read: "),
        ("cut.png", "is damaged or truncated: "),
        ("empty.png", "must be a PNG, JPEG, WebP, KTX2, EXR or HDR file"),
    ] {
        let text = MATERIAL.replace("FILE", file);
        let scene = load(folder.path(), &text, false).unwrap();
        assert_eq!(
            scene.notes.len(),
            1,
            "expected exactly one message about the file: {:?}",
            scene.notes
        );
        let note = &scene.notes[0];
        assert!(note.message.starts_with(&format!("{file:?} {reason}")), "{note}");
        assert!(
            note.message.ends_with("; the texture is replaced by its factor"),
            "{note}"
        );
        let material = &scene.materials[0];
        let Reflection::Diffuse {
            color: Color::Texture(texture),
            ..
        } = material.reflection
        else {
            panic!("{material:?}");
        };
        let kind = &scene.textures[texture].kind;
        assert_eq!(*kind, TextureKind::Constant(DVec3::new(0.5, 0.25, 1.0)));
        assert_eq!((material.emission, material.normal_map), (Color::BLACK, None));
        let error = load(folder.path(), &text, true).unwrap_err();
        let line = format!("s.toml:13: textures.bumps.file: {file:?} {reason}");
        assert!(error.contains(&line), "{error}");
    }
    let valid = load(folder.path(), &MATERIAL.replace("FILE", "good.png"), true).unwrap();
    assert!(valid.notes.is_empty() && valid.materials[0].normal_map.is_some());
}

#[test]
fn invalid_texels_are_clamped_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let values = [f32::NAN, -0.5, f32::INFINITY, 2e6, 0.25, 1e6];
    write_exr(&folder.path().join("a.exr"), 6, 3, |x, _| {
        [values[x as usize], 0.5, 0.125]
    });
    let rule = "texel values must be from 0 to 1e6";
    let damage = format!("\"a.exr\" has 12 invalid texels, the first at (0, 0); {rule}");
    let texture = "[textures.t]\ntype = 'image'\nfile = 'a.exr'\n";
    let environment = "[environment]\nfile = 'a.exr'\n";
    for (text, key) in [(texture, "7: textures.t.file"), (environment, "6: environment.file")] {
        let scene = load(folder.path(), text, false).unwrap();
        assert!(
            scene.notes.contains(&format!("{damage}; they are clamped").into()),
            "{:?}",
            scene.notes
        );
        let image = match (&scene.environment, scene.textures.first().map(|texture| &texture.kind)) {
            (_, Some(TextureKind::Image { image, .. })) => image,
            (Some(environment), _) => &environment.image.as_ref().unwrap().image,
            other => panic!("{other:?}"),
        };
        let Texels::Floats(texels) = &image.texels else {
            panic!("floats")
        };
        let red: Vec<f32> = texels[..6].iter().map(|texel| texel[0]).collect();
        assert_eq!(red, [0.0, 0.0, 1e6, 1e6, 0.25, 1e6]);
        assert!(texels.iter().all(|texel| texel[1..] == [0.5, 0.125]));
        let error = load(folder.path(), text, true).unwrap_err();
        assert!(error.ends_with(&format!("s.toml:{key}: {damage}")), "{error}");
    }
}

#[test]
fn an_unreadable_environment_map_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let error = load(folder.path(), "[environment]\nfile = 'none.hdr'\n", false).unwrap_err();
    assert!(
        error.contains("environment.file: \"none.hdr\" cannot be read"),
        "{error}"
    );
}
