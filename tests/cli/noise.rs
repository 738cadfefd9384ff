//! `wgray render --noise`: renders end when the noise is low.

use super::TestFolder;
use crate::adapter;
use crate::layers::SCENE;

const OPTIONS: [&str; 3] = ["render", "s.toml", "--reproducible"];

fn folder() -> TestFolder {
    let folder = TestFolder::new();
    folder.write("s.toml", SCENE);
    folder
}

fn stats(folder: &TestFolder) -> serde_json::Value {
    serde_json::from_slice(&folder.read("stats.json")).expect("JSON")
}

/// Renders with a noise limit; returns the samples per pixel.
fn render(folder: &TestFolder, limit: &str, extra: &[&str]) -> u64 {
    let noise = ["--noise", limit, "--stats", "stats.json"];
    folder.run_quietly(&[&OPTIONS[..], &noise, extra].concat());
    let stats = stats(folder);
    let noise = stats["noise"].as_f64().expect("the noise");
    assert!(noise < limit.parse().expect("a number"), "{noise}");
    assert!(
        stats["noise_median"].as_f64().is_some_and(|median| median <= noise),
        "{stats}"
    );
    assert_eq!(
        (stats["pixel_samples"].as_u64(), stats["fraction_rendered"].as_f64()),
        (Some(4096), Some(1.0))
    );
    stats["min_samples"].as_u64().expect("the samples")
}

#[test]
fn a_render_ends_when_the_noise_is_low() {
    let folder = folder();
    let mut counts = Vec::new();
    for limit in ["1", "0.1", "0.05"] {
        let count = render(&folder, limit, &["--device", "cpu", "-o", "noise.exr"]);
        counts.push(count);
        // The image equals a render with this number of samples.
        let spp = count.to_string();
        folder.run_quietly(&[&OPTIONS[..], &["--device", "cpu", "--spp", &spp, "-o", "plain.exr"]].concat());
        assert_eq!(folder.run(&["diff", "noise.exr", "plain.exr"]).code, 0, "{limit}");
        // The noise of half the samples is not below the limit.
        if count > 16 {
            let half = (count / 2).to_string();
            let options = [
                "--device",
                "cpu",
                "--spp",
                &half,
                "--noise",
                limit,
                "--stats",
                "stats.json",
                "-o",
                "half.exr",
            ];
            let result = folder.run(&[&OPTIONS[..], &options].concat());
            let expected = format!(" is not below {limit} after the maximum of {half} samples per pixel\n");
            assert!(
                result.code == 0 && result.stderr.ends_with(&expected),
                "{}",
                result.stderr
            );
            assert!(stats(&folder)["noise"].as_f64() >= limit.parse().ok());
            assert_eq!(
                folder.run(&["diff", "noise.exr", "half.exr"]).code,
                5,
                "the comparison cannot fail"
            );
        }
        let metadata = wgray::image::read_metadata(&folder.path("noise.exr")).expect("metadata");
        assert_eq!(metadata.get("noise_limit"), Some(limit));
        let noise = metadata.get("noise").expect("the noise");
        assert!(noise.starts_with(&format!("{count} of 4096 samples, 0.")), "{noise}");
        assert!(noise.contains(", median 0."), "{noise}");
    }
    assert!(counts[0] == 16 && counts[1] > 16 && counts[2] > counts[1], "{counts:?}");
}

