//! Twin of `shaders/solid.wgsl`.

use super::lanes::{Real, Vector2, select};
use super::math::min;

#[inline(always)]
pub fn levels_on_surface<V: Vector2>(levels: V, surface_level: V::Real) -> V {
    let on_side = V::new(surface_level, min(levels.y(), surface_level));
    let on_cap = V::new(min(levels.x(), surface_level), surface_level);
    V::select(on_cap, on_side, levels.x().ge(levels.y()))
}

#[inline(always)]
pub fn nearest_end<V: Vector2>(interval: V, limit: V::Real) -> V::Real {
    let (near, far, zero) = (interval.x(), interval.y(), limit.splat(0.0));
    let t = select(far, near, near.gt(zero));
    select(limit, t, near.lt(far) & t.gt(zero) & t.lt(limit))
}

#[inline(always)]
pub fn interval_occludes<V: Vector2>(interval: V, t_max: V::Real) -> <V::Real as Real>::Mask {
    let (near, far, zero) = (interval.x(), interval.y(), t_max.splat(0.0));
    let enters = near.gt(zero) & near.lt(t_max);
    let leaves = far.gt(zero) & far.lt(t_max);
    near.lt(far) & (enters | leaves)
}
