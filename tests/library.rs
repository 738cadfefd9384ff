//! The library API on the CPU, with any set of features, and the program `wgray` without the feature `gpu`.

use std::ops::ControlFlow;
#[cfg(all(feature = "cli", not(feature = "gpu")))]
use std::path::Path;
use std::sync::Arc;

use wgray::error::RenderError;
use wgray::image::{BitDepth, Metadata, SaveOptions, read_exr};
use wgray::scene::{
    AdaptiveDescription, Assets, ColorDescription, Encoding, Image, ImageTextureDescription, Pattern,
    PerspectiveDescription, PhongDescription, PlaneDescription, RectangleLightDescription, RenderDescription,
    SamplesDescription, SphereDescription, Texels, ViewSettings, ViewTransform,
};
use wgray::{Aov, ChannelValues, DVec3, Description, Device, Error, Options, Overrides, Picture, Region, Scene};

const FILE: &str = r#"
image = { width = 24, height = 16 }
camera = { position = [0, -5, 2], look_at = [0, 0, 0.5], fov = 40 }
[render]
ambient = [0.1, 0.1, 0.1]
pixel_samples = { pattern = "random", count = 4 }
light_samples = { pattern = "grid", count = 4 }
[materials.red]
type = "phong"
color = [0.8, 0.1, 0.1]
[[lights]]
type = "rectangle"
center = [0, -1, 4]
size = [1, 1]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [0.8, 0.8, 0.8]
[[shapes]]
type = "sphere"
material = "red"
center = [0, 0, 0.5]
radius = 0.5
[[shapes]]
type = "plane"
material = "red"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
"#;

