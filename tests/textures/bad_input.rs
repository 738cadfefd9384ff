//! Invalid textures and materials: errors with file, line, key, value and rule; exit code 3.

use std::path::Path;
use std::process::Command;

use wgray::scene::{Overrides, Scene, Texels, TextureKind};

use super::{write_exr, write_png};

const PAGE: &str = include_str!("../../docs/scene-format.md");

const SCENE_START: &str = "\
image = { width = 4, height = 4 }
camera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }
";

fn load(folder: &Path, text: &str) -> Result<Scene, String> {
    let path = folder.join("s.toml");
    std::fs::write(&path, format!("{SCENE_START}{text}")).unwrap();
    let strict = Overrides {
        strict: true,
        ..Overrides::default()
    };
    Scene::load_with(&path, &strict).map_err(|error| {
        let message = error.to_string();
        let prefix = format!("{}:", path.display());
        message
            .strip_prefix(&prefix)
            .unwrap_or_else(|| panic!("{message}"))
            .to_string()
    })
}

fn write_files(folder: &Path) {
    let path = |name: &str| folder.join(name);
    write_png(&path("good.png"), 4, 4, |x, _| [x as u8 * 60; 3]);
    write_exr(&path("good.exr"), 4, 4, |x, _| [x as f32; 3]);
    write_exr(&path("nan.exr"), 4, 4, |x, y| {
        [if (x, y) == (2, 1) { f32::NAN } else { 1.0 }; 3]
    });
    write_exr(&path("negative.exr"), 4, 4, |x, y| {
        [if (x, y) == (3, 3) { -0.5 } else { 1.0 }; 3]
    });
    let png = std::fs::read(path("good.png")).unwrap();
    std::fs::write(path("cut.png"), &png[..png.len() / 2]).unwrap();
    std::fs::write(path("head.png"), &png[..12]).unwrap();
    std::fs::write(path("empty.png"), b"").unwrap();
    std::fs::write(path("text.png"), b"no image at all").unwrap();
    std::fs::write(path("named.jpg"), &png).unwrap();
    // The header claims 60000 x 60000 texels.
    let mut huge = png.clone();
    huge[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    let crc = crc32(&huge[12..29]);
    huge[29..33].copy_from_slice(&crc.to_be_bytes());
    std::fs::write(path("huge.png"), &huge).unwrap();
    let mut zero = png;
    zero[16..24].copy_from_slice(&[0, 0, 0, 0, 0, 0, 0, 4]);
    let crc = crc32(&zero[12..29]);
    zero[29..33].copy_from_slice(&crc.to_be_bytes());
    std::fs::write(path("zero.png"), &zero).unwrap();
    std::fs::write(path("zero.hdr"), b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n").unwrap();
    forge_size(&path("good.png"), &path("large.png"), 16_384, 16_384);
    std::fs::create_dir(path("folder.png")).unwrap();
    std::fs::create_dir(path("inner")).unwrap();
    std::fs::copy(path("good.png"), path("inner/good.png")).unwrap();
}

/// Returns the CRC of PNG chunks (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |mut crc, byte| {
        crc ^= u32::from(*byte);
        (0..8).for_each(|_| {
            crc = if crc & 1 == 1 {
                (crc >> 1) ^ 0xedb8_8320
            } else {
                crc >> 1
            }
        });
        crc
    })
}

#[test]
fn invalid_images_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path());
    for valid in ["good.png", "good.exr", "inner/good.png", "inner/../good.png"] {
        load(
            folder.path(),
            &format!("[textures.t]\ntype = 'image'\nfile = '{valid}'"),
        )
        .unwrap();
    }
    for (file, rule) in [
        ("none.png", "cannot be read: "),
        ("", "must be a file"),
        ("folder.png", "must be a file"),
        ("cut.png", "is damaged or truncated: "),
        ("head.png", "is damaged or truncated: "),
        ("huge.png", "must have at most 16384 texels along a side"),
        ("zero.png", "is damaged or truncated: "),
        ("zero.hdr", "must "),
        ("empty.png", "must be a PNG, JPEG, WebP, KTX2, EXR or HDR file"),
        ("text.png", "must be a PNG, JPEG, WebP, KTX2, EXR or HDR file"),
        ("s.toml", "must be a PNG, JPEG, WebP, KTX2, EXR or HDR file"),
        ("named.jpg", "must have the extension of its format, PNG"),
        (
            "nan.exr",
            "has 1 invalid texel, at (2, 1); texel values must be from 0 to 1e6",
        ),
        (
            "negative.exr",
            "has 1 invalid texel, at (3, 3); texel values must be from 0 to 1e6",
        ),
        (
            "large.png",
            "(16384 x 16384 texels) needs 1365.3 MiB, in addition to 0.0 MiB for the previous textures; the limit is 1024.0 MiB",
        ),
        ("/etc/hostname", "lies outside of "),
        ("../", "lies outside of "),
    ] {
        let message = load(folder.path(), &format!("[textures.t]\ntype = 'image'\nfile = '{file}'")).unwrap_err();
        let prefix = format!("5: textures.t.file: {file:?} {rule}");
        assert!(message.starts_with(&prefix), "{message}\n{prefix}");
    }
}

