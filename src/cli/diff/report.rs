//! The report of `wgray diff`, as text or JSON. Metrics have the same names in both.

use std::fmt;

use serde::{Serialize, Serializer};
use wgray_image::compare::{LargestDifference, NonFiniteCounts, Picture, PixelCoord};

use super::metric::{Limit, METRICS, Metric};

#[derive(Debug, Serialize)]
pub struct Report {
    /// Name of the tested image.
    pub a: String,
    /// Name of the reference.
    pub b: String,
    size_a: [u32; 2],
    size_b: [u32; 2],
    /// Positions of the images' top left pixels in the full image.
    #[serde(skip)]
    positions: [(i32, i32); 2],
    /// True if the exit code is 0.
    pub passes: bool,
    fails: Vec<String>,
    /// Conversions and omissions.
    pub notes: Vec<String>,
    /// Channels that exist in only one of the images.
    only_a: Vec<String>,
    only_b: Vec<String>,
    pub layers: Vec<LayerReport>,
    #[serde(skip)]
    pub metrics: Vec<Metric>,
}

/// The report on a layer. Metrics that were not requested are absent.
#[derive(Debug, Serialize)]
pub struct LayerReport {
    pub name: String,
    pub channels: Vec<String>,
    pub pixels: u64,
    pub different: u64,
    /// First pixel that differs.
    pub first: Option<PixelReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_at: Option<LargestReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rel_mse: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub psnr: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ssim: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flip: Option<Number>,
    pub not_finite: Option<NotFinite>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct PixelReport {
    x: u32,
    y: u32,
}

impl From<PixelCoord> for PixelReport {
    fn from(pixel: PixelCoord) -> Self {
        PixelReport { x: pixel.x, y: pixel.y }
    }
}

impl fmt::Display for PixelReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}, {})", self.x, self.y)
    }
}

#[derive(Debug, Serialize)]
pub struct LargestReport {
    x: u32,
    y: u32,
    channel: String,
    a: f64,
    b: f64,
}

impl From<LargestDifference> for LargestReport {
    fn from(largest: LargestDifference) -> Self {
        LargestReport {
            x: largest.pixel.x,
            y: largest.pixel.y,
            channel: largest.channel,
            a: largest.a,
            b: largest.b,
        }
    }
}

#[derive(Debug, Serialize)]
pub struct NotFinite {
    nan_a: u64,
    nan_b: u64,
    infinite_a: u64,
    infinite_b: u64,
    first: PixelReport,
}

impl From<(NonFiniteCounts, NonFiniteCounts, PixelCoord)> for NotFinite {
    fn from((a, b, first): (NonFiniteCounts, NonFiniteCounts, PixelCoord)) -> Self {
        NotFinite {
            nan_a: a.nan,
            nan_b: b.nan,
            infinite_a: a.infinite,
            infinite_b: b.infinite,
            first: first.into(),
        }
    }
}

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (a, b) = ((self.nan_a, self.infinite_a), (self.nan_b, self.infinite_b));
        write!(
            f,
            "{} NaN and {} infinite values in A, {} and {} in B, the first at {}",
            a.0, a.1, b.0, b.1, self.first
        )
    }
}

/// A number. Infinite numbers become strings in JSON, which cannot represent them.
#[derive(Clone, Copy, Debug)]
pub struct Number(pub f64);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0.is_finite() {
            true => serializer.serialize_f64(self.0),
            false => serializer.serialize_str(&self.0.to_string()),
        }
    }
}

impl fmt::Display for Number {
    /// Formats the number with six significant digits, and integers with all digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let magnitude = self.0.abs();
        if magnitude == 0.0 || !magnitude.is_finite() {
            return write!(f, "{}", self.0);
        }
        // Shape numbers are integers up to 2^32 - 1, which stands for the background.
        let is_integer = magnitude.fract() == 0.0 && magnitude < 1e15;
        let text = if (1e-4..1e9).contains(&magnitude) || is_integer {
            let decimals = (5 - magnitude.log10().floor() as i32).max(0) as usize;
            without_trailing_zeros(&format!("{:.decimals$}", self.0)).to_owned()
        } else {
            let text = format!("{:.5e}", self.0);
            let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{}e{exponent}", without_trailing_zeros(digits))
        };
        // Rounding must not turn a fraction into an integer.
        match magnitude < 1e6 && self.0.fract() != 0.0 && text.parse::<i64>().is_ok() {
            true => write!(f, "{}", self.0),
            false => f.write_str(&text),
        }
    }
}

fn without_trailing_zeros(digits: &str) -> &str {
    match digits.contains('.') {
        true => digits.trim_end_matches('0').trim_end_matches('.'),
        false => digits,
    }
}

impl LayerReport {
    pub fn is_different(&self) -> bool {
        self.different > 0
    }

    fn value(&self, metric: Metric) -> Option<f64> {
        let number = match metric {
            Metric::Different => return Some(self.different as f64),
            Metric::Largest => self.largest,
            Metric::Share => self.share,
            Metric::Rmse => self.rmse,
            Metric::RelMse => self.rel_mse,
            Metric::Psnr => self.psnr,
            Metric::Ssim => self.ssim,
            Metric::Flip => self.flip,
        };
        number.map(|number| number.0)
    }

