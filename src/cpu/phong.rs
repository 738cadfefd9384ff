//! Twin of `shaders/phong.wgsl`: Phong's reflection model.

use glam::Vec3;

use super::light::{Segments, segment};
use super::math::{dot, max, power, power_whole};
use super::shadow::{Block, block_sample};
use super::surface::Surface;
use crate::pack::Material;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes {
    pub diffuse: f32,
    pub specular: f32,
}

#[inline]
pub fn phong_lobes(surface: &Surface, material: &Material, to: Vec3, exponent_bits: u32) -> Lobes {
    let inverse_length = 1.0 / dot(to, to).sqrt();
    let n_l = dot(surface.shading_normal, to);
    let n_v = dot(surface.shading_normal, surface.wo);
    let r_v = (2.0 * n_l * n_v - dot(surface.wo, to)) * inverse_length;
    let r_v_power = phong_power(max(r_v, 0.0), material, exponent_bits);
    let lit = (n_l > 0.0) & (dot(surface.normal, to) > 0.0);
    Lobes {
        diffuse: if lit { n_l * inverse_length } else { 0.0 },
        specular: if lit { r_v_power } else { 0.0 },
    }
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
    to: Segments,
    block: Block,
    hidden: u32,
    exponent_bits: u32,
    sum: Lobes,
) -> Lobes {
    let mut lobes = sum;
    for i in 0..block.count {
        let sample = phong_lobes(surface, material, segment(to, block_sample(block, i)), exponent_bits);
        let visible = (hidden >> i) & 1 == 0;
        lobes.diffuse += if visible { sample.diffuse } else { 0.0 };
        lobes.specular += if visible { sample.specular } else { 0.0 };
    }
    lobes
}
