//! The tasks of the templates in `examples/farm` render the same image as a single `wgray render`. `scripts/farms` runs
//! the templates on the schedulers.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;

use super::{RunResult, TestFolder, program, project_path};

/// A file name with special characters of shells, YAML and Open Job Description.
const SPECIAL_NAME: &str = "it's $HOME \"{{a}}\" #1 é.toml";
const QUOTED_SPECIAL_NAME: &str = "'it'\\''s $HOME \"{{a}}\" #1 é.toml'";
const OPTIONS: &str = "--size 20x12 --spp 4 -D 'materials.gray.color=[0.1, 0.5, 0.3]' --aov normal --device cpu";

fn template(name: &str) -> String {
    fs::read_to_string(project_path("examples/farm").join(name)).expect("a template")
}

fn write_slurm(folder: &TestFolder, variables: &str, scene: &str, options: &str, output: &str) {
    let text = template("slurm.sh");
    let (head, rest) = text.split_once("# Settings.").expect("the settings");
    let (_, rest) = rest
        .split_once("# End of the settings.")
        .expect("the end of the settings");
    let program = program().display();
    let settings = format!(
        "{variables}\nrender() {{ exec '{program}' render {options} \"$@\" -- {scene}; }}\n\
         merge() {{ exec '{program}' merge --reproducible --output={output} \"$@\"; }}\n"
    );
    folder.write("slurm.sh", &(head.to_owned() + &settings + rest));
}

/// Runs a shell script in a folder that does not contain the scene.
fn run(arguments: &[&str], variables: &[(&str, &str)]) -> RunResult {
    let mut command = assert_cmd::Command::new("sh");
    command.current_dir("/").args(arguments).envs(variables.iter().copied());
    let output = command
        .timeout(std::time::Duration::from_secs(60))
        .output()
        .expect("a shell");
    RunResult::new(
        output.status.code(),
        String::from_utf8_lossy(&output.stdout).into_owned(),
        &String::from_utf8_lossy(&output.stderr),
        &[],
    )
}

/// Runs the task with the number `first` + `index` of the Slurm script.
fn task(folder: &TestFolder, kind: &str, first: &str, index: &str) -> RunResult {
    let script = folder.path("slurm.sh").display().to_string();
    let folder_path = folder.folder().display().to_string();
    run(&[&script, kind, &folder_path, first], &[("SLURM_ARRAY_TASK_ID", index)])
}

/// Returns the image of the scene named [`SPECIAL_NAME`], and the image with another seed.
fn render_full_image(folder: &TestFolder) -> [Vec<u8>; 2] {
    fs::copy(folder.path("small.toml"), folder.path(SPECIAL_NAME)).expect("a copy");
    ["", "--seed 5"].map(|extra| {
        let line = format!("$0 render {QUOTED_SPECIAL_NAME} {OPTIONS} {extra} --reproducible -o whole.exr");
        assert_eq!(folder.shell("sh", &line).code, 0);
        folder.read("whole.exr")
    })
}

#[test]
fn tasks_of_slurm_render_the_image() {
    let folder = TestFolder::new();
    let [expected, other_seed] = render_full_image(&folder);
    assert!(expected != other_seed, "another seed gives the same image");
    write_slurm(
        &folder,
        "job='my job' tiles=3 frames=",
        QUOTED_SPECIAL_NAME,
        OPTIONS,
        "'- {{}} .exr'",
    );
    for (first, index) in [("0", "0"), ("0", "1"), ("2", "0")] {
        let result = task(&folder, "tile", first, index);
        assert_eq!(result.code, 0, "{}", result.stderr);
    }
    let second_run = task(&folder, "tile", "2", "0");
    assert!(
        second_run.code == 0 && second_run.stderr.contains("skipped 1 of 1"),
        "{}",
        second_run.stderr
    );
    let parts = folder.path("my job/parts/image-of-3");
    assert_eq!(fs::read_dir(&parts).expect("a folder").count(), 3);
    let result = task(&folder, "merge", "0", "0");
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("- {{}} .exr") == expected);
    assert!(!folder.path("my job/checkpoints/image-of-3").exists());
    // If a part is missing, the merge fails and keeps the other files.
    fs::remove_file(parts.join("2.part")).expect("a part");
    fs::remove_file(folder.path("- {{}} .exr")).expect("the image");
    let result = task(&folder, "merge", "0", "0");
    assert_eq!(
        (result.code, folder.path("- {{}} .exr").exists()),
        (1, false),
        "{}",
        result.stderr
    );
    assert!(parts.join("1.part").exists());
}

