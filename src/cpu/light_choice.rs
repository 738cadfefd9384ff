//! Twin of `shaders/light_choice.wgsl`: which of much that shines a sample of light is taken from.

use glam::{UVec2, UVec4, Vec3};

use super::integrators::path::decision_set;
use super::light_tree::{first_share, light_importance, light_sibling};
use super::ray::Hit;
use super::rng::{hash4, unit_float};
use crate::pack::{Emitter, NOTHING, Packed};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    pub emitter: Emitter,
    pub density: f32,
}

pub fn chosen_light(scene: &Packed, emitter: Emitter, p: Vec3, n: Vec3, key: UVec2, sample: u32) -> Chosen {
    let mut chosen = Chosen { emitter, density: 0.0 };
    if emitter.index != NOTHING {
        return chosen;
    }
    let nodes = &scene.light_nodes;
    let mut node = &nodes[0];
    let mut probability = 1.0;
    let mut level = 0;
    let mut bits = UVec2::ZERO;
    while node.children != NOTHING {
        let first = &nodes[node.children as usize];
        let second = &nodes[node.children as usize + 1];
        let share = first_share(light_importance(first, p, n), light_importance(second, p, n));
        if level & 1 == 0 {
            let level_key = hash4(UVec4::new(key.x, key.y, level, 1));
            bits = decision_set(scene, UVec2::new(level_key.x, level_key.y), sample);
        }
        let random = unit_float(if level & 1 == 1 { bits.y } else { bits.x });
        if random < share {
            node = first;
            probability *= share;
        } else {
            node = second;
            probability *= 1.0 - share;
        }
        level += 1;
    }
    chosen.emitter.instance = node.instance;
    chosen.emitter.index = node.index;
    chosen.density = node.density * probability;
    chosen
}

pub fn met_density(scene: &Packed, hit: Hit, wanted: bool, p: Vec3, n: Vec3) -> f32 {
    let mut at = NOTHING;
    if wanted {
        at = light_leaf(scene, hit);
    }
    if at == NOTHING {
        return 0.0;
    }
    let nodes = &scene.light_nodes;
    let mut node = &nodes[at as usize];
    let mut density = node.density;
    while node.parent != NOTHING {
        let own = light_importance(node, p, n);
        let other = light_importance(&nodes[light_sibling(at) as usize], p, n);
        let is_first = at & 1 == 1;
        let share = if is_first {
            first_share(own, other)
        } else {
            first_share(other, own)
        };
        density *= if is_first { share } else { 1.0 - share };
        at = node.parent;
        node = &nodes[at as usize];
    }
    density
}

pub fn light_leaf(scene: &Packed, hit: Hit) -> u32 {
    let mut place = hit.primitive;
    if hit.instance != 0 {
        let leaves = scene.instances[hit.instance as usize - 1].leaves;
        if leaves == NOTHING {
            return NOTHING;
        }
        place = leaves + hit.slot;
    }
    scene.light_leaves[place as usize]
}
