//! Rendering pauses while no viewer is connected.

use std::sync::Arc;
use std::time::Duration;

use wgray_dev::{Command, Preview, Report, Session, Settings};
use wgray_render::gpu::AdapterChoice;

use super::responsive::slow_scene;
use super::running::{Files, IDLE_TIME, SCENE, TestSession};

#[test]
fn rendering_pauses_without_viewers() {
    let files = Files::new(&slow_scene());
    let settings = Settings {
        sources: files.sources(),
        device: AdapterChoice::Auto,
        out: None,
        only_for_viewers: true,
        editor: None,
        report: Box::new(|_| ()),
    };
    let session = TestSession {
        inner: Session::start(settings).unwrap(),
    };
    session.wait("a kernel", |session| session.state().compile_seconds);
    std::thread::sleep(IDLE_TIME);
    assert!(session.frame().is_none(), "a render runs without a viewer");
    let viewer = session.inner.viewers().enter();
    session.wait("a first image", |session| session.frame());
    let second_viewer = session.inner.viewers().enter();
    drop(viewer);
    let last_frame = session.frame().unwrap();
    session.wait("more samples for the second viewer", |session| {
        (!Arc::ptr_eq(&session.frame()?, &last_frame)).then_some(())
    });
    drop(second_viewer);
    std::thread::sleep(IDLE_TIME);
    let last_frame = session.frame().unwrap();
    assert!(!last_frame.header.done, "the image is already complete");
    std::thread::sleep(Duration::from_secs(1));
    assert!(
        Arc::ptr_eq(&session.frame().unwrap(), &last_frame),
        "rendering continued without viewers"
    );
    let _viewer = session.inner.viewers().enter();
    session.wait("more samples", |session| {
        (!Arc::ptr_eq(&session.frame()?, &last_frame)).then_some(())
    });
}

#[test]
fn the_time_to_an_image_includes_the_time_to_compile() {
    let files = Files::new(SCENE);
    let (sender, reports) = std::sync::mpsc::channel();
    let settings = Settings {
        sources: files.sources(),
        device: AdapterChoice::Auto,
        out: None,
        only_for_viewers: true,
        editor: None,
        report: Box::new(move |report| drop(sender.send(report))),
    };
    let session = TestSession {
        inner: Session::start(settings).unwrap(),
    };
    // The viewer connects after the compilation, so its time to the first image does not include the compilation.
    session.wait("a kernel", |session| session.state().compile_seconds);
    std::thread::sleep(IDLE_TIME);
    let _viewer = session.inner.viewers().enter();
    session.wait_for_rendered_image(&files);
    files.tint(0.5);
    session.wait_for_rendered_image(&files);
    // A reduced size that the viewer requests is not reported as an image too large to display.
    session.inner.send(Command::Preview(Preview::try_from(2).unwrap()));
    session.wait("a preview", |session| {
        (session.frame()?.header.finest == [20, 15]).then_some(())
    });
    drop(session);
    let mut images = 0;
    for report in reports {
        assert!(!matches!(report, Report::ReducedImage(..)), "{report:?}");
        if let Report::Reloaded { seconds, compiled } = report {
            assert!(
                compiled.is_none_or(|compiled| compiled <= seconds),
                "compile time {compiled:?}, total time {seconds}"
            );
            images += 1;
        }
    }
    assert_eq!(images, 2);
}
