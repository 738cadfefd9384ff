//! glTF materials, their extensions, alpha modes, sidedness and variants.

use serde_json::{Value, json};
use wgray::scene::{AlphaMode, Scene};

use super::build::{Builder, Packing};
use super::read::{
    assert_all, assert_near, load_scene, material, plain, plain_color, principled, rejection, scene, scene_with_keys,
};
use crate::test_folder::TestFolder;

fn quad_with_material(material: Value) -> Builder {
    let mut builder = Builder::new();
    if let Some(extensions) = material["extensions"].as_object() {
        extensions.keys().for_each(|extension| builder.uses(extension));
    }
    let material = builder.add("materials", material);
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    builder
}

fn extension_material(extension: &str, values: Value) -> Value {
    json!({
        "pbrMetallicRoughness": { "metallicFactor": 0 },
        "extensions": { extension: values },
    })
}

#[test]
fn defaults_match_the_specification() {
    let mut without_material = Builder::new();
    let mesh = without_material.quad(None);
    without_material.root_node(json!({ "mesh": mesh }));
    for (name, builder) in [
        ("default-none", without_material),
        ("default-empty", quad_with_material(json!({}))),
    ] {
        let scene = scene(&builder, name);
        let material = material(&scene);
        let principled = principled(&scene);
        // Defaults: white, metallic, rough (glTF 2.0, 3.9.2).
        assert_eq!(plain_color(principled.base_color), [1.0; 3]);
        assert_eq!(plain(principled.metallic), 1.0);
        assert_eq!(plain(principled.roughness), 1.0);
        assert_eq!(plain_color(material.emission), [0.0; 3]);
        assert_eq!(principled.alpha_mode, AlphaMode::Opaque);
        assert_eq!(material.normal_map, None);
        assert_eq!(principled.ior, 1.5);
        assert_eq!(plain(principled.specular), 1.0);
        assert_eq!(plain_color(principled.specular_color), [1.0; 3]);
        assert_eq!(plain(principled.transmission), 0.0);
        assert_eq!(plain(principled.clearcoat), 0.0);
        assert_eq!(plain_color(principled.sheen_color), [0.0; 3]);
        assert_eq!(plain(principled.anisotropy), 0.0);
    }
}

#[test]
fn core_parameters_are_imported() {
    let scene = scene(
        &quad_with_material(json!({
            "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.25, "roughnessFactor": 0.75 },
            "emissiveFactor": [0.5, 0.6, 0.7],
        })),
        "core",
    );
    assert_near(plain_color(principled(&scene).base_color), [0.1, 0.2, 0.3]);
    assert_near(
        [plain(principled(&scene).metallic), plain(principled(&scene).roughness)],
        [0.25, 0.75],
    );
    assert_near(plain_color(material(&scene).emission), [0.5, 0.6, 0.7]);
}

#[test]
fn emission_may_be_stronger_than_one() {
    let mut material = extension_material("KHR_materials_emissive_strength", json!({ "emissiveStrength": 8 }));
    material["emissiveFactor"] = json!([0.5, 0.25, 1]);
    let scene = scene(&quad_with_material(material), "emissive-strength");
    assert_near(plain_color(super::read::material(&scene).emission), [4.0, 2.0, 8.0]);
}

#[test]
fn indices_of_refraction_are_imported() {
    let with_ior = |ior: f64, name: &str| {
        scene(
            &quad_with_material(extension_material("KHR_materials_ior", json!({ "ior": ior }))),
            name,
        )
    };
    assert_near([principled(&with_ior(1.33, "ior")).ior], [1.33]);
    // An IOR of 0 means a Fresnel term of 1; a high IOR approximates it.
    assert!(principled(&with_ior(0.0, "ior-zero")).ior >= 50.0);
}

