//! Output destinations: input files are protected, no file is written twice, and pipes and devices are written to
//! directly.

use std::fs;

use super::{RunResult, SCENE, TestFolder};

fn write_textured_scene(folder: &TestFolder) {
    let texture = |name: &str, file: &str, encoding: &str| {
        image::RgbImage::new(2, 2).save(folder.path(file)).unwrap();
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
    folder.write("tiles.toml", &scene);
}

/// Writes a scene with a mesh whose .mtl file defines three materials. The mesh uses the first two, of which the second
/// is textured.
fn write_scene_with_materials(folder: &TestFolder) {
    for name in ["wood.png", "spare.png"] {
        image::RgbImage::new(2, 2).save(folder.path(name)).unwrap();
    }
    folder.write(
        "box.mtl",
        "newmtl a\nKd 1 0 0\nnewmtl b\nmap_Kd wood.png\nnewmtl c\nmap_Kd spare.png\n",
    );
    let mesh = "v 0 -2 0\nv 1 -2 0\nv 0 -2 2\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1/1 3/1 2/1\n";
    folder.write("box.obj", &format!("mtllib box.mtl\n{mesh}"));
    let shape = "[[shapes]]\ntype = 'mesh'\nfile = 'box.obj'\n";
    folder.write("box.toml", &format!("{SCENE}{shape}"));
}

#[test]
fn files_that_a_mesh_refers_to_are_not_replaced() {
    let folder = TestFolder::new();
    write_scene_with_materials(&folder);
    let rule = "is an input of the scene; choose another name";
    for name in ["wood.png", "spare.png"] {
        assert_rejected(
            &folder,
            &["box.toml", "-o", name],
            2,
            &format!("--output: {name} {rule}"),
        );
    }
    for name in ["box.mtl", "box.obj"] {
        let message = format!("--output: {name} {rule}");
        assert_rejected(&folder, &["box.toml", "-o", name, "--format", "png"], 2, &message);
    }
    let message = format!("--stats: box.mtl {rule}");
    assert_rejected(&folder, &["box.toml", "--stats", "box.mtl"], 2, &message);
    folder.run_quietly(&["render", "box.toml", "-o", "other.png", "--device", "cpu"]);
    let result = folder.run(&["dev", "box.toml", "--no-page", "--out", "wood.png"]);
    assert_eq!(result.code, 2, "{}", result.stderr);
    assert!(
        result.stderr.contains("--out: wood.png is an input of the scene"),
        "{}",
        result.stderr
    );
}

#[test]
fn a_mesh_has_the_materials_of_its_file() {
    let folder = TestFolder::new();
    write_scene_with_materials(&folder);
    let picture = |scene: &str| {
        folder.run_quietly(&["render", scene, "-o", "a.exr", "--device", "cpu"]);
        folder.read("a.exr")
    };
    let from_mtl = picture("box.toml");
    let material = "[materials.red]\ntype = 'phong'\ncolor = [1, 0, 0]\nspecular = [0, 0, 0]\n";
    let texture = "[textures.wood]\ntype = 'image'\nfile = 'wood.png'\n[materials.wood]\ntype = 'phong'\n\
                   color = { texture = 'wood' }\nspecular = [0, 0, 0]\n";
    let scene = String::from_utf8(folder.read("box.toml")).unwrap();
    let text = format!("{scene}materials = {{ a = 'red', b = 'wood' }}\n{material}{texture}");
    folder.write("explicit.toml", &text);
    assert!(picture("explicit.toml") == from_mtl);
    folder.write("other.toml", &text.replace("[1, 0, 0]", "[0, 1, 0]"));
    assert!(picture("other.toml") != from_mtl);
}

/// Checks that the render is rejected and changes no file.
#[track_caller]
pub fn assert_rejected(folder: &TestFolder, arguments: &[&str], code: i32, message: &str) {
    let content = |folder: &TestFolder| -> Vec<(String, Vec<u8>)> {
        let files = folder.files().into_iter().filter(|name| folder.path(name).is_file());
        files.map(|name| (name.clone(), folder.read(&name))).collect()
    };
    let before = content(folder);
    let result = folder.run(&[&["render", "--device", "cpu"], arguments].concat());
    assert_eq!(
        (result.code, result.stdout.as_str()),
        (code, ""),
        "{arguments:?}: {}",
        result.stderr
    );
    assert!(result.stderr.contains(message), "{arguments:?}: {}", result.stderr);
    assert_eq!(result.stderr.lines().count(), 1, "{}", result.stderr);
    assert!(before == content(folder), "{arguments:?} changed a file");
}

#[test]
fn no_input_is_replaced() {
    let folder = TestFolder::new();
    write_textured_scene(&folder);
    let input_rule = "is an input of the scene; choose another name";
    let not_by_wgray = "exists and was not written by wgray; name the output with -o";
    assert_rejected(&folder, &["tiles.toml"], 2, &format!("tiles.png {not_by_wgray}"));
    assert_rejected(
        &folder,
        &["tiles.toml", "-o", "tiles.png"],
        2,
        &format!("--output: tiles.png {input_rule}"),
    );
    assert_rejected(
        &folder,
        &["tiles.toml", "-o", "spare.png"],
        2,
        &format!("--output: spare.png {input_rule}"),
    );
    let aov = format!("--aov normal: wall.normal.png {input_rule}");
    assert_rejected(
        &folder,
        &["tiles.toml", "-o", "wall.png", "--aov", "depth,normal"],
        2,
        &aov,
    );
    fs::copy(folder.path("small.toml"), folder.path("scene.png")).unwrap();
    assert_rejected(&folder, &["scene.png"], 2, &format!("scene.png {not_by_wgray}"));
    // An EXR contains its layers, so no separate layer file can collide.
    folder.run_quietly(&[
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
    let folder = TestFolder::new();
    write_textured_scene(&folder);
    let path = |name: &str| folder.path(name);
    std::os::unix::fs::symlink("tiles.png", path("soft.png")).unwrap();
    std::os::unix::fs::symlink(".", path("folder")).unwrap();
    std::os::unix::fs::symlink("small.toml", path("scene.json")).unwrap();
    fs::hard_link(path("tiles.png"), path("hard.png")).unwrap();
    for output in ["soft.png", "hard.png", "folder/tiles.png"] {
        let message = format!("--output: {output} is the same file as ./tiles.png, an input of the scene");
        assert_rejected(&folder, &["tiles.toml", "-o", output], 2, &message);
    }
    assert_rejected(
        &folder,
        &["small.toml", "--stats", "scene.json"],
        2,
        "--stats: scene.json: must not end in .toml",
    );
}

#[test]
fn no_output_is_written_twice() {
    let folder = TestFolder::new();
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
            "--stats: other.toml: must not end in .toml or link to such a file: .toml files are scenes",
        ),
        (
            &["-o", "other.toml", "--format", "exr"],
            "--output: other.toml: must not end in .toml",
        ),
    ] {
        assert_rejected(&folder, &[&["small.toml"], arguments].concat(), 2, message);
    }
}

#[test]
fn the_output_of_the_development_mode_replaces_no_input() {
    let folder = TestFolder::new();
    write_textured_scene(&folder);
    std::fs::create_dir(folder.path("folder.png")).unwrap();
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
        let result = folder.run(&["dev", "tiles.toml", "--no-page", "--out", out]);
        assert_eq!(result.code, code, "{}", result.stderr);
        assert!(result.stderr.contains(message), "{}", result.stderr);
    }
}

