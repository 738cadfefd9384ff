//! `--log-format json`: each line of standard error is a JSON object.

#[cfg(unix)]
use std::io::{BufRead as _, BufReader};
#[cfg(unix)]
use std::process::{Command, Stdio};

use serde_json::Value;

#[cfg(unix)]
use super::program;
use super::{NO_DRIVER, RunResult, SCENE, TestFolder};

/// Parses standard error and checks that each line has the keys of all messages.
fn lines(result: &RunResult) -> Vec<Value> {
    let lines = result.stderr.lines().map(|line| {
        let value: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
        for key in ["level", "message", "time"] {
            assert!(value.get(key).is_some(), "{key}: {line}");
        }
        value
    });
    lines.collect()
}

fn log(folder: &TestFolder, arguments: &[&str]) -> (i32, Vec<Value>) {
    let result = folder.run(&[&["--log-format", "json"], arguments].concat());
    (result.code, lines(&result))
}

#[test]
fn a_render_logs_progress_and_statistics() {
    let folder = TestFolder::new();
    let (code, lines) = log(
        &folder,
        &[
            "render",
            "small.toml",
            "-o",
            "a.png",
            "--device",
            "cpu",
            "--size",
            "200x100",
        ],
    );
    assert_eq!(code, 0);
    let (last, progress) = lines.split_last().expect("lines");
    assert!(!progress.is_empty() && progress.len() <= 11, "{progress:?}");
    let shares: Vec<f64> = progress.iter().map(|line| line["share"].as_f64().unwrap()).collect();
    let starts_with_digit = |line: &Value| {
        line["message"]
            .as_str()
            .is_some_and(|text| text.starts_with(|c: char| c.is_ascii_digit()))
    };
    assert!(progress.iter().all(starts_with_digit), "{progress:?}");
    assert!(shares.is_sorted() && shares.last() == Some(&1.0), "{shares:?}");
    assert!(progress.iter().all(|line| line["level"] == "progress"), "{progress:?}");
    assert_eq!(
        (&last["level"], &last["message"]),
        (&"info".into(), &"render done".into())
    );
    assert_eq!(
        (&last["files"][0], &last["stats"]["width"]),
        (&"a.png".into(), &200.into())
    );
    let (_, lines) = log(&folder, &["render", "small.toml", "-o", "a.png", "--progress", "none"]);
    assert_eq!(lines.len(), 1, "{lines:?}");
    let (_, lines) = log(&folder, &["render", "small.toml", "-o", "a.png", "--verbose"]);
    let scene_read = lines
        .iter()
        .find(|line| line["message"] == "scene read")
        .expect("an event");
    assert!(scene_read["seconds"].as_f64() > Some(0.0), "{scene_read}");
    let is_done = |line: &&Value| line["message"] == "render done";
    assert_eq!(lines.iter().filter(is_done).count(), 1, "{lines:?}");
    let (code, lines) = log(&folder, &["render", "small.toml", "-o", "a.png", "--quiet"]);
    assert_eq!((code, lines.len()), (0, 0));
    let (_, lines) = log(&folder, &["render", "small.toml", "-o", "#.png", "--frames", "1-2"]);
    assert!(
        lines.iter().any(|line| line["frame"] == 2 && line["share"] == 1.0),
        "{lines:?}"
    );
    assert!(lines.iter().any(|line| line["level"] == "warning"), "{lines:?}");
    let result = folder.run(&["render", "small.toml", "-o", "a.png", "--log-format", "text"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
}

#[test]
fn each_error_of_a_scene_is_a_separate_message() {
    let folder = TestFolder::new();
    let invalid_scene = SCENE
        .replace("radius = 0.8", "radius = -1")
        .replace("fov = 40", "fov = 1000");
    folder.write("bad.toml", &invalid_scene);
    let lights = "[[lights]]\ntype = \"point\"\n".repeat(30);
    folder.write("many.toml", &format!("{SCENE}{lights}"));
    for command in ["check", "render", "info"] {
        let result = folder.run(&[command, "bad.toml"]);
        let lines: Vec<&str> = result.stderr.lines().collect();
        assert_eq!((result.code, lines.len()), (3, 2), "{}", result.stderr);
        assert!(lines[0].starts_with("error: bad.toml:") && lines[0].contains(": camera.fov: 1000 must be"));
        assert!(
            lines[1].starts_with("error: bad.toml:22: shapes[0].radius: -1 must be"),
            "{}",
            lines[1]
        );
        let (code, lines) = log(&folder, &[command, "bad.toml"]);
        let keys: Vec<_> = lines
            .iter()
            .map(|line| (&line["key"], &line["exit_code"], &line["file"]))
            .collect();
        let [exit_code, file] = [3.into(), "bad.toml".into()];
        assert_eq!(
            (code, keys),
            (
                3,
                vec![
                    (&"camera.fov".into(), &exit_code, &file),
                    (&"shapes[0].radius".into(), &exit_code, &file)
                ]
            )
        );
    }
    let result = folder.run(&["check", "many.toml", "bad.toml"]);
    let lines: Vec<&str> = result.stderr.lines().collect();
    assert_eq!(
        (result.code, lines.len(), lines[20]),
        (3, 23, "error: and 10 more errors")
    );
    let (_, lines) = log(&folder, &["check", "many.toml"]);
    assert_eq!((lines.len(), &lines[20]["level"]), (21, &"error".into()));
}

#[test]
fn errors_have_location_and_exit_code() {
    let folder = TestFolder::new();
    folder.write("value.toml", &SCENE.replace("radius = 0.8", "radius = -1"));
    folder.write("syntax.toml", "image = [\n[");
    folder.write("broken.gltf", "{ \"asset\": 3 }");
    let single_error = |arguments: &[&str]| {
        let (code, mut lines) = log(&folder, arguments);
        assert_eq!(lines.len(), 1, "{lines:?}");
        let line = lines.remove(0);
        assert_eq!(
            (&line["level"], &line["exit_code"]),
            (&"error".into(), &code.into()),
            "{line}"
        );
        assert!(!line["message"].as_str().unwrap().starts_with("error"), "{line}");
        line
    };
    let value = single_error(&["check", "value.toml"]);
    assert_eq!((&value["exit_code"], &value["file"]), (&3.into(), &"value.toml".into()));
    assert_eq!(
        (&value["key"], &value["line"]),
        (&"shapes[0].radius".into(), &22.into())
    );
    let syntax = single_error(&["render", "syntax.toml"]);
    assert!(
        syntax["line"].as_u64() > Some(0) && syntax["column"].as_u64() > Some(0),
        "{syntax}"
    );
    assert_eq!(single_error(&["info", "nowhere.toml"])["file"], "nowhere.toml");
    let model = single_error(&["check", "broken.gltf"]);
    assert!(model["file"].as_str().unwrap().ends_with("broken.gltf"), "{model}");
    assert_eq!(
        single_error(&["render", "small.toml", "--device", "nonesuch"])["exit_code"],
        4
    );
    assert_eq!(
        single_error(&["render", "small.toml", "-o", "small.toml"])["exit_code"],
        2
    );
    for arguments in [
        &["render"][..],
        &["render", "--bad"],
        &["paint"],
        &["render", "small.toml", "--size", "9"],
        &[],
    ] {
        let usage = single_error(arguments);
        assert_eq!(usage["exit_code"], 2, "{usage}");
        assert!(
            !usage["message"].as_str().unwrap().contains('\n') || arguments.is_empty(),
            "{usage}"
        );
    }
    let (code, lines) = log(&folder, &["check", "value.toml", "syntax.toml", "small.toml"]);
    assert_eq!((code, lines.len()), (3, 2));
    // Control characters in a file name are escaped, so the message remains one line.
    let escaped = single_error(&["render", "a\n\"b\".toml"]);
    assert_eq!(escaped["file"], "a\n\"b\".toml");
}

#[test]
fn warnings_and_notes_have_levels() {
    let folder = TestFolder::new();
    let result = folder.run_with(
        &[
            "render",
            "small.toml",
            "-o",
            "a.png",
            "--log-format=json",
            "--progress",
            "none",
        ],
        &NO_DRIVER,
    );
    let lines = lines(&result);
    assert_eq!((result.code, lines.len()), (0, 2), "{lines:?}");
    assert_eq!(lines[0]["level"], "warning");
    assert!(
        lines[0]["message"]
            .as_str()
            .unwrap()
            .starts_with("rendering on the CPU: "),
        "{lines:?}"
    );
}

#[test]
#[cfg(unix)]
fn a_signal_is_an_error_with_its_exit_code() {
    super::restore_signal_defaults();
    let folder = TestFolder::new();
    let options =
        "render small.toml --size 4000x4000 --spp 1024 --device cpu -o a.png --log-format json --progress none -v";
    let mut child = Command::new(program())
        .current_dir(folder.folder())
        .args(options.split(' '))
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut stderr_lines = BufReader::new(child.stderr.take().expect("a pipe"))
        .lines()
        .map_while(Result::ok);
    // The program installs its signal handlers before it prints the message `ready`.
    assert!(stderr_lines.any(|line| line.contains("\"ready\"")));
    // SAFETY: the process is a child that has not been waited for, so that its id is still valid.
    unsafe { libc::kill(child.id() as i32, libc::SIGTERM) };
    let stderr: Vec<String> = stderr_lines.collect();
    let code = child.wait().expect("an exit status").code().unwrap_or(-1);
    let result = RunResult::new(Some(code), String::new(), &stderr.join("\n"), &[]);
    let lines = lines(&result);
    let last = lines.last().expect("a line");
    assert_eq!(
        (code, &last["level"], &last["message"]),
        (143, &"error".into(), &"interrupted by SIGTERM".into())
    );
    assert_eq!(last["exit_code"], 143);
    assert!(folder.files().is_empty());
}

#[test]
fn openjd_progress_excludes_a_json_log() {
    let folder = TestFolder::new();
    let (code, lines) = log(&folder, &["render", "small.toml", "--progress", "openjd"]);
    let rule = "--progress: openjd cannot be combined with --log-format json";
    assert_eq!((code, &lines[0]["message"]), (2, &rule.into()));
}

#[test]
#[cfg(unix)]
fn an_unwritable_log_does_not_end_a_render() {
    let folder = TestFolder::new();
    for redirection in ["2>/dev/full", "2>&-"] {
        let result = folder.shell(
            "sh",
            &format!("$0 render small.toml -o a.png --log-format json {redirection}"),
        );
        assert_eq!(result.code, 0, "{redirection}");
    }
    let result = folder.shell("sh", "$0 info small.toml --log-format json >/dev/full");
    assert_eq!((result.code, &lines(&result)[0]["exit_code"]), (8, &8.into()));
    for command in ["schema", "completions zsh", "man", "info small.toml"] {
        let result = folder.shell("sh", &format!("$0 {command} | true"));
        assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{command}");
        assert_eq!(
            folder.shell("sh", &format!("$0 {command} >/dev/full")).code,
            8,
            "{command}"
        );
    }
}
