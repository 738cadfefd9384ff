//! What each option does.

use wgray::cpu::Cpu;
use wgray::image::{difference, encode, read_exr};
use wgray::job::{self, Cut};

use super::{NO_DRIVER, Place, SCENE, project_scene, read_png};
use crate::patterns;
use crate::pictures::{film, reference, whole};
use crate::scenes::{packed, parse};

#[test]
fn the_picture_has_the_scenes_name_and_is_in_the_current_folder() {
    let place = Place::new();
    std::fs::create_dir(place.path("scenes")).unwrap();
    place.write("scenes/my.scene.toml", SCENE);
    place.quietly(&["render", "scenes/my.scene.toml"]);
    assert_eq!(place.files(), ["my.scene.png", "scenes"]);
}

#[test]
fn a_png_holds_the_means_as_a_screen_shows_them() {
    let place = Place::new();
    place.quietly(&["render", "small.toml"]);
    let expected: Vec<u8> = reference(&parse(SCENE))
        .means()
        .flat_map(|color| color.map(encode))
        .collect();
    assert!(expected.contains(&255), "the background's blue is clamped");
    assert_eq!(read_png(&place.path("small.png")), (10, 6, expected));
}

#[test]
fn an_exr_holds_the_means_themselves() {
    let place = Place::new();
    for device in ["gpu", "cpu"] {
        place.quietly(&["render", "small.toml", "-o", "out.EXR", "--device", device]);
        let found = read_exr(&place.path("out.EXR")).unwrap();
        assert_eq!((found.width, found.height), (10, 6));
        let expected: Vec<[f32; 3]> = reference(&parse(SCENE)).means().collect();
        assert_eq!(found.colors, expected, "{device}");
        let mut other = found.clone();
        other.colors[7][1] = other.colors[7][1].next_up();
        assert_eq!(difference(&found, &other, 0.0).unwrap().unequal, 1);
    }
}

/// A render with options is the render of a scene that says the same.
#[test]
fn options_stand_in_for_the_scenes_values() {
    let place = Place::new();
    let cases: [(&[&str], &str, &str); 5] = [
        (&["--size", "13x4"], "width = 10, height = 6", "width = 13, height = 4"),
        (&["--spp", "2"], "count = 3", "count = 2"),
        (&["--pixel-samples", "2"], "count = 3", "count = 2"),
        (&["--light-samples", "9"], "count = 4", "count = 9"),
        (&["--seed", "4294967295"], "[render]", "[render]\nseed = 4294967295"),
    ];
    place.quietly(&["render", "small.toml", "-o", "plain.exr"]);
    for (options, from, to) in cases {
        place.write("other.toml", &SCENE.replace(from, to));
        place.quietly(&["render", "other.toml", "--output", "other.exr"]);
        place.quietly(&[&["render", "small.toml", "-o", "option.exr"], options].concat());
        assert_eq!(place.read("option.exr"), place.read("other.exr"), "{options:?}");
        assert_ne!(
            place.read("option.exr"),
            place.read("plain.exr"),
            "{options:?} changes something"
        );
    }
}

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let place = Place::new();
    place.quietly(&["render", "small.toml", "-o", "whole.exr"]);
    place.quietly(&["render", "small.toml", "-o", "whole.png"]);
    place.quietly(&["render", "small.toml", "-o", "part.exr", "--crop", "2,1,9,5"]);
    place.quietly(&["render", "small.toml", "-o", "part.png", "--crop", "2,1,9,5"]);
    let (whole, part) = (
        read_exr(&place.path("whole.exr")).unwrap(),
        read_exr(&place.path("part.exr")).unwrap(),
    );
    let cut: Vec<[f32; 3]> = whole
        .colors
        .chunks(10)
        .skip(1)
        .take(4)
        .flat_map(|row| row[2..9].to_vec())
        .collect();
    assert_eq!((part.width, part.height, part.colors), (7, 4, cut));
    let (_, _, whole) = read_png(&place.path("whole.png"));
    let cut: Vec<u8> = whole
        .chunks(30)
        .skip(1)
        .take(4)
        .flat_map(|row| row[6..27].to_vec())
        .collect();
    assert_eq!(read_png(&place.path("part.png")), (7, 4, cut));
}

