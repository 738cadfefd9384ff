//! Twin of `shaders/lens.wgsl`: thin lens cameras.

use glam::Vec2;

use super::camera::image_plane_offset;
use super::math::{floor, normalize, sine};
use super::ray::Ray;
use super::warp::{disk_sample, triangle_sample};
use crate::records::Camera;

pub fn lens_ray(camera: &Camera, raster: Vec2, p: Vec2) -> Ray {
    let start = camera.lens_u * p.x + camera.lens_v * p.y;
    let through_middle = camera.forward + image_plane_offset(camera, raster);
    Ray {
        origin: camera.position + start,
        direction: normalize(through_middle - start * camera.inverse_focus),
    }
}

pub fn lens_sample(blades: u32, u: Vec2) -> Vec2 {
    if blades == 0 {
        return disk_sample(u);
    }
    polygon_sample(blades, u)
}

pub fn polygon_sample(corners: u32, u: Vec2) -> Vec2 {
    let scaled = u.x * corners as f32;
    let side = floor(scaled);
    let b = triangle_sample(Vec2::new(scaled - side, u.y));
    let step = 2.0 / corners as f32;
    circle_point(side * step) * b.x + circle_point((side + 1.0) * step) * b.y
}

pub fn circle_point(angle: f32) -> Vec2 {
    Vec2::new(sine(angle + 0.5), sine(angle))
}
