//! The development mode shows glTF files and reloads them when they are saved.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wgray::scene::Overrides;
use wgray_dev::{Command, Move, Sources};

use super::running::TestSession;
use crate::model::Model;

fn model(color: [f64; 3]) -> Model {
    Model {
        color,
        ..Model::default()
    }
}

const RED: [f64; 3] = [0.8, 0.05, 0.05];
const GREEN: [f64; 3] = [0.05, 0.8, 0.05];
const BLUE: [f64; 3] = [0.05, 0.05, 0.8];

fn start(folder: &Path, name: &str) -> TestSession {
    let sources = Sources {
        scene: folder.join(name),
        overrides: Overrides {
            size: Some((24, 16)),
            pixel_samples: Some(2),
            ..Overrides::default()
        },
        shaders: None,
    };
    TestSession::start(sources, None)
}

/// Waits for an image in which the large box, at the center, has the dominant channel of `color`.
fn wait_for(session: &TestSession, color: [f64; 3]) {
    let expected = color.map(|value| value > 0.5);
    session.wait("the image of the file", |session| {
        let frame = session.frame().filter(|frame| frame.header.done)?;
        let pixels = match &frame.content {
            wgray_dev::Content::Color(pixels) => &pixels.colors,
            _ => return None,
        };
        let center = pixels.get(11 * 24 + 12)?;
        let max = center.iter().fold(0.0_f32, |max, value| max.max(*value));
        let is_shown = center.map(|value| value == max && max > 0.0) == expected;
        (is_shown && session.state().problems.is_empty()).then_some(())
    });
}

#[test]
fn saving_a_model_updates_the_image() {
    let folder = TempDir::new().unwrap();
    let write = |color: [f64; 3]| model(color).write_glb(folder.path(), "box.glb");
    write(RED);
    let session = start(folder.path(), "box.glb");
    wait_for(&session, RED);
    // The file is overwritten in place, as exporters do, and then replaced by a rename.
    write(GREEN);
    wait_for(&session, GREEN);
    model(BLUE).write_glb(folder.path(), "new~");
    fs::rename(folder.path().join("new~"), folder.path().join("box.glb")).unwrap();
    wait_for(&session, BLUE);
    // An incomplete file is an error until its end is written.
    let complete = model(RED).glb();
    fs::write(folder.path().join("box.glb"), &complete[..complete.len() / 2]).unwrap();
    assert!(session.wait_for_problem().message.contains("box.glb: "));
    fs::write(folder.path().join("box.glb"), complete).unwrap();
    wait_for(&session, RED);
}

/// While a file grows byte by byte, no error is reported; the state reports that files are being read.
#[test]
fn incomplete_files_of_an_exporter_cause_no_error() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("box.glb");
    model(RED).write_glb(folder.path(), "box.glb");
    let session = start(folder.path(), "box.glb");
    wait_for(&session, RED);
    let complete = model(GREEN).glb();
    // On a busy machine, the writer may pause for so long that the incomplete file is read.
    let shows_no_error = (0..20).any(|_| {
        let [start, mut last_write] = [Instant::now(); 2];
        let (mut was_read, mut has_paused) = (false, false);
        fs::write(&path, "").unwrap();
        let mut file = fs::OpenOptions::new().append(true).open(&path).unwrap();
        for byte in complete.chunks(1) {
            file.write_all(byte).unwrap();
            has_paused |= last_write.elapsed() > Duration::from_millis(80);
            last_write = Instant::now();
            let state = session.state();
            was_read |= state.reading;
            if has_paused {
                break;
            }
            assert_eq!(state.problems, [], "after {:?}", start.elapsed());
            if was_read && start.elapsed() > Duration::from_millis(1500) {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        assert!(was_read || has_paused);
        fs::write(&path, &complete).unwrap();
        wait_for(&session, GREEN);
        !has_paused
    });
    assert!(shows_no_error);
}

#[test]
fn files_that_a_model_refers_to_are_watched() {
    let folder = TempDir::new().unwrap();
    model(RED).write_gltf(folder.path(), "box");
    let session = start(folder.path(), "box.gltf");
    wait_for(&session, RED);
    model(GREEN).write_gltf(folder.path(), "box");
    wait_for(&session, GREEN);
    // Without the buffer, an error is reported; with the buffer, the image returns.
    let buffer = folder.path().join("box.bin");
    let bytes = fs::read(&buffer).unwrap();
    fs::remove_file(&buffer).unwrap();
    assert!(session.wait_for_problem().message.contains("box.bin"));
    fs::write(&buffer, &bytes).unwrap();
    wait_for(&session, GREEN);
    let revision = session.revision();
    let scaled: Vec<u8> = bytes[..96]
        .chunks(4)
        .flat_map(|x| (f32::from_le_bytes([x[0], x[1], x[2], x[3]]) * 0.5).to_le_bytes())
        .collect();
    fs::write(&buffer, [&scaled, &bytes[96..]].concat()).unwrap();
    session.wait_for_complete_image(revision);
}

#[test]
fn the_camera_moves_but_is_not_saved_into_a_model() {
    let folder = TempDir::new().unwrap();
    model(RED).write_glb(folder.path(), "box.glb");
    let before = fs::read(folder.path().join("box.glb")).unwrap();
    let session = start(folder.path(), "box.glb");
    wait_for(&session, RED);
    let (initial, revision) = (session.colors(), session.revision());
    session.inner.send(Command::Move(Move::Orbit(0.5, 0.1)));
    session.wait_for_complete_image(revision);
    assert_ne!(session.colors(), initial);
    session.inner.send(Command::SaveCamera);
    session.wait("the error message", |session| {
        let text = format!("{:?}", session.state());
        text.contains("cannot save the camera: glTF files are read-only here")
            .then_some(())
    });
    assert_eq!(fs::read(folder.path().join("box.glb")).unwrap(), before);
}
