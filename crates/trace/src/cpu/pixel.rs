//! Twin of `shaders/pixel.wgsl`: camera samples of a pixel.

use glam::{UVec2, UVec4, Vec2, Vec3, Vec4, Vec4Swizzles};

use super::camera::camera_differential;
use super::differential::Differential;
use super::filter::{filter_bin, filter_offset};
use super::geometry::view_ray;
use super::integrators::{path, phong};
use super::lens::{lens_ray, lens_sample};
use super::panorama::panorama_differential;
use super::ray::Ray;
use super::rng::hash4;
use super::sampling::{random_sample, sample_key, sample_square};
use super::sequence::sobol_sample;
use crate::records::{Packed, RANDOM};
use wgray_scene::Integrator;

/// Returns a sample's weighted radiance and weight, and its contribution to enabled layers.
pub fn pixel_radiance(scene: &Packed, pixel: UVec2, sample: u32) -> (Vec4, Layers) {
    match scene.integrator {
        Integrator::Phong => {
            let start = camera_sample(scene, pixel, sample);
            let radiance = phong::radiance(scene, start.ray, start.differential, pixel, sample);
            ((radiance * start.weight).extend(start.weight), Layers::default())
        }
        Integrator::Path => {
            let mut state = path::begin_path(scene, pixel, sample);
            while !state.ended {
                path::advance(scene, &mut state, pixel);
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
    let position = filtered(scene, u);
    let raster = pixel.as_vec2() + position.truncate();
    let mut ray = view_ray(scene, raster);
    if s.lens != 0 {
        ray = lens_ray(&scene.camera, raster, lens_point(scene, pixel, sample));
    }
    CameraSample {
        ray,
        differential: differential_at(scene, raster),
        weight: position.z,
    }
}

pub fn lens_point(scene: &Packed, pixel: UVec2, sample: u32) -> Vec2 {
    let key = hash4(UVec4::new(pixel.x, pixel.y, scene.camera.seed, 0)).zw();
    let mut u = sobol_sample(sample, key);
    if scene.specialization.pixel_pattern == RANDOM {
        u = random_sample(sample, 0, key);
    }
    lens_sample(scene.camera.blades, u)
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layers {
    pub emission: Vec4,
    pub direct: Vec4,
    pub indirect: Vec4,
    pub albedo: Vec4,
    pub normal: Vec4,
}

pub fn differential_at(scene: &Packed, raster: Vec2) -> Differential {
    let s = &scene.specialization;
    if s.differentials == 0 {
        return Differential::default();
    }
    let spacing = 1.0 / (s.pixel_samples as f32).sqrt();
    if s.panoramic != 0 {
        return panorama_differential(&scene.camera, raster, spacing);
    }
    camera_differential(&scene.camera, raster, spacing)
}

pub fn filtered(scene: &Packed, u: Vec2) -> Vec3 {
    let (bins, table) = (scene.specialization.filter_bins, &scene.sampling.filter_table);
    if bins == 0 {
        return u.extend(1.0);
    }
    let (i, j) = (filter_bin(u.x, bins), filter_bin(u.y, bins));
    let (bin_x, bin_y) = (table[i as usize], table[j as usize]);
    let x = filter_offset(u.x, i, bins, bin_x.x, bin_x.y);
    let y = filter_offset(u.y, j, bins, bin_y.x, bin_y.y);
    Vec3::new(0.5 + x, 0.5 + y, bin_x.z * bin_y.z)
}
