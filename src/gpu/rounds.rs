//! How many samples of a pixel one call may have, so that software Vulkan runs it whole.

use crate::pack::{BLOCK, LEAVES, Specialization};

/// After so many rounds of all its loops together, Mesa 22.3's software Vulkan ends every loop of an invocation. Rounds
/// are counted for all lanes of a vector: a round that any of them needs counts.
const MOST_ROUNDS: f64 = 65_535.0;
/// Primitives that may hide a light's block of samples, where nothing else is known.
const CANDIDATES: f64 = 4.0;

/// The most samples of a call that are likely to run whole. It is an estimate: few primitives may hide a light, or all.
/// A call that is cut short nevertheless is repeated with fewer samples, so that too much costs time alone; too little
/// costs what a call costs.
pub fn samples_per_call(s: &Specialization, baked: bool) -> u32 {
    let samples = MOST_ROUNDS / rounds_of_sample(s, baked);
    (samples as u32).max(1)
}

/// Rounds of the loops of one sample, about; at least 1.
fn rounds_of_sample(s: &Specialization, baked: bool) -> f64 {
    let blocking = [
        s.blocking_rectangles,
        s.blocking_triangles,
        s.blocking_ellipsoids,
        s.blocking_planes,
    ];
    let all = sum([s.rectangles, s.triangles, s.ellipsoids, s.planes]);
    let lists = sum(blocking.map(|count| count.div_ceil(BLOCK)));
    // A scene in buffers is read by loops, one of constants by statements.
    let (of_hit, of_lists) = if baked {
        (0.0, lists)
    } else {
        (all, lists + sum(blocking))
    };
    let block = |samples: u32| {
        let shadows = CANDIDATES.min(sum(blocking)) * (1.0 + f64::from(samples));
        let lobes = f64::from(samples) * (2.0 + f64::from(s.exponent_bits));
        of_lists + shadows + lobes
    };
    let (blocks, rest) = (s.light_samples / BLOCK, s.light_samples % BLOCK);
    let area_light = f64::from(blocks) * block(BLOCK) + if rest > 0 { block(rest) } else { 0.0 };
    let shading = f64::from(s.area_lights) * (1.0 + area_light) + f64::from(s.delta_lights) * (1.0 + block(1));
    let paths = if s.bounces == 0 { 1 } else { LEAVES };
    1.0 + f64::from(paths) * (shading + (f64::from(s.bounces) + 1.0) * (1.0 + of_hit))
}

fn sum(counts: [u32; 4]) -> f64 {
    counts.map(f64::from).iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_samples_come_in_shorter_calls() {
        let small = Specialization {
            rectangles: 6,
            blocking_triangles: 4,
            triangles: 4,
            area_lights: 1,
            light_samples: 16,
            ..Specialization::default()
        };
        let calls = |change: fn(&mut Specialization)| {
            let mut changed = small;
            change(&mut changed);
            samples_per_call(&changed, false)
        };
        let plain = calls(|_| ());
        assert!((100..65_535).contains(&plain), "{plain}");
        assert!(samples_per_call(&small, true) > plain);
        for change in [
            (|s| s.light_samples = 256) as fn(&mut Specialization),
            |s| s.ellipsoids = 100,
            |s| s.delta_lights = 10,
            |s| s.bounces = 8,
        ] {
            assert!(calls(change) < plain);
        }
        // the ends of the ranges
        assert_eq!(calls(|s| s.light_samples = 65_536), 1);
        assert_eq!(calls(|s| s.triangles = u32::MAX), 1);
        assert!(samples_per_call(&Specialization::default(), true) > 1000);
    }
}
