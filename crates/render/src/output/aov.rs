//! Arbitrary output variables (AOVs): first hits through pixel centers, means over samples, and statistics of samples.

use std::fmt;
use std::str::FromStr;

use glam::Vec3;

use super::{Band, Layout};
use wgray_scene::Integrator;
use wgray_trace::film::Layer;
use wgray_trace::records::{FirstHit, NO_INDEX};

/// An output variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Aov {
    /// Outward geometric normal.
    Normal,
    /// Outward shading normal of the first hit, without normal maps. With the path integrator: mean over samples, with
    /// normal maps; the mean is shorter than 1 where the samples differ.
    ShadingNormal,
    /// Distance along the ray.
    Depth,
    /// Texture coordinates.
    Uv,
    /// Index of the triangle in a mesh; otherwise index of the shape in the scene file.
    Primitive,
    /// Index of the shape in the scene file: `[[shapes]]`, then `[[instances]]`, then lights.
    Instance,
    /// Barycentric coordinates of a mesh triangle's second and third vertex.
    Barycentric,
    /// Albedo of the first surface on the path that is neither mirror nor glass, times the tints of the mirrors and
    /// glass surfaces in front of it.
    Albedo,
    /// Radiance scattered once.
    Direct,
    /// Radiance scattered more than once. Emission, direct and indirect add up to the image.
    Indirect,
    /// Unscattered radiance of emitters and the environment.
    Emission,
    /// Number of samples.
    SampleCount,
    /// Variance estimated by [`Film::variance`](wgray_trace::film::Film::variance).
    Variance,
    /// Denoised color ([`denoise`](crate::denoise)). Display formats show it in place of the image.
    Denoised,
}

impl fmt::Display for Aov {
    /// Writes the name.
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.pad(self.name())
    }
}

impl FromStr for Aov {
    type Err = String;

    /// Parses a name. The error lists the names.
    fn from_str(name: &str) -> Result<Aov, String> {
        let unknown = || {
            let names = Aov::ALL.map(Aov::name).join(", ");
            format!("{name:?} must be one of {names}")
        };
        Aov::ALL.into_iter().find(|aov| aov.name() == name).ok_or_else(unknown)
    }
}

/// Source of an output variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AovSource {
    /// First hit of the ray through the pixel's center.
    FirstHit,
    /// Mean over samples, weighted like the radiance. Only with the path integrator.
    Samples,
    /// Statistics of the samples, which adaptive sampling and films with noise estimates have.
    Statistics,
}

