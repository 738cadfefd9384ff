//! Image metrics, compared with closed-form values and with the values of NVIDIA's FLIP and of scikit-image, which
//! `benches/peers/diff_check.py --values` prints.

use std::sync::Arc;

use wgray_image::compare::{
    self, COLOR, Channel, Difference, Kind, PIXELS_PER_DEGREE, Picture, PixelCoord, Plane, layers,
};

/// Returns an RGB image whose values are `value(column, row, channel)`.
fn picture(width: u32, height: u32, kind: Kind, value: impl Fn(u32, u32, u32) -> f32) -> Picture {
    let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let channels = ["R", "G", "B"].into_iter().zip(0..).map(|(name, c)| {
        let values = pixels().map(|(x, y)| value(x, y, c));
        let plane = match kind {
            Kind::Display { .. } => Plane::Bytes(values.map(|value| value as u8).collect()),
            Kind::Linear => Plane::Floats(values.collect()),
        };
        Channel {
            name: name.to_owned(),
            plane: Arc::new(plane),
        }
    });
    Picture {
        width,
        height,
        position: (0, 0),
        kind,
        channels: channels.collect(),
    }
}

const BYTES: Kind = Kind::Display { bits: 8 };

/// Returns the two images that the function `formula` of `diff_check.py` defines.
fn formula(kind: Kind) -> (Picture, Picture) {
    let smooth = |x: u32, y: u32, c: u32| ((x * 5 + y * 3 + c * 40) % 256) as i32;
    let noise = |x: u32, y: u32, c: u32| ((x * 7919 + y * 104_729 + c * 1_299_709 + x * y * 31) % 101) as i32 - 50;
    let value = move |v: i32| match kind {
        Kind::Linear => v as f32 * v as f32 / 4096.0,
        Kind::Display { .. } => v as f32,
    };
    let a = picture(40, 30, kind, move |x, y, c| {
        value((smooth(x, y, c) + noise(x, y, c)).clamp(0, 255))
    });
    (a, picture(40, 30, kind, move |x, y, c| value(smooth(x, y, c))))
}

fn color(a: &Picture, b: &Picture) -> Difference {
    let (layers, ..) = layers(a, b);
    assert_eq!(layers[0].name, COLOR);
    layers[0].difference(b.width, b.height, 0.0)
}

fn flip(a: &Picture, b: &Picture) -> f64 {
    compare::flip(a, b, PIXELS_PER_DEGREE, None).unwrap().mean
}

fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "found {found}, expected {expected}"
    );
}

#[test]
fn metrics_match_the_reference_implementations() {
    let display = [
        0.10898956890902572,
        0.12076424445584943,
        19.252301303945003,
        0.31052258114691983,
        0.22480514645576477,
    ];
    let linear = [
        2.0722226296799424,
        1.0334040028704303,
        17.68568001600276,
        0.8227664472557091,
        0.25062838196754456,
    ];
    for (kind, expected) in [(BYTES, display), (Kind::Linear, linear)] {
        let (a, b) = formula(kind);
        let found = color(&a, &b);
        let ssim = compare::ssim(&a, &b).unwrap();
        for (found, expected) in [found.rmse, found.rel_mse, found.psnr, ssim].into_iter().zip(expected) {
            assert_near(found, expected, 1e-12 * expected.abs());
        }
        // Both implementations of FLIP use f32.
        assert_near(flip(&a, &b), expected[4], 2e-6);
    }
}

#[test]
fn an_image_equals_itself_and_the_second_image_is_the_reference() {
    for kind in [BYTES, Kind::Linear] {
        let (a, b) = formula(kind);
        let found = color(&a, &a);
        assert_eq!(
            (found.different, found.first, found.beyond, found.largest),
            (0, None, 0, None)
        );
        assert_eq!((found.rmse, found.rel_mse, found.psnr), (0.0, 0.0, f64::INFINITY));
        assert_near(compare::ssim(&a, &a).unwrap(), 1.0, 1e-12);
        assert_eq!(flip(&a, &a), 0.0);
        let (forward, backward) = (color(&a, &b), color(&b, &a));
        assert_eq!(forward.rmse, backward.rmse);
        assert_ne!(forward.rel_mse, backward.rel_mse);
    }
}

#[test]
fn metrics_of_extreme_images_match_closed_forms() {
    let uniform =
        |r: f32, g: f32, b: f32, (width, height)| picture(width, height, BYTES, move |_, _, c| [r, g, b][c as usize]);
    for size in [(1, 1), (3, 7), (40, 1), (1, 40), (31, 23)] {
        let (black, white) = (uniform(0.0, 0.0, 0.0, size), uniform(255.0, 255.0, 255.0, size));
        let found = color(&black, &white);
        assert_eq!((found.rmse, found.psnr), (1.0, 0.0));
        assert_near(found.rel_mse, 1.0 / 1.01, 1e-12);
        // Zero variance and means of 0 and 1: (0 + C1) (0 + C2) / ((1 + C1) (0 + C2))
        assert_near(compare::ssim(&black, &white).unwrap(), 1e-4 / (1.0 + 1e-4), 1e-12);
        // Green and blue have the maximum distance by definition.
        assert_near(
            flip(&uniform(0.0, 255.0, 0.0, size), &uniform(0.0, 0.0, 255.0, size)),
            1.0,
            1e-6,
        );
    }
}

