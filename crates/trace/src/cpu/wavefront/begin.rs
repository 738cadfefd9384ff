//! The stage that begins paths with their camera rays. SIMD lanes compute the rays of perspective and orthographic
//! cameras without a lens and a filter table, and Sobol' points.

use fearless_simd::prelude::*;
use fearless_simd::{dispatch, u32x8};
use glam::{UVec2, Vec2, Vec3};

use super::super::camera::camera_ray;
use super::super::integrators::path::{PathState, begin_path};
use super::super::lanes::{Lanes2, Word};
use super::super::path::Path;
use super::super::pixel::{Layers, differential_at};
use super::super::ray::Ray;
use super::super::rng::hash4;
use super::super::samples::LEVEL;
use super::super::sampling::{sample_key, sample_square};
use super::super::sequence::sobol_sample;
use super::rows::{LANES, Row, get3, store3};
use crate::records::{GRID, NO_PRIMITIVE, Packed, ROTATED_GRID, SOBOL};

/// Begins a path for each camera sample, like `begin_path`. A camera sample is a pixel and a sample number. Returns true if
/// the rays have yet to pass surfaces that are invisible to the camera.
pub fn begin_paths(
    scene: &Packed,
    samples: impl Iterator<Item = (UVec2, u32)>,
    paths: &mut Vec<PathState>,
    pixels: &mut Vec<UVec2>,
) -> bool {
    paths.clear();
    pixels.clear();
    if !has_lane_camera(scene) {
        for (pixel, sample) in samples {
            paths.push(begin_path(scene, pixel, sample));
            pixels.push(pixel);
        }
        return false;
    }
    dispatch!(*LEVEL, simd => begin_in_lanes(simd, scene, samples, paths, pixels));
    scene.specialization.camera_invisible != 0
}

/// Returns true if `begin_in_lanes` can compute the camera rays: each depends only on its pixel and a point in it.
fn has_lane_camera(scene: &Packed) -> bool {
    let s = &scene.specialization;
    s.filter_bins == 0 && s.lens == 0 && s.panoramic == 0
}

/// Begins paths in SIMD lanes, with the results of `camera_sample` and of `begin_path` without invisible surfaces.
#[inline(always)]
fn begin_in_lanes<S: Simd>(
    simd: S,
    scene: &Packed,
    mut samples: impl Iterator<Item = (UVec2, u32)>,
    paths: &mut Vec<PathState>,
    pixels: &mut Vec<UVec2>,
) {
    let s = &scene.specialization;
    loop {
        let (mut x, mut y, mut index, mut sample) = ([0; LANES], [0; LANES], [0; LANES], [0; LANES]);
        let (mut u_x, mut u_y): (Row, Row) = ([0.0; LANES], [0.0; LANES]);
        let mut count = 0;
        for (pixel, number) in samples.by_ref().take(LANES) {
            (x[count], y[count], sample[count]) = (pixel.x, pixel.y, number);
            let (round, round_index) = (number / s.pixel_samples, number % s.pixel_samples);
            match s.pixel_pattern {
                SOBOL => index[count] = round.wrapping_mul(s.pixel_side).wrapping_add(round_index),
                pattern => {
                    let key = match pattern {
                        GRID | ROTATED_GRID => UVec2::ZERO, // without effect
                        _ => sample_key(pixel, scene.camera.seed, 0),
                    };
                    let u = sample_square(pattern, s.pixel_side, round_index, round, key);
                    (u_x[count], u_y[count]) = (u.x, u.y);
                }
            }
            pixels.push(pixel);
            count += 1;
        }
        if count == 0 {
            return;
        }
        let words = |words: [u32; LANES]| u32x8::simd_from(simd, words);
        let (pixel_x, pixel_y) = (words(x), words(y));
        let u = match s.pixel_pattern {
            SOBOL => {
                let key = hash4([pixel_x, pixel_y, words([scene.camera.seed; LANES]), words([0; LANES])]);
                sobol_sample(words(index), Lanes2 { x: key[0], y: key[1] })
            }
            _ => Lanes2 {
                x: SimdFrom::simd_from(simd, u_x),
                y: SimdFrom::simd_from(simd, u_y),
            },
        };
        let raster = Lanes2 {
            x: pixel_x.to_real() + u.x,
            y: pixel_y.to_real() + u.y,
        };
        let ray = camera_ray(&scene.camera, raster);
        let (origins, directions) = (store3(ray.origin), store3(ray.direction));
        let (raster_x, raster_y): (Row, Row) = (raster.x.into(), raster.y.into());
        for lane in 0..count {
            paths.push(PathState {
                path: Path {
                    ray: Ray {
                        origin: get3(&origins, lane),
                        direction: get3(&directions, lane),
                    },
                    differential: differential_at(scene, Vec2::new(raster_x[lane], raster_y[lane])),
                    throughput: Vec3::ONE,
                    depth: 0,
                    branch: 0,
                    origin_prim: NO_PRIMITIVE,
                    inside_prim: NO_PRIMITIVE,
                },
                radiance: Vec3::ZERO,
                pdf: 0.0,
                eta2: 1.0,
                absorption: Vec3::ZERO,
                sample: sample[lane],
                weight: 1.0,
                ended: false,
                layers: Layers::default(),
                albedo_recorded: false,
                prev_position: Vec3::ZERO,
                prev_normal: Vec3::ZERO,
                skipped_distance: 0.0,
                skips: 0,
            });
        }
    }
}
