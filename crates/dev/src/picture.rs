//! Frames: the images of a view for the page and for `--out`, and the values of each pixel.

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::bad_pixels::{BadPixel, BadPixels, faults, mark};
use super::display_settings::{DisplaySettings, Legend};
use super::film_layer::FilmLayer;
use super::histogram::Histogram;
use super::pixel_values::{ScaledImage, bits, bytes, numbers};
use wgray_image::{Pixels, difference};
use wgray_render::output::{self as image, Aov, AovSource};
use wgray_scene::Integrator;
use wgray_trace::records::{FirstHit, NO_INDEX};

/// The view that is selected on the page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// Radiance.
    #[default]
    Color,
    /// The normal of the first hit.
    Normal,
    /// The shading normal of the first hit; with the integrator `path`, its mean over the samples.
    ShadingNormal,
    /// The distance of the first hit.
    Depth,
    /// The texture coordinates of the first hit.
    Uv,
    /// The index of the shape or triangle of the first hit.
    Primitive,
    /// The index of the shape of the first hit.
    Instance,
    /// The barycentric coordinates of the first hit in its triangle.
    Barycentric,
    /// The fraction of light that the first surface reflects.
    Albedo,
    /// The radiance after exactly one reflection.
    Direct,
    /// Radiance scattered more than once.
    Indirect,
    /// The radiance without reflections.
    Emission,
    /// The variance of a pixel's mean.
    Variance,
    /// The denoised image.
    Denoised,
    /// The number of samples of a pixel.
    Samples,
    /// Radiance, a second image, and their difference.
    Compare(Against),
}

/// The image that radiance is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Against {
    /// The image that the CPU renders.
    Cpu,
    /// The image from before the last saved change of the scene or the shaders.
    Before,
    /// The reference: an image that was kept, or a file that a viewer uploaded.
    Reference,
}

impl View {
    /// The views that are layers of `wgray render --aov`.
    pub const LAYERS: [View; 13] = [
        View::Normal,
        View::ShadingNormal,
        View::Depth,
        View::Uv,
        View::Primitive,
        View::Instance,
        View::Barycentric,
        View::Albedo,
        View::Direct,
        View::Indirect,
        View::Emission,
        View::Variance,
        View::Denoised,
    ];

    /// Returns the first-hit layer that the view shows, if any.
    pub fn hit_layer(self, integrator: Integrator) -> Option<Aov> {
        self.aov().filter(|aov| aov.source(integrator) == AovSource::FirstHit)
    }

    /// Returns the film layer that the view shows, if any. The denoised image is not a layer of the film.
    pub fn film_layer(self, integrator: Integrator) -> Option<Aov> {
        let aov = self.aov().filter(|_| self != View::Denoised);
        aov.filter(|aov| aov.source(integrator) != AovSource::FirstHit)
    }

    /// Returns the layer of `wgray render --aov` that the view shows, if any.
    pub fn aov(self) -> Option<Aov> {
        match self {
            View::Normal => Some(Aov::Normal),
            View::ShadingNormal => Some(Aov::ShadingNormal),
            View::Depth => Some(Aov::Depth),
            View::Uv => Some(Aov::Uv),
            View::Primitive => Some(Aov::Primitive),
            View::Instance => Some(Aov::Instance),
            View::Barycentric => Some(Aov::Barycentric),
            View::Albedo => Some(Aov::Albedo),
            View::Direct => Some(Aov::Direct),
            View::Indirect => Some(Aov::Indirect),
            View::Emission => Some(Aov::Emission),
            View::Variance => Some(Aov::Variance),
            View::Denoised => Some(Aov::Denoised),
            View::Color | View::Samples | View::Compare(_) => None,
        }
    }

    /// Returns true if both the GPU and the CPU render this view.
    pub fn is_rendered_twice(self) -> bool {
        self == View::Compare(Against::Cpu)
    }
}

