//! Invalid pixels are counted, and marked in the displayed image only.

use std::sync::Arc;

use wgray_dev::{Against, Command, Frame, View};

use super::running::{Files, KERNEL, Running, SCENE};

fn pixel(png: &[u8], x: u32, y: u32) -> [u8; 3] {
    image::load_from_memory(png).unwrap().into_rgb8().get_pixel(x, y).0
}

fn with_faults(running: &Running) -> Option<Arc<Frame>> {
    let frame = running.frame().filter(|frame| frame.header.done)?;
    let found = frame.header.faults.first()?.1.clone();
    (found.nan == 1 && found.infinite == 2 && found.negative == 40).then_some(frame)
}

#[test]
fn invalid_pixels_of_a_shader_are_counted_and_marked() {
    let files = Files::new(SCENE);
    let out = files.path("out.png");
    let running = Running::start(files.sources(), Some(out.clone()));
    running.wait_rendered(&files);
    let frame = running.frame().unwrap();
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
    let frame = running.wait("the faults", with_faults);
    let places = &frame.header.faults[0].1.places;
    assert!(places.contains(&[0, 3]) && places.contains(&[20, 20]), "{places:?}");
    let shown = |frame: &Frame| [(0, 3), (1, 3), (2, 3), (30, 20)].map(|(x, y)| pixel(&frame.pictures[0], x, y));
    let (magenta, cyan, green) = ([255, 0, 255], [0, 255, 255], [0, 255, 0]);
    assert_eq!(shown(&frame), [magenta, cyan, cyan, green]);
    // The output file equals the image that `render` writes, without marks.
    running.wait("the file", |_| {
        let picture = image::open(&out).ok()?.into_rgb8();
        (picture.get_pixel(1, 3).0 == [0, 255, 0]).then_some(())
    });
    running.session.send(Command::Marks(false));
    running.wait("an image without marks", |running| {
        with_faults(running).filter(|frame| pixel(&frame.pictures[0], 0, 3) != magenta)
    });
    running.session.send(Command::Marks(true));
    running.session.send(Command::View(View::Compare(Against::Cpu)));
    let frame = running.wait("the comparison", |running| {
        with_faults(running).filter(|frame| frame.header.view == View::Compare(Against::Cpu))
    });
    assert_eq!(pixel(&frame.pictures[0], 0, 3), magenta);
    assert_eq!(frame.header.faults[1], ("second", Default::default()));
}

#[test]
fn negative_values_of_a_filter_with_negative_lobes_are_not_faults() {
    let edges = SCENE
        .replace("[render]", "[render]\nfilter = { type = 'mitchell' }")
        .replace(
            "pixel_samples = { pattern = \"grid\", count = 4 }",
            "pixel_samples = { pattern = 'sobol', count = 16 }",
        )
        .replace("[0.8, 0.8, 0.8]", "[50, 50, 50]");
    let files = Files::new(&edges);
    let running = files.start();
    running.wait_rendered(&files);
    let colors = running.colors().colors;
    assert!(
        colors.iter().flatten().any(|v| *v < 0.0),
        "the filter gives no negative values"
    );
    assert_eq!(running.frame().unwrap().header.faults[0].1, Default::default());
}