#[cfg(unix)]
#[test]
fn links_that_leave_the_folder_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let outside = tempfile::tempdir().unwrap();
    write_png(&outside.path().join("good.png"), 2, 2, |_, _| [1; 3]);
    std::os::unix::fs::symlink(outside.path().join("good.png"), folder.path().join("link.png")).unwrap();
    let text = "[textures.t]\ntype = 'image'\nfile = 'link.png'";
    assert!(load(folder.path(), text).unwrap_err().contains("lies outside of"));
    let overrides = Overrides {
        asset_root: Some("/".into()),
        ..Overrides::default()
    };
    Scene::load_with(folder.path().join("s.toml"), &overrides).unwrap();
}

/// Copies a PNG with another size in its header, which is checked before decoding.
fn forge_size(from: &Path, to: &Path, width: u32, height: u32) {
    let mut png = std::fs::read(from).unwrap();
    png[16..20].copy_from_slice(&width.to_be_bytes());
    png[20..24].copy_from_slice(&height.to_be_bytes());
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    std::fs::write(to, &png).unwrap();
}

#[test]
fn the_total_size_of_images_is_limited() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::new(512, 512)
        .save(folder.path().join("a.png"))
        .unwrap();
    forge_size(
        &folder.path().join("a.png"),
        &folder.path().join("huge.png"),
        16_384,
        16_384,
    );
    forge_size(
        &folder.path().join("a.png"),
        &folder.path().join("fits.png"),
        16_384,
        4_000,
    );
    let texture = |name: &str, file: &str, filter: &str| {
        format!("[textures.{name}]\ntype = 'image'\nfilter = '{filter}'\nfile = '{file}'\n")
    };
    let error = |text: &str| load(folder.path(), text).unwrap_err();
    let small_texture = texture("a", "a.png", "nearest");
    assert_eq!(
        error(&(small_texture.clone() + &texture("b", "huge.png", "nearest"))),
        "10: textures.b.file: \"huge.png\" (16384 x 16384 texels) needs 1024.0 MiB, in addition to 1.0 MiB for the previous textures; \
         the limit is 1024.0 MiB"
    );
    // The size is within the limit, so the image is decoded, which detects the truncation.
    assert!(error(&texture("b", "fits.png", "ewa")).contains("is damaged or truncated"));
}

#[test]
fn files_are_loaded_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("inner")).unwrap();
    write_png(&folder.path().join("a.png"), 64, 32, |x, y| [x as u8, y as u8, 7]);
    let image = |name: &str, file: &str, keys: &str| {
        format!(
            "[textures.{name}]\ntype = 'image'\nfile = '{file}'\n{keys}\n[materials.{name}]\ntype = 'phong'\n\
             color = {{ texture = '{name}' }}\n"
        )
    };
    let pack = |text: &str| wgray_render::pack::pack(&load(folder.path(), text).unwrap());
    let one_texture = pack(&image("a", "a.png", ""));
    let three_textures = pack(&format!(
        "{}{}{}",
        image("a", "a.png", "filter = 'nearest'"),
        image("b", "inner/../a.png", "wrap = 'clamp'"),
        image("c", "./a.png", "filter = 'trilinear'\nencoding = 'srgb'"),
    ));
    assert_eq!(three_textures.textures.texels, one_texture.textures.texels);
    let levels: Vec<u32> = three_textures
        .textures
        .records
        .iter()
        .map(|texture| texture.levels)
        .collect();
    assert_eq!((three_textures.textures.records.len(), levels), (3, vec![1, 7, 7]));
    // Another encoding needs other mip levels.
    let two_encodings = pack(&(image("a", "a.png", "") + &image("b", "a.png", "encoding = 'linear'")));
    assert_eq!(
        two_encodings.textures.texels.len(),
        2 * one_texture.textures.texels.len()
    );
}

