//! The library API on the adapter under test: device selection and the fallback to the CPU.

use std::ops::ControlFlow;

use wgray::error::RenderError;
use wgray::{Aov, Device, Error, Options, Overrides, Scene};

use crate::{adapter, sources};

fn scene(overrides: Overrides) -> Scene {
    let size = overrides.size.or(Some((40, 30)));
    let overrides = Overrides { size, ..overrides };
    Scene::load_with(sources::path("scenes/mirror-glass.toml"), &overrides).expect("a valid scene")
}

fn options_for(device: Device) -> Options {
    Options {
        device,
        aovs: vec![Aov::Depth, Aov::Normal],
        ..Options::default()
    }
}

#[test]
fn every_device_choice_gives_the_same_image_and_reports_the_device() {
    let Some(device) = adapter::device() else { return };
    let name = device.info.name.clone();
    let scene = scene(Overrides::default());
    let cpu = wgray::render(&scene, &options_for(Device::Cpu)).unwrap();
    assert_eq!(cpu.device().name, "cpu");
    let exact = Options {
        exact_rounding: device.info.exact,
        ..options_for(Device::Named(name.clone()))
    };
    for options in [options_for(Device::Named(name.clone())), exact] {
        let picture = wgray::render(&scene, &options).unwrap();
        assert_eq!(picture.device().name, name);
        if adapter::bit_exact(device) {
            assert!(picture.pixels() == cpu.pixels(), "{options:?}");
            assert!(picture.channel("depth.Z") == cpu.channel("depth.Z"), "{options:?}");
        }
    }
    let first = wgray::adapters()[0].name.clone();
    for choice in [Device::Auto, Device::Gpu, Device::Named("1".to_string())] {
        let picture = wgray::render(&scene, &options_for(choice)).unwrap();
        assert_eq!(picture.device().name, first);
    }
    let error = wgray::render(&scene, &options_for(Device::from("abacus"))).unwrap_err();
    assert!(matches!(error, Error::Render(RenderError::NoDevice(_))), "{error:?}");
}

#[test]
fn the_final_progressive_image_equals_the_rendered_image() {
    let Some(device) = adapter::device() else { return };
    let scene = scene(Overrides {
        size: Some((130, 131)),
        ..Overrides::default()
    });
    let options = options_for(Device::Named(device.info.name.clone()));
    let rendered = wgray::render(&scene, &options).unwrap();
    let mut images = Vec::new();
    let result = wgray::render_progressive(&scene, &options, &mut |progress| {
        images.push(progress.picture()?);
        Ok(ControlFlow::Continue(()))
    });
    assert!(result.unwrap() == rendered);
    assert!(images.len() > 1 && images[0] != rendered && images.last() == Some(&rendered));
    let cancelled = wgray::render_progressive(&scene, &options, &mut |_| Ok(ControlFlow::Break(())));
    assert!(matches!(cancelled, Err(Error::Render(RenderError::Cancelled))));
}

/// On drivers that truncate loops, one sample of this scene exceeds the limit. The image then names the CPU as device.
#[test]
fn a_sample_too_long_for_the_driver_is_rendered_by_the_cpu() {
    let Some(device) = adapter::device() else { return };
    let scene = scene(Overrides {
        size: Some((2, 1)),
        pixel_samples: Some(1),
        light_samples: Some(65_536),
        ..Overrides::default()
    });
    let options = options_for(Device::Named(device.info.name.clone()));
    let cpu = wgray::render(&scene, &options_for(Device::Cpu)).unwrap();
    let progressive = wgray::render_progressive(&scene, &options, &mut |progress| {
        progress.picture().map(|_| ControlFlow::Continue(()))
    });
    for picture in [wgray::render(&scene, &options).unwrap(), progressive.unwrap()] {
        let name = &picture.device().name;
        assert!(name == "cpu" || *name == device.info.name, "{name}");
        if adapter::bit_exact(device) {
            assert!(picture.pixels() == cpu.pixels());
        }
    }
}
