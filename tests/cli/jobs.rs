//! Checkpoints, parts and time limits, tested by running, signaling and killing the program.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{RunResult, TestFolder, program};

/// A render that takes a few seconds.
const LONG_RENDER: [&str; 8] = [
    "render",
    "small.toml",
    "--size",
    "160x160",
    "--spp",
    "300",
    "--aov",
    "normal",
];

fn render_expected(folder: &TestFolder) -> Vec<u8> {
    let mut arguments = LONG_RENDER.to_vec();
    arguments.extend(["-o", "whole.exr", "--reproducible", "--device", "cpu"]);
    folder.run_quietly(&arguments);
    folder.read("whole.exr")
}

fn start(folder: &TestFolder, arguments: &[&str]) -> Child {
    Command::new(program())
        .current_dir(folder.path("."))
        .args(LONG_RENDER)
        .args(["--reproducible", "--threads", "1"]) // so that the render takes seconds on any machine
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program")
}

/// Waits until the file has more than `bytes` bytes.
fn wait_for(folder: &TestFolder, file: &str, bytes: u64) {
    let start = Instant::now();
    while fs::metadata(folder.path(file)).map_or(0, |data| data.len()) <= bytes {
        assert!(start.elapsed() < Duration::from_secs(60), "{file} does not grow");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Waits until the child has used 0.15 s of CPU time. By then, its signal handlers are installed.
fn wait_for_cpu_time(child: &Child) {
    let cpu_ticks = || {
        let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
        let fields: Vec<&str> = stat.rsplit(") ").next()?.split(' ').collect();
        let number = |i: usize| fields.get(i)?.parse::<u64>().ok();
        Some(number(11)? + number(12)?) // user and system time in 1/100 s
    };
    let start = Instant::now();
    while cpu_ticks().is_some_and(|cpu_ticks| cpu_ticks < 15) && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(100));
}

fn wait_for_end(child: Child) -> RunResult {
    let output = child.wait_with_output().expect("an exit status");
    RunResult::new(
        output.status.code(),
        String::new(),
        &String::from_utf8_lossy(&output.stderr),
        &[],
    )
}

/// Resumes the render from the checkpoint `c`.
fn resume_render(folder: &TestFolder, device: &str) -> RunResult {
    let mut arguments = LONG_RENDER.to_vec();
    arguments.extend(["--reproducible", "--checkpoint", "c", "--resume", "--device", device]);
    arguments.extend(["-o", "out.exr"]);
    folder.run(&arguments)
}

#[test]
fn a_killed_render_resumes() {
    let folder = TestFolder::new();
    let expected = render_expected(&folder);
    for (round, device) in (0..).zip(["cpu", "gpu", "cpu", "gpu"]) {
        let mut child = start(
            &folder,
            &[
                "--checkpoint",
                "c",
                "--resume",
                "--checkpoint-interval",
                "0.02",
                "-o",
                "out.exr",
                "--device",
                device,
            ],
        );
        let before = fs::metadata(folder.path("c")).map_or(0, |data| data.len());
        wait_for(&folder, "c", before + 50_000);
        std::thread::sleep(Duration::from_millis(7 * round));
        child.kill().expect("the process is killed"); // SIGKILL
        child.wait().expect("an exit status");
    }
    let result = resume_render(&folder, "cpu");
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(folder.read("out.exr") == expected);
    // The complete checkpoint remains and can be resumed.
    let result = resume_render(&folder, "gpu");
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("out.exr") == expected);
    assert_eq!(folder.files(), ["c", "out.exr", "whole.exr"]);
}