#[test]
fn the_image_does_not_depend_on_device_threads_or_interruptions() {
    let folder = folder();
    let count = render(&folder, "0.1", &["--device", "cpu", "-o", "cpu.exr"]);
    let mut others = vec![
        vec!["--device", "cpu", "--threads", "1"],
        vec!["--device", "cpu", "--preview"],
    ];
    if adapter::device().is_some_and(adapter::bit_exact) {
        others.push(vec!["--device", "gpu"]);
    }
    for options in others {
        let found = render(&folder, "0.1", &[&options[..], &["-o", "other.exr"]].concat());
        assert!(
            found == count && folder.read("other.exr") == folder.read("cpu.exr"),
            "{options:?}"
        );
        std::fs::remove_file(folder.path("other.exr")).expect("a file"); // with --preview, the next render would not replace a file with more samples
    }
    // The time limit is a bound; a checkpoint continues.
    let checkpoint = ["--device", "cpu", "--checkpoint", "c", "--resume", "-o", "resumed.exr"];
    let limited = ["--time-limit", "0", "--noise", "0.1", "--stats", "stats.json"];
    let result = folder.run(&[&OPTIONS[..], &checkpoint, &limited].concat());
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(
        result.stderr.starts_with("note: time limit reached: "),
        "{}",
        result.stderr
    );
    assert_eq!(stats(&folder)["min_samples"].as_u64(), Some(1));
    for _ in 0..2 {
        let found = render_resumed(&folder, &checkpoint);
        assert!(
            found == count && folder.read("resumed.exr") == folder.read("cpu.exr"),
            "{found}"
        );
    }
    // Another image is in another file.
    let result = folder.run(&[&OPTIONS[..], &checkpoint, &["--noise", "0.1", "--spp", "64"]].concat());
    assert_eq!(result.code, 2);
    assert!(
        result.stderr.contains("its number of samples is 4096, not 64"),
        "{}",
        result.stderr
    );
}

fn render_resumed(folder: &TestFolder, checkpoint: &[&str]) -> u64 {
    let noise = ["--noise", "0.1", "--stats", "stats.json"];
    folder.run_quietly(&[&OPTIONS[..], checkpoint, &noise].concat());
    stats(folder)["min_samples"].as_u64().expect("the samples")
}

/// A time limit ends a render within a pass: the metadata and statistics are those of the image, not of the last pass.
#[test]
fn a_time_limit_reports_the_samples_and_the_noise_of_the_image() {
    let folder = folder();
    for preview in [&[][..], &["--preview"]] {
        let limits = ["--noise", "0.00001", "--spp", "65536", "--time-limit", "0.7"];
        let outputs = ["--device", "cpu", "-o", "a.exr", "--stats", "stats.json"];
        let result = folder.run(&[&OPTIONS[..], &limits, &outputs, preview].concat());
        let stats = stats(&folder);
        let samples = &stats["min_samples"];
        let note = format!("note: time limit reached: every pixel has at least {samples} of 65536 samples\n");
        assert!(result.code == 0 && result.stderr.ends_with(&note), "{}", result.stderr);
        assert_eq!(stats["fraction_rendered"].as_f64(), Some(1.0), "{stats}");
        let metadata = wgray::image::read_metadata(&folder.path("a.exr")).expect("metadata");
        let noise = metadata.get("noise").expect("the noise");
        assert!(
            noise.starts_with(&format!("{samples} of 65536 samples, ")),
            "{noise}, {stats}"
        );
        std::fs::remove_file(folder.path("a.exr")).expect("a file");
    }
    // The noise may be below the limit where it does not decide.
    let limits = ["--noise", "1", "--time-limit", "0", "--stats", "stats.json"];
    let checkpoint = ["--device", "cpu", "--checkpoint", "c", "--resume", "-o", "a.exr"];
    let mut noise = Vec::new();
    for _ in 0..4 {
        let result = folder.run(&[&OPTIONS[..], &limits, &checkpoint].concat());
        assert!(
            result.code == 0 && result.stderr.starts_with("note: time limit reached: "),
            "{}",
            result.stderr
        );
        noise.push(stats(&folder)["noise"].as_f64());
    }
    assert!(noise[3].is_some_and(|noise| noise < 1.0), "{noise:?}");
}

/// The maximum number of samples does not change how much textures are filtered.
#[test]
fn the_maximum_does_not_change_the_filters_of_textures() {
    let folder = TestFolder::new();
    let scene = super::project_scene("textures.toml");
    let render = |file: &str, samples: &[&str]| {
        let options = [
            "--integrator",
            "path",
            "--pixel-pattern",
            "sobol",
            "--size",
            "20x15",
            "-q",
        ];
        let outputs = ["--noise", "0.2", "--device", "cpu", "-o", file];
        folder.run_quietly(&[&["render", &scene], &options[..], &outputs, samples].concat());
    };
    render("default.exr", &[]);
    render("fewer.exr", &["--spp", "1024"]);
    assert_eq!(folder.run(&["diff", "default.exr", "fewer.exr"]).code, 0);
}

