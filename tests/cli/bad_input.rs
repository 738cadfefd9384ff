//! Invalid command lines and scenes: one message, the documented exit code, no output file.

use super::{NO_DRIVER, RunResult, SCENE, TestFolder};

#[track_caller]
fn assert_failed(folder: &TestFolder, result: &RunResult, code: i32, message: &str) {
    assert_eq!(result.code, code, "{}", result.stderr);
    assert_eq!(result.stdout, "");
    assert!(result.stderr.starts_with("error: "), "{}", result.stderr);
    assert!(
        result.stderr.contains(message),
        "'{message}' is not in: {}",
        result.stderr
    );
    assert!(folder.files().is_empty(), "these files remain: {:?}", folder.files());
}

#[test]
fn invalid_command_lines_exit_with_2() {
    let folder = TestFolder::new();
    let cases: [(&[&str], &str); 37] = [
        (&["--size", "64"], "--size"),
        (&["--size", "64x"], "--size"),
        (&["--size", "0x64"], "--size: 0 must be from 1 to 65536"),
        (&["--size", "64x65537"], "--size: 65537 must be from 1 to 65536"),
        (&["--size", "-1x4"], "-1"),
        (&["--spp", "0"], "--spp: 0 must be from 1"),
        (&["--spp", "many"], "must be a whole number"),
        (&["--spp", "4", "--pixel-samples", "4"], "cannot be used multiple times"),
        (
            &["--light-samples", "10"],
            "--light-samples: 10 must be a square number",
        ),
        (&["--seed", "-1"], "--seed"),
        (&["--seed", "4294967296"], "--seed"),
        (&["--crop", "0,0,10"], "--crop"),
        (&["--crop", "5,0,5,4"], "x0 must be less than x1"),
        (&["--crop", "0,4,5,3"], "y0 less than y1"),
        (
            &["--crop", "0,0,11,6"],
            "--crop: 0,0,11,6 must lie within the image of 10 x 6 pixels",
        ),
        (&["--crop", "0,6,10,7"], "--crop"),
        (&["--device", ""], "--device"),
        (&["--threads", "0"], "--threads"),
        (&["--aov", "normal,colour"], "colour"),
        (
            &["--aov", "albedo"],
            "--aov albedo: needs integrator = \"path\" (--integrator path)",
        ),
        (&["--pixel-pattern", "hexagonal"], "hexagonal"),
        (
            &["--pixel-pattern", "sobol", "--adaptive", "2"],
            "must be a number from 0 to 1",
        ),
        (
            &["--pixel-pattern", "grid", "--adaptive", "0.1"],
            "--adaptive: the pattern of pixel_samples",
        ),
        (&["--integrator", "paths"], "[possible values: phong, path]"),
        (&["--max-depth", "0"], "--max-depth: 0 must be from 1 to 64"),
        (&["--max-depth", "65"], "--max-depth: 65 must be from 1 to 64"),
        (
            &["--integrator", "path", "--max-depth", "1025"],
            "--max-depth: 1025 must be from 0 to 1024",
        ),
        (&["--max-depth", "-1"], "--max-depth"),
        (&["--max-depth", "deep"], "--max-depth"),
        (
            &["--integrator", "path", "--pixel-pattern", "grid", "--spp", "5"],
            "--spp: 5 must be a square number",
        ),
        (&["--progress", "loud"], "--progress"),
        (&["-q", "-v"], "cannot be used with"),
        (
            &["-o", "image.gif"],
            "image.gif: must end in .png, .exr, .jpg, .jpeg or .webp",
        ),
        (&["-o", "image"], "must end in .png, .exr"),
        (&["-o", ".png"], "must end in .png, .exr"),
        (&["another.toml"], "another.toml"),
        (&["--unknown"], "--unknown"),
    ];
    for (arguments, message) in cases {
        let result = folder.run(&[&["render", "small.toml"], arguments].concat());
        assert_failed(&folder, &result, 2, message);
    }
    for (arguments, message) in [
        (&["render"][..], "<SCENE>"),
        (&["check"], "<SCENE>..."),
        (&["paint"], "paint"),
    ] {
        assert_failed(&folder, &folder.run(arguments), 2, message);
    }
    assert_eq!(folder.run(&[]).code, 2);
}

#[test]
fn a_crop_is_checked_against_the_size_option() {
    let folder = TestFolder::new();
    folder.run_quietly(&["render", "small.toml", "--size", "20x20", "--crop", "0,0,11,7"]);
}

