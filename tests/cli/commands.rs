//! Commands other than `render`, and the help.

use super::{NO_DRIVER, TestFolder, project_scene};

#[test]
fn devices_are_listed() {
    let place = TestFolder::new();
    let ran = place.run(&["devices"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    for word in ["driver", "largest buffer", "cpu", "auto selects: "] {
        assert!(ran.stdout.contains(word), "{word} is missing in {}", ran.stdout);
    }
    assert!(!ran.stdout.contains("auto selects: cpu"));
    let none = place.run_with(&["devices"], &NO_DRIVER);
    assert_eq!(none.code, 0);
    assert!(none.stdout.contains("auto selects: cpu") && none.stdout.contains("mesa-vulkan-drivers"));
}

#[test]
fn valid_scenes_pass_the_check_without_a_device() {
    let place = TestFolder::new();
    let cornell = project_scene("cornell.toml");
    let ran = place.run_with(&["check", "small.toml", &cornell], &NO_DRIVER);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let lines: Vec<&str> = ran.stdout.lines().collect();
    assert_eq!(lines.len(), 2);
    assert!(
        lines[0].starts_with(
            "small.toml: ok: 10 x 6 pixels, 3 samples per pixel, 4 light samples, phong; 2 shapes; 1 light"
        ),
        "{}",
        lines[0]
    );
    assert!(place.files().is_empty());
}

#[test]
fn a_check_warns_of_scenes_that_render_black() {
    let place = TestFolder::new();
    let (start, lit) = super::SCENE.split_once("[[lights]]").unwrap();
    let (_, shapes) = lit.split_once("[[shapes]]").unwrap();
    let dark = format!("{start}[[shapes]]{shapes}").replace("[0.1, 0.1, 0.1]", "[0, 0, 0]");
    place.write("dark.toml", &dark.replace("[0.2, 0.3, 2]", "[0, 0, 0]"));
    let ran = place.run(&["check", "dark.toml"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(
        ran.stderr,
        "warning: dark.toml: the scene has no light, emission or environment; every surface renders black\n"
    );
}

#[test]
fn a_mesh_away_from_the_origin_is_found_in_view() {
    let place = TestFolder::new();
    place.write("far.obj", "v 100 0 0\nv 101 0 0\nv 100 0 1\nf 1 2 3\n");
    let (start, rest) = super::SCENE.split_once("[[shapes]]").unwrap();
    let mesh = "[[shapes]]\ntype = 'mesh'\nmaterial = 'gray'\nfile = 'far.obj'\n";
    assert!(rest.contains("sphere"));
    let near = format!("{start}{mesh}");
    let far = near.replace(
        "position = [0, -5, 1], look_at = [0, 0, 1]",
        "position = [100.3, -5, 1], look_at = [100.3, 0, 1]",
    );
    for (scene, is_in_view) in [(far, true), (near, false)] {
        place.write("far.toml", &scene);
        let ran = place.run(&["check", "far.toml"]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let warns = ran
            .stderr
            .contains("warning: far.toml: no shape is in view of the camera");
        assert_eq!(warns, !is_in_view, "{scene}: {}", ran.stderr);
    }
    let info = place.run(&["info", "far.toml", "--device", "cpu"]).stdout;
    assert!(
        info.contains("    bounds      [100, 0, 0] to [101, 0, 1], size 1 x 0 x 1\n"),
        "{info}"
    );
}

#[test]
fn help_and_version_exit_with_0() {
    let place = TestFolder::new();
    for arguments in [
        &["--help"][..],
        &["render", "--help"],
        &["check", "--help"],
        &["--version"],
    ] {
        let ran = place.run(arguments);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{arguments:?}");
        assert!(ran.stdout.contains("wgray"), "{arguments:?}");
    }
    let help = place.run(&["render", "--help"]).stdout;
    for option in [
        "--output",
        "--size",
        "--spp",
        "--pixel-samples",
        "--light-samples",
        "--seed",
        "--define",
        "--frames",
        "--skip-existing",
        "--integrator",
        "--max-depth",
        "--crop",
        "--device",
        "--threads",
        "--aov",
        "--stats",
        "--progress",
        "--quiet",
        "--verbose",
    ] {
        assert!(help.contains(option), "{option} is missing in the help");
    }
}

#[test]
fn the_scenes_of_the_documentation_are_valid() {
    let place = TestFolder::new();
    for document in ["README.md", "docs/scene-format.md"] {
        let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(document)).unwrap();
        let scenes: Vec<&str> = text
            .split("```toml\n")
            .skip(1)
            .filter_map(|rest| rest.split("```").next())
            .collect();
        assert!(
            scenes.iter().any(|scene| scene.contains("[camera]")),
            "{document}: no scene was found"
        );
        for scene in scenes.into_iter().filter(|scene| scene.contains("[camera]")) {
            place.write("scene.toml", scene);
            let ran = place.run(&["check", "scene.toml"]);
            assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{document}");
        }
    }
}
