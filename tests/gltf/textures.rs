//! glTF textures: images, samplers, texture coordinates, channels, normal maps.

use serde_json::{Value, json};
use wgray::{Aov, ChannelValues, Device, Options, Scene};

use super::build::{Builder, Component, Packing, QUAD, QUAD_INDICES, QUAD_UVS, png};
use super::read::{assert_all, load_scene, pixels, scene};
use crate::test_folder::TestFolder;

const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];
const WHITE: [u8; 4] = [255; 4];

fn add_textured_quad(builder: &mut Builder, info: Value) {
    let material = builder.unlit(json!({ "baseColorTexture": info }));
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
}

/// Asserts the colors of the quarters of the image: top left, top right, bottom left, bottom right.
#[track_caller]
fn assert_quarters(scene: &Scene, expected: [[u8; 4]; 4]) {
    let pixels = pixels(scene);
    for (i, pixel) in pixels.iter().enumerate() {
        let quarter = 2 * (i / 18) + i % 6 / 3;
        let texel = expected[quarter];
        let color = [0, 1, 2].map(|k| f32::from(texel[k]) / 255.0);
        assert_eq!(*pixel, color, "pixel {i} of {pixels:?}");
    }
}

#[test]
fn the_first_texel_is_at_the_upper_left() {
    let mut builder = Builder::new();
    let texture = builder.texture(2, &[RED, GREEN, BLUE, WHITE]);
    add_textured_quad(&mut builder, json!({ "index": texture }));
    assert_quarters(&scene(&builder, "texture"), [RED, GREEN, BLUE, WHITE]);
}

#[test]
fn images_may_be_in_the_buffer_in_their_own_files_or_in_a_data_uri() {
    let bytes = png(2, &[RED, GREEN, BLUE, WHITE]);
    let folder = TestFolder::with_file("a", "");
    for uri in ["my%20image.png", "data"] {
        let data = format!("data:image/png;base64,{}", super::build::base64(&bytes));
        let uri = if uri == "data" { data.as_str() } else { uri };
        let mut builder = Builder::new();
        let image = builder.add("images", json!({ "uri": uri }));
        let sampler = builder.add("samplers", json!({ "magFilter": 9728 }));
        let texture = builder.add("textures", json!({ "source": image, "sampler": sampler }));
        add_textured_quad(&mut builder, json!({ "index": texture }));
        let name = if uri.len() < 20 { "image-beside" } else { "image-data" };
        for image_folder in [
            Some(folder.folder().to_owned()),
            std::env::var_os("WGRAY_TEST_GLTF").map(Into::into),
        ] {
            let write = |image_folder: std::path::PathBuf| std::fs::write(image_folder.join("my image.png"), &bytes);
            image_folder.map(write).transpose().expect("a file");
        }
        let file = builder.write(folder.folder(), name, Packing::Embedded);
        assert_quarters(&load_scene(&file, ""), [RED, GREEN, BLUE, WHITE]);
    }
}

#[test]
fn jpeg_and_webp_are_read() {
    let rgb: Vec<u8> = [RED, GREEN, BLUE, WHITE]
        .iter()
        .flat_map(|texel| [texel[0], texel[1], texel[2]])
        .collect();
    let mut webp = Vec::new();
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut webp);
    encoder
        .encode(&rgb, 2, 2, image::ExtendedColorType::Rgb8)
        .expect("WebP");
    let mut builder = Builder::new();
    builder.requires("EXT_texture_webp");
    let image = builder.image(&webp, "image/webp");
    let sampler = builder.add("samplers", json!({ "magFilter": 9728 }));
    let texture = json!({ "sampler": sampler, "extensions": { "EXT_texture_webp": { "source": image } } });
    let texture = builder.add("textures", texture);
    add_textured_quad(&mut builder, json!({ "index": texture }));
    assert_quarters(&scene(&builder, "webp"), [RED, GREEN, BLUE, WHITE]);
    // A JPEG file stores blocks of 8 x 8 texels of one color with a small error.
    let large: Vec<u8> = (0..256).flat_map(|i| [[255, 0, 0], [255; 3]][(i / 8) % 2]).collect();
    let mut jpeg = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 100);
    encoder
        .encode(&large, 16, 16, image::ExtendedColorType::Rgb8)
        .expect("JPEG");
    let mut builder = Builder::new();
    let image = builder.image(&jpeg, "image/jpeg");
    let texture = builder.add("textures", json!({ "source": image }));
    add_textured_quad(&mut builder, json!({ "index": texture }));
    let pixels = pixels(&scene(&builder, "jpeg"));
    let is_near = |pixel: [f32; 3], expected: [f32; 3]| (0..3).all(|k| (pixel[k] - expected[k]).abs() < 0.02);
    assert!(
        is_near(pixels[1], [1.0, 0.0, 0.0]) && is_near(pixels[4], [1.0; 3]),
        "{pixels:?}"
    );
}

