//! The summary line after a render, and default output names. A default name never replaces a file that wgray did not
//! write.

use super::{SCENE, TestFolder, is_summary};

/// Removes the time of the render, which differs between runs.
fn without_time(line: &str) -> String {
    let (rest, _) = line.rsplit_once(", ").unwrap_or((line, ""));
    rest.to_owned()
}

#[test]
fn a_render_ends_with_a_summary_line() {
    let folder = TestFolder::new();
    for (arguments, lines) in [
        (&["-o", "a.png"][..], &["a.png: 10 x 6, 3 spp"][..]),
        (&["-o", "./a.png", "-o", "b.exr"], &["./a.png, b.exr: 10 x 6, 3 spp"]),
        (
            &["-o", "a.png", "--aov", "depth"],
            &["a.png, a.depth.png: 10 x 6, 3 spp"],
        ),
        (&["--size", "4x2", "--spp", "2"], &["small.png: 4 x 2, 2 spp"]),
        (
            &["--crop", "1,1,4,3", "-o", "a.png", "--stats", "s.json"],
            &["a.png: 3 x 2, 3 spp"],
        ),
        (&["--tile", "1/2", "-o", "a.part"], &["a.part: 10 x 3, 3 spp"]),
        (
            &["--frames", "1-2", "-o", "f#.png"],
            &["f1.png: 10 x 6, 3 spp", "f2.png: 10 x 6, 3 spp"],
        ),
        (&["-o", "a.png", "-q"], &[]),
    ] {
        let result = folder.run(&[&["render", "small.toml", "--device", "cpu"], arguments].concat());
        assert_eq!(result.code, 0, "{arguments:?}: {}", result.stderr);
        assert!(
            result.summary.iter().all(|line| is_summary(line)),
            "{:?}",
            result.summary
        );
        let found: Vec<String> = result.summary.iter().map(|line| without_time(line)).collect();
        assert_eq!(found, lines, "{arguments:?}");
    }
    let stream = folder.shell("sh", "$0 render small.toml --device cpu -o - | cat > piped.png");
    assert_eq!(stream.summary.len(), 1, "{}", stream.stderr);
    assert!(
        stream.summary[0].starts_with("standard output: 10 x 6"),
        "{:?}",
        stream.summary
    );
    assert!(folder.read("piped.png").starts_with(b"\x89PNG"));
    // In a JSON log, "render done" replaces the summary line.
    let json = folder.run(&[
        "render",
        "small.toml",
        "-o",
        "a.png",
        "--device",
        "cpu",
        "--log-format",
        "json",
    ]);
    assert_eq!(json.summary, [""; 0]);
    assert!(json.stderr.contains("\"render done\""), "{}", json.stderr);
    let failed = folder.run(&["render", "small.toml", "-o", "missing/a.png"]);
    assert_eq!((failed.code, failed.summary.len()), (8, 0));
}

#[test]
fn the_choice_of_the_device_is_explained_only_with_verbose() {
    let folder = TestFolder::new();
    let sphere = SCENE.split("[[shapes]]").nth(1).expect("a sphere");
    let many = (0..70).map(|_| format!("[[shapes]]{sphere}")).collect::<String>();
    folder.write("many.toml", &format!("{SCENE}{many}"));
    let options = ["render", "many.toml", "--spp", "1", "-o", "a.png"];
    assert_eq!(folder.run(&options).stderr, "");
    let verbose = folder.run(&[&options[..], &["-v"]].concat()).stderr;
    let has_adapter = folder.run(&["devices"]).stdout.contains("llvmpipe");
    assert!(!has_adapter || verbose.contains("rendering on the CPU: "), "{verbose}");
}

#[test]
fn a_default_name_replaces_only_images_that_wgray_wrote() {
    let folder = TestFolder::new();
    let options = ["render", "small.toml", "--device", "cpu", "--spp", "1"];
    let assert_rejected = |arguments: &[&str], name: &str| {
        let result = folder.run(&[&options[..], arguments].concat());
        let message = format!("error: {name} exists and was not written by wgray; name the output with -o\n");
        assert_eq!((result.code, result.stderr), (2, message), "{arguments:?}");
    };
    folder.run_quietly(&options);
    let wgray_png = folder.read("small.png");
    folder.run_quietly(&[&options[..], &["--reproducible", "--bit-depth", "16"]].concat());
    assert_ne!(
        folder.read("small.png"),
        wgray_png,
        "a PNG written by wgray was not replaced"
    );
    // Rewriting the image removes the chunk that names wgray as its author.
    let picture = image::load_from_memory(&wgray_png).expect("a PNG");
    picture.save(folder.path("small.png")).expect("written");
    let rewritten_png = folder.read("small.png");
    assert_rejected(&[], "small.png");
    assert_rejected(&["--skip-existing"], "small.png");
    assert_eq!(folder.read("small.png"), rewritten_png);
    for content in ["", "no PNG"] {
        folder.write("small.png", content);
        assert_rejected(&[], "small.png");
    }
    folder.run_quietly(&[&options[..], &["-o", "small.png"]].concat());
    folder.write("small.depth.png", "notes");
    assert_rejected(&["--aov", "depth"], "small.depth.png");
    folder.write("small.0001.png", "notes");
    assert_rejected(&["--frames", "1-2"], "small.0001.png");
    assert!(!folder.path("small.0002.png").exists());
}
