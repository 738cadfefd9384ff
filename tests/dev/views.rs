//! The camera, the views of an image, the comparison with the CPU, and the output file.

use std::fs;

use wgray_dev::{Against, Command, Content, Move, View};
use wgray_image::Region;
use wgray_render::backend::Backend as _;
use wgray_render::cpu::Cpu;

use super::running::{Files, KERNEL, RADIANCE, Running, SCENE, SETTLED};

#[test]
fn the_camera_moves_and_is_saved_without_a_flicker() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    assert!(!running.state().camera_moved);
    for by in [Move::Orbit(0.4, 0.2), Move::Pan(0.1, -0.1), Move::Dolly(0.3)] {
        let revision = running.revision();
        running.session.send(Command::Move(by));
        running.wait_done(revision);
    }
    running.session.send(Command::Move(Move::Orbit(-0.1, 0.0)));
    running.session.send(Command::View(View::Normal));
    running.session.send(Command::View(View::Color));
    let settled = |running: &Running| {
        let frame = running.frame()?;
        (frame.header.done && frame.header.view == View::Color).then_some(frame.header.revision)
    };
    std::thread::sleep(SETTLED);
    running.wait("a finished image", settled);
    let state = running.state();
    assert!(state.camera_moved);
    // The camera's text gives the displayed image.
    let from_text = {
        let (start, end) = (SCENE.find("[camera]").unwrap(), SCENE.find("[render]").unwrap());
        Files::new(&format!("{}{}\n{}", &SCENE[..start], state.camera, &SCENE[end..]))
    };
    assert_eq!(running.colors(), from_text.rendered());
    let (shown, revision) = (running.colors(), running.revision());
    running.session.send(Command::SaveCamera);
    running.wait("the camera to be the file's", |running| {
        (!running.state().camera_moved).then_some(())
    });
    assert_eq!(files.rendered(), shown);
    let saved = files.read("scene.toml");
    for text in [
        "# a small scene\n",
        "[camera] # looks from the front\n",
        "] # a comment\n",
        "fov = 40\n",
    ] {
        assert!(saved.contains(text), "{saved}");
    }
    let notice = running.state().notice.clone().unwrap();
    assert!(!notice.bad && notice.text.contains("scene.toml"), "{}", notice.text);
    std::thread::sleep(SETTLED);
    assert_eq!(running.revision(), revision, "the image was rendered again");
    // Undoing restores the text, but not the view.
    assert_eq!(running.state().undo.as_deref(), Some("camera"));
    running.session.send(Command::UndoWrite);
    running.wait("the original file", |running| {
        (running.state().camera_moved && running.state().undo.is_none()).then_some(())
    });
    assert_eq!(files.read("scene.toml"), SCENE);
    std::thread::sleep(SETTLED);
    assert_eq!((running.colors(), running.state().camera_moved), (shown, true));
    running.session.send(Command::UndoWrite);
    running.session.send(Command::SaveCamera);
    running.wait("the camera to be the file's", |running| {
        (!running.state().camera_moved).then_some(())
    });
    assert_eq!(files.read("scene.toml"), saved);
}

#[test]
fn an_edit_of_the_file_changes_only_the_edited_keys_of_a_moved_camera() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let before = running.revision();
    running.session.send(Command::Move(Move::Orbit(0.4, 0.2)));
    running.wait_done(before);
    let moved = running.state().camera.clone();
    files.edit("scene.toml", "fov = 40", "fov = 44");
    let wide = moved.replace("fov = 40", "fov = 44");
    running.wait("the moved camera with another field", |running| {
        (running.state().camera == wide).then_some(())
    });
    assert!(running.state().camera_moved);
    files.edit("scene.toml", "position = [0, -4, 1]", "position = [0, -5, 1]");
    running.wait_rendered(&files);
    assert!(!running.state().camera_moved, "a part of the move is left");
}

