//! Twin of `shaders/math.wgsl`.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::lanes::{Children, Condition, Real, Vector3, constant, select};

#[inline(always)]
pub fn dot<V: Vector3>(a: V, b: V) -> V::Real {
    a.x() * b.x() + a.y() * b.y() + a.z() * b.z()
}

#[inline(always)]
pub fn cross<V: Vector3>(a: V, b: V) -> V {
    V::new(
        a.y() * b.z() - a.z() * b.y(),
        a.z() * b.x() - a.x() * b.z(),
        a.x() * b.y() - a.y() * b.x(),
    )
}

#[inline(always)]
pub fn normalize<V: Vector3>(v: V) -> V {
    v * (constant(1.0) / dot(v, v).sqrt())
}

#[inline(always)]
pub fn max<F: Real>(a: F, b: F) -> F {
    select(b, a, a.gt(b))
}

#[inline(always)]
pub fn max4<C: Children>(a: C, b: C) -> C {
    C::select(b, a, b.lt(a))
}

#[inline(always)]
pub fn min<F: Real>(a: F, b: F) -> F {
    select(b, a, a.lt(b))
}

pub fn positive_zero(x: f32) -> f32 {
    let bits = x.to_bits();
    f32::from_bits(if bits == 0x8000_0000 { 0 } else { bits })
}

#[inline(always)]
pub fn floor<F: Real>(x: F) -> F {
    let small = x.abs().lt(x.splat(8_388_608.0));
    let integer = select(x.splat(0.0), x, small).truncate();
    select(x, select(integer, integer - 1.0, integer.gt(x)), small)
}

#[inline(always)]
pub fn power_whole<F: Real>(x: F, n: u32, bits: u32) -> F {
    let mut result = x.splat(1.0);
    let mut square = x;
    for i in 0..bits {
        result = if (n >> i) & 1 == 1 { result * square } else { result };
        square = square * square;
    }
    result
}

#[inline(always)]
pub fn power<F: Real>(x: F, y: F) -> F {
    let is_positive = x.ge(x.splat(f32::MIN_POSITIVE));
    if !is_positive.any() {
        return x.splat(0.0);
    }
    select(x.splat(0.0), (y * x.map(log2)).map(exp2), is_positive)
}

pub fn log2(x: f32) -> f32 {
    let bits = x.to_bits() as i32;
    let exponent = bits.wrapping_sub(0x3f35_04f3) >> 23;
    let m = f32::from_bits(bits.wrapping_sub(exponent << 23) as u32);
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let series = 1.0 + s2 * (0.333_333_34 + s2 * (0.2 + s2 * (0.142_857_15 + s2 * 0.111_111_11)));
    exponent as f32 + s * series * (2.0 * std::f32::consts::LOG2_E)
}

pub fn exp2(x: f32) -> f32 {
    let p = min(max(x, -126.5), 128.0);
    let integer = (p + if p < 0.0 { -0.5 } else { 0.5 }) as i32;
    let f = (p - integer as f32) * std::f32::consts::LN_2;
    let high = 0.008_333_334 + f * (0.001_388_888_9 + f * 0.000_198_412_7);
    let series = 1.0 + f * (1.0 + f * (0.5 + f * (0.166_666_67 + f * (0.041_666_668 + f * high))));
    if x > -126.5 {
        series * f32::from_bits(((integer + 127) << 23) as u32)
    } else {
        0.0
    }
}

#[inline(always)]
pub fn atan2<F: Real>(y: F, x: F) -> F {
    let c = constant;
    let zero = x.splat(0.0);
    let large = max(x.abs(), y.abs());
    let small = min(x.abs(), y.abs());
    let steep = small.gt(c(0.414_213_57) * large);
    let t = select(small, small - large, steep) / select(large, small + large, steep);
    let t2 = t * t;
    let high =
        c(0.111_111_11) - t2 * (c(0.090_909_09) - t2 * (c(0.076_923_08) - t2 * (c(0.066_666_67) - t2 * 0.058_823_53)));
    let series = c(1.0) - t2 * (c(0.333_333_34) - t2 * (c(0.2) - t2 * (c(0.142_857_15) - t2 * high)));
    let octant = select(zero, x.splat(FRAC_PI_4), steep) + t * series;
    let quadrant = select(octant, c(FRAC_PI_2) - octant, y.abs().gt(x.abs()));
    let half = select(quadrant, c(PI) - quadrant, x.lt(zero));
    select(zero, select(half, -half, y.lt(zero)), large.gt(zero))
}

#[inline(always)]
pub fn sine<F: Real>(x: F) -> F {
    let c = constant;
    let integer = floor(x + 0.5);
    let r = x - integer;
    let r2 = r * r;
    let tail = c(0.599_264_5) - r2 * (c(0.082_145_89) - r2 * 0.007_370_431);
    let series = r * (c(PI) - r2 * (c(5.167_712_7) - r2 * (c(2.550_164) - r2 * tail)));
    let is_odd = (integer - c(2.0) * floor(c(0.5) * integer)).gt(x.splat(0.0));
    select(series, -series, is_odd)
}
