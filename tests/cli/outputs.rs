//! Output destinations: input files are protected, no file is written twice, and pipes and devices are written to
//! directly.

use std::fs;

use super::{Ran, SCENE, TestFolder};

fn textured(place: &TestFolder) {
    let texture = |name: &str, file: &str, encoding: &str| {
        image::RgbImage::new(2, 2).save(place.path(file)).unwrap();
        format!("[textures.{name}]\ntype = 'image'\nfile = '{file}'\nencoding = '{encoding}'\n")
    };
    let scene = SCENE.replacen(
        "[[lights]]",
        &format!(
            "{}{}{}[[lights]]",
            texture("colour", "tiles.png", "srgb"),
            texture("bumps", "wall.normal.png", "linear"),
            texture("unused", "spare.png", "srgb"),
        ),
        1,
    );
    place.write("tiles.toml", &scene);
}

/// Writes a scene with a mesh whose .mtl file has two used materials, one textured, and an unused one.
fn with_materials(place: &TestFolder) {
    for name in ["wood.png", "spare.png"] {
        image::RgbImage::new(2, 2).save(place.path(name)).unwrap();
    }
    place.write(
        "box.mtl",
        "newmtl a\nKd 1 0 0\nnewmtl b\nmap_Kd wood.png\nnewmtl c\nmap_Kd spare.png\n",
    );
    let mesh = "v 0 -2 0\nv 1 -2 0\nv 0 -2 2\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1/1 3/1 2/1\n";
    place.write("box.obj", &format!("mtllib box.mtl\n{mesh}"));
    let shape = "[[shapes]]\ntype = 'mesh'\nfile = 'box.obj'\n";
    place.write("box.toml", &format!("{SCENE}{shape}"));
}

