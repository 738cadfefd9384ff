//! Values set on the page are written into the scene file, shown at once, undone, or rejected.

use std::fs;

use serde_json::{Value, json};
use wgray::scene::Overrides;
use wgray_dev::{Command, Move, Set, Sources};

use super::running::{Files, IDLE_TIME, SCENE, TestSession};

#[track_caller]
fn set(session: &TestSession, path: &str, value: Value, gesture: Option<u64>) {
    let path = path.to_owned();
    execute(session, Command::Set(Set { path, value, gesture }));
}

#[track_caller]
fn execute(session: &TestSession, command: Command) {
    let executed = session.state().executed;
    session.inner.send(command);
    session.wait("the end of the command", |session| {
        (session.state().executed > executed).then_some(())
    });
}

#[track_caller]
fn rejection(session: &TestSession) -> String {
    let state = session.state();
    let notice = state.notice.clone().unwrap();
    assert!(notice.bad && notice.command == state.executed, "{notice:?}");
    notice.text
}

#[test]
fn a_new_value_is_written_and_shown() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let before = session.colors();
    set(&session, "materials.red.color", json!([0.1, 0.75, 0.1]), None);
    assert_eq!(
        files.read("scene.toml"),
        SCENE.replace("[0.8, 0.1, 0.1]", "[0.1, 0.75, 0.1]")
    );
    session.wait_for_rendered_image(&files);
    assert_ne!(session.colors(), before);
    assert_eq!(session.state().undo.as_deref(), Some("materials.red.color"));
    // A value that equals the value in the file is not written. Keys can be added and removed.
    set(&session, "shapes[0].radius", json!(0.5), None);
    assert_eq!(session.state().undo.as_deref(), Some("materials.red.color"));
    set(&session, "render.seed", json!(3), None);
    assert!(files.read("scene.toml").contains("count = 4 }\nseed = 3\n\n[materials"));
    set(&session, "render.seed", Value::Null, None);
    assert!(!files.read("scene.toml").contains("seed"));
    // This pattern needs another kernel.
    set(&session, "render.pixel_samples.pattern", json!("random"), None);
    session.wait_for_rendered_image(&files);
    // The file watcher reports edits of other programs, but not what the session writes.
    let revision = session.state().scene_revision;
    std::thread::sleep(IDLE_TIME);
    assert_eq!(session.state().scene_revision, revision);
    files.edit("scene.toml", "fov = 40", "fov = 44");
    session.wait("the edited scene", |session| {
        (session.state().scene_revision > revision).then_some(())
    });
    session.wait_for_rendered_image(&files);
}

#[test]
fn concurrent_saves_of_an_editor_are_kept() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    for round in 0..10 {
        let fov = |round: i32| format!("fov = {}", 40 + round);
        files.edit("scene.toml", &fov(round), &fov(round + 1));
        set(&session, "shapes[0].radius", json!(0.6), None);
        let text = files.read("scene.toml");
        assert!(
            text.contains(&fov(round + 1)) && text.contains("radius = 0.6"),
            "{text}"
        );
        session.wait_for_rendered_image(&files);
        set(&session, "shapes[0].radius", json!(0.5), None);
        assert!(files.read("scene.toml").contains("radius = 0.5\n"));
    }
}

#[test]
fn setting_a_list_element_keeps_the_other_elements() {
    let files = Files::new(&SCENE.replace("center = [0, 0, 0.5]", "center = [0,  0, # here\n 0.5]"));
    let original = files.read("scene.toml");
    let session = files.start();
    session.wait_for_rendered_image(&files);
    set(&session, "shapes[0].center[2]", json!(0.75), Some(1));
    files.edit("scene.toml", "[0,  0, #", "[0.25,  0, #");
    set(&session, "shapes[0].center[2]", json!(1), Some(1));
    let center = |numbers: &str| original.replace("[0,  0, # here\n 0.5]", numbers);
    assert_eq!(files.read("scene.toml"), center("[0.25,  0, # here\n 1]"));
    session.wait_for_rendered_image(&files);
    // If the file does not contain the list, its other elements get their defaults.
    set(&session, "camera.up[0]", json!(0.5), None);
    assert!(files.read("scene.toml").contains("fov = 40\nup = [0.5, 0, 1]\n"));
    let text = files.read("scene.toml");
    for (path, value, expected) in [
        ("shapes[0].center[3]", json!(1), "cannot be changed"),
        ("shapes[0].center[0][0]", json!(1), "cannot be changed"),
        ("shapes[0].radius[0]", json!(1), "cannot be changed"),
        ("shapes[0].center[0]", json!(null), "must be a list of 3 numbers"),
        ("shapes[0].center[0]", json!("a"), "must be a list of 3 numbers"),
        ("shapes[0].center[0]", json!(1e300), "shapes[0].center: "),
    ] {
        set(&session, path, value, None);
        assert!(
            rejection(&session).contains(expected),
            "{path}: {}",
            rejection(&session)
        );
    }
    assert_eq!(files.read("scene.toml"), text);
    set(&session, "shapes[0].center[0]", json!(0), None);
    let notice = session.state().notice.clone().unwrap();
    assert!(!notice.bad && notice.text.is_empty(), "{notice:?}");
    files.write("scene.toml", &original);
    session.wait_for_rendered_image(&files);
}

