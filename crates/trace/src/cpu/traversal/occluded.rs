//! Occlusion of up to 32 segments from one point, which traverse the BVH together.

use arrayvec::ArrayVec;
use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::super::bits::bits_of;
use super::super::prefetch::prefetch_item;
use super::closest::STACK;
use super::line::{MIN_COMPONENT, axes_from, in_order, maximum, minimum};
use super::node::{TriangleBvh, Triangles as _, WideNode};
use super::{Directions, Line, MAX_SEGMENTS, Segments};
use crate::bvh::{Aabb, Node};

/// Maximum number of segments that are tested one by one. Each of them is tested against all boxes of a node, or
/// against four triangles of a leaf, at a time.
const FEW_SEGMENTS: u32 = 6;

/// Maximum number of SIMD vectors of segments: the narrowest vectors have four lanes.
const MAX_VECTORS: usize = MAX_SEGMENTS / 4;

/// A SIMD vector of segments.
#[derive(Clone, Copy)]
struct Lanes<S: Simd> {
    /// Permutation of axes as in [`Line`](super::Line), if all segments share it.
    axes: Option<[usize; 3]>,
    /// Masks of the segments whose direction has the largest component along x, and along y.
    largest: [S::mask32s; 2],
    /// Shear as in [`Line`](super::Line).
    shear: [S::f32s; 3],
    inverse: [S::f32s; 3],
}

/// Bounds on one component of all directions, for a conservative box test.
#[derive(Clone, Copy, Default)]
struct Slope {
    /// All directions have the same sign.
    same_sign: bool,
    /// Near and far side of a box (0: lower, 1: upper) if the signs agree, else lower and upper side.
    sides: [usize; 2],
    /// Origins for tests of these sides.
    origins: [f32; 2],
    /// Reciprocals that minimize the near and maximize the far distance if the signs agree, otherwise reciprocals that
    /// minimize the entry distance for either side.
    inverse: [f32; 2],
}

/// See [`super::occluded`].
#[inline(always)]
pub fn occluded<S: Simd>(simd: S, mesh: &impl TriangleBvh, segments: &Segments, mask: u32) -> u32 {
    let o = segments.o.to_array();
    traverse(
        simd,
        mesh.nodes(),
        segments,
        mask,
        #[inline(always)]
        |leaf| mesh.prefetch_leaf(leaf),
        #[inline(always)]
        |lanes, leaf, leaf_mask| {
            let Some(triangles) = mesh.triangles(leaf) else {
                return 0;
            };
            let mut pending = leaf_mask;
            if pending.count_ones() <= FEW_SEGMENTS {
                for i in bits_of(pending) {
                    let (hits, t) = triangles.intersect(simd, &line_at(lanes, i, &o, segments.pad));
                    for lane in bits_of(hits) {
                        if t[lane] > 0.0 && t[lane] < segments.t_max && triangles.index(lane) != segments.skip {
                            pending &= !(1 << i);
                        }
                    }
                }
                return leaf_mask & !pending;
            }
            for lane in (0..triangles.count()).filter(|lane| triangles.index(*lane) != segments.skip) {
                pending &= !in_lanes(
                    lanes,
                    #[inline(always)]
                    |lanes| occluded_by_triangle(simd, lanes, &o, segments, triangles.corners(lane)),
                );
            }
            leaf_mask & !pending
        },
    )
}

/// See [`super::occluded_items`].
#[inline(always)]
pub fn items<S: Simd>(
    simd: S,
    nodes: &[Node],
    segments: &Segments,
    mask: u32,
    bounds: impl Fn(usize) -> Option<Aabb>,
    mut visit: impl FnMut(usize, u32) -> u32,
) -> u32 {
    let o = segments.o.to_array();
    traverse(
        simd,
        nodes,
        segments,
        mask,
        |_| {},
        #[inline(always)]
        |lanes, items, leaf_mask| {
            let mut occluded = 0;
            for item in items {
                let Some(item_bounds) = bounds(item) else { continue };
                let candidates = in_lanes(
                    lanes,
                    #[inline(always)]
                    |lanes| hitting_box(simd, lanes, &o, segments, &item_bounds),
                ) & leaf_mask
                    & !occluded;
                if candidates != 0 {
                    occluded |= visit(item, candidates);
                }
            }
            occluded
        },
    )
}

/// Returns the bits of a mask of children, approximately from the farthest to the nearest child for directions in an
/// octant. The child in slot c is approximately in octant c of its node.
#[inline(always)]
fn far_to_near(children: u32, octant: usize) -> impl Iterator<Item = usize> {
    let mut bits = children; // bit j stands for slot `j ^ octant`
    for (k, low) in [0x55, 0x33, 0x0f].into_iter().enumerate() {
        let distance = 1 << k;
        let swapped = (bits & low) << distance | bits >> distance & low;
        bits = if octant & distance != 0 { swapped } else { bits };
    }
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let j = bits.checked_ilog2()? as usize;
            bits ^= 1 << j;
            Some(j ^ octant)
        },
    )
}

