//! Parsers of integers, and the text of estimates.

use std::ops::RangeInclusive;

/// Returns a parser of integers in a range.
pub fn integer<T: TryFrom<u32>>(range: RangeInclusive<u32>) -> impl Fn(&str) -> Result<T, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let number = number.and_then(|number: u32| T::try_from(number).ok());
        number.ok_or_else(|| format!("must be a whole number from {} to {}", range.start(), range.end()))
    }
}

/// Parses a number of samples. The library checks the range.
pub fn samples(text: &str) -> Result<u32, String> {
    let number = text.parse();
    number.map_err(|_| "must be a whole number from 1 to 65536".to_owned())
}

/// Parses a number of bounces. The library checks the range, which depends on the integrator.
pub fn bounces(text: &str) -> Result<u32, String> {
    let number = text.parse();
    number.map_err(|_| "must be a whole number, such as 8".to_owned())
}

/// Returns the text of a positive number with three significant digits.
pub fn significant(number: f64) -> String {
    let digits = (2.0 - number.log10().floor()).clamp(0.0, 9.0); // 9 for zero, 0 for infinity
    let text = format!("{number:.*}", digits as usize);
    match number == 0.0 {
        true => "0".to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_have_three_significant_digits() {
        for (number, text) in [
            (0.0, "0"),
            (0.012_345, "0.0123"),
            (0.5, "0.500"),
            (1.0, "1.00"),
            (17.25, "17.2"),
            (4321.0, "4321"),
            (1e-7, "0.000000100"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(significant(number), text);
        }
    }
}
