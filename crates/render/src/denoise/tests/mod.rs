mod edges;
mod excluded;

use glam::{DVec3, Vec4};

use super::*;
use wgray_trace::film::Layer;

/// A film of 4 samples per pixel whose samples are `color` of the pixel plus noise: a triangular distribution of this
/// amplitude. Albedo, normal and depth have no noise.
struct Subject {
    width: u32,
    height: u32,
    amplitude: f64,
}

const SAMPLES: u32 = 4;

/// Returns a number from -1 to 1.
fn random(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as f64 / f64::from(1 << 30) - 1.0
}

impl Subject {
    fn film(&self, color: impl Fn(u32, u32) -> DVec3, albedo: impl Fn(u32, u32) -> DVec3) -> Film {
        let film_layout = FilmLayout {
            layers: true,
            noise: true,
            ..FilmLayout::default()
        };
        let mut film = Film::of(Region::whole(self.width, self.height), film_layout);
        let mut state = 1;
        for i in 0..film.sums.len() {
            let (x, y) = (i as u32 % self.width, i as u32 / self.width);
            let values = [(); SAMPLES as usize].map(|()| {
                let noise = DVec3::splat(random(&mut state) + random(&mut state)) * self.amplitude;
                color(x, y) + noise
            });
            let sum: DVec3 = values.iter().sum();
            let mean = sum / f64::from(SAMPLES);
            let squares: DVec3 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
            let weight = SAMPLES as f32;
            film.sums[i] = sum.as_vec3().extend(weight);
            film.half_sums[i] = (values[0] + values[1]).as_vec3().extend(weight / 2.0);
            film.moments[i] = squares.as_vec3().extend(weight);
            film.layers[Layer::Emission as usize][i].w = weight;
            film.layers[Layer::Albedo as usize][i] = (albedo(x, y).as_vec3() * weight).extend(0.0);
            film.layers[Layer::Normal as usize][i] = Vec4::new(0.0, 0.0, weight, 2.0 * weight);
        }
        film
    }

    /// Returns the mean squared error of colors in columns.
    fn error(&self, colors: &[Vec3], expected: impl Fn(u32, u32) -> DVec3, columns: std::ops::Range<u32>) -> f64 {
        let errors = (0..colors.len() as u32).map(|i| (i % self.width, i / self.width, i));
        let errors = errors.filter(|(x, ..)| columns.contains(x));
        let errors: Vec<f64> = errors
            .map(|(x, y, i)| (colors[i as usize].as_dvec3() - expected(x, y)).length_squared())
            .collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    }
}

const WHITE: fn(u32, u32) -> DVec3 = |_, _| DVec3::ONE;

fn means(film: &Film) -> Vec<Vec3> {
    film.means().map(Vec3::from).collect()
}

#[test]
fn noise_on_an_even_surface_falls_by_a_factor_of_40_and_the_mean_stays() {
    let subject = Subject {
        width: 64,
        height: 48,
        amplitude: 0.2,
    };
    let color = |_, _| DVec3::new(0.5, 0.4, 0.3);
    let film = subject.film(color, WHITE);
    let denoised = denoise(&film);
    let [before, after] = [means(&film), denoised.clone()].map(|colors| subject.error(&colors, color, 0..64));
    assert!(after < before / 40.0, "{before} before, {after} after");
    let mean = |colors: &[Vec3]| colors.iter().map(|color| color.as_dvec3()).sum::<DVec3>() / colors.len() as f64;
    assert!((mean(&denoised) - mean(&means(&film))).abs().max_element() < 2e-3);
}

#[test]
fn edges_of_light_and_of_albedo_stay() {
    let subject = Subject {
        width: 64,
        height: 48,
        amplitude: 0.05,
    };
    let step = |x, _| if x < 32 { DVec3::splat(0.2) } else { DVec3::splat(0.8) };
    for film in [subject.film(step, WHITE), subject.film(step, step)] {
        let denoised = denoise(&film);
        let [before, after] = [means(&film), denoised].map(|colors| subject.error(&colors, step, 30..34));
        assert!(after < before / 4.0, "{before} before, {after} after");
    }
}

