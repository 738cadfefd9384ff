//! The camera, the views of an image, the comparison with the CPU, and the output file.

use std::fs;

use wgray_dev::{Against, Command, Content, Move, View};
use wgray_image::Region;
use wgray_render::backend::Backend as _;
use wgray_render::cpu::Cpu;

use super::running::{Files, IDLE_TIME, KERNEL, RADIANCE, SCENE, TestSession};

#[test]
fn the_camera_moves_and_is_saved_without_another_render() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    assert!(!session.state().camera_moved);
    for motion in [Move::Orbit(0.4, 0.2), Move::Pan(0.1, -0.1), Move::Dolly(0.3)] {
        let revision = session.revision();
        session.inner.send(Command::Move(motion));
        session.wait_for_complete_image(revision);
    }
    session.inner.send(Command::Move(Move::Orbit(-0.1, 0.0)));
    session.inner.send(Command::View(View::Normal));
    session.inner.send(Command::View(View::Color));
    let finished_revision = |session: &TestSession| {
        let frame = session.frame()?;
        (frame.header.done && frame.header.view == View::Color).then_some(frame.header.revision)
    };
    std::thread::sleep(IDLE_TIME);
    session.wait("a finished image", finished_revision);
    let state = session.state();
    assert!(state.camera_moved);
    // A scene file with the text of the moved camera gives the displayed image.
    let files_of_moved_camera = {
        let (start, end) = (SCENE.find("[camera]").unwrap(), SCENE.find("[render]").unwrap());
        Files::new(&format!("{}{}\n{}", &SCENE[..start], state.camera, &SCENE[end..]))
    };
    assert_eq!(session.colors(), files_of_moved_camera.rendered_image());
    let (shown, revision) = (session.colors(), session.revision());
    session.inner.send(Command::SaveCamera);
    session.wait("the saved camera", |session| {
        (!session.state().camera_moved).then_some(())
    });
    assert_eq!(files.rendered_image(), shown);
    let saved = files.read("scene.toml");
    for text in [
        "# a small scene\n",
        "[camera] # looks from the front\n",
        "] # a comment\n",
        "fov = 40\n",
    ] {
        assert!(saved.contains(text), "{saved}");
    }
    let notice = session.state().notice.clone().unwrap();
    assert!(!notice.bad && notice.text.contains("scene.toml"), "{}", notice.text);
    std::thread::sleep(IDLE_TIME);
    assert_eq!(session.revision(), revision, "the image was rendered again");
    // Undo restores the text of the file, but not the camera of the displayed image.
    assert_eq!(session.state().undo.as_deref(), Some("camera"));
    session.inner.send(Command::UndoWrite);
    session.wait("the original file", |session| {
        (session.state().camera_moved && session.state().undo.is_none()).then_some(())
    });
    assert_eq!(files.read("scene.toml"), SCENE);
    std::thread::sleep(IDLE_TIME);
    assert_eq!((session.colors(), session.state().camera_moved), (shown, true));
    session.inner.send(Command::UndoWrite);
    session.inner.send(Command::SaveCamera);
    session.wait("the saved camera", |session| {
        (!session.state().camera_moved).then_some(())
    });
    assert_eq!(files.read("scene.toml"), saved);
}

#[test]
fn a_moved_camera_stays_until_its_position_in_the_file_is_edited() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let before = session.revision();
    session.inner.send(Command::Move(Move::Orbit(0.4, 0.2)));
    session.wait_for_complete_image(before);
    let moved = session.state().camera.clone();
    files.edit("scene.toml", "fov = 40", "fov = 44");
    let expected_camera = moved.replace("fov = 40", "fov = 44");
    session.wait("the moved camera with the edited field of view", |session| {
        (session.state().camera == expected_camera).then_some(())
    });
    assert!(session.state().camera_moved);
    files.edit("scene.toml", "position = [0, -4, 1]", "position = [0, -5, 1]");
    session.wait_for_rendered_image(&files);
    assert!(!session.state().camera_moved, "the camera still counts as moved");
}

