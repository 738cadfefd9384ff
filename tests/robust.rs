//! A picture does not depend on the unit of length, nor on where the origin is: no acne, no lost contact shadows.

use glam::DVec3;
use wgray::film::Film;
use wgray::scene::{CameraDescription, Description, LightDescription, ShapeDescription};

use crate::pictures::reference;
use crate::scenes::{packed, scene};

/// The scene scaled about the origin and then moved.
fn transformed(description: &Description, scale: f64, offset: DVec3) -> Description {
    let mut description = description.clone();
    let point = |p: &mut DVec3| *p = *p * scale + offset;
    let vector = |v: &mut DVec3| *v *= scale;
    let lengths = |size: &mut [f64; 2]| *size = size.map(|length| length * scale);
    match &mut description.camera {
        CameraDescription::Perspective(camera) => {
            [&mut camera.position, &mut camera.look_at].into_iter().for_each(point)
        }
        other => panic!("not foreseen: {other:?}"),
    };
    for light in &mut description.lights {
        match light {
            LightDescription::Rectangle(light) => {
                point(&mut light.center);
                lengths(&mut light.size);
            }
            LightDescription::Point(light) => point(&mut light.position),
            other => panic!("not foreseen: {other:?}"),
        }
    }
    for shape in &mut description.shapes {
        match shape {
            ShapeDescription::Rectangle(shape) => {
                point(&mut shape.center);
                lengths(&mut shape.size);
            }
            ShapeDescription::Ellipsoid(shape) => {
                point(&mut shape.center);
                [&mut shape.a, &mut shape.b, &mut shape.c].into_iter().for_each(vector);
            }
            ShapeDescription::Tetrahedron(shape) => shape.vertices.iter_mut().for_each(point),
            other => panic!("not foreseen: {other:?}"),
        }
    }
    description
}

/// The assignment scene with few samples, so that each counts.
fn cornell() -> Description {
    let mut description = scene("cornell.toml");
    (description.image.width, description.image.height) = (200, 200);
    description.render.pixel_samples.count = 1;
    description.render.light_samples.count = 16;
    description
}

/// Pixels with a value that differs by more than a tolerance.
fn beyond(a: &Film, b: &Film, tolerance: f32) -> usize {
    let far = |(a, b): ([f32; 3], [f32; 3])| a.iter().zip(b).any(|(a, b)| !((a - b).abs() <= tolerance));
    a.means().zip(b.means()).filter(|pair| far(*pair)).count()
}

/// Pixels of the 40,000 that differ visibly from the scene where it was. A shadow's edge that falls to the other side of
/// a light's sample changes a value by 1/16 of the light.
fn visible(scale: f64, offset: f64, shadow_epsilon: f64) -> usize {
    let expected = reference(&packed(&cornell()));
    let mut description = transformed(&cornell(), scale, DVec3::splat(offset));
    description.render.shadow_epsilon = shadow_epsilon;
    beyond(&reference(&packed(&description)), &expected, 0.01)
}

#[test]
fn the_unit_of_length_does_not_show() {
    let expected = reference(&packed(&cornell()));
    for scale in [0.001, 1000.0] {
        let found = reference(&packed(&transformed(&cornell(), scale, DVec3::ZERO)));
        let differ = beyond(&found, &expected, 1e-5);
        assert!(
            differ <= 2,
            "scaled by {scale}: {differ} pixels, more than edges' last digits"
        ); // 1 and 0
    }
}

/// 1000 of its own sizes away, and farther: coordinates are counted from near what the camera looks at.
#[test]
fn the_place_of_the_origin_does_not_show() {
    for offset in [100.0, -2000.0, 1e6] {
        let (found, expected) = (transformed(&cornell(), 1.0, DVec3::splat(offset)), cornell());
        let (found, expected) = (reference(&packed(&found)), reference(&packed(&expected)));
        assert_eq!(found, expected, "moved by {offset}");
    }
    // not by a multiple of the grid that the origin is on
    for offset in [1999.3, -77_777.7] {
        let found = visible(1.0, offset, 0.0);
        assert!(found <= 12, "moved by {offset}: {found} pixels");
    }
}

#[test]
fn too_large_an_offset_is_found() {
    let leaks = visible(1.0, 0.0, 0.05);
    assert!(leaks > 400, "lost contact shadows: {leaks} pixels");
}
