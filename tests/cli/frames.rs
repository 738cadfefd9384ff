//! `--frames`, `--skip-existing` and `--define`.

use std::fs;
use std::time::{Duration, SystemTime};

use super::{NO_DRIVER, SCENE, TestFolder};
use crate::gltf::build::png;

/// Writes the scene with a camera that moves to the right and is centered at frame 5.
fn write_moving_scene(folder: &TestFolder, interpolation: &str) {
    let keys = "{ frame = 1, position = [-2, -5, 1] }, { frame = 5, position = [0, -5, 1] }, { frame = 9, position = [2, -5, 1] }";
    let path = format!("fov = 40, path = {{ interpolation = \"{interpolation}\", keys = [{keys}] }} }}");
    assert!(SCENE.contains("fov = 40 }"));
    folder.write("moving.toml", &SCENE.replace("fov = 40 }", &path));
}

/// Returns the width and the color bits of an EXR. Tests compare these bits instead of files, because the metadata may
/// depend on the scene file.
fn bits(folder: &TestFolder, name: &str) -> (u32, Vec<u32>) {
    let picture = image::open(folder.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let picture = picture.into_rgb32f();
    (
        picture.width(),
        picture.into_raw().into_iter().map(f32::to_bits).collect(),
    )
}

const CPU: [&str; 2] = ["--device", "cpu"];

fn render_quietly(folder: &TestFolder, arguments: &[&str]) {
    folder.run_quietly(&[&["render"], arguments, &CPU[..]].concat());
}

/// Runs a render that must be rejected and write no file.
fn assert_rejected(folder: &TestFolder, arguments: &[&str], code: i32, message: &str) {
    let before = folder.files();
    let result = folder.run(&[&["render"], arguments, &CPU[..]].concat());
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
fn a_frame_equals_a_still_image_of_its_camera() {
    for interpolation in ["linear", "smooth"] {
        let folder = TestFolder::new();
        write_moving_scene(&folder, interpolation);
        render_quietly(&folder, &["moving.toml", "--frames", "1-9:4", "-o", "out.###.exr"]);
        assert_eq!(
            folder.files(),
            ["moving.toml", "out.001.exr", "out.005.exr", "out.009.exr"].map(String::from)
        );
        for (frame, x) in [(1, -2), (5, 0), (9, 2)] {
            folder.write("still.toml", &SCENE.replace("[0, -5, 1]", &format!("[{x}, -5, 1]")));
            render_quietly(&folder, &["still.toml", "-o", "still.exr"]);
            assert_eq!(
                bits(&folder, "still.exr"),
                bits(&folder, &format!("out.00{frame}.exr")),
                "{frame}"
            );
        }
        assert_ne!(bits(&folder, "out.001.exr"), bits(&folder, "out.009.exr"));
        // A frame halfway between two keys does not depend on the other frames of the render or their order.
        folder.write("still.toml", &SCENE.replace("[0, -5, 1]", "[-1, -5, 1]"));
        render_quietly(&folder, &["still.toml", "-o", "still.exr"]);
        render_quietly(&folder, &["moving.toml", "--frames", "3", "-o", "alone.exr"]);
        render_quietly(&folder, &["moving.toml", "--frames", "9,3,1", "-o", "#.exr"]);
        for name in ["alone.exr", "3.exr"] {
            assert_eq!(bits(&folder, name), bits(&folder, "still.exr"), "{name}");
        }
        // Without `--frames`, the `position` of the camera applies. It equals the key of frame 5.
        render_quietly(&folder, &["moving.toml", "-o", "static.exr"]);
        assert_eq!(bits(&folder, "static.exr"), bits(&folder, "out.005.exr"));
    }
}

#[test]
fn frames_have_the_same_bits_on_the_default_device_and_the_cpu() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "smooth");
    folder.run(&["render", "moving.toml", "--frames", "2-4", "-o", "any.#.exr"]);
    render_quietly(&folder, &["moving.toml", "--frames", "2-4", "-o", "cpu.#.exr"]);
    let read = |name: &str, frame: u32| bits(&folder, &format!("{name}.{frame}.exr"));
    for frame in 2..5 {
        assert_eq!(read("any", frame), read("cpu", frame));
    }
    assert_ne!(read("cpu", 2), read("cpu", 3));
}

