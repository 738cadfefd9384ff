//! Tests of the errors of invalid text, and of the page `docs/scene-format.md`.

use std::path::Path;

use super::super::{
    Assets, CameraDescription, LightDescription, MaterialDescription, Overrides, Pattern, RenderDescription, Scene,
    ShapeDescription, TextureDescription,
};
use super::*;
use crate::description::tagged::Tagged;

const PAGE: &str = include_str!("../../../../docs/scene-format.md");

/// The start of a valid text.
const START: &str = "\
[image]
width = 4
height = 4
[camera]
position = [0, -3, 1]
look_at = [0, 0, 1]
fov = 45
";

fn message(text: &str) -> String {
    Scene::parse(text, "s.toml").unwrap_err().to_string()
}

#[test]
fn invalid_text_is_reported_with_its_line() {
    Scene::parse(START, "s.toml").unwrap();
    // The appended text, the line of the error in the appended text, and the message.
    for (added, line, rule) in [
        (
            "far = 3",
            1,
            "camera.far: unknown key; expected one of \"type\", \"position\", \"look_at\", \"up\", \"fov\", \"focal_length\", \"aperture\", \"f_number\", \"focus_distance\", \"blades\", \"blade_rotation\", \"path\"",
        ),
        (
            "[film]\n",
            1,
            "film: unknown key; expected one of \"image\", \"camera\", \"render\", \"environment\", \"textures\", \"materials\", \"lights\", \"shapes\", \"meshes\", \"instances\"",
        ),
        (
            "type = 'fisheye'",
            1,
            "camera.type: \"fisheye\" must be one of \"perspective\", \"orthographic\", \"panorama\"",
        ),
        (
            "type = 3",
            1,
            "camera.type: 3 must be one of \"perspective\", \"orthographic\", \"panorama\"",
        ),
        ("focal_length = '1'", 1, "camera.focal_length: \"1\" must be a number"),
        (
            "focal_length = 'a, expected b'",
            1,
            "camera.focal_length: \"a, expected b\" must be a number",
        ),
        ("up = [0, 1]", 1, "camera.up: [0, 1] must be a list of 3 numbers"),
        (
            "up = [0, 0, 1, 0]",
            1,
            "camera.up: [0, 0, 1, 0] must be a list with fewer elements",
        ),
        ("up = [0, 0, true]", 1, "camera.up[2]: true must be a number"),
        ("up = { z = 1 }", 1, "camera.up: { z = 1 } must be a list of 3 numbers"),
        (
            "[render]\nseed = -1",
            2,
            "render.seed: -1 must be a whole number from 0 to 4294967295",
        ),
        (
            "[render]\nseed = 1.5",
            2,
            "render.seed: 1.5 must be a whole number from 0 to 4294967295",
        ),
        (
            "[render]\nintegrator = 'paths'",
            2,
            "render.integrator: \"paths\" must be \"phong\" or \"path\"",
        ),
        (
            "[render]\nintegrator = 'path'\nmax_depth = -1",
            3,
            "render.max_depth: -1 must be a whole number from 0 to 1024",
        ),
        (
            "[render]\nrr_depth = 1.5",
            2,
            "render.rr_depth: 1.5 must be a whole number from 0 to 1024",
        ),
        ("[render]\nclamp = 'off'", 2, "render.clamp: \"off\" must be a number"),
        ("[render]\nalpha = 1", 2, "render.alpha: 1 must be true or false"),
        (
            "[environment]\nname = 'moon'",
            2,
            "environment.name: \"moon\" must be \"studio\" or \"sky\"",
        ),
        (
            "[environment]\nname = 3",
            2,
            "environment.name: 3 must be \"studio\" or \"sky\"",
        ),
        (
            "[environment]\nvisible = 1",
            2,
            "environment.visible: 1 must be true or false",
        ),
        (
            "[render]\nintegrator = ['path']",
            2,
            "render.integrator: [\"path\"] must be \"phong\" or \"path\"",
        ),
        (
            "[render]\npixel_samples = { pattern = 3, count = 4 }",
            2,
            "render.pixel_samples.pattern: 3 must be one of \"grid\", \"rotated_grid\", \"jittered\", \"random\", \
             \"halton\", \"sobol\"",
        ),
        (
            "[materials.a]\ntype = 'principled'\nalpha_mode = true",
            3,
            "materials.a.alpha_mode: true must be one of \"opaque\", \"mask\", \"blend\"",
        ),
        (
            "[materials.a]\ntype = 'principled'\nvertex_colors = 'all'",
            3,
            "materials.a.vertex_colors: \"all\" must be one of \"none\", \"base_color\", \"emission\"",
        ),
        (
            "[materials.a]\ntype = 'principled'\ndouble_sided = 1",
            3,
            "materials.a.double_sided: 1 must be true or false",
        ),
        (
            "[materials.a]\ntype = 'principled'\nalpha = { texture = 't', channel = 4 }",
            3,
            "materials.a.alpha.channel: 4 must be one of \"r\", \"g\", \"b\", \"a\"",
        ),
        (
            "blades = 2.5",
            1,
            "camera.blades: 2.5 must be 0 or a whole number from 3 to 16",
        ),
        (
            "[environment]\ncolor = 1",
            2,
            "environment.color: 1 must be a list of 3 numbers",
        ),
        (
            "[materials.a]\ntype = 'diffuse'\ncolor = [1, 1, 1]\nroughness = [1, 1, 1]",
            4,
            "materials.a.roughness: [1, 1, 1] must be a number or { texture = NAME }",
        ),
        (
            "[materials.a]\ntype = 'diffuse'\ncolor = [1, 1, 1]\nroughness = { file = 'a' }",
            4,
            "materials.a.roughness.file: unknown key; expected one of \"texture\", \"channel\"",
        ),
        ("[materials.a]\ntype = 'diffuse'", 1, "materials.a.color is missing"),
        ("[materials.a]\ntype = 'dielectric'", 1, "materials.a.ior is missing"),
        (
            "[materials.a]\ntype = 'mirror'\nemission = 1",
            3,
            "materials.a.emission: 1 must be a list of 3 numbers or { texture = NAME }",
        ),
        (
            "[render]\n\npixel_samples = { pattern = 'hex', count = 4 }",
            3,
            "render.pixel_samples.pattern: \"hex\" must be one of \"grid\", \"rotated_grid\", \"jittered\", \"random\", \
             \"halton\", \"sobol\"",
        ),
        (
            "[render]\npixel_samples = { pattern = 'grid' }",
            2,
            "render.pixel_samples.count is missing",
        ),
        (
            "[render]\n\nadaptive = [0.1]",
            3,
            "render.adaptive: [0.1] must be a table, such as { error = 0.01 }",
        ),
        (
            "[render]\npixel_samples = ['grid', 4]",
            2,
            "render.pixel_samples: [\"grid\", 4] must be a whole number from 1 to 65536, or a table such as { pattern = \"grid\", count = 16 }",
        ),
        (
            "path = ['linear', [[1]]]",
            1,
            "camera.path: [\"linear\", [[1]]] must be a table",
        ),
        (
            "path = { keys = [{ frame = 1, fov = 30 }, [2]] }",
            1,
            "camera.path.keys[1]: [2] must be a table",
        ),
        (
            "[environment]\nrotate = [[0, 0, 1], 90]",
            2,
            "environment.rotate: [[0, 0, 1], 90] must be a number of degrees, a list of 3 angles in degrees or a table such as { axis = [0, 0, 1], degrees = 90 }",
        ),
        (
            "[materials.a]\ntype = 'phong'\nnormal_map = ['b']",
            3,
            "materials.a.normal_map: [\"b\"] must be a table, such as { texture = \"NAME\" }",
        ),
        (
            "[materials.a]\ntype = 'phong'\nshininess = [['b']]",
            3,
            "materials.a.shininess: [[\"b\"]] must be a number",
        ),
        (
            "[render.light_samples]\ncount = 4\nn = 2",
            3,
            "render.light_samples.n: unknown key; expected one of \"pattern\", \"count\"",
        ),
        ("[materials]\nred = 3", 2, "materials.red: 3 must be a table"),
        (
            "[materials.red]\ncolor = [1, 0, 0]",
            1,
            "materials.red.type is missing; it must be one of \"phong\", \"mirror\", \"glass\", \"diffuse\", \"conductor\", \"dielectric\", \"principled\"",
        ),
        (
            "[materials.\"a b\"]\ntype = 'phong'\nshininess = 'x'",
            3,
            "materials.\"a b\".shininess: \"x\" must be a number",
        ),
        (
            "[lights]\ntype = 'point'",
            1,
            "lights: { type = \"point\" } must be a list of tables, each under its own [[header]]",
        ),
        (
            "[[shapes]]\ntype = 'sphere'\nmaterial = 'a'\ncenter = [0, 0, 0]\n",
            1,
            "shapes[0].radius is missing",
        ),
        (
            "[[lights]]\n[[lights]]",
            1,
            "lights[0].type is missing; it must be one of \"rectangle\", \"point\", \"directional\", \"spot\"",
        ),
        (
            "[[lights]]\ntype = 'directional'\ndirection = [0, 0, 1]\ncolor = [1, 1, 1]\n[[lights]]\ntype = 'point'\nvertex = 3",
            7,
            "lights[1].vertex: unknown key; expected one of \"type\", \"position\", \"color\"",
        ),
        (
            "[[shapes]]\ntype = 'triangle'\nmaterial = 'a'\nvertices = [\n[0, 0, 0],\n[1, 'x', 0],\n[0, 1, 0]]",
            6,
            "shapes[0].vertices[1][1]: \"x\" must be a number",
        ),
        (
            "[[shapes]]\ntype = 'triangle'\nmaterial = 'a'\nvertices = [[0, 0, 0], [1, 0, 0]]",
            4,
            "shapes[0].vertices: [[0, 0, 0], [1, 0, 0]] must be a list of 3 points",
        ),
    ] {
        let line = START.lines().count() + line;
        let found = message(&format!("{START}{added}"));
        assert_eq!(found.lines().next(), Some(&*format!("s.toml:{line}: {rule}")));
    }
}

