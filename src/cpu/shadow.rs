//! Twin of `shaders/shadow.wgsl`: shadow rays, from one point to a block of samples of one light at a time.

use glam::{UVec2, Vec2, Vec3};

use super::ellipsoid::ellipsoid_blocks;
use super::light::{segment, segments_to_light, segments_to_local};
use super::plane::plane_blocks;
use super::ray::point_to_local;
use super::rectangle::rectangle_blocks;
use super::sampling::{grid_sample, sample_square};
use super::triangle::triangle_blocks;
use crate::pack::{BLOCK, ELLIPSOID, GRID, Light, Primitive, RECTANGLE, TRIANGLE};

#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    pub pattern: u32,
    pub side: u32,
    pub first: u32,
    pub count: u32,
    pub positions: [Vec2; BLOCK as usize],
}

pub fn sample_block(pattern: u32, side: u32, first: u32, count: u32, group: u32, key: UVec2) -> Block {
    let mut block = Block {
        pattern,
        side,
        first,
        count,
        positions: [Vec2::ZERO; BLOCK as usize],
    };
    if pattern != GRID {
        for i in 0..count {
            block.positions[i as usize] = sample_square(pattern, side, first + i, group, key);
        }
    }
    block
}

#[inline(always)] // compiled for each kind
pub fn shadow_bits(kind: u32, q: &Primitive, p: Vec3, light: &Light, block: &Block) -> u32 {
    let o = point_to_local(q, p);
    let to = segments_to_local(q, segments_to_light(light, p));
    let mut bits = 0;
    for i in 0..block.count {
        let d = segment(to, block_sample(block, i));
        bits |= if blocks(kind, o, d, light.reach) { 1 << i } else { 0 };
    }
    bits
}

pub fn block_sample(block: &Block, i: u32) -> Vec2 {
    if block.pattern == GRID {
        return grid_sample(block.side, block.first + i);
    }
    block.positions[i as usize]
}

#[inline(always)] // compiled for each kind
pub fn blocks(kind: u32, o: Vec3, d: Vec3, reach: f32) -> bool {
    if kind == RECTANGLE {
        return rectangle_blocks(o, d, reach);
    }
    if kind == TRIANGLE {
        return triangle_blocks(o, d, reach);
    }
    if kind == ELLIPSOID {
        return ellipsoid_blocks(o, d, reach);
    }
    plane_blocks(o, d, reach)
}