#[test]
fn file_names_get_frame_numbers_and_folder_names_do_not() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "linear");
    fs::create_dir(folder.path("a##b")).unwrap();
    let arguments = [
        "moving.toml",
        "--frames",
        "8-12:2",
        "-o",
        "a##b/x#.png",
        "--aov",
        "normal",
        "--stats",
        "s##.json",
    ];
    render_quietly(&folder, &arguments);
    assert_eq!(
        folder.files(),
        ["a##b", "moving.toml", "s08.json", "s10.json", "s12.json"].map(String::from)
    );
    let inner = fs::read_dir(folder.path("a##b")).unwrap();
    let mut inner: Vec<_> = inner
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    inner.sort();
    let expected = [
        "x10.normal.png",
        "x10.png",
        "x12.normal.png",
        "x12.png",
        "x8.normal.png",
        "x8.png",
    ];
    assert_eq!(inner, expected);
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("s10.json")).unwrap();
    assert_eq!(stats["frame"], 10);
    // The default name is derived from the name of the scene file.
    fs::rename(folder.path("moving.toml"), folder.path("m#.toml")).unwrap();
    render_quietly(&folder, &["m#.toml", "--frames", "3,12345"]);
    render_quietly(&folder, &["m#.toml"]);
    let files = folder.files();
    for name in ["m#.0003.png", "m#.12345.png", "m#.png"] {
        assert!(files.contains(&name.to_owned()), "{files:?}");
    }
    // A single frame needs no number; without `--frames`, a # is literal.
    render_quietly(&folder, &["m#.toml", "--frames", "4", "-o", "one.png"]);
    render_quietly(&folder, &["m#.toml", "-o", "#.##.png"]);
    assert!(folder.files().contains(&"#.##.png".to_owned()));
}

#[test]
fn ambiguous_frame_names_are_rejected() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "linear");
    fs::create_dir(folder.path("a#")).unwrap();
    let rule = "needs # for the frame number, such as out.####.png, with 2 frames";
    for name in ["out.png", "a#/out.png", "-", "/dev/null"] {
        let format = ["moving.toml", "--frames", "1-2", "--format", "png", "-o", name];
        assert_rejected(&folder, &format, 2, &format!("--output: {name}: {rule}"));
    }
    let stats = ["moving.toml", "--frames", "1-2", "-o", "#.png", "--stats", "s.json"];
    assert_rejected(&folder, &stats, 2, &format!("--stats: s.json: {rule}"));
    let two_groups = ["moving.toml", "--frames", "1-2", "-o", "#.#.png"];
    assert_rejected(
        &folder,
        &two_groups,
        2,
        "--output: #.#.png: must have a single group of #",
    );
    // These names collide once the frame numbers are inserted.
    let colliding = ["moving.toml", "--frames", "1-12", "-o", "b#.png", "-o", "b1#.png"];
    assert_rejected(
        &folder,
        &colliding,
        2,
        "--output: b11.png: frames 1 and 11 would be written to this file",
    );
    // Errors of the last frame are reported before the first render.
    folder.write("2.exr", "");
    let mut mode = fs::metadata(folder.path("2.exr")).unwrap().permissions();
    mode.set_readonly(true);
    fs::set_permissions(folder.path("2.exr"), mode).unwrap();
    assert_rejected(
        &folder,
        &["moving.toml", "--frames", "1-2", "-o", "#.exr"],
        8,
        "2.exr: ",
    );
    image::RgbImage::new(2, 2).save(folder.path("t.2.png")).unwrap();
    let texture = format!("{SCENE}[textures.t]\ntype = 'image'\nfile = 't.2.png'\n");
    folder.write("textured.toml", &texture);
    let input = ["textured.toml", "--frames", "1-2", "-o", "t.#.png"];
    assert_rejected(&folder, &input, 2, "--output: t.2.png is an input of the scene");
    for (frames, message) in [
        (
            "",
            "frames and steps are whole numbers from 0 to 999999999, such as 5, 1-10, 1-10:2 or 1-3,7",
        ),
        ("-3", "frames and steps are whole numbers"),
        ("-3--1", "frames and steps are whole numbers"),
        ("2-1", "2-1 must be in ascending order, 1-2"),
        ("1-2:0", "1-2:0 needs a step of at least 1"),
        (
            "1-4000000000",
            "4000000000: frames and steps are whole numbers from 0 to 999999999",
        ),
        ("0-999999999", "must be at most 100000 frames"),
    ] {
        assert_rejected(&folder, &["moving.toml", "--frames", frames, "-o", "#.png"], 2, message);
    }
}

