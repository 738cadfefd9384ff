//! Tests that files of the Basis Universal encoder decode to the texels of the Basis Universal transcoder, and that
//! damaged files are rejected or decoded without a panic.

use std::fs;
use std::path::PathBuf;

use super::*;

/// Output of `tests/textures/ktx2.mjs`.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/textures/ktx2");

fn path(name: &str, extension: &str) -> PathBuf {
    PathBuf::from(FOLDER).join(format!("{name}.{extension}"))
}

fn file(name: &str) -> Vec<u8> {
    fs::read(path(name, "ktx2")).unwrap()
}

fn reference(name: &str) -> RgbaImage {
    image::open(path(name, "png")).unwrap().into_rgba8()
}

fn names() -> Vec<String> {
    let files = fs::read_dir(FOLDER).unwrap().map(|entry| entry.unwrap().path());
    let files = files.filter(|path| path.extension().is_some_and(|extension| extension == "ktx2"));
    files
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect()
}

fn decoded(bytes: &[u8]) -> Result<DynamicImage, String> {
    Ktx2::parse(bytes)?.decode()
}

fn write_at<const N: usize>(bytes: &mut [u8], offset: usize, value: [u8; N]) {
    bytes[offset..offset + N].copy_from_slice(&value);
}

/// Replaces the Zstandard frame of a file; the declared size of the texels does not change.
fn with_frame(frame: &[u8]) -> Vec<u8> {
    let mut bytes = file("zstandard-48x20");
    let level = read_u64(&bytes, INDEX).unwrap() as usize;
    bytes.truncate(level);
    bytes.extend(frame);
    write_at(&mut bytes, INDEX + 8, (frame.len() as u64).to_le_bytes());
    bytes
}

#[test]
fn files_decode_to_the_images_of_the_reference_transcoder() {
    let names = names();
    assert_eq!(names.len(), 12);
    for name in &names {
        let image = decoded(&file(name)).unwrap();
        assert_eq!(image.color().has_alpha(), has_alpha(&file(name)).unwrap(), "{name}");
        // The file uastc-1x1 also has alpha.
        let has_alpha = name.contains("alpha") || name == "uastc-1x1";
        assert_eq!(image.color().has_alpha(), has_alpha, "{name}");
        assert!(image.into_rgba8() == reference(name), "{name}");
    }
    // Checks that the comparison distinguishes different images.
    for [a, b] in [["etc1s-48x20", "zstandard-48x20"], ["etc1s-48x20", "etc1s-48x20-alpha"]] {
        assert!(decoded(&file(a)).unwrap().into_rgba8() != reference(b), "{a} {b}");
    }
    assert_eq!(has_alpha(b"\x89PNG"), None);
}

#[test]
fn truncated_files_are_rejected() {
    for name in names() {
        let bytes = file(&name);
        for length in 0..bytes.len() {
            let error = decoded(&bytes[..length]).unwrap_err();
            assert!(
                error.starts_with("is damaged or truncated: "),
                "{name} {length}: {error}"
            );
        }
    }
}