#[cfg(unix)]
#[test]
fn signals_end_a_render_with_a_checkpoint_and_an_exit_code() {
    crate::cli::restore_signal_defaults();
    let folder = TestFolder::new();
    let expected = render_expected(&folder);
    let message_for =
        |signal: &str| format!("note: progress is saved in c; --resume continues\nerror: interrupted by {signal}\n");
    let requeue_message = format!(
        "{}note: exit code 75 requests another attempt\n",
        message_for("SIGTERM")
    );
    let requeue = &["--requeue-exit", "75"][..];
    for (signal, code, extra, message) in [
        ("-INT", 130, &[][..], message_for("Ctrl+C (SIGINT)")),
        ("-TERM", 143, &[], message_for("SIGTERM")),
        ("-HUP", 129, &[], message_for("SIGHUP")),
        ("-TERM", 75, requeue, requeue_message),
        ("-INT", 130, requeue, message_for("Ctrl+C (SIGINT)")), // Ctrl+C does not requeue the render
    ] {
        if !extra.is_empty() && folder.path("c").exists() {
            // The next render must have samples left to render.
            fs::remove_file(folder.path("c")).expect("a checkpoint");
        }
        // With an interval of 1 h, only the signal causes a checkpoint.
        let child = start(
            &folder,
            &[
                "--checkpoint",
                "c",
                "--resume",
                "--checkpoint-interval",
                "1h",
                "-o",
                "out.exr",
                "--device",
                "cpu",
            ]
            .iter()
            .chain(extra)
            .copied()
            .collect::<Vec<_>>(),
        );
        let before = fs::metadata(folder.path("c")).map_or(0, |data| data.len());
        let start_time = Instant::now();
        while !folder.files().iter().any(|name| name.ends_with("-out.exr")) {
            assert!(start_time.elapsed() < Duration::from_secs(60), "{:?}", folder.files());
            std::thread::sleep(Duration::from_millis(2));
        }
        wait_for_cpu_time(&child);
        let status = Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(status.expect("kill").success());
        let result = wait_for_end(child);
        assert_eq!((result.code, result.stderr), (code, message), "{signal} {extra:?}");
        assert!(
            fs::metadata(folder.path("c")).expect("the checkpoint").len() > before,
            "{signal}"
        );
        assert_eq!(folder.files(), ["c", "whole.exr"]);
    }
    let result = resume_render(&folder, "cpu");
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("out.exr") == expected);
}

#[test]
fn a_second_render_waits_for_the_checkpoint_and_resumes() {
    let folder = TestFolder::new();
    let expected = render_expected(&folder);
    let options = [
        "--checkpoint",
        "c",
        "--resume",
        "--checkpoint-interval",
        "0.05",
        "--device",
        "cpu",
    ];
    let mut first = start(&folder, &[&options[..], &["-o", "first.exr"]].concat());
    wait_for(&folder, "c", 100_000);
    let second = start(&folder, &[&options[..], &["-o", "second.exr"]].concat());
    std::thread::sleep(Duration::from_millis(300));
    assert!(!folder.path("second.exr").exists());
    #[cfg(target_os = "linux")]
    check_sigterm_while_waiting(&folder, &options);
    first.kill().expect("the process is killed");
    first.wait().expect("an exit status");
    let result = wait_for_end(second);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(folder.read("second.exr") == expected);
    // The checkpoint is complete: a third render has nothing left to render.
    let third = start(
        &folder,
        &[&options[..], &["-o", "third.exr", "--stats", "stats.json"]].concat(),
    );
    assert_eq!(wait_for_end(third).code, 0);
    assert!(folder.read("third.exr") == expected);
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).expect("JSON");
    assert_eq!(
        (&stats["fraction_rendered"], &stats["share_rendered"]),
        (&0.0.into(), &0.0.into())
    );
}

/// On SIGTERM, a render that still waits for the checkpoint also exits with the code of `--requeue-exit`.
#[cfg(target_os = "linux")]
fn check_sigterm_while_waiting(folder: &TestFolder, options: &[&str]) {
    let child = start(
        folder,
        &[options, &["-o", "third.exr", "--requeue-exit", "75"]].concat(),
    );
    let id = child.id().to_string();
    let catches_sigterm = || {
        let status = std::fs::read_to_string(format!("/proc/{id}/status")).expect("a process");
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = u64::from_str_radix(caught.expect("signals").trim(), 16).expect("a number");
        caught >> (libc::SIGTERM - 1) & 1 == 1
    };
    while !catches_sigterm() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let status = std::process::Command::new("kill").args(["-TERM", &id]).status();
    assert!(status.expect("kill").success());
    assert_eq!(wait_for_end(child).code, 75);
}

