//! Builder of the light tree: a BVH over emitters with four children per node, in f64. Section and equation numbers
//! refer to Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", HPG 2018.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec3, UVec4};
use rayon::prelude::*;

use super::{LightNode, NO_INDEX};

/// Number of buckets per axis for split candidates (section 4.4).
const BUCKETS: usize = 12;
/// Binary splits after which nodes are split at the median, to bound the depth.
const LIGHT_TREE_MAX_DEPTH: u32 = 48;

/// Bounds of emission: normals lie within the angle `spread` of the axis, and emission lies within the angle `edge` of
/// a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit length.
    pub axis: DVec3,
    /// Maximum angle between the axis and a normal (θ_o in the paper), 0 to pi.
    pub spread: f64,
    /// Maximum angle between a normal and the emission (θ_e in the paper), 0 to pi / 2.
    pub edge: f64,
    /// True if the opposite directions belong to the cone too.
    pub two_sided: bool,
}

impl Cone {
    /// All directions.
    pub const ALL: Cone = Cone {
        axis: DVec3::Z,
        spread: PI,
        edge: FRAC_PI_2,
        two_sided: false,
    };

    /// Returns the cone of a flat emitter.
    pub fn flat(normal: DVec3, two_sided: bool) -> Cone {
        Cone {
            axis: normal,
            spread: 0.0,
            edge: FRAC_PI_2,
            two_sided,
        }
    }

    /// Returns a cone that contains two cones, algorithm 1.
    pub fn with(&self, other: &Cone) -> Cone {
        let (mut a, mut b) = (*self, *other);
        if b.spread > a.spread {
            (a, b) = (b, a);
        }
        let two_sided = a.two_sided || b.two_sided;
        if two_sided && a.axis.dot(b.axis) < 0.0 {
            b.axis = -b.axis;
        }
        let union = Cone {
            edge: a.edge.max(b.edge),
            two_sided,
            ..a
        };
        if a.spread >= PI {
            return union;
        }
        // The angle is 2 asin(chord / 2), without the cancellation of acos at small angles. The cheaper bound asin(x)
        // <= x + (pi / 2 - 1) x^3 decides most cases.
        let chord = (a.axis - b.axis).length();
        let bound = chord + 0.25 * (FRAC_PI_2 - 1.0) * chord.powi(3);
        if bound + b.spread <= a.spread * (1.0 - 1e-12) {
            return union;
        }
        let angle = 2.0 * (0.5 * chord).min(1.0).asin();
        if (angle + b.spread).min(PI) <= a.spread {
            return union;
        }
        let spread = 0.5 * (a.spread + angle + b.spread);
        let normal = a.axis.cross(b.axis);
        if spread >= PI || normal.length() < 1e-9 {
            return Cone { spread: PI, ..union };
        }
        let rotation = DQuat::from_axis_angle(normal.normalize(), spread - a.spread);
        Cone {
            axis: (rotation * a.axis).normalize(),
            spread,
            ..union
        }
    }

    /// Orientation measure, equation 1.
    fn measure(&self) -> f64 {
        let (o, w) = (self.spread, (self.spread + self.edge).min(PI));
        let edge_term = 2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos();
        2.0 * PI * (1.0 - o.cos()) + FRAC_PI_2 * edge_term
    }
}

/// An emitter in the light tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeEmitter {
    /// Lower corner of the bounding box.
    pub low: DVec3,
    /// Upper corner of the bounding box.
    pub high: DVec3,
    /// Bounds of the directions of emission.
    pub cone: Cone,
    /// Maximum intensity.
    pub intensity: f64,
    /// PDF of samples per area, times the probability of selecting the tree.
    pub density: f64,
    /// 0 for a light, else 1 + the index of the mesh instance.
    pub instance: u32,
    /// Index of the light, or of the triangle in its mesh.
    pub index: u32,
}

#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    cone: Cone,
    intensity: f64,
}

impl Bounds {
    fn of(emitter: &TreeEmitter) -> Bounds {
        let TreeEmitter {
            low,
            high,
            cone,
            intensity,
            ..
        } = *emitter;
        Bounds {
            low,
            high,
            cone,
            intensity,
        }
    }

    fn with(&self, other: &Bounds) -> Bounds {
        Bounds {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            cone: self.cone.with(&other.cone),
            intensity: self.intensity + other.intensity,
        }
    }

