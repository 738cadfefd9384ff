//! Reads arbitrary bytes as the image of a texture and of an environment: PNG, JPEG, WebP, KTX2, EXR, HDR.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::Description;
use wgray::scene::Assets;
use wgray_fuzz::render;

const SCENE: &str = "
image = { width = 3, height = 2 }
camera = { position = [0, 0, 3], look_at = [0, 0, 0], up = [0, 1, 0], fov = 50 }
environment = { file = 'a' }
render = { integrator = 'path', pixel_samples = { pattern = 'random', count = 1 } }
[textures.t]
type = 'image'
file = 'a'
[materials.m]
type = 'diffuse'
color = { texture = 't' }
[[shapes]]
type = 'sphere'
material = 'm'
center = [0, 0, 0]
radius = 1
";

fuzz_target!(|bytes: &[u8]| {
    let description = Description::parse(SCENE, "a.toml").expect("a scene");
    let mut assets = Assets::default();
    assets.encoded.insert("a".to_owned(), bytes.into());
    if let Ok(scene) = description.validate_with(&assets) {
        // Building the importance tables of large environment maps takes too long.
        if bytes.len() < 1 << 16 {
            render(&scene);
        }
    }
});
