//! Conservative shadow culling: a primitive whose bounding sphere is outside of the light frustum occludes no sample.

use glam::{UVec2, Vec3};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use wgray_trace::cpu::ray::vector_to_local;
use wgray_trace::cpu::shadow::{SampleBlock, light_frustum, may_block, occlusion_mask};
use wgray_trace::records::{ENVIRONMENT, Packed, RANDOM, Sphere};

use crate::random::Random;
use crate::random_scenes::any_scene;

fn generated_scenes(count: usize) -> Vec<Packed> {
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = any_scene::without_trees();
    let scene = |_| any_scene::packed(&strategy.new_tree(&mut runner).expect("a scene").current());
    (0..count).map(scene).collect()
}

/// Returns how many primitives are culled, and how many of them wrongly. Shaded points are at most 30 radii away, and
/// at most 200 units in local space, because rounding dominates at thousands of radii. `change_sphere` changes the
/// bounding spheres.
fn count_culled(scenes: &[Packed], change_sphere: impl Fn(Sphere) -> Sphere) -> (usize, usize) {
    let random = Random::new(11);
    let (mut culled, mut wrong) = (0, 0);
    for scene in scenes
        .iter()
        .filter(|scene| !scene.lighting.lights.is_empty() && !scene.primitives.is_empty())
    {
        for _ in 0..200 {
            let bounds = scene.bounds[random.below(scene.bounds.len() as u32) as usize];
            let t_max = random.pick(&[0.5, 1.0, 4.0, 30.0]) * bounds.radius;
            if t_max > 1e9 {
                continue; // the bounding sphere of a plane
            }
            let p = bounds.center + Vec3::from_array([(); 3].map(|()| random.between(-1.0, 1.0) as f32)) * t_max;
            let light = &scene.lighting.lights[random.below(scene.lighting.lights.len() as u32) as usize];
            if light.kind == ENVIRONMENT {
                continue; // an environment has no frustum
            }
            let frustum = light_frustum(light, p);
            let block = SampleBlock {
                pattern: RANDOM,
                side: 32,
                first: 0,
                count: 32,
                group: 0,
                key: UVec2::new(random.bits() as u32, random.bits() as u32),
            };
            let primitives = scene.primitives.iter().zip(&scene.bounds);
            for (q, sphere) in primitives.filter(|(q, _)| vector_to_local(q, p - q.anchor).length() < 200.0) {
                if !may_block(&change_sphere(*sphere), &frustum) {
                    culled += 1;
                    wrong += usize::from(occlusion_mask(q.kind, q, p, false, light, block) != 0);
                }
            }
        }
    }
    (culled, wrong)
}

#[test]
fn culled_primitives_occlude_nothing() {
    let scenes = generated_scenes(400);
    let (culled, wrong) = count_culled(&scenes, |sphere| sphere);
    println!("{culled} primitives were culled, {wrong} of them wrongly");
    assert!(culled > 10_000, "only {culled} primitives were culled");
    assert_eq!(wrong, 0);
    let shrink = |sphere: Sphere| Sphere {
        radius: 0.9 * sphere.radius,
        ..sphere
    };
    assert!(
        count_culled(&scenes, shrink).1 > 0,
        "spheres that are too small are not detected"
    );
}
