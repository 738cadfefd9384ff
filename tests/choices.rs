//! The library API on the adapter under test: device selection and the fallback to the CPU.

use std::ops::ControlFlow;

use wgray::error::RenderError;
use wgray::{Aov, Device, Error, Options, Overrides, Region, Scene};

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
    // Software Vulkan takes longer to compile the kernel than the CPU to render this image.
    let automatic = if device.info.is_software() { "cpu" } else { &first };
    let first_adapter = Device::Named("1".to_string());
    for (choice, expected) in [
        (Device::Auto, automatic),
        (Device::Gpu, &first),
        (first_adapter, &first),
    ] {
        let picture = wgray::render(&scene, &options_for(choice)).unwrap();
        assert_eq!(picture.device().name, expected);
    }
    let error = wgray::render(&scene, &options_for(Device::from("abacus"))).unwrap_err();
    assert!(matches!(error, Error::Render(RenderError::NoDevice(_))), "{error:?}");
}

/// On software Vulkan, the CPU renders a crop of one pixel, and the adapter the full image and later crops.
#[test]
fn a_session_selects_the_device_again_for_more_work() {
    let Some(device) = adapter::device() else { return };
    let overrides = Overrides {
        size: Some((200, 200)),
        ..Overrides::default()
    };
    let scene = Scene::load_with(sources::path("scenes/cornell.toml"), &overrides).expect("a valid scene");
    let mut session = wgray::Session::new(&wgray::Context::new(), scene);
    let crop = Options {
        crop: Some(Region::whole(1, 1)),
        ..Options::default()
    };
    // One thread, so that the selection does not depend on the machine.
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let mut render = |options: &Options| one_thread.install(|| session.render(options)).expect("an image");
    let [first, full, last] = [&crop, &Options::default(), &crop].map(&mut render);
    if device.info.is_software() {
        assert_eq!(first.device().name, "cpu");
        assert_ne!(full.device().name, "cpu");
    }
    assert_eq!(last.device(), full.device());
    assert!(!adapter::bit_exact(device) || first.pixels() == last.pixels());
    assert_eq!(last.pixels().colors.first(), full.pixels().colors.first());
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

/// Only failures of the render itself are handled by another device.
#[test]
fn errors_of_the_callback_end_the_render() {
    let scene = scene(Overrides::default());
    let foreign_error = || RenderError::OutOfMemory {
        device: "another device".to_owned(),
        message: None,
    };
    for device in [Device::Auto, Device::Cpu, Device::Gpu] {
        if device == Device::Gpu && adapter::device().is_none() {
            continue;
        }
        let result = wgray::render_progressive(&scene, &options_for(device), &mut |_| Err(foreign_error().into()));
        let Err(Error::Render(RenderError::OutOfMemory { device, .. })) = result else {
            panic!("{result:?}")
        };
        assert_eq!(device, "another device");
    }
}

#[test]
fn the_device_states_the_number_of_threads_of_the_render() {
    let mut session = wgray::Session::new(&wgray::Context::new(), scene(Overrides::default()));
    let mut driver = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        let picture = pool
            .install(|| session.render(&options_for(Device::Cpu)))
            .expect("an image");
        picture.device().driver.clone()
    };
    assert!(driver(3).ends_with(" 3 threads"));
    assert!(driver(1).ends_with(" 1 thread"));
}

#[test]
fn an_image_with_layers_that_does_not_fit_into_memory_is_an_error() {
    let scene = scene(Overrides {
        size: Some((65_536, 65_536)),
        ..Overrides::default()
    });
    for aovs in [vec![], vec![Aov::Depth]] {
        let options = Options {
            aovs,
            ..options_for(Device::Cpu)
        };
        let result = wgray::render(&scene, &options);
        assert!(
            matches!(result, Err(Error::Render(RenderError::Memory(_)))),
            "{result:?}"
        );
    }
}