#[test]
fn ten_thousand_frames_of_which_most_exist_take_less_than_a_minute() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "smooth");
    let options = [
        "moving.toml",
        "--frames",
        "1-9999,10000",
        "--size",
        "1x1",
        "--spp",
        "1",
        "--light-samples",
        "1",
    ];
    let existing = png(1, &[[9; 4]]);
    for frame in 1..=10_000 {
        if frame % 20 != 7 {
            fs::write(folder.path(&format!("o.{frame:04}.png")), &existing).unwrap();
        }
    }
    let start = std::time::Instant::now();
    let arguments = [
        &["render"],
        &options[..],
        &["-o", "o.####.png", "--skip-existing"],
        &CPU,
    ]
    .concat();
    let result = folder.run(&arguments);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert_eq!(result.stderr, "note: skipped 9500 of 10000: the output files exist\n");
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
    for frame in 1..=10_000 {
        let is_rendered = folder.read(&format!("o.{frame:04}.png")) != existing;
        assert_eq!(is_rendered, frame % 20 == 7, "{frame}");
    }
    assert_eq!(folder.files().len(), 10_001);
}

#[test]
fn existing_frames_are_skipped_on_request() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "linear");
    let arguments = [
        "moving.toml",
        "--frames",
        "1-3",
        "-o",
        "#.png",
        "--aov",
        "normal",
        "--skip-existing",
    ];
    render_quietly(&folder, &arguments);
    let old = SystemTime::now() - Duration::from_secs(3600);
    let all = [
        "1.png",
        "2.png",
        "3.png",
        "1.normal.png",
        "2.normal.png",
        "3.normal.png",
    ];
    let make_old = |name: &str| {
        let file = fs::File::options().write(true).open(folder.path(name)).unwrap();
        file.set_modified(old).unwrap();
    };
    let is_old = |name: &str| fs::metadata(folder.path(name)).unwrap().modified().unwrap() == old;
    all.iter().copied().for_each(make_old);
    let assert_skipped = |message: &str| {
        let result = folder.run(&[&["render"], &arguments[..], &CPU].concat());
        assert_eq!((result.code, result.stderr.as_str()), (0, message));
    };
    assert_skipped("note: skipped 3 of 3: the output files exist\n");
    assert!(all.into_iter().all(is_old));
    // A frame is complete only if all of its files exist.
    fs::remove_file(folder.path("2.normal.png")).unwrap();
    assert_skipped("note: skipped 2 of 3: the output files exist\n");
    let rerendered: Vec<_> = all.into_iter().filter(|name| !is_old(name)).collect();
    assert_eq!(rerendered, ["2.png", "2.normal.png"]);
    // A statistics file counts as an output file; statistics on standard output do not.
    let with_stats = [&["render"], &arguments[..], &CPU, &["--stats", "#.json"]].concat();
    assert_eq!(folder.run(&with_stats).stderr, "");
    assert!(folder.run(&with_stats).stderr.starts_with("note: skipped 3 of 3"));
    let with_stats = [&["render"], &arguments[..], &CPU, &["--stats", "-"]].concat();
    let result = folder.run(&with_stats);
    assert!(
        result.stdout.is_empty() && result.stderr.starts_with("note: skipped 3 of 3"),
        "{}",
        result.stderr
    );
    all.iter().copied().for_each(make_old);
    render_quietly(&folder, &arguments[..7]);
    assert!(!all.into_iter().any(is_old));
    folder.write("p.png", "");
    let single = [
        &["render", "moving.toml", "-o", "p.png", "--skip-existing", "--quiet"],
        &CPU[..],
    ]
    .concat();
    folder.run_quietly(&single);
    let complete = folder.read("p.png");
    assert!(!complete.is_empty(), "an empty file counts as complete");
    folder.run_quietly(&single);
    assert_eq!(folder.read("p.png"), complete);
}

