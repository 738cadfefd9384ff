//! Files appear when they are whole, and nothing else is left.

use std::fs;

use super::Place;

#[test]
fn a_file_that_cannot_be_written_fails_with_1() {
    let place = Place::new();
    fs::create_dir(place.path("folder.png")).unwrap();
    for (output, message) in [
        ("nowhere/out.png", "nowhere/out.png: cannot be written: No such file"),
        ("small.toml/out.exr", "small.toml/out.exr: cannot be written: "),
        ("folder.png", "folder.png: cannot be written: is a directory"),
    ] {
        let ran = place.run(&["render", "small.toml", "-o", output]);
        assert_eq!((ran.code, ran.stdout.as_str()), (1, ""), "{}", ran.stderr);
        assert!(ran.stderr.starts_with(&format!("error: {message}")), "{}", ran.stderr);
        assert_eq!(place.files(), ["folder.png"]);
    }
    let ran = place.run(&["render", "small.toml", "--stats", "nowhere/stats.json"]);
    assert_eq!(ran.code, 1);
    assert!(
        ran.stderr.contains("nowhere/stats.json: cannot be written"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_file_is_replaced_by_the_next() {
    let place = Place::new();
    place.write("out.png", "old");
    place.quietly(&["render", "small.toml", "-o", "out.png"]);
    assert!(place.read("out.png").starts_with(b"\x89PNG"));
    assert_eq!(place.files(), ["out.png"]);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::PermissionsExt;
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    use super::super::program;
    use super::*;

    #[test]
    fn permissions_are_those_of_any_new_file() {
        let place = Place::new();
        place.quietly(&["render", "small.toml", "--stats", "stats.json"]);
        let mode = |name: &str| fs::metadata(place.path(name)).unwrap().permissions().mode();
        assert_eq!(mode("small.png"), mode("small.toml"));
        assert_eq!(mode("stats.json"), mode("small.toml"));
    }

    /// A disk that fills up: here, a limit on the size of files.
    #[test]
    fn half_a_file_is_not_kept() {
        let place = Place::new();
        for (output, aov) in [("out.png", "normal"), ("out.exr", "depth")] {
            place.write(output, "old");
            let command = "trap '' XFSZ; ulimit -f 8; exec \"$0\" render small.toml --size 300x300 --spp 1 \"$@\"";
            let output = Command::new("sh")
                .current_dir(place.path("."))
                .args(["-c", command])
                .arg(program())
                .args(["-o", output, "--aov", aov, "--device", "cpu"])
                .output()
                .unwrap();
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(1), "{stderr}");
            assert!(stderr.contains(": cannot be written: File too large"), "{stderr}");
        }
        assert_eq!(place.files(), ["out.exr", "out.png"]);
        assert_eq!(
            (place.read("out.exr"), place.read("out.png")),
            (b"old".to_vec(), b"old".to_vec())
        );
    }

    /// Ctrl-C during a render that would take minutes.
    #[test]
    fn an_interrupted_render_leaves_no_trace() {
        for device in ["cpu", "gpu"] {
            let place = Place::new();
            place.write("out.exr", "old");
            let mut child = Command::new(program())
                .current_dir(place.path("."))
                .args(["render", "small.toml", "-o", "out.exr", "--device", device])
                .args(["--size", "2000x2000", "--spp", "400"])
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            let start = Instant::now();
            while !place.files().iter().any(|name| name.starts_with(".wgray-")) {
                assert!(
                    start.elapsed() < Duration::from_secs(60),
                    "no file was begun: {:?}",
                    place.files()
                );
                std::thread::sleep(Duration::from_millis(20));
            }
            let killed = Command::new("kill")
                .args(["-INT", &child.id().to_string()])
                .status()
                .unwrap();
            assert!(killed.success());
            let status = child.wait().unwrap();
            assert_eq!(status.code(), Some(130));
            assert_eq!(place.files(), ["out.exr"]);
            assert_eq!(place.read("out.exr"), b"old");
        }
    }

    #[test]
    fn a_reader_that_goes_is_no_failure() {
        let place = Place::new();
        let output = Command::new("sh")
            .current_dir(place.path("."))
            .args(["-c", "{ \"$0\" check small.toml small.toml; echo $? >&2; } | true"])
            .arg(program())
            .output()
            .unwrap();
        assert_eq!(String::from_utf8(output.stderr).unwrap(), "0\n");
    }
}
