//! `wgray devices` and `wgray check`, the help, and the scenes in the documentation.

use super::{NO_DRIVER, TestFolder, project_scene};

#[test]
fn devices_are_listed() {
    let folder = TestFolder::new();
    let result = folder.run(&["devices"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    for word in ["driver", "largest buffer", "cpu", "auto selects: "] {
        assert!(result.stdout.contains(word), "{word} is missing in {}", result.stdout);
    }
    assert!(!result.stdout.contains("auto selects: cpu"));
    if result.stdout.contains("auto selects: llvmpipe") {
        assert!(
            result.stdout.ends_with(", or cpu if predicted to be faster\n"),
            "{}",
            result.stdout
        );
    }
    let without_driver = folder.run_with(&["devices"], &NO_DRIVER);
    assert_eq!(without_driver.code, 0);
    assert!(
        without_driver.stdout.contains("auto selects: cpu") && without_driver.stdout.contains("mesa-vulkan-drivers")
    );
}

#[test]
fn valid_scenes_pass_the_check_without_a_device() {
    let folder = TestFolder::new();
    let cornell = project_scene("cornell.toml");
    let result = folder.run_with(&["check", "small.toml", &cornell], &NO_DRIVER);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    let lines: Vec<&str> = result.stdout.lines().collect();
    assert_eq!(lines.len(), 2);
    assert!(
        lines[0].starts_with(
            "small.toml: ok: 10 x 6 pixels, 3 samples per pixel, 4 light samples, phong; 2 shapes; 1 light"
        ),
        "{}",
        lines[0]
    );
    assert!(folder.files().is_empty());
}

#[test]
fn a_check_warns_about_scenes_that_render_black() {
    let folder = TestFolder::new();
    let (head, rest) = super::SCENE.split_once("[[lights]]").unwrap();
    let (_, shapes) = rest.split_once("[[shapes]]").unwrap();
    let dark = format!("{head}[[shapes]]{shapes}").replace("[0.1, 0.1, 0.1]", "[0, 0, 0]");
    folder.write("dark.toml", &dark.replace("[0.2, 0.3, 2]", "[0, 0, 0]"));
    let result = folder.run(&["check", "dark.toml"]);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert_eq!(
        result.stderr,
        "warning: dark.toml: the scene has no light, emission or environment; every surface renders black\n"
    );
}

#[test]
fn the_view_check_finds_a_mesh_away_from_the_origin() {
    let folder = TestFolder::new();
    folder.write("far.obj", "v 100 0 0\nv 101 0 0\nv 100 0 1\nf 1 2 3\n");
    let (start, rest) = super::SCENE.split_once("[[shapes]]").unwrap();
    let mesh = "[[shapes]]\ntype = 'mesh'\nmaterial = 'gray'\nfile = 'far.obj'\n";
    assert!(rest.contains("sphere"));
    let scene_out_of_view = format!("{start}{mesh}");
    let scene_in_view = scene_out_of_view.replace(
        "position = [0, -5, 1], look_at = [0, 0, 1]",
        "position = [100.3, -5, 1], look_at = [100.3, 0, 1]",
    );
    for (scene, is_in_view) in [(scene_in_view, true), (scene_out_of_view, false)] {
        folder.write("far.toml", &scene);
        let result = folder.run(&["check", "far.toml"]);
        assert_eq!(result.code, 0, "{}", result.stderr);
        let warns = result
            .stderr
            .contains("warning: far.toml: no shape is in view of the camera");
        assert_eq!(warns, !is_in_view, "{scene}: {}", result.stderr);
    }
    let info = folder.run(&["info", "far.toml", "--device", "cpu"]).stdout;
    assert!(
        info.contains("    bounds      [100, 0, 0] to [101, 0, 1], size 1 x 0 x 1\n"),
        "{info}"
    );
}

#[test]
fn help_and_version_exit_with_0() {
    let folder = TestFolder::new();
    for arguments in [
        &["--help"][..],
        &["render", "--help"],
        &["check", "--help"],
        &["--version"],
    ] {
        let result = folder.run(arguments);
        assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{arguments:?}");
        assert!(result.stdout.contains("wgray"), "{arguments:?}");
    }
    let help = folder.run(&["render", "--help"]).stdout;
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
    let folder = TestFolder::new();
    for document in ["README.md", "docs/scene-format.md"] {
        let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(document)).unwrap();
        let scenes: Vec<&str> = text
            .split("```toml\n")
            .skip(1)
            .filter_map(|rest| rest.split("```").next())
            .collect();
        assert!(
            scenes.iter().any(|scene| scene.contains("[camera]")),
            "{document}: contains no scene"
        );
        for scene in scenes.into_iter().filter(|scene| scene.contains("[camera]")) {
            folder.write("scene.toml", scene);
            let result = folder.run(&["check", "scene.toml"]);
            assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{document}");
        }
    }
}
