//! What a render writes: pictures, layers and figures.

use wgray::cpu::Cpu;
use wgray::image::{difference, encode, read_exr};
use wgray::job::{self, Cut};

use super::{Place, SCENE, read_png};
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
        counts.contains(&16) && counts.iter().any(|count| *count > 16),
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
    let rays = counts.iter().map(|count| u64::from(*count)).sum::<u64>();
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

/// Whatever the driver: where it ends loops early and a sample is too long for it, the CPU takes over and a line says so.
#[test]
fn a_sample_too_long_for_the_driver_is_rendered_all_the_same() {
    if crate::adapter::device().is_none() {
        return;
    }
    let place = Place::new();
    let long = [
        "render",
        "small.toml",
        "--size",
        "2x1",
        "--spp",
        "1",
        "--light-samples",
        "65536",
    ];
    let render = |device: &str, out: &str| {
        let more = [
            "--device",
            device,
            "-o",
            out,
            "--aov",
            "depth",
            "--stats",
            "s.json",
            "--progress",
            "none",
        ];
        place.run(&[&long[..], &more[..]].concat())
    };
    let ran = render("gpu", "gpu.exr");
    assert_eq!((ran.code, ran.stdout.as_str()), (0, ""), "{}", ran.stderr);
    let stats: serde_json::Value = serde_json::from_slice(&place.read("s.json")).expect("JSON");
    if stats["device"] == "cpu" {
        let line = ran.stderr.trim_end();
        assert!(line.starts_with("warning: rendering on the CPU: "), "{line}");
        assert!(line.contains("ends long loops early") && !line.contains('\n'), "{line}");
    } else {
        assert_eq!(ran.stderr, "");
    }
    assert_eq!(render("cpu", "cpu.exr").code, 0);
    if crate::adapter::device().is_some_and(crate::adapter::bit_exact) {
        assert!(place.read("gpu.exr") == place.read("cpu.exr"));
    }
}
