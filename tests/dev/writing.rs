//! Values set on the page: written into the scene file, shown at once, undone, or rejected.

use std::fs;

use serde_json::{Value, json};
use wgray::scene::Overrides;
use wgray_dev::{Command, Move, Set, Sources};

use super::running::{Files, Running, SCENE, SETTLED};

#[track_caller]
fn set(running: &Running, path: &str, value: Value, gesture: Option<u64>) {
    let path = path.to_owned();
    follow(running, Command::Set(Set { path, value, gesture }));
}

#[track_caller]
fn follow(running: &Running, command: Command) {
    let executed = running.state().executed;
    running.session.send(command);
    running.wait("the command to be followed", |running| {
        (running.state().executed > executed).then_some(())
    });
}

#[track_caller]
fn refused(running: &Running) -> String {
    let state = running.state();
    let notice = state.notice.clone().unwrap();
    assert!(notice.bad && notice.command == state.executed, "{notice:?}");
    notice.text
}

#[test]
fn a_new_value_is_written_and_shown() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let before = running.colors();
    set(&running, "materials.red.color", json!([0.1, 0.75, 0.1]), None);
    assert_eq!(
        files.read("scene.toml"),
        SCENE.replace("[0.8, 0.1, 0.1]", "[0.1, 0.75, 0.1]")
    );
    running.wait_rendered(&files);
    assert_ne!(running.colors(), before);
    assert_eq!(running.state().undo.as_deref(), Some("materials.red.color"));
    // Absent keys are added and removed. A value equal to the file's is not written.
    set(&running, "shapes[0].radius", json!(0.5), None);
    assert_eq!(running.state().undo.as_deref(), Some("materials.red.color"));
    set(&running, "render.seed", json!(3), None);
    assert!(files.read("scene.toml").contains("count = 4 }\nseed = 3\n\n[materials"));
    set(&running, "render.seed", Value::Null, None);
    assert!(!files.read("scene.toml").contains("seed"));
    // An enumeration value that needs another kernel.
    set(&running, "render.pixel_samples.pattern", json!("random"), None);
    running.wait_rendered(&files);
    // Only edits of the file trigger the watcher.
    let scenes = running.state().scenes;
    std::thread::sleep(SETTLED);
    assert_eq!(running.state().scenes, scenes);
    files.edit("scene.toml", "fov = 40", "fov = 44");
    running.wait("the edited scene", |running| {
        (running.state().scenes > scenes).then_some(())
    });
    running.wait_rendered(&files);
}

#[test]
fn concurrent_saves_of_an_editor_are_kept() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    for round in 0..10 {
        let fov = |round: i32| format!("fov = {}", 40 + round);
        files.edit("scene.toml", &fov(round), &fov(round + 1));
        set(&running, "shapes[0].radius", json!(0.6), None);
        let text = files.read("scene.toml");
        assert!(
            text.contains(&fov(round + 1)) && text.contains("radius = 0.6"),
            "{text}"
        );
        running.wait_rendered(&files);
        set(&running, "shapes[0].radius", json!(0.5), None);
        assert!(files.read("scene.toml").contains("radius = 0.5\n"));
    }
}

#[test]
fn setting_a_list_element_keeps_the_other_elements() {
    let files = Files::new(&SCENE.replace("center = [0, 0, 0.5]", "center = [0,  0, # here\n 0.5]"));
    let start = files.read("scene.toml");
    let running = files.start();
    running.wait_rendered(&files);
    set(&running, "shapes[0].center[2]", json!(0.75), Some(1));
    files.edit("scene.toml", "[0,  0, #", "[0.25,  0, #");
    set(&running, "shapes[0].center[2]", json!(1), Some(1));
    let center = |numbers: &str| start.replace("[0,  0, # here\n 0.5]", numbers);
    assert_eq!(files.read("scene.toml"), center("[0.25,  0, # here\n 1]"));
    running.wait_rendered(&files);
    // Other elements of an absent list get their defaults.
    set(&running, "camera.up[0]", json!(0.5), None);
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
        set(&running, path, value, None);
        assert!(refused(&running).contains(expected), "{path}: {}", refused(&running));
    }
    assert_eq!(files.read("scene.toml"), text);
    set(&running, "shapes[0].center[0]", json!(0), None);
    let notice = running.state().notice.clone().unwrap();
    assert!(!notice.bad && notice.text.is_empty(), "{notice:?}");
    files.write("scene.toml", &start);
    running.wait_rendered(&files);
}

