//! Twin of `shaders/phong.wgsl`: Phong's reflection model.

use super::lanes::{Real, Vector3, constant, select};
use super::light::LightSegments;
use super::lobes::{unlit_bits, write_lobes};
use super::math::{dot, max, power, power_whole};
use super::mesh::HitPrimitive;
use super::samples::{LEVEL, Samples};
use super::shadow::SampleBlock;
use super::surface::Surface;
use super::traversal::{Directions, MAX_SEGMENTS};
use crate::records::Material;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes<F = f32> {
    pub diffuse: F,
    pub specular: F,
}

#[inline(always)]
pub fn phong_lobes<V: Vector3>(
    surface: &Surface,
    material: &Material,
    to_light: V,
    exponent_bits: u32,
) -> Lobes<V::Real> {
    let zero = to_light.x().splat(0.0);
    let inverse_length = constant(1.0) / dot(to_light, to_light).sqrt();
    let n_l = dot(to_light.broadcast(surface.shading_normal), to_light);
    let n_v = dot(surface.shading_normal, surface.wo);
    let r_v = (n_l * 2.0 * n_v - dot(to_light.broadcast(surface.wo), to_light)) * inverse_length;
    let r_v_power = phong_power(max(r_v, zero), material, exponent_bits);
    let lit = is_lit(surface, to_light);
    Lobes {
        diffuse: select(zero, n_l * inverse_length, lit),
        specular: select(zero, r_v_power, lit),
    }
}

#[inline(always)]
pub fn is_lit<V: Vector3>(surface: &Surface, direction: V) -> <V::Real as Real>::Mask {
    let zero = direction.x().splat(0.0);
    dot(direction.broadcast(surface.shading_normal), direction).gt(zero)
        & dot(direction.broadcast(surface.smooth_normal), direction).gt(zero)
}

pub fn unlit_mask(prim: &HitPrimitive, surface: &Surface, segments: LightSegments, block: SampleBlock) -> u32 {
    let mut directions = Directions::EMPTY;
    Samples::of(block).write_segments(*LEVEL, segments, &mut directions);
    unlit_bits(prim, surface, &directions)
}

#[inline(always)]
pub fn phong_power<F: Real>(x: F, material: &Material, exponent_bits: u32) -> F {
    if exponent_bits > 0 {
        return power_whole(x, material.exponent, exponent_bits);
    }
    power(x, x.splat(material.shininess))
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
    let mut directions = Directions::EMPTY;
    Samples::of(block).write_segments(*LEVEL, segments, &mut directions);
    add_visible(surface, material, &directions, occluded, exponent_bits, sum)
}

/// [`phong_block`] for known directions.
pub fn add_visible(
    surface: &Surface,
    material: &Material,
    directions: &Directions,
    occluded: u32,
    exponent_bits: u32,
    sum: Lobes,
) -> Lobes {
    if occluded == directions.all() {
        return Lobes {
            diffuse: sum.diffuse + 0.0, // -0 becomes 0
            specular: sum.specular + 0.0,
        };
    }
    let mut values = [[0.0; MAX_SEGMENTS]; 2];
    write_lobes(*LEVEL, surface, material, directions, exponent_bits, &mut values);
    let mut lobes = sum;
    for (i, (diffuse, specular)) in values[0].iter().zip(&values[1]).enumerate().take(directions.count) {
        let visible = (occluded >> i) & 1 == 0;
        lobes.diffuse += if visible { *diffuse } else { 0.0 };
        lobes.specular += if visible { *specular } else { 0.0 };
    }
    lobes
}
