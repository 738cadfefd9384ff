//! The example of `docs/golden-pictures.md`, run as documented.
#![cfg(unix)]

use std::fs;
use std::process::Command;

use super::{RunResult, program};
use crate::sources::path as project_path;

/// A copy of `examples/golden`.
struct Example {
    folder: tempfile::TempDir,
}

impl Example {
    fn new() -> Example {
        let folder = tempfile::tempdir().unwrap();
        let source = project_path("examples/golden");
        fs::copy(source.join("check"), folder.path().join("check")).unwrap();
        for subfolder in ["scenes", "golden"] {
            fs::create_dir(folder.path().join(subfolder)).unwrap();
            for entry in fs::read_dir(source.join(subfolder)).unwrap() {
                let entry = entry.unwrap();
                fs::copy(entry.path(), folder.path().join(subfolder).join(entry.file_name())).unwrap();
            }
        }
        Example { folder }
    }

    fn check(&self, arguments: &[&str]) -> RunResult {
        let output = Command::new(self.folder.path().join("check"))
            .args(arguments)
            .env("WGRAY", program())
            .env_remove("OUT")
            .output()
            .unwrap();
        RunResult::new(
            output.status.code(),
            String::from_utf8_lossy(&output.stdout).into_owned(),
            &String::from_utf8_lossy(&output.stderr),
            &[],
        )
    }

    fn change_scene(&self) {
        let scene = self.folder.path().join("scenes/ball.toml");
        let text = fs::read_to_string(&scene).unwrap();
        assert!(text.contains("radius = 0.7\n"));
        fs::write(&scene, text.replace("radius = 0.7\n", "radius = 0.68\n")).unwrap();
    }
}

fn page() -> String {
    fs::read_to_string(project_path("docs/golden-pictures.md")).unwrap()
}

#[test]
fn the_golden_images_match() {
    let example = Example::new();
    let result = example.check(&[]);
    let hint = "after an intended change of an image, run examples/golden/check update";
    assert_eq!(result.code, 0, "{hint}\n{}{}", result.stdout, result.stderr);
    assert_eq!(result.stdout.matches("color R G B: identical").count(), 2);
}

#[test]
fn a_changed_scene_fails_until_updated() {
    let example = Example::new();
    example.change_scene();
    let result = example.check(&[]);
    assert_eq!(result.code, 5, "{}{}", result.stdout, result.stderr);
    let page = page();
    let report = page.split("```text\n").nth(1).and_then(|text| text.split("```").next());
    let report = report.expect("the page shows the report");
    assert!(result.stdout.contains(report), "{}is not\n{report}", result.stdout);
    assert!(
        result.stdout.contains("out/balls.png against golden/balls.png"),
        "the second image is not checked"
    );
    let found = image::open(example.folder.path().join("out/ball.diff.png")).unwrap();
    assert_eq!(
        found,
        image::open(project_path("docs/golden-pictures/ball.diff.png")).unwrap()
    );

    let unchanged = fs::read(example.folder.path().join("golden/balls.png")).unwrap();
    let result = example.check(&["update"]);
    assert_eq!((result.code, result.stdout.as_str()), (0, "golden/ball.exr is new\n"));
    assert_eq!(
        unchanged,
        fs::read(example.folder.path().join("golden/balls.png")).unwrap()
    );
    assert_eq!(example.check(&[]).code, 0);
}

#[test]
fn a_scene_without_a_golden_image_fails() {
    let example = Example::new();
    let scenes = example.folder.path().join("scenes");
    fs::copy(scenes.join("ball.toml"), scenes.join("new.toml")).unwrap();
    let result = example.check(&[]);
    assert_eq!(result.code, 1);
    assert!(
        result.stderr.contains("golden/new.exr: cannot be read"),
        "{}",
        result.stderr
    );
    assert_eq!(example.check(&["update"]).stdout, "golden/new.exr is new\n");
    assert_eq!(example.check(&[]).code, 0);
    // If a scene cannot be rendered, the script exits with the exit code of the render.
    fs::write(scenes.join("new.toml"), "image = 3").unwrap();
    assert_eq!(example.check(&[]).code, 3);
}

#[test]
fn the_page_and_the_help_list_the_metrics_options_and_exit_codes() {
    let (page, help) = (page(), super::TestFolder::new().run(&["diff", "--help"]).stdout);
    let help = help.split_whitespace().collect::<Vec<_>>().join(" "); // help lines wrap at the terminal width
    for metric in [
        "different",
        "largest",
        "share",
        "rmse",
        "rel_mse",
        "psnr",
        "ssim",
        "flip",
    ] {
        assert!(page.contains(&format!("| `{metric}` |")), "{metric}");
    }
    for option in [
        "--fail",
        "--metrics",
        "--layers",
        "--threshold",
        "--ppd",
        "--out",
        "--json",
    ] {
        assert!(page.contains(option), "{option}");
        assert!(help.contains(option), "{option}");
    }
    for code in [0, 1, 2, 5, 8] {
        assert!(page.contains(&format!("\n| {code} | ")), "{code}");
        assert!(help.contains(&format!("{code} ")), "{code}");
    }
}
