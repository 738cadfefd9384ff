//! Twin of `shaders/panorama.wgsl`: equirectangular camera.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::differential::{Derivative, Differential};
use super::lens::circle_point;
use super::math::normalize;
use super::ray::Ray;
use crate::records::Camera;

pub fn panorama_ray(camera: &Camera, raster: Vec2) -> Ray {
    let east = circle_point(panorama_angles(camera, raster).x);
    let north = circle_point(panorama_angles(camera, raster).y);
    let horizontal = camera.forward * east.x + camera.right * east.y;
    Ray {
        origin: camera.position,
        direction: normalize(horizontal * north.x + camera.up * north.y),
    }
}

pub fn panorama_differential(camera: &Camera, raster: Vec2, spacing: f32) -> Differential {
    let east = circle_point(panorama_angles(camera, raster).x);
    let north = circle_point(panorama_angles(camera, raster).y);
    let horizontal = camera.forward * east.x + camera.right * east.y;
    let eastward = camera.right * east.x - camera.forward * east.y;
    let dx = eastward * (north.x * (TAU / camera.width as f32 * spacing));
    let dy = (horizontal * north.y - camera.up * north.x) * (PI / camera.height as f32 * spacing);
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

pub fn panorama_angles(camera: &Camera, raster: Vec2) -> Vec2 {
    Vec2::new(
        raster.x * (2.0 / camera.width as f32) - 1.0,
        0.5 - raster.y * (1.0 / camera.height as f32),
    )
}
