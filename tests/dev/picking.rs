//! Picking of mesh instances, of meshes with their own materials, and of objects in glTF files.

use std::fs;

use serde_json::json;
use wgray::scene::Overrides;
use wgray_dev::{Command, Object, SceneView, Set, Sources};

use super::running::{Files, TestSession};
use crate::model::Model;

/// The start of a scene. The camera is at -y, and the image covers about x = -2 to 2.
const SCENE_START: &str = "\
image = { width = 40, height = 30 }
camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }
render.pixel_samples = { count = 1 }
";
const LEFT: [u32; 2] = [10, 15];
const MIDDLE: [u32; 2] = [20, 15];
const RIGHT: [u32; 2] = [30, 15];

const TILE: &str = "v -0.4 0 -0.4\nv 0.4 0 -0.4\nv 0.4 0 0.4\nv -0.4 0 0.4\nf 1 2 3 4\n";

/// An OBJ file of two quads with different materials: bark on the left, leaf on the right.
const PAIR: &str = "\
mtllib pair.mtl
v -1.4 0 -0.4
v -0.6 0 -0.4
v -0.6 0 0.4
v -1.4 0 0.4
v 0.6 0 -0.4
v 1.4 0 -0.4
v 1.4 0 0.4
v 0.6 0 0.4
g trunk
usemtl bark
f 1 2 3 4
g crown
usemtl leaf
f 5 6 7 8
";
const MTL: &str = "newmtl bark\nKd 0.4 0.2 0.1\nnewmtl leaf\nKd 0.1 0.5 0.1\n";

fn wait_for_view(session: &TestSession) -> std::sync::Arc<SceneView> {
    session.wait("a scene", |session| session.inner.scene_views.borrow().clone())
}

fn groups(object: &Object) -> Vec<&str> {
    object.groups.iter().map(|group| group.name.as_str()).collect()
}

#[track_caller]
fn line_number(text: &str, content: &str) -> usize {
    1 + text.lines().position(|line| line == content).unwrap()
}

fn set(session: &TestSession, path: &str, value: serde_json::Value) -> Option<String> {
    let executed = session.state().executed;
    session.inner.send(Command::Set(Set {
        path: path.to_owned(),
        value,
        gesture: None,
    }));
    session.wait("the end of the command", |session| {
        (session.state().executed > executed).then_some(())
    });
    let state = session.state();
    let notice = state.notice.clone().filter(|notice| notice.command == state.executed);
    notice.filter(|notice| notice.bad).map(|notice| notice.text)
}

