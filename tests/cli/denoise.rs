//! `--denoise`: files of all formats, parts, checkpoints and the setting of the scene.

use wgray::image::read_exr;

use super::{TestFolder, read_png};
use crate::layers::{SCENE, scene_with};

fn folder() -> TestFolder {
    let folder = TestFolder::with_file("s.toml", SCENE);
    folder.write("on.toml", &scene_with("denoise = true"));
    folder
}

#[test]
fn display_formats_are_denoised_and_an_exr_has_both() {
    let folder = folder();
    let render =
        |arguments: &[&str]| folder.run_quietly(&[&["render", "s.toml", "--reproducible"], arguments].concat());
    render(&["-o", "raw.png", "-o", "raw.exr"]);
    render(&["--denoise", "-o", "a.png", "-o", "a.exr", "-o", "a.jpg", "-o", "a.webp"]);
    assert_eq!(
        read_exr(&folder.path("a.exr")).unwrap(),
        read_exr(&folder.path("raw.exr")).unwrap()
    );
    assert_ne!(read_png(&folder.path("a.png")), read_png(&folder.path("raw.png")));
    let meta = exr::meta::MetaData::read_from_file(folder.path("a.exr"), true).unwrap();
    let names = meta.headers[0]
        .channels
        .list
        .iter()
        .map(|channel| channel.name.to_string());
    let names: Vec<String> = names.collect();
    assert_eq!(names, ["B", "G", "R", "denoised.B", "denoised.G", "denoised.R"]);
    // No separate file of the layer.
    assert_eq!(folder.files_except(|name| name.ends_with(".toml")).len(), 6);
    render(&["--device", "cpu", "--aov", "denoised", "-o", "b.png"]);
    assert_eq!(folder.read("a.png"), folder.read("b.png"));
}

#[test]
fn the_option_overrides_the_scene() {
    let folder = folder();
    for (name, arguments) in [
        ("raw", &["s.toml"][..]),
        ("off", &["on.toml", "--denoise=off"]),
        ("separate", &["on.toml", "--denoise", "off"]),
        ("on", &["on.toml"]),
        ("option", &["s.toml", "--denoise=on"]),
        ("define", &["s.toml", "-D", "render.denoise=true"]),
    ] {
        let output = format!("{name}.png");
        folder.run_quietly(&[&["render"], arguments, &["--device", "cpu", "-o", &output]].concat());
    }
    let pixels = |name: &str| read_png(&folder.path(name));
    assert_eq!(pixels("raw.png"), pixels("off.png"));
    assert_eq!(pixels("raw.png"), pixels("separate.png"));
    for name in ["option.png", "define.png"] {
        assert_eq!(pixels("on.png"), pixels(name), "{name}");
    }
    assert_ne!(pixels("on.png"), pixels("off.png"));
}

#[test]
fn a_model_is_denoised_by_default() {
    let folder = TestFolder::with_file("m.obj", "v -1 0 1\nv 1 0 1\nv 0 1.5 0\nf 1 2 3\n");
    let render = |arguments: &[&str]| {
        let base = [
            "render",
            "m.obj",
            "--size",
            "24x16",
            "--device",
            "cpu",
            "--reproducible",
        ];
        folder.run_quietly(&[&base[..], arguments].concat());
    };
    render(&["-o", "default.png"]);
    render(&["--denoise", "--spp", "32", "-o", "denoised.png"]);
    render(&["--denoise", "off", "-o", "raw.png"]);
    let pixels = |name: &str| read_png(&folder.path(name));
    assert_eq!(pixels("default.png"), pixels("denoised.png"));
    assert_ne!(pixels("default.png"), pixels("raw.png"));
}

#[test]
fn a_model_whose_film_would_need_too_much_memory_is_not_denoised_by_default() {
    let folder = TestFolder::with_file("m.obj", "v -1 0 1\nv 1 0 1\nv 0 1.5 0\nf 1 2 3\n");
    for (size, is_denoised) in [("4096x4096", true), ("4096x4097", false), ("65536x65536", false)] {
        let output = format!("{size}.toml");
        folder.run_quietly(&["convert", "m.obj", "--size", size, "-o", &output]);
        let scene = String::from_utf8(folder.read(&output)).unwrap();
        assert_eq!(scene.contains("denoise = true"), is_denoised, "{scene}");
    }
}

#[test]
fn parts_are_denoised_when_they_are_merged() {
    let folder = folder();
    let arguments = ["render", "s.toml", "--denoise", "--reproducible", "--device", "cpu"];
    let outputs = |stem: &str| [format!("{stem}.png"), format!("{stem}.exr")];
    let [png, exr] = outputs("a");
    folder.run_quietly(&[&arguments[..], &["--aov", "depth,albedo", "-o", &png, "-o", &exr]].concat());
    for tile in ["1/3", "2/3", "3/3"] {
        let part = format!("{}.part", &tile[..1]);
        folder.run_quietly(&[&arguments[..], &["--aov", "depth,albedo", "--tile", tile, "-o", &part]].concat());
    }
    let [merged_png, merged_exr] = outputs("m");
    folder.run_quietly(&[
        "merge",
        "1.part",
        "2.part",
        "3.part",
        "-o",
        &merged_png,
        "-o",
        &merged_exr,
        "--reproducible",
    ]);
    assert_eq!(folder.read(&merged_png), folder.read(&png));
    assert_eq!(folder.read(&merged_exr), folder.read(&exr));
    assert_eq!(folder.read("m.depth.png"), folder.read("a.depth.png"));
}

#[test]
fn a_preview_and_a_resumed_render_are_denoised() {
    let folder = folder();
    let arguments = ["render", "s.toml", "--denoise", "--reproducible", "--device", "cpu"];
    folder.run_quietly(&[&arguments[..], &["-o", "a.png"]].concat());
    folder.run_quietly(&[&arguments[..], &["--preview", "-o", "b.png"]].concat());
    for _ in 0..2 {
        folder.run_quietly(&[&arguments[..], &["--checkpoint", "c", "--resume", "-o", "c.png"]].concat());
    }
    assert_eq!(folder.read("a.png"), folder.read("b.png"));
    assert_eq!(folder.read("a.png"), folder.read("c.png"));
}
