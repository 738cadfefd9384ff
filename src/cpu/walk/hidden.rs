//! Which segments from one point are hidden: all of them walk the tree together.

use std::ops::Range;

use arrayvec::ArrayVec;
use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::closest::{STACK, side};
use super::four::Four;
use super::line::{LEAST, greater, in_order, less};
use super::{Line, Mesh, Segments};
use crate::pack::tree::Node;

/// Segments at once, at most.
const MOST: usize = 32;
/// Blocks that they make at most: each of three groups has one that is not full, and one of 4 is as small as they get.
const BLOCKS: usize = MOST / 4 + 2;

/// So many segments are tested against the boxes of a node one by one.
const FEW: u32 = 6;

/// So many segments are tested against the triangles of a leaf one by one.
const FEW_IN_LEAF: u32 = 6;

/// Segments whose directions have the largest component along the same axis, as many as a vector has places.
#[derive(Clone, Copy)]
struct Block<S: Simd> {
    /// As for a [`Line`](super::Line).
    axes: [usize; 3],
    /// As for a [`Line`](super::Line).
    shear: [S::f32s; 3],
    /// The reciprocals of the directions' x, y and z.
    inverse: [S::f32s; 3],
    /// A bit for each that there is.
    full: u64,
    /// Which they are.
    numbers: [u8; 16],
}

/// One axis of all directions, for tests that a box passes wherever one of the segments does.
#[derive(Clone, Copy, Default)]
struct Slope {
    /// Whether all go the same way.
    same: bool,
    /// If so, the nearer and the farther side of a box (0: low, 1: high); else low and high.
    sides: [usize; 2],
    /// From where these are seen.
    from: [f32; 2],
    /// The reciprocals that make the nearer side nearest and the farther farthest; or those that make either side nearest, for
    /// the segments that come from outside.
    inverse: [f32; 2],
}

/// Components of directions, one array an axis.
type Components = [[f32; MOST]; 3];