/// The values of a frame.
#[derive(Clone, Debug)]
pub enum Content {
    /// [`View::Color`] and [`View::Denoised`]: the linear colors.
    Color(Pixels),
    /// [`View::Samples`]: the sample counts, and the final number of samples.
    Samples(Vec<u32>, u32),
    /// A view of first hits: the layer, and the first hit of each pixel.
    Hits(Aov, Vec<FirstHit>),
    /// [`View::Compare`]: the image, and a second image of the same size.
    Compare(Pixels, Pixels),
    /// A view of a film layer.
    Film(FilmLayer),
}

impl Content {
    /// Returns the displayed bytes of first hits and sample counts; empty for other content.
    pub(super) fn plain_bytes(&self, [width, height]: [u32; 2]) -> Vec<u8> {
        match self {
            Content::Samples(counts, total) => bytes(counts, |n| Vec3::splat(*n as f32 / (*total).max(1) as f32)),
            Content::Hits(aov, hits) => {
                let middle = hits.get((height / 2 * width + width / 2) as usize);
                let middle_depth = middle.filter(|hit| hit.shape != NO_INDEX).map_or(1.0, |hit| hit.depth);
                bytes(hits, |hit| aov.color_of_hit(hit, middle_depth))
            }
            Content::Color(_) | Content::Compare(..) | Content::Film(_) => Vec::new(),
        }
    }
}

/// The metadata and statistics of a frame, sent before the images.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Header {
    /// The number of the frame.
    pub number: u64,
    /// Number of changes of the image up to this frame, for example of the scene, the camera or the view.
    pub revision: u64,
    /// The view.
    pub view: View,
    /// Width of the full-size image; a coarse frame has fewer pixels.
    pub width: u32,
    /// Height of the full-size image.
    pub height: u32,
    /// Width and height of the transmitted images.
    pub sent: [u32; 2],
    /// Width and height of the finished image; less than the full size for a scaled preview, or if the full size is too
    /// large to display.
    pub finest: [u32; 2],
    /// Current number of samples per pixel.
    pub samples: u32,
    /// Final number of samples per pixel.
    pub total: u32,
    /// True if the image is finished.
    pub done: bool,
    /// True if the frame shows first hits, with one ray per pixel.
    pub first_hits: bool,
    /// Samples per second.
    pub speed: Option<f64>,
    /// Seconds from the last change to its first frame.
    pub latency: Option<f64>,
    /// With [`View::Compare`], the number of pixels that differ in any bit, and the largest difference.
    pub differing: Option<(usize, f32)>,
    /// The names of the two images of [`View::Compare`].
    pub sides: Option<[String; 2]>,
    /// The histogram of a color image.
    pub histogram: Option<Histogram>,
    /// The scale of false colors, if they are shown.
    pub legend: Option<Legend>,
    /// The invalid pixels of each image whose view can have invalid pixels.
    pub faults: Vec<(&'static str, BadPixels)>,
    /// Names and sizes in bytes of the images that follow.
    pub parts: Vec<(&'static str, usize)>,
}

/// The images of a view, as PNG files and as values.
#[derive(Clone, Debug)]
pub struct Frame {
    /// The metadata and statistics of the images.
    pub header: Header,
    /// PNG files, one for each entry of [`Header::parts`].
    pub pictures: Vec<Vec<u8>>,
    /// The pixel values of the images.
    pub content: Content,
    /// The shapes and materials that the values refer to by index.
    pub names: Names,
    /// The display settings.
    pub display: DisplaySettings,
}

/// The numbers of shapes and instances and the names of materials, to name what a pixel shows.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// Number of shapes; the indices of mesh instances follow.
    pub shapes: u32,
    /// Number of mesh instances; the indices of lights follow.
    pub instances: u32,
    pub materials: Vec<String>,
}