/// Reads a file that `tests/textures/ktx2.mjs` wrote.
fn ktx2_file(name: &str) -> Vec<u8> {
    std::fs::read(crate::sources::path(&format!("tests/textures/ktx2/{name}"))).expect("a file")
}

/// Returns an unlit quad with the image as its texture. KTX2 images are referenced through `KHR_texture_basisu`.
fn with_image(bytes: &[u8], mime_type: &str, material_keys: &Value) -> Builder {
    let mut builder = Builder::new();
    let image = builder.image(bytes, mime_type);
    let sampler = builder.add("samplers", json!({ "magFilter": 9728 }));
    let texture = match mime_type {
        "image/ktx2" => {
            builder.requires("KHR_texture_basisu");
            json!({ "sampler": sampler, "extensions": { "KHR_texture_basisu": { "source": image } } })
        }
        _ => json!({ "sampler": sampler, "source": image }),
    };
    let texture = builder.add("textures", texture);
    let material = builder.unlit(json!({ "baseColorTexture": { "index": texture } }));
    for (key, value) in material_keys.as_object().expect("a table") {
        builder.get("materials")[material][key] = value.clone();
    }
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    builder
}

#[test]
fn ktx2_files_are_read() {
    // UASTC represents a block of one color exactly.
    let builder = with_image(&ktx2_file("zstandard-quarters.ktx2"), "image/ktx2", &json!({}));
    assert_quarters(&scene(&builder, "zstandard-quarters"), [RED, GREEN, BLUE, WHITE]);
    // For each of these KTX2 files, a PNG file contains the same texels.
    let blend = json!({ "alphaMode": "BLEND" });
    let mut images = Vec::new();
    for name in ["etc1s-48x20-alpha", "uastc-48x20-alpha", "etc1s-quarters"] {
        let [ktx2, png] = [("ktx2", "image/ktx2"), ("png", "image/png")].map(|(extension, mime_type)| {
            let builder = with_image(&ktx2_file(&format!("{name}.{extension}")), mime_type, &blend);
            pixels(&scene(&builder, &format!("{name}-{extension}")))
        });
        assert_eq!(ktx2, png, "{name}");
        images.push(ktx2);
    }
    assert!(
        images[0] != images[1] && images[0] != images[2],
        "the textures are equal"
    );
}

#[test]
fn base_color_is_srgb_and_multiplied_by_its_factor() {
    let mut builder = Builder::new();
    let texture = builder.constant_texture([128, 255, 64, 255]);
    let pbr = json!({ "baseColorTexture": { "index": texture }, "baseColorFactor": [0.5, 0.25, 1, 1] });
    let material = builder.unlit(pbr);
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    // The sRGB transfer function (IEC 61966-2-1).
    let to_linear = |byte: f64| ((byte / 255.0 + 0.055) / 1.055).powf(2.4);
    assert_all(
        &scene(&builder, "srgb"),
        [0.5 * to_linear(128.0), 0.25, to_linear(64.0)],
    );
}

