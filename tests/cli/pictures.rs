//! Image formats: bit depth, compression, metadata, several outputs of a render, and view transforms.

use std::collections::BTreeMap;
use std::path::Path;

use exr::prelude::{FlatSamples, f16};
use wgray::image::{read_exr, to_8_bits, to_16_bits};
use wgray::scene::{ViewSettings, ViewTransform};

use super::outputs::assert_rejected;
use super::{SCENE, TestFolder, read_png};

fn render(folder: &TestFolder, arguments: &[&str]) {
    folder.run_quietly(&[&["render", "small.toml", "--device", "cpu"], arguments].concat());
}

fn png_info(path: &Path) -> png::Info<'static> {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    png::Decoder::new(file).read_info().unwrap().info().clone()
}

fn texts(path: &Path) -> BTreeMap<String, String> {
    let info = png_info(path);
    let texts = info.uncompressed_latin1_text.iter();
    texts.map(|chunk| (chunk.keyword.clone(), chunk.text.clone())).collect()
}

/// Returns the bits of the values of each channel of an EXR; half floats have 16 bits.
fn channel_bits(path: &Path) -> BTreeMap<String, Vec<u32>> {
    let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let bits = |samples: &FlatSamples| match samples {
        FlatSamples::F32(values) => values.iter().map(|value| value.to_bits()).collect(),
        FlatSamples::U32(values) => values.clone(),
        FlatSamples::F16(values) => values.iter().map(|value| u32::from(value.to_bits())).collect(),
    };
    let channels = image.layer_data.channel_data.list.iter();
    channels
        .map(|channel| (channel.name.to_string(), bits(&channel.sample_data)))
        .collect()
}

fn path_scene() -> String {
    SCENE
        .replace("[render]", "[render]\nintegrator = \"path\"\nalpha = true")
        .replace("ambient = [0.1, 0.1, 0.1]\n", "")
        .replace("light_samples = { pattern = \"grid\", count = 4 }\n", "")
        .replace("type = \"plane\"", "type = \"rectangle\"\nsize = [3, 3]")
        .replace("point = [0, 0, 0]", "center = [0, 0, 0]")
        .replace("\"phong\"", "\"diffuse\"")
}

#[test]
fn one_render_writes_several_images() {
    const NAMES: [&str; 6] = ["a.png", "a.exr", "a.jpg", "a.jpeg", "a.webp", "b.PNG"];
    let folder = TestFolder::new();
    let aovs = ["--aov", "depth,primitive"];
    let outputs = NAMES.map(|name| ["-o", name]).concat();
    render(&folder, &[&outputs[..], &aovs].concat());
    let all = folder.files();
    assert_eq!(
        all,
        [
            "a.depth.png",
            "a.exr",
            "a.jpeg",
            "a.jpg",
            "a.png",
            "a.primitive.png",
            "a.webp",
            "b.PNG",
            "b.depth.png",
            "b.primitive.png"
        ]
    );
    let from_one_render: Vec<Vec<u8>> = all.iter().map(|name| folder.read(name)).collect();
    for name in NAMES {
        match name {
            "a.jpg" | "a.jpeg" | "a.webp" => render(&folder, &["-o", name]),
            _ => render(&folder, &[&["-o", name], &aovs[..]].concat()),
        }
    }
    assert_eq!(folder.files(), all);
    for (name, expected) in all.iter().zip(from_one_render) {
        assert!(
            folder.read(name) == expected,
            "{name} differs if written as the only output"
        );
    }
    assert_ne!(folder.read("a.png"), folder.read("a.depth.png"));
}

#[test]
fn transparency_in_a_format_without_alpha_is_reported() {
    let folder = TestFolder::new();
    folder.write("clear.toml", &path_scene());
    for (name, is_noted) in [("a.jpg", true), ("a.png", false)] {
        let result = folder.run(&["render", "clear.toml", "--device", "cpu", "-o", name]);
        let note = "a.jpg: JPEG has no alpha; the transparent background is black";
        assert_eq!(
            (result.code, result.stderr.contains(note)),
            (0, is_noted),
            "{name}: {}",
            result.stderr
        );
    }
}

