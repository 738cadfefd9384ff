//! A tree over things by how far they reach, for questions of the form "does anything reach beyond this plane?".

use glam::DVec3;

/// Things, by number, that reach from somewhere to somewhere along every direction.
pub trait Extent {
    /// From where to where thing `i` reaches along a unit vector.
    fn extent(&self, i: usize, direction: DVec3) -> (f64, f64);
    /// A vector along which the thing is thin, of any length; zero if there is none.
    fn normal(&self, i: usize) -> DVec3;
}

/// Things in a leaf, at most.
const LEAF: usize = 4;

/// A binary tree of the things' numbers, halved at the middle of the longest side: built in O(n log n).
pub struct ExtentTree {
    /// Every node is followed by those below it on its first side.
    nodes: Vec<Node>,
    /// The things, in the order of the leaves.
    things: Vec<usize>,
}

/// What a node's things are inside of: a box along the axes, and a slab along the normal of one of them. The slab is
/// what makes a slanted wall of many parts thin.
struct Node {
    low: DVec3,
    high: DVec3,
    normal: DVec3,
    slab: (f64, f64),
    children: Children,
}

enum Children {
    /// A range of the things.
    Leaf(usize, usize),
    /// The node where the second side begins.
    Halves(usize),
}

impl ExtentTree {
    pub fn new(things: Vec<usize>, extents: &impl Extent) -> ExtentTree {
        let mut tree = ExtentTree {
            nodes: Vec::new(),
            things,
        };
        if let Some(most) = tree.things.iter().max() {
            let mut boxes = vec![(DVec3::ZERO, DVec3::ZERO); most + 1];
            for i in &tree.things {
                let [x, y, z] = DVec3::AXES.map(|axis| extents.extent(*i, axis));
                boxes[*i] = (DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1));
            }
            tree.build(0, tree.things.len(), extents, &boxes);
        }
        tree
    }

    /// `boxes` has where each thing reaches along the axes.
    fn build(&mut self, start: usize, end: usize, extents: &impl Extent, boxes: &[(DVec3, DVec3)]) {
        let things = &mut self.things[start..end];
        let nowhere = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = things.iter().fold(nowhere, |(low, high), i| {
            let own = &boxes[*i];
            (low.min(own.0), high.max(own.1))
        });
        let normal = extents.normal(things[things.len() / 2]).normalize_or_zero();
        let slab = match normal == DVec3::ZERO {
            true => (0.0, 0.0),
            false => {
                let all = things.iter().map(|i| extents.extent(*i, normal));
                all.fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)))
            }
        };
        let node = self.nodes.len();
        let half = things.len() / 2;
        let is_leaf = things.len() <= LEAF;
        if !is_leaf {
            let axis = (high - low).max_position();
            let middle = |i: &usize| boxes[*i].0[axis] + boxes[*i].1[axis];
            things.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
        }
        self.nodes.push(Node {
            low,
            high,
            normal,
            slab,
            children: Children::Leaf(start, end),
        });
        if !is_leaf {
            self.build(start, start + half, extents, boxes);
            self.nodes[node].children = Children::Halves(self.nodes.len());
            self.build(start + half, end, extents, boxes);
        }
    }

    /// Whether `is_beyond` holds for any thing. Nodes are left out where `may_be_beyond` does not hold: it is told how
    /// far the node reaches along the unit vector `normal`, at most; its largest coordinate; and the least that any point
    /// in it has as its largest coordinate. `budget` is how many nodes may be looked at, and is lowered by those that
    /// were; once it is 0 the search ends.
    pub fn any(
        &self,
        normal: DVec3,
        budget: &mut u32,
        may_be_beyond: impl Fn(f64, f64, f64) -> bool,
        mut is_beyond: impl FnMut(usize) -> bool,
    ) -> bool {
        let mut waiting = Vec::new();
        if !self.nodes.is_empty() {
            waiting.push((0, self.nodes[0].highest(normal)));
        }
        while let Some((i, highest)) = waiting.pop() {
            if *budget == 0 {
                return false;
            }
            *budget -= 1;
            let node = &self.nodes[i];
            if !may_be_beyond(highest, node.size(), node.nearest()) {
                continue;
            }
            match node.children {
                Children::Leaf(start, end) => {
                    if self.things[start..end].iter().any(|thing| is_beyond(*thing)) {
                        return true;
                    }
                }
                Children::Halves(second) => {
                    let halves = [i + 1, second].map(|half| (half, self.nodes[half].highest(normal)));
                    let [a, b] = halves;
                    // What reaches farthest comes first, from the end of the list.
                    waiting.extend(if a.1 > b.1 { [b, a] } else { [a, b] });
                }
            }
        }
        false
    }
}

impl Node {
    /// How far it reaches along a unit vector, at most. In the slab n = m + (n - m), and a point is not farther from the
    /// middle of the box than its corners are.
    fn highest(&self, n: DVec3) -> f64 {
        let by_box = (self.low * n).max(self.high * n).element_sum();
        if self.normal == DVec3::ZERO {
            return by_box;
        }
        let (m, highest) = match n.dot(self.normal) >= 0.0 {
            true => (self.normal, self.slab.1),
            false => (-self.normal, -self.slab.0),
        };
        let middle = (self.low + self.high) * 0.5;
        let radius = (self.high - middle).length();
        let by_slab = highest + middle.dot(n - m) + (n - m).length() * radius;
        by_box.min(by_slab)
    }

    fn size(&self) -> f64 {
        self.low.abs().max(self.high.abs()).max_element()
    }

    fn nearest(&self) -> f64 {
        self.low.max(-self.high).max(DVec3::ZERO).max_element()
    }
}
