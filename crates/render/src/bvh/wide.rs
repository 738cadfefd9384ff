//! Collapse of a binary BVH into one of 8 children per node with the lowest SAH cost (Ylitie, Karras and Laine, HPG
//! 2017, section 3.1).

use bytemuck::Zeroable as _;
use glam::Vec3;
use rayon::prelude::*;

use super::binary::{Binary, BuildItem, Inner};
use super::{Aabb, Node, Tree};

/// Maximum children per node.
pub const SLOTS: usize = 8;
/// SAH cost of testing a node's boxes.
const NODE_COST: f32 = 1.0;
/// SAH cost of testing an item.
const ITEM_COST: f32 = 0.3;
/// Minimum number of items of a node whose children are built in parallel.
const PARALLEL: usize = 1 << 14;

pub fn leaf_cost(area: f32, count: usize) -> f32 {
    area * count as f32 * ITEM_COST
}

/// Returns the costs of a binary node that occupies up to 1, 2, .. 7 slots of a wide parent, given the costs of its
/// halves.
pub fn costs(area: f32, count: usize, most_in_leaf: usize, sides: &[[f32; SLOTS - 1]; 2]) -> [f32; SLOTS - 1] {
    let shared = |slots: usize| share(slots, |k| sides[0][k - 1], |k| sides[1][k - 1]).0;
    let mut costs = [0.0; SLOTS - 1];
    costs[0] = shared(SLOTS) + area * NODE_COST;
    if count <= most_in_leaf {
        costs[0] = costs[0].min(leaf_cost(area, count));
    }
    for slots in 2..SLOTS {
        costs[slots - 1] = shared(slots).min(costs[slots - 2]);
    }
    costs
}

/// Distributes slots over two sides, at least one each, at the lowest cost. Returns the cost and the number of slots of
/// the first side.
fn share(slots: usize, first: impl Fn(usize) -> f32, second: impl Fn(usize) -> f32) -> (f32, usize) {
    let mut best = (first(1) + second(slots - 1), 1);
    for k in 2..slots {
        let cost = first(k) + second(slots - k);
        if cost < best.0 {
            best = (cost, k);
        }
    }
    best
}

#[derive(Clone, Copy)]
struct Part<'a> {
    items: &'a [BuildItem],
    inner: &'a [Inner],
}

impl<'a> Part<'a> {
    fn bounds(&self) -> Aabb {
        match self.inner.first() {
            Some(node) => Aabb {
                low: node.low,
                high: node.high,
            },
            None => self.items[0].bounds(),
        }
    }

    fn cost(&self, slots: usize) -> f32 {
        match self.inner.first() {
            Some(node) => node.costs[slots - 1],
            None => leaf_cost(self.area(), 1),
        }
    }

    fn area(&self) -> f32 {
        let Aabb { low, high } = self.bounds();
        super::binary::area(low.extend(0.0), high.extend(0.0))
    }

    fn halves(&self) -> [Part<'a>; 2] {
        let first = self.inner[0].first as usize;
        let items = self.items.split_at(first);
        let inner = self.inner[1..].split_at(first - 1);
        [
            Part {
                items: items.0,
                inner: inner.0,
            },
            Part {
                items: items.1,
                inner: inner.1,
            },
        ]
    }

    fn is_leaf(&self, most_in_leaf: usize) -> bool {
        let count = self.items.len();
        count == 1 || (count <= most_in_leaf && leaf_cost(self.area(), count) <= self.cost(1))
    }

    /// Collects the parts that fill this number of slots of a wide node. This part must have at least two items.
    fn spread(&self, slots: usize, children: &mut Vec<Part<'a>>) {
        let halves = self.halves();
        let (_, first) = share(slots, |k| halves[0].cost(k), |k| halves[1].cost(k));
        for (half, mut slots) in halves.into_iter().zip([first, slots - first]) {
            while slots > 1 && half.cost(slots) == half.cost(slots - 1) {
                slots -= 1;
            }
            match slots {
                1 => children.push(half),
                _ => half.spread(slots, children),
            }
        }
    }
}

pub fn collapse(binary: &Binary, most_in_leaf: usize) -> Tree {
    let root = Part {
        items: &binary.items,
        inner: &binary.inner,
    };
    let mut below = Below {
        most_in_leaf,
        tree: Tree {
            nodes: vec![Node::zeroed()],
            order: Vec::with_capacity(binary.items.len()),
        },
    };
    below.tree.nodes[0] = below.add(root);
    below.tree
}

