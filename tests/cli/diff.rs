//! `wgray diff`: exit codes, options and edge cases.

use std::fs;

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Layer, LayerAttributes, SmallVec, WritableImage as _, f16};
use exr::prelude::{Encoding, Image};

use super::{RunResult, TestFolder};

/// Writes an 8-bit PNG; the number of values per pixel determines the color type.
fn write_8_bit_png(folder: &TestFolder, name: &str, (width, height): (u32, u32), values: &[u8]) {
    let color = match values.len() / (width * height) as usize {
        1 => png::ColorType::Grayscale,
        2 => png::ColorType::GrayscaleAlpha,
        3 => png::ColorType::Rgb,
        _ => png::ColorType::Rgba,
    };
    write_png(folder, name, (width, height), color, png::BitDepth::Eight, values);
}

fn write_png(
    folder: &TestFolder,
    name: &str,
    size: (u32, u32),
    color: png::ColorType,
    depth: png::BitDepth,
    values: &[u8],
) {
    let file = fs::File::create(folder.path(name)).unwrap();
    let mut encoder = png::Encoder::new(file, size.0, size.1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![10, 20, 30, 200, 100, 0]);
    }
    encoder.write_header().unwrap().write_image_data(values).unwrap();
}

fn write_exr(folder: &TestFolder, name: &str, size: (usize, usize), channels: Vec<(&str, FlatSamples)>) {
    write_exr_parts(folder, name, size, vec![("part", channels)], Encoding::FAST_LOSSLESS);
}

fn write_exr_parts(
    folder: &TestFolder,
    name: &str,
    size: (usize, usize),
    parts: Vec<(&str, Vec<(&str, FlatSamples)>)>,
    encoding: Encoding,
) {
    let layer = |(part, channels): (&str, Vec<(&str, FlatSamples)>)| {
        let list: SmallVec<[AnyChannel<FlatSamples>; 4]> = channels
            .into_iter()
            .map(|(name, samples)| AnyChannel::new(name, samples))
            .collect();
        Layer::new(size, LayerAttributes::named(part), encoding, AnyChannels::sort(list))
    };
    let layers: Vec<_> = parts.into_iter().map(layer).collect();
    let attributes = exr::prelude::ImageAttributes::new(exr::prelude::IntegerBounds::from_dimensions(size));
    let image = Image {
        attributes,
        layer_data: layers.into_iter().collect::<exr::prelude::Layers<_>>(),
    };
    image.write().to_file(folder.path(name)).unwrap();
}

fn floats(values: &[f32]) -> FlatSamples {
    FlatSamples::F32(values.to_vec())
}

fn gray(values: &[f32]) -> Vec<(&'static str, FlatSamples)> {
    ["R", "G", "B"].into_iter().map(|name| (name, floats(values))).collect()
}

fn write_two_pngs(folder: &TestFolder) -> (Vec<u8>, Vec<u8>) {
    let a: Vec<u8> = (0..24).map(|i| i * 9).collect();
    let mut b = a.clone();
    b[16] += 10; // pixel (1, 1), green
    write_8_bit_png(folder, "a.png", (4, 2), &a);
    write_8_bit_png(folder, "b.png", (4, 2), &b);
    (a, b)
}

#[track_caller]
fn assert_output(result: &RunResult, code: i32, text: &str) {
    assert_eq!(result.code, code, "{}{}", result.stdout, result.stderr);
    let output = if [0, 5].contains(&code) {
        &result.stdout
    } else {
        &result.stderr
    };
    assert!(output.contains(text), "'{text}' is not in: {output}");
}

fn json(result: &RunResult) -> serde_json::Value {
    assert_eq!(result.stderr, "");
    serde_json::from_str(&result.stdout).unwrap_or_else(|error| panic!("{error}: {}", result.stdout))
}

