//! Variables of shaders that are shown as layers: what they held at the samples' ends.

use std::sync::Arc;

use wgray::image::Pixels;
use wgray_dev::{Command, Content, Frame, LayerName, View};

use super::running::{Files, KERNEL, Running, SCENE};

const PIXEL: &str = "shaders/pixel.wgsl";
const PLACE: &str = "let place = vec2f(pixel) + at.xy;\n    var ray";

fn layer(name: &str) -> View {
    View::Layer(LayerName::new(name).unwrap())
}

/// Returns the finished image of a layer, and its frame.
#[track_caller]
fn wait_layer(running: &Running, name: &str) -> (Pixels, Arc<Frame>) {
    running.wait("the layer", |running| {
        let frame = running
            .frame()
            .filter(|frame| frame.header.done && frame.header.view == layer(name))?;
        match &frame.content {
            Content::Layer(pixels, _) => Some((pixels.clone(), frame)),
            other => panic!("{other:?}"),
        }
    })
}

/// Shaders in which `seen` is what is said, where the camera's ray starts.
fn with_seen(files: &Files, ty: &str, said: &str) {
    files.edit(PIXEL, PLACE, &PLACE.replace('\n', &format!("\n    {said}\n")));
    files.write(
        PIXEL,
        &format!("{}\nvar<private> seen: {ty}; // layer\n", files.read(PIXEL)),
    );
}

#[test]
fn a_layer_is_the_mean_of_what_it_held() {
    let path = SCENE.replace("[render]", "[render]\nintegrator = \"path\"");
    let adaptive = path.replace(
        "pixel_samples = { pattern = \"grid\", count = 4 }",
        "pixel_samples = { pattern = \"jittered\", count = 4 }\nadaptive = { error = 0.2, max_samples = 8 }",
    );
    for scene in [&SCENE.to_string(), &path, &adaptive] {
        let files = Files::new(scene);
        // It is 0 before each sample: of every four one has the last number.
        with_seen(
            &files,
            "vec3f",
            "seen.x = place.x; seen.y = -place.y; if sample % 4u == 1u { seen.z = 4.0; }",
        );
        let running = files.start();
        running.wait_rendered(&files);
        let (colors, compiled) = (running.colors(), running.state().compile_seconds);
        assert_eq!(running.state().layers, [LayerName::new("seen").unwrap()]);
        running.session.send(Command::View(layer("seen")));
        let (pixels, frame) = wait_layer(&running, "seen");
        assert_ne!(running.state().compile_seconds, compiled, "it takes a kernel");
        for (i, found) in pixels.colors.iter().enumerate() {
            let (x, y) = (i % 40, i / 40);
            let middle = [x as f32 + 0.5, -(y as f32 + 0.5), 1.0];
            if *scene == adaptive {
                // Its samples lie anywhere in the pixel; all have their say.
                let apart = found.iter().zip(middle).map(|(found, middle)| (found - middle).abs());
                assert!(
                    apart.fold(0.0, f32::max) < 0.5 && found[2] == 1.0,
                    "pixel {x} {y}: {found:?}"
                );
            } else {
                assert_eq!(*found, middle, "pixel {x} {y}");
            }
        }
        if *scene != adaptive {
            assert_eq!(
                frame.pixel(3, 2),
                Some(vec![
                    ("layer", "3.5  -2.5  1".to_string()),
                    ("bits", "40600000  c0200000  3f800000".to_string())
                ])
            );
        }
        let (_, faults) = &frame.header.faults[0];
        assert_eq!(
            (faults.nan, faults.infinite, faults.negative),
            (0, 0, 0),
            "negative values are valid"
        );
        // Back to color: its kernel and its image are still available.
        let compiled = running.state().compile_seconds;
        running.session.send(Command::View(View::Color));
        running.wait("light", |running| {
            let frame = running.frame()?;
            matches!(&frame.content, Content::Color(pixels) if frame.header.done && *pixels == colors).then_some(())
        });
        running.session.send(Command::View(layer("seen")));
        assert_eq!(wait_layer(&running, "seen").0, pixels);
        assert_eq!(running.state().compile_seconds, compiled);
        assert_eq!(running.state().problems, []);
    }
}

