//! Ranges of numbers from the schema, and ranges of the sliders that edit the numbers.

use serde::Serialize;
use serde_json::Value as Json;

/// A slider that edits a number, with the values at its ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slider {
    pub from: f64,
    pub to: f64,
    /// Step of a linear slider.
    pub step: f64,
    /// True if equal distances on the slider correspond to equal factors.
    pub logarithmic: bool,
}

/// Distance between the excluded end and the displayed end of a range, relative to the width of the range.
const END_GAP: f64 = 1e-3;

/// Returns the ends of the range of a schema without alternatives.
fn ends(schema: &Json) -> Option<(f64, f64)> {
    if let Some(constant) = schema.get("const").and_then(Json::as_f64) {
        return Some((constant, constant));
    }
    let end = |name: &str| schema.get(name).and_then(Json::as_f64);
    match (end("exclusiveMinimum"), end("exclusiveMaximum")) {
        (Some(low), Some(high)) => Some((low + END_GAP * (high - low), high - END_GAP * (high - low))),
        _ => Some((end("minimum")?, end("maximum")?)),
    }
}

/// Returns the range of each alternative of a schema.
pub(super) fn ranges(schema: &Json) -> Vec<(f64, f64)> {
    match schema.get("anyOf").and_then(Json::as_array) {
        Some(alternatives) => alternatives.iter().filter_map(ends).collect(),
        None => ends(schema).into_iter().collect(),
    }
}

/// Returns the smallest range that contains the ranges of all alternatives.
pub(super) fn range_of(schema: &Json) -> Option<(f64, f64)> {
    let ranges = ranges(schema);
    let ends = ranges.iter().copied().reduce(|(a, b), (c, d)| (a.min(c), b.max(d)));
    ends.filter(|(low, high)| low < high)
}

/// Returns the gap between the ranges of two alternatives.
pub(super) fn gap_of(schema: &Json) -> Option<(f64, f64)> {
    let [a, b] = ranges(schema).try_into().ok()?;
    Some(if a.0 < b.0 { (a.1, b.0) } else { (b.1, a.0) })
}

/// Maximum width of a range for a linear slider.
const MAX_LINEAR_WIDTH: f64 = 1000.0;
/// Minimum ratio of the ends of a range for a logarithmic slider.
const MIN_LOGARITHMIC_RATIO: f64 = 50.0;
/// Maximum factor between the value and an end of a logarithmic slider.
const MAX_FACTOR: f64 = 100.0;

/// Returns a slider for the range that contains the current value, or for a part of a range that is too wide.
pub(super) fn slider(schema: &Json, is_integer: bool, unit: Option<&str>, current: Option<f64>) -> Option<Slider> {
    let value = current.unwrap_or(0.0);
    let ranges = ranges(schema);
    let (low, high) = match ranges.iter().find(|(low, high)| (*low..=*high).contains(&value)) {
        Some(range) if range.0 < range.1 => *range,
        _ => range_of(schema)?,
    };
    let linear = |from: f64, to: f64| {
        let step = 10f64.powf(((to - from) / 100.0).log10().floor());
        let step = if is_integer { step.max(1.0) } else { step };
        Some(Slider {
            from,
            to,
            step,
            logarithmic: false,
        })
    };
    if low > 0.0 && high / low >= MIN_LOGARITHMIC_RATIO && unit != Some("°") {
        let center = if value > 0.0 { value } else { 1.0 };
        let (from, to) = ((center / MAX_FACTOR).max(low), (center * MAX_FACTOR).min(high));
        return Some(Slider {
            from,
            to,
            step: 0.0,
            logarithmic: true,
        });
    }
    if high - low <= MAX_LINEAR_WIDTH {
        return linear(low, high);
    }
    let min_end = if is_integer { 10.0 } else { 1.0 };
    let end = round_up((4.0 * value.abs()).max(min_end));
    linear(low.max(-end), high.min(end))
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let found = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|rounded| *rounded >= x * 0.999);
    found.unwrap_or(x)
}
