//! Saved files and camera moves do not wait for an image that takes minutes.

use std::time::{Duration, Instant};

use wgray_dev::{Command, Move};

use super::running::{Files, SCENE, TIMEOUT};

/// Returns a scene that takes minutes to render.
pub fn slow_scene() -> String {
    let large = SCENE
        .replace("width = 40", "width = 1200")
        .replace("height = 30", "height = 900");
    large.replace("count = 4 }", "count = 1024 }")
}

#[test]
fn a_save_or_a_move_does_not_wait_for_the_image() {
    let files = Files::new(&slow_scene());
    let session = files.start();
    let frame = session.wait("a first image", |session| session.frame());
    assert!(
        !frame.header.done && frame.header.sent[0] < 1200,
        "the first image is not coarse: {:?}",
        frame.header
    );
    let mut max_time = Duration::ZERO;
    for i in 0..4 {
        std::thread::sleep(Duration::from_millis(150));
        let revision = session.revision();
        let start = Instant::now();
        if i % 2 == 0 {
            files.write(
                "scene.toml",
                &slow_scene().replace("fov = 40", &format!("fov = {}", 50 + i)),
            );
        } else {
            session.inner.send(Command::Move(Move::Orbit(0.1, 0.0)));
        }
        session.wait("the next image", |session| {
            (session.revision() > revision).then_some(())
        });
        max_time = max_time.max(start.elapsed());
    }
    // The complete image takes minutes; the target for the next image is 0.3 s on an idle machine.
    assert!(max_time < Duration::from_secs(5), "{max_time:?}");
    assert!(!session.frame().unwrap().header.done);
}

#[test]
fn a_camera_in_constant_motion_is_shown() {
    let files = Files::new(&slow_scene());
    let session = files.start();
    session.wait("a first image", |session| session.frame());
    let revision = session.revision();
    let start = Instant::now();
    let mut images = 0;
    while images < 5 {
        assert!(start.elapsed() < TIMEOUT, "{images} images");
        session.inner.send(Command::Move(Move::Orbit(0.01, 0.0)));
        std::thread::sleep(Duration::from_millis(4));
        images = session.revision() - revision;
    }
}
