//! `KHR_lights_punctual`: position, direction and intensity.

use glam::{DQuat, DVec3};
use serde_json::{Value, json};
use wgray::Scene;
use wgray::scene::Light;

use super::build::{Builder, Packing};
use super::read::{assert_near, pixels, scene, scene_with_keys, to_file};
use crate::test_folder::TestFolder;

/// Returns a quad and a light on a rotated node below a scaled node.
fn quad_with_light(light: Value) -> Builder {
    let mut builder = Builder::new();
    builder.uses("KHR_lights_punctual");
    let mesh = builder.quad(None);
    builder.root_node(json!({ "mesh": mesh }));
    builder.set("extensions", json!({ "KHR_lights_punctual": { "lights": [light] } }));
    let rotation = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2).to_array();
    let node = json!({ "rotation": rotation, "extensions": { "KHR_lights_punctual": { "light": 0 } } });
    let node = builder.add("nodes", node);
    builder.root_node(json!({ "translation": [1, 2, 3], "scale": [2, 2, 2], "children": [node] }));
    builder
}

#[test]
fn candelas_are_radiant_intensity() {
    let light = json!({ "type": "point", "intensity": 20, "color": [1, 0.5, 0.25] });
    match &scene(&quad_with_light(light), "light-point").lights[..] {
        [Light::Point { position, color }] => {
            assert_near(to_file(*position).to_array(), [1.0, 2.0, 3.0]);
            assert_near(color.to_array(), [20.0, 10.0, 5.0]);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn lux_are_irradiance() {
    let light = json!({ "type": "directional", "intensity": 3, "color": [1, 0.5, 0.25] });
    match &scene(&quad_with_light(light), "light-directional").lights[..] {
        // The node's -z axis points down.
        [Light::Directional { direction, color }] => {
            assert_near(to_file(*direction).to_array(), [0.0, -1.0, 0.0]);
            assert_near(color.to_array(), [3.0, 1.5, 0.75]);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn spots_have_two_angles() {
    for (spot, inner, outer) in [
        (json!({ "innerConeAngle": 0.2, "outerConeAngle": 0.5 }), 0.2, 0.5),
        (json!({}), 0.0, std::f64::consts::FRAC_PI_4),
    ] {
        let light = json!({ "type": "spot", "spot": spot });
        match &scene(&quad_with_light(light), &format!("light-spot-{inner}")).lights[..] {
            [
                Light::Spot {
                    position,
                    direction,
                    color,
                    cone,
                    inner: inner_angle,
                },
            ] => {
                assert_near(to_file(*position).to_array(), [1.0, 2.0, 3.0]);
                assert_near(to_file(*direction).to_array(), [0.0, -1.0, 0.0]);
                // Defaults: white, 1 cd.
                assert_near(color.to_array(), [1.0; 3]);
                assert_near([*cone, *inner_angle], [outer, inner]);
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn each_node_that_references_a_light_adds_a_light() {
    let mut builder = quad_with_light(json!({ "type": "point" }));
    for x in 0..3 {
        builder.root_node(json!({ "translation": [x, 0, 5], "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    }
    assert_eq!(scene(&builder, "lights-many").lights.len(), 4);
    assert_eq!(
        scene_with_keys(&builder, "lights-off", "lights = false").lights.len(),
        0
    );
}

#[test]
fn a_light_of_intensity_zero_is_accepted() {
    let scene = scene(
        &quad_with_light(json!({ "type": "point", "intensity": 0 })),
        "light-dark",
    );
    assert!(scene.lights.len() <= 1);
}

#[test]
fn light_intensities_in_lux_and_candela_give_the_closed_form_radiance() {
    // At an IOR of 1, there is no specular reflection, and the BRDF is albedo / pi.
    let mut builder = Builder::new();
    builder.uses("KHR_lights_punctual");
    builder.uses("KHR_materials_ior");
    let material = json!({
        "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.4, 0.2, 1], "metallicFactor": 0 },
        "extensions": { "KHR_materials_ior": { "ior": 1 } },
    });
    let material = builder.add("materials", material);
    let mesh = builder.quad(Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    let lights = json!([{ "type": "directional", "intensity": 5 }, { "type": "point", "intensity": 12 }]);
    builder.set("extensions", json!({ "KHR_lights_punctual": { "lights": lights } }));
    builder.root_node(json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    // The point light is so far away that its irradiance on the quad varies by at most 0.03 %.
    builder.root_node(json!({ "translation": [0, 0, 100], "extensions": { "KHR_lights_punctual": { "light": 1 } } }));
    builder.get("extensions")["KHR_lights_punctual"]["lights"][1]["intensity"] = json!(20_000);
    let folder = TestFolder::with_file("a", "");
    let file = builder.write(folder.folder(), "lux", Packing::Binary);
    // Without the default environment, only the lights contribute.
    let mut scene = super::read::load_scene(&file, "");
    scene.environment = None;
    scene.render.background = DVec3::ZERO;
    scene.render.pixel_samples.count = 256;
    let irradiance = 5.0 + 20_000.0 / 100.0_f64.powi(2);
    for pixel in pixels(&scene) {
        for (k, albedo) in [0.8, 0.4, 0.2].into_iter().enumerate() {
            let expected = albedo / std::f64::consts::PI * irradiance;
            // The tolerance of a pixel is large because each sample selects one of the two lights at random.
            assert!(
                (f64::from(pixel[k]) / expected - 1.0).abs() < 0.15,
                "{pixel:?}, not {expected}"
            );
        }
    }
    let mean = pixels(&scene).iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / 36.0;
    assert!(
        (mean / (0.8 / std::f64::consts::PI * irradiance) - 1.0).abs() < 0.02,
        "{mean}"
    );
}

#[test]
fn a_file_with_lights_has_no_default_environment() {
    let folder = TestFolder::with_file("a", "");
    let file = quad_with_light(json!({ "type": "point" })).write(folder.folder(), "lights-alone", Packing::Binary);
    let scene = Scene::load(&file).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.lights.len(), 1);
    assert!(scene.environment.is_none_or(|environment| environment.image.is_none()));
}
