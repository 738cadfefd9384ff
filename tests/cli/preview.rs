//! `--preview`: intermediate images during a render, and their replacement when a signal ends the render.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use wgray::image::read_metadata;

use super::{RunResult, TestFolder, program, project_scene, restore_signal_defaults};

/// A render that takes minutes, with passes of a few hundredths of a second.
const LONG_RENDER: [&str; 8] = [
    "render",
    "small.toml",
    "--size",
    "150x100",
    "--spp",
    "65536",
    "--threads",
    "1",
];

fn start(folder: &TestFolder, arguments: &[&str]) -> Child {
    start_in_shell(folder, "", arguments)
}

fn start_in_shell(folder: &TestFolder, shell_prefix: &str, arguments: &[&str]) -> Child {
    restore_signal_defaults();
    Command::new("sh")
        .current_dir(folder.path("."))
        .args(["-c", &format!("{shell_prefix} exec \"$0\" \"$@\"")])
        .arg(program())
        .args(LONG_RENDER)
        .arg("--preview")
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program")
}

fn wait_until(event: &str, condition: impl Fn() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(60), "{event}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn wait_for(folder: &TestFolder, file: &str) {
    wait_until(file, || folder.path(file).exists());
}

fn send(signal: &str, child: &Child) {
    let status = Command::new("kill").args([signal, &child.id().to_string()]).status();
    assert!(status.expect("kill").success());
}

fn wait_for_end(child: Child) -> RunResult {
    let output = child.wait_with_output().expect("an exit status");
    let stderr = String::from_utf8_lossy(&output.stderr);
    RunResult::new(output.status.code(), String::new(), &stderr, &[])
}

/// Returns the actual and the requested number of samples if the file is marked as partial.
fn partial(path: &Path) -> Option<(u32, u32)> {
    let metadata = read_metadata(path).expect("metadata");
    let text = metadata.get("partial")?.strip_suffix(" samples").expect("samples");
    let (samples, requested) = text.split_once(" of ").expect("two numbers");
    Some((samples.parse().expect("a number"), requested.parse().expect("a number")))
}

fn read_and_remove_files(folder: &TestFolder) -> Vec<(String, Vec<u8>)> {
    let files = folder.files().into_iter();
    let files: Vec<_> = files.map(|name| (name.clone(), folder.read(&name))).collect();
    for (name, _) in &files {
        assert_eq!(partial(&folder.path(name)), None, "{name}");
        fs::remove_file(folder.path(name)).expect("a file");
    }
    files
}

#[test]
fn the_complete_files_are_the_same_with_and_without_previews() {
    let folder = TestFolder::new();
    let path_scene = project_scene("cornell-path.toml");
    let png_and_exr = ["-o", "a.png", "-o", "a.exr"];
    let cases: [&[&str]; 8] = [
        &["small.toml", "--size", "33x21", "--spp", "9"],
        &["small.toml", "--size", "1x1", "--spp", "1"],
        &["small.toml", "--size", "1x1", "--spp", "65536"],
        &["small.toml", "--crop", "1,2,9,5", "--aov", "normal,depth"],
        &[
            "small.toml",
            "--adaptive",
            "0.02",
            "--pixel-pattern",
            "sobol",
            "--spp",
            "4",
            "--aov",
            "variance",
        ],
        &[
            &path_scene,
            "--size",
            "24x20",
            "--spp",
            "5",
            "--aov",
            "albedo,direct,normal",
        ],
        &["small.toml", "--turntable", "2", "-o", "#.png"],
        &["small.toml", "--frames", "1-2", "--size", "9x7", "-o", "#.png"],
    ];
    for device in ["cpu", "gpu"] {
        for options in cases {
            let outputs = if options.contains(&"-o") { &[][..] } else { &png_and_exr };
            let render = |extra: &[&str]| {
                let result =
                    folder.run(&[&["render", "--device", device, "--quiet"], options, outputs, extra].concat());
                assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{options:?}");
                read_and_remove_files(&folder)
            };
            let (without_preview, with_preview) = (render(&[]), render(&["--preview"]));
            assert!(without_preview.len() >= 2);
            assert!(without_preview == with_preview, "{device}: {options:?}");
        }
    }
}

/// Returns true if the image equals a render with `samples` samples and the options `extra`.
fn has_pixels_of(folder: &TestFolder, file: &str, samples: u32, extra: &[&str]) -> bool {
    let spp = samples.to_string();
    let size = ["render", "small.toml", "--size", "150x100", "--device", "cpu"];
    folder.run_quietly(&[&size[..], &["--spp", &spp, "-o", "expected.exr"], extra].concat());
    let result = folder.run(&["diff", file, "expected.exr"]);
    assert!([0, 5].contains(&result.code), "{}", result.stderr);
    result.code == 0
}