#[test]
fn a_failed_output_leaves_no_incomplete_files() {
    let folder = TestFolder::new();
    let result = folder.run(&[
        "render",
        "small.toml",
        "--device",
        "cpu",
        "-o",
        "a.png",
        "-o",
        "a.exr",
        "-o",
        "/dev/full",
        "-o",
        "b.png",
    ]);
    assert_ne!(result.code, 0);
    assert!(
        result.stderr.contains("/dev/full: cannot be written"),
        "{}",
        result.stderr
    );
    // Outputs are renamed one after the other: outputs before the failed output may exist, later outputs must not.
    assert!(!folder.files().contains(&"b.png".to_owned()), "{:?}", folder.files());
    assert!(
        folder.files().iter().all(|name| !name.starts_with('.')),
        "{:?}",
        folder.files()
    );
}

#[test]
fn pngs_have_8_or_16_bits_and_declare_their_transfer_function() {
    let folder = TestFolder::new();
    render(&folder, &["-o", "a.exr"]);
    let linear = read_exr(&folder.path("a.exr")).unwrap().colors;
    for transform in ViewTransform::ALL {
        let settings = ViewSettings {
            transform,
            exposure: -0.5,
        };
        let (name, displayed) = (
            transform.name(),
            linear.iter().flat_map(|color| settings.display(*color)),
        );
        let options = ["--view-transform", name, "--exposure", "-0.5"];
        render(&folder, &[&["-o", "a.png"], &options[..]].concat());
        render(
            &folder,
            &[&["-o", "b.png", "--bit-depth", "16", "--aov", "normal"], &options[..]].concat(),
        );
        let expected: Vec<u8> = displayed.clone().map(to_8_bits).collect();
        assert_eq!(read_png(&folder.path("a.png")).2, expected, "{name}");
        let image::DynamicImage::ImageRgb16(deep) = image::open(folder.path("b.png")).unwrap() else {
            panic!("the PNG does not have 16 bits per channel");
        };
        let expected: Vec<u16> = displayed.map(to_16_bits).collect();
        assert_eq!(deep.into_raw(), expected, "{name}");
        assert!(
            expected.iter().any(|value| value % 257 != 0),
            "all values fit in 8 bits"
        );
        assert_eq!(png_info(&folder.path("b.normal.png")).bit_depth, png::BitDepth::Sixteen);
        let info = png_info(&folder.path("a.png"));
        let (srgb, gamma) = (info.srgb.is_some(), info.gama_chunk.map(|gamma| gamma.into_scaled()));
        match transform {
            ViewTransform::Gamma22 => assert_eq!((srgb, gamma), (false, Some(45_454))),
            _ => assert!(srgb, "{name}"),
        }
    }
}

