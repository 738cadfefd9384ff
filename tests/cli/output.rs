//! Output files of a render: images, layers and statistics.

use wgray::image::{difference, encode, read_exr};
use wgray_image::Region;
use wgray_render::cpu::Cpu;
use wgray_render::job::{self, WorkSplit};

use super::{SCENE, TestFolder, read_png};
use crate::patterns;
use crate::pictures::{film, reference, whole};
use crate::scenes::{packed, parse};

#[test]
fn the_default_output_has_the_scenes_name() {
    let folder = TestFolder::new();
    std::fs::create_dir(folder.path("scenes")).unwrap();
    folder.write("scenes/my.scene.toml", SCENE);
    folder.run_quietly(&["render", "scenes/my.scene.toml"]);
    assert_eq!(folder.files(), ["my.scene.png", "scenes"]);
}

#[test]
fn a_png_contains_the_display_values_of_the_means() {
    let folder = TestFolder::new();
    folder.run_quietly(&["render", "small.toml"]);
    let expected: Vec<u8> = reference(&parse(SCENE))
        .means()
        .flat_map(|color| color.map(encode))
        .collect();
    assert!(expected.contains(&255), "no value is clamped");
    assert_eq!(read_png(&folder.path("small.png")), (10, 6, expected));
}

#[test]
fn an_exr_contains_the_linear_means() {
    let folder = TestFolder::new();
    for device in ["gpu", "cpu"] {
        folder.run_quietly(&["render", "small.toml", "-o", "out.EXR", "--device", device]);
        let found = read_exr(&folder.path("out.EXR")).unwrap();
        assert_eq!((found.width, found.height), (10, 6));
        let expected: Vec<[f32; 3]> = reference(&parse(SCENE)).means().collect();
        assert_eq!(found.colors, expected, "{device}");
        let mut changed = found.clone();
        changed.colors[7][1] = changed.colors[7][1].next_up();
        assert_eq!(difference(&found, &changed, 0.0).unwrap().unequal, 1);
    }
}

