//! `--environment`, `--background` and `--turntable`, which override parts of a scene.

use std::fs;

use super::{SCENE, TestFolder, read_png};

const BALL: &str = "image = { width = 12, height = 8 }\n\
                    camera = { position = [0, -4, 1], look_at = [0.5, 0, 0], fov = 40 }\n\
                    render = { integrator = 'path', pixel_samples = { count = 4 } }\n\
                    environment.color = [0.5, 0.5, 0.5]\n\
                    materials.m = { type = 'principled', base_color = [0.8, 0.4, 0.2] }\n\
                    shapes = [{ type = 'sphere', material = 'm', center = [0, 0, 0], radius = 1 }]\n";

fn ball() -> TestFolder {
    TestFolder::with_file("ball.toml", BALL)
}

fn quietly(place: &TestFolder, arguments: &[&str]) {
    place.quietly(&[&["render"], arguments, &["--device", "cpu"]].concat());
}

fn write_room(place: &TestFolder, name: &str) {
    let room = image::Rgb32FImage::from_fn(4, 2, |x, y| image::Rgb([1.0 + x as f32, 0.5, 0.25 + y as f32]));
    room.save(place.path(name)).unwrap();
}

#[test]
fn the_option_overrides_the_environment() {
    let place = ball();
    write_room(&place, "room.exr");
    fs::create_dir(place.path("sub")).unwrap();
    fs::copy(place.path("ball.toml"), place.path("sub/ball.toml")).unwrap();
    quietly(&place, &["ball.toml", "-o", "plain.exr"]);
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
        place.write("other.toml", &text);
        quietly(&place, &["other.toml", "-o", "other.exr"]);
        // The path is relative to the current folder, not to the scene.
        for scene in ["ball.toml", "sub/ball.toml"] {
            quietly(&place, &[scene, "--environment", option, "-o", "option.exr"]);
            assert_eq!(place.read("option.exr"), place.read("other.exr"), "{option} {scene}");
        }
        assert_ne!(place.read("option.exr"), place.read("plain.exr"), "{option}");
        let checked = place.run(&["check", "sub/ball.toml", "--environment", option]);
        assert_eq!((checked.code, checked.stderr.as_str()), (0, ""), "{option}");
    }
}