#[test]
fn files_that_a_mesh_refers_to_are_not_replaced() {
    let place = TestFolder::new();
    with_materials(&place);
    let keeps = "is an input of the scene; choose another name";
    for name in ["wood.png", "spare.png"] {
        refused(
            &place,
            &["box.toml", "-o", name],
            2,
            &format!("--output: {name} {keeps}"),
        );
    }
    for name in ["box.mtl", "box.obj"] {
        let message = format!("--output: {name} {keeps}");
        refused(&place, &["box.toml", "-o", name, "--format", "png"], 2, &message);
    }
    let message = format!("--stats: box.mtl {}", keeps.replace(" with --output", ""));
    refused(&place, &["box.toml", "--stats", "box.mtl"], 2, &message);
    place.quietly(&["render", "box.toml", "-o", "other.png", "--device", "cpu"]);
    let ran = place.run(&["dev", "box.toml", "--no-page", "--out", "wood.png"]);
    assert_eq!(ran.code, 2, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("--out: wood.png is an input of the scene"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_mesh_has_the_materials_of_its_file() {
    let place = TestFolder::new();
    with_materials(&place);
    let picture = |scene: &str| {
        place.quietly(&["render", scene, "-o", "a.exr", "--device", "cpu"]);
        place.read("a.exr")
    };
    let with_own = picture("box.toml");
    let material = "[materials.red]\ntype = 'phong'\ncolor = [1, 0, 0]\nspecular = [0, 0, 0]\n";
    let texture = "[textures.wood]\ntype = 'image'\nfile = 'wood.png'\n[materials.wood]\ntype = 'phong'\n\
                   color = { texture = 'wood' }\nspecular = [0, 0, 0]\n";
    let scene = String::from_utf8(place.read("box.toml")).unwrap();
    let text = format!("{scene}materials = {{ a = 'red', b = 'wood' }}\n{material}{texture}");
    place.write("told.toml", &text);
    assert!(picture("told.toml") == with_own);
    place.write("other.toml", &text.replace("[1, 0, 0]", "[0, 1, 0]"));
    assert!(picture("other.toml") != with_own);
}

/// Checks that the render is rejected and changes no file.
#[track_caller]
pub fn refused(place: &TestFolder, arguments: &[&str], code: i32, message: &str) {
    let content = |place: &TestFolder| -> Vec<(String, Vec<u8>)> {
        let files = place.files().into_iter().filter(|name| place.path(name).is_file());
        files.map(|name| (name.clone(), place.read(&name))).collect()
    };
    let before = content(place);
    let ran = place.run(&[&["render", "--device", "cpu"], arguments].concat());
    assert_eq!(
        (ran.code, ran.stdout.as_str()),
        (code, ""),
        "{arguments:?}: {}",
        ran.stderr
    );
    assert!(ran.stderr.contains(message), "{arguments:?}: {}", ran.stderr);
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    assert!(before == content(place), "{arguments:?} changed a file");
}

#[test]
fn no_input_is_replaced() {
    let place = TestFolder::new();
    textured(&place);
    let keeps = "is an input of the scene; choose another name";
    let foreign = "exists and was not written by wgray; name the output with -o";
    refused(&place, &["tiles.toml"], 2, &format!("tiles.png {foreign}"));
    refused(
        &place,
        &["tiles.toml", "-o", "tiles.png"],
        2,
        &format!("--output: tiles.png {keeps}"),
    );
    refused(
        &place,
        &["tiles.toml", "-o", "spare.png"],
        2,
        &format!("--output: spare.png {keeps}"),
    );
    let aov = format!("--aov normal: wall.normal.png {keeps}");
    refused(
        &place,
        &["tiles.toml", "-o", "wall.png", "--aov", "depth,normal"],
        2,
        &aov,
    );
    fs::copy(place.path("small.toml"), place.path("scene.png")).unwrap();
    refused(&place, &["scene.png"], 2, &format!("scene.png {foreign}"));
    // An EXR contains its layers: no separate file collides.
    place.quietly(&[
        "render",
        "tiles.toml",
        "-o",
        "wall.exr",
        "--aov",
        "normal",
        "--device",
        "cpu",
    ]);
}

#[cfg(unix)]
#[test]
fn no_input_is_replaced_through_links() {
    let place = TestFolder::new();
    textured(&place);
    let path = |name: &str| place.path(name);
    std::os::unix::fs::symlink("tiles.png", path("soft.png")).unwrap();
    std::os::unix::fs::symlink(".", path("folder")).unwrap();
    std::os::unix::fs::symlink("small.toml", path("scene.json")).unwrap();
    fs::hard_link(path("tiles.png"), path("hard.png")).unwrap();
    for output in ["soft.png", "hard.png", "folder/tiles.png"] {
        let message = format!("--output: {output} is the same file as ./tiles.png, an input of the scene");
        refused(&place, &["tiles.toml", "-o", output], 2, &message);
    }
    refused(
        &place,
        &["small.toml", "--stats", "scene.json"],
        2,
        "--stats: scene.json: must not end in .toml",
    );
}

#[test]
fn no_output_is_written_twice() {
    let place = TestFolder::new();
    for (arguments, message) in [
        (
            &["-o", "q", "--format", "png", "--stats", "./q"][..],
            "--stats: ./q is also written by --output",
        ),
        (
            &["-o", "-", "--stats", "-"],
            "--stats: standard output is also written by --output",
        ),
        (
            &["-o", "q.png", "--stats", "q.png"],
            "--stats: q.png: must not end in .png or link to such a file",
        ),
        (&["--stats", "Q.EXR"], "--stats: Q.EXR: must not end in .exr"),
        (
            &["--stats", "other.toml"],
            "--stats: other.toml: must not end in .toml or link to such a file, which names a",
        ),
        (
            &["-o", "other.toml", "--format", "exr"],
            "--output: other.toml: must not end in .toml",
        ),
    ] {
        refused(&place, &[&["small.toml"], arguments].concat(), 2, message);
    }
}

#[test]
fn the_output_of_the_development_mode_replaces_no_input() {
    let place = TestFolder::new();
    textured(&place);
    std::fs::create_dir(place.path("folder.png")).unwrap();
    for (out, code, message) in [
        (
            "tiles.png",
            2,
            "--out: tiles.png is an input of the scene; choose another name",
        ),
        ("./spare.png", 2, "--out: ./spare.png is an input of the scene"),
        ("tiles.toml", 2, "--out: tiles.toml: must end in .png"),
        ("folder.png", 8, "folder.png: cannot be written: it is a folder"),
        (
            "nowhere/a.png",
            8,
            "nowhere/a.png: cannot be written: the folder nowhere does not exist",
        ),
    ] {
        let ran = place.run(&["dev", "tiles.toml", "--no-page", "--out", out]);
        assert_eq!(ran.code, code, "{}", ran.stderr);
        assert!(ran.stderr.contains(message), "{}", ran.stderr);
    }
}

#[test]
fn the_name_or_the_option_selects_the_format() {
    let place = TestFolder::new();
    refused(
        &place,
        &["small.toml", "-o", "q.png", "--format", "exr"],
        2,
        "--format: contradicts --output",
    );
    refused(
        &place,
        &["small.toml", "-o", "q.gif"],
        2,
        "q.gif: must end in .png, .exr, .jpg, .jpeg or .webp; or set --format",
    );
    place.quietly(&["render", "small.toml", "-o", "q", "--format", "exr", "--device", "cpu"]);
    place.quietly(&[
        "render",
        "small.toml",
        "-o",
        "q.exr",
        "--format",
        "exr",
        "--device",
        "cpu",
    ]);
    assert_eq!(place.read("q"), place.read("q.exr"));
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt};
    use std::process::{Command, Stdio};

    use super::super::program;
    use super::*;

    fn bash(place: &TestFolder, line: &str) -> Ran {
        place.shell("bash", line)
    }

    #[track_caller]
    fn quiet(place: &TestFolder, line: &str) {
        let ran = bash(place, line);
        assert_eq!(
            (ran.code, ran.stdout.as_str(), ran.stderr.as_str()),
            (0, "", ""),
            "{line}"
        );
    }

    /// Standard output receives the same bytes as a file.
    #[test]
    fn standard_output_receives_an_image_or_statistics() {
        let place = TestFolder::new();
        place.quietly(&["render", "small.toml", "-o", "file.png", "--device", "cpu"]);
        place.quietly(&[
            "render",
            "small.toml",
            "-o",
            "file.exr",
            "--aov",
            "normal",
            "--device",
            "cpu",
        ]);
        for (line, file) in [
            ("$0 render small.toml --device cpu -o - | cat > got", "file.png"),
            ("$0 render small.toml --device cpu -o - > got", "file.png"),
            (
                "$0 render small.toml --device cpu -o /dev/stdout | cat > got",
                "file.png",
            ),
            ("$0 render small.toml --device cpu -o /dev/fd/1 > got", "file.png"),
            (
                "$0 render small.toml --device cpu -o >(cat > got); while ! [ -s got ]; do sleep 0.02; done",
                "file.png",
            ),
            (
                "$0 render small.toml --device cpu -o - --format exr --aov normal > got",
                "file.exr",
            ),
            (
                "mkfifo p.exr; cat p.exr > got & $0 render small.toml --device cpu -o p.exr --aov normal; wait",
                "file.exr",
            ),
        ] {
            place.write("got", "");
            quiet(&place, line);
            assert_eq!(place.read("got"), place.read(file), "{line}");
        }
        assert!(fs::metadata(place.path("p.exr")).unwrap().file_type().is_fifo());
        for path in ["-", "/dev/stdout", "/dev/fd/1"] {
            place.write("got", "first\n");
            quiet(
                &place,
                &format!("$0 render small.toml --device cpu -o q.png --stats {path} >> got"),
            );
            let got = String::from_utf8(place.read("got")).unwrap();
            let figures = got.strip_prefix("first\n").unwrap_or_else(|| panic!("{path}: {got}"));
            serde_json::from_str::<serde_json::Value>(figures).unwrap();
        }
        refused(
            &place,
            &["small.toml", "-o", "-", "--aov", "normal"],
            2,
            "--aov normal: needs a file beside standard output, which is a stream; use -o NAME.png",
        );
    }

    #[test]
    fn an_input_on_standard_output_is_kept() {
        let place = TestFolder::new();
        textured(&place);
        let before = place.read("tiles.png");
        let ran = bash(&place, "$0 render tiles.toml --device cpu -o - >> tiles.png");
        assert_eq!(ran.code, 2, "{}", ran.stderr);
        assert!(
            ran.stderr
                .contains("--output: standard output is the same file as ./tiles.png"),
            "{}",
            ran.stderr
        );
        assert_eq!(place.read("tiles.png"), before);
    }

    #[test]
    fn a_file_size_limit_is_reported_like_a_full_disk() {
        let place = TestFolder::new();
        let ran = bash(
            &place,
            "ulimit -f 1; $0 render small.toml --device cpu --size 200x200 --spp 1 -o big.exr",
        );
        assert_eq!(ran.code, 8, "{}", ran.stderr);
        assert!(
            ran.stderr.starts_with("error: big.exr: cannot be written: "),
            "{}",
            ran.stderr
        );
        assert_eq!(place.files(), Vec::<String>::new());
    }

    #[test]
    fn devices_are_written_through() {
        let place = TestFolder::new();
        quiet(
            &place,
            "$0 render small.toml --device cpu -o /dev/null --stats /dev/null",
        );
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        for (line, message) in [
            (
                "$0 render small.toml --device cpu -o /dev/full",
                "error: /dev/full: cannot be written: No space left",
            ),
            (
                "$0 render small.toml --device cpu -o - > /dev/full",
                "error: standard output: cannot be written: No space left",
            ),
            (
                "$0 render small.toml --device cpu --stats - > /dev/full",
                "error: standard output: cannot be written: No space",
            ),
            (
                "{ while [ ! -e gone ]; do sleep 0.05; done; $0 render small.toml --device cpu -o -; echo $? > code; } \
                 | { exec <&-; touch gone; }; exit $(cat code)",
                "error: standard output: cannot be written: Broken pipe",
            ),
        ] {
            let ran = bash(&place, line);
            assert_eq!(ran.code, 8, "{line}: {}", ran.stderr);
            assert!(ran.stderr.starts_with(message), "{line}: {}", ran.stderr);
        }
    }

    #[test]
    fn a_missing_folder_for_temporary_files_is_reported() {
        let place = TestFolder::new();
        let ran = place.run_with(
            &["render", "small.toml", "-o", "-", "--device", "cpu"],
            &[("TMPDIR", "/nonexistent")],
        );
        assert_eq!((ran.code, ran.stdout.as_str()), (8, ""));
        assert!(
            ran.stderr
                .contains("standard output: cannot be written: cannot create a temporary file in /nonexistent"),
            "{}",
            ran.stderr
        );
        refused(
            &place,
            &["small.toml", "-o", "out.png/"],
            8,
            "out.png/: cannot be written: it is a folder",
        );
    }

    #[test]
    fn a_link_stays_and_its_target_is_replaced() {
        let place = TestFolder::new();
        fs::create_dir(place.path("inner")).unwrap();
        place.write("inner/there.png", "old");
        std::os::unix::fs::symlink("inner/there.png", place.path("there.png")).unwrap();
        std::os::unix::fs::symlink("inner/new.png", place.path("new.png")).unwrap();
        std::os::unix::fs::symlink("new.png", place.path("twice.png")).unwrap();
        std::os::unix::fs::symlink("ring.png", place.path("ring.png")).unwrap();
        place.quietly(&["render", "small.toml", "-o", "there.png", "--device", "cpu"]);
        place.quietly(&["render", "small.toml", "-o", "twice.png", "--device", "cpu"]);
        for name in ["there.png", "new.png", "twice.png"] {
            assert!(fs::symlink_metadata(place.path(name)).unwrap().is_symlink());
            assert!(place.read(name).starts_with(b"\x89PNG"), "{name}");
        }
        assert_eq!(fs::read_dir(place.path("inner")).unwrap().count(), 2);
        refused(
            &place,
            &["small.toml", "-o", "ring.png"],
            8,
            "ring.png: cannot be written: ",
        );
    }

    /// The mode bits decide, because root can write to any file.
    #[test]
    fn a_read_only_file_is_not_replaced_and_other_files_keep_their_mode() {
        let place = TestFolder::new();
        for (name, mode) in [("fixed.png", 0o444), ("open.png", 0o640)] {
            place.write(name, "old");
            fs::set_permissions(place.path(name), fs::Permissions::from_mode(mode)).unwrap();
        }
        refused(
            &place,
            &["small.toml", "-o", "fixed.png"],
            8,
            "fixed.png: cannot be written: it is read-only",
        );
        refused(
            &place,
            &["small.toml", "--format", "exr", "-o", "q", "--stats", "nowhere/s"],
            8,
            "nowhere/s: cannot be written: the folder nowhere does not exist",
        );
        place.quietly(&["render", "small.toml", "-o", "open.png", "--device", "cpu"]);
        let mode = fs::metadata(place.path("open.png")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
    }

    /// Opening a pipe without a reader blocks.
    #[test]
    fn waiting_for_a_reader_can_be_interrupted() {
        crate::cli::heed_interrupts();
        let place = TestFolder::new();
        let made = Command::new("mkfifo").arg(place.path("p.png")).status().unwrap();
        assert!(made.success());
        let mut child = Command::new(program())
            .current_dir(place.path("."))
            .args(["render", "small.toml", "-o", "p.png", "--device", "cpu"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(300));
        assert!(
            child.try_wait().unwrap().is_none(),
            "the render does not wait for a reader"
        );
        let killed = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .unwrap();
        assert!(killed.success());
        assert!(!child.wait().unwrap().success());
        assert_eq!(place.files(), ["p.png"]);
    }
}
