//! Effects of the options of `wgray render`.

use wgray::image::read_exr;

use super::{NO_DRIVER, SCENE, TestFolder, read_png};

#[test]
fn options_override_the_values_of_the_scene() {
    let folder = TestFolder::new();
    let cases: [(&[&str], &str, &str); 5] = [
        (&["--size", "13x4"], "width = 10, height = 6", "width = 13, height = 4"),
        (&["--spp", "2"], "count = 3", "count = 2"),
        (&["--pixel-samples", "2"], "count = 3", "count = 2"),
        (&["--light-samples", "9"], "count = 4", "count = 9"),
        (&["--seed", "4294967295"], "[render]", "[render]\nseed = 4294967295"),
    ];
    folder.run_quietly(&["render", "small.toml", "-o", "plain.exr"]);
    for (options, from, to) in cases {
        folder.write("other.toml", &SCENE.replace(from, to));
        folder.run_quietly(&["render", "other.toml", "--output", "other.exr"]);
        folder.run_quietly(&[&["render", "small.toml", "-o", "option.exr"], options].concat());
        assert_eq!(folder.read("option.exr"), folder.read("other.exr"), "{options:?}");
        assert_ne!(
            folder.read("option.exr"),
            folder.read("plain.exr"),
            "{options:?} has no effect"
        );
    }
}

#[test]
fn the_max_depth_option_overrides_the_scene() {
    let folder = TestFolder::new();
    // With a depth of 1, light does not leave the glass.
    let ball = SCENE.replacen("material = \"gray\"", "material = \"glass\"", 1);
    let ball = ball.replace(
        "[materials.gray]",
        "[materials.glass]\ntype = \"glass\"\nior = 1.5\n[materials.gray]",
    );
    folder.write("ball.toml", &ball);
    folder.write("other.toml", &ball.replace("[render]", "[render]\nmax_depth = 1"));
    folder.run_quietly(&["render", "ball.toml", "-o", "plain.exr"]);
    folder.run_quietly(&["render", "ball.toml", "-o", "option.exr", "--max-depth", "1"]);
    folder.run_quietly(&["render", "other.toml", "-o", "other.exr"]);
    assert_eq!(folder.read("option.exr"), folder.read("other.exr"));
    assert_ne!(folder.read("option.exr"), folder.read("plain.exr"));
}

/// The option and the key cause the same warnings about keys without effect.
#[test]
fn the_integrator_option_overrides_the_scene() {
    let folder = TestFolder::new();
    let path = SCENE.replace("[render]", "[render]\nintegrator = \"path\"\nmax_depth = 0");
    folder.write("path.toml", &path);
    let option = ["--integrator", "path", "--max-depth", "0", "--device", "cpu"];
    let result = folder.run(&[&["render", "small.toml", "-o", "option.exr"], &option[..]].concat());
    assert_eq!((result.code, result.stdout.as_str()), (0, ""), "{}", result.stderr);
    let lines: Vec<&str> = result.stderr.lines().collect();
    assert_eq!(lines.len(), 3, "{}", result.stderr);
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
    folder.run_quietly(&["render", "path.toml", "-q", "-o", "file.exr", "--device", "cpu"]);
    assert_eq!(folder.read("option.exr"), folder.read("file.exr"));
    let checked = folder.run(&["check", "path.toml"]);
    assert_eq!(checked.code, 0);
    assert_eq!(checked.stderr, result.stderr.replace("small.toml", "path.toml"));
}

#[test]
fn a_crop_has_the_pixels_of_the_full_image() {
    let folder = TestFolder::new();
    folder.run_quietly(&["render", "small.toml", "-o", "whole.exr"]);
    folder.run_quietly(&["render", "small.toml", "-o", "whole.png"]);
    folder.run_quietly(&["render", "small.toml", "-o", "part.exr", "--crop", "2,1,9,5"]);
    folder.run_quietly(&["render", "small.toml", "-o", "part.png", "--crop", "2,1,9,5"]);
    let (full, crop) = (
        read_exr(&folder.path("whole.exr")).unwrap(),
        read_exr(&folder.path("part.exr")).unwrap(),
    );
    let expected: Vec<[f32; 3]> = full
        .colors
        .chunks(10)
        .skip(1)
        .take(4)
        .flat_map(|row| row[2..9].to_vec())
        .collect();
    assert_eq!((crop.width, crop.height, crop.colors), (7, 4, expected));
    let (_, _, full) = read_png(&folder.path("whole.png"));
    let expected: Vec<u8> = full
        .chunks(30)
        .skip(1)
        .take(4)
        .flat_map(|row| row[6..27].to_vec())
        .collect();
    assert_eq!(read_png(&folder.path("part.png")), (7, 4, expected));
}