/// Without `--resume`, an existing checkpoint is rejected. With `--resume`, checkpoints of renders with other options
/// and files that are not checkpoints are rejected.
#[test]
fn checkpoints_of_other_jobs_are_rejected() {
    let folder = TestFolder::new();
    let base = ["render", "small.toml", "-o", "out.png", "--device", "cpu"];
    let run = |extra: &[&str]| folder.run(&[&base[..], extra].concat());
    assert_eq!(run(&["--checkpoint", "c"]).code, 0);
    let checkpoint = folder.read("c");
    let assert_rejected = |extra: &[&str], expected_reason: &str| {
        let result = run(extra);
        assert_eq!(result.code, 2, "{extra:?}: {}", result.stderr);
        assert!(result.stderr.contains(expected_reason), "{extra:?}: {}", result.stderr);
        assert!(!result.stderr.contains("panicked"), "{}", result.stderr);
    };
    assert_rejected(
        &["--checkpoint", "c"],
        "--checkpoint: c: already exists; pass --resume to continue it",
    );
    let resume = ["--checkpoint", "c", "--resume"];
    for (option, value, expected_reason) in [
        ("--seed", "7", "its scene or an option"),
        ("--spp", "4", "its number of samples is 3, not 4"),
        ("--size", "11x6", "its size is 10 x 6, not 11 x 6"),
        ("--crop", "0,0,5,5", "its crop is"),
        ("--light-samples", "9", "its scene or an option"),
    ] {
        assert_rejected(
            &[&resume[..], &[option, value]].concat(),
            &format!("--checkpoint: c: belongs to another job: {expected_reason}"),
        );
    }
    assert_rejected(
        &[&resume[..], &["--exact-rounding"]].concat(),
        "it was rendered without",
    );
    folder.write("small.toml", &super::SCENE.replace("0.8, 0.8, 0.8", "0.8, 0.8, 0.9"));
    assert_rejected(&resume, "its scene or an option");
    folder.write("small.toml", &super::SCENE.replace("# ", "#  "));
    assert_eq!(run(&resume).code, 0, "a comment in the scene file changes the job");
    for (bytes, expected_reason) in [
        (Vec::new(), "it is not a part or checkpoint that wgray wrote"),
        (
            b"width = 3\n".repeat(20),
            "it is not a part or checkpoint that wgray wrote",
        ),
        (checkpoint[..40].to_vec(), "its header is damaged or truncated"),
    ] {
        fs::write(folder.path("c"), &bytes).expect("a file");
        assert_rejected(&resume, expected_reason);
        assert_eq!(folder.read("c"), bytes, "the rejected file was changed");
    }
    fs::remove_file(folder.path("c")).expect("a file");
    assert_eq!(run(&resume).code, 0, "a missing checkpoint is not created");
    assert_eq!(
        folder.read("c"),
        checkpoint,
        "the checkpoint differs from the first checkpoint of this job"
    );
    for (name, rule) in [
        ("small.toml", ".toml files are scenes"),
        ("out.png", ".png files are images"),
        ("-", "must be a regular file"),
        ("/dev/null", "must be a regular file"),
        ("x.toml", ".toml files are scenes"),
        ("x.part", ".part files are parts of images"),
    ] {
        assert_rejected(&["--checkpoint", name, "--resume"], rule);
    }
    let result = run(&["--checkpoint", "nowhere/c"]);
    assert_eq!(result.code, 8, "{}", result.stderr);
    assert_rejected(&["--resume"], "--checkpoint");
    assert_rejected(&["--checkpoint-interval", "3"], "--checkpoint");
    for interval in ["-1", "x", "3 s", "1e999", "nan", "5d", ""] {
        assert_rejected(
            &["--checkpoint", "d", &format!("--checkpoint-interval={interval}")],
            "--checkpoint-interval",
        );
    }
    for interval in ["0", "0.3", "90", "90s", "1.5m", "2h", "250ms", "1e9"] {
        let _ = fs::remove_file(folder.path("d"));
        let option = format!("--checkpoint-interval={interval}");
        assert_eq!(run(&["--checkpoint", "d", &option]).code, 0, "{interval}");
    }
}

