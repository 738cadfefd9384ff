//! Tests of the warnings about scenes in which nothing can be visible.

use crate::Scene;

const NO_LIGHT: &str = "the scene has no light, emission or environment; every surface renders black";
const NOT_IN_VIEW: &str = "no shape is in view of the camera; the image shows only the background \
                           (check camera.position and camera.look_at)";
const NO_SHAPES: &str = "the scene has no shapes; the image shows only the background";

/// A camera at (0, -10, 0) along +y, with a vertical field of view of 90 degrees and 20 x 10 pixels.
const CAMERA: &str = "[image]\nwidth = 20\nheight = 10\n\
    [camera]\nposition = [0, -10, 0]\nlook_at = [0, 0, 0]\nfov = 90\n";
const LIGHT: &str = "[[lights]]\ntype = 'point'\nposition = [0, 0, 5]\ncolor = [1, 1, 1]\n";
const GRAY: &str = "[materials.gray]\ntype = 'diffuse'\ncolor = [0.5, 0.5, 0.5]\n";
const PATH: &str = "[render]\nintegrator = 'path'\n";

fn warnings(text: &str) -> Vec<String> {
    let scene = Scene::parse(text, "s.toml");
    scene.expect("a valid scene").visibility_warnings()
}

fn sphere(center: [f64; 3]) -> String {
    format!("[[shapes]]\ntype = 'sphere'\nmaterial = 'gray'\ncenter = {center:?}\nradius = 1.0\n")
}

#[test]
fn a_lit_shape_in_view_has_no_warning() {
    let scene = format!("{CAMERA}{PATH}{GRAY}{LIGHT}{}", sphere([0.0; 3]));
    assert_eq!(warnings(&scene), [""; 0]);
}

#[test]
fn any_source_of_light_suffices() {
    let sphere = sphere([0.0; 3]);
    let dark = format!("{CAMERA}{PATH}{GRAY}{sphere}");
    assert_eq!(warnings(&dark), [NO_LIGHT]);
    assert_eq!(
        warnings(&format!("{dark}{}", LIGHT.replace("[1, 1, 1]", "[0, 0, 0]"))),
        [NO_LIGHT]
    );
    assert_eq!(
        warnings(&format!("{dark}[environment]\ncolor = [0, 0, 0]\n")),
        [NO_LIGHT]
    );
    for lit in [
        format!("{dark}[environment]\ncolor = [0, 0, 0.1]\n"),
        format!("{dark}[environment]\nname = 'sky'\n"),
        dark.replace("[0.5, 0.5, 0.5]", "[0.5, 0.5, 0.5]\nemission = [0, 1, 0]"),
    ] {
        assert_eq!(warnings(&lit), [""; 0], "{lit}");
    }
    let unused = "[materials.lit]\ntype = 'diffuse'\ncolor = [0, 0, 0]\nemission = [1, 1, 1]\n";
    assert_eq!(warnings(&format!("{dark}{unused}")), [NO_LIGHT]);
    // The Phong integrator supports an ambient term instead of emission.
    let phong = |ambient: &str, factor: &str| {
        format!(
            "{CAMERA}[render]\nambient = {ambient}\n[materials.gray]\ntype = 'phong'\ncolor = [1, 1, 1]\nambient = {factor}\n{sphere}"
        )
    };
    assert_eq!(warnings(&phong("[0, 0, 0]", "[1, 1, 1]")), [NO_LIGHT]);
    assert_eq!(warnings(&phong("[1, 1, 1]", "[0, 0, 0]")), [NO_LIGHT]);
    assert_eq!(warnings(&phong("[1, 1, 1]", "[1, 1, 1]")), [""; 0]);
}

