//! The tree over what shines, built in f64. Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", HPG 2018: sections and equations are those of that paper.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec3};

use super::{LightNode, NOTHING};

/// Buckets along each axis where a node may be split, section 4.4.
const BUCKETS: usize = 12;
/// Below so many levels nodes are split in the middle, so that no path gets long.
const MOST_LEVELS: u32 = 48;

/// The directions in which something sends light: normals within `spread` of the axis, and light within `edge` of a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit length.
    pub axis: DVec3,
    /// 0 to pi.
    pub spread: f64,
    /// 0 to pi / 2.
    pub edge: f64,
    /// Whether the opposite directions get light too.
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

    /// The directions of a flat thing.
    pub fn flat(normal: DVec3, two_sided: bool) -> Cone {
        Cone {
            axis: normal,
            spread: 0.0,
            edge: FRAC_PI_2,
            two_sided,
        }
    }

    /// One around two: algorithm 1.
    pub fn with(&self, other: &Cone) -> Cone {
        let (mut a, mut b) = (*self, *other);
        if b.spread > a.spread {
            (a, b) = (b, a);
        }
        let two_sided = a.two_sided || b.two_sided;
        if two_sided && a.axis.dot(b.axis) < 0.0 {
            b.axis = -b.axis;
        }
        let around = Cone {
            edge: a.edge.max(b.edge),
            two_sided,
            ..a
        };
        if a.spread >= PI {
            return around;
        }
        // The angle of two unit vectors, without what the arc cosine loses of small ones.
        let between = 2.0 * (0.5 * (a.axis - b.axis).length()).min(1.0).asin();
        if (between + b.spread).min(PI) <= a.spread {
            return around;
        }
        let spread = 0.5 * (a.spread + between + b.spread);
        let normal = a.axis.cross(b.axis);
        if spread >= PI || normal.length() < 1e-9 {
            return Cone { spread: PI, ..around };
        }
        let turn = DQuat::from_axis_angle(normal.normalize(), spread - a.spread);
        Cone {
            axis: (turn * a.axis).normalize(),
            spread,
            ..around
        }
    }

    /// How much there is of its directions, equation 1.
    fn measure(&self) -> f64 {
        let (o, w) = (self.spread, (self.spread + self.edge).min(PI));
        let part = 2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos();
        2.0 * PI * (1.0 - o.cos()) + FRAC_PI_2 * part
    }
}

/// Something that shines, in the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// The lower corner of its box.
    pub low: DVec3,
    /// The upper corner.
    pub high: DVec3,
    /// Where its light goes.
    pub cone: Cone,
    /// The light that it sends in its brightest direction.
    pub intensity: f64,
    /// How densely samples lie on it, per area, with the tree's choice among all that shines.
    pub density: f64,
    /// 0 for a light, else one more than the number of a mesh's instance.
    pub instance: u32,
    /// The number of the light, or where the triangle is in its mesh.
    pub index: u32,
}

/// What is known of several.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    cone: Cone,
    intensity: f64,
}

impl Bounds {
    fn of(lamp: &Lamp) -> Bounds {
        let Lamp {
            low,
            high,
            cone,
            intensity,
            ..
        } = *lamp;
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

    fn of_all(all: impl Iterator<Item = Bounds>) -> Option<Bounds> {
        all.reduce(|a, b| a.with(&b))
    }

    /// What it costs to have these in one node, equation 2's numerator. A box is counted wider by `room`, so that one without
    /// area costs something too.
    fn cost(&self, room: f64) -> f64 {
        let size = self.high - self.low + room;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        self.intensity * area * self.cone.measure()
    }
}

/// Builds the tree. The root is node 0; a node's children lie together, the first with an odd number.
pub fn build(lamps: &[Lamp]) -> Vec<LightNode> {
    let mut order: Vec<u32> = (0..lamps.len() as u32).collect();
    let mut nodes = Vec::with_capacity((2 * lamps.len()).saturating_sub(1));
    let total: f64 = lamps.iter().map(|lamp| lamp.intensity).sum();
    if !lamps.is_empty() {
        nodes.push(bytemuck::Zeroable::zeroed());
        let mut builder = Builder { lamps, total, nodes };
        builder.fill(0, NOTHING, &mut order, 0);
        return builder.nodes;
    }
    nodes
}

struct Builder<'a> {
    lamps: &'a [Lamp],
    /// The intensity of all.
    total: f64,
    nodes: Vec<LightNode>,
}