#[test]
fn textures_without_noise_stay() {
    let subject = Subject {
        width: 40,
        height: 40,
        amplitude: 0.1,
    };
    // The light has noise, the texture has none: the color of a pixel is its albedo times the light.
    let texture = |x: u32, y: u32| DVec3::splat([0.2, 0.5, 0.9][((x + 2 * y) % 3) as usize]);
    let mut film = subject.film(WHITE, texture);
    for i in 0..film.sums.len() {
        let albedo = Vec3::from(film.layer(Layer::Albedo, i)).extend(1.0);
        (film.sums[i], film.half_sums[i]) = (film.sums[i] * albedo, film.half_sums[i] * albedo);
        film.moments[i] *= albedo * albedo;
    }
    let [before, after] = [means(&film), denoise(&film)].map(|colors| subject.error(&colors, texture, 0..40));
    assert!(after < before / 9.0, "{before} before, {after} after");
}

/// The method in f64, from the definitions: every pixel, window and patch on its own, without planes, tiles and lanes.
/// `guides` returns plane `k` of a pixel, mirrored at the borders.
fn definition(guides: &Guides, x: i32, y: i32) -> DVec3 {
    let mirrored = |x: i32, size: usize| {
        let last = size as i32 - 1;
        let mut x = if last == 0 { 0 } else { x };
        while x < 0 || x > last {
            x = if x < 0 { -x } else { 2 * last - x };
        }
        x as usize
    };
    let margin = guides::MARGIN;
    let at = |k: usize, x: i32, y: i32| {
        let (x, y) = (mirrored(x, guides.width) + margin, mirrored(y, guides.height) + margin);
        f64::from(guides.plane(k)[y * guides.stride + x])
    };
    let squared = |k: usize, count: usize, p: (i32, i32), q: (i32, i32)| {
        (k..k + count)
            .map(|k| (at(k, p.0, p.1) - at(k, q.0, q.1)).powi(2))
            .sum::<f64>()
    };
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for dy in -7..=7 {
        for dx in -7..=7 {
            let (p, q) = ((x, y), (x + dx, y + dy));
            let mut patch = 0.0;
            for j in -2..=2 {
                for i in -2..=2 {
                    let (p, q) = ((p.0 + i, p.1 + j), (q.0 + i, q.1 + j));
                    let (vp, vq, limit) = (at(3, p.0, p.1), at(3, q.0, q.1), at(4, p.0, p.1));
                    patch += (squared(0, 3, p, q) - vp - vp.min(vq)) / (1.1 * (vp + vq.min(limit)) + 1e-20) / 25.0;
                }
            }
            let feature = |k: usize, count: usize| {
                let (vp, vq) = (at(k + count, p.0, p.1), at(k + count, q.0, q.1));
                (squared(k, count, p, q) - vp - vp.min(vq)) * at(k + count + 1, p.0, p.1)
            };
            let distance = patch
                .max(feature(5, 3))
                .max(feature(10, 3))
                .max(feature(15, 1))
                .max(0.0);
            let weight = (1.0 - distance / 4.0).max(0.0).powi(4);
            sum += DVec3::new(at(0, q.0, q.1), at(1, q.0, q.1), at(2, q.0, q.1)) * weight;
            weights += weight;
        }
    }
    sum / weights
}