#[test]
fn black_images_and_single_pixels_have_a_noise() {
    let folder = folder();
    let mut dark = SCENE.replace("emission = [0.4, 0.8, 0.2]\n", "");
    for color in [
        "[0.2, 0.3, 0.5]",
        "[0.5, 0.4, 0.3]",
        "[0.9, 0.8, 0.7]",
        "[0.1, 0.1, 0.1]",
    ] {
        dark = dark.replace(color, "[0, 0, 0]");
    }
    folder.write("s.toml", &dark);
    let count = render(&folder, "0.0000001", &["--device", "cpu", "-o", "black.png"]);
    assert_eq!((count, stats(&folder)["noise"].as_f64()), (16, Some(0.0)));
    folder.write("s.toml", SCENE);
    let count = render(
        &folder,
        "0.05",
        &["--device", "cpu", "--size", "1x1", "-o", "pixel.png"],
    );
    assert!(count >= 16, "{count}");
    let stats = stats(&folder);
    assert_eq!(stats["noise"], stats["noise_median"]);
    // A single sample has no variance.
    let single = [
        "--spp",
        "1",
        "--noise",
        "0.5",
        "--device",
        "cpu",
        "--stats",
        "stats.json",
        "-o",
        "single.png",
    ];
    let result = folder.run(&[&OPTIONS[..], &single].concat());
    let expected = "note: the noise, inf, is not below 0.5 after the maximum of 1 samples per pixel\n";
    assert_eq!((result.code, result.stderr.as_str()), (0, expected));
    assert!(self::stats(&folder)["noise"].is_null());
}

#[test]
fn progress_shows_the_noise() {
    let folder = folder();
    let options = [
        "--noise",
        "0.02",
        "--device",
        "cpu",
        "--progress",
        "plain",
        "--log-format",
        "json",
        "-o",
        "a.png",
    ];
    let result = folder.run(&[&OPTIONS[..], &options].concat());
    assert_eq!(result.code, 0, "{}", result.stderr);
    let lines = result
        .stderr
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"));
    let lines: Vec<serde_json::Value> = lines.collect();
    let progress = lines.iter().filter(|line| line["level"] == "progress");
    let noise: Vec<f64> = progress.filter_map(|line| line["noise"].as_f64()).collect();
    assert!(
        noise.is_sorted_by(|a, b| a >= b) && noise.len() > 1,
        "{}",
        result.stderr
    );
    let text = "a.png: 24 x 16, ";
    let summary = lines
        .iter()
        .find(|line| line["message"].as_str().is_some_and(|line| line.starts_with(text)));
    assert!(
        summary.is_some() || lines.iter().any(|line| line["stats"]["noise"].is_number()),
        "{lines:?}"
    );
    let result = folder.run(&[&OPTIONS[..], &["--noise", "0.5", "--device", "cpu", "-o", "a.png"]].concat());
    let [summary] = &result.summary[..] else {
        panic!("{:?}", result.summary);
    };
    assert!(
        summary.starts_with("a.png: 24 x 16, 16 spp, noise 0.") && summary.contains(" (median 0."),
        "{summary}"
    );
}

#[test]
fn invalid_limits_and_combinations_are_rejected() {
    let folder = folder();
    let range = "must be a number greater than 0 and at most 1";
    for (options, rule) in [
        (&["--noise", "0"][..], range),
        (&["--noise", "-0.1"], range),
        (&["--noise", "1.0001"], range),
        (&["--noise", "nan"], range),
        (&["--noise", "low"], range),
        (&["--noise", "0.1", "--tile", "1/2"], "cannot be used with"),
        (&["--noise", "0.1", "--adaptive", "0.1"], "cannot be used with"),
        (
            &["--noise", "0.1", "-D", "render.adaptive.error=0.1"],
            "--noise: cannot be combined with adaptive sampling",
        ),
        (
            &["--noise", "0.1", "--pixel-pattern", "grid", "--spp", "16"],
            "--noise: the first samples must cover the pixel",
        ),
    ] {
        let result = folder.run(&[&OPTIONS[..], options].concat());
        assert_eq!(result.code, 2, "{options:?}: {}", result.stderr);
        assert!(result.stderr.contains(rule), "{options:?}: {}", result.stderr);
    }
    assert_eq!(folder.files(), ["s.toml"]);
}
