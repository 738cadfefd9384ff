// Arithmetic that gives the same bits wherever rounding follows IEEE 754. WGSL's built-in functions are avoided, since
// no decoration protects them from contraction. Tests check each error bound.

fn dot(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn cross(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// Returns the unit vector in the direction of v. The error of each component is within 3 x 2^-24.
fn normalize(v: vec3f) -> vec3f {
    return v * (1.0 / sqrt(dot(v, v)));
}

fn max(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

fn max4(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a > b);
}

fn min(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

// Returns x, but 0 for -0. Operates on bits, since Mesa ignores the sign of zero; for example, Mesa simplifies x + 0 to
// x.
fn positive_zero(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    return bitcast<f32>(select(bits, 0u, bits == 0x80000000u));
}

fn floor(x: f32) -> f32 {
    let small = abs(x) < 8388608.0; // larger numbers are integers
    let integer = f32(i32(select(0.0, x, small)));
    return select(x, select(integer, integer - 1.0, integer > x), small);
}

// Returns x^n by repeated squaring, for n below 2^bits. The relative error is within n x 2^-24 for x from 0 to 1.
fn power_whole(x: f32, n: u32, bits: u32) -> f32 {
    var result = 1.0;
    var square = x;
    for (var i = 0u; i < bits; i++) {
        result = select(result, result * square, ((n >> i) & 1u) == 1u);
        square = square * square;
    }
    return result;
}

// Returns x^y as 2^(y log2 x), for x from 0 to 1 and y > 0; 0 for subnormal x. The relative error is within 1.7 x 2^-23
// (1 + |y log2 x|).
fn power(x: f32, y: f32) -> f32 {
    return select(0.0, exp2(y * log2(x)), x >= 1.1754943508222875e-38);
}

// Returns log2 of a normal x > 0: the exponent, and the series of 2 artanh((m - 1) / (m + 1)) for a mantissa m from
// sqrt(1/2) to sqrt(2) (Abramowitz and Stegun, "Handbook of Mathematical Functions", 4.1.27). The error is within 4.5
// units in the last place.
fn log2(x: f32) -> f32 {
    let bits = bitcast<i32>(x);
    let exponent = (bits - 0x3f3504f3) >> 23u;
    let m = bitcast<f32>(bits - (exponent << 23u));
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let series = 1.0 + s2 * (0.33333334 + s2 * (0.2 + s2 * (0.14285715 + s2 * 0.11111111)));
    return f32(exponent) + s * series * 2.8853900817779268;
}

// Returns 2^x; 0 below the normal numbers, infinite from 127.5 on. The nearest integer goes to the exponent; the series
// of the exponential (Abramowitz and Stegun, 4.2.1) is evaluated for the remainder. The error is within 1.5 units in
// the last place.
fn exp2(x: f32) -> f32 {
    let p = min(max(x, -126.5), 128.0);
    let integer = i32(p + select(0.5, -0.5, p < 0.0));
    let f = (p - f32(integer)) * 0.6931471805599453;
    let high = 0.008333334 + f * (0.0013888889 + f * 0.0001984127);
    let series = 1.0 + f * (1.0 + f * (0.5 + f * (0.16666667 + f * (0.041666668 + f * high))));
    return select(0.0, series * bitcast<f32>((integer + 127) << 23u), x > -126.5);
}

// Returns the angle of (x, y) in (-pi, pi], 0 if both are 0: the series of the arctangent (Abramowitz and Stegun,
// 4.4.42), for arguments reduced below tan(pi / 8). The error is within 3.5 units in the last place.
fn atan2(y: f32, x: f32) -> f32 {
    let large = max(abs(x), abs(y));
    let small = min(abs(x), abs(y));
    let steep = small > 0.41421357 * large;
    let t = select(small, small - large, steep) / select(large, small + large, steep);
    let t2 = t * t;
    let high = 0.11111111 - t2 * (0.09090909 - t2 * (0.07692308 - t2 * (0.06666667 - t2 * 0.05882353)));
    let series = 1.0 - t2 * (0.33333334 - t2 * (0.2 - t2 * (0.14285715 - t2 * high)));
    let octant = select(0.0, 0.7853982, steep) + t * series;
    let quadrant = select(octant, 1.5707964 - octant, abs(y) > abs(x));
    let half = select(quadrant, 3.1415927 - quadrant, x < 0.0);
    return select(0.0, select(half, -half, y < 0.0), large > 0.0);
}

// Returns sin(pi x), by the Taylor series after x is reduced to -1/2 to 1/2. The error is within 3e-7 for |x| below
// 1000.
fn sine(x: f32) -> f32 {
    let integer = floor(x + 0.5);
    let r = x - integer;
    let r2 = r * r;
    let tail = 0.5992645 - r2 * (0.08214589 - r2 * 0.007370431);
    let series = r * (3.1415927 - r2 * (5.1677127 - r2 * (2.550164 - r2 * tail)));
    return select(series, -series, integer - 2.0 * floor(0.5 * integer) > 0.0);
}
