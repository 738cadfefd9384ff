//! Twin of `shaders/light_tree.wgsl`: the tree over what shines.

use glam::Vec3;

use super::math::{dot, max, min};
use crate::pack::LightNode;

#[inline(always)]
pub fn light_importance(node: &LightNode, p: Vec3, n: Vec3) -> f32 {
    let to = node.center - p;
    let d2 = dot(to, to);
    let d = d2.sqrt();
    let along = -dot(node.axis, to);
    let ahead = if node.sides == 2 { along.abs() } else { along };
    let sine = max(1.0 - node.cosine * node.cosine, 0.0).sqrt();
    let turned = ahead * node.cosine + max(d2 - along * along, 0.0).sqrt() * sine;
    let leaving = if ahead >= node.cosine * d { d } else { turned };
    let facing = if dot(n, n) == 0.0 { d } else { dot(n, to) };
    let outer = d + node.radius;
    let cosines = max((leaving + node.radius) / outer, 1e-3) * max((facing + node.radius) / outer, 1e-3);
    let value = node.intensity * cosines / max(d2 + 0.5 * node.radius * node.radius, 1e-30);
    let leaves = leaving + 1.5707964 * node.radius > (node.edge - 1e-3) * d;
    if leaves & (facing + node.radius > -1e-3 * d) {
        max(value, 1e-36)
    } else {
        0.0
    }
}

pub fn first_share(first: f32, second: f32) -> f32 {
    let sum = first + second;
    if sum == 0.0 {
        return 0.5;
    }
    if (first > 0.0) & (second > 0.0) {
        return min(max(first / sum, 0.00024414063), 0.99975586);
    }
    if first == 0.0 { 0.0 } else { 1.0 }
}

pub fn light_sibling(i: u32) -> u32 {
    ((i - 1) ^ 1) + 1
}