#[test]
fn gray_palette_and_alpha_images_are_decoded() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_png(&path("rgb.png"), 4, 4, |x, y| [(60 * x + y) as u8; 3]);
    image::GrayImage::from_fn(4, 4, |x, y| image::Luma([(60 * x + y) as u8]))
        .save(path("gray.png"))
        .unwrap();
    image::GrayAlphaImage::from_fn(4, 4, |x, y| image::LumaA([(60 * x + y) as u8, x as u8]))
        .save(path("gray_alpha.png"))
        .unwrap();
    image::RgbaImage::from_fn(4, 4, |x, y| {
        let value = (60 * x + y) as u8;
        image::Rgba([value, value, value, y as u8])
    })
    .save(path("rgba.png"))
    .unwrap();
    let mut palette = png::Encoder::new(std::fs::File::create(path("palette.png")).unwrap(), 4, 4);
    palette.set_color(png::ColorType::Indexed);
    palette.set_depth(png::BitDepth::Four);
    palette.set_palette(
        (0..16)
            .flat_map(|i| [(60 * (i / 4) + i % 4) as u8; 3])
            .collect::<Vec<u8>>(),
    );
    let rows: Vec<u8> = (0..4)
        .flat_map(|y| [y << 4 | (4 + y), (8 + y) << 4 | (12 + y)])
        .collect();
    palette.write_header().unwrap().write_image_data(&rows).unwrap();
    let texels = |name: &str| {
        let material = "[materials.m]\ntype = 'phong'\ncolor = { texture = 't' }\n";
        let text = format!("[textures.t]\ntype = 'image'\nfile = '{name}.png'\n{material}");
        wgray_render::pack::pack(&load(folder.path(), &text).unwrap())
            .textures
            .texels
    };
    for name in ["gray", "gray_alpha", "rgba", "palette"] {
        assert_eq!(texels(name), texels("rgb"), "{name}");
    }
    // 16-bit sRGB channels are decoded to linear floats, without rounding to 8 bits.
    let gray_16_bit = |x: u32| image::Luma([257 * (60 * x) as u16]);
    image::ImageBuffer::from_fn(4, 4, |x, _| gray_16_bit(x))
        .save(path("deep.png"))
        .unwrap();
    let red = f32::from_bits(texels("deep")[3 + 3]); // the table of three levels comes first
    let value: f64 = 60.0 / 255.0;
    assert!(
        (f64::from(red) - ((value + 0.055) / 1.055).powf(2.4)).abs() < 1e-6,
        "{red}"
    );
}

