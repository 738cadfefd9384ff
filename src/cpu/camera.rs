//! Twin of `shaders/camera.wgsl`: camera rays and their differentials.

use glam::{Vec2, Vec3};

use super::differential::{Derivative, Differential};
use super::math::{dot, normalize};
use super::ray::Ray;
use crate::pack::{Camera, ORTHOGRAPHIC};

pub fn camera_ray(camera: &Camera, at: Vec2) -> Ray {
    let offset = image_plane_offset(camera, at);
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

pub fn camera_differential(camera: &Camera, at: Vec2, spacing: f32) -> Differential {
    Differential {
        x: camera_derivative(camera, at, camera.right * (2.0 / camera.width as f32 * spacing)),
        y: camera_derivative(camera, at, camera.up * (-2.0 / camera.height as f32 * spacing)),
    }
}

pub fn camera_derivative(camera: &Camera, at: Vec2, step: Vec3) -> Derivative {
    if camera.projection == ORTHOGRAPHIC {
        return Derivative {
            position: step,
            direction: Vec3::ZERO,
        };
    }
    let d = camera.forward + image_plane_offset(camera, at);
    let dd = dot(d, d);
    Derivative {
        position: Vec3::ZERO,
        direction: (step * dd - d * dot(d, step)) / (dd * dd.sqrt()),
    }
}

pub fn image_plane_offset(camera: &Camera, at: Vec2) -> Vec3 {
    let x = at.x * (2.0 / camera.width as f32) - 1.0;
    let y = 1.0 - at.y * (2.0 / camera.height as f32);
    camera.right * x + camera.up * y
}
