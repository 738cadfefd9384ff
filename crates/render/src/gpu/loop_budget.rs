//! Number of samples per dispatch for which software Vulkan truncates no loop.

use wgray_trace::records::{MAX_PATH_LEAVES, Packed, SAMPLE_BLOCK};

/// Number of iterations, summed over all loops of an invocation, after which Mesa 22.3's llvmpipe ends every loop. An
/// iteration counts if any lane executes the iteration.
const MAX_ITERATIONS: f64 = 65_535.0;
/// Estimated number of primitives that may occlude a block of light samples.
const CANDIDATES: f64 = 4.0;

/// Estimated iterations of a BVH traversal: nodes, leaves, triangles.
const TRAVERSAL_ITERATIONS: f64 = 150.0;

/// Bounces after which Russian roulette has ended nearly all paths: a reflectance of 95 % leaves 0.95^100 = 0.6 %.
const MAX_ROULETTE_BOUNCES: u32 = 100;

/// Estimated number of surfaces that a ray passes through because of their alpha before a hit.
const ALPHA_SKIPS: f64 = 4.0;
/// Estimated number of surfaces invisible to the camera that a camera ray passes through.
const CAMERA_SKIPS: f64 = 2.0;

/// Estimated iterations of a texture lookup.
const LOOKUP_ITERATIONS: f64 = 8.0;

/// Returns the estimated maximum number of samples per dispatch. A wrong estimate only costs time: truncated dispatches
/// are repeated with fewer samples, and an estimate that is too low causes more dispatches.
pub fn samples_per_dispatch(packed: &Packed, baked: bool) -> u32 {
    let samples = MAX_ITERATIONS / iterations_of_sample(packed, baked);
    (samples as u32).max(1)
}

/// Estimates a sample's loop iterations; at least 1.
fn iterations_of_sample(packed: &Packed, baked: bool) -> f64 {
    let features = &packed.specialization;
    let primitives = packed.kinds().map(|(_, range)| range.len()).sum::<usize>() as f64;
    let caster_counts = || packed.shadow_casters().map(|(_, range)| range.len());
    let blocks = caster_counts()
        .map(|count| count.div_ceil(SAMPLE_BLOCK as usize))
        .sum::<usize>() as f64;
    let casters = caster_counts().sum::<usize>() as f64;
    // Primitives in buffers are tested by loops, baked primitives by straight-line code.
    let (per_hit, per_block) = if baked {
        (0.0, blocks)
    } else {
        (primitives, blocks + casters)
    };
    let per_traversal = if features.tlas_kinds == 0 {
        0.0
    } else {
        TRAVERSAL_ITERATIONS
    };
    let per_hit = per_hit + per_traversal;
    // A camera ray searches again behind a surface that is invisible to the camera.
    let per_start = 1.0 + f64::from(features.camera_invisible) * (1.0 + per_hit) * CAMERA_SKIPS;
    if packed.integrator.follows_paths() {
        // Each bounce has a BSDF ray, a shadow ray and texture lookups.
        let per_shadow_ray = if baked { per_traversal } else { casters + per_traversal };
        let alpha_skips = if features.alpha_surfaces == 0 { 1.0 } else { ALPHA_SKIPS };
        let bounces = f64::from(
            features
                .bounces
                .min(features.rr_depth.saturating_add(MAX_ROULETTE_BOUNCES)),
        );
        // Light tree: descent to select an emitter, ascent for the PDF of a hit emitter.
        let levels = 2.0 * f64::from(packed.lighting.nodes.len().max(1).ilog2());
        let per_bounce = 1.0 + per_hit + per_shadow_ray + levels + f64::from(features.lookups) * LOOKUP_ITERATIONS;
        return per_start + (bounces + 1.0) * alpha_skips * per_bounce;
    }
    let block = |samples: u32| {
        let shadows = CANDIDATES.min(casters) * (1.0 + f64::from(samples)) + per_traversal * f64::from(samples);
        let lobes = f64::from(samples) * (2.0 + f64::from(features.exponent_bits));
        per_block + shadows + lobes
    };
    let (blocks, remainder) = (
        features.light_samples / SAMPLE_BLOCK,
        features.light_samples % SAMPLE_BLOCK,
    );
    let area_light = f64::from(blocks) * block(SAMPLE_BLOCK) + if remainder > 0 { block(remainder) } else { 0.0 };
    let (area_lights, lights) = (f64::from(packed.counts.lights.x), f64::from(packed.counts.lights.y));
    let shading = area_lights * (1.0 + area_light) + (lights - area_lights) * (1.0 + block(1));
    let paths = if features.bounces == 0 { 1 } else { MAX_PATH_LEAVES };
    per_start + f64::from(paths) * (shading + (f64::from(features.bounces) + 1.0) * (1.0 + per_hit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pack::pack;
    use wgray_scene::Scene;
    use wgray_trace::records::Specialization;

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
    fn more_iterations_per_sample_give_fewer_samples_per_dispatch() {
        let plain = samples_per_dispatch(&scene(6, 0), false);
        assert!((100..65_535).contains(&plain), "{plain}");
        assert!(samples_per_dispatch(&scene(6, 0), true) > plain);
        assert!(samples_per_dispatch(&scene(100, 0), false) < plain);
        assert!(samples_per_dispatch(&scene(6, 10), false) < plain);
        let changed = |change: fn(&mut Specialization)| {
            let mut packed = scene(6, 0);
            change(&mut packed.specialization);
            samples_per_dispatch(&packed, false)
        };
        assert!(changed(|s| s.light_samples = 256) < plain);
        assert!(changed(|s| s.bounces = 8) < plain);
        let path = |depth: u32| {
            let text = format!(
                "image = {{ width = 4, height = 4 }}\ncamera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}\n\
                 render = {{ integrator = 'path', max_depth = {depth}, rr_depth = 8 }}\n"
            );
            samples_per_dispatch(&pack(&Scene::parse(&text, "s").unwrap()), false)
        };
        assert!(
            path(0) > path(5) && path(5) > path(100) && path(1024) > 100,
            "{} {}",
            path(5),
            path(1024)
        );
        assert_eq!(changed(|s| s.light_samples = 65_536), 1);
        assert!(
            samples_per_dispatch(&scene(70_000, 0), false) > 1,
            "the spheres are not in the BVH"
        );
        assert!(samples_per_dispatch(&scene(0, 0), true) > 500);
    }
}