/// Concatenates the masks of all vectors of segments.
#[inline(always)]
fn in_lanes<S: Simd>(lanes: &[Lanes<S>], mut test: impl FnMut(&Lanes<S>) -> u64) -> u32 {
    let mut bits = 0;
    for (i, lanes) in lanes.iter().enumerate() {
        bits |= (test(lanes) as u32) << (i * S::f32s::LEN);
    }
    bits
}

/// Visits each leaf with the mask of the segments that hit the leaf. `visit` returns the mask of the segments that the
/// leaf occludes. `prefetch_leaf` starts to load a leaf. Returns the mask of all occluded segments.
#[inline(always)]
fn traverse<S: Simd, N: WideNode>(
    simd: S,
    nodes: &[N],
    segments: &Segments,
    mask: u32,
    prefetch_leaf: impl Fn(N::Leaf),
    mut visit: impl FnMut(&[Lanes<S>], N::Leaf, u32) -> u32,
) -> u32 {
    let mut pending = mask & segments.directions.all();
    if pending == 0 {
        return 0;
    }
    let tested = pending;
    let mut lanes = ArrayVec::new();
    let slopes = prepare(simd, segments, &mut lanes);
    let zero = f32x8::splat(simd, 0.0);
    let t_max = f32x8::splat(simd, segments.t_max);
    // The octant of the first direction, with which most directions agree.
    let octant = (0..3)
        .map(|k| usize::from(segments.directions.components[k][0] < 0.0) << k)
        .sum();
    let mut stack: ArrayVec<(u32, u32), STACK> = ArrayVec::new();
    stack.push((0, pending));
    while let Some((node_index, mask)) = stack.pop() {
        let mask = mask & pending;
        if mask == 0 {
            continue;
        }
        let node = &nodes[node_index as usize];
        let mut planes_from_origin = [[zero; 3]; 2];
        for k in 0..3 {
            for (i, planes) in planes_from_origin.iter_mut().enumerate() {
                planes[k] = node.planes(simd, slopes[k].sides[i], k) - slopes[k].origins[i];
            }
        }
        // For each child, the mask of the segments that hit its box; mask of the children that any segment hits.
        let mut children = [0u32; 8];
        let mut hit_children = 0;
        if mask.count_ones() <= FEW_SEGMENTS {
            for i in bits_of(mask) {
                let inverse = &lanes[i / S::f32s::LEN].inverse;
                let (mut near, mut far) = (zero, t_max);
                for k in 0..3 {
                    let inverse = inverse[k][i % S::f32s::LEN];
                    let (a, b) = (planes_from_origin[0][k] * inverse, planes_from_origin[1][k] * inverse);
                    if slopes[k].same_sign {
                        near = near.max(a);
                        far = far.min(b);
                    } else {
                        near = near.max(a.min(b));
                        far = far.min(a.max(b));
                    }
                }
                let hits = (near.simd_le(far) & far.simd_gt(zero)).to_bitmask() as u32;
                hit_children |= hits;
                // Branchless, to avoid mispredictions.
                for (slot, child) in children.iter_mut().enumerate() {
                    *child |= (hits >> slot & 1) << i;
                }
            }
        } else {
            let (mut near, mut far) = (zero, t_max);
            for k in 0..3 {
                near = near.max(planes_from_origin[0][k] * slopes[k].inverse[0]);
                let second = planes_from_origin[1][k] * slopes[k].inverse[1];
                if slopes[k].same_sign {
                    far = far.min(second);
                } else {
                    near = near.max(second);
                }
            }
            let hits = (near.simd_le(far) & far.simd_gt(zero)).to_bitmask() as u32;
            for slot in bits_of(hits) {
                children[slot] = mask
                    & in_lanes(
                        &lanes,
                        #[inline(always)]
                        |lanes| segments_hitting_child(simd, lanes, &slopes, &planes_from_origin, slot, segments.t_max),
                    );
                hit_children |= u32::from(children[slot] != 0) << slot;
            }
        }
        let inner = node.inner();
        for slot in bits_of(hit_children & !inner) {
            prefetch_leaf(node.leaf(slot));
        }
        for slot in far_to_near(hit_children & inner, octant) {
            let child = node.node(slot);
            prefetch_item(nodes, child);
            stack.push((child, children[slot]));
        }
        for slot in bits_of(hit_children & !inner) {
            let mask = children[slot] & pending;
            if mask != 0 {
                pending &= !visit(&lanes, node.leaf(slot), mask);
            }
        }
    }
    tested & !pending
}