struct Below {
    most_in_leaf: usize,
    tree: Tree,
}

impl Below {
    /// Adds the descendants of a part and returns its node.
    fn add(&mut self, part: Part) -> Node {
        if part.items.is_empty() {
            return Node::around(&Aabb {
                low: Vec3::ZERO,
                high: Vec3::ZERO,
            });
        }
        let mut children = Vec::with_capacity(SLOTS);
        match part.items.len() {
            1 => children.push(part),
            _ => part.spread(SLOTS, &mut children),
        }
        let bounds = part.bounds();
        let mut node = Node::around(&bounds);
        node.first_item = self.tree.order.len() as u32;
        node.first_child = self.tree.nodes.len() as u32;
        let mut inner = Vec::with_capacity(SLOTS);
        for (slot, child) in slots_of(&bounds, &children).into_iter().enumerate() {
            let Some(child) = child.map(|i| children[i]) else {
                continue;
            };
            node.set_bounds(slot, &child.bounds());
            if child.is_leaf(self.most_in_leaf) {
                let offset = self.tree.order.len() as u32 - node.first_item;
                node.leaves[slot] = (child.items.len() << 5) as u8 | offset as u8;
                self.tree.order.extend(child.items.iter().map(BuildItem::number));
            } else {
                node.inner |= 1 << slot;
                inner.push(child);
            }
        }
        let first_child = self.tree.nodes.len();
        self.tree.nodes.resize(first_child + inner.len(), Node::zeroed());
        if part.items.len() < PARALLEL {
            for (i, child) in inner.into_iter().enumerate() {
                self.tree.nodes[first_child + i] = self.add(child);
            }
        } else {
            let below = inner.into_par_iter().map(|child| {
                let mut below = Below {
                    most_in_leaf: self.most_in_leaf,
                    tree: Tree::default(),
                };
                let node = below.add(child);
                (node, below)
            });
            for (i, (node, below)) in below.collect::<Vec<_>>().into_iter().enumerate() {
                self.tree.nodes[first_child + i] = self.append(node, below);
            }
        }
        node
    }

    /// Appends nodes built separately, in the order of `add`.
    fn append(&mut self, node: Node, below: Below) -> Node {
        let (nodes, items) = (self.tree.nodes.len() as u32, self.tree.order.len() as u32);
        let moved = |node: Node| Node {
            first_child: node.first_child + nodes,
            first_item: node.first_item + items,
            ..node
        };
        self.tree.nodes.extend(below.tree.nodes.into_iter().map(moved));
        self.tree.order.extend(below.tree.order);
        moved(node)
    }
}

/// Assigns children to slots. Slot c is meant for octant c of the node (bit 0: +x, bit 1: +y, bit 2: +z), so that c ^
/// octant of a ray approximates front-to-back order. The pair with the largest projected distance is assigned first.
fn slots_of(bounds: &Aabb, children: &[Part]) -> [Option<usize>; SLOTS] {
    // Halved, to avoid overflow.
    let middle = |bounds: &Aabb| bounds.low * 0.5 + bounds.high * 0.5;
    let center = middle(bounds);
    let mut towards = [[0.0; SLOTS]; SLOTS];
    for (child, towards) in children.iter().zip(&mut towards) {
        let [x, y, z] = (middle(&child.bounds()) - center).to_array();
        for (slot, towards) in towards.iter_mut().enumerate() {
            let along = |x: f32, bit: usize| if slot >> bit & 1 == 1 { x } else { -x };
            *towards = along(x, 0) + along(y, 1) + along(z, 2);
        }
    }
    let mut slots = [None; SLOTS];
    let mut unassigned: u32 = (1 << children.len()) - 1;
    while unassigned != 0 {
        let mut best: Option<(f32, usize, usize)> = None;
        for child in (0..children.len()).filter(|child| unassigned >> child & 1 == 1) {
            for slot in (0..SLOTS).filter(|slot| slots[*slot].is_none()) {
                let far = towards[child][slot];
                if best.is_none_or(|best| far > best.0) {
                    best = Some((far, child, slot));
                }
            }
        }
        let Some((_, child, slot)) = best else {
            break;
        };
        slots[slot] = Some(child);
        unassigned &= !(1 << child);
    }
    slots
}