#[test]
fn missing_keys_are_reported_at_their_table() {
    assert_eq!(message(""), "s.toml:1: the scene has no [image] table");
    assert_eq!(
        message(&START.replace("fov = 45", "")),
        "s.toml:4: camera.fov is missing"
    );
    assert_eq!(message("image = 3"), "s.toml:1: image: 3 must be a table");
    assert_eq!(message("image = [4, 4]"), "s.toml:1: image: [4, 4] must be a table");
}

#[test]
fn invalid_toml_is_reported_with_line_and_column() {
    for (added, rule) in [
        ("é = 3", "8:1: "),
        ("up = [0, 1", "8:11: "),
        ("fov = 46", "8:1: duplicate key: fov = 46"),
        ("focal_length = ", "8:16: "),
        ("focal_length = 1e999", "8:16: "),
    ] {
        let message = message(&format!("{START}{added}"));
        assert!(message.starts_with(&format!("s.toml:{rule}")), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[test]
fn truncated_scenes_do_not_panic() {
    let text = include_str!("../../../../scenes/cornell.toml");
    let is_valid = |end: usize| Scene::parse(&text[..end], "s.toml").is_ok();
    let count = (0..text.len())
        .filter(|&end| text.is_char_boundary(end) && is_valid(end))
        .count();
    assert!(count > 0 && count < text.len());
}

#[test]
fn a_serialized_scene_parses_to_the_same_description() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let description = Description::parse(&text, "s.toml").unwrap();
        let written = toml::to_string(&description).unwrap();
        assert_eq!(
            Description::parse(&written, "s.toml").unwrap(),
            description,
            "{}",
            path.display()
        );
        description.validate_with(&Assets::beside(Path::new(folder))).unwrap();
        assert!(
            text.starts_with("# "),
            "{}: the first line must describe the scene",
            path.display()
        );
        count += 1;
    }
    assert!(count >= 4);
}

#[test]
fn the_example_of_the_page_is_a_scene() {
    let example = PAGE.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let scene = Scene::parse(example, "scene-format.md").unwrap();
    assert_eq!(scene.shapes.len(), 1);
}

/// Returns a section of the page, without its subsections.
fn section(heading: &str) -> &'static str {
    let (_, rest) = PAGE
        .split_once(&format!("\n{heading}\n"))
        .unwrap_or_else(|| panic!("no {heading}"));
    rest.split("\n#").next().unwrap()
}