#[test]
fn written_values_are_undone_and_redone() {
    let files = Files::new(&SCENE.replace('\n', "\r\n"));
    let original = files.read("scene.toml");
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let mut texts = vec![original.clone()];
    for (path, value) in [
        ("shapes[0].radius", json!(0.25)),
        ("camera.fov", json!(50)),
        ("lights[0].visible", json!(false)),
    ] {
        set(&session, path, value, None);
        texts.push(files.read("scene.toml"));
    }
    // All values of one gesture, such as a drag, are one undo step.
    for i in 1..=20 {
        set(&session, "materials.red.shininess", json!(16 + i), Some(7));
    }
    assert_eq!(session.state().undo.as_deref(), Some("materials.red.shininess"));
    let last = files.read("scene.toml");
    assert!(last.contains("shininess = 36\r\n"), "{last}");
    // Undo of a saved camera does not move the camera of the displayed image.
    execute(&session, Command::Move(Move::Orbit(0.3, 0.1)));
    execute(&session, Command::SaveCamera);
    assert_eq!(session.state().undo.as_deref(), Some("camera"));
    execute(&session, Command::UndoWrite);
    assert!(session.state().camera_moved);
    assert_eq!(files.read("scene.toml"), last);
    for text in texts.iter().rev() {
        execute(&session, Command::UndoWrite);
        assert_eq!(files.read("scene.toml"), *text);
    }
    let state = session.state();
    assert_eq!(
        (state.undo.as_deref(), state.redo.as_deref()),
        (None, Some("shapes[0].radius"))
    );
    execute(&session, Command::UndoWrite); // nothing to undo
    assert_eq!(files.read("scene.toml"), original);
    for text in &texts[1..] {
        execute(&session, Command::RedoWrite);
        assert_eq!(files.read("scene.toml"), *text);
    }
    execute(&session, Command::RedoWrite);
    assert_eq!(files.read("scene.toml"), last);
    execute(&session, Command::ResetCamera);
    session.wait_for_rendered_image(&files);
}

#[test]
fn invalid_values_are_rejected_and_the_file_is_unchanged() {
    let files = Files::new(SCENE);
    fs::write(files.path("other.png"), "").unwrap();
    let session = files.start();
    session.wait_for_rendered_image(&files);
    for (path, value, expected) in [
        (
            "shapes[0].radius",
            json!(-1),
            "shapes[0].radius: -1 must be from 1e-9 to 1e9",
        ),
        ("shapes[0].radius", json!("large"), "\"large\" must be a number"),
        ("shapes[0].radius", Value::Null, "is required"),
        ("camera.look_at", Value::Null, "is required"),
        ("shapes[1].normal", json!([1, 0, 0]), "must not be parallel"),
        ("shapes[1].normal", json!([1, 0]), "must be a list of 3 numbers"),
        ("shapes[0].material", json!("blue"), "must be one of the allowed names"),
        ("render.pixel_samples.count", json!(5), "must be a square number"),
        ("render.pixel_samples.count", json!(2.5), "must be a whole number"),
        ("image.width", json!(70_000), "must be from 1 to 65536"),
        ("shapes[0].type", json!("disk"), "cannot be changed"),
        ("textures.new.file", json!("other.png"), "cannot be changed"),
        ("shapes[9].radius", json!(1), "cannot be changed"),
        ("shapes", json!([]), "cannot be changed"),
        ("shapes[0]", json!({}), "cannot be changed"),
        ("shapes[0", json!(1), "must be"),
        ("", json!(1), "must be"),
    ] {
        set(&session, path, value, None);
        let message = rejection(&session);
        assert!(message.contains(expected), "{path}: {message}");
        assert_eq!(files.read("scene.toml"), SCENE, "{path}");
    }
    assert_eq!(session.state().undo, None);
    // Values cannot be written into a file with a syntax error.
    files.edit("scene.toml", "radius = 0.5", "radius = ");
    let invalid_text = files.read("scene.toml");
    set(&session, "camera.fov", json!(50), None);
    assert!(rejection(&session).starts_with("fix the file first: "));
    assert_eq!(files.read("scene.toml"), invalid_text);
    files.write("scene.toml", SCENE);
    set(&session, "camera.fov", json!(50), None);
    assert_eq!(files.read("scene.toml"), SCENE.replace("fov = 40", "fov = 50"));
    session.wait_for_rendered_image(&files);
}