#[test]
fn identical_files_pass_and_a_single_differing_bit_fails() {
    let folder = TestFolder::new();
    let (a, _) = write_two_pngs(&folder);
    write_8_bit_png(&folder, "copy.png", (4, 2), &a);
    for name in ["a.png", "copy.png"] {
        let result = folder.run(&["diff", "a.png", name]);
        assert_output(&result, 0, "color R G B: identical\nidentical\n");
    }
    let result = folder.run(&["diff", "a.png", "b.png"]);
    assert_output(&result, 5, "fails: color: 1 pixel differs\n");
    assert_output(&result, 5, "  different  1 of 8 pixels, the first at (1, 1)\n");
    assert_output(
        &result,
        5,
        "  largest    0.0392157 in G at (1, 1): 0.564706 instead of 0.603922\n",
    );
    // One of the 24 values differs by 10 / 255, so the RMSE is sqrt((10 / 255)² / 24).
    assert_output(&result, 5, "  rmse       0.00800487\n");
    assert_eq!((result.stderr.as_str(), folder.files().len()), ("", 3));
}

#[test]
fn json_uses_the_names_of_the_text_output() {
    let folder = TestFolder::new();
    write_two_pngs(&folder);
    let result = folder.run(&["diff", "a.png", "b.png", "--json"]);
    assert_eq!(result.code, 5);
    let found = json(&result);
    assert_eq!(found["passes"], false);
    assert_eq!(found["size_a"], serde_json::json!([4, 2]));
    let layer = &found["layers"][0];
    assert_eq!((&layer["name"], &layer["different"]), (&"color".into(), &1.into()));
    assert_eq!(layer["channels"], serde_json::json!(["R", "G", "B"]));
    assert_eq!(layer["first"], serde_json::json!({"x": 1, "y": 1}));
    assert_eq!(layer["largest_at"]["channel"], "G");
    let text = folder.run(&["diff", "a.png", "b.png"]).stdout;
    for metric in [
        "different",
        "largest",
        "share",
        "rmse",
        "rel_mse",
        "psnr",
        "ssim",
        "flip",
    ] {
        assert!(layer[metric].is_number(), "{metric}");
        assert!(text.contains(&format!("\n  {metric:<9}  ")), "{metric}");
    }
    // The PSNR of equal images is infinite, which JSON numbers cannot represent.
    let report = json(&folder.run(&["diff", "a.png", "a.png", "--json"]));
    assert_eq!(
        (&report["passes"], &report["layers"][0]["psnr"]),
        (&true.into(), &"inf".into())
    );
    assert_eq!(
        (&report["layers"][0]["flip"], &report["layers"][0]["ssim"]),
        (&0.0.into(), &1.0.into())
    );
}

#[test]
fn limits_decide_the_exit_code() {
    let folder = TestFolder::new();
    write_two_pngs(&folder);
    let passes = |limits: &[&str]| {
        let options: Vec<&str> = limits.iter().flat_map(|limit| ["--fail", limit]).collect();
        let result = folder.run(&[&["diff", "a.png", "b.png"], &options[..]].concat());
        assert!([0, 5].contains(&result.code), "{}", result.stderr);
        (result.code == 0, result.stdout)
    };
    for (satisfied, violated) in [
        ("different=1", "different=0"),
        ("largest=0.0393", "largest=0.0392"),
        ("share=0.125", "share=0.12"),
        ("rmse=0.00801", "rmse=0.008"),
        ("rel_mse=1", "rel_mse=0"),
        ("psnr=41.9", "psnr=42"),
        ("ssim=0.9", "ssim=1"),
        ("flip=0.2", "flip=0"),
    ] {
        assert!(passes(&[satisfied]).0, "{satisfied}");
        let (passed, text) = passes(&[violated]);
        let (metric, limit) = violated.split_once('=').unwrap();
        let word = if ["psnr", "ssim"].contains(&metric) {
            "below"
        } else {
            "above"
        };
        assert!(!passed && text.contains(&format!("fails: color: {metric} ")), "{text}");
        assert!(text.contains(&format!(" is {word} {limit}\n")), "{text}");
        // A violated limit fails, even if another limit is satisfied.
        assert!(
            !passes(&[satisfied, violated]).0 && !passes(&[violated, satisfied]).0,
            "{violated}"
        );
    }
    assert!(passes(&["rmse=0.1", "psnr=20", "flip=0.5"]).0);
}