/// Covers a selection of rules; the tests of the parser cover every rule of scene files.
#[test]
fn invalid_scenes_exit_with_3_and_name_file_line_key_value_and_rule() {
    let cases = [
        (
            "radius = 0.8",
            "radius = -1",
            "bad.toml:22: shapes[0].radius: -1 must be",
        ),
        ("radius = 0.8", "radius = nan", "bad.toml:22: shapes[0].radius: "),
        ("radius = 0.8", "radius = ", "bad.toml:22:"),
        (
            "radius = 0.8",
            "radius = 0.8\ncolour = 1",
            "bad.toml:23: shapes[0].colour: ",
        ),
        ("radius = 0.8\n", "", "shapes[0]"),
        ("fov = 40", "fov = 180", "bad.toml:2: camera.fov: 180 must be"),
        ("fov = 40", "fov = 'wide'", "bad.toml:2: camera.fov: "),
        (
            "look_at = [0, 0, 1]",
            "look_at = [0, -5, 1]",
            "bad.toml:2: camera.look_at",
        ),
        (
            "width = 10",
            "width = 0",
            "bad.toml:1: image.width: 0 must be from 1 to 65536",
        ),
        (
            "width = 10",
            "width = 65537",
            "bad.toml:1: image.width: 65537 must be from 1 to 65536",
        ),
        (
            "count = 4",
            "count = 5",
            "bad.toml:7: render.light_samples.count: 5 must be a square number",
        ),
        ("material = \"gray\"", "material = \"grey\"", "shapes[0].material: "),
        ("tangent = [1, 0, 0]\ncolor", "tangent = [0, 0, 2]\ncolor", "lights[0]"),
        ("[render]", "[render", "bad.toml:3:"),
    ];
    for (from, to, message) in cases {
        let folder = TestFolder::new();
        assert!(SCENE.contains(from), "{from}");
        let scene = folder.path("small.toml").with_file_name("bad.toml");
        let text = SCENE.replacen(from, to, 1);
        for command in ["render", "check"] {
            std::fs::write(&scene, &text).unwrap();
            let result = folder.run(&[command, "bad.toml"]);
            std::fs::remove_file(&scene).unwrap();
            assert_failed(&folder, &result, 3, message);
            assert!(
                result.stderr.starts_with("error: bad.toml"),
                "the message does not start with the file: {}",
                result.stderr
            );
        }
    }
}

/// An error that the option causes is reported with the line of the scene file.
#[test]
fn an_integrator_option_validates_the_scene() {
    let folder = TestFolder::new();
    let scene = folder.path("small.toml");
    for (from, to, message) in [
        (
            "[render]",
            "[render]\nintegrator = 'path'\nalpha = true",
            "small.toml:5: render.alpha: needs integrator = \"path\"",
        ),
        (
            "[render]",
            "[render]\nintegrator = 'path'\nmax_depth = 65",
            "small.toml:5: render.max_depth: 65 must be from 1 to 64",
        ),
        (
            "[materials.gray]",
            "[environment]\ncolor = [1, 1, 1]\n[materials.gray]",
            "small.toml:8: environment: needs integrator = \"path\"",
        ),
        (
            "\"phong\"",
            "\"diffuse\"",
            "small.toml:9: materials.gray.type: \"diffuse\" needs integrator = \"path\"",
        ),
    ] {
        assert!(SCENE.contains(from), "{from}");
        std::fs::write(&scene, SCENE.replacen(from, to, 1)).unwrap();
        let result = folder.run(&["render", "small.toml", "--integrator", "phong"]);
        assert_failed(&folder, &result, 3, message);
    }
}

#[test]
fn a_missing_scene_exits_with_3() {
    let folder = TestFolder::new();
    for command in ["render", "check"] {
        assert_failed(
            &folder,
            &folder.run(&[command, "none.toml"]),
            3,
            "none.toml: cannot be read",
        );
    }
}

#[test]
fn the_check_continues_after_an_invalid_scene() {
    let folder = TestFolder::new();
    let result = folder.run(&["check", "none.toml", "small.toml"]);
    assert_eq!(result.code, 3);
    assert!(result.stderr.contains("none.toml") && result.stdout.starts_with("small.toml: ok"));
}

#[test]
fn a_missing_device_exits_with_4() {
    let folder = TestFolder::new();
    let result = folder.run(&["render", "small.toml", "--device", "abacus"]);
    assert_failed(
        &folder,
        &result,
        4,
        "no adapter's name, driver or type contains 'abacus'; available: cpu, gpu, auto, 1: ",
    );
    for device in ["gpu", "lavapipe"] {
        let result = folder.run_with(&["render", "small.toml", "--device", device], &NO_DRIVER);
        assert_failed(&folder, &result, 4, "apt-get install mesa-vulkan-drivers");
    }
}