#[test]
fn textures_wrap_as_their_sampler_specifies() {
    // u from -1 to 2: each third of the row is one repetition.
    let (r, g) = (RED, GREEN);
    for (mode, row) in [
        (10497, [r, g, r, g, r, g]),
        (33648, [g, r, r, g, g, r]),
        (33071, [r, r, r, g, g, g]),
    ] {
        let mut builder = Builder::new();
        let texture = builder.texture(2, &[RED, GREEN, RED, GREEN]);
        builder.get("samplers")[0]["wrapS"] = json!(mode);
        let uvs = QUAD_UVS.map(|[u, v]| [3.0 * u - 1.0, v]);
        let position = builder.floats(&QUAD);
        let uv = builder.floats(&uvs);
        let material = builder.unlit(json!({ "baseColorTexture": { "index": texture } }));
        let mesh = builder.quad_with(json!({ "POSITION": position, "TEXCOORD_0": uv }), Some(material));
        builder.root_node(json!({ "mesh": mesh }));
        let expected = row.map(|texel: [u8; 4]| [0, 1, 2].map(|k| f32::from(texel[k]) / 255.0));
        assert_eq!(
            pixels(&scene(&builder, &format!("wrap-{mode}")))[..6],
            expected,
            "{mode}"
        );
    }
}