#[test]
fn invalid_command_lines_exit_with_2() {
    let folder = TestFolder::new();
    write_two_pngs(&folder);
    write_exr(&folder, "depth.exr", (2, 1), vec![("depth.Z", floats(&[1.0, 2.0]))]);
    let metrics = "different, largest, share, rmse, rel_mse, psnr, ssim, flip";
    let cases: [(&[&str], &str); 17] = [
        (&["a.png"], "<B>"),
        (&["a.png", "b.png", "a.png"], "unexpected argument"),
        (&["-", "-"], "only one of the images can be standard input"),
        (&["a.png", "b.png", "--fail", "mse=1"], metrics),
        (&["a.png", "b.png", "--fail", "rmse"], "must be METRIC=X"),
        (
            &["a.png", "b.png", "--fail", "rmse=-1"],
            "rmse must be a number of at least 0",
        ),
        (
            &["a.png", "b.png", "--fail", "ssim=NaN"],
            "ssim must be a number from -1 to 1",
        ),
        (&["a.png", "b.png", "--metrics", "rmse,mse"], metrics),
        (
            &["a.png", "b.png", "--threshold", "-1"],
            "must be a number of at least 0",
        ),
        (&["a.png", "b.png", "--ppd", "0"], "must be a number from 1 to 1000"),
        (
            &["a.png", "b.png", "--layers", "normal"],
            "--layers: normal: must be a layer of the images: color",
        ),
        (
            &["a.png", "b.png", "--out", "a.png"],
            "--out: a.png: would overwrite the input a.png",
        ),
        (
            &["a.png", "b.png", "--out", "./b.png"],
            "would overwrite the input b.png",
        ),
        (&["a.png", "b.png", "--out", "c.jpg"], "--out: c.jpg: must end in .png"),
        (&["a.png", "b.png", "--out", "-"], "standard output receives the report"),
        (
            &["depth.exr", "depth.exr", "--fail", "flip=0"],
            "flip: requires color channels",
        ),
        (
            &["depth.exr", "depth.exr", "--metrics", "ssim"],
            "ssim: requires color channels",
        ),
    ];
    for (arguments, message) in cases {
        let result = folder.run(&[&["diff"], arguments].concat());
        assert_output(&result, 2, message);
        assert_eq!(result.stdout, "", "{arguments:?}");
    }
    assert_eq!(folder.files(), ["a.png", "b.png", "depth.exr"]);
}

#[test]
fn files_that_are_not_images_exit_with_1() {
    let folder = TestFolder::new();
    let (a, _) = write_two_pngs(&folder);
    let complete = folder.read("a.png");
    for (name, bytes) in [
        ("empty.png", &[][..]),
        ("text.png", b"not a PNG!"),
        ("short.png", &complete[..complete.len() / 2]),
        ("endless.png", &complete[..complete.len() - 12]),
    ] {
        fs::write(folder.path(name), bytes).unwrap();
    }
    let mut flipped = complete.clone();
    flipped[50] ^= 1;
    fs::write(folder.path("flipped.png"), flipped).unwrap();
    write_exr(&folder, "whole.exr", (4, 2), gray(&[0.5; 8]));
    let complete = folder.read("whole.exr");
    fs::write(folder.path("short.exr"), &complete[..complete.len() - 40]).unwrap();
    write_exr(&folder, "depth.exr", (4, 2), vec![("depth.Z", floats(&[1.0; 8]))]);
    fs::create_dir(folder.path("folder")).unwrap();
    for (name, message) in [
        ("absent.png", "cannot be read: "),
        ("folder", "is a directory"),
        ("empty.png", "is empty"),
        ("text.png", "is not an image: it must be a PNG, EXR"),
        ("small.toml", "is not an image"),
        ("short.png", "is damaged or truncated"),
        ("endless.png", "is damaged or truncated"),
        ("flipped.png", "is damaged or truncated"),
        ("short.exr", "is damaged or truncated"),
        ("depth.exr", "has no color channels"),
    ] {
        for arguments in [["diff", name, "a.png"], ["diff", "a.png", name]] {
            let result = folder.run(&arguments);
            assert_output(&result, 1, &format!("error: {name}: {message}"));
            assert_eq!(result.stdout, "", "{name}");
        }
    }
    // The cause is printed only once.
    for arguments in [["diff", "absent.png", "a.png"], ["diff", "a.png", "absent.png"]] {
        let message = "error: absent.png: cannot be read: No such file or directory (os error 2)\n";
        assert_eq!(folder.run(&arguments).stderr, message);
    }
    // The content determines the format, not the extension.
    write_8_bit_png(&folder, "a.exr", (4, 2), &a);
    assert_output(&folder.run(&["diff", "a.exr", "a.png"]), 0, "identical\n");
}