#[test]
fn a_checkpoint_folder_contains_a_file_for_each_job() {
    let folder = TestFolder::new();
    fs::create_dir(folder.path("kept")).expect("a folder");
    let run = |extra: &[&str]| {
        let base = [
            "render",
            "small.toml",
            "-o",
            "out.##.png",
            "--device",
            "cpu",
            "--checkpoint",
            "kept",
        ];
        folder.run(&[&base[..], extra].concat())
    };
    let files = || {
        let all = fs::read_dir(folder.path("kept")).expect("a folder");
        all.map(|entry| entry.expect("a file").file_name().into_string().expect("UTF-8"))
            .collect::<BTreeSet<_>>()
    };
    let mut known_files = BTreeSet::new();
    for extra in [
        &[][..],
        &["--seed", "7"],
        &["--spp", "4"],
        &["--size", "11x6"],
        &["--crop", "0,0,5,5"],
        &["--exact-rounding"],
    ] {
        let result = run(extra);
        assert_eq!(result.code, 0, "{extra:?}: {}", result.stderr);
        let current = files();
        let new_files: Vec<_> = current.difference(&known_files).cloned().collect();
        let [new_file] = &new_files[..] else {
            panic!("{extra:?}: {new_files:?}")
        };
        let result = run(extra);
        let message = format!("error: --checkpoint: kept/{new_file}: already exists; pass --resume to continue it");
        assert!(
            result.code == 2 && result.stderr.starts_with(&message),
            "{extra:?}: {}",
            result.stderr
        );
        assert_eq!(run(&[extra, &["--resume"]].concat()).code, 0);
        assert_eq!(files(), current, "{extra:?}");
        known_files = current;
    }
    let result = run(&["--frames", "1-2"]);
    assert_eq!(result.code, 2, "{}", result.stderr);
    assert!(
        result.stderr.contains("--checkpoint: kept: needs #"),
        "{}",
        result.stderr
    );
}

/// The file consists of the header of this job and the pieces of another job.
#[test]
fn pieces_of_another_job_are_rejected() {
    let folder = TestFolder::new();
    let render = |extra: &[&str]| {
        let result = folder.run(&[&["render", "small.toml", "--device", "cpu", "--reproducible"], extra].concat());
        assert_eq!(result.code, 0, "{}", result.stderr);
        result.stderr
    };
    render(&["--checkpoint", "a", "-o", "a.exr"]);
    render(&["--checkpoint", "b", "--seed", "1", "-o", "b.exr"]);
    let [a, b] = ["a", "b"].map(|name| folder.read(name));
    assert_eq!(a.len(), b.len(), "the headers have different lengths");
    let piece_bytes = (10 * 6) * 16 + 14 * 4 + 32 + 32;
    let start = a.len() - piece_bytes;
    fs::write(folder.path("c"), [&a[..start], &b[start..]].concat()).expect("a file");
    let stderr = render(&["--checkpoint", "c", "--resume", "-o", "c.exr"]);
    assert!(stderr.contains("is damaged"), "{stderr}");
    assert!(folder.read("c.exr") == folder.read("a.exr") && folder.read("a.exr") != folder.read("b.exr"));
}

