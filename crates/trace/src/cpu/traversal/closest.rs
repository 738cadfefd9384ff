//! Traversal of a BVH by a single ray, for the closest hit, any hit, or the leaves approximately from front to back.

use arrayvec::ArrayVec;
use fearless_simd::f32x8;
use fearless_simd::prelude::*;

use super::super::bits::bits_of;
use super::box_ray::BoxRay;
use super::line::maximum;
use super::node::{TriangleBvh, Triangles, WideNode};
use super::{Line, Nearest, remaining_t_max};
use crate::bvh::BUILD_MAX_DEPTH;

/// Maximum number of nodes on the stack: each level pops one node and pushes up to 8.
pub const STACK: usize = BUILD_MAX_DEPTH as usize * 7 + 1;

/// See [`super::closest`].
#[inline(always)]
pub fn closest<S: Simd>(
    simd: S,
    mesh: &impl TriangleBvh,
    line: &Line,
    start: f32,
    skip: u32,
    mut best: Nearest,
) -> Nearest {
    leaves(
        simd,
        mesh.nodes(),
        line,
        remaining_t_max(start, best.t),
        #[inline(always)]
        |leaf, _| {
            for_each_hit(
                simd,
                mesh.triangles(leaf),
                line,
                #[inline(always)]
                |t, triangle, slot| {
                    let t = start + maximum(t, 0.0);
                    let nearer = t < best.t || (t == best.t && triangle < best.triangle);
                    if nearer && t > 0.0 && triangle != skip {
                        best = Nearest { t, triangle, slot };
                    }
                },
            );
            remaining_t_max(start, best.t)
        },
    );
    best
}

/// See [`super::any`].
#[inline(always)]
pub fn any<S: Simd>(simd: S, mesh: &impl TriangleBvh, line: &Line, skip: u32, t_max: f32) -> bool {
    let mut found = false;
    leaves(
        simd,
        mesh.nodes(),
        line,
        t_max,
        #[inline(always)]
        |leaf, limit| {
            for_each_hit(
                simd,
                mesh.triangles(leaf),
                line,
                #[inline(always)]
                |t, triangle, _| found |= t > 0.0 && t < t_max && triangle != skip,
            );
            if found { f32::NEG_INFINITY } else { limit }
        },
    );
    found
}

/// Calls `visit` with the distance, the index and the slot of each triangle of a leaf that the line intersects.
#[inline(always)]
fn for_each_hit<S: Simd>(
    simd: S,
    triangles: Option<impl Triangles>,
    line: &Line,
    mut visit: impl FnMut(f32, u32, u32),
) {
    let Some(triangles) = triangles else { return };
    let (hits, t) = triangles.intersect(simd, line);
    for i in bits_of(hits) {
        visit(t[i], triangles.index(i), triangles.slot(i));
    }
}

/// See [`super::leaves`].
#[inline(always)]
pub fn leaves<S: Simd, N: WideNode>(
    simd: S,
    nodes: &[N],
    line: &Line,
    mut limit: f32,
    mut visit: impl FnMut(N::Leaf, f32) -> f32,
) {
    let BoxRay {
        near_side_index,
        origins,
        inverse,
    } = BoxRay::of(line);
    // Distances and indices of nodes. The children of a node are sorted, with the nearest on top.
    let mut stack: ArrayVec<(f32, u32), STACK> = ArrayVec::new();
    stack.push((f32::NEG_INFINITY, 0));
    while let Some((node_distance, node_index)) = stack.pop() {
        if node_distance > limit {
            continue;
        }
        let node = &nodes[node_index as usize];
        let mut near = f32x8::splat(simd, f32::NEG_INFINITY);
        let mut far = f32x8::splat(simd, limit);
        for k in 0..3 {
            near = near.max((node.planes(simd, near_side_index[k], k) - origins[0][k]) * inverse[k]);
            far = far.min((node.planes(simd, 1 - near_side_index[k], k) - origins[1][k]) * inverse[k]);
        }
        let hits = (near.simd_le(far) & far.simd_ge(f32x8::splat(simd, 0.0))).to_bitmask() as u32;
        let inner = node.inner();
        for slot in bits_of(hits & !inner) {
            limit = visit(node.leaf(slot), limit);
        }
        let first = stack.len();
        for slot in bits_of(hits & inner) {
            let child = (near[slot], node.node(slot));
            let mut i = stack.len();
            stack.push(child);
            while i > first && stack[i - 1].0 < child.0 {
                stack[i] = stack[i - 1];
                i -= 1;
            }
            stack[i] = child;
        }
    }
}