    fn union(bounds: impl Iterator<Item = Bounds>) -> Option<Bounds> {
        bounds.reduce(|a, b| a.with(&b))
    }

    /// Returns the numerator of equation 2. `padding` enlarges the box, so that boxes without extent also have a cost.
    fn cost(&self, padding: f64) -> f64 {
        let size = self.high - self.low + padding;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        self.intensity * area * self.cone.measure()
    }
}

/// Maximum number of children of a node.
const WIDTH: usize = 4;

/// Minimum number of emitters of a node whose children are built in parallel.
const MIN_PARALLEL_EMITTERS: usize = 2048;

/// Builds the tree, root first.
pub fn build(emitters: &[TreeEmitter]) -> Vec<LightNode> {
    build_with(emitters, MIN_PARALLEL_EMITTERS)
}

fn build_with(emitters: &[TreeEmitter], parallel: usize) -> Vec<LightNode> {
    let mut order: Vec<u32> = (0..emitters.len() as u32).collect();
    let builder = Builder {
        emitters,
        total: emitters.iter().map(|emitter| emitter.intensity).sum(),
        parallel,
    };
    let mut nodes = Vec::with_capacity(emitters.len() / 2 + 1);
    if let Some(part) = builder.part(&mut order, 0) {
        builder.add_subtree(NO_INDEX, part, &mut nodes);
    }
    nodes
}

struct Builder<'a> {
    emitters: &'a [TreeEmitter],
    total: f64,
    parallel: usize,
}

/// The emitters of a node or of a child.
struct Part<'a> {
    /// Indices of the emitters.
    order: &'a mut [u32],
    bounds: Bounds,
    /// Number of binary splits above.
    level: u32,
}

