//! Twin of `shaders/camera.wgsl`: camera rays.

use glam::Vec2;

use super::math::normalize;
use super::ray::Ray;
use crate::pack::{Camera, ORTHOGRAPHIC};

pub fn camera_ray(camera: &Camera, at: Vec2) -> Ray {
    let x = at.x * (2.0 / camera.width as f32) - 1.0;
    let y = 1.0 - at.y * (2.0 / camera.height as f32);
    let offset = camera.right * x + camera.up * y;
    if camera.projection == ORTHOGRAPHIC {
        return Ray {
            origin: camera.position + offset,
            direction: camera.forward,
        };
    }
    Ray {
        origin: camera.position,
        direction: normalize(camera.forward + offset),
    }
}
