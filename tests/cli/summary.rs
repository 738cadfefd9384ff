//! The summary line of a written image, and the protection of files of other programs from a default output name.

use super::{SCENE, TestFolder, is_summary};

/// Removes the time, which differs between runs.
fn without_time(line: &str) -> String {
    let (rest, _) = line.rsplit_once(", ").unwrap_or((line, ""));
    rest.to_owned()
}

#[test]
fn a_render_ends_with_a_summary_line() {
    let place = TestFolder::new();
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
        let ran = place.run(&[&["render", "small.toml", "--device", "cpu"], arguments].concat());
        assert_eq!(ran.code, 0, "{arguments:?}: {}", ran.stderr);
        assert!(ran.summary.iter().all(|line| is_summary(line)), "{:?}", ran.summary);
        let found: Vec<String> = ran.summary.iter().map(|line| without_time(line)).collect();
        assert_eq!(found, lines, "{arguments:?}");
    }
    let stream = place.shell("sh", "$0 render small.toml --device cpu -o - | cat > piped.png");
    assert_eq!(stream.summary.len(), 1, "{}", stream.stderr);
    assert!(
        stream.summary[0].starts_with("standard output: 10 x 6"),
        "{:?}",
        stream.summary
    );
    assert!(place.read("piped.png").starts_with(b"\x89PNG"));
    // "render done" replaces the summary line.
    let json = place.run(&[
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
    let failed = place.run(&["render", "small.toml", "-o", "missing/a.png"]);
    assert_eq!((failed.code, failed.summary.len()), (8, 0));
}

#[test]
fn the_device_is_explained_with_verbose_only() {
    let place = TestFolder::new();
    let sphere = SCENE.split("[[shapes]]").nth(1).expect("a sphere");
    let many = (0..70).map(|_| format!("[[shapes]]{sphere}")).collect::<String>();
    place.write("many.toml", &format!("{SCENE}{many}"));
    let options = ["render", "many.toml", "--spp", "1", "-o", "a.png"];
    assert_eq!(place.run(&options).stderr, "");
    let verbose = place.run(&[&options[..], &["-v"]].concat()).stderr;
    let has_adapter = place.run(&["devices"]).stdout.contains("llvmpipe");
    assert!(!has_adapter || verbose.contains("rendering on the CPU: "), "{verbose}");
}

#[test]
fn a_default_name_replaces_images_of_this_program_only() {
    let place = TestFolder::new();
    let options = ["render", "small.toml", "--device", "cpu", "--spp", "1"];
    let refused = |arguments: &[&str], name: &str| {
        let ran = place.run(&[&options[..], arguments].concat());
        let message = format!("error: {name} exists and was not written by wgray; name the output with -o\n");
        assert_eq!((ran.code, ran.stderr), (2, message), "{arguments:?}");
    };
    place.quietly(&options);
    let ours = place.read("small.png");
    place.quietly(&[&options[..], &["--reproducible", "--bit-depth", "16"]].concat());
    assert_ne!(
        place.read("small.png"),
        ours,
        "an image of this program was not replaced"
    );
    // Rewriting the image removes the chunk that names wgray as its author.
    let picture = image::load_from_memory(&ours).expect("a PNG");
    picture.save(place.path("small.png")).expect("written");
    let of_others = place.read("small.png");
    refused(&[], "small.png");
    refused(&["--skip-existing"], "small.png");
    assert_eq!(place.read("small.png"), of_others);
    for content in ["", "no PNG"] {
        place.write("small.png", content);
        refused(&[], "small.png");
    }
    place.quietly(&[&options[..], &["-o", "small.png"]].concat());
    place.write("small.depth.png", "notes");
    refused(&["--aov", "depth"], "small.depth.png");
    place.write("small.0001.png", "notes");
    refused(&["--frames", "1-2"], "small.0001.png");
    assert!(!place.path("small.0002.png").exists());
}
