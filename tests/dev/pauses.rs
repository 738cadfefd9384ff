//! Rendering pauses while no viewer is connected.

use std::sync::Arc;
use std::time::Duration;

use wgray_dev::{Command, Preview, Report, Session, Settings};
use wgray_render::gpu::AdapterChoice;

use super::responsive::heavy;
use super::running::{Files, Running, SCENE, SETTLED};

#[test]
fn rendering_pauses_without_viewers() {
    let files = Files::new(&heavy());
    let settings = Settings {
        sources: files.sources(),
        device: AdapterChoice::Auto,
        out: None,
        only_for_viewers: true,
        editor: None,
        report: Box::new(|_| ()),
    };
    let running = Running {
        session: Session::start(settings).unwrap(),
    };
    running.wait("a kernel", |running| running.state().compile_seconds);
    std::thread::sleep(SETTLED);
    assert!(running.frame().is_none(), "a render runs without a viewer");
    let viewer = running.session.viewers().enter();
    running.wait("a first image", |running| running.frame());
    let other = running.session.viewers().enter();
    drop(viewer);
    let last = running.frame().unwrap();
    running.wait("more samples for the other viewer", |running| {
        (!Arc::ptr_eq(&running.frame()?, &last)).then_some(())
    });
    drop(other);
    std::thread::sleep(SETTLED);
    let last = running.frame().unwrap();
    assert!(!last.header.done, "the image is already complete");
    std::thread::sleep(Duration::from_secs(1));
    assert!(
        Arc::ptr_eq(&running.frame().unwrap(), &last),
        "rendering continued without viewers"
    );
    let _viewer = running.session.viewers().enter();
    running.wait("more samples", |running| {
        (!Arc::ptr_eq(&running.frame()?, &last)).then_some(())
    });
}

#[test]
fn the_time_to_an_image_contains_the_time_to_compile() {
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
    let running = Running {
        session: Session::start(settings).unwrap(),
    };
    // A viewer that connects after the compilation has not waited for it.
    running.wait("a kernel", |running| running.state().compile_seconds);
    std::thread::sleep(SETTLED);
    let _viewer = running.session.viewers().enter();
    running.wait_rendered(&files);
    files.tint(0.5);
    running.wait_rendered(&files);
    // A preview size that the viewer chooses is not reported as too large to display.
    running.session.send(Command::Preview(Preview::try_from(2).unwrap()));
    running.wait("a preview", |running| {
        (running.frame()?.header.finest == [20, 15]).then_some(())
    });
    drop(running);
    let mut images = 0;
    for report in reports {
        assert!(!matches!(report, Report::Smaller(..)), "{report:?}");
        if let Report::Reloaded { seconds, compiled } = report {
            assert!(
                compiled.is_none_or(|compiled| compiled <= seconds),
                "{compiled:?} of {seconds}"
            );
            images += 1;
        }
    }
    assert_eq!(images, 2);
}
