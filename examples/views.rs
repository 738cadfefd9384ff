//! Renders a scene from cameras on a circle, in one session: all views share the device and the packed scene.
//!
//! ```sh
//! cargo run --release --example views -- scenes/materials.toml 12
//! ```

use std::error::Error;
use std::f64::consts::TAU;
use std::time::Instant;

use wgray::scene::{CameraDescription, PerspectiveDescription};
use wgray::{Context, DVec3, Options, Overrides, Scene, Session};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().unwrap_or("scenes/orthographic.toml".to_string());
    let count: u32 = arguments.next().map_or(Ok(5), |count| count.parse())?;

    let overrides = Overrides {
        size: Some((96, 72)),
        ..Overrides::default()
    };
    let scene = Scene::load_with(&file, &overrides)?;
    let (target, offset) = (scene.camera.look_at, scene.camera.position - scene.camera.look_at);

    let mut session = Session::new(&Context::new(), scene);
    for view in 0..count {
        let start = Instant::now();
        let (sin, cos) = (TAU * f64::from(view) / f64::from(count)).sin_cos();
        let rotated = DVec3::new(
            cos * offset.x - sin * offset.y,
            sin * offset.x + cos * offset.y,
            offset.z,
        );
        let camera = CameraDescription::from(PerspectiveDescription::new(target + rotated, target, 40.0));
        session.set_camera(camera.validate()?)?;
        let image = session.render(&Options::default())?;
        let file = format!("target/view-{view}.png");
        image.save(&file)?;
        println!("{file}: {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(())
}