#[test]
fn an_exr_says_where_in_the_picture_its_pixels_are() {
    let place = Place::new();
    place.quietly(&["render", "small.toml", "-o", "part.exr", "--crop", "2,1,9,5"]);
    let meta = exr::meta::MetaData::read_from_file(place.path("part.exr"), true).unwrap();
    let header = &meta.headers[0];
    let display = header.shared_attributes.display_window;
    assert_eq!(
        (display.position.0, display.position.1, display.size.0, display.size.1),
        (0, 0, 10, 6)
    );
    let data = header.data_window();
    assert_eq!(
        (data.position.0, data.position.1, data.size.0, data.size.1),
        (2, 1, 7, 4)
    );
}

#[test]
fn devices_are_chosen_by_kind_and_by_part_of_a_name() {
    let place = Place::new();
    place.quietly(&["render", "small.toml", "-o", "auto.exr"]);
    let listed = place.run(&["devices"]).stdout;
    let mut names = vec!["gpu", "cpu", "auto"];
    if listed.contains("llvmpipe") {
        names.extend(["lavapipe", "LAVApipe", "llvmp", "software"]);
    }
    for name in names {
        place.quietly(&["render", "small.toml", "-o", "named.exr", "--device", name]);
        assert_eq!(place.read("named.exr"), place.read("auto.exr"), "{name}");
    }
}

