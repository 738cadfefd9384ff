//! Film layers as views: equal to `wgray render --aov` with the same samples, and rejected if the scene lacks them.

use std::sync::Arc;

use wgray_dev::{Command, Content, FilmLayer, Frame, View};
use wgray_render::film::{Film, Layer};

use super::running::{Files, KERNEL, RADIANCE, Running, SCENE};

const MEANS: [(View, Layer); 5] = [
    (View::Albedo, Layer::Albedo),
    (View::Direct, Layer::Direct),
    (View::Indirect, Layer::Indirect),
    (View::Emission, Layer::Emission),
    (View::ShadingNormal, Layer::Normal),
];

/// Returns the scene for the path integrator, with an environment.
fn path() -> String {
    SCENE.replace(
        "[render]",
        "[render]\nintegrator = \"path\"\nbackground = [0.1, 0.2, 0.4]",
    )
}

fn adaptive() -> String {
    path().replace(
        "pixel_samples = { pattern = \"grid\", count = 4 }",
        "pixel_samples = { pattern = \"jittered\", count = 4 }\nadaptive = { error = 0.02, max_samples = 96 }",
    )
}

#[track_caller]
fn wait_layer(running: &Running, view: View) -> (FilmLayer, Arc<Frame>) {
    running.wait("the layer", |running| {
        let frame = running
            .frame()
            .filter(|frame| frame.header.done && frame.header.view == view)?;
        match &frame.content {
            Content::Film(layer) => Some((layer.clone(), frame)),
            other => panic!("{other:?}"),
        }
    })
}

fn close(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs().max(1.0))
}

#[test]
fn layers_equal_the_layers_of_render_and_sum_to_the_image() {
    for scene in [path(), adaptive()] {
        let files = Files::new(&scene);
        let running = files.start();
        running.wait_rendered(&files);
        let (colors, light) = (running.colors(), running.state().compile_seconds);
        let layered = files.packed().with_layers();
        let wanted = |layer| files.rendered_as(&layered, &|film: &Film, i| film.layer(layer, i));
        let mut seen = vec![colors.colors.clone()];
        let mut compiled = None;
        for (view, layer) in MEANS {
            running.session.send(Command::View(view));
            let (found, frame) = wait_layer(&running, view);
            assert_eq!(found.values.colors, wanted(layer), "{view:?}");
            assert!(
                !seen.contains(&found.values.colors),
                "{view:?} is as another: the comparison cannot fail"
            );
            assert!(found.values.colors.iter().any(|value| *value != [0.0; 3]), "{view:?}");
            let values = frame.pixel(20, 15).unwrap();
            let value = found.values.colors[15 * 40 + 20].map(|v| v.to_string()).join("  ");
            assert_eq!(values[0].1, value, "{view:?}");
            assert_eq!(
                frame.header.histogram.is_some(),
                found.is_light(),
                "not exactly the layers of light have a histogram"
            );
            seen.push(found.values.colors);
            // One kernel computes all layers.
            let now = running.state().compile_seconds;
            assert_ne!(now, light, "{view:?} takes a kernel");
            assert_eq!(*compiled.get_or_insert(now), now, "{view:?} takes no further one");
        }
        for (i, color) in colors.colors.iter().enumerate() {
            let [direct, indirect, emission] = [2, 3, 4].map(|layer: usize| seen[layer][i]);
            let sum = [0, 1, 2].map(|c| direct[c] + indirect[c] + emission[c]);
            assert!(close(*color, sum), "pixel {i}: {color:?} {sum:?}");
        }
        // The kernel and the image of color are still cached.
        running.session.send(Command::View(View::Color));
        running.wait("light", |running| {
            let frame = running.frame()?;
            matches!(&frame.content, Content::Color(pixels) if frame.header.done && *pixels == colors).then_some(())
        });
        assert_eq!(running.state().compile_seconds, compiled.unwrap());
        running.session.send(Command::View(View::Variance));
        if scene == path() {
            let notice = running.wait("a notice", |running| running.state().notice.clone());
            assert!(
                notice.bad && notice.text == "view `variance`: needs adaptive sampling",
                "{}",
                notice.text
            );
        } else {
            let (found, frame) = wait_layer(&running, View::Variance);
            let wanted = files.rendered_as(&files.packed(), &Film::variance);
            assert_eq!(found.values.colors, wanted);
            assert!(wanted.iter().any(|variance| *variance != wanted[0]));
            assert!(frame.header.legend.is_some() && frame.header.histogram.is_none());
            assert_eq!(
                running.state().compile_seconds,
                compiled.unwrap(),
                "the variance needed another compilation"
            );
        }
        assert_eq!(running.state().problems, []);
    }
}

