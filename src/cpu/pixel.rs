//! Twin of `shaders/pixel.wgsl`: the samples of a pixel.

use glam::{UVec2, Vec2, Vec3, Vec4};

use super::camera::{camera_differential, camera_ray};
use super::differential::Differential;
use super::filter::{filter_bin, filter_offset};
use super::integrators::{path, phong};
use super::ray::Ray;
use super::sampling::{sample_key, sample_square};
use crate::pack::Packed;
use crate::scene::Integrator;

/// One sample of a pixel: its radiance times its weight, and its weight; and where layers are wanted its part of these.
pub fn pixel_radiance(scene: &Packed, pixel: UVec2, sample: u32) -> (Vec4, Layers) {
    match scene.integrator {
        Integrator::Phong => {
            let start = camera_sample(scene, pixel, sample);
            let found = phong::radiance(scene, start.ray, start.differential, pixel, sample);
            ((found * start.weight).extend(start.weight), Layers::default())
        }
        Integrator::Path => {
            let mut state = path::begin_path(scene, pixel, sample);
            while !state.ended {
                state = path::advance(scene, state, pixel);
            }
            (path::path_value(&state), path::path_layers(&state))
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSample {
    pub ray: Ray,
    pub differential: Differential,
    pub weight: f32,
}

pub fn camera_sample(scene: &Packed, pixel: UVec2, sample: u32) -> CameraSample {
    let s = &scene.specialization;
    let (round, index) = (sample / s.pixel_samples, sample % s.pixel_samples);
    let key = sample_key(pixel, scene.camera.seed, 0);
    let u = sample_square(s.pixel_pattern, s.pixel_side, index, round, key);
    let at = filtered(scene, u);
    let place = pixel.as_vec2() + at.truncate();
    CameraSample {
        ray: camera_ray(&scene.camera, place),
        differential: differential_at(scene, place),
        weight: at.z,
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layers {
    pub emission: Vec4,
    pub direct: Vec4,
    pub indirect: Vec4,
    pub albedo: Vec4,
    pub normal: Vec4,
}

pub fn differential_at(scene: &Packed, place: Vec2) -> Differential {
    let s = &scene.specialization;
    if s.differentials == 0 {
        return Differential::default();
    }
    camera_differential(&scene.camera, place, 1.0 / (s.pixel_samples as f32).sqrt())
}

pub fn filtered(scene: &Packed, u: Vec2) -> Vec3 {
    let (bins, table) = (scene.specialization.filter_bins, &scene.filter_table);
    if bins == 0 {
        return u.extend(1.0);
    }
    let (i, j) = (filter_bin(u.x, bins), filter_bin(u.y, bins));
    let (of_x, of_y) = (table[i as usize], table[j as usize]);
    let x = filter_offset(u.x, i, bins, of_x.x, of_x.y);
    let y = filter_offset(u.y, j, bins, of_y.x, of_y.y);
    Vec3::new(0.5 + x, 0.5 + y, of_x.z * of_y.z)
}