#[test]
fn the_views_show_the_first_hits() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let packed = files.packed();
    let expected = Cpu::new(&packed).first_hits(Region::whole(40, 30)).unwrap();
    for view in [View::Normal, View::Depth, View::Uv, View::Primitive] {
        session.inner.send(Command::View(view));
        let frame = session.wait("the view", |session| {
            session
                .frame()
                .filter(|frame| frame.header.view == view && frame.header.done)
        });
        let Content::Hits(_, hits) = &frame.content else {
            panic!("{:?}", frame.content)
        };
        assert_eq!(*hits, expected);
        let values = frame.pixel(20, 15).unwrap();
        assert!(
            values.contains(&("on", "shapes[0]".to_string())) && values.contains(&("material", "red".to_string())),
            "{values:?}"
        );
    }
    session.inner.send(Command::View(View::Samples));
    let frame = session.wait("the sample counts", |session| {
        session.frame().filter(|frame| frame.header.view == View::Samples)
    });
    assert!(matches!(&frame.content, Content::Samples(counts, 4) if counts.iter().all(|count| *count == 4)));
    session.inner.send(Command::View(View::Color));
    session.wait_for_rendered_image(&files);
}

#[test]
fn another_view_shows_the_samples_of_a_paused_render() {
    // The complete image takes minutes, but each pixel soon has a sample.
    let slow = SCENE
        .replace("width = 40", "width = 120")
        .replace("height = 30", "height = 90");
    let files = Files::new(&slow.replacen("count = 4", "count = 65536", 1));
    let session = files.start();
    session.wait("samples of all pixels", |session| {
        session.frame().filter(|frame| frame.header.samples > 0)
    });
    session.inner.send(Command::Pause(true));
    session.wait("the end of rendering", |session| {
        let state = session.state();
        (state.paused && !state.busy).then_some(())
    });
    session.inner.send(Command::View(View::Samples));
    let frame = session.wait("the sample counts", |session| {
        session.frame().filter(|frame| frame.header.view == View::Samples)
    });
    assert!(frame.header.samples > 0 && !frame.header.done);
    std::thread::sleep(IDLE_TIME);
    assert_eq!(
        session.frame().unwrap().header.number,
        frame.header.number,
        "the view was rendered again"
    );
}

#[test]
fn the_cpu_agrees_until_a_shader_is_changed() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    session.inner.send(Command::View(View::Compare(Against::Cpu)));
    let differing = |session: &TestSession| {
        session
            .frame()
            .filter(|frame| frame.header.done)
            .and_then(|frame| frame.header.differing)
    };
    assert_eq!(session.wait("a comparison", differing), (0, 0.0));
    files.edit(KERNEL, RADIANCE, &format!("({RADIANCE} + vec4f(0.25, 0.0, 0.0, 0.0))"));
    let (pixels, max_difference) = session.wait("a difference", |session| {
        differing(session).filter(|(pixels, _)| *pixels > 0)
    });
    assert!(pixels > 100, "{pixels}");
    assert!((max_difference - 0.25).abs() < 1e-5, "{max_difference}");
    let Content::Compare(gpu, cpu) = &session.frame().unwrap().content else {
        panic!()
    };
    assert_ne!(gpu, cpu);
}

#[test]
fn the_output_file_contains_the_finished_image() {
    let files = Files::new(SCENE);
    let out = files.path("pictures.png");
    let session = TestSession::start(files.sources(), Some(out.clone()));
    for fov in [40, 50] {
        files.write("scene.toml", &SCENE.replace("fov = 40", &format!("fov = {fov}")));
        session.wait_for_rendered_image(&files);
        let expected: Vec<u8> = session
            .colors()
            .colors
            .iter()
            .flat_map(|color| color.map(wgray::image::encode))
            .collect();
        session.wait("the output file", |_| {
            let picture = image::open(&out).ok()?.into_rgb8();
            (picture.dimensions() == (40, 30) && *picture.as_raw() == expected).then_some(())
        });
    }
    // Writing the image triggers no reload, and no temporary file remains.
    let mut names: Vec<_> = fs::read_dir(files.folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["pictures.png", "scene.toml", "shaders"]);
}
