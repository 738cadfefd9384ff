//! Viewers behind slow connections receive recent frames.

use std::time::{Duration, Instant};

use serde_json::json;
use wgray_dev::{Command, Move};

use super::running::{Files, SCENE, serve};
use super::viewer::{Received, Viewer};

/// Returns a scene with noisy frames, which PNG hardly compresses.
fn noisy_scene() -> String {
    SCENE
        .replace("width = 40", "width = 320")
        .replace("height = 30", "height = 240")
        .replace(
            "[render]",
            "[render]\nintegrator = \"path\"\nbackground = [0.1, 0.2, 0.4]",
        )
        .replace(
            "pixel_samples = { pattern = \"grid\", count = 4 }",
            "pixel_samples = { pattern = \"jittered\", count = 64 }",
        )
}

#[test]
fn at_most_two_frames_are_in_flight_and_the_next_frame_is_the_newest() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (session, address) = serve(session);
    let mut viewer = Viewer::new(address);
    let mut frames = Vec::new();
    let mut reported_frame = 0;
    for _ in 0..6 {
        let revision = session.revision();
        session.inner.send(Command::Move(Move::Orbit(0.1, 0.0)));
        session.wait_for_complete_image(revision);
    }
    // A viewer that acknowledges no frames receives two frames and every state.
    let newest_frame = session.state().frame;
    while reported_frame < newest_frame {
        match viewer.receive().unwrap() {
            Received::Frame(header, _) => frames.push(header),
            Received::Text(message) => reported_frame = message["state"]["frame"].as_u64().unwrap_or(reported_frame),
        }
    }
    viewer.set_timeout(Duration::from_secs(2));
    while let Some(message) = viewer.receive() {
        if let Received::Frame(header, _) = message {
            frames.push(header);
        }
    }
    assert_eq!(frames.len(), 2, "{frames:?}");
    // One acknowledgement permits one frame, the newest.
    viewer.acknowledge(&frames[0]);
    let next = loop {
        if let Received::Frame(header, _) = viewer.receive().expect("a frame") {
            break header;
        }
    };
    assert_eq!(next["number"], json!(session.frame().unwrap().header.number));
}

#[test]
fn a_slow_connection_does_not_delay_camera_moves() {
    const RATE: f64 = 30_000.0; // bytes per second
    let files = Files::new(&noisy_scene());
    let session = files.start();
    session.wait("a first image", |session| session.frame());
    let (session, address) = serve(session);
    let mut viewer = Viewer::slow(address, RATE);
    let mut sender = viewer.sender();
    let camera_mover = std::thread::spawn(move || {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(5) {
            sender
                .send_text(json!({ "move": { "orbit": [0.02, 0.0] } }).to_string().as_bytes())
                .unwrap();
            std::thread::sleep(Duration::from_millis(40));
        }
    });
    let mut max_size = 0;
    while !camera_mover.is_finished() {
        match viewer.receive().unwrap() {
            Received::Frame(header, size) => {
                max_size = max_size.max(size);
                viewer.acknowledge(&header);
            }
            Received::Text(_) => {}
        }
    }
    let start = Instant::now();
    let executed = session.state().executed;
    loop {
        match viewer.receive().unwrap() {
            Received::Frame(header, size) => {
                max_size = max_size.max(size); // frames are finer, and thus larger, when the camera is at rest
                viewer.acknowledge(&header);
            }
            Received::Text(message) if message["state"]["executed"].as_u64() >= Some(executed) => break,
            Received::Text(_) => {}
        }
    }
    let two_frames = Duration::from_secs_f64(2.0 * max_size as f64 / RATE);
    assert!(max_size > 4_000, "frames are too small for a slow transfer: {max_size}");
    assert!(
        start.elapsed() < two_frames + Duration::from_secs(1),
        "{:?}",
        start.elapsed()
    );
}
