use super::*;

/// Sets a value, or removes the key if `value` is "none".
fn set(text: &str, path: &str, value: &str) -> Result<String, String> {
    let value = (value != "none").then(|| {
        let mut table: toml::Table = toml::from_str(&format!("value = {value}")).unwrap();
        table.remove("value").unwrap()
    });
    edited(text, &path.parse().unwrap(), value.as_ref())
}

/// Text, key, value, expected text. Each case is also tested with DOS line endings and a byte-order mark.
const CHANGES: [(&str, &str, &str, &str); 36] = [
    // Existing values.
    (
        "[camera] # c\nfov=45   # degrees\n",
        "camera.fov",
        "50.5",
        "[camera] # c\nfov=50.5   # degrees\n",
    ),
    ("[camera]\nfov = 45.0\n", "camera.fov", "45", "[camera]\nfov = 45.0\n"),
    ("[camera]\nfov = 45\n", "camera.fov", "45.0", "[camera]\nfov = 45\n"),
    (
        "[camera]\nposition = [ 0,  -3.0, # back\n 1.3 ]\n",
        "camera.position",
        "[0.0, -2.0, 1.25]",
        "[camera]\nposition = [ 0,  -2, # back\n 1.25 ]\n",
    ),
    (
        "materials = { red = { color = [1, 0, 0] } } # m\n",
        "materials.red.color",
        "[1.0, 0.5, 0.0]",
        "materials = { red = { color = [1, 0.5, 0] } } # m\n",
    ),
    (
        "materials.\"dark red\".ior = 1 # d\n",
        "materials.'dark red'.ior",
        "2",
        "materials.\"dark red\".ior = 2 # d\n",
    ),
    (
        "[[shapes]]\nradius = 1\n\n# the second\n[[shapes]]\nradius = 1 # b\n",
        "shapes[1].radius",
        "0.25",
        "[[shapes]]\nradius = 1\n\n# the second\n[[shapes]]\nradius = 0.25 # b\n",
    ),
    (
        "shapes = [\n  { radius = 1 }, # a\n  { radius = 1 }, # b\n]\n",
        "shapes[1].radius",
        "0.25",
        "shapes = [\n  { radius = 1 }, # a\n  { radius = 0.25 }, # b\n]\n",
    ),
    ("[m]\na = 'one' # a\n", "m.a", "\"two\"", "[m]\na = \"two\" # a\n"),
    ("[m]\na = true # a\n", "m.a", "false", "[m]\na = false # a\n"),
    (
        "[m]\na = [[0, 0], [1, 0]]\n",
        "m.a[1]",
        "[1, 2]",
        "[m]\na = [[0, 0], [1, 2]]\n",
    ),
    (
        "[m]\na = { texture = 't' } # a\n",
        "m.a",
        "[1, 2, 3]",
        "[m]\na = [1, 2, 3] # a\n",
    ),
    // Missing keys.
    (
        "[camera]\nfov = 45 # c\n\n[render]\n",
        "camera.up",
        "[0, 1, 0]",
        "[camera]\nfov = 45 # c\nup = [0, 1, 0]\n\n[render]\n",
    ),
    (
        "  [camera]\n\tfov = 45\n",
        "camera.a",
        "1",
        "  [camera]\n\tfov = 45\n\ta = 1\n",
    ),
    ("[camera]\nfov = 45", "camera.a", "1", "[camera]\nfov = 45\na = 1"),
    (
        "[camera] # c\n[render]\nseed = 1\n",
        "camera.a",
        "1",
        "[camera] # c\na = 1\n[render]\nseed = 1\n",
    ),
    (
        "camera = { fov = 45 } # c\n",
        "camera.a",
        "1",
        "camera = { fov = 45, a = 1 } # c\n",
    ),
    (
        "camera = {\n  fov = 45, # f\n}\n",
        "camera.a",
        "1",
        "camera = {\n  fov = 45, a = 1, # f\n}\n",
    ),
    ("camera = {}\n", "camera.a", "1", "camera = { a = 1 }\n"),
    (
        "camera.fov = 45 # c\nimage.width = 4\n",
        "camera.a",
        "1",
        "camera.fov = 45 # c\ncamera.a = 1\nimage.width = 4\n",
    ),
    (
        "[render]\nfilter.type = 'box'\nseed = 1\n",
        "render.filter.radius",
        "2",
        "[render]\nfilter.type = 'box'\nfilter.radius = 2\nseed = 1\n",
    ),
    (
        "render = { filter.type = 'box', seed = 1 }\n",
        "render.filter.radius",
        "2",
        "render = { filter.type = 'box', filter.radius = 2, seed = 1 }\n",
    ),
    (
        "[render]\nseed = 1\n",
        "render.adaptive.error",
        "0.5",
        "[render]\nseed = 1\nadaptive = { error = 0.5 }\n",
    ),
    (
        "[render.filter]\ntype = 'box'\n",
        "render.seed",
        "1",
        "[render]\nseed = 1\n\n[render.filter]\ntype = 'box'\n",
    ),
    (
        "[render]\nseed = 1\n[render.filter]\ntype = 'box' # f\n",
        "render.a",
        "2",
        "[render]\nseed = 1\na = 2\n[render.filter]\ntype = 'box' # f\n",
    ),
    (
        "[[shapes]]\nradius = 1 # a\n\n# the second\n[[shapes]]\nradius = 1 # b\n\n[materials.m]\n",
        "shapes[1].a",
        "2",
        "[[shapes]]\nradius = 1 # a\n\n# the second\n[[shapes]]\nradius = 1 # b\na = 2\n\n[materials.m]\n",
    ),
    (
        "# top\n[image]\nwidth = 4\n[camera]\nfov = 45 # f\n[camera.path]\na = 1 # p\n\n# shapes\n[[shapes]]\n",
        "render.seed",
        "3",
        "# top\n[image]\nwidth = 4\n[camera]\nfov = 45 # f\n[camera.path]\na = 1 # p\n\n[render]\nseed = 3\n\n# shapes\n[[shapes]]\n",
    ),
    (
        "[camera]\nfov = 45\n[[shapes]]\n",
        "render.adaptive.error",
        "0.5",
        "[camera]\nfov = 45\n\n[render]\nadaptive = { error = 0.5 }\n[[shapes]]\n",
    ),
    (
        "image = { width = 4 }\ncamera.fov = 45\n[[shapes]]\n",
        "render.seed",
        "3",
        "image = { width = 4 }\ncamera.fov = 45\nrender = { seed = 3 }\n[[shapes]]\n",
    ),
    // Removed keys.
    (
        "[camera]\nfov = 45\na = 1\nb = 2\n",
        "camera.a",
        "none",
        "[camera]\nfov = 45\nb = 2\n",
    ),
    (
        "[camera]\nfov = 45\na = 1 # why\nb = 2\n",
        "camera.a",
        "none",
        "[camera]\nfov = 45\n# why\nb = 2\n",
    ),
    (
        "[camera]\na = [\n 1, # one\n]\nb = 2\n",
        "camera.a",
        "none",
        "[camera]\nb = 2\n",
    ),
    (
        "camera = { a = 1, b = 2 }\n",
        "camera.a",
        "none",
        "camera = { b = 2 }\n",
    ),
    (
        "camera = { a = 1, b = 2 }\n",
        "camera.b",
        "none",
        "camera = { a = 1 }\n",
    ),
    (
        "[render]\nseed = 1\nadaptive = { error = 0.5 }\n",
        "render.adaptive.error",
        "none",
        "[render]\nseed = 1\n",
    ),
    (
        "[render]\nseed = 1\n",
        "render.adaptive.error",
        "none",
        "[render]\nseed = 1\n",
    ),
];

