//! How a picture is shown: the scene's view transform and exposure or those chosen on the page, false colours, and marks.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::compare::color;
use crate::image::Pixels;
use crate::scene::{ViewSettings, ViewTransform};

/// What is chosen of how light is shown; what is not chosen is the scene's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Choice {
    /// Stops, -100 to 100.
    pub exposure: Option<f64>,
    /// From light to what a display is sent.
    pub transform: Option<ViewTransform>,
    /// Whether colours tell how bright light is.
    pub false_color: bool,
}

impl Choice {
    /// A choice that is within its ranges.
    pub fn checked(self) -> Result<Choice, String> {
        if let Some(stops) = self.exposure {
            ViewSettings::check_exposure(stops).map_err(|rule| format!("exposure: {stops} {rule}"))?;
        }
        Ok(self)
    }

    /// The scene's settings, with what is chosen.
    pub fn over(self, scene: ViewSettings) -> ViewSettings {
        ViewSettings {
            transform: self.transform.unwrap_or(scene.transform),
            exposure: self.exposure.unwrap_or(scene.exposure),
        }
    }
}

/// How a frame is shown, beside what it is of.
#[derive(Clone, Copy, Debug, Default)]
pub struct Look {
    /// The factor of the difference of [`View::Compare`](super::View::Compare).
    pub gain: f32,
    /// Whether pixels that are no light are marked.
    pub marks: bool,
    /// Whether negative ones are light, as under filters with negative lobes.
    pub negative: bool,
    /// How light is shown.
    pub view: ViewSettings,
    /// Whether colours tell how bright light is.
    pub false_color: bool,
}

/// The stops of luminance, after the exposure, from the first false colour to the last: of light, and of standard errors.
const FALSE_COLORS: [f32; 2] = [-10.0, 6.0];
const ERRORS: [f32; 2] = [-12.0, 0.0];

impl Look {
    /// The bytes that are shown for linear light.
    pub fn shown(&self, light: [f32; 3]) -> [u8; 3] {
        match self.false_color {
            true => self.false_color(light, FALSE_COLORS),
            false => self.view.rgb8(light),
        }
    }

    /// The bytes of a picture of light.
    pub fn bytes(&self, pixels: &Pixels) -> Vec<u8> {
        let colors = pixels.colors.par_iter().with_min_len(1024);
        colors.flat_map_iter(|color| self.shown(*color)).collect()
    }

    /// The false colour of a standard error of light.
    pub fn error_color(&self, error: [f32; 3]) -> [u8; 3] {
        self.false_color(error, ERRORS)
    }

    /// Luminance is that of Rec. 709; none is shown as the least.
    fn false_color(&self, [r, g, b]: [f32; 3], [first, last]: [f32; 2]) -> [u8; 3] {
        let stops = (0.2126 * r + 0.7152 * g + 0.0722 * b).log2() + self.view.exposure as f32;
        color(((stops - first) / (last - first) * 255.0 + 0.5) as u8) // saturates; NaN is 0
    }
}

/// What false colours mean.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Legend {
    /// The stops of luminance of the first colour and of the last.
    pub stops: [f64; 2],
    /// Colours, evenly spaced.
    pub colors: Vec<[u8; 3]>,
}

impl Legend {
    /// That of light, under an exposure.
    pub fn of(exposure: f64) -> Legend {
        Legend::over(FALSE_COLORS, exposure)
    }

    /// That of standard errors of light.
    pub fn of_errors(exposure: f64) -> Legend {
        Legend::over(ERRORS, exposure)
    }

    fn over(stops: [f32; 2], exposure: f64) -> Legend {
        Legend {
            stops: stops.map(|stops| f64::from(stops) - exposure),
            colors: (0..=16).map(|i| color((i * 255 / 16) as u8)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn false_colours_follow_the_stops() {
        let look = |exposure| Look {
            view: ViewSettings {
                exposure,
                ..ViewSettings::default()
            },
            false_color: true,
            ..Look::default()
        };
        let grey = |stops: f32| [stops.exp2(); 3];
        let [first, last] = FALSE_COLORS;
        let Legend { stops, colors: legend } = Legend::of(3.0);
        assert_eq!(stops, [-13.0, 3.0]);
        for (i, wanted) in legend.iter().enumerate() {
            let stops = first + (last - first) * i as f32 / 16.0;
            let shown = look(0.0).shown(grey(stops));
            assert!(
                shown.iter().zip(wanted).all(|(a, b)| a.abs_diff(*b) <= 2),
                "{stops}: {shown:?} {wanted:?}"
            );
            assert_eq!(look(3.0).shown(grey(stops - 3.0)), look(0.0).shown(grey(stops)));
        }
        for (light, wanted) in [
            (0.0, legend[0]),
            (-1.0, legend[0]),
            (f32::NAN, legend[0]),
            (f32::INFINITY, legend[16]),
        ] {
            assert_eq!(look(0.0).shown([light; 3]), wanted, "{light}");
        }
        assert_ne!(look(0.0).shown(grey(0.0)), look(0.0).shown(grey(-3.0)));
        // Standard errors have a scale of their own.
        let Legend { stops, colors: legend } = Legend::of_errors(3.0);
        assert_eq!(stops, [-15.0, -3.0]);
        for (stops, wanted) in [(-15.0, legend[0]), (-9.0, legend[8]), (-3.0, legend[16])] {
            let shown = look(3.0).error_color(grey(stops));
            assert!(
                shown.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) <= 2),
                "{stops}: {shown:?} {wanted:?}"
            );
        }
    }

    #[test]
    fn what_is_chosen_stands_for_the_scenes() {
        let scene = ViewSettings {
            transform: ViewTransform::Agx,
            exposure: 2.0,
        };
        assert_eq!(Choice::default().over(scene), scene);
        let chosen = Choice {
            exposure: Some(-1.0),
            ..Choice::default()
        };
        assert_eq!(
            chosen.over(scene),
            ViewSettings {
                exposure: -1.0,
                ..scene
            }
        );
        for stops in [100.5, -101.0, f64::NAN, f64::INFINITY] {
            let exposure = Some(stops);
            assert!(Choice { exposure, ..chosen }.checked().is_err(), "{stops}");
        }
    }
}