#[test]
fn options_override_the_view_of_the_scene() {
    let folder = TestFolder::new();
    let keys = "view_transform = 'khronos-pbr-neutral', exposure = 1.5";
    folder.write(
        "shown.toml",
        &SCENE.replacen("height = 6", &format!("height = 6, {keys}"), 1),
    );
    let render_with_keys = |options: &[&str]| {
        folder.run_quietly(&[&["render", "shown.toml", "--device", "cpu", "-o", "s.png"], options].concat());
        read_png(&folder.path("s.png"))
    };
    let render_without_keys = |options: &[&str]| {
        render(&folder, &[&["-o", "p.png"], options].concat());
        read_png(&folder.path("p.png"))
    };
    let with_scene_view = render_with_keys(&[]);
    assert_eq!(
        with_scene_view,
        render_without_keys(&["--view-transform", "khronos-pbr-neutral", "--exposure", "1.5"])
    );
    assert_ne!(
        with_scene_view,
        render_without_keys(&["--view-transform", "khronos-pbr-neutral"])
    );
    assert_ne!(with_scene_view, render_without_keys(&["--exposure", "1.5"]));
    assert_eq!(
        render_with_keys(&["--view-transform", "gamma22", "--exposure", "0"]),
        render_without_keys(&[])
    );
    assert_eq!(
        render_with_keys(&["--exposure", "-2"]),
        render_without_keys(&["--view-transform", "khronos-pbr-neutral", "--exposure", "-2"])
    );
    // An EXR is linear and does not depend on the view settings. The library gives the same images as the program.
    folder.run_quietly(&["render", "shown.toml", "--device", "cpu", "-o", "s.exr"]);
    render(&folder, &["-o", "p.exr"]);
    assert_eq!(folder.read("s.exr"), folder.read("p.exr"));
    let scene = wgray::Scene::load(folder.path("shown.toml")).unwrap();
    let options = wgray::Options {
        device: wgray::Device::Cpu,
        ..Default::default()
    };
    let picture = wgray::render(&scene, &options).unwrap();
    assert_eq!(picture.rgb8(), with_scene_view.2);
    picture.save(folder.path("l.webp")).unwrap();
    assert_eq!(
        image::open(folder.path("l.webp")).unwrap().into_rgb8().into_raw(),
        with_scene_view.2
    );
    for (keys, message) in [
        ("exposure = 101", "image.exposure: 101 must be from -100 to 100 stops"),
        ("exposure = nan", "image.exposure: NaN must be from -100 to 100 stops"),
        ("view_transform = 'filmic'", "image.view_transform: "),
        ("view = 'srgb'", "view"),
    ] {
        folder.write(
            "bad.toml",
            &SCENE.replacen("height = 6", &format!("height = 6, {keys}"), 1),
        );
        let result = folder.run(&["check", "bad.toml"]);
        assert_eq!(result.code, 3, "{keys}: {}", result.stderr);
        assert!(result.stderr.contains(message), "{keys}: {}", result.stderr);
    }
}

#[test]
fn exr_compression_is_lossless() {
    let folder = TestFolder::new();
    let aovs = ["--aov", "depth,primitive", "--size", "75x70"];
    render(&folder, &[&["-o", "zip.exr"], &aovs[..]].concat());
    let floats = channel_bits(&folder.path("zip.exr"));
    let halves: BTreeMap<String, Vec<u32>> = (floats.iter())
        .map(|(name, bits)| match name.as_str() {
            "primitive.ID" => (name.clone(), bits.clone()),
            _ => {
                let half = |bits: &u32| u32::from(f16::from_f32(f32::from_bits(*bits)).to_bits());
                (name.clone(), bits.iter().map(half).collect())
            }
        })
        .collect();
    let mut sizes = BTreeMap::new();
    for method in ["none", "rle", "zips", "zip", "piz"] {
        for (value_type, expected) in [("float", &floats), ("half", &halves)] {
            let options = ["--exr-compression", method, "--exr-type", value_type];
            render(&folder, &[&["-o", "a.exr"], &aovs[..], &options].concat());
            assert!(
                channel_bits(&folder.path("a.exr")) == *expected,
                "{method} {value_type}"
            );
            sizes.insert((method, value_type), folder.read("a.exr").len());
            // The crop starts and ends inside a compression block.
            render(
                &folder,
                &[&["-o", "c.exr", "--crop", "3,5,70,62"], &aovs[..], &options].concat(),
            );
            let crop = channel_bits(&folder.path("c.exr"));
            for (name, full) in expected {
                let rows = full.chunks(75).skip(5).take(57);
                let expected_crop: Vec<u32> = rows.flat_map(|row| row[3..70].to_vec()).collect();
                assert!(crop[name] == expected_crop, "{method} {value_type}: {name}");
            }
        }
    }
    let (pixels, header) = (75 * 70, 2000);
    assert!(sizes[&("none", "float")] >= pixels * 5 * 4 && sizes[&("none", "float")] < pixels * 5 * 4 + header);
    assert!(sizes[&("none", "half")] < pixels * (4 * 2 + 4) + header);
    assert!(sizes[&("zip", "float")] < sizes[&("none", "float")]);
    let depth = |bits: &BTreeMap<String, Vec<u32>>| bits["depth.Z"][3000];
    assert_ne!(depth(&floats), depth(&halves));
}