#[test]
fn invalid_cameras_are_rejected_before_the_first_frame() {
    let folder = TestFolder::new();
    let path = "fov = 40, path.keys = [{ frame = 1, position = [0, -5, 1] }, { frame = 7, position = [0, 5, 1] }] }";
    folder.write("through.toml", &SCENE.replace("fov = 40 }", path));
    let message = "through.toml:2: camera.path: at frame 4, look_at: [0, 0, 1] must differ from the camera's position";
    assert_rejected(&folder, &["through.toml", "--frames", "1-7", "-o", "#.png"], 3, message);
    render_quietly(&folder, &["through.toml", "--frames", "1-7:2", "-o", "#.png"]);
    let result = folder.run(&["check", "through.toml"]);
    assert_eq!(result.code, 3);
    assert!(result.stderr.contains(message), "{}", result.stderr);
    write_moving_scene(&folder, "linear");
    let result = folder.run(&["check", "moving.toml"]);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(
        result.stdout.ends_with("; the camera moves from frame 1 to 9\n"),
        "{}",
        result.stdout
    );
}

#[test]
fn a_failed_frame_ends_the_run_and_finished_frames_remain() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "linear");
    // /dev/full is a device, so the check before the render accepts it; writing the statistics of the second frame then
    // fails.
    #[cfg(target_os = "linux")]
    {
        std::os::unix::fs::symlink("/dev/full", folder.path("s.2.json")).unwrap();
        let arguments = ["moving.toml", "--frames", "1-3", "-o", "#.png", "--stats", "s.#.json"];
        let result = folder.run(&[&["render"], &arguments[..], &CPU].concat());
        assert_eq!(result.code, 8, "{}", result.stderr);
        assert!(result.stderr.contains("s.2.json"), "{}", result.stderr);
        let files = folder.files();
        assert!(
            files.contains(&"1.png".to_owned()) && !files.contains(&"3.png".to_owned()),
            "{files:?}"
        );
    }
}

#[test]
fn progress_and_notes_name_the_frame() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "linear");
    let result = folder.run(
        &[
            &["render", "moving.toml", "--frames", "3,5", "--progress", "plain"],
            &CPU[..],
        ]
        .concat(),
    );
    assert_eq!(result.code, 0);
    for message in ["frame 3 (1 of 2): 100 % done", "frame 5 (2 of 2): 100 % done"] {
        assert!(result.stderr.contains(message), "{}", result.stderr);
    }
    let result = folder.run_with(
        &["render", "small.toml", "--frames", "1-3", "--size", "2x2"],
        &NO_DRIVER,
    );
    let lines: Vec<&str> = result.stderr.lines().collect();
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert_eq!(lines.len(), 2, "{}", result.stderr);
    assert_eq!(lines[0], "warning: small.toml: no camera.path: all frames are equal");
    assert!(
        lines[1].starts_with("warning: rendering on the CPU: "),
        "{}",
        result.stderr
    );
}

