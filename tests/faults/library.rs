//! The library with a Vulkan driver that loses its device. The library renders in a child process, because environment
//! variables select the driver.

use std::ops::ControlFlow;
use std::process::Command;

use wgray::error::RenderError;
use wgray::{CancelToken, Context, Device, Error, Options, Picture, Scene, Session, Status};

use crate::test_folder::TestFolder;

use super::driver::{SCENE, driver};

/// Environment variable of the child process: the path of the scene file.
const SCENE_VARIABLE: &str = "WGRAY_TEST_FAULTS_SCENE";

fn render(scene: &Scene, device: Device) -> Picture {
    let options = Options {
        device,
        ..Options::default()
    };
    wgray::render(scene, &options).expect("an image")
}

/// Renders in the child process that [`images_survive_device_losses`] starts.
#[test]
fn render_in_the_child_process() {
    let Ok(file) = std::env::var(SCENE_VARIABLE) else {
        return;
    };
    let scene = Scene::load(&file).expect("a scene");
    let expected = render(&scene, Device::Cpu);
    let picture = render(&scene, Device::Gpu);
    assert!(picture.device().name.starts_with("llvmpipe"));
    assert_eq!(picture.pixels(), expected.pixels());
    // The callback copies the image after each dispatch.
    let options = Options {
        device: Device::Gpu,
        ..Options::default()
    };
    let mut callbacks = 0;
    let progressive = wgray::render_progressive(&scene, &options, &mut |progress| {
        progress.picture()?;
        callbacks += 1;
        Ok(ControlFlow::Continue(()))
    });
    assert_eq!(progressive.expect("an image").pixels(), expected.pixels());
    assert!(callbacks > 0);
}

/// Renders in the child process that [`a_step_after_a_permanent_loss_opens_the_device_again`] starts.
#[test]
fn steps_in_the_child_process() {
    let Ok(file) = std::env::var(SCENE_VARIABLE) else {
        return;
    };
    let scene = Scene::load(&file).expect("a scene");
    let expected = render(&scene, Device::Cpu);
    let options = Options {
        device: Device::Gpu,
        ..Options::default()
    };
    let cancel = CancelToken::new();
    let mut session = Session::new(&Context::new(), scene);
    let mut progressive = session.start(&options, &cancel).expect("a render");
    let lost = progressive.run(&cancel);
    assert!(matches!(lost, Err(Error::Render(RenderError::Lost { .. }))), "{lost:?}");
    assert_eq!(progressive.run(&cancel).expect("samples"), Status::Finished);
    assert_eq!(progressive.finish().pixels(), expected.pixels());
}

/// The device is lost, and three attempts to open it fail.
#[test]
fn a_step_after_a_permanent_loss_opens_the_device_again() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    let log = folder.path("log");
    let output = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "--nocapture", "faults::library::steps_in_the_child_process"])
        .envs(driver.environment(&log))
        .env(SCENE_VARIABLE, folder.path("scene.toml"))
        .envs([("FAULTS_LOSE", "2"), ("FAULTS_REFUSE", "3")])
        .output()
        .expect("the test program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let log = std::fs::read_to_string(&log).expect("the driver's log");
    assert_eq!(log.matches("device refused").count(), 3, "{log}");
}

#[test]
fn images_survive_device_losses() {
    let Some(driver) = driver() else { return };
    let folder = TestFolder::with_scene(SCENE);
    // Submit 2 renders samples of the first image, which needs 6 submits because of this loss. Submit 7 renders samples
    // of the second image, and submit 10 is a readback.
    for (lost_submits, losses) in [("2", 1), ("2,7,10", 3), ("999", 0)] {
        let log = folder.path("log");
        let _ = std::fs::remove_file(&log); // the log of the previous run
        let output = Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", "--nocapture", "faults::library::render_in_the_child_process"])
            .envs(driver.environment(&log))
            .env(SCENE_VARIABLE, folder.path("scene.toml"))
            .envs([("FAULTS_LOSE", lost_submits), ("FAULTS_LOSE_IN", "wait")])
            .output()
            .expect("the test program runs");
        assert!(
            output.status.success(),
            "{lost_submits}: {}",
            String::from_utf8_lossy(&output.stdout)
        );
        // wgpu panics at each loss, and the child process prints these panics because it installs no panic hook.
        let panics = String::from_utf8_lossy(&output.stderr)
            .matches("Error in Device::poll")
            .count();
        assert_eq!(panics, losses, "{lost_submits}");
        let log = std::fs::read_to_string(&log).expect("the driver's log");
        assert_eq!(log.matches("lost").count(), losses, "{lost_submits}: {log}");
        assert!(log.contains("submit 7\n"), "{lost_submits}: {log}");
    }
}