/// The checkpoint is removed or replaced while the render writes to it.
#[cfg(unix)]
#[test]
fn a_removed_checkpoint_is_restored_or_reported() {
    let folder = TestFolder::new();
    let expected = render_expected(&folder);
    std::os::unix::fs::symlink("target", folder.path("link")).expect("a link");
    let options = [
        "--checkpoint",
        "link",
        "--resume",
        "--checkpoint-interval",
        "0.02",
        "--device",
        "cpu",
    ];
    let child = start(&folder, &[&options[..], &["-o", "out.exr"]].concat());
    wait_for(&folder, "target", 50_000);
    fs::remove_file(folder.path("target")).expect("a file");
    let result = wait_for_end(child);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("out.exr") == expected);
    let result = wait_for_end(start(
        &folder,
        &[&options[..], &["-o", "again.exr", "--stats", "stats.json"]].concat(),
    ));
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("again.exr") == expected);
    fs::remove_file(folder.path("target")).expect("a file");
    let child = start(&folder, &[&options[..], &["-o", "out.exr"]].concat());
    wait_for(&folder, "target", 50_000);
    fs::remove_file(folder.path("target")).expect("a file");
    folder.write("target", "mine");
    let result = wait_for_end(child);
    assert_eq!(result.code, 0);
    assert!(
        result.stderr.contains("was changed or replaced by another program"),
        "{}",
        result.stderr
    );
    assert_eq!(folder.read("target"), b"mine");
}

#[test]
fn a_damaged_checkpoint_is_used_up_to_the_damage() {
    let folder = TestFolder::new();
    let expected = render_expected(&folder);
    let child = start(&folder, &["--checkpoint", "c", "-o", "out.exr", "--device", "cpu"]);
    assert_eq!(wait_for_end(child).code, 0);
    let mut bytes = folder.read("c");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(folder.path("c"), &bytes).expect("a file");
    let result = resume_render(&folder, "cpu");
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(
        result.stderr.starts_with("warning: c: ") && result.stderr.contains("is damaged"),
        "{}",
        result.stderr
    );
    assert!(folder.read("out.exr") == expected);
    let mut file = fs::File::options().append(true).open(folder.path("c")).expect("a file");
    file.write_all(&bytes[200..900]).expect("bytes");
    let result = resume_render(&folder, "cpu");
    assert!(result.stderr.contains("bytes dropped: 700"), "{}", result.stderr);
    assert_eq!(
        resume_render(&folder, "cpu").stderr,
        "",
        "damaged pieces are still in the file"
    );
    assert!(folder.read("out.exr") == expected);
}

/// Writing the image fails; after space becomes available, the render resumes from the checkpoint.
#[cfg(unix)]
#[test]
fn the_checkpoint_is_kept_when_the_disk_is_full() {
    let folder = TestFolder::new();
    let expected = render_expected(&folder);
    // The limit on file sizes is 250 KiB; a complete checkpoint needs 400 KiB.
    let line = "trap '' XFSZ; ulimit -f 500; exec \"$0\" render small.toml --size 160x160 --spp 300 --aov normal \
                --reproducible --checkpoint c --checkpoint-interval 0.02 -o out.exr --exr-compression none --device cpu";
    let result = folder.shell("sh", line);
    assert_eq!(result.code, 8, "{}", result.stderr);
    assert!(
        result.stderr.contains("out.exr: cannot be written: File too large"),
        "{}",
        result.stderr
    );
    assert_eq!(folder.files(), ["c", "whole.exr"], "an incomplete file remains");
    let checkpoint_len = fs::metadata(folder.path("c")).expect("the checkpoint").len();
    assert!(checkpoint_len > 50_000, "{checkpoint_len}");
    let result = resume_render(&folder, "cpu");
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(folder.read("out.exr") == expected);
}