#[test]
fn each_direction_may_have_its_own_wrap_mode() {
    let mut builder = Builder::new();
    let texture = builder.texture(2, &[RED, GREEN, BLUE, WHITE]);
    builder.get("samplers")[0]["wrapS"] = json!(10497);
    builder.get("samplers")[0]["wrapT"] = json!(33071);
    let position = builder.floats(&QUAD);
    let uv = builder.floats(&QUAD_UVS.map(|[u, v]| [3.0 * u - 1.0, 3.0 * v - 1.0]));
    let material = builder.unlit(json!({ "baseColorTexture": { "index": texture } }));
    let mesh = builder.quad_with(json!({ "POSITION": position, "TEXCOORD_0": uv }), Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    let pixels = pixels(&scene(&builder, "wrap-both"));
    let top = [RED, GREEN, RED, GREEN, RED, GREEN].map(|texel| [0, 1, 2].map(|k| f32::from(texel[k]) / 255.0));
    let bottom = [BLUE, WHITE, BLUE, WHITE, BLUE, WHITE].map(|texel| [0, 1, 2].map(|k| f32::from(texel[k]) / 255.0));
    // v is clamped: the first and last texel rows extend.
    for (i, row) in pixels.chunks(6).enumerate() {
        assert_eq!(row, if i < 3 { top } else { bottom }, "row {i}");
    }
}

#[test]
fn a_texture_may_use_another_set_of_coordinates() {
    for set in [1, 2] {
        let mut builder = Builder::new();
        let texture = builder.texture(2, &[RED, GREEN, BLUE, WHITE]);
        let mut attributes = builder.quad_attributes();
        attributes["TEXCOORD_1"] = json!(builder.floats(&QUAD_UVS.map(|[u, v]| [1.0 - u, v])));
        attributes["TEXCOORD_2"] = json!(builder.floats(&QUAD_UVS.map(|[u, v]| [u, 1.0 - v])));
        let material = builder.unlit(json!({ "baseColorTexture": { "index": texture, "texCoord": set } }));
        let mesh = builder.quad_with(attributes, Some(material));
        builder.root_node(json!({ "mesh": mesh }));
        let expected = if set == 1 {
            [GREEN, RED, WHITE, BLUE]
        } else {
            [BLUE, WHITE, RED, GREEN]
        };
        assert_quarters(&scene(&builder, &format!("uv-set-{set}")), expected);
    }
}

#[test]
fn missing_texture_coordinates_are_reported() {
    let mut builder = Builder::new();
    let texture = builder.texture(2, &[RED, GREEN, BLUE, WHITE]);
    let material = builder.unlit(json!({ "baseColorTexture": { "index": texture, "texCoord": 1 } }));
    let attributes = builder.quad_attributes();
    let mesh = builder.quad_with(attributes, Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    let notes = scene(&builder, "no-coordinates").notes;
    let message = "meshes[0].primitives[0] has no TEXCOORD_1, which its material needs";
    assert!(notes.iter().any(|note| note.message.contains(message)), "{notes:?}");
}

fn transformed(name: &str, transform: Value) -> Scene {
    let mut builder = Builder::new();
    builder.uses("KHR_texture_transform");
    let texture = builder.texture(2, &[RED, GREEN, BLUE, WHITE]);
    let mut attributes = builder.quad_attributes();
    attributes["TEXCOORD_1"] = json!(builder.floats(&QUAD_UVS.map(|[u, v]| [1.0 - u, v])));
    let info = json!({ "index": texture, "extensions": { "KHR_texture_transform": transform } });
    let material = builder.unlit(json!({ "baseColorTexture": info }));
    let mesh = builder.quad_with(attributes, Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    scene(&builder, name)
}

#[test]
fn texture_transforms_follow_khr_texture_transform() {
    let quarter_turn = std::f64::consts::FRAC_PI_2;
    assert_quarters(&transformed("transform-none", json!({})), [RED, GREEN, BLUE, WHITE]);
    assert_quarters(
        &transformed("transform-offset", json!({ "offset": [0.5, 0] })),
        [GREEN, RED, WHITE, BLUE],
    );
    assert_quarters(
        &transformed("transform-offset-v", json!({ "offset": [0, 0.5] })),
        [BLUE, WHITE, RED, GREEN],
    );
    assert_quarters(
        &transformed("transform-scale", json!({ "scale": [0.5, 0.5] })),
        [RED; 4],
    );
    let lower = json!({ "offset": [0.5, 0.5], "scale": [0.5, 0.5] });
    assert_quarters(&transformed("transform-lower", lower), [WHITE; 4]);
    // Examples of the extension's specification: clockwise rotations of the full image and of a quarter, and a flip.
    let rotated = json!({ "offset": [0, 1], "rotation": quarter_turn });
    assert_quarters(&transformed("transform-turn", rotated), [BLUE, RED, WHITE, GREEN]);
    let rotated = json!({ "offset": [0, 1], "rotation": quarter_turn, "scale": [0.5, 0.5] });
    assert_quarters(&transformed("transform-turn-quarter", rotated), [BLUE; 4]);
    let flipped = json!({ "offset": [0, 1], "scale": [1, -1] });
    assert_quarters(&transformed("transform-flip", flipped), [BLUE, WHITE, RED, GREEN]);
    // The scale is applied before the rotation.
    let scaled_and_rotated = json!({ "offset": [0, 1], "rotation": quarter_turn, "scale": [0.5, 1] });
    assert_quarters(
        &transformed("transform-order", scaled_and_rotated),
        [BLUE, BLUE, WHITE, WHITE],
    );
    // `texCoord` of the transform takes precedence.
    assert_quarters(
        &transformed("transform-set", json!({ "texCoord": 1 })),
        [GREEN, RED, WHITE, BLUE],
    );
}

/// A material with a texture of one color, and the equivalent material without a texture.
struct Case {
    name: &'static str,
    texel: [u8; 4],
    /// `TEXTURE` stands for the reference to the texture.
    textured: Value,
    plain: Value,
}

fn cases() -> Vec<Case> {
    let pbr = |value: Value| json!({ "pbrMetallicRoughness": value });
    let dielectric = |name: &str, value: Value| json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.5 }, "extensions": { name: value } });
    let metal = |name: &str, value: Value| json!({ "pbrMetallicRoughness": { "metallicFactor": 1, "roughnessFactor": 0.3 }, "extensions": { name: value } });
    let case = |name, texel, textured, plain| Case {
        name,
        texel,
        textured,
        plain,
    };
    // The component of an anisotropy direction that the byte 128 encodes.
    let near_zero: f64 = 128.0 / 255.0 * 2.0 - 1.0;
    // The emissive materials are delta-specular, because NEE samples textured emission in a different way.
    vec![
        case(
            "base-color",
            [255, 0, 255, 255],
            pbr(json!({ "baseColorTexture": "TEXTURE", "baseColorFactor": [0.5, 0.5, 0.25, 1], "metallicFactor": 0 })),
            pbr(json!({ "baseColorFactor": [0.5, 0, 0.25, 1], "metallicFactor": 0 })),
        ),
        case(
            "metallic-roughness",
            [0, 102, 51, 255],
            pbr(json!({ "metallicRoughnessTexture": "TEXTURE", "metallicFactor": 0.5, "roughnessFactor": 0.75 })),
            pbr(json!({ "metallicFactor": 0.1, "roughnessFactor": 0.3 })),
        ),
        case(
            "emissive",
            [255, 0, 255, 255],
            json!({
                "emissiveTexture": "TEXTURE", "emissiveFactor": [0.5, 1, 0.25],
                "pbrMetallicRoughness": { "roughnessFactor": 0 },
            }),
            json!({ "emissiveFactor": [0.5, 0, 0.25], "pbrMetallicRoughness": { "roughnessFactor": 0 } }),
        ),
        case(
            "emissive-strong",
            [255, 0, 255, 255],
            json!({
                "emissiveTexture": "TEXTURE", "emissiveFactor": [0.5, 1, 0.25],
                "pbrMetallicRoughness": { "roughnessFactor": 0 },
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 } },
            }),
            json!({
                "emissiveFactor": [0.5, 0, 0.25], "pbrMetallicRoughness": { "roughnessFactor": 0 },
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 } },
            }),
        ),
        case(
            "specular",
            [255, 255, 255, 51],
            dielectric(
                "KHR_materials_specular",
                json!({ "specularTexture": "TEXTURE", "specularFactor": 0.5 }),
            ),
            dielectric("KHR_materials_specular", json!({ "specularFactor": 0.1 })),
        ),
        case(
            "specular-color",
            [255, 0, 255, 51],
            dielectric(
                "KHR_materials_specular",
                json!({ "specularColorTexture": "TEXTURE", "specularColorFactor": [0.5, 0.5, 1] }),
            ),
            dielectric("KHR_materials_specular", json!({ "specularColorFactor": [0.5, 0, 1] })),
        ),
        case(
            "transmission",
            [51, 255, 255, 255],
            dielectric(
                "KHR_materials_transmission",
                json!({ "transmissionTexture": "TEXTURE", "transmissionFactor": 0.5 }),
            ),
            dielectric("KHR_materials_transmission", json!({ "transmissionFactor": 0.1 })),
        ),
        case(
            "clearcoat",
            [51, 255, 255, 255],
            dielectric(
                "KHR_materials_clearcoat",
                json!({ "clearcoatTexture": "TEXTURE", "clearcoatFactor": 0.5 }),
            ),
            dielectric("KHR_materials_clearcoat", json!({ "clearcoatFactor": 0.1 })),
        ),
        case(
            "clearcoat-roughness",
            [255, 102, 255, 255],
            dielectric(
                "KHR_materials_clearcoat",
                json!({
                    "clearcoatRoughnessTexture": "TEXTURE", "clearcoatRoughnessFactor": 0.75, "clearcoatFactor": 1,
                }),
            ),
            dielectric(
                "KHR_materials_clearcoat",
                json!({ "clearcoatRoughnessFactor": 0.3, "clearcoatFactor": 1 }),
            ),
        ),
        case(
            "sheen-color",
            [255, 0, 255, 255],
            dielectric(
                "KHR_materials_sheen",
                json!({
                    "sheenColorTexture": "TEXTURE", "sheenColorFactor": [0.5, 0.5, 1], "sheenRoughnessFactor": 0.5,
                }),
            ),
            dielectric(
                "KHR_materials_sheen",
                json!({ "sheenColorFactor": [0.5, 0, 1], "sheenRoughnessFactor": 0.5 }),
            ),
        ),
        case(
            "sheen-roughness",
            [255, 255, 255, 102],
            dielectric(
                "KHR_materials_sheen",
                json!({
                    "sheenRoughnessTexture": "TEXTURE", "sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.75,
                }),
            ),
            dielectric(
                "KHR_materials_sheen",
                json!({ "sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.3 }),
            ),
        ),
        case(
            "anisotropy",
            [255, 128, 153, 255],
            metal(
                "KHR_materials_anisotropy",
                json!({ "anisotropyTexture": "TEXTURE", "anisotropyStrength": 0.5 }),
            ),
            metal(
                "KHR_materials_anisotropy",
                json!({ "anisotropyStrength": 0.3, "anisotropyRotation": near_zero.atan2(1.0) }),
            ),
        ),
        case(
            "anisotropy-direction",
            [128, 255, 255, 255],
            metal(
                "KHR_materials_anisotropy",
                json!({ "anisotropyTexture": "TEXTURE", "anisotropyStrength": 0.8, "anisotropyRotation": 0.25 }),
            ),
            metal(
                "KHR_materials_anisotropy",
                json!({ "anisotropyStrength": 0.8, "anisotropyRotation": 0.25 + 1.0_f64.atan2(near_zero) }),
            ),
        ),
    ]
}