fn description() -> Description {
    let samples = |pattern, count| SamplesDescription {
        pattern: Some(pattern),
        count,
    };
    Description::new(
        24,
        16,
        PerspectiveDescription::new([0.0, -5.0, 2.0], [0.0, 0.0, 0.5], 40.0),
    )
    .with_render(RenderDescription {
        ambient: DVec3::splat(0.1),
        pixel_samples: samples(Pattern::Random, 4),
        light_samples: samples(Pattern::Grid, 4),
        ..RenderDescription::default()
    })
    .with_material("red", PhongDescription::new([0.8, 0.1, 0.1]))
    .with_light(RectangleLightDescription::new(
        [0.0, -1.0, 4.0],
        [1.0, 1.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, 0.0],
        [0.8, 0.8, 0.8],
    ))
    .with_shape(SphereDescription::new("red", [0.0, 0.0, 0.5], 0.5))
    .with_shape(PlaneDescription::new("red", [0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
}

fn cpu_options() -> Options {
    Options {
        device: Device::Cpu,
        ..Options::default()
    }
}

fn scene() -> Scene {
    description().validate().expect("a valid scene")
}

fn floats(picture: &Picture, name: &str) -> Vec<f32> {
    match picture.channel(name) {
        Some(ChannelValues::Floats(values)) => values,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn a_scene_built_in_code_equals_a_scene_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, FILE).unwrap();
    let loaded = Scene::load(&path).unwrap();
    assert_eq!(scene(), loaded);
    let larger = description().with_shape(SphereDescription::new("red", [1.0, 0.0, 0.5], 0.5));
    assert_ne!(larger.validate().unwrap(), loaded);
    let picture = wgray::render(&loaded, &cpu_options()).unwrap();
    assert_eq!((picture.width(), picture.height()), (24, 16));
    assert_eq!(picture.device().name, "cpu");
    let differing_pairs = picture
        .pixels()
        .colors
        .windows(2)
        .filter(|pair| pair[0] != pair[1])
        .count();
    assert!(
        differing_pairs > 100,
        "only {differing_pairs} pairs of neighboring pixels differ"
    );
}

#[test]
fn invalid_scenes_are_reported_with_key_value_and_rule() {
    let ball = SphereDescription::new("red", [0.0, 0.0, 0.5], -1.0);
    let message = |description: Description| Error::from(description.validate().unwrap_err()).to_string();
    let error = message(description().with_shape(ball));
    assert!(error.starts_with("shapes[2].radius: -1 must be from 1e-9"), "{error}");
    let error = message(description().with_shape(SphereDescription::new("blue", [0.0; 3], 1.0)));
    assert!(
        error.starts_with("shapes[2].material: there is no material \"blue\""),
        "{error}"
    );
    let missing = Scene::load("no such file.toml").unwrap_err().to_string();
    assert!(missing.starts_with("no such file.toml: cannot be read: "), "{missing}");
    let overrides = Overrides {
        pixel_samples: Some(0),
        ..Overrides::default()
    };
    let message = Scene::parse_with(FILE, "s.toml", &overrides).unwrap_err().to_string();
    assert_eq!(message, "pixel_samples: 0 must be from 1 to 65536");
}

#[test]
fn invalid_options_are_rejected() {
    let crop_options = |x0, y0, x1, y1| Options {
        crop: Some(Region { x0, y0, x1, y1 }),
        ..cpu_options()
    };
    let aov = Options {
        aovs: vec![Aov::Depth, Aov::Albedo],
        ..cpu_options()
    };
    for (options, expected) in [
        (
            crop_options(0, 0, 25, 16),
            "crop: 0,0,25,16 must lie within the image of 24 x 16 pixels",
        ),
        (
            crop_options(3, 0, 3, 16),
            "crop: 3,0,3,16 must have x0 < x1 and y0 < y1",
        ),
        (crop_options(5, 9, 7, 2), "crop: 5,9,7,2 must have x0 < x1 and y0 < y1"),
        (aov, "aov.albedo: needs integrator = \"path\""),
    ] {
        let error = wgray::render(&scene(), &options).unwrap_err();
        assert_eq!(error.to_string(), expected);
        assert!(matches!(error, Error::Option(_)), "{error:?}");
    }
}

#[test]
fn a_crop_equals_the_region_of_the_full_image() {
    let region = Region {
        x0: 5,
        y0: 3,
        x1: 20,
        y1: 11,
    };
    let aovs = vec![Aov::Depth, Aov::Normal, Aov::Primitive];
    let full = Options { aovs, ..cpu_options() };
    let crop = Options {
        crop: Some(region),
        ..full.clone()
    };
    let (full, crop) = (
        wgray::render(&scene(), &full).unwrap(),
        wgray::render(&scene(), &crop).unwrap(),
    );
    assert_eq!(crop.region(), region);
    for name in ["R", "G", "B", "depth.Z", "normal.X", "normal.Z"] {
        let rows = floats(&full, name);
        let cropped = rows.chunks(24).take(11).skip(3).flat_map(|row| row[5..20].to_vec());
        assert_eq!(floats(&crop, name), cropped.collect::<Vec<_>>(), "{name}");
    }
    let Some(ChannelValues::Whole(shapes)) = crop.channel("primitive.ID") else {
        panic!("no shapes")
    };
    assert!(shapes.contains(&0) && shapes.contains(&1));
    assert_eq!(crop.channel("uv.U"), None);
}

#[test]
fn the_extension_selects_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let options = Options {
        aovs: vec![Aov::Depth, Aov::Depth],
        ..cpu_options()
    };
    let picture = wgray::render(&scene(), &options).unwrap();
    assert_eq!(picture.aovs(), [Aov::Depth]);
    picture.save(path("a.png")).unwrap();
    let png = |name: &str| image::open(path(name)).unwrap().into_rgb8();
    assert_eq!(png("a.png").into_raw(), picture.rgb8());
    assert_eq!(png("a.depth.png").dimensions(), (24, 16));
    let error = picture.save(path("a.gif")).unwrap_err().to_string();
    assert!(
        error.ends_with("a.gif: must end in .png, .exr, .jpg, .jpeg or .webp"),
        "{error}"
    );
    assert!(!path("a.gif").exists());
    // `save_with` uses its options; the view settings come from the scene.
    let save_options = SaveOptions {
        bit_depth: BitDepth::Sixteen,
        metadata: Metadata {
            pairs: vec![("Source".to_owned(), "a test, 21 °C, 数".to_owned())],
        },
        ..SaveOptions::default()
    };
    for name in ["b.png", "b.jpg"] {
        picture.save_with(path(name), &save_options).unwrap();
    }
    assert_eq!(image::open(path("b.png")).unwrap().color(), image::ColorType::Rgb16);
    if cfg!(feature = "formats") {
        picture.save_with(path("b.exr"), &save_options).unwrap();
        assert_eq!(read_exr(&path("b.exr")).unwrap(), picture.pixels());
        picture.save_with(path("b.webp"), &save_options).unwrap();
        assert_eq!(png("b.webp").into_raw(), picture.rgb8());
    }
    let mut description = description();
    description.image.view_transform = ViewTransform::Srgb;
    description.image.exposure = -1.0;
    let darker = wgray::render(&description.validate().unwrap(), &options).unwrap();
    assert_eq!(darker.pixels(), picture.pixels());
    let halved = darker.pixels().colors.into_iter();
    let settings = ViewSettings {
        transform: ViewTransform::Srgb,
        exposure: 0.0,
    };
    let expected: Vec<u8> = halved.flat_map(|color| settings.rgb8(color.map(|x| x / 2.0))).collect();
    assert_eq!(darker.rgb8(), expected);
    assert_ne!(darker.rgb8(), picture.rgb8());
}

#[test]
fn a_progressive_image_equals_the_rendered_image_and_can_be_cancelled() {
    let mut adaptive = description();
    adaptive.render.adaptive = Some(AdaptiveDescription {
        error: 0.01,
        max_samples: Some(64),
    });
    adaptive.image.width = 130; // more than the first dispatch covers
    adaptive.image.height = 130;
    let mut uniform = adaptive.clone();
    uniform.render.adaptive = None;
    for description in [uniform, adaptive] {
        let scene = description.validate().unwrap();
        let options = Options {
            aovs: vec![Aov::Depth],
            crop: Some(Region {
                x0: 1,
                y0: 2,
                x1: 130,
                y1: 129,
            }),
            ..cpu_options()
        };
        let rendered = wgray::render(&scene, &options).unwrap();
        let mut images: Vec<(f64, Picture)> = Vec::new();
        let result = wgray::render_progressive(&scene, &options, &mut |progress| {
            images.push((progress.share(), progress.picture()?));
            Ok(ControlFlow::Continue(()))
        });
        assert!(result.unwrap() == rendered);
        assert!(images.len() > 1, "{}", images.len());
        assert!(images.is_sorted_by(|a, b| a.0 <= b.0));
        let (fraction, last) = images.pop().unwrap();
        assert!((fraction - 1.0).abs() < 1e-9 && last == rendered, "{fraction}");
        assert!(images[0].1 != rendered, "the first image equals the last");

        let cancelled = wgray::render_progressive(&scene, &options, &mut |_| Ok(ControlFlow::Break(())));
        assert!(matches!(cancelled, Err(Error::Render(RenderError::Cancelled))));
        let failed = wgray::render_progressive(&scene, &options, &mut |_| {
            Err(Error::Render(RenderError::Output(std::io::Error::other("no screen"))))
        });
        assert_eq!(failed.unwrap_err().to_string(), "no screen");
    }
}

#[test]
fn layers_are_parsed_by_name() {
    for aov in Aov::ALL {
        assert_eq!(aov.to_string().parse(), Ok(aov));
    }
    let error = "dept".parse::<Aov>().unwrap_err();
    assert!(error.starts_with("\"dept\" must be one of normal, "), "{error}");
}

#[test]
fn an_image_in_memory_equals_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let colors: Vec<[u8; 3]> = (0..12).map(|i| [i * 20, 255 - i * 9, 40]).collect();
    let bytes: Vec<u8> = colors.concat();
    image::save_buffer(folder.path().join("a.png"), &bytes, 4, 3, image::ColorType::Rgb8).unwrap();
    let description = description()
        .with_texture("a", ImageTextureDescription::new("a.png"))
        .with_material("red", PhongDescription::new(ColorDescription::texture("a")));
    let validate_with_image = |width, height, texels| {
        let image = Image { width, height, texels };
        let mut assets = Assets::default();
        assets.images.insert("a.png".to_string(), Arc::new(image));
        description.validate_with(&assets)
    };
    let from_file = description.validate_with(&Assets::beside(folder.path())).unwrap();
    let from_memory = validate_with_image(4, 3, Texels::Bytes(Encoding::Srgb, colors.clone())).unwrap();
    assert_eq!(from_file.textures, from_memory.textures);
    assert_eq!((from_file.files.len(), from_memory.files.len()), (1, 0));
    let error = |width, height, texels| validate_with_image(width, height, texels).unwrap_err().to_string();
    for (width, height, texels, rule) in [
        (
            4,
            4,
            Texels::Bytes(Encoding::Srgb, colors),
            "has 12 texels; its size is 4 x 4",
        ),
        (0, 1, Texels::Floats(Vec::new()), "must have at least one texel"),
        (
            1,
            1,
            Texels::Floats(vec![[f32::NAN; 3]]),
            "has the texel [NaN, NaN, NaN] at (0, 0)",
        ),
        (20_000, 1, Texels::Floats(Vec::new()), "must have at most 16384 texels"),
    ] {
        let message = error(width, height, texels);
        assert!(
            message.starts_with("textures.a.file: \"a.png\"") && message.contains(rule),
            "{message}"
        );
    }
}

#[test]
fn device_names_are_valid_choices() {
    for (name, device) in [
        ("auto", Device::Auto),
        ("CPU", Device::Cpu),
        ("Gpu", Device::Gpu),
        ("llvmpipe", Device::Named("llvmpipe".to_string())),
    ] {
        assert_eq!(Device::from(name), device);
    }
}

/// Layered materials need the largest stack frames, especially without optimization, as in `cargo test` of a program
/// that uses the library.
#[test]
fn all_kinds_of_materials_fit_into_the_stack_of_a_thread() {
    for material in [
        "type = \"diffuse\"\ncolor = [0.8, 0.1, 0.1]",
        "type = \"principled\"\nroughness = 0.3\nanisotropy = 0.4\nclearcoat = 1\nsheen_color = [0.2, 0.2, 0.2]",
        "type = \"principled\"\nroughness = 0.3\ntransmission = 1",
        "type = \"conductor\"\nmetal = \"gold\"\nroughness = 0.3",
        "type = \"dielectric\"\nior = 1.5\nroughness = 0.3",
    ] {
        let text = FILE.replace("type = \"phong\"\ncolor = [0.8, 0.1, 0.1]", material);
        let path = tempfile::Builder::new().suffix(".toml").tempfile().expect("a file");
        std::fs::write(
            &path,
            text.replace("ambient = [0.1, 0.1, 0.1]", "integrator = \"path\""),
        )
        .expect("a scene");
        let scene = Scene::load(path.path()).expect("a valid scene");
        let picture = wgray::render(&scene, &cpu_options()).expect("an image");
        assert!(floats(&picture, "R").iter().any(|value| *value > 0.0), "{material}");
    }
}

#[cfg(not(feature = "gpu"))]
#[test]
fn without_the_feature_gpu_only_the_cpu_exists() {
    let scene = scene();
    let picture = wgray::render(&scene, &Options::default()).unwrap();
    assert_eq!(picture.device().name, "cpu");
    assert!(picture == wgray::render(&scene, &cpu_options()).unwrap());
    for (device, start) in [(Device::Gpu, "a GPU: "), (Device::from("llvmpipe"), "'llvmpipe': ")] {
        let options = Options {
            device,
            ..Options::default()
        };
        let error = wgray::render(&scene, &options).unwrap_err();
        assert!(matches!(error, Error::Render(RenderError::NoDevice(_))), "{error:?}");
        let message = error.to_string();
        assert!(
            message.starts_with(start) && message.contains("feature \"gpu\""),
            "{message}"
        );
    }
}

#[cfg(all(feature = "cli", not(feature = "gpu")))]
#[test]
fn the_program_without_the_feature_gpu_renders_on_the_cpu() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), FILE).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = assert_cmd::Command::new(Path::new(env!("CARGO_BIN_EXE_wgray")));
        let output = command.current_dir(&folder).args(arguments).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let silent = (Some(0), String::new(), String::new());
    assert_eq!(run(&["render", "s.toml", "-o", "s.exr", "-q"]), silent);
    let picture = wgray::render(&scene(), &cpu_options()).unwrap();
    assert_eq!(read_exr(&folder.path().join("s.exr")).unwrap(), picture.pixels());
    let (code, _, stderr) = run(&["render", "s.toml", "-o", "gpu.exr", "--device", "gpu"]);
    assert_eq!(code, Some(4), "{stderr}");
    assert!(stderr.contains("built without the feature \"gpu\""), "{stderr}");
    assert!(!folder.path().join("gpu.exr").exists());
    let (code, listed, stderr) = run(&["devices"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    assert!(
        listed.contains("auto selects: cpu") && listed.contains("feature \"gpu\""),
        "{listed}"
    );
    let (code, stdout, stderr) = run(&["check", "s.toml"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    assert!(stdout.starts_with("s.toml: ok: 24 x 16 pixels"), "{stdout}");
    assert_eq!(run(&["dev", "s.toml"]).0, Some(2));
}
