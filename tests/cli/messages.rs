//! Text messages: renders succeed although standard error is closed or full, and each message names a remedy.

use super::{RunResult, SCENE, TestFolder};

#[cfg(unix)]
mod unix {
    use super::*;

    fn sh(folder: &TestFolder, line: &str) -> RunResult {
        folder.shell("sh", line)
    }

    /// Redirections of standard error to full, closed and unread streams.
    const UNWRITABLE: [&str; 3] = ["2>/dev/full", "2>&-", "2>&1 >&3 3>&- | true"];

    #[test]
    fn a_render_ignores_an_unwritable_standard_error() {
        for redirection in UNWRITABLE {
            for options in [
                "--progress plain --size 64x64",
                "--verbose",
                // Without a driver, a warning is printed.
                "--device auto",
            ] {
                let folder = TestFolder::new();
                let driver = "VK_DRIVER_FILES=/nonexistent.json VK_ICD_FILENAMES=/nonexistent.json";
                let line = format!(
                    "{{ {{ {driver} $0 render small.toml {options}; echo $? > code; }} {redirection}; }} 3>&1; exit $(cat code)"
                );
                let result = sh(&folder, &line);
                assert_eq!(result.code, 0, "{line}: {}", result.stderr);
                assert!(
                    folder.files().contains(&"small.png".to_owned()),
                    "{line}: {:?}",
                    folder.files()
                );
            }
        }
    }

    #[test]
    fn exit_codes_do_not_depend_on_standard_error() {
        let folder = TestFolder::new();
        folder.write("bad.toml", &SCENE.replace("radius = 0.8", "radius = -1"));
        for redirection in UNWRITABLE {
            for (command, code) in [
                ("check bad.toml", 3),
                ("render bad.toml", 3),
                ("render small.toml --device abacus", 4),
                ("render small.toml --colour", 2),
                ("render small.toml -o nowhere/a.png", 8),
                ("dev bad.toml --no-page", 2),
                ("", 2),
            ] {
                let line = format!("{{ {{ $0 {command}; echo $? > code; }} {redirection}; }} 3>&1; exit $(cat code)");
                let result = sh(&folder, &line);
                assert_eq!(result.code, code, "{line}: {}", result.stderr);
            }
        }
    }

    /// A full disk is an error; a closed pipe is not.
    #[test]
    fn output_to_a_full_disk_exits_with_8_and_a_closed_pipe_is_ignored() {
        let folder = TestFolder::new();
        for command in ["devices", "check small.toml", "--help", "render --help", "--version"] {
            let result = sh(&folder, &format!("$0 {command} > /dev/full"));
            assert_eq!(result.code, 8, "{command}: {}", result.stderr);
            assert!(
                result
                    .stderr
                    .starts_with("error: standard output: cannot be written: No space left"),
                "{command}: {}",
                result.stderr
            );
            for (line, code) in [
                (
                    format!("{{ $0 {command}; echo $? > code; }} | true; exit $(cat code)"),
                    0,
                ),
                (format!("$0 {command} >&-"), 0),
            ] {
                let result = sh(&folder, &line);
                assert_eq!((result.code, result.stderr.as_str()), (code, ""), "{line}");
            }
        }
        let statistics = "$0 render small.toml --spp 1 --device cpu -q -o a.png --stats -";
        let line = format!("{{ {statistics}; echo $? > code; }} | true; exit $(cat code)");
        let result = sh(&folder, &line);
        assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{line}");
        folder.write("bad.toml", "");
        let result = sh(
            &folder,
            "{ $0 check small.toml small.toml bad.toml small.toml; echo $? > code; } | true; exit $(cat code)",
        );
        assert_eq!(
            result.code, 3,
            "the check stopped because the pipe is closed: {}",
            result.stderr
        );
    }
}

fn message_for(from: &str, to: &str) -> String {
    let folder = TestFolder::new();
    assert!(SCENE.contains(from), "{from}");
    folder.write("bad.toml", &SCENE.replacen(from, to, 1));
    let result = folder.run(&["check", "--strict", "bad.toml"]);
    assert_eq!((result.code, result.stdout.as_str()), (3, ""), "{}", result.stderr);
    assert_eq!(result.stderr.lines().count(), 1, "{}", result.stderr);
    result.stderr.trim_end().to_owned()
}