impl Frame {
    /// Encodes the images of `content` and completes the header.
    pub fn new(mut header: Header, content: Content, names: Names, display: DisplaySettings) -> Frame {
        let [width, height] = header.sent;
        let mut counts = Vec::new();
        let mut mark_and_count = |name, mut rgb: Vec<u8>, faults: Vec<Option<BadPixel>>| {
            if display.marks {
                mark(&mut rgb, &faults);
            }
            counts.push((name, BadPixels::count(&faults, width)));
            (name, rgb)
        };
        let color_faults = |pixels: &Pixels| faults(&pixels.colors, display.allow_negative, |color| *color);
        let pictures: Vec<(&'static str, Vec<u8>)> = match &content {
            Content::Color(colors) => vec![mark_and_count("picture", display.bytes(colors), color_faults(colors))],
            Content::Film(layer) => {
                let allow_negative = display.allow_negative || layer.may_be_negative();
                let faults = faults(&layer.values.colors, allow_negative, |color| *color);
                vec![mark_and_count("picture", layer.bytes(&display), faults)]
            }
            Content::Samples(..) => vec![("picture", content.plain_bytes(header.sent))],
            Content::Hits(aov, hits) => {
                // Normals and texture coordinates may be negative.
                let values = |hit: &FirstHit| match aov {
                    Aov::Normal => hit.normal.into(),
                    Aov::ShadingNormal => hit.shading_normal.into(),
                    Aov::Depth => [hit.depth, 0.0, 0.0],
                    Aov::Uv => [hit.uv.x, hit.uv.y, 0.0],
                    Aov::Barycentric => [hit.barycentric.x, hit.barycentric.y, 0.0],
                    _ => [0.0; 3],
                };
                vec![mark_and_count(
                    "picture",
                    content.plain_bytes(header.sent),
                    faults(hits, true, values),
                )]
            }
            Content::Compare(first, second) => {
                header.differing = difference(first, second, 0.0).map(|result| (result.unequal, result.largest));
                vec![
                    mark_and_count("first", display.bytes(first), color_faults(first)),
                    mark_and_count("second", display.bytes(second), color_faults(second)),
                    ("difference", amplified(first, second, display.gain)),
                ]
            }
        };
        header.faults = counts;
        header.first_hits = matches!(content, Content::Hits(..));
        let exposure = display.view.exposure;
        header.histogram = match &content {
            Content::Color(pixels) | Content::Compare(pixels, _) => Some(Histogram::of(&pixels.colors, exposure)),
            Content::Film(layer) if layer.is_light() => Some(Histogram::of(&layer.values.colors, exposure)),
            Content::Samples(..) | Content::Hits(..) | Content::Film(_) => None,
        };
        header.legend = match &content {
            Content::Film(layer) if layer.aov == Aov::Variance => Some(Legend::of_errors(exposure)),
            _ if display.false_color && header.histogram.is_some() => Some(Legend::of(exposure)),
            _ => None,
        };
        let (parts, pictures): (Vec<_>, Vec<_>) = pictures
            .into_par_iter()
            .map(|(name, rgb)| {
                let file = png(width, height, &rgb);
                ((name, file.len()), file)
            })
            .unzip();
        header.parts = parts;
        Frame {
            header,
            pictures,
            content,
            names,
            display,
        }
    }

