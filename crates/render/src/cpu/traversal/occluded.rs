//! Occlusion of up to 32 segments from one point, which traverse the BVH together.

use std::ops::Range;

use arrayvec::ArrayVec;
use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::closest::{STACK, side};
use super::four::Four;
use super::line::{LEAST, axes_from, greater, in_order, less};
use super::{Directions, Line, MOST, Mesh, Segments};
use crate::bvh::{Aabb, Node};

/// Maximum number of segments tested one by one, against all boxes of a node or triangles of a leaf at once.
const FEW: u32 = 6;

/// Maximum number of SIMD vectors: the narrowest vectors have four lanes.
const MAX_LANES: usize = MOST / 4;

#[derive(Clone, Copy)]
struct Lanes<S: Simd> {
    /// Permutation of axes as in [`Line`](super::Line), if all segments share it.
    axes: Option<[usize; 3]>,
    /// Segments whose largest component is x, and y.
    largest: [S::mask32s; 2],
    /// Shear as in [`Line`](super::Line).
    shear: [S::f32s; 3],
    inverse: [S::f32s; 3],
}

/// Bounds on all directions along an axis, for a conservative box test.
#[derive(Clone, Copy, Default)]
struct Slope {
    /// All directions have the same sign.
    same: bool,
    /// Near and far side of a box (0: lower, 1: upper) if the signs agree, else lower and upper.
    sides: [usize; 2],
    /// Origins relative to these sides.
    from: [f32; 2],
    /// Reciprocals that minimize the near and maximize the far distance if the signs agree, otherwise reciprocals that
    /// minimize the entry distance for either side.
    inverse: [f32; 2],
}

/// See [`super::occluded`].
#[inline(always)]
pub fn occluded<S: Simd>(simd: S, mesh: &Mesh, segments: &Segments, asked: u32) -> u32 {
    let o = segments.o.to_array();
    walk(
        simd,
        mesh.nodes,
        segments,
        asked,
        #[inline(always)]
        |lanes, items, mask| {
            let mut pending = mask;
            for triangles in mesh.triangles[items].chunks(4) {
                if pending.count_ones() <= FEW {
                    let four = Four::new(simd, mesh, triangles);
                    for i in bits_of(pending) {
                        let (met, t) = four.intersect(simd, &line_at(lanes, i, &o, segments.pad));
                        for c in bits_of(met) {
                            if t[c] > 0.0 && t[c] < segments.t_max && triangles[c][3] != segments.skip {
                                pending &= !(1 << i);
                            }
                        }
                    }
                    continue;
                }
                for [a, b, c, number] in triangles {
                    if *number == segments.skip {
                        continue;
                    }
                    let vertices = [
                        &mesh.vertices[*a as usize],
                        &mesh.vertices[*b as usize],
                        &mesh.vertices[*c as usize],
                    ];
                    pending &= !in_lanes(
                        lanes,
                        #[inline(always)]
                        |lanes| occluded_by_triangle(simd, lanes, &o, segments, vertices),
                    );
                }
            }
            mask & !pending
        },
    )
}

/// See [`super::occluded_items`].
#[inline(always)]
pub fn items<S: Simd>(
    simd: S,
    nodes: &[Node],
    segments: &Segments,
    asked: u32,
    boxes: impl Fn(usize) -> Option<Aabb>,
    mut visit: impl FnMut(usize, u32) -> u32,
) -> u32 {
    let o = segments.o.to_array();
    walk(
        simd,
        nodes,
        segments,
        asked,
        #[inline(always)]
        |lanes, items, mask| {
            let mut occluded = 0;
            for item in items {
                let Some(bounds) = boxes(item) else { continue };
                let segments_hitting_child = in_lanes(
                    lanes,
                    #[inline(always)]
                    |lanes| passing_box(simd, lanes, &o, segments, &bounds),
                ) & mask
                    & !occluded;
                if segments_hitting_child != 0 {
                    occluded |= visit(item, segments_hitting_child);
                }
            }
            occluded
        },
    )
}

