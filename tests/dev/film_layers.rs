//! The views of film layers show the values of the layers that `wgray render --aov` computes from the same samples. A
//! view is rejected if the scene does not have its layer.

use std::sync::Arc;

use wgray_dev::{Command, Content, FilmLayer, Frame, View};
use wgray_image::Region;
use wgray_render::backend::Backend as _;
use wgray_render::cpu::Cpu;
use wgray_render::denoise::denoise;
use wgray_trace::film::{Film, Layer};

use super::running::{Files, KERNEL, RADIANCE, SCENE, TestSession};

const LAYERS: [(View, Layer); 5] = [
    (View::Albedo, Layer::Albedo),
    (View::Direct, Layer::Direct),
    (View::Indirect, Layer::Indirect),
    (View::Emission, Layer::Emission),
    (View::ShadingNormal, Layer::Normal),
];

/// Returns the scene for the path integrator, lit also by a background.
fn path_scene() -> String {
    SCENE.replace(
        "[render]",
        "[render]\nintegrator = \"path\"\nbackground = [0.1, 0.2, 0.4]",
    )
}

fn adaptive_scene() -> String {
    path_scene().replace(
        "pixel_samples = { pattern = \"grid\", count = 4 }",
        "pixel_samples = { pattern = \"jittered\", count = 4 }\nadaptive = { error = 0.02, max_samples = 96 }",
    )
}

#[track_caller]
fn wait_layer(session: &TestSession, view: View) -> (FilmLayer, Arc<Frame>) {
    session.wait("the layer", |session| {
        let frame = session
            .frame()
            .filter(|frame| frame.header.done && frame.header.view == view)?;
        match &frame.content {
            Content::Film(layer) => Some((layer.clone(), frame)),
            other => panic!("{other:?}"),
        }
    })
}

fn is_close(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1.0))
}

#[test]
fn layers_equal_the_layers_of_render_and_sum_to_the_image() {
    for scene in [path_scene(), adaptive_scene()] {
        let files = Files::new(&scene);
        let session = files.start();
        session.wait_for_rendered_image(&files);
        let (colors, color_compile_seconds) = (session.colors(), session.state().compile_seconds);
        let layered = files.packed().with_layers();
        let expected = |layer| files.render_values(&layered, &|film: &Film, i| film.layer(layer, i));
        let mut earlier_layers = vec![colors.colors.clone()];
        let mut layer_compile_seconds = None;
        for (view, layer) in LAYERS {
            session.inner.send(Command::View(view));
            let (found, frame) = wait_layer(&session, view);
            assert_eq!(found.values.colors, expected(layer), "{view:?}");
            assert!(
                !earlier_layers.contains(&found.values.colors),
                "{view:?} equals another layer, so the test cannot detect that they are swapped"
            );
            assert!(found.values.colors.iter().any(|value| *value != [0.0; 3]), "{view:?}");
            let values = frame.pixel(20, 15).unwrap();
            let value = found.values.colors[15 * 40 + 20].map(|v| v.to_string()).join("  ");
            assert_eq!(values[0].1, value, "{view:?}");
            assert_eq!(
                frame.header.histogram.is_some(),
                found.is_light(),
                "{view:?}: only layers of light have a histogram"
            );
            earlier_layers.push(found.values.colors);
            // One kernel computes all layers.
            let compile_seconds = session.state().compile_seconds;
            assert_ne!(
                compile_seconds, color_compile_seconds,
                "{view:?} used the kernel of the color view"
            );
            assert_eq!(
                *layer_compile_seconds.get_or_insert(compile_seconds),
                compile_seconds,
                "{view:?} needed another kernel"
            );
        }
        // `earlier_layers` starts with the color and the albedo.
        for (i, color) in colors.colors.iter().enumerate() {
            let [direct, indirect, emission] = [2, 3, 4].map(|layer: usize| earlier_layers[layer][i]);
            let sum = [0, 1, 2].map(|k| direct[k] + indirect[k] + emission[k]);
            assert!(is_close(*color, sum), "pixel {i}: {color:?} {sum:?}");
        }
        // The kernel and the image of the color view are still cached.
        session.inner.send(Command::View(View::Color));
        session.wait("the color view", |session| {
            let frame = session.frame()?;
            matches!(&frame.content, Content::Color(pixels) if frame.header.done && *pixels == colors).then_some(())
        });
        assert_eq!(session.state().compile_seconds, layer_compile_seconds.unwrap());
        session.inner.send(Command::View(View::Variance));
        let (found, frame) = wait_layer(&session, View::Variance);
        let is_adaptive = files.packed().sampling.adaptive;
        let packed = match is_adaptive {
            true => files.packed(),
            false => files.packed().with_noise(),
        };
        let expected = files.render_values(&packed, &Film::variance);
        assert_eq!(found.values.colors, expected);
        assert!(expected.iter().any(|variance| *variance != expected[0]));
        assert!(frame.header.legend.is_some() && frame.header.histogram.is_none());
        assert_eq!(
            session.state().compile_seconds == layer_compile_seconds.unwrap(),
            is_adaptive,
            "only a film without variances needs another kernel"
        );
        assert_eq!(session.state().problems, []);
    }
}

