//! Renders a scene on an adapter and on the CPU, and compares the two images bit by bit.
//!
//! ```sh
//! cargo run --release --example gpu_against_cpu -- scenes/textures.toml
//! ```

use std::process::ExitCode;

use wgray::image::difference;
use wgray::{Device, Error, Options, Overrides, Scene};

fn main() -> Result<ExitCode, Error> {
    let file = std::env::args()
        .nth(1)
        .unwrap_or("scenes/mirror-glass.toml".to_string());
    let overrides = Overrides {
        size: Some((96, 64)),
        pixel_samples: Some(4),
        ..Overrides::default()
    };
    let scene = Scene::load_with(file, &overrides)?;
    let render = |device| {
        let options = Options {
            device,
            ..Options::default()
        };
        wgray::render(&scene, &options)
    };
    let (gpu, cpu) = (render(Device::Gpu)?, render(Device::Cpu)?);
    if gpu.device() == cpu.device() {
        eprintln!("the adapter cannot render this scene; the CPU rendered it instead");
        return Ok(ExitCode::FAILURE);
    }
    let Some(difference) = difference(&gpu.pixels(), &cpu.pixels(), 0.0) else {
        return Ok(ExitCode::FAILURE); // the images have different sizes
    };
    let name = &gpu.device().name;
    println!(
        "{name}: pixels that differ from the CPU: {}; largest difference: {}",
        difference.unequal, difference.largest
    );
    Ok(match difference.unequal {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    })
}
