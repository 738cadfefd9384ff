//! Interrupted and resumed renders, and images in parts, tested through the program with signals and damaged files.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{Ran, TestFolder, program};

/// A render that takes a few seconds.
const LONG: [&str; 8] = [
    "render",
    "small.toml",
    "--size",
    "160x160",
    "--spp",
    "300",
    "--aov",
    "normal",
];

fn expected(place: &TestFolder) -> Vec<u8> {
    let mut arguments = LONG.to_vec();
    arguments.extend(["-o", "whole.exr", "--reproducible", "--device", "cpu"]);
    place.quietly(&arguments);
    place.read("whole.exr")
}

fn start(place: &TestFolder, arguments: &[&str]) -> Child {
    Command::new(program())
        .current_dir(place.path("."))
        .args(LONG)
        .args(["--reproducible", "--threads", "1"]) // takes a while on any machine
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program")
}

fn wait_for(place: &TestFolder, file: &str, bytes: u64) {
    let start = Instant::now();
    while fs::metadata(place.path(file)).map_or(0, |data| data.len()) <= bytes {
        assert!(start.elapsed() < Duration::from_secs(60), "{file} does not grow");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Waits for 0.15 s of CPU time, after which the signal handlers are installed even on a busy machine.
fn wait_for_work(child: &Child) {
    let ticks = || {
        let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
        let fields: Vec<&str> = stat.rsplit(") ").next()?.split(' ').collect();
        let number = |i: usize| fields.get(i)?.parse::<u64>().ok();
        Some(number(11)? + number(12)?) // user and system time in 1/100 s
    };
    let start = Instant::now();
    while ticks().is_some_and(|ticks| ticks < 15) && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(100));
}

fn ended(child: Child) -> Ran {
    let output = child.wait_with_output().expect("an end");
    Ran::new(
        output.status.code(),
        String::new(),
        &String::from_utf8_lossy(&output.stderr),
        &[],
    )
}

/// Resumes from the checkpoint.
fn resume_render(place: &TestFolder, device: &str) -> Ran {
    let mut arguments = LONG.to_vec();
    arguments.extend(["--reproducible", "--checkpoint", "c", "--resume", "--device", device]);
    arguments.extend(["-o", "out.exr"]);
    place.run(&arguments)
}

#[test]
fn a_killed_render_resumes() {
    let place = TestFolder::new();
    let expected = expected(&place);
    for (round, device) in (0..).zip(["cpu", "gpu", "cpu", "gpu"]) {
        let mut child = start(
            &place,
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
        let before = fs::metadata(place.path("c")).map_or(0, |data| data.len());
        wait_for(&place, "c", before + 50_000);
        std::thread::sleep(Duration::from_millis(7 * round));
        child.kill().expect("a kill"); // SIGKILL
        child.wait().expect("an end");
    }
    let ran = resume_render(&place, "cpu");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(place.read("out.exr") == expected);
    // The complete checkpoint remains and can be resumed.
    let ran = resume_render(&place, "gpu");
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(place.read("out.exr") == expected);
    assert_eq!(place.files(), ["c", "out.exr", "whole.exr"]);
}

#[cfg(unix)]
#[test]
fn signals_end_a_render_with_a_checkpoint_and_a_code() {
    crate::cli::heed_interrupts();
    let place = TestFolder::new();
    let expected = expected(&place);
    let kept =
        |signal: &str| format!("note: progress is saved in c; --resume continues\nerror: interrupted by {signal}\n");
    let retry = format!("{}note: exit code 75 requests another attempt\n", kept("SIGTERM"));
    let requeue = &["--requeue-exit", "75"][..];
    for (signal, code, more, message) in [
        ("-INT", 130, &[][..], kept("Ctrl+C (SIGINT)")),
        ("-TERM", 143, &[], kept("SIGTERM")),
        ("-HUP", 129, &[], kept("SIGHUP")),
        ("-TERM", 75, requeue, retry),
        ("-INT", 130, requeue, kept("Ctrl+C (SIGINT)")), // the user interrupts a render: no requeue
    ] {
        if !more.is_empty() && place.path("c").exists() {
            fs::remove_file(place.path("c")).expect("a checkpoint"); // so that there is work left
        }
        // With an interval of 1 h, only the signal causes a checkpoint.
        let child = start(
            &place,
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
            .chain(more)
            .copied()
            .collect::<Vec<_>>(),
        );
        let before = fs::metadata(place.path("c")).map_or(0, |data| data.len());
        let begun = Instant::now();
        while !place.files().iter().any(|name| name.ends_with("-out.exr")) {
            assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", place.files());
            std::thread::sleep(Duration::from_millis(2));
        }
        wait_for_work(&child);
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.expect("kill").success());
        let ran = ended(child);
        assert_eq!((ran.code, ran.stderr), (code, message), "{signal} {more:?}");
        assert!(
            fs::metadata(place.path("c")).expect("the checkpoint").len() > before,
            "{signal}"
        );
        assert_eq!(place.files(), ["c", "whole.exr"]);
    }
    let ran = resume_render(&place, "cpu");
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(place.read("out.exr") == expected);
}

#[test]
fn a_second_writer_waits_and_resumes() {
    let place = TestFolder::new();
    let expected = expected(&place);
    let options = [
        "--checkpoint",
        "c",
        "--resume",
        "--checkpoint-interval",
        "0.05",
        "--device",
        "cpu",
    ];
    let mut first = start(&place, &[&options[..], &["-o", "first.exr"]].concat());
    wait_for(&place, "c", 100_000);
    let second = start(&place, &[&options[..], &["-o", "second.exr"]].concat());
    std::thread::sleep(Duration::from_millis(300));
    assert!(!place.path("second.exr").exists());
    #[cfg(target_os = "linux")]
    check_sigterm_while_waiting(&place, &options);
    first.kill().expect("a kill");
    first.wait().expect("an end");
    let ran = ended(second);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(place.read("second.exr") == expected);
    // The file contains each finished piece once.
    let third = start(
        &place,
        &[&options[..], &["-o", "third.exr", "--stats", "stats.json"]].concat(),
    );
    assert_eq!(ended(third).code, 0);
    assert!(place.read("third.exr") == expected);
    let stats: serde_json::Value = serde_json::from_slice(&place.read("stats.json")).expect("JSON");
    assert_eq!(
        (&stats["fraction_rendered"], &stats["share_rendered"]),
        (&0.0.into(), &0.0.into())
    );
}

/// On SIGTERM, a render that still waits for the checkpoint also exits with the code of `--requeue-exit`.
#[cfg(target_os = "linux")]
fn check_sigterm_while_waiting(place: &TestFolder, options: &[&str]) {
    let waiting = start(place, &[options, &["-o", "third.exr", "--requeue-exit", "75"]].concat());
    let id = waiting.id().to_string();
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
    assert_eq!(ended(waiting).code, 75);
}

/// Rejects checkpoints that exist, checkpoints of renders with other options, and files that are not checkpoints.
#[test]
fn checkpoints_of_other_jobs_are_rejected() {
    let place = TestFolder::new();
    let base = ["render", "small.toml", "-o", "out.png", "--device", "cpu"];
    let run = |more: &[&str]| place.run(&[&base[..], more].concat());
    assert_eq!(run(&["--checkpoint", "c"]).code, 0);
    let good = place.read("c");
    let refused = |more: &[&str], rule: &str| {
        let ran = run(more);
        assert_eq!(ran.code, 2, "{more:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(rule), "{more:?}: {}", ran.stderr);
        assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
    };
    refused(
        &["--checkpoint", "c"],
        "--checkpoint: c: already exists; pass --resume to continue it",
    );
    let resume = ["--checkpoint", "c", "--resume"];
    for (option, value, rule) in [
        ("--seed", "7", "its scene or an option"),
        ("--spp", "4", "its number of samples is 3, not 4"),
        ("--size", "11x6", "its size is 10 x 6, not 11 x 6"),
        ("--crop", "0,0,5,5", "its crop is"),
        ("--light-samples", "9", "its scene or an option"),
    ] {
        refused(
            &[&resume[..], &[option, value]].concat(),
            &format!("--checkpoint: c: belongs to another job: {rule}"),
        );
    }
    refused(
        &[&resume[..], &["--exact-rounding"]].concat(),
        "its rounding is without",
    );
    place.write("small.toml", &super::SCENE.replace("0.8, 0.8, 0.8", "0.8, 0.8, 0.9"));
    refused(&resume, "its scene or an option");
    place.write("small.toml", &super::SCENE.replace("# ", "#  "));
    assert_eq!(run(&resume).code, 0, "a comment in the scene file changes the job");
    for (bytes, rule) in [
        (Vec::new(), "it is not a part or checkpoint that wgray wrote"),
        (
            b"width = 3\n".repeat(20),
            "it is not a part or checkpoint that wgray wrote",
        ),
        (good[..40].to_vec(), "its header is damaged or truncated"),
    ] {
        fs::write(place.path("c"), &bytes).expect("a file");
        refused(&resume, rule);
        assert_eq!(place.read("c"), bytes, "a rejected file was changed");
    }
    fs::remove_file(place.path("c")).expect("a file");
    assert_eq!(run(&resume).code, 0, "a missing checkpoint is not created");
    assert_eq!(place.read("c"), good, "the same job gives another file");
    for (name, option) in [
        ("small.toml", "which names a scene"),
        ("out.png", "which names an image"),
        ("-", "must be a regular file"),
        ("/dev/null", "must be a regular file"),
        ("x.toml", "which names a scene"),
        ("x.part", "which names a part"),
    ] {
        refused(&["--checkpoint", name, "--resume"], option);
    }
    let ran = run(&["--checkpoint", "nowhere/c"]);
    assert_eq!(ran.code, 8, "{}", ran.stderr);
    refused(&["--resume"], "--checkpoint");
    refused(&["--checkpoint-interval", "3"], "--checkpoint");
    for bad in ["-1", "x", "3 s", "1e999", "nan", "5d", ""] {
        refused(
            &["--checkpoint", "d", &format!("--checkpoint-interval={bad}")],
            "--checkpoint-interval",
        );
    }
    for good in ["0", "0.3", "90", "90s", "1.5m", "2h", "250ms", "1e9"] {
        let _ = fs::remove_file(place.path("d"));
        let interval = format!("--checkpoint-interval={good}");
        assert_eq!(run(&["--checkpoint", "d", &interval]).code, 0, "{good}");
    }
}

#[test]
fn a_folder_has_a_checkpoint_for_each_job() {
    let place = TestFolder::new();
    fs::create_dir(place.path("kept")).expect("a folder");
    let run = |more: &[&str]| {
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
        place.run(&[&base[..], more].concat())
    };
    let files = || {
        let all = fs::read_dir(place.path("kept")).expect("a folder");
        all.map(|entry| entry.expect("a file").file_name().into_string().expect("UTF-8"))
            .collect::<BTreeSet<_>>()
    };
    let mut seen = BTreeSet::new();
    for more in [
        &[][..],
        &["--seed", "7"],
        &["--spp", "4"],
        &["--size", "11x6"],
        &["--crop", "0,0,5,5"],
        &["--exact-rounding"],
    ] {
        let ran = run(more);
        assert_eq!(ran.code, 0, "{more:?}: {}", ran.stderr);
        let now = files();
        let new: Vec<_> = now.difference(&seen).cloned().collect();
        let [new] = &new[..] else { panic!("{more:?}: {new:?}") };
        let ran = run(more);
        let message = format!("error: --checkpoint: kept/{new}: already exists; pass --resume to continue it");
        assert!(
            ran.code == 2 && ran.stderr.starts_with(&message),
            "{more:?}: {}",
            ran.stderr
        );
        assert_eq!(run(&[more, &["--resume"]].concat()).code, 0);
        assert_eq!(files(), now, "{more:?}");
        seen = now;
    }
    let ran = run(&["--frames", "1-2"]);
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    assert!(ran.stderr.contains("--checkpoint: kept: needs #"), "{}", ran.stderr);
}

/// The pieces follow a header of this job.
#[test]
fn pieces_of_another_job_are_rejected() {
    let place = TestFolder::new();
    let render = |more: &[&str]| {
        let ran = place.run(&[&["render", "small.toml", "--device", "cpu", "--reproducible"], more].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        ran.stderr
    };
    render(&["--checkpoint", "a", "-o", "a.exr"]);
    render(&["--checkpoint", "b", "--seed", "1", "-o", "b.exr"]);
    let [a, b] = ["a", "b"].map(|name| place.read(name));
    assert_eq!(a.len(), b.len(), "the headers have different lengths");
    let pieces = (10 * 6) * 16 + 14 * 4 + 32 + 32;
    let start = a.len() - pieces;
    fs::write(place.path("c"), [&a[..start], &b[start..]].concat()).expect("a file");
    let stderr = render(&["--checkpoint", "c", "--resume", "-o", "c.exr"]);
    assert!(stderr.contains("are damaged"), "{stderr}");
    assert!(place.read("c.exr") == place.read("a.exr") && place.read("a.exr") != place.read("b.exr"));
}

/// The checkpoint is removed or replaced while the render writes to it.
#[cfg(unix)]
#[test]
fn a_removed_checkpoint_is_restored_or_reported() {
    let place = TestFolder::new();
    let expected = expected(&place);
    std::os::unix::fs::symlink("target", place.path("link")).expect("a link");
    let options = [
        "--checkpoint",
        "link",
        "--resume",
        "--checkpoint-interval",
        "0.02",
        "--device",
        "cpu",
    ];
    let child = start(&place, &[&options[..], &["-o", "out.exr"]].concat());
    wait_for(&place, "target", 50_000);
    fs::remove_file(place.path("target")).expect("a file");
    let ran = ended(child);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(place.read("out.exr") == expected);
    let ran = ended(start(
        &place,
        &[&options[..], &["-o", "again.exr", "--stats", "stats.json"]].concat(),
    ));
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(place.read("again.exr") == expected);
    fs::remove_file(place.path("target")).expect("a file");
    let child = start(&place, &[&options[..], &["-o", "out.exr"]].concat());
    wait_for(&place, "target", 50_000);
    fs::remove_file(place.path("target")).expect("a file");
    place.write("target", "mine");
    let ran = ended(child);
    assert_eq!(ran.code, 0);
    assert!(
        ran.stderr.contains("was changed or replaced by another program"),
        "{}",
        ran.stderr
    );
    assert_eq!(place.read("target"), b"mine");
}

#[test]
fn a_damaged_checkpoint_is_used_up_to_the_damage() {
    let place = TestFolder::new();
    let expected = expected(&place);
    let child = start(&place, &["--checkpoint", "c", "-o", "out.exr", "--device", "cpu"]);
    assert_eq!(ended(child).code, 0);
    let mut bytes = place.read("c");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(place.path("c"), &bytes).expect("a file");
    let ran = resume_render(&place, "cpu");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(
        ran.stderr.starts_with("warning: c: ") && ran.stderr.contains("are damaged"),
        "{}",
        ran.stderr
    );
    assert!(place.read("out.exr") == expected);
    let mut file = fs::File::options().append(true).open(place.path("c")).expect("a file");
    file.write_all(&bytes[200..900]).expect("bytes");
    let ran = resume_render(&place, "cpu");
    assert!(ran.stderr.contains("dropped 700 bytes after byte"), "{}", ran.stderr);
    assert_eq!(
        resume_render(&place, "cpu").stderr,
        "",
        "damaged pieces are still in the file"
    );
    assert!(place.read("out.exr") == expected);
}

/// Writing the image fails; once space is available, the render resumes from the checkpoint.
#[cfg(unix)]
#[test]
fn the_checkpoint_is_kept_when_the_disk_is_full() {
    let place = TestFolder::new();
    let expected = expected(&place);
    // A file size limit of 250 KiB; the checkpoint needs 400 KiB.
    let line = "trap '' XFSZ; ulimit -f 500; exec \"$0\" render small.toml --size 160x160 --spp 300 --aov normal \
                --reproducible --checkpoint c --checkpoint-interval 0.02 -o out.exr --exr-compression none --device cpu";
    let ran = place.shell("sh", line);
    assert_eq!(ran.code, 8, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("out.exr: cannot be written: File too large"),
        "{}",
        ran.stderr
    );
    assert_eq!(place.files(), ["c", "whole.exr"], "an incomplete file is left");
    let kept = fs::metadata(place.path("c")).expect("the checkpoint").len();
    assert!(kept > 50_000, "{kept}");
    let ran = resume_render(&place, "cpu");
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(place.read("out.exr") == expected);
}

/// Runs in a separate mount namespace. Where namespaces are not permitted, only the file size limit above and a
/// read-only folder are tested.
#[cfg(target_os = "linux")]
#[test]
fn full_and_read_only_file_systems() {
    let place = TestFolder::new();
    fs::create_dir(place.path("disk")).expect("a folder");
    let can = place.shell("sh", "unshare -rm mount -t tmpfs -o size=64k none disk");
    if can.code != 0 {
        eprintln!("no separate mount namespace: {}", can.stderr);
        return;
    }
    let run = |options: &str, command: &str| {
        let line = format!("exec unshare -rm sh -c 'mount -t tmpfs -o {options} none disk && {command}' \"$0\"");
        place.shell("sh", &line)
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
    let kept = format!("{render} --spp 1 --checkpoint disk/c -o out.png; echo $?; ls -A disk");
    let full = run("size=256k", &kept);
    assert_eq!(full.stdout, "0\nc\n", "{}", full.stderr);
    assert!(
        full.stderr
            .contains("warning: disk/c: a piece could not be written; rendering continues"),
        "{}",
        full.stderr
    );
    let none = run("size=4k", &kept);
    assert!(
        none.stdout.starts_with("0\n") || none.stdout.starts_with("8\n"),
        "{}",
        none.stdout
    );
    for output in ["-o disk/out.png", "-o out.png --checkpoint disk/c"] {
        let begun = Instant::now();
        let read_only = run("ro", &format!("{render} --spp 60000 {output}; echo $?; ls -A disk"));
        assert_eq!(read_only.stdout, "8\n", "{}", read_only.stderr);
        assert!(
            read_only.stderr.contains("Read-only file system"),
            "{}",
            read_only.stderr
        );
        assert!(
            begun.elapsed() < Duration::from_secs(20),
            "not reported before the render"
        );
    }
}

#[test]
fn parts_merge_to_the_same_image() {
    let place = TestFolder::new();
    let options = [
        "small.toml",
        "--size",
        "30x23",
        "--device",
        "cpu",
        "--reproducible",
        "--aov",
        "normal,depth,instance",
    ];
    let render = |more: &[&str]| place.quietly(&[&["render"], &options[..], more].concat());
    render(&["-o", "whole.png", "-o", "whole.exr"]);
    let names: Vec<String> = (1..=7).map(|i| format!("p{i}.part")).collect();
    for (i, name) in (1..).zip(&names) {
        render(&["--tile", &format!("{i}/7"), "-o", name]);
    }
    let shuffled: Vec<&str> = [3, 0, 6, 1, 5, 2, 4].map(|i| names[i].as_str()).to_vec();
    let merge = |parts: &[&str]| {
        place.run(&[&["merge"], parts, &["-o", "out.png", "-o", "out.exr", "--reproducible"]].concat())
    };
    let ran = merge(&shuffled);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    for end in ["png", "exr", "normal.png", "depth.png", "instance.png"] {
        assert!(
            place.read(&format!("out.{end}")) == place.read(&format!("whole.{end}")),
            "{end}"
        );
        fs::remove_file(place.path(&format!("out.{end}"))).expect("a file");
    }
    let refused = |parts: &[&str], rule: &str| {
        let ran = merge(parts);
        assert_eq!(ran.code, 1, "{parts:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(rule), "{parts:?}: {}", ran.stderr);
        assert!(
            !place.files().iter().any(|name| name.contains("out.")),
            "{:?}",
            place.files()
        );
    };
    refused(&shuffled[1..], "rows 9 to 12 are missing: add part 4/7");
    refused(
        &[&shuffled[..], &["p2.part"]].concat(),
        "p2.part: overlaps p2.part in rows 3 to 5",
    );
    render(&["--tile", "2/3", "-o", "other.part"]);
    refused(&[&shuffled[..], &["other.part"]].concat(), "other.part: overlaps");
    // Parts of different divisions of the image are accepted if they cover it without overlaps.
    render(&["--tile", "1/1", "-o", "all.part"]);
    assert_eq!(merge(&["all.part"]).code, 0);
    for end in ["png", "exr", "normal.png", "depth.png", "instance.png"] {
        fs::remove_file(place.path(&format!("out.{end}"))).expect("a file");
    }
    render(&["--tile", "1/7", "--seed", "3", "-o", "seed.part"]);
    refused(
        &["seed.part", "p2.part"],
        "p2.part: belongs to a different image than seed.part: its scene or an option",
    );
    place.quietly(&[
        "render",
        "small.toml",
        "--size",
        "30x23",
        "--device",
        "cpu",
        "--tile",
        "1/7",
        "-o",
        "bare.part",
    ]);
    refused(
        &["bare.part", "p2.part"],
        "p2.part: has different layers than bare.part",
    );
    render(&["--tile", "1/7", "-D", "image.exposure=1", "-o", "bright.part"]);
    let bright: Vec<&str> = ["bright.part"]
        .into_iter()
        .chain(names[1..].iter().map(String::as_str))
        .collect();
    refused(
        &bright,
        "p2.part: has a different view transform or exposure than bright.part",
    );
    let mut given = [&["merge"], &bright[..], &["-o", "given.png", "--reproducible"]].concat();
    given.extend(["--exposure", "0", "--view-transform", "gamma22"]);
    place.quietly(&given);
    assert!(place.read("given.png") == place.read("whole.png"));
    place.quietly(&[&["merge"], &shuffled[..], &["-o", "given.jpg"]].concat());
    for length in [0, 10, 300, place.read("p2.part").len() - 1] {
        fs::write(place.path("cut.part"), &place.read("p2.part")[..length]).expect("a file");
        refused(&["p1.part", "cut.part"], "cut.part: ");
    }
    refused(
        &["small.toml"],
        "small.toml: it is not a part or checkpoint that wgray wrote",
    );
    refused(&["nowhere.part"], "nowhere.part: ");
    render(&["--checkpoint", "c", "-o", "whole.png"]);
    fs::copy(place.path("c"), place.path("c.part")).expect("a copy");
    refused(&["c.part"], "c.part: is a checkpoint");
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
            "parts consist of whole rows, and the image has 6",
        ),
        (&["render", "small.toml", "-o", "x.part"], "names a part"),
    ] {
        let ran = place.run(arguments);
        assert_eq!(ran.code, 2, "{arguments:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(rule), "{arguments:?}: {}", ran.stderr);
    }
}

#[test]
fn a_part_resumes_from_its_own_checkpoint() {
    let place = TestFolder::new();
    let part = |more: &[&str]| {
        let base = ["render", "small.toml", "--device", "cpu", "--tile", "2/3"];
        place.run(&[&base[..], more].concat())
    };
    assert_eq!(part(&["-o", "a.part", "--checkpoint", "c"]).code, 0);
    assert_eq!(part(&["-o", "b.part", "--checkpoint", "c", "--resume"]).code, 0);
    assert!(place.read("a.part") == place.read("b.part"));
    let ran = place.run(&[
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
    assert_eq!(ran.code, 2);
    assert!(ran.stderr.contains("its crop is"), "{}", ran.stderr);
}

#[test]
fn a_time_limit_ends_with_a_complete_image() {
    let place = TestFolder::new();
    let begun = Instant::now();
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
    let run = |more: &[&str]| place.run(&[&options[..], more].concat());
    let ran = run(&["--time-limit", "0.5", "-o", "a.png", "--stats", "a.json"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(ran.stderr.starts_with("note: time limit reached: "), "{}", ran.stderr);
    assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
    let stats = |name: &str| -> serde_json::Value { serde_json::from_slice(&place.read(name)).expect("JSON") };
    let least = stats("a.json")["least_samples"].as_u64().expect("a number");
    assert!((1..65536).contains(&least), "{least}");
    let (_, _, pixels) = super::read_png(&place.path("a.png"));
    assert!(
        pixels.chunks(3).all(|pixel| pixel != [0, 0, 0]),
        "a pixel has no samples"
    );
    let ran = run(&["--time-limit", "0", "-o", "a.png", "--stats", "a.json"]);
    assert_eq!(
        (ran.code, stats("a.json")["least_samples"].as_u64()),
        (0, Some(1)),
        "{}",
        ran.stderr
    );
    for pattern in ["grid", "rotated_grid", "jittered"] {
        let ran = run(&["--time-limit", "1", "--pixel-pattern", pattern, "-o", "b.png"]);
        assert_eq!(ran.code, 2, "{}", ran.stderr);
        assert!(
            ran.stderr
                .contains("--time-limit: cannot stop early with --pixel-pattern"),
            "{}",
            ran.stderr
        );
    }
    // A limit that is not reached has no effect. A stopped render resumes and gives the same image.
    let short = [
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
    let short = |more: &[&str]| place.run(&[&short[..], more].concat());
    assert_eq!(short(&["-o", "whole.exr"]).code, 0);
    let ran = short(&["-o", "limited.exr", "--time-limit", "1h"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert_eq!(place.run(&["diff", "limited.exr", "whole.exr"]).code, 0);
    let kept = ["--checkpoint", "c", "--resume", "-o", "kept.exr"];
    assert_eq!(short(&[&kept[..], &["--time-limit", "0"]].concat()).code, 0);
    assert!(place.read("kept.exr") != place.read("whole.exr"));
    assert_eq!(short(&kept).code, 0);
    assert!(place.read("kept.exr") == place.read("whole.exr"));
}
