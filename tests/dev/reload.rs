//! Files are saved, damaged, renamed, linked or deleted: the image always shows their latest valid state.

use std::fs;
use std::time::{Duration, Instant};

use wgray_dev::{Command, Move};
use wgray_render::gpu::compose::Shaders;

use super::running::{Files, IDLE_TIME, KERNEL, RADIANCE, SCENE, TestSession};

#[test]
fn the_first_image_equals_the_image_of_render() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let frame = session.frame().unwrap();
    assert_eq!((frame.header.samples, frame.header.total), (4, 4));
    let colors = session.colors().colors;
    assert!(colors.iter().any(|color| *color != colors[0]), "the image is empty");
    let (x, y) = (20, 20);
    let [r, g, b] = colors[y * 40 + x];
    let values = frame.pixel(x as u32, y as u32).unwrap();
    let shown = [r, g, b].map(|value| wgray::image::encode(value).to_string()).join(" ");
    let bits = [r, g, b].map(|value| format!("{:08x}", value.to_bits())).join("  ");
    assert_eq!(
        values,
        [
            ("linear RGB", format!("{r}  {g}  {b}")),
            ("bits", bits),
            ("shown", shown)
        ]
    );
    assert_eq!(frame.pixel(40, 0), None);
}

#[test]
fn a_partly_written_scene_is_not_an_error() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let incomplete = &SCENE[..SCENE.find("radius").unwrap() + 3];
    // On a busy machine, a single save may take too long, but not each of ten saves.
    let is_not_reported = (0..10).any(|i| {
        let start = Instant::now();
        files.write("scene.toml", incomplete);
        let mut has_no_problem = true;
        let mut check = || has_no_problem &= session.state().problems.is_empty();
        while start.elapsed() < Duration::from_millis(50) {
            check();
            std::thread::sleep(Duration::from_millis(1));
        }
        files.write(
            "scene.toml",
            &SCENE.replace("radius = 0.5", &format!("radius = 0.{}", 3 + i)),
        );
        while start.elapsed() < Duration::from_millis(300) {
            check();
            std::thread::sleep(Duration::from_millis(1));
        }
        has_no_problem
    });
    assert!(is_not_reported);
    session.wait_for_rendered_image(&files);
    files.write("scene.toml", incomplete); // a file that remains incomplete is an error
    session.wait_for_problem();
}

#[test]
fn a_saved_scene_is_compiled_only_if_it_needs_another_kernel() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (before, compile_seconds) = (session.colors(), session.state().compile_seconds);
    files.edit("scene.toml", "0.8, 0.1, 0.1", "0.1, 0.8, 0.1");
    session.wait_for_rendered_image(&files);
    assert_ne!(session.colors(), before);
    assert_eq!(
        session.state().compile_seconds,
        compile_seconds,
        "a kernel was compiled"
    );
    let before = session.colors();
    let new_shape = |shape: &str| format!("[[shapes]]\nmaterial = 'red'\n{shape}\n\n[[shapes]]");
    let sphere = new_shape("type = 'sphere'\ncenter = [1, 0, 1]\nradius = 0.3");
    files.edit("scene.toml", "[[shapes]]", &sphere);
    session.wait_for_rendered_image(&files);
    assert_ne!(session.colors(), before);
    assert_eq!(
        session.state().compile_seconds,
        compile_seconds,
        "a second sphere needed a compilation"
    );
    let triangle = new_shape("type = 'triangle'\nvertices = [[1, 0, 1], [1, 0, 2], [1, 1, 1]]");
    files.edit("scene.toml", "[[shapes]]", &triangle);
    session.wait_for_rendered_image(&files);
    assert_ne!(
        session.state().compile_seconds,
        compile_seconds,
        "no kernel was compiled"
    );
    files.edit("scene.toml", "width = 40", "width = 33");
    session.wait_for_rendered_image(&files);
}

