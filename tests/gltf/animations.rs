//! glTF animations, skins and morph target weights.

use glam::{DMat4, DQuat, DVec3};
use serde_json::{Value, json};

use super::build::{Builder, Component, QUAD};
use super::read::{assert_corners, rejection, scene, scene_with_keys};

fn animated_quad<const N: usize>(path: &str, interpolation: &str, times: &[f64], values: &[[f64; N]]) -> Builder {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    let node = builder.root_node(json!({ "mesh": mesh }));
    animate(&mut builder, node, path, interpolation, times, values, "go");
    builder
}

fn animate<const N: usize>(
    builder: &mut Builder,
    node: usize,
    path: &str,
    interpolation: &str,
    times: &[f64],
    values: &[[f64; N]],
    name: &str,
) {
    let times: Vec<[f64; 1]> = times.iter().map(|time| [*time]).collect();
    let input = builder.samples(&times);
    let output = builder.samples(values);
    builder.add(
        "animations",
        json!({
            "name": name,
            "channels": [{ "sampler": 0, "target": { "node": node, "path": path } }],
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }],
        }),
    );
}

fn mapped_quad(map: impl Fn(DVec3) -> DVec3) -> [[[f64; 3]; 3]; 2] {
    let p = QUAD.map(|corner| map(DVec3::from_array(corner)).to_array());
    [[p[0], p[1], p[2]], [p[0], p[2], p[3]]]
}

fn assert_at_times(
    builder: &Builder,
    name: &str,
    expected: impl Fn(f64) -> Box<dyn Fn(DVec3) -> DVec3>,
    times: &[f64],
) {
    for (i, time) in times.iter().enumerate() {
        let name = format!("{name}-{i}");
        assert_corners(
            &scene_with_keys(builder, &name, &format!("time = {time:?}")),
            &mapped_quad(expected(*time)),
        );
    }
}

