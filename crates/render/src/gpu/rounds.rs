//! How many samples of a pixel one call may have, so that software Vulkan runs it whole.

use crate::records::{MAX_PATH_LEAVES, Packed, SAMPLE_BLOCK};

/// After so many rounds of all its loops together, Mesa 22.3's software Vulkan ends every loop of an invocation. Rounds
/// are counted for all lanes of a vector: a round that any of them needs counts.
const MOST_ROUNDS: f64 = 65_535.0;
/// Primitives that may hide a light's block of samples, where nothing else is known.
const CANDIDATES: f64 = 4.0;

/// Rounds of a walk through the trees, about: nodes, leaves, triangles.
const ROUNDS_OF_TREE: f64 = 150.0;

/// Bounces of a path on which it may end at random, at most, nearly always, where surfaces reflect 95 % of the light: 0.95^100 is
/// 0.6 %.
const LONGEST_ROULETTE: u32 = 100;

/// Surfaces that a ray passes by their alpha before it meets one, about.
const ROUNDS_OF_PASSING: f64 = 4.0;

/// Rounds of a lookup in a texture, about.
const ROUNDS_OF_LOOKUP: f64 = 8.0;

/// The most samples of a call that are likely to run whole. It is an estimate: few primitives may hide a light, or all.
/// A call that is cut short nevertheless is repeated with fewer samples, so that too much costs time alone; too little
/// costs what a call costs.
pub fn samples_per_call(packed: &Packed, baked: bool) -> u32 {
    let samples = MOST_ROUNDS / rounds_of_sample(packed, baked);
    (samples as u32).max(1)
}

/// Rounds of the loops of one sample, about; at least 1.
fn rounds_of_sample(packed: &Packed, baked: bool) -> f64 {
    let s = &packed.specialization;
    let all = packed.kinds().map(|(_, range)| range.len()).sum::<usize>() as f64;
    let casting = || packed.shadow_casters().map(|(_, range)| range.len());
    let lists = casting()
        .map(|count| count.div_ceil(SAMPLE_BLOCK as usize))
        .sum::<usize>() as f64;
    let casters = casting().sum::<usize>() as f64;
    // A scene in buffers is read by loops, one of constants by statements.
    let (of_hit, of_lists) = if baked { (0.0, lists) } else { (all, lists + casters) };
    let in_tree = if s.in_tree == 0 { 0.0 } else { ROUNDS_OF_TREE };
    let of_hit = of_hit + in_tree;
    // Behind what is hidden from the camera.
    let of_start = 1.0 + f64::from(s.hidden) * (1.0 + of_hit) * 2.0;
    if packed.integrator.follows_paths() {
        // Each bounce is a round, with a ray to go on, one to a light, and the loops of textures.
        let to_light = if baked { in_tree } else { casters + in_tree };
        let passing = if s.sees_through == 0 { 1.0 } else { ROUNDS_OF_PASSING };
        let bounces = f64::from(s.bounces.min(s.rr_depth.saturating_add(LONGEST_ROULETTE)));
        // Down the tree over what shines, and up from what a ray has met.
        let levels = 2.0 * f64::from(packed.lighting.nodes.len().max(1).ilog2());
        let of_bounce = 1.0 + of_hit + to_light + levels + f64::from(s.lookups) * ROUNDS_OF_LOOKUP;
        return of_start + (bounces + 1.0) * passing * of_bounce;
    }
    let block = |samples: u32| {
        let shadows = CANDIDATES.min(casters) * (1.0 + f64::from(samples)) + in_tree * f64::from(samples);
        let lobes = f64::from(samples) * (2.0 + f64::from(s.exponent_bits));
        of_lists + shadows + lobes
    };
    let (blocks, rest) = (s.light_samples / SAMPLE_BLOCK, s.light_samples % SAMPLE_BLOCK);
    let area_light = f64::from(blocks) * block(SAMPLE_BLOCK) + if rest > 0 { block(rest) } else { 0.0 };
    let (area_lights, lights) = (f64::from(packed.counts.lights.x), f64::from(packed.counts.lights.y));
    let shading = area_lights * (1.0 + area_light) + (lights - area_lights) * (1.0 + block(1));
    let paths = if s.bounces == 0 { 1 } else { MAX_PATH_LEAVES };
    of_start + f64::from(paths) * (shading + (f64::from(s.bounces) + 1.0) * (1.0 + of_hit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pack::pack;
    use crate::records::Specialization;
    use wgray_scene::Scene;

    /// A scene of so many spheres and point lights.
    fn scene(spheres: usize, lights: usize) -> Packed {
        let sphere = "[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n";
        let light = "[[lights]]\ntype = 'point'\nposition = [0, 0, 3]\ncolor = [1, 1, 1]\n";
        let area = "[[lights]]\ntype = 'rectangle'\ncenter = [0, 0, 3]\nsize = [1, 1]\nnormal = [0, 0, -1]\n\
                    tangent = [1, 0, 0]\ncolor = [1, 1, 1]\n";
        let start = "image = { width = 4, height = 4 }\ncamera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }\n\
                     materials.m = { type = 'phong', color = [1, 1, 1] }\n";
        let text = format!("{start}{}{}{area}", sphere.repeat(spheres), light.repeat(lights));
        pack(&Scene::parse(&text, "s").unwrap())
    }

    #[test]
    fn longer_samples_come_in_shorter_calls() {
        let plain = samples_per_call(&scene(6, 0), false);
        assert!((100..65_535).contains(&plain), "{plain}");
        assert!(samples_per_call(&scene(6, 0), true) > plain);
        assert!(samples_per_call(&scene(100, 0), false) < plain);
        assert!(samples_per_call(&scene(6, 10), false) < plain);
        let changed = |change: fn(&mut Specialization)| {
            let mut packed = scene(6, 0);
            change(&mut packed.specialization);
            samples_per_call(&packed, false)
        };
        assert!(changed(|s| s.light_samples = 256) < plain);
        assert!(changed(|s| s.bounces = 8) < plain);
        // Of paths, more bounces.
        let path = |depth: u32| {
            let text = format!(
                "image = {{ width = 4, height = 4 }}\ncamera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}\n\
                 render = {{ integrator = 'path', max_depth = {depth}, rr_depth = 8 }}\n"
            );
            samples_per_call(&pack(&Scene::parse(&text, "s").unwrap()), false)
        };
        assert!(
            path(0) > path(5) && path(5) > path(100) && path(1024) > 100,
            "{} {}",
            path(5),
            path(1024)
        );
        // the ends of the ranges
        assert_eq!(changed(|s| s.light_samples = 65_536), 1);
        assert!(samples_per_call(&scene(70_000, 0), false) > 1, "they are in the tree");
        assert!(samples_per_call(&scene(0, 0), true) > 500);
    }
}