#[test]
fn the_views_show_the_first_hits() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let packed = files.packed();
    let wanted = Cpu::new(&packed).first_hits(Region::whole(40, 30)).unwrap();
    for view in [View::Normal, View::Depth, View::Uv, View::Primitive] {
        running.session.send(Command::View(view));
        let frame = running.wait("the view", |running| {
            running
                .frame()
                .filter(|frame| frame.header.view == view && frame.header.done)
        });
        let Content::Hits(_, hits) = &frame.content else {
            panic!("{:?}", frame.content)
        };
        assert_eq!(*hits, wanted);
        let values = frame.pixel(20, 15).unwrap();
        assert!(
            values.contains(&("on", "shapes[0]".to_string())) && values.contains(&("material", "red".to_string())),
            "{values:?}"
        );
    }
    running.session.send(Command::View(View::Samples));
    let frame = running.wait("the counts", |running| {
        running.frame().filter(|frame| frame.header.view == View::Samples)
    });
    assert!(matches!(&frame.content, Content::Samples(counts, 4) if counts.iter().all(|count| *count == 4)));
    running.session.send(Command::View(View::Color));
    running.wait_rendered(&files);
}

#[test]
fn another_view_shows_the_samples_of_a_paused_render() {
    // Takes minutes, but soon has a sample of each pixel.
    let long = SCENE
        .replace("width = 40", "width = 120")
        .replace("height = 30", "height = 90");
    let files = Files::new(&long.replacen("count = 4", "count = 65536", 1));
    let running = files.start();
    running.wait("samples of all pixels", |running| {
        running.frame().filter(|frame| frame.header.samples > 0)
    });
    running.session.send(Command::Pause(true));
    running.wait("the end of rendering", |running| {
        let state = running.state();
        (state.paused && !state.busy).then_some(())
    });
    running.session.send(Command::View(View::Samples));
    let frame = running.wait("the counts", |running| {
        running.frame().filter(|frame| frame.header.view == View::Samples)
    });
    assert!(frame.header.samples > 0 && !frame.header.done);
    std::thread::sleep(SETTLED);
    assert_eq!(
        running.frame().unwrap().header.number,
        frame.header.number,
        "the view was rendered again"
    );
}

#[test]
fn the_cpu_agrees_until_a_shader_is_changed() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    running.session.send(Command::View(View::Compare(Against::Cpu)));
    let compared = |running: &Running| {
        running
            .frame()
            .filter(|frame| frame.header.done)
            .and_then(|frame| frame.header.differing)
    };
    assert_eq!(running.wait("a comparison", compared), (0, 0.0));
    files.edit(KERNEL, RADIANCE, &format!("({RADIANCE} + vec4f(0.25, 0.0, 0.0, 0.0))"));
    let (pixels, largest) = running.wait("a difference", |running| {
        compared(running).filter(|(pixels, _)| *pixels > 0)
    });
    assert!(pixels > 100, "{pixels}");
    assert!((largest - 0.25).abs() < 1e-5, "{largest}");
    let Content::Compare(gpu, cpu) = &running.frame().unwrap().content else {
        panic!()
    };
    assert_ne!(gpu, cpu);
}

#[test]
fn the_output_file_is_the_finished_image() {
    let files = Files::new(SCENE);
    let out = files.path("pictures.png");
    let running = Running::start(files.sources(), Some(out.clone()));
    for fov in [40, 50] {
        files.write("scene.toml", &SCENE.replace("fov = 40", &format!("fov = {fov}")));
        running.wait_rendered(&files);
        let wanted: Vec<u8> = running
            .colors()
            .colors
            .iter()
            .flat_map(|color| color.map(wgray::image::encode))
            .collect();
        running.wait("the file", |_| {
            let picture = image::open(&out).ok()?.into_rgb8();
            (picture.dimensions() == (40, 30) && *picture.as_raw() == wanted).then_some(())
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