#[test]
fn half_float_overflows_are_counted() {
    let folder = TestFolder::new();
    folder.write(
        "small.toml",
        &SCENE.replace("background = [0.2, 0.3, 2]", "background = [65504, 65519, 70000]"),
    );
    let result = folder.run(&[
        "render",
        "small.toml",
        "--device",
        "cpu",
        "-o",
        "h.exr",
        "--exr-type",
        "half",
    ]);
    assert_eq!(result.code, 0, "{}", result.stderr);
    let found = channel_bits(&folder.path("h.exr"));
    let count_infinite = |name: &str| found[name].iter().filter(|bits| **bits == 0x7c00).count();
    let infinite_blue = count_infinite("B");
    assert!(infinite_blue > 5, "{infinite_blue}");
    // Values below 65520 round to 65504, the largest finite half float.
    assert_eq!((count_infinite("R"), count_infinite("G")), (0, 0));
    let warning = format!(
        "warning: h.exr: values beyond 65504, the maximum of a 16-bit float, were written as infinity (number of these values: \
         {infinite_blue}); use --exr-type float\n"
    );
    assert_eq!(result.stderr, warning);
    folder.run_quietly(&[
        "render",
        "small.toml",
        "--device",
        "cpu",
        "-o",
        "h.exr",
        "--exr-type",
        "half",
        "-q",
    ]);
    folder.run_quietly(&["render", "small.toml", "--device", "cpu", "-o", "f.exr"]);
}

#[test]
fn jpeg_and_webp_match_the_png() {
    let folder = TestFolder::new();
    let size = ["--size", "160x96"];
    render(
        &folder,
        &[&["-o", "a.png", "-o", "a.webp", "-o", "a.jpg"], &size[..]].concat(),
    );
    render(&folder, &[&["-o", "b.jpg", "--quality", "20"], &size[..]].concat());
    let (_, _, exact) = read_png(&folder.path("a.png"));
    let image::DynamicImage::ImageRgb8(webp) = image::open(folder.path("a.webp")).unwrap() else {
        panic!("the WebP image is not RGB");
    };
    assert_eq!(webp.into_raw(), exact, "WebP is not lossless");
    let error = |name: &str| {
        let found = image::open(folder.path(name)).unwrap().into_rgb8().into_raw();
        let squares = found
            .iter()
            .zip(&exact)
            .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
        (squares.sum::<f64>() / exact.len() as f64).sqrt()
    };
    let (fine, coarse) = (error("a.jpg"), error("b.jpg"));
    assert!(fine > 0.0 && fine < 6.0, "{fine}");
    assert!(coarse > fine, "{coarse}, {fine}");
    assert!(folder.read("b.jpg").len() < folder.read("a.jpg").len());
}

#[test]
fn a_webp_has_alpha_and_a_jpeg_is_composited_over_black() {
    let folder = TestFolder::new();
    folder.write("small.toml", &path_scene());
    render(
        &folder,
        &[
            "-o",
            "a.png",
            "-o",
            "a.webp",
            "-o",
            "a.exr",
            "-o",
            "a.jpg",
            "--quality",
            "100",
            "-q",
        ],
    );
    let image::DynamicImage::ImageRgba8(png) = image::open(folder.path("a.png")).unwrap() else {
        panic!("the PNG has no alpha channel");
    };
    let image::DynamicImage::ImageRgba8(webp) = image::open(folder.path("a.webp")).unwrap() else {
        panic!("the WebP image has no alpha channel");
    };
    let transparent = png.pixels().filter(|pixel| pixel.0[3] == 0).count();
    let partial = png.pixels().filter(|pixel| !matches!(pixel.0[3], 0 | 255)).count();
    assert!(transparent > 5 && partial > 3, "{transparent}, {partial}");
    for (a, b) in png.pixels().zip(webp.pixels()) {
        // The color of transparent pixels is undefined.
        assert!(a == b || (a.0[3], b.0[3]) == (0, 0), "{a:?} {b:?}");
    }
    let jpeg = image::open(folder.path("a.jpg")).unwrap().into_rgb8();
    let over_black = read_exr(&folder.path("a.exr")).unwrap().colors;
    for (found, color) in jpeg.pixels().zip(over_black) {
        let expected = ViewSettings::default().rgb8(color);
        let difference = found.0.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
        assert!(difference <= Some(12), "{found:?} {expected:?}");
    }
}

