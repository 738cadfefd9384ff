//! Unused kernels are checked, too, and kernels whose loops a driver truncates are reported.

use wgray_dev::{Command, Move, View};

use super::running::{Files, KERNEL, RADIANCE, Running, SCENE};

const FIRST_HITS: &str = "shaders/kernels/first_hits.wgsl";
const ADAPTIVE: &str = "shaders/kernels/adaptive.wgsl";

fn problems(running: &Running) -> Vec<String> {
    let state = running.state();
    let place = |place: &Option<String>| place.clone().unwrap_or_default();
    state
        .problems
        .iter()
        .map(|problem| format!("{}: {}", place(&problem.place), problem.message))
        .collect()
}

#[test]
fn errors_in_unused_kernels_are_reported_at_once() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let good = running.colors();
    files.edit(FIRST_HITS, "fn first_hits", "fn hits_first");
    files.edit(ADAPTIVE, "= moments;", "= moments.xyz;");
    files.edit(KERNEL, "@workgroup_size(8, 8)", "@workgroup_size(4, 4)");
    let message = running.wait("all problems", |running| {
        Some(problems(running)).filter(|all| all.len() == 3)
    });
    for (file, words) in [
        (FIRST_HITS, "must be called `first_hits`"),
        (ADAPTIVE, "`moments.xyz`"),
        (KERNEL, "(4, 4)"),
    ] {
        let path = files.path(file).display().to_string();
        assert!(
            message
                .iter()
                .any(|message| message.starts_with(&path) && message.contains(words)),
            "{file}: {message:?}"
        );
    }
    assert_eq!(running.colors(), good);
    // The session continues with the last valid shaders.
    let revision = running.revision();
    running.session.send(Command::Move(Move::Orbit(0.3, 0.0)));
    running.wait_done(revision);
    running.session.send(Command::View(View::Normal));
    running.wait("the normals", |running| {
        running
            .frame()
            .filter(|frame| frame.header.view == View::Normal && frame.header.done)
    });
    assert_eq!(problems(&running).len(), 3);
    running.session.send(Command::View(View::Color));
    running.session.send(Command::ResetCamera);
    files.edit(FIRST_HITS, "fn hits_first", "fn first_hits");
    files.edit(ADAPTIVE, "= moments.xyz;", "= moments;");
    files.edit(KERNEL, "(4, 4)", "(8, 8)");
    running.wait_rendered(&files);
}

/// Adds a loop of a million iterations without effect that no compiler can remove.
fn long_loop(files: &Files, file: &str, before: &str) {
    let rounds = "var rounds = 0u;
    for (var i = 0u; i < 1000000u + 0u * params.origin.x; i++) { rounds += (rounds ^ i) & params.loop_probe.y; }
    if rounds == 0xffffffffu { return; }\n    ";
    files.edit(file, before, &format!("{rounds}{before}"));
}

#[test]
fn a_truncated_loop_is_reported_or_the_image_is_complete() {
    let small = SCENE
        .replace("width = 40", "width = 8")
        .replace("height = 30", "height = 8");
    let files = Files::new(&small);
    let running = files.start();
    running.wait_rendered(&files);
    let good = running.colors();
    let red = files.rendered();
    assert_eq!(good, red);
    long_loop(&files, KERNEL, "var sum = film[index];");
    files.edit(KERNEL, RADIANCE, &format!("({RADIANCE} * vec4f(vec3f(0.5), 1.0))"));
    let halved = |running: &Running| {
        let colors = running.colors().colors;
        let pairs = colors.iter().flatten().zip(good.colors.iter().flatten());
        pairs.into_iter().all(|(new, old)| *new == old * 0.5)
    };
    let cut = running.wait("a problem or the complete image", |running| {
        let message = problems(running)
            .iter()
            .any(|message| message.contains("ends long loops early"));
        let is_complete = running.frame().is_some_and(|frame| frame.header.done) && halved(running);
        (message || is_complete).then_some(message)
    });
    if cut {
        assert_eq!(running.state().problems[0].kind, "shader");
        assert_eq!(running.colors(), good, "the last valid image was discarded");
        let revision = running.revision();
        running.session.send(Command::Move(Move::Orbit(0.3, 0.0)));
        running.wait_done(revision);
        running.session.send(Command::ResetCamera);
        assert!(!problems(&running).is_empty());
    }
    files.write(
        KERNEL,
        wgray_render::gpu::compose::Shaders::built_in().text("kernels/render.wgsl"),
    );
    running.wait_rendered(&files);

    // The loop is in a kernel of another view, which alone reports the error.
    long_loop(&files, FIRST_HITS, "let pixel = params.origin");
    running.wait_well();
    running.session.send(Command::View(View::Normal));
    running.wait("a problem or the normals", |running| {
        let message = problems(running)
            .iter()
            .any(|message| message.contains("ends long loops early"));
        let frame = running.frame()?;
        (message || frame.header.view == View::Normal && frame.header.done).then_some(())
    });
    running.session.send(Command::View(View::Color));
    running.wait_rendered(&files);
    files.tint(0.25);
    files.write(
        FIRST_HITS,
        wgray_render::gpu::compose::Shaders::built_in().text("kernels/first_hits.wgsl"),
    );
    running.wait_rendered(&files);
}