#[test]
fn a_view_transform_is_applied_without_rendering_again() {
    let files = Files::new(SCENE);
    let out = files.path("out.png");
    let session = TestSession::start(files.sources(), Some(out.clone()));
    session.wait_for_rendered_image(&files);
    let (linear, revision) = (session.colors(), session.revision());
    let keys = "width = 40\nview_transform = 'agx'\nexposure = 1";
    files.edit("scene.toml", "width = 40", keys);
    let frame = session.wait_for_complete_image(revision);
    let settings = wgray::scene::ViewSettings {
        transform: wgray::scene::ViewTransform::Agx,
        exposure: 1.0,
    };
    let expected: Vec<u8> = linear.colors.iter().flat_map(|color| settings.rgb8(*color)).collect();
    let displayed = image::load_from_memory(&frame.pictures[0]).unwrap().into_rgb8();
    assert_eq!(*displayed.as_raw(), expected);
    assert_eq!(session.colors(), linear);
    session.wait("the output file", |_| {
        let picture = image::open(&out).ok()?.into_rgb8();
        (*picture.as_raw() == expected).then_some(())
    });
}

#[test]
fn a_changed_comment_does_not_restart_the_render() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let revision = session.revision();
    files.edit("scene.toml", "# a small scene", "# a very small scene");
    std::thread::sleep(IDLE_TIME);
    assert_eq!(session.revision(), revision);
    files.edit("scene.toml", "fov = 40", "fov = 41"); // positive control: the file is being watched
    session.wait_for_rendered_image(&files);
}

#[test]
fn an_invalid_shader_is_reported_and_the_image_stays() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (valid_colors, revision) = (session.colors(), session.revision());
    files.edit(KERNEL, "= sum;", "= sun;");
    let problem = session.wait_for_problem();
    assert_eq!(problem.kind, "shader");
    let text = files.read(KERNEL);
    let before = &text[..text.find("sun;").unwrap()];
    let (line, column) = (
        before.matches('\n').count() + 1,
        before.len() - before.rfind('\n').unwrap(),
    );
    let location = format!("{}:{line}:{column}", files.path(KERNEL).display());
    assert_eq!(problem.place, Some(location));
    assert!(problem.message.contains("sun"), "{}", problem.message);
    let excerpt = problem.excerpt.unwrap();
    assert!(excerpt.contains("= sun;") && excerpt.contains("^^^"), "{excerpt}");
    std::thread::sleep(IDLE_TIME);
    assert_eq!((session.colors(), session.revision()), (valid_colors, revision));
    // Changes that need no new kernel take effect.
    session.inner.send(Command::Move(Move::Orbit(0.3, 0.0)));
    session.wait_for_complete_image(revision);
    session.inner.send(Command::ResetCamera);
    files.edit("scene.toml", "0.8, 0.1, 0.1", "0.1, 0.8, 0.1");
    let changed_image = Files::new(&files.read("scene.toml")).rendered_image();
    session.wait("the changed scene with the last valid shaders", |session| {
        (session.colors() == changed_image).then_some(())
    });
    // Changes that need another kernel take effect, too.
    files.edit(
        "scene.toml",
        "radius = 0.5",
        "radius = 0.5\n\n[[shapes]]\ntype = 'sphere'\nmaterial = 'red'\ncenter = [1, 0, 1]\nradius = 0.3",
    );
    let changed_image = Files::new(&files.read("scene.toml")).rendered_image();
    session.wait("a new kernel from the last valid shaders", |session| {
        (session.colors() == changed_image).then_some(())
    });
    assert_eq!(session.wait_for_problem().kind, "shader");
    files.tint(0.5);
    session.wait_for_rendered_image(&files);
}

#[test]
fn a_type_error_in_a_shader_is_reported() {
    let files = Files::new(SCENE);
    files.edit(
        "shaders/camera.wgsl",
        "return Ray(camera.position, ",
        "return Ray(camera.seed, ",
    );
    let session = files.start();
    let problem = session.wait_for_problem();
    assert!(
        problem.place.unwrap().contains("camera.wgsl:"),
        "the error does not name the shader"
    );
    assert!(session.frame().is_none());
    files.edit(
        "shaders/camera.wgsl",
        "return Ray(camera.seed, ",
        "return Ray(camera.position, ",
    );
    session.wait_for_rendered_image(&files);
}

#[test]
fn an_invalid_scene_is_reported_and_the_image_stays() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let valid_colors = session.colors();
    for (old, new, line, rule) in [
        ("radius = 0.5", "radius = -1", 33, "must be"),
        ("radius = -1", "radius = = 1", 33, "extra"),
        ("radius = = 1", "radius = 1\nradios = 2", 34, "radios"),
    ] {
        files.edit("scene.toml", old, new);
        let location = format!("{}:{line}", files.path("scene.toml").display());
        let problem = session.wait("the problem", |session| {
            let problem = session.state().problems.first().cloned()?;
            (problem.place.as_ref()?.starts_with(&location) && problem.message.contains(rule)).then_some(problem)
        });
        assert_eq!(problem.kind, "scene");
        assert!(problem.excerpt.unwrap().contains(new.lines().last().unwrap()));
        assert_eq!(session.colors(), valid_colors);
    }
    files.edit("scene.toml", "radios = 2\n", "");
    session.wait_for_rendered_image(&files);
}

