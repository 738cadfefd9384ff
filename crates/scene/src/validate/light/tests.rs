//! Tests of the directions and angles of spot lights.

use crate::{Light, Scene};

fn spot(keys: &str) -> Result<Light, String> {
    let text = format!(
        "image = {{ width = 1, height = 1 }}\ncamera = {{ position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }}\n\
         [[lights]]\ntype = 'spot'\nposition = [1, 2, 3]\ncolor = [1, 1, 1]\n{keys}\n"
    );
    let scene = Scene::parse(&text, "s.toml").map_err(|error| error.to_string())?;
    Ok(scene.lights[0].clone())
}

#[test]
fn a_spot_has_a_direction_or_looks_at_a_point() {
    let angle = "cone_angle = 30\n";
    let by_direction = spot(&format!("{angle}direction = [0, 0, -7]"));
    assert_eq!(by_direction, spot(&format!("{angle}look_at = [1, 2, -4]")));
    let Ok(Light::Spot {
        direction, cone, inner, ..
    }) = by_direction
    else {
        panic!("{by_direction:?}");
    };
    assert_eq!((direction, cone, inner), (-glam::DVec3::Z, 30_f64.to_radians(), 0.0));
    for (keys, rule) in [
        ("", "lights[0].direction is missing; set direction or look_at"),
        (
            "direction = [0, 0, 1]\nlook_at = [0, 0, 0]",
            "lights[0].direction: cannot be combined with look_at; remove one",
        ),
        (
            "direction = [0, 0, 0]",
            "lights[0].direction: [0, 0, 0] must not be zero",
        ),
        (
            "look_at = [1, 2, 3]",
            "lights[0].look_at: [1, 2, 3] must be at least 1e-9 away from the light",
        ),
    ] {
        let message = spot(&format!("{angle}{keys}")).expect_err(keys);
        assert!(message.contains(rule), "{message}");
    }
}

#[test]
fn the_angles_of_a_spot_are_limited() {
    let parse = |keys: &str| spot(&format!("direction = [1, 0, 0]\n{keys}"));
    for keys in [
        "cone_angle = 0.01",
        "cone_angle = 180",
        "cone_angle = 180\ninner_angle = 180",
        "cone_angle = 0.01\ninner_angle = 0.01",
        "cone_angle = 90\ninner_angle = 0",
    ] {
        assert!(parse(keys).is_ok(), "{keys}");
    }
    for (keys, rule) in [
        ("cone_angle = 0", "cone_angle: 0 must be from 0.01 to 180"),
        ("cone_angle = 180.1", "cone_angle: 180.1 must be from 0.01 to 180"),
        ("cone_angle = nan", "cone_angle: nan must be from 0.01 to 180"),
        (
            "cone_angle = 20\ninner_angle = 20.1",
            "inner_angle: 20.1 must be from 0 to cone_angle, 20",
        ),
        ("cone_angle = 20\ninner_angle = -1", "inner_angle: -1 must be"),
    ] {
        let message = parse(keys).expect_err(keys);
        assert!(message.contains(rule), "{message}");
    }
}