#[test]
fn tasks_of_slurm_render_frames() {
    let folder = TestFolder::new();
    fs::copy(project_path("scenes/turntable.toml"), folder.path("turn.toml")).expect("a copy");
    let options = "--size 8x6 --spp 1 --device cpu";
    assert_eq!(
        folder
            .shell(
                "sh",
                &format!("$0 render turn.toml {options} --frames 3,8 --reproducible -o whole.#.png")
            )
            .code,
        0
    );
    write_slurm(
        &folder,
        "job=job tiles=2 frames=\"$(seq 3 5 8)\"",
        "turn.toml",
        options,
        "'out.#.png'",
    );
    for index in ["0", "1", "2", "3"] {
        assert_eq!(task(&folder, "tile", "0", index).code, 0);
    }
    for index in ["0", "1"] {
        assert_eq!(task(&folder, "merge", "0", index).code, 0);
    }
    assert!(folder.read("out.3.png") == folder.read("whole.3.png"));
    assert!(folder.read("out.8.png") == folder.read("whole.8.png"));
    assert!(
        folder.read("out.3.png") != folder.read("out.8.png"),
        "frames 3 and 8 are equal"
    );
}

fn write_program(folder: &TestFolder, name: &str, script: &str) {
    let path = folder.path("bin").join(name);
    fs::create_dir_all(folder.path("bin")).expect("a folder");
    fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("a program");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a program");
}

fn path_with_bin(folder: &TestFolder) -> String {
    format!(
        "{}:{}",
        folder.path("bin").display(),
        std::env::var("PATH").unwrap_or_default()
    )
}

