//! Renders an image progressively and shows each intermediate image in the terminal, which needs 24-bit colors.
//!
//! ```sh
//! cargo run --release --example progressive -- scenes/cornell.toml
//! ```

use std::io::{self, Write as _};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use wgray::{Error, Options, Overrides, Picture, Scene};

/// The size of the image in pixels. Each character of the terminal shows two pixels, one above the other.
const SIZE: (u32, u32) = (64, 48);

fn main() -> Result<(), Error> {
    let file = std::env::args()
        .nth(1)
        .unwrap_or("scenes/mirror-glass.toml".to_string());
    let overrides = Overrides {
        size: Some(SIZE),
        ..Overrides::default()
    };
    let scene = Scene::load_with(file, &overrides)?;

    let mut last_draw = Instant::now();
    let image = wgray::render_progressive(&scene, &Options::default(), &mut |progress| {
        if last_draw.elapsed() > Duration::from_millis(100) {
            // Moves the cursor up, so that the next image overwrites this image.
            let lines = draw(&progress.picture()?);
            print!("{:3.0} %\x1b[{lines}A\r", progress.share() * 100.0);
            last_draw = Instant::now();
        }
        // Cancels the rendering when the output is closed.
        Ok(match io::stdout().flush() {
            Ok(()) => ControlFlow::Continue(()),
            Err(_) => ControlFlow::Break(()),
        })
    })?;
    draw(&image);
    println!("100 %, rendered on {}", image.device().name);
    Ok(())
}

/// Draws an image and returns the number of lines.
fn draw(image: &Picture) -> usize {
    let (width, bytes) = (image.width() as usize, image.rgb8());
    let rows: Vec<&[u8]> = bytes.chunks(3 * width).collect();
    for pair in rows.chunks_exact(2) {
        for (upper, lower) in pair[0].chunks(3).zip(pair[1].chunks(3)) {
            let (u, l) = (upper, lower);
            print!("\x1b[38;2;{};{};{};48;2;{};{};{}m▀", u[0], u[1], u[2], l[0], l[1], l[2]);
        }
        println!("\x1b[0m");
    }
    rows.len() / 2
}
