//! `wgray farm`: what is written, and that it renders the picture that `wgray render` does. `scripts/farms` runs it on the engines.

use std::fs;

use super::{Place, Ran, program};

/// A name with all that means something to a shell, to YAML or to Open Job Description.
const ODD: &str = "it's $HOME \"{{a}}\" #1 é.toml";

/// Options that shape the picture, in each way in which they can be written.
const SHAPE: [&str; 11] = [
    "--size=20x12",
    "--pixel-samples",
    "4",
    "-Drender.seed=7",
    "--define",
    "materials.gray.color=[0.1, 0.5, 0.3]",
    "--aov",
    "normal,depth",
    "--device",
    "cpu",
    "--reproducible",
];

fn farm(place: &Place, engine: &str, more: &[&str]) -> Ran {
    place.run(&[&["farm", engine][..], more].concat())
}

fn written(place: &Place, engine: &str, more: &[&str]) -> String {
    let ran = farm(place, engine, more);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{more:?}");
    ran.stdout
}

fn text(place: &Place, name: &str) -> String {
    String::from_utf8(place.read(name)).expect("UTF-8")
}

/// The odd scene, and the picture that one render makes of it.
fn odd() -> (Place, Vec<u8>) {
    let place = Place::new();
    fs::copy(place.path("small.toml"), place.path(ODD)).expect("a copy");
    place.quietly(&[&["render", ODD, "-o", "whole.exr"][..], &SHAPE].concat());
    let whole = place.read("whole.exr");
    (place, whole)
}

/// Runs a script of a task.
fn task(shell: &str, words: &[&str], variables: &[(&str, &str)]) -> Ran {
    let mut command = assert_cmd::Command::new(shell);
    command.current_dir("/").args(words).envs(variables.iter().copied());
    let output = command
        .timeout(std::time::Duration::from_secs(60))
        .output()
        .expect("a shell");
    Ran::new(
        output.status.code(),
        String::from_utf8_lossy(&output.stdout).into_owned(),
        &String::from_utf8_lossy(&output.stderr),
        &[],
    )
}

#[cfg(unix)]
#[test]
fn scripts_of_slurm_render_the_picture() {
    let (place, whole) = odd();
    let own = ["--tiles", "3", "--program", &program().display().to_string()];
    let told = written(
        &place,
        "slurm",
        &[&[ODD, "--output=- {{}} '.exr"], &SHAPE[..], &own].concat(),
    );
    let folder = format!("{}.farm", ODD.trim_end_matches(".toml"));
    assert!(
        told.contains("in 3 parts: 3 tasks to render, 1 task to join the parts."),
        "{told}"
    );
    let [tile, merge] = ["tile.sh", "merge.sh"].map(|name| place.path(&folder).join(name).display().to_string());
    let run = |script: &str, first: &str, index: &str| {
        task(
            "bash",
            &[script, first],
            &[("SLURM_ARRAY_TASK_ID", index), ("PWD", "/")],
        )
    };
    // An array of two, and one of one; a task that was done before is not done again.
    for (first, index) in [("0", "0"), ("0", "1"), ("2", "0")] {
        let ran = run(&tile, first, index);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
    }
    let again = run(&tile, "2", "0");
    assert_eq!(again.code, 0);
    assert!(again.stderr.contains("skipped 1 of 1"), "{}", again.stderr);
    let ran = run(&merge, "0", "0");
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(place.read("- {{}} '.exr") == whole);
    let left = place.path(&folder);
    assert_eq!(fs::read_dir(left.join("checkpoints")).expect("a folder").count(), 0);
    assert_eq!(
        fs::read_dir(left.join("parts/picture-of-3")).expect("a folder").count(),
        3
    );
    // A part that is not there ends it, and what was there stays.
    fs::remove_file(left.join("parts/picture-of-3/2.part")).expect("a part");
    fs::remove_file(place.path("- {{}} '.exr")).expect("the picture");
    let ran = run(&merge, "0", "0");
    assert_eq!(
        (ran.code, place.path("- {{}} '.exr").exists()),
        (1, false),
        "{}",
        ran.stderr
    );
}

