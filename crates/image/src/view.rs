//! View transforms: from linear light to display values, 0 to 1, before quantization.
//!
//! Light is linear RGB with the primaries of sRGB (Rec. 709, D65). NaN and negative values are treated as 0, and
//! infinity is treated as the largest finite value.

use serde::{Deserialize, Serialize};

use crate::agx::{Rgb, agx};
use crate::color::{linear_to_srgb, srgb_to_linear};

/// Transform from linear light to display values. [`ViewTransform::name`] is the name in files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[non_exhaustive]
pub enum ViewTransform {
    /// Clamps to 0 ... 1, then applies gamma 1/2.2.
    #[default]
    #[serde(rename = "gamma22")]
    Gamma22,
    /// Clamps to 0 ... 1, then applies the sRGB curve.
    #[serde(rename = "srgb")]
    Srgb,
    /// AgX without a look: desaturates bright colors gradually, like film.
    #[serde(rename = "agx")]
    Agx,
    /// Khronos PBR Neutral: keeps colors up to a brightness, and compresses brighter colors.
    #[serde(rename = "khronos-pbr-neutral")]
    KhronosPbrNeutral,
}

impl ViewTransform {
    /// All view transforms.
    pub const ALL: [ViewTransform; 4] = [
        ViewTransform::Gamma22,
        ViewTransform::Srgb,
        ViewTransform::Agx,
        ViewTransform::KhronosPbrNeutral,
    ];

    /// Returns the name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            ViewTransform::Gamma22 => "gamma22",
            ViewTransform::Srgb => "srgb",
            ViewTransform::Agx => "agx",
            ViewTransform::KhronosPbrNeutral => "khronos-pbr-neutral",
        }
    }
}

/// Exposure and view transform of an image. Formats with linear values, such as OpenEXR, ignore both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewSettings {
    /// View transform.
    pub transform: ViewTransform,
    /// Exposure in stops, -100 to 100: light is multiplied by 2^exposure before the transform.
    pub exposure: f64,
}

impl ViewSettings {
    /// Maximum magnitude of the exposure in stops, which keeps radiance far from the limits of 64-bit floats.
    pub const MAX_STOPS: f64 = 100.0;

    /// Returns the exposure, or the rule that it violates.
    pub fn check_exposure(stops: f64) -> Result<f64, String> {
        match stops.abs() <= ViewSettings::MAX_STOPS {
            true => Ok(stops),
            false => Err("must be from -100 to 100 stops".to_owned()),
        }
    }
}

impl ViewSettings {
    /// Returns the display values of a linear color, 0 to 1.
    pub fn display(&self, linear: [f32; 3]) -> [f64; 3] {
        transformed(self.transform, self.exposed(linear))
    }

    /// Returns the radiance that is displayed as this color, whose components are 0 to 1. The result is approximate for
    /// colors outside the range of the transform.
    pub fn light_of(&self, display: [f64; 3]) -> [f64; 3] {
        let factor = self.exposure.exp2();
        inverse(self.transform, display).map(|light| light / factor)
    }

    /// Returns the display values of a reflectance such as an albedo: only the curve of the transform is applied.
    pub fn display_reflectance(&self, reflectance: [f32; 3]) -> [f64; 3] {
        match self.transform {
            ViewTransform::Gamma22 => reflectance.map(sanitized).map(gamma22),
            _ => reflectance.map(sanitized).map(srgb),
        }
    }

    fn exposed(&self, linear: [f32; 3]) -> Rgb {
        let factor = self.exposure.exp2();
        linear.map(|value| sanitized(value) * factor)
    }

    /// Returns the display values in 8 bits.
    pub fn rgb8(&self, linear: [f32; 3]) -> [u8; 3] {
        self.display(linear).map(to_8_bits)
    }

    /// Returns the straight (not premultiplied) display values of a color that is premultiplied by alpha, black where
    /// alpha is 0, and the linear alpha.
    pub fn display_straight(&self, linear: [f32; 3], alpha: f32) -> [f64; 4] {
        let straight = linear.map(|value| if alpha > 0.0 { value / alpha } else { 0.0 });
        let [r, g, b] = self.display(straight);
        [r, g, b, sanitized(alpha).min(1.0)]
    }

