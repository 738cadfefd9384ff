//! Origin of the packed coordinates, near the camera's look-at point. Relative to the file's origin, a scene at a
//! distance of a thousand times its size would lose ten of the 24 bits of f32.

use std::borrow::Cow;

use glam::DVec3;

use wgray_scene::{Camera, Light, Scene};

/// Returns a point near the camera's look-at point, on a grid whose spacing is a power of 2, at least the distance from
/// the camera to the look-at point. Scenes near the file's origin keep their coordinates, and the translation adds no
/// significant digits to coordinates.
pub fn origin(camera: &Camera) -> DVec3 {
    let cell = camera.position.distance(camera.look_at).log2().ceil().exp2();
    (camera.look_at / cell).round() * cell
}

/// Translates a scene to another origin.
pub fn translated_to(scene: &Scene, origin: DVec3) -> Cow<'_, Scene> {
    if origin == DVec3::ZERO {
        return Cow::Borrowed(scene);
    }
    let mut scene = scene.clone();
    for light in &mut scene.lights {
        match light {
            Light::Rectangle { rectangle, .. } => rectangle.center -= origin,
            Light::Point { position, .. } | Light::Spot { position, .. } => *position -= origin,
            Light::Directional { .. } => {}
        }
    }
    for shape in &mut scene.shapes {
        shape.geometry.translate(-origin);
    }
    Cow::Owned(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgray_scene::Description;

    fn camera(position: [f64; 3], look_at: [f64; 3]) -> Camera {
        let text = format!(
            "[image]\nwidth = 1\nheight = 1\n[camera]\nposition = {position:?}\nlook_at = {look_at:?}\nfov = 40\n"
        );
        let description = Description::parse(&text, "test").expect("a scene");
        description.validate().expect("a valid scene").camera
    }

    #[test]
    fn a_scene_around_the_origin_keeps_its_coordinates() {
        assert_eq!(origin(&camera([0.0, -3.0, 1.3], [0.0, 0.0, 1.0])), DVec3::ZERO);
        assert_eq!(origin(&camera([1e9, 0.0, 0.0], [0.0, 1.0, 0.0])), DVec3::ZERO);
    }

    #[test]
    fn the_origin_is_no_farther_from_the_look_at_point_than_the_camera() {
        for (position, look_at) in [
            ([2000.0, 1997.0, 2001.3], [2000.0, 2000.0, 2001.0]),
            ([-1e9, 1e9, 0.0], [-1e9 + 1e-3, 1e9, 1e-3]),
            ([5.0, 7.0, 0.1], [-40.0, 7.0, 0.0]),
        ] {
            let camera = camera(position, look_at);
            let distance = camera.position.distance(camera.look_at);
            let offset = (origin(&camera) - camera.look_at).abs().max_element();
            assert!(offset <= distance, "{position:?}: {offset}");
        }
    }
}
