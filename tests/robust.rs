//! Images do not depend on the unit of length or the origin: no shadow acne, no lost contact shadows.

use glam::DVec3;
use wgray::scene::{CameraDescription, Description, LightDescription, ShapeDescription};
use wgray_trace::film::Film;

use crate::oracle::{Flaw, Oracle};
use crate::pictures::reference;
use crate::scenes::{packed, scene};

fn transformed(description: &Description, scale: f64, offset: DVec3) -> Description {
    let mut description = description.clone();
    let transform_point = |p: &mut DVec3| *p = *p * scale + offset;
    let scale_vector = |v: &mut DVec3| *v *= scale;
    let scale_lengths = |size: &mut [f64; 2]| *size = size.map(|length| length * scale);
    match &mut description.camera {
        CameraDescription::Perspective(camera) => [&mut camera.position, &mut camera.look_at]
            .into_iter()
            .for_each(transform_point),
        other => panic!("unexpected variant: {other:?}"),
    };
    for light in &mut description.lights {
        match light {
            LightDescription::Rectangle(light) => {
                transform_point(&mut light.center);
                scale_lengths(&mut light.size);
            }
            LightDescription::Point(light) => transform_point(&mut light.position),
            other => panic!("unexpected variant: {other:?}"),
        }
    }
    for shape in &mut description.shapes {
        match shape {
            ShapeDescription::Rectangle(shape) => {
                transform_point(&mut shape.center);
                scale_lengths(&mut shape.size);
            }
            ShapeDescription::Ellipsoid(shape) => {
                transform_point(&mut shape.center);
                [&mut shape.a, &mut shape.b, &mut shape.c]
                    .into_iter()
                    .for_each(scale_vector);
            }
            ShapeDescription::Tetrahedron(shape) => shape.vertices.iter_mut().for_each(transform_point),
            other => panic!("unexpected variant: {other:?}"),
        }
    }
    description
}

fn cornell() -> Description {
    let mut description = scene("cornell.toml");
    (description.image.width, description.image.height) = (200, 200);
    description.render.pixel_samples.count = 1;
    description.render.light_samples.count = 16;
    description
}

fn differing_pixels(a: &Film, b: &Film, tolerance: f32) -> Vec<usize> {
    let differs = |(a, b): ([f32; 3], [f32; 3])| a.iter().zip(b).any(|(a, b)| !((a - b).abs() <= tolerance));
    let pairs = a.means().zip(b.means()).enumerate();
    pairs
        .filter(|(_, pair)| differs(*pair))
        .map(|(pixel, _)| pixel)
        .collect()
}

/// Returns the pixels that differ visibly, of 40,000 pixels. A shadow edge that moves across a light sample changes a
/// pixel by 1/16 of the light's contribution.
fn visibly_differing_pixels(offset: f64, shadow_epsilon: f64) -> Vec<usize> {
    let expected = reference(&packed(&cornell()));
    let mut description = transformed(&cornell(), 1.0, DVec3::splat(offset));
    description.render.shadow_epsilon = shadow_epsilon;
    differing_pixels(&reference(&packed(&description)), &expected, 0.01)
}

/// Rays start 32 units of 2^-24 above a surface, with an error below 24 units: docs/decisions/shadow-rays.md, step 5.
/// All coordinates are within 1 of the look-at point.
const ROUNDING: f64 = 56.0 / 16_777_216.0;

/// Returns true if rounding may change a pixel: in f64, moving the camera or the light by `ROUNDING` moves an edge
/// across the camera ray or a light sample.
fn is_near_edge(description: &Description, pixel: usize) -> bool {
    let value = |description: &Description| {
        let oracle = Oracle::new(description, Flaw::None);
        DVec3::from_array(oracle.pixel(pixel as u32))
    };
    let expected = value(description);
    let differs = |moved: Description| (value(&moved) - expected).abs().max_element() > 1e-3;
    let offsets = [DVec3::X, DVec3::Y, DVec3::Z].map(|offset| offset * ROUNDING);
    let displacements = offsets.into_iter().chain(offsets.map(|offset| -offset));
    displacements
        .into_iter()
        .any(|offset| differs(with_moved_light(description, offset)) || differs(with_moved_camera(description, offset)))
}

fn with_moved_light(description: &Description, offset: DVec3) -> Description {
    let mut description = description.clone();
    for light in &mut description.lights {
        match light {
            LightDescription::Rectangle(light) => light.center += offset,
            other => panic!("unexpected variant: {other:?}"),
        }
    }
    description
}

fn with_moved_camera(description: &Description, offset: DVec3) -> Description {
    let mut description = description.clone();
    match &mut description.camera {
        CameraDescription::Perspective(camera) => {
            camera.position += offset;
            camera.look_at += offset;
        }
        other => panic!("unexpected variant: {other:?}"),
    }
    description
}

/// The segment from pixel (15, 193) to the first light sample passes an edge at a distance of 4e-7; the scale decides
/// whether the edge occludes the segment.
#[test]
fn scaling_changes_pixels_only_near_edges() {
    let (scene, expected) = (cornell(), reference(&packed(&cornell())));
    for scale in [0.001, 0.3, 7.7, 1000.0] {
        let found = reference(&packed(&transformed(&scene, scale, DVec3::ZERO)));
        for pixel in differing_pixels(&found, &expected, 1e-5) {
            assert!(is_near_edge(&scene, pixel), "scaled by {scale}: pixel {pixel}");
        }
    }
    let sampled_pixels = (0..40_000).step_by(41);
    let near_edge_count = sampled_pixels.filter(|pixel| is_near_edge(&scene, *pixel)).count();
    assert_eq!(near_edge_count, 0, "some of the sampled pixels are near edges");
}

/// Offsets are up to a million times the size of the scene. The image does not change, because packed coordinates are
/// relative to a point near the look-at point.
#[test]
fn translation_does_not_change_the_image() {
    for offset in [100.0, -2000.0, 1e6] {
        let (found, expected) = (transformed(&cornell(), 1.0, DVec3::splat(offset)), cornell());
        let (found, expected) = (reference(&packed(&found)), reference(&packed(&expected)));
        assert_eq!(found, expected, "moved by {offset}");
    }
    // These offsets are not multiples of the grid of possible origins.
    for offset in [1999.3, -77_777.7] {
        let found = visibly_differing_pixels(offset, 0.0);
        assert!(found.is_empty(), "moved by {offset}: pixels {found:?}");
    }
}

#[test]
fn too_large_a_shadow_epsilon_is_detected() {
    let changed = visibly_differing_pixels(0.0, 0.05);
    assert!(
        changed.len() > 400,
        "pixels with lost contact shadows: {}",
        changed.len()
    );
    // A small offset also changes pixels far from edges.
    let (scene, moved) = (cornell(), visibly_differing_pixels(0.0, 1e-3));
    let far_from_edges = moved.iter().filter(|pixel| !is_near_edge(&scene, **pixel)).count();
    assert!(
        far_from_edges > 60,
        "pixels far from edges: {far_from_edges} of {}",
        moved.len()
    );
}
