//! Measures a layer with all requested metrics.

use wgray_image::compare::{self, COLOR, Flip, Layer, Picture};

use super::metric::Metric;
use super::report::{LayerReport, Number};

/// Returns the report and, if FLIP was computed, its result. The result has an error map if `step` is given, the
/// subsampling step of the map.
pub fn measure(
    layer: &Layer,
    a: &Picture,
    b: &Picture,
    metrics: &[Metric],
    threshold: f64,
    ppd: f64,
    step: Option<usize>,
) -> (LayerReport, Option<Flip>) {
    let difference = layer.difference(b.width, b.height, threshold);
    let has_colors = layer.name == COLOR && a.colors().is_some() && b.colors().is_some();
    let is_requested = |metric: Metric| metrics.contains(&metric) && has_colors;
    let is_identical = difference.different == 0;
    let ssim = match (is_requested(Metric::Ssim), is_identical) {
        (true, true) => Some(1.0),
        (true, false) => compare::ssim(a, b),
        (false, _) => None,
    };
    let (flip, map) = match (is_requested(Metric::Flip), is_identical, step) {
        (true, true, None) => (Some(0.0), None),
        (true, ..) => {
            let flip = compare::flip(a, b, ppd, step);
            (flip.as_ref().map(|flip| flip.mean), flip)
        }
        (false, ..) => (None, None),
    };
    let pixels = b.pixels();
    let if_requested = |metric: Metric, value: f64| metrics.contains(&metric).then_some(Number(value));
    let report = LayerReport {
        name: layer.name.clone(),
        channels: layer.channels.iter().map(|(name, ..)| (*name).to_owned()).collect(),
        pixels: pixels as u64,
        different: difference.different,
        first: difference.first.map(Into::into),
        largest: if_requested(
            Metric::Largest,
            difference.largest.as_ref().map_or(0.0, |largest| largest.difference),
        ),
        largest_at: match metrics.contains(&Metric::Largest) {
            true => difference.largest.map(Into::into),
            false => None,
        },
        share: if_requested(Metric::Share, difference.beyond as f64 / pixels as f64),
        rmse: if_requested(Metric::Rmse, difference.rmse),
        rel_mse: if_requested(Metric::RelMse, difference.rel_mse),
        psnr: if_requested(Metric::Psnr, difference.psnr),
        ssim: ssim.map(Number),
        flip: flip.map(Number),
        not_finite: match difference.first_non_finite {
            Some(first) => Some((difference.a, difference.b, first).into()),
            None => None,
        },
    };
    (report, map)
}
