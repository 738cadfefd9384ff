//! Proptest strategies: points, directions, lengths and colors.

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;

/// Generates coordinates, often from a few values, so that objects touch or coincide.
pub fn coordinate() -> BoxedStrategy<f64> {
    prop_oneof![
        3 => select(&[0.0, 0.5, -0.5, 1.0, -1.0][..]),
        2 => (-64i32..64).prop_map(|n| f64::from(n) / 32.0),
        1 => -2.0..2.0,
    ]
    .boxed()
}

pub fn point() -> BoxedStrategy<DVec3> {
    [coordinate(), coordinate(), coordinate()]
        .prop_map(DVec3::from_array)
        .boxed()
}

pub fn direction() -> BoxedStrategy<DVec3> {
    let axes = select(vec![DVec3::Z, DVec3::X, DVec3::Y, -DVec3::Z, -DVec3::X, -DVec3::Y]);
    prop_oneof![2 => axes, 1 => point().prop_filter("a direction", |v| v.length() > 0.1)].boxed()
}

/// Generates two directions that are not parallel.
pub fn frame() -> BoxedStrategy<[DVec3; 2]> {
    [direction(), direction()]
        .prop_filter("a frame", |[a, b]| a.normalize().cross(b.normalize()).length() > 0.01)
        .boxed()
}

pub fn length() -> BoxedStrategy<f64> {
    prop_oneof![select(&[1.0, 0.5, 2.0, 0.01][..]), 0.05..2.0].boxed()
}

pub fn color(max: f64) -> BoxedStrategy<DVec3> {
    let component = prop_oneof![select(vec![0.5, 0.0, 1.0]), 0.0..max];
    [component.clone(), component.clone(), component]
        .prop_map(DVec3::from_array)
        .boxed()
}
