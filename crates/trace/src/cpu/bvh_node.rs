//! Twin of `shaders/bvh_node.wgsl`.

use glam::{UVec2, UVec3, Vec3, Vec4};

use super::slab::{RayInterval, Slabs};
use crate::records::{INFINITE_T, Node};

pub fn steps(word: u32) -> Vec4 {
    Vec4::from(word.to_le_bytes().map(f32::from))
}

pub fn step_length(node: &Node, axis: u32) -> f32 {
    f32::from_bits(((node.scales >> (8 * axis)) & 0xff) << 23)
}

pub fn larger(a: Vec4, b: Vec4) -> Vec4 {
    Vec4::select(a.cmpgt(b), a, b)
}

pub fn smaller(a: Vec4, b: Vec4) -> Vec4 {
    Vec4::select(a.cmplt(b), a, b)
}

pub fn hit_bits(near: Vec4, far: Vec4, limit: f32) -> u32 {
    (near.cmple(far) & far.cmpge(Vec4::ZERO) & near.cmple(Vec4::splat(limit))).bitmask()
}

pub fn children_hit(node: &Node, s: Slabs, limit: f32) -> u32 {
    let first = four_hit(
        node,
        UVec3::new(node.low_x.x, node.low_y.x, node.low_z.x),
        UVec3::new(node.high_x.x, node.high_y.x, node.high_z.x),
        s,
        limit,
    );
    let second = four_hit(
        node,
        UVec3::new(node.low_x.y, node.low_y.y, node.low_z.y),
        UVec3::new(node.high_x.y, node.high_y.y, node.high_z.y),
        s,
        limit,
    );
    first | (second << 4)
}

pub fn four_hit(node: &Node, low: UVec3, high: UVec3, s: Slabs, limit: f32) -> u32 {
    let x = step_length(node, 0);
    let y = step_length(node, 1);
    let z = step_length(node, 2);
    let low_x = (node.base.x + steps(low.x) * x - s.low_origin.x) * s.inverse.x;
    let high_x = (node.base.x + steps(high.x) * x - s.high_origin.x) * s.inverse.x;
    let low_y = (node.base.y + steps(low.y) * y - s.low_origin.y) * s.inverse.y;
    let high_y = (node.base.y + steps(high.y) * y - s.high_origin.y) * s.inverse.y;
    let low_z = (node.base.z + steps(low.z) * z - s.low_origin.z) * s.inverse.z;
    let high_z = (node.base.z + steps(high.z) * z - s.high_origin.z) * s.inverse.z;
    let near = larger(
        larger(smaller(low_x, high_x), smaller(low_y, high_y)),
        smaller(low_z, high_z),
    );
    let far = smaller(
        smaller(larger(low_x, high_x), larger(low_y, high_y)),
        larger(low_z, high_z),
    );
    hit_bits(near, far, limit)
}

pub fn children_in_interval(node: &Node, rays: RayInterval, limit: f32) -> u32 {
    let first = four_in_interval(
        node,
        UVec3::new(node.low_x.x, node.low_y.x, node.low_z.x),
        UVec3::new(node.high_x.x, node.high_y.x, node.high_z.x),
        rays,
        limit,
    );
    let second = four_in_interval(
        node,
        UVec3::new(node.low_x.y, node.low_y.y, node.low_z.y),
        UVec3::new(node.high_x.y, node.high_y.y, node.high_z.y),
        rays,
        limit,
    );
    first | (second << 4)
}

pub fn four_in_interval(node: &Node, low: UVec3, high: UVec3, rays: RayInterval, limit: f32) -> u32 {
    let x = step_length(node, 0);
    let y = step_length(node, 1);
    let z = step_length(node, 2);
    let low_x = node.base.x + steps(low.x) * x - rays.low_origin.x;
    let high_x = node.base.x + steps(high.x) * x - rays.high_origin.x;
    let low_y = node.base.y + steps(low.y) * y - rays.low_origin.y;
    let high_y = node.base.y + steps(high.y) * y - rays.high_origin.y;
    let low_z = node.base.z + steps(low.z) * z - rays.low_origin.z;
    let high_z = node.base.z + steps(high.z) * z - rays.high_origin.z;
    let near_x = larger(low_x * rays.near_low.x, high_x * rays.near_high.x);
    let near_y = larger(low_y * rays.near_low.y, high_y * rays.near_high.y);
    let near_z = larger(low_z * rays.near_low.z, high_z * rays.near_high.z);
    let far_x = far_side(low_x, high_x, rays.far_low.x, rays.far_high.x);
    let far_y = far_side(low_y, high_y, rays.far_low.y, rays.far_high.y);
    let far_z = far_side(low_z, high_z, rays.far_low.z, rays.far_high.z);
    hit_bits(
        larger(larger(near_x, near_y), near_z),
        smaller(smaller(far_x, far_y), far_z),
        limit,
    )
}

pub fn far_side(low: Vec4, high: Vec4, far_low: f32, far_high: f32) -> Vec4 {
    if far_low == 0.0 && far_high == 0.0 {
        return Vec4::splat(INFINITE_T);
    }
    low * far_low + high * far_high
}

pub fn in_order(bits: u32, octant: u32) -> u32 {
    let swapped = |bits: u32, mask: u32, shift: u32| ((bits & mask) << shift) | ((bits >> shift) & mask);
    let after_x = if octant & 1 != 0 { swapped(bits, 0x55, 1) } else { bits };
    let after_y = if octant & 2 != 0 {
        swapped(after_x, 0x33, 2)
    } else {
        after_x
    };
    if octant & 4 != 0 {
        swapped(after_y, 0x0f, 4)
    } else {
        after_y
    }
}

pub fn octant_of(direction: Vec3) -> u32 {
    direction.cmplt(Vec3::ZERO).bitmask()
}

pub fn leaf_items(node: &Node, slot: u32) -> UVec2 {
    let word = if slot >= 4 { node.leaves.y } else { node.leaves.x };
    let leaf = (word >> (8 * (slot & 3))) & 0xff;
    UVec2::new(node.first_item + (leaf & 31), leaf >> 5)
}