#[test]
fn transmission_without_a_volume_is_thin_walled() {
    let sheet = extension_material("KHR_materials_transmission", json!({ "transmissionFactor": 0.75 }));
    let sheet = scene(&quad_with_material(sheet), "transmission");
    assert_near([plain(principled(&sheet).transmission)], [0.75]);
    assert!(principled(&sheet).thin);
    let volume = |thickness: f64, name: &str| {
        let mut material = extension_material("KHR_materials_transmission", json!({ "transmissionFactor": 1 }));
        material["extensions"]["KHR_materials_volume"] =
            json!({ "thicknessFactor": thickness, "attenuationDistance": 2, "attenuationColor": [0.5, 0.25, 1] });
        scene(&quad_with_material(material), name)
    };
    // A thickness of 0 means thin-walled (`KHR_materials_volume`).
    assert!(principled(&volume(0.0, "volume-thin")).thin);
    let thick = volume(0.5, "volume");
    assert!(!principled(&thick).thin);
    // Beer-Lambert law: the attenuation color is the transmittance over the attenuation distance, 2.
    let expected = [0.5_f64, 0.25, 1.0].map(|transmittance| -transmittance.ln() / 2.0);
    assert_near(principled(&thick).absorption.to_array(), expected);
}

#[test]
fn a_volume_absorbs_nothing_without_a_distance_and_everything_if_black() {
    let with_volume = |volume: Value, name: &str| {
        let mut material = extension_material("KHR_materials_transmission", json!({ "transmissionFactor": 1 }));
        material["extensions"]["KHR_materials_volume"] = volume;
        scene(&quad_with_material(material), name)
    };
    let clear = with_volume(
        json!({ "thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5] }),
        "volume-clear",
    );
    assert_eq!(principled(&clear).absorption.to_array(), [0.0; 3]);
    let black = json!({ "thicknessFactor": 1, "attenuationColor": [0, 0, 0], "attenuationDistance": 1 });
    let black = with_volume(black, "volume-black");
    assert!(principled(&black).absorption.min_element() > 10.0);
}

#[test]
fn extensions_of_reflection_are_imported() {
    let specular = json!({ "specularFactor": 0.25, "specularColorFactor": [0.5, 0.75, 1] });
    let scene_of =
        |extension: &str, values: Value| scene(&quad_with_material(extension_material(extension, values)), extension);
    let scene = scene_of("KHR_materials_specular", specular);
    assert_near([plain(principled(&scene).specular)], [0.25]);
    assert_near(plain_color(principled(&scene).specular_color), [0.5, 0.75, 1.0]);
    let scene = scene_of(
        "KHR_materials_clearcoat",
        json!({ "clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25 }),
    );
    assert_near(
        [
            plain(principled(&scene).clearcoat),
            plain(principled(&scene).clearcoat_roughness),
        ],
        [0.5, 0.25],
    );
    let sheen = json!({ "sheenColorFactor": [0.1, 0.2, 0.3], "sheenRoughnessFactor": 0.5 });
    let scene = scene_of("KHR_materials_sheen", sheen);
    assert_near(plain_color(principled(&scene).sheen_color), [0.1, 0.2, 0.3]);
    assert_near([plain(principled(&scene).sheen_roughness)], [0.5]);
    let anisotropy = json!({ "anisotropyStrength": 0.6, "anisotropyRotation": 1.25 });
    let scene = scene_of("KHR_materials_anisotropy", anisotropy);
    assert_near(
        [
            plain(principled(&scene).anisotropy),
            principled(&scene).anisotropy_rotation,
        ],
        [0.6, 1.25],
    );
}

#[test]
fn specular_glossiness_materials_become_dielectrics() {
    let values =
        json!({ "diffuseFactor": [0.1, 0.2, 0.3, 0.5], "specularFactor": [0.04, 0.08, 1], "glossinessFactor": 0.75 });
    let scene = scene(
        &quad_with_material(extension_material("KHR_materials_pbrSpecularGlossiness", values)),
        "specular-glossiness",
    );
    let principled = principled(&scene);
    assert_near(plain_color(principled.base_color), [0.1, 0.2, 0.3]);
    assert_near([plain(principled.metallic), plain(principled.roughness)], [0.0, 0.25]);
    // F0 is the specular color times the F0 of the IOR.
    let f0 = ((principled.ior - 1.0) / (principled.ior + 1.0)).powi(2);
    assert_near(
        plain_color(principled.specular_color).map(|x| x * f0),
        [0.04, 0.08, 1.0],
    );
}

#[test]
fn a_clearcoat_may_have_its_own_normal_map() {
    let mut builder = Builder::new();
    builder.uses("KHR_materials_clearcoat");
    let maps = [[204, 128, 226, 255], [128, 204, 226, 255]].map(|texel| builder.constant_texture(texel));
    let coat = json!({ "clearcoatFactor": 1, "clearcoatNormalTexture": { "index": maps[1], "scale": 0.5 } });
    let material = builder.add(
        "materials",
        json!({ "normalTexture": { "index": maps[0], "scale": -1 }, "extensions": { "KHR_materials_clearcoat": coat } }),
    );
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    let scene = scene(&builder, "coat-normal");
    let base_map = super::read::material(&scene).normal_map.expect("a normal map");
    let coat = principled(&scene)
        .clearcoat_normal_map
        .expect("a normal map of the coat");
    assert_eq!((base_map.strength, coat.strength), (-1.0, 0.5));
    assert_ne!(base_map.texture, coat.texture);
}

#[test]
fn unlit_materials_emit_their_base_color() {
    for (name, factor) in [
        ("unlit", [0.25, 0.5, 0.75]),
        ("unlit-white", [1.0; 3]),
        ("unlit-black", [0.0; 3]),
    ] {
        let [r, g, b] = factor;
        let mut builder = Builder::new();
        let material = builder.unlit(json!({ "baseColorFactor": [r, g, b, 0.5] }));
        let mesh = builder.quad(Some(material));
        builder.root_node(json!({ "mesh": mesh }));
        assert_all(&scene(&builder, name), factor);
    }
}

#[test]
fn smooth_metal_in_a_white_environment_has_its_base_color() {
    // At normal incidence, Schlick's Fresnel term is the base color.
    let metal = json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.25, 0.5, 0.75, 1], "roughnessFactor": 0 } });
    assert_all(&scene(&quad_with_material(metal), "metal"), [0.25, 0.5, 0.75]);
}