#[test]
fn wrong_types_are_reported_with_the_expected_type() {
    let samples = "pixel_samples = { pattern = \"random\", count = 3 }";
    for (from, to, message) in [
        (
            samples,
            "pixel_samples = 16.5",
            "bad.toml:6: render.pixel_samples: 16.5 must be a whole number from 1 to 65536, or a table such as { pattern = \"grid\", count = 16 }",
        ),
        (
            samples,
            "pixel_samples = 'sobol'",
            "bad.toml:6: render.pixel_samples: \"sobol\" must be a whole number from 1 to 65536, or a table such as { pattern =",
        ),
        (
            samples,
            "filter = 'gaussian'",
            "bad.toml:6: render.filter: \"gaussian\" must be a table, such as { type = \"gaussian\" }",
        ),
        (
            samples,
            "adaptive = 0.01",
            "bad.toml:6: render.adaptive: 0.01 must be a table, such as { error = 0.01 }",
        ),
        (
            samples,
            "adaptive = { error = 0.01 }",
            "render.adaptive: the pattern of pixel_samples, \"grid\", cannot add samples; use one of \"jittered\", \"random\", \"halton\", \"sobol\"",
        ),
        (
            "width = 10",
            "width = -1",
            "bad.toml:1: image.width: -1 must be a whole number from 1 to 65536",
        ),
        (
            "width = 10",
            "width = 9.5",
            "bad.toml:1: image.width: 9.5 must be a whole number from 1 to 65536",
        ),
        (
            "width = 10",
            "width = 5000000000",
            "bad.toml:1: image.width: 5000000000 must be a whole number from 1 to 65536",
        ),
        (
            samples,
            "max_depth = -1",
            "bad.toml:6: render.max_depth: -1 must be a whole number from 1 to 64",
        ),
        (
            samples,
            "seed = -1",
            "bad.toml:6: render.seed: -1 must be a whole number from 0 to 4294967295",
        ),
        (
            samples,
            "pixel_samples = { count = -4 }",
            "bad.toml:6: render.pixel_samples.count: -4 must be a whole number from 1 to 65536",
        ),
        (
            samples,
            "shadow_epsilon = .5",
            "bad.toml:6:18: invalid mantissa, expected digits; a number has digits on both sides of the decimal point: \
             shadow_epsilon = .5",
        ),
        (samples, "seed = 1\nseed = 2", "bad.toml:7:1: duplicate key: seed = 2"),
    ] {
        let found = message_for(from, to);
        assert!(found.contains(message), "{found}\n{message}");
    }
}

/// The parser and the validation print the same range.
#[test]
fn integer_ranges_are_consistent() {
    let in_render_table = |line: &str| (String::from("[render]"), format!("[render]\n{line}"));
    for (key, (from, to)) in [
        ("width", ("width = 10".to_owned(), "width = N".to_owned())),
        ("height", ("height = 6".to_owned(), "height = N".to_owned())),
        ("max_depth", in_render_table("max_depth = N")),
        ("count", ("count = 3".to_owned(), "count = N".to_owned())),
    ] {
        let [negative, zero] = ["-1", "0"].map(|value| message_for(&from, &to.replace('N', value)));
        let range = |message: &str| message.split(" from ").nth(1).map(str::to_owned);
        assert!(
            range(&zero).is_some() && range(&zero) == range(&negative),
            "{key}: {zero} and {negative}"
        );
    }
}

#[test]
fn messages_of_long_keys_and_values_are_short() {
    let long_text = "k".repeat(1_000_000);
    for (from, to) in [
        ("[render]", format!("{long_text} = 1\n[render]")),
        ("[render]", format!("[render]\n{long_text} = 1")),
        ("[render]", format!("[render]\n{long_text} = 1\n{long_text} = 2")),
        ("[render]", format!("[render]\n{long_text}")),
        ("[render]", format!("[render]\nseed = {long_text}")),
        ("[render]", format!("[render]\nseed = '{long_text}'")),
        ("[render]", format!("[render]\nshadows = '{long_text}'")),
        ("[render]", format!("[render]\nseed = {}", "9".repeat(1_000_000))),
        ("material = \"gray\"", format!("material = '{long_text}'")),
        ("type = \"phong\"", format!("type = '{long_text}'")),
        (
            "[materials.gray]",
            format!("[materials.{long_text}]\ntype = 'phong'\nshininess = 0\n[materials.gray]"),
        ),
        (
            "[materials.gray]",
            format!("[textures.a]\ntype = 'image'\nfile = '{long_text}'\n[materials.gray]"),
        ),
    ] {
        let message = message_for(from, &to);
        assert!(message.len() < 1500, "{} bytes: {}", message.len(), &message[..200]);
        assert!(message.contains("..."), "{message}");
    }
    let materials: String = (0..2000)
        .map(|i| format!("[materials.m{i}]\ntype = 'mirror'\n"))
        .collect();
    let message = message_for(
        "[[shapes]]\ntype = \"sphere\"\nmaterial = \"gray\"",
        &format!("{materials}[[shapes]]\ntype = \"sphere\"\nmaterial = \"zebra\""),
    );
    assert!(message.len() < 1500 && message.contains(" and 1977 more"), "{message}");
}