#[test]
fn after_a_burst_of_saves_the_last_save_is_shown() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    for i in 1..=40 {
        files.write("scene.toml", &SCENE.replace("fov = 40", &format!("fov = {}", 40 + i)));
        if i % 4 == 0 {
            files.tint(1.0 + i as f64 / 100.0);
        }
        if i % 7 == 0 {
            files.write("shaders/phong.wgsl", "half written");
            files.write("shaders/phong.wgsl", Shaders::built_in().text("phong.wgsl"));
        }
        std::thread::sleep(Duration::from_millis(i % 12));
    }
    session.wait_for_rendered_image(&files);
}

#[test]
fn saves_by_rename_and_links_are_detected() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    files.save_by_rename("scene.toml", &SCENE.replace("fov = 40", "fov = 50"));
    session.wait_for_rendered_image(&files);
    let kernel = files
        .read(KERNEL)
        .replace(RADIANCE, &format!("({RADIANCE} * vec4f(vec3f(0.25), 1.0))"));
    files.save_by_rename(KERNEL, &kernel);
    session.wait_for_rendered_image(&files);
    #[cfg(unix)]
    {
        // Scene and shader become links to files in another folder, which are then edited.
        let linked = Files::new(&SCENE.replace("fov = 40", "fov = 60"));
        for name in ["scene.toml", "shaders/phong.wgsl"] {
            fs::remove_file(files.path(name)).unwrap();
            std::os::unix::fs::symlink(linked.path(name), files.path(name)).unwrap();
        }
        session.wait_for_rendered_image(&files);
        linked.save_by_rename("scene.toml", &SCENE.replace("fov = 40", "fov = 70"));
        session.wait_for_rendered_image(&files);
        linked.edit(
            "shaders/phong.wgsl",
            "return lobes;",
            "return Lobes(lobes.specular, lobes.diffuse);",
        );
        session.wait_for_rendered_image(&files);
    }
}

#[test]
fn deleted_files_are_reported_until_they_return() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let valid_colors = session.colors();
    fs::remove_file(files.path("scene.toml")).unwrap();
    let problem = session.wait_for_problem();
    assert_eq!(problem.kind, "file");
    assert!(
        problem.message.contains("scene.toml: cannot be read"),
        "{}",
        problem.message
    );
    files.write("scene.toml", &SCENE.replace("fov = 40", "fov = 50"));
    session.wait_for_rendered_image(&files);
    assert_ne!(session.colors(), valid_colors);

    fs::remove_file(files.path("shaders/phong.wgsl")).unwrap();
    assert!(session.wait_for_problem().message.contains("phong.wgsl"));
    files.write("shaders/phong.wgsl", Shaders::built_in().text("phong.wgsl"));
    session.wait_for_no_problem();

    // A checkout of another branch also removes and restores folders.
    for name in ["shaders/kernels", "shaders"] {
        fs::rename(files.path(name), files.path("away")).unwrap();
        assert_eq!(session.wait_for_problem().kind, "file");
        fs::rename(files.path("away"), files.path(name)).unwrap();
        session.wait_for_no_problem();
    }
    fs::remove_dir_all(files.path("shaders")).unwrap();
    files.write_shaders();
    files.tint(0.125);
    session.wait_for_rendered_image(&files);
    files.edit(
        "shaders/kernels/render.wgsl",
        "film[index] = sum;",
        "film[index] = sum * vec4f(2.0, 1.0, 1.0, 1.0);",
    );
    session.wait_for_rendered_image(&files);
}