#[inline(always)]
fn line_at<S: Simd>(lanes: &[Lanes<S>], segment: usize, o: &[f32; 3], pad: f32) -> Line {
    let (lanes, i) = (&lanes[segment / S::f32s::LEN], segment % S::f32s::LEN);
    let axes = lanes.axes.unwrap_or_else(|| {
        let [x, y] = lanes.largest.map(|mask| mask.to_bitmask() >> i & 1 == 1);
        axes_from(if x {
            0
        } else if y {
            1
        } else {
            2
        })
    });
    let o = in_order(o, axes);
    let [x, y, z] = axes;
    Line {
        axes,
        o,
        o_low: [o[0] + pad, o[1] + pad, o[2] + pad],
        o_high: [o[0] - pad, o[1] - pad, o[2] - pad],
        inverse: [lanes.inverse[x][i], lanes.inverse[y][i], lanes.inverse[z][i]],
        shear: [lanes.shear[0][i], lanes.shear[1][i], lanes.shear[2][i]],
    }
}

/// Arranges the segments in vectors, and returns bounds on the directions of all segments.
#[inline(always)]
fn prepare<S: Simd>(simd: S, segments: &Segments, lanes: &mut ArrayVec<Lanes<S>, MAX_VECTORS>) -> [Slope; 3] {
    let one = S::f32s::splat(simd, 1.0);
    let mut bounds = [
        [S::f32s::splat(simd, f32::INFINITY); 3],
        [S::f32s::splat(simd, f32::NEG_INFINITY); 3],
    ];
    let Directions { count, components } = segments.directions;
    for i in (0..*count).step_by(S::f32s::LEN) {
        let mut d = [one; 3];
        let mut inverse = [one; 3];
        for k in 0..3 {
            d[k] = S::f32s::from_slice(simd, &components[k][i..i + S::f32s::LEN]);
            let clamped = away_from_zero(simd, d[k]);
            bounds[0][k] = bounds[0][k].min(clamped);
            bounds[1][k] = bounds[1][k].max(clamped);
            inverse[k] = one / clamped;
        }
        let [x, y, z] = d.map(|d| d.abs());
        let x_first = x.simd_ge(y) & x.simd_ge(z);
        let y_first = y.simd_ge(z) & !x_first;
        let full_mask = (1 << S::f32s::LEN) - 1;
        let axes = match (x_first.to_bitmask(), y_first.to_bitmask()) {
            (x, _) if x == full_mask => Some(axes_from(0)),
            (_, y) if y == full_mask => Some(axes_from(1)),
            (0, 0) => Some(axes_from(2)),
            _ => None,
        };
        let mut vector = Lanes {
            axes,
            largest: [x_first, y_first],
            shear: [one; 3],
            inverse,
        };
        let [x, y, z] = vector.in_order(d);
        vector.shear = [x / z, y / z, one / z];
        lanes.push(vector);
    }
    let mut slopes = [Slope::default(); 3];
    for k in 0..3 {
        let (min_direction, max_direction) = (bounds[0][k].reduce_min(), bounds[1][k].reduce_max());
        let [low, high] = [segments.o[k] + segments.pad, segments.o[k] - segments.pad];
        let [inverse_min, inverse_max] = [1.0 / min_direction, 1.0 / max_direction];
        slopes[k] = match () {
            _ if min_direction > 0.0 => Slope {
                same_sign: true,
                sides: [0, 1],
                origins: [low, high],
                inverse: [inverse_max, inverse_min],
            },
            _ if max_direction < 0.0 => Slope {
                same_sign: true,
                sides: [1, 0],
                origins: [high, low],
                inverse: [inverse_min, inverse_max],
            },
            _ => Slope {
                same_sign: false,
                sides: [0, 1],
                origins: [low, high],
                inverse: [inverse_max, inverse_min],
            },
        };
    }
    slopes
}

/// Like [`line::away_from_zero`](super::line::away_from_zero).
#[inline(always)]
fn away_from_zero<S: Simd>(simd: S, d: S::f32s) -> S::f32s {
    let min_component = S::f32s::splat(simd, MIN_COMPONENT);
    let clamped = d
        .simd_lt(S::f32s::splat(simd, 0.0))
        .select(-min_component, min_component);
    d.abs().simd_ge(min_component).select(d, clamped)
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    fn in_order(&self, v: [S::f32s; 3]) -> [S::f32s; 3] {
        if let Some([x, y, z]) = self.axes {
            return [v[x], v[y], v[z]];
        }
        let [x, y, z] = v;
        let [x_largest, y_largest] = self.largest;
        [
            x_largest.select(y, y_largest.select(z, x)),
            x_largest.select(z, y_largest.select(x, y)),
            x_largest.select(x, y_largest.select(y, z)),
        ]
    }

    #[inline(always)]
    fn splat_in_order(&self, simd: S, v: [f32; 3]) -> [S::f32s; 3] {
        match self.axes {
            Some(axes) => in_order(&v, axes).map(|x| S::f32s::splat(simd, x)),
            None => self.in_order(v.map(|x| S::f32s::splat(simd, x))),
        }
    }
}