#[test]
fn steps_stay_until_the_next_key() {
    let builder = animated_quad("translation", "STEP", &[1.0, 2.0], &[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    let expected = |time: f64| -> Box<dyn Fn(DVec3) -> DVec3> {
        let x = if time < 2.0 { 1.0 } else { 2.0 };
        Box::new(move |p| p + DVec3::X * x)
    };
    assert_at_times(&builder, "step", expected, &[0.0, 1.0, 1.5, 1.999, 2.0, 7.0]);
    // Without a time, the node transforms apply.
    assert_corners(&scene(&builder, "step"), &mapped_quad(|p| p));
}

#[test]
fn linear_values_are_interpolated_and_clamped_beyond_their_keys() {
    let builder = animated_quad(
        "translation",
        "LINEAR",
        &[1.0, 3.0],
        &[[0.0, 2.0, 0.0], [4.0, 0.0, 1.0]],
    );
    let expected = |time: f64| -> Box<dyn Fn(DVec3) -> DVec3> {
        let t = (time.clamp(1.0, 3.0) - 1.0) / 2.0;
        Box::new(move |p| p + DVec3::new(0.0, 2.0, 0.0).lerp(DVec3::new(4.0, 0.0, 1.0), t))
    };
    assert_at_times(&builder, "linear", expected, &[0.0, 0.5, 1.0, 1.5, 2.75, 3.0, 100.0]);
    let scaled = animated_quad("scale", "LINEAR", &[0.0, 1.0], &[[1.0, 1.0, 1.0], [3.0, 2.0, 1.0]]);
    let expected = |time: f64| -> Box<dyn Fn(DVec3) -> DVec3> {
        Box::new(move |p| p * DVec3::new(1.0 + 2.0 * time, 1.0 + time, 1.0))
    };
    assert_at_times(&scaled, "linear-scale", expected, &[0.0, 0.25, 1.0]);
}

#[test]
fn cubic_splines_are_hermite_splines() {
    // In-tangent, value and out-tangent of two keys 2 s apart (glTF 2.0, C.5).
    let keys = [
        [9.0; 3],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [2.0, 1.0, 0.0],
        [9.0; 3],
    ];
    let builder = animated_quad("translation", "CUBICSPLINE", &[1.0, 3.0], &keys);
    let expected = |time: f64| -> Box<dyn Fn(DVec3) -> DVec3> {
        let t = (time.clamp(1.0, 3.0) - 1.0) / 2.0;
        let [start, out_tangent, in_tangent, end] = [keys[1], keys[2], keys[3], keys[4]].map(DVec3::from_array);
        let value = (2.0 * t.powi(3) - 3.0 * t * t + 1.0) * start
            + 2.0 * (t.powi(3) - 2.0 * t * t + t) * out_tangent
            + (-2.0 * t.powi(3) + 3.0 * t * t) * end
            + 2.0 * (t.powi(3) - t * t) * in_tangent;
        Box::new(move |p| p + value)
    };
    assert_at_times(&builder, "cubic", expected, &[0.0, 1.0, 1.3, 2.0, 2.9, 3.0, 4.0]);
}

#[test]
fn rotations_take_the_shorter_arc_at_constant_speed() {
    let rotation = |degrees: f64| DQuat::from_axis_angle(DVec3::Z, degrees.to_radians());
    // q and -q are the same rotation; with both, the interpolation takes the shorter arc.
    for sign in [1.0, -1.0] {
        let values = [rotation(10.0).to_array(), rotation(130.0).to_array().map(|x| sign * x)];
        let builder = animated_quad("rotation", "LINEAR", &[0.0, 1.0], &values);
        let expected = move |time: f64| -> Box<dyn Fn(DVec3) -> DVec3> {
            Box::new(move |p| rotation(10.0 + 120.0 * time.clamp(0.0, 1.0)) * p)
        };
        assert_at_times(&builder, &format!("turn{sign}"), expected, &[0.0, 0.25, 0.5, 1.0]);
    }
    // Slerp divides by the sine of the angle between the rotations, which is almost 0 here.
    let values = [rotation(10.0).to_array(), rotation(10.001).to_array()];
    let builder = animated_quad("rotation", "LINEAR", &[0.0, 1.0], &values);
    let expected = move |_: f64| -> Box<dyn Fn(DVec3) -> DVec3> { Box::new(move |p| rotation(10.0005) * p) };
    assert_at_times(&builder, "turn-small", expected, &[0.5]);
}

#[test]
fn rotations_on_splines_are_normalized() {
    let (a, b) = (DQuat::IDENTITY, DQuat::from_axis_angle(DVec3::Z, 2.0));
    let keys = [[0.0; 4], a.to_array(), [0.0; 4], [0.0; 4], b.to_array(), [0.0; 4]];
    let builder = animated_quad("rotation", "CUBICSPLINE", &[0.0, 1.0], &keys);
    // Halfway between the keys, both values have weight 1/2, and the tangents are 0.
    let mean_rotation = (a + b).normalize();
    let expected = move |_: f64| -> Box<dyn Fn(DVec3) -> DVec3> { Box::new(move |p| mean_rotation * p) };
    assert_at_times(&builder, "turn-cubic", expected, &[0.5]);
}

#[test]
fn rotations_may_be_normalized_integers() {
    for component in [Component::I8, Component::U8, Component::I16, Component::U16] {
        let mut builder = Builder::new();
        let mesh = builder.quad(None);
        let node = builder.root_node(json!({ "mesh": mesh }));
        let input = builder.samples(&[[0.0], [1.0]]);
        let one = component.one();
        let output = builder.accessor("VEC4", component, &[0.0, 0.0, 0.0, one, 0.0, 0.0, one, 0.0]);
        builder.get("accessors")[output]["normalized"] = json!(true);
        builder.add(
            "animations",
            json!({
                "channels": [{ "sampler": 0, "target": { "node": node, "path": "rotation" } }],
                "samplers": [{ "input": input, "output": output }],
            }),
        );
        let scene = scene_with_keys(&builder, &format!("turn-{component:?}"), "time = 0.5");
        assert_corners(&scene, &mapped_quad(|p| DVec3::new(-p.y, p.x, p.z)));
    }
}

#[test]
fn an_animation_is_selected_by_its_name_or_number() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    let node = builder.root_node(json!({ "mesh": mesh }));
    animate(
        &mut builder,
        node,
        "translation",
        "STEP",
        &[0.0],
        &[[1.0, 0.0, 0.0]],
        "walk",
    );
    animate(
        &mut builder,
        node,
        "translation",
        "STEP",
        &[0.0],
        &[[2.0, 0.0, 0.0]],
        "run",
    );
    let quad_at = |x: f64| mapped_quad(|p| p + DVec3::X * x);
    assert_corners(&scene_with_keys(&builder, "chosen-first", "time = 0"), &quad_at(1.0));
    assert_corners(
        &scene_with_keys(&builder, "chosen-name", "time = 0\nanimation = \"run\""),
        &quad_at(2.0),
    );
    assert_corners(
        &scene_with_keys(&builder, "chosen-number", "time = 0\nanimation = 1"),
        &quad_at(2.0),
    );
    let message = rejection(&builder, "time = 0\nanimation = \"swim\"");
    assert!(message.contains("walk") && message.contains("run"), "{message}");
}

#[test]
fn animations_of_different_properties_play_together() {
    let mut builder = Builder::new();
    let mesh = builder.quad(None);
    let node = builder.root_node(json!({ "mesh": mesh }));
    let mut step = |path: &str, value: [f64; 3], name: &str| {
        animate(&mut builder, node, path, "STEP", &[0.0], &[value], name);
    };
    step("translation", [1.0, 0.0, 0.0], "walk");
    step("scale", [2.0, 2.0, 2.0], "grow");
    step("translation", [5.0, 0.0, 0.0], "run");
    step("scale", [7.0, 7.0, 7.0], "swell");
    let scene = scene_with_keys(&builder, "together", "time = 0");
    assert_corners(&scene, &mapped_quad(|p| 2.0 * p + DVec3::X));
    assert_eq!(
        scene.notes,
        [
            "together.glb: animations 2 (\"run\"), 3 (\"swell\") drive properties that an earlier animation drives, and do not play; \
             choose one with --animation"
        ]
    );
    let scene = scene_with_keys(&builder, "together-one", "time = 0\nanimation = \"swell\"");
    assert_corners(&scene, &mapped_quad(|p| 7.0 * p));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn morph_target_weights_may_be_animated() {
    let mut builder = Builder::new();
    let attributes = builder.quad_attributes();
    let indices = builder.indices(&[0, 1, 2, 0, 2, 3]);
    let right = builder.floats(&[[1.0, 0.0, 0.0]; 4]);
    let up = builder.floats(&[[0.0, 1.0, 0.0]; 4]);
    let primitive = json!({
        "attributes": attributes, "indices": indices, "targets": [{ "POSITION": right }, { "POSITION": up }],
    });
    let mesh = builder.add("meshes", json!({ "primitives": [primitive] }));
    let node = builder.root_node(json!({ "mesh": mesh }));
    animate(
        &mut builder,
        node,
        "weights",
        "LINEAR",
        &[0.0, 1.0],
        &[[0.0], [1.0], [2.0], [0.0]],
        "go",
    );
    let expected =
        |time: f64| -> Box<dyn Fn(DVec3) -> DVec3> { Box::new(move |p| p + DVec3::new(2.0 * time, 1.0 - time, 0.0)) };
    assert_at_times(&builder, "weights", expected, &[0.0, 0.25, 1.0]);
    // Each key consists of the in-tangents of all targets, then all values, then all out-tangents.
    let mut builder = builder.clone();
    let keys = [
        [0.0],
        [0.0],
        [0.0],
        [1.0],
        [0.0],
        [0.0],
        [0.0],
        [0.0],
        [2.0],
        [0.0],
        [0.0],
        [0.0],
    ];
    animate(
        &mut builder,
        node,
        "weights",
        "CUBICSPLINE",
        &[0.0, 1.0],
        &keys,
        "spline",
    );
    let scene = scene_with_keys(&builder, "weights-spline", "time = 0.5\nanimation = \"spline\"");
    assert_corners(&scene, &mapped_quad(|p| p + DVec3::new(1.0, 0.5, 0.0)));
}

/// Returns a strip with two joints. The lower corners follow the first joint, the upper left corner follows the second,
/// and the upper right corner follows both, with weights 0.4 and 0.6.
fn arm(component: Component) -> Builder {
    let mut builder = Builder::new();
    let points = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 2.0, 0.0], [1.0, 2.0, 0.0]];
    let position = builder.floats(&points);
    let joints = [[0.0; 4], [0.0; 4], [0.0, 1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]];
    let joints = builder.attribute(Component::U8, false, &joints);
    let weights = [
        [1.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.4, 0.6, 0.0, 0.0],
    ];
    let weights = builder.attribute(component, component != Component::F32, &weights);
    let indices = builder.indices(&[0, 1, 3, 0, 3, 2]);
    let attributes = json!({ "POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights });
    let mesh = builder.add(
        "meshes",
        json!({ "primitives": [{ "attributes": attributes, "indices": indices }] }),
    );
    // In the bind pose, the second joint is at (0, 1, 0).
    let matrices = [DMat4::IDENTITY, DMat4::from_translation(-DVec3::Y)].map(|m| m.to_cols_array());
    let inverse = builder.accessor("MAT4", Component::F32, matrices.as_flattened());
    let elbow = builder.add("nodes", json!({ "translation": [0, 1, 0] }));
    let shoulder = builder.root_node(json!({ "children": [elbow] }));
    let skin = builder.add(
        "skins",
        json!({ "joints": [shoulder, elbow], "inverseBindMatrices": inverse }),
    );
    // The transform of this node has no effect on a skinned mesh (glTF 2.0, 3.7.3.3).
    builder.root_node(json!({ "mesh": mesh, "skin": skin }));
    builder
}

fn arm_corners(map: impl Fn(DVec3) -> DVec3) -> [[[f64; 3]; 3]; 2] {
    let lower = [DVec3::new(-1.0, 0.0, 0.0), DVec3::new(1.0, 0.0, 0.0)];
    let left = map(DVec3::new(-1.0, 2.0, 0.0));
    let upper_right = DVec3::new(1.0, 2.0, 0.0);
    let right = 0.4 * upper_right + 0.6 * map(upper_right);
    let [a, b, c, d] = [lower[0], lower[1], left, right].map(|p| p.to_array());
    [[a, b, d], [a, d, c]]
}

#[test]
fn skinned_vertices_follow_their_joints() {
    for component in [Component::F32, Component::U8, Component::U16] {
        let mut builder = arm(component);
        assert_corners(
            &scene(&builder, &format!("skin-rest-{component:?}")),
            &arm_corners(|p| p),
        );
        let rotation = DQuat::from_axis_angle(DVec3::Z, std::f64::consts::FRAC_PI_2);
        builder.get("nodes")[0]["rotation"] = json!(rotation.to_array());
        let expected = arm_corners(|p| rotation * (p - DVec3::Y) + DVec3::Y);
        assert_corners(&scene(&builder, &format!("skin-bent-{component:?}")), &expected);
    }
}

#[test]
fn the_transform_of_a_skinned_node_is_ignored() {
    let mut builder = arm(Component::F32);
    builder.get("nodes")[2]["translation"] = json!([5, 6, 7]);
    assert_corners(&scene(&builder, "skin-moved-node"), &arm_corners(|p| p));
    builder.get("nodes")[1]["translation"] = json!([0, 0, 3]);
    let expected = arm_corners(|p| p).map(|t| t.map(|[x, y, z]| [x, y, z + 3.0]));
    assert_corners(&scene(&builder, "skin-moved-joint"), &expected);
}

#[test]
fn joints_may_be_animated() {
    let mut builder = arm(Component::F32);
    let rotation = |angle: f64| DQuat::from_axis_angle(DVec3::Z, angle);
    let values = [rotation(0.0).to_array(), rotation(1.5).to_array()];
    animate(&mut builder, 0, "rotation", "LINEAR", &[0.0, 1.0], &values, "bend");
    let expected = arm_corners(|p| rotation(0.6) * (p - DVec3::Y) + DVec3::Y);
    assert_corners(&scene_with_keys(&builder, "skin-animated", "time = 0.4"), &expected);
}

#[test]
fn a_vertex_may_have_eight_joints() {
    let mut builder = Builder::new();
    let position = builder.floats(&QUAD);
    let first_joints = builder.attribute(Component::U8, false, &[[0.0, 1.0, 2.0, 3.0]; 4]);
    let second_joints = builder.attribute(Component::U16, false, &[[4.0, 0.0, 0.0, 0.0]; 4]);
    let first_weights = builder.floats(&[[0.1, 0.1, 0.1, 0.1]; 4]);
    let second_weights = builder.floats(&[[0.6, 0.0, 0.0, 0.0]; 4]);
    let attributes = json!({
        "POSITION": position, "JOINTS_0": first_joints, "WEIGHTS_0": first_weights,
        "JOINTS_1": second_joints, "WEIGHTS_1": second_weights,
    });
    let mesh = builder.quad_with(attributes, None);
    let parent = builder.root_node(json!({}));
    let joints: Vec<usize> = (0..5)
        .map(|i| builder.add("nodes", json!({ "translation": [i, 0, 0] })))
        .collect();
    builder.get("nodes")[parent]["children"] = json!(joints);
    // Inverse bind matrices default to identity.
    let skin = builder.add("skins", json!({ "joints": joints }));
    builder.root_node(json!({ "mesh": mesh, "skin": skin }));
    let x = 0.1 * (1.0 + 2.0 + 3.0) + 0.6 * 4.0;
    assert_corners(&scene(&builder, "skin-eight"), &mapped_quad(|p| p + DVec3::X * x));
}

#[test]
fn morph_targets_are_applied_before_skinning() {
    let mut builder = arm(Component::F32);
    let target = builder.floats(&[[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]);
    let mesh = &mut builder.get("meshes")[0];
    mesh["primitives"][0]["targets"] = json!([{ "POSITION": target }]);
    mesh["weights"] = json!([1.0]);
    let rotation = DQuat::from_axis_angle(DVec3::Z, 1.0);
    builder.get("nodes")[0]["rotation"] = json!(rotation.to_array());
    let bent = |p: DVec3| rotation * (p - DVec3::Y) + DVec3::Y;
    let mut expected = arm_corners(bent);
    expected[1][2] = bent(DVec3::new(-1.0, 3.0, 0.0)).to_array();
    assert_corners(&scene(&builder, "skin-morph"), &expected);
}

#[test]
fn animation_pointers_are_ignored() {
    let mut builder = animated_quad("translation", "STEP", &[0.0], &[[1.0, 0.0, 0.0]]);
    builder.uses("KHR_animation_pointer");
    let animation = &mut builder.get("animations")[0];
    animation["channels"].as_array_mut().expect("a list").push(json!({
        "sampler": 0,
        "target": {
            "path": "pointer",
            "extensions": { "KHR_animation_pointer": { "pointer": "/nodes/0/translation" } },
        },
    }) as Value);
    assert_corners(
        &scene_with_keys(&builder, "pointer", "time = 0"),
        &mapped_quad(|p| p + DVec3::X),
    );
}
