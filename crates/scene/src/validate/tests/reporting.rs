//! Tests of the number, order and text of reported errors.

use super::*;

fn errors(text: &str) -> Vec<String> {
    let error = Scene::parse(text, "s.toml").unwrap_err().to_string();
    error.lines().map(str::to_owned).collect()
}

const SMALL: &str = "\
image = { width = 4, height = 4 }
camera = { position = [0, -4, 1], look_at = [0, 0, 1], fov = 40 }
";

#[test]
fn all_invalid_values_are_reported_in_the_order_of_the_lines() {
    let text = "\
[materials.z]
type = 'phong'
color = [1, 1, 1]
shininess = -1
[materials.a]
type = 'mirror'
tint = [2, 1, 1]
[[shapes]]
type = 'sphere'
material = 'z'
center = [0, 0, 0]
radius = -3
[[shapes]]
type = 'sphere'
material = 'b'
center = [0, 0, 0]
radius = 1
[[lights]]
type = 'point'
position = [0, 0, 2e9]
color = [1, 1, 1]
[environment]
color = [1, 1, -1]
[textures.t]
type = 'constant'
color = [-1, 0, 0]
[meshes.m]
file = 'none.obj'
[[instances]]
mesh = 'n'
material = 'z'
[render]
max_depth = 70000
clamp = -1
pixel_samples = 0
adaptive = { error = 2 }
filter = { type = 'box', radius = -1 }
[image]
width = 0
height = 70000
exposure = 300
[camera]
position = [0, 0, 2e9]
look_at = [0, 0, 1]
up = [0, 0, 0]
fov = 190
blades = 1
";
    let found = errors(text);
    let locations: Vec<_> = found.iter().map(|line| line.rsplitn(2, ": ").last().unwrap()).collect();
    let expected = [
        "4: materials.z.shininess",
        "7: materials.a.tint",
        "12: shapes[0].radius",
        "15: shapes[1].material",
        "20: lights[0].position",
        "23: environment.color",
        "26: textures.t.color",
        "28: meshes.m.file",
        "30: instances[0].mesh",
        "33: render.max_depth",
        "34: render.clamp",
        "35: render.pixel_samples.count",
        "37: render.filter.radius",
        "39: image.width",
        "40: image.height",
        "41: image.exposure",
        "43: camera.position",
        "45: camera.up",
        "46: camera.fov",
        "47: camera.blades",
    ];
    let locations: Vec<_> = locations
        .iter()
        .map(|location| location.split(": ").take(2).collect::<Vec<_>>().join(": "))
        .collect();
    assert_eq!(
        locations,
        expected.map(|location| format!("s.toml:{location}")),
        "{found:#?}"
    );
    // `adaptive` is validated after `pixel_samples`.
    let found = errors(&text.replace("pixel_samples = 0", "pixel_samples = 9"));
    assert!(
        found
            .iter()
            .any(|line| line.contains("render.adaptive.error: 2 must be")),
        "{found:#?}"
    );
}

#[test]
fn invalid_keys_and_types_of_all_entries_are_reported() {
    let text = "\
[image]
width = 4
heightt = 4
[camera]
fovv = 40
[render]
seed = 'x'
[[shapes]]
type = 'sphere'
radiuss = 1
[[shapes]]
type = 'spheree'
[materials.a]
color = [1, 1, 1]
[[lights]]
type = 'point'
position = [0, 0]
color = [1, 1, 1]
";
    let expected = [
        "s.toml:3: image.heightt: unknown key; did you mean \"height\"?",
        "s.toml:5: camera.fovv: unknown key; did you mean \"fov\"?",
        "s.toml:7: render.seed: \"x\" must be a whole number from 0 to 4294967295",
        "s.toml:10: shapes[0].radiuss: unknown key; did you mean \"radius\"?",
        "s.toml:12: shapes[1].type: \"spheree\" must be one of",
        "s.toml:13: materials.a.type is missing",
        "s.toml:17: lights[0].position: [0, 0] must be a list of 3 numbers",
    ];
    let found = errors(text);
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.starts_with(expected), "{found}\n{expected}");
    }
    // Without headers, the file is parsed as a whole.
    let text = format!("{SMALL}shapes = [{{ type = 'a' }}, {{ type = 'sphere', radiuss = 1 }}]\n[render]\nseeds = 3\n");
    assert_eq!(errors(&text).len(), 3);
}

