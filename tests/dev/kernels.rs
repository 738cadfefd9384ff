//! Kernels that no view uses at the moment are checked, too. Kernels whose loops a driver truncates are reported.

use wgray_dev::{Command, Move, View};

use super::running::{Files, KERNEL, RADIANCE, SCENE, TestSession};

const FIRST_HITS: &str = "shaders/kernels/first_hits.wgsl";
const ADAPTIVE: &str = "shaders/kernels/adaptive.wgsl";

fn problems(session: &TestSession) -> Vec<String> {
    let state = session.state();
    let location_text = |location: &Option<String>| location.clone().unwrap_or_default();
    state
        .problems
        .iter()
        .map(|problem| format!("{}: {}", location_text(&problem.place), problem.message))
        .collect()
}

#[test]
fn errors_in_unused_kernels_are_reported_at_once() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let valid_colors = session.colors();
    files.edit(FIRST_HITS, "fn first_hits", "fn hits_first");
    files.edit(ADAPTIVE, "= moments;", "= moments.xyz;");
    files.edit(KERNEL, "@workgroup_size(8, 8)", "@workgroup_size(4, 4)");
    let messages = session.wait("all problems", |session| {
        Some(problems(session)).filter(|all| all.len() == 3)
    });
    for (file, words) in [
        (FIRST_HITS, "must be called `first_hits`"),
        (ADAPTIVE, "`moments.xyz`"),
        (KERNEL, "(4, 4)"),
    ] {
        let path = files.path(file).display().to_string();
        assert!(
            messages
                .iter()
                .any(|message| message.starts_with(&path) && message.contains(words)),
            "{file}: {messages:?}"
        );
    }
    assert_eq!(session.colors(), valid_colors);
    // The session continues with the last valid shaders.
    let revision = session.revision();
    session.inner.send(Command::Move(Move::Orbit(0.3, 0.0)));
    session.wait_for_complete_image(revision);
    session.inner.send(Command::View(View::Normal));
    session.wait("the normals", |session| {
        session
            .frame()
            .filter(|frame| frame.header.view == View::Normal && frame.header.done)
    });
    assert_eq!(problems(&session).len(), 3);
    session.inner.send(Command::View(View::Color));
    session.inner.send(Command::ResetCamera);
    files.edit(FIRST_HITS, "fn hits_first", "fn first_hits");
    files.edit(ADAPTIVE, "= moments.xyz;", "= moments;");
    files.edit(KERNEL, "(4, 4)", "(8, 8)");
    session.wait_for_rendered_image(&files);
}

/// Inserts a loop of a million iterations before `next_code`. The loop has no effect, but no compiler can remove it.
fn insert_long_loop(files: &Files, file: &str, next_code: &str) {
    let loop_code = "var rounds = 0u;
    for (var i = 0u; i < 1000000u + 0u * params.origin.x; i++) { rounds += (rounds ^ i) & params.loop_probe.y; }
    if rounds == 0xffffffffu { return; }\n    ";
    files.edit(file, next_code, &format!("{loop_code}{next_code}"));
}

#[test]
fn a_truncated_loop_is_reported_or_the_image_is_complete() {
    let small_scene = SCENE
        .replace("width = 40", "width = 8")
        .replace("height = 30", "height = 8");
    let files = Files::new(&small_scene);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let initial = session.colors();
    let expected = files.rendered_image();
    assert_eq!(initial, expected);
    insert_long_loop(&files, KERNEL, "var sum = film[index];");
    files.edit(KERNEL, RADIANCE, &format!("({RADIANCE} * vec4f(vec3f(0.5), 1.0))"));
    let is_halved = |session: &TestSession| {
        let colors = session.colors().colors;
        let pairs = colors.iter().flatten().zip(initial.colors.iter().flatten());
        pairs.into_iter().all(|(new, old)| *new == old * 0.5)
    };
    let is_truncated = session.wait("a problem or the complete image", |session| {
        let has_message = problems(session)
            .iter()
            .any(|message| message.contains("ends long loops early"));
        let is_complete = session.frame().is_some_and(|frame| frame.header.done) && is_halved(session);
        (has_message || is_complete).then_some(has_message)
    });
    if is_truncated {
        assert_eq!(session.state().problems[0].kind, "shader");
        assert_eq!(session.colors(), initial, "the last valid image was discarded");
        let revision = session.revision();
        session.inner.send(Command::Move(Move::Orbit(0.3, 0.0)));
        session.wait_for_complete_image(revision);
        session.inner.send(Command::ResetCamera);
        assert!(!problems(&session).is_empty());
    }
    files.write(
        KERNEL,
        wgray_render::gpu::compose::Shaders::built_in().text("kernels/render.wgsl"),
    );
    session.wait_for_rendered_image(&files);

    // The loop is in the kernel of another view, and only that view reports the error.
    insert_long_loop(&files, FIRST_HITS, "let pixel = params.origin");
    session.wait_for_no_problem();
    session.inner.send(Command::View(View::Normal));
    session.wait("a problem or the normals", |session| {
        let has_message = problems(session)
            .iter()
            .any(|message| message.contains("ends long loops early"));
        let frame = session.frame()?;
        (has_message || frame.header.view == View::Normal && frame.header.done).then_some(())
    });
    session.inner.send(Command::View(View::Color));
    session.wait_for_rendered_image(&files);
    files.tint(0.25);
    files.write(
        FIRST_HITS,
        wgray_render::gpu::compose::Shaders::built_in().text("kernels/first_hits.wgsl"),
    );
    session.wait_for_rendered_image(&files);
}
