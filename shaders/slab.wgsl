// Intersection of rays with boxes, in the common interval of three slabs: Kay and Kajiya, "Ray Tracing Complex Scenes",
// SIGGRAPH 1986. Boxes are enlarged by `pad`.
//
// Every step is monotone in 32-bit floats: of two nested boxes, the outer one is entered no later and left no earlier.
// A BVH thus misses nothing whose box a ray hits (docs/decisions/trees.md).

// A ray's terms for box tests, with origins for lower and upper sides.
struct Slabs {
    low_origin: vec3f,
    high_origin: vec3f,
    inverse: vec3f,        // of the direction
}

fn slabs(origin: vec3f, direction: vec3f, pad: f32) -> Slabs {
    let inverse = vec3f(inverse_of(direction.x), inverse_of(direction.y), inverse_of(direction.z));
    return Slabs(origin + pad, origin - pad, inverse);
}

// Returns 1 / x, finite: |x| is at least 2^-100.
fn inverse_of(x: f32) -> f32 {
    let least = select(7.888609e-31, -7.888609e-31, x < 0.0);
    return 1.0 / select(least, x, abs(x) >= 7.888609e-31);
}

// Returns the t of entry, x, and exit, y; a miss if x > y.
fn box_interval(low: vec3f, high: vec3f, s: Slabs) -> vec2f {
    let a = (low - s.low_origin) * s.inverse;
    let b = (high - s.high_origin) * s.inverse;
    let near = max(max(min(a.x, b.x), min(a.y, b.y)), min(a.z, b.z));
    let far = min(min(max(a.x, b.x), max(a.y, b.y)), max(a.z, b.z));
    return vec2f(near, far);
}

// Returns true for a nonempty interval that overlaps [0, limit].
fn interval_hits(interval: vec2f, limit: f32) -> bool {
    return (interval.x <= interval.y) & (interval.y >= 0.0) & (interval.x <= limit);
}

// All rays from a point with directions in a box. A box test reports a hit if any of these rays hits.
struct RayInterval {
    low_origin: vec3f,
    high_origin: vec3f,
    near_low: vec3f,       // factor from the distance of a lower side to the earliest t
    near_high: vec3f,      // factor from the distance of an upper side to the earliest t
    far_low: vec3f,        // factor from the distance of a lower side to the latest t; 0 if unbounded
    far_high: vec3f,
}

fn ray_interval(origin: vec3f, least: vec3f, most: vec3f, pad: f32) -> RayInterval {
    let up = least >= vec3f(0.0);
    let down = most < vec3f(0.0);
    let of_least = vec3f(inverse_of(least.x), inverse_of(least.y), inverse_of(least.z));
    let of_most = vec3f(inverse_of(most.x), inverse_of(most.y), inverse_of(most.z));
    let zero = vec3f(0.0);
    return RayInterval(origin + pad, origin - pad, select(of_most, zero, down), select(of_least, zero, up),
               select(zero, of_most, down), select(zero, of_least, up));
}

// Returns the earliest t at which any ray may enter, x, and the latest t at which any ray may leave, y.
fn ray_interval_box(low: vec3f, high: vec3f, f: RayInterval) -> vec2f {
    let a = low - f.low_origin;
    let b = high - f.high_origin;
    let by_low = a * f.near_low;
    let by_high = b * f.near_high;
    let near = max(max(max(by_low.x, by_high.x), max(by_low.y, by_high.y)), max(by_low.z, by_high.z));
    let none = (f.far_low == vec3f(0.0)) & (f.far_high == vec3f(0.0));
    let far = select(a * f.far_low + b * f.far_high, vec3f(INFINITE_T), none);
    return vec2f(near, min(min(far.x, far.y), far.z));
}