#[test]
fn messages_about_wrong_arguments_name_a_remedy() {
    let folder = TestFolder::new();
    let grid = SCENE.replacen("pixel_samples = { pattern = \"random\", count = 3 }\n", "", 1);
    folder.write("grid.toml", &grid);
    let adaptive = folder.run(&["render", "grid.toml", "--adaptive", "0.1"]);
    assert_eq!(adaptive.code, 2);
    assert!(
        adaptive
            .stderr
            .starts_with("error: --adaptive: the pattern of pixel_samples, \"grid\", ")
            && adaptive.stderr.contains("--pixel-pattern sobol"),
        "{}",
        adaptive.stderr
    );
    for scene in [".", "..", "/"] {
        for command in ["render", "check"] {
            let result = folder.run(&[command, scene]);
            assert_eq!(result.code, 3);
            assert_eq!(
                result.stderr,
                format!("error: {scene}: cannot be read: it is a folder, not a scene file\n")
            );
        }
    }
    for device in ["CPU", "Cpu", "GPU", "AUTO"] {
        folder.run_quietly(&["render", "small.toml", "--device", device]);
    }
    folder.run_quietly(&["render", "small.toml", "--device", "1"]);
    let dev = folder.run(&["dev", "small.toml", "--no-page", "--device", "CPU"]);
    assert!(dev.stderr.contains("cpu cannot run shaders"), "{}", dev.stderr);
}

#[test]
fn an_image_outside_the_asset_root_is_reported_with_both_paths() {
    let folder = TestFolder::new();
    image::RgbImage::new(2, 2).save(folder.path("tile.png")).unwrap();
    std::fs::create_dir(folder.path("sub")).unwrap();
    let texture = "[textures.a]\ntype = 'image'\nfile = 'tile.png'\n[[lights]]";
    folder.write("tile.toml", &SCENE.replacen("[[lights]]", texture, 1));
    let result = folder.run(&["check", "tile.toml", "--asset-root", "sub"]);
    assert_eq!(result.code, 3);
    assert!(
        result
            .stderr
            .contains("which is outside the asset root sub; pass another --asset-root"),
        "{}",
        result.stderr
    );
    assert!(!result.stderr.contains("contains both"), "{}", result.stderr);
    folder.write(
        "tile.toml",
        &SCENE.replacen("[[lights]]", &texture.replace("tile.png", "../tile.png"), 1),
    );
    std::fs::rename(folder.path("tile.toml"), folder.path("sub/tile.toml")).unwrap();
    let result = folder.run(&["check", "sub/tile.toml"]);
    assert!(
        result
            .stderr
            .contains("lies outside of the scene's folder, sub; pass --asset-root with a folder that contains both"),
        "{}",
        result.stderr
    );
    let result = folder.run(&["check", "sub/tile.toml", "--asset-root", "."]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
}

#[test]
fn mesh_warnings_appear_once() {
    let folder = TestFolder::new();
    folder.write("odd.obj", "v 0 0 0\nv 1 0 0\nv 0 0 2\nf 1 2 3\nf 1 1 2\n");
    let shape = "[[shapes]]\ntype = 'mesh'\nfile = 'odd.obj'\nmaterial = 'gray'\n";
    folder.write("odd.toml", &format!("{SCENE}{shape}"));
    let warning = "warning: odd.toml: odd.obj: 1 of 2 triangles has no area (degenerate) and was removed";
    for options in [&[][..], &["-v"]] {
        let result = folder.run(&[&["render", "odd.toml", "--device", "cpu"], options].concat());
        assert_eq!(result.code, 0, "{}", result.stderr);
        assert!(result.stderr.lines().any(|line| line == warning), "{}", result.stderr);
        assert_eq!(result.stderr.matches("degenerate").count(), 1, "{}", result.stderr);
    }
}

#[test]
fn arguments_in_messages_are_escaped_and_short() {
    let folder = TestFolder::new();
    for (arguments, expected) in [
        (
            &["render", "small.toml", "--size", "\u{1b}[31m\nx"][..],
            "error: invalid value '\\u{1b}[31m\\nx' for '--size <WxH>': must be ",
        ),
        (
            &["render", "--b\u{202e}ad"],
            "error: unexpected argument '--b\\u{202e}ad' found\n",
        ),
        (&["pa\rint"], "error: unrecognized subcommand 'pa\\rint'\n"),
    ] {
        let result = folder.run(arguments);
        assert_eq!((result.code, result.stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(result.stderr.starts_with(expected), "{arguments:?}: {}", result.stderr);
    }
    let result = folder.run(&["rendr"]);
    assert!(result.stderr.contains("'render'"), "{}", result.stderr);
    let long_text = "a.".repeat(30_000);
    for arguments in [
        &["render", "small.toml", "-D", &long_text][..],
        &["render", "small.toml", "-D", &format!("{long_text}a=1")],
        &["render", &format!("--{long_text}")],
        &[&long_text],
    ] {
        let result = folder.run(arguments);
        assert_eq!(result.code, 2, "{}", result.stderr);
        assert!(result.stderr.len() < 1000, "{}", result.stderr);
    }
}