    /// Returns the straight display values in 8 bits.
    pub fn rgba8(&self, linear: [f32; 3], alpha: f32) -> [u8; 4] {
        self.display_straight(linear, alpha).map(to_8_bits)
    }

    /// Returns true if the values are sRGB-encoded.
    pub fn is_srgb(&self) -> bool {
        self.transform != ViewTransform::Gamma22
    }
}

fn transformed(transform: ViewTransform, light: Rgb) -> Rgb {
    match transform {
        ViewTransform::Gamma22 => light.map(gamma22),
        ViewTransform::Srgb => light.map(srgb),
        ViewTransform::Agx => agx(light).map(srgb),
        ViewTransform::KhronosPbrNeutral => khronos_pbr_neutral(light).map(srgb),
    }
}

/// Returns the radiance that is displayed as a color. If no such radiance exists, returns the candidate displayed
/// closest to the color: the result of [`solution`], or a multiple of the linear color.
fn inverse(transform: ViewTransform, display: Rgb) -> Rgb {
    const MAX_DISTANCE: f64 = 0.5 / 255.0;
    let distance = |light: &Rgb| {
        let shown = transformed(transform, *light);
        let squares = (0..3).map(|i| (shown[i] - display[i]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let solved = solution(transform, display);
    if distance(&solved) < MAX_DISTANCE {
        return solved;
    }
    let linear = display.map(srgb_to_linear);
    let multiples = (0..=400).map(|i| linear.map(|x| x * (0.025 * f64::from(i - 200)).exp2()));
    let candidates = multiples.chain([solved]);
    let closest = candidates.min_by(|a, b| distance(a).total_cmp(&distance(b)));
    closest.unwrap_or(solved)
}

/// Solves `transformed(transform, light) == display` by coordinate-wise bisection, because each display channel
/// increases with the radiance of the channel.
fn solution(transform: ViewTransform, display: Rgb) -> Rgb {
    /// Maximum radiance of a channel. PBR Neutral only approaches white.
    const MAX_RADIANCE: f64 = 1e3;
    /// A display value that rounds to white in 8 bits.
    const NEARLY_WHITE: f64 = 1.0 - 0.25 / 255.0;
    const SWEEPS: usize = 100;
    const BISECTIONS: usize = 60;
    let [white, ..] = transformed(transform, [MAX_RADIANCE; 3]);
    let target = display.map(|value| {
        if value <= white + 1e-9 {
            value.min(white)
        } else {
            NEARLY_WHITE
        }
    });
    let mut light = [0.18; 3];
    for _ in 0..SWEEPS {
        for channel in 0..3 {
            let (mut low, mut high) = (0.0, MAX_RADIANCE);
            for _ in 0..BISECTIONS {
                light[channel] = 0.5 * (low + high);
                match transformed(transform, light)[channel] < target[channel] {
                    true => low = light[channel],
                    false => high = light[channel],
                }
            }
            light[channel] = if target[channel] > 0.0 { high } else { 0.0 };
        }
    }
    light
}

/// Encodes a linear value in 8 bits with [`ViewTransform::Gamma22`]: clamped to [0, 1], raised to the power 1/2.2,
/// times 255, rounded to the nearest integer. NaN yields 0.
pub fn encode(linear: f32) -> u8 {
    to_8_bits(gamma22(sanitized(linear)))
}

/// Rounds to the nearest of 256 steps from 0 to 1; halves round up.
pub fn to_8_bits(value: f64) -> u8 {
    (value * 255.0 + 0.5) as u8 // the cast saturates and maps NaN to 0
}

/// Rounds to the nearest of 65,536 steps from 0 to 1; halves round up.
pub fn to_16_bits(value: f64) -> u16 {
    (value * 65_535.0 + 0.5) as u16
}

/// Replaces NaN and negative values by 0, and infinity by the largest finite value.
fn sanitized(value: f32) -> f64 {
    match value > 0.0 {
        true => f64::from(value.min(f32::MAX)),
        false => 0.0, // also for NaN
    }
}

/// Exponent of [`ViewTransform::Gamma22`].
pub const GAMMA: f64 = 1.0 / 2.2;

fn gamma22(light: f64) -> f64 {
    light.min(1.0).powf(GAMMA)
}

fn srgb(light: f64) -> f64 {
    linear_to_srgb(light.clamp(0.0, 1.0))
}

/// Khronos Group, "PBR Neutral Tone Mapper" specification, 2024, with F90 = 0.04, Ks = 0.8 - 0.04 and Kd = 0.15.
/// Returns linear display light up to 1.
fn khronos_pbr_neutral(light: Rgb) -> Rgb {
    const F90: f64 = 0.04;
    const START: f64 = 0.8 - F90;
    const DESATURATION: f64 = 0.15;
    let min = smallest(light);
    let offset = match min <= 2.0 * F90 {
        true => min - min * min / (4.0 * F90),
        false => F90,
    };
    let light = light.map(|value| value - offset);
    let peak = largest(light);
    if peak <= START {
        return light;
    }
    let range = 1.0 - START;
    let new_peak = 1.0 - range * range / (peak + range - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    light.map(|value| mix(value * (new_peak / peak), new_peak, white))
}

fn smallest([r, g, b]: Rgb) -> f64 {
    r.min(g).min(b)
}

fn largest([r, g, b]: Rgb) -> f64 {
    r.max(g).max(b)
}

fn mix(a: f64, b: f64, weight: f64) -> f64 {
    a * (1.0 - weight) + b * weight
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(transform: ViewTransform) -> ViewSettings {
        ViewSettings {
            transform,
            exposure: 0.0,
        }
    }

    fn max_difference(a: [f64; 3], b: [f64; 3]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn light_of_inverts_display() {
        for transform in ViewTransform::ALL {
            for exposure in [0.0, -2.0, 3.5] {
                let view = ViewSettings { transform, exposure };
                for color in [
                    [255, 255, 255],
                    [0, 0, 0],
                    [128, 128, 128],
                    [20, 20, 20],
                    [254, 254, 254],
                    [200, 180, 160],
                    [90, 140, 200],
                    [240, 230, 220],
                ] {
                    let light = view.light_of(color.map(|value| f64::from(value) / 255.0));
                    let shown = view.rgb8(light.map(|value| value as f32));
                    assert_eq!(shown, color, "{view:?}: {light:?}");
                }
            }
        }
        // The sRGB curve is inverted exactly.
        let srgb = view(ViewTransform::Srgb).light_of([1.0, 0.5, 0.0]);
        assert!(max_difference(srgb, [1.0, 0.214_041_14, 0.0]) < 1e-8, "{srgb:?}");
    }

    /// Checks both branches of the curve and the point where the branches meet.
    #[test]
    fn srgb_matches_the_standard() {
        for (linear, shown) in [
            (0.0, 0.0),
            (0.001, 0.01292),
            (0.003_130_8, 0.040_449_9),
            (0.214_041_14, 0.5),
            (0.5, 0.735_356_98),
            (1.0, 1.0),
            (7.0, 1.0),
        ] {
            let found = view(ViewTransform::Srgb).display([linear; 3]);
            assert!(max_difference(found, [shown; 3]) < 1e-6, "{linear}: {found:?}");
        }
        let gamma = view(ViewTransform::Gamma22).display([0.5; 3]);
        assert!(
            max_difference(gamma, [0.735_356_98; 3]) > 1e-3,
            "gamma 2.2 passes as sRGB"
        );
    }

    /// Checks the formulas of the specification: grays x up to 0.08 become x² / 0.16, and grays from 0.08 to 0.8 are
    /// reduced by 0.04. Primaries up to 0.76 are unchanged. For brighter colors, a peak x becomes 1 - 0.0576 / (x -
    /// 0.52), and the other channels move towards the peak.
    #[test]
    fn pbr_neutral_matches_the_specification() {
        let neutral = view(ViewTransform::KhronosPbrNeutral);
        let srgb = view(ViewTransform::Srgb);
        for (light, linear) in [
            ([0.5, 0.5, 0.5], [0.46, 0.46, 0.46]),
            ([0.08, 0.08, 0.08], [0.04, 0.04, 0.04]),
            ([0.04, 0.04, 0.04], [0.01, 0.01, 0.01]),
            ([0.76, 0.0, 0.3], [0.76, 0.0, 0.3]),
            ([2.04, 2.04, 2.04], [0.961_081_1; 3]),
        ] {
            let (found, expected) = (neutral.display(light), srgb.display(linear));
            assert!(
                max_difference(found, expected) < 1e-6,
                "{light:?}: {found:?}, {expected:?}"
            );
        }
        // x = 2 has a peak of 2, which is displayed as p = 1 - 0.0576 / 1.48. The weight of white is 1 - 1 / (0.15 (2 -
        // p) + 1).
        let peak = 1.0 - 0.0576 / 1.48;
        let white = 1.0 - 1.0 / (0.15 * (2.0 - peak) + 1.0);
        let expected = srgb.display([peak as f32, (peak * white) as f32, (peak * white) as f32]);
        assert!(max_difference(neutral.display([2.0, 0.0, 0.0]), expected) < 1e-6);
    }

    #[test]
    fn colors_out_of_range_have_an_approximate_inverse() {
        let distance = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>();
        for transform in [ViewTransform::KhronosPbrNeutral, ViewTransform::Agx] {
            let view = view(transform);
            let shown = |light: [f64; 3]| view.display(light.map(|x| x as f32));
            for color in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]] {
                let found = distance(shown(view.light_of(color)), color);
                for candidate in [color.map(srgb_to_linear), solution(transform, color)] {
                    assert!(found < distance(shown(candidate), color), "{transform:?} {color:?}");
                }
            }
        }
        let [red, green, blue] = view(ViewTransform::KhronosPbrNeutral).display(
            view(ViewTransform::KhronosPbrNeutral)
                .light_of([1.0, 0.0, 0.0])
                .map(|x| x as f32),
        );
        assert!(red > 0.85 && green < 0.15 && blue < 0.15, "{red} {green} {blue}");
    }

    /// Reference values from `benches/peers/view_check.py`, computed with its numpy formula and with Blender's tables.
    #[test]
    fn agx_matches_blender() {
        let agx = view(ViewTransform::Agx);
        for (light, formula, blender) in [
            ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
            ([0.18, 0.18, 0.18], [0.461_356; 3], [0.4613, 0.4613, 0.4614]),
            ([1.0, 1.0, 1.0], [0.771_101; 3], [0.771, 0.771, 0.771]),
            ([16.0, 16.0, 16.0], [0.999_14; 3], [0.9985, 0.9985, 0.9985]),
            (
                [1.0, 0.0, 0.0],
                [0.858_59, 0.224_071, 0.132_639],
                [0.858, 0.2241, 0.1292],
            ),
            (
                [0.0, 4.0, 0.0],
                [0.718_556, 0.919_514, 0.660_69],
                [0.7179, 0.9192, 0.6598],
            ),
            ([0.0, 0.0, 0.05], [0.0, 0.032_873, 0.220_254], [0.0, 0.0467, 0.2084]),
            (
                [0.8, 0.3, 0.1],
                [0.769_65, 0.556_776, 0.403_772],
                [0.7691, 0.5567, 0.4026],
            ),
            ([20.0, 5.0, 0.5], [1.0, 0.922_445, 0.862_342], [1.0, 0.9226, 0.8624]),
            ([0.3, 2.5, 40.0], [0.899_475, 0.936_018, 1.0], [0.8941, 0.9365, 1.0]),
        ] {
            let found = agx.display(light);
            assert!(
                max_difference(found, formula) < 2e-5,
                "{light:?}: {found:?}, {formula:?}"
            );
            assert!(
                max_difference(found, blender) < 0.015,
                "{light:?}: {found:?}, {blender:?}"
            );
        }
        let gray = agx.display([0.18; 3]);
        assert!(
            max_difference(gray, view(ViewTransform::Srgb).display([0.18; 3])) < 2e-4,
            "middle gray changes"
        );
        assert!(max_difference(agx.display([1.0; 3]), view(ViewTransform::Srgb).display([1.0; 3])) > 0.2);
    }

    #[test]
    fn exposure_multiplies_light() {
        for transform in ViewTransform::ALL {
            let light = [0.05, 0.2, 0.4];
            let brighter = ViewSettings {
                transform,
                exposure: 1.0,
            };
            assert_eq!(brighter.display(light), view(transform).display(light.map(|x| 2.0 * x)));
            assert_ne!(brighter.display(light), view(transform).display(light));
            let albedo = brighter.display_reflectance(light);
            assert_eq!(
                albedo,
                view(transform).display_reflectance(light),
                "the exposure changes an albedo"
            );
        }
        for (stops, is_valid) in [
            (100.0, true),
            (-100.0, true),
            (100.5, false),
            (f64::NAN, false),
            (f64::INFINITY, false),
        ] {
            assert_eq!(ViewSettings::check_exposure(stops).is_ok(), is_valid, "{stops}");
        }
    }

    /// All rendered values must map to 0 ... 1.
    #[test]
    fn display_values_are_always_from_0_to_1() {
        let values = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            -1.0,
            -0.0,
            0.0,
            1e-45,
            0.5,
            1e30,
            f32::MAX,
        ];
        for transform in ViewTransform::ALL {
            for exposure in [-100.0, 0.0, 100.0] {
                let settings = ViewSettings { transform, exposure };
                for (r, g, b) in values
                    .iter()
                    .flat_map(|r| values.map(move |g| (*r, g, values)))
                    .flat_map(|(r, g, values)| values.map(|b| (r, g, b)))
                {
                    let shown = settings.display([r, g, b]);
                    assert!(
                        shown.iter().all(|x| (0.0..=1.0).contains(x)),
                        "{settings:?} {r} {g} {b}: {shown:?}"
                    );
                    let straight = settings.display_straight([r, g, b], g);
                    assert!(
                        straight.iter().all(|x| (0.0..=1.0).contains(x)),
                        "{settings:?} {r} {g} {b}: {straight:?}"
                    );
                }
            }
            assert_eq!(view(transform).rgb8([f32::NAN, -1.0, f32::NEG_INFINITY]), [0; 3]);
            assert_eq!(view(transform).rgb8([f32::INFINITY; 3]), [255; 3]);
            assert_eq!(view(transform).rgb8([1e30; 3]), [255; 3]);
        }
    }

    /// Brighter light must not be displayed darker.
    #[test]
    fn grays_keep_their_order() {
        for transform in ViewTransform::ALL {
            let mut last = 0.0;
            for i in 0..4000 {
                let light = 1e-6 * 1.008_f32.powi(i);
                let [r, g, b] = view(transform).display([light; 3]);
                assert!(
                    (r - g).abs() < 1e-6 && (g - b).abs() < 1e-6,
                    "{transform:?}: {light} is not gray: {r} {g} {b}"
                );
                assert!(r >= last - 1e-9, "{transform:?}: {light}: {r} after {last}");
                last = r;
            }
            assert!(last > 0.999, "{transform:?}: {last}");
        }
    }

    #[test]
    fn values_are_rounded_to_the_nearest_step() {
        assert_eq!(
            [0.0, 0.5 / 255.0, 0.49 / 255.0, 1.0, f64::NAN].map(to_8_bits),
            [0, 1, 0, 255, 0]
        );
        assert_eq!(
            [0.0, 0.5 / 65_535.0, 0.49 / 65_535.0, 1.0].map(to_16_bits),
            [0, 1, 0, 65_535]
        );
        assert_eq!(to_16_bits(f64::NAN), 0);
    }
}