#[test]
fn only_the_bytes_of_a_value_change() {
    let dos = |text: &str| format!("\u{feff}{}", text.replace('\n', "\r\n"));
    for (text, path, value, expected) in CHANGES {
        toml::from_str::<toml::Table>(expected).unwrap();
        assert_eq!(set(text, path, value).as_deref(), Ok(expected), "{text}{path}");
        let with_dos_endings = set(&dos(text), path, value).unwrap();
        assert_eq!(with_dos_endings, dos(expected), "{path}");
        assert_eq!(set(expected, path, value).as_deref(), Ok(expected));
    }
}

#[test]
fn values_without_a_location_in_the_file_are_rejected() {
    for (text, path, value, message) in [
        (
            "[camera]\nfov = 45\n",
            "camera.fov.a",
            "1",
            "does not belong to a table",
        ),
        (
            "[[shapes]]\nradius = 1\n",
            "shapes[1].radius",
            "1",
            "is not in the scene",
        ),
        ("[render.filter]\ntype = 'box'\n", "render.filter", "1", "is a table"),
        (
            "[m]\na = [1, 2]\n",
            "m.a[1]",
            "none",
            "can only be removed in the scene file",
        ),
        ("[m\n", "m.a", "1", "m.a: "),
    ] {
        let error = set(text, path, value).unwrap_err();
        assert!(error.contains(message) && error.starts_with(path), "{error}");
    }
}

#[test]
fn extents_of_tables_and_values_are_found() {
    let text = "a.b = 1 # a\n[camera] # c\nfov = 45\n[camera.path]\nx = [1,\n 2]\n[[shapes]]\nr = 1\n";
    let layout = Layout::of(text).unwrap();
    let extent = |path: &str| layout.extent(&path.parse().unwrap()).map(|range| &text[range]);
    assert_eq!(
        extent("camera"),
        Some("[camera] # c\nfov = 45\n[camera.path]\nx = [1,\n 2]")
    );
    assert_eq!(extent("camera.path"), Some("[camera.path]\nx = [1,\n 2]"));
    assert_eq!(extent("camera.fov"), Some("fov = 45"));
    assert_eq!(extent("a.b"), Some("b = 1"));
    assert_eq!(extent("shapes[0]"), Some("[[shapes]]\nr = 1"));
    assert_eq!(extent("shapes[1]"), None);
    assert_eq!(extent("render"), None);
}