#[test]
fn devices_are_selected_by_kind_and_by_part_of_a_name() {
    let folder = TestFolder::new();
    folder.run_quietly(&["render", "small.toml", "--reproducible", "-o", "auto.exr"]);
    let listed = folder.run(&["devices"]).stdout;
    let mut names = vec!["gpu", "cpu", "auto"];
    if listed.contains("llvmpipe") {
        names.extend(["lavapipe", "LAVApipe", "llvmp", "software"]);
    }
    for name in names {
        folder.run_quietly(&[
            "render",
            "small.toml",
            "--reproducible",
            "-o",
            "named.exr",
            "--device",
            name,
        ]);
        assert_eq!(folder.read("named.exr"), folder.read("auto.exr"), "{name}");
    }
}

/// Software Vulkan and the CPU round quotients and square roots correctly, so `--exact-rounding` has no effect.
#[test]
fn exact_rounding_does_not_change_images_of_software_vulkan_and_the_cpu() {
    let folder = TestFolder::new();
    for device in ["gpu", "cpu"] {
        let arguments = ["render", "small.toml", "--device", device, "-o"];
        folder.run_quietly(&[&arguments[..], &["default.exr"]].concat());
        folder.run_quietly(&[&arguments[..], &["exact.exr", "--exact-rounding"]].concat());
        assert_eq!(folder.read("default.exr"), folder.read("exact.exr"), "{device}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_image() {
    let folder = TestFolder::new();
    folder.run_quietly(&["render", "small.toml", "--reproducible", "-o", "all.exr"]);
    for (device, threads) in [("gpu", "1"), ("cpu", "1"), ("cpu", "3")] {
        folder.run_quietly(&[
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
        assert_eq!(folder.read("some.exr"), folder.read("all.exr"), "{device} {threads}");
    }
    let stats = ["--stats", "stats.json", "--device", "cpu", "--threads", "3"];
    folder.run_quietly(&[&["render", "small.toml"], &stats[..]].concat());
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
    assert!(stats["driver"].as_str().unwrap().ends_with("3 threads"), "{stats}");
}

#[test]
fn progress_is_printed_as_requested() {
    let folder = TestFolder::new();
    let result = folder.run(&["render", "small.toml", "--progress", "plain"]);
    assert_eq!((result.code, result.stdout.as_str()), (0, ""));
    assert!(result.stderr.contains("100 % done after"), "{}", result.stderr);
    folder.run_quietly(&["render", "small.toml", "--progress", "none"]);
    folder.run_quietly(&["render", "small.toml", "--progress", "auto"]); // standard error is not a terminal here
    folder.run_quietly(&["render", "small.toml", "--progress", "plain", "-q"]);
    let verbose = folder.run(&["render", "small.toml", "-v"]);
    assert_eq!((verbose.code, verbose.stdout.as_str()), (0, ""));
    assert!(verbose.stderr.contains("ready seconds="), "{}", verbose.stderr);
}

#[test]
fn without_a_driver_auto_renders_on_the_cpu_with_a_one_line_warning() {
    let folder = TestFolder::new();
    folder.run_quietly(&["render", "small.toml", "--reproducible", "-o", "gpu.exr"]);
    let result = folder.run_with(&["render", "small.toml", "--reproducible", "-o", "cpu.exr"], &NO_DRIVER);
    assert_eq!((result.code, result.stdout.as_str()), (0, ""));
    assert_eq!(result.stderr.lines().count(), 1, "{}", result.stderr);
    assert!(
        result.stderr.contains("on the CPU") && result.stderr.contains("mesa-vulkan-drivers"),
        "{}",
        result.stderr
    );
    assert_eq!(folder.read("cpu.exr"), folder.read("gpu.exr"));
    let quiet = folder.run_with(&["render", "small.toml", "-o", "cpu.exr", "--quiet"], &NO_DRIVER);
    assert_eq!((quiet.code, quiet.stderr.as_str()), (0, ""));
    let cpu = folder.run_with(
        &["render", "small.toml", "-o", "cpu.exr", "--device", "cpu"],
        &NO_DRIVER,
    );
    assert_eq!((cpu.code, cpu.stderr.as_str()), (0, ""));
}