/// See [`super::hidden`].
#[inline(always)]
pub fn hidden<S: Simd>(simd: S, mesh: &Mesh, segments: &Segments, asked: u32) -> u32 {
    let width = S::f32s::LEN;
    let o = segments.o.to_array();
    walk(
        simd,
        mesh.nodes,
        segments,
        asked,
        #[inline(always)]
        |blocks, items, mask| {
            let mut waiting = mask;
            for triangles in mesh.triangles[items].chunks(4) {
                if waiting.count_ones() <= FEW_IN_LEAF {
                    let four = Four::new(simd, mesh, triangles);
                    let mut each = waiting;
                    while each != 0 {
                        let i = each.trailing_zeros() as usize;
                        each &= each - 1;
                        let (block, place) = (&blocks[i / width], i % width);
                        let (mut met, t) = four.met_by(simd, &block.line(place, &o, segments.pad));
                        while met != 0 {
                            let c = met.trailing_zeros() as usize;
                            met &= met - 1;
                            if t[c] > 0.0 && t[c] < segments.reach && triangles[c][3] != segments.skip {
                                waiting &= !(1 << i);
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
                    for (i, block) in blocks.iter().enumerate() {
                        if waiting >> (i * width) & block.full != 0 {
                            waiting &= !(triangle_hides(simd, block, &o, segments, vertices) << (i * width));
                        }
                    }
                }
            }
            mask & !waiting
        },
    )
}

/// See [`super::hidden_leaves`].
#[inline(always)]
pub fn leaves<S: Simd>(
    simd: S,
    nodes: &[Node],
    segments: &Segments,
    asked: u32,
    mut visit: impl FnMut(Range<usize>, u32) -> u32,
) -> u32 {
    let width = S::f32s::LEN;
    walk(
        simd,
        nodes,
        segments,
        asked,
        #[inline(always)]
        |blocks, items, mask| {
            let hidden = visit(items, numbers_of(blocks, width, mask));
            let mut places = mask;
            let mut each = mask;
            while each != 0 {
                let i = each.trailing_zeros() as usize;
                each &= each - 1;
                if hidden >> blocks[i / width].numbers[i % width] & 1 == 0 {
                    places &= !(1 << i);
                }
            }
            places
        },
    )
}

/// The segments at these places of the blocks, a bit for each.
#[inline(always)]
fn numbers_of<S: Simd>(blocks: &[Block<S>], width: usize, mut places: u64) -> u32 {
    let mut numbers = 0;
    while places != 0 {
        let i = places.trailing_zeros() as usize;
        places &= places - 1;
        numbers |= 1 << blocks[i / width].numbers[i % width];
    }
    numbers
}

/// Visits leaves with the segments that pass their boxes, as bits for places of the blocks, each of which has as many as a
/// vector; is told which of them are hidden; and says which segments are.
#[inline(always)]
fn walk<S: Simd>(
    simd: S,
    nodes: &[Node],
    segments: &Segments,
    asked: u32,
    mut visit: impl FnMut(&[Block<S>], Range<usize>, u64) -> u64,
) -> u32 {
    let width = S::f32s::LEN;
    let mut blocks = ArrayVec::new();
    let slopes = prepare(simd, segments, asked, &mut blocks);
    let mut all = 0u64;
    for (i, block) in blocks.iter().enumerate() {
        all |= block.full << (i * width);
    }
    let mut waiting = all;
    let zero = f32x8::splat(simd, 0.0);
    let reach = f32x8::splat(simd, segments.reach);
    let mut stack: ArrayVec<(u32, u64), STACK> = ArrayVec::new();
    stack.push((0, waiting));
    while let Some((number, mask)) = stack.pop() {
        let mut mask = mask & waiting;
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
        // For each child those that pass its box; the children that any passes.
        let mut children = [0u64; 8];
        let mut any = 0;
        if mask.count_ones() <= FEW {
            while mask != 0 {
                let i = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let inverse = &blocks[i / width].inverse;
                let (mut near, mut far) = (zero, reach);
                for k in 0..3 {
                    let inverse = inverse[k][i % width];
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
                // No branches, as they would be guessed wrong.
                for (c, child) in children.iter_mut().enumerate() {
                    *child |= u64::from(passed >> c & 1) << i;
                }
            }
        } else {
            let (mut near, mut far) = (zero, reach);
            for k in 0..3 {
                near = near.max(seen[0][k] * slopes[k].inverse[0]);
                let second = seen[1][k] * slopes[k].inverse[1];
                if slopes[k].same {
                    far = far.min(second);
                } else {
                    near = near.max(second);
                }
            }
            let mut passed = (near.simd_le(far) & far.simd_gt(zero)).to_bitmask() as u32;
            while passed != 0 {
                let c = passed.trailing_zeros() as usize;
                passed &= passed - 1;
                for (i, block) in blocks.iter().enumerate() {
                    children[c] |= passing(simd, block, &slopes, &seen, c, segments.reach) << (i * width);
                }
                children[c] &= mask;
                any |= u32::from(children[c] != 0) << c;
            }
        }
        let mut inner = any & u32::from(node.inner);
        while inner != 0 {
            let c = inner.trailing_zeros();
            inner &= inner - 1;
            let before = u32::from(node.inner) & ((1 << c) - 1);
            stack.push((node.first_child + before.count_ones(), children[c as usize]));
        }
        let mut leaves = any & !u32::from(node.inner);
        while leaves != 0 {
            let c = leaves.trailing_zeros() as usize;
            leaves &= leaves - 1;
            let mask = children[c] & waiting;
            if mask != 0 {
                waiting &= !visit(&blocks, node.items(c), mask);
            }
        }
    }
    numbers_of(&blocks, width, all & !waiting)
}

impl<S: Simd> Block<S> {
    /// The segment at a place.
    #[inline(always)]
    fn line(&self, place: usize, o: &[f32; 3], pad: f32) -> Line {
        let o = in_order(o, self.axes);
        let [x, y, z] = self.axes;
        Line {
            axes: self.axes,
            o,
            o_low: [o[0] + pad, o[1] + pad, o[2] + pad],
            o_high: [o[0] - pad, o[1] - pad, o[2] - pad],
            inverse: [self.inverse[x][place], self.inverse[y][place], self.inverse[z][place]],
            shear: [self.shear[0][place], self.shear[1][place], self.shear[2][place]],
        }
    }
}

/// Makes blocks of the segments that are asked for.
#[inline(always)]
fn prepare<S: Simd>(simd: S, segments: &Segments, asked: u32, blocks: &mut ArrayVec<Block<S>, BLOCKS>) -> [Slope; 3] {
    let width = S::f32s::LEN;
    let mut all: Components = [[1.0; MOST]; 3];
    let mut numbers = [0; MOST];
    let mut count = 0;
    for (i, d) in segments.directions.iter().enumerate().take(MOST) {
        if asked >> i & 1 == 1 {
            [all[0][count], all[1][count], all[2][count]] = d.to_array();
            numbers[count] = i as u8;
            count += 1;
        }
    }
    // The places that are left of the last vector.
    for i in count..count.next_multiple_of(width) {
        for axis in &mut all {
            axis[i] = axis[0];
        }
    }
    let mut bounds = [
        [S::f32s::splat(simd, f32::INFINITY); 3],
        [S::f32s::splat(simd, f32::NEG_INFINITY); 3],
    ];
    let mut thirds = [0u32; 3];
    for i in (0..count).step_by(width) {
        let mut size = [S::f32s::splat(simd, 0.0); 3];
        for k in 0..3 {
            let d = S::f32s::from_slice(simd, &all[k][i..i + width]);
            size[k] = d.abs();
            let away = away_from_zero(simd, d);
            bounds[0][k] = bounds[0][k].min(away);
            bounds[1][k] = bounds[1][k].max(away);
        }
        let [x, y, z] = size;
        let x_first = (x.simd_ge(y) & x.simd_ge(z)).to_bitmask() as u32;
        let y_first = y.simd_ge(z).to_bitmask() as u32 & !x_first;
        thirds[0] |= x_first << i;
        thirds[1] |= y_first << i;
    }
    let these = if count == MOST { !0 } else { (1 << count) - 1 };
    thirds = [thirds[0] & these, thirds[1] & these, these & !(thirds[0] | thirds[1])];
    for (third, mut bits) in thirds.into_iter().enumerate() {
        let axes = [(third + 1) % 3, (third + 2) % 3, third];
        if bits == 0 {
            continue;
        }
        if bits == these {
            add_blocks(simd, axes, &all, &numbers, count, blocks);
            break;
        }
        let mut group: Components = [[1.0; MOST]; 3];
        let mut group_numbers = [0; MOST];
        let mut group_count = 0;
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            for k in 0..3 {
                group[k][group_count] = all[k][i];
            }
            group_numbers[group_count] = numbers[i];
            group_count += 1;
        }
        add_blocks(simd, axes, &group, &group_numbers, group_count, blocks);
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

/// See [`line::away_from_zero`](super::line::away_from_zero).
#[inline(always)]
fn away_from_zero<S: Simd>(simd: S, d: S::f32s) -> S::f32s {
    let least = S::f32s::splat(simd, LEAST);
    let near = d.simd_lt(S::f32s::splat(simd, 0.0)).select(-least, least);
    d.abs().simd_ge(least).select(d, near)
}

/// Adds blocks of segments whose directions have the largest component along the third of the axes.
#[inline(always)]
fn add_blocks<S: Simd>(
    simd: S,
    axes: [usize; 3],
    directions: &Components,
    numbers: &[u8; MOST],
    count: usize,
    blocks: &mut ArrayVec<Block<S>, BLOCKS>,
) {
    let width = S::f32s::LEN;
    let one = S::f32s::splat(simd, 1.0);
    for first in (0..count).step_by(width) {
        let here = width.min(count - first);
        let mut d = [one; 3];
        let mut inverse = [one; 3];
        for k in 0..3 {
            d[k] = S::f32s::from_slice(simd, &directions[k][first..first + width]);
            inverse[k] = one / away_from_zero(simd, d[k]);
        }
        let [x, y, z] = [d[axes[0]], d[axes[1]], d[axes[2]]];
        let mut block = Block {
            axes,
            shear: [x / z, y / z, one / z],
            inverse,
            full: (1 << here) - 1,
            numbers: [0; 16],
        };
        block.numbers[..here].copy_from_slice(&numbers[first..first + here]);
        blocks.push(block);
    }
}

/// Which of the segments of a block that are not hidden pass a child's box.
#[inline(always)]
fn passing<S: Simd>(
    simd: S,
    block: &Block<S>,
    slopes: &[Slope; 3],
    seen: &[[f32x8<S>; 3]; 2],
    child: usize,
    reach: f32,
) -> u64 {
    let zero = S::f32s::splat(simd, 0.0);
    let mut near = zero;
    let mut far = S::f32s::splat(simd, reach);
    for k in 0..3 {
        let a = block.inverse[k] * seen[0][k][child];
        let b = block.inverse[k] * seen[1][k][child];
        if slopes[k].same {
            near = near.max(a);
            far = far.min(b);
        } else {
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
    }
    (near.simd_le(far) & far.simd_gt(zero)).to_bitmask() & block.full
}

/// Which of the segments of a block a triangle hides: [`Line::triangle`](super::Line::triangle) for each.
#[inline(always)]
fn triangle_hides<S: Simd>(
    simd: S,
    block: &Block<S>,
    o: &[f32; 3],
    segments: &Segments,
    vertices: [&[f32; 4]; 3],
) -> u64 {
    let o = in_order(o, block.axes);
    let zero = S::f32s::splat(simd, 0.0);
    let mut corners = [[0.0; 3]; 3];
    let mut seen = [[zero; 2]; 3];
    for i in 0..3 {
        corners[i] = in_order(vertices[i], block.axes);
        let [x, y, z] = [corners[i][0] - o[0], corners[i][1] - o[1], corners[i][2] - o[2]];
        seen[i] = [
            S::f32s::splat(simd, x) - block.shear[0] * z,
            S::f32s::splat(simd, y) - block.shear[1] * z,
        ];
    }
    let [a, b, c] = seen;
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let inside =
        (u.simd_ge(zero) & v.simd_ge(zero) & w.simd_ge(zero)) | (u.simd_le(zero) & v.simd_le(zero) & w.simd_le(zero));
    if inside.to_bitmask() & block.full == 0 {
        return 0;
    }
    let determinant = u + v + w;
    let mut z = [zero; 3];
    for i in 0..3 {
        z[i] = block.shear[2] * (corners[i][2] - o[2]);
    }
    let t = (u * z[0] + v * z[1] + w * z[2]) / determinant;
    let mut near = S::f32s::splat(simd, f32::NEG_INFINITY);
    let mut far = S::f32s::splat(simd, f32::INFINITY);
    for k in 0..3 {
        let low = less(less(corners[0][k], corners[1][k]), corners[2][k]);
        let high = greater(greater(corners[0][k], corners[1][k]), corners[2][k]);
        let inverse = block.inverse[block.axes[k]];
        let a = inverse * (low - (o[k] + segments.pad));
        let b = inverse * (high - (o[k] - segments.pad));
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    // Selected in this way, NaN stays NaN.
    let t = near.simd_gt(t).select(near, t);
    let t = far.simd_lt(t).select(far, t);
    let hit = inside
        & determinant.simd_ne(zero)
        & near.simd_le(far)
        & t.simd_gt(zero)
        & t.simd_lt(S::f32s::splat(simd, segments.reach));
    hit.to_bitmask() & block.full
}