/// Mounts file systems in a separate mount namespace. Skipped where such namespaces are not permitted.
#[cfg(target_os = "linux")]
#[test]
fn full_and_read_only_file_systems_are_reported() {
    let folder = TestFolder::new();
    fs::create_dir(folder.path("disk")).expect("a folder");
    let mounted = folder.shell("sh", "unshare -rm mount -t tmpfs -o size=64k none disk");
    if mounted.code != 0 {
        eprintln!("no separate mount namespace: {}", mounted.stderr);
        return;
    }
    let run = |options: &str, command: &str| {
        let line = format!("exec unshare -rm sh -c 'mount -t tmpfs -o {options} none disk && {command}' \"$0\"");
        folder.shell("sh", &line)
    };
    let render = "\"$0\" render small.toml --size 200x200 --device cpu";
    let full = run(
        "size=64k",
        &format!("{render} --spp 1 -o disk/out.exr; echo $?; ls -A disk"),
    );
    assert_eq!(full.stdout, "8\n", "{}", full.stderr);
    assert!(
        full.stderr.contains("disk/out.exr: cannot be written: No space left"),
        "{}",
        full.stderr
    );
    let checkpointed = format!("{render} --spp 1 --checkpoint disk/c -o out.png; echo $?; ls -A disk");
    let full = run("size=256k", &checkpointed);
    assert_eq!(full.stdout, "0\nc\n", "{}", full.stderr);
    assert!(
        full.stderr.contains("warning: disk/c: progress could not be saved: "),
        "{}",
        full.stderr
    );
    // After a signal, the note does not claim that the latest progress is saved.
    let interrupted = run(
        "size=600k",
        &format!("timeout -s INT 2 {render} --spp 65536 --checkpoint disk/c --checkpoint-interval 0 -o out.png"),
    );
    assert!(
        interrupted.stderr.contains("progress could not be saved")
            && interrupted
                .stderr
                .contains("note: the latest progress is not saved in disk/c; --resume "),
        "{}",
        interrupted.stderr
    );
    let tiny = run("size=4k", &checkpointed);
    assert!(
        tiny.stdout.starts_with("0\n") || tiny.stdout.starts_with("8\n"),
        "{}",
        tiny.stdout
    );
    for output in ["-o disk/out.png", "-o out.png --checkpoint disk/c"] {
        let start_time = Instant::now();
        let read_only = run("ro", &format!("{render} --spp 60000 {output}; echo $?; ls -A disk"));
        assert_eq!(read_only.stdout, "8\n", "{}", read_only.stderr);
        assert!(
            read_only.stderr.contains("Read-only file system"),
            "{}",
            read_only.stderr
        );
        assert!(
            start_time.elapsed() < Duration::from_secs(20),
            "the error is not reported before the render"
        );
    }
}

