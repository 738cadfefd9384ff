//! Types of numbers and vectors for functions that trace either a single path or several paths in SIMD lanes: a
//! [`Real`] is an `f32`, or a vector with an `f32` in each lane. Functions that are generic over these types select
//! values instead of branching, like the WGSL functions. The result in a lane has the same bits as the `f32` result.

mod children;
mod materials;
mod surfaces;
mod vectors;

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Shl, Shr, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, i32x8, mask32x8, u32x8};
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

pub use self::children::{Children, LightNodes, TwoLightNodes};
pub use self::materials::{LaneMaterials, MaterialFields, MaterialRows};
pub use self::surfaces::SurfaceVectors;
pub use self::vectors::{Lanes2, Lanes3};

/// A floating-point number.
pub trait Real:
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
    /// The result of a comparison: a `bool`, or one in each lane.
    type Mask: Condition;
    type Word: Word<Real = Self>;
    type Vec2: Vector2<Real = Self>;
    type Vec3: Vector3<Real = Self>;
    type Vec4: Vector4<Real = Self>;

    /// Returns `value` in all lanes. The value of `self` is not used.
    fn splat(self, value: f32) -> Self;

    /// Returns the vector `value` in all lanes. The value of `self` is not used.
    #[inline(always)]
    fn broadcast(self, value: Vec3) -> Self::Vec3 {
        Vector3::new(self.splat(value.x), self.splat(value.y), self.splat(value.z))
    }

    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn le(self, other: Self) -> Self::Mask;
    fn eq(self, other: Self) -> Self::Mask;
    fn select(if_false: Self, if_true: Self, mask: Self::Mask) -> Self;
    /// Calls `function` for the number of each lane.
    fn map(self, function: impl FnMut(f32) -> f32) -> Self;
    /// Rounds toward 0. The absolute value must be less than 2³¹. The result is never -0.
    fn truncate(self) -> Self;
    /// Returns the integer part of a number from 0 to less than 2³¹.
    fn to_word(self) -> Self::Word;

    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }

    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
}

/// The result of a comparison.
pub trait Condition:
    Copy + BitAnd<Output = Self> + BitOr<Output = Self> + BitXor<Output = Self> + Not<Output = Self>
{
    /// Returns true if the condition is true in any lane. Functions use it only to skip values that no lane selects.
    fn any(self) -> bool;
}

/// A constant as the left operand of an operator. Rust does not allow operators of `f32` and any [`Real`].
#[derive(Clone, Copy, Debug)]
pub struct Constant(f32);

/// Returns a constant for the left side of an operator, as in `constant(1.0) - x`.
#[inline(always)]
pub fn constant(value: f32) -> Constant {
    Constant(value)
}

/// Returns `if_true` where the mask is set, else `if_false`, like `select` of WGSL.
#[inline(always)]
pub fn select<F: Real>(if_false: F, if_true: F, mask: F::Mask) -> F {
    F::select(if_false, if_true, mask)
}

macro_rules! constant_operators {
    ($($operator:ident $function:ident;)*) => {
        $(impl<F: Real> $operator<F> for Constant {
            type Output = F;

            #[inline(always)]
            fn $function(self, other: F) -> F {
                $operator::$function(other.splat(self.0), other)
            }
        })*
    };
}

constant_operators! { Add add; Sub sub; Mul mul; Div div; }

/// An unsigned 32-bit integer, or one in each lane. Sums and products wrap, as in WGSL.
pub trait Word:
    Copy
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + BitAnd<u32, Output = Self>
    + Shl<u32, Output = Self>
    + Shr<u32, Output = Self>
{
    type Real: Real<Word = Self>;
    type UVec2: WordVector2<Word = Self>;
    type UVec4: WordVector4<Word = Self>;

    /// Returns `value` in all lanes. The value of `self` is not used.
    fn splat(self, value: u32) -> Self;
    fn wrapping_add(self, other: Self) -> Self;
    fn wrapping_sub(self, other: Self) -> Self;
    fn wrapping_mul(self, other: Self) -> Self;
    fn reverse_bits(self) -> Self;
    /// Returns the nearest floating-point number. Values must be less than 2³¹.
    fn to_real(self) -> Self::Real;
    fn select(if_false: Self, if_true: Self, mask: <Self::Real as Real>::Mask) -> Self;
}

/// A vector of two floating-point numbers.
pub trait Vector2: Copy + Mul<Self::Real, Output = Self> {
    type Real: Real<Vec2 = Self>;

    fn new(x: Self::Real, y: Self::Real) -> Self;
    fn x(self) -> Self::Real;
    fn y(self) -> Self::Real;