impl Builder<'_> {
    fn part<'a>(&self, order: &'a mut [u32], level: u32) -> Option<Part<'a>> {
        let bounds = Bounds::union(order.iter().map(|i| Bounds::of(&self.emitters[*i as usize])))?;
        Some(Part { order, bounds, level })
    }

    /// Appends a node and its descendants depth first, and returns its index.
    fn add_subtree(&self, parent: u32, part: Part, nodes: &mut Vec<LightNode>) -> u32 {
        let node_index = nodes.len();
        let is_parallel = part.order.len() >= self.parallel;
        let (node, parts) = self.node(parent, part);
        nodes.push(node);
        let inner = parts.into_iter().enumerate().filter(|(_, part)| part.order.len() > 1);
        let parent_of = |i: usize| (4 * node_index + i) as u32;
        if !is_parallel {
            for (i, part) in inner {
                nodes[node_index].children[i] = self.add_subtree(parent_of(i), part, nodes);
            }
            return node_index as u32;
        }
        let inner: Vec<(usize, Part)> = inner.collect();
        let subtrees = inner.into_par_iter().map(|(i, part)| {
            let mut subtree = Vec::new();
            self.add_subtree(NO_INDEX, part, &mut subtree);
            (i, subtree)
        });
        for (i, mut subtree) in subtrees.collect::<Vec<_>>() {
            let first = nodes.len() as u32;
            for node in &mut subtree {
                node.parent.x = node.parent.x.wrapping_add(4 * first); // the parent of the subtree's root is set below
                for child in 0..WIDTH {
                    if node.children[child] != NO_INDEX {
                        node.children[child] += first;
                    }
                }
            }
            subtree[0].parent.x = parent_of(i);
            nodes[node_index].children[i] = first;
            nodes.append(&mut subtree);
        }
        node_index as u32
    }

    /// Returns a node, whose child indices the caller sets, and the emitters of each child.
    fn node<'a>(&self, parent: u32, part: Part<'a>) -> (LightNode, Vec<Part<'a>>) {
        let size = (part.bounds.high - part.bounds.low).max_element();
        let padding = if size > 0.0 { 1e-3 * size } else { 1.0 };
        let mut parts = vec![part];
        // The most expensive part is split until the node is full.
        while parts.len() < WIDTH {
            let costs = parts.iter().enumerate().filter(|(_, part)| part.order.len() > 1);
            let costliest = costs.max_by(|(_, a), (_, b)| a.bounds.cost(padding).total_cmp(&b.bounds.cost(padding)));
            let Some((i, _)) = costliest else {
                break;
            };
            let Part { order, level, .. } = parts.swap_remove(i);
            let first_size = self.split(order, level);
            let (first, second) = order.split_at_mut(first_size);
            parts.extend(
                [first, second]
                    .into_iter()
                    .filter_map(|order| self.part(order, level + 1)),
            );
        }
        let mut node = LightNode {
            children: UVec4::splat(NO_INDEX),
            parent: UVec4::new(parent, 0, 0, 0),
            ..bytemuck::Zeroable::zeroed()
        };
        for (i, part) in parts.iter().enumerate() {
            self.set_child(&mut node, i, &part.bounds);
            if let [emitter] = *part.order {
                let emitter = &self.emitters[emitter as usize];
                node.density[i] = emitter.density as f32;
                node.instance[i] = emitter.instance;
                node.index[i] = emitter.index;
            }
        }
        (node, parts)
    }

    fn set_child(&self, node: &mut LightNode, i: usize, bounds: &Bounds) {
        let center = (0.5 * (bounds.low + bounds.high)).as_vec3();
        // The extent is measured from the rounded center, so that the sphere contains the box.
        let half_extent = (bounds.high - center.as_dvec3()).max(center.as_dvec3() - bounds.low);
        let radius = half_extent.length() * (1.0 + 1e-6);
        let axis = bounds.cone.axis.as_vec3();
        (node.x[i], node.y[i], node.z[i]) = center.into();
        node.radius[i] = radius as f32;
        (node.axis_x[i], node.axis_y[i], node.axis_z[i]) = axis.into();
        node.cosine[i] = bounds.cone.spread.cos() as f32;
        node.edge[i] = bounds.cone.edge.cos() as f32;
        node.sides[i] = if bounds.cone.two_sided { 2 } else { 1 };
        // Greater than 0, because 0 marks a missing child.
        node.intensity[i] = ((bounds.intensity / self.total) as f32).max(f32::MIN_POSITIVE);
    }

    /// Partitions emitters by the surface area orientation heuristic. Returns the size of the first part.
    fn split(&self, order: &mut [u32], level: u32) -> usize {
        let half = order.len() / 2;
        let center = |i: &u32| {
            let emitter = &self.emitters[*i as usize];
            0.5 * (emitter.low + emitter.high)
        };
        let (low, high) = order
            .iter()
            .map(center)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
                (low.min(p), high.max(p))
            });
        let size = high - low;
        if order.len() == 2 || !(size.max_element() > 0.0) {
            return half;
        }
        let longest = (0..3).fold(
            0,
            |longest, axis| if size[axis] > size[longest] { axis } else { longest },
        );
        if level >= LIGHT_TREE_MAX_DEPTH {
            order.select_nth_unstable_by(half, |a, b| center(a)[longest].total_cmp(&center(b)[longest]));
            return half;
        }
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in 0..3 {
            if !(size[axis] > 1e-6 * size[longest]) {
                continue;
            }
            let mut buckets: [Option<Bounds>; BUCKETS] = [None; BUCKETS];
            for i in &*order {
                let bounds = Bounds::of(&self.emitters[*i as usize]);
                let bucket = &mut buckets[bucket(center(i)[axis], low[axis], size[axis])];
                *bucket = Some(bucket.map_or(bounds, |merged| merged.with(&bounds)));
            }
            let padding = 1e-3 * size[longest];
            let stretch = size[longest] / size[axis]; // K_r
            let mut lower_bounds: Option<Bounds> = None;
            for split in 1..BUCKETS {
                // A split after an empty bucket gives the same parts as the previous split.
                let Some(added) = buckets[split - 1] else { continue };
                let lower = lower_bounds.map_or(added, |bounds| bounds.with(&added));
                lower_bounds = Some(lower);
                let Some(upper) = Bounds::union(buckets[split..].iter().copied().flatten()) else {
                    break;
                };
                let cost = stretch * (lower.cost(padding) + upper.cost(padding));
                if best.is_none_or(|(min_cost, _, _)| cost < min_cost) {
                    best = Some((cost, axis, split));
                }
            }
        }
        let Some((_, axis, split)) = best else {
            return half;
        };
        let mut first_size = 0;
        for i in 0..order.len() {
            if bucket(center(&order[i])[axis], low[axis], size[axis]) < split {
                order.swap(first_size, i);
                first_size += 1;
            }
        }
        first_size
    }
}

fn bucket(x: f64, low: f64, size: f64) -> usize {
    let fraction = (x - low) / size;
    ((fraction * BUCKETS as f64) as usize).min(BUCKETS - 1)
}

#[cfg(test)]
mod tests;