#[test]
fn invalid_headers_are_rejected() {
    let format_rule =
        "must contain ETC1S texels with BasisLZ, or UASTC texels with or without Zstandard; it has format ";
    let shape_rule = "must contain one 2D image, not an array, a cube map or a volume";
    let damaged = "is damaged or truncated: ";
    for (name, offset, value, expected_start) in [
        ("uastc-5x7-levels", 12, 37, format_rule),
        ("uastc-5x7-levels", 20, 0, shape_rule),
        ("uastc-5x7-levels", 20, 9, damaged),
        ("uastc-5x7-levels", 20, u32::MAX, damaged),
        ("uastc-5x7-levels", 24, 0, shape_rule),
        ("uastc-5x7-levels", 28, 1, shape_rule),
        ("uastc-5x7-levels", 32, 2, shape_rule),
        ("uastc-5x7-levels", 36, 6, shape_rule),
        ("uastc-5x7-levels", 40, 0, damaged),
        ("uastc-5x7-levels", 40, 17, damaged),
        ("uastc-5x7-levels", 40, u32::MAX, damaged),
        ("uastc-5x7-levels", 44, 1, format_rule),
        ("uastc-5x7-levels", 44, 2, damaged),
        ("uastc-5x7-levels", 44, 3, format_rule),
        ("uastc-5x7-levels", 48, u32::MAX, damaged),
        (
            "uastc-5x7-levels",
            52,
            60,
            "must have the channels RGB or RGBA; it has RGB",
        ),
        ("uastc-5x7-levels", 52, u32::MAX, damaged),
        ("uastc-5x7-levels", INDEX + 4, u32::MAX, damaged),
        ("uastc-5x7-levels", INDEX + 8, 0, damaged),
        ("uastc-5x7-levels", INDEX + 8, u32::MAX, damaged),
        ("zstandard-48x20", 44, 0, damaged),
        ("zstandard-48x20", INDEX + 16, u32::MAX, damaged),
        ("zstandard-48x20", INDEX + 20, u32::MAX, damaged),
        ("etc1s-48x20", 44, 0, format_rule),
        ("etc1s-48x20", 64, u32::MAX, damaged),
        ("etc1s-48x20", 68, u32::MAX, damaged),
        ("etc1s-48x20", 72, u32::MAX, damaged),
        ("etc1s-48x20", 72, 0, ""),
        ("etc1s-48x20", INDEX + 16, 1, damaged),
    ] {
        let mut bytes = file(name);
        write_at(&mut bytes, offset, value.to_le_bytes());
        let error = decoded(&bytes).map(|_| String::new()).unwrap_or_else(|error| error);
        assert!(error.starts_with(expected_start), "{name} {offset} {value}: {error}");
        assert!(
            !expected_start.is_empty() || error.is_empty(),
            "{name} {offset} {value}: {error}"
        );
    }
    // A file whose only channel is RRR.
    let mut bytes = file("etc1s-48x20");
    let descriptor = read_u32(&bytes, 48).unwrap() as usize;
    bytes[descriptor + 31] = 3;
    assert_eq!(
        decoded(&bytes).unwrap_err(),
        "must have the channels RGB or RGBA; it has RRR"
    );
}

#[test]
fn zstandard_frames_must_have_the_declared_length() {
    let texels = 48 * 20; // also the size in bytes: UASTC has one byte per texel
    // A frame of blocks that repeat a byte (RFC 8878, section 3.1.1).
    let frame = |window: u8, lengths: &[u32]| {
        let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, window];
        for (i, length) in lengths.iter().enumerate() {
            let is_last = u32::from(i + 1 == lengths.len());
            frame.extend(&(length << 3 | 1 << 1 | is_last).to_le_bytes()[..3]);
            frame.push(0);
        }
        frame
    };
    let error = |frame: &[u8]| decoded(&with_frame(frame)).unwrap_err();
    // Windows of 1 KiB and 8 MiB are accepted; a window of 16 MiB is rejected below. Blocks of zeros decode to black.
    for frame in [
        frame(0, &[texels]),
        frame(13 << 3, &[texels]),
        frame(0, &[1, texels - 1]),
    ] {
        let image = decoded(&with_frame(&frame)).unwrap();
        assert!(image.into_rgb8().iter().all(|value| *value == 0));
    }
    let not_decompressed = "is damaged or truncated: its Zstandard data cannot be decompressed: ";
    for frame in [
        frame(14 << 3, &[texels]),
        frame(0, &[texels - 1]),
        frame(0, &[texels, 1]),
        frame(0, &[texels; 1000]),
        vec![],
        vec![0; 100],
    ] {
        let error = error(&frame);
        assert!(error.starts_with(not_decompressed), "{error}");
    }
}

#[test]
fn randomly_changed_files_do_not_panic() {
    let random = |state: &mut u64| {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (*state >> 33) as usize
    };
    let (mut images, mut errors) = (0, 0);
    for name in names() {
        let valid = file(&name);
        for seed in 0..500 {
            let mut state = seed;
            let mut bytes = valid.clone();
            for _ in 0..1 + random(&mut state) % 3 {
                let offset = random(&mut state) % bytes.len();
                bytes[offset] = [0, 255, random(&mut state) as u8][random(&mut state) % 3];
            }
            let is_small = |file: &Ktx2| file.width.max(file.height) < 1000;
            match Ktx2::parse(&bytes).and_then(|file| {
                if is_small(&file) {
                    file.decode()
                } else {
                    Err(String::new())
                }
            }) {
                Ok(_) => images += 1,
                Err(_) => errors += 1,
            }
        }
    }
    assert!(images > 500 && errors > 500, "images: {images}, errors: {errors}");
}