#[test]
fn a_background_emits_no_light() {
    let place = ball();
    quietly(&place, &["ball.toml", "-o", "plain.exr"]);
    quietly(
        &place,
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
    let (_, _, bytes) = read_png(&place.path("a.png"));
    assert_eq!(bytes[..3], [255, 128, 0]);
    let pixels = |name: &str| image::open(place.path(name)).unwrap().into_rgb32f();
    let (plain, colored) = (pixels("plain.exr"), pixels("a.exr"));
    let ball = |x: u32, y: u32| (4..6).contains(&x) && (3..5).contains(&y);
    let mut seen = 0;
    for (x, y, pixel) in plain.enumerate_pixels().filter(|(x, y, _)| ball(*x, *y)) {
        assert_eq!(pixel, colored.get_pixel(x, y), "the background changes the ball");
        seen += 1;
    }
    assert_eq!(seen, 4);
    assert_ne!(plain.get_pixel(0, 0), colored.get_pixel(0, 0));
    place.write("says.toml", &format!("{BALL}environment.background = [1, 0, 2]\n"));
    quietly(&place, &["says.toml", "-o", "says.exr"]);
    quietly(&place, &["ball.toml", "--background", "1,0,2", "-o", "option.exr"]);
    assert_eq!(place.read("says.exr"), place.read("option.exr"));
    quietly(&place, &["says.toml", "--background", "none", "-o", "none.png"]);
    let picture = image::open(place.path("none.png")).unwrap();
    assert!(picture.color().has_alpha());
    let alpha = |x, y| picture.to_rgba8().get_pixel(x, y).0[3];
    assert_eq!((alpha(0, 0), alpha(5, 4)), (0, 255));
    // The direct integrator has its own background key.
    place.write("small.toml", SCENE);
    place.write(
        "other.toml",
        &SCENE.replace("background = [0.2, 0.3, 2]", "background = [1, 0, 2]"),
    );
    quietly(&place, &["small.toml", "--background", "1,0,2", "-o", "option.exr"]);
    quietly(&place, &["other.toml", "-o", "other.exr"]);
    assert_eq!(place.read("option.exr"), place.read("other.exr"));
}

#[test]
fn invalid_environment_options_are_rejected() {
    let place = ball();
    place.write(
        "small.toml",
        &SCENE.replace("[render]", "[render]\nintegrator = 'phong'"),
    );
    place.write("text.hdr", "no image");
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
            "--environment: -3 must be finite, from 0 to 1e6",
        ),
        (
            ["small.toml", "--environment", "sky"],
            "--environment: needs integrator = \"path\"",
        ),
        (
            ["small.toml", "--background", "none"],
            "--background: none needs integrator = \"path\"",
        ),
        (
            ["ball.toml", "--background", "blue"],
            "must be none or a color, such as white",
        ),
        (
            ["ball.toml", "--background", "-1,0,0"],
            "--background: -1 must be finite, from 0 to 1e6",
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
        let before = place.files_but(|_| false);
        let ran = place.run(&[&["render"], &arguments[..]].concat());
        assert_eq!(
            (ran.code, ran.stdout.as_str()),
            (2, ""),
            "{arguments:?}: {}",
            ran.stderr
        );
        assert!(ran.stderr.contains(message), "{arguments:?}: {}\n{message}", ran.stderr);
        assert_eq!(place.files_but(|_| false), before, "{arguments:?}");
    }
    let panorama = BALL.replace("fov = 40 }", "type = 'panorama' }");
    place.write("panorama.toml", &panorama);
    let ran = place.run(&["render", "panorama.toml", "--turntable", "4"]);
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("--turntable: does not apply to a panorama camera"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_turntable_is_one_full_turn() {
    let place = ball();
    quietly(&place, &["ball.toml", "-o", "still.exr"]);
    quietly(&place, &["ball.toml", "--turntable", "4", "-o", "t.##.exr"]);
    quietly(
        &place,
        &["ball.toml", "--turntable", "4", "--frames", "3", "-o", "alone.exr"],
    );
    let names = ["t.01.exr", "t.02.exr", "t.03.exr", "t.04.exr"];
    let found = place.files_but(|name| !name.starts_with("t."));
    assert_eq!(found, names);
    // The first frame equals the still image. After a quarter turn the camera is at +x of the target, after a half turn
    // at +y.
    assert_eq!(place.read("t.01.exr"), place.read("still.exr"));
    assert_eq!(place.read("t.03.exr"), place.read("alone.exr"));
    let at = |position: &str, name: &str| {
        place.write(
            "at.toml",
            &BALL.replace("position = [0, -4, 1]", &format!("position = {position}")),
        );
        quietly(&place, &["at.toml", "-o", "at.exr"]);
        let pixels = |name: &str| image::open(place.path(name)).unwrap().into_rgb32f().into_raw();
        let differences = pixels("at.exr")
            .into_iter()
            .zip(pixels(name))
            .map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f32::max)
    };
    assert!(at("[4.5, -0.5, 1]", "t.02.exr") < 1e-3);
    assert!(at("[1, 4, 1]", "t.03.exr") < 1e-3);
    assert!(at("[-3.5, 0.5, 1]", "t.04.exr") < 1e-3);
    assert!(
        at("[-3.5, 0.5, 1]", "t.02.exr") > 0.1,
        "a different camera gives the same image"
    );
    let ran = place.run(&["render", "ball.toml", "--turntable", "4", "-o", "t.exr"]);
    assert_eq!(ran.code, 2);
    assert!(ran.stderr.contains("needs # for the frame number"), "{}", ran.stderr);
}
