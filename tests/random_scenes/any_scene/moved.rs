//! Scaling and translation of random scenes.

use glam::DVec3;
use wgray::scene::*;

use super::shapes::{move_placement, scale_and_translate_shape};

/// Scales the cameras, lights and shapes of a scene about the origin, then translates them by `offset`.
pub fn scale_and_translate(description: &mut Description, scale: f64, offset: DVec3) {
    let move_point = |p: &mut DVec3| *p = *p * scale + offset;
    match &mut description.camera {
        CameraDescription::Perspective(c) => {
            for length in [&mut c.aperture, &mut c.focus_distance].into_iter().flatten() {
                *length *= scale;
            }
            [&mut c.position, &mut c.look_at].map(move_point)
        }
        CameraDescription::Panorama(c) => [&mut c.position, &mut c.look_at].map(move_point),
        CameraDescription::Orthographic(c) => {
            c.height *= scale;
            [&mut c.position, &mut c.look_at].map(move_point)
        }
    };
    for light in &mut description.lights {
        match light {
            LightDescription::Rectangle(l) => {
                move_point(&mut l.center);
                l.size = l.size.map(|side| side * scale);
            }
            LightDescription::Point(l) => move_point(&mut l.position),
            LightDescription::Spot(l) => move_point(&mut l.position),
            _ => {}
        }
    }
    for shape in &mut description.shapes {
        scale_and_translate_shape(shape, scale, offset);
    }
    for i in &mut description.instances {
        move_placement(&mut i.translate, &mut i.scale, &mut i.matrix, scale, offset);
    }
}
