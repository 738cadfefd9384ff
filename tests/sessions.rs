//! Sessions: after changes of camera and scene, images and packed scenes equal those of a new session bit for bit.

use std::sync::Arc;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use wgray::scene::{Assets, Description, Image, LoadOptions, SceneFormat, Texels};
use wgray::{
    Aov, Camera, CancelToken, Context, Device, Error, Options, Picture, ProgressiveRender, Scene, Session, Status,
};
use wgray_render::pack::{self, PackedShading, pack, pack_with};

use crate::adapter;
use crate::random_scenes::any_scene;
use crate::test_folder::TestFolder;

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

/// Returns the cameras of the scenes, and the same cameras moved by 1000 units along x.
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
fn scenes_with_edited_cameras_are_packed_like_new_scenes() {
    let descriptions = random_descriptions(14);
    let cameras = cameras(&descriptions);
    let (mut kept, mut moved) = (0, 0);
    for description in &descriptions {
        let scene = scene_of(description);
        let shading = PackedShading::of(&scene);
        let mut packed = pack_with(&scene, &shading);
        assert_eq!(packed, pack(&scene));
        for camera in &cameras {
            let edited = with_camera(&scene, *camera);
            if pack::origin(camera) == packed.origin {
                kept += 1;
                pack::set_camera(&mut packed, &edited);
            } else {
                moved += 1;
                packed = pack_with(&edited, &shading);
            }
            assert_eq!(packed, pack(&edited));
        }
    }
    assert!(kept > 100 && moved > 100, "{kept} origins kept, {moved} moved");
}

/// Returns the bits of the colors of all pixels.
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
    let mut previous: Option<Vec<u32>> = None;
    let mut changed_count = 0;
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
            let expected = wgray::render(&with_camera(scene, *camera), &options).expect("an image without a session");
            // The second image reuses the packed scene.
            for _ in 0..2 {
                let image = session.render(&options).expect("an image");
                assert_eq!(image, expected, "camera {i}");
            }
            let now = bits(&expected);
            changed_count += usize::from(previous.is_some_and(|previous| previous != now));
            previous = Some(now);
        }
    }
    assert!(changed_count > scene_count, "the images do not depend on the camera");
}

#[test]
fn images_of_a_session_equal_images_without_a_session_on_the_cpu() {
    check_session(&Device::Cpu, 8);
}

