//! Sessions: images, and packed scenes, have the bits of fresh ones after changes of camera and scene.

use std::sync::Arc;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use wgray::scene::{Assets, Description};
use wgray::{Aov, Camera, Context, Device, Options, Picture, Scene, Session};
use wgray_render::pack::{self, PackedShading, pack, pack_with};

use crate::adapter;
use crate::random_scenes::any_scene;

fn random_descriptions(count: usize) -> Vec<Description> {
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = any_scene::description();
    let scenes = (0..count).map(|_| strategy.new_tree(&mut runner).expect("a scene").current());
    scenes.collect()
}

fn scene_of(description: &Description) -> Scene {
    let assets = Assets::beside(any_scene::folder());
    (description.validate_with(&assets)).unwrap_or_else(|problem| panic!("{problem}"))
}

fn with_camera(scene: &Scene, camera: Camera) -> Scene {
    let mut scene = scene.clone();
    scene.camera = camera;
    scene
}

/// Cameras with every projection, and far targets.
fn cameras(descriptions: &[Description]) -> Vec<Camera> {
    let mut cameras: Vec<Camera> = descriptions.iter().map(|d| scene_of(d).camera).collect();
    for camera in cameras.clone() {
        let mut far = camera;
        far.position.x += 1000.0;
        far.look_at.x += 1000.0;
        cameras.push(far);
    }
    cameras
}

#[test]
fn edited_cameras_are_packed_like_fresh_ones() {
    let descriptions = random_descriptions(24);
    let cameras = cameras(&descriptions);
    let (mut kept, mut moved) = (0, 0);
    for description in &descriptions {
        let scene = scene_of(description);
        let (shading, texels) = PackedShading::of(&scene);
        let mut packed = pack_with(&scene, &shading, texels);
        assert_eq!(packed, pack(&scene));
        for camera in &cameras {
            let other = with_camera(&scene, *camera);
            if pack::origin(camera) == packed.origin {
                kept += 1;
                pack::set_camera(&mut packed, &other);
            } else {
                moved += 1;
                packed = pack_with(&other, &shading, packed.textures.texels);
            }
            assert_eq!(packed, pack(&other));
        }
    }
    assert!(kept > 100 && moved > 100, "{kept} origins kept, {moved} moved");
}

/// Returns the color and depth of all pixels.
fn bits(picture: &Picture) -> Vec<u32> {
    let colors = picture.pixels().colors.into_iter().flatten();
    colors.map(f32::to_bits).collect()
}

fn check_session(device: &Device, scene_count: usize) {
    let descriptions = random_descriptions(scene_count);
    let cameras = cameras(&descriptions[..3.min(scene_count)]);
    let scenes: Vec<Arc<Scene>> = descriptions.iter().map(|d| Arc::new(scene_of(d))).collect();
    let context = Context::new();
    let mut session = Session::new(&context, Arc::clone(&scenes[0]));
    let mut former: Option<Vec<u32>> = None;
    let mut changed = 0;
    for scene in &scenes {
        session.set_scene(Arc::clone(scene));
        for (i, camera) in cameras.iter().enumerate() {
            session.set_camera(*camera).expect("a working device");
            let options = Options {
                device: device.clone(),
                aovs: match i % 3 {
                    0 => vec![Aov::Depth],
                    1 if scene.render.integrator.has_layers() => vec![Aov::Albedo],
                    _ => Vec::new(),
                },
                ..Options::default()
            };
            let expected = wgray::render(&with_camera(scene, *camera), &options).expect("a fresh image");
            // The second image needs no packing at all.
            for _ in 0..2 {
                let image = session.render(&options).expect("an image");
                assert_eq!(image, expected, "camera {i}");
            }
            let now = bits(&expected);
            changed += usize::from(former.is_some_and(|former| former != now));
            former = Some(now);
        }
    }
    assert!(changed > scene_count, "the images do not depend on the camera");
}

#[test]
fn images_of_a_session_have_the_bits_of_fresh_images_on_the_cpu() {
    check_session(&Device::Cpu, 8);
}

#[test]
fn images_of_a_session_have_the_bits_of_fresh_images_on_the_gpu() {
    if adapter::device().is_some() {
        check_session(&Device::Gpu, 2);
    }
}

#[test]
fn sessions_of_a_context_work_at_the_same_time() {
    let scenes: Vec<Scene> = random_descriptions(4).iter().map(scene_of).collect();
    let context = Context::new();
    let device = match adapter::device() {
        Some(_) => Device::Gpu,
        None => Device::Cpu,
    };
    let options = Options {
        device,
        ..Options::default()
    };
    std::thread::scope(|threads| {
        for scene in &scenes {
            let (context, options) = (&context, &options);
            threads.spawn(move || {
                let expected = wgray::render(scene, options).expect("a fresh image");
                let mut session = Session::new(context, scene.clone());
                for _ in 0..3 {
                    assert_eq!(session.render(options).expect("an image"), expected);
                }
            });
        }
    });
}

/// An error leaves the session usable.
#[test]
fn a_session_survives_invalid_options() {
    let scene = scene_of(&random_descriptions(1)[0]);
    let options = Options {
        device: Device::Cpu,
        ..Options::default()
    };
    let expected = wgray::render(&scene, &options).expect("a fresh image");
    let mut session = Session::new(&Context::new(), scene);
    let invalid = [
        Options {
            crop: Some(wgray::Region {
                x0: 1,
                y0: 0,
                x1: 1,
                y1: 1,
            }),
            ..options.clone()
        },
        Options {
            device: Device::Named("no such adapter".to_owned()),
            ..options.clone()
        },
    ];
    for invalid in invalid {
        assert!(session.render(&invalid).is_err());
        assert_eq!(session.render(&options).expect("an image"), expected);
    }
}
