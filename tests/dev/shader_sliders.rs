//! Shader overrides as sliders: moving a slider gives the same bits as editing the file, without a compilation.

use wgray::image::Pixels;
use wgray_dev::{Command, Content, Kind, Slider, SliderState, Value};

use super::running::{Files, KERNEL, RADIANCE, Running, SCENE};

const FILE: &str = "kernels/render.wgsl";

fn declare(files: &Files, declared: &str, factor: &str) {
    let text = files.read(KERNEL);
    let text = text.replace(RADIANCE, &format!("({RADIANCE} * vec4f(vec3f({factor}), 1.0))"));
    files.write(KERNEL, &format!("{text}\n{declared}\n"));
}

fn slide(running: &Running, name: &str, value: Value) {
    let (file, name) = (FILE.to_string(), name.to_string());
    running.session.send(Command::Slide { file, name, value });
}

fn slider(running: &Running, name: &str) -> SliderState {
    let state = running.state();
    let found = state.sliders.iter().find(|state| state.slider.name == name);
    found.unwrap_or_else(|| panic!("{name}: {state:?}")).clone()
}

fn line_of(files: &Files, what: &str) -> usize {
    let text = files.read(KERNEL);
    text.lines().position(|line| line.contains(what)).unwrap() + 1
}

#[track_caller]
fn wait_for(running: &Running, wanted: &Pixels) {
    running.wait("the image of the sliders", |running| {
        let frame = running.frame()?;
        matches!(&frame.content, Content::Color(pixels) if frame.header.done && pixels == wanted).then_some(())
    });
}

/// Returns the image that `render` makes after edits of the kernel.
fn rendered(files: &Files, edits: &[(&str, &str)]) -> Pixels {
    let text = files.read(KERNEL);
    let edited = Files::new(&files.read("scene.toml"));
    let new = edits.iter().fold(text.clone(), |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    edited.write(KERNEL, &new);
    edited.rendered()
}

#[test]
fn a_slider_equals_an_edit_without_a_compilation() {
    let files = Files::new(SCENE);
    declare(
        &files,
        "override tint: f32 = 0.5; // 0..1\noverride shift: i32 = -1; // slider -4..4\n\
         override on: bool = false;\noverride level: u32 = 2u; // 0..8\noverride hue = 0.75;\n\
         fn factor() -> f32 { return hue * (tint + f32(shift) * 0.125 + f32(level) * select(0.1, 0.3, on)); }",
        "factor()",
    );
    let running = files.start();
    running.wait_rendered(&files);
    let compiled = running.state().compile_seconds;
    let wanted = SliderState {
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
    assert_eq!(slider(&running, "tint"), wanted);
    let first = running.colors();
    let mut last = first.clone();
    let mut edits = Vec::new();
    for (name, value, edit) in [
        ("tint", Value::Number(0.35), ("tint: f32 = 0.5", "tint: f32 = 0.35")),
        ("shift", Value::Number(2.0), ("shift: i32 = -1", "shift: i32 = 2")),
        ("on", Value::Bool(true), ("on: bool = false", "on: bool = true")),
        ("level", Value::Number(7.0), ("level: u32 = 2u", "level: u32 = 7u")),
        ("hue", Value::Number(0.1), ("hue = 0.75", "hue = 0.1")),
    ] {
        edits.push(edit);
        let edited = rendered(&files, &edits);
        assert_ne!(edited, last, "{name} has no effect");
        slide(&running, name, value);
        wait_for(&running, &edited);
        assert_eq!(slider(&running, name).value, value, "{name}");
        last = edited;
    }
    assert_eq!(running.state().compile_seconds, compiled, "a kernel was compiled");
    running
        .session
        .send(Command::ResetSlider(FILE.to_string(), "hue".to_string()));
    wait_for(&running, &rendered(&files, &edits[..4]));
    running.session.send(Command::ResetSliders);
    wait_for(&running, &first);

    // Range and line of a slider follow the file without a compilation.
    files.edit(
        KERNEL,
        "override tint: f32 = 0.5; // 0..1",
        "\noverride tint: f32 = 0.5; // 0..2",
    );
    running.wait("the range", |running| {
        (slider(running, "tint").slider.max == 2.0).then_some(())
    });
    assert_eq!(slider(&running, "tint").slider.line, wanted.slider.line + 1);
    assert_eq!(running.state().compile_seconds, compiled);
    // An edited value in the file replaces the value of its slider; other sliders keep their values through a
    // compilation.
    slide(&running, "tint", Value::Number(0.9));
    slide(&running, "level", Value::Number(5.0));
    files.edit(KERNEL, "tint: f32 = 0.5", "tint: f32 = 0.75");
    wait_for(&running, &rendered(&files, &[("level: u32 = 2u", "level: u32 = 5u")]));
    assert_eq!(slider(&running, "tint").value, Value::Number(0.75));
    assert_eq!(running.state().problems, []);
}

#[test]
fn an_override_that_is_needed_to_compile_has_no_slider() {
    let files = Files::new(SCENE);
    declare(
        &files,
        "override size: u32 = 2u; // 1..8\nvar<workgroup> many: array<f32, size>;\noverride tint: f32 = 0.5;\n\
         fn factor() -> f32 { return tint * f32(arrayLength(&film) * 0u + size); }",
        "factor()",
    );
    let running = files.start();
    running.wait_rendered(&files);
    let names: Vec<String> = running
        .state()
        .sliders
        .iter()
        .map(|state| state.slider.name.clone())
        .collect();
    assert_eq!(names, ["tint"]);
    slide(&running, "tint", Value::Number(0.25));
    wait_for(&running, &rendered(&files, &[("f32 = 0.5", "f32 = 0.25")]));
    // A slider that does not exist cannot be moved.
    slide(&running, "size", Value::Number(3.0));
    let notice = running.wait("a notice", |running| running.state().notice.clone());
    assert!(
        notice.bad && notice.text.contains("no slider `size`"),
        "{}",
        notice.text
    );
}

#[test]
fn sliders_remain_while_a_shader_has_errors() {
    let files = Files::new(SCENE);
    declare(&files, "override c: f32 = 0.5;", "min(1.0 / c, 1.0)");
    let running = files.start();
    running.wait_rendered(&files);
    let (text, picture) = (files.read(KERNEL), running.colors());
    slide(&running, "c", Value::Number(0.0));
    wait_for(&running, &picture); // 1 / 0 is infinite, and the minimum is 1
    files.write(KERNEL, &text.replace("min(1.0 / c, 1.0)", "min(1.0 / d, 1.0)"));
    running.wait_problem();
    slide(&running, "c", Value::Number(1.0));
    running.wait("the value", |running| {
        (slider(running, "c").value == Value::Number(1.0)).then_some(())
    });
    files.write(KERNEL, &text);
    running.wait_well();
    wait_for(&running, &rendered(&files, &[("f32 = 0.5", "f32 = 1.0")]));
}
