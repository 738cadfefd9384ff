//! Marked constants of shaders: a slider shows what an edit of the file would, bit for bit, and without the compiler where
//! that is possible.

use wgray::image::Pixels;
use wgray_dev::{Command, Content, Kind, SliderState, Value};

use super::running::{Files, KERNEL, RADIANCE, Running, SCENE, SETTLED};

const FILE: &str = "kernels/render.wgsl";

/// The kernel with more declarations, and with its light multiplied.
fn marked(files: &Files, declared: &str, factor: &str) {
    let text = files.read(KERNEL);
    let text = text.replace(RADIANCE, &format!("({RADIANCE} * vec4f(vec3f({factor}), 1.0))"));
    files.write(KERNEL, &format!("{text}\n{declared}\n"));
}

fn slide(running: &Running, name: &str, value: Value) {
    let (file, name) = (FILE.to_string(), name.to_string());
    running.session.send(Command::Slide { file, name, value });
}

/// Writes the values into the files, and waits until that is done.
#[track_caller]
fn write(running: &Running) {
    let number = |running: &Running| running.state().notice.as_ref().map(|notice| notice.number);
    let before = number(running);
    running.session.send(Command::WriteSliders);
    let notice = running.wait("what was written", |running| {
        let notice = running.state().notice.clone();
        notice.filter(|notice| before != Some(notice.number))
    });
    assert!(!notice.bad && notice.text.contains("Saved sliders"), "{notice:?}");
}

fn slider(running: &Running, name: &str) -> SliderState {
    let state = running.state();
    let found = state.sliders.iter().find(|slider| slider.name == name);
    found.unwrap_or_else(|| panic!("{name}: {state:?}")).clone()
}

/// Waits until a finished image is this one.
#[track_caller]
fn wait_for(running: &Running, wanted: &Pixels) {
    running.wait("the image of the sliders", |running| {
        let frame = running.frame()?;
        matches!(&frame.content, Content::Color(pixels) if frame.header.done && pixels == wanted).then_some(())
    });
}