#[test]
fn changes_of_another_program_are_not_undone() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    set(&session, "camera.fov", json!(50), None);
    files.edit("scene.toml", "# a small scene", "# another scene");
    let edited = files.read("scene.toml");
    session.inner.send(Command::UndoWrite); // the session may not have detected the change yet
    session.wait("nothing to undo", |session| {
        session.state().undo.is_none().then_some(())
    });
    assert_eq!(files.read("scene.toml"), edited);
    session.wait("the change of the other program", |session| {
        session.state().undo_blocked.clone()
    });
    execute(&session, Command::UndoWrite);
    let message = rejection(&session);
    assert!(message.contains("changed by another program"), "{message}");
    // Setting a value keeps the change of the other program.
    set(&session, "camera.fov", json!(55), None);
    assert_eq!(files.read("scene.toml"), edited.replace("fov = 50", "fov = 55"));
    execute(&session, Command::UndoWrite);
    assert_eq!(files.read("scene.toml"), edited);
    session.wait_for_rendered_image(&files);
}

#[test]
fn values_overridden_by_options_cannot_be_set() {
    let files = Files::new(SCENE);
    let sources = Sources {
        overrides: Overrides {
            size: Some((32, 24)),
            define: vec!["shapes[0].radius=0.75".parse().unwrap()],
            ..Overrides::default()
        },
        ..files.sources()
    };
    let session = TestSession::start(sources, None);
    session.wait_for_complete_image(0);
    for (path, value, expected) in [
        (
            "shapes[0].radius",
            json!(0.25),
            "shapes[0].radius: --define shapes[0].radius=0.75 overrides the value of the file",
        ),
        (
            "image.width",
            json!(20),
            "image.width: --size overrides the value of the file",
        ),
    ] {
        set(&session, path, value, None);
        assert_eq!(rejection(&session), expected);
        assert_eq!(files.read("scene.toml"), SCENE);
    }
    // Other values can be set; the value of `--define` stays.
    let revision = session.revision();
    set(&session, "shapes[0].center", json!([0, 0, 0.75]), None);
    session.wait_for_complete_image(revision);
    assert_eq!(
        files.read("scene.toml"),
        SCENE.replace("[0, 0, 0.5]\nradius", "[0, 0, 0.75]\nradius")
    );
    let view = session.inner.scene_views.borrow().clone().unwrap();
    let field = view.object("shapes[0]", None).groups[0]
        .fields
        .iter()
        .find(|field| field.name == "radius")
        .cloned()
        .unwrap();
    assert!(field.fixed.is_some() && field.value == Some(json!(0.5)));
}

#[test]
fn links_and_permissions_are_preserved() {
    let files = Files::new(SCENE);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(files.path("scene.toml"), fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink("scene.toml", files.path("link.toml")).unwrap();
        let sources = Sources {
            scene: files.path("link.toml"),
            ..files.sources()
        };
        let session = TestSession::start(sources, None);
        session.wait_for_rendered_image(&files);
        set(&session, "camera.fov", json!(50), None);
        assert!(fs::symlink_metadata(files.path("link.toml")).unwrap().is_symlink());
        assert_eq!(files.read("scene.toml"), SCENE.replace("fov = 40", "fov = 50"));
        let mode = fs::metadata(files.path("scene.toml")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        session.wait_for_rendered_image(&files);
    }
}
