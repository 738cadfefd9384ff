//! EXR files with one channel are gray images.

use exr::prelude::*;
use wgray::scene::{Overrides, Scene, Texels, TextureKind};

const SIZE: (usize, usize) = (3, 2);

fn write(path: &std::path::Path, names: &[&str], to_channel: impl Fn(Vec<f32>) -> FlatSamples) {
    let texels = SIZE.0 * SIZE.1;
    let channels = names.iter().enumerate().map(|(i, name)| {
        let values = (0..texels).map(|texel| (10 * i + texel) as f32 * 0.25);
        AnyChannel::new(*name, to_channel(values.collect()))
    });
    let image = Image::from_channels(SIZE, AnyChannels::sort(channels.collect()));
    image.write().to_file(path).unwrap();
}

fn load(folder: &std::path::Path) -> std::result::Result<Texels, String> {
    let text = "image = { width = 4, height = 4 }\n\
        camera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }\n\
        [textures.t]\ntype = 'image'\nfile = 't.exr'\n";
    std::fs::write(folder.join("s.toml"), text).unwrap();
    let strict = Overrides {
        strict: true,
        ..Overrides::default()
    };
    let scene = Scene::load_with(folder.join("s.toml"), &strict).map_err(|error| error.to_string())?;
    let TextureKind::Image { image, .. } = &scene.textures[0].kind else {
        panic!("an image");
    };
    assert_eq!((image.width as usize, image.height as usize), SIZE);
    Ok(image.texels.clone())
}

#[test]
fn a_single_channel_is_gray_for_any_name_and_type() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.exr");
    let gray = |first: f32| {
        let values = (0..6).map(|texel| [first + texel as f32 * 0.25; 3]);
        Ok(Texels::Floats(values.collect()))
    };
    for name in ["Y", "Z", "depth.Z", "R"] {
        write(&path, &[name], FlatSamples::F32);
        assert_eq!(load(folder.path()), gray(0.0), "{name}");
    }
    write(&path, &["Y"], |values| {
        FlatSamples::F16(values.into_iter().map(f16::from_f32).collect())
    });
    assert_eq!(load(folder.path()), gray(0.0), "half-precision values differ");
    write(&path, &["A", "Y"], FlatSamples::F32);
    assert_eq!(load(folder.path()), gray(2.5), "opacity changes the image");
}

#[test]
fn unsupported_channels_and_damage_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.exr");
    for (names, channels) in [
        (vec!["U", "V"], "\"U\", \"V\""),
        (vec!["G", "B"], "\"B\", \"G\""),
        (vec!["A"], "\"A\""),
        (vec!["A", "G", "R"], "\"A\", \"G\", \"R\""),
        (
            vec!["light.R", "light.G", "light.B"],
            "\"light.B\", \"light.G\", \"light.R\"",
        ),
    ] {
        write(&path, &names, FlatSamples::F32);
        let message = load(folder.path()).unwrap_err();
        let rule = "\"t.exr\" must have the channels \"R\", \"G\" and \"B\", or a single channel; it has";
        assert!(
            message.ends_with(&format!(":5: textures.t.file: {rule} {channels}")),
            "{message}"
        );
    }
    write(&path, &["Y"], FlatSamples::F32);
    let bytes = std::fs::read(&path).unwrap();
    for length in [20, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let message = load(folder.path()).unwrap_err();
        assert!(message.contains("\"t.exr\" is damaged or truncated: "), "{message}");
    }
}
