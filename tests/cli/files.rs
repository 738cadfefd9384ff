//! Atomic output files: a file appears only when complete, and no temporary files remain.

use std::fs;

use super::TestFolder;

#[test]
fn a_file_that_cannot_be_written_fails_with_8() {
    let place = TestFolder::new();
    fs::create_dir(place.path("folder.png")).unwrap();
    for (output, message) in [
        (
            "nowhere/out.png",
            "nowhere/out.png: cannot be written: the folder nowhere does not exist",
        ),
        ("small.toml/out.exr", "small.toml/out.exr: cannot be written: "),
        ("folder.png", "folder.png: cannot be written: it is a folder"),
    ] {
        let ran = place.run(&["render", "small.toml", "-o", output]);
        assert_eq!((ran.code, ran.stdout.as_str()), (8, ""), "{}", ran.stderr);
        assert!(ran.stderr.starts_with(&format!("error: {message}")), "{}", ran.stderr);
        assert_eq!(place.files(), ["folder.png"]);
    }
    let ran = place.run(&["render", "small.toml", "--stats", "nowhere/stats.json"]);
    assert_eq!(ran.code, 8);
    assert_eq!(place.files(), ["folder.png"], "the image was rendered before the error");
    assert!(
        ran.stderr.contains("nowhere/stats.json: cannot be written"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_file_is_replaced_by_the_next_render() {
    let place = TestFolder::new();
    place.write("out.png", "old");
    place.quietly(&["render", "small.toml", "-o", "out.png"]);
    assert!(place.read("out.png").starts_with(b"\x89PNG"));
    assert_eq!(place.files(), ["out.png"]);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::PermissionsExt;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    use super::super::program;
    use super::*;

    #[test]
    fn outputs_have_the_permissions_of_a_new_file() {
        let place = TestFolder::new();
        place.quietly(&["render", "small.toml", "--stats", "stats.json"]);
        let mode = |name: &str| fs::metadata(place.path(name)).unwrap().permissions().mode();
        assert_eq!(mode("small.png"), mode("small.toml"));
        assert_eq!(mode("stats.json"), mode("small.toml"));
    }

    /// Simulates a full disk by a limit on file sizes.
    #[test]
    fn an_incomplete_file_is_removed() {
        let place = TestFolder::new();
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
            assert_eq!(output.status.code(), Some(8), "{stderr}");
            assert!(stderr.contains(": cannot be written: File too large"), "{stderr}");
        }
        assert_eq!(place.files(), ["out.exr", "out.png"]);
        assert_eq!(
            (place.read("out.exr"), place.read("out.png")),
            (b"old".to_vec(), b"old".to_vec())
        );
    }

    /// Starts a render that takes minutes, and waits for its temporary file.
    fn long_render(place: &TestFolder, shell: &str, options: &[&str]) -> Child {
        let before = temporary(place);
        let child = Command::new("sh")
            .current_dir(place.path("."))
            .args([
                "-c",
                &format!("{shell} exec \"$0\" render small.toml -o out.exr --size 2000x2000 \"$@\""),
            ])
            .arg(program())
            .args(options)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while temporary(place) == before {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "no file was created: {:?}",
                place.files()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
        child
    }

    fn temporary(place: &TestFolder) -> Vec<String> {
        place
            .files()
            .into_iter()
            .filter(|name| name.starts_with(".wgray-"))
            .collect()
    }

    fn send(signal: &str, child: &Child) {
        let sent = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status()
            .unwrap();
        assert!(sent.success());
    }

    #[test]
    fn an_interrupted_render_leaves_no_files() {
        crate::cli::heed_interrupts();
        for (device, signal, code) in [
            ("cpu", "-INT", 130),
            ("gpu", "-INT", 130),
            ("cpu", "-TERM", 143),
            ("cpu", "-HUP", 129),
        ] {
            let place = TestFolder::new();
            place.write("out.exr", "old");
            let mut child = long_render(&place, "", &["--spp", "400", "--device", device]);
            std::thread::sleep(Duration::from_millis(100)); // the signal handler is installed after the file is created
            send(signal, &child);
            assert_eq!(child.wait().unwrap().code(), Some(code), "{signal}");
            assert_eq!(place.files(), ["out.exr"]);
            assert_eq!(place.read("out.exr"), b"old");
        }
    }

    /// `nohup` (SIGHUP) and shells (SIGINT, for background jobs) ignore them for their children.
    #[test]
    fn ignored_signals_stay_ignored() {
        for signal in ["HUP", "INT", "TERM"] {
            let place = TestFolder::new();
            let ignore = format!("trap '' {signal};");
            let mut child = long_render(
                &place,
                &ignore,
                &["--crop", "0,0,64,64", "--spp", "256", "--device", "cpu"],
            );
            send(&format!("-{signal}"), &child);
            assert_eq!(child.wait().unwrap().code(), Some(0), "{signal}");
            assert_eq!(place.files(), ["out.exr"]);
        }
    }

    #[test]
    fn temporary_files_of_killed_renders_are_removed_by_the_next() {
        let place = TestFolder::new();
        let mut killed = long_render(&place, "", &["--spp", "400", "--device", "cpu"]);
        send("-KILL", &killed);
        killed.wait().unwrap();
        let [left] = temporary(&place).try_into().unwrap();
        let process = format!(".wgray-{}@", killed.id());
        assert!(left.starts_with(&process) && left.ends_with("-out.exr"), "{left}");
        // Folders and temporary files of another output, another machine or a running process are kept.
        let other_machine = left.replace('@', "@not-");
        let other_output = left.replace("-out.exr", "-about.exr");
        let folder = left.replace(&process, ".wgray-1@");
        for name in [&other_machine, &other_output] {
            place.write(name, "");
        }
        fs::create_dir(place.path(&folder)).unwrap();
        let mut living = long_render(&place, "", &["--spp", "400", "--device", "cpu"]);
        let living_file = temporary(&place)
            .into_iter()
            .find(|name| name.contains(&format!("-{}@", living.id())))
            .unwrap();
        assert!(!place.path(&left).exists(), "the next render did not remove the file");
        place.quietly(&["render", "small.toml", "-o", "out.exr", "--device", "cpu"]);
        let mut expected = [other_machine, other_output, folder, living_file];
        expected.sort();
        assert_eq!(temporary(&place), expected);
        send("-TERM", &living);
        living.wait().unwrap();
    }

    #[test]
    fn a_closed_pipe_is_not_an_error() {
        let place = TestFolder::new();
        let output = Command::new("sh")
            .current_dir(place.path("."))
            .args(["-c", "{ \"$0\" check small.toml small.toml; echo $? >&2; } | true"])
            .arg(program())
            .output()
            .unwrap();
        assert_eq!(String::from_utf8(output.stderr).unwrap(), "0\n");
    }
}
