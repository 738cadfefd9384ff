//! Overhead of a view: the time to render 8 x 8 pixels with 1 sample per pixel, from cameras on a circle, in a session
//! and in separate renders: `cargo bench --bench views [-- MODEL...]`. Models are files that `wgray render` accepts.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::{Duration, Instant};

use wgray::scene::{
    Assets, CameraDescription, ColorDescription, Encoding, EnvironmentDescription, Image, ImageTextureDescription,
    Integrator, PerspectiveDescription, PhongDescription, PlaneDescription, PointLightDescription, SphereDescription,
    Texels,
};
use wgray::{Camera, Context, DVec3, Description, Device, Error, Options, Overrides, Scene, Session};

const VIEWS: u32 = 50;

fn main() {
    println!(
        "{:32} {:>8} {:>14} {:>14} {:>8}",
        "scene", "device", "render, ms", "session, ms", "ratio"
    );
    let models = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let models = models.map(|file| {
        let small = Overrides {
            size: Some((8, 8)),
            pixel_samples: Some(1),
            ..Overrides::default()
        };
        let scene = Scene::load_with(&file, &small).unwrap_or_else(|error| panic!("{file}: {error}"));
        (file, scene)
    });
    let built_in = [
        ("one sphere".to_owned(), sphere_scene()),
        ("texture of 4096 x 4096".to_owned(), textured_scene()),
        ("environment of 4096 x 2048".to_owned(), environment_scene()),
    ];
    for (name, scene) in built_in.into_iter().chain(models) {
        for device in [Device::Cpu, Device::Gpu] {
            match compare(&scene, &device) {
                Ok((separate, session)) => println!(
                    "{name:32} {:>8} {:14.2} {:14.2} {:8.1}",
                    if device == Device::Cpu { "cpu" } else { "gpu" },
                    separate.as_secs_f64() * 1e3,
                    session.as_secs_f64() * 1e3,
                    separate.as_secs_f64() / session.as_secs_f64()
                ),
                Err(error) => println!("{name:32} {error}"),
            }
        }
    }
}

/// Returns the median time of a view in a separate render, and in a session.
fn compare(scene: &Scene, device: &Device) -> Result<(Duration, Duration), Error> {
    let options = Options {
        device: device.clone(),
        ..Options::default()
    };
    let cameras = cameras(scene);
    let mut view_scene = scene.clone();
    let separate = median(cameras.iter().take(10).map(|camera| {
        view_scene.camera = *camera;
        let start = Instant::now();
        wgray::render(&view_scene, &options)?;
        Ok(start.elapsed())
    }))?;
    let mut session = Session::new(&Context::new(), scene.clone());
    session.render(&options)?;
    let session = median(cameras.iter().map(|camera| {
        let start = Instant::now();
        session.set_camera(*camera)?;
        session.render(&options)?;
        Ok(start.elapsed())
    }))?;
    Ok((separate, session))
}

fn median(times: impl Iterator<Item = Result<Duration, Error>>) -> Result<Duration, Error> {
    let mut times = times.collect::<Result<Vec<_>, _>>()?;
    times.sort();
    Ok(times[times.len() / 2])
}

/// Returns cameras around the vertical axis through the target of the scene's camera.
fn cameras(scene: &Scene) -> Vec<Camera> {
    let start = scene.camera;
    let offset = start.position - start.look_at;
    let camera = |i: u32| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(VIEWS)).sin_cos();
        let offset = DVec3::new(
            cos * offset.x - sin * offset.y,
            sin * offset.x + cos * offset.y,
            offset.z,
        );
        let camera: CameraDescription = PerspectiveDescription::new(start.look_at + offset, start.look_at, 40.0).into();
        camera.validate().expect("a valid camera")
    };
    (0..VIEWS).map(camera).collect()
}

fn description() -> Description {
    let camera = PerspectiveDescription::new([0.0, -5.0, 2.0], [0.0, 0.0, 0.5], 40.0);
    let mut description = Description::new(8, 8, camera)
        .with_shape(SphereDescription::new("ball", [0.0, 0.0, 0.5], 0.5))
        .with_shape(PlaneDescription::new(
            "ball",
            [0.0; 3],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
        ));
    description.render.pixel_samples.count = 1;
    description
}

fn sphere_scene() -> Scene {
    let description = description()
        .with_material("ball", PhongDescription::new([0.8, 0.1, 0.1]))
        .with_light(PointLightDescription::new([3.0, -4.0, 5.0], [1.0; 3]));
    description.validate().expect("a valid scene")
}

fn image(width: u32, height: u32, texels: Texels) -> Arc<Image> {
    Arc::new(Image { width, height, texels })
}

fn textured_scene() -> Scene {
    let side = 4096;
    let texels = (0..side * side)
        .map(|i: u32| [(i % 251) as u8, (i / side % 241) as u8, 99])
        .collect();
    let mut assets = Assets::default();
    assets.images.insert(
        "texels".to_owned(),
        image(side, side, Texels::Bytes(Encoding::Srgb, texels)),
    );
    let description = description()
        .with_texture("texels", ImageTextureDescription::new("texels"))
        .with_material("ball", PhongDescription::new(ColorDescription::texture("texels")))
        .with_light(PointLightDescription::new([3.0, -4.0, 5.0], [1.0; 3]));
    description.validate_with(&assets).expect("a valid scene")
}

fn environment_scene() -> Scene {
    let (width, height) = (4096, 2048);
    let texels = (0..width * height)
        .map(|i: u32| [(i % 1001) as f32 * 1e-3, 0.5, (i / width) as f32 * 1e-3])
        .collect();
    let mut assets = Assets::default();
    assets
        .images
        .insert("sky".to_owned(), image(width, height, Texels::Floats(texels)));
    let mut description = description().with_material("ball", PhongDescription::new([0.8, 0.1, 0.1]));
    description.render.integrator = Some(Integrator::Path);
    description.environment = Some(EnvironmentDescription::image("sky"));
    description.validate_with(&assets).expect("a valid scene")
}
