//! A color map from black over violet, red and orange to pale yellow. Luminance increases monotonically, so that the
//! map is readable in grayscale and for color-blind viewers.

/// Evenly spaced display colors.
const KNOTS: [[u8; 3]; 9] = [
    [0, 0, 4],
    [30, 16, 70],
    [80, 18, 123],
    [130, 37, 129],
    [182, 54, 121],
    [230, 80, 98],
    [251, 136, 97],
    [254, 194, 140],
    [252, 253, 191],
];

/// Returns the display color of a value from 0 to 255.
pub fn color(value: u8) -> [u8; 3] {
    let position = f64::from(value) / 255.0 * (KNOTS.len() - 1) as f64;
    let knot = (position as usize).min(KNOTS.len() - 2);
    let fraction = position - knot as f64;
    std::array::from_fn(|i| {
        let (low, high) = (f64::from(KNOTS[knot][i]), f64::from(KNOTS[knot + 1][i]));
        (low + (high - low) * fraction + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_grow_brighter_from_black_to_pale_yellow() {
        assert_eq!((color(0), color(255)), (KNOTS[0], KNOTS[8]));
        let luminance = |value| {
            let [r, g, b] = color(value).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        assert!((1..=255).all(|value| luminance(value) > luminance(value - 1)));
    }
}
