//! AgX (T. Sobotka): a view transform that desaturates bright colors gradually, like film. This is the variant of
//! Blender 4.0 and later, without a look.
//!
//! All constants and steps are from Z. Zhou, `AgX_LUT_Gen`: `AgXBaseRec2020.py`, whose matrices Blender's tables use,
//! and `AgXBasesRGB.py`. The curve is by J. Smith (`sigmoid.py` in the same repository). Two simplifications: values
//! are not interpolated in a 57 x 57 x 57 table, and colors outside the display gamut are clipped.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

pub(super) type Rgb = [f64; 3];

/// Linear Rec. 709 to Rec. 2020 in row-major order: ITU-R BT.2087-0, section 2.
const TO_REC2020: [[f64; 3]; 3] = [
    [0.627_403_9, 0.329_283_0, 0.043_313_1],
    [0.069_097_3, 0.919_540_4, 0.011_362_3],
    [0.016_391_4, 0.088_013_3, 0.895_595_3],
];

/// Matrix that moves the primaries inwards and rotates them. This reduces hue shifts of bright saturated colors.
const INSET: [[f64; 3]; 3] = [
    [0.856_627_153_315_983, 0.095_121_240_538_158_8, 0.048_251_606_145_858_3],
    [0.137_318_972_929_847, 0.761_241_990_602_591, 0.101_439_036_467_562],
    [0.111_898_212_999_95, 0.076_799_418_603_190_3, 0.811_302_368_396_859],
];

/// Inverse of the outset matrix. The outset restores saturation after the curve.
const OUTSET_INVERSE: [[f64; 3]; 3] = [
    [0.899_796_955_911_611, 0.087_199_619_202_835_1, 0.013_003_424_885_555],
    [0.111_420_988_957_48, 0.875_575_586_156_966, 0.013_003_424_885_554_8],
    [0.111_420_988_957_48, 0.087_199_619_202_834_9, 0.801_379_391_839_686],
];

/// Linear value of middle gray.
const MIDDLE_GRAY: f64 = 0.18;
/// Dynamic range of the curve, in stops below and above middle gray.
const STOPS_BELOW: f64 = 10.0;
const STOPS_ABOVE: f64 = 6.5;
/// Exponent that decodes the output of the curve to linear display light.
const POWER: f64 = 2.4;
/// Slope of the curve at middle gray, and the exponent of its shoulder and toe.
const SLOPE: f64 = 2.4;
const BEND: f64 = 1.5;
/// Fraction of the hue shift of the curve that is kept.
const HUE: f64 = 0.4;

/// Returns linear display light, possibly out of gamut, for linear scene light >= 0.
pub(super) fn agx(light: Rgb) -> Rgb {
    let light = *TO_CURVE_SPACE * DVec3::from(light);
    let displayed = light.map(|value| curve(log_position(value)).powf(POWER));
    let displayed = with_hue(displayed, mix_hues(hue(light), hue(displayed), HUE));
    (*FROM_CURVE_SPACE * displayed).into()
}

/// Linear Rec. 709 to the space of the curve, and back.
static TO_CURVE_SPACE: LazyLock<DMat3> = LazyLock::new(|| matrix(INSET) * matrix(TO_REC2020));
static FROM_CURVE_SPACE: LazyLock<DMat3> = LazyLock::new(|| (matrix(OUTSET_INVERSE) * matrix(TO_REC2020)).inverse());

fn matrix(rows: [[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(&rows).transpose()
}

/// Returns the logarithmic position of a value in the dynamic range, 0 to 1.
fn log_position(value: f64) -> f64 {
    let stops = (value / MIDDLE_GRAY).log2(); // -inf for 0
    ((stops + STOPS_BELOW) / (STOPS_BELOW + STOPS_ABOVE)).clamp(0.0, 1.0)
}

/// Returns the value of the sigmoid from (0, 0) to (1, 1) that is steepest at middle gray and maps
/// middle gray to itself.
fn curve(x: f64) -> f64 {
    let BranchScales { below, above } = &*BRANCH_SCALES;
    let (middle, gray) = pivot();
    match x >= middle {
        true => (gray + branch(x - middle, *above)).min(1.0),
        false => (gray - branch(middle - x, *below)).max(0.0),
    }
}

/// Returns the position of middle gray and the value of the curve at this position.
fn pivot() -> (f64, f64) {
    (STOPS_BELOW / (STOPS_BELOW + STOPS_ABOVE), *GRAY)
}

static GRAY: LazyLock<f64> = LazyLock::new(|| MIDDLE_GRAY.powf(1.0 / POWER));

/// Scales of the two branches of the curve, below and above middle gray.
struct BranchScales {
    below: f64,
    above: f64,
}

static BRANCH_SCALES: LazyLock<BranchScales> = LazyLock::new(|| {
    let scale = |width: f64, height: f64| {
        let scaled_width = SLOPE * width;
        (scaled_width.powf(-BEND) * ((scaled_width / height).powf(BEND) - 1.0)).powf(-1.0 / BEND)
    };
    let (middle, gray) = pivot();
    BranchScales {
        below: scale(middle, gray),
        above: scale(1.0 - middle, 1.0 - gray),
    }
});

/// Returns the value of one branch of the sigmoid, relative to middle gray.
fn branch(x: f64, scale: f64) -> f64 {
    let x = SLOPE * x / scale;
    scale * x / (1.0 + x.powf(BEND)).powf(1.0 / BEND)
}

/// Returns the HSV hue in turns, 0 to 1; 0 for grays. A. R. Smith, "Color gamut transform pairs", SIGGRAPH 1978.
fn hue(color: DVec3) -> f64 {
    let (max, spread) = (color.max_element(), color.max_element() - color.min_element());
    let [r, g, b] = color.into();
    if !(spread > 0.0) {
        0.0
    } else if max == r {
        ((g - b) / spread / 6.0).rem_euclid(1.0)
    } else if max == g {
        ((b - r) / spread + 2.0) / 6.0
    } else {
        ((r - g) / spread + 4.0) / 6.0
    }
}

/// Interpolates two hues along the shorter arc.
fn mix_hues(from: f64, to: f64, weight: f64) -> f64 {
    let arc = (to - from + 0.5).rem_euclid(1.0) - 0.5;
    from + weight * arc
}

/// Replaces the HSV hue of the color; value and saturation are kept.
fn with_hue(color: DVec3, hue: f64) -> DVec3 {
    let (max, spread) = (color.max_element(), color.max_element() - color.min_element());
    let channel = |offset: f64| {
        let x = (offset + hue * 6.0).rem_euclid(6.0);
        max - spread * x.min(4.0 - x).clamp(0.0, 1.0)
    };
    DVec3::new(channel(5.0), channel(3.0), channel(1.0))
}
