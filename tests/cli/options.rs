//! The effect of each option of `render`.

use wgray::image::read_exr;

use super::{NO_DRIVER, SCENE, TestFolder, read_png};

#[test]
fn options_override_the_values_of_the_scene() {
    let place = TestFolder::new();
    let cases: [(&[&str], &str, &str); 5] = [
        (&["--size", "13x4"], "width = 10, height = 6", "width = 13, height = 4"),
        (&["--spp", "2"], "count = 3", "count = 2"),
        (&["--pixel-samples", "2"], "count = 3", "count = 2"),
        (&["--light-samples", "9"], "count = 4", "count = 9"),
        (&["--seed", "4294967295"], "[render]", "[render]\nseed = 4294967295"),
    ];
    place.quietly(&["render", "small.toml", "-o", "plain.exr"]);
    for (options, from, to) in cases {
        place.write("other.toml", &SCENE.replace(from, to));
        place.quietly(&["render", "other.toml", "--output", "other.exr"]);
        place.quietly(&[&["render", "small.toml", "-o", "option.exr"], options].concat());
        assert_eq!(place.read("option.exr"), place.read("other.exr"), "{options:?}");
        assert_ne!(
            place.read("option.exr"),
            place.read("plain.exr"),
            "{options:?} changes something"
        );
    }
}

#[test]
fn the_option_sets_the_maximum_depth() {
    let place = TestFolder::new();
    // With a depth of 1, light does not leave the glass.
    let ball = SCENE.replacen("material = \"gray\"", "material = \"glass\"", 1);
    let ball = ball.replace(
        "[materials.gray]",
        "[materials.glass]\ntype = \"glass\"\nior = 1.5\n[materials.gray]",
    );
    place.write("ball.toml", &ball);
    place.write("other.toml", &ball.replace("[render]", "[render]\nmax_depth = 1"));
    place.quietly(&["render", "ball.toml", "-o", "plain.exr"]);
    place.quietly(&["render", "ball.toml", "-o", "option.exr", "--max-depth", "1"]);
    place.quietly(&["render", "other.toml", "-o", "other.exr"]);
    assert_eq!(place.read("option.exr"), place.read("other.exr"));
    assert_ne!(place.read("option.exr"), place.read("plain.exr"));
}

/// The option and the key give the same warning about ignored keys.
#[test]
fn the_integrator_option_overrides_the_scene() {
    let place = TestFolder::new();
    let path = SCENE.replace("[render]", "[render]\nintegrator = \"path\"\nmax_depth = 0");
    place.write("path.toml", &path);
    let option = ["--integrator", "path", "--max-depth", "0", "--device", "cpu"];
    let ran = place.run(&[&["render", "small.toml", "-o", "option.exr"], &option[..]].concat());
    assert_eq!((ran.code, ran.stdout.as_str()), (0, ""), "{}", ran.stderr);
    let lines: Vec<&str> = ran.stderr.lines().collect();
    assert_eq!(lines.len(), 3, "{}", ran.stderr);
    assert!(lines[2].contains("render.max_depth is 0"), "{}", lines[2]);
    assert!(
        lines[0].starts_with("warning: small.toml: render.ambient: no effect"),
        "{}",
        lines[0]
    );
    assert!(
        lines[1].starts_with("warning: small.toml: render.light_samples: no effect"),
        "{}",
        lines[1]
    );
    place.quietly(&["render", "path.toml", "-q", "-o", "file.exr", "--device", "cpu"]);
    assert_eq!(place.read("option.exr"), place.read("file.exr"));
    let checked = place.run(&["check", "path.toml"]);
    assert_eq!(checked.code, 0);
    assert_eq!(checked.stderr, ran.stderr.replace("small.toml", "path.toml"));
}

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let place = TestFolder::new();
    place.quietly(&["render", "small.toml", "-o", "whole.exr"]);
    place.quietly(&["render", "small.toml", "-o", "whole.png"]);
    place.quietly(&["render", "small.toml", "-o", "part.exr", "--crop", "2,1,9,5"]);
    place.quietly(&["render", "small.toml", "-o", "part.png", "--crop", "2,1,9,5"]);
    let (whole, part) = (
        read_exr(&place.path("whole.exr")).unwrap(),
        read_exr(&place.path("part.exr")).unwrap(),
    );
    let cut: Vec<[f32; 3]> = whole
        .colors
        .chunks(10)
        .skip(1)
        .take(4)
        .flat_map(|row| row[2..9].to_vec())
        .collect();
    assert_eq!((part.width, part.height, part.colors), (7, 4, cut));
    let (_, _, whole) = read_png(&place.path("whole.png"));
    let cut: Vec<u8> = whole
        .chunks(30)
        .skip(1)
        .take(4)
        .flat_map(|row| row[6..27].to_vec())
        .collect();
    assert_eq!(read_png(&place.path("part.png")), (7, 4, cut));
}

