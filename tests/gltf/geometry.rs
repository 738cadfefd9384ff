//! glTF accessors, primitive modes and vertex attributes.

use glam::DVec3;
use serde_json::json;
use wgray::Scene;

use super::build::{Builder, Component, Packing, QUAD, QUAD_INDICES, QUAD_UVS};
use super::read::{assert_all, assert_corners, corners, load_scene, pixels, rejection, scene, triangles};
use crate::test_folder::TestFolder;

const QUAD_CORNERS: [[[f64; 3]; 3]; 2] = [[QUAD[0], QUAD[1], QUAD[2]], [QUAD[0], QUAD[2], QUAD[3]]];

fn quad() -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    builder.root_node(json!({ "mesh": mesh }));
    builder
}

#[test]
fn a_buffer_may_be_in_the_glb_file_in_its_own_file_or_in_a_data_uri() {
    let folder = TestFolder::with_file("a", "");
    for packing in Packing::ALL {
        let file = quad().write(folder.folder(), &format!("packing-{packing:?}"), packing);
        let scene = load_scene(&file, "");
        assert_corners(&scene, &QUAD_CORNERS);
        for triangle in triangles(&scene) {
            assert_eq!(triangle.normals, [DVec3::Z; 3]);
            assert_eq!(triangle.geometric_normal(), DVec3::Z);
            for (corner, uv) in triangle.corners.iter().zip(triangle.uvs) {
                assert_eq!((uv.x, uv.y), ((corner.x + 1.0) / 2.0, (1.0 - corner.y) / 2.0));
            }
        }
        let buffer_files = usize::from(packing == Packing::Beside);
        assert_eq!(scene.files.len(), 1 + buffer_files, "{:?}", scene.files);
    }
}

#[test]
fn indices_may_have_any_integer_type() {
    for component in [Component::U8, Component::U16, Component::U32] {
        let mut builder = Builder::new();
        let attributes = builder.quad_attributes();
        let indices = builder.indices_of(component, &QUAD_INDICES);
        let primitive = json!({ "attributes": attributes, "indices": indices });
        let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
        builder.root_node(json!({ "mesh": mesh }));
        assert_corners(&scene(&builder, &format!("indices-{component:?}")), &QUAD_CORNERS);
    }
}

/// Returns the value of the nearest normalized integer (glTF 2.0, 3.6.2.2; `KHR_mesh_quantization`).
fn quantize(component: Component, value: f64) -> f64 {
    (value * component.one()).round() / component.one()
}

#[test]
fn positions_may_have_any_integer_type() {
    // The node's scale maps the integer range to the size of the mesh, as in files that quantization tools write.
    for component in [Component::I8, Component::U8, Component::I16, Component::U16] {
        for normalized in [false, true] {
            let signed = matches!(component, Component::I8 | Component::I16);
            let low = if signed { -0.7 } else { 0.1 };
            let unit = if normalized { 1.0 } else { 100.0 };
            let positions = [[low, low, 0.3], [0.9, low, 0.3], [0.9, 0.8, 0.3]].map(|p| p.map(|x| x * unit));
            let mut builder = Builder::new();
            builder.requires("KHR_mesh_quantization");
            let position = builder.attribute(component, normalized, &positions);
            let mesh = json!({ "primitives": [{ "attributes": { "POSITION": position } }] });
            let mesh = builder.add("meshes", mesh);
            let scale = 2.0 / unit;
            builder.root_node(json!({ "mesh": mesh, "scale": [scale, scale, scale], "translation": [0, 0, 1] }));
            let stored = |x: f64| match normalized {
                true => quantize(component, x),
                false => (x as i64) as f64,
            };
            let expected = positions.map(|p| {
                let [x, y, z] = p.map(|x| stored(x) * scale);
                [x, y, z + 1.0]
            });
            let name = format!("positions-{component:?}-{normalized}");
            assert_corners(&scene(&builder, &name), &[expected]);
        }
    }
}