#[test]
fn images_of_a_session_equal_images_without_a_session_on_the_gpu() {
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
                let expected = wgray::render(scene, options).expect("an image without a session");
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
    let expected = wgray::render(&scene, &options).expect("an image without a session");
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

/// Compares all values. Pilot statistics can be NaN, which does not equal itself.
fn is_same(a: &Picture, b: &Picture) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

fn devices() -> Vec<Device> {
    let mut devices = vec![Device::Cpu];
    devices.extend(adapter::device().map(|_| Device::Gpu));
    devices
}

fn options_for(device: &Device) -> Options {
    Options {
        device: device.clone(),
        ..Options::default()
    }
}

/// The render is cancelled after different times, and continued.
#[test]
fn a_render_with_cancellations_equals_a_render_without() {
    for device in devices() {
        let count = if device == Device::Cpu { 6 } else { 2 };
        for description in random_descriptions(count) {
            let scene = Arc::new(scene_of(&description));
            let options = options_for(&device);
            let expected = wgray::render(&scene, &options).expect("an image");
            let mut session = Session::new(&Context::new(), Arc::clone(&scene));
            let mut render = session.start(&options, &CancelToken::new()).expect("a start");
            let black = render.snapshot();
            assert!(bits(&black).iter().all(|bits| *bits == 0), "the first image is black");
            assert_eq!((render.samples(), render.fraction()), (0, 0.0));
            let (mut picture, mut previous, mut pause) = (black, 0, 0);
            loop {
                let cancel = CancelToken::new();
                let status = std::thread::scope(|threads| {
                    threads.spawn(|| {
                        std::thread::sleep(Duration::from_micros(pause * 500));
                        cancel.cancel();
                    });
                    render.run(&cancel).expect("a step")
                });
                assert!(render.samples() >= previous && (0.0..=1.0).contains(&render.fraction()));
                previous = render.samples();
                render.snapshot_into(&mut picture);
                assert!(is_same(&picture, &render.snapshot()));
                if status == Status::Finished {
                    break;
                }
                assert_eq!(status, Status::Cancelled);
                pause += 1;
            }
            assert_eq!(render.fraction(), 1.0);
            assert!(is_same(&render.finish(), &expected));
            // The session can be used again.
            assert!(is_same(&session.render(&options).expect("an image"), &expected));
        }
    }
}

#[test]
fn added_samples_do_not_depend_on_when_they_are_added() {
    let text = "image = { width = 9, height = 7 }
camera = { position = [0, -5, 2], look_at = [0, 0, 0.5], fov = 40 }
render = { integrator = 'path', pixel_samples = 3 }
environment = { name = 'studio' }
materials.a = { type = 'diffuse', color = [0.5, 0.5, 0.5] }
shapes = [{ type = 'sphere', material = 'a', center = [0, 0, 0], radius = 1 }]";
    let scene = Arc::new(Scene::parse(text, "s.toml").expect("a scene"));
    let no_cancel = CancelToken::new();
    for device in devices() {
        let options = options_for(&device);
        let image = |additions: &[(bool, u32)]| {
            let mut session = Session::new(&Context::new(), Arc::clone(&scene));
            let mut render = session.start(&options, &no_cancel).expect("a start");
            for (runs_first, count) in additions {
                if *runs_first {
                    assert_eq!(render.run(&no_cancel).expect("samples"), Status::Finished);
                }
                render.add_samples(*count).expect("an addition");
            }
            assert_eq!(render.run(&no_cancel).expect("samples"), Status::Finished);
            assert_eq!(render.step(&no_cancel).expect("no samples"), Status::Finished);
            (render.samples(), render.finish().pixels())
        };
        let expected = image(&[(false, 5)]);
        assert_eq!(expected.0, 8);
        assert!(image(&[(true, 5)]) == expected);
        assert!(image(&[(true, 1), (false, 1), (true, 3)]) == expected);
        assert!(image(&[(true, 4)]).1 != expected.1);
        let mut session = Session::new(&Context::new(), Arc::clone(&scene));
        let mut render = session.start(&options, &no_cancel).expect("a start");
        let error = render.add_samples(65_534).unwrap_err().to_string();
        assert_eq!(error, "samples: 65537 in total must be at most 65536");
        assert!(render.add_samples(u32::MAX).is_err());
    }
    let adaptive = text.replace("pixel_samples = 3", "pixel_samples = 64, adaptive = { error = 0.01 }");
    let scene = Scene::parse(&adaptive, "s.toml").expect("a scene");
    let mut session = Session::new(&Context::new(), scene);
    let mut render = session.start(&options_for(&Device::Cpu), &no_cancel).expect("a start");
    assert!(render.add_samples(1).unwrap_err().to_string().contains("adaptive"));
}

/// Returns a scene with an environment map of 4096 x 2048 texels. Its preparation takes about a second.
fn large_environment() -> Arc<Scene> {
    let text = "image = { width = 8, height = 6 }
camera = { position = [0, -5, 2], look_at = [0, 0, 0.5], fov = 40 }
render = { integrator = 'path', pixel_samples = 1 }
environment = { file = 'map' }";
    let (width, height) = (4096, 2048);
    let texels = (0..width * height).map(|i| [(i % 251) as f32, 1.0, (i / width) as f32]);
    let image = Image {
        width,
        height,
        texels: Texels::Floats(texels.collect()),
    };
    let load_options = LoadOptions::new().with_image("map", image);
    Arc::new(Scene::from_slice(text.as_bytes(), SceneFormat::Toml, &load_options).expect("a scene"))
}

fn is_cancelled(result: Result<ProgressiveRender, Error>) -> bool {
    matches!(result, Err(Error::Render(wgray::error::RenderError::Cancelled)))
}

/// Starts a render and cancels it after 50 ms.
fn cancel_start(session: &mut Session, options: &Options) {
    let cancel = CancelToken::new();
    std::thread::scope(|threads| {
        threads.spawn(|| {
            std::thread::sleep(Duration::from_millis(50));
            cancel.cancel();
        });
        assert!(is_cancelled(session.start(options, &cancel)));
    });
}

#[test]
fn a_preparation_is_cancelled_at_once_and_used_later() {
    let scene = large_environment();
    for device in devices() {
        let options = options_for(&device);
        let mut session = Session::new(&Context::new(), Arc::clone(&scene));
        let cancel = CancelToken::new();
        cancel.cancel();
        assert!(is_cancelled(session.start(&options, &cancel)));
        let cancel = CancelToken::new();
        let (start, mut time_of_cancel) = (Instant::now(), Duration::ZERO);
        std::thread::scope(|threads| {
            threads.spawn(|| {
                std::thread::sleep(Duration::from_millis(50));
                time_of_cancel = start.elapsed();
                cancel.cancel();
            });
            assert!(is_cancelled(session.start(&options, &cancel)));
        });
        let delay = start.elapsed() - time_of_cancel;
        assert!(delay < Duration::from_millis(500), "cancelled after {delay:?}"); // usually 10 ms
        // The cancelled preparation continues. A later render uses the result, or drops it if the scene has changed.
        let no_cancel = CancelToken::new();
        let expected = wgray::render(&scene, &options).expect("an image");
        let mut render = session.start(&options, &no_cancel).expect("a start");
        assert_eq!(render.run(&no_cancel).expect("samples"), Status::Finished);
        assert!(is_same(&render.finish(), &expected));
        let mut second_session = Session::new(&Context::new(), Arc::clone(&scene));
        cancel_start(&mut second_session, &options);
        let mut camera = scene.camera;
        camera.position.x += 1.0;
        second_session.set_camera(camera).expect("a camera");
        let expected = wgray::render(&with_camera(&scene, camera), &options).expect("an image");
        assert!(is_same(&second_session.render(&options).expect("an image"), &expected));
    }
}

#[test]
fn renders_start_on_threads_of_a_pool() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let scene = Arc::new(scene_of(&random_descriptions(1)[0]));
    let options = options_for(&Device::Cpu);
    let expected = wgray::render(&scene, &options).expect("an image");
    let image = pool.install(|| {
        let mut session = Session::new(&Context::new(), Arc::clone(&scene));
        let no_cancel = CancelToken::new();
        let mut render = session.start(&options, &no_cancel).expect("a start");
        render.run(&no_cancel).expect("samples");
        render.finish().pixels()
    });
    assert!(image == expected.pixels());
}

