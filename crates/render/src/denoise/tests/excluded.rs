//! Pixels that are not averaged: not finite, without samples, or none at all.

use super::*;

#[test]
fn pixels_that_are_not_finite_stay_and_do_not_spread() {
    let subject = Subject {
        width: 30,
        height: 20,
        amplitude: 0.1,
    };
    let color = |_, _| DVec3::splat(0.5);
    let mut film = subject.film(color, WHITE);
    for (i, value) in [(65, f32::NAN), (190, f32::INFINITY), (340, 1e30), (599, -f32::INFINITY)] {
        film.sums[i].y = value;
        film.half_sums[i].y = value;
        film.moments[i].y = f32::NAN;
    }
    film.sums[444] = Vec4::ZERO;
    let denoised = denoise(&film);
    for (i, color) in denoised.iter().enumerate() {
        match i {
            65 | 190 | 340 | 444 | 599 => assert_eq!(color.to_array().map(f32::to_bits), {
                wgray_trace::film::mean(film.sums[i]).map(f32::to_bits)
            }),
            _ => assert!((*color - 0.5).abs().max_element() < 0.15, "{i}: {color}"),
        }
    }
}

/// With a single sample and without layers, as for `phong`, the variance of a pixel explains the difference from black.
#[test]
fn excluded_pixels_are_not_averaged_without_layers() {
    let film_layout = FilmLayout {
        noise: true,
        ..FilmLayout::default()
    };
    let mut film = Film::of(Region::whole(30, 20), film_layout);
    for i in 0..film.sums.len() {
        film.sums[i] = Vec4::new(0.5, 0.5, 0.5, 1.0);
        film.moments[i].w = 1.0;
    }
    film.sums[310] = Vec4::ZERO;
    film.sums[315].x = f32::NAN;
    for (i, color) in denoise(&film).iter().enumerate() {
        assert!(
            [310, 315].contains(&i) || (*color - 0.5).abs().max_element() < 1e-6,
            "{i}: {color}"
        );
    }
}

/// The patches around a pixel that is not finite are like those of other pixels.
#[test]
fn noise_around_pixels_that_are_not_finite_falls() {
    let subject = Subject {
        width: 40,
        height: 40,
        amplitude: 0.02,
    };
    let color = |_, _| DVec3::splat(0.5);
    let mut film = subject.film(color, WHITE);
    for i in (0..film.sums.len()).filter(|i| i % 40 == 20 && i / 40 % 8 == 4) {
        film.sums[i].x = f32::NAN;
    }
    let [before, after] = [means(&film), denoise(&film)].map(|colors| {
        let sides = [18..20, 21..23].map(|columns| subject.error(&colors, color, columns));
        sides.iter().sum::<f64>()
    });
    assert!(after < before / 20.0, "{before} before, {after} after");
}

#[test]
fn a_film_without_pixels_has_no_colors() {
    let film_layout = FilmLayout {
        noise: true,
        ..FilmLayout::default()
    };
    assert!(denoise(&Film::of(Region::whole(0, 0), film_layout)).is_empty());
}
