//! Interpolation between keys, linear or C1-continuous. Uses only sums, products and quotients of 64-bit floats, so
//! that the bits are equal on all machines.

use std::ops::{Add, Mul, Sub};

use super::Interpolation;

/// The value of a key: a number or a point.
pub trait Point:
    Copy + PartialEq + Default + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
}

impl<T: Copy + PartialEq + Default + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>> Point for T {}

/// A time and a value.
pub type Key<T> = (f64, T);

/// Interpolates keys with ascending times; `None` if there are no keys. The value is exact at keys, and constant
/// before the first key and after the last key.
pub fn value<T: Point>(keys: &[Key<T>], time: f64, interpolation: Interpolation) -> Option<T> {
    let next = keys.partition_point(|(key_time, _)| *key_time <= time);
    let (Some(&a), Some(&b)) = (
        keys.get(next.saturating_sub(1)),
        keys.get(next.min(keys.len().saturating_sub(1))),
    ) else {
        return None;
    };
    let (span, step) = (b.0 - a.0, b.1 - a.1);
    if !(span > 0.0) || time <= a.0 {
        return Some(a.1); // before the first key, after the last key, or exactly at a key
    }
    let s = (time - a.0) / span;
    let (start_slope, end_slope) = match interpolation {
        Interpolation::Linear => return Some(a.1 + step * s),
        Interpolation::Smooth => (slope(keys, next - 1), slope(keys, next)),
    };
    // Cubic Hermite segment: smoothstep between the values, plus the contribution of the slopes.
    let remaining = 1.0 - s;
    Some(a.1 + step * (s * s * (3.0 - 2.0 * s)) + (start_slope * remaining - end_slope * s) * (span * s * remaining))
}

/// Returns the derivative of the smooth curve at a key: the secant of its neighbors (E. Catmull and R. Rom, "A Class of
/// Local Interpolating Splines", 1974, generalized to non-uniform times). At the first and last key, the slope makes
/// the segment a parabola. Next to a key with an equal value, the slope is 0, so that the value is constant between
/// equal keys.
fn slope<T: Point>(keys: &[Key<T>], i: usize) -> T {
    let before = i.checked_sub(1).and_then(|i| keys.get(i));
    let after = keys.get(i + 1);
    let Some(key) = keys.get(i) else {
        return T::default();
    };
    if [before, after]
        .into_iter()
        .flatten()
        .any(|neighbor| neighbor.1 == key.1)
    {
        return T::default();
    }
    match (before, after) {
        (Some(before), Some(after)) => secant(before, after),
        // The mean slope of a parabola between two points is the mean of the slopes at these points.
        (None, Some(after)) if keys.len() > 2 => secant(key, after) * 2.0 - slope(keys, i + 1),
        (Some(before), None) if keys.len() > 2 => secant(before, key) * 2.0 - slope(keys, i - 1),
        (None, Some(after)) => secant(key, after),
        (Some(before), None) => secant(before, key),
        (None, None) => T::default(),
    }
}

