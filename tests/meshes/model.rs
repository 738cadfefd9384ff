//! Mesh files that are rendered without a scene, and files that cannot be rendered.

use std::fs;
use std::path::Path;

use wgray::scene::{
    Geometry, GltfChoice, Integrator, Overrides, Presentation, Reflection, Scene, Selection, VertexColors, View,
};
use wgray::{Description, Device, Options};

use super::readers::in_all_formats;

fn load(path: &Path) -> Result<(Scene, Description), String> {
    Scene::load_described(path, &Overrides::default()).map_err(|error| error.to_string())
}

fn coverage(scene: &Scene) -> f64 {
    let options = Options {
        device: Device::Cpu,
        ..Options::default()
    };
    let picture = wgray::render(scene, &options).unwrap();
    let alpha = picture.alpha().expect("alpha");
    alpha.iter().map(|a| f64::from(*a)).sum::<f64>() / alpha.len() as f64
}

#[test]
fn mesh_files_of_all_formats_are_framed() {
    let folder = tempfile::tempdir().unwrap();
    let overrides = |view| Overrides {
        size: Some((40, 30)),
        pixel_samples: Some(4),
        background: Some("none".parse().unwrap()),
        gltf: GltfChoice {
            view,
            ..GltfChoice::default()
        },
        ..Overrides::default()
    };
    for (name, bytes) in in_all_formats() {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        for view in [None, Some(View::Front), Some(View::Top)] {
            let scene = Scene::load_with(&path, &overrides(view)).unwrap();
            assert_eq!(scene.notes, Vec::<String>::new(), "{name}");
            let covered = coverage(&scene);
            assert!((0.1..0.9).contains(&covered), "{name} {view:?}: {covered}");
        }
    }
}

#[test]
fn a_mesh_is_upright_by_default() {
    let folder = tempfile::tempdir().unwrap();
    let tall = "v 0 0 0\nv 0.1 0 0\nv 0 9 1\nf 1 2 3\n";
    let path = folder.path().join("tall.OBJ");
    fs::write(&path, tall).unwrap();
    let (low, high) = load(&path).unwrap().0.bounds().unwrap();
    assert!((high - low - wgray::DVec3::new(0.1, 1.0, 9.0)).abs().max_element() < 1e-6);
    let facet = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 9\nendloop\nendfacet\nendsolid\n";
    let path = folder.path().join("tall.stl");
    fs::write(&path, facet).unwrap();
    let (low, high) = load(&path).unwrap().0.bounds().unwrap();
    assert!((high - low - wgray::DVec3::new(1.0, 2.0, 9.0)).abs().max_element() < 1e-6);
}

#[test]
fn any_axis_may_be_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    fs::write(&path, "v 0 0 0\nv 1 2 0\nv 0 0 5\nf 1 2 3\n").unwrap();
    for (up, height) in [("x", 1.0), ("-y", 2.0), ("z", 5.0), ("-z", 5.0)] {
        let overrides = Overrides {
            presentation: Presentation {
                up: Some(up.parse().unwrap()),
                ..Presentation::default()
            },
            ..Overrides::default()
        };
        let scene = Scene::load_with(&path, &overrides).unwrap();
        let (low, high) = scene.bounds().unwrap();
        assert!((high.z - low.z - height).abs() < 1e-6, "{up}: {low} {high}");
    }
}

#[test]
fn materials_use_the_vertex_colors_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    for (text, expected) in [
        (
            "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n",
            VertexColors::BaseColor,
        ),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", VertexColors::None),
    ] {
        fs::write(&path, text).unwrap();
        let (scene, _) = load(&path).unwrap();
        let Reflection::Principled(principled) = &scene.materials[0].reflection else {
            panic!("{:?}", scene.materials)
        };
        assert_eq!(principled.vertex_colors, expected);
        assert_eq!(scene.material_names, ["default"]);
    }
}

#[test]
fn the_description_of_a_mesh_gives_the_same_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    fs::write(folder.path().join("a.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    fs::write(
        &path,
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nusemtl red\nf 1 2 3\nusemtl\nf 2 4 3\n",
    )
    .unwrap();
    let (scene, description) = load(&path).unwrap();
    let text = description.to_toml().unwrap();
    let file = folder.path().join("a.toml");
    fs::write(&file, text).unwrap();
    let reloaded = Scene::load(&file).unwrap();
    assert_eq!(reloaded.shapes, scene.shapes);
    assert_eq!(
        (&reloaded.materials, &reloaded.camera),
        (&scene.materials, &scene.camera)
    );
    assert_eq!(reloaded.render, scene.render);
    assert_eq!(scene.material_names, ["red", "default"]);
    // The list of files of the scene contains files that the mesh refers to.
    let is_listed = |name: &str| scene.files.iter().any(|file| file.ends_with(name));
    assert!(is_listed("a.obj") && is_listed("a.mtl"), "{:?}", scene.files);
    assert!(matches!(scene.shapes[0].geometry, Geometry::Mesh { .. }));
}