#[test]
fn a_layer_of_normals_is_what_the_first_hits_say() {
    let files = Files::new(&SCENE.replace(
        "pixel_samples = { pattern = \"grid\", count = 4 }",
        "pixel_samples = { pattern = \"grid\", count = 1 }",
    ));
    files.tint(0.5); // what is done to light afterwards is not done to the layer
    let call = "return radiance_from(spot_of(hit), hit, path, pixel, sample);";
    let file = "shaders/integrators/phong.wgsl";
    files.edit(
        file,
        call,
        &format!("turned = surface_of(spot_of(hit), hit, path.ray).normal;\n        {call}"),
    );
    files.write(
        file,
        &format!("{}var<private> turned: vec3f; // layer\n", files.read(file)),
    );
    let running = files.start();
    running.wait_rendered(&files);
    running.session.send(Command::View(View::Normal));
    let hits = running.wait("the normals", |running| {
        let frame = running.frame().filter(|frame| frame.header.done)?;
        match &frame.content {
            Content::Hits(_, hits) => Some(hits.clone()),
            _ => None,
        }
    });
    running.session.send(Command::View(layer("turned")));
    let (pixels, _) = wait_layer(&running, "turned");
    let wanted: Vec<[f32; 3]> = hits.iter().map(|hit| hit.normal.into()).collect();
    assert!(wanted.iter().any(|normal| *normal != wanted[0]));
    assert_eq!(pixels.colors, wanted);
}

#[test]
fn layers_follow_edits_and_those_that_are_not_there_are_told() {
    let files = Files::new(SCENE);
    with_seen(&files, "f32", "seen = bitcast<f32>(0x7f800000u + (sample >> 8u));");
    let running = files.start();
    running.wait_rendered(&files);
    running.session.send(Command::View(layer("seen")));
    let (_, frame) = wait_layer(&running, "seen");
    assert_eq!(frame.header.faults[0].1.infinite, 1200, "infinite values are counted");
    files.edit(PIXEL, "bitcast<f32>(0x7f800000u + (sample >> 8u));", "0.25;");
    running.wait("a quarter", |running| {
        let frame = running.frame().filter(|frame| frame.header.done)?;
        let Content::Layer(pixels, 1) = &frame.content else {
            return None;
        };
        (pixels.colors == [[0.25; 3]; 1200] && frame.pixel(0, 0)?[0].1 == "0.25").then_some(())
    });
    // A kernel that no layer fits.
    files.edit(KERNEL, "sum += path_value(path);", "sum = sum + path_value(path);");
    let problem = running.wait_problem();
    assert!(problem.message.contains("`seen` cannot be shown"), "{problem:?}");
    assert!(problem.place.as_ref().unwrap().contains("pixel.wgsl:"), "{problem:?}");
    running.session.send(Command::View(View::Color));
    running.wait_rendered(&files);
    files.write_shaders();
    running.wait("no layer", |running| running.state().layers.is_empty().then_some(()));
    running.session.send(Command::View(layer("seen")));
    let notice = running.wait("a notice", |running| running.state().notice.clone());
    assert!(notice.bad && notice.text.contains("no layer `seen`"), "{}", notice.text);
    assert_eq!(running.state().view, View::Color);
    // One that is looked at and goes gives its place to light.
    with_seen(&files, "f32", "seen = 0.5;");
    running.wait("the layer", |running| {
        (!running.state().layers.is_empty()).then_some(())
    });
    running.session.send(Command::View(layer("seen")));
    wait_layer(&running, "seen");
    files.write_shaders();
    running.wait_rendered(&files);
    assert_eq!(running.state().view, View::Color);
    files.write(
        PIXEL,
        &format!("{}\nvar<private> wide: mat3x3f; // layer\n", files.read(PIXEL)),
    );
    let problem = running.wait_problem();
    assert!(
        problem.message.contains("`mat3x3f`") && problem.line.is_some(),
        "{problem:?}"
    );
}
