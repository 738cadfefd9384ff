//! glTF files on the command line: rendering options and `wgray convert`.

use std::fs;

use super::{SCENE, TestFolder, read_png};
use crate::model::Model;

const QUICK: [&str; 6] = ["--size", "24x16", "--spp", "2", "--device", "cpu"];

fn place(model: &Model) -> TestFolder {
    let place = TestFolder::with_file("small.toml", SCENE);
    model.write_glb(place.folder(), "box.glb");
    model.write_gltf(place.folder(), "box");
    place
}

fn with_cameras() -> Model {
    Model {
        cameras: true,
        ..Model::default()
    }
}

fn quietly(place: &TestFolder, arguments: &[&str]) {
    place.quietly(&[&["render"], arguments, &QUICK].concat());
}

fn bits(place: &TestFolder, arguments: &[&str]) -> Vec<u32> {
    quietly(place, &[arguments, &["-o", "bits.exr"]].concat());
    pixels(place, "bits.exr")
}

fn pixels(place: &TestFolder, name: &str) -> Vec<u32> {
    let picture = image::open(place.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    picture.into_rgb32f().into_raw().into_iter().map(f32::to_bits).collect()
}

fn refused(place: &TestFolder, arguments: &[&str], code: i32, message: &str) {
    let before = place.files();
    let ran = place.run(arguments);
    assert_eq!(
        (ran.code, ran.stdout.as_str()),
        (code, ""),
        "{arguments:?}: {}",
        ran.stderr
    );
    assert!(ran.stderr.contains(message), "{arguments:?}: {}\n{message}", ran.stderr);
    assert_eq!(place.files(), before, "{arguments:?}");
}

#[test]
fn a_model_renders_without_a_scene() {
    let place = place(&Model::default());
    let ran = place.run(&["check", "box.glb", "box.gltf"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    for line in ran.stdout.lines() {
        assert!(line.contains(": ok: 720 x 720 pixels, 32 samples per pixel"), "{line}");
        assert!(
            line.contains("2 shapes, including 2 instances of 2 meshes (24 triangles"),
            "{line}"
        );
    }
    // The margin of 5 % around the model is less than a pixel.
    quietly(
        &place,
        &["box.glb", "--background", "none", "-o", "box.png", "-o", "box.exr"],
    );
    assert_eq!(
        pixels(&place, "box.exr"),
        bits(&place, &["box.gltf", "--background", "none"])
    );
    let picture = image::open(place.path("box.png")).unwrap().into_rgba8();
    let covered: Vec<(u32, u32)> = picture
        .enumerate_pixels()
        .filter(|(_, _, p)| p.0[3] > 0)
        .map(|(x, y, _)| (x, y))
        .collect();
    let ends = |values: &mut dyn Iterator<Item = u32>| values.fold((u32::MAX, 0), |(a, b), x| (a.min(x), b.max(x)));
    let (left, right) = ends(&mut covered.iter().map(|(x, _)| *x));
    let (top, bottom) = ends(&mut covered.iter().map(|(_, y)| *y));
    assert!(
        left + right == 23 || top + bottom == 15,
        "{left} {right} {top} {bottom}"
    );
    assert!(
        (left <= 2 && right >= 21) || (top <= 1 && bottom >= 14),
        "{left} {right} {top} {bottom}"
    );
    let middle = picture.get_pixel(12, 10).0;
    assert!(
        middle[0] > middle[2],
        "the box does not have the color of clay: {middle:?}"
    );
    quietly(&place, &["box.gltf"]);
    assert_eq!(read_png(&place.path("box.png")).0, 24);
}

#[test]
fn options_select_parts_by_name_or_index() {
    let place = place(&with_cameras());
    let plain = bits(&place, &["box.glb"]);
    let mut seen = vec![plain.clone()];
    let other = |options: &[&[&str]], seen: &mut Vec<Vec<u32>>| {
        let of = |options: &&[&str]| bits(&place, &[&["box.glb"], *options].concat());
        let all: Vec<_> = options.iter().map(of).collect();
        assert!(
            all.iter().all(|bits| *bits == all[0]),
            "{options:?} give the same image"
        );
        assert!(!seen.contains(&all[0]), "{options:?} give different images");
        seen.push(all[0].clone());
    };
    other(&[&["--camera", "side camera"], &["--camera", "1"]], &mut seen);
    other(&[&["--view", "front"]], &mut seen);
    other(&[&["--view", "corner"]], &mut seen);
    other(&[&["--gltf-scene", "one"], &["--gltf-scene", "1"]], &mut seen);
    other(
        &[
            &["--time", "0.5"],
            &["--time", "0.5", "--animation", "rise"],
            &["--time", "0.5", "--animation", "0"],
        ],
        &mut seen,
    );
    other(&[&["--variant", "golden"], &["--variant", "0"]], &mut seen);
    other(&[&["--environment", "sky"]], &mut seen);
    for options in [
        ["--camera", "front camera"],
        ["--camera", "0"],
        ["--gltf-scene", "all"],
        ["--time", "0"],
    ] {
        assert_eq!(
            bits(&place, &[&["box.glb"], &options[..]].concat()),
            plain,
            "{options:?}"
        );
    }
    // The aspect ratio is the camera's, unless a size is given.
    for (options, size) in [
        (&["--camera", "0"][..], "720 x 480"),
        (&["--camera", "1"], "720 x 720"),
        (&["--view", "iso"], "720 x 720"),
    ] {
        let ran = place.run(&[&["check", "box.glb"], options].concat());
        assert!(ran.stdout.contains(size), "{options:?}: {}{}", ran.stdout, ran.stderr);
    }
}

#[test]
fn unknown_gltf_selections_list_the_available_ones() {
    let place = place(&with_cameras());
    for (option, value, message) in [
        (
            "--camera",
            "above",
            "--camera: the file has no camera \"above\"; it has 2: 0 (\"front camera\"), 1 (\"side camera\")",
        ),
        (
            "--camera",
            "2",
            "--camera: the file has no camera 2; it has 2: 0 (\"front",
        ),
        (
            "--gltf-scene",
            "two",
            "--gltf-scene: the file has no scene \"two\"; it has 2: 0 (\"all\"), 1 (\"one\")",
        ),
        (
            "--animation",
            "fall",
            "--animation: the file has no animation \"fall\"; it has 1: 0 (\"rise\")",
        ),
        (
            "--variant",
            "red",
            "--variant: the file has no variant \"red\"; it has 1: 0 (\"golden\")",
        ),
        ("--time", "-1", "--time: -1 must be from 0 to 1e9 seconds"),
        ("--time", "nan", "--time: NaN must be from 0 to 1e9 seconds"),
        ("--view", "above", "invalid value 'above' for '--view"),
    ] {
        for command in ["render", "check"] {
            refused(&place, &[command, "box.glb", option, value], 2, message);
        }
        refused(
            &place,
            &["convert", "box.glb", "-o", "box.toml", "--force", option, value],
            2,
            message,
        );
    }
    refused(
        &place,
        &["render", "box.glb", "--camera", "0", "--view", "top"],
        2,
        "cannot be used with",
    );
    for (option, value) in [
        ("--camera", "0"),
        ("--view", "top"),
        ("--time", "0"),
        ("--gltf-scene", "0"),
        ("--animation", "0"),
        ("--variant", "0"),
        ("--orbit", "0,0"),
        ("--fov", "40"),
        ("--up", "z"),
    ] {
        let message = format!("error: {option}: only applies to model files, and small.toml is a scene file");
        refused(&place, &["render", "small.toml", option, value], 2, &message);
    }
    let still = Model {
        animated: false,
        ..Model::default()
    };
    still.write_glb(place.folder(), "still.glb");
    refused(
        &place,
        &["render", "still.glb", "--time", "1"],
        2,
        "--time: the file has no animations",
    );
    refused(
        &place,
        &["render", "still.glb", "--frames", "1-2", "--fps", "10"],
        2,
        "--fps: only applies to glTF files with animations",
    );
    refused(
        &place,
        &["render", "box.glb", "--fps", "10"],
        2,
        "--fps: needs --frames or --turntable",
    );
    refused(
        &place,
        &["render", "box.glb", "--frames", "1-2", "--fps", "10", "--time", "1"],
        2,
        "cannot be used with",
    );
    let empty = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{}] }"#;
    fs::write(place.path("empty.gltf"), empty).unwrap();
    refused(&place, &["render", "empty.gltf"], 3, "has no triangles");
    fs::write(place.path("bad.glb"), "no model").unwrap();
    refused(&place, &["render", "bad.glb"], 3, "bad.glb:1:2: ");
    refused(&place, &["render", "none.glb"], 3, "none.glb: cannot be read");
}

#[test]
fn frames_select_times_of_the_animation() {
    let place = place(&with_cameras());
    quietly(&place, &["box.glb", "--frames", "0-12:6", "-o", "f.##.exr"]);
    quietly(&place, &["box.glb", "--frames", "5", "--fps", "10", "-o", "fps.exr"]);
    for (frame, time) in [
        ("f.00.exr", "0"),
        ("f.06.exr", "0.25"),
        ("f.12.exr", "0.5"),
        ("fps.exr", "0.5"),
    ] {
        assert_eq!(pixels(&place, frame), moment(&place, time), "{frame}");
    }
    assert_ne!(pixels(&place, "f.00.exr"), pixels(&place, "f.12.exr"));
    // `--time` takes precedence over the frame.
    let ran = place.run(
        &[
            &[
                "render",
                "box.glb",
                "--frames",
                "12",
                "--time",
                "0.25",
                "-o",
                "named.exr",
            ],
            &QUICK[..],
        ]
        .concat(),
    );
    assert_eq!(ran.code, 0);
    assert!(ran.stderr.contains("all frames are equal"), "{}", ran.stderr);
    assert_eq!(pixels(&place, "named.exr"), moment(&place, "0.25"));
    // A generated camera does not move: a rising part does not change the framing.
    Model::default().write_glb(place.folder(), "box.glb");
    quietly(&place, &["box.glb", "--frames", "0-18:6", "-o", "s##.exr"]);
    quietly(&place, &["box.glb", "--frames", "18", "-o", "alone.exr"]);
    assert_eq!(pixels(&place, "s00.exr"), bits(&place, &["box.glb"]));
    assert_eq!(pixels(&place, "s18.exr"), pixels(&place, "alone.exr"));
    assert_ne!(pixels(&place, "s18.exr"), moment(&place, "0.75"));
    assert_ne!(pixels(&place, "s18.exr"), pixels(&place, "s12.exr"));
}

fn moment(place: &TestFolder, time: &str) -> Vec<u32> {
    bits(place, &["box.glb", "--time", time])
}

#[test]
fn a_converted_scene_has_the_same_bits() {
    let place = place(&with_cameras());
    fs::create_dir_all(place.path("scenes/models")).unwrap();
    fs::copy(place.path("box.glb"), place.path("scenes/models/a box.glb")).unwrap();
    let model = "scenes/models/a box.glb";
    let mut seen = Vec::new();
    for options in [
        &[][..],
        &["--camera", "1"],
        &["--view", "iso"],
        &["--time", "0.3", "--animation", "rise"],
        &["--variant", "golden", "--gltf-scene", "all"],
        &["--background", "1,0,0.5"],
        &["--environment", "sky", "--background", "none"],
        &["-D", "render.max_depth=1"],
        &["--ground"],
        &["--orbit", "200,40", "--fov", "50", "--up", "x"],
    ] {
        place.quietly(
            &[
                &[
                    "convert",
                    model,
                    "-o",
                    "scenes/box.toml",
                    "--force",
                    "--size",
                    "24x16",
                    "--spp",
                    "2",
                ],
                options,
            ]
            .concat(),
        );
        let wanted = bits(&place, &[&[model], options].concat());
        place.quietly(&["render", "scenes/box.toml", "-o", "bits.exr", "--device", "cpu"]);
        assert_eq!(pixels(&place, "bits.exr"), wanted, "{options:?}");
        assert!(!seen.contains(&wanted), "{options:?}: the comparison cannot fail");
        seen.push(wanted);
        let text = String::from_utf8(place.read("scenes/box.toml")).unwrap();
        assert!(text.starts_with("# a box.glb, as a scene."), "{text}");
        assert!(text.contains("file = \"models/a box.glb\""), "{text}");
        assert!(text.lines().count() < 45, "{text}");
    }
    let ran = place.run(&["check", "scenes/box.toml"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
}

#[test]
fn a_conversion_keeps_its_input_and_uses_relative_paths() {
    let place = place(&Model::default());
    let same = ["convert", "small.toml", "-o", "./small.toml"];
    refused(&place, &same, 2, "is an input of the scene");
    refused(
        &place,
        &["convert", "box.glb", "-o", "box.json"],
        2,
        "--output: box.json: must end in .toml",
    );
    refused(&place, &["convert", "box.glb", "-o", "none/box.toml"], 8, "none");
    fs::create_dir(place.path("sub")).unwrap();
    let ran = place.run(&[
        "convert",
        "box.gltf",
        "-o",
        "sub/box.toml",
        "--size",
        "24x16",
        "--spp",
        "2",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(
        ran.stderr
            .starts_with("note: sub/box.toml: refers to files outside of ")
            && ran.stderr.ends_with("/sub; pass --asset-root . to render it\n"),
        "{}",
        ran.stderr
    );
    let wanted = bits(&place, &["box.gltf"]);
    place.quietly(&[
        "render",
        "sub/box.toml",
        "--asset-root",
        ".",
        "-o",
        "bits.exr",
        "--device",
        "cpu",
    ]);
    assert_eq!(pixels(&place, "bits.exr"), wanted);
    refused(
        &place,
        &["render", "sub/box.toml"],
        3,
        "lies outside of the scene's folder",
    );
    place.quietly(&["convert", "small.toml", "-o", "other.toml"]);
    place.quietly(&["render", "small.toml", "-o", "a.exr", "--device", "cpu"]);
    place.quietly(&["render", "other.toml", "-o", "b.exr", "--device", "cpu"]);
    assert_eq!(pixels(&place, "a.exr"), pixels(&place, "b.exr"));
}

#[test]
fn info_lists_what_options_select() {
    let place = place(&with_cameras());
    let ran = place.run(&["info", "box.glb", "--device", "cpu"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    for row in [
        "    glTF file   box.glb\n",
        "                cameras    2: 0 ",
        "                animations ",
        " \"rise\"",
        "                variants   1: 0 \"golden\"\n",
        "                materials  3: 0 ",
    ] {
        assert!(ran.stdout.contains(row), "{row}: {}", ran.stdout);
    }
    let ran = place.run(&["info", "box.glb", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    let model = &info["models"][0];
    assert_eq!(
        (&model["file"], &model["variants"]),
        (&"box.glb".into(), &serde_json::json!(["golden"]))
    );
    assert_eq!(model["cameras"].as_array().map(Vec::len), Some(2));
    for (list, option) in [
        ("cameras", "--camera"),
        ("animations", "--animation"),
        ("variants", "--variant"),
        ("scenes", "--gltf-scene"),
    ] {
        let names = model[list].as_array().unwrap();
        assert!(!names.is_empty(), "{list}: {model}");
        for (i, name) in names.iter().enumerate() {
            for wanted in [Some(i.to_string().as_str()), name.as_str()].into_iter().flatten() {
                let ran = place.run(&["check", "box.glb", option, wanted]);
                assert_eq!(ran.code, 0, "{option} {wanted}: {}", ran.stderr);
            }
        }
        let beyond = names.len().to_string();
        assert_eq!(
            place.run(&["check", "box.glb", option, &beyond]).code,
            2,
            "{option} {beyond}"
        );
    }
}

#[test]
fn a_conversion_overwrites_a_file_only_by_force() {
    let place = place(&Model::default());
    place.write("mine.toml", "# a scene of many hours\n");
    let convert = ["convert", "box.glb", "-o", "mine.toml"];
    refused(
        &place,
        &convert,
        2,
        "--output: mine.toml: already exists; pass --force to overwrite it",
    );
    assert_eq!(place.read("mine.toml"), b"# a scene of many hours\n");
    place.quietly(&[&convert[..], &["--force"]].concat());
    assert!(place.read("mine.toml").starts_with(b"# box.glb, as a scene. "));
    refused(&place, &convert, 2, "already exists");
    let same = ["convert", "mine.toml", "-o", "./mine.toml", "--force"];
    refused(&place, &same, 2, "is an input of the scene");
}

#[test]
fn a_conversion_prints_the_asset_root_to_pass() {
    let place = place(&Model::default());
    fs::create_dir_all(place.path("a dir/models")).unwrap();
    fs::create_dir_all(place.path("a dir/scenes/new")).unwrap();
    fs::rename(place.path("box.glb"), place.path("a dir/models/box.glb")).unwrap();
    let ran = place.run(&["convert", "a dir/models/box.glb", "-o", "a dir/scenes/new/box.toml"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(
        ran.stderr.ends_with("pass --asset-root 'a dir' to render it\n"),
        "{}",
        ran.stderr
    );
    let check = ["check", "a dir/scenes/new/box.toml"];
    refused(&place, &check, 3, "pass --asset-root with a folder that contains both");
    let ran = place.run(&[&check[..], &["--asset-root", "a dir"]].concat());
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let ran = place.run(&["convert", "a dir/models/box.glb", "-o", "a dir/models/box.toml"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
}

#[test]
fn a_turntable_frames_the_model() {
    let place = place(&Model::default());
    // The margin of 5 % is at least two pixels.
    let small = ["--size", "60x40", "--spp", "1", "--device", "cpu"];
    let around = [
        "render",
        "box.glb",
        "--turntable",
        "5",
        "--background",
        "none",
        "-o",
        "t#.png",
    ];
    place.quietly(&[&around[..], &small].concat());
    let mut seen = Vec::new();
    for frame in 1..=5 {
        let picture = image::open(place.path(&format!("t{frame}.png"))).unwrap().into_rgba8();
        let edge = |x: u32, y: u32| x == 0 || y == 0 || x == 59 || y == 39;
        let covered = |at_edge: bool| {
            picture
                .enumerate_pixels()
                .any(|(x, y, p)| edge(x, y) == at_edge && p.0[3] > 0)
        };
        assert!(
            covered(false) && !covered(true),
            "frame {frame} does not show the whole model"
        );
        let bytes = picture.into_raw();
        assert!(!seen.contains(&bytes), "frame {frame} equals another");
        seen.push(bytes);
    }
}
