// Correctly rounded quotients and square roots (IEEE 754-2019, 4.3.1: to nearest, ties to even), for devices whose
// operations may be inexact: WGSL allows 2.5 units in the last place. The device's result is corrected by its
// remainder, which is computed exactly in integers modulo 2^32. `crates/render/src/gpu/rounding.rs` replaces the
// operations of a kernel by these functions.

const INFINITE = 0x7f800000u;

// The positive number mantissa x 2^(exponent - 150), with mantissa from 2^23 to 2^24.
struct Digits {
    mantissa: u32,
    exponent: i32,
}

fn digits_of(bits: u32) -> Digits {
    let is_normal = bits >= 0x800000u;
    let shift = select(countLeadingZeros(bits) - 8u, 0u, is_normal);
    let mantissa = select(bits << shift, (bits & 0x7fffffu) | 0x800000u, is_normal);
    return Digits(mantissa, select(1 - i32(shift), i32(bits >> 23u), is_normal));
}

// Returns the rounded bits of 2^(exponent - 127) x (digits / 2^24), with digits from 2^24 to 2^25. If `more` is true,
// the exact number is slightly larger.
fn rounded(exponent: i32, digits: u32, more: bool) -> u32 {
    let dropped = u32(clamp(2 - exponent, 1, 26));
    let kept = digits >> dropped;
    let rest = digits & ((1u << dropped) - 1u);
    let half = 1u << (dropped - 1u);
    let rounds_up = (rest > half) | ((rest == half) & (more | ((kept & 1u) == 1u)));
    let exponent_bits = u32(clamp(exponent - 1, 0, 254)) << 23u; // the mantissa's leading bit adds 1 to the exponent
    return select(exponent_bits + kept + select(0u, 1u, rounds_up), INFINITE, exponent >= 255);
}

fn quotient(a: f32, b: f32) -> f32 {
    let sign = (bitcast<u32>(a) ^ bitcast<u32>(b)) & 0x80000000u;
    let x = bitcast<u32>(a) & 0x7fffffffu;
    let y = bitcast<u32>(b) & 0x7fffffffu;
    let over = digits_of(x);
    let under = digits_of(y);
    let is_less = over.mantissa < under.mantissa;
    let numerator = over.mantissa << select(0u, 1u, is_less); // so that the quotient is from 1 to 2
    let exponent = over.exponent - under.exponent + select(127, 126, is_less);
    let guess = i32(f32(numerator) / f32(under.mantissa) * 16777216.0);
    let denominator = i32(under.mantissa);
    var rest = i32(numerator << 24u) - guess * denominator;
    let step = i32(f32(rest) / f32(denominator)) - select(0, 1, rest < 0);
    rest -= step * denominator;
    let is_below = rest < 0;
    rest += select(0, denominator, is_below);
    let is_above = rest >= denominator;
    rest -= select(0, denominator, is_above);
    let digits = guess + step - select(0, 1, is_below) + select(0, 1, is_above);
    let finite = rounded(exponent, u32(digits), rest != 0);
    let is_nan = (x > INFINITE) | (y > INFINITE) | ((x == y) & ((x == 0u) | (x == INFINITE)));
    let is_infinite = (x == INFINITE) | (y == 0u);
    let is_zero = (x == 0u) | (y == INFINITE);
    let bits = select(select(finite, 0u, is_zero), INFINITE, is_infinite);
    return bitcast<f32>(sign | select(bits, 0x7fc00000u, is_nan));
}

fn quotient2(a: vec2f, b: vec2f) -> vec2f {
    return vec2f(quotient(a.x, b.x), quotient(a.y, b.y));
}

fn quotient3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(quotient2(a.xy, b.xy), quotient(a.z, b.z));
}

fn quotient4(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(quotient2(a.xy, b.xy), quotient2(a.zw, b.zw));
}

fn square_root(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    let number = digits_of(bits & 0x7fffffffu);
    let is_even = (number.exponent & 1) == 0;
    let mantissa = number.mantissa << select(0u, 1u, is_even);
    let exponent = (number.exponent - select(0, 1, is_even) + 127) / 2;
    var digits = i32(sqrt(f32(mantissa) * 33554432.0)); // from 2^24 to 2^25
    var rest = i32(mantissa << 25u) - digits * digits;
    digits += i32(f32(rest) / f32(2 * digits)) - select(0, 1, rest < 0);
    rest = i32(mantissa << 25u) - digits * digits;
    let is_below = rest < 0;
    digits -= select(0, 1, is_below);
    rest += select(0, 2 * digits + 1, is_below);
    let is_above = rest > 2 * digits;
    rest -= select(0, 2 * digits + 1, is_above);
    digits += select(0, 1, is_above);
    let finite = rounded(exponent, u32(digits), rest != 0);
    let is_itself = (bits == 0u) | (bits == 0x80000000u) | (bits == INFINITE);
    let root = select(finite, bits, is_itself);
    return bitcast<f32>(select(root, bits | 0x7fc00000u, (bits > INFINITE) & !is_itself)); // NaN, or below 0
}

fn square_root4(x: vec4f) -> vec4f {
    return vec4f(square_root(x.x), square_root(x.y), square_root(x.z), square_root(x.w));
}
