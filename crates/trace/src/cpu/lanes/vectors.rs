//! Vectors in SIMD lanes.

use std::ops::{Add, Div, Mul, Neg, Sub};

use fearless_simd::{Simd, f32x8, u32x8};

use super::{Real, Vector2, Vector3, Vector4, WordVector2, WordVector4};

/// A vector of two numbers in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Lanes2<T> {
    pub x: T,
    pub y: T,
}

/// A vector of three numbers in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Lanes3<F> {
    pub x: F,
    pub y: F,
    pub z: F,
}

impl<S: Simd> Vector2 for Lanes2<f32x8<S>> {
    type Real = f32x8<S>;

    #[inline(always)]
    fn new(x: f32x8<S>, y: f32x8<S>) -> Self {
        Lanes2 { x, y }
    }

    #[inline(always)]
    fn x(self) -> f32x8<S> {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f32x8<S> {
        self.y
    }
}

impl<S: Simd> WordVector2 for Lanes2<u32x8<S>> {
    type Word = u32x8<S>;

    #[inline(always)]
    fn new(x: u32x8<S>, y: u32x8<S>) -> Self {
        Lanes2 { x, y }
    }

    #[inline(always)]
    fn x(self) -> u32x8<S> {
        self.x
    }

    #[inline(always)]
    fn y(self) -> u32x8<S> {
        self.y
    }
}

impl<S: Simd> WordVector4 for [u32x8<S>; 4] {
    type Word = u32x8<S>;

    #[inline(always)]
    fn from_words(words: [u32x8<S>; 4]) -> Self {
        words
    }

    #[inline(always)]
    fn words(self) -> [u32x8<S>; 4] {
        self
    }
}

impl<S: Simd> Vector3 for Lanes3<f32x8<S>> {
    type Real = f32x8<S>;

    #[inline(always)]
    fn new(x: f32x8<S>, y: f32x8<S>, z: f32x8<S>) -> Self {
        Lanes3 { x, y, z }
    }

    #[inline(always)]
    fn x(self) -> f32x8<S> {
        self.x
    }

    #[inline(always)]
    fn y(self) -> f32x8<S> {
        self.y
    }

    #[inline(always)]
    fn z(self) -> f32x8<S> {
        self.z
    }
}

impl<S: Simd> Vector4 for [f32x8<S>; 4] {
    type Real = f32x8<S>;

    #[inline(always)]
    fn new(x: f32x8<S>, y: f32x8<S>, z: f32x8<S>, w: f32x8<S>) -> Self {
        [x, y, z, w]
    }

    #[inline(always)]
    fn x(self) -> f32x8<S> {
        self[0]
    }

    #[inline(always)]
    fn y(self) -> f32x8<S> {
        self[1]
    }

    #[inline(always)]
    fn z(self) -> f32x8<S> {
        self[2]
    }

    #[inline(always)]
    fn w(self) -> f32x8<S> {
        self[3]
    }
}

impl<F: Real> Neg for Lanes3<F> {
    type Output = Lanes3<F>;

    #[inline(always)]
    fn neg(self) -> Lanes3<F> {
        Lanes3 {
            x: -self.x,
            y: -self.y,
            z: -self.z,
        }
    }
}

macro_rules! vector_operators {
    ($($operator:ident $function:ident;)*) => {
        $(impl<F: Real> $operator for Lanes3<F> {
            type Output = Lanes3<F>;

            #[inline(always)]
            fn $function(self, other: Lanes3<F>) -> Lanes3<F> {
                Lanes3 {
                    x: $operator::$function(self.x, other.x),
                    y: $operator::$function(self.y, other.y),
                    z: $operator::$function(self.z, other.z),
                }
            }
        })*
    };
}

vector_operators! { Add add; Sub sub; Mul mul; }

macro_rules! scalar_operators {
    ($($operator:ident $function:ident;)*) => {
        $(impl<F: Real> $operator<F> for Lanes3<F> {
            type Output = Lanes3<F>;

            #[inline(always)]
            fn $function(self, scalar: F) -> Lanes3<F> {
                Lanes3 {
                    x: $operator::$function(self.x, scalar),
                    y: $operator::$function(self.y, scalar),
                    z: $operator::$function(self.z, scalar),
                }
            }
        })*
    };
}

scalar_operators! { Add add; Sub sub; Mul mul; Div div; }

impl<F: Real> Mul<F> for Lanes2<F> {
    type Output = Lanes2<F>;

    #[inline(always)]
    fn mul(self, factor: F) -> Lanes2<F> {
        Lanes2 {
            x: self.x * factor,
            y: self.y * factor,
        }
    }
}