#[test]
fn different_sizes_and_positions_differ() {
    let folder = TestFolder::new();
    write_two_pngs(&folder);
    write_8_bit_png(&folder, "wide.png", (8, 1), &[0; 24]);
    let result = folder.run(&["diff", "a.png", "wide.png", "--fail", "rmse=1", "--out", "out.png"]);
    assert_output(&result, 5, "fails: A has 4 x 2 pixels, B 8 x 1\n");
    assert_output(&result, 5, "note: out.png: not written");
    assert!(!folder.path("out.png").exists());
    // Two crops of the same size are at different positions in the image.
    for (name, crop) in [("left.exr", "0,0,2,2"), ("right.exr", "2,0,4,2")] {
        folder.run_quietly(&["render", "small.toml", "--device", "cpu", "-o", name, "--crop", crop]);
    }
    assert_output(
        &folder.run(&["diff", "left.exr", "right.exr"]),
        5,
        "fails: A starts at pixel (0, 0) of the whole image, B at (2, 0)\n",
    );
    assert_output(&folder.run(&["diff", "left.exr", "left.exr"]), 0, "identical\n");
}

#[test]
fn missing_channels_differ_unless_excluded() {
    let folder = TestFolder::new();
    let colors = || gray(&[0.25, 0.5]);
    let depth = |z: f32| vec![("depth.Z", floats(&[1.0, z]))];
    write_exr(&folder, "both.exr", (2, 1), [colors(), depth(2.0)].concat());
    write_exr(&folder, "deeper.exr", (2, 1), [colors(), depth(2.5)].concat());
    write_exr(&folder, "colors.exr", (2, 1), colors());
    let missing = folder.run(&["diff", "both.exr", "colors.exr", "--fail", "rmse=9"]);
    assert_output(&missing, 5, "fails: B lacks depth.Z, which A has\n");
    assert_output(
        &folder.run(&["diff", "colors.exr", "both.exr"]),
        5,
        "fails: A lacks depth.Z, which B has\n",
    );
    assert_output(
        &folder.run(&["diff", "colors.exr", "both.exr", "--layers", "color"]),
        0,
        "identical\n",
    );
    // Layers that differ are listed with metrics; identical layers are reported as identical.
    let result = folder.run(&["diff", "both.exr", "deeper.exr"]);
    assert_output(&result, 5, "color R G B: identical\ndepth depth.Z\n");
    assert_output(&result, 5, "  largest    0.5 in depth.Z at (1, 0): 2 instead of 2.5\n");
    assert_output(&result, 5, "fails: depth: 1 pixel differs\n");
    assert_output(
        &folder.run(&["diff", "both.exr", "deeper.exr", "--layers", "color"]),
        0,
        "identical\n",
    );
    assert_output(
        &folder.run(&["diff", "both.exr", "deeper.exr", "--fail", "rmse=0.3"]),
        5,
        "fails: depth: rmse 0.353553 is above 0.3\n",
    );
    let result = folder.run(&["diff", "both.exr", "deeper.exr", "--out", "out.png"]);
    assert_output(&result, 5, "note: out.png: shows layer depth\n");
    assert!(folder.path("out.png").exists());
}