#[test]
fn a_signal_leaves_the_last_complete_pass() {
    for (signal, name, code, device) in [
        ("-INT", "Ctrl+C (SIGINT)", 130, "cpu"),
        ("-TERM", "SIGTERM", 143, "gpu"),
        ("-HUP", "SIGHUP", 129, "cpu"),
    ] {
        let folder = TestFolder::new();
        let files = ["out.png", "out.normal.png", "out.exr", "out.jpg", "out.webp"];
        let outputs = ["-o", "out.png", "-o", "out.exr", "-o", "out.jpg", "-o", "out.webp"];
        let extra = ["--aov", "normal", "--stats", "stats.json", "--device", device];
        let child = start(&folder, &[&outputs[..], &extra].concat());
        files.iter().for_each(|file| wait_for(&folder, file));
        fs::copy(folder.path("out.exr"), folder.path("first.exr")).expect("a copy");
        let (first, requested) = partial(&folder.path("first.exr")).expect("a partial file");
        assert!(first.is_power_of_two() && requested == 65536, "{first} of {requested}");
        std::thread::sleep(Duration::from_millis(500));
        let signal_time = Instant::now();
        send(signal, &child);
        let result = wait_for_end(child);
        assert!(
            signal_time.elapsed() < Duration::from_secs(10),
            "{:?}",
            signal_time.elapsed()
        ); // takes 2 s on an idle machine
        let (samples, _) = partial(&folder.path("out.exr")).expect("a partial file");
        let message = format!(
            "note: interrupted: the image has {samples} of 65536 samples per pixel\nerror: interrupted by {name}\n"
        );
        assert_eq!((result.code, result.stderr), (code, message), "{signal}");
        let [summary] = &result.summary[..] else {
            panic!("{:?}", result.summary)
        };
        let written = "out.png, out.normal.png, out.exr, out.jpg, out.webp: 150 x 100";
        assert!(summary.starts_with(&format!("{written}, {samples} spp")), "{summary}");
        for file in files {
            assert_eq!(partial(&folder.path(file)), Some((samples, 65536)), "{file}");
        }
        let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).expect("JSON");
        assert_eq!(
            (&stats["partial"], &stats["min_samples"]),
            (&true.into(), &samples.into())
        );
        let mut expected = files.to_vec();
        expected.extend(["first.exr", "stats.json"]);
        expected.sort_unstable();
        assert_eq!(folder.files(), expected);
        assert!(samples > first, "{samples}");
        assert!(has_pixels_of(&folder, "first.exr", first, &extra[..2]));
        assert!(has_pixels_of(&folder, "out.exr", samples, &extra[..2]));
        assert!(!has_pixels_of(&folder, "out.exr", samples + 1, &extra[..2]));
    }
}

#[test]
fn a_signal_reports_the_noise_of_the_last_complete_pass() {
    let folder = TestFolder::new();
    let noise = ["--noise", "0.00001", "--pixel-pattern", "sobol", "--device", "cpu"];
    let child = start(
        &folder,
        &[&noise[..], &["-o", "out.exr", "--stats", "stats.json"]].concat(),
    );
    wait_for(&folder, "out.exr");
    send("-INT", &child);
    let result = wait_for_end(child);
    assert_eq!(result.code, 130, "{}", result.stderr);
    let (samples, _) = partial(&folder.path("out.exr")).expect("a partial file");
    let metadata = read_metadata(&folder.path("out.exr")).expect("metadata");
    let text = metadata.get("noise").expect("the noise");
    assert!(text.starts_with(&format!("{samples} of 65536 samples, ")), "{text}");
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).expect("JSON");
    let is_known = stats["noise"].as_f64().is_some();
    assert_eq!(is_known, samples > 1, "{stats}"); // a single sample has no variance
    let [summary] = &result.summary[..] else {
        panic!("{:?}", result.summary)
    };
    assert!(summary.contains("noise "), "{summary}");
}

#[test]
fn a_second_signal_ends_at_once() {
    let folder = TestFolder::new();
    let child = start(&folder, &["-o", "out.exr", "--device", "cpu"]);
    wait_for(&folder, "out.exr");
    std::thread::sleep(Duration::from_millis(500));
    // While the program is stopped, signals stay pending. When it continues, it receives all of them at once.
    send("-STOP", &child);
    std::thread::sleep(Duration::from_millis(100));
    let before = folder.read("out.exr");
    for signal in ["-INT", "-TERM", "-HUP", "-CONT"] {
        send(signal, &child);
    }
    let result = wait_for_end(child);
    assert!([130, 143, 129].contains(&result.code), "{}", result.code);
    assert_eq!(result.stderr, "");
    assert!(folder.read("out.exr") == before, "the last pass was written");
}