#[test]
fn the_filter_matches_its_definition_in_f64() {
    for (width, height) in [(1, 1), (2, 1), (1, 9), (17, 3), (40, 12), (131, 34)] {
        let subject = Subject {
            width,
            height,
            amplitude: 0.2,
        };
        let color = |x, y| DVec3::new(0.2, 0.4, 0.6) + f64::from(x / 5 % 2) * 0.3 + f64::from(y) * 0.01;
        let film = subject.film(color, |x, _| DVec3::splat(0.3 + 0.1 * f64::from(x % 3)));
        let guides = Guides::of(&film);
        let filtered = filter::filter(&guides);
        assert_eq!(filtered.len() as u32, width * height);
        for (i, found) in filtered.iter().enumerate().step_by(7) {
            let expected = definition(&guides, (i as u32 % width) as i32, (i as u32 / width) as i32);
            let error = (found.as_dvec3() - expected).abs().max_element();
            assert!(
                error < 2e-4,
                "{width} x {height}, pixel {i}: {found}, expected {expected}"
            );
        }
    }
}

#[test]
fn a_single_sample_is_denoised_by_features() {
    let subject = Subject {
        width: 32,
        height: 32,
        amplitude: 0.2,
    };
    let color = |_, _| DVec3::splat(0.5);
    let mut film = subject.film(color, WHITE);
    for i in 0..film.sums.len() {
        film.sums[i] = (film.half_sums[i] * 0.5).with_w(1.0);
        film.half_sums[i] = Vec4::ZERO;
        film.moments[i] = Vec4::new(0.0, 0.0, 0.0, 1.0);
        for layer in &mut film.layers {
            layer[i] *= 0.25;
        }
    }
    let [before, after] = [means(&film), denoise(&film)].map(|colors| subject.error(&colors, color, 0..32));
    assert!(after < before / 20.0, "{before} before, {after} after");
}

/// Detail within pixels and of pixels, such as thin shadows, gives the samples of a pixel a large variance. If they are
/// stratified, the two halves are nearly equal.
#[test]
fn detail_that_stratified_samples_resolve_stays() {
    let subject = Subject {
        width: 40,
        height: 40,
        amplitude: 0.3,
    };
    let detail = |x: u32, y: u32| DVec3::splat(0.5 + 0.1 * f64::from((x * 7 + y * 13) % 11 % 3));
    let mut film = subject.film(|_, _| DVec3::splat(0.5), WHITE);
    let mut state = 3;
    let mut halve = |film: &mut Film, difference: f64| {
        for i in 0..film.sums.len() {
            let mean = detail(i as u32 % 40, i as u32 / 40);
            let noise = [(); 2].map(|()| DVec3::splat(difference * random(&mut state)));
            film.half_sums[i] = ((mean + noise[0]) * 2.0).as_vec3().extend(2.0);
            film.sums[i] = (mean * 4.0 + (noise[0] + noise[1]) * 2.0).as_vec3().extend(4.0);
        }
        let [before, after] = [means(film), denoise(film)].map(|colors| subject.error(&colors, detail, 0..40));
        after / before
    };
    let stratified = halve(&mut film, 0.01);
    assert!(stratified < 1.05, "{stratified}");
    // Halves that differ as much as independent samples.
    let independent = halve(&mut film, 0.3);
    assert!(independent < 0.4, "{independent}");
}

/// The model of `stratification`: the variance of n samples is n^-b, the halves suggest that of n / 2 less that of n.
#[test]
fn the_variance_of_stratified_samples_follows_from_the_halves() {
    for (b, n, smallest, largest) in [
        (1.0, 4.0, 1.0, 1.0),
        (1.5, 4.0, 1.8, 1.9), // b is unknown
        (1.0, 256.0, 1.0, 1.0),
        (1.25, 16.0, 1.0, 1.2),
        (1.5, 16.0, 1.1, 1.3),
        (1.5, 64.0, 0.95, 1.05),
        (2.0, 64.0, 1.0, 1.4),
    ] {
        let variance = |n: f64| n.powf(-b);
        let halves = variance(n / 2.0) - variance(n);
        let found = guides::stratification(halves as f32, (variance(1.0) / n) as f32, n as u32);
        let relative = f64::from(found) / (variance(n) * n);
        assert!(
            (smallest - 1e-6..=largest + 1e-6).contains(&relative),
            "b = {b}, n = {n}: {relative}"
        );
    }
    assert_eq!(guides::stratification(f32::INFINITY, 1.0, 16), 1.0);
    assert_eq!(guides::stratification(f32::INFINITY, f32::INFINITY, 16), 1.0);
    assert_eq!(guides::stratification(0.0, 0.0, 16), 1.0);
}