#[test]
fn the_kernels_of_color_and_layers_are_cached() {
    let files = Files::new(&path_scene());
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let colors = session.colors();
    let show = |view| {
        session.inner.send(Command::View(view));
        session.wait("the view", |session| {
            let frame = session.frame()?;
            (frame.header.done && frame.header.view == view).then_some(frame)
        })
    };
    let color_compile_seconds = session.state().compile_seconds;
    show(View::Direct);
    let layer_compile_seconds = session.state().compile_seconds;
    assert_ne!(
        layer_compile_seconds, color_compile_seconds,
        "layers use the kernel of the color view"
    );
    let color = show(View::Color);
    assert!(matches!(&color.content, Content::Color(pixels) if *pixels == colors));
    show(View::Albedo);
    assert_eq!(session.state().compile_seconds, layer_compile_seconds);
}

#[test]
fn missing_layers_are_rejected_until_an_edit_adds_them() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let path_views = [View::Albedo, View::Direct, View::Indirect, View::Emission];
    let missing = path_views.map(|view| (view, "needs integrator = \"path\""));
    assert_eq!(session.state().missing_views, missing);
    session.inner.send(Command::View(View::Direct));
    let notice = session.wait("a notice", |session| session.state().notice.clone());
    assert!(
        notice.bad && notice.text == "view `direct`: needs integrator = \"path\"",
        "{}",
        notice.text
    );
    assert_eq!(session.state().view, View::Color);
    // In this scene, the shading normals equal the normals of the first hits.
    session.inner.send(Command::View(View::ShadingNormal));
    session.wait("the normals", |session| {
        let frame = session.frame()?;
        matches!(frame.content, Content::Hits(..)).then_some(())
    });
    session.inner.send(Command::View(View::Color));
    files.write("scene.toml", &path_scene());
    session.wait_for_rendered_image(&files);
    assert_eq!(session.state().missing_views, []);
    session.inner.send(Command::View(View::Direct));
    let (before, _) = wait_layer(&session, View::Direct);
    // The layer follows edits of the scene and of shaders.
    let compile_seconds = session.state().compile_seconds;
    files.edit("scene.toml", "color = [0.8, 0.1, 0.1]", "color = [0.1, 0.8, 0.1]");
    let expected = || {
        files.render_values(&files.packed().with_layers(), &|film: &Film, i| {
            film.layer(Layer::Direct, i)
        })
    };
    let green = expected();
    assert_ne!(before.values.colors, green);
    let shows = |session: &TestSession, expected: &[[f32; 3]]| {
        let frame = session.frame().filter(|frame| frame.header.done)?;
        matches!(&frame.content, Content::Film(layer) if layer.values.colors == expected).then_some(())
    };
    session.wait("the edited scene", |session| shows(session, &green));
    assert_eq!(
        session.state().compile_seconds,
        compile_seconds,
        "a changed color was compiled into the kernel"
    );
    files.edit(KERNEL, RADIANCE, "path_value(simple)");
    session.wait_for_problem();
    assert!(shows(&session, &green).is_some(), "the last image was discarded");
    files.write_shaders();
    session.wait_for_no_problem();
    // With the direct integrator, these layers do not exist.
    files.write("scene.toml", SCENE);
    session.wait_for_rendered_image(&files);
    assert_eq!(session.state().view, View::Color);
    assert_eq!(session.state().missing_views.len(), 4);
}

/// Returns the image that the view "denoised" must show: all samples rendered by the CPU backend, then denoised.
fn denoised_image(files: &Files) -> Vec<[f32; 3]> {
    let packed = files.packed().with_layers().with_noise();
    let mut cpu = Cpu::new(&packed);
    let region = Region::whole(packed.camera.width, packed.camera.height);
    cpu.begin(region).unwrap();
    cpu.render(region, 0..packed.sampling.pixel_samples).unwrap();
    let mut film = cpu.film().unwrap();
    film.denoised = denoise(&film);
    (0..film.sums.len()).map(|i| film.color(i)).collect()
}

#[test]
fn the_denoised_view_shows_the_denoised_image_and_is_initial_if_the_scene_denoises() {
    let files = Files::new(&path_scene());
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let shown = |view: View| {
        session.wait("the view", |session| {
            let frame = session.frame()?;
            let Content::Color(pixels) = &frame.content else {
                return None;
            };
            (frame.header.done && frame.header.view == view).then(|| pixels.colors.clone())
        })
    };
    let raw = shown(View::Color);
    session.inner.send(Command::View(View::Denoised));
    let denoised = shown(View::Denoised);
    assert_eq!(denoised, denoised_image(&files));
    assert_ne!(denoised, raw);
    session.inner.send(Command::View(View::Color));
    assert_eq!(shown(View::Color), raw);
    // The key of the scene selects the view, in a new session too.
    files.edit("scene.toml", "[render]", "[render]\ndenoise = true");
    assert_eq!(shown(View::Denoised), denoised);
    let second = files.start();
    second.wait("the denoised view", |session| {
        let frame = session.frame()?;
        (frame.header.done && frame.header.view == View::Denoised).then_some(())
    });
    files.edit("scene.toml", "denoise = true", "denoise = false");
    assert_eq!(shown(View::Color), raw);
    assert_eq!(session.state().problems, []);
}