#[test]
fn parts_merge_to_the_same_image() {
    let folder = TestFolder::new();
    let options = [
        "small.toml",
        "--size",
        "30x23",
        "--device",
        "cpu",
        "--reproducible",
        "--aov",
        "normal,depth,instance,variance,sample_count",
    ];
    let suffixes = [
        "png",
        "exr",
        "normal.png",
        "depth.png",
        "instance.png",
        "variance.png",
        "sample_count.png",
    ];
    let render = |extra: &[&str]| folder.run_quietly(&[&["render"], &options[..], extra].concat());
    render(&["-o", "whole.png", "-o", "whole.exr"]);
    let names: Vec<String> = (1..=7).map(|i| format!("p{i}.part")).collect();
    for (i, name) in (1..).zip(&names) {
        render(&["--tile", &format!("{i}/7"), "-o", name]);
    }
    let shuffled: Vec<&str> = [3, 0, 6, 1, 5, 2, 4].map(|i| names[i].as_str()).to_vec();
    let merge = |parts: &[&str]| {
        folder.run(&[&["merge"], parts, &["-o", "out.png", "-o", "out.exr", "--reproducible"]].concat())
    };
    let result = merge(&shuffled);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    for suffix in suffixes {
        assert!(
            folder.read(&format!("out.{suffix}")) == folder.read(&format!("whole.{suffix}")),
            "{suffix}"
        );
        fs::remove_file(folder.path(&format!("out.{suffix}"))).expect("a file");
    }
    let assert_rejected = |parts: &[&str], rule: &str| {
        let result = merge(parts);
        assert_eq!(result.code, 1, "{parts:?}: {}", result.stderr);
        assert!(result.stderr.contains(rule), "{parts:?}: {}", result.stderr);
        assert!(
            !folder.files().iter().any(|name| name.contains("out.")),
            "{:?}",
            folder.files()
        );
    };
    assert_rejected(&shuffled[1..], "rows 9 to 12 are missing: add part 4/7");
    assert_rejected(
        &[&shuffled[..], &["p2.part"]].concat(),
        "p2.part: overlaps p2.part in rows 3 to 5",
    );
    render(&["--tile", "2/3", "-o", "other.part"]);
    assert_rejected(&[&shuffled[..], &["other.part"]].concat(), "other.part: overlaps");
    // A single part that covers the full image is accepted.
    render(&["--tile", "1/1", "-o", "all.part"]);
    assert_eq!(merge(&["all.part"]).code, 0);
    for suffix in suffixes {
        fs::remove_file(folder.path(&format!("out.{suffix}"))).expect("a file");
    }
    render(&["--tile", "1/7", "--seed", "3", "-o", "seed.part"]);
    assert_rejected(
        &["seed.part", "p2.part"],
        "p2.part: belongs to a different image than seed.part: its scene or an option",
    );
    let render_bare = |extra: &[&str]| {
        let options = [
            "render",
            "small.toml",
            "--size",
            "30x23",
            "--device",
            "cpu",
            "--tile",
            "1/7",
        ];
        folder.run_quietly(&[&options[..], extra].concat());
    };
    render_bare(&["--aov", "variance", "-o", "bare.part"]);
    assert_rejected(
        &["bare.part", "p2.part"],
        "p2.part: has different layers than bare.part",
    );
    render_bare(&["--aov", "normal,depth,instance", "-o", "other.part"]);
    assert_rejected(
        &["other.part", "p2.part"],
        "p2.part: belongs to a different image than other.part: it was rendered with, not without, noise estimates",
    );
    render(&["--tile", "1/7", "-D", "image.exposure=1", "-o", "bright.part"]);
    let bright: Vec<&str> = ["bright.part"]
        .into_iter()
        .chain(names[1..].iter().map(String::as_str))
        .collect();
    assert_rejected(
        &bright,
        "p2.part: has a different view transform or exposure than bright.part",
    );
    let mut arguments = [&["merge"], &bright[..], &["-o", "overridden.png", "--reproducible"]].concat();
    arguments.extend(["--exposure", "0", "--view-transform", "gamma22"]);
    folder.run_quietly(&arguments);
    assert!(folder.read("overridden.png") == folder.read("whole.png"));
    folder.run_quietly(&[&["merge"], &shuffled[..], &["-o", "overridden.jpg"]].concat());
    for length in [0, 10, 300, folder.read("p2.part").len() - 1] {
        fs::write(folder.path("cut.part"), &folder.read("p2.part")[..length]).expect("a file");
        assert_rejected(&["p1.part", "cut.part"], "cut.part: ");
    }
    assert_rejected(
        &["small.toml"],
        "small.toml: it is not a part or checkpoint that wgray wrote",
    );
    assert_rejected(&["nowhere.part"], "nowhere.part: ");
    render(&["--checkpoint", "c", "-o", "whole.png"]);
    fs::copy(folder.path("c"), folder.path("c.part")).expect("a copy");
    assert_rejected(&["c.part"], "c.part: is a checkpoint");
    for (arguments, rule) in [
        (&["merge", "all.part", "-o", "all.part"][..], "names a part"),
        (
            &["merge", "all.part", "-o", "all.part", "--format", "png"],
            "--output: all.part is an input",
        ),
        (
            &["render", "small.toml", "--tile", "1/7", "-o", "x.png"],
            "--tile: needs exactly one -o NAME.part",
        ),
        (
            &["render", "small.toml", "--tile", "1/7"],
            "--tile: needs exactly one -o NAME.part",
        ),
        (&["render", "small.toml", "--tile", "0/7", "-o", "x.part"], "--tile"),
        (&["render", "small.toml", "--tile", "8/7", "-o", "x.part"], "--tile"),
        (
            &["render", "small.toml", "--tile", "1/7", "-o", "x.part"],
            "the number of parts must not exceed the number of rows, 6",
        ),
        (&["render", "small.toml", "-o", "x.part"], "names a part"),
    ] {
        let result = folder.run(arguments);
        assert_eq!(result.code, 2, "{arguments:?}: {}", result.stderr);
        assert!(result.stderr.contains(rule), "{arguments:?}: {}", result.stderr);
    }
}

