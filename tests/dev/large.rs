//! Images that are too large to display are rendered at a smaller size.

use wgray_dev::{Command, View};

use super::running::{Files, SCENE};

#[test]
fn an_image_too_large_to_display_is_rendered_smaller() {
    let scene = SCENE.replace("count = 4 }", "count = 1 }");
    for (size, max_side) in [((3000, 3000), 3000), ((65_536, 1), 16_384), ((1, 65_536), 16_384)] {
        let files = Files::new(&scene);
        let mut sources = files.sources();
        sources.overrides.size = Some(size);
        let session = super::running::TestSession::start(sources, None);
        let frame = session.wait_for_complete_image(0);
        let header = &frame.header;
        assert_eq!([header.width, header.height], [size.0, size.1]);
        assert_eq!(header.sent, header.finest);
        assert!(header.finest.into_iter().all(|side| side <= max_side), "{header:?}");
        assert!(
            u64::from(header.finest[0]) * u64::from(header.finest[1]) <= 1 << 24,
            "{header:?}"
        );
        assert!(frame.pixel(size.0 - 1, size.1 - 1).is_some() && frame.pixel(size.0, 0).is_none());
        let colors = session.colors();
        assert_eq!([colors.width, colors.height], header.finest);
        // The image equals a render at the smaller size.
        if size == (3000, 3000) {
            let [width, height] = header.finest;
            let smaller = scene.replace("width = 40", &format!("width = {width}"));
            let expected = Files::new(&smaller.replace("height = 30", &format!("height = {height}"))).rendered_image();
            assert!(colors == expected, "{width} x {height}");
        }
        session.inner.send(Command::View(View::Normal));
        let frame = session.wait("the normals", |session| {
            session
                .frame()
                .filter(|frame| frame.header.view == View::Normal && frame.header.done)
        });
        assert_eq!(frame.header.sent, frame.header.finest);
        assert_eq!(session.state().problems, []);
    }
}
