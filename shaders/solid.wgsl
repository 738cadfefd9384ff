// Convex solids that are intersections of two sets. A level is a function that is negative inside one of the sets. A
// line is inside the solid in one interval.

// Corrects the rounding of levels on the surface: the larger level becomes `surface_level`, the other at most
// `surface_level`.
fn levels_on_surface(levels: vec2f, surface_level: f32) -> vec2f {
    let x_is_larger = levels.x >= levels.y;
    return vec2f(select(min(levels.x, surface_level), surface_level, x_is_larger), select(surface_level, min(levels.y, surface_level), x_is_larger));
}

// Returns the nearest end of an interval that is in (0, limit), else `limit`. An interval is empty unless x < y.
fn nearest_end(interval: vec2f, limit: f32) -> f32 {
    let t = select(interval.y, interval.x, interval.x > 0.0);
    return select(limit, t, (interval.x < interval.y) & (t > 0.0) & (t < limit));
}

// Returns true if an end of an interval is in (0, t_max).
fn interval_occludes(interval: vec2f, t_max: f32) -> bool {
    let enters = (interval.x > 0.0) & (interval.x < t_max);
    let leaves = (interval.y > 0.0) & (interval.y < t_max);
    return (interval.x < interval.y) & (enters | leaves);
}