    /// Returns `if_true` where the mask is set, else `if_false`.
    #[inline(always)]
    fn select(if_false: Self, if_true: Self, mask: <Self::Real as Real>::Mask) -> Self {
        Self::new(
            select(if_false.x(), if_true.x(), mask),
            select(if_false.y(), if_true.y(), mask),
        )
    }
}

/// A vector of three floating-point numbers.
pub trait Vector3:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Add<Self::Real, Output = Self>
    + Sub<Self::Real, Output = Self>
    + Mul<Self::Real, Output = Self>
    + Div<Self::Real, Output = Self>
{
    type Real: Real<Vec3 = Self>;

    fn new(x: Self::Real, y: Self::Real, z: Self::Real) -> Self;
    fn x(self) -> Self::Real;
    fn y(self) -> Self::Real;
    fn z(self) -> Self::Real;

    /// Returns `value` in all lanes. The value of `self` is not used.
    #[inline(always)]
    fn broadcast(self, value: Vec3) -> Self {
        let x = self.x();
        Self::new(x.splat(value.x), x.splat(value.y), x.splat(value.z))
    }

    /// Returns a vector with equal components.
    #[inline(always)]
    fn repeat(value: Self::Real) -> Self {
        Self::new(value, value, value)
    }

    /// Returns `if_true` where the mask is set, else `if_false`.
    #[inline(always)]
    fn select(if_false: Self, if_true: Self, mask: <Self::Real as Real>::Mask) -> Self {
        Self::new(
            select(if_false.x(), if_true.x(), mask),
            select(if_false.y(), if_true.y(), mask),
            select(if_false.z(), if_true.z(), mask),
        )
    }
}

/// A vector of four floating-point numbers.
pub trait Vector4: Copy {
    type Real: Real<Vec4 = Self>;

    fn new(x: Self::Real, y: Self::Real, z: Self::Real, w: Self::Real) -> Self;
    fn x(self) -> Self::Real;
    fn y(self) -> Self::Real;
    fn z(self) -> Self::Real;
    fn w(self) -> Self::Real;
}

/// A vector of two integers.
pub trait WordVector2: Copy {
    type Word: Word<UVec2 = Self>;

    fn new(x: Self::Word, y: Self::Word) -> Self;
    fn x(self) -> Self::Word;
    fn y(self) -> Self::Word;
}

/// A vector of four integers.
pub trait WordVector4: Copy {
    type Word: Word;

    fn from_words(words: [Self::Word; 4]) -> Self;
    fn words(self) -> [Self::Word; 4];
}

impl Real for f32 {
    type Mask = bool;
    type Word = u32;
    type Vec2 = Vec2;
    type Vec3 = Vec3;
    type Vec4 = Vec4;

    #[inline(always)]
    fn splat(self, value: f32) -> f32 {
        value
    }

    #[inline(always)]
    fn abs(self) -> f32 {
        f32::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> f32 {
        f32::sqrt(self)
    }

    #[inline(always)]
    fn lt(self, other: f32) -> bool {
        self < other
    }

    #[inline(always)]
    fn le(self, other: f32) -> bool {
        self <= other
    }

    #[inline(always)]
    fn eq(self, other: f32) -> bool {
        self == other
    }

    #[inline(always)]
    fn select(if_false: f32, if_true: f32, mask: bool) -> f32 {
        if mask { if_true } else { if_false }
    }

    #[inline(always)]
    fn map(self, mut function: impl FnMut(f32) -> f32) -> f32 {
        function(self)
    }

    #[inline(always)]
    fn truncate(self) -> f32 {
        self as i32 as f32
    }

    #[inline(always)]
    fn to_word(self) -> u32 {
        self as u32
    }
}

impl Condition for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

impl Word for u32 {
    type Real = f32;
    type UVec2 = UVec2;
    type UVec4 = UVec4;

    #[inline(always)]
    fn splat(self, value: u32) -> u32 {
        value
    }

    #[inline(always)]
    fn wrapping_add(self, other: u32) -> u32 {
        u32::wrapping_add(self, other)
    }

    #[inline(always)]
    fn wrapping_sub(self, other: u32) -> u32 {
        u32::wrapping_sub(self, other)
    }

    #[inline(always)]
    fn wrapping_mul(self, other: u32) -> u32 {
        u32::wrapping_mul(self, other)
    }

    #[inline(always)]
    fn reverse_bits(self) -> u32 {
        u32::reverse_bits(self)
    }

    #[inline(always)]
    fn to_real(self) -> f32 {
        self as f32
    }

    #[inline(always)]
    fn select(if_false: u32, if_true: u32, mask: bool) -> u32 {
        if mask { if_true } else { if_false }
    }
}

impl Vector2 for Vec2 {
    type Real = f32;