/// Slurm signals tasks before the time limit. Signaled tasks are requeued unless they were cancelled or requeued too
/// often.
#[test]
fn signaled_tasks_of_slurm_are_requeued() {
    let folder = TestFolder::new();
    write_slurm(
        &folder,
        "job=job tiles=1 frames=",
        "small.toml",
        "--size 100x100 --spp 65536 --device cpu --checkpoint-interval 0.1",
        "out.exr",
    );
    write_program(&folder, "scontrol", "echo \"$*\" >>\"$LOG\"; exit 1");
    let script = folder.path("slurm.sh");
    let folder_path = folder.folder();
    for (signals, restarts, code, requeues) in [
        (&["-USR1"][..], "0", 75, 1),
        (&["-USR1"], "20", 143, 0),
        (&["-TERM", "-USR1"], "0", 75, 0),
    ] {
        let log = folder.path("log");
        let _ = fs::remove_file(&log);
        let mut child = std::process::Command::new("sh")
            .args([
                script.as_os_str(),
                "tile".as_ref(),
                folder_path.as_os_str(),
                "0".as_ref(),
            ])
            .env("PATH", path_with_bin(&folder))
            .env("LOG", &log)
            .envs([
                ("SLURM_ARRAY_TASK_ID", "0"),
                ("SLURM_ARRAY_JOB_ID", "7"),
                ("SLURM_RESTART_COUNT", restarts),
            ])
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("a shell");
        let checkpoints = folder.path("job/checkpoints/image-of-1/1");
        while fs::read_dir(&checkpoints).map_or(0, Iterator::count) == 0 {
            assert!(
                child.try_wait().expect("a process").is_none(),
                "the task ended before its checkpoint"
            );
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        for signal in signals {
            let status = std::process::Command::new("kill")
                .args([*signal, child.id().to_string().as_str()])
                .status();
            assert!(status.expect("kill").success());
            // bash postpones a signal that arrives while it handles another signal.
            std::thread::sleep(std::time::Duration::from_millis(300));
        }
        assert_eq!(
            child.wait().expect("an exit status").code(),
            Some(code),
            "{signals:?} {restarts}"
        );
        let logged = fs::read_to_string(&log).unwrap_or_default();
        assert_eq!(logged, "requeue 7_0\n".repeat(requeues), "{signals:?} {restarts}");
        fs::remove_dir_all(folder.path("job")).expect("a folder");
    }
}

#[test]
fn slurm_arrays_do_not_exceed_the_maximum_size_of_the_cluster() {
    let folder = TestFolder::new();
    write_slurm(
        &folder,
        "job=job tiles=2 frames='1 2 3 4 5 6'",
        "small.toml",
        "",
        "'#.png'",
    );
    write_program(&folder, "scontrol", "echo 'MaxArraySize            = 5'");
    write_program(
        &folder,
        "sbatch",
        "echo \"$*\" >>\"$LOG\"\nnumber=$(wc -l <\"$LOG\")\n[ \"$number\" -eq \"$FAILING_CALL\" ] && exit 1\necho \"$((number));cluster\"",
    );
    write_program(&folder, "scancel", "echo \"cancelled $*\" >>\"$LOG\"");
    let script = folder.path("slurm.sh").display().to_string();
    let path = path_with_bin(&folder);
    let submit = |failing_call: &str| {
        let log = folder.path("log").display().to_string();
        let _ = fs::remove_file(&log);
        let variables = [
            ("PATH", path.as_str()),
            ("FAILING_CALL", failing_call),
            ("LOG", log.as_str()),
        ];
        let result = run(&[&script, "--gres=gpu:1"], &variables);
        let logged = fs::read_to_string(&log).expect("a log");
        (result, logged.lines().map(str::to_owned).collect::<Vec<String>>())
    };
    let (result, logged) = submit("0");
    assert_eq!(
        (result.code, result.stdout.as_str(), result.stderr.as_str()),
        (0, "tiles 1 2 3, merge 4 5\n", "")
    );
    let folder_path = fs::canonicalize(folder.folder())
        .expect("a folder")
        .display()
        .to_string();
    let array = |kind: &str, last: u32, options: &str, first: u32| {
        format!(
            "--parsable --job-name=wgray-{kind} --array=0-{last} --chdir={folder_path}/job/logs --output=%x-%A_%a.txt {options} \
             {folder_path}/slurm.sh {kind} {folder_path} {first}"
        )
    };
    let (tile, merge) = (
        "--signal=B:USR1@60 --gres=gpu:1",
        "--gres=gpu:1 --dependency=afterok:1:2:3 --kill-on-invalid-dep=yes",
    );
    assert_eq!(
        logged,
        [
            array("tile", 4, tile, 0),
            array("tile", 4, tile, 5),
            array("tile", 1, tile, 10),
            array("merge", 4, merge, 0),
            array("merge", 0, merge, 5),
        ]
    );
    for (failing_call, cancelled) in [
        ("1", None),
        ("3", Some("1 2")),
        ("4", Some("1 2 3")),
        ("5", Some("1 2 3 4")),
    ] {
        let (result, logged) = submit(failing_call);
        assert_eq!(result.code, 1, "{failing_call}");
        let found = logged.last().and_then(|line| line.strip_prefix("cancelled "));
        assert_eq!(found, cancelled, "{failing_call}");
    }
}

/// Returns the scripts in an Open Job Description template.
fn scripts(template: &str) -> Vec<String> {
    let script = |text: &str| -> String {
        let indent = " ".repeat(12);
        let lines = text.lines().skip(1).map_while(|line| line.strip_prefix(&indent));
        lines.map(|line| line.to_owned() + "\n").collect()
    };
    template.split("data: |").skip(1).map(script).collect()
}

#[test]
fn scripts_of_open_job_description_render_the_image() {
    let folder = TestFolder::new();
    let [expected, other_seed] = render_full_image(&folder);
    assert!(expected != other_seed, "another seed gives the same image");
    let scripts = scripts(&template("wgray.openjd.yaml"));
    let [render, merge] = scripts.as_slice() else {
        panic!("{scripts:?}")
    };
    // Schedulers would expand double braces.
    assert!(!render.contains("{{") && !merge.contains("{{"));
    let [scene, output] = [SPECIAL_NAME, "- {{}} .exr"].map(|name| folder.path(name).display().to_string());
    let program = program().display().to_string();
    for tile in ["1", "2"] {
        let result = run(
            &[
                "-c", render, "render", &program, &scene, &output, OPTIONS, "2", "-1", tile,
            ],
            &[],
        );
        assert_eq!(result.code, 0, "{}", result.stderr);
        assert!(result.stderr.ends_with("openjd_progress: 100\n"), "{}", result.stderr);
    }
    let result = run(
        &[
            "-c",
            merge,
            "merge",
            &program,
            &scene,
            &output,
            "--reproducible",
            "2",
            "-1",
        ],
        &[],
    );
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("- {{}} .exr") == expected);
    assert!(!folder.path("- {{}} .exr.farm/checkpoints/image-of-2").exists());
    // An attempt with other options does not reuse the parts of the first attempt.
    let options = OPTIONS.to_owned() + " --seed 5";
    for tile in ["1", "2"] {
        let result = run(
            &[
                "-c", render, "render", &program, &scene, &output, &options, "2", "-1", tile,
            ],
            &[],
        );
        assert_eq!(result.code, 0, "{}", result.stderr);
    }
    let result = run(
        &[
            "-c",
            merge,
            "merge",
            &program,
            &scene,
            &output,
            "--reproducible",
            "2",
            "-1",
        ],
        &[],
    );
    assert_eq!((result.code, result.stderr.as_str()), (0, ""));
    assert!(folder.read("- {{}} .exr") == other_seed);
}