fn unlit_with_alpha(mode: &str, cutoff: Option<f64>) -> Scene {
    let mut builder = Builder::new();
    let material = builder.unlit(json!({ "baseColorFactor": [0.25, 0.5, 0.75, 0.4] }));
    builder.get("materials")[material]["alphaMode"] = json!(mode);
    if let Some(cutoff) = cutoff {
        builder.get("materials")[material]["alphaCutoff"] = json!(cutoff);
    }
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    scene(&builder, &format!("alpha-{mode}-{cutoff:?}"))
}

#[test]
fn alpha_modes_are_applied() {
    let (surface, background) = ([0.25, 0.5, 0.75], [1.0; 3]);
    assert_all(&unlit_with_alpha("OPAQUE", None), surface);
    assert_all(&unlit_with_alpha("MASK", None), background);
    assert_all(&unlit_with_alpha("MASK", Some(0.375)), surface);
    assert_all(&unlit_with_alpha("MASK", Some(0.0)), surface);
    assert_all(&unlit_with_alpha("MASK", Some(2.0)), background);
    // With `BLEND`, each sample sees either the surface or the background, at random.
    let mut scene = unlit_with_alpha("BLEND", None);
    scene.render.pixel_samples.count = 64 * 64;
    let pixels = super::read::pixels(&scene);
    for k in 0..3 {
        let mean = pixels.iter().map(|pixel| f64::from(pixel[k])).sum::<f64>() / pixels.len() as f64;
        let expected = 0.4 * surface[k] + 0.6;
        assert!((mean - expected).abs() < 0.005, "{mean}, not {expected}");
    }
}

#[test]
fn single_sided_materials_are_invisible_from_behind() {
    let sided_quad = |is_double_sided: bool, is_rotated: bool, is_mirrored: bool| {
        let mut builder = Builder::new();
        let material = builder.unlit(json!({ "baseColorFactor": [0.25, 0.5, 0.75, 1] }));
        builder.get("materials")[material]["doubleSided"] = json!(is_double_sided);
        let mesh = builder.quad(Some(material));
        let mut node = json!({ "mesh": mesh });
        if is_rotated {
            node["rotation"] = json!([0, 1, 0, 0]);
        }
        if is_mirrored {
            node["scale"] = json!([-1, 1, 1]);
        }
        builder.root_node(node);
        scene(&builder, &format!("sides-{is_double_sided}-{is_rotated}-{is_mirrored}"))
    };
    for is_mirrored in [false, true] {
        assert_all(&sided_quad(true, false, is_mirrored), [0.25, 0.5, 0.75]);
        assert_all(&sided_quad(true, true, is_mirrored), [0.25, 0.5, 0.75]);
        assert_all(&sided_quad(false, false, is_mirrored), [0.25, 0.5, 0.75]);
        assert_all(&sided_quad(false, true, is_mirrored), [1.0; 3]);
    }
}