/// The albedo layer is only sRGB-encoded, and the normal layer is not transformed.
#[test]
fn radiance_layers_use_the_view_of_the_image() {
    let folder = TestFolder::new();
    folder.write("small.toml", &path_scene());
    let names = ["albedo", "direct", "indirect", "emission"];
    let options = [
        "--view-transform",
        "agx",
        "--exposure",
        "2",
        "--aov",
        "normal,albedo,direct,indirect,emission",
    ];
    render(&folder, &[&["-o", "a.png", "-o", "a.exr"], &options[..]].concat());
    let channels = channel_bits(&folder.path("a.exr"));
    let settings = ViewSettings {
        transform: ViewTransform::Agx,
        exposure: 2.0,
    };
    let mut differing = 0;
    for name in names {
        let (_, _, layer) = read_png(&folder.path(&format!("a.{name}.png")));
        for (i, found) in layer.chunks(3).enumerate() {
            let color = ["R", "G", "B"].map(|part| f32::from_bits(channels[&format!("{name}.{part}")][i]));
            let as_light = settings.rgb8(color);
            let as_reflectance = settings.display_reflectance(color).map(to_8_bits);
            differing += usize::from(as_light != as_reflectance);
            assert_eq!(
                found,
                if name == "albedo" { as_reflectance } else { as_light },
                "{name} {i}"
            );
        }
    }
    assert!(differing > 30, "{differing}");
    let (_, _, normals) = read_png(&folder.path("a.normal.png"));
    render(&folder, &["-o", "b.png", "--aov", "normal"]);
    assert_eq!(read_png(&folder.path("b.normal.png")).2, normals);
    render(&folder, &["-o", "c.png", "--bit-depth", "16"]);
    let image::DynamicImage::ImageRgba16(deep) = image::open(folder.path("c.png")).unwrap() else {
        panic!("the PNG does not have 16 bits per channel and alpha");
    };
    for (pixel, alpha) in deep.pixels().zip(&channels["A"]) {
        assert_eq!(pixel.0[3], to_16_bits(f64::from(f32::from_bits(*alpha))));
    }
}