#[test]
fn unsupported_files_are_rejected_with_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    for (name, message) in [
        ("a.fbx", ".fbx is not supported; export glTF (.glb), OBJ, PLY or STL"),
        ("a.USDZ", ".usdz is not supported; export glTF (.glb), OBJ, PLY or STL"),
        (
            "a.blend",
            ".blend is not supported; export glTF (.glb), OBJ, PLY or STL",
        ),
        (
            "a.png",
            ".png is an image, not a scene; use it as a texture in a scene, or with --environment",
        ),
        (
            "a.mtl",
            ".mtl is a material library; render the .obj file that names it",
        ),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, "x").unwrap();
        assert_eq!(load(&path).unwrap_err(), format!("{}: {message}", path.display()));
    }
    let path = folder.path().join("a.obj");
    assert!(
        load(&path)
            .unwrap_err()
            .starts_with(&format!("{}: cannot be read: ", path.display()))
    );
    fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").unwrap();
    let expected = format!(
        "{}:4: the face refers to vertex 9, which does not exist; defined so far: 3",
        path.display()
    );
    assert_eq!(load(&path).unwrap_err(), expected);
}

#[test]
fn models_are_framed_or_rejected_by_their_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    for (size, is_framed) in [("1e-12", false), ("1e-6", true), ("1e7", true), ("9e8", false)] {
        fs::write(&path, format!("v 0 0 0\nv {size} 0 0\nv 0 {size} 0\nf 1 2 3\n")).unwrap();
        for ground in [false, true] {
            let overrides = Overrides {
                size: Some((8, 8)),
                pixel_samples: Some(1),
                background: Some("none".parse().unwrap()),
                presentation: Presentation {
                    ground,
                    ..Presentation::default()
                },
                ..Overrides::default()
            };
            match Scene::load_with(&path, &overrides) {
                Ok(scene) => assert!(is_framed && coverage(&scene) > 0.1, "{size}"),
                Err(error) => {
                    let rule = "units; the automatic camera needs 1e-8 to 4e8: scale the model";
                    assert!(!is_framed && error.to_string().ends_with(rule), "{size}: {error}");
                }
            }
        }
    }
}

#[test]
fn files_with_names_in_another_case_are_found_or_suggested() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("RED.mtl", "newmtl red\nKd 1 0 0\n");
    write(
        "a.obj",
        "mtllib Red.MTL\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n",
    );
    let (scene, _) = load(&folder.path().join("a.obj")).unwrap();
    assert_eq!(scene.notes, Vec::<String>::new());
    assert_eq!(scene.material_names, ["red"]);
    // A folder has the exact name; the file differs in case.
    fs::create_dir_all(folder.path().join("Sub/M.mtl")).unwrap();
    write("Sub/m.mtl", "newmtl red\nKd 1 0 0\n");
    write(
        "b.obj",
        "mtllib sub/M.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n",
    );
    let (scene, _) = load(&folder.path().join("b.obj")).unwrap();
    assert_eq!(scene.notes, Vec::<String>::new());
    let text = "image = { width = 4, height = 4 }\ncamera = { position = [0, -5, 0], look_at = [0, 0, 0], fov = 40 }\n\
                [render]\nintegrator = 'path'\n[environment]\nfile = 'red.MTL'\n";
    write("s.toml", text);
    let message = load(&folder.path().join("s.toml")).unwrap_err();
    assert!(message.ends_with("; did you mean \"RED.mtl\"?"), "{message}");
}

#[test]
fn strict_rejects_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n").unwrap();
    let scene = folder.path().join("s.toml");
    let text = "image = { width = 4, height = 4 }\ncamera = { position = [0, -5, 0], look_at = [0, 0, 0], fov = 40 }\n\
                [[shapes]]\ntype = 'mesh'\nfile = 'a.obj'\n";
    fs::write(&scene, text).unwrap();
    for strict in [false, true] {
        let overrides = Overrides {
            strict,
            ..Overrides::default()
        };
        let load = |path: &Path| Scene::load_with(path, &overrides).map_err(|error| error.to_string());
        let rule = "a face must have at least 3 corners, not 2";
        match strict {
            true => {
                assert_eq!(load(&path).unwrap_err(), format!("{}:5: {rule}", path.display()));
                let message = load(&scene).unwrap_err();
                assert!(
                    message.ends_with(&format!(": shapes[0].file: a.obj:5: {rule}")),
                    "{message}"
                );
            }
            false => {
                let note = format!("line 5: {rule}; the face was removed");
                assert_eq!(load(&path).unwrap().notes, std::slice::from_ref(&note));
                let scene_note = format!("a.obj:5: {rule}; the face was removed");
                assert_eq!(load(&scene).unwrap().notes, [scene_note]);
            }
        }
    }
}

#[test]
fn gltf_options_are_rejected_for_mesh_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.stl");
    fs::write(&path, "solid").unwrap();
    let overrides = Overrides {
        gltf: GltfChoice {
            camera: Some(Selection::Number(0)),
            ..GltfChoice::default()
        },
        ..Overrides::default()
    };
    let message = Scene::load_with(&path, &overrides).unwrap_err().to_string();
    assert_eq!(
        message,
        format!("camera: only applies to glTF files, and {} is a mesh", path.display())
    );
}

#[test]
fn a_model_without_lights_needs_the_path_tracer() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in in_all_formats() {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        for (integrator, is_rejected) in [(Integrator::Phong, true), (Integrator::Path, false)] {
            let overrides = Overrides {
                integrator: Some(integrator),
                ..Overrides::default()
            };
            let message = Scene::load_with(&path, &overrides).map_or_else(|error| error.to_string(), |_| String::new());
            let rule = "integrator: phong does not support environment light";
            assert_eq!(message.starts_with(rule), is_rejected, "{name}: {message}");
        }
    }
}
