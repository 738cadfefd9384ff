//! Twin of `shaders/solid.wgsl`.

use glam::Vec2;

use super::math::min;

pub fn levels_on_surface(levels: Vec2, surface_level: f32) -> Vec2 {
    if levels.x >= levels.y {
        Vec2::new(surface_level, min(levels.y, surface_level))
    } else {
        Vec2::new(min(levels.x, surface_level), surface_level)
    }
}

pub fn nearest_end(interval: Vec2, limit: f32) -> f32 {
    let t = if interval.x > 0.0 { interval.x } else { interval.y };
    if (interval.x < interval.y) & (t > 0.0) & (t < limit) {
        t
    } else {
        limit
    }
}

pub fn interval_occludes(interval: Vec2, t_max: f32) -> bool {
    let enters = (interval.x > 0.0) & (interval.x < t_max);
    let leaves = (interval.y > 0.0) & (interval.y < t_max);
    (interval.x < interval.y) & (enters | leaves)
}
