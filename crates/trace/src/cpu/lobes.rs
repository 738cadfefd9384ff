//! Phong's reflection model for all directions of a block, in SIMD lanes.

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};

use super::mesh::{HitPrimitive, face_direction_allowed};
use super::phong::{is_lit, phong_lobes};
use super::samples::{LANES, LEVEL, directions_at};
use super::surface::Surface;
use super::traversal::{Directions, MAX_SEGMENTS};
use crate::records::Material;

/// Returns a mask in which bit i is set if the surface reflects no light from direction i.
pub fn unlit_bits(prim: &HitPrimitive, surface: &Surface, directions: &Directions) -> u32 {
    directions.all() & !allowed_bits(*LEVEL, prim, surface, directions)
}

/// Returns a mask in which bit i is set if the surface may reflect light from direction i.
fn allowed_bits(level: Level, prim: &HitPrimitive, surface: &Surface, directions: &Directions) -> u32 {
    let is_flat = surface.smooth_normal == surface.normal;
    dispatch!(level, simd => {
        let mut bits = 0;
        for i in (0..directions.count).step_by(LANES) {
            let direction = directions_at(simd, directions, i);
            let mut is_allowed = is_lit(surface, direction);
            if !is_flat {
                is_allowed &= face_direction_allowed(prim, surface, direction);
            }
            bits |= (is_allowed.to_bitmask() as u32) << i;
        }
        bits & directions.all()
    })
}

/// Writes the values of [`phong_lobes`] for all directions: diffuse lobes, then specular lobes. Returned values would be
/// copied.
pub fn write_lobes(
    level: Level,
    surface: &Surface,
    material: &Material,
    directions: &Directions,
    exponent_bits: u32,
    values: &mut [[f32; MAX_SEGMENTS]; 2],
) {
    dispatch!(level, simd => {
        for i in (0..directions.count).step_by(LANES) {
            let lobes = phong_lobes(surface, material, directions_at(simd, directions, i), exponent_bits);
            lobes.diffuse.store_slice(&mut values[0][i..i + LANES]);
            lobes.specular.store_slice(&mut values[1][i..i + LANES]);
        }
    });
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;
    use glam::{UVec2, Vec3};

    use super::*;
    use crate::cpu::light::{LightSegments, segment};
    use crate::cpu::mesh::standalone_hit_primitive;
    use crate::cpu::samples::Samples;
    use crate::cpu::shadow::{SampleBlock, block_sample};
    use crate::cpu::traversal::levels;
    use crate::records::{GRID, JITTERED, NO_PRIMITIVE, Primitive, SOBOL};

    fn surface(smooth_normal: Vec3, shading_normal: Vec3) -> Surface {
        let zero = Vec3::ZERO;
        Surface {
            position: zero,
            normal: Vec3::new(-0.8, 0.0, 0.6),
            smooth_normal,
            shading_normal,
            wo: Vec3::new(0.6, 0.0, 0.8),
            ray_origin: zero,
            terminator_offset: Vec3::new(0.1, -0.2, 0.3),
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
        let prim = standalone_hit_primitive(&Primitive {
            x: Vec3::new(0.2, 0.1, 0.0),
            y: Vec3::new(0.1, 0.2, 0.1),
            ..Primitive::zeroed()
        });
        let (mut lit, mut unlit, mut self_occluded) = (0, 0, 0);
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
                let mut directions = Directions::EMPTY;
                Samples::of(block).write_segments(level, segments, &mut directions);
                let mut lobes = [[0.0; MAX_SEGMENTS]; 2];
                write_lobes(level, &surface, &material, &directions, exponent_bits, &mut lobes);
                let bits = allowed_bits(level, &prim, &surface, &directions);
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
                    let is_allowed = is_lit(&surface, d) && face_direction_allowed(&prim, &surface, d);
                    assert_eq!(bits >> k & 1 == 1, is_allowed);
                    match is_lit(&surface, d) {
                        true if is_allowed => lit += 1,
                        true => self_occluded += 1,
                        false => unlit += 1,
                    }
                }
            }
        }
        assert!(
            lit > 20 && unlit > 20 && self_occluded > 20,
            "{lit} {unlit} {self_occluded}"
        );
    }
}