/// Returns the names in the first column of a section's tables, with their quotes.
fn rows(heading: &str) -> Vec<&'static str> {
    let lines = section(heading).lines();
    let names = lines.filter_map(|line| Some(line.strip_prefix("| `")?.split_once('`')?.0));
    names.collect()
}

/// Checks that the rows of a section of the page are the keys that are allowed at the end of the text, except `type`
/// and the keys that have a row under `shared`. The allowed keys are taken from the error message for an unknown key.
fn check_keys(text: &str, heading: &str, shared: Option<&str>) {
    let message = message(&format!("{text}\n'?' = 1"));
    let (_, keys) = message
        .split_once("expected one of ")
        .unwrap_or_else(|| panic!("{message}"));
    let mut keys: Vec<_> = keys.split(", ").map(|key| key.trim_matches('"')).collect();
    let mut rows = rows(heading);
    rows.retain(|name| !name.starts_with('"'));
    let shared_rows = shared.map_or_else(Vec::new, self::rows);
    keys.retain(|key| *key != "type" && (rows.contains(key) || !shared_rows.contains(key)));
    keys.sort_unstable();
    rows.sort_unstable();
    assert_eq!(rows, keys, "under {heading}");
}

fn check_types<T: Tagged>(before: &str, header: &str, title: &str, shared: Option<&str>) {
    for tag in T::TYPES {
        let text = format!("{before}\n{header}\ntype = '{tag}'");
        check_keys(&text, &format!("### `{title}` of type `\"{tag}\"`"), shared);
    }
}

