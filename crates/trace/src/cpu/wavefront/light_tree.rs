//! Selection of emitters for several paths by a light tree. All paths descend one level at a time, and two nodes are
//! evaluated in the lanes of a SIMD vector.

use arrayvec::ArrayVec;
use fearless_simd::prelude::*;
use fearless_simd::{f32x4, u32x8};
use glam::Vec4;

use super::super::integrators::path::decision_set;
use super::super::lanes::{Lanes2, Lanes3, TwoLightNodes};
use super::super::light_choice::EmitterSelection;
use super::super::light_tree::{light_child, light_importances, light_shares};
use super::super::rng::{hash4, unit_float};
use super::rows::{F, LANES, Row, Rows3, lanes_of};
use crate::records::{NO_INDEX, Packed};

/// Surface points of several paths, and the keys of their random numbers.
pub struct TreePoints<'a, S: Simd> {
    pub points: &'a Rows3,
    pub normals: &'a Rows3,
    pub key: Lanes2<u32x8<S>>,
    /// Sample numbers of the paths.
    pub sample: u32x8<S>,
}

impl<S: Simd> TreePoints<'_, S> {
    /// Selects an emitter for each lane of a mask, like `light_tree_select`.
    #[inline(always)]
    pub fn select(&self, simd: S, scene: &Packed, mask: u64, selections: &mut [EmitterSelection; LANES]) {
        let mut random: [Row; 2] = [[0.0; LANES]; 2];
        let mut nodes = [0; LANES];
        let mut probabilities = [1.0; LANES];
        let mut active: ArrayVec<usize, LANES> = lanes_of(mask).collect();
        let mut level = 0;
        while !active.is_empty() {
            let parity = level as usize & 1;
            if parity == 0 {
                random = self.random(simd, scene, level);
            }
            for pair in active.chunks(2) {
                let lanes = [pair[0], pair[pair.len() - 1]];
                let two = TwoLightNodes {
                    simd,
                    nodes: lanes.map(|lane| &scene.lighting.nodes[nodes[lane] as usize]),
                };
                let [points, normals] = [self.points, self.normals].map(|rows| two_vectors(simd, rows, lanes));
                let shares: Row = light_shares(light_importances(&two, points, normals)).into();
                for (i, &lane) in pair.iter().enumerate() {
                    // Slices are indexed without a branch, unlike the components of a `Vec4`.
                    let (node, shares) = (two.nodes[i], &shares[4 * i..4 * i + 4]);
                    let child = light_child(Vec4::from_slice(shares), random[parity][lane]) as usize;
                    probabilities[lane] *= shares[child];
                    nodes[lane] = node.children.as_ref()[child];
                    if nodes[lane] == NO_INDEX {
                        let selection = &mut selections[lane];
                        selection.emitter.instance = node.instance[child];
                        selection.emitter.index = node.index[child];
                        selection.density = node.density[child] * probabilities[lane];
                    }
                }
            }
            active.retain(|lane| nodes[*lane] != NO_INDEX);
            level += 1;
        }
    }

    /// Returns the random numbers of a level and of the next one.
    #[inline(always)]
    fn random(&self, simd: S, scene: &Packed, level: u32) -> [Row; 2] {
        let word = |value: u32| -> u32x8<S> { SimdBase::splat(simd, value) };
        let [x, y, ..] = hash4([self.key.x, self.key.y, word(level), word(1)]);
        let Lanes2 { x, y } = decision_set(scene, Lanes2 { x, y }, self.sample);
        let (x, y): (F<S>, F<S>) = (unit_float(x), unit_float(y));
        [x.into(), y.into()]
    }
}

/// Returns the vectors of two lanes, each repeated for the children of a node.
#[inline(always)]
fn two_vectors<S: Simd>(simd: S, rows: &Rows3, [first, second]: [usize; 2]) -> Lanes3<F<S>> {
    let [x, y, z] = rows
        .each_ref()
        .map(|row| f32x4::splat(simd, row[first]).combine(f32x4::splat(simd, row[second])));
    Lanes3 { x, y, z }
}
