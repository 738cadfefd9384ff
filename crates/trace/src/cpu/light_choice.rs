//! Twin of `shaders/light_choice.wgsl`.

use glam::{UVec2, UVec4, Vec3};

use super::integrators::path::decision_set;
use super::light_tree::{light_child, light_importances, light_shares};
use super::ray::Hit;
use super::rng::{hash4, unit_float};
use crate::records::{Emitter, NO_INDEX, Packed};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterSelection {
    pub emitter: Emitter,
    pub density: f32,
}

pub fn light_tree_select(
    scene: &Packed,
    emitter: Emitter,
    p: Vec3,
    n: Vec3,
    key: UVec2,
    sample: u32,
) -> EmitterSelection {
    let mut selection = EmitterSelection { emitter, density: 0.0 };
    if emitter.index != NO_INDEX {
        return selection;
    }
    let mut probability = 1.0;
    let mut node_index = 0;
    let mut node = &scene.lighting.nodes[0];
    let mut child = 0;
    let mut level = 0;
    let mut bits = UVec2::ZERO;
    while node_index != NO_INDEX {
        node = &scene.lighting.nodes[node_index as usize];
        let shares = light_shares(light_importances(node, p, n));
        if level & 1 == 0 {
            let level_key = hash4(UVec4::new(key.x, key.y, level, 1));
            bits = decision_set(scene, UVec2::new(level_key.x, level_key.y), sample);
        }
        child = light_child(shares, unit_float(if level & 1 == 1 { bits.y } else { bits.x })) as usize;
        probability *= shares.as_ref()[child];
        node_index = node.children.as_ref()[child];
        level += 1;
    }
    selection.emitter.instance = node.instance[child];
    selection.emitter.index = node.index[child];
    selection.density = node.density[child] * probability;
    selection
}

pub fn light_tree_pdf(scene: &Packed, hit: Hit, is_enabled: bool, p: Vec3, n: Vec3) -> f32 {
    let mut child = NO_INDEX;
    if is_enabled {
        child = light_leaf(scene, hit);
    }
    if child == NO_INDEX {
        return 0.0;
    }
    let nodes = &scene.lighting.nodes;
    let mut density = nodes[child as usize / 4].density[child as usize % 4];
    while child != NO_INDEX {
        let node = &nodes[child as usize / 4];
        density *= light_shares(light_importances(node, p, n))[child as usize % 4];
        child = node.parent.x;
    }
    density
}

pub fn light_leaf(scene: &Packed, hit: Hit) -> u32 {
    let mut position_in_tree = hit.primitive;
    if hit.instance != 0 {
        let leaves = scene.bvh.instances[hit.instance as usize - 1].leaves;
        if leaves == NO_INDEX {
            return NO_INDEX;
        }
        position_in_tree = leaves + hit.slot;
    }
    scene.lighting.leaves[position_in_tree as usize]
}