    /// Returns the named values of a pixel of the full-size image; `None` outside of the image.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Vec<(&'static str, String)>> {
        let Header {
            width, height, sent, ..
        } = self.header;
        let i = ScaledImage {
            from: [width, height],
            to: sent,
        }
        .index(x, y)?;
        Some(match &self.content {
            Content::Color(pixels) => {
                let color = *pixels.colors.get(i)?;
                let shown = self.display.color_bytes(color).map(|byte| byte.to_string()).join(" ");
                vec![("linear RGB", numbers(color)), ("bits", bits(color)), ("shown", shown)]
            }
            Content::Film(layer) => layer.pixel(i, &self.display)?,
            Content::Samples(counts, total) => vec![("samples", format!("{} of {total}", counts.get(i)?))],
            Content::Hits(aov, hits) => self.hit(*aov, hits.get(i)?),
            Content::Compare(first, second) => {
                let (first, second) = (*first.colors.get(i)?, *second.colors.get(i)?);
                let difference = Vec3::from(first) - Vec3::from(second);
                vec![
                    ("first", numbers(first)),
                    ("bits", bits(first)),
                    ("second", numbers(second)),
                    ("bits", bits(second)),
                    ("difference", numbers(difference.into())),
                ]
            }
        })
    }

    fn hit(&self, aov: Aov, hit: &FirstHit) -> Vec<(&'static str, String)> {
        if hit.shape == NO_INDEX {
            return vec![("hit", "nothing".to_string())];
        }
        let Names { shapes, instances, .. } = self.names;
        let shape = match (hit.shape.checked_sub(shapes), hit.shape.checked_sub(shapes + instances)) {
            (None, _) => format!("shapes[{}]", hit.shape),
            (Some(instance), None) => format!("instances[{instance}]"),
            (_, Some(light)) => format!("lights[{light}]"),
        };
        let mut values = match aov {
            Aov::Normal => value_and_bits("normal", hit.normal.into()),
            Aov::ShadingNormal => value_and_bits("shading normal", hit.shading_normal.into()),
            Aov::Depth => value_and_bits("depth", [hit.depth]),
            Aov::Barycentric => value_and_bits("barycentric", hit.barycentric.into()),
            Aov::Primitive if hit.primitive != hit.shape => vec![("triangle", hit.primitive.to_string())],
            Aov::Uv => value_and_bits("uv", hit.uv.into()),
            _ => Vec::new(),
        };
        values.push(("on", shape));
        values.extend(
            self.names
                .materials
                .get(hit.material as usize)
                .map(|name| ("material", name.clone())),
        );
        values
    }
}

fn value_and_bits<const N: usize>(name: &'static str, values: [f32; N]) -> Vec<(&'static str, String)> {
    vec![(name, numbers(values)), ("bits", bits(values))]
}

/// Returns the differences multiplied by `gain`, as RGB bytes. Small differences are raised to a visible minimum.
fn amplified(first: &Pixels, second: &Pixels, gain: f32) -> Vec<u8> {
    const MIN_DIFFERENCE: f32 = 0.2;
    let pairs: Vec<_> = first
        .colors
        .iter()
        .copied()
        .zip(second.colors.iter().copied())
        .collect();
    bytes(&pairs, |(first, second)| {
        if first.map(f32::to_bits) == second.map(f32::to_bits) {
            return Vec3::ZERO;
        }
        let difference = (Vec3::from(*first) - Vec3::from(*second)).abs() * gain;
        // NaN counts as the largest difference.
        let difference = Vec3::select(difference.is_nan_mask(), Vec3::ONE, difference);
        if difference.max_element() < MIN_DIFFERENCE {
            Vec3::splat(MIN_DIFFERENCE)
        } else {
            difference
        }
    })
}

/// Encodes radiance as PNG.
pub(super) fn png_of(pixels: &Pixels, display: DisplaySettings) -> Vec<u8> {
    png(pixels.width, pixels.height, &display.bytes(pixels))
}

/// Encodes 8-bit RGB as PNG with fast compression.
pub(super) fn png(width: u32, height: u32, rgb: &[u8]) -> Vec<u8> {
    // Encoding to memory fails only if the sizes do not match; the page then shows no image.
    image::in_memory(width, height, rgb).unwrap_or_else(|error| {
        tracing::error!("cannot encode an image of {width} x {height} pixels: {error}");
        Vec::new()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(colors: &[[f32; 3]]) -> Pixels {
        Pixels {
            width: colors.len() as u32,
            height: 1,
            colors: colors.to_vec(),
        }
    }

    #[test]
    fn every_difference_is_visible() {
        let first = pixels(&[[0.5; 3], [0.0; 3], [1.0; 3], [1.0; 3], [0.0; 3]]);
        let second = pixels(&[
            [0.5; 3],
            [-0.0; 3],
            [1.0, 1.0 + f32::EPSILON, 1.0],
            [f32::NAN; 3],
            [0.001, 0.0, 1.0],
        ]);
        assert_eq!(
            amplified(&first, &second, 256.0),
            [0, 0, 0, 51, 51, 51, 51, 51, 51, 255, 255, 255, 65, 0, 255]
        );
        assert_eq!(amplified(&first, &first, 256.0), [0; 15]);
    }
}