#[test]
fn invalid_values_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path());
    let image = "[textures.t]\ntype = 'image'\nfile = 'good.png'\n";
    let checker = "[textures.t]\ntype = 'checker'\neven = [0, 0, 0]\nodd = [1, 1, 1]\n";
    let grid = "[textures.t]\ntype = 'grid'\ncell = [0, 0, 0]\nline = [1, 1, 1]\n";
    let linear = "[textures.t]\ntype = 'image'\nfile = 'good.png'\nencoding = 'linear'\n";
    let mapped = "[materials.m]\ntype = 'phong'\ncolor = [1, 1, 1]\nnormal_map = { texture = 't' }\n";
    let triangle = "[[shapes]]\ntype = 'triangle'\nmaterial = 'm'\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n";
    for (text, expected) in [
        (
            format!("{image}filter = 'sharp'"),
            "6: textures.t.filter: \"sharp\" must be one of \"nearest\", \"bilinear\", \"trilinear\", \"ewa\"",
        ),
        (
            format!("{image}wrap = 'around'"),
            "6: textures.t.wrap: \"around\" must be one of \"repeat\", \"clamp\", \"mirror\"",
        ),
        (
            format!("{image}encoding = 'log'"),
            "6: textures.t.encoding: \"log\" must be \"srgb\" or \"linear\"",
        ),
        (
            format!("{image}max_anisotropy = 0.5"),
            "6: textures.t.max_anisotropy: 0.5 must be from 1 to 64",
        ),
        (
            format!("{image}max_anisotropy = nan"),
            "6: textures.t.max_anisotropy: nan must be from 1 to 64",
        ),
        (
            format!("{image}factor = [1, 1, 1, -1]"),
            "6: textures.t.factor: -1 must be from 0 to 1e6",
        ),
        (
            format!("{image}factor = [1, 2e6, 1, 1]"),
            "6: textures.t.factor: 2e6 must be from 0 to 1e6",
        ),
        (
            format!("{image}factor = [1, 1, 1]"),
            "6: textures.t.factor: [1, 1, 1] must be a list of 4 numbers",
        ),
        (
            format!("{image}uv_set = 8"),
            "6: textures.t.uv_set: 8 must be from 0 to 7",
        ),
        (
            format!("{image}uv_set = -1"),
            "6: textures.t.uv_set: -1 must be a whole number from 0 to 7",
        ),
        (
            format!("{image}scale = [1, 0]"),
            "6: textures.t.scale: [1, 0] must have magnitudes from 1e-6 to 1e6",
        ),
        (
            format!("{image}scale = [inf, 1]"),
            "6: textures.t.scale: [inf, 1] must have magnitudes from 1e-6 to 1e6",
        ),
        (
            format!("{image}offset = [0, 2e6]"),
            "6: textures.t.offset: [0, 2e6] must be from -1e6 to 1e6",
        ),
        (
            format!("{image}rotate = 400"),
            "6: textures.t.rotate: 400 must be from -360 to 360",
        ),
        (format!("{image}blur = 1"), "6: textures.t.blur: unknown key"),
        ("[textures.t]\ntype = 'image'".into(), "3: textures.t.file is missing"),
        (
            "[textures.t]\ntype = 'image'\nfile = 'good.exr'\nencoding = 'srgb'".into(),
            "5: textures.t.file: the encoding of \"good.exr\" must not be \"srgb\": EXR files are linear",
        ),
        (
            "[textures.t]\ntype = 'noise'".into(),
            "4: textures.t.type: \"noise\" must be one of \"constant\", \"checker\", \"grid\", \"image\"",
        ),
        (
            "[textures.t]\ntype = 'constant'\ncolor = [0, -1, 0]".into(),
            "5: textures.t.color: -1 must be from 0 to 1e6",
        ),
        (
            checker.replace("[1, 1, 1]", "[1, nan, 1]"),
            "6: textures.t.odd: nan must be from 0 to 1e6",
        ),
        (
            format!("{grid}line_width = 0"),
            "7: textures.t.line_width: 0 must be greater than 0 and less than 1",
        ),
        (
            format!("{grid}line_width = 1"),
            "7: textures.t.line_width: 1 must be greater than 0 and less than 1",
        ),
        (
            "[materials.m]\ntype = 'phong'\ncolor = { texture = 't' }".into(),
            "5: materials.m.color.texture: there is no texture \"t\"; the scene has none",
        ),
        (
            format!("{image}[materials.m]\ntype = 'phong'\ncolor = {{ texture = 'u' }}"),
            "8: materials.m.color.texture: there is no texture \"u\"; the scene has \"t\"",
        ),
        (
            "[materials.m]\ntype = 'phong'\ncolor = 'red'".into(),
            "5: materials.m.color: \"red\" must be a list of 3 numbers or { texture = NAME }",
        ),
        (
            "[materials.m]\ntype = 'phong'\ncolor = [1, 'a', 1]".into(),
            "5: materials.m.color[1]: \"a\" must be a number",
        ),
        (
            "[materials.m]\ntype = 'phong'\ncolor = [1, 1]".into(),
            "5: materials.m.color: [1, 1] must be a list of 3 numbers",
        ),
        (
            "[materials.m]\ntype = 'phong'\ncolor = { texture = 't', tint = 1 }".into(),
            "5: materials.m.color.tint: unknown key; expected one of \"texture\"",
        ),
        (
            "[materials.m]\ntype = 'glass'\nior = 0".into(),
            "5: materials.m.ior: 0 must be from 0.01 to 100",
        ),
        (
            "[materials.m]\ntype = 'glass'\nior = -1.5".into(),
            "5: materials.m.ior: -1.5 must be from 0.01 to 100",
        ),
        (
            "[materials.m]\ntype = 'glass'\nior = nan".into(),
            "5: materials.m.ior: nan must be from 0.01 to 100",
        ),
        ("[materials.m]\ntype = 'glass'".into(), "3: materials.m.ior is missing"),
        (
            "[materials.m]\ntype = 'mirror'\ntint = [1, 1, 2]".into(),
            "5: materials.m.tint: 2 must be from 0 to 1",
        ),
        (
            "render = { max_depth = 0 }".into(),
            "3: render.max_depth: 0 must be from 1 to 64",
        ),
        (
            "render = { max_depth = 65 }".into(),
            "3: render.max_depth: 65 must be from 1 to 64",
        ),
        (
            "render = { shadows = 'none' }".into(),
            "3: render.shadows: \"none\" must be \"opaque\" or \"transparent\"",
        ),
        (
            format!("{image}{mapped}"),
            "9: materials.m.normal_map.texture: \"t\" is used as a normal map; its encoding must be \"linear\"",
        ),
        (
            format!("{checker}{mapped}"),
            "10: materials.m.normal_map.texture: \"t\" must be a texture of type \"image\"",
        ),
        (
            format!("{linear}{mapped}{triangle}"),
            "13: shapes[0].material: \"m\" must have no normal map here, because this shape has no tangents",
        ),
        (
            format!("{linear}{}", mapped.replace("'t'", "'t', strength = -101")),
            "10: materials.m.normal_map.strength: -101 must be from -100 to 100",
        ),
    ] {
        let message = load(folder.path(), &text).expect_err(&text);
        assert!(message.starts_with(expected), "{message}\n{expected}");
    }
    load(folder.path(), &format!("{linear}{mapped}")).unwrap();
}

