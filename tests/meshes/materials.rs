//! Materials of MTL files with the integrator `path`, including the extensions for physically based rendering.

use std::fs;
use std::path::Path;

use wgray::DVec3;
use wgray::scene::{AlphaMode, Channel, Color, Material, Overrides, Principled, Reflection, Scene, Value};

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";

fn write(folder: &Path, mtl: &str) {
    fs::write(folder.join("a.obj"), OBJ).unwrap();
    fs::write(folder.join("a.mtl"), format!("newmtl m\n{mtl}")).unwrap();
    let color = image::RgbImage::from_fn(2, 2, |x, y| image::Rgb([100, 50 * x as u8, 200 * y as u8]));
    color.save(folder.join("color.png")).unwrap();
    let gray = image::RgbImage::from_pixel(2, 2, image::Rgb([90, 90, 90]));
    gray.save(folder.join("gray.png")).unwrap();
    let transparent = image::RgbaImage::from_pixel(2, 2, image::Rgba([90, 90, 90, 128]));
    transparent.save(folder.join("clear.png")).unwrap();
}

fn material(mtl: &str) -> (Material, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), mtl);
    let mut scene = Scene::load(folder.path().join("a.obj")).unwrap();
    assert_eq!(scene.material_names, ["m"]);
    let notes = scene.notes.iter().map(ToString::to_string).collect();
    (scene.materials.remove(0), notes)
}

fn principled(material: &Material) -> &Principled {
    match &material.reflection {
        Reflection::Principled(principled) => principled,
        other => panic!("{other:?}"),
    }
}

#[test]
fn values_are_converted_to_principled() {
    let (material, notes) = material("Kd 0.5 0.25 0.125\nKs 0.25\nPr 0.3\nPm 0.75\nKe 2 3 4\nd 0.5\n");
    assert_eq!(notes, Vec::<String>::new());
    let principled = principled(&material);
    assert_eq!(principled.base_color, Color::Plain(DVec3::new(0.5, 0.25, 0.125)));
    assert_eq!(principled.specular, Value::Plain(0.5));
    assert_eq!(
        (principled.roughness, principled.metallic),
        (Value::Plain(0.3), Value::Plain(0.75))
    );
    assert_eq!(
        (principled.alpha, principled.alpha_mode),
        (Value::Plain(0.5), AlphaMode::Blend)
    );
    assert_eq!(material.emission, Color::Plain(DVec3::new(2.0, 3.0, 4.0)));
}

#[test]
fn defaults_are_a_rough_surface_without_highlights() {
    for mtl in ["", "Ks 1\nillum 1\n"] {
        let (material, _) = material(mtl);
        let principled = principled(&material);
        assert_eq!(principled.base_color, Color::Plain(DVec3::splat(0.8)));
        assert_eq!(
            (principled.specular, principled.roughness),
            (Value::Plain(0.0), Value::Plain(1.0))
        );
        assert_eq!(
            (principled.metallic, principled.alpha_mode),
            (Value::Plain(0.0), AlphaMode::Opaque)
        );
        assert_eq!(material.emission, Color::BLACK);
    }
    // A higher exponent makes the surface smoother.
    let roughness = |exponent: f64| match principled(&material(&format!("Ks 1\nNs {exponent}\n")).0).roughness {
        Value::Plain(roughness) => roughness,
        other => panic!("{other:?}"),
    };
    assert_eq!(roughness(0.0), 1.0);
    assert!((roughness(30.0) - 0.5).abs() < 1e-12);
    assert!(roughness(1000.0) < 0.25);
    // `Tr` is 1 - opacity.
    assert_eq!(principled(&material("Tr 0.25\n").0).alpha, Value::Plain(0.75));
    // MeshLab writes `Tr 1` for an opaque material.
    assert_eq!(principled(&material("Tr 1.000000\n").0).alpha, Value::Plain(1.0));
}