#[test]
fn images_have_metadata() {
    let folder = TestFolder::new();
    render(
        &folder,
        &[
            "-o",
            "a.png",
            "-o",
            "a.jpg",
            "-o",
            "a.webp",
            "-o",
            "a.exr",
            "--seed",
            "7",
            "--view-transform",
            "agx",
        ],
    );
    let png = texts(&folder.path("a.png"));
    assert_eq!(png["Software"], concat!("wgray ", env!("CARGO_PKG_VERSION")));
    let expected: Vec<(&str, &str)> = [
        ("seed", "7"),
        ("integrator", "phong"),
        ("pixel_samples", "3 random"),
        ("device", "cpu"),
        ("view_transform", "agx"),
        ("exposure", "0"),
    ]
    .into();
    for (name, text) in &expected {
        assert_eq!(png[*name], *text, "{name}");
    }
    assert_eq!((png["shader_hash"].len(), png["scene_hash"].len()), (64, 64));
    folder.write("other.toml", &SCENE.replacen("0.8", "0.7", 1));
    folder.run_quietly(&["render", "other.toml", "--device", "cpu", "-o", "b.png", "--seed", "7"]);
    let other_texts = texts(&folder.path("b.png"));
    assert_ne!(other_texts["scene_hash"], png["scene_hash"]);
    assert_eq!(other_texts["shader_hash"], png["shader_hash"]);
    let exif_texts = |name: &str| {
        let data = exif::Reader::new()
            .read_from_container(&mut std::io::Cursor::new(folder.read(name)))
            .unwrap();
        let text = |tag| match &data.get_field(tag, exif::In::PRIMARY).unwrap().value {
            exif::Value::Ascii(texts) => String::from_utf8(texts[0].clone()).unwrap(),
            _ => panic!("the Exif value is not text"),
        };
        (text(exif::Tag::Software), text(exif::Tag::ImageDescription))
    };
    let meta = exr::meta::MetaData::read_from_file(folder.path("a.exr"), true).unwrap();
    let attributes = &meta.headers[0].own_attributes;
    let text = |text: &Option<exr::meta::attribute::Text>| text.as_ref().unwrap().to_string();
    for (name, (software, lines)) in [
        ("a.jpg", exif_texts("a.jpg")),
        ("a.webp", exif_texts("a.webp")),
        ("a.exr", (text(&attributes.software_name), text(&attributes.comments))),
    ] {
        assert_eq!(software, png["Software"], "{name}");
        for (key, value) in &png {
            let is_listed = lines.lines().any(|line| line == format!("{key}: {value}"));
            let depends_on_display = ["view_transform", "exposure"].contains(&key.as_str()) && name == "a.exr";
            assert_eq!(is_listed, key != "Software" && !depends_on_display, "{name}: {key}");
        }
    }
}

#[test]
fn reproducible_images_do_not_depend_on_the_device() {
    let folder = TestFolder::new();
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    const NAMES: [&str; 5] = ["a.png", "a.normal.png", "a.exr", "a.webp", "a.jpg"];
    for device in ["cpu", "gpu"] {
        if device == "gpu" && !crate::adapter::device().is_some_and(crate::adapter::bit_exact) {
            continue;
        }
        for reproducible in [true, false] {
            let outputs = [
                "-o", "a.png", "-o", "a.exr", "-o", "a.webp", "-o", "a.jpg", "--aov", "normal", "--device", device,
            ];
            let option: &[&str] = if reproducible { &["--reproducible"] } else { &[] };
            folder.run_quietly(&[&["render", "small.toml"], &outputs[..], option].concat());
            for name in NAMES {
                let bytes = folder.read(name);
                let mut earlier = files.iter().filter(|(earlier_name, _)| earlier_name == name);
                let is_repeated = earlier.any(|(_, earlier_bytes)| *earlier_bytes == bytes);
                assert_eq!(is_repeated, reproducible && device == "gpu", "{name} {device}");
                files.push((name.to_owned(), bytes));
            }
            let metadata = texts(&folder.path("a.png"));
            assert_eq!(metadata.contains_key("device"), !reproducible);
            assert!(metadata.contains_key("shader_hash") && metadata.contains_key("seed"));
        }
    }
}