    #[inline(always)]
    fn new(x: f32, y: f32) -> Vec2 {
        Vec2::new(x, y)
    }

    #[inline(always)]
    fn x(self) -> f32 {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f32 {
        self.y
    }
}

impl Vector3 for Vec3 {
    type Real = f32;

    #[inline(always)]
    fn new(x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::new(x, y, z)
    }

    #[inline(always)]
    fn x(self) -> f32 {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f32 {
        self.y
    }

    #[inline(always)]
    fn z(self) -> f32 {
        self.z
    }
}

impl Vector4 for Vec4 {
    type Real = f32;

    #[inline(always)]
    fn new(x: f32, y: f32, z: f32, w: f32) -> Vec4 {
        Vec4::new(x, y, z, w)
    }

    #[inline(always)]
    fn x(self) -> f32 {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f32 {
        self.y
    }

    #[inline(always)]
    fn z(self) -> f32 {
        self.z
    }

    #[inline(always)]
    fn w(self) -> f32 {
        self.w
    }
}

impl WordVector2 for UVec2 {
    type Word = u32;

    #[inline(always)]
    fn new(x: u32, y: u32) -> UVec2 {
        UVec2::new(x, y)
    }

    #[inline(always)]
    fn x(self) -> u32 {
        self.x
    }

    #[inline(always)]
    fn y(self) -> u32 {
        self.y
    }
}

impl WordVector4 for UVec4 {
    type Word = u32;

    #[inline(always)]
    fn from_words(words: [u32; 4]) -> UVec4 {
        UVec4::from_array(words)
    }

    #[inline(always)]
    fn words(self) -> [u32; 4] {
        self.to_array()
    }
}

impl<S: Simd> Real for f32x8<S> {
    type Mask = mask32x8<S>;
    type Word = u32x8<S>;
    type Vec2 = Lanes2<Self>;
    type Vec3 = Lanes3<Self>;
    type Vec4 = [Self; 4];

    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        SimdBase::splat(self.simd, value)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        SimdBase::abs(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        SimdFloat::sqrt(self)
    }

    #[inline(always)]
    fn lt(self, other: Self) -> mask32x8<S> {
        self.simd_lt(other)
    }

    #[inline(always)]
    fn le(self, other: Self) -> mask32x8<S> {
        self.simd_le(other)
    }

    #[inline(always)]
    fn eq(self, other: Self) -> mask32x8<S> {
        SimdBase::simd_eq(self, other)
    }

    #[inline(always)]
    fn select(if_false: Self, if_true: Self, mask: mask32x8<S>) -> Self {
        mask.select(if_true, if_false)
    }

    #[inline(always)]
    fn map(self, function: impl FnMut(f32) -> f32) -> Self {
        let lanes: [f32; 8] = self.into();
        Self::simd_from(self.simd, lanes.map(function))
    }

    #[inline(always)]
    fn truncate(self) -> Self {
        Self::float_from(i32x8::truncate_from(self))
    }

    #[inline(always)]
    fn to_word(self) -> u32x8<S> {
        u32x8::truncate_from(self)
    }
}

impl<S: Simd> Condition for mask32x8<S> {
    #[inline(always)]
    fn any(self) -> bool {
        self.any_true()
    }
}

impl<S: Simd> Word for u32x8<S> {
    type Real = f32x8<S>;
    type UVec2 = Lanes2<Self>;
    type UVec4 = [Self; 4];

    #[inline(always)]
    fn splat(self, value: u32) -> Self {
        SimdBase::splat(self.simd, value)
    }

    #[inline(always)]
    fn wrapping_add(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn wrapping_sub(self, other: Self) -> Self {
        self - other
    }

    #[inline(always)]
    fn wrapping_mul(self, other: Self) -> Self {
        self * other
    }

    #[inline(always)]
    fn reverse_bits(self) -> Self {
        let x = swapped(self, 1, 0x5555_5555);
        let x = swapped(x, 2, 0x3333_3333);
        let x = swapped(x, 4, 0x0f0f_0f0f);
        let x = swapped(x, 8, 0x00ff_00ff);
        (x >> 16) | (x << 16)
    }

    #[inline(always)]
    fn to_real(self) -> f32x8<S> {
        f32x8::float_from(self.bitcast::<i32x8<S>>())
    }

    #[inline(always)]
    fn select(if_false: Self, if_true: Self, mask: mask32x8<S>) -> Self {
        mask.select(if_true, if_false)
    }
}

/// Swaps neighboring groups of `width` bits. `mask` selects the lower group of each pair.
#[inline(always)]
fn swapped<W: Word>(x: W, width: u32, mask: u32) -> W {
    ((x >> width) & mask) | ((x & mask) << width)
}

#[cfg(test)]
mod tests;
