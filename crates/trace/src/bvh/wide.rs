//! Collapse of a binary BVH into a BVH with up to 8 children per node, at the lowest SAH cost (Ylitie, Karras and
//! Laine, HPG 2017, section 3.1).

use bytemuck::Zeroable as _;
use glam::Vec3;
use rayon::prelude::*;

use super::binary::{Binary, BuildItem, Inner};
use super::{Aabb, Node, Tree};

/// Maximum number of children per node.
pub const SLOTS: usize = 8;
/// SAH cost of testing a node's boxes.
const NODE_COST: f32 = 1.0;
/// SAH cost of testing an item.
const ITEM_COST: f32 = 0.3;
/// Minimum number of items of a node whose children are built in parallel.
const MIN_PARALLEL_ITEMS: usize = 1 << 14;

pub fn leaf_cost(area: f32, count: usize) -> f32 {
    area * count as f32 * ITEM_COST
}

/// Returns the costs of a binary node that occupies up to 1, 2, .. 7 slots of a wide parent, given the costs of its
/// parts.
pub fn costs(area: f32, count: usize, max_leaf_size: usize, sides: &[[f32; SLOTS - 1]; 2]) -> [f32; SLOTS - 1] {
    let split_cost = |slots: usize| distribute(slots, |k| sides[0][k - 1], |k| sides[1][k - 1]).0;
    let mut costs = [0.0; SLOTS - 1];
    costs[0] = split_cost(SLOTS) + area * NODE_COST;
    if count <= max_leaf_size {
        costs[0] = costs[0].min(leaf_cost(area, count));
    }
    for slots in 2..SLOTS {
        costs[slots - 1] = split_cost(slots).min(costs[slots - 2]);
    }
    costs
}

/// Distributes slots over two sides, at least one each, at the lowest cost. Returns the cost and the number of slots of
/// the first side.
fn distribute(slots: usize, first: impl Fn(usize) -> f32, second: impl Fn(usize) -> f32) -> (f32, usize) {
    let mut best = (first(1) + second(slots - 1), 1);
    for k in 2..slots {
        let cost = first(k) + second(slots - k);
        if cost < best.0 {
            best = (cost, k);
        }
    }
    best
}

/// A binary subtree: its items and its inner nodes.
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

    fn parts(&self) -> [Part<'a>; 2] {
        let first_size = self.inner[0].first_size as usize;
        let items = self.items.split_at(first_size);
        let inner = self.inner[1..].split_at(first_size - 1);
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

    fn is_leaf(&self, max_leaf_size: usize) -> bool {
        let count = self.items.len();
        count == 1 || (count <= max_leaf_size && leaf_cost(self.area(), count) <= self.cost(1))
    }

    /// Collects the parts that fill this number of slots of a wide node. This part must have at least two items.
    fn collect_children(&self, slots: usize, children: &mut Vec<Part<'a>>) {
        let parts = self.parts();
        let (_, first_slots) = distribute(slots, |k| parts[0].cost(k), |k| parts[1].cost(k));
        for (part, mut slots) in parts.into_iter().zip([first_slots, slots - first_slots]) {
            while slots > 1 && part.cost(slots) == part.cost(slots - 1) {
                slots -= 1;
            }
            match slots {
                1 => children.push(part),
                _ => part.collect_children(slots, children),
            }
        }
    }
}

pub fn collapse(binary: &Binary, max_leaf_size: usize) -> Tree {
    let root = Part {
        items: &binary.items,
        inner: &binary.inner,
    };
    let mut builder = Builder {
        max_leaf_size,
        tree: Tree {
            nodes: vec![Node::zeroed()],
            order: Vec::with_capacity(binary.items.len()),
        },
    };
    builder.tree.nodes[0] = builder.add(root);
    builder.tree
}

struct Builder {
    max_leaf_size: usize,
    tree: Tree,
}

impl Builder {
    /// Adds the descendants of a part and returns the node of the part.
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
            _ => part.collect_children(SLOTS, &mut children),
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
            if child.is_leaf(self.max_leaf_size) {
                let offset = self.tree.order.len() as u32 - node.first_item;
                node.leaves[slot] = (child.items.len() << 5) as u8 | offset as u8;
                self.tree.order.extend(child.items.iter().map(BuildItem::index));
            } else {
                node.inner |= 1 << slot;
                inner.push(child);
            }
        }
        let first_child = self.tree.nodes.len();
        self.tree.nodes.resize(first_child + inner.len(), Node::zeroed());
        if part.items.len() < MIN_PARALLEL_ITEMS {
            for (i, child) in inner.into_iter().enumerate() {
                self.tree.nodes[first_child + i] = self.add(child);
            }
        } else {
            let subtrees = inner.into_par_iter().map(|child| {
                let mut subtree = Builder {
                    max_leaf_size: self.max_leaf_size,
                    tree: Tree::default(),
                };
                let node = subtree.add(child);
                (node, subtree)
            });
            for (i, (node, subtree)) in subtrees.collect::<Vec<_>>().into_iter().enumerate() {
                self.tree.nodes[first_child + i] = self.append(node, subtree);
            }
        }
        node
    }

    /// Appends a subtree that was built separately, and returns its root with offset indices.
    fn append(&mut self, node: Node, subtree: Builder) -> Node {
        let (nodes, items) = (self.tree.nodes.len() as u32, self.tree.order.len() as u32);
        let moved = |node: Node| Node {
            first_child: node.first_child + nodes,
            first_item: node.first_item + items,
            ..node
        };
        self.tree.nodes.extend(subtree.tree.nodes.into_iter().map(moved));
        self.tree.order.extend(subtree.tree.order);
        moved(node)
    }
}

/// Assigns children to slots. Slot c is meant for octant c of the node (bit 0: +x, bit 1: +y, bit 2: +z), so that c ^
/// octant of a ray approximates front-to-back order. The pair with the largest projected distance is assigned first.
fn slots_of(bounds: &Aabb, children: &[Part]) -> [Option<usize>; SLOTS] {
    // The corners are halved before the addition, to avoid overflow.
    let middle = |bounds: &Aabb| bounds.low * 0.5 + bounds.high * 0.5;
    let center = middle(bounds);
    let mut projections = [[0.0; SLOTS]; SLOTS];
    for (child, distances) in children.iter().zip(&mut projections) {
        let [x, y, z] = (middle(&child.bounds()) - center).to_array();
        for (slot, distance) in distances.iter_mut().enumerate() {
            let signed = |x: f32, bit: usize| if slot >> bit & 1 == 1 { x } else { -x };
            *distance = signed(x, 0) + signed(y, 1) + signed(z, 2);
        }
    }
    let mut slots = [None; SLOTS];
    let mut unassigned: u32 = (1 << children.len()) - 1;
    while unassigned != 0 {
        let mut best: Option<(f32, usize, usize)> = None;
        for child in (0..children.len()).filter(|child| unassigned >> child & 1 == 1) {
            for slot in (0..SLOTS).filter(|slot| slots[*slot].is_none()) {
                let distance = projections[child][slot];
                if best.is_none_or(|best| distance > best.0) {
                    best = Some((distance, child, slot));
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