#[inline(always)]
fn bits_of(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(
        #[inline(always)]
        move || {
            let i = bits.trailing_zeros();
            bits &= bits.checked_sub(1)?;
            Some(i as usize)
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

/// Visits leaves with the segments that hit them. `visit` returns the segments that the leaf occludes. Returns all
/// occluded segments.
#[inline(always)]
fn walk<S: Simd>(
    simd: S,
    nodes: &[Node],
    segments: &Segments,
    asked: u32,
    mut visit: impl FnMut(&[Lanes<S>], Range<usize>, u32) -> u32,
) -> u32 {
    let mut pending = asked & segments.directions.all();
    if pending == 0 {
        return 0;
    }
    let asked = pending;
    let mut lanes = ArrayVec::new();
    let slopes = prepare(simd, segments, &mut lanes);
    let zero = f32x8::splat(simd, 0.0);
    let t_max = f32x8::splat(simd, segments.t_max);
    let mut stack: ArrayVec<(u32, u32), STACK> = ArrayVec::new();
    stack.push((0, pending));
    while let Some((number, mask)) = stack.pop() {
        let mask = mask & pending;
        if mask == 0 {
            continue;
        }
        let node = &nodes[number as usize];
        let scale = node.scale().to_array();
        let planes = [&node.low, &node.high];
        let mut seen = [[zero; 3]; 2];
        for k in 0..3 {
            for i in 0..2 {
                seen[i][k] = side(simd, node, planes[slopes[k].sides[i]], k, scale[k]) - slopes[k].from[i];
            }
        }
        // Segments that hit each child's box, and children that any segment hits.
        let mut children = [0u32; 8];
        let mut any = 0;
        if mask.count_ones() <= FEW {
            for i in bits_of(mask) {
                let inverse = &lanes[i / S::f32s::LEN].inverse;
                let (mut near, mut far) = (zero, t_max);
                for k in 0..3 {
                    let inverse = inverse[k][i % S::f32s::LEN];
                    let (a, b) = (seen[0][k] * inverse, seen[1][k] * inverse);
                    if slopes[k].same {
                        near = near.max(a);
                        far = far.min(b);
                    } else {
                        near = near.max(a.min(b));
                        far = far.min(a.max(b));
                    }
                }
                let passed = (near.simd_le(far) & far.simd_gt(zero)).to_bitmask() as u32;
                any |= passed;
                // Branchless, to avoid mispredictions.
                for (c, child) in children.iter_mut().enumerate() {
                    *child |= (passed >> c & 1) << i;
                }
            }
        } else {
            let (mut near, mut far) = (zero, t_max);
            for k in 0..3 {
                near = near.max(seen[0][k] * slopes[k].inverse[0]);
                let second = seen[1][k] * slopes[k].inverse[1];
                if slopes[k].same {
                    far = far.min(second);
                } else {
                    near = near.max(second);
                }
            }
            let passed = (near.simd_le(far) & far.simd_gt(zero)).to_bitmask() as u32;
            for c in bits_of(passed) {
                children[c] = mask
                    & in_lanes(
                        &lanes,
                        #[inline(always)]
                        |lanes| segments_hitting_child(simd, lanes, &slopes, &seen, c, segments.t_max),
                    );
                any |= u32::from(children[c] != 0) << c;
            }
        }
        for c in bits_of(any & u32::from(node.inner)) {
            let before = u32::from(node.inner) & ((1 << c) - 1);
            stack.push((node.first_child + before.count_ones(), children[c]));
        }
        for c in bits_of(any & !u32::from(node.inner)) {
            let mask = children[c] & pending;
            if mask != 0 {
                pending &= !visit(&lanes, node.items(c), mask);
            }
        }
    }
    asked & !pending
}

#[inline(always)]
fn line_at<S: Simd>(lanes: &[Lanes<S>], place: usize, o: &[f32; 3], pad: f32) -> Line {
    let (lanes, i) = (&lanes[place / S::f32s::LEN], place % S::f32s::LEN);
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

/// Arranges the segments in vectors and returns bounds on their directions.
#[inline(always)]
fn prepare<S: Simd>(simd: S, segments: &Segments, lanes: &mut ArrayVec<Lanes<S>, MAX_LANES>) -> [Slope; 3] {
    let one = S::f32s::splat(simd, 1.0);
    let mut bounds = [
        [S::f32s::splat(simd, f32::INFINITY); 3],
        [S::f32s::splat(simd, f32::NEG_INFINITY); 3],
    ];
    let Directions { count, along } = segments.directions;
    for i in (0..*count).step_by(S::f32s::LEN) {
        let mut d = [one; 3];
        let mut inverse = [one; 3];
        for k in 0..3 {
            d[k] = S::f32s::from_slice(simd, &along[k][i..i + S::f32s::LEN]);
            let away = away_from_zero(simd, d[k]);
            bounds[0][k] = bounds[0][k].min(away);
            bounds[1][k] = bounds[1][k].max(away);
            inverse[k] = one / away;
        }
        let [x, y, z] = d.map(|d| d.abs());
        let x_first = x.simd_ge(y) & x.simd_ge(z);
        let y_first = y.simd_ge(z) & !x_first;
        let all = (1 << S::f32s::LEN) - 1;
        let axes = match (x_first.to_bitmask(), y_first.to_bitmask()) {
            (x, _) if x == all => Some(axes_from(0)),
            (_, y) if y == all => Some(axes_from(1)),
            (0, 0) => Some(axes_from(2)),
            _ => None,
        };
        let mut new = Lanes {
            axes,
            largest: [x_first, y_first],
            shear: [one; 3],
            inverse,
        };
        let [x, y, z] = new.in_order(d);
        new.shear = [x / z, y / z, one / z];
        lanes.push(new);
    }
    let mut slopes = [Slope::default(); 3];
    for k in 0..3 {
        let (least, most) = (bounds[0][k].reduce_min(), bounds[1][k].reduce_max());
        let [low, high] = [segments.o[k] + segments.pad, segments.o[k] - segments.pad];
        let [of_least, of_most] = [1.0 / least, 1.0 / most];
        slopes[k] = match () {
            _ if least > 0.0 => Slope {
                same: true,
                sides: [0, 1],
                from: [low, high],
                inverse: [of_most, of_least],
            },
            _ if most < 0.0 => Slope {
                same: true,
                sides: [1, 0],
                from: [high, low],
                inverse: [of_least, of_most],
            },
            _ => Slope {
                same: false,
                sides: [0, 1],
                from: [low, high],
                inverse: [of_most, of_least],
            },
        };
    }
    slopes
}

/// Like [`line::away_from_zero`](super::line::away_from_zero).
#[inline(always)]
fn away_from_zero<S: Simd>(simd: S, d: S::f32s) -> S::f32s {
    let least = S::f32s::splat(simd, LEAST);
    let near = d.simd_lt(S::f32s::splat(simd, 0.0)).select(-least, least);
    d.abs().simd_ge(least).select(d, near)
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

/// Returns the mask of segments that hit an item's box, like `interval_hits` in `slab.rs`.
#[inline(always)]
fn passing_box<S: Simd>(simd: S, lanes: &Lanes<S>, o: &[f32; 3], segments: &Segments, bounds: &Aabb) -> u64 {
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
    seen: &[[f32x8<S>; 3]; 2],
    child: usize,
    t_max: f32,
) -> u64 {
    let zero = S::f32s::splat(simd, 0.0);
    let mut near = zero;
    let mut far = S::f32s::splat(simd, t_max);
    for k in 0..3 {
        let a = lanes.inverse[k] * seen[0][k][child];
        let b = lanes.inverse[k] * seen[1][k][child];
        if slopes[k].same {
            near = near.max(a);
            far = far.min(b);
        } else {
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
    }
    (near.simd_le(far) & far.simd_gt(zero)).to_bitmask()
}

/// Returns the mask of segments that a triangle occludes, like [`Line::triangle`](super::Line::triangle).
#[inline(always)]
fn occluded_by_triangle<S: Simd>(
    simd: S,
    lanes: &Lanes<S>,
    o: &[f32; 3],
    segments: &Segments,
    vertices: [&[f32; 4]; 3],
) -> u64 {
    let zero = S::f32s::splat(simd, 0.0);
    let mut seen = [[zero; 3]; 3];
    for (seen, vertex) in seen.iter_mut().zip(vertices) {
        let from_o = [vertex[0] - o[0], vertex[1] - o[1], vertex[2] - o[2]];
        let [x, y, z] = lanes.splat_in_order(simd, from_o);
        *seen = [x - lanes.shear[0] * z, y - lanes.shear[1] * z, z];
    }
    let [a, b, c] = seen;
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
        low[k] = less(less(a, b), c);
        high[k] = greater(greater(a, b), c);
    }
    let [near, far] = line_intervals(simd, lanes, o, segments.pad, low, high);
    // This order of operands preserves NaN.
    let t = near.simd_gt(t).select(near, t);
    let t = far.simd_lt(t).select(far, t);
    let hit = inside
        & determinant.simd_ne(zero)
        & near.simd_le(far)
        & t.simd_gt(zero)
        & t.simd_lt(S::f32s::splat(simd, segments.t_max));
    hit.to_bitmask()
}
