//! Renders a scene file to an image file.
//!
//! ```sh
//! cargo run --release --example render_file -- scenes/cornell.toml cornell.png
//! ```

use wgray::{Error, Options, Scene};

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or("scenes/mirror-glass.toml".to_string());
    let file = arguments.next().unwrap_or("target/render_file.png".to_string());

    let scene = Scene::load(scene)?;
    let image = wgray::render(&scene, &Options::default())?;
    image.save(&file)?;

    let (width, height) = (image.width(), image.height());
    println!("{file}: {width} x {height} pixels, rendered on {}", image.device().name);
    Ok(())
}