/// Returns what `render` makes of the files with edits of the kernel.
fn rendered(files: &Files, edits: &[(&str, &str)]) -> Pixels {
    let text = files.read(KERNEL);
    let other = Files::new(&files.read("scene.toml"));
    let new = edits.iter().fold(text.clone(), |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    other.write(KERNEL, &new);
    other.rendered()
}

#[test]
fn a_slider_shows_what_an_edit_would_without_the_compiler() {
    let files = Files::new(SCENE);
    marked(
        &files,
        "const tint: f32 = 0.5; // slider 0..1 step 0.01\nconst shift: i32 = -1; // slider -4..4\n\
         const on: bool = false; // switch\noverride level: u32 = 2u; // slider 0..8\n\
         const hue: vec3f = vec3f(1.0, 0.5, 0.25); // color\n\
         fn factor() -> vec3f { return hue * (tint + f32(shift) * 0.125 + f32(level) * select(0.1, 0.3, on)); }",
        "factor()",
    );
    let running = files.start();
    running.wait_rendered(&files);
    let compiled = running.state().compile_seconds;
    let told = slider(&running, "tint");
    let wanted = SliderState {
        file: FILE.to_string(),
        path: Some(files.path(KERNEL).display().to_string()),
        name: "tint".to_string(),
        line: files
            .read(KERNEL)
            .lines()
            .position(|line| line.contains("const tint"))
            .unwrap()
            + 1,
        kind: Kind::F32,
        min: 0.0,
        max: 1.0,
        step: Some(0.01),
        value: Value::Number(0.5),
        file_value: Value::Number(0.5),
        recompiles: false,
        used: true,
    };
    assert_eq!(told, wanted);
    let first = running.colors();
    let mut last = first.clone();
    let mut edits = Vec::new();
    for (name, value, edit) in [
        ("tint", Value::Number(0.35), ("tint: f32 = 0.5", "tint: f32 = 0.35")),
        ("shift", Value::Number(2.0), ("shift: i32 = -1", "shift: i32 = 2")),
        ("on", Value::Bool(true), ("on: bool = false", "on: bool = true")),
        ("level", Value::Number(7.0), ("level: u32 = 2u", "level: u32 = 7u")),
        (
            "hue",
            Value::Color([0.1, 0.2, 0.9]),
            ("vec3f(1.0, 0.5, 0.25);", "vec3f(0.1, 0.2, 0.9);"),
        ),
    ] {
        edits.push(edit);
        let edited = rendered(&files, &edits);
        assert_ne!(edited, last, "{name} is seen");
        slide(&running, name, value);
        wait_for(&running, &edited);
        assert_eq!(slider(&running, name).value, value, "{name}");
        last = edited;
    }
    assert_eq!(running.state().compile_seconds, compiled, "nothing was compiled");
    running
        .session
        .send(Command::ResetSlider(FILE.to_string(), "hue".to_string()));
    wait_for(&running, &rendered(&files, &edits[..4]));
    running.session.send(Command::ResetSliders);
    wait_for(&running, &first);

    // Written, the file has the number and is else as it was; nothing is compiled nor rendered again.
    slide(&running, "tint", Value::Number(0.2));
    wait_for(&running, &rendered(&files, &[("f32 = 0.5", "f32 = 0.2")]));
    let (text, revision) = (files.read(KERNEL), running.revision());
    running.session.send(Command::WriteSliders);
    running.wait("the file's value", |running| {
        (slider(running, "tint").file_value == Value::Number(0.2)).then_some(())
    });
    assert_eq!(files.read(KERNEL), text.replace("f32 = 0.5", "f32 = 0.2"));
    assert!(!running.state().notice.as_ref().unwrap().bad);
    std::thread::sleep(SETTLED);
    assert_eq!(
        (running.revision(), running.state().compile_seconds),
        (revision, compiled)
    );
    // The writing is taken back, and made again.
    running.session.send(Command::UndoSliders);
    running.wait("the old value", |running| {
        (slider(running, "tint").file_value == Value::Number(0.5)).then_some(())
    });
    assert_eq!(files.read(KERNEL), text);
    assert!(!running.state().sliders_undo);
    wait_for(&running, &first);
    slide(&running, "tint", Value::Number(0.2));
    write(&running);
    running.wait_rendered(&files);
    // The file's number counts when it is edited, and takes no compiler either.
    slide(&running, "tint", Value::Number(0.9));
    files.edit(KERNEL, "f32 = 0.2", "f32 = 0.75");
    running.wait_rendered(&files);
    assert_eq!(slider(&running, "tint").value, Value::Number(0.75));
    assert_eq!(running.state().compile_seconds, compiled);
    // Anything else does.
    files.edit(KERNEL, "* 0.125", "* 0.25");
    running.wait_rendered(&files);
    assert_ne!(running.state().compile_seconds, compiled);
}

#[test]
fn a_constant_that_kernels_are_compiled_for_is_compiled_anew() {
    let files = Files::new(SCENE);
    marked(
        &files,
        "const size: u32 = 2u; // slider 1..8\nvar<private> many: array<f32, size>;\n\
         const tint: f32 = 0.5; // slider 0..1\n\
         fn factor() -> f32 { many[size - 1u] = 0.1; return tint * (many[size - 1u] + 0.1 * f32(size)); }",
        "factor()",
    );
    let running = files.start();
    running.wait_rendered(&files);
    let recompiles = |name: &str| slider(&running, name).recompiles;
    assert_eq!([recompiles("size"), recompiles("tint")], [true, false]);
    let compiled = running.state().compile_seconds;
    slide(&running, "size", Value::Number(5.0));
    wait_for(&running, &rendered(&files, &[("size: u32 = 2u", "size: u32 = 5u")]));
    let again = running.state().compile_seconds;
    assert_ne!(again, compiled);
    slide(&running, "tint", Value::Number(0.25));
    let both = [("size: u32 = 2u", "size: u32 = 5u"), ("f32 = 0.5", "f32 = 0.25")];
    wait_for(&running, &rendered(&files, &both));
    assert_eq!(running.state().compile_seconds, again, "the other one needs none");
    write(&running);
    running.wait_rendered(&files);
    assert!(files.read(KERNEL).contains("size: u32 = 5u; // slider 1..8"));
    assert_eq!(running.state().compile_seconds, again, "what is written is what runs");
}

#[test]
fn a_value_that_would_not_compile_is_not_written() {
    let files = Files::new(SCENE);
    marked(&files, "const c: f32 = 0.5; // slider 0..1", "min(1.0 / c, 1.0)");
    let running = files.start();
    running.wait_rendered(&files);
    let (text, picture) = (files.read(KERNEL), running.colors());
    slide(&running, "c", Value::Number(0.0));
    wait_for(&running, &picture); // read from a buffer it is infinite, of which 1 is the least
    running.session.send(Command::WriteSliders);
    let notice = running.wait("a notice", |running| running.state().notice.clone());
    assert!(
        notice.bad && notice.text.contains("with these values the shaders would not compile"),
        "{}",
        notice.text
    );
    assert!(notice.text.contains("kernels/render.wgsl:"), "{}", notice.text);
    assert_eq!(files.read(KERNEL), text);
    // If the shaders are wrong already, the values are not blamed.
    files.write(KERNEL, &text.replace("min(1.0 / c, 1.0)", "min(1.0 / d, 1.0)"));
    running.wait_problem();
    running.session.send(Command::WriteSliders);
    running.wait("another notice", |running| {
        let notice = running.state().notice.clone()?;
        notice.text.contains("the shaders do not compile").then_some(())
    });
    files.write(KERNEL, &text);
    running.wait_well();
    slide(&running, "c", Value::Number(0.25));
    running.session.send(Command::WriteSliders);
    running.wait("the file's value", |running| {
        (slider(running, "c").file_value == Value::Number(0.25)).then_some(())
    });
    assert_eq!(files.read(KERNEL), text.replace("f32 = 0.5", "f32 = 0.25"));
}

#[test]
fn a_mark_that_says_nothing_is_told_and_the_picture_stays() {
    let files = Files::new(SCENE);
    marked(&files, "const tint = 0.5; // slider 0..1", "tint");
    let running = files.start();
    let problem = running.wait_problem();
    let path = files.path(KERNEL).display().to_string();
    let line = files
        .read(KERNEL)
        .lines()
        .position(|line| line.contains("const tint"))
        .unwrap()
        + 1;
    assert_eq!(problem.place, Some(format!("{path}:{line}:1")));
    assert_eq!(
        (problem.file, problem.line, problem.column),
        (Some(path), Some(line), Some(1))
    );
    assert!(
        problem.message.contains("`tint` must have a type"),
        "{}",
        problem.message
    );
    let lines: Vec<String> = problem.excerpt.unwrap().lines().map(str::to_string).collect();
    assert!(lines[1].ends_with("const tint = 0.5; // slider 0..1"), "{lines:?}");
    let wanted = files.rendered();
    wait_for(&running, &wanted);
    assert_eq!(running.state().sliders, []);
    files.edit(KERNEL, "const tint =", "const tint: f32 =");
    running.wait_rendered(&files);
    assert_eq!(slider(&running, "tint").value, Value::Number(0.5));
    // A slider that does not exist cannot be moved.
    slide(&running, "other", Value::Number(0.5));
    let notice = running.wait("a notice", |running| running.state().notice.clone());
    assert!(notice.bad && notice.text.contains("`other`"), "{}", notice.text);
}
