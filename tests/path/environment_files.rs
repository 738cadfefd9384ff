//! Environment maps in scene files: image formats and error messages.

use std::path::Path;

use wgray::scene::{Overrides, Scene};

use crate::textures::{write_exr, write_png};

const SCENE_START: &str = "image = { width = 4, height = 4 }\ncamera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }\n\
                     render = { integrator = 'path' }\n";

fn load(folder: &Path, environment: &str) -> Result<Scene, String> {
    let path = folder.join("s.toml");
    std::fs::write(&path, format!("{SCENE_START}[environment]\n{environment}\n")).unwrap();
    Scene::load_with(
        &path,
        &Overrides {
            strict: true,
            ..Overrides::default()
        },
    )
    .map_err(|error| {
        let message = error.to_string();
        let start = format!("{}:", path.display());
        message
            .strip_prefix(&start)
            .unwrap_or_else(|| panic!("{message}"))
            .to_string()
    })
}

#[test]
fn images_of_every_format_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_exr(&path("sky.exr"), 4, 2, |_, _| [0.5; 3]);
    image::Rgb32FImage::from_pixel(4, 2, image::Rgb([0.5; 3]))
        .save(path("sky.hdr"))
        .unwrap();
    write_png(&path("sky.png"), 4, 2, |_, _| [188; 3]);
    image::RgbImage::from_pixel(4, 2, image::Rgb([188; 3]))
        .save(path("sky.jpg"))
        .unwrap();
    for name in ["sky.exr", "sky.hdr", "sky.png", "sky.jpg"] {
        let scene = load(folder.path(), &format!("file = '{name}'")).unwrap();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        assert!(scene.files.iter().any(|file| file.ends_with(name)), "{:?}", scene.files);
        let packed = wgray_render::pack::pack(&scene);
        let offset = packed.environment.texels as usize;
        let value = f32::from_bits(packed.textures.texels[offset]);
        // 188/255 in sRGB is 0.5029 linear.
        assert!((value - 0.5).abs() < 6e-3, "{name}: {value}");
    }
    write_exr(&path("square.exr"), 3, 3, |_, _| [0.5; 3]);
    let notes = load(folder.path(), "file = 'square.exr'").unwrap().notes;
    assert_eq!(
        notes,
        [
            "environment.file: \"square.exr\" has 3 x 3 texels; equirectangular images are twice as wide as high, so this image is stretched"
        ]
    );
}

#[test]
fn errors_are_reported_with_their_location() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_exr(&path("good.exr"), 4, 2, |_, _| [0.5; 3]);
    write_exr(&path("nan.exr"), 4, 2, |x, y| {
        [if (x, y) == (2, 1) { f32::NAN } else { 1.0 }; 3]
    });
    write_exr(&path("negative.exr"), 4, 2, |x, _| [if x == 3 { -0.5 } else { 1.0 }; 3]);
    write_exr(&path("infinite.exr"), 4, 2, |x, _| {
        [if x == 3 { f32::INFINITY } else { 1.0 }; 3]
    });
    std::fs::write(path("zero.hdr"), b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n").unwrap();
    std::fs::write(path("text.exr"), b"no image").unwrap();
    std::fs::write(
        path("huge.hdr"),
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n",
    )
    .unwrap();
    let rule = "texel values must be from 0 to 1e6";
    for (environment, message) in [
        ("", "4: environment: must have exactly one of \"color\", \"file\" and \"name\"".to_owned()),
        (
            "color = [1, 1, 1]\nfile = 'good.exr'",
            "4: environment: must have exactly one of \"color\", \"file\" and \"name\"".to_owned(),
        ),
        (
            "file = 'nan.exr'",
            format!("5: environment.file: \"nan.exr\" has 1 invalid texel, at (2, 1); {rule}"),
        ),
        (
            "file = 'negative.exr'",
            format!("5: environment.file: \"negative.exr\" has 2 invalid texels, the first at (3, 0); {rule}"),
        ),
        (
            "file = 'infinite.exr'",
            format!("5: environment.file: \"infinite.exr\" has 2 invalid texels, the first at (3, 0); {rule}"),
        ),
        (
            "file = 'text.exr'",
            "5: environment.file: \"text.exr\" must be a PNG, JPEG, WebP, KTX2, EXR or HDR file".to_owned(),
        ),
        (
            "file = 'huge.hdr'",
            "5: environment.file: \"huge.hdr\" (16384 x 8192 texels) needs 2561.7 MiB, in addition to 0.0 MiB for the previous textures; the \
             limit is 1024.0 MiB"
                .to_owned(),
        ),
        (
            "file = 'good.exr'\nscale = -1",
            "6: environment.scale: -1 must be from 0 to 1e6".to_owned(),
        ),
        (
            "file = 'good.exr'\nscale = 2e6",
            "6: environment.scale: 2e6 must be from 0 to 1e6".to_owned(),
        ),
        (
            "file = 'good.exr'\nrotate = 361",
            "6: environment.rotate: 361 must be from -360 to 360".to_owned(),
        ),
        (
            "file = 'good.exr'\nrotate = 'left'",
            "6: environment.rotate: \"left\" must be a number of degrees, a list of 3 angles in degrees or a table such as { axis = [0, 0, 1], degrees = 90 }"
                .to_owned(),
        ),
        (
            "file = 'good.exr'\nturbidity = 3",
            "6: environment.turbidity: needs name = \"sky\"".to_owned(),
        ),
        (
            "name = 'sky'\nsun_elevation = -1",
            "6: environment.sun_elevation: -1 must be from 0 to 90".to_owned(),
        ),
        (
            "name = 'sky'\nturbidity = 0.5",
            "6: environment.turbidity: 0.5 must be from 1 to 10".to_owned(),
        ),
        (
            "name = 'sky'\nsun_azimuth = 400",
            "6: environment.sun_azimuth: 400 must be from -360 to 360".to_owned(),
        ),
    ] {
        assert_eq!(load(folder.path(), environment).unwrap_err(), message, "{environment}");
    }
    let error = |environment: &str| load(folder.path(), environment).unwrap_err();
    for (environment, start) in [
        (
            "file = 'none.exr'",
            "5: environment.file: \"none.exr\" cannot be read: ",
        ),
        ("file = 'zero.hdr'", "5: environment.file: \"zero.hdr\" "),
        ("file = '../up.exr'", "5: environment.file: \"../up.exr\" "),
    ] {
        assert!(error(environment).starts_with(start), "{}", error(environment));
    }
    for environment in [
        "file = 'good.exr'\nscale = 1e6\nrotate = -360\nvisible = false",
        "file = 'good.exr'\nrotate = [10, 20, 30]",
        "file = 'good.exr'\nrotate = { axis = [1, 1, 0], degrees = 20 }",
        "name = 'studio'\nscale = 0",
        "name = 'sky'\nsun_elevation = 0\nsun_azimuth = -360\nturbidity = 10",
        "name = 'sky'\nsun_elevation = 90\nturbidity = 1",
    ] {
        load(folder.path(), environment).unwrap_or_else(|error| panic!("{environment}: {error}"));
    }
}

#[test]
fn generated_environments_are_packed() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["studio", "sky"] {
        let start = std::time::Instant::now();
        let scene = load(folder.path(), &format!("name = '{name}'")).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        println!("{name}: {seconds:.3} s");
        let packed = wgray_render::pack::pack(&scene);
        println!("{name}, packed: {:.3} s", start.elapsed().as_secs_f64() - seconds);
        assert!(
            packed.lighting.emitters.len() == 1 && packed.environment.width > 0,
            "{name}"
        );
    }
}