#[test]
fn the_name_or_the_option_selects_the_format() {
    let folder = TestFolder::new();
    assert_rejected(
        &folder,
        &["small.toml", "-o", "q.png", "--format", "exr"],
        2,
        "--format: contradicts --output",
    );
    assert_rejected(
        &folder,
        &["small.toml", "-o", "q.gif"],
        2,
        "q.gif: must end in .png, .exr, .jpg, .jpeg or .webp; or set --format",
    );
    folder.run_quietly(&["render", "small.toml", "-o", "q", "--format", "exr", "--device", "cpu"]);
    folder.run_quietly(&[
        "render",
        "small.toml",
        "-o",
        "q.exr",
        "--format",
        "exr",
        "--device",
        "cpu",
    ]);
    assert_eq!(folder.read("q"), folder.read("q.exr"));
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt};
    use std::process::{Command, Stdio};

    use super::super::program;
    use super::*;

    fn bash(folder: &TestFolder, line: &str) -> RunResult {
        folder.shell("bash", line)
    }

    #[track_caller]
    fn run_line_quietly(folder: &TestFolder, line: &str) {
        let result = bash(folder, line);
        assert_eq!(
            (result.code, result.stdout.as_str(), result.stderr.as_str()),
            (0, "", ""),
            "{line}"
        );
    }

    /// Standard output receives the bytes that a file would contain.
    #[test]
    fn standard_output_receives_an_image_or_statistics() {
        let folder = TestFolder::new();
        folder.run_quietly(&["render", "small.toml", "-o", "file.png", "--device", "cpu"]);
        folder.run_quietly(&[
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
            folder.write("got", "");
            run_line_quietly(&folder, line);
            assert_eq!(folder.read("got"), folder.read(file), "{line}");
        }
        assert!(fs::metadata(folder.path("p.exr")).unwrap().file_type().is_fifo());
        for path in ["-", "/dev/stdout", "/dev/fd/1"] {
            folder.write("got", "first\n");
            run_line_quietly(
                &folder,
                &format!("$0 render small.toml --device cpu -o q.png --stats {path} >> got"),
            );
            let output = String::from_utf8(folder.read("got")).unwrap();
            let stats = output
                .strip_prefix("first\n")
                .unwrap_or_else(|| panic!("{path}: {output}"));
            serde_json::from_str::<serde_json::Value>(stats).unwrap();
        }
        assert_rejected(
            &folder,
            &["small.toml", "-o", "-", "--aov", "normal"],
            2,
            "--aov normal: needs a file beside standard output, which is a stream; use -o NAME.png",
        );
    }

    #[test]
    fn an_input_on_standard_output_is_kept() {
        let folder = TestFolder::new();
        write_textured_scene(&folder);
        let before = folder.read("tiles.png");
        let result = bash(&folder, "$0 render tiles.toml --device cpu -o - >> tiles.png");
        assert_eq!(result.code, 2, "{}", result.stderr);
        assert!(
            result
                .stderr
                .contains("--output: standard output is the same file as ./tiles.png"),
            "{}",
            result.stderr
        );
        assert_eq!(folder.read("tiles.png"), before);
    }

    #[test]
    fn a_file_size_limit_is_reported_like_a_full_disk() {
        let folder = TestFolder::new();
        let result = bash(
            &folder,
            "ulimit -f 1; $0 render small.toml --device cpu --size 200x200 --spp 1 -o big.exr",
        );
        assert_eq!(result.code, 8, "{}", result.stderr);
        assert!(
            result.stderr.starts_with("error: big.exr: cannot be written: "),
            "{}",
            result.stderr
        );
        assert_eq!(folder.files(), Vec::<String>::new());
    }

    #[test]
    fn devices_are_written_directly() {
        let folder = TestFolder::new();
        run_line_quietly(
            &folder,
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
            let result = bash(&folder, line);
            assert_eq!(result.code, 8, "{line}: {}", result.stderr);
            assert!(result.stderr.starts_with(message), "{line}: {}", result.stderr);
        }
    }

    #[test]
    fn a_missing_folder_for_temporary_files_is_reported() {
        let folder = TestFolder::new();
        let result = folder.run_with(
            &["render", "small.toml", "-o", "-", "--device", "cpu"],
            &[("TMPDIR", "/nonexistent")],
        );
        assert_eq!((result.code, result.stdout.as_str()), (8, ""));
        assert!(
            result
                .stderr
                .contains("standard output: cannot be written: cannot create a temporary file in /nonexistent"),
            "{}",
            result.stderr
        );
        assert_rejected(
            &folder,
            &["small.toml", "-o", "out.png/"],
            8,
            "out.png/: cannot be written: it is a folder",
        );
    }

    #[test]
    fn a_link_stays_and_its_target_is_replaced() {
        let folder = TestFolder::new();
        fs::create_dir(folder.path("inner")).unwrap();
        folder.write("inner/old.png", "old");
        std::os::unix::fs::symlink("inner/old.png", folder.path("old.png")).unwrap();
        std::os::unix::fs::symlink("inner/new.png", folder.path("new.png")).unwrap();
        std::os::unix::fs::symlink("new.png", folder.path("twice.png")).unwrap();
        std::os::unix::fs::symlink("ring.png", folder.path("ring.png")).unwrap();
        folder.run_quietly(&["render", "small.toml", "-o", "old.png", "--device", "cpu"]);
        folder.run_quietly(&["render", "small.toml", "-o", "twice.png", "--device", "cpu"]);
        for name in ["old.png", "new.png", "twice.png"] {
            assert!(fs::symlink_metadata(folder.path(name)).unwrap().is_symlink());
            assert!(folder.read(name).starts_with(b"\x89PNG"), "{name}");
        }
        assert_eq!(fs::read_dir(folder.path("inner")).unwrap().count(), 2);
        assert_rejected(
            &folder,
            &["small.toml", "-o", "ring.png"],
            8,
            "ring.png: cannot be written: ",
        );
    }

    /// The program checks the mode bits, because root can write to any file.
    #[test]
    fn a_read_only_file_is_not_replaced_and_other_files_keep_their_mode() {
        let folder = TestFolder::new();
        for (name, mode) in [("fixed.png", 0o444), ("open.png", 0o640)] {
            folder.write(name, "old");
            fs::set_permissions(folder.path(name), fs::Permissions::from_mode(mode)).unwrap();
        }
        assert_rejected(
            &folder,
            &["small.toml", "-o", "fixed.png"],
            8,
            "fixed.png: cannot be written: it is read-only",
        );
        assert_rejected(
            &folder,
            &["small.toml", "--format", "exr", "-o", "q", "--stats", "nowhere/s"],
            8,
            "nowhere/s: cannot be written: the folder nowhere does not exist",
        );
        folder.run_quietly(&["render", "small.toml", "-o", "open.png", "--device", "cpu"]);
        let mode = fs::metadata(folder.path("open.png")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
    }

    /// Opening a pipe without a reader blocks.
    #[test]
    fn waiting_for_a_reader_can_be_interrupted() {
        crate::cli::restore_signal_defaults();
        let folder = TestFolder::new();
        let created = Command::new("mkfifo").arg(folder.path("p.png")).status().unwrap();
        assert!(created.success());
        let mut child = Command::new(program())
            .current_dir(folder.path("."))
            .args(["render", "small.toml", "-o", "p.png", "--device", "cpu"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(300));
        assert!(
            child.try_wait().unwrap().is_none(),
            "the render does not wait for a reader"
        );
        let status = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status()
            .unwrap();
        assert!(status.success());
        assert!(!child.wait().unwrap().success());
        assert_eq!(folder.files(), ["p.png"]);
    }
}