/// Between two tries the scene changes, and changes back.
#[cfg(unix)]
#[test]
fn a_changed_scene_begins_anew_beside_the_old_one() {
    let place = Place::new();
    let render = |output: &str| {
        place.quietly(&[
            "render",
            "small.toml",
            "--device",
            "cpu",
            "--reproducible",
            "-o",
            output,
        ])
    };
    let program = program().display().to_string();
    let own = [
        "--device",
        "cpu",
        "--reproducible",
        "--tiles",
        "2",
        "--program",
        &program,
    ];
    written(&place, "slurm", &[&["small.toml", "-o", "out.exr"][..], &own].concat());
    let run = |script: &str, index: &str| {
        let script = place.path("small.farm").join(script).display().to_string();
        let ran = task("bash", &[&script], &[("SLURM_ARRAY_TASK_ID", index)]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        ran.stderr
    };
    let kept = || {
        let folder = fs::read_dir(place.path("small.farm/checkpoints/picture-of-2/1"));
        let mut names: Vec<_> = folder
            .expect("a folder")
            .map(|entry| entry.expect("a file").file_name())
            .collect();
        names.sort();
        names
    };
    render("old.exr");
    run("tile.sh", "0");
    let old = kept();
    place.write("small.toml", &super::SCENE.replace("0.8, 0.8, 0.8", "0.8, 0.8, 0.9"));
    render("new.exr");
    assert!(place.read("old.exr") != place.read("new.exr"), "the control");
    run("tile.sh", "0");
    let both = kept();
    assert!(
        old.len() == 1 && both.len() == 2 && both.contains(&old[0]),
        "{old:?} {both:?}"
    );
    place.write("small.toml", super::SCENE);
    run("tile.sh", "0");
    assert_eq!(kept(), both, "what was kept of the old scene is gone on from");
    run("tile.sh", "1");
    run("merge.sh", "0");
    assert!(place.read("out.exr") == place.read("old.exr"));
    assert!(!place.path("small.farm/checkpoints/picture-of-2").exists());
}

/// The scripts in a template.
fn scripts(template: &str) -> Vec<String> {
    let script = |text: &str| -> String {
        let lines = text
            .lines()
            .skip(1)
            .take_while(|line| line.is_empty() || line.starts_with("              "));
        lines
            .map(|line| line.trim_start_matches("              ").to_owned() + "\n")
            .collect()
    };
    template.split("data: |").skip(1).map(script).collect()
}

#[cfg(unix)]
#[test]
fn scripts_of_a_template_render_the_picture() {
    let (place, whole) = odd();
    written(
        &place,
        "openjd",
        &[&[ODD, "-o", "out.exr", "--tiles", "2", "--to", "job.yaml"], &SHAPE[..]].concat(),
    );
    let template = text(&place, "job.yaml");
    for line in [
        "    default: \"it's $HOME \\\"{{a}}\\\" #1 é.toml\"",
        "    default: \".\"",
        "    default: 2",
        "          range: \"1-{{Param.Tiles}}\"",
        "            mode: NOTIFY_THEN_TERMINATE",
        "      - dependsOn: render",
    ] {
        assert!(template.lines().any(|found| found == line), "{line}:\n{template}");
    }
    let scripts = scripts(&template);
    let [render, merge] = scripts.as_slice() else {
        panic!("{template}")
    };
    assert!(!render.contains("{{") && !merge.contains("{{"), "{template}");
    let (folder, program) = (place.folder().display().to_string(), program().display().to_string());
    for tile in ["1", "2"] {
        let ran = task("sh", &["-c", render, "render", &folder, &program, "2", ODD, tile], &[]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        assert!(ran.stderr.ends_with("openjd_progress: 100\n"), "{}", ran.stderr);
    }
    let ran = task("sh", &["-c", merge, "merge", &folder, &program, "2", "out.exr"], &[]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(place.read("out.exr") == whole);
}

#[test]
fn frames_are_told_as_ranges() {
    let place = Place::new();
    let options = [
        "small.toml",
        "--frames",
        "7,1-5:2,20",
        "-o",
        "out.###.png",
        "--tiles",
        "2",
    ];
    for (engine, file, line) in [
        ("openjd", "small.openjd.yaml", "    default: \"1-7:2,20\""),
        ("slurm", "small.farm/tile.sh", "frames=($(seq 1 2 7) 20)"),
        ("slurm", "small.farm/merge.sh", "    '--output=out.###.png' \\"),
    ] {
        let ran = farm(&place, engine, &[&options[..], &["--overwrite"]].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let text = text(&place, file);
        assert!(text.lines().any(|found| found == line), "{line}:\n{text}");
    }
    // Around, frames are those of the circle.
    let ran = farm(
        &place,
        "openjd",
        &[
            "small.toml",
            "--turntable",
            "9",
            "-o",
            "out.#.png",
            "--tiles=1",
            "--overwrite",
        ],
    );
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let text = text(&place, "small.openjd.yaml");
    assert!(
        text.contains("default: \"1-9\"") && text.contains("--turntable=9"),
        "{text}"
    );
}

#[test]
fn tiles_are_as_long_as_was_asked() {
    let place = Place::new();
    let options = [
        "small.toml",
        "-o",
        "out.png",
        "--device",
        "cpu",
        "--size",
        "40x30",
        "--spp",
        "64",
    ];
    let tiles = |time: &str, rows: u32| {
        let ran = farm(
            &place,
            "slurm",
            &[&options[..], &["--task-time", time, "--overwrite"]].concat(),
        );
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let text = text(&place, "small.farm/tile.sh");
        let tiles = text
            .lines()
            .find_map(|line| line.strip_prefix("tiles="))
            .expect("tiles");
        let tiles: u32 = tiles
            .split(' ')
            .next()
            .and_then(|tiles| tiles.parse().ok())
            .expect("a number");
        assert!((1..=rows).contains(&tiles), "{tiles}");
        (tiles, ran.stderr, text)
    };
    let (all, warned, text) = tiles("1h", 30);
    assert_eq!((all, warned.as_str()), (1, ""));
    assert!(
        text.contains("# A task takes about ") && text.contains("by a test render on cpu"),
        "{text}"
    );
    assert!(text.contains("#SBATCH --time=10 "), "{text}");
    let (_, warned, _) = tiles("0", 30);
    assert!(warned.starts_with("warning: --task-time: startup takes "), "{warned}");
}

#[test]
fn why_tasks_are_not_as_long_as_was_asked_is_told() {
    let place = Place::new();
    for (size, samples, told) in [
        // By far more than what a task's beginning takes, and by far less.
        ("64x1", "65536", "a single row takes longer than 0 ms\n"),
        ("1x1", "1", "; the image is a single task\n"),
        (
            "16x2000",
            "64",
            "; tasks are lengthened so that it takes at most half\n",
        ),
    ] {
        let more = [
            "small.toml",
            "-o",
            "out.png",
            "--device",
            "cpu",
            "--size",
            size,
            "--task-time",
            "0",
            "--overwrite",
        ];
        let ran = farm(&place, "slurm", &[&more[..], &["--pixel-samples", samples]].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        assert!(
            ran.stderr.starts_with("warning: --task-time: ") && ran.stderr.ends_with(told),
            "{size}: {}{}",
            ran.stderr,
            ran.stdout
        );
    }
}

/// Programs of Slurm that note what they are asked for.
#[cfg(unix)]
#[test]
fn arrays_are_no_larger_than_the_cluster_has_them() {
    use std::os::unix::fs::PermissionsExt as _;
    let place = Place::new();
    let ran = farm(
        &place,
        "slurm",
        &["small.toml", "--frames", "1-6", "-o", "#.png", "--tiles", "2"],
    );
    assert_eq!(ran.code, 0, "{}", ran.stderr); // with a warning, as nothing moves
    let bin = place.path("bin");
    fs::create_dir(&bin).expect("a folder");
    for (name, script) in [
        ("scontrol", "#!/bin/sh\necho 'MaxArraySize            = 5'\n"),
        (
            "sbatch",
            "#!/bin/sh\necho \"$*\" >>\"$LOG\"\nnumber=$(wc -l <\"$LOG\")\n[ \"$number\" = \"$BROKEN\" ] && exit 1\necho \"$number;cluster\"\n",
        ),
        ("scancel", "#!/bin/sh\necho \"cancelled $*\" >>\"$LOG\"\n"),
    ] {
        fs::write(bin.join(name), script).expect("a program");
        fs::set_permissions(bin.join(name), fs::Permissions::from_mode(0o755)).expect("a program");
    }
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let submit = place.path("small.farm/submit").display().to_string();
    let run = |broken: &str| {
        let log = place.path("log");
        let _ = fs::remove_file(&log);
        let variables = [("PATH", path.as_str()), ("BROKEN", broken)];
        let log_variable = [("LOG", log.to_str().expect("UTF-8"))];
        let ran = task(&submit, &["--gres=gpu:1"], &[&variables[..], &log_variable].concat());
        let noted = text(&place, "log");
        let noted = noted.lines().map(|line| {
            let words = line
                .split(' ')
                .filter(|word| !word.starts_with("--chdir=") && !word.starts_with("--output="));
            words.collect::<Vec<_>>().join(" ")
        });
        (ran, noted.collect::<Vec<String>>())
    };
    let (ran, noted) = run("0");
    assert_eq!(
        (ran.code, ran.stdout.as_str(), ran.stderr.as_str()),
        (0, "tiles 1 2 3, merge 4 5\n", "")
    );
    let merge = "--gres=gpu:1 --dependency=afterok:1:2:3 --kill-on-invalid-dep=yes merge.sh";
    assert_eq!(
        noted,
        [
            "--parsable --array=0-4 --gres=gpu:1 tile.sh 0".to_owned(),
            "--parsable --array=0-4 --gres=gpu:1 tile.sh 5".to_owned(),
            "--parsable --array=0-1 --gres=gpu:1 tile.sh 10".to_owned(),
            format!("--parsable --array=0-4 {merge} 0"),
            format!("--parsable --array=0-0 {merge} 5"),
        ]
    );
    // What was submitted before something failed is cancelled.
    for (broken, cancelled) in [
        ("1", None),
        ("3", Some("cancelled 1 2")),
        ("4", Some("cancelled 1 2 3")),
        ("5", Some("cancelled 1 2 3 4")),
    ] {
        let (ran, noted) = run(broken);
        assert_eq!(ran.code, 1, "{broken}");
        let found = noted.last().filter(|line| line.starts_with("cancelled"));
        assert_eq!(
            found
                .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
                .as_deref(),
            cancelled
        );
    }
}

#[test]
fn what_is_not_for_farms_is_refused() {
    let place = Place::new();
    for (more, code, told) in [
        (&["small.toml"][..], 2, "error: --output: is required: -o NAME.exr\n"),
        (
            &["small.toml", "-o", "-"],
            2,
            "error: --output: -: must be a file that the machines of the farm can write\n",
        ),
        #[cfg(unix)]
        (
            &["small.toml", "-o", "x.png", "-o", "/dev/stdout", "--tiles", "1"],
            2,
            "error: --output: /dev/stdout: must be a file that the machines of the farm can write\n",
        ),
        #[cfg(unix)]
        (
            &["small.toml", "-o", "/dev/null", "--tiles", "1"],
            2,
            "error: --output: /dev/null: must be a file that the machines of the farm can write\n",
        ),
        (
            &["small.toml", "-o", "x.png", "--tile", "1/2"],
            2,
            "error: --tile: cannot be used with wgray farm, which sets it for each task\n",
        ),
        (
            &["small.toml", "-o", "x.png", "--resume"],
            2,
            "error: --resume: cannot be used with wgray farm, which sets it for each task\n",
        ),
        (
            &["small.toml", "-o", "x.png", "--quiet"],
            2,
            "error: --quiet: cannot be used with wgray farm",
        ),
        (
            &["small.toml", "-o", "x.png", "--tiles", "7"],
            2,
            "error: --tiles: 7: must be at most 6, the number of rows of the image\n",
        ),
        (
            &["small.toml", "-o", "x.png", "--size", "1x1", "--tiles", "10"],
            2,
            "error: --tiles: 10: must be at most ",
        ),
        (
            &["small.toml", "-o", "x.png", "--tiles", "0"],
            2,
            "error: invalid value '0' for '--tiles <N>'",
        ),
        (
            &["small.toml", "-o", "x.png", "--tiles", "1", "--task-time", "1m"],
            2,
            "error: the argument '--tiles <N>' cannot be used with",
        ),
        (
            &["small.toml", "-o", "x.png", "--tiles", "1", "--limit", "119"],
            2,
            "error: invalid value '119' for '--limit <TIME>': must be 2m or more",
        ),
        (
            &["small.toml", "-o", "x.png", "--tiles", "1", "-D", "a=\n1"],
            2,
            "error: --define: \"a=\\n1\": must be UTF-8 without line breaks",
        ),
        (
            &["small.toml", "-o", "x\n.png", "--tiles", "1"],
            2,
            "error: --output: \"x\\n.png\": must be UTF-8",
        ),
        (
            &["none.toml", "-o", "x.png", "--tiles", "1"],
            3,
            "error: none.toml: cannot be read",
        ),
        (
            &["small.toml", "-o", "x.png", "--frames", "1-2", "--tiles", "1"],
            2,
            "error: --output: x.png: needs #",
        ),
        (
            &[
                "small.toml",
                "-o",
                "x.png",
                "--bit-depth",
                "8",
                "--exr-type",
                "half",
                "--tiles",
                "1",
            ],
            2,
            "error: --exr-type: only applies to EXR outputs",
        ),
        (
            &["small.toml", "-o", "small.toml", "--tiles", "1"],
            2,
            "error: --output: small.toml:",
        ),
    ] {
        let ran = farm(&place, "slurm", more);
        assert_eq!((ran.code, ran.stdout.as_str()), (code, ""), "{more:?}: {}", ran.stderr);
        assert!(ran.stderr.starts_with(told), "{more:?}: {}", ran.stderr);
    }
    assert_eq!(place.files(), [""; 0]);
    let ran = farm(&place, "openjd", &["small.toml", "-o", "x.png", "--to", "small.toml"]);
    assert_eq!(
        (ran.code, ran.stderr.as_str()),
        (2, "error: --to: small.toml: must end in .yaml or .yml\n")
    );
}

#[test]
fn files_that_are_there_stay() {
    let place = Place::new();
    let options = ["small.toml", "-o", "x.png", "--tiles", "2"];
    for (engine, file) in [("openjd", "small.openjd.yaml"), ("slurm", "small.farm/tile.sh")] {
        written(&place, engine, &options);
        fs::write(place.path(file), "mine").expect("a file");
        let ran = farm(&place, engine, &options);
        let told = format!(
            "error: --to: {file}: already exists; pass --overwrite to replace it, or choose another name with --to\n"
        );
        assert_eq!((ran.code, ran.stderr), (2, told));
        assert_eq!(place.read(file), b"mine");
        written(&place, engine, &[&options[..], &["--overwrite"]].concat());
        assert_ne!(place.read(file), b"mine");
    }
}

#[test]
fn a_folder_stands_for_its_parts() {
    let place = Place::new();
    place.quietly(&["render", "small.toml", "-o", "whole.png", "--reproducible"]);
    fs::create_dir(place.path("parts")).expect("a folder");
    for i in ["1", "2", "3"] {
        place.quietly(&[
            "render",
            "small.toml",
            "--tile",
            &format!("{i}/3"),
            "-o",
            &format!("parts/{i}.part"),
        ]);
    }
    // What is no part, and what another process is still writing.
    fs::write(place.path("parts/notes"), "x").expect("a file");
    fs::write(place.path("parts/.wgray-1.part"), "x").expect("a file");
    place.quietly(&["merge", "parts", "--frame", "7", "-o", "out.###.png", "--reproducible"]);
    assert!(place.read("out.007.png") == place.read("whole.png"));
    fs::rename(place.path("parts/2.part"), place.path("2.part")).expect("a part");
    place.quietly(&["merge", "parts", "2.part", "-o", "out.png", "--reproducible"]);
    assert!(place.read("out.png") == place.read("whole.png"));
    let ran = place.run(&["merge", "parts", "-o", "x.png"]);
    assert_eq!(
        (ran.code, ran.stderr.as_str()),
        (1, "error: rows 2 to 3 are missing: add part 2/3\n")
    );
    fs::create_dir(place.path("empty")).expect("a folder");
    let ran = place.run(&["merge", "empty", "-o", "x.png"]);
    let told = "error: empty: contains no parts (NAME.part, written by wgray render --tile)\n";
    assert_eq!((ran.code, ran.stderr.as_str()), (1, told));
    let ran = place.run(&["merge", "parts", "-o", "x.png", "--frame", "1000000000"]);
    assert_eq!(ran.code, 2, "{}", ran.stderr);
}

#[test]
fn a_part_of_another_job_is_not_skipped() {
    let place = Place::new();
    let part = |seed: &str, exposure: &str| {
        let exposure = format!("image.exposure={exposure}");
        let options = [
            "--tile",
            "1/2",
            "-o",
            "1.part",
            "--skip-existing",
            "--seed",
            seed,
            "-D",
            &exposure,
        ];
        let ran = place.run(&[&["render", "small.toml"][..], &options].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        ran.stderr
    };
    let skipped = "note: skipped 1 of 1: the output files exist\n";
    assert_eq!(part("1", "0"), "");
    assert_eq!(part("1", "0"), skipped);
    let first = place.read("1.part");
    assert!(part("2", "0").contains("belongs to another scene or other options; rendering it again"));
    assert!(place.read("1.part") != first);
    assert!(part("1", "0").contains("rendering it again"));
    assert!(place.read("1.part") == first);
    // How it is shown is told in it too.
    assert!(part("1", "1").contains("rendering it again"));
    assert_eq!(part("1", "1"), skipped);
    fs::write(place.path("1.part"), "no part").expect("a file");
    assert!(part("1", "0").contains("rendering it again"));
    assert!(place.read("1.part") == first);
}

#[test]
fn codes_for_another_try_have_no_meaning_of_their_own() {
    let place = Place::new();
    for (code, good) in [
        ("8", false),
        ("9", true),
        ("75", true),
        ("125", true),
        ("126", false),
        ("0", false),
    ] {
        let ran = place.run(&["render", "small.toml", "-o", "x.png", "--requeue-exit", code]);
        assert_eq!(ran.code, if good { 0 } else { 2 }, "{code}: {}", ran.stderr);
    }
    // What another try does not help has its own code.
    let ran = place.run(&["render", "none.toml", "-o", "x.png", "--requeue-exit", "75"]);
    assert_eq!(ran.code, 3);
}
