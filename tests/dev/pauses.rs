//! Nothing is rendered while nobody looks.

use std::sync::Arc;
use std::time::Duration;

use wgray::dev::{Session, Settings};
use wgray::gpu::Choice;

use super::responsive::heavy;
use super::running::{Files, Running, SETTLED};

#[test]
fn rendering_rests_while_nobody_looks() {
    let files = Files::new(&heavy());
    let settings = Settings {
        sources: files.sources(),
        device: Choice::Auto,
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
    assert!(running.frame().is_none(), "nobody looks");
    let viewer = running.session.viewers().enter();
    running.wait("a first picture", |running| running.frame());
    let other = running.session.viewers().enter();
    drop(viewer);
    let last = running.frame().unwrap();
    running.wait("more of it for the other", |running| {
        (!Arc::ptr_eq(&running.frame()?, &last)).then_some(())
    });
    drop(other);
    std::thread::sleep(SETTLED);
    let last = running.frame().unwrap();
    assert!(!last.header.done, "there is more to do");
    std::thread::sleep(Duration::from_secs(1));
    assert!(Arc::ptr_eq(&running.frame().unwrap(), &last), "it rests");
    let _viewer = running.session.viewers().enter();
    running.wait("more of it", |running| {
        (!Arc::ptr_eq(&running.frame()?, &last)).then_some(())
    });
}