/// A channel of an AOV.
pub enum Channel {
    /// A float of the first hit.
    Float(&'static str, fn(&FirstHit) -> f32),
    /// An integer of the first hit.
    Integer(&'static str, fn(&FirstHit) -> u32),
    /// A component of a layer's mean.
    Mean(&'static str, Layer, usize),
    /// A component of the shading normal: of the mean if the film has layers, otherwise of the first hit.
    ShadingNormal(&'static str, usize),
    /// Number of samples.
    Count(&'static str),
    /// Variance of a color channel.
    Variance(&'static str, usize),
    /// A denoised color channel.
    Denoised(&'static str, usize),
}

/// Returns the channels of an AOV's layer in an EXR file.
pub fn channels_of(aov: Aov) -> &'static [Channel] {
    aov.row().channels
}

impl Channel {
    /// Returns the name in OpenEXR files.
    pub fn name(&self) -> &'static str {
        match self {
            Channel::Float(name, _) | Channel::Integer(name, _) | Channel::Count(name) => name,
            Channel::Mean(name, ..) | Channel::ShadingNormal(name, _) | Channel::Variance(name, _) => name,
            Channel::Denoised(name, _) => name,
        }
    }

    /// Returns true if the values are integers.
    pub fn is_whole(&self) -> bool {
        matches!(self, Channel::Integer(..) | Channel::Count(_))
    }

    /// Returns the bytes of a band's pixel `i`.
    pub fn bytes(&self, band: Band, i: usize) -> [u8; 4] {
        match self {
            Channel::Float(_, value) => value(&band.hits[i]).to_ne_bytes(),
            Channel::Integer(_, value) => value(&band.hits[i]).to_ne_bytes(),
            Channel::Mean(_, layer, component) => band.film.layer(*layer, i)[*component].to_ne_bytes(),
            Channel::ShadingNormal(_, component) if band.film.has_layers() => {
                band.film.layer(Layer::Normal, i)[*component].to_ne_bytes()
            }
            Channel::ShadingNormal(_, component) => band.hits[i].shading_normal[*component].to_ne_bytes(),
            Channel::Count(_) => band.film.sample_count(i).to_ne_bytes(),
            Channel::Variance(_, channel) => band.film.variance(i)[*channel].to_ne_bytes(),
            Channel::Denoised(_, channel) => band.film.color(i)[*channel].to_ne_bytes(),
        }
    }
}

struct Row {
    name: &'static str,
    source: AovSource,
    channels: &'static [Channel],
}

impl Aov {
    /// All output variables.
    pub const ALL: [Aov; 14] = [
        Aov::Normal,
        Aov::ShadingNormal,
        Aov::Depth,
        Aov::Uv,
        Aov::Primitive,
        Aov::Instance,
        Aov::Barycentric,
        Aov::Albedo,
        Aov::Direct,
        Aov::Indirect,
        Aov::Emission,
        Aov::SampleCount,
        Aov::Variance,
        Aov::Denoised,
    ];

    /// Returns the source with an integrator, which may not support the variable: see [`Aov::missing`].
    pub fn source(self, integrator: Integrator) -> AovSource {
        match self {
            Aov::ShadingNormal if integrator.has_layers() => AovSource::Samples,
            _ => self.row().source,
        }
    }

    /// Returns the reason why renders with the integrator cannot have the variable; `None` if they can.
    pub fn missing(self, integrator: Integrator) -> Option<&'static str> {
        match self.source(integrator) {
            AovSource::Samples if !integrator.has_layers() => Some("needs integrator = \"path\""),
            _ => None,
        }
    }

    /// Returns the film layer that contains the color of the variable, if any.
    pub fn light(self) -> Option<Layer> {
        channels_of(self).iter().find_map(|channel| match channel {
            Channel::Mean(_, layer, _) => Some(*layer),
            _ => None,
        })
    }

    /// Returns true if PNG output stores this variable in a file of its own. The denoised color replaces the color of
    /// the main file.
    pub fn has_file(self) -> bool {
        self != Aov::Denoised
    }

    /// Returns the name in options, files and layers.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Returns the names of the channels in an EXR file, such as `normal.X`.
    pub fn channel_names(self) -> impl Iterator<Item = &'static str> {
        channels_of(self).iter().map(Channel::name)
    }

    const fn row(self) -> Row {
        use AovSource::{FirstHit, Samples, Statistics};
        use Channel::{Count, Denoised, Float, Integer, Mean, ShadingNormal, Variance};
        const fn row(name: &'static str, source: AovSource, channels: &'static [Channel]) -> Row {
            Row { name, source, channels }
        }
        macro_rules! colors {
            ($name:literal, $layer:ident) => {
                row(
                    $name,
                    Samples,
                    &[
                        Mean(concat!($name, ".R"), Layer::$layer, 0),
                        Mean(concat!($name, ".G"), Layer::$layer, 1),
                        Mean(concat!($name, ".B"), Layer::$layer, 2),
                    ],
                )
            };
        }
        match self {
            Aov::Normal => row(
                "normal",
                FirstHit,
                &[
                    Float("normal.X", |hit| hit.normal.x),
                    Float("normal.Y", |hit| hit.normal.y),
                    Float("normal.Z", |hit| hit.normal.z),
                ],
            ),
            Aov::ShadingNormal => row(
                "shading_normal",
                FirstHit,
                &[
                    ShadingNormal("shading_normal.X", 0),
                    ShadingNormal("shading_normal.Y", 1),
                    ShadingNormal("shading_normal.Z", 2),
                ],
            ),
            Aov::Depth => row("depth", FirstHit, &[Float("depth.Z", |hit| hit.depth)]),
            Aov::Uv => row(
                "uv",
                FirstHit,
                &[Float("uv.U", |hit| hit.uv.x), Float("uv.V", |hit| hit.uv.y)],
            ),
            Aov::Primitive => row("primitive", FirstHit, &[Integer("primitive.ID", |hit| hit.primitive)]),
            Aov::Instance => row("instance", FirstHit, &[Integer("instance.ID", |hit| hit.shape)]),
            Aov::Barycentric => row(
                "barycentric",
                FirstHit,
                &[
                    Float("barycentric.U", |hit| hit.barycentric.x),
                    Float("barycentric.V", |hit| hit.barycentric.y),
                ],
            ),
            Aov::Albedo => colors!("albedo", Albedo),
            Aov::Direct => colors!("direct", Direct),
            Aov::Indirect => colors!("indirect", Indirect),
            Aov::Emission => colors!("emission", Emission),
            Aov::SampleCount => row("sample_count", Statistics, &[Count("sample_count.N")]),
            Aov::Variance => row(
                "variance",
                Statistics,
                &[
                    Variance("variance.R", 0),
                    Variance("variance.G", 1),
                    Variance("variance.B", 2),
                ],
            ),
            Aov::Denoised => row(
                "denoised",
                Statistics,
                &[
                    Denoised("denoised.R", 0),
                    Denoised("denoised.G", 1),
                    Denoised("denoised.B", 2),
                ],
            ),
        }
    }

    /// Returns the color of a band's pixel `i` in a PNG, before quantization; black if nothing is hit.
    ///
    /// - Albedo and radiance: linear, before the view transform.
    /// - Normals: mapped from [-1, 1] to [0, 1].
    /// - Depth d: `1 / (1 + (d / middle)^4)`.
    /// - Texture coordinates: fractional parts in red and green.
    /// - Indices: a color per index.
    /// - Sample counts: `log(count) / log(max)`.
    /// - Variance: standard error to the power 1/2.2.
    pub fn color(self, band: Band, i: usize, layout: &Layout) -> Vec3 {
        let film = band.film;
        if let Some(layer) = self.light() {
            return film.layer(layer, i).into();
        }
        match self {
            // Samples that hit nothing count as black.
            Aov::ShadingNormal if film.has_layers() => {
                Vec3::from(film.layer(Layer::Normal, i)) * 0.5 + 0.5 * film.alpha(i)
            }
            Aov::SampleCount => {
                let [count, max] = [band.film.sample_count(i), layout.max_samples].map(|n| n.max(1) as f32);
                Vec3::splat(count.ln() / max.max(2.0).ln())
            }
            Aov::Denoised => band.film.color(i).into(),
            Aov::Variance => Vec3::from(band.film.variance(i)).map(|v| v.sqrt().powf(1.0 / 2.2)),
            _ => self.color_of_hit(&band.hits[i], layout.middle_depth),
        }
    }

    /// Returns [`Aov::color`] of a first hit. Variables of other sources have the color of [`Aov::Instance`].
    pub fn color_of_hit(self, hit: &FirstHit, middle_depth: f32) -> Vec3 {
        if hit.shape == NO_INDEX {
            return Vec3::ZERO;
        }
        match self {
            Aov::Normal => hit.normal * 0.5 + 0.5,
            Aov::Depth => Vec3::splat(1.0 / (1.0 + (hit.depth / middle_depth).powi(4))),
            Aov::ShadingNormal => hit.shading_normal * 0.5 + 0.5,
            Aov::Uv => (hit.uv - hit.uv.floor()).extend(0.0),
            Aov::Barycentric => hit.barycentric.extend(1.0 - hit.barycentric.x - hit.barycentric.y),
            Aov::Primitive => index_color(hit.primitive),
            _ => index_color(hit.shape),
        }
    }
}

/// Returns a color for an index, never black: hues a golden section of the circle apart, so that consecutive indices
/// differ clearly, in three lightnesses.
fn index_color(index: u32) -> Vec3 {
    const GOLDEN_SECTION: u32 = 0x9e37_79b9; // of 2^32
    let hue = index.wrapping_mul(GOLDEN_SECTION) as f32 / u32::MAX as f32 * 6.0;
    let saturated = Vec3::new(
        (hue - 3.0).abs() - 1.0,
        2.0 - (hue - 2.0).abs(),
        2.0 - (hue - 4.0).abs(),
    );
    let lightness = [1.0, 0.6, 0.8][index as usize % 3];
    (saturated.clamp(Vec3::ZERO, Vec3::ONE) * 0.75 + 0.25) * lightness
}
