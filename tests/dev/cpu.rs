//! Rendering on the CPU in the development mode, for scenes with a BVH: without a GPU while the shaders are unedited,
//! and on any device while a kernel is compiled. The CPU computes the same bits as the kernel.

use std::time::Instant;

use wgray::image::Pixels;
use wgray_dev::{Against, Command, Content, Move, State, View};
use wgray_render::gpu::{AdapterChoice, choose};

use super::running::{Files, IDLE_TIME, KERNEL, RADIANCE, SCENE, TIMEOUT, TestSession};

/// Returns a scene with a BVH over spheres.
fn spheres(integrator: &str) -> String {
    let sphere = |i: i32| {
        let (x, y) = (i % 9 - 4, i / 9 - 4);
        format!(
            "[[shapes]]\ntype = \"sphere\"\nmaterial = \"red\"\ncenter = [{:?}, {:?}, 0.2]\nradius = 0.15\n",
            0.4 * f64::from(x),
            0.4 * f64::from(y),
        )
    };
    let scene = SCENE.replace("[render]", &format!("[render]\nintegrator = \"{integrator}\""));
    scene + &(0..81).map(sphere).collect::<String>()
}

fn files() -> Files {
    Files::new(&spheres("phong"))
}

/// Returns true if `auto` finds only a software Vulkan adapter. The CPU then renders in its place, as long as no shader
/// is edited.
fn only_software_adapter() -> bool {
    choose(&AdapterChoice::Auto).unwrap().info.is_software()
}

fn is_on_cpu(state: &State) -> bool {
    state.device.starts_with("CPU, ")
}

fn is_black(pixels: &Pixels) -> bool {
    pixels.colors.iter().all(|color| *color == [0.0; 3])
}

fn color(content: &Content) -> &Pixels {
    match content {
        Content::Color(pixels) => pixels,
        other => panic!("{other:?}"),
    }
}

/// Saves a kernel that makes the image black.
fn blacken(files: &Files) {
    files.edit(KERNEL, RADIANCE, &format!("({RADIANCE} * vec4f(0.0))"));
}