#[test]
fn non_finite_values_are_counted_and_fail() {
    let folder = TestFolder::new();
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let red = |values: &[f32]| {
        let mut channels = gray(&[0.5; 4]);
        channels[0].1 = floats(values);
        channels
    };
    write_exr(&folder, "non-finite.exr", (4, 1), red(&[0.5, nan, inf, -inf]));
    write_exr(&folder, "finite.exr", (4, 1), red(&[0.5; 4]));
    let text = "color: 1 NaN and 2 infinite values in A, 1 and 2 in B, the first at (1, 0)";
    // Files with non-finite values fail even if they are identical, regardless of the limits.
    let diff_with_itself = ["diff", "non-finite.exr", "non-finite.exr"];
    assert_output(&folder.run(&diff_with_itself), 5, text);
    assert_output(
        &folder.run(&[&diff_with_itself[..], &["--fail", "rmse=9"]].concat()),
        5,
        text,
    );
    let result = folder.run(&["diff", "non-finite.exr", "finite.exr", "--json", "--fail", "share=1"]);
    assert_eq!(result.code, 5);
    let layer = &json(&result)["layers"][0];
    assert_eq!(
        layer["not_finite"],
        serde_json::json!({"nan_a": 1, "nan_b": 0, "infinite_a": 2, "infinite_b": 0, "first": {"x": 1, "y": 0}})
    );
    // Pixels with non-finite values count as different; in the other metrics, their difference is 0.
    assert_eq!((&layer["different"], &layer["share"]), (&3.into(), &0.75.into()));
    for metric in ["largest", "rmse", "rel_mse", "flip"] {
        assert_eq!(layer[metric], 0.0, "{metric}");
    }
}

#[test]
fn signed_zeros_differ_by_zero() {
    let folder = TestFolder::new();
    write_exr(&folder, "plus.exr", (1, 1), gray(&[0.0]));
    write_exr(&folder, "minus.exr", (1, 1), gray(&[-0.0]));
    let result = folder.run(&["diff", "plus.exr", "minus.exr"]);
    assert_output(&result, 5, "fails: color: 1 pixel differs\n");
    assert_output(&result, 5, "  largest    0\n");
    assert_output(
        &folder.run(&["diff", "plus.exr", "minus.exr", "--fail", "largest=0"]),
        0,
        "passes\n",
    );
}

#[test]
fn the_share_counts_pixels_above_the_threshold() {
    let folder = TestFolder::new();
    let (a, mut b) = write_two_pngs(&folder);
    b[0] += 1;
    write_8_bit_png(&folder, "b.png", (4, 2), &b);
    write_8_bit_png(&folder, "a.png", (4, 2), &a);
    let share = |threshold: &str| {
        let result = folder.run(&["diff", "a.png", "b.png", "--json", "--threshold", threshold]);
        json(&result)["layers"][0]["share"].as_f64().unwrap()
    };
    // The differences are 1 / 255 = 0.0039 and 10 / 255 = 0.0392.
    assert_eq!((share("0"), share("0.01"), share("0.04")), (0.25, 0.125, 0.0));
    let result = folder.run(&["diff", "a.png", "b.png", "--threshold", "0.01", "--fail", "share=0.1"]);
    assert_output(&result, 5, "fails: color: share over 0.01 0.125 is above 0.1\n");
}

#[test]
fn only_requested_metrics_are_computed() {
    let folder = TestFolder::new();
    write_two_pngs(&folder);
    let result = folder.run(&[
        "diff",
        "a.png",
        "b.png",
        "--json",
        "--metrics",
        "rmse,psnr",
        "--fail",
        "share=1",
    ]);
    assert_eq!(result.code, 0);
    let layer = &json(&result)["layers"][0];
    for (metric, is_present) in [
        ("rmse", true),
        ("psnr", true),
        ("share", true),
        ("ssim", false),
        ("flip", false),
    ] {
        assert_eq!(layer.get(metric).is_some(), is_present, "{metric}");
    }
    let flip = |ppd: &str| {
        let result = folder.run(&["diff", "a.png", "b.png", "--json", "--ppd", ppd]);
        json(&result)["layers"][0]["flip"].as_f64().unwrap()
    };
    assert!(flip("20") > flip("200"));
}