/// Software Vulkan's own quotients and square roots are rounded correctly, so that nothing changes.
#[test]
fn rounding_in_software_gives_the_same_picture() {
    let place = Place::new();
    for device in ["auto", "cpu"] {
        let arguments = ["render", "small.toml", "--device", device, "-o"];
        place.quietly(&[&arguments[..], &["own.exr"]].concat());
        place.quietly(&[&arguments[..], &["exact.exr", "--exact-rounding"]].concat());
        assert_eq!(place.read("own.exr"), place.read("exact.exr"), "{device}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_picture() {
    let place = Place::new();
    place.quietly(&["render", "small.toml", "-o", "all.exr"]);
    for (device, threads) in [("auto", "1"), ("cpu", "1"), ("cpu", "3")] {
        place.quietly(&[
            "render",
            "small.toml",
            "-o",
            "some.exr",
            "--device",
            device,
            "--threads",
            threads,
        ]);
        assert_eq!(place.read("some.exr"), place.read("all.exr"), "{device} {threads}");
    }
    let stats = ["--stats", "stats.json", "--device", "cpu", "--threads", "3"];
    place.quietly(&[&["render", "small.toml"], &stats[..]].concat());
    let stats: serde_json::Value = serde_json::from_slice(&place.read("stats.json")).unwrap();
    assert!(stats["driver"].as_str().unwrap().ends_with("3 threads"), "{stats}");
}

#[test]
fn aovs_are_layers_of_an_exr() {
    let place = Place::new();
    place.quietly(&[
        "render",
        "small.toml",
        "-o",
        "out.exr",
        "--aov",
        "uv,normal,depth,primitive,uv",
    ]);
    let scene = parse(SCENE);
    let mut backend = Cpu::new(&scene);
    let hits = job::first_hits(&mut backend, whole(&scene)).unwrap();
    let means: Vec<[f32; 3]> = film(&mut backend, &scene, whole(&scene), &Cut::default())
        .means()
        .collect();
    let image = exr::prelude::read_first_flat_layer_from_file(place.path("out.exr")).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    let expected = [
        "B",
        "G",
        "R",
        "depth.Z",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "primitive.ID",
        "uv.U",
        "uv.V",
    ]
    .as_slice();
    assert_eq!(names, expected);
    for channel in channels {
        let found: Vec<u32> = match &channel.sample_data {
            exr::prelude::FlatSamples::F32(values) => values.iter().map(|value| value.to_bits()).collect(),
            exr::prelude::FlatSamples::U32(values) => values.clone(),
            exr::prelude::FlatSamples::F16(_) => panic!("half precision"),
        };
        let name = channel.name.to_string();
        let expected: Vec<u32> = (hits.iter().zip(&means))
            .map(|(hit, mean)| match name.as_str() {
                "R" => mean[0].to_bits(),
                "G" => mean[1].to_bits(),
                "B" => mean[2].to_bits(),
                "depth.Z" => hit.depth.to_bits(),
                "normal.X" => hit.normal.x.to_bits(),
                "normal.Y" => hit.normal.y.to_bits(),
                "normal.Z" => hit.normal.z.to_bits(),
                "primitive.ID" => hit.shape,
                "uv.U" => hit.uv.x.to_bits(),
                _ => hit.uv.y.to_bits(),
            })
            .collect();
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn adaptive_sampling_and_its_layers_are_those_of_the_library() {
    let place = Place::new();
    let options = ["--pixel-pattern", "sobol", "--spp", "8", "--adaptive", "0.02"];
    let files = [
        "-o",
        "out.exr",
        "--aov",
        "variance,sample_count",
        "--stats",
        "stats.json",
    ];
    place.quietly(&[&["render", "small.toml"], &options[..], &files[..]].concat());
    let mut description = wgray::scene::Description::parse(SCENE, "test").unwrap();
    let render = &mut description.render;
    render.pixel_samples = patterns::samples(wgray::scene::Pattern::Sobol, 8);
    render.adaptive = Some(wgray::scene::AdaptiveDescription {
        error: 0.02,
        max_samples: None,
    });
    let scene = packed(&description);
    let film = film(&mut Cpu::new(&scene), &scene, whole(&scene), &Cut::default());
    let counts: Vec<u32> = film.sample_counts().collect();
    assert!(
        counts.contains(&8) && counts.iter().any(|count| *count > 8),
        "{counts:?}"
    );
    let image = exr::prelude::read_first_flat_layer_from_file(place.path("out.exr")).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    let expected = [
        "B",
        "G",
        "R",
        "sample_count.N",
        "variance.B",
        "variance.G",
        "variance.R",
    ];
    assert_eq!(names, expected);
    for channel in channels {
        match (&channel.sample_data, channel.name.to_string().as_str()) {
            (exr::prelude::FlatSamples::U32(found), _) => assert_eq!(*found, counts),
            (exr::prelude::FlatSamples::F32(found), "variance.G") => {
                assert!(found.iter().enumerate().all(|(i, found)| *found == film.variance(i)[1]));
            }
            _ => {}
        }
    }
    let stats: serde_json::Value = serde_json::from_slice(&place.read("stats.json")).unwrap();
    let rays = counts.iter().map(|count| u64::from(count + 4)).sum::<u64>();
    assert_eq!(stats["camera_rays"].as_u64(), Some(rays));
    // Beside a PNG: the most samples are white, and the least are not.
    place.quietly(
        &[
            &["render", "small.toml"],
            &options[..],
            &["-o", "out.png", "--aov", "sample_count"],
        ]
        .concat(),
    );
    let (_, _, bytes) = read_png(&place.path("out.sample_count.png"));
    for (pixel, count) in bytes.chunks(3).zip(&counts) {
        let grey = (255.0 * f64::from(*count).ln() / 128f64.ln()).round() as i32;
        assert!(
            pixel.iter().all(|value| (i32::from(*value) - grey).abs() <= 1),
            "{pixel:?} for {count}"
        );
    }
}

#[test]
fn aovs_are_files_beside_a_png() {
    let place = Place::new();
    place.quietly(&[
        "render",
        "small.toml",
        "-o",
        "a.b.png",
        "--aov",
        "normal,depth",
        "--aov",
        "uv,primitive",
    ]);
    let names = [
        "a.b.depth.png",
        "a.b.normal.png",
        "a.b.png",
        "a.b.primitive.png",
        "a.b.uv.png",
    ];
    assert_eq!(place.files(), names);
    let pixel = |name: &str, x: usize, y: usize| {
        let (width, height, bytes) = read_png(&place.path(name));
        assert_eq!((width, height), (10, 6));
        let at = 3 * (10 * y + x);
        [bytes[at], bytes[at + 1], bytes[at + 2]]
    };
    // the sphere in the middle, the ground below, the sky above
    let [facing, ground, sky] = [(5, 3), (0, 5), (0, 0)].map(|(x, y)| pixel("a.b.normal.png", x, y));
    assert!(facing[1] < 20 && facing[0] > 128, "{facing:?}");
    assert_eq!((ground, sky), ([128, 128, 255], [0, 0, 0]));
    let [near, far, nothing] = [(5, 3), (0, 4), (0, 0)].map(|(x, y)| pixel("a.b.depth.png", x, y));
    assert_eq!(
        (near, nothing),
        ([128; 3], [0; 3]),
        "the middle of the picture is half bright"
    );
    assert!(far[0] < near[0] && far[0] > 0, "{far:?}");
    assert_ne!(
        pixel("a.b.primitive.png", 5, 3),
        pixel("a.b.primitive.png", 0, 5),
        "two shapes, two colours"
    );
    assert_eq!(
        pixel("a.b.primitive.png", 0, 5),
        pixel("a.b.primitive.png", 9, 5),
        "one shape, one colour"
    );
    assert_ne!(pixel("a.b.uv.png", 0, 5), pixel("a.b.uv.png", 9, 5));
}

#[test]
fn stats_have_the_promised_fields() {
    let place = Place::new();
    let arguments = ["--stats", "stats.json", "--crop", "0,0,5,4", "--light-samples", "9"];
    place.quietly(&[&["render", "small.toml", "-o", "out.png"], &arguments[..]].concat());
    let stats: serde_json::Value = serde_json::from_slice(&place.read("stats.json")).unwrap();
    let fields = stats.as_object().unwrap();
    let mut names: Vec<&str> = fields.keys().map(String::as_str).collect();
    let mut expected = [
        "device",
        "driver",
        "backend",
        "width",
        "height",
        "pixel_samples",
        "light_samples",
        "setup_s",
        "render_s",
        "total_s",
        "camera_rays",
        "shadow_rays",
        "nominal_mrays_per_s",
    ];
    names.sort_unstable();
    expected.sort_unstable();
    assert_eq!(names, expected);
    let number = |name: &str| fields[name].as_f64().unwrap_or_else(|| panic!("{name} is no number"));
    assert_eq!(
        ["width", "height", "pixel_samples", "light_samples"].map(number),
        [5.0, 4.0, 3.0, 9.0]
    );
    assert_eq!(number("camera_rays"), 60.0);
    assert!(fields["shadow_rays"].is_null());
    let (setup, render, total) = (number("setup_s"), number("render_s"), number("total_s"));
    assert!(setup > 0.0 && render > 0.0 && total >= setup + render, "{stats}");
    let nominal = 5.0 * 4.0 * 3.0 * (1.0 + 9.0) / render / 1e6;
    assert!((number("nominal_mrays_per_s") / nominal - 1.0).abs() < 1e-9, "{stats}");
    for name in ["device", "driver", "backend"] {
        assert!(!fields[name].as_str().unwrap().is_empty());
    }
}

#[test]
fn progress_is_told_as_asked() {
    let place = Place::new();
    let plain = place.run(&["render", "small.toml", "--progress", "plain"]);
    assert_eq!((plain.code, plain.stdout.as_str()), (0, ""));
    assert!(plain.stderr.contains("100 % done after"), "{}", plain.stderr);
    place.quietly(&["render", "small.toml", "--progress", "none"]);
    place.quietly(&["render", "small.toml", "--progress", "auto"]); // standard error is no terminal here
    place.quietly(&["render", "small.toml", "--progress", "plain", "-q"]);
    let verbose = place.run(&["render", "small.toml", "-v"]);
    assert_eq!((verbose.code, verbose.stdout.as_str()), (0, ""));
    assert!(verbose.stderr.contains("ready seconds="), "{}", verbose.stderr);
}

#[test]
fn without_a_driver_auto_renders_on_the_cpu_and_says_so_in_a_line() {
    let place = Place::new();
    place.quietly(&["render", "small.toml", "-o", "gpu.exr"]);
    let ran = place.run_with(&["render", "small.toml", "-o", "cpu.exr"], &NO_DRIVER);
    assert_eq!((ran.code, ran.stdout.as_str()), (0, ""));
    assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("on the CPU") && ran.stderr.contains("mesa-vulkan-drivers"),
        "{}",
        ran.stderr
    );
    assert_eq!(place.read("cpu.exr"), place.read("gpu.exr"));
    let quiet = place.run_with(&["render", "small.toml", "-o", "cpu.exr", "--quiet"], &NO_DRIVER);
    assert_eq!((quiet.code, quiet.stderr.as_str()), (0, ""));
    let cpu = place.run_with(
        &["render", "small.toml", "-o", "cpu.exr", "--device", "cpu"],
        &NO_DRIVER,
    );
    assert_eq!((cpu.code, cpu.stderr.as_str()), (0, ""));
}

#[test]
fn devices_are_listed() {
    let place = Place::new();
    let ran = place.run(&["devices"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    for word in ["driver", "largest buffer", "cpu", "auto chooses: "] {
        assert!(ran.stdout.contains(word), "{word} is missing in {}", ran.stdout);
    }
    assert!(!ran.stdout.contains("auto chooses: cpu"));
    let none = place.run_with(&["devices"], &NO_DRIVER);
    assert_eq!(none.code, 0);
    assert!(none.stdout.contains("auto chooses: cpu") && none.stdout.contains("mesa-vulkan-drivers"));
}

#[test]
fn good_scenes_pass_the_check_without_a_device() {
    let place = Place::new();
    let cornell = project_scene("cornell.toml");
    let ran = place.run_with(&["check", "small.toml", &cornell], &NO_DRIVER);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let lines: Vec<&str> = ran.stdout.lines().collect();
    assert_eq!(lines.len(), 2);
    assert!(
        lines[0].starts_with("small.toml: good; 10 x 6 pixels, 3 samples each, 4 of light"),
        "{}",
        lines[0]
    );
    assert!(place.files().is_empty());
}

#[test]
fn help_and_version_are_no_errors() {
    let place = Place::new();
    for arguments in [
        &["--help"][..],
        &["render", "--help"],
        &["check", "--help"],
        &["--version"],
    ] {
        let ran = place.run(arguments);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{arguments:?}");
        assert!(ran.stdout.contains("wgray"), "{arguments:?}");
    }
    let help = place.run(&["render", "--help"]).stdout;
    for option in [
        "--output",
        "--size",
        "--spp",
        "--pixel-samples",
        "--light-samples",
        "--seed",
        "--crop",
        "--device",
        "--threads",
        "--aov",
        "--stats",
        "--progress",
        "--quiet",
        "--verbose",
    ] {
        assert!(help.contains(option), "{option} is not told of");
    }
}

#[test]
fn the_scenes_of_the_documents_are_good() {
    let place = Place::new();
    for document in ["README.md", "docs/scene-format.md"] {
        let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(document)).unwrap();
        let scenes: Vec<&str> = text
            .split("```toml\n")
            .skip(1)
            .filter_map(|rest| rest.split("```").next())
            .collect();
        assert!(
            scenes.iter().any(|scene| scene.contains("[camera]")),
            "{document}: no scene was found"
        );
        for scene in scenes.into_iter().filter(|scene| scene.contains("[camera]")) {
            place.write("scene.toml", scene);
            let ran = place.run(&["check", "scene.toml"]);
            assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{document}");
        }
    }
}