#[test]
fn a_variant_replaces_the_materials_of_primitives() {
    let mut builder = Builder::new();
    builder.uses("KHR_materials_variants");
    let materials =
        [0.25, 0.5, 0.75].map(|level| builder.unlit(json!({ "baseColorFactor": [level, level, level, 1] })));
    let mesh = builder.quad(Some(materials[0]));
    builder.get("meshes")[mesh]["primitives"][0]["extensions"] = json!({
        "KHR_materials_variants": { "mappings": [
            { "material": materials[1], "variants": [0, 2] },
            { "material": materials[2], "variants": [1] },
        ] },
    });
    let names = json!([{ "name": "day" }, { "name": "night" }, { "name": "dusk" }, { "name": "dawn" }]);
    builder.set("extensions", json!({ "KHR_materials_variants": { "variants": names } }));
    builder.root_node(json!({ "mesh": mesh }));
    for (keys, level) in [
        ("", 0.25),
        ("variant = \"day\"", 0.5),
        ("variant = \"night\"", 0.75),
        ("variant = 1", 0.75),
        ("variant = \"dusk\"", 0.5),
        ("variant = \"dawn\"", 0.25),
    ] {
        assert_all(&scene_with_keys(&builder, "variants", keys), [level; 3]);
    }
    let message = rejection(&builder, "variant = \"noon\"");
    assert!(
        ["day", "night", "dusk", "dawn"]
            .iter()
            .all(|name| message.contains(name)),
        "{message}"
    );
}

#[test]
fn a_scene_may_replace_a_material_of_the_file() {
    let mut builder = Builder::new();
    let mut names = ["red", "blue"].into_iter();
    for x in [-1, 1] {
        let material = builder.unlit(json!({ "baseColorFactor": [0.5, 0.5, 0.5, 1] }));
        builder.get("materials")[material]["name"] = json!(names.next());
        let mesh = builder.quad(Some(material));
        builder.root_node(json!({ "mesh": mesh, "translation": [x, 0, 0] }));
    }
    let folder = TestFolder::with_file("a", "");
    let file = builder.write(folder.folder(), "replaced", Packing::Binary);
    let emitter = "[materials.emitter]\ntype = \"diffuse\"\ncolor = [0, 0, 0]\nemission = [0.125, 0.25, 0.5]";
    let keys = format!("materials = {{ blue = \"emitter\" }}\n{emitter}");
    let pixels = super::read::pixels(&load_scene(&file, &keys));
    for row in pixels.chunks(6) {
        assert!(row[..3].iter().all(|pixel| *pixel == [0.5; 3]), "{row:?}");
        assert!(row[3..].iter().all(|pixel| *pixel == [0.125, 0.25, 0.5]), "{row:?}");
    }
    let keys = format!("materials = {{ green = \"emitter\" }}\n{emitter}");
    let message = super::read::try_load_scene(&file, &keys).expect_err("no such material");
    assert!(message.contains("green") && message.contains("red"), "{message}");
}

#[test]
fn unknown_extensions_are_rejected_if_required_and_reported_if_used() {
    for extension in ["KHR_draco_mesh_compression", "EXT_texture_avif", "EXT_unknown"] {
        let mut builder = quad_with_material(json!({}));
        builder.requires(extension);
        let message = rejection(&builder, "");
        assert!(message.contains(extension), "{message}");
    }
    let mut builder = quad_with_material(json!({}));
    builder.uses("EXT_unknown");
    let scene = scene(&builder, "used-unknown");
    assert!(
        scene.notes.iter().any(|note| note.message.contains("EXT_unknown")),
        "{:?}",
        scene.notes
    );
}