#[test]
fn encodings_of_equal_values_are_equal() {
    use png::{BitDepth, ColorType};
    let folder = TestFolder::new();
    let colors = [
        10, 20, 30, 200, 100, 0, 10, 20, 30, 10, 20, 30, 200, 100, 0, 200, 100, 0, 10, 20, 30, 10, 20, 30,
    ];
    write_8_bit_png(&folder, "rgb.png", (4, 2), &colors);
    // The palette indices are 0 1 0 0 in the first row and 1 1 0 0 in the second.
    write_png(
        &folder,
        "palette.png",
        (4, 2),
        ColorType::Indexed,
        BitDepth::One,
        &[0x40, 0xc0],
    );
    let deep: Vec<u8> = colors.iter().flat_map(|value| [*value, *value]).collect();
    write_png(&folder, "deep.png", (4, 2), ColorType::Rgb, BitDepth::Sixteen, &deep);
    let opaque: Vec<u8> = colors.chunks(3).flat_map(|pixel| [pixel, &[255]].concat()).collect();
    write_8_bit_png(&folder, "opaque.png", (4, 2), &opaque);
    for name in ["palette.png", "deep.png", "opaque.png"] {
        assert_output(&folder.run(&["diff", name, "rgb.png"]), 0, "identical\n");
        assert_output(&folder.run(&["diff", "rgb.png", name]), 0, "identical\n");
    }
    let mut deeper = deep;
    deeper[1] += 1;
    write_png(&folder, "deep.png", (4, 2), ColorType::Rgb, BitDepth::Sixteen, &deeper);
    assert_output(
        &folder.run(&["diff", "deep.png", "rgb.png"]),
        5,
        "1 of 8 pixels, the first at (0, 0)\n",
    );
    let mut translucent = opaque;
    translucent[7] = 254;
    write_8_bit_png(&folder, "translucent.png", (4, 2), &translucent);
    assert_output(
        &folder.run(&["diff", "translucent.png", "rgb.png"]),
        5,
        " in A at (1, 0): 0.996078 instead of 1\n",
    );
    write_8_bit_png(&folder, "gray.png", (2, 1), &[7, 9]);
    write_8_bit_png(&folder, "grays.png", (2, 1), &[7, 7, 7, 9, 9, 9]);
    assert_output(&folder.run(&["diff", "gray.png", "grays.png"]), 0, "identical\n");
    // EXR files with half and float channels: uncompressed and compressed, in scan lines and in tiles.
    let values = [0.5_f32, 1.0, 1.5, 65504.0];
    let halves = FlatSamples::F16(values.map(f16::from_f32).to_vec());
    let half = ["R", "G", "B"].map(|name| (name, halves.clone())).to_vec();
    write_exr(&folder, "float.exr", (4, 1), gray(&values));
    let encodings = [
        Encoding::UNCOMPRESSED,
        Encoding::SMALL_LOSSLESS,
        Encoding::SMALL_FAST_LOSSLESS,
    ];
    for encoding in encodings {
        write_exr_parts(&folder, "half.exr", (4, 1), vec![("", half.clone())], encoding);
        assert_output(&folder.run(&["diff", "half.exr", "float.exr"]), 0, "identical\n");
    }
    let mut changed = values;
    changed[2] = 1.5_f32.next_up();
    write_exr(&folder, "other.exr", (4, 1), gray(&changed));
    assert_output(
        &folder.run(&["diff", "half.exr", "other.exr"]),
        5,
        "1 of 4 pixels, the first at (2, 0)\n",
    );
    let ids = |last: u32| vec![("primitive.ID", FlatSamples::U32(vec![0, last]))];
    write_exr(&folder, "id.exr", (2, 1), ids(u32::MAX));
    write_exr(&folder, "next.exr", (2, 1), ids(u32::MAX - 1));
    assert_output(&folder.run(&["diff", "id.exr", "id.exr"]), 0, "identical\n");
    // IDs are compared as integers: as f32, these two would be equal.
    assert_output(
        &folder.run(&["diff", "id.exr", "next.exr"]),
        5,
        "1 of 2 pixels, the first at (1, 0)\n",
    );
}