fn secant<T: Point>(a: &Key<T>, b: &Key<T>) -> T {
    (b.1 - a.1) * (1.0 / (b.0 - a.0))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    const INTERPOLATIONS: [Interpolation; 2] = [Interpolation::Linear, Interpolation::Smooth];
    /// Arbitrary values at ascending, uneven times.
    const KEYS: [Key<f64>; 6] = [
        (-2.0, 3.0),
        (0.5, -1.0),
        (1.0, 2.5),
        (4.0, 2.0),
        (10.0, -7.0),
        (10.25, -6.5),
    ];

    fn is_near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * (1.0 + b.abs())
    }

    #[test]
    fn values_are_exact_at_keys_and_constant_outside() {
        for interpolation in INTERPOLATIONS {
            for (time, expected) in KEYS {
                assert_eq!(value(&KEYS, time, interpolation), Some(expected));
            }
            for (time, expected) in [(-2.5, 3.0), (-1e300, 3.0), (10.26, -6.5), (1e300, -6.5)] {
                assert_eq!(value(&KEYS, time, interpolation), Some(expected));
            }
            assert_eq!(value(&KEYS[2..3], 7.0, interpolation), Some(2.5));
            assert_eq!(value::<f64>(&[], 7.0, interpolation), None);
        }
    }

    #[test]
    fn linear_interpolation_is_straight() {
        for (time, expected) in [(-0.75, 1.0), (0.75, 0.75), (2.5, 2.25), (5.5, -0.25)] {
            assert_eq!(value(&KEYS, time, Interpolation::Linear), Some(expected));
            assert_ne!(value(&KEYS, time, Interpolation::Smooth), Some(expected));
        }
        let points = [(0.0, DVec3::new(0.0, 2.0, -4.0)), (8.0, DVec3::new(4.0, 2.0, 4.0))];
        for interpolation in INTERPOLATIONS {
            assert_eq!(value(&points, 2.0, interpolation), Some(DVec3::new(1.0, 2.0, -2.0)));
        }
    }

    /// Tests uniform motion with uneven keys, and free fall with even keys.
    #[test]
    fn constant_speeds_and_accelerations_are_reproduced() {
        let line = |t: f64| DVec3::new(3.0 - 2.0 * t, t, 0.5);
        let uneven = [0.0, 1.0, 1.5, 4.0, 9.0].map(|t| (t, line(t)));
        let fall = |t: f64| DVec3::new(t, 0.0, 7.0 - 4.9 * t * t);
        let even = [0.0, 2.0, 4.0, 6.0].map(|t| (t, fall(t)));
        let mut linear_error = 0.0_f64;
        for i in 0..=90 {
            let t = f64::from(i) / 10.0;
            for interpolation in INTERPOLATIONS {
                let found = value(&uneven, t, interpolation).unwrap();
                assert!(found.abs_diff_eq(line(t), 1e-12), "{t}: {found}");
            }
            if t <= 6.0 {
                let found = value(&even, t, Interpolation::Smooth).unwrap();
                assert!(found.abs_diff_eq(fall(t), 1e-12), "{t}: {found}");
                let found = value(&even, t, Interpolation::Linear).unwrap();
                linear_error = linear_error.max(found.distance(fall(t)));
            }
        }
        assert!(linear_error > 1.0, "linear interpolation must not reproduce free fall");
    }

    /// The expected values are computed with SciPy 1.17: `CubicHermiteSpline(t, v, m)` with `m[1:-1] = (v[2:] - v[:-2])
    /// / (t[2:] - t[:-2])`, and, at the ends, `m` is twice the difference quotient minus the neighbor's `m`.
    #[test]
    fn smooth_interpolation_matches_scipy() {
        for (time, expected) in [
            (-1.75, 2.2775),
            (-0.5, -0.26000000000000045),
            (0.625, -0.4849330357142856),
            (0.9, 2.0784761904761915),
            (2.0, 2.9858906525573197),
            (3.5, 2.4630731922398583),
            (7.25, -2.684526427469136),
            (10.125, -6.96),
        ] {
            let found = value(&KEYS, time, Interpolation::Smooth).unwrap();
            assert!(is_near(found, expected), "{time}: {found}, expected {expected}");
        }
    }

    /// Returns the speeds before and after each inner key.
    fn speeds(interpolation: Interpolation) -> Vec<(f64, f64)> {
        let value_at = |time| value(&KEYS, time, interpolation).unwrap();
        let step = 1e-6;
        let inner_keys = &KEYS[1..5];
        let speeds = inner_keys
            .iter()
            .map(|(t, v)| ((v - value_at(t - step)) / step, (value_at(t + step) - v) / step));
        speeds.collect()
    }

    #[test]
    fn smooth_interpolation_has_continuous_speed() {
        let jumps = |interpolation| speeds(interpolation).into_iter().map(|(a, b)| (a - b).abs());
        assert!(jumps(Interpolation::Smooth).all(|jump| jump < 1e-3));
        assert!(jumps(Interpolation::Linear).all(|jump| jump > 1.0));
    }

    #[test]
    fn the_value_is_constant_between_equal_keys() {
        let keys = [(0.0, 1.0), (4.0, 3.0), (6.0, 3.0), (9.0, -2.0)];
        for i in 0..=20 {
            assert_eq!(
                value(&keys, 4.0 + f64::from(i) / 10.0, Interpolation::Smooth),
                Some(3.0)
            );
        }
        // The curve does not overshoot before these keys either.
        for i in 0..=40 {
            assert!(value(&keys, f64::from(i) / 10.0, Interpolation::Smooth).unwrap() <= 3.0);
        }
    }

    #[test]
    fn extreme_keys_give_finite_values() {
        let keys = [(-1e9, -1e9), (-1e9 + 1e-6, 1e9), (0.0, -1e9), (1e-6, 1e9), (1e9, -1e9)];
        for interpolation in INTERPOLATIONS {
            for time in [-1e9 + 5e-7, -0.5e9, 5e-7, 1.0, 1e8, 0.999e9] {
                assert!(value(&keys, time, interpolation).unwrap().is_finite(), "{time}");
            }
        }
    }
}