#[cfg(unix)]
#[test]
fn a_signal_ends_the_render_of_all_frames() {
    let folder = TestFolder::new();
    write_moving_scene(&folder, "linear");
    let mut child = std::process::Command::new(super::program())
        .current_dir(folder.path("."))
        .args([
            "render",
            "moving.toml",
            "--frames",
            "1-2000",
            "--size",
            "100x100",
            "-o",
            "#.png",
        ])
        .args(CPU)
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let start = std::time::Instant::now();
    while !folder.path("3.png").exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "{:?}", folder.files());
        std::thread::sleep(Duration::from_millis(5));
    }
    let id = child.id().to_string();
    std::process::Command::new("kill")
        .args(["-TERM", &id])
        .status()
        .unwrap();
    let code = child.wait().unwrap().code();
    assert_eq!(code, Some(143));
    let files = folder.files();
    assert!(files.len() > 3 && files.len() < 1000, "{}", files.len());
    assert!(
        files.iter().all(|name| !name.starts_with('.')),
        "temporary files remain: {files:?}"
    );
}

#[test]
fn a_define_has_the_effect_of_an_edit_of_the_scene() {
    let folder = TestFolder::new();
    for (name, defines, edits) in [
        (
            "seed",
            &["render.seed=9"][..],
            &[("[render]", "[render]\nseed = 9")][..],
        ),
        ("shape", &["shapes[0].radius=0.5"], &[("radius = 0.8", "radius = 0.5")]),
        (
            "both",
            &["materials.gray.color=[1, 0, 0]", "camera.position.0=-1"],
            &[("[0.5, 0.4, 0.3]", "[1, 0, 0]"), ("[0, -5, 1]", "[-1, -5, 1]")],
        ),
    ] {
        let mut edited = SCENE.to_owned();
        for (from, to) in edits {
            assert!(edited.contains(from));
            edited = edited.replace(from, to);
        }
        folder.write("edited.toml", &edited);
        render_quietly(&folder, &["edited.toml", "-o", "edited.exr"]);
        let options: Vec<&str> = defines.iter().flat_map(|define| ["--define", define]).collect();
        render_quietly(&folder, &[&["small.toml", "-o", "defined.exr"], &options[..]].concat());
        assert_eq!(bits(&folder, "defined.exr"), bits(&folder, "edited.exr"), "{name}");
        render_quietly(&folder, &["small.toml", "-o", "plain.exr"]);
        assert_ne!(bits(&folder, "defined.exr"), bits(&folder, "plain.exr"), "{name}");
    }
    // A dedicated option takes precedence over `--define`.
    render_quietly(
        &folder,
        &["small.toml", "-o", "a.exr", "-D", "render.seed=9", "--seed", "4"],
    );
    render_quietly(&folder, &["small.toml", "-o", "b.exr", "--seed", "4"]);
    assert_eq!(bits(&folder, "a.exr"), bits(&folder, "b.exr"));
}

#[test]
fn invalid_defines_are_rejected() {
    let folder = TestFolder::new();
    for (define, message) in [
        (
            "camera.fov=wide",
            "error: --define camera.fov: \"wide\" must be a number\n",
        ),
        (
            "shapes[0].radius=-1",
            "error: --define shapes[0].radius: -1 must be from 1e-9 to 1e9",
        ),
        (
            "shapes[7].radius=1",
            "error: --define shapes[7]: does not exist; the length of the list is 2, and indices start at 0\n",
        ),
        (
            "materials.grey.color=[1,1,1]",
            "error: --define materials.grey: does not exist; did you mean \"gray\"?\n",
        ),
        (
            "film.iso=100",
            "error: --define film: unknown key; expected one of \"image\"",
        ),
        (
            "render",
            "render must be KEY=VALUE, such as render.seed=3 or shapes[2].radius=0.5",
        ),
        ("render.seed=", "render.seed: has no value after the ="),
    ] {
        assert_rejected(&folder, &["small.toml", "-o", "x.png", "--define", define], 2, message);
        let result = folder.run(&["check", "small.toml", "--define", define]);
        assert_eq!(
            (result.code, result.stdout.as_str()),
            (2, ""),
            "{define}: {}",
            result.stderr
        );
        assert!(result.stderr.contains(message), "{define}: {}", result.stderr);
    }
    folder.write("bad.toml", &SCENE.replace("radius = 0.8", "radius = -1"));
    assert_rejected(
        &folder,
        &["bad.toml", "-o", "x.png", "-D", "render.seed=3"],
        3,
        "bad.toml:22: shapes[0].radius: -1 must",
    );
    render_quietly(&folder, &["bad.toml", "-o", "x.png", "-D", "shapes[0].radius=1"]);
    // A message about a model file also names the option.
    folder.write("tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (define, message) in [
        (
            "camera.fov=1000",
            "--define camera.fov: 1000 must be from 0.001 to 179.999",
        ),
        ("image.width=0", "--define image.width: 0 must be from 1 to 65536"),
    ] {
        let result = folder.run(&["check", "tri.obj", "-D", define]);
        assert_eq!((result.code, result.stderr), (2, format!("error: {message}\n")));
    }
}