#[test]
fn texture_coordinates_may_have_any_type() {
    let cases = [
        (Component::F32, false, false),
        (Component::U8, true, false),
        (Component::U16, true, false),
        (Component::I8, true, true),
        (Component::I16, true, true),
        (Component::U8, false, true),
        (Component::I16, false, true),
    ];
    for (component, normalized, quantized) in cases {
        let unit = if normalized || component == Component::F32 {
            1.0
        } else {
            8.0
        };
        let uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.25], [0.0, 0.25]].map(|uv| uv.map(|x| x * unit));
        let mut builder = Builder::new();
        if quantized {
            builder.requires("KHR_mesh_quantization");
        }
        let position = builder.floats(&QUAD);
        let uv = builder.attribute(component, normalized, &uvs);
        let mesh = builder.quad_with(json!({ "POSITION": position, "TEXCOORD_0": uv }), None);
        builder.root_node(json!({ "mesh": mesh }));
        let found = triangles(&scene(&builder, &format!("uvs-{component:?}-{normalized}")));
        for (uv, index) in found.iter().flat_map(|triangle| triangle.uvs).zip(QUAD_INDICES) {
            let expected = uvs[index as usize].map(|x| if normalized { quantize(component, x) } else { x });
            assert!(
                (uv.x - expected[0]).abs() + (uv.y - expected[1]).abs() < 1e-6,
                "{component:?}: {uv}, not {expected:?}"
            );
        }
    }
}

#[test]
fn normals_of_integer_types_are_unit_vectors() {
    for component in [Component::I8, Component::I16] {
        let mut builder = Builder::new();
        builder.requires("KHR_mesh_quantization");
        let position = builder.floats(&QUAD);
        let normal = builder.attribute(component, true, &[[0.6, 0.0, 0.8]; 4]);
        let mesh = builder.quad_with(json!({ "POSITION": position, "NORMAL": normal }), None);
        builder.root_node(json!({ "mesh": mesh }));
        for triangle in triangles(&scene(&builder, &format!("normals-{component:?}"))) {
            for normal in triangle.normals {
                assert!((normal.length() - 1.0).abs() < 1e-6);
                assert!(normal.distance(DVec3::new(0.6, 0.0, 0.8)) < 0.01, "{normal}");
            }
        }
    }
}