#[test]
fn the_page_has_every_key() {
    let image = "[image]\nwidth = 1\nheight = 1";
    let check = |text: &str, heading: &str| check_keys(text, heading, None);
    check("[camera]\n[image]", "## `[image]`");
    check(&format!("{START}[render]"), "## `[render]`");
    check(&format!("{START}[render.pixel_samples]"), "### Samples");
    check(&format!("{START}[environment]"), "## `[environment]`");
    let camera = Some("### Keys of all cameras");
    check_types::<CameraDescription>(image, "[camera]", "[camera]", camera);
    check(&format!("{START}[camera.path]"), "### The camera's path");
    check(&format!("{START}[[camera.path.keys]]"), "### Keys of the path");
    let texture = Some("### Keys of several textures");
    check_types::<TextureDescription>(START, "[textures.a]", "[textures.NAME]", texture);
    let material = Some("### Keys of all materials");
    check_types::<MaterialDescription>(START, "[materials.a]", "[materials.NAME]", material);
    check_types::<LightDescription>(START, "[[lights]]", "[[lights]]", None);
    let several = Some("### Keys of several shapes");
    check_types::<ShapeDescription>(START, "[[shapes]]", "[[shapes]]", several);
    check(&format!("{START}[meshes.a]"), "## `[meshes.NAME]`");
    check_keys(&format!("{START}[[instances]]"), "## `[[instances]]`", several);
}

#[test]
fn the_page_has_the_defaults_of_the_render_settings() {
    let lines = section("## `[render]`").lines();
    let rows = lines.filter_map(|line| {
        let mut cells = line.strip_prefix("| `")?.split(" | ");
        let key = cells.next()?.split('`').next()?;
        Some(format!("{key} = {}\n", cells.nth(1)?.replace('`', "")))
    });
    // Other defaults are described in words.
    let rows = rows.filter(|line| line.parse::<toml::Table>().is_ok());
    // In the default description, these keys have no value.
    let (optional_keys, other_keys): (Vec<_>, Vec<_>) =
        rows.partition(|line| ["rr_depth", "alpha", "denoise"].contains(&line.split(' ').next().unwrap_or_default()));
    assert_eq!(
        (optional_keys.len(), other_keys.len()),
        (3, 10),
        "{optional_keys:?} {other_keys:?}"
    );
    let written: RenderDescription = toml::from_str(&other_keys.concat()).unwrap();
    assert_eq!(written, RenderDescription::default());
    let scene = |lines: &str| {
        let text = format!("{START}[render]\nintegrator = 'path'\n{lines}");
        Scene::parse(&text, "s.toml").unwrap()
    };
    assert_eq!(scene(&optional_keys.concat()).render, scene("").render);
}

#[test]
fn the_page_has_every_pattern() {
    let message = message(&format!(
        "{START}[render]\nlight_samples = {{ count = 1, pattern = '?' }}"
    ));
    let (_, names) = message.split_once("must be ").unwrap();
    let names: Vec<_> = names.split('"').skip(1).step_by(2).collect();
    let mut rows = rows("### Samples");
    rows.retain(|name| name.starts_with('"'));
    let rows: Vec<_> = rows.into_iter().map(|name| name.trim_matches('"')).collect();
    assert_eq!(rows, names);
}

#[test]
#[should_panic(expected = "under ## `[image]`")]
fn a_key_that_is_missing_in_the_page_is_found() {
    check_keys(&format!("{START}[render]"), "## `[image]`", None);
}

