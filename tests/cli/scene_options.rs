//! `--environment`, `--background` and `--turntable`, which override values of a scene.

use std::fs;

use super::{SCENE, TestFolder, read_png};

const BALL: &str = "image = { width = 12, height = 8 }\n\
                    camera = { position = [0, -4, 1], look_at = [0.5, 0, 0], fov = 40 }\n\
                    render = { integrator = 'path', pixel_samples = { count = 4 } }\n\
                    environment.color = [0.5, 0.5, 0.5]\n\
                    materials.m = { type = 'principled', base_color = [0.8, 0.4, 0.2] }\n\
                    shapes = [{ type = 'sphere', material = 'm', center = [0, 0, 0], radius = 1 }]\n";

fn folder_with_ball() -> TestFolder {
    TestFolder::with_file("ball.toml", BALL)
}

fn render_quietly(folder: &TestFolder, arguments: &[&str]) {
    folder.run_quietly(&[&["render"], arguments, &["--device", "cpu"]].concat());
}

fn write_environment_map(folder: &TestFolder, name: &str) {
    let room = image::Rgb32FImage::from_fn(4, 2, |x, y| image::Rgb([1.0 + x as f32, 0.5, 0.25 + y as f32]));
    room.save(folder.path(name)).unwrap();
}

#[test]
fn the_option_overrides_the_environment() {
    let folder = folder_with_ball();
    write_environment_map(&folder, "room.exr");
    fs::create_dir(folder.path("sub")).unwrap();
    fs::copy(folder.path("ball.toml"), folder.path("sub/ball.toml")).unwrap();
    render_quietly(&folder, &["ball.toml", "-o", "plain.exr"]);
    for (option, key) in [
        ("room.exr", "file = 'room.exr'"),
        ("studio", "name = 'studio'"),
        ("sky", "name = 'sky'"),
        ("1,2,0.5", "color = [1, 2, 0.5]"),
        ("#ffffff", "color = [1, 1, 1]"),
    ] {
        let text = BALL.replace(
            "environment.color = [0.5, 0.5, 0.5]",
            &format!("environment = {{ {key} }}"),
        );
        folder.write("other.toml", &text);
        render_quietly(&folder, &["other.toml", "-o", "other.exr"]);
        // The path is relative to the current folder, not to the scene.
        for scene in ["ball.toml", "sub/ball.toml"] {
            render_quietly(&folder, &[scene, "--environment", option, "-o", "option.exr"]);
            assert_eq!(folder.read("option.exr"), folder.read("other.exr"), "{option} {scene}");
        }
        assert_ne!(folder.read("option.exr"), folder.read("plain.exr"), "{option}");
        let checked = folder.run(&["check", "sub/ball.toml", "--environment", option]);
        assert_eq!((checked.code, checked.stderr.as_str()), (0, ""), "{option}");
    }
}

#[test]
fn a_background_emits_no_light() {
    let folder = folder_with_ball();
    render_quietly(&folder, &["ball.toml", "-o", "plain.exr"]);
    render_quietly(
        &folder,
        &[
            "ball.toml",
            "--background",
            "#ff8000",
            "--view-transform",
            "srgb",
            "-o",
            "a.png",
            "-o",
            "a.exr",
        ],
    );
    let (_, _, bytes) = read_png(&folder.path("a.png"));
    assert_eq!(bytes[..3], [255, 128, 0]);
    let pixels = |name: &str| image::open(folder.path(name)).unwrap().into_rgb32f();
    let (default_image, colored) = (pixels("plain.exr"), pixels("a.exr"));
    let is_ball = |x: u32, y: u32| (4..6).contains(&x) && (3..5).contains(&y);
    let mut compared = 0;
    for (x, y, pixel) in default_image.enumerate_pixels().filter(|(x, y, _)| is_ball(*x, *y)) {
        assert_eq!(pixel, colored.get_pixel(x, y), "the background changes the ball");
        compared += 1;
    }
    assert_eq!(compared, 4);
    assert_ne!(default_image.get_pixel(0, 0), colored.get_pixel(0, 0));
    folder.write("keyed.toml", &format!("{BALL}environment.background = [1, 0, 2]\n"));
    render_quietly(&folder, &["keyed.toml", "-o", "keyed.exr"]);
    render_quietly(&folder, &["ball.toml", "--background", "1,0,2", "-o", "option.exr"]);
    assert_eq!(folder.read("keyed.exr"), folder.read("option.exr"));
    render_quietly(&folder, &["keyed.toml", "--background", "none", "-o", "none.png"]);
    let picture = image::open(folder.path("none.png")).unwrap();
    assert!(picture.color().has_alpha());
    let alpha = |x, y| picture.to_rgba8().get_pixel(x, y).0[3];
    assert_eq!((alpha(0, 0), alpha(5, 4)), (0, 255));
    // The direct integrator has its own background key.
    folder.write("small.toml", SCENE);
    folder.write(
        "other.toml",
        &SCENE.replace("background = [0.2, 0.3, 2]", "background = [1, 0, 2]"),
    );
    render_quietly(&folder, &["small.toml", "--background", "1,0,2", "-o", "option.exr"]);
    render_quietly(&folder, &["other.toml", "-o", "other.exr"]);
    assert_eq!(folder.read("option.exr"), folder.read("other.exr"));
}

