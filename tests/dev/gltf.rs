//! glTF files in the development mode: shown, and reloaded whenever they are saved.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wgray::scene::Overrides;
use wgray_dev::{Command, Move, Sources};

use super::running::Running;
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

fn start(folder: &Path, name: &str) -> Running {
    let sources = Sources {
        scene: folder.join(name),
        overrides: Overrides {
            size: Some((24, 16)),
            pixel_samples: Some(2),
            ..Overrides::default()
        },
        shaders: None,
    };
    Running::start(sources, None)
}

/// Waits for an image in which this channel is the strongest at the center, where the large box is.
fn wait_for(running: &Running, strongest: [f64; 3]) {
    let wanted = strongest.map(|value| value > 0.5);
    running.wait("the image of the file", |running| {
        let frame = running.frame().filter(|frame| frame.header.done)?;
        let pixels = match &frame.content {
            wgray_dev::Content::Color(pixels) => &pixels.colors,
            _ => return None,
        };
        let middle = pixels.get(11 * 24 + 12)?;
        let most = middle.iter().fold(0.0_f32, |most, value| most.max(*value));
        let is_shown = middle.map(|value| value == most && most > 0.0) == wanted;
        (is_shown && running.state().problems.is_empty()).then_some(())
    });
}

#[test]
fn saving_a_model_updates_the_image() {
    let folder = TempDir::new().unwrap();
    let write = |color: [f64; 3]| model(color).write_glb(folder.path(), "box.glb");
    write(RED);
    let running = start(folder.path(), "box.glb");
    wait_for(&running, RED);
    // Overwritten in place, as exporters do, then replaced by a rename.
    write(GREEN);
    wait_for(&running, GREEN);
    model(BLUE).write_glb(folder.path(), "new~");
    fs::rename(folder.path().join("new~"), folder.path().join("box.glb")).unwrap();
    wait_for(&running, BLUE);
    // An incomplete file is an error until the rest is written.
    let whole = model(RED).glb();
    fs::write(folder.path().join("box.glb"), &whole[..whole.len() / 2]).unwrap();
    assert!(running.wait_problem().message.contains("box.glb: "));
    fs::write(folder.path().join("box.glb"), whole).unwrap();
    wait_for(&running, RED);
}

/// Incomplete pieces cause no error; the state reports that files are being read.
#[test]
fn incomplete_files_of_an_exporter_cause_no_error() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("box.glb");
    model(RED).write_glb(folder.path(), "box.glb");
    let running = start(folder.path(), "box.glb");
    wait_for(&running, RED);
    let whole = model(GREEN).glb();
    // On a busy machine the writer may pause until the file seems complete.
    let shows_no_error = (0..20).any(|_| {
        let [start, mut written] = [Instant::now(); 2];
        let (mut was_read, mut has_paused) = (false, false);
        fs::write(&path, "").unwrap();
        let mut file = fs::OpenOptions::new().append(true).open(&path).unwrap();
        for byte in whole.chunks(1) {
            file.write_all(byte).unwrap();
            has_paused |= written.elapsed() > Duration::from_millis(80);
            written = Instant::now();
            let state = running.state();
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
        fs::write(&path, &whole).unwrap();
        wait_for(&running, GREEN);
        !has_paused
    });
    assert!(shows_no_error);
}

#[test]
fn files_that_a_model_refers_to_are_watched() {
    let folder = TempDir::new().unwrap();
    model(RED).write_gltf(folder.path(), "box");
    let running = start(folder.path(), "box.gltf");
    wait_for(&running, RED);
    model(GREEN).write_gltf(folder.path(), "box");
    wait_for(&running, GREEN);
    // Without the buffer an error is reported; with the buffer the image returns.
    let buffer = folder.path().join("box.bin");
    let bytes = fs::read(&buffer).unwrap();
    fs::remove_file(&buffer).unwrap();
    assert!(running.wait_problem().message.contains("box.bin"));
    fs::write(&buffer, &bytes).unwrap();
    wait_for(&running, GREEN);
    let revision = running.revision();
    let larger: Vec<u8> = bytes[..96]
        .chunks(4)
        .flat_map(|x| (f32::from_le_bytes([x[0], x[1], x[2], x[3]]) * 0.5).to_le_bytes())
        .collect();
    fs::write(&buffer, [&larger, &bytes[96..]].concat()).unwrap();
    running.wait_done(revision);
}

#[test]
fn the_camera_moves_but_is_not_saved_into_a_model() {
    let folder = TempDir::new().unwrap();
    model(RED).write_glb(folder.path(), "box.glb");
    let before = fs::read(folder.path().join("box.glb")).unwrap();
    let running = start(folder.path(), "box.glb");
    wait_for(&running, RED);
    let (still, revision) = (running.colors(), running.revision());
    running.session.send(Command::Move(Move::Orbit(0.5, 0.1)));
    running.wait_done(revision);
    assert_ne!(running.colors(), still);
    running.session.send(Command::SaveCamera);
    running.wait("the reason", |running| {
        let text = format!("{:?}", running.state());
        text.contains("cannot save the camera: glTF files are read-only here")
            .then_some(())
    });
    assert_eq!(fs::read(folder.path().join("box.glb")).unwrap(), before);
}