#[test]
fn triangles_of_strips_and_fans_have_the_right_winding_order() {
    // Vertices of a strip and of a fan whose triangles are counterclockwise as seen from +z (glTF 2.0, 3.7.2.1).
    let zigzag = [
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
    ];
    let circle = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
    ];
    for (mode, points, triples) in [
        (4, &zigzag, vec![[0, 1, 2], [2, 1, 3]]),
        (5, &zigzag, vec![[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, &circle, vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
    ] {
        let order: Vec<u32> = if mode == 4 { triples.concat() } else { (0..5).collect() };
        for indexed in [false, true] {
            let mut builder = Builder::new();
            let mut primitive = json!({ "mode": mode });
            if indexed {
                let position = builder.floats(points);
                primitive["attributes"] = json!({ "POSITION": position });
                primitive["indices"] = json!(builder.indices(&order));
            } else {
                let points: Vec<[f64; 3]> = order.iter().map(|i| points[*i as usize]).collect();
                let position = builder.floats(&points);
                primitive["attributes"] = json!({ "POSITION": position });
            }
            let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
            builder.root_node(json!({ "mesh": mesh }));
            let scene = scene(&builder, &format!("mode-{mode}-{indexed}"));
            let found = triangles(&scene);
            assert_eq!(found.len(), triples.len(), "mode {mode}");
            for (triangle, triple) in found.iter().zip(&triples) {
                assert_eq!(triangle.geometric_normal(), DVec3::Z, "mode {mode}");
                let mut expected = triple.map(|i| points[i as usize]);
                let mut corners = triangle.corners.map(|corner| corner.to_array());
                expected.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
                corners.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
                assert_eq!(corners, expected, "mode {mode}");
            }
        }
    }
}

#[test]
fn points_and_lines_are_skipped_and_reported() {
    for (mode, word) in [(0, "point"), (1, "line"), (2, "line"), (3, "line")] {
        let mut builder = Builder::new();
        let attributes = builder.quad_attributes();
        let indices = builder.indices(&QUAD_INDICES);
        let other_indices = builder.indices(&[0, 1, 2, 3]);
        let triangles = json!({ "attributes": attributes, "indices": indices });
        let other_primitive = json!({ "attributes": attributes, "indices": other_indices, "mode": mode });
        let mesh = builder.add("meshes", json!({ "primitives": [other_primitive.clone(), triangles] }));
        builder.root_node(json!({ "mesh": mesh }));
        let scene = scene(&builder, &format!("mode-{mode}"));
        assert_corners(&scene, &QUAD_CORNERS);
        let notes = scene
            .notes
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join("\n");
        assert!(notes.contains(word) && notes.contains(".glb"), "{notes:?}");
        builder.get("meshes")[0]["primitives"] = json!([other_primitive]);
        let message = rejection(&builder, "");
        assert!(message.contains("triangle"), "{message}");
    }
}

#[test]
fn sparse_accessors_replace_values_of_a_buffer_or_zeros() {
    for has_base in [true, false] {
        let mut builder = Builder::new();
        let sparse_indices = builder.view(&[1, 0, 3, 0]);
        let values = [0.5, 0.25, 0.0, -0.5, 0.75, 0.125];
        let values = builder.view(&Builder::elements("VEC3", Component::F32, &values, 4));
        let mut accessor = json!({
            "componentType": 5126, "count": 4, "type": "VEC3",
            "sparse": {
                "count": 2,
                "indices": { "bufferView": sparse_indices, "componentType": 5123 },
                "values": { "bufferView": values },
            },
        });
        let mut expected = [[0.0; 3]; 4];
        if has_base {
            let flat: Vec<f64> = QUAD.iter().flatten().copied().collect();
            accessor["bufferView"] = json!(builder.view(&Builder::elements("VEC3", Component::F32, &flat, 4)));
            expected = QUAD;
        }
        expected[1] = [0.5, 0.25, 0.0];
        expected[3] = [-0.5, 0.75, 0.125];
        let bound =
            |pick: fn(f64, f64) -> f64| [0, 1, 2].map(|k| expected.iter().map(|p| p[k]).reduce(pick).expect("points"));
        accessor["min"] = json!(bound(f64::min));
        accessor["max"] = json!(bound(f64::max));
        let position = builder.add("accessors", accessor);
        // Without a buffer view, vertices 0 and 2 are both at the origin, so a triangle must not contain both.
        let order: &[u32] = if has_base { &QUAD_INDICES } else { &[0, 1, 3] };
        let indices = builder.indices(order);
        let primitive = json!({ "attributes": { "POSITION": position }, "indices": indices });
        let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
        builder.root_node(json!({ "mesh": mesh }));
        let triples: Vec<_> = order
            .chunks(3)
            .map(|t| [0, 1, 2].map(|k| expected[t[k] as usize]))
            .collect();
        assert_corners(&scene(&builder, &format!("sparse-{has_base}")), &triples);
    }
}

#[test]
fn attributes_may_be_interleaved() {
    let mut builder = Builder::new();
    let mut flat = Vec::new();
    for (position, uv) in QUAD.iter().zip(QUAD_UVS) {
        flat.extend(position);
        flat.extend(uv);
    }
    let view = builder.view(&Builder::elements("SCALAR", Component::F32, &flat, 4));
    builder.get("bufferViews")[view]["byteStride"] = json!(20);
    builder.get("bufferViews")[view]["target"] = json!(34962);
    let position = builder.add(
        "accessors",
        json!({
            "bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3",
            "min": [-1, -1, 0], "max": [1, 1, 0],
        }),
    );
    let uv = json!({ "bufferView": view, "byteOffset": 12, "componentType": 5126, "count": 4, "type": "VEC2" });
    let uv = builder.add("accessors", uv);
    let mesh = builder.quad_with(json!({ "POSITION": position, "TEXCOORD_0": uv }), None);
    builder.root_node(json!({ "mesh": mesh }));
    let scene = scene(&builder, "interleaved");
    assert_corners(&scene, &QUAD_CORNERS);
    for triangle in triangles(&scene) {
        for (corner, uv) in triangle.corners.iter().zip(triangle.uvs) {
            assert_eq!((uv.x, uv.y), ((corner.x + 1.0) / 2.0, (1.0 - corner.y) / 2.0));
        }
    }
}

#[test]
fn without_normals_triangles_are_flat() {
    // Primitives without normals have flat shading (glTF 2.0, 3.7.2.1).
    let points = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, -1.0]];
    let mut builder = Builder::new();
    let position = builder.floats(&points);
    let indices = builder.indices(&[0, 1, 2, 1, 3, 2]);
    let primitive = json!({ "attributes": { "POSITION": position }, "indices": indices });
    let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
    builder.root_node(json!({ "mesh": mesh }));
    let found = triangles(&scene(&builder, "flat"));
    assert_eq!(found.len(), 2);
    for triangle in found {
        for normal in triangle.normals {
            assert!(
                normal == DVec3::ZERO || normal.distance(triangle.geometric_normal()) < 1e-6,
                "{triangle:?}"
            );
        }
    }
}

fn colored_quad<const N: usize>(component: Component, colors: &[[f64; N]; 4], alpha: &str) -> Builder {
    let mut builder = Builder::new();
    let material = builder.unlit(json!({ "baseColorFactor": [1, 0.5, 1, 1] }));
    builder.get("materials")[material]["alphaMode"] = json!(alpha);
    let mut attributes = builder.quad_attributes();
    attributes["COLOR_0"] = json!(builder.attribute(component, component != Component::F32, colors));
    let mesh = builder.quad_with(attributes, Some(material));
    builder.root_node(json!({ "mesh": mesh }));
    builder
}