#[test]
fn files_with_more_samples_are_not_replaced() {
    let folder = TestFolder::new();
    let outputs = [
        "-o",
        "a.png",
        "-o",
        "a.exr",
        "-o",
        "a.jpg",
        "-o",
        "a.webp",
        "-o",
        "other.png",
    ];
    let files = ["a.png", "a.exr", "a.jpg", "a.webp", "other.png"];
    let render = |extra: &[&str]| folder.run(&[&["render", "small.toml", "--device", "cpu"], extra].concat());
    assert_eq!(
        render(&[&outputs[..], &["--size", "2x2", "--spp", "60000"]].concat()).code,
        0
    );
    folder.write("other.png", "mine");
    let before = files.map(|file| folder.read(file));
    let child = start(&folder, &[&outputs[..], &["-o", "new.exr", "--device", "cpu"]].concat());
    wait_for(&folder, "new.exr");
    send("-INT", &child);
    let result = wait_for_end(child);
    let (samples, _) = partial(&folder.path("new.exr")).expect("a partial file");
    assert!(has_pixels_of(&folder, "new.exr", samples, &[]));
    let fewer_samples = "has 60000 samples per pixel; a preview with fewer samples does not replace it";
    let not_by_wgray = "was not written by wgray; a preview does not replace it, but the complete image will";
    let notes = files.map(|file| match file {
        "other.png" => format!("note: {file}: {not_by_wgray}\n"),
        _ => format!("note: {file}: {fewer_samples}\n"),
    });
    let interrupted = format!("note: interrupted: the image has {samples} of 65536 samples per pixel\n");
    let error = "error: interrupted by Ctrl+C (SIGINT)\n";
    assert_eq!(
        (result.code, result.stderr),
        (130, [&notes.concat(), &*interrupted, error].concat())
    );
    assert_eq!(files.map(|file| folder.read(file)), before);
    // Nothing is written if all files have more samples.
    let child = start(
        &folder,
        &[&outputs[..8], &["--stats", "stats.json", "--device", "cpu"]].concat(),
    );
    std::thread::sleep(Duration::from_secs(1));
    wait_until("a temporary file", || {
        folder.files().iter().any(|name| name.starts_with(".wgray-"))
    });
    send("-INT", &child);
    let result = wait_for_end(child);
    assert_eq!(result.code, 130, "{}", result.stderr);
    assert!(
        result
            .stderr
            .contains("note: the samples taken so far were not written\n"),
        "{}",
        result.stderr
    );
    assert!(result.summary.is_empty() && !folder.path("stats.json").exists());
    assert_eq!(files.map(|file| folder.read(file)), before);
    // The complete image replaces all files, even files with more samples.
    let result = render(&[&outputs[..], &["--preview", "--spp", "2"]].concat());
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(files.iter().all(|file| partial(&folder.path(file)).is_none()));
    let result = render(&["--preview", "--spp", "1000", "-o", "a.png"]);
    assert_eq!(
        (result.code, result.stderr.as_str()),
        (
            0,
            "note: a.png: has 2 samples per pixel; a preview with fewer samples does not replace it\n"
        )
    );
}

#[test]
fn partial_files_do_not_count_as_existing() {
    let folder = TestFolder::new();
    let child = start(
        &folder,
        &["--frames", "1-3", "-o", "#.png", "-o", "#.exr", "--device", "cpu"],
    );
    wait_for(&folder, "1.exr");
    send("-INT", &child);
    assert_eq!(wait_for_end(child).code, 130);
    assert_eq!(folder.files(), ["1.exr", "1.png"], "another frame was started");
    let run = || {
        let arguments = [
            "render",
            "small.toml",
            "--frames",
            "1",
            "-o",
            "#.png",
            "-o",
            "#.exr",
            "--skip-existing",
        ];
        folder.run(&[&arguments[..], &["--device", "cpu"]].concat())
    };
    assert!(partial(&folder.path("1.png")).is_some() && partial(&folder.path("1.exr")).is_some());
    let result = run();
    assert!(result.code == 0 && result.summary.len() == 1, "{}", result.stderr);
    assert!(partial(&folder.path("1.png")).is_none() && partial(&folder.path("1.exr")).is_none());
    let result = run();
    assert!(
        result.code == 0 && result.stderr.contains("note: skipped 1 of 1"),
        "{}",
        result.stderr
    );
}

