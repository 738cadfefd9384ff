//! Parsers of integers.

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
