//! SIMD evaluation of `phong_lobes` for all directions of a block.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};
use glam::Vec3;

use super::math::{dot, power};
use super::surface::Surface;
use super::traversal::{Directions, MAX_SEGMENTS};
use crate::records::Material;

/// Returns a mask in which bit i is set if light from direction i reaches the surface
/// ([`is_lit`](super::phong::is_lit)).
pub fn lit_bits(level: Level, surface: &Surface, directions: &Directions) -> u32 {
    dispatch!(level, simd => {
        let mut bits = 0;
        for i in (0..directions.count).step_by(width(simd)) {
            bits |= (lit(simd, surface, &components(simd, directions, i)).to_bitmask() as u32) << i;
        }
        bits
    })
}

/// Returns the values of [`phong_lobes`](super::phong::phong_lobes) for all directions: diffuse lobes, then specular
/// lobes.
pub fn lobes_of_all(
    level: Level,
    surface: &Surface,
    material: &Material,
    directions: &Directions,
    exponent_bits: u32,
) -> [[f32; MAX_SEGMENTS]; 2] {
    dispatch!(level, simd => lobes(simd, surface, material, directions, exponent_bits))
}

#[inline(always)]
fn lobes<S: Simd>(
    simd: S,
    surface: &Surface,
    material: &Material,
    directions: &Directions,
    exponent_bits: u32,
) -> [[f32; MAX_SEGMENTS]; 2] {
    let mut values = [[0.0; MAX_SEGMENTS]; 2];
    let zero = S::f32s::splat(simd, 0.0);
    let n_v = dot(surface.shading_normal, surface.wo);
    for i in (0..directions.count).step_by(width(simd)) {
        let direction = components(simd, directions, i);
        let is_lit = lit(simd, surface, &direction);
        if is_lit.to_bitmask() == 0 {
            continue;
        }
        let [x, y, z] = direction;
        let inverse_length = S::f32s::splat(simd, 1.0) / (x * x + y * y + z * z).sqrt();
        let n_l = dot_vector::<S>(surface.shading_normal, &direction);
        let r_v: S::f32s = (n_l * 2.0 * n_v - dot_vector::<S>(surface.wo, &direction)) * inverse_length;
        let r_v = r_v.simd_gt(zero).select(r_v, zero);
        let mut powers = S::f32s::splat(simd, 1.0);
        let mut square = r_v;
        for bit in 0..exponent_bits {
            if (material.exponent >> bit) & 1 == 1 {
                powers *= square;
            }
            square *= square;
        }
        if exponent_bits == 0 {
            let mut lanes = [0.0; MAX_SEGMENTS];
            r_v.store_slice(&mut lanes[..width(simd)]);
            lanes = lanes.map(|x| power(x, material.shininess));
            powers = S::f32s::from_slice(simd, &lanes[..width(simd)]);
        }
        let range = i..i + width(simd);
        is_lit
            .select(n_l * inverse_length, zero)
            .store_slice(&mut values[0][range.clone()]);
        is_lit.select(powers, zero).store_slice(&mut values[1][range]);
    }
    values
}

#[inline(always)]
fn lit<S: Simd>(simd: S, surface: &Surface, direction: &[S::f32s; 3]) -> S::mask32s {
    let zero = S::f32s::splat(simd, 0.0);
    dot_vector::<S>(surface.shading_normal, direction).simd_gt(zero)
        & dot_vector::<S>(surface.smooth_normal, direction).simd_gt(zero)
}

#[inline(always)]
fn dot_vector<S: Simd>(a: Vec3, [x, y, z]: &[S::f32s; 3]) -> S::f32s {
    *x * a.x + *y * a.y + *z * a.z
}

/// Returns SIMD vectors of the components of directions, starting at index i.
#[inline(always)]
fn components<S: Simd>(simd: S, directions: &Directions, i: usize) -> [S::f32s; 3] {
    let [x, y, z] = &directions.components;
    [x, y, z].map(|lanes| S::f32s::from_slice(simd, &lanes[i..i + width(simd)]))
}

#[inline(always)]
fn width<S: Simd>(_: S) -> usize {
    S::f32s::LEN
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;
    use crate::cpu::light::{LightSegments, segment};
    use crate::cpu::phong::{is_lit, phong_lobes};
    use crate::cpu::samples::Samples;
    use crate::cpu::shadow::{SampleBlock, block_sample};
    use crate::cpu::traversal::levels;
    use crate::records::{GRID, JITTERED, NO_PRIMITIVE, SOBOL};

    fn surface(smooth_normal: Vec3, shading_normal: Vec3) -> Surface {
        let zero = Vec3::ZERO;
        Surface {
            position: zero,
            normal: Vec3::Z,
            smooth_normal,
            shading_normal,
            wo: Vec3::new(0.6, 0.0, 0.8),
            ray_origin: zero,
            terminator_offset: zero,
            side: 1.0,
            exclude_front: NO_PRIMITIVE,
            exclude_back: NO_PRIMITIVE,
            uv: zero.truncate(),
            du: zero,
            dv: zero,
        }
    }

    #[test]
    fn simd_lobes_are_bit_identical_to_the_scalar_functions() {
        let segments = LightSegments {
            towards: Vec3::new(0.3, -0.4, 0.5),
            u: Vec3::new(0.7, 0.1, 0.2),
            v: Vec3::new(-0.2, 0.9, 0.4),
        };
        let mut lit = 0;
        let mut unlit = 0;
        for (i, (pattern, side, first, count)) in [
            (GRID, 4, 0, 16),
            (GRID, 3, 0, 9),
            (GRID, 7, 32, 17),
            (GRID, 1, 0, 1),
            (JITTERED, 6, 0, 32),
            (SOBOL, 4, 3, 13),
        ]
        .into_iter()
        .enumerate()
        {
            let block = SampleBlock {
                pattern,
                side,
                first,
                count,
                group: 2,
                key: UVec2::new(5, 7),
            };
            let surface = surface(Vec3::new(0.0, 0.8, 0.6), Vec3::new(0.28, 0.0, 0.96));
            let material = Material {
                exponent: 11,
                shininess: 11.5,
                ..bytemuck::Zeroable::zeroed()
            };
            let exponent_bits = if i % 2 == 0 { 4 } else { 0 };
            for level in levels() {
                let directions = Samples::of(block).segments(level, segments);
                let lobes = lobes_of_all(level, &surface, &material, &directions, exponent_bits);
                let bits = lit_bits(level, &surface, &directions);
                assert_eq!(directions.count, count as usize);
                for k in 0..count {
                    let d = segment(segments, block_sample(block, k));
                    assert_eq!(directions.get(k as usize), d, "{level:?} {block:?} {k}");
                    let expected = phong_lobes(&surface, &material, d, exponent_bits);
                    let found = lobes.map(|lobe| lobe[k as usize].to_bits());
                    assert_eq!(
                        found,
                        [expected.diffuse, expected.specular].map(f32::to_bits),
                        "{level:?} {block:?} {k}"
                    );
                    assert_eq!(bits >> k & 1 == 1, is_lit(&surface, d));
                    *if is_lit(&surface, d) { &mut lit } else { &mut unlit } += 1;
                }
            }
        }
        assert!(lit > 20 && unlit > 20, "{lit} {unlit}");
    }
}