impl Builder<'_> {
    /// Makes the node of some lamps, and all below it.
    fn fill(&mut self, place: u32, parent: u32, order: &mut [u32], level: u32) -> Bounds {
        if let [lamp] = order {
            let lamp = &self.lamps[*lamp as usize];
            let bounds = Bounds::of(lamp);
            self.nodes[place as usize] = LightNode {
                parent,
                children: NOTHING,
                density: lamp.density as f32,
                instance: lamp.instance,
                index: lamp.index,
                ..self.node(&bounds)
            };
            return bounds;
        }
        let middle = self.split(order, level);
        let children = self.nodes.len() as u32;
        let empty: LightNode = bytemuck::Zeroable::zeroed();
        self.nodes.extend([empty, empty]);
        let (first, second) = order.split_at_mut(middle);
        let first = self.fill(children, place, first, level + 1);
        let second = self.fill(children + 1, place, second, level + 1);
        let bounds = first.with(&second);
        self.nodes[place as usize] = LightNode {
            parent,
            children,
            ..self.node(&bounds)
        };
        bounds
    }

    /// The part of a node that says where and how bright it is.
    fn node(&self, bounds: &Bounds) -> LightNode {
        let center = (0.5 * (bounds.low + bounds.high)).as_vec3();
        // Around the box from the centre as it is rounded, and a bit more.
        let far = (bounds.high - center.as_dvec3()).max(center.as_dvec3() - bounds.low);
        let radius = far.length() * (1.0 + 1e-6);
        LightNode {
            center,
            radius: radius as f32,
            axis: bounds.cone.axis.as_vec3(),
            cosine: bounds.cone.spread.cos() as f32,
            edge: bounds.cone.edge.cos() as f32,
            sides: if bounds.cone.two_sided { 2 } else { 1 },
            intensity: (bounds.intensity / self.total) as f32,
            ..bytemuck::Zeroable::zeroed()
        }
    }

    /// Orders some lamps so that the first ones, whose number it gives, go to one side: where that costs least, by the heuristic of
    /// surface, area and orientation.
    fn split(&self, order: &mut [u32], level: u32) -> usize {
        let half = order.len() / 2;
        let middle = |i: &u32| {
            let lamp = &self.lamps[*i as usize];
            0.5 * (lamp.low + lamp.high)
        };
        let (low, high) = order
            .iter()
            .map(middle)
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
        if level >= MOST_LEVELS {
            order.select_nth_unstable_by(half, |a, b| middle(a)[longest].total_cmp(&middle(b)[longest]));
            return half;
        }
        let mut best: Option<(f64, usize, usize)> = None;
        for axis in 0..3 {
            if !(size[axis] > 1e-6 * size[longest]) {
                continue;
            }
            let mut buckets: [Option<Bounds>; BUCKETS] = [None; BUCKETS];
            for i in &*order {
                let bounds = Bounds::of(&self.lamps[*i as usize]);
                let bucket = &mut buckets[bucket(middle(i)[axis], low[axis], size[axis])];
                *bucket = Some(bucket.map_or(bounds, |before| before.with(&bounds)));
            }
            let room = 1e-3 * size[longest];
            let stretched = size[longest] / size[axis]; // K_r
            for split in 1..BUCKETS {
                let cost = |buckets: &[Option<Bounds>]| {
                    Bounds::of_all(buckets.iter().copied().flatten()).map(|bounds| bounds.cost(room))
                };
                let (Some(first), Some(second)) = (cost(&buckets[..split]), cost(&buckets[split..])) else {
                    continue;
                };
                let cost = stretched * (first + second);
                if best.is_none_or(|(least, _, _)| cost < least) {
                    best = Some((cost, axis, split));
                }
            }
        }
        let Some((_, axis, split)) = best else {
            return half;
        };
        let mut first = 0;
        for i in 0..order.len() {
            if bucket(middle(&order[i])[axis], low[axis], size[axis]) < split {
                order.swap(first, i);
                first += 1;
            }
        }
        first
    }
}

/// Where along an axis something is.
fn bucket(x: f64, low: f64, size: f64) -> usize {
    let share = (x - low) / size;
    ((share * BUCKETS as f64) as usize).min(BUCKETS - 1)
}

#[cfg(test)]
mod tests;