#[test]
fn sample_counts_can_be_numbers_or_tables() {
    let scene = |render: &str| {
        let text = format!(
            "image = {{ width = 4, height = 4 }}\ncamera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}\n\
             [render]\n{render}"
        );
        Scene::parse(&text, "s.toml").map_err(|error| error.to_string())
    };
    assert_eq!(
        scene("pixel_samples = 36\nlight_samples = 4").unwrap().render,
        scene("pixel_samples = { count = 36 }\nlight_samples = { count = 4 }")
            .unwrap()
            .render
    );
    for (line, rule) in [
        (
            "pixel_samples = 0",
            "s.toml:4: render.pixel_samples.count: 0 must be from 1 to 65536",
        ),
        (
            "pixel_samples = 1.5",
            "s.toml:4: render.pixel_samples: 1.5 must be a whole number from 1 to 65536, or a table such as {",
        ),
        (
            "pixel_samples = -4",
            "s.toml:4: render.pixel_samples: -4 must be a whole number from 1 to 65536, or a table such as {",
        ),
        (
            "pixel_samples = 4294967296",
            "s.toml:4: render.pixel_samples: 4294967296 must be a whole number from 1 to 65536, or a",
        ),
        (
            "pixel_samples = '9'",
            "s.toml:4: render.pixel_samples: \"9\" must be a whole number from 1 to 65536, or a table such as {",
        ),
        (
            "pixel_samples = [4]",
            "s.toml:4: render.pixel_samples: [4] must be a whole number from 1 to 65536, or a table such as {",
        ),
        (
            "pixel_samples = { count = 4, pattxrn = 'grid' }",
            "s.toml:4: render.pixel_samples.pattxrn: unknown key; did you",
        ),
    ] {
        let message = scene(line).unwrap_err();
        assert!(message.starts_with(rule), "{message}\n{rule}");
    }
    let samples_with = |define: &str| {
        let overrides = Overrides {
            define: vec![define.parse().unwrap()],
            ..Overrides::default()
        };
        let text = "image = { width = 4, height = 4 }\ncamera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }\n\
                    render.pixel_samples = 36";
        let samples = Scene::parse_with(text, "s.toml", &overrides)
            .unwrap()
            .render
            .pixel_samples;
        (samples.pattern, samples.count)
    };
    assert_eq!(samples_with("render.pixel_samples.count=4"), (Pattern::Grid, 4));
    assert_eq!(
        samples_with("render.pixel_samples.pattern=halton"),
        (Pattern::Halton, 36)
    );
    assert_eq!(samples_with("render.pixel_samples=9"), (Pattern::Grid, 9));
}

#[test]
fn default_tangents_are_along_x_or_y() {
    let scene = |normal: &str, tangent: &str| {
        let text = format!(
            "image = {{ width = 4, height = 4 }}\ncamera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}\n\
             materials.m = {{ type = 'mirror' }}\n\
             [[shapes]]\ntype = 'plane'\nmaterial = 'm'\npoint = [0, 0, 0]\nnormal = {normal}\n{tangent}\n\
             [[shapes]]\ntype = 'rectangle'\nmaterial = 'm'\ncenter = [0, 0, 0]\nsize = [1, 2]\nnormal = {normal}\n{tangent}\n\
             [[shapes]]\ntype = 'disk'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\nnormal = {normal}\n{tangent}\n\
             [[lights]]\ntype = 'rectangle'\ncenter = [0, 0, 3]\nsize = [1, 2]\ncolor = [1, 1, 1]\nnormal = {normal}\n{tangent}\n"
        );
        Scene::parse(&text, "s.toml").unwrap()
    };
    for (normal, tangent) in [
        ("[0, 0, 1]", "[1, 0, 0]"),
        ("[0.5, 1, 2]", "[1, 0, 0]"),
        ("[-1, 0, 0]", "[0, 1, 0]"),
        ("[1, 0.1, 0.2]", "[0, 1, 0]"),
    ] {
        assert_eq!(
            scene(normal, ""),
            scene(normal, &format!("tangent = {tangent}")),
            "{normal}"
        );
    }
    assert_ne!(scene("[0, 0, 1]", ""), scene("[0, 0, 1]", "tangent = [0, 1, 0]"));
}

#[test]
fn misspelled_names_get_suggestions() {
    let error_of = |extra: &str| {
        let text = format!(
            "image = {{ width = 4, height = 4 }}\ncamera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}\n\
             materials.yellow = {{ type = 'mirror' }}\n{extra}"
        );
        Scene::parse(&text, "s.toml").unwrap_err().to_string()
    };
    for (extra, message) in [
        (
            "materials.b = { type = 'mirror', tnt = [1, 1, 1] }",
            "s.toml:4: materials.b.tnt: unknown key; did you mean \"tint\"?",
        ),
        ("rendr = 3", "s.toml:4: rendr: unknown key; did you mean \"render\"?"),
        (
            "shapes = [{ type = 'sphere', material = 'yellwo', center = [0, 0, 0], radius = 1 }]",
            "s.toml:4: shapes[0].material: there is no material \"yellwo\"; did you mean \"yellow\"?",
        ),
    ] {
        assert_eq!(error_of(extra), message);
    }
    let message = error_of("shapes = [{ type = 'spher' }]");
    assert!(message.ends_with("\"gltf\"; did you mean \"sphere\"?"), "{message}");
}
