//! Atomic output files: a file appears only when complete, and no temporary files remain.

use std::fs;

use super::TestFolder;

#[test]
fn a_file_that_cannot_be_written_fails_with_8() {
    let folder = TestFolder::new();
    fs::create_dir(folder.path("folder.png")).unwrap();
    for (output, message) in [
        (
            "nowhere/out.png",
            "nowhere/out.png: cannot be written: the folder nowhere does not exist",
        ),
        ("small.toml/out.exr", "small.toml/out.exr: cannot be written: "),
        ("folder.png", "folder.png: cannot be written: it is a folder"),
    ] {
        let result = folder.run(&["render", "small.toml", "-o", output]);
        assert_eq!((result.code, result.stdout.as_str()), (8, ""), "{}", result.stderr);
        assert!(
            result.stderr.starts_with(&format!("error: {message}")),
            "{}",
            result.stderr
        );
        assert_eq!(folder.files(), ["folder.png"]);
    }
    let result = folder.run(&["render", "small.toml", "--stats", "nowhere/stats.json"]);
    assert_eq!(result.code, 8);
    assert_eq!(
        folder.files(),
        ["folder.png"],
        "the image was rendered before the error"
    );
    assert!(
        result.stderr.contains("nowhere/stats.json: cannot be written"),
        "{}",
        result.stderr
    );
}

#[test]
fn a_file_is_replaced_by_the_next_render() {
    let folder = TestFolder::new();
    folder.write("out.png", "old");
    folder.run_quietly(&["render", "small.toml", "-o", "out.png"]);
    assert!(folder.read("out.png").starts_with(b"\x89PNG"));
    assert_eq!(folder.files(), ["out.png"]);
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
        let folder = TestFolder::new();
        folder.run_quietly(&["render", "small.toml", "--stats", "stats.json"]);
        let mode = |name: &str| fs::metadata(folder.path(name)).unwrap().permissions().mode();
        assert_eq!(mode("small.png"), mode("small.toml"));
        assert_eq!(mode("stats.json"), mode("small.toml"));
    }

    /// A limit on file sizes simulates a full disk.
    #[test]
    fn an_incomplete_file_is_removed() {
        let folder = TestFolder::new();
        for (output, aov) in [("out.png", "normal"), ("out.exr", "depth")] {
            folder.write(output, "old");
            let command = "trap '' XFSZ; ulimit -f 8; exec \"$0\" render small.toml --size 300x300 --spp 1 \"$@\"";
            let output = Command::new("sh")
                .current_dir(folder.path("."))
                .args(["-c", command])
                .arg(program())
                .args(["-o", output, "--aov", aov, "--device", "cpu"])
                .output()
                .unwrap();
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(8), "{stderr}");
            assert!(stderr.contains(": cannot be written: File too large"), "{stderr}");
        }
        assert_eq!(folder.files(), ["out.exr", "out.png"]);
        assert_eq!(
            (folder.read("out.exr"), folder.read("out.png")),
            (b"old".to_vec(), b"old".to_vec())
        );
    }

    /// Starts a render that takes minutes, and waits for its temporary file.
    fn long_render(folder: &TestFolder, shell_prefix: &str, options: &[&str]) -> Child {
        let before = temporary_files(folder);
        let child = Command::new("sh")
            .current_dir(folder.path("."))
            .args([
                "-c",
                &format!("{shell_prefix} exec \"$0\" render small.toml -o out.exr --size 2000x2000 \"$@\""),
            ])
            .arg(program())
            .args(options)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while temporary_files(folder) == before {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "no file was created: {:?}",
                folder.files()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
        child
    }

    fn temporary_files(folder: &TestFolder) -> Vec<String> {
        folder
            .files()
            .into_iter()
            .filter(|name| name.starts_with(".wgray-"))
            .collect()
    }

    fn send(signal: &str, child: &Child) {
        let status = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status()
            .unwrap();
        assert!(status.success());
    }

    #[test]
    fn an_interrupted_render_leaves_no_files() {
        crate::cli::restore_signal_defaults();
        for (device, signal, code) in [
            ("cpu", "-INT", 130),
            ("gpu", "-INT", 130),
            ("cpu", "-TERM", 143),
            ("cpu", "-HUP", 129),
        ] {
            let folder = TestFolder::new();
            folder.write("out.exr", "old");
            let mut child = long_render(&folder, "", &["--spp", "400", "--device", device]);
            // The temporary file appears before the signal handlers are installed.
            std::thread::sleep(Duration::from_millis(100));
            send(signal, &child);
            assert_eq!(child.wait().unwrap().code(), Some(code), "{signal}");
            assert_eq!(folder.files(), ["out.exr"]);
            assert_eq!(folder.read("out.exr"), b"old");
        }
    }

    /// `nohup` ignores SIGHUP for its child, and shells ignore SIGINT for background jobs.
    #[test]
    fn ignored_signals_stay_ignored() {
        for signal in ["HUP", "INT", "TERM"] {
            let folder = TestFolder::new();
            let ignore = format!("trap '' {signal};");
            let mut child = long_render(
                &folder,
                &ignore,
                &["--crop", "0,0,64,64", "--spp", "256", "--device", "cpu"],
            );
            send(&format!("-{signal}"), &child);
            assert_eq!(child.wait().unwrap().code(), Some(0), "{signal}");
            assert_eq!(folder.files(), ["out.exr"]);
        }
    }

    #[test]
    fn temporary_files_of_killed_renders_are_removed_by_the_next_render() {
        let folder = TestFolder::new();
        let mut killed = long_render(&folder, "", &["--spp", "400", "--device", "cpu"]);
        send("-KILL", &killed);
        killed.wait().unwrap();
        let [leftover] = temporary_files(&folder).try_into().unwrap();
        let process_prefix = format!(".wgray-{}@", killed.id());
        assert!(
            leftover.starts_with(&process_prefix) && leftover.ends_with("-out.exr"),
            "{leftover}"
        );
        // Folders and temporary files of another output, another machine or a running process are kept.
        let other_machine = leftover.replace('@', "@not-");
        let other_output = leftover.replace("-out.exr", "-about.exr");
        let kept_folder = leftover.replace(&process_prefix, ".wgray-1@");
        for name in [&other_machine, &other_output] {
            folder.write(name, "");
        }
        fs::create_dir(folder.path(&kept_folder)).unwrap();
        let mut running = long_render(&folder, "", &["--spp", "400", "--device", "cpu"]);
        let running_file = temporary_files(&folder)
            .into_iter()
            .find(|name| name.contains(&format!("-{}@", running.id())))
            .unwrap();
        assert!(
            !folder.path(&leftover).exists(),
            "the next render did not remove the temporary file"
        );
        folder.run_quietly(&["render", "small.toml", "-o", "out.exr", "--device", "cpu"]);
        let mut expected = [other_machine, other_output, kept_folder, running_file];
        expected.sort();
        assert_eq!(temporary_files(&folder), expected);
        send("-TERM", &running);
        running.wait().unwrap();
    }

    #[test]
    fn a_closed_pipe_is_not_an_error() {
        let folder = TestFolder::new();
        let output = Command::new("sh")
            .current_dir(folder.path("."))
            .args(["-c", "{ \"$0\" check small.toml small.toml; echo $? >&2; } | true"])
            .arg(program())
            .output()
            .unwrap();
        assert_eq!(String::from_utf8(output.stderr).unwrap(), "0\n");
    }
}
