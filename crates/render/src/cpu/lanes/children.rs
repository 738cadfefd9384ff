//! Numbers of the children of light-tree nodes, for functions that evaluate a single node or two nodes in SIMD lanes.

use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f32x4, f32x8, mask32x8, u32x4};
use glam::{BVec4A, Vec3, Vec4};

use super::{Lanes3, Real};
use crate::records::LightNode;

/// A number for each of the four children of a node, or for each child of two nodes.
pub trait Children:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f32, Output = Self>
    + Sub<f32, Output = Self>
    + Mul<f32, Output = Self>
{
    /// The result of a comparison.
    type Mask: Copy + BitAnd<Output = Self::Mask>;

    /// Returns `value` for all children. The value of `self` is not used.
    fn splat(self, value: f32) -> Self;
    /// Returns 1 for the first child of a node, and 0 for the others. The value of `self` is not used.
    fn first(self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    fn eq(self, other: Self) -> Self::Mask;
    /// Returns `if_true` where the mask is set, else `if_false`.
    fn select(if_false: Self, if_true: Self, mask: Self::Mask) -> Self;
    /// Returns the sum of each node's numbers, (first + second) + (third + fourth), for all of its children.
    fn sum(self) -> Self;
}

/// One or two nodes of a light tree.
pub trait LightNodes {
    /// A number for each child.
    type Vec4: Children;
    /// A vector for each node.
    type Vec3: Copy;

    /// Returns a field of the nodes.
    fn get(&self, field: impl Fn(&LightNode) -> Vec4) -> Self::Vec4;
    /// Returns the mask of the children with two sides.
    fn is_two_sided(&self) -> <Self::Vec4 as Children>::Mask;
    /// Returns the components of the vector of each child's node.
    fn components(v: Self::Vec3) -> [Self::Vec4; 3];
}

impl Children for Vec4 {
    type Mask = BVec4A;

    #[inline(always)]
    fn splat(self, value: f32) -> Vec4 {
        Vec4::splat(value)
    }

    #[inline(always)]
    fn first(self) -> Vec4 {
        Vec4::X
    }

    #[inline(always)]
    fn abs(self) -> Vec4 {
        Vec4::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Vec4 {
        Vec4::sqrt(self)
    }

    #[inline(always)]
    fn lt(self, other: Vec4) -> BVec4A {
        self.cmplt(other)
    }

    #[inline(always)]
    fn le(self, other: Vec4) -> BVec4A {
        self.cmple(other)
    }

    #[inline(always)]
    fn eq(self, other: Vec4) -> BVec4A {
        self.cmpeq(other)
    }

    #[inline(always)]
    fn select(if_false: Vec4, if_true: Vec4, mask: BVec4A) -> Vec4 {
        Vec4::select(mask, if_true, if_false)
    }

    #[inline(always)]
    fn sum(self) -> Vec4 {
        Vec4::splat((self.x + self.y) + (self.z + self.w))
    }
}

impl LightNodes for LightNode {
    type Vec4 = Vec4;
    type Vec3 = Vec3;

    #[inline(always)]
    fn get(&self, field: impl Fn(&LightNode) -> Vec4) -> Vec4 {
        field(self)
    }

    #[inline(always)]
    fn is_two_sided(&self) -> BVec4A {
        BVec4A::from(self.sides.to_array().map(|sides| sides == 2))
    }

    #[inline(always)]
    fn components(v: Vec3) -> [Vec4; 3] {
        v.to_array().map(Vec4::splat)
    }
}

impl<S: Simd> Children for f32x8<S> {
    type Mask = mask32x8<S>;

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        Real::splat(self, value)
    }

    #[inline(always)]
    fn first(self) -> Self {
        f32x8::simd_from(self.simd, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Real::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Real::sqrt(self)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> mask32x8<S> {
        Real::lt(self, other)
    }

    #[inline(always)]
    fn le(self, other: Self) -> mask32x8<S> {
        Real::le(self, other)
    }

    #[inline(always)]
    fn eq(self, other: Self) -> mask32x8<S> {
        Real::eq(self, other)
    }

    #[inline(always)]
    fn select(if_false: Self, if_true: Self, mask: mask32x8<S>) -> Self {
        Real::select(if_false, if_true, mask)
    }

    #[inline(always)]
    fn sum(self) -> Self {
        let (first, second) = self.split();
        let sum = |v: f32x4<S>| {
            let pairs = v.unzip_low(v) + v.unzip_high(v);
            pairs.unzip_low(pairs) + pairs.unzip_high(pairs)
        };
        sum(first).combine(sum(second))
    }
}

/// Two nodes of a light tree.
pub struct TwoLightNodes<'a, S> {
    pub simd: S,
    pub nodes: [&'a LightNode; 2],
}

impl<S: Simd> LightNodes for TwoLightNodes<'_, S> {
    type Vec4 = f32x8<S>;
    type Vec3 = Lanes3<f32x8<S>>;

    #[inline(always)]
    fn get(&self, field: impl Fn(&LightNode) -> Vec4) -> f32x8<S> {
        let [first, second] = self
            .nodes
            .map(|node| f32x4::simd_from(self.simd, field(node).to_array()));
        first.combine(second)
    }

    #[inline(always)]
    fn is_two_sided(&self) -> mask32x8<S> {
        let [first, second] = self
            .nodes
            .map(|node| u32x4::simd_from(self.simd, node.sides.to_array()));
        first.combine(second).simd_eq(2)
    }

    #[inline(always)]
    fn components(v: Lanes3<f32x8<S>>) -> [f32x8<S>; 3] {
        [v.x, v.y, v.z]
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use glam::UVec4;

    use super::*;
    use crate::cpu::light_tree::{light_importances, light_shares};
    use crate::cpu::traversal::levels;

    struct Random(u64);

    impl Random {
        fn bits(&mut self) -> u32 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 32) as u32
        }

        /// Returns a number from -1 to 1. A quarter of the numbers are -1, 0 or 1.
        fn number(&mut self) -> f32 {
            let number = self.bits() as f32 / (1u32 << 31) as f32 - 1.0;
            if self.bits().is_multiple_of(4) {
                number.round()
            } else {
                number
            }
        }

        fn vec4(&mut self) -> Vec4 {
            Vec4::from_array([(); 4].map(|()| self.number()))
        }

        fn vec3(&mut self) -> Vec3 {
            self.vec4().truncate()
        }

        fn node(&mut self) -> LightNode {
            LightNode {
                x: self.vec4(),
                y: self.vec4(),
                z: self.vec4(),
                radius: self.vec4().abs(),
                axis_x: self.vec4(),
                axis_y: self.vec4(),
                axis_z: self.vec4(),
                cosine: self.vec4(),
                intensity: self.vec4().max(Vec4::ZERO),
                edge: self.vec4(),
                sides: UVec4::from_array([(); 4].map(|()| 1 + self.bits() % 2)),
                ..bytemuck::Zeroable::zeroed()
            }
        }
    }

    #[test]
    fn two_nodes_have_the_bits_of_single_nodes() {
        let random = &mut Random(1);
        let (mut positive, mut without_light, mut differing) = (0, 0, 0);
        for _ in 0..4000 {
            let nodes = [random.node(), random.node()];
            let points = [random.vec3(), random.vec3()];
            let normals = [
                random.vec3(),
                if random.bits().is_multiple_of(4) {
                    Vec3::ZERO
                } else {
                    random.vec3()
                },
            ];
            let single = [0, 1].map(|i| {
                let importances = light_importances(&nodes[i], points[i], normals[i]);
                (importances, light_shares(importances))
            });
            let bits = |values: [f32; 8]| values.map(f32::to_bits);
            let both = |values: [Vec4; 2]| -> [f32; 8] { std::array::from_fn(|i| values[i / 4].to_array()[i % 4]) };
            let importances = both(single.map(|(importances, _)| importances));
            let shares = both(single.map(|(_, shares)| shares));
            for level in levels() {
                let found: [[f32; 8]; 2] = dispatch!(level, simd => {
                    let rows = |vectors: [Vec3; 2]| {
                        let row = |axis: usize| {
                            f32x8::simd_from(simd, std::array::from_fn(|i| vectors[i / 4].to_array()[axis]))
                        };
                        Lanes3 { x: row(0), y: row(1), z: row(2) }
                    };
                    let two = TwoLightNodes { simd, nodes: [&nodes[0], &nodes[1]] };
                    let importances = light_importances(&two, rows(points), rows(normals));
                    [importances.into(), light_shares(importances).into()]
                });
                assert_eq!(bits(found[0]), bits(importances), "{level:?}");
                assert_eq!(bits(found[1]), bits(shares), "{level:?}");
            }
            positive += importances.iter().filter(|x| **x > 0.0).count();
            without_light += importances
                .chunks(4)
                .filter(|node| node.iter().all(|x| *x == 0.0))
                .count();
            differing += usize::from(importances[..4] != importances[4..]);
        }
        assert!(
            positive > 5000 && without_light > 200 && differing > 3000,
            "{positive} positive importances, {without_light} nodes without light, {differing} pairs that differ"
        );
    }
}
