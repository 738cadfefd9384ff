//! Film layers as images: means over the samples of a pixel, and the variance of the mean.

use glam::Vec3;
use rayon::prelude::*;

use super::display_settings::DisplaySettings;
use super::pixel_values::{bits, bytes, film_values, numbers};
use wgray_image::{Pixels, to_8_bits};
use wgray_render::output::Aov;
use wgray_trace::film::{Film, Layer};

/// A film layer, as written by `wgray render --aov`.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmLayer {
    /// The kind of the layer.
    pub aov: Aov,
    /// Three values per pixel. The variance is 0 if there are fewer than two samples.
    pub values: Pixels,
    /// For normals: the fraction of each pixel's samples that hit a surface. Empty for other layers.
    pub hit_fractions: Vec<f32>,
}

impl FilmLayer {
    /// Returns a layer of a film. Rows without samples show `coarser`, a film of lower resolution.
    pub fn of(aov: Aov, film: &Film, coarser: Option<&Film>, has_samples: &(dyn Fn(u32) -> bool + Sync)) -> FilmLayer {
        let hit_fractions = match aov {
            Aov::ShadingNormal => film_values(film, coarser, has_samples, &Film::alpha),
            _ => Vec::new(),
        };
        FilmLayer {
            aov,
            values: Pixels {
                width: film.region.width(),
                height: film.region.height(),
                colors: film_values(film, coarser, has_samples, &|film, i| value(aov, film, i)),
            },
            hit_fractions,
        }
    }

    /// Returns true if the layer is a component of the image's radiance.
    pub fn is_light(&self) -> bool {
        matches!(self.aov, Aov::Direct | Aov::Indirect | Aov::Emission)
    }

    /// Returns true if the values may be negative.
    pub fn may_be_negative(&self) -> bool {
        self.aov == Aov::ShadingNormal
    }

    /// Returns the displayed bytes: radiance is displayed like the image, albedo with the display's curve only, and
    /// variance as standard error in false colors.
    pub fn bytes(&self, display: &DisplaySettings) -> Vec<u8> {
        let values = &self.values.colors;
        match self.aov {
            Aov::ShadingNormal => {
                let pairs: Vec<_> = values.iter().zip(&self.hit_fractions).collect();
                bytes(&pairs, |(normal, hit_fraction)| {
                    Vec3::from(**normal) * 0.5 + **hit_fraction * 0.5
                })
            }
            _ if self.is_light() => display.bytes(&self.values),
            _ => {
                let values = values.par_iter().with_min_len(1024);
                values
                    .flat_map_iter(|value| self.color_bytes(*value, display))
                    .collect()
            }
        }
    }

    fn color_bytes(&self, value: [f32; 3], display: &DisplaySettings) -> [u8; 3] {
        match self.aov {
            Aov::Variance => display.error_color(standard_error(value)),
            Aov::Albedo => display.view.display_reflectance(value).map(to_8_bits),
            _ => display.color_bytes(value),
        }
    }

    /// Returns the named values of pixel `i`.
    pub fn pixel(&self, i: usize, display: &DisplaySettings) -> Option<Vec<(&'static str, String)>> {
        let value = *self.values.colors.get(i)?;
        let name = match self.aov {
            Aov::ShadingNormal => "shading normal",
            aov => aov.name(),
        };
        let numbers_and_bits = [(name, numbers(value)), ("bits", bits(value))];
        let derived = match self.aov {
            Aov::ShadingNormal => None,
            Aov::Variance => Some(("standard error", numbers(standard_error(value)))),
            _ => Some((
                "shown",
                self.color_bytes(value, display).map(|byte| byte.to_string()).join(" "),
            )),
        };
        Some(numbers_and_bits.into_iter().chain(derived).collect())
    }
}

fn standard_error(variance: [f32; 3]) -> [f32; 3] {
    variance.map(f32::sqrt)
}

/// Returns the values of a pixel; 0 if the film does not contain the layer.
fn value(aov: Aov, film: &Film, i: usize) -> [f32; 3] {
    match aov {
        Aov::Variance => match film.moments.get(i).filter(|_| film.sample_count(i) >= 2) {
            Some(_) => film.variance(i),
            None => [0.0; 3], // a variance needs two samples
        },
        Aov::ShadingNormal => film.layer(Layer::Normal, i),
        aov => aov.light().map_or([0.0; 3], |layer| film.layer(layer, i)),
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;
    use wgray_image::Region;
    use wgray_trace::film::FilmLayout;

    fn film() -> Film {
        let film_layout = FilmLayout {
            adaptive: true,
            layers: true,
            noise: false,
        };
        let mut film = Film::of(Region::whole(1, 2), film_layout);
        film.sums.fill(Vec4::new(4.0, 8.0, 12.0, 4.0));
        film.moments = vec![Vec4::new(3.0, 12.0, 0.0, 4.0), Vec4::new(0.0, 0.0, 0.0, 1.0)];
        for (number, list) in (1u8..).zip(&mut film.layers) {
            list.fill(Vec4::new(f32::from(number), 0.0, -4.0, 2.0));
        }
        film
    }

    #[test]
    fn layers_have_their_own_values_and_variances_need_two_samples() {
        let has_samples = |_| true;
        for (aov, number) in [
            (Aov::Emission, 1.0),
            (Aov::Direct, 2.0),
            (Aov::Indirect, 3.0),
            (Aov::Albedo, 4.0),
            (Aov::ShadingNormal, 5.0),
        ] {
            let layer = FilmLayer::of(aov, &film(), None, &has_samples);
            assert_eq!(layer.values.colors, [[number / 4.0, 0.0, -1.0]; 2], "{aov:?}");
        }
        let normal = FilmLayer::of(Aov::ShadingNormal, &film(), None, &has_samples);
        assert_eq!(normal.hit_fractions, [0.5; 2]);
        // x: 1.25 / 2 + 0.5 / 2 = 0.875; y: 0.25; z: negative, clamped to 0.
        assert_eq!(normal.bytes(&DisplaySettings::default())[..3], [223, 64, 0]);
        let variance = FilmLayer::of(Aov::Variance, &film(), None, &has_samples);
        assert_eq!(variance.values.colors, [[0.25, 1.0, 0.0], [0.0; 3]]);
        let values = variance.pixel(0, &DisplaySettings::default()).unwrap();
        assert_eq!(values[2], ("standard error", "0.5  1  0".to_string()));
        assert_eq!(variance.pixel(2, &DisplaySettings::default()), None);
        let without_layers = Film::new(Region::whole(1, 2));
        for aov in [Aov::Variance, Aov::Direct] {
            assert_eq!(
                FilmLayer::of(aov, &without_layers, None, &has_samples).values.colors,
                [[0.0; 3]; 2],
                "{aov:?}"
            );
        }
    }

    #[test]
    fn the_exposure_affects_light_but_not_albedo() {
        let bytes = |aov, exposure: f64| {
            let mut display = DisplaySettings::default();
            display.view.exposure = exposure;
            FilmLayer::of(aov, &film(), None, &|_| true).bytes(&display)
        };
        for aov in [Aov::Emission, Aov::Direct, Aov::Indirect, Aov::Variance] {
            assert_ne!(bytes(aov, 0.0), bytes(aov, -3.0), "{aov:?}");
        }
        for aov in [Aov::Albedo, Aov::ShadingNormal] {
            assert_eq!(bytes(aov, 0.0), bytes(aov, -3.0), "{aov:?}");
        }
    }
}