#[test]
fn maps_replace_values() {
    let (material, notes) = material(
        "map_Kd color.png\nmap_Ke color.png\nmap_Pr gray.png\nmap_Pm color.png\nmap_d clear.png\nnorm color.png\n",
    );
    assert_eq!(notes, Vec::<String>::new());
    let principled = principled(&material);
    assert!(matches!(principled.base_color, Color::Texture(_)));
    assert_eq!(material.emission, principled.base_color);
    assert!(matches!(principled.roughness, Value::Texture(_, Channel::R)));
    assert!(matches!(principled.metallic, Value::Texture(_, Channel::R)));
    assert!(matches!(principled.alpha, Value::Texture(_, Channel::A)));
    assert_eq!(principled.alpha_mode, AlphaMode::Blend);
    // Maps with linear texels share a texture; sRGB colors need a separate texture.
    let Value::Texture(metallic, _) = principled.metallic else {
        unreachable!("`metallic` is a texture")
    };
    assert_eq!(material.normal_map.map(|map| map.texture), Some(metallic));
    assert_ne!(material.emission, Color::Texture(metallic));
}

#[test]
fn bump_maps_are_used_as_normal_maps_or_reported() {
    let (colored, notes) = material("map_Bump color.png\n");
    assert!(colored.normal_map.is_some() && notes.is_empty(), "{notes:?}");
    let (gray, notes) = material("bump gray.png\n");
    assert_eq!(gray.normal_map, None);
    assert_eq!(
        notes,
        ["a.mtl:2: material \"m\": map_Bump: a height map is ignored; bake a normal map and reference it with norm"]
    );
    let (opaque, notes) = material("map_d gray.png\n");
    assert!(matches!(principled(&opaque).alpha, Value::Texture(_, Channel::R)) && notes.is_empty());
}

#[test]
fn strict_rejects_missing_maps() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "map_Kd none.png\n");
    let overrides = Overrides {
        strict: true,
        ..Overrides::default()
    };
    let path = folder.path().join("a.obj");
    let message = Scene::load_with(&path, &overrides).unwrap_err().to_string();
    let start = format!(
        "{}: a.mtl:2: material \"m\": map_Kd: \"none.png\" cannot be read: ",
        path.display()
    );
    assert!(message.starts_with(&start) && !message.contains("ignored"), "{message}");
    // Paths that cannot be used: a folder, and a path outside of the folder of the mesh.
    fs::create_dir(folder.path().join("folder.png")).unwrap();
    for (map, rule) in [("folder.png", "must be a file"), ("../none.png", "cannot be read")] {
        write(folder.path(), &format!("map_Kd {map}\n"));
        let message = Scene::load_with(&path, &overrides).unwrap_err().to_string();
        assert!(message.contains(rule), "{message}");
        assert_eq!(Scene::load(&path).unwrap().notes.len(), 1, "{map}");
    }
}

#[test]
fn strict_rejects_missing_materials() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.obj"), OBJ).unwrap();
    let path = folder.path().join("a.obj");
    let load = |strict: bool| {
        let overrides = Overrides {
            strict,
            ..Overrides::default()
        };
        Scene::load_with(&path, &overrides)
    };
    let notes = load(false).unwrap().notes;
    assert!(
        notes
            .iter()
            .any(|note| note.message.ends_with("; a gray material is used instead")),
        "{notes:?}"
    );
    let message = load(true).unwrap_err().to_string();
    assert!(message.contains("undefined material \"m\""), "{message}");
}

#[test]
fn only_maps_that_exist_need_texture_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    for (mtl, expected) in [("Kd 1 0 0\n", 0), ("Kd 1 0 0\nmap_Kd color.png\n", 1)] {
        write(folder.path(), mtl);
        let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
        fs::write(folder.path().join("a.obj"), obj).unwrap();
        let notes = Scene::load(folder.path().join("a.obj")).unwrap().notes;
        assert_eq!(notes.len(), expected, "{notes:?}");
    }
}

#[test]
fn invalid_values_and_missing_maps_are_reported() {
    for (mtl, note) in [
        ("Pr 2\n", "Pr: 2 must be from 0 to 1; 1 is used instead"),
        ("d 0\n", "d: 0 makes the material invisible; 1 is opaque"),
        (
            "Kd 1 2 -1\n",
            "Kd: each of [1, 2, -1] must be from 0 to 1; [1, 1, 0] is used instead",
        ),
        ("map_Pr none.png\n", "map_Pr: \"none.png\" cannot be read: "),
        ("map_d none.png\n", "map_d: \"none.png\" cannot be read: "),
        ("norm ../x.png\n", "norm: \"../x.png\" "),
    ] {
        let (_, notes) = material(mtl);
        let [found] = &notes[..] else {
            panic!("{mtl}: {notes:?}")
        };
        assert!(
            found.starts_with(&format!("a.mtl:2: material \"m\": {note}")),
            "{found}"
        );
    }
}