/// Returns the mask of the segments that hit an item's box, like `interval_hits` in `slab.rs`.
#[inline(always)]
fn hitting_box<S: Simd>(simd: S, lanes: &Lanes<S>, o: &[f32; 3], segments: &Segments, bounds: &Aabb) -> u64 {
    let [near, far] = line_intervals(
        simd,
        lanes,
        o,
        segments.pad,
        bounds.low.to_array(),
        bounds.high.to_array(),
    );
    let zero = S::f32s::splat(simd, 0.0);
    let t_max = S::f32s::splat(simd, segments.t_max);
    (near.simd_le(far) & far.simd_ge(zero) & near.simd_le(t_max)).to_bitmask()
}

/// Returns the segments' intervals inside a box, like [`Line::slab`](super::Line::slab).
#[inline(always)]
fn line_intervals<S: Simd>(
    simd: S,
    lanes: &Lanes<S>,
    o: &[f32; 3],
    pad: f32,
    low: [f32; 3],
    high: [f32; 3],
) -> [S::f32s; 2] {
    let mut near = S::f32s::splat(simd, f32::NEG_INFINITY);
    let mut far = S::f32s::splat(simd, f32::INFINITY);
    for k in 0..3 {
        let a = lanes.inverse[k] * (low[k] - (o[k] + pad));
        let b = lanes.inverse[k] * (high[k] - (o[k] - pad));
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    [near, far]
}

#[inline(always)]
fn segments_hitting_child<S: Simd>(
    simd: S,
    lanes: &Lanes<S>,
    slopes: &[Slope; 3],
    planes_from_origin: &[[f32x8<S>; 3]; 2],
    child: usize,
    t_max: f32,
) -> u64 {
    let zero = S::f32s::splat(simd, 0.0);
    let mut near = zero;
    let mut far = S::f32s::splat(simd, t_max);
    for k in 0..3 {
        let a = lanes.inverse[k] * planes_from_origin[0][k][child];
        let b = lanes.inverse[k] * planes_from_origin[1][k][child];
        if slopes[k].same_sign {
            near = near.max(a);
            far = far.min(b);
        } else {
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
    }
    (near.simd_le(far) & far.simd_gt(zero)).to_bitmask()
}

/// Returns the mask of the segments that a triangle occludes, like [`Line::triangle`](super::Line::triangle).
#[inline(always)]
fn occluded_by_triangle<S: Simd>(
    simd: S,
    lanes: &Lanes<S>,
    o: &[f32; 3],
    segments: &Segments,
    vertices: [[f32; 3]; 3],
) -> u64 {
    let zero = S::f32s::splat(simd, 0.0);
    let mut sheared = [[zero; 3]; 3];
    for (sheared, vertex) in sheared.iter_mut().zip(vertices) {
        let from_o = [vertex[0] - o[0], vertex[1] - o[1], vertex[2] - o[2]];
        let [x, y, z] = lanes.splat_in_order(simd, from_o);
        *sheared = [x - lanes.shear[0] * z, y - lanes.shear[1] * z, z];
    }
    let [a, b, c] = sheared;
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let inside =
        (u.simd_ge(zero) & v.simd_ge(zero) & w.simd_ge(zero)) | (u.simd_le(zero) & v.simd_le(zero) & w.simd_le(zero));
    if inside.to_bitmask() == 0 {
        return 0;
    }
    let determinant = u + v + w;
    let [a, b, c] = [a[2], b[2], c[2]].map(|z| lanes.shear[2] * z);
    let t = (u * a + v * b + w * c) / determinant;
    let [mut low, mut high] = [[0.0; 3]; 2];
    for k in 0..3 {
        let [a, b, c] = vertices.map(|vertex| vertex[k]);
        low[k] = minimum(minimum(a, b), c);
        high[k] = maximum(maximum(a, b), c);
    }
    let [near, far] = line_intervals(simd, lanes, o, segments.pad, low, high);
    // This order of operands preserves a NaN of `t`.
    let t = near.simd_gt(t).select(near, t);
    let t = far.simd_lt(t).select(far, t);
    let is_hit = inside
        & determinant.simd_ne(zero)
        & near.simd_le(far)
        & t.simd_gt(zero)
        & t.simd_lt(S::f32s::splat(simd, segments.t_max));
    is_hit.to_bitmask()
}