/// Beside pixels with noise, the color of pixels without noise stays, even if the noise explains the difference.
#[test]
fn noise_does_not_spread_to_pixels_without_noise() {
    let subject = Subject {
        width: 40,
        height: 40,
        amplitude: 0.4,
    };
    let color = |x: u32, _| DVec3::splat(if x < 20 { 0.1 } else { 0.3 });
    let mut film = subject.film(color, WHITE);
    for i in (0..film.sums.len()).filter(|i| i % 40 < 20) {
        film.sums[i] = Vec4::new(0.1, 0.1, 0.1, 1.0) * SAMPLES as f32;
        film.half_sums[i] = film.sums[i] / 2.0;
        film.moments[i] = Vec4::new(1e-3, 1e-3, 1e-3, film.moments[i].w);
    }
    let error = |film: &Film| subject.error(&denoise(film), color, 0..20).sqrt();
    // Few samples may have missed a light.
    let few = error(&film);
    assert!(few > 0.009, "{few}");
    // The same variances of the means, from 64 samples.
    for moments in &mut film.moments {
        *moments *= 64.0 * 63.0 / (4.0 * 3.0);
        moments.w = 64.0;
    }
    let many = error(&film);
    assert!(many < 0.005, "{many}");
}

/// Film whose pixels have light of emission `emission`, in addition to the noisy light of `subject`.
fn film_with_emission(subject: &Subject, light: f64, emission: impl Fn(usize) -> f64) -> Film {
    let mut film = subject.film(|_, _| DVec3::splat(light), WHITE);
    for i in 0..film.sums.len() {
        let emitted = Vec3::splat(emission(i) as f32).extend(0.0);
        film.sums[i] += emitted * SAMPLES as f32;
        film.half_sums[i] += emitted * SAMPLES as f32 * 0.5;
        film.layers[Layer::Emission as usize][i] += emitted * SAMPLES as f32;
    }
    film
}

#[test]
fn emission_stays_and_the_rest_of_the_light_is_averaged() {
    let subject = Subject {
        width: 40,
        height: 40,
        amplitude: 0.1,
    };
    let emission = |i: usize| f64::from((i * 7919 % 13) as u32) * 0.1;
    let mut film = film_with_emission(&subject, 0.5, emission);
    for moments in &mut film.moments {
        *moments += Vec4::new(1.0, 1.0, 1.0, 0.0); // the emission varies within the pixel
    }
    let expected = |x: u32, y: u32| DVec3::splat(0.5 + emission((y * 40 + x) as usize));
    let [before, after] = [means(&film), denoise(&film)].map(|colors| subject.error(&colors, expected, 0..40));
    assert!(after < before / 20.0, "{before} before, {after} after");
}

#[test]
fn the_emission_of_blurred_surfaces_is_averaged() {
    let subject = Subject {
        width: 40,
        height: 40,
        amplitude: 0.2,
    };
    let mut film = subject.film(|_, _| DVec3::splat(0.6), WHITE);
    for (layer, sum) in film.layers[Layer::Emission as usize].iter_mut().zip(&film.sums) {
        *layer = sum.truncate().extend(layer.w);
    }
    let raw = means(&film);
    for (color, raw) in denoise(&film).iter().zip(&raw) {
        assert!(
            (*color - *raw).abs().max_element() < 1e-6,
            "sharp emission changed: {raw} {color}"
        );
    }
    for moments in &mut film.normal_moments {
        moments.w = 1.0; // the samples of each pixel have different distances
    }
    let color = |_, _| DVec3::splat(0.6);
    let [before, after] = [raw, denoise(&film)].map(|colors| subject.error(&colors, color, 0..40));
    assert!(after < before / 20.0, "{before} before, {after} after");
}

