//! Metrics and their limits.

use std::fmt;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    Different,
    Largest,
    Share,
    Rmse,
    RelMse,
    Psnr,
    Ssim,
    Flip,
}

/// All metrics, in the order in which they are printed.
pub const METRICS: [Metric; 8] = [
    Metric::Different,
    Metric::Largest,
    Metric::Share,
    Metric::Rmse,
    Metric::RelMse,
    Metric::Psnr,
    Metric::Ssim,
    Metric::Flip,
];

impl Metric {
    /// Returns the name used in options, text and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Different => "different",
            Metric::Largest => "largest",
            Metric::Share => "share",
            Metric::Rmse => "rmse",
            Metric::RelMse => "rel_mse",
            Metric::Psnr => "psnr",
            Metric::Ssim => "ssim",
            Metric::Flip => "flip",
        }
    }

    pub fn parse(name: &str) -> Result<Metric, String> {
        let found = METRICS.into_iter().find(|metric| metric.name() == name);
        found.ok_or_else(|| format!("must be one of {}", METRICS.map(Metric::name).join(", ")))
    }

    /// Returns true if the metric needs red, green and blue.
    pub fn needs_colors(self) -> bool {
        matches!(self, Metric::Ssim | Metric::Flip)
    }

    fn is_similarity(self) -> bool {
        matches!(self, Metric::Psnr | Metric::Ssim)
    }

    /// Returns the minimum, the maximum, and the rule for messages.
    fn range(self) -> (f64, f64, &'static str) {
        match self {
            Metric::Different | Metric::Largest | Metric::Rmse | Metric::RelMse => (0.0, f64::MAX, "of at least 0"),
            Metric::Share | Metric::Flip => (0.0, 1.0, "from 0 to 1"),
            Metric::Psnr => (f64::MIN, f64::MAX, "of decibels"),
            Metric::Ssim => (-1.0, 1.0, "from -1 to 1"),
        }
    }
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A limit of a metric; the comparison fails if the value is worse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    pub metric: Metric,
    pub worst: f64,
}

impl Limit {
    pub fn parse(text: &str) -> Result<Limit, String> {
        let (name, value) = text.split_once('=').ok_or("must be METRIC=X, such as rmse=0.01")?;
        let metric = Metric::parse(name).map_err(|rule| format!("the metric {rule}"))?;
        let (min, max, rule) = metric.range();
        match value.parse() {
            Ok(worst) if (min..=max).contains(&worst) => Ok(Limit { metric, worst }),
            _ => Err(format!("{name} must be a number {rule}")),
        }
    }

    /// Returns "above" or "below" if a value is worse than the limit.
    pub fn exceeded(self, value: f64) -> Option<&'static str> {
        match self.metric.is_similarity() {
            true => (!(value >= self.worst)).then_some("below"),
            false => (!(value <= self.worst)).then_some("above"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_with_their_ranges() {
        let limit = |metric, worst| Ok(Limit { metric, worst });
        assert_eq!(Limit::parse("rmse=0"), limit(Metric::Rmse, 0.0));
        assert_eq!(Limit::parse("ssim=-1"), limit(Metric::Ssim, -1.0));
        assert_eq!(Limit::parse("psnr=-3.5"), limit(Metric::Psnr, -3.5));
        for invalid in [
            "rmse", "rmse=", "rmse=-1", "rmse=nan", "psnr=inf", "flip=1.1", "ssim=2", "mse=1", "=1",
        ] {
            assert!(Limit::parse(invalid).is_err(), "{invalid}");
        }
    }

    #[test]
    fn values_equal_to_the_limit_pass_and_nan_fails() {
        let limit = |text| Limit::parse(text).unwrap();
        assert_eq!(limit("rmse=0.5").exceeded(0.5), None);
        assert_eq!(limit("rmse=0.5").exceeded(0.500_000_1), Some("above"));
        assert_eq!(limit("psnr=30").exceeded(30.0), None);
        assert_eq!(limit("psnr=30").exceeded(29.9), Some("below"));
        assert_eq!(limit("psnr=30").exceeded(f64::INFINITY), None);
        for text in ["rmse=0.5", "psnr=30"] {
            assert!(limit(text).exceeded(f64::NAN).is_some(), "{text}");
        }
    }
}