#[test]
fn picking_an_instance_returns_its_lines_mesh_and_material() {
    let text = format!(
        "{SCENE_START}materials.red = {{ type = 'phong', color = [0.8, 0.1, 0.1] }}
materials.green = {{ type = 'phong', color = [0.1, 0.8, 0.1] }}

[meshes.tile]
file = 'tile.obj'

# the left instance
[[instances]]
mesh = 'tile'
material = 'red'
translate = [-1, 0, 0]

# shapes come before instances
[[shapes]]
type = 'sphere'
material = 'green'
center = [0, 0, 0]
radius = 0.3

# the right instance
[[instances]]
mesh = 'tile'
material = 'green'
translate = [1, 0, 0]
"
    );
    let files = Files::new(&text);
    files.write("tile.obj", TILE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let scene = wait_for_view(&session);
    for (pixel, name, comment, expected) in [
        (
            LEFT,
            "instances[0]",
            "# the left instance",
            ["materials.red", "meshes.tile"],
        ),
        (
            RIGHT,
            "instances[1]",
            "# the right instance",
            ["materials.green", "meshes.tile"],
        ),
    ] {
        let object = scene.at(pixel);
        assert_eq!((object.name.as_str(), &object.gone, &object.note), (name, &None, &None));
        assert_eq!(object.groups[0].line, line_number(&text, comment));
        let mut references = groups(&object).split_off(1);
        references.sort_unstable();
        assert_eq!(references, expected, "{object:?}");
    }
    assert_eq!(scene.at(MIDDLE).name, "shapes[0]");
    assert_eq!(scene.at([0, 0]).name, "render");
    let mesh = scene.object("meshes.tile", None);
    let file = mesh.groups[0].fields.iter().find(|field| field.name == "file").unwrap();
    assert!(file.fixed.is_some(), "a viewer can change which file is read");
    // The instance moves away from the pixel and is picked at its new position.
    assert_eq!(set(&session, "instances[1].translate", json!([1, 0, 0.9])), None);
    assert_eq!(
        files.read("scene.toml"),
        text.replace("translate = [1, 0, 0]", "translate = [1, 0, 0.9]")
    );
    session.wait_for_rendered_image(&files);
    let scene = wait_for_view(&session);
    assert_eq!(scene.at(RIGHT).name, "render");
    assert_eq!(scene.at([30, 6]).name, "instances[1]");
    // Absent keys are added. A scale may be a number or a list.
    assert_eq!(set(&session, "instances[0].scale", json!(0.5)), None);
    assert!(
        files
            .read("scene.toml")
            .contains("translate = [-1, 0, 0]\nscale = 0.5\n")
    );
    session.wait_for_rendered_image(&files);
    let message = set(&session, "instances[0].scale", json!(0)).unwrap();
    assert!(
        message.contains("instances[0].scale: 0 must be from 1e-6 to 1e6"),
        "{message}"
    );
    assert!(files.read("scene.toml").contains("scale = 0.5\n"));
}

#[test]
fn picking_a_mesh_returns_its_own_materials() {
    let text = format!(
        "{SCENE_START}[materials.leaf]
type = 'phong'
color = [0.1, 0.8, 0.1]

# a tree
[[shapes]]
type = 'mesh'
file = 'pair.obj'
materials = {{ leaf = 'leaf' }}
"
    );
    let files = Files::new(&text);
    files.write("pair.obj", PAIR);
    files.write("pair.mtl", MTL);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let scene = wait_for_view(&session);
    let trunk = scene.at(LEFT);
    assert_eq!((trunk.name.as_str(), &trunk.gone), ("shapes[0]", &None));
    assert_eq!(trunk.groups[0].line, line_number(&text, "# a tree"));
    assert_eq!(groups(&trunk), ["shapes[0]", "materials.leaf"]);
    let note = trunk.note.unwrap();
    assert!(note.contains("bark") && note.ends_with("is in another file"), "{note}");
    let crown = scene.at(RIGHT);
    assert_eq!(
        (crown.name.as_str(), crown.material.as_deref()),
        ("shapes[0]", Some("leaf"))
    );
    assert_eq!(
        (groups(&crown), &crown.note),
        (vec!["shapes[0]", "materials.leaf"], &None)
    );
    // Only materials of the scene can be assigned to a mesh; values in other files cannot be set.
    for (path, value, expected) in [
        (
            "shapes[0].materials.leaf",
            json!("bark"),
            "must be one of the allowed names",
        ),
        (
            "shapes[0].file",
            json!("other.obj"),
            "names and files can only be changed in the scene file",
        ),
        ("materials.bark.color", json!([1, 1, 1]), "cannot be changed"),
    ] {
        let message = set(&session, path, value).unwrap();
        assert!(message.contains(expected), "{path}: {message}");
        assert_eq!(files.read("scene.toml"), text);
    }
    assert_eq!(set(&session, "shapes[0].scale", json!(0.75)), None);
    session.wait_for_rendered_image(&files);
    assert_eq!(set(&session, "materials.leaf.color", json!([0.8, 0.8, 0.1])), None);
    session.wait_for_rendered_image(&files);
}

#[test]
fn picking_a_gltf_file_reports_that_it_is_read_only() {
    let files = Files::new("");
    Model::default().write_glb(files.folder.path(), "box.glb");
    let before = fs::read(files.path("box.glb")).unwrap();
    let sources = Sources {
        scene: files.path("box.glb"),
        overrides: Overrides {
            size: Some((24, 16)),
            pixel_samples: Some(1),
            ..Overrides::default()
        },
        shaders: None,
    };
    let session = TestSession::start(sources, None);
    session.wait_for_complete_image(0);
    let scene = wait_for_view(&session);
    let object = scene.at([12, 11]);
    assert_eq!((object.name.as_str(), object.groups.len()), ("shapes[0]", 0));
    let message = "glTF files are read-only here; run `wgray convert` for an editable scene";
    assert_eq!(object.gone.as_deref(), Some(message));
    for (name, _) in scene.objects("").objects {
        assert_eq!(scene.object(&name, None).gone.as_deref(), Some(message), "{name}");
    }
    for path in ["shapes[0].file", "camera.fov", "render.seed"] {
        let error = set(&session, path, json!(1)).unwrap();
        assert!(error.ends_with("run `wgray convert` for an editable scene"), "{error}");
    }
    assert_eq!(fs::read(files.path("box.glb")).unwrap(), before);
    assert_eq!(session.state().undo, None);
}

#[test]
fn objects_of_a_gltf_file_belong_to_the_shape_that_loads_it() {
    let files = Files::new(&format!(
        "{SCENE_START}materials.red = {{ type = 'phong', color = [0.8, 0.1, 0.1] }}
render.integrator = 'path'

[[shapes]]
type = 'sphere'
material = 'red'
center = [-1, 0, 0]
radius = 0.3

# the model
[[shapes]]
type = 'gltf'
file = 'box.glb'
scale = 0.4
translate = [1, 0, -0.2]
"
    ));
    Model::default().write_glb(files.folder.path(), "box.glb");
    let model = fs::read(files.path("box.glb")).unwrap();
    let text = files.read("scene.toml");
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let scene = wait_for_view(&session);
    assert_eq!(scene.at(LEFT).name, "shapes[0]");
    let object = scene.at(RIGHT);
    assert_eq!(
        (object.name.as_str(), groups(&object)),
        ("shapes[1]", vec!["shapes[1]"])
    );
    assert_eq!(object.groups[0].line, line_number(&text, "# the model"));
    assert_eq!(
        object.note.as_deref(),
        Some("The object is part of a glTF file, which is read-only here. Run `wgray convert` for an editable scene.")
    );
    assert_eq!(set(&session, "shapes[1].translate", json!([1, 0, 0.7])), None);
    session.wait_for_rendered_image(&files);
    assert_eq!(wait_for_view(&session).at(RIGHT).name, "render");
    assert_eq!(
        (files.read("scene.toml"), fs::read(files.path("box.glb")).unwrap()),
        (text.replace("-0.2]", "0.7]"), model)
    );
}
