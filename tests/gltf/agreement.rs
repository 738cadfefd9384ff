//! The image of a glTF file with many features has the same bits on CPU and GPU.

use serde_json::json;
use wgray_render::pack::pack;

use super::build::{Builder, Packing, QUAD, QUAD_UVS};
use super::read::load_scene;
use crate::pictures::{RenderMode, differing, exact_modes, reference, render};

#[test]
fn the_image_of_a_file_has_the_same_bits_on_cpu_and_gpu() {
    let mut builder = Builder::new();
    let colors = builder.texture(
        2,
        &[
            [250, 80, 60, 255],
            [60, 230, 90, 40],
            [70, 90, 240, 255],
            [250, 240, 220, 130],
        ],
    );
    let normals = builder.texture(
        2,
        &[
            [160, 128, 240, 255],
            [128, 90, 240, 255],
            [100, 128, 240, 255],
            [128, 170, 240, 255],
        ],
    );
    let roughness = builder.texture(
        2,
        &[
            [0, 60, 255, 255],
            [0, 200, 0, 255],
            [0, 120, 128, 255],
            [0, 255, 30, 255],
        ],
    );
    builder.get("samplers")[0]["wrapT"] = json!(33071);
    builder.uses("KHR_texture_transform");
    let transform = json!({ "KHR_texture_transform": { "offset": [0.2, 0.1], "rotation": 0.4, "scale": [1.5, 0.7] } });
    let material = builder.add(
        "materials",
        json!({
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": colors, "extensions": transform },
                "baseColorFactor": [0.9, 0.8, 0.7, 0.9],
                "metallicRoughnessTexture": { "index": roughness, "texCoord": 1 },
            },
            "normalTexture": { "index": normals, "scale": 0.7 },
            "emissiveFactor": [0.05, 0.1, 0.02],
            "alphaMode": "BLEND",
        }),
    );
    let attributes = json!({
        "POSITION": builder.floats(&QUAD),
        "NORMAL": builder.floats(&[[0.1, 0.0, 1.0], [-0.2, 0.1, 1.0], [0.0, -0.1, 1.0], [0.0, 0.0, 1.0]]),
        "TEXCOORD_0": builder.floats(&QUAD_UVS),
        "TEXCOORD_1": builder.floats(&[[0.0, 0.0], [2.0, 0.3], [1.5, 1.5], [-0.5, 1.0]]),
        "COLOR_0": builder.floats(&[[1.0, 0.5, 0.5, 1.0], [0.5, 1.0, 1.0, 0.5], [1.0; 4], [0.2, 0.9, 0.4, 1.0]]),
    });
    let mesh = builder.quad_with(attributes, Some(material));
    builder.root_node(json!({ "mesh": mesh, "rotation": [0.2, 0.1, 0.0, 0.97] }));
    builder.root_node(json!({ "mesh": mesh, "translation": [0.3, -0.2, -1], "scale": [-1.2, 1, 1] }));
    let folder = tempfile::tempdir().unwrap();
    let file = builder.write(folder.path(), "many", Packing::Binary);
    let mut scene = load_scene(&file, "");
    (scene.width, scene.height) = (24, 24);
    let packed = pack(&scene);
    let expected = reference(&packed);
    for mode in exact_modes().into_iter().filter(|mode| *mode == RenderMode::Baked) {
        assert_eq!(differing(&render(&packed, mode), &expected), 0, "{mode:?}");
    }
    // Negative control: another strength of the normal map changes the image.
    builder.get("materials")[material]["normalTexture"]["scale"] = json!(0.6);
    let mut other_scene = load_scene(&builder.write(folder.path(), "other", Packing::Binary), "");
    (other_scene.width, other_scene.height) = (24, 24);
    assert!(differing(&reference(&pack(&other_scene)), &expected) > 50);
}