#[test]
fn vertex_colors_of_each_type_are_factors_of_the_base_color() {
    for component in [Component::U8, Component::U16, Component::F32] {
        let rgb = colored_quad(component, &[[0.2, 0.4, 0.8]; 4], "OPAQUE");
        assert_all(&scene(&rgb, &format!("colors-{component:?}-3")), [0.2, 0.2, 0.8]);
        // `OPAQUE` ignores alpha.
        let rgba = colored_quad(component, &[[0.2, 0.4, 0.8, 0.2]; 4], "OPAQUE");
        assert_all(&scene(&rgba, &format!("colors-{component:?}-4")), [0.2, 0.2, 0.8]);
        // Alpha is below the cutoff of 0.5, so only the white environment is visible.
        let masked = colored_quad(component, &[[0.2, 0.4, 0.8, 0.2]; 4], "MASK");
        assert_all(&scene(&masked, &format!("colors-{component:?}-mask")), [1.0, 1.0, 1.0]);
    }
}

#[test]
fn vertex_colors_are_linear_between_vertices() {
    let colors = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
    let scene = scene(&colored_quad(Component::F32, &colors, "OPAQUE"), "colors-between");
    for (i, pixel) in pixels(&scene).iter().enumerate() {
        let (x, y) = (
            (i % 6) as f32 / 6.0 + 1.0 / 12.0,
            1.0 - (i / 6) as f32 / 6.0 - 1.0 / 12.0,
        );
        let expected = [x, y / 2.0, y];
        assert!(
            (0..3).all(|k| (pixel[k] - expected[k]).abs() < 1e-5),
            "{i}: {pixel:?}, not {expected:?}"
        );
    }
}

#[test]
fn morph_targets_are_added_by_their_weights() {
    let mut builder = Builder::new();
    let attributes = builder.quad_attributes();
    let indices = builder.indices(&QUAD_INDICES);
    let first = builder.floats(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [0.0, 0.0, 4.0]]);
    let second = builder.floats(&[[0.0, -2.0, 0.0]; 4]);
    let normal_delta = builder.floats(&[[0.75, 0.0, 0.0]; 4]);
    let primitive = json!({
        "attributes": attributes, "indices": indices,
        "targets": [{ "POSITION": first, "NORMAL": normal_delta }, { "POSITION": second }],
    });
    let mesh = builder.add("meshes", json!({ "primitives": [primitive], "weights": [0.5, 0.25] }));
    let node = builder.root_node(json!({ "mesh": mesh }));
    let expected = |a: f64, b: f64| {
        let mut points = QUAD.map(|[x, y, z]| [x, y - 2.0 * b, z]);
        points[1][0] += a;
        points[3][2] += 4.0 * a;
        [[points[0], points[1], points[2]], [points[0], points[2], points[3]]]
    };
    let with_mesh_weights = scene(&builder, "morph-mesh");
    assert_corners(&with_mesh_weights, &expected(0.5, 0.25));
    let expected_normal = DVec3::new(0.375, 0.0, 1.0).normalize();
    for normal in triangles(&with_mesh_weights)
        .iter()
        .flat_map(|triangle| triangle.normals)
    {
        assert!(
            normal.distance(expected_normal) < 1e-5,
            "{normal}, not {expected_normal}"
        );
    }
    // Weights of the node take precedence over weights of the mesh.
    builder.get("nodes")[node]["weights"] = json!([1.0, -0.5]);
    assert_corners(&scene(&builder, "morph-node"), &expected(1.0, -0.5));
    // Another node with the same mesh has its own weights.
    builder.root_node(json!({ "mesh": mesh }));
    let expected = [expected(1.0, -0.5), expected(0.5, 0.25)].concat();
    assert_corners(&scene(&builder, "morph-two"), &expected);
}

#[test]
fn a_file_without_a_scene_gets_the_default_settings() {
    let folder = TestFolder::with_file("a", "");
    for packing in Packing::ALL {
        let file = quad().write(folder.folder(), &format!("whole-{packing:?}"), packing);
        let scene = Scene::load(&file).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(corners(&scene).len(), 2);
        assert_eq!((scene.width, scene.height), (720, 720));
        assert_eq!(scene.render.pixel_samples.count, 32);
        assert_eq!(scene.render.integrator, wgray::scene::Integrator::Path);
        assert_eq!(scene.view.transform, wgray::scene::ViewTransform::KhronosPbrNeutral);
        // Without lights, the studio environment is used.
        assert!(scene.environment.is_some());
    }
}
