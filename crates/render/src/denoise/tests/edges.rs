//! Tests of pixels at the edges of surfaces, in front of a background.

use glam::{DVec3, Vec3, Vec4};
use wgray_image::Region;

use super::super::{coverage, denoise};
use super::{means, random};
use wgray_trace::film::{Film, FilmLayout, Layer};

/// Returns the film of a noisy surface to the right of the line x = 10.3 + 0.2 y, with 16 samples per pixel, in front of
/// `background`. Also returns the mean of each pixel with a surface without noise.
fn film_of_an_edge(background: impl Fn(&mut u64) -> f64) -> (Film, Vec<DVec3>) {
    const SURFACE: f64 = 0.5;
    let film_layout = FilmLayout {
        layers: true,
        noise: true,
        ..FilmLayout::default()
    };
    let (width, height) = (24, 24);
    let mut film = Film::of(Region::whole(width, height), film_layout);
    let (mut state, mut exact) = (7, Vec::new());
    for i in 0..film.sums.len() {
        let (x, y) = (i as u32 % width, i as u32 / width);
        let (mut sums, mut squares, mut without_noise) = (Sums::default(), Sums::default(), 0.0);
        for sample in 0..16 {
            let offset = [sample % 4, sample / 4].map(|k| (f64::from(k) + 0.5) / 4.0);
            let is_hit = f64::from(x) + offset[0] > 10.3 + 0.2 * (f64::from(y) + offset[1]);
            let behind = background(&mut state);
            let noise = 0.3 * (random(&mut state) + random(&mut state));
            let hit = f64::from(u8::from(is_hit));
            let color = if is_hit { SURFACE + noise } else { behind };
            let values = Sums {
                color,
                emission: (1.0 - hit) * behind,
                hit,
                depth: 3.0 * hit,
            };
            sums.add(values);
            squares.add(values.squared());
            if sample % 2 == 0 {
                film.half_sums[i] += DVec3::splat(color).as_vec3().extend(1.0);
            }
            without_noise += (if is_hit { SURFACE } else { behind }) / 16.0;
        }
        let deviations = |sum: f64, square: f64| DVec3::splat(square - sum * sum / 16.0).as_vec3();
        film.sums[i] = DVec3::splat(sums.color).as_vec3().extend(16.0);
        film.moments[i] = deviations(sums.color, squares.color).extend(16.0);
        film.layers[Layer::Emission as usize][i] = DVec3::splat(sums.emission).as_vec3().extend(sums.hit as f32);
        film.layers[Layer::Albedo as usize][i] = Vec3::splat(sums.hit as f32).extend(0.0);
        film.layers[Layer::Normal as usize][i] = Vec4::new(0.0, 0.0, sums.hit as f32, sums.depth as f32);
        film.albedo_moments[i] = deviations(sums.hit, squares.hit).extend(0.0);
        let normal = Vec3::new(0.0, 0.0, deviations(sums.hit, squares.hit).x);
        film.normal_moments[i] = normal.extend(deviations(sums.depth, squares.depth).x);
        exact.push(DVec3::splat(without_noise));
    }
    (film, exact)
}

#[derive(Clone, Copy, Default)]
struct Sums {
    color: f64,
    emission: f64,
    hit: f64,
    depth: f64,
}

impl Sums {
    fn add(&mut self, values: Sums) {
        self.color += values.color;
        self.emission += values.emission;
        self.hit += values.hit;
        self.depth += values.depth;
    }

    fn squared(self) -> Sums {
        Sums {
            color: self.color * self.color,
            emission: self.emission * self.emission,
            hit: self.hit * self.hit,
            depth: self.depth * self.depth,
        }
    }
}

#[test]
fn noise_at_the_edge_of_a_surface_falls_like_inside() {
    let (film, exact) = film_of_an_edge(|_| 4.0);
    let denoised = denoise(&film);
    let error = |colors: &[Vec3], is_selected: &dyn Fn(f32) -> bool| {
        let selected = (0..colors.len()).filter(|i| is_selected(film.alpha(*i)));
        let errors: Vec<f64> = selected
            .map(|i| (colors[i].as_dvec3() - exact[i]).length_squared() / f64::from(film.alpha(i).powi(2)))
            .collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    };
    let is_edge = |alpha: f32| alpha > 0.0 && alpha < 1.0;
    let before = error(&means(&film), &is_edge);
    let after = error(&denoised, &is_edge);
    assert!(after < before / 10.0, "{before} before, {after} after");
    for (i, color) in denoised.iter().enumerate().filter(|(i, _)| film.alpha(*i) == 0.0) {
        assert_eq!(*color, Vec3::splat(4.0), "pixel {i}");
    }
}

#[test]
fn a_background_with_noise_keeps_its_color() {
    let (film, _) = film_of_an_edge(|state| 1.0 + 0.5 * random(state));
    let raw = means(&film);
    let denoised = denoise(&film);
    let background = (0..denoised.len()).filter(|i| film.alpha(*i) == 0.0);
    let changes: Vec<f32> = background.map(|i| (denoised[i].x - raw[i].x).abs()).collect();
    assert!(changes.len() > 100);
    assert!(changes.iter().all(|change| *change < 1e-6));
}

#[test]
fn the_variance_of_the_samples_that_hit_a_surface_is_exact() {
    // Four of six samples hit a surface, with these values.
    let hits = [1.0, 2.0, 3.0, 5.0_f32];
    let (sum, squares): (f32, f32) = (hits.iter().sum(), hits.iter().map(|value| value * value).sum());
    let variance = (squares - sum * sum / 6.0) / (6.0 * 5.0);
    let found = coverage::surface_variance(Vec3::splat(sum / 4.0), Vec3::splat(variance), 6.0, 4.0 / 6.0);
    let deviations: f32 = hits.iter().map(|value| (value - 2.75).powi(2)).sum();
    let expected = deviations / (4.0 * 3.0);
    assert!((found - expected).abs().max_element() < 1e-6, "{found} {expected}");
    assert!(
        !coverage::surface_variance(Vec3::ONE, Vec3::ONE, 4.0, 0.25).is_finite(),
        "one hit has no variance"
    );
}

/// With a filter that has negative weights, the covered fraction of a pixel may amount to less than a sample.
#[test]
fn a_small_fraction_of_a_pixel_is_not_amplified() {
    let (mut film, _) = film_of_an_edge(|_| 4.0);
    let edges: Vec<usize> = (0..film.sums.len())
        .filter(|i| film.alpha(*i) > 0.0 && film.alpha(*i) < 1.0)
        .collect();
    for (i, fraction) in edges
        .into_iter()
        .zip([1e-6, 0.01, 0.06, 0.07, 0.99, 0.999_999].into_iter().cycle())
    {
        film.layers[Layer::Emission as usize][i].w = 16.0 * fraction;
        film.layers[Layer::Normal as usize][i] *= fraction;
        film.layers[Layer::Albedo as usize][i] *= fraction;
    }
    for (i, color) in denoise(&film).into_iter().enumerate() {
        assert!((0.0..5.0).contains(&color.x), "pixel {i}: {color}");
    }
}