    fn line(&self, metric: Metric) -> Option<String> {
        let value = Number(self.value(metric)?);
        let location = match &self.largest_at {
            Some(LargestReport { x, y, channel, a, b }) => {
                format!(" in {channel} at ({x}, {y}): {} instead of {}", Number(*a), Number(*b))
            }
            None => String::new(),
        };
        Some(match (metric, &self.first) {
            (Metric::Different, Some(first)) => {
                format!("{} of {} pixels, the first at {first}", self.different, self.pixels)
            }
            (Metric::Different, None) => format!("0 of {} pixels", self.pixels),
            (Metric::Largest, _) => format!("{value}{location}"),
            (Metric::Psnr, _) => format!("{value} dB"),
            _ => value.to_string(),
        })
    }
}

impl Report {
    pub fn new([a, b]: [String; 2], picture_a: &Picture, picture_b: &Picture) -> Report {
        Report {
            a,
            b,
            size_a: [picture_a.width, picture_a.height],
            size_b: [picture_b.width, picture_b.height],
            positions: [picture_a.position, picture_b.position],
            passes: false,
            fails: Vec::new(),
            notes: Vec::new(),
            only_a: Vec::new(),
            only_b: Vec::new(),
            layers: Vec::new(),
            metrics: Vec::new(),
        }
    }

    pub fn set_only(&mut self, a: &[&str], b: &[&str]) {
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        (self.only_a, self.only_b) = (owned(a), owned(b));
    }

    pub fn is_different(&self) -> bool {
        self.layers.iter().any(LayerReport::is_different)
    }

    /// Collects the reasons why the comparison fails: different sizes, positions or channels, non-finite values, and
    /// values beyond a limit. Without limits, any difference is a reason.
    pub fn judge(&mut self, limits: &[Limit], threshold: f64) {
        let mut fails = Vec::new();
        let (a, b) = (self.size_a, self.size_b);
        if a != b {
            fails.push(format!("A has {} x {} pixels, B {} x {}", a[0], a[1], b[0], b[1]));
        } else if self.positions[0] != self.positions[1] {
            let [a, b] = self.positions;
            fails.push(format!(
                "A starts at pixel ({}, {}) of the whole image, B at ({}, {})",
                a.0, a.1, b.0, b.1
            ));
        }
        for (names, owner, other) in [(&self.only_a, "A", "B"), (&self.only_b, "B", "A")] {
            if !names.is_empty() {
                fails.push(format!("{other} lacks {}, which {owner} has", names.join(" ")));
            }
        }
        for layer in &self.layers {
            if let Some(found) = &layer.not_finite {
                fails.push(format!("{}: {found}", layer.name));
            }
            if limits.is_empty() && layer.is_different() {
                let (name, different) = (&layer.name, layer.different);
                let pixels = if different == 1 {
                    "pixel differs"
                } else {
                    "pixels differ"
                };
                fails.push(format!("{name}: {different} {pixels}"));
            }
            for limit in limits {
                let value = layer.value(limit.metric);
                if let Some((value, relation)) = value.and_then(|value| Some((value, limit.exceeded(value)?))) {
                    let (name, metric) = (&layer.name, limit.metric);
                    let condition = match metric {
                        Metric::Share if threshold > 0.0 => format!(" over {}", Number(threshold)),
                        _ => String::new(),
                    };
                    fails.push(format!(
                        "{name}: {metric}{condition} {} is {relation} {}",
                        Number(value),
                        Number(limit.worst)
                    ));
                }
            }
        }
        self.passes = fails.is_empty();
        self.fails = fails;
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size_b;
        writeln!(f, "{} against {}: {width} x {height} pixels", self.a, self.b)?;
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        for layer in &self.layers {
            let channels = layer.channels.join(" ");
            let channels = if channels == layer.name {
                String::new()
            } else {
                format!(" {channels}")
            };
            if !layer.is_different() {
                writeln!(f, "{}{channels}: identical", layer.name)?;
                continue;
            }
            writeln!(f, "{}{channels}", layer.name)?;
            for metric in METRICS.into_iter().filter(|metric| self.metrics.contains(metric)) {
                if let Some(line) = layer.line(metric) {
                    writeln!(f, "  {:<9}  {line}", metric.name())?;
                }
            }
        }
        for fail in &self.fails {
            writeln!(f, "fails: {fail}")?;
        }
        match (self.passes, self.is_different()) {
            (true, true) => writeln!(f, "passes"),
            (true, false) => writeln!(f, "identical"),
            (false, _) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits_and_are_not_rounded_to_integers() {
        let text = |value: f64| Number(value).to_string();
        assert_eq!(text(0.0), "0");
        assert_eq!(text(1.0), "1");
        assert_eq!(text(0.048_767_311), "0.0487673");
        assert_eq!(text(26.237_423), "26.2374");
        assert_eq!(text(123_456_789.0), "123456789");
        assert_eq!(text(4_294_967_295.0), "4294967295");
        assert_eq!(text(4_294_967_294.5), "4.29497e9");
        assert_eq!(text(2.384_19e-7), "2.38419e-7");
        assert_eq!(text(1e-5), "1e-5");
        assert_eq!(text(0.999_999_998_7), "0.9999999987");
        assert_eq!(text(f64::INFINITY), "inf");
        assert_eq!(
            serde_json::to_string(&[Number(f64::INFINITY), Number(0.5)]).unwrap(),
            r#"["inf",0.5]"#
        );
    }
}
