// Intersection of rays with boxes, in the common interval of three slabs: Kay and Kajiya, "Ray Tracing Complex Scenes",
// SIGGRAPH 1986. Boxes are enlarged by `pad`.
//
// Every step is monotone in 32-bit floats: of two nested boxes, the outer one is entered no later and left no earlier.
// A traversal thus misses no item whose box a ray hits (docs/decisions/trees.md).

// Precomputed terms of a ray for box tests: the origin for lower and upper sides, offset by the padding, and 1 over the
// direction.
struct Slabs {
    low_origin: vec3f,
    high_origin: vec3f,
    inverse: vec3f,
}

fn slabs(origin: vec3f, direction: vec3f, pad: f32) -> Slabs {
    let inverse = vec3f(inverse_of(direction.x), inverse_of(direction.y), inverse_of(direction.z));
    return Slabs(origin + pad, origin - pad, inverse);
}

// Returns 1 / x, with |x| clamped to at least 2^-100, so that the result is finite.
fn inverse_of(x: f32) -> f32 {
    let smallest = select(7.888609e-31, -7.888609e-31, x < 0.0);
    return 1.0 / select(smallest, x, abs(x) >= 7.888609e-31);
}

// Returns the t at which the ray enters the box (x) and leaves it (y). The ray misses the box if x > y.
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

// A bundle of rays with a common origin, whose direction components are in given ranges, as precomputed terms for box
// tests. A test reports a hit if any ray of the bundle may hit the box.
//
// Multiplied by the offset from the origin to a box's lower or upper side, the near factors give the earliest t and the
// far factors the latest t of the bundle. A near factor is 0 if a ray cannot enter by this side, a far factor if a ray
// need not leave by this side. The latest t is unbounded if both far factors of an axis are 0.
struct RayInterval {
    low_origin: vec3f,
    high_origin: vec3f,
    near_low: vec3f,
    near_high: vec3f,
    far_low: vec3f,
    far_high: vec3f,
}

fn ray_interval(origin: vec3f, min_direction: vec3f, max_direction: vec3f, pad: f32) -> RayInterval {
    let is_positive = min_direction >= vec3f(0.0);
    let is_negative = max_direction < vec3f(0.0);
    let inverse_min = vec3f(inverse_of(min_direction.x), inverse_of(min_direction.y), inverse_of(min_direction.z));
    let inverse_max = vec3f(inverse_of(max_direction.x), inverse_of(max_direction.y), inverse_of(max_direction.z));
    let zero = vec3f(0.0);
    return RayInterval(origin + pad, origin - pad, select(inverse_max, zero, is_negative), select(inverse_min, zero, is_positive),
               select(zero, inverse_max, is_negative), select(zero, inverse_min, is_positive));
}

// Returns the earliest t at which any ray may enter a box (x), and the latest t at which any ray may leave the box (y).
fn ray_interval_box(low: vec3f, high: vec3f, rays: RayInterval) -> vec2f {
    let a = low - rays.low_origin;
    let b = high - rays.high_origin;
    let t_low = a * rays.near_low;
    let t_high = b * rays.near_high;
    let near = max(max(max(t_low.x, t_high.x), max(t_low.y, t_high.y)), max(t_low.z, t_high.z));
    let is_unbounded = (rays.far_low == vec3f(0.0)) & (rays.far_high == vec3f(0.0));
    let far = select(a * rays.far_low + b * rays.far_high, vec3f(INFINITE_T), is_unbounded);
    return vec2f(near, min(min(far.x, far.y), far.z));
}