#[test]
fn a_signal_writes_the_samples_to_the_checkpoint() {
    let folder = TestFolder::new();
    let options = ["--spp", "2000", "--device", "cpu"];
    let render = |extra: &[&str]| {
        let result = folder.run(&[&["render", "small.toml", "--size", "150x100"], &options[..], extra].concat());
        assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    };
    render(&["-o", "whole.exr"]);
    let checkpoint = ["--checkpoint", "c", "--resume", "-o", "out.exr"];
    let mut arguments = vec![
        "render",
        "small.toml",
        "--size",
        "150x100",
        "--preview",
        "--threads",
        "1",
    ];
    arguments.extend(options.iter().chain(&checkpoint));
    restore_signal_defaults();
    let child = Command::new(program())
        .current_dir(folder.path("."))
        .args(&arguments)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program");
    wait_for(&folder, "out.exr");
    send("-INT", &child);
    let result = wait_for_end(child);
    let message = "note: progress is saved in c; --resume continues\nerror: interrupted by Ctrl+C (SIGINT)\n";
    assert_eq!((result.code, result.stderr.as_str()), (130, message));
    let (samples, requested) = partial(&folder.path("out.exr")).expect("a partial file");
    assert!(
        samples.is_power_of_two() && requested == 2000,
        "{samples} of {requested}"
    );
    render(&[&checkpoint[..], &["--preview"]].concat());
    assert!(folder.read("out.exr") == folder.read("whole.exr"));
}

#[test]
fn previews_need_a_pattern_with_passes_and_a_file() {
    let folder = TestFolder::new();
    for (options, rule) in [
        (&["--tile", "1/2", "-o", "x.part"][..], "cannot be used with '--tile"),
        (
            &["--pixel-pattern", "grid", "--spp", "4"],
            "--preview: the first samples must cover the pixel, but those of --pixel-pattern grid do not; use sobol",
        ),
        (
            &["--pixel-pattern", "jittered", "--spp", "4"],
            "--preview: the first samples must cover the pixel, but those of --pixel-pattern jittered",
        ),
        (
            &["-o", "-"],
            "--preview: needs an output that is a file, such as -o NAME.png",
        ),
        (&["-o", "/dev/null"], "--preview: needs an output that is a file"),
    ] {
        let result = folder.run(&[&["render", "small.toml", "--preview", "--device", "cpu"], options].concat());
        assert_eq!(result.code, 2, "{}", result.stderr);
        assert!(result.stderr.contains(rule), "{}", result.stderr);
        assert!(folder.files().is_empty(), "{:?}", folder.files());
    }
    // A stream receives only the complete image.
    let line = "\"$0\" render small.toml --preview --device cpu -q -o - -o a.png > b.png";
    let result = folder.shell("sh", line);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("a.png") == folder.read("b.png"));
}

#[test]
fn a_time_limit_ends_previews() {
    let folder = TestFolder::new();
    let child = start(&folder, &["--time-limit", "1", "-o", "out.exr", "--device", "cpu"]);
    let result = wait_for_end(child);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(
        result.stderr.starts_with("note: time limit reached: "),
        "{}",
        result.stderr
    );
    let metadata = read_metadata(&folder.path("out.exr")).expect("metadata");
    assert_eq!(
        (metadata.get("time_limit"), metadata.get("partial")),
        (Some("1 s"), None)
    );
}

/// A file size limit simulates a full disk.
#[test]
fn on_a_full_disk_previews_are_not_written_and_the_older_file_remains() {
    for output in ["out.png", "out.exr"] {
        let folder = TestFolder::new();
        let base = ["render", "small.toml", "--spp", "1", "-o", output, "--device", "cpu"];
        folder.run_quietly(&[&base[..], &["--size", "2x2"]].concat());
        let before = folder.read(output);
        let limit = "trap '' XFSZ; ulimit -f 8;";
        let line =
            format!("{limit} exec \"$0\" render small.toml --spp 3 --size 300x300 --preview -o {output} --device cpu");
        let result = folder.shell("sh", &line);
        let warning =
            format!("warning: {output}: cannot be written: File too large (os error 27); the preview is not written\n");
        assert_eq!(result.code, 8, "{}", result.stderr);
        assert!(result.stderr.starts_with(&warning), "{}", result.stderr);
        assert!(result.stderr.contains("error: "), "{}", result.stderr);
        // If a signal ends the render, the preview is not written, either.
        let child = start_in_shell(&folder, limit, &["-o", output, "--device", "cpu"]);
        wait_until("a temporary file", || {
            folder.files().iter().any(|name| name.starts_with(".wgray-"))
        });
        std::thread::sleep(Duration::from_secs(1));
        send("-INT", &child);
        let result = wait_for_end(child);
        let expected_end = "note: the samples taken so far were not written\nerror: interrupted by Ctrl+C (SIGINT)\n";
        assert_eq!((result.code, result.stderr), (130, warning + expected_end), "{output}");
        assert!(folder.read(output) == before && folder.files() == [output]);
    }
}