#[test]
fn bright_pixels_stay_and_do_not_brighten_the_pixels_around() {
    let subject = Subject {
        width: 31,
        height: 31,
        amplitude: 0.2,
    };
    let center = 15 * 31 + 15;
    let film_with = |value: f32| {
        let mut film = subject.film(WHITE, WHITE);
        // One of the four samples is bright.
        let excess = Vec3::splat(value);
        film.sums[center] += excess.extend(0.0);
        film.half_sums[center] += excess.extend(0.0);
        film.moments[center] += (excess * excess * 0.75).extend(0.0);
        // The edge of the bright pixel.
        film.sums[center + 1] += (excess * 0.1).extend(0.0);
        film.moments[center + 1] += (excess * excess * 0.0075).extend(0.0);
        film
    };
    for value in [1e3, 1e6, 1e12] {
        let film = film_with(value);
        let (raw, denoised) = (means(&film), denoise(&film));
        for i in [center, center + 1] {
            assert_eq!(denoised[i], raw[i], "{value}");
        }
        let others = (0..denoised.len()).filter(|i| *i != center && *i != center + 1);
        for i in others {
            assert!(
                (denoised[i].x - 1.0).abs() < 0.1,
                "{value}, pixel {i}: {}",
                denoised[i].x
            );
        }
    }
    // A moderately bright pixel is averaged.
    let film = film_with(40.0);
    let (raw, denoised) = (means(&film)[center].x, denoise(&film)[center].x);
    assert!(denoised < 0.3 * raw, "{raw} before, {denoised} after");
}

/// The number in `docs/denoising.md`: a patch of the window, an extended surface, the limit of the variance, the edge of a
/// bright pixel, and the pixels around it.
#[test]
fn a_crop_differs_from_the_full_image_only_near_its_border() {
    const BORDER: u32 = 24;
    let subject = Subject {
        width: 70,
        height: 68,
        amplitude: 0.3,
    };
    let mut film = subject.film(|x, y| DVec3::splat(f64::from(1 + (x / 9 + y / 9) % 3)), WHITE);
    let mut state = 5;
    for i in 0..film.sums.len() {
        let factor = match random(&mut state) {
            x if x > 0.97 => 1000.0,
            x if x > 0.94 => 10.0,
            _ => 1.0,
        };
        film.sums[i] = (film.sums[i].truncate() * factor).extend(film.sums[i].w);
        film.moments[i] = (film.moments[i].truncate() * factor * factor).extend(film.moments[i].w);
        if random(&mut state) > 0.9 {
            film.layers[Layer::Emission as usize][i].w = 0.0;
            film.moments[i] = Vec4::new(0.0, 0.0, 0.0, film.moments[i].w);
        }
        // Areas with edges in more or less than half of the pixels.
        if random(&mut state) > f64::from(i as u32 % subject.width / 12 % 2) - 0.5 {
            film.normal_moments[i].w = 100.0;
        }
    }
    let region = Region {
        x0: 4,
        y0: 3,
        x1: 66,
        y1: 65,
    };
    let [full, crop] = [denoise(&film), denoise(&film.clone().part(region))];
    let (mut equal, mut differing) = (0, 0);
    for y in region.y0..region.y1 {
        for x in region.x0..region.x1 {
            let of_crop = crop[((y - region.y0) * region.width() + x - region.x0) as usize];
            let is_equal = of_crop == full[(y * subject.width + x) as usize];
            let distance = (x - region.x0)
                .min(region.x1 - 1 - x)
                .min((y - region.y0).min(region.y1 - 1 - y));
            if distance >= BORDER {
                assert!(is_equal, "{x}, {y}");
                equal += 1;
            } else {
                differing += usize::from(!is_equal);
            }
        }
    }
    assert!(equal > 100 && differing > 100, "{equal}, {differing}");
}