#[test]
fn written_values_are_undone_and_redone() {
    let files = Files::new(&SCENE.replace('\n', "\r\n"));
    let start = files.read("scene.toml");
    let running = files.start();
    running.wait_rendered(&files);
    let mut texts = vec![start.clone()];
    for (path, value) in [
        ("shapes[0].radius", json!(0.25)),
        ("camera.fov", json!(50)),
        ("lights[0].visible", json!(false)),
    ] {
        set(&running, path, value, None);
        texts.push(files.read("scene.toml"));
    }
    // A drag of a slider is one undo step.
    for i in 1..=20 {
        set(&running, "materials.red.shininess", json!(16 + i), Some(7));
    }
    assert_eq!(running.state().undo.as_deref(), Some("materials.red.shininess"));
    let last = files.read("scene.toml");
    assert!(last.contains("shininess = 36\r\n"), "{last}");
    // Undoing a saved camera keeps the view.
    follow(&running, Command::Move(Move::Orbit(0.3, 0.1)));
    follow(&running, Command::SaveCamera);
    assert_eq!(running.state().undo.as_deref(), Some("camera"));
    follow(&running, Command::UndoWrite);
    assert!(running.state().camera_moved);
    assert_eq!(files.read("scene.toml"), last);
    for text in texts.iter().rev() {
        follow(&running, Command::UndoWrite);
        assert_eq!(files.read("scene.toml"), *text);
    }
    let state = running.state();
    assert_eq!(
        (state.undo.as_deref(), state.redo.as_deref()),
        (None, Some("shapes[0].radius"))
    );
    follow(&running, Command::UndoWrite); // nothing to undo
    assert_eq!(files.read("scene.toml"), start);
    for text in &texts[1..] {
        follow(&running, Command::RedoWrite);
        assert_eq!(files.read("scene.toml"), *text);
    }
    follow(&running, Command::RedoWrite);
    assert_eq!(files.read("scene.toml"), last);
    follow(&running, Command::ResetCamera);
    running.wait_rendered(&files);
}

#[test]
fn invalid_values_are_rejected_and_the_file_is_unchanged() {
    let files = Files::new(SCENE);
    fs::write(files.path("other.png"), "").unwrap();
    let running = files.start();
    running.wait_rendered(&files);
    for (path, value, expected) in [
        (
            "shapes[0].radius",
            json!(-1),
            "shapes[0].radius: -1 must be finite and greater than 0",
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
        set(&running, path, value, None);
        let message = refused(&running);
        assert!(message.contains(expected), "{path}: {message}");
        assert_eq!(files.read("scene.toml"), SCENE, "{path}");
    }
    assert_eq!(running.state().undo, None);
    // A file with a syntax error must be fixed by hand.
    files.edit("scene.toml", "radius = 0.5", "radius = ");
    let broken = files.read("scene.toml");
    set(&running, "camera.fov", json!(50), None);
    assert!(refused(&running).starts_with("fix the file first: "));
    assert_eq!(files.read("scene.toml"), broken);
    files.write("scene.toml", SCENE);
    set(&running, "camera.fov", json!(50), None);
    assert_eq!(files.read("scene.toml"), SCENE.replace("fov = 40", "fov = 50"));
    running.wait_rendered(&files);
}

#[test]
fn changes_of_another_program_are_not_undone() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    set(&running, "camera.fov", json!(50), None);
    files.edit("scene.toml", "# a small scene", "# another scene");
    let edited = files.read("scene.toml");
    running.session.send(Command::UndoWrite); // whether or not the change was detected by then
    running.wait("nothing to undo", |running| {
        running.state().undo.is_none().then_some(())
    });
    assert_eq!(files.read("scene.toml"), edited);
    running.wait("the change", |running| running.state().undo_blocked.clone());
    follow(&running, Command::UndoWrite);
    let refused = refused(&running);
    assert!(refused.contains("changed by another program"), "{refused}");
    // Keeps the change of the other program.
    set(&running, "camera.fov", json!(55), None);
    assert_eq!(files.read("scene.toml"), edited.replace("fov = 50", "fov = 55"));
    follow(&running, Command::UndoWrite);
    assert_eq!(files.read("scene.toml"), edited);
    running.wait_rendered(&files);
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
    let running = Running::start(sources, None);
    running.wait_done(0);
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
        set(&running, path, value, None);
        assert_eq!(refused(&running), expected);
        assert_eq!(files.read("scene.toml"), SCENE);
    }
    // Other values can be set; the defined one stays.
    let revision = running.revision();
    set(&running, "shapes[0].center", json!([0, 0, 0.75]), None);
    running.wait_done(revision);
    assert_eq!(
        files.read("scene.toml"),
        SCENE.replace("[0, 0, 0.5]\nradius", "[0, 0, 0.75]\nradius")
    );
    let seen = running.session.seen.borrow().clone().unwrap();
    let field = seen.object("shapes[0]", None).groups[0]
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
        let running = Running::start(sources, None);
        running.wait_rendered(&files);
        set(&running, "camera.fov", json!(50), None);
        assert!(fs::symlink_metadata(files.path("link.toml")).unwrap().is_symlink());
        assert_eq!(files.read("scene.toml"), SCENE.replace("fov = 40", "fov = 50"));
        let mode = fs::metadata(files.path("scene.toml")).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        running.wait_rendered(&files);
    }
}