/// Waits for the finished image. Panics if any frame is not black.
#[track_caller]
fn wait_for_black_image(session: &TestSession, old_revision: u64) {
    let start = Instant::now();
    loop {
        if let Some(frame) = session.frame().filter(|frame| frame.header.revision > old_revision) {
            assert!(
                is_black(color(&frame.content)),
                "the image of the unedited shaders was shown"
            );
            if frame.header.done {
                return;
            }
        }
        assert!(start.elapsed() < TIMEOUT, "{:?}", session.state());
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

#[test]
fn the_cpu_renders_only_unedited_shaders() {
    for integrator in ["phong", "path"] {
        let files = Files::new(&spheres(integrator));
        let session = files.start();
        session.wait_for_rendered_image(&files);
        let unedited = session.colors();
        assert!(!is_black(&unedited));
        assert_eq!(
            is_on_cpu(&session.state()),
            only_software_adapter(),
            "{}",
            session.state().device
        );
        assert_eq!(session.state().compile_seconds.is_none(), only_software_adapter());

        let before = session.revision();
        blacken(&files);
        wait_for_black_image(&session, before);
        assert!(!is_on_cpu(&session.state()), "{}", session.state().device);

        // After an edit of the scene and after a move of the camera, the edited shaders still run.
        let before = session.revision();
        files.edit("scene.toml", "color = [0.8, 0.1, 0.1]", "color = [0.1, 0.8, 0.1]");
        wait_for_black_image(&session, before);
        let before = session.revision();
        session.inner.send(Command::Move(Move::Orbit(0.3, 0.0)));
        wait_for_black_image(&session, before);
        session.inner.send(Command::ResetCamera);
        files.edit("scene.toml", "color = [0.1, 0.8, 0.1]", "color = [0.8, 0.1, 0.1]");

        // A comment is not an edit of the code, so the CPU renders again.
        files.write_shaders();
        files.edit(KERNEL, "\n", "\n// a comment\n");
        session.wait_for_rendered_image(&files);
        assert_eq!(session.colors(), unedited);
        assert_eq!(is_on_cpu(&session.state()), only_software_adapter());
    }
}

#[test]
fn shaders_that_were_edited_before_the_start_never_run_on_the_cpu() {
    let files = files();
    blacken(&files);
    let session = files.start();
    wait_for_black_image(&session, 0);
    assert!(!is_on_cpu(&session.state()));
}

#[test]
fn an_error_in_the_shaders_at_the_start_leaves_the_page_without_an_image() {
    let files = files();
    files.edit(KERNEL, RADIANCE, "path_value(simple)");
    let session = files.start();
    assert_eq!(session.wait_for_problem().kind, "shader");
    session.wait("no compilation", |session| (!session.state().compiling).then_some(()));
    std::thread::sleep(IDLE_TIME);
    assert!(session.frame().is_none(), "an image of other shaders was shown");
    files.write_shaders();
    session.wait_for_rendered_image(&files);
}

#[test]
fn after_an_error_in_the_shaders_the_last_good_shaders_render_changed_scenes() {
    let files = files();
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let unedited = session.colors();
    files.edit(KERNEL, RADIANCE, "path_value(simple)");
    assert_eq!(session.wait_for_problem().kind, "shader");
    assert_eq!(session.colors(), unedited);
    let before = session.revision();
    files.edit("scene.toml", "color = [0.8, 0.1, 0.1]", "color = [0.1, 0.8, 0.1]");
    session.wait_for_complete_image(before);
    let image_with_error = session.colors();
    assert!(!session.state().problems.is_empty(), "the error is no longer listed");
    files.write_shaders();
    session.wait_for_no_problem();
    session.wait_for_rendered_image(&files);
    assert_eq!(session.colors(), image_with_error);
    assert_ne!(image_with_error, unedited);
}

#[test]
fn with_a_chosen_device_the_cpu_renders_until_the_kernel_is_compiled() {
    for integrator in ["phong", "path"] {
        let files = Files::new(&spheres(integrator));
        let session = TestSession::start_on(files.sources(), None, AdapterChoice::Gpu);
        session.wait("the CPU's image", |session| {
            let is_interim = session.state().device.contains(", until the kernel for ");
            (is_interim && session.state().compiling && session.frame().is_some()).then_some(())
        });
        session.wait_for_rendered_image(&files);
        session.wait("the kernel", |session| (!is_on_cpu(&session.state())).then_some(()));
        session.wait_for_rendered_image(&files);
        assert_eq!(session.revision(), 1, "the kernel restarted the image of the CPU");
        assert!(session.state().compile_seconds.is_some());
    }
}

#[test]
fn after_a_camera_move_the_cpu_and_a_kernel_render_the_same_bits() {
    for integrator in ["phong", "path"] {
        let files = Files::new(&spheres(integrator));
        let images = [AdapterChoice::Auto, AdapterChoice::Gpu].map(|device| {
            let session = TestSession::start_on(files.sources(), None, device);
            session.wait("the kernel", |session| {
                (session.frame().is_some() && !session.state().compiling).then_some(())
            });
            session.wait_for_rendered_image(&files);
            let (before, file_image) = (session.revision(), session.colors());
            session.inner.send(Command::Move(Move::Orbit(0.4, 0.1)));
            session.wait_for_complete_image(before);
            let moved_image = session.colors();
            assert_ne!(moved_image, file_image);
            moved_image
        });
        assert_eq!(images[0], images[1]);
    }
}

#[test]
fn the_comparison_with_the_cpu_runs_a_kernel() {
    let files = files();
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let image = session.colors();
    session.inner.send(Command::View(View::Compare(Against::Cpu)));
    let frame = session.wait("the comparison", |session| {
        let frame = session.frame()?;
        (matches!(frame.content, Content::Compare(..)) && frame.header.done).then_some(frame)
    });
    assert_eq!(frame.header.sides, Some(["GPU".to_owned(), "CPU".to_owned()]));
    assert!(!is_on_cpu(&session.state()));
    match &frame.content {
        Content::Compare(gpu, cpu) => assert_eq!([gpu, cpu], [&image; 2]),
        other => panic!("{other:?}"),
    }
    // After the comparison, the color view has the same pixels and the same device as before.
    session.inner.send(Command::View(View::Color));
    session.wait("the image", |session| {
        let frame = session.frame()?;
        matches!(&frame.content, Content::Color(pixels) if frame.header.done && *pixels == image).then_some(())
    });
    assert_eq!(is_on_cpu(&session.state()), only_software_adapter());
}
