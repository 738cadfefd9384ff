// Convex solids that are intersections of two sets. A level is a function of a point that is negative inside one set; a
// line is inside the solid in one interval.

// Corrects the rounding of levels on the surface: the larger one becomes `on`, the other at most `on`.
fn levels_on_surface(levels: vec2f, on: f32) -> vec2f {
    let on_side = levels.x >= levels.y;
    return vec2f(select(min(levels.x, on), on, on_side), select(on, min(levels.y, on), on_side));
}

// Returns the nearest end of an interval, if it is in (0, limit), else `limit`. An interval is empty unless x < y.
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