/// Marks the child process of the test below.
const CHILD_VARIABLE: &str = "WGRAY_TEST_POOL_OF_ONE_THREAD";

/// The preparation needs the global pool of rayon, which has one thread in the child process.
#[test]
fn a_thread_of_the_pool_does_not_wait_for_a_cancelled_preparation() {
    let mut child = std::process::Command::new(std::env::current_exe().expect("this program"))
        .args([
            "--exact",
            "--nocapture",
            "sessions::a_render_on_the_only_thread_of_the_pool",
        ])
        .envs([(CHILD_VARIABLE, "1"), ("RAYON_NUM_THREADS", "1")])
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("the test program runs");
    let start = Instant::now();
    let status = loop {
        match child.try_wait().expect("the state of the child process") {
            None if start.elapsed() < Duration::from_secs(120) => std::thread::sleep(Duration::from_millis(20)),
            status => break status,
        }
    };
    if status.is_none() {
        child.kill().expect("the child process ends");
        child.wait().expect("the child process ends");
    }
    assert!(status.is_some_and(|status| status.success()), "{status:?}");
}

#[test]
fn a_render_on_the_only_thread_of_the_pool() {
    if std::env::var_os(CHILD_VARIABLE).is_none() {
        return; // only the child process has a pool of one thread
    }
    let scene = large_environment();
    let options = options_for(&Device::Cpu);
    let mut session = Session::new(&Context::new(), Arc::clone(&scene));
    cancel_start(&mut session, &options);
    let image = rayon::scope(|_| session.render(&options)).expect("an image");
    assert!(is_same(&image, &wgray::render(&scene, &options).expect("an image")));
}

/// Wakes the thread that waits in [`block_on`].
struct Unpark(std::thread::Thread);

impl std::task::Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

fn block_on<F: Future>(future: F) -> F::Output {
    let mut future = std::pin::pin!(future);
    let waker = Arc::new(Unpark(std::thread::current())).into();
    let mut context = std::task::Context::from_waker(&waker);
    loop {
        match future.as_mut().poll(&mut context) {
            std::task::Poll::Ready(output) => return output,
            std::task::Poll::Pending => std::thread::park(),
        }
    }
}