#[test]
fn options_without_an_applicable_output_are_rejected() {
    let folder = TestFolder::new();
    for (arguments, message) in [
        (
            &["-o", "a.exr", "--bit-depth", "16"][..],
            "--bit-depth: only applies to PNG outputs",
        ),
        (
            &["-o", "a.exr", "--exposure", "1"],
            "--exposure: only applies to PNG, JPEG, WEBP outputs",
        ),
        (
            &["-o", "a.exr", "--view-transform", "agx"],
            "--view-transform: only applies to PNG, JPEG",
        ),
        (&["--exr-type", "half"], "--exr-type: only applies to EXR outputs"),
        (&["--exr-compression", "rle"], "--exr-compression: only applies to EXR"),
        (
            &["-o", "a.webp", "--quality", "80"],
            "--quality: only applies to JPEG outputs",
        ),
        (
            &["-o", "a.jpg", "-o", "a.webp", "--aov", "depth"],
            "--aov depth: only applies to EXR and PNG outputs; add -o NAME.exr",
        ),
        (
            &["-o", "a.jpg", "-o", "b", "--format", "exr", "-o", "c.gif", "-o", "./b"],
            "--output: ./b is given twice",
        ),
        (
            &["-o", "a.png", "-o", "a.normal.png", "--aov", "normal"],
            "--output: a.normal.png is also written by --aov normal",
        ),
        (&["-o", "a.png", "-o", "a.png"], "--output: a.png is given twice"),
        (&["-o", "-", "-o", "/dev/stdout"], "is given twice"),
        (
            &["-o", "a.png", "-o", "b.exr", "--format", "png"],
            "--format: contradicts --output b.exr, which ends in .exr",
        ),
        (
            &["-o", "a.png", "-o", "b"],
            "--output: b: must end in .png, .exr, .jpg, .jpeg or .webp; or set --format",
        ),
        (&["--stats", "a.webp"], "--stats: a.webp: must not end in .webp"),
    ] {
        assert_rejected(&folder, &[&["small.toml"], arguments].concat(), 2, message);
    }
    for (option, value, message) in [
        ("--quality", "0", "0"),
        ("--quality", "101", "101"),
        ("--exposure", "nan", "from -100 to 100"),
        ("--exposure", "-101", "from -100 to 100"),
        ("--exposure", "one", "from -100 to 100"),
        ("--bit-depth", "12", "12"),
        ("--exr-compression", "dwaa", "none, rle, zips, zip, piz"),
        ("--view-transform", "filmic", "gamma22, srgb, agx, khronos-pbr-neutral"),
    ] {
        let result = folder.run(&["render", "small.toml", "-o", "a.jpg", "-o", "a.exr", option, value]);
        assert_eq!(result.code, 2, "{option} {value}: {}", result.stderr);
        assert!(
            result.stderr.contains(option) && result.stderr.contains(message),
            "{option} {value}: {}",
            result.stderr
        );
    }
    render(
        &folder,
        &[
            "-o",
            "a.jpg",
            "-o",
            "b",
            "--format",
            "exr",
            "--exr-type",
            "half",
            "--exposure",
            "-1.5",
        ],
    );
    assert_eq!(folder.files(), ["a.jpg", "b"]);
    assert!(channel_bits(&folder.path("b")).contains_key("R"));
}

/// The error is reported before the render, which would take long.
#[test]
fn images_too_large_for_a_format_are_rejected() {
    let folder = TestFolder::new();
    for (name, size, message) in [
        (
            "a.jpg",
            "65536x60000",
            "--output: a.jpg: 65536 x 60000 pixels are too many for a JPEG; the limit is 65535 along a side",
        ),
        (
            "a.webp",
            "60000x16384",
            "--output: a.webp: 60000 x 16384 pixels are too many for a WebP; the limit is 16383 along a side",
        ),
    ] {
        assert_rejected(
            &folder,
            &["small.toml", "--size", size, "-o", "b.png", "-o", name],
            2,
            message,
        );
    }
    // A crop within the limits and images of the maximum sizes are accepted.
    let crop = [
        "--size",
        "65536x60000",
        "--crop",
        "65500,59990,65536,60000",
        "--spp",
        "1",
    ];
    render(&folder, &[&crop[..], &["-o", "a.jpg", "-o", "a.webp"]].concat());
    render(
        &folder,
        &[
            "--size",
            "65535x1",
            "--spp",
            "1",
            "--light-samples",
            "1",
            "-o",
            "wide.jpg",
        ],
    );
    render(
        &folder,
        &[
            "--size",
            "1x16383",
            "--spp",
            "1",
            "--light-samples",
            "1",
            "-o",
            "high.webp",
        ],
    );
    assert_eq!(image::image_dimensions(folder.path("wide.jpg")).unwrap(), (65_535, 1));
    assert_eq!(image::image_dimensions(folder.path("high.webp")).unwrap(), (1, 16_383));
}