#[test]
fn json_scenes_support_frames_and_defines() {
    let folder = TestFolder::new();
    folder.write("floor.obj", "v -1 0 -1\nv 1 0 -1\nv 0 0 1\nf 1 3 2\n");
    let scene = r#"{ "spp": 4, "max_depth": 2, "image_resolution": [6, 4],
        "cam_config": { "position": [0, 2, 4], "look_at": [0, 0, 0], "ref_up": [0, 1, 0], "vertical_fov": 40 },
        "light_config": { "position": [0, 3, 0], "size": [1, 1], "radiance": [9, 9, 9] },
        "materials": [{ "name": "white", "type": "diffuse", "color": [0.5, 0.5, 0.5] }],
        "objects": [{ "obj_file_path": "floor.obj", "material_name": "white" }] }"#;
    folder.write("a.json", scene);
    folder.write(
        "b.json",
        &scene
            .replace("0.5, 0.5, 0.5", "0.5, 0.1, 0.5")
            .replace("\"spp\": 4", "\"spp\": 9"),
    );
    render_quietly(&folder, &["b.json", "-o", "b.exr"]);
    render_quietly(
        &folder,
        &[
            "a.json",
            "-o",
            "a.exr",
            "-D",
            "materials[0].color[1]=0.1",
            "-D",
            "spp=9",
        ],
    );
    assert_eq!(bits(&folder, "a.exr"), bits(&folder, "b.exr"));
    assert_rejected(
        &folder,
        &["a.json", "-D", "spp=0"],
        2,
        "--define spp: 0 must be from 1 to 65536",
    );
    assert_rejected(
        &folder,
        &["a.json", "-D", "camera.fov=3"],
        2,
        "--define camera: unknown key; expected one of \"spp\"",
    );
    let result = folder.run(&[&["render", "a.json", "--frames", "1-2", "-o", "f#.exr"], &CPU[..]].concat());
    assert_eq!(result.code, 0);
    assert_eq!(result.stderr, "warning: a.json: no camera.path: all frames are equal\n");
    assert_eq!(bits(&folder, "f1.exr"), bits(&folder, "f2.exr"));
}

#[test]
fn truncated_images_and_parts_are_rendered_again() {
    let folder = TestFolder::new();
    for name in ["a.png", "a.exr", "a.jpg", "a.webp", "a.part"] {
        let tile: &[&str] = if name == "a.part" { &["--tile", "1/2"] } else { &[] };
        let arguments = [&["render", "small.toml", "-o", name, "--skip-existing"], tile, &CPU].concat();
        let is_skipped = || {
            let result = folder.run(&arguments);
            assert_eq!(result.code, 0, "{name}: {}", result.stderr);
            result.stderr.contains("skipped 1 of 1")
        };
        assert!(!is_skipped(), "{name}");
        let complete = folder.read(name);
        for length in [0, 10, complete.len() / 2, complete.len() - 1] {
            fs::write(folder.path(name), &complete[..length]).unwrap();
            assert!(!is_skipped(), "{name} of {length} bytes");
            assert_eq!(folder.read(name), complete, "{name} of {length} bytes");
        }
        assert!(is_skipped(), "the complete {name} is rendered again");
    }
}