#[test]
fn windows_wider_than_the_image_are_clipped_and_renormalized() {
    // The definition of SSIM in one dimension: (2 ma mb + C1) (2 cov + C2) / ((ma² + mb² + C1) (va + vb + C2))
    let (a, b) = ([0.0, 51.0, 255.0, 102.0], [10.0, 51.0, 200.0, 0.0]);
    let mut sum = 0.0;
    for center in 0..4 {
        let weight = |x: usize| (-(x as f64 - center as f64).powi(2) / 4.5).exp();
        let total_weight: f64 = (0..4).map(weight).sum();
        let mean = |value: &dyn Fn(usize) -> f64| (0..4).map(|x| weight(x) * value(x)).sum::<f64>() / total_weight;
        let (value_a, value_b) = (|x: usize| a[x] / 255.0, |x: usize| b[x] / 255.0);
        let (ma, mb) = (mean(&value_a), mean(&value_b));
        let va = mean(&|x| (value_a(x) - ma).powi(2));
        let vb = mean(&|x| (value_b(x) - mb).powi(2));
        let cov = mean(&|x| (value_a(x) - ma) * (value_b(x) - mb));
        sum += (2.0 * ma * mb + 1e-4) * (2.0 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
    }
    let row = |values: [f64; 4]| picture(4, 1, BYTES, move |x, _, _| values[x as usize] as f32);
    let column = |values: [f64; 4]| picture(1, 4, BYTES, move |_, y, _| values[y as usize] as f32);
    assert_near(compare::ssim(&row(a), &row(b)).unwrap(), sum / 4.0, 1e-12);
    assert_near(compare::ssim(&column(a), &column(b)).unwrap(), sum / 4.0, 1e-12);
}

#[test]
fn tiles_and_chunks_do_not_change_the_metrics() {
    // The image is larger than a tile of 256 x 256 pixels and a chunk of 65,536 pixels. Pixels with
    // errors are too far apart to influence each other, so their errors add up.
    let noise = |x: u32, y: u32, c: u32| ((x * 7919 + y * 104_729 + c * 1_299_709) % 251) as f32;
    let b = picture(600, 300, BYTES, move |x, y, c| (noise(x, y, c) / 2.0).floor());
    let with_errors_at = |pixels: &'static [(u32, u32)]| {
        picture(600, 300, BYTES, move |x, y, c| {
            let value = (noise(x, y, c) / 2.0).floor();
            if pixels.contains(&(x, y)) { value + 90.0 } else { value }
        })
    };
    let (first, second) = (with_errors_at(&[(255, 255)]), with_errors_at(&[(512, 100)]));
    let both = with_errors_at(&[(255, 255), (512, 100)]);
    assert_near(flip(&both, &b), flip(&first, &b) + flip(&second, &b), 1e-9);
    let dissimilarity = |a: &Picture| 1.0 - compare::ssim(a, &b).unwrap();
    assert!(dissimilarity(&first) > 1e-7);
    assert_near(
        dissimilarity(&both),
        dissimilarity(&first) + dissimilarity(&second),
        1e-11,
    );
    let found = color(&both, &b);
    assert_eq!((found.different, found.first), (2, Some(PixelCoord { x: 512, y: 100 })));
    assert_near(
        found.rmse,
        (6.0 * (90.0_f64 / 255.0).powi(2) / (3.0 * 180_000.0)).sqrt(),
        1e-12,
    );
}

#[test]
fn flip_decreases_with_the_viewing_distance() {
    let (a, b) = formula(BYTES);
    let flip_at = |ppd: f64| compare::flip(&a, &b, ppd, None).unwrap().mean;
    assert!(flip_at(20.0) > flip_at(67.0) && flip_at(67.0) > flip_at(300.0));
    for ppd in [1.0, 1000.0] {
        assert!((0.0..=1.0).contains(&flip_at(ppd)), "{ppd}");
    }
}

#[test]
fn flip_of_linear_values_adapts_its_exposures_to_the_reference() {
    let uniform = |value: f32| picture(12, 12, Kind::Linear, move |_, _, _| value);
    // The exposures follow the reference, so a common factor cancels.
    let found = flip(&uniform(1.1), &uniform(1.0));
    assert!(found > 0.01);
    for scale in [1e-30_f32, 1e-3, 1e3, 1e30] {
        assert_near(flip(&uniform(1.1 * scale), &uniform(scale)), found, 1e-4);
    }
    // Black, mostly black, negative and infinite images.
    let single_pixel = |value: f32| {
        picture(
            12,
            12,
            Kind::Linear,
            move |x, y, _| if (x, y) == (3, 4) { value } else { 0.0 },
        )
    };
    assert_eq!(flip(&uniform(0.0), &uniform(-1.0)), 0.0);
    let (bright, similar) = (
        flip(&single_pixel(5.0), &uniform(0.0)),
        flip(&single_pixel(5.0), &single_pixel(4.0)),
    );
    assert!(bright > similar && similar > 0.0, "{bright} {similar}");
    assert_eq!(flip(&single_pixel(f32::INFINITY), &single_pixel(1.0)), 0.0);
    assert!(flip(&single_pixel(f32::MAX), &single_pixel(f32::MIN_POSITIVE)).is_finite());
}
