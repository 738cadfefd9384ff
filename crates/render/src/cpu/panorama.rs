//! Twin of `shaders/panorama.wgsl`: equirectangular camera.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::differential::{Derivative, Differential};
use super::lens::circle_point;
use super::math::normalize;
use super::ray::Ray;
use crate::records::Camera;

pub fn panorama_ray(camera: &Camera, at: Vec2) -> Ray {
    let east = circle_point(panorama_angles(camera, at).x);
    let north = circle_point(panorama_angles(camera, at).y);
    let level = camera.forward * east.x + camera.right * east.y;
    Ray {
        origin: camera.position,
        direction: normalize(level * north.x + camera.up * north.y),
    }
}

pub fn panorama_differential(camera: &Camera, at: Vec2, spacing: f32) -> Differential {
    let east = circle_point(panorama_angles(camera, at).x);
    let north = circle_point(panorama_angles(camera, at).y);
    let level = camera.forward * east.x + camera.right * east.y;
    let along = camera.right * east.x - camera.forward * east.y;
    let dx = along * (north.x * (TAU / camera.width as f32 * spacing));
    let dy = (level * north.y - camera.up * north.x) * (PI / camera.height as f32 * spacing);
    Differential {
        x: Derivative {
            position: Vec3::ZERO,
            direction: dx,
        },
        y: Derivative {
            position: Vec3::ZERO,
            direction: dy,
        },
    }
}

pub fn panorama_angles(camera: &Camera, at: Vec2) -> Vec2 {
    Vec2::new(
        at.x * (2.0 / camera.width as f32) - 1.0,
        0.5 - at.y * (1.0 / camera.height as f32),
    )
}