#[test]
fn futures_return_the_same_image_and_can_be_cancelled_and_dropped() {
    let scene = Arc::new(scene_of(&random_descriptions(1)[0]));
    for device in devices() {
        let options = options_for(&device);
        let expected = wgray::render(&scene, &options).expect("an image");
        let mut session = Session::new(&Context::new(), Arc::clone(&scene));
        let cancel = CancelToken::new();
        for _ in 0..2 {
            let image = block_on(session.render_async(&options, &cancel)).expect("an image");
            assert!(is_same(&image, &expected));
        }
        drop(session.render_async(&options, &cancel));
        assert!(!cancel.is_cancelled());
        assert!(is_same(&session.render(&options).expect("an image"), &expected));
        cancel.cancel();
        let cancelled = block_on(session.render_async(&options, &cancel));
        assert!(matches!(
            cancelled,
            Err(Error::Render(wgray::error::RenderError::Cancelled))
        ));
        assert!(is_same(&session.render(&options).expect("an image"), &expected));
        let invalid = Options {
            crop: Some(wgray::Region::whole(70_000, 1)),
            ..options
        };
        assert!(matches!(
            block_on(session.render_async(&invalid, &CancelToken::new())),
            Err(Error::Option(_))
        ));
    }
}

/// Collects the names of spans, and the field `reason` of events.
#[derive(Clone, Default)]
struct Recorder(Arc<std::sync::Mutex<Vec<String>>>);

impl<S: tracing::Subscriber> tracing_subscriber::Layer<S> for Recorder {
    fn on_new_span(
        &self,
        attributes: &tracing::span::Attributes,
        _: &tracing::Id,
        _: tracing_subscriber::layer::Context<S>,
    ) {
        self.0
            .lock()
            .expect("a list")
            .push(attributes.metadata().name().to_owned());
    }

    fn on_event(&self, event: &tracing::Event, _: tracing_subscriber::layer::Context<S>) {
        struct Reason(Option<String>);
        impl tracing::field::Visit for Reason {
            fn record_debug(&mut self, field: &tracing::field::Field, value: &dyn std::fmt::Debug) {
                if field.name() == "reason" {
                    self.0 = Some(format!("{value:?}"));
                }
            }
        }
        let mut reason = Reason(None);
        event.record(&mut reason);
        self.0.lock().expect("a list").extend(reason.0);
    }
}

#[test]
fn spans_cover_the_phases_and_the_device_has_a_reason() {
    use tracing_subscriber::prelude::*;
    // With only one subscriber, tracing uses the default subscriber of the thread that first enters a span. In other
    // tests, this thread has no subscriber.
    let _second = tracing::Dispatch::new(tracing_subscriber::registry());
    for (device, reason) in devices().into_iter().zip(["requested", "requested"]) {
        let recorder = Recorder::default();
        let subscriber = tracing_subscriber::registry().with(recorder.clone());
        tracing::subscriber::with_default(subscriber, || {
            // No other test uses this mesh.
            let folder = TestFolder::with_file("a.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
            let overrides = wgray::Overrides {
                size: Some((4, 3)),
                pixel_samples: Some(1),
                ..wgray::Overrides::default()
            };
            let scene = Scene::load_with(folder.path("a.obj"), &overrides).expect("a scene");
            let mut session = Session::new(&Context::new(), scene);
            // Spans of other threads belong to the same subscriber.
            let mut render = session
                .start(&options_for(&device), &CancelToken::new())
                .expect("a start");
            render.step(&CancelToken::new()).expect("a step");
        });
        let names = recorder.0.lock().expect("a list");
        let mut expected = vec!["load", "mesh", "pack", "bvh", "render"];
        if device != Device::Cpu {
            expected.push("compile");
        }
        for name in expected {
            assert!(names.iter().any(|found| found == name), "{name} is not in {names:?}");
        }
        assert!(names.iter().any(|found| found.contains(reason)), "{names:?}");
    }
}

#[test]
fn types_are_send_and_sync() {
    fn check<T: Send + Sync + 'static>() {}
    check::<Context>();
    check::<CancelToken>();
    check::<Picture>();
    check::<Scene>();
    check::<LoadOptions>();
    check::<Error>();
    fn check_send<T: Send>() {}
    check_send::<Session>();
    check_send::<ProgressiveRender>();
}