#[test]
fn jpegs_and_interlaced_pngs_are_read() {
    let folder = TestFolder::new();
    let jpeg = |name: &str, value: u8| {
        let pixels = vec![value; 16 * 8 * 3];
        image::save_buffer(folder.path(name), &pixels, 16, 8, image::ColorType::Rgb8).unwrap();
    };
    jpeg("a.jpg", 90);
    jpeg("b.jpg", 99);
    write_8_bit_png(
        &folder,
        "decoded.png",
        (16, 8),
        image::open(folder.path("a.jpg")).unwrap().as_bytes(),
    );
    assert_output(&folder.run(&["diff", "a.jpg", "decoded.png"]), 0, "identical\n");
    assert_output(&folder.run(&["diff", "a.jpg", "b.jpg"]), 5, "128 of 128 pixels");
    // An interlaced PNG of two pixels: the first belongs to pass 1, the second to pass 6. Both rows have filter type 0.
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        let body = [kind.as_slice(), data].concat();
        let length = (data.len() as u32).to_be_bytes();
        [length.as_slice(), &body, &crc32fast::hash(&body).to_be_bytes()].concat()
    };
    let data = [0, 10, 20, 30, 0, 40, 50, 60_u8];
    let adler_sums = data.iter().fold((1_u32, 0_u32), |(a, b), byte| {
        (a + u32::from(*byte), b + a + u32::from(*byte))
    });
    let adler = (adler_sums.1 << 16 | adler_sums.0).to_be_bytes();
    let zlib_stream = [&[0x78, 1, 1, 8, 0, 0xf7, 0xff], data.as_slice(), &adler].concat();
    let file = [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &[0, 0, 0, 2, 0, 0, 0, 1, 8, 2, 0, 0, 1]),
        chunk(b"IDAT", &zlib_stream),
        chunk(b"IEND", &[]),
    ];
    fs::write(folder.path("interlaced.png"), file.concat()).unwrap();
    write_8_bit_png(&folder, "plain.png", (2, 1), &[10, 20, 30, 40, 50, 60]);
    assert_output(&folder.run(&["diff", "interlaced.png", "plain.png"]), 0, "identical\n");
}

#[test]
fn parts_of_an_exr_are_layers() {
    let folder = TestFolder::new();
    let parts = |x: f32| vec![("beauty", gray(&[0.5])), ("normal", vec![("X", floats(&[x]))])];
    write_exr_parts(&folder, "a.exr", (1, 1), parts(0.0), Encoding::FAST_LOSSLESS);
    write_exr_parts(&folder, "b.exr", (1, 1), parts(1.0), Encoding::FAST_LOSSLESS);
    let result = folder.run(&["diff", "a.exr", "b.exr"]);
    assert_output(&result, 5, "beauty.R");
    assert_output(&result, 5, "fails: normal: 1 pixel differs\n");
    assert_output(&folder.run(&["diff", "a.exr", "a.exr"]), 0, "identical\n");
}

#[test]
fn an_exr_is_converted_to_a_png_before_it_is_compared_with_a_png() {
    let folder = TestFolder::new();
    for name in ["out.png", "out.exr"] {
        folder.run_quietly(&["render", "small.toml", "--device", "cpu", "-o", name]);
    }
    for arguments in [["diff", "out.png", "out.exr"], ["diff", "out.exr", "out.png"]] {
        let result = folder.run(&arguments);
        assert_output(
            &result,
            0,
            "note: out.exr: linear; converted to a PNG with 8 bits and gamma22 for the comparison\n",
        );
        assert_output(&result, 0, "identical\n");
    }
    folder.run_quietly(&[
        "render",
        "small.toml",
        "--device",
        "cpu",
        "-o",
        "other.png",
        "--seed",
        "1",
    ]);
    assert_output(&folder.run(&["diff", "other.png", "out.exr"]), 5, "fails: color");
}

#[test]
fn standard_input_and_pipes_are_read() {
    let folder = TestFolder::new();
    write_two_pngs(&folder);
    let lines: [(&str, i32); 3] = [
        ("cat a.png | \"$0\" diff - a.png", 0),
        ("cat b.png | \"$0\" diff a.png -", 5),
        ("\"$0\" diff /dev/stdin a.png < a.png", 0),
    ];
    for (line, code) in lines {
        let result = folder.shell("sh", line);
        assert_eq!(result.code, code, "{line}: {}{}", result.stdout, result.stderr);
    }
    assert_output(
        &folder.shell("sh", "printf x | \"$0\" diff - a.png"),
        1,
        "error: standard input: is not an image",
    );
    // A full standard output is an error.
    assert_output(
        &folder.shell("sh", "\"$0\" diff a.png a.png > /dev/full"),
        8,
        "standard output: cannot be written",
    );
}