#[test]
fn a_part_resumes_from_its_own_checkpoint() {
    let folder = TestFolder::new();
    let render_part = |extra: &[&str]| {
        let base = ["render", "small.toml", "--device", "cpu", "--tile", "2/3"];
        folder.run(&[&base[..], extra].concat())
    };
    assert_eq!(render_part(&["-o", "a.part", "--checkpoint", "c"]).code, 0);
    assert_eq!(render_part(&["-o", "b.part", "--checkpoint", "c", "--resume"]).code, 0);
    assert!(folder.read("a.part") == folder.read("b.part"));
    let result = folder.run(&[
        "render",
        "small.toml",
        "--device",
        "cpu",
        "-o",
        "x.png",
        "--checkpoint",
        "c",
        "--resume",
    ]);
    assert_eq!(result.code, 2);
    assert!(result.stderr.contains("its crop is"), "{}", result.stderr);
}

#[test]
fn a_time_limit_ends_with_a_complete_image() {
    let folder = TestFolder::new();
    let start_time = Instant::now();
    let options = [
        "render",
        "small.toml",
        "--size",
        "300x200",
        "--spp",
        "65536",
        "--reproducible",
        "--device",
        "cpu",
    ];
    let run = |extra: &[&str]| folder.run(&[&options[..], extra].concat());
    let result = run(&["--time-limit", "0.5", "-o", "a.png", "--stats", "a.json"]);
    assert_eq!(result.code, 0, "{}", result.stderr);
    assert!(
        result.stderr.starts_with("note: time limit reached: "),
        "{}",
        result.stderr
    );
    assert!(
        start_time.elapsed() < Duration::from_secs(30),
        "{:?}",
        start_time.elapsed()
    );
    let stats = |name: &str| -> serde_json::Value { serde_json::from_slice(&folder.read(name)).expect("JSON") };
    let min_samples = stats("a.json")["least_samples"].as_u64().expect("a number");
    assert!((1..65536).contains(&min_samples), "{min_samples}");
    let (_, _, pixels) = super::read_png(&folder.path("a.png"));
    assert!(
        pixels.chunks(3).all(|pixel| pixel != [0, 0, 0]),
        "a pixel has no samples"
    );
    let result = run(&["--time-limit", "0", "-o", "a.png", "--stats", "a.json"]);
    assert_eq!(
        (result.code, stats("a.json")["least_samples"].as_u64()),
        (0, Some(1)),
        "{}",
        result.stderr
    );
    for pattern in ["grid", "rotated_grid", "jittered"] {
        let result = run(&["--time-limit", "1", "--pixel-pattern", pattern, "-o", "b.png"]);
        assert_eq!(result.code, 2, "{}", result.stderr);
        assert!(
            result
                .stderr
                .contains("--time-limit: the first samples must cover the pixel, but those of --pixel-pattern"),
            "{}",
            result.stderr
        );
    }
    // A time limit that is not reached has no effect. After a time limit was reached, the render can be resumed.
    let arguments = [
        "render",
        "small.toml",
        "--size",
        "300x200",
        "--spp",
        "300",
        "--reproducible",
        "--device",
        "cpu",
    ];
    let render_with = |extra: &[&str]| folder.run(&[&arguments[..], extra].concat());
    assert_eq!(render_with(&["-o", "whole.exr"]).code, 0);
    let result = render_with(&["-o", "limited.exr", "--time-limit", "1h"]);
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert_eq!(folder.run(&["diff", "limited.exr", "whole.exr"]).code, 0);
    let checkpoint = ["--checkpoint", "c", "--resume", "-o", "kept.exr"];
    assert_eq!(render_with(&[&checkpoint[..], &["--time-limit", "0"]].concat()).code, 0);
    assert!(folder.read("kept.exr") != folder.read("whole.exr"));
    assert_eq!(render_with(&checkpoint).code, 0);
    assert!(folder.read("kept.exr") == folder.read("whole.exr"));
}