#[test]
fn the_command_line_ends_with_exit_code_3() {
    let folder = tempfile::tempdir().unwrap();
    write_files(folder.path());
    let check = |text: &str| {
        let _ = load(folder.path(), text);
        Command::new(env!("CARGO_BIN_EXE_wgray"))
            .args(["check", "--strict"])
            .arg(folder.path().join("s.toml"))
            .output()
            .unwrap()
    };
    let rejected = check("[textures.t]\ntype = 'image'\nfile = 'cut.png'");
    assert_eq!(rejected.status.code(), Some(3), "{rejected:?}");
    assert!(
        String::from_utf8_lossy(&rejected.stderr)
            .contains("s.toml:5: textures.t.file: \"cut.png\" is damaged or truncated")
    );
    let accepted = check("[textures.t]\ntype = 'image'\nfile = 'good.png'");
    assert_eq!(accepted.status.code(), Some(0), "{accepted:?}");
}

/// Covers every key whose documented type is "number or texture".
#[test]
fn only_images_have_an_alpha_channel() {
    let folder = tempfile::tempdir().unwrap();
    image::GrayAlphaImage::from_fn(4, 4, |x, _| image::LumaA([60 * x as u8, 255 - x as u8]))
        .save(folder.path().join("a.png"))
        .unwrap();
    write_png(&folder.path().join("opaque.png"), 4, 4, |x, _| [x as u8 * 60; 3]);
    let mut keys = Vec::new();
    for section in PAGE.split("\n### `[materials.NAME]` of type `\"").skip(1) {
        let (kind, section) = section.split_once('"').unwrap();
        let section = section.split("\n#").next().unwrap();
        let required_keys = match kind {
            "diffuse" => "color = [1, 1, 1]",
            "dielectric" => "ior = 1.5",
            _ => "",
        };
        for row in section.lines().filter(|row| row.contains("number or texture")) {
            let key = row.split('`').nth(1).unwrap();
            let scene = |texture: &str| {
                let text = format!(
                    "render.integrator = 'path'\n[materials.m]\ntype = '{kind}'\n{required_keys}\n\
                     {key} = {{ texture = 't', channel = 'a' }}\n[textures.t]\n{texture}\n"
                );
                load(folder.path(), &text)
            };
            let expected = |rule: &str| format!("7: materials.m.{key}.channel: {rule}");
            for texture in [
                "type = 'constant'\ncolor = [1, 1, 1]",
                "type = 'checker'\neven = [0, 0, 0]\nodd = [1, 1, 1]",
                "type = 'grid'\ncell = [0, 0, 0]\nline = [1, 1, 1]\nline_width = 0.1",
            ] {
                let rule = "\"t\" must be a texture of type \"image\" to have an alpha channel";
                assert_eq!(scene(texture).unwrap_err(), expected(rule), "{kind}");
            }
            let rule = "\"opaque.png\" must have an alpha channel";
            let message = scene("type = 'image'\nfile = 'opaque.png'").unwrap_err();
            assert_eq!(message, expected(rule), "{kind}");
            let scene = scene("type = 'image'\nfile = 'a.png'").unwrap();
            let TextureKind::Image { image, .. } = &scene.textures[1].kind else {
                panic!("{kind}.{key}: no image");
            };
            let Texels::Bytes(_, texels) = &image.texels else {
                panic!("{kind}.{key}: no bytes");
            };
            assert_eq!(texels[..4], [[255; 3], [254; 3], [253; 3], [252; 3]], "{kind}.{key}");
            keys.push(format!("{kind}.{key}"));
        }
    }
    for key in [
        "diffuse.roughness",
        "conductor.roughness",
        "dielectric.roughness",
        "principled.alpha",
    ] {
        assert!(keys.iter().any(|listed| listed == key), "{key} is not among {keys:?}");
    }
}
