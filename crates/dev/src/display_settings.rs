//! Display settings: view transform and exposure (from the scene or chosen on the page), false colors, and marks on
//! invalid pixels.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use wgray_image::Pixels;
use wgray_image::compare::color;
use wgray_scene::{ViewSettings, ViewTransform};

/// Overrides of the scene's display settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct DisplayOverrides {
    /// The exposure in stops, -100 to 100.
    pub exposure: Option<f64>,
    /// The view transform.
    pub transform: Option<ViewTransform>,
    /// True if the luminance is displayed as false colors.
    pub false_color: bool,
}

impl DisplayOverrides {
    /// Returns the overrides if all values are in range.
    pub fn checked(self) -> Result<DisplayOverrides, String> {
        if let Some(stops) = self.exposure {
            ViewSettings::check_exposure(stops).map_err(|rule| format!("exposure: {stops} {rule}"))?;
        }
        Ok(self)
    }

    /// Applies the overrides to the settings of the scene.
    pub fn apply_to(self, scene: ViewSettings) -> ViewSettings {
        ViewSettings {
            transform: self.transform.unwrap_or(scene.transform),
            exposure: self.exposure.unwrap_or(scene.exposure),
        }
    }
}

/// The settings with which a frame is displayed.
#[derive(Clone, Copy, Debug, Default)]
pub struct DisplaySettings {
    /// The gain of the difference in [`View::Compare`](super::View::Compare).
    pub gain: f32,
    /// True if invalid pixels are marked.
    pub marks: bool,
    /// True if negative values are valid, as from filters that have negative lobes.
    pub allow_negative: bool,
    /// The view transform and the exposure.
    pub view: ViewSettings,
    /// True if the luminance is displayed as false colors.
    pub false_color: bool,
}

/// Ranges of the false colors in stops of luminance after exposure.
const RADIANCE_STOPS: [f32; 2] = [-10.0, 6.0];
const STANDARD_ERROR_STOPS: [f32; 2] = [-12.0, 0.0];

impl DisplaySettings {
    /// Returns the displayed bytes of a linear color.
    pub fn color_bytes(&self, light: [f32; 3]) -> [u8; 3] {
        match self.false_color {
            true => self.false_color(light, RADIANCE_STOPS),
            false => self.view.rgb8(light),
        }
    }

    /// Returns the displayed bytes of an image.
    pub fn bytes(&self, pixels: &Pixels) -> Vec<u8> {
        let colors = pixels.colors.par_iter().with_min_len(1024);
        colors.flat_map_iter(|color| self.color_bytes(*color)).collect()
    }

    /// Returns the false color of a standard error.
    pub fn error_color(&self, error: [f32; 3]) -> [u8; 3] {
        self.false_color(error, STANDARD_ERROR_STOPS)
    }

    /// Returns the false color of the Rec. 709 luminance; a luminance of zero gets the first color.
    fn false_color(&self, [r, g, b]: [f32; 3], [first, last]: [f32; 2]) -> [u8; 3] {
        let stops = (0.2126 * r + 0.7152 * g + 0.0722 * b).log2() + self.view.exposure as f32;
        color(((stops - first) / (last - first) * 255.0 + 0.5) as u8) // `as` saturates and maps NaN to 0
    }
}

/// The scale of false colors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Legend {
    /// The luminance of the first and the last color, in stops.
    pub stops: [f64; 2],
    /// Evenly spaced colors.
    pub colors: Vec<[u8; 3]>,
}

impl Legend {
    /// Returns the scale of radiance for this exposure.
    pub fn of(exposure: f64) -> Legend {
        Legend::with_stops(RADIANCE_STOPS, exposure)
    }

    /// Returns the scale of standard errors for this exposure.
    pub fn of_errors(exposure: f64) -> Legend {
        Legend::with_stops(STANDARD_ERROR_STOPS, exposure)
    }

    fn with_stops(stops: [f32; 2], exposure: f64) -> Legend {
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
    fn false_colors_follow_the_stops() {
        let settings = |exposure| DisplaySettings {
            view: ViewSettings {
                exposure,
                ..ViewSettings::default()
            },
            false_color: true,
            ..DisplaySettings::default()
        };
        let grey = |stops: f32| [stops.exp2(); 3];
        let [first, last] = RADIANCE_STOPS;
        let Legend { stops, colors: legend } = Legend::of(3.0);
        assert_eq!(stops, [-13.0, 3.0]);
        for (i, expected) in legend.iter().enumerate() {
            let stops = first + (last - first) * i as f32 / 16.0;
            let shown = settings(0.0).color_bytes(grey(stops));
            assert!(
                shown.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= 2),
                "{stops}: {shown:?} {expected:?}"
            );
            assert_eq!(
                settings(3.0).color_bytes(grey(stops - 3.0)),
                settings(0.0).color_bytes(grey(stops))
            );
        }
        for (light, expected) in [
            (0.0, legend[0]),
            (-1.0, legend[0]),
            (f32::NAN, legend[0]),
            (f32::INFINITY, legend[16]),
        ] {
            assert_eq!(settings(0.0).color_bytes([light; 3]), expected, "{light}");
        }
        assert_ne!(
            settings(0.0).color_bytes(grey(0.0)),
            settings(0.0).color_bytes(grey(-3.0))
        );
        // Standard errors have their own scale.
        let Legend { stops, colors: legend } = Legend::of_errors(3.0);
        assert_eq!(stops, [-15.0, -3.0]);
        for (stops, expected) in [(-15.0, legend[0]), (-9.0, legend[8]), (-3.0, legend[16])] {
            let shown = settings(3.0).error_color(grey(stops));
            assert!(
                shown.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 2),
                "{stops}: {shown:?} {expected:?}"
            );
        }
    }

    #[test]
    fn overrides_replace_the_settings_of_the_scene() {
        let scene = ViewSettings {
            transform: ViewTransform::Agx,
            exposure: 2.0,
        };
        assert_eq!(DisplayOverrides::default().apply_to(scene), scene);
        let overrides = DisplayOverrides {
            exposure: Some(-1.0),
            ..DisplayOverrides::default()
        };
        assert_eq!(
            overrides.apply_to(scene),
            ViewSettings {
                exposure: -1.0,
                ..scene
            }
        );
        for stops in [100.5, -101.0, f64::NAN, f64::INFINITY] {
            let exposure = Some(stops);
            assert!(DisplayOverrides { exposure, ..overrides }.checked().is_err(), "{stops}");
        }
    }
}