fn tilted_quad(name: &str, texel: [u8; 4], material: &Value) -> Scene {
    let mut builder = Builder::new();
    builder.uses("KHR_lights_punctual");
    let texture = builder.constant_texture(texel);
    let text = material
        .to_string()
        .replace("\"TEXTURE\"", &json!({ "index": texture }).to_string());
    let material: Value = serde_json::from_str(&text).expect("JSON");
    if let Some(extensions) = material["extensions"].as_object() {
        extensions.keys().for_each(|extension| builder.uses(extension));
    }
    let material = builder.add("materials", material);
    let mut attributes = builder.quad_attributes();
    attributes["TANGENT"] = json!(builder.floats(&[[1.0, 0.0, 0.0, 1.0]; 4]));
    let mesh = builder.quad_with(attributes, Some(material));
    builder.root_node(json!({ "mesh": mesh, "rotation": [-0.3826834323650898, 0, 0, 0.9238795325112867] }));
    let lights = json!({ "lights": [{ "type": "directional", "intensity": 3 }] });
    builder.set("extensions", json!({ "KHR_lights_punctual": lights }));
    let rotation = glam::DQuat::from_euler(glam::EulerRot::YXZ, 0.4, -0.9, 0.0).to_array();
    builder.root_node(json!({ "rotation": rotation, "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    scene(&builder, name)
}

#[test]
fn constant_textures_equal_plain_values() {
    for case in cases() {
        let name = format!("texture-{}", case.name);
        let textured = pixels(&tilted_quad(&name, case.texel, &case.textured));
        let untextured = pixels(&tilted_quad(&format!("{name}-plain"), case.texel, &case.plain));
        let white = pixels(&tilted_quad(&format!("{name}-white"), WHITE, &case.textured));
        let max_difference = |a: &[[f32; 3]], b: &[[f32; 3]]| {
            let pairs = a.as_flattened().iter().zip(b.as_flattened());
            pairs
                .map(|(a, b)| (a - b).abs() / b.abs().max(0.05))
                .fold(0.0, f32::max)
        };
        // Textured anisotropy uses a coarser multiple-scattering table.
        let tolerance = if case.name.starts_with("anisotropy") {
            0.01
        } else {
            1e-5
        };
        assert!(
            max_difference(&textured, &untextured) < tolerance,
            "{}: {textured:?} {untextured:?}",
            case.name
        );
        // Negative control: with a white texel, the image differs visibly.
        assert!(
            max_difference(&white, &untextured) > 0.1,
            "{}: {white:?} {untextured:?}",
            case.name
        );
    }
}

#[test]
fn occlusion_textures_are_ignored_and_reported() {
    let mut builder = Builder::new();
    let texture = builder.constant_texture([0, 0, 0, 255]);
    let material = json!({
        "occlusionTexture": { "index": texture },
        "pbrMetallicRoughness": { "baseColorFactor": [0.25, 0.5, 0.75, 1], "roughnessFactor": 0 },
    });
    let material = builder.add("materials", material);
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    let scene = scene(&builder, "occlusion");
    assert_all(&scene, [0.25, 0.5, 0.75]);
    assert!(
        scene.notes.iter().any(|note| note.message.contains("occlusion")),
        "{:?}",
        scene.notes
    );
}

/// Returns the shading normal of a quad with a normal map, in file coordinates.
fn shading_normal(name: &str, map: Value, uvs: [[f64; 2]; 4], tangent: Option<[f64; 4]>) -> [f64; 3] {
    let mut builder = Builder::new();
    builder.uses("KHR_texture_transform");
    // The texel encodes the tangent-space normal (0.6, 0.2, 0.77), rounded.
    let texture = builder.constant_texture([204, 153, 226, 255]);
    let mut info = map;
    info["index"] = json!(texture);
    let material = builder.add("materials", json!({ "normalTexture": info }));
    let position = builder.floats(&QUAD);
    let normal = builder.floats(&[[0.0, 0.0, 1.0]; 4]);
    let uv = builder.floats(&uvs);
    let mut attributes = json!({ "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv });
    if let Some(tangent) = tangent {
        attributes["TANGENT"] = json!(builder.floats(&[tangent; 4]));
    }
    let mesh = builder.quad_with(attributes, Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    let scene = scene(&builder, name);
    let options = Options {
        device: Device::Cpu,
        aovs: vec![Aov::ShadingNormal],
        ..Options::default()
    };
    let picture = wgray::render(&scene, &options).expect("an image");
    let component = |axis: &str| match picture.channel(&format!("shading_normal.{axis}")) {
        Some(ChannelValues::Floats(values)) => f64::from(values[14]),
        other => panic!("{other:?}"),
    };
    [component("X"), component("Z"), -component("Y")]
}

#[test]
fn texels_of_normal_maps_tilt_the_normal() {
    let assert_normal = |name: &str, found: [f64; 3], expected: [f64; 3]| {
        let length = expected.iter().map(|x| x * x).sum::<f64>().sqrt();
        let is_near = (0..3).all(|k| (found[k] - expected[k] / length).abs() < 0.002);
        assert!(is_near, "{name}: {found:?}, not {:?}", expected.map(|x| x / length));
    };
    let (x, y, z) = (0.6, 0.2, 226.0 / 255.0 * 2.0 - 1.0);
    let upright = QUAD_UVS;
    let check = |name: &str, map: Value, uvs, tangent, normal| {
        assert_normal(name, shading_normal(name, map, uvs, tangent), normal)
    };
    // Red is along +u, green along -v (glTF 2.0, 3.9.3).
    check("normal", json!({}), upright, None, [x, y, z]);
    check(
        "normal-scale",
        json!({ "scale": 0.5 }),
        upright,
        None,
        [0.5 * x, 0.5 * y, z],
    );
    // The texture coordinates are mirrored or rotated.
    check(
        "normal-mirrored",
        json!({}),
        QUAD_UVS.map(|[u, v]| [1.0 - u, v]),
        None,
        [-x, y, z],
    );
    check(
        "normal-turned",
        json!({}),
        QUAD_UVS.map(|[u, v]| [v, 1.0 - u]),
        None,
        [y, -x, z],
    );
    // Tangents in the file take precedence.
    check(
        "normal-tangent",
        json!({}),
        upright,
        Some([0.0, 1.0, 0.0, 1.0]),
        [-y, x, z],
    );
    check(
        "normal-handed",
        json!({}),
        upright,
        Some([1.0, 0.0, 0.0, -1.0]),
        [x, -y, z],
    );
}

#[test]
fn a_transformed_normal_map_keeps_its_tangents() {
    // `KHR_texture_transform` changes the lookup, not the tangents.
    let transform = json!({ "extensions": { "KHR_texture_transform": { "rotation": std::f64::consts::FRAC_PI_2 } } });
    let found = shading_normal("normal-transformed", transform, QUAD_UVS, Some([1.0, 0.0, 0.0, 1.0]));
    assert!(
        (found[0] - 0.6).abs() < 0.01 && (found[1] - 0.2).abs() < 0.01,
        "{found:?}"
    );
}

#[test]
fn samplers_and_sources_are_optional() {
    let mut builder = Builder::new();
    let image = builder.image(&png(1, &[[255; 4]]), "image/png");
    let texture = builder.add("textures", json!({ "source": image }));
    let empty = builder.add("textures", json!({}));
    let material =
        builder.unlit(json!({ "baseColorTexture": { "index": texture }, "baseColorFactor": [0.5, 0.5, 0.5, 1] }));
    builder.get("materials")[material]["emissiveTexture"] = json!({ "index": empty });
    let indices = builder.indices_of(Component::U16, &QUAD_INDICES);
    let attributes = builder.quad_attributes();
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
    let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
    builder.root_node(json!({ "mesh": mesh }));
    assert_all(&scene(&builder, "sampler-none"), [0.5; 3]);
}