#[test]
fn an_error_is_reported_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("a.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    let origin = folder.path().join("s.toml").display().to_string();
    let image = "type = 'image'\nfile = 'none.png'\n";
    let uses = "\
[materials.m]
type = 'principled'
base_color = { texture = 't' }
roughness = { texture = 't', channel = 'a' }
normal_map = { texture = 't' }
emission = { texture = 't' }
[[shapes]]
type = 'plane'
material = 'm'
point = [0, 0, 0]
normal = [0, 0, 1]
[[shapes]]
type = 'triangle'
material = 'm'
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
[[shapes]]
type = 'mesh'
file = 'a.obj'
material = 'm'
";
    let count = |text: &str| match Scene::parse(&format!("{SMALL}{text}"), &origin) {
        Ok(_) => 0,
        Err(error) => {
            assert!(
                matches!(error.each(), ([SceneError::Invalid { .. }, ..], None)),
                "{error}"
            );
            error.to_string().lines().count()
        }
    };
    // The image is missing, or the description of the image is invalid; materials and shapes are valid.
    let texture = |extra: &str| format!("[textures.t]\n{image}{extra}\n{uses}");
    assert_eq!(count(&texture("")), 0, "a missing image is only a warning");
    assert_eq!(count(&texture("max_anisotropy = 99")), 1);
    assert_eq!(count(&format!("{}\n[render]\nmax_depth = 9999999", texture(""))), 1);
    assert_eq!(
        count(&format!(
            "{}\n[render]\nmax_depth = 9999999",
            texture("max_anisotropy = 99")
        )),
        2
    );
    let material = uses.replace("type = 'principled'\n", "type = 'principled'\nmetallic = 3\n");
    assert_eq!(
        count(&format!(
            "[textures.t]\ntype = 'constant'\ncolor = [1, 1, 1]\n{material}"
        )),
        1
    );
    let mesh = "[meshes.n]\nfile = 'none.obj'\n[[instances]]\nmesh = 'n'\n";
    assert_eq!(count(mesh), 1);
    assert_eq!(count(&mesh.replace("none.obj", "a.obj")), 0);
    assert_eq!(count(&format!("{mesh}scale = 0\n")), 2);
    assert_eq!(count(&format!("{mesh}material = 'none'\n")), 2);
    let gltf = "[[shapes]]\ntype = 'gltf'\nfile = 'none.glb'\n";
    assert_eq!(
        count(&format!("{gltf}[materials.m]\ntype = 'mirror'\ntint = [2, 2, 2]\n")),
        2
    );
    assert_eq!(
        count(&format!("{gltf}scale = 0\n[environment]\ncolor = [-1, 0, 0]\n")),
        2
    );
}

/// Tests that a typo is reported before gigabytes are read.
#[test]
fn files_are_not_read_for_a_scene_with_invalid_settings() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "a.obj", "a.glb", "a.hdr"] {
        std::fs::write(folder.path().join(name), "broken").unwrap();
    }
    let text = format!(
        "{SMALL}textures.t = {{ type = 'image', file = 'a.png' }}\nmeshes.m = {{ file = 'a.obj' }}\n\
         shapes = [{{ type = 'mesh', file = 'a.obj' }}, {{ type = 'gltf', file = 'a.glb' }}]\nenvironment.file = 'a.hdr'\n"
    );
    let origin = folder.path().join("s.toml").display().to_string();
    let count = |text: &str| Scene::parse(text, &origin).unwrap_err().to_string().lines().count();
    assert_eq!(count(&text.replace("fov = 40", "fov = 400")), 1);
    // A missing file is also reported, although no file is read.
    assert_eq!(
        count(&text.replace("fov = 40", "fov = 400").replace("a.hdr", "b.hdr")),
        2
    );
    assert!(
        count(&text.replace("{ type = 'gltf', file = 'a.glb' }", "")) > 2,
        "the files of a scene with valid settings must be read"
    );
}

