//! Shader overrides as sliders: moving a slider gives the same bits as editing the file, without a compilation.

use wgray::image::Pixels;
use wgray_dev::{Command, Content, Kind, Slider, SliderState, Value};

use super::running::{Files, KERNEL, RADIANCE, SCENE, TestSession};

const FILE: &str = "kernels/render.wgsl";

fn declare_overrides(files: &Files, declarations: &str, factor: &str) {
    let text = files.read(KERNEL);
    let text = text.replace(RADIANCE, &format!("({RADIANCE} * vec4f(vec3f({factor}), 1.0))"));
    files.write(KERNEL, &format!("{text}\n{declarations}\n"));
}

fn move_slider(session: &TestSession, name: &str, value: Value) {
    let (file, name) = (FILE.to_string(), name.to_string());
    session.inner.send(Command::Slide { file, name, value });
}

fn slider(session: &TestSession, name: &str) -> SliderState {
    let state = session.state();
    let found = state.sliders.iter().find(|state| state.slider.name == name);
    found.unwrap_or_else(|| panic!("{name}: {state:?}")).clone()
}

fn line_of(files: &Files, pattern: &str) -> usize {
    let text = files.read(KERNEL);
    text.lines().position(|line| line.contains(pattern)).unwrap() + 1
}

#[track_caller]
fn wait_for(session: &TestSession, expected: &Pixels) {
    session.wait("the image of the sliders", |session| {
        let frame = session.frame()?;
        matches!(&frame.content, Content::Color(pixels) if frame.header.done && pixels == expected).then_some(())
    });
}

/// Returns the image that `render` makes after edits of the kernel.
fn render_with_edits(files: &Files, edits: &[(&str, &str)]) -> Pixels {
    let text = files.read(KERNEL);
    let edited_files = Files::new(&files.read("scene.toml"));
    let edited_text = edits.iter().fold(text.clone(), |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    edited_files.write(KERNEL, &edited_text);
    edited_files.rendered_image()
}

#[test]
fn a_slider_equals_an_edit_without_a_compilation() {
    let files = Files::new(SCENE);
    declare_overrides(
        &files,
        "override tint: f32 = 0.5; // 0..1\noverride shift: i32 = -1; // slider -4..4\n\
         override on: bool = false;\noverride level: u32 = 2u; // 0..8\noverride hue = 0.75;\n\
         fn factor() -> f32 { return hue * (tint + f32(shift) * 0.125 + f32(level) * select(0.1, 0.3, on)); }",
        "factor()",
    );
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let compile_seconds = session.state().compile_seconds;
    let expected = SliderState {
        slider: Slider {
            file: FILE.to_string(),
            name: "tint".to_string(),
            line: line_of(&files, "override tint"),
            kind: Kind::F32,
            min: 0.0,
            max: 1.0,
            default: Value::Number(0.5),
        },
        path: Some(files.path(KERNEL).display().to_string()),
        value: Value::Number(0.5),
    };
    assert_eq!(slider(&session, "tint"), expected);
    let initial_image = session.colors();
    let mut previous_image = initial_image.clone();
    let mut edits = Vec::new();
    for (name, value, edit) in [
        ("tint", Value::Number(0.35), ("tint: f32 = 0.5", "tint: f32 = 0.35")),
        ("shift", Value::Number(2.0), ("shift: i32 = -1", "shift: i32 = 2")),
        ("on", Value::Bool(true), ("on: bool = false", "on: bool = true")),
        ("level", Value::Number(7.0), ("level: u32 = 2u", "level: u32 = 7u")),
        ("hue", Value::Number(0.1), ("hue = 0.75", "hue = 0.1")),
    ] {
        edits.push(edit);
        let expected_image = render_with_edits(&files, &edits);
        assert_ne!(expected_image, previous_image, "{name} has no effect");
        move_slider(&session, name, value);
        wait_for(&session, &expected_image);
        assert_eq!(slider(&session, name).value, value, "{name}");
        previous_image = expected_image;
    }
    assert_eq!(
        session.state().compile_seconds,
        compile_seconds,
        "a kernel was compiled"
    );
    session
        .inner
        .send(Command::ResetSlider(FILE.to_string(), "hue".to_string()));
    wait_for(&session, &render_with_edits(&files, &edits[..4]));
    session.inner.send(Command::ResetSliders);
    wait_for(&session, &initial_image);

    // Range and line of a slider follow the file without a compilation.
    files.edit(
        KERNEL,
        "override tint: f32 = 0.5; // 0..1",
        "\noverride tint: f32 = 0.5; // 0..2",
    );
    session.wait("the new range", |session| {
        (slider(session, "tint").slider.max == 2.0).then_some(())
    });
    assert_eq!(slider(&session, "tint").slider.line, expected.slider.line + 1);
    assert_eq!(session.state().compile_seconds, compile_seconds);
    // An edited value in the file replaces the value of its slider; other sliders keep their values through a
    // compilation.
    move_slider(&session, "tint", Value::Number(0.9));
    move_slider(&session, "level", Value::Number(5.0));
    files.edit(KERNEL, "tint: f32 = 0.5", "tint: f32 = 0.75");
    wait_for(
        &session,
        &render_with_edits(&files, &[("level: u32 = 2u", "level: u32 = 5u")]),
    );
    assert_eq!(slider(&session, "tint").value, Value::Number(0.75));
    assert_eq!(session.state().problems, []);
}

#[test]
fn an_override_that_is_needed_to_compile_has_no_slider() {
    let files = Files::new(SCENE);
    declare_overrides(
        &files,
        "override size: u32 = 2u; // 1..8\nvar<workgroup> many: array<f32, size>;\noverride tint: f32 = 0.5;\n\
         fn factor() -> f32 { return tint * f32(arrayLength(&film) * 0u + size); }",
        "factor()",
    );
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let names: Vec<String> = session
        .state()
        .sliders
        .iter()
        .map(|state| state.slider.name.clone())
        .collect();
    assert_eq!(names, ["tint"]);
    move_slider(&session, "tint", Value::Number(0.25));
    wait_for(&session, &render_with_edits(&files, &[("f32 = 0.5", "f32 = 0.25")]));
    // A slider that does not exist cannot be moved.
    move_slider(&session, "size", Value::Number(3.0));
    let notice = session.wait("a notice", |session| session.state().notice.clone());
    assert!(
        notice.bad && notice.text.contains("no slider `size`"),
        "{}",
        notice.text
    );
}

#[test]
fn sliders_remain_while_a_shader_has_errors() {
    let files = Files::new(SCENE);
    declare_overrides(&files, "override c: f32 = 0.5;", "min(1.0 / c, 1.0)");
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (text, initial_image) = (files.read(KERNEL), session.colors());
    move_slider(&session, "c", Value::Number(0.0));
    wait_for(&session, &initial_image); // 1 / 0 is infinite, and the minimum of infinity and 1 is 1
    files.write(KERNEL, &text.replace("min(1.0 / c, 1.0)", "min(1.0 / d, 1.0)"));
    session.wait_for_problem();
    move_slider(&session, "c", Value::Number(1.0));
    session.wait("the moved slider", |session| {
        (slider(session, "c").value == Value::Number(1.0)).then_some(())
    });
    files.write(KERNEL, &text);
    session.wait_for_no_problem();
    wait_for(&session, &render_with_edits(&files, &[("f32 = 0.5", "f32 = 1.0")]));
}