#[test]
fn devices_are_selected_by_kind_and_by_part_of_a_name() {
    let place = TestFolder::new();
    place.quietly(&["render", "small.toml", "--reproducible", "-o", "auto.exr"]);
    let listed = place.run(&["devices"]).stdout;
    let mut names = vec!["gpu", "cpu", "auto"];
    if listed.contains("llvmpipe") {
        names.extend(["lavapipe", "LAVApipe", "llvmp", "software"]);
    }
    for name in names {
        place.quietly(&[
            "render",
            "small.toml",
            "--reproducible",
            "-o",
            "named.exr",
            "--device",
            name,
        ]);
        assert_eq!(place.read("named.exr"), place.read("auto.exr"), "{name}");
    }
}

/// Software Vulkan rounds quotients and square roots correctly, so the option has no effect.
#[test]
fn rounding_in_software_gives_the_same_image() {
    let place = TestFolder::new();
    for device in ["auto", "cpu"] {
        let arguments = ["render", "small.toml", "--device", device, "-o"];
        place.quietly(&[&arguments[..], &["own.exr"]].concat());
        place.quietly(&[&arguments[..], &["exact.exr", "--exact-rounding"]].concat());
        assert_eq!(place.read("own.exr"), place.read("exact.exr"), "{device}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_image() {
    let place = TestFolder::new();
    place.quietly(&["render", "small.toml", "--reproducible", "-o", "all.exr"]);
    for (device, threads) in [("auto", "1"), ("cpu", "1"), ("cpu", "3")] {
        place.quietly(&[
            "render",
            "small.toml",
            "--reproducible",
            "-o",
            "some.exr",
            "--device",
            device,
            "--threads",
            threads,
        ]);
        assert_eq!(place.read("some.exr"), place.read("all.exr"), "{device} {threads}");
    }
    let stats = ["--stats", "stats.json", "--device", "cpu", "--threads", "3"];
    place.quietly(&[&["render", "small.toml"], &stats[..]].concat());
    let stats: serde_json::Value = serde_json::from_slice(&place.read("stats.json")).unwrap();
    assert!(stats["driver"].as_str().unwrap().ends_with("3 threads"), "{stats}");
}

#[test]
fn progress_is_printed_as_requested() {
    let place = TestFolder::new();
    let plain = place.run(&["render", "small.toml", "--progress", "plain"]);
    assert_eq!((plain.code, plain.stdout.as_str()), (0, ""));
    assert!(plain.stderr.contains("100 % done after"), "{}", plain.stderr);
    place.quietly(&["render", "small.toml", "--progress", "none"]);
    place.quietly(&["render", "small.toml", "--progress", "auto"]); // standard error is not a terminal here
    place.quietly(&["render", "small.toml", "--progress", "plain", "-q"]);
    let verbose = place.run(&["render", "small.toml", "-v"]);
    assert_eq!((verbose.code, verbose.stdout.as_str()), (0, ""));
    assert!(verbose.stderr.contains("ready seconds="), "{}", verbose.stderr);
}

#[test]
fn without_a_driver_auto_renders_on_the_cpu_with_a_one_line_warning() {
    let place = TestFolder::new();
    place.quietly(&["render", "small.toml", "--reproducible", "-o", "gpu.exr"]);
    let ran = place.run_with(&["render", "small.toml", "--reproducible", "-o", "cpu.exr"], &NO_DRIVER);
    assert_eq!((ran.code, ran.stdout.as_str()), (0, ""));
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("on the CPU") && ran.stderr.contains("mesa-vulkan-drivers"),
        "{}",
        ran.stderr
    );
    assert_eq!(place.read("cpu.exr"), place.read("gpu.exr"));
    let quiet = place.run_with(&["render", "small.toml", "-o", "cpu.exr", "--quiet"], &NO_DRIVER);
    assert_eq!((quiet.code, quiet.stderr.as_str()), (0, ""));
    let cpu = place.run_with(
        &["render", "small.toml", "-o", "cpu.exr", "--device", "cpu"],
        &NO_DRIVER,
    );
    assert_eq!((cpu.code, cpu.stderr.as_str()), (0, ""));
}