#[test]
fn spheres_just_outside_of_the_view_are_reported_and_those_at_its_edge_are_not() {
    // At depth 10, the view is 40 x 20, not including the filter's margin. A corner of a sphere's bounding box is at
    // most sqrt(3) closer to a slanted side than the center of the sphere.
    let visible = [
        [0.0, 0.0, 0.0],
        [19.0, 0.0, 0.0],
        [-19.0, 0.0, 0.0],
        [0.0, 0.0, 10.9],
        [0.0, 0.0, -10.9],
        [0.0, -10.5, 0.0],
    ];
    let invisible = [
        [28.0, 0.0, 0.0],
        [-28.0, 0.0, 0.0],
        [0.0, 0.0, 16.0],
        [0.0, 0.0, -16.0],
        [0.0, -11.5, 0.0],
        [0.0, -100.0, 0.0],
    ];
    let scene = |center| format!("{CAMERA}{PATH}{GRAY}{LIGHT}{}", sphere(center));
    for center in visible {
        assert_eq!(warnings(&scene(center)), [""; 0], "{center:?}");
    }
    for center in invisible {
        assert_eq!(warnings(&scene(center)), [NOT_IN_VIEW], "{center:?}");
    }
    // A single shape in view suffices. A panorama sees all directions.
    let both = format!("{}{}", scene(invisible[0]), sphere(visible[0]));
    assert_eq!(warnings(&both), [""; 0]);
    let panorama = scene(invisible[4]).replace("fov = 90", "type = 'panorama'");
    assert_eq!(warnings(&panorama), [""; 0]);
}

#[test]
fn orthographic_cameras_see_a_box() {
    let scene = |center| {
        let perspective = format!("{CAMERA}{PATH}{GRAY}{LIGHT}{}", sphere(center));
        perspective.replace("fov = 90", "type = 'orthographic'\nheight = 10")
    };
    for center in [[10.5, 1e4, 0.0], [-10.5, 0.0, 0.0], [0.0, 0.0, 5.5], [0.0, -10.5, 0.0]] {
        assert_eq!(warnings(&scene(center)), [""; 0], "{center:?}");
    }
    for center in [[15.0, 0.0, 0.0], [0.0, 1e4, 10.0], [0.0, 0.0, -10.0], [0.0, -11.5, 0.0]] {
        assert_eq!(warnings(&scene(center)), [NOT_IN_VIEW], "{center:?}");
    }
}

#[test]
fn scenes_without_shapes_are_reported_unless_they_show_an_environment_map() {
    assert_eq!(warnings(&format!("{CAMERA}{PATH}")), [NO_SHAPES]);
    assert_eq!(
        warnings(&format!("{CAMERA}{PATH}[environment]\ncolor = [1, 1, 1]\n")),
        [NO_SHAPES]
    );
    assert_eq!(
        warnings(&format!("{CAMERA}{PATH}[environment]\nname = 'sky'\n")),
        [""; 0]
    );
    let plane =
        "[[shapes]]\ntype = 'plane'\nmaterial = 'gray'\npoint = [0, 0, -1]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n";
    assert_eq!(warnings(&format!("{CAMERA}{PATH}{GRAY}{LIGHT}{plane}")), [""; 0]);
    let gray = GRAY.replace("[0.5, 0.5, 0.5]", "[0.5, 0.5, 0.5]\nvisible = false");
    assert_eq!(warnings(&format!("{CAMERA}{PATH}{gray}{LIGHT}{plane}")), [NOT_IN_VIEW]);
}

#[test]
fn paths_without_bounces_show_only_emission() {
    let scene = |depth: u32, extra: &str| {
        let render = format!("[render]\nintegrator = 'path'\nmax_depth = {depth}\n");
        warnings(&format!("{CAMERA}{render}{GRAY}{LIGHT}{extra}{}", sphere([0.0; 3])))
    };
    let [warning] = &scene(0, "")[..] else {
        panic!("{:?}", scene(0, ""))
    };
    assert!(
        warning.starts_with("render.max_depth is 0, so only emitters are visible"),
        "{warning}"
    );
    assert_eq!(scene(1, ""), [""; 0]);
    let emissive = GRAY.replace("gray", "lit") + "emission = [0, 1, 0]\n";
    let lit = sphere([3.0, 0.0, 0.0]).replace("gray", "lit");
    assert_eq!(scene(0, &format!("{emissive}{lit}")), [""; 0]);
}
