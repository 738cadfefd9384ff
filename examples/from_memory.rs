//! Renders views of a model from the bytes of its files, and encodes the images in memory. The renderer reads and
//! writes no files.
//!
//! ```sh
//! cargo run --release --example from_memory -- 50
//! ```

use std::error::Error;
use std::io::Cursor;

use wgray::image::{Format, SaveOptions};
use wgray::scene::{CameraDescription, LoadOptions, MemoryFiles, PerspectiveDescription, SceneFormat};
use wgray::{Context, DVec3, Options, Scene, Session};

/// A scene that refers to two files.
const SCENE: &str = "
image = { width = 96, height = 72 }
camera = { position = [0, -3, 2], look_at = [0, 0, 0.3], fov = 40 }
render = { integrator = 'path', pixel_samples = 4 }
environment = { name = 'studio' }
textures.grid = { type = 'image', file = 'grid.png' }
materials.grid = { type = 'diffuse', color = { texture = 'grid' } }
materials.knot = { type = 'principled', base_color = [0.8, 0.3, 0.1], roughness = 0.3 }
[[shapes]]
type = 'plane'
material = 'grid'
point = [0, 0, 0]
normal = [0, 0, 1]
[[shapes]]
type = 'mesh'
material = 'knot'
file = 'knot.obj'
";

fn main() -> Result<(), Box<dyn Error>> {
    let count: u32 = std::env::args().nth(1).map_or(Ok(3), |count| count.parse())?;

    // The bytes could also come from an archive, a database or the network.
    let files = MemoryFiles::new()
        .with("knot.obj", &include_bytes!("../scenes/meshes/knot.obj")[..])
        .with("grid.png", &include_bytes!("../scenes/textures/grid.png")[..]);
    let options = LoadOptions::new().with_source(files);
    let scene = Scene::from_slice(SCENE.as_bytes(), SceneFormat::Toml, &options)?;

    let mut session = Session::new(&Context::new(), scene);
    for view in 0..count {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(view) / f64::from(count)).sin_cos();
        let position = DVec3::new(3.0 * sin, -3.0 * cos, 2.0);
        let camera = PerspectiveDescription::new(position, [0.0, 0.0, 0.3], 40.0);
        session.set_camera(CameraDescription::from(camera).validate()?)?;
        let mut png = Cursor::new(Vec::new());
        let image = session.render(&Options::default())?;
        image.write_to(&mut png, Format::Png, &SaveOptions::default())?;
        println!("view {view}: a PNG of {} bytes", png.into_inner().len());
    }
    Ok(())
}
