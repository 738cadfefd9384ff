//! The denoiser: equal bits on all backends, and how images, parts, crops and the library use it.

use glam::{Vec3, Vec4};
use wgray::film::Film;
use wgray::scene::{Overrides, Scene};
use wgray::{Aov, CancelToken, ChannelValues, Context, Device, Options, Pixels, Session};
use wgray_image::Region;
use wgray_render::denoise::denoise;
use wgray_render::gpu::{self, Rounding};
use wgray_trace::film::FilmLayout;

use crate::adapter;
use crate::layers::{SCENE, scene_with};
use crate::pictures::{crop, reference};
use crate::random::Random;
use crate::scenes::parse;

fn bits(colors: &[Vec3]) -> Vec<[u32; 3]> {
    colors.iter().map(|color| color.to_array().map(f32::to_bits)).collect()
}

/// A film with random values of all magnitudes, some of which are not finite.
fn random_film(seed: u32, width: u32, height: u32) -> Film {
    let film_layout = FilmLayout {
        adaptive: false,
        layers: !seed.is_multiple_of(3),
        noise: true,
    };
    let random = Random::new(seed.into());
    let mut film = Film::of(Region::whole(width, height), film_layout);
    let scale = random.magnitude(-3.0, 3.0) as f32;
    for list in film.lists_mut() {
        for value in list {
            *value = Vec4::from_array([(); 4].map(|()| scale * random.between(0.0, 1.0) as f32));
        }
    }
    for i in 0..film.sums.len() {
        (film.sums[i].w, film.half_sums[i].w, film.moments[i].w) = (4.0, 2.0, 4.0);
        if random.between(0.0, 1.0) < 0.01 {
            film.sums[i].x = [f32::NAN, f32::INFINITY, 1e20, -1.0][i % 4];
        }
    }
    film
}

#[test]
fn gpu_and_cpu_denoise_with_equal_bits() {
    let Some(device) = adapter::device().filter(|device| adapter::bit_exact(device)) else {
        return; // without an adapter, by request
    };
    let roundings = [Rounding::Device, Rounding::Software].map(Some);
    let roundings = if device.info.exact {
        roundings.to_vec()
    } else {
        vec![None]
    };
    let mut films: Vec<Film> = [(1, 1), (1, 20), (33, 2), (57, 41), (140, 36)]
        .into_iter()
        .zip(0..)
        .map(|((width, height), seed)| random_film(seed, width, height))
        .collect();
    films.push(reference(&parse(SCENE).with_layers().with_noise()));
    films.push(reference(&parse(SCENE).with_noise()));
    for (i, film) in films.iter().enumerate() {
        let expected = bits(&denoise(film));
        for rounding in &roundings {
            let found = bits(&gpu::denoise(device, film, *rounding).expect("the device denoises"));
            assert_eq!(found, expected, "film {i}, {rounding:?}");
        }
        // The comparison detects a change of a single pixel.
        let mut changed = film.clone();
        changed.sums[0].y *= 1.001;
        assert_ne!(bits(&denoise(&changed)), expected, "film {i}");
    }
}

fn colors(pixels: &Pixels) -> Vec<[u32; 3]> {
    pixels.colors.iter().map(|color| color.map(f32::to_bits)).collect()
}

