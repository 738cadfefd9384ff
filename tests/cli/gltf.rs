//! glTF files on the command line: rendering options and `wgray convert`.

use std::fs;

use super::{SCENE, TestFolder, read_png};
use crate::model::Model;

const QUICK: [&str; 6] = ["--size", "24x16", "--spp", "2", "--device", "cpu"];

fn folder_with_model(model: &Model) -> TestFolder {
    let folder = TestFolder::with_file("small.toml", SCENE);
    model.write_glb(folder.folder(), "box.glb");
    model.write_gltf(folder.folder(), "box");
    folder
}

fn model_with_cameras() -> Model {
    Model {
        has_cameras: true,
        ..Model::default()
    }
}

fn render_quietly(folder: &TestFolder, arguments: &[&str]) {
    folder.run_quietly(&[&["render"], arguments, &QUICK].concat());
}

fn bits(folder: &TestFolder, arguments: &[&str]) -> Vec<u32> {
    render_quietly(folder, &[arguments, &["-o", "bits.exr"]].concat());
    pixels(folder, "bits.exr")
}

fn pixels(folder: &TestFolder, name: &str) -> Vec<u32> {
    let picture = image::open(folder.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    picture.into_rgb32f().into_raw().into_iter().map(f32::to_bits).collect()
}

fn assert_rejected(folder: &TestFolder, arguments: &[&str], code: i32, message: &str) {
    let before = folder.files();
    let result = folder.run(arguments);
    assert_eq!(
        (result.code, result.stdout.as_str()),
        (code, ""),
        "{arguments:?}: {}",
        result.stderr
    );
    assert!(
        result.stderr.contains(message),
        "{arguments:?}: {}\n{message}",
        result.stderr
    );
    assert_eq!(folder.files(), before, "{arguments:?}");
}

#[test]
fn a_model_renders_without_a_scene() {
    let folder = folder_with_model(&Model::default());
    let result = folder.run(&["check", "box.glb", "box.gltf"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    for line in result.stdout.lines() {
        assert!(line.contains(": ok: 720 x 720 pixels, 32 samples per pixel"), "{line}");
        assert!(
            line.contains("2 shapes, including 2 instances of 2 meshes (24 triangles"),
            "{line}"
        );
    }
    // The margin of 5 % around the model is less than a pixel.
    render_quietly(
        &folder,
        &["box.glb", "--background", "none", "-o", "box.png", "-o", "box.exr"],
    );
    assert_eq!(
        pixels(&folder, "box.exr"),
        bits(&folder, &["box.gltf", "--background", "none"])
    );
    let picture = image::open(folder.path("box.png")).unwrap().into_rgba8();
    let covered: Vec<(u32, u32)> = picture
        .enumerate_pixels()
        .filter(|(_, _, p)| p.0[3] > 0)
        .map(|(x, y, _)| (x, y))
        .collect();
    let range = |values: &mut dyn Iterator<Item = u32>| values.fold((u32::MAX, 0), |(a, b), x| (a.min(x), b.max(x)));
    let (left, right) = range(&mut covered.iter().map(|(x, _)| *x));
    let (top, bottom) = range(&mut covered.iter().map(|(_, y)| *y));
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
    render_quietly(&folder, &["box.gltf"]);
    assert_eq!(read_png(&folder.path("box.png")).0, 24);
}

#[test]
fn options_select_parts_of_the_file_by_name_or_index() {
    let folder = folder_with_model(&model_with_cameras());
    let default_image = bits(&folder, &["box.glb"]);
    let mut images_so_far = vec![default_image.clone()];
    let assert_new_image = |options: &[&[&str]], images_so_far: &mut Vec<Vec<u32>>| {
        let render = |options: &&[&str]| bits(&folder, &[&["box.glb"], *options].concat());
        let images: Vec<_> = options.iter().map(render).collect();
        assert!(
            images.iter().all(|bits| *bits == images[0]),
            "{options:?}: the images differ"
        );
        assert!(
            !images_so_far.contains(&images[0]),
            "{options:?}: the options have no effect"
        );
        images_so_far.push(images[0].clone());
    };
    assert_new_image(&[&["--camera", "side camera"], &["--camera", "1"]], &mut images_so_far);
    assert_new_image(&[&["--view", "front"]], &mut images_so_far);
    assert_new_image(&[&["--view", "corner"]], &mut images_so_far);
    assert_new_image(&[&["--gltf-scene", "one"], &["--gltf-scene", "1"]], &mut images_so_far);
    assert_new_image(
        &[
            &["--time", "0.5"],
            &["--time", "0.5", "--animation", "rise"],
            &["--time", "0.5", "--animation", "0"],
        ],
        &mut images_so_far,
    );
    assert_new_image(&[&["--variant", "golden"], &["--variant", "0"]], &mut images_so_far);
    assert_new_image(&[&["--environment", "sky"]], &mut images_so_far);
    for options in [
        ["--camera", "front camera"],
        ["--camera", "0"],
        ["--gltf-scene", "all"],
        ["--time", "0"],
    ] {
        assert_eq!(
            bits(&folder, &[&["box.glb"], &options[..]].concat()),
            default_image,
            "{options:?}"
        );
    }
    // Without `--size`, the camera determines the aspect ratio.
    for (options, size) in [
        (&["--camera", "0"][..], "720 x 480"),
        (&["--camera", "1"], "720 x 720"),
        (&["--view", "iso"], "720 x 720"),
    ] {
        let result = folder.run(&[&["check", "box.glb"], options].concat());
        assert!(
            result.stdout.contains(size),
            "{options:?}: {}{}",
            result.stdout,
            result.stderr
        );
    }
}

#[test]
fn unknown_gltf_selections_list_the_available_ones() {
    let folder = folder_with_model(&model_with_cameras());
    for (option, value, message) in [
        (
            "--camera",
            "above",
            "--camera: the file has no camera \"above\"; available: 0 (\"front camera\"), 1 (\"side camera\")",
        ),
        (
            "--camera",
            "2",
            "--camera: the file has no camera 2; available: 0 (\"front",
        ),
        (
            "--gltf-scene",
            "two",
            "--gltf-scene: the file has no scene \"two\"; available: 0 (\"all\"), 1 (\"one\")",
        ),
        (
            "--animation",
            "fall",
            "--animation: the file has no animation \"fall\"; available: 0 (\"rise\")",
        ),
        (
            "--variant",
            "red",
            "--variant: the file has no variant \"red\"; available: 0 (\"golden\")",
        ),
        ("--time", "-1", "--time: -1 must be from 0 to 1e9 seconds"),
        ("--time", "nan", "--time: NaN must be from 0 to 1e9 seconds"),
        ("--view", "above", "invalid value 'above' for '--view"),
    ] {
        for command in ["render", "check"] {
            assert_rejected(&folder, &[command, "box.glb", option, value], 2, message);
        }
        assert_rejected(
            &folder,
            &["convert", "box.glb", "-o", "box.toml", "--force", option, value],
            2,
            message,
        );
    }
    assert_rejected(
        &folder,
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
        assert_rejected(&folder, &["render", "small.toml", option, value], 2, &message);
    }
    let still = Model {
        animated: false,
        ..Model::default()
    };
    still.write_glb(folder.folder(), "still.glb");
    assert_rejected(
        &folder,
        &["render", "still.glb", "--time", "1"],
        2,
        "--time: the file has no animations",
    );
    assert_rejected(
        &folder,
        &["render", "still.glb", "--frames", "1-2", "--fps", "10"],
        2,
        "--fps: only applies to glTF files with animations",
    );
    assert_rejected(
        &folder,
        &["render", "box.glb", "--fps", "10"],
        2,
        "--fps: needs --frames or --turntable",
    );
    assert_rejected(
        &folder,
        &["render", "box.glb", "--frames", "1-2", "--fps", "10", "--time", "1"],
        2,
        "cannot be used with",
    );
}

#[test]
fn gltf_files_without_triangles_and_invalid_ones_are_rejected() {
    let folder = folder_with_model(&model_with_cameras());
    let empty = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{}] }"#;
    fs::write(folder.path("empty.gltf"), empty).unwrap();
    assert_rejected(&folder, &["render", "empty.gltf"], 3, "has no triangles");
    fs::write(folder.path("bad.glb"), "no model").unwrap();
    assert_rejected(&folder, &["render", "bad.glb"], 3, "bad.glb:1:2: ");
    assert_rejected(&folder, &["render", "none.glb"], 3, "none.glb: cannot be read");
}

#[test]
fn frames_select_times_of_the_animation() {
    let folder = folder_with_model(&model_with_cameras());
    render_quietly(&folder, &["box.glb", "--frames", "0-12:6", "-o", "f.##.exr"]);
    render_quietly(&folder, &["box.glb", "--frames", "5", "--fps", "10", "-o", "fps.exr"]);
    for (frame, time) in [
        ("f.00.exr", "0"),
        ("f.06.exr", "0.25"),
        ("f.12.exr", "0.5"),
        ("fps.exr", "0.5"),
    ] {
        assert_eq!(pixels(&folder, frame), render_at_time(&folder, time), "{frame}");
    }
    assert_ne!(pixels(&folder, "f.00.exr"), pixels(&folder, "f.12.exr"));
    // `--time` takes precedence over the frame.
    let result = folder.run(
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
    assert_eq!(result.code, 0);
    assert!(result.stderr.contains("all frames are equal"), "{}", result.stderr);
    assert_eq!(pixels(&folder, "named.exr"), render_at_time(&folder, "0.25"));
    // The automatic camera does not move: the part of the model that rises does not change the framing.
    Model::default().write_glb(folder.folder(), "box.glb");
    render_quietly(&folder, &["box.glb", "--frames", "0-18:6", "-o", "s##.exr"]);
    render_quietly(&folder, &["box.glb", "--frames", "18", "-o", "alone.exr"]);
    assert_eq!(pixels(&folder, "s00.exr"), bits(&folder, &["box.glb"]));
    assert_eq!(pixels(&folder, "s18.exr"), pixels(&folder, "alone.exr"));
    assert_ne!(pixels(&folder, "s18.exr"), render_at_time(&folder, "0.75"));
    assert_ne!(pixels(&folder, "s18.exr"), pixels(&folder, "s12.exr"));
}

fn render_at_time(folder: &TestFolder, time: &str) -> Vec<u32> {
    bits(folder, &["box.glb", "--time", time])
}

#[test]
fn a_converted_scene_has_the_same_bits() {
    let folder = folder_with_model(&model_with_cameras());
    fs::create_dir_all(folder.path("scenes/models")).unwrap();
    fs::copy(folder.path("box.glb"), folder.path("scenes/models/a box.glb")).unwrap();
    let model = "scenes/models/a box.glb";
    let mut earlier_images = Vec::new();
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
        folder.run_quietly(
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
        let expected = bits(&folder, &[&[model], options].concat());
        folder.run_quietly(&["render", "scenes/box.toml", "-o", "bits.exr", "--device", "cpu"]);
        assert_eq!(pixels(&folder, "bits.exr"), expected, "{options:?}");
        assert!(
            !earlier_images.contains(&expected),
            "{options:?}: the options have no effect"
        );
        earlier_images.push(expected);
        let text = String::from_utf8(folder.read("scenes/box.toml")).unwrap();
        assert!(text.starts_with("# a box.glb, as a scene."), "{text}");
        assert!(text.contains("file = \"models/a box.glb\""), "{text}");
        assert!(text.lines().count() < 45, "{text}");
    }
    let result = folder.run(&["check", "scenes/box.toml"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
}

#[test]
fn a_conversion_keeps_its_input_and_uses_relative_paths() {
    let folder = folder_with_model(&Model::default());
    let onto_itself = ["convert", "small.toml", "-o", "./small.toml"];
    assert_rejected(&folder, &onto_itself, 2, "is an input of the scene");
    assert_rejected(
        &folder,
        &["convert", "box.glb", "-o", "box.json"],
        2,
        "--output: box.json: must end in .toml",
    );
    assert_rejected(&folder, &["convert", "box.glb", "-o", "none/box.toml"], 8, "none");
    fs::create_dir(folder.path("sub")).unwrap();
    let result = folder.run(&[
        "convert",
        "box.gltf",
        "-o",
        "sub/box.toml",
        "--size",
        "24x16",
        "--spp",
        "2",
    ]);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(
        result
            .stderr
            .starts_with("note: sub/box.toml: refers to files outside of ")
            && result
                .stderr
                .ends_with("/sub; pass --asset-root . to render the scene\n"),
        "{}",
        result.stderr
    );
    let expected = bits(&folder, &["box.gltf"]);
    folder.run_quietly(&[
        "render",
        "sub/box.toml",
        "--asset-root",
        ".",
        "-o",
        "bits.exr",
        "--device",
        "cpu",
    ]);
    assert_eq!(pixels(&folder, "bits.exr"), expected);
    assert_rejected(
        &folder,
        &["render", "sub/box.toml"],
        3,
        "lies outside of the scene's folder",
    );
    folder.run_quietly(&["convert", "small.toml", "-o", "other.toml"]);
    folder.run_quietly(&["render", "small.toml", "-o", "a.exr", "--device", "cpu"]);
    folder.run_quietly(&["render", "other.toml", "-o", "b.exr", "--device", "cpu"]);
    assert_eq!(pixels(&folder, "a.exr"), pixels(&folder, "b.exr"));
}

#[test]
fn info_lists_the_names_that_options_accept() {
    let folder = folder_with_model(&model_with_cameras());
    let result = folder.run(&["info", "box.glb", "--device", "cpu"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    for row in [
        "    glTF file   box.glb\n",
        "                cameras    2: 0 ",
        "                animations ",
        " \"rise\"",
        "                variants   1: 0 \"golden\"\n",
        "                materials  3: 0 ",
    ] {
        assert!(result.stdout.contains(row), "{row}: {}", result.stdout);
    }
    let result = folder.run(&["info", "box.glb", "--json"]);
    let info: serde_json::Value = serde_json::from_str(&result.stdout).unwrap();
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
            for selector in [Some(i.to_string().as_str()), name.as_str()].into_iter().flatten() {
                let result = folder.run(&["check", "box.glb", option, selector]);
                assert_eq!(result.code, 0, "{option} {selector}: {}", result.stderr);
            }
        }
        let invalid_index = names.len().to_string();
        assert_eq!(
            folder.run(&["check", "box.glb", option, &invalid_index]).code,
            2,
            "{option} {invalid_index}"
        );
    }
}

#[test]
fn a_conversion_overwrites_a_file_only_with_force() {
    let folder = folder_with_model(&Model::default());
    folder.write("mine.toml", "# a scene that took many hours to write\n");
    let convert = ["convert", "box.glb", "-o", "mine.toml"];
    assert_rejected(
        &folder,
        &convert,
        2,
        "--output: mine.toml: already exists; pass --force to overwrite it",
    );
    assert_eq!(folder.read("mine.toml"), b"# a scene that took many hours to write\n");
    folder.run_quietly(&[&convert[..], &["--force"]].concat());
    assert!(folder.read("mine.toml").starts_with(b"# box.glb, as a scene. "));
    assert_rejected(&folder, &convert, 2, "already exists");
    let onto_itself = ["convert", "mine.toml", "-o", "./mine.toml", "--force"];
    assert_rejected(&folder, &onto_itself, 2, "is an input of the scene");
}

#[test]
fn a_conversion_prints_the_asset_root_to_pass() {
    let folder = folder_with_model(&Model::default());
    fs::create_dir_all(folder.path("a dir/models")).unwrap();
    fs::create_dir_all(folder.path("a dir/scenes/new")).unwrap();
    fs::rename(folder.path("box.glb"), folder.path("a dir/models/box.glb")).unwrap();
    let result = folder.run(&["convert", "a dir/models/box.glb", "-o", "a dir/scenes/new/box.toml"]);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(
        result
            .stderr
            .ends_with("pass --asset-root 'a dir' to render the scene\n"),
        "{}",
        result.stderr
    );
    let check = ["check", "a dir/scenes/new/box.toml"];
    assert_rejected(&folder, &check, 3, "pass --asset-root with a folder that contains both");
    let result = folder.run(&[&check[..], &["--asset-root", "a dir"]].concat());
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    let result = folder.run(&["convert", "a dir/models/box.glb", "-o", "a dir/models/box.toml"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
}

#[test]
fn a_turntable_frames_the_model() {
    let folder = folder_with_model(&Model::default());
    // The margin of 5 % is at least two pixels.
    let quick = ["--size", "60x40", "--spp", "1", "--device", "cpu"];
    let turntable = [
        "render",
        "box.glb",
        "--turntable",
        "5",
        "--background",
        "none",
        "-o",
        "t#.png",
    ];
    folder.run_quietly(&[&turntable[..], &quick].concat());
    let mut earlier_frames = Vec::new();
    for frame in 1..=5 {
        let picture = image::open(folder.path(&format!("t{frame}.png"))).unwrap().into_rgba8();
        let is_at_edge = |x: u32, y: u32| x == 0 || y == 0 || x == 59 || y == 39;
        let shows_model = |at_edge: bool| {
            picture
                .enumerate_pixels()
                .any(|(x, y, p)| is_at_edge(x, y) == at_edge && p.0[3] > 0)
        };
        assert!(
            shows_model(false) && !shows_model(true),
            "frame {frame} does not show the full model"
        );
        let bytes = picture.into_raw();
        assert!(
            !earlier_frames.contains(&bytes),
            "frame {frame} equals an earlier frame"
        );
        earlier_frames.push(bytes);
    }
}
