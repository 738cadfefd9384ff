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