#[test]
fn the_library_denoises_with_equal_bits_on_all_devices() {
    let film = reference(&parse(SCENE).with_layers().with_noise());
    let expected = bits(&denoise(&film));
    let raw: Vec<[u32; 3]> = film.means().map(|color| color.map(f32::to_bits)).collect();
    assert_ne!(expected, raw);
    let scene = Scene::parse(SCENE, "s.toml").unwrap();
    let requested = Scene::parse(&scene_with("denoise = true"), "s.toml").unwrap();
    let overrides = Overrides {
        denoise: Some(true),
        ..Overrides::default()
    };
    let overridden = Scene::parse_with(&scene_with("denoise = false"), "s.toml", &overrides).unwrap();
    for device in [Device::Cpu, Device::Gpu] {
        let options = |aovs: &[Aov]| Options {
            device: device.clone(),
            aovs: aovs.to_vec(),
            ..Options::default()
        };
        let option = wgray::render(&scene, &options(&[Aov::Denoised])).unwrap();
        for picture in [
            &option,
            &wgray::render(&requested, &options(&[])).unwrap(),
            &wgray::render(&overridden, &options(&[Aov::Denoised])).unwrap(),
        ] {
            assert_eq!(colors(&picture.pixels()), raw);
            assert_eq!(
                colors(&picture.denoised().expect("denoised pixels")),
                expected,
                "{device:?}"
            );
            assert_eq!(picture.aovs(), [Aov::Denoised]);
        }
        let Some(ChannelValues::Floats(red)) = option.channel("denoised.R") else {
            panic!("no channel");
        };
        assert_eq!(red[7].to_bits(), expected[7][0]);
        let plain = wgray::render(&scene, &options(&[])).unwrap();
        assert_eq!((plain.pixels(), plain.denoised()), (option.pixels(), None));
        assert_ne!(plain.rgb8(), option.rgb8());
        let rgb: Vec<u8> = option.rgba8().chunks(4).flat_map(|rgba| rgba[..3].to_vec()).collect();
        assert_eq!(rgb, option.rgb8());
        // Step by step, and in a session whose next render is not denoised.
        let mut session = Session::new(&Context::new(), scene.clone());
        let cancel = CancelToken::new();
        let mut render = session.start(&options(&[Aov::Denoised]), &cancel).unwrap();
        render.run(&cancel).unwrap();
        assert_eq!(
            colors(&render.snapshot().denoised().expect("denoised pixels")),
            expected
        );
        assert_eq!(render.finish(), option);
        assert_eq!(session.render(&options(&[])).unwrap().pixels(), plain.pixels());
    }
}

#[test]
fn a_crop_is_denoised_on_its_own() {
    let region = Region {
        x0: 3,
        y0: 2,
        x1: 20,
        y1: 11,
    };
    let film = crop(&reference(&parse(SCENE).with_layers().with_noise()), region);
    let options = Options {
        device: Device::Cpu,
        crop: Some(region),
        aovs: vec![Aov::Denoised],
        ..Options::default()
    };
    let scene = Scene::parse(SCENE, "s.toml").unwrap();
    let picture = wgray::render(&scene, &options).unwrap();
    assert_eq!(
        colors(&picture.denoised().expect("denoised pixels")),
        bits(&denoise(&film))
    );
}

#[test]
fn direct_light_and_adaptive_sampling_are_denoised_too() {
    for (render, text) in [
        (
            "phong",
            SCENE
                .replace("\"path\"", "\"phong\"")
                .replace("\"diffuse\"", "\"phong\""),
        ),
        ("adaptive", scene_with("adaptive = { error = 0.02, max_samples = 64 }")),
        ("single sample", SCENE.replace("count = 8", "count = 1")),
    ] {
        let text = match render {
            "phong" => text
                .lines()
                .filter(|line| !line.starts_with("emission"))
                .collect::<Vec<_>>()
                .join("\n")
                .replace("[environment]\ncolor = [0.2, 0.3, 0.5]\n", ""),
            _ => text,
        };
        let scene = Scene::parse(&text, "s.toml").unwrap_or_else(|error| panic!("{render}: {error}"));
        let pictures = [Device::Cpu, Device::Gpu].map(|device| {
            let options = Options {
                device,
                aovs: vec![Aov::Denoised],
                ..Options::default()
            };
            wgray::render(&scene, &options).unwrap()
        });
        let [cpu, gpu] = pictures
            .each_ref()
            .map(|picture| colors(&picture.denoised().expect("denoised pixels")));
        assert_eq!(cpu, gpu, "{render}");
        assert_ne!(cpu, colors(&pictures[0].pixels()), "{render}");
        assert!(
            pictures[0]
                .denoised()
                .unwrap()
                .colors
                .iter()
                .flatten()
                .all(|value| value.is_finite())
        );
    }
}