#[test]
fn an_exr_of_a_crop_has_its_data_window() {
    let folder = TestFolder::new();
    folder.run_quietly(&["render", "small.toml", "-o", "part.exr", "--crop", "2,1,9,5"]);
    let meta = exr::meta::MetaData::read_from_file(folder.path("part.exr"), true).unwrap();
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
    let folder = TestFolder::new();
    folder.run_quietly(&[
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
    let means: Vec<[f32; 3]> = film(&mut backend, &scene, whole(&scene), &WorkSplit::default())
        .means()
        .collect();
    let image = exr::prelude::read_first_flat_layer_from_file(folder.path("out.exr")).unwrap();
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
            exr::prelude::FlatSamples::F16(_) => panic!("an unexpected channel of half floats"),
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

/// `--adaptive` provides the error that `render.adaptive` requires.
#[test]
fn the_maximum_of_adaptive_sampling_can_be_defined() {
    let folder = TestFolder::new();
    for define in ["render.adaptive.max_samples=20", "render.adaptive={max_samples=20}"] {
        let options = ["--pixel-pattern", "sobol", "--adaptive", "0", "-D", define];
        let files = ["-o", "out.exr", "--stats", "stats.json"];
        folder.run_quietly(&[&["render", "small.toml"], &options[..], &files[..]].concat());
        let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
        assert_eq!(stats["pixel_samples"], 20, "{define}");
    }
    let without_error = folder.run(&["render", "small.toml", "-D", "render.adaptive.max_samples=20"]);
    assert_eq!(without_error.code, 2, "{}", without_error.stderr);
    assert!(without_error.stderr.contains("error"), "{}", without_error.stderr);
}

#[test]
fn adaptive_sampling_and_its_layers_give_the_values_of_the_library() {
    let folder = TestFolder::new();
    let options = ["--pixel-pattern", "sobol", "--spp", "8", "--adaptive", "0.02"];
    let files = [
        "-o",
        "out.exr",
        "--aov",
        "variance,sample_count",
        "--stats",
        "stats.json",
    ];
    folder.run_quietly(&[&["render", "small.toml"], &options[..], &files[..]].concat());
    let mut description = wgray::scene::Description::parse(SCENE, "test").unwrap();
    let render = &mut description.render;
    render.pixel_samples = patterns::samples(wgray::scene::Pattern::Sobol, 8);
    render.adaptive = Some(wgray::scene::AdaptiveDescription {
        error: 0.02,
        max_samples: None,
    });
    let scene = packed(&description);
    let film = film(&mut Cpu::new(&scene), &scene, whole(&scene), &WorkSplit::default());
    let counts: Vec<u32> = film.sample_counts().collect();
    assert!(
        counts.contains(&16) && counts.iter().any(|count| *count > 16),
        "{counts:?}"
    );
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
    let min_count = counts.iter().min().copied();
    for key in ["min_samples", "least_samples"] {
        assert_eq!(stats[key].as_u64(), min_count.map(u64::from), "{key}");
    }
    let image = exr::prelude::read_first_flat_layer_from_file(folder.path("out.exr")).unwrap();
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
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
    let rays = counts.iter().map(|count| u64::from(*count)).sum::<u64>();
    assert_eq!(stats["camera_rays"].as_u64(), Some(rays));
    // In the PNG, pixels with the maximum number of samples are white.
    folder.run_quietly(
        &[
            &["render", "small.toml"],
            &options[..],
            &["-o", "out.png", "--aov", "sample_count"],
        ]
        .concat(),
    );
    let (_, _, bytes) = read_png(&folder.path("out.sample_count.png"));
    for (pixel, count) in bytes.chunks(3).zip(&counts) {
        let gray = (255.0 * f64::from(*count).ln() / 128f64.ln()).round() as i32;
        assert!(
            pixel.iter().all(|value| (i32::from(*value) - gray).abs() <= 1),
            "{pixel:?} for {count}"
        );
    }
}

/// Returns a scene for the path integrator, with a finite floor.
fn path_scene(settings: &str) -> String {
    SCENE
        .replace("[render]", &format!("[render]\nintegrator = \"path\"\n{settings}"))
        .replace("ambient = [0.1, 0.1, 0.1]\n", "")
        .replace("light_samples = { pattern = \"grid\", count = 4 }\n", "")
        .replace("type = \"plane\"", "type = \"rectangle\"\nsize = [3, 3]")
        .replace("point = [0, 0, 0]", "center = [0, 0, 0]")
        .replace("\"phong\"", "\"diffuse\"\nemission = [0.1, 0.2, 0.7]")
}

#[test]
fn path_layers_equal_the_layers_of_the_film() {
    const NAMES: [&str; 5] = ["emission", "direct", "indirect", "albedo", "shading_normal"];
    let folder = TestFolder::new();
    let inner = Region {
        x0: 1,
        y0: 1,
        x1: 9,
        y1: 6,
    };
    for (alpha, region) in [(false, Region::whole(10, 6)), (true, inner)] {
        let text = path_scene(if alpha { "alpha = true" } else { "" });
        folder.write("path.toml", &text);
        let scene = parse(&text).with_layers();
        let film = film(&mut Cpu::new(&scene), &scene, region, &WorkSplit::default());
        let hits = job::first_hits(&mut Cpu::new(&scene), region).unwrap();
        for device in ["gpu", "cpu"] {
            if device == "gpu" && !crate::adapter::device().is_some_and(crate::adapter::bit_exact) {
                continue;
            }
            let (names, region) = ([&NAMES[..], &["depth"]].concat().join(","), region.to_string());
            let options = ["-o", "out.exr", "--aov", &names, "--crop", &region, "--device", device];
            folder.run_quietly(&[&["render", "path.toml"], &options[..]].concat());
            let image = exr::prelude::read_first_flat_layer_from_file(folder.path("out.exr")).unwrap();
            let channels = &image.layer_data.channel_data.list;
            assert_eq!(channels.len(), if alpha { 20 } else { 19 });
            let mut earlier_channels = Vec::new();
            for channel in channels {
                let exr::prelude::FlatSamples::F32(found) = &channel.sample_data else {
                    panic!("{}: the values are not floats", channel.name);
                };
                let name = channel.name.to_string();
                let (layer, component) = name.split_once('.').unwrap_or(("", &name));
                let channel_index = ["R", "G", "B", "X", "Y", "Z"]
                    .iter()
                    .position(|name| *name == component);
                let layer_index = NAMES.iter().position(|name| *name == layer);
                let expected: Vec<f32> = (0..film.sums.len())
                    .map(|pixel| match (name.as_str(), layer_index, channel_index) {
                        ("A", ..) => film.layers[0][pixel].w / film.sums[pixel].w,
                        ("depth.Z", ..) => hits[pixel].depth,
                        (_, Some(layer_index), Some(channel_index)) => {
                            film.layers[layer_index][pixel][channel_index % 3] / film.sums[pixel].w
                        }
                        (_, None, Some(channel_index)) => film.sums[pixel][channel_index] / film.sums[pixel].w,
                        _ => panic!("{name}: unexpected layer"),
                    })
                    .collect();
                assert_eq!(found.to_vec(), expected, "{name}, {device}");
                assert!(
                    !earlier_channels.contains(&expected),
                    "{name} equals another channel, so the test cannot detect that they are swapped"
                );
                earlier_channels.push(expected);
            }
        }
    }
}

#[test]
fn path_layers_are_rejected_with_the_phong_integrator() {
    let folder = TestFolder::new();
    for name in ["albedo", "direct", "indirect", "emission"] {
        let names = format!("depth,{name}");
        let result = folder.run(&["render", "small.toml", "-o", "out.exr", "--aov", &names]);
        let message = format!("error: --aov {name}: needs integrator = \"path\" (--integrator path)\n");
        assert_eq!((result.code, result.stderr), (2, message));
    }
    assert_eq!(folder.files(), [""; 0]);
    folder.run_quietly(&["render", "small.toml", "-o", "out.exr", "--aov", "shading_normal"]);
}

#[test]
fn path_layers_are_files_beside_a_png() {
    let folder = TestFolder::new();
    let text = path_scene("alpha = true");
    folder.write("path.toml", &text);
    folder.run_quietly(&[
        "render",
        "path.toml",
        "-o",
        "out.png",
        "--aov",
        "albedo,direct,indirect,emission,shading_normal",
        "--device",
        "cpu",
    ]);
    let film = reference(&parse(&text));
    let layers = ["emission", "direct", "indirect", "albedo"];
    for (layer, name) in film.layers.iter().zip(layers) {
        let expected: Vec<u8> = layer
            .iter()
            .zip(&film.sums)
            .flat_map(|(layer_sum, sum)| [0, 1, 2].map(|k| encode(layer_sum[k] / sum.w)))
            .collect();
        assert_eq!(
            read_png(&folder.path(&format!("out.{name}.png"))),
            (10, 6, expected),
            "{name}"
        );
    }
    // Normals are mapped to colors before averaging; samples that hit nothing are black.
    let (_, _, normals) = read_png(&folder.path("out.shading_normal.png"));
    for (i, found) in normals.chunks(3).enumerate() {
        let (normal, alpha) = (film.layers[4][i] / film.sums[i].w, film.alpha(i));
        for (k, found) in found.iter().enumerate() {
            let expected = (normal[k] * 0.5 + alpha * 0.5) * 255.0;
            assert!(
                (f32::from(*found) - expected).abs() <= 0.51,
                "pixel {i}: {found}, not {expected}"
            );
        }
    }
    let picture = image::open(folder.path("out.png")).unwrap();
    let image::DynamicImage::ImageRgba8(picture) = picture else {
        panic!("the PNG has no alpha channel");
    };
    let (mut transparent, mut partial, mut opaque) = (0, 0, 0);
    for (i, (pixel, sum)) in picture.pixels().zip(&film.sums).enumerate() {
        let (mean, alpha) = (sum.truncate() / sum.w, film.alpha(i));
        let color = |value: f32| if alpha == 0.0 { 0 } else { encode(value / alpha) };
        let expected = [mean.x, mean.y, mean.z].map(color);
        assert_eq!(
            (&pixel.0[..3], pixel.0[3]),
            (&expected[..], (alpha * 255.0).round() as u8),
            "pixel {i}"
        );
        match alpha {
            0.0 => transparent += 1,
            1.0 => opaque += 1,
            // Colors must not be premultiplied.
            _ => partial += usize::from(pixel.0[..3] != [mean.x, mean.y, mean.z].map(encode)),
        }
    }
    assert!(
        transparent > 5 && partial > 3 && opaque > 5,
        "{transparent}, {partial}, {opaque}"
    );
}

#[test]
fn aovs_are_files_beside_a_png() {
    let folder = TestFolder::new();
    folder.run_quietly(&[
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
    assert_eq!(folder.files(), names);
    let pixel = |name: &str, x: usize, y: usize| {
        let (width, height, bytes) = read_png(&folder.path(name));
        assert_eq!((width, height), (10, 6));
        let offset = 3 * (10 * y + x);
        [bytes[offset], bytes[offset + 1], bytes[offset + 2]]
    };
    // The sphere is in the middle of the image, the floor below it, and the background above it.
    let [sphere, ground, sky] = [(5, 3), (0, 5), (0, 0)].map(|(x, y)| pixel("a.b.normal.png", x, y));
    assert!(sphere[1] < 20 && sphere[0] > 128, "{sphere:?}");
    assert_eq!((ground, sky), ([128, 128, 255], [0, 0, 0]));
    let [near, far, background] = [(5, 3), (0, 4), (0, 0)].map(|(x, y)| pixel("a.b.depth.png", x, y));
    assert_eq!(
        (near, background),
        ([128; 3], [0; 3]),
        "the sphere is not displayed at half brightness, or the background is not black"
    );
    assert!(far[0] < near[0] && far[0] > 0, "{far:?}");
    assert_ne!(
        pixel("a.b.primitive.png", 5, 3),
        pixel("a.b.primitive.png", 0, 5),
        "two shapes have the same color"
    );
    assert_eq!(
        pixel("a.b.primitive.png", 0, 5),
        pixel("a.b.primitive.png", 9, 5),
        "one shape has two colors"
    );
    assert_ne!(pixel("a.b.uv.png", 0, 5), pixel("a.b.uv.png", 9, 5));
}

#[test]
fn stats_have_the_documented_fields() {
    let folder = TestFolder::new();
    let arguments = ["--stats", "stats.json", "--crop", "0,0,5,4", "--light-samples", "9"];
    folder.run_quietly(&[&["render", "small.toml", "-o", "out.png"], &arguments[..]].concat());
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("stats.json")).unwrap();
    let fields = stats.as_object().unwrap();
    let mut names: Vec<&str> = fields.keys().map(String::as_str).collect();
    let mut expected = [
        "device",
        "driver",
        "backend",
        "width",
        "height",
        "pixel_samples",
        "min_samples",
        "least_samples",
        "partial",
        "light_samples",
        "setup_s",
        "render_s",
        "total_s",
        "camera_rays",
        "fraction_rendered",
        "share_rendered",
        "shadow_rays",
        "nominal_mrays_per_s",
    ];
    names.sort_unstable();
    expected.sort_unstable();
    assert_eq!(names, expected);
    let number = |name: &str| {
        fields[name]
            .as_f64()
            .unwrap_or_else(|| panic!("{name} is not a number"))
    };
    assert_eq!(
        [
            "width",
            "height",
            "pixel_samples",
            "min_samples",
            "least_samples",
            "light_samples"
        ]
        .map(number),
        [5.0, 4.0, 3.0, 3.0, 3.0, 9.0]
    );
    assert_eq!(number("camera_rays"), 60.0);
    assert!(fields["shadow_rays"].is_null());
    assert_eq!(fields["partial"], false);
    let (setup, render, total) = (number("setup_s"), number("render_s"), number("total_s"));
    assert!(setup > 0.0 && render > 0.0 && total >= setup + render, "{stats}");
    let nominal = 5.0 * 4.0 * 3.0 * (1.0 + 9.0) / render / 1e6;
    assert!((number("nominal_mrays_per_s") / nominal - 1.0).abs() < 1e-9, "{stats}");
    for name in ["device", "driver", "backend"] {
        assert!(!fields[name].as_str().unwrap().is_empty());
    }
}

/// If the driver truncates loops and a single sample needs longer loops, the CPU renders the image with a warning.
#[test]
fn a_sample_too_long_for_the_driver_is_rendered_on_the_cpu() {
    if crate::adapter::device().is_none() {
        return;
    }
    let folder = TestFolder::new();
    let options = [
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
        let extra = [
            "--device",
            device,
            "--reproducible",
            "-o",
            out,
            "--aov",
            "depth",
            "--stats",
            "s.json",
            "--progress",
            "none",
        ];
        folder.run(&[&options[..], &extra[..]].concat())
    };
    let result = render("gpu", "gpu.exr");
    assert_eq!((result.code, result.stdout.as_str()), (0, ""), "{}", result.stderr);
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("s.json")).expect("JSON");
    if stats["device"] == "cpu" {
        let line = result.stderr.trim_end();
        assert!(line.starts_with("warning: rendering on the CPU: "), "{line}");
        assert!(line.contains("ends long loops early") && !line.contains('\n'), "{line}");
    } else {
        assert_eq!(result.stderr, "");
    }
    assert_eq!(render("cpu", "cpu.exr").code, 0);
    if crate::adapter::device().is_some_and(crate::adapter::bit_exact) {
        assert!(folder.read("gpu.exr") == folder.read("cpu.exr"));
    }
}