#[test]
fn an_edited_texture_updates_the_image() {
    let textured = SCENE.replacen("color = [0.8, 0.1, 0.1]", "color = { texture = 'wood' }", 1)
        + "\n[textures.wood]\ntype = 'image'\nfile = 'textures/wood.png'\n";
    let files = Files::new(&textured);
    let write_texture = |color: [u8; 3]| {
        fs::create_dir_all(files.path("textures")).unwrap();
        image::RgbImage::from_pixel(4, 4, image::Rgb(color))
            .save(files.path("textures/wood.png"))
            .unwrap();
    };
    write_texture([200, 30, 30]);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let first_colors = session.colors();
    write_texture([30, 30, 200]);
    session.wait_for_rendered_image(&files);
    assert_ne!(session.colors(), first_colors);
    // A missing or damaged texture is replaced by a placeholder, as in `render`.
    fs::remove_dir_all(files.path("textures")).unwrap();
    session.wait_for_rendered_image(&files);
    assert_ne!(session.colors(), first_colors);
    write_texture([30, 200, 30]);
    session.wait_for_rendered_image(&files);
    fs::write(files.path("textures/wood.png"), "not an image").unwrap();
    session.wait_for_rendered_image(&files);
    assert_ne!(session.colors(), first_colors);
    write_texture([200, 30, 30]);
    session.wait("the first image again", |session| {
        (session.colors() == first_colors).then_some(())
    });
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_instead_of_the_scene_is_reported() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let path = files.path("scene.toml");
    fs::remove_file(&path).unwrap();
    let created = std::process::Command::new("mkfifo").arg(&path).status().unwrap();
    assert!(created.success());
    assert!(session.wait_for_problem().message.contains("is a named pipe"));
    fs::remove_file(&path).unwrap();
    files.write("scene.toml", &SCENE.replace("0.8, 0.1, 0.1", "0.1, 0.8, 0.1"));
    session.wait_for_rendered_image(&files);
    fs::remove_file(&path).unwrap();
    std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
    assert!(session.wait_for_problem().message.contains("is a device"));
    fs::remove_file(&path).unwrap();
    files.write("scene.toml", SCENE);
    session.wait_for_rendered_image(&files);
}

#[test]
fn the_image_of_a_finished_kernel_is_shown_while_a_newer_save_waits_for_the_compiler() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let compile_time = Duration::from_secs_f64(session.state().compile_seconds.unwrap());
    let revision = session.revision();
    let start = Instant::now();
    let mut saves = 0;
    while session.revision() == revision {
        assert!(
            start.elapsed() < 10 * compile_time,
            "{saves} saves in {:?}, no image",
            start.elapsed()
        );
        saves += 1;
        files.tint(1.0 / f64::from(saves + 1));
        std::thread::sleep((compile_time / 3).max(Duration::from_millis(60)));
    }
    assert!(saves > 1);
    session.wait_for_rendered_image(&files);
}

#[test]
fn a_new_comment_in_a_shader_causes_no_compilation_and_later_errors_have_the_correct_line() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (revision, before) = (session.revision(), session.state());
    files.write(KERNEL, &format!("// one\n// two\n{}", files.read(KERNEL)));
    session.wait("the saved comment", |session| {
        (session.state().scene_revision > before.scene_revision).then_some(())
    });
    std::thread::sleep(IDLE_TIME);
    let after = session.state();
    assert_eq!(
        (session.revision(), after.compile_seconds),
        (revision, before.compile_seconds)
    );
    assert!(!after.compiling);
    files.edit(KERNEL, "= sum;", "= sun;");
    let text = files.read(KERNEL);
    let line = text.lines().position(|line| line.contains("= sun;")).unwrap() + 1;
    assert_eq!(session.wait_for_problem().line, Some(line));
    // A comment above the error moves its line.
    files.write(KERNEL, &format!("// zero\n{text}"));
    session.wait("the error at its new line", |session| {
        (session.state().problems.first()?.line == Some(line + 1)).then_some(())
    });
    files.write(KERNEL, &text.replace("sun;", "sum;"));
    session.wait_for_rendered_image(&files);
}

#[test]
fn the_state_reports_a_changed_scene_until_it_is_read() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let incomplete = &SCENE[..SCENE.find("radius").unwrap() + 3];
    files.write("scene.toml", incomplete);
    session.wait("the start of reading", |session| session.state().reading.then_some(()));
    session.wait_for_problem();
    assert!(!session.state().reading);
    files.write("scene.toml", SCENE);
    session.wait_for_rendered_image(&files);
    session.wait("the end of reading", |session| (!session.state().reading).then_some(()));
    // If the file returns to its previous content before it is read again, `reading` must end, too.
    files.write("scene.toml", incomplete);
    session.wait("the start of reading", |session| session.state().reading.then_some(()));
    files.write("scene.toml", SCENE);
    session.wait("the end of reading", |session| (!session.state().reading).then_some(()));
}