#[test]
fn the_difference_image_marks_the_location() {
    let folder = TestFolder::new();
    // One bit of one of 500,000 pixels differs.
    let (width, height) = (1000, 500);
    let mut values = vec![60; width * height * 3];
    write_8_bit_png(&folder, "a.png", (width as u32, height as u32), &values);
    values[3 * (123 * width + 456)] ^= 1;
    write_8_bit_png(&folder, "b.png", (width as u32, height as u32), &values);
    let result = folder.run(&["diff", "a.png", "b.png", "--out", "out.png"]);
    assert_output(&result, 5, "the first at (456, 123)\n");
    let (out_width, _, bytes) = super::read_png(&folder.path("out.png"));
    let marker: Vec<(usize, usize)> = (bytes.chunks(3).enumerate())
        .filter(|(_, pixel)| pixel == &[0, 220, 220])
        .map(|(i, _)| (i % out_width as usize, i / out_width as usize))
        .collect();
    let center = |coordinate: fn(&(usize, usize)) -> usize| {
        let values = || marker.iter().map(coordinate);
        let (low, high) = (values().min().unwrap(), values().max().unwrap());
        assert!(high - low < 40, "{low} {high}");
        (low + high) / 2
    };
    // The difference map is to the right of both images. Margins and gaps are 8 pixels wide, and labels have 20 rows.
    let marker_center = (center(|pixel| pixel.0), center(|pixel| pixel.1));
    let expected = (8 + 2 * (width + 8) + 456, 8 + 20 + 123);
    assert!(
        marker_center.0.abs_diff(expected.0) < 20 && marker_center.1.abs_diff(expected.1) < 20,
        "{marker_center:?} {expected:?}"
    );
    // The difference image of identical images has no marker.
    assert_output(
        &folder.run(&["diff", "a.png", "a.png", "--out", "out.png"]),
        0,
        "identical\n",
    );
    let (_, _, bytes) = super::read_png(&folder.path("out.png"));
    assert!(!bytes.chunks(3).any(|pixel| pixel == [0, 220, 220]));
}

#[test]
fn an_unwritable_difference_image_exits_with_8() {
    let folder = TestFolder::new();
    write_two_pngs(&folder);
    let before = folder.read("a.png");
    fs::create_dir(folder.path("folder.png")).unwrap();
    fs::write(folder.path("fixed.png"), "old").unwrap();
    let mut mode = fs::metadata(folder.path("fixed.png")).unwrap().permissions();
    mode.set_readonly(true);
    fs::set_permissions(folder.path("fixed.png"), mode).unwrap();
    for out in ["absent/out.png", "folder.png", "fixed.png", "/dev/full"] {
        let result = folder.run(&["diff", "a.png", "b.png", "--out", out]);
        assert_output(&result, 8, &format!("error: {out}: cannot be written"));
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("a.png", folder.path("link.png")).unwrap();
        assert_output(
            &folder.run(&["diff", "a.png", "b.png", "--out", "link.png"]),
            2,
            "--out: link.png: would overwrite the input a.png",
        );
    }
    assert_eq!(
        (folder.read("a.png"), folder.read("fixed.png")),
        (before, b"old".to_vec())
    );
}

#[test]
fn all_metrics_exist_for_extreme_sizes() {
    let folder = TestFolder::new();
    for (width, height) in [(1, 1), (65536, 1), (1, 65536), (10, 11), (11, 10)] {
        let count = (width * height * 3) as usize;
        write_8_bit_png(&folder, "a.png", (width, height), &vec![50; count]);
        write_8_bit_png(&folder, "b.png", (width, height), &vec![80; count]);
        let result = folder.run(&["diff", "a.png", "b.png", "--json", "--out", "out.png"]);
        assert_eq!(result.code, 5, "{width} x {height}: {}", result.stderr);
        let layer = &json(&result)["layers"][0];
        let metric = |name: &str| layer[name].as_f64().unwrap();
        assert!((metric("rmse") - 30.0 / 255.0).abs() < 1e-12);
        // SSIM of two constant images: (2 a b + C1) / (a² + b² + C1)
        let (a, b) = (50.0 / 255.0, 80.0 / 255.0);
        let expected = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
        assert!((metric("ssim") - expected).abs() < 1e-9, "{width} x {height}");
        assert!(metric("flip") > 0.05 && metric("flip") < 0.5, "{}", metric("flip"));
        image::open(folder.path("out.png")).unwrap();
    }
}