#[test]
fn all_invalid_keys_of_a_table_are_reported() {
    let text = "\
[render]
seed = -5
max_depth = 'deep'
colour = 1
pixel_samples = -3
[[shapes]]
type = 'sphere'
size = 3
center = [0, 0]
material = 7
radius = 1
";
    assert_eq!(
        errors(&format!("{SMALL}{text}")),
        [
            "s.toml:4: render.seed: -5 must be a whole number from 0 to 4294967295",
            "s.toml:5: render.max_depth: \"deep\" must be a whole number from 1 to 64",
            "s.toml:6: render.colour: unknown key; expected one of \"integrator\", \"ambient\", \"background\", \"shadow_epsilon\", \
             \"shadows\", \"max_depth\", \"rr_depth\", \"clamp\", \"alpha\", \"ray_differentials\", \"seed\", \"pixel_samples\", \
             \"light_samples\", \"filter\", \"adaptive\", \"denoise\"",
            "s.toml:7: render.pixel_samples: -3 must be a whole number from 1 to 65536, or a table such as { pattern = \"grid\", count = 16 }",
            "s.toml:10: shapes[0].size: unknown key; expected one of \"type\", \"material\", \"center\", \"radius\"",
            "s.toml:11: shapes[0].center: [0, 0] must be a list of 3 numbers",
            "s.toml:12: shapes[0].material: 7 must be a string",
        ]
    );
    // All invalid keys are also reported if the file has an unknown section.
    let found = errors(&format!("{SMALL}{text}[shape]\n[environment]\nrotate = 'x'\n"));
    assert_eq!(found.len(), 9, "{found:#?}");
    assert_eq!(found[7], "s.toml:14: shape: unknown key; did you mean \"shapes\"?");
    // A missing key is not reported if a misspelled key may stand for the missing key.
    assert_eq!(
        errors(&format!(
            "{SMALL}[[shapes]]\ntype = 'sphere'\ncentre = [0, 0, 0]\nradius = 'x'\nmaterial = 'm'\n"
        )),
        [
            "s.toml:5: shapes[0].centre: unknown key; did you mean \"center\"?",
            "s.toml:6: shapes[0].radius: \"x\" must be a number",
        ]
    );
}

#[test]
fn only_the_first_20_errors_are_reported() {
    let shape = "[[shapes]]\ntype = 'sphere'\nmaterial = 'none'\ncenter = [0, 0, 0]\nradius = 1\n";
    for (count, expected_more) in [
        (20, None),
        (21, Some("and 1 more error")),
        (300, Some("and 280 more errors")),
    ] {
        let error = Scene::parse(&format!("{SMALL}{}", shape.repeat(count)), "s.toml").unwrap_err();
        let (errors, more) = error.each();
        assert_eq!((errors.len(), more.as_deref()), (20, expected_more));
        assert_eq!(errors[19].place().key.as_deref(), Some("shapes[19].material"));
    }
    let light = "[[lights]]\ntype = 'point'\nposition = [0, 0, 0]\ncolor = [-1, 0, 0]\n";
    let [lights, shapes] = [light.repeat(15), shape.repeat(15)];
    for (text, key) in [
        (format!("{SMALL}{lights}{shapes}"), "lights[0].color"),
        (format!("{SMALL}{shapes}{lights}"), "shapes[0].material"),
    ] {
        let error = Scene::parse(&text, "s.toml").unwrap_err();
        let (errors, more) = error.each();
        assert_eq!((errors.len(), more.as_deref()), (20, Some("and 10 more errors")));
        assert_eq!(error.place().key.as_deref(), Some(key));
    }
    // The search for suggestions is limited: for all errors, the search would take minutes.
    let materials = (0..50_000)
        .map(|i| format!("m{i}.type = 'mirror'\n"))
        .collect::<String>();
    let unknown = (0..50_000)
        .map(|i| shape.replace("none", &format!("n{i}")))
        .collect::<String>();
    let error = Scene::parse(&format!("{SMALL}[materials]\n{materials}{unknown}"), "s.toml").unwrap_err();
    let (errors, more) = error.each();
    assert_eq!(more.as_deref(), Some("and 49980 more errors"));
    assert!(
        errors[0]
            .to_string()
            .ends_with("there is no material \"n0\"; did you mean \"m0\"?"),
        "{}",
        errors[0]
    );
    let error = Scene::parse(&format!("{SMALL}{}", "[[lights]]\nx = 1\n".repeat(5000)), "s.toml").unwrap_err();
    assert_eq!(error.to_string().lines().last(), Some("and 4980 more errors"));
}

#[test]
fn an_invalid_define_is_the_only_reported_error() {
    let overrides = crate::Overrides {
        define: vec!["camera.fov=190".parse().unwrap()],
        ..Default::default()
    };
    let text = format!("{SMALL}[render]\nmax_depth = 9999999\n");
    let error = Scene::parse_with(&text, "s.toml", &overrides).unwrap_err();
    assert!(matches!(error, SceneError::Override(_)), "{error}");
    assert_eq!(
        error.to_string(),
        "define.camera.fov: 190 must be from 0.001 to 179.999"
    );
}