#[test]
fn the_kernels_of_color_and_layers_are_cached() {
    let files = Files::new(&path());
    let running = files.start();
    running.wait_rendered(&files);
    let colors = running.colors();
    let show = |view| {
        running.session.send(Command::View(view));
        running.wait("the view", |running| {
            let frame = running.frame()?;
            (frame.header.done && frame.header.view == view).then_some(frame)
        })
    };
    let first = running.state().compile_seconds;
    show(View::Direct);
    let compiled = running.state().compile_seconds;
    assert_ne!(compiled, first, "layers use the kernel of the color");
    let color = show(View::Color);
    assert!(matches!(&color.content, Content::Color(pixels) if *pixels == colors));
    show(View::Albedo);
    assert_eq!(running.state().compile_seconds, compiled);
}

#[test]
fn missing_layers_are_rejected_until_an_edit_adds_them() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let of_paths = [View::Albedo, View::Direct, View::Indirect, View::Emission];
    let variance = (View::Variance, "needs adaptive sampling");
    let missing = of_paths.map(|view| (view, "needs integrator = \"path\""));
    assert_eq!(running.state().missing_views, [&missing[..], &[variance]].concat());
    running.session.send(Command::View(View::Direct));
    let notice = running.wait("a notice", |running| running.state().notice.clone());
    assert!(
        notice.bad && notice.text == "view `direct`: needs integrator = \"path\"",
        "{}",
        notice.text
    );
    assert_eq!(running.state().view, View::Color);
    // In this scene the shading normals equal the normals of the first hits.
    running.session.send(Command::View(View::ShadingNormal));
    running.wait("the normals", |running| {
        let frame = running.frame()?;
        matches!(frame.content, Content::Hits(..)).then_some(())
    });
    running.session.send(Command::View(View::Color));
    files.write("scene.toml", &path());
    running.wait_rendered(&files);
    assert_eq!(running.state().missing_views, [variance]);
    running.session.send(Command::View(View::Direct));
    let (before, _) = wait_layer(&running, View::Direct);
    // The layer follows edits of the scene and of shaders.
    let compiled = running.state().compile_seconds;
    files.edit("scene.toml", "color = [0.8, 0.1, 0.1]", "color = [0.1, 0.8, 0.1]");
    let wanted = || {
        files.rendered_as(&files.packed().with_layers(), &|film: &Film, i| {
            film.layer(Layer::Direct, i)
        })
    };
    let green = wanted();
    assert_ne!(before.values.colors, green);
    let shows = |running: &Running, wanted: &[[f32; 3]]| {
        let frame = running.frame().filter(|frame| frame.header.done)?;
        matches!(&frame.content, Content::Film(layer) if layer.values.colors == wanted).then_some(())
    };
    running.wait("the edited scene", |running| shows(running, &green));
    assert_eq!(
        running.state().compile_seconds,
        compiled,
        "a changed color was compiled into the kernel"
    );
    files.edit(KERNEL, RADIANCE, "path_value(simple)");
    running.wait_problem();
    assert!(shows(&running, &green).is_some(), "the last image was discarded");
    files.write_shaders();
    running.wait_well();
    // The direct integrator has no such layer.
    files.write("scene.toml", SCENE);
    running.wait_rendered(&files);
    assert_eq!(running.state().view, View::Color);
    assert_eq!(running.state().missing_views.len(), 5);
}
