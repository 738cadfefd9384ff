//! Invalid pixels are counted. Marks for them appear in the displayed image, but not in the output file.

use std::sync::Arc;

use wgray_dev::{Against, Command, Frame, View};

use super::running::{Files, KERNEL, SCENE, TestSession};

fn pixel(png: &[u8], x: u32, y: u32) -> [u8; 3] {
    image::load_from_memory(png).unwrap().into_rgb8().get_pixel(x, y).0
}

fn frame_with_faults(session: &TestSession) -> Option<Arc<Frame>> {
    let frame = session.frame().filter(|frame| frame.header.done)?;
    let found = frame.header.faults.first()?.1.clone();
    (found.nan == 1 && found.infinite == 2 && found.negative == 40).then_some(frame)
}

#[test]
fn invalid_pixels_of_a_shader_are_counted_and_marked() {
    let files = Files::new(SCENE);
    let out = files.path("out.png");
    let session = TestSession::start(files.sources(), Some(out.clone()));
    session.wait_for_rendered_image(&files);
    let frame = session.frame().unwrap();
    assert_eq!(frame.header.faults[0].1, Default::default());
    files.edit(
        KERNEL,
        "film[index] = sum;",
        "let zero = f32(params.samples.x) * 0.0;
        if pixel.y == 3u && pixel.x == 0u { sum.x = zero / zero; }
        if pixel.y == 3u && pixel.x == 1u { sum.y = 1.0 / zero; }
        if pixel.y == 3u && pixel.x == 2u { sum.z = -1.0 / zero; }
        if pixel.y == 20u { sum.z = -1.0; }
        film[index] = sum;",
    );
    let frame = session.wait("the counts of invalid pixels", frame_with_faults);
    let positions = &frame.header.faults[0].1.places;
    assert!(
        positions.contains(&[0, 3]) && positions.contains(&[20, 20]),
        "{positions:?}"
    );
    let displayed = |frame: &Frame| [(0, 3), (1, 3), (2, 3), (30, 20)].map(|(x, y)| pixel(&frame.pictures[0], x, y));
    let (magenta, cyan, green) = ([255, 0, 255], [0, 255, 255], [0, 255, 0]);
    assert_eq!(displayed(&frame), [magenta, cyan, cyan, green]);
    // The output file equals the image that `render` writes, without marks.
    session.wait("the output file", |_| {
        let picture = image::open(&out).ok()?.into_rgb8();
        (picture.get_pixel(1, 3).0 == [0, 255, 0]).then_some(())
    });
    session.inner.send(Command::Marks(false));
    session.wait("an image without marks", |session| {
        frame_with_faults(session).filter(|frame| pixel(&frame.pictures[0], 0, 3) != magenta)
    });
    session.inner.send(Command::Marks(true));
    session.inner.send(Command::View(View::Compare(Against::Cpu)));
    let frame = session.wait("the comparison", |session| {
        frame_with_faults(session).filter(|frame| frame.header.view == View::Compare(Against::Cpu))
    });
    assert_eq!(pixel(&frame.pictures[0], 0, 3), magenta);
    assert_eq!(frame.header.faults[1], ("second", Default::default()));
}

#[test]
fn negative_values_of_a_filter_with_negative_lobes_are_not_faults() {
    let scene = SCENE
        .replace("[render]", "[render]\nfilter = { type = 'mitchell' }")
        .replace(
            "pixel_samples = { pattern = \"grid\", count = 4 }",
            "pixel_samples = { pattern = 'sobol', count = 16 }",
        )
        .replace("[0.8, 0.8, 0.8]", "[50, 50, 50]");
    let files = Files::new(&scene);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let colors = session.colors().colors;
    assert!(
        colors.iter().flatten().any(|v| *v < 0.0),
        "the filter gives no negative values"
    );
    assert_eq!(session.frame().unwrap().header.faults[0].1, Default::default());
}