#[test]
fn invalid_environment_options_are_rejected() {
    let folder = folder_with_ball();
    folder.write(
        "small.toml",
        &SCENE.replace("[render]", "[render]\nintegrator = 'phong'"),
    );
    folder.write("text.hdr", "no image");
    for (arguments, message) in [
        (["ball.toml", "--environment", "none.hdr"], "--environment: \""),
        (
            ["ball.toml", "--environment", "none.hdr"],
            "none.hdr\" cannot be read: No such file",
        ),
        (
            ["ball.toml", "--environment", "text.hdr"],
            "text.hdr\" must be a PNG, JPEG, WebP, KTX2, EXR or HDR file",
        ),
        (
            ["ball.toml", "--environment", "#12"],
            "must be studio, sky, an image file (.hdr, .exr, .png, .jpg) or a color",
        ),
        (
            ["ball.toml", "--environment", "1,2,-3"],
            "--environment: -3 must be from 0 to 1e6",
        ),
        (
            ["small.toml", "--environment", "sky"],
            "--environment: needs integrator = \"path\"",
        ),
        (
            ["small.toml", "--background", "none"],
            "--background: transparency needs integrator = \"path\"",
        ),
        (
            ["ball.toml", "--background", "blue"],
            "must be none or a color, such as white",
        ),
        (
            ["ball.toml", "--background", "-1,0,0"],
            "--background: -1 must be from 0 to 1e6",
        ),
        (
            ["ball.toml", "--turntable", "0"],
            "must be a whole number from 1 to 100000",
        ),
        (
            ["ball.toml", "--turntable", "100001"],
            "must be a whole number from 1 to 100000",
        ),
    ] {
        let before = folder.files_except(|_| false);
        let result = folder.run(&[&["render"], &arguments[..]].concat());
        assert_eq!(
            (result.code, result.stdout.as_str()),
            (2, ""),
            "{arguments:?}: {}",
            result.stderr
        );
        assert!(
            result.stderr.contains(message),
            "{arguments:?}: {}\n{message}",
            result.stderr
        );
        assert_eq!(folder.files_except(|_| false), before, "{arguments:?}");
    }
    let panorama = BALL.replace("fov = 40 }", "type = 'panorama' }");
    folder.write("panorama.toml", &panorama);
    let result = folder.run(&["render", "panorama.toml", "--turntable", "4"]);
    assert_eq!(result.code, 2, "{}", result.stderr);
    assert!(
        result
            .stderr
            .contains("--turntable: does not apply to a panorama camera"),
        "{}",
        result.stderr
    );
}

#[test]
fn a_turntable_is_one_full_turn() {
    let folder = folder_with_ball();
    render_quietly(&folder, &["ball.toml", "-o", "still.exr"]);
    render_quietly(&folder, &["ball.toml", "--turntable", "4", "-o", "t.##.exr"]);
    render_quietly(
        &folder,
        &["ball.toml", "--turntable", "4", "--frames", "3", "-o", "alone.exr"],
    );
    let names = ["t.01.exr", "t.02.exr", "t.03.exr", "t.04.exr"];
    let found = folder.files_except(|name| !name.starts_with("t."));
    assert_eq!(found, names);
    // The first frame equals the still image. The camera is at +x of the look-at point after a quarter turn and at +y
    // after half a turn.
    assert_eq!(folder.read("t.01.exr"), folder.read("still.exr"));
    assert_eq!(folder.read("t.03.exr"), folder.read("alone.exr"));
    let max_difference = |position: &str, name: &str| {
        folder.write(
            "at.toml",
            &BALL.replace("position = [0, -4, 1]", &format!("position = {position}")),
        );
        render_quietly(&folder, &["at.toml", "-o", "at.exr"]);
        let pixels = |name: &str| image::open(folder.path(name)).unwrap().into_rgb32f().into_raw();
        let differences = pixels("at.exr")
            .into_iter()
            .zip(pixels(name))
            .map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f32::max)
    };
    assert!(max_difference("[4.5, -0.5, 1]", "t.02.exr") < 1e-3);
    assert!(max_difference("[1, 4, 1]", "t.03.exr") < 1e-3);
    assert!(max_difference("[-3.5, 0.5, 1]", "t.04.exr") < 1e-3);
    assert!(
        max_difference("[-3.5, 0.5, 1]", "t.02.exr") > 0.1,
        "the image does not depend on the camera"
    );
    let result = folder.run(&["render", "ball.toml", "--turntable", "4", "-o", "t.exr"]);
    assert_eq!(result.code, 2);
    assert!(
        result.stderr.contains("needs # for the frame number"),
        "{}",
        result.stderr
    );
}
