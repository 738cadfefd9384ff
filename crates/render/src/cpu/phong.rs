//! Twin of `shaders/phong.wgsl`: Phong's reflection model.

use glam::Vec3;

use super::light::LightSegments;
use super::lobes::{lit_bits, lobes_of_all};
use super::math::{dot, max, power, power_whole};
use super::mesh::{HitPrimitive, face_direction_allowed};
use super::samples::{LEVEL, Samples};
use super::shadow::SampleBlock;
use super::surface::Surface;
use crate::records::Material;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes {
    pub diffuse: f32,
    pub specular: f32,
}

#[inline]
pub fn phong_lobes(surface: &Surface, material: &Material, to_light: Vec3, exponent_bits: u32) -> Lobes {
    let inverse_length = 1.0 / dot(to_light, to_light).sqrt();
    let n_l = dot(surface.shading_normal, to_light);
    let n_v = dot(surface.shading_normal, surface.wo);
    let r_v = (2.0 * n_l * n_v - dot(surface.wo, to_light)) * inverse_length;
    let r_v_power = phong_power(max(r_v, 0.0), material, exponent_bits);
    let lit = is_lit(surface, to_light);
    Lobes {
        diffuse: if lit { n_l * inverse_length } else { 0.0 },
        specular: if lit { r_v_power } else { 0.0 },
    }
}

#[inline]
pub fn is_lit(surface: &Surface, direction: Vec3) -> bool {
    (dot(surface.shading_normal, direction) > 0.0) & (dot(surface.smooth_normal, direction) > 0.0)
}

pub fn unlit_mask(prim: &HitPrimitive, surface: &Surface, segments: LightSegments, block: SampleBlock) -> u32 {
    let directions = Samples::of(block).segments(*LEVEL, segments);
    let lit = lit_bits(*LEVEL, surface, &directions);
    let mut bits = directions.all() & !lit;
    if surface.smooth_normal != surface.normal {
        for i in (0..directions.count).filter(|i| (lit >> i) & 1 == 1) {
            bits |= if face_direction_allowed(prim, surface, directions.get(i)) {
                0
            } else {
                1 << i
            };
        }
    }
    bits
}

#[inline]
pub fn phong_power(x: f32, material: &Material, exponent_bits: u32) -> f32 {
    if exponent_bits > 0 {
        return power_whole(x, material.exponent, exponent_bits);
    }
    power(x, material.shininess)
}

pub fn phong_block(
    surface: &Surface,
    material: &Material,
    segments: LightSegments,
    block: SampleBlock,
    occluded: u32,
    exponent_bits: u32,
    sum: Lobes,
) -> Lobes {
    let directions = Samples::of(block).segments(*LEVEL, segments);
    let values = lobes_of_all(*LEVEL, surface, material, &directions, exponent_bits);
    let mut lobes = sum;
    for (i, (diffuse, specular)) in values[0].iter().zip(&values[1]).enumerate().take(directions.count) {
        let visible = (occluded >> i) & 1 == 0;
        lobes.diffuse += if visible { *diffuse } else { 0.0 };
        lobes.specular += if visible { *specular } else { 0.0 };
    }
    lobes
}
