//! Builds a scene in code, without a scene file: a row of balls on a checkered ground plane. The texture image of one
//! ball is also built in code. Writes the image with depth and normal layers to an OpenEXR file.
//!
//! ```sh
//! cargo run --release --example build_scene -- balls.exr
//! ```

use std::sync::Arc;

use wgray::scene::{
    Assets, CheckerDescription, ColorDescription, Encoding, GlassDescription, Image, ImageTextureDescription,
    MirrorDescription, PerspectiveDescription, PhongDescription, PlaneDescription, PointLightDescription,
    RenderDescription, SphereDescription, Texels,
};
use wgray::{Aov, ChannelValues, DVec3, Description, Error, Options};

fn main() -> Result<(), Error> {
    let file = std::env::args().nth(1).unwrap_or("target/build_scene.exr".to_string());

    let camera = PerspectiveDescription::new([0.0, -6.0, 2.0], [0.0, 0.0, 0.8], 35.0);
    let description = Description::new(160, 90, camera)
        .with_render(RenderDescription {
            ambient: DVec3::splat(0.2),
            background: DVec3::new(0.4, 0.6, 0.9),
            ..RenderDescription::default()
        })
        .with_texture("tiles", CheckerDescription::new([0.8, 0.8, 0.8], [0.2, 0.2, 0.2]))
        .with_texture("stripes", ImageTextureDescription::new("stripes"))
        .with_material("ground", PhongDescription::new(ColorDescription::texture("tiles")))
        .with_material("striped", PhongDescription::new(ColorDescription::texture("stripes")))
        .with_material("mirror", MirrorDescription::default())
        .with_material("glass", GlassDescription::new(1.5))
        .with_light(PointLightDescription::new([-4.0, -6.0, 8.0], [0.8, 0.8, 0.8]))
        .with_shape(PlaneDescription::new(
            "ground",
            [0.0; 3],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
        ))
        .with_shape(SphereDescription::new("mirror", [-2.0, 0.5, 0.9], 0.9))
        .with_shape(SphereDescription::new("striped", [0.0, 0.0, 0.9], 0.9))
        .with_shape(SphereDescription::new("glass", [2.0, -0.5, 0.9], 0.9));

    // A texture image in memory; its key is the file name that the texture refers to.
    let colors: Vec<[u8; 3]> = (0..32)
        .map(|i| if i % 4 < 2 { [200, 40, 40] } else { [240, 230, 200] })
        .collect();
    let mut assets = Assets::default();
    assets.images.insert(
        "stripes".to_string(),
        Arc::new(Image {
            width: 32,
            height: 1,
            texels: Texels::Bytes(Encoding::Srgb, colors),
        }),
    );
    let scene = description.validate_with(&assets)?;

    let options = Options {
        aovs: vec![Aov::Depth, Aov::Normal],
        ..Options::default()
    };
    let image = wgray::render(&scene, &options)?;
    image.save(&file)?;

    if let Some(ChannelValues::Floats(depths)) = image.channel("depth.Z") {
        let hits = depths.iter().filter(|depth| **depth > 0.0);
        let nearest = hits.copied().fold(f32::INFINITY, f32::min);
        println!("{file}: the nearest surface is at distance {nearest}");
    }
    Ok(())
}
