//! What the page and the terminal's file show of a render: pictures of several views, and the numbers behind a pixel.

use std::time::Duration;

use glam::{Vec3, Vec4};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::pack::{FirstHit, NOTHING};

/// What is shown of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// Radiance.
    #[default]
    Color,
    /// The first hit's normal.
    Normal,
    /// Its distance.
    Depth,
    /// Its texture coordinates.
    Uv,
    /// Which shape it is on.
    Primitive,
    /// How many samples a pixel has.
    Samples,
    /// Radiance by the GPU, by the CPU, and their difference.
    Compare,
}

impl View {
    /// Whether it shows the first hits rather than the film.
    pub fn shows_hits(self) -> bool {
        matches!(self, View::Normal | View::Depth | View::Uv | View::Primitive)
    }
}

/// Linear RGB of a rectangle of pixels, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// As many as columns times rows.
    pub pixels: Vec<Vec3>,
}

impl Linear {
    /// The means of a film's sums. Where it has no samples yet, `under` shows through, a smaller picture of the same.
    pub fn of_film(width: u32, height: u32, sums: &[Vec4], under: Option<&Linear>) -> Linear {
        let mean = |(i, sum): (usize, &Vec4)| {
            if sum.w > 0.0 {
                sum.truncate() / sum.w
            } else {
                under.map_or(Vec3::ZERO, |under| under.at_share(i as u32 % width, i as u32 / width, width, height))
            }
        };
        Linear { width, height, pixels: sums.par_iter().enumerate().map(mean).collect() }
    }

    /// The pixel that covers pixel (x, y) of the same picture in another size.
    fn at_share(&self, x: u32, y: u32, width: u32, height: u32) -> Vec3 {
        let scaled = |at: u32, of: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(of)) as usize;
        let i = scaled(y, height, self.height) * self.width as usize + scaled(x, width, self.width);
        self.pixels.get(i).copied().unwrap_or(Vec3::ZERO)
    }
}

/// The numbers of a frame.
#[derive(Clone, Debug)]
pub enum Content {
    /// [`View::Color`]
    Color(Linear),
    /// [`View::Samples`]: of how many there will be.
    Samples(Vec<u32>, u32),
    /// The views of the first hits.
    Hits(Vec<FirstHit>),
    /// [`View::Compare`]: GPU and CPU, where both have samples.
    Compare(Linear, Linear),
}

/// What is told about a frame beside its pictures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Header {
    /// Counts the changes of scene, shaders and camera: which of them the frame shows.
    pub revision: u64,
    /// What it shows.
    pub view: View,
    /// Width of the whole picture; that of a coarse frame's pixels is a fraction of it.
    pub width: u32,
    /// Height of the whole picture.
    pub height: u32,
    /// Width and height of what is sent.
    pub sent: [u32; 2],
    /// Samples that every pixel has.
    pub samples: u32,
    /// Samples that it will have.
    pub total: u32,
    /// Whether nothing will be added.
    pub done: bool,
    /// Samples of pixels per second.
    pub speed: Option<f64>,
    /// Seconds from the change to the first frame that shows it.
    pub latency: Option<f64>,
    /// What [`View::Compare`] found: pixels that differ in any bit, and the largest difference.
    pub differing: Option<(u64, f32)>,
    /// What the least and the greatest value of the picture stands for.
    pub range: Option<[f32; 2]>,
    /// Names and sizes in bytes of the pictures that follow.
    pub parts: Vec<(&'static str, usize)>,
}

/// A picture that the viewers get, as PNG files and as numbers.
#[derive(Clone, Debug)]
pub struct Frame {
    /// About it.
    pub header: Header,
    /// PNG files, one for each part of the header.
    pub pictures: Vec<Vec<u8>>,
    /// The numbers.
    pub content: Content,
    /// How names are given to what the numbers count.
    pub names: Names,
}

/// How shapes and materials are called in the scene file.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// How many shapes there are; lights follow them.
    pub shapes: u32,
    /// The materials' names.
    pub materials: Vec<String>,
}

/// A frame's header before its pictures are made.
pub struct About {
    /// See [`Header::revision`].
    pub revision: u64,
    /// See [`Header::view`].
    pub view: View,
    /// See [`Header::width`].
    pub size: [u32; 2],
    /// See [`Header::sent`].
    pub sent: [u32; 2],
    /// See [`Header::samples`].
    pub samples: u32,
    /// See [`Header::total`].
    pub total: u32,
    /// See [`Header::done`].
    pub done: bool,
    /// See [`Header::speed`].
    pub speed: Option<f64>,
    /// See [`Header::latency`].
    pub latency: Option<Duration>,
    /// The factor of the difference of [`View::Compare`].
    pub gain: f32,
}

impl Frame {
    /// Makes the pictures of `content`.
    pub fn new(about: About, content: Content, names: Names) -> Frame {
        let [width, height] = about.sent;
        let (mut differing, mut range) = (None, None);
        let pictures: Vec<(&'static str, Vec<u8>)> = match &content {
            Content::Color(linear) => vec![("picture", display_all(&linear.pixels))],
            Content::Samples(counts, total) => {
                let total = (*total).max(1) as f32;
                vec![("picture", bytes(counts, |n| [unit(*n as f32 / total); 3]))]
            }
            Content::Hits(hits) => {
                let span = depths(hits);
                range = (about.view == View::Depth).then_some([span.0, span.1]);
                vec![("picture", bytes(hits, |hit| hit_color(about.view, hit, span)))]
            }
            Content::Compare(gpu, cpu) => {
                let (count, largest, difference) = difference(&gpu.pixels, &cpu.pixels, about.gain);
                differing = Some((count, largest));
                vec![
                    ("gpu", display_all(&gpu.pixels)),
                    ("cpu", display_all(&cpu.pixels)),
                    ("difference", difference),
                ]
            }
        };
        let (names_of_parts, pictures): (Vec<_>, Vec<_>) =
            pictures.into_par_iter().map(|(name, rgb)| (name, png(width, height, &rgb))).unzip();
        let parts = names_of_parts.into_iter().zip(pictures.iter().map(Vec::len)).collect();
        let header = Header {
            revision: about.revision,
            view: about.view,
            width: about.size[0],
            height: about.size[1],
            sent: about.sent,
            samples: about.samples,
            total: about.total,
            done: about.done,
            speed: about.speed,
            latency: about.latency.map(|latency| latency.as_secs_f64()),
            differing,
            range,
            parts,
        };
        Frame { header, pictures, content, names }
    }

    /// What is known of a pixel of the whole picture, by name; `None` outside of it.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Vec<(&'static str, String)>> {
        let Header { width, height, sent, .. } = self.header;
        if x >= width || y >= height {
            return None;
        }
        let scaled = |at: u32, of: u32, to: u32| (u64::from(at) * u64::from(to) / u64::from(of)) as usize;
        let i = scaled(y, height, sent[1]) * sent[0] as usize + scaled(x, width, sent[0]);
        Some(match &self.content {
            Content::Color(linear) => vec![("linear RGB", numbers(linear.pixels.get(i)?.to_array()))],
            Content::Samples(counts, total) => vec![("samples", format!("{} of {total}", counts.get(i)?))],
            Content::Hits(hits) => self.hit(hits.get(i)?),
            Content::Compare(gpu, cpu) => {
                let (gpu, cpu) = (*gpu.pixels.get(i)?, *cpu.pixels.get(i)?);
                vec![
                    ("GPU", numbers(gpu.to_array())),
                    ("CPU", numbers(cpu.to_array())),
                    ("GPU - CPU", numbers((gpu - cpu).to_array())),
                ]
            }
        })
    }

    fn hit(&self, hit: &FirstHit) -> Vec<(&'static str, String)> {
        if hit.shape == NOTHING {
            return vec![("hit", "nothing".to_string())];
        }
        let shape = match hit.shape.checked_sub(self.names.shapes) {
            None => format!("shapes[{}]", hit.shape),
            Some(light) => format!("lights[{light}]"),
        };
        let mut known = match self.header.view {
            View::Normal => vec![("normal", numbers(hit.normal.to_array()))],
            View::Depth => vec![("depth", numbers([hit.depth]))],
            View::Uv => vec![("uv", numbers(hit.uv.to_array()))],
            _ => Vec::new(),
        };
        known.push(("on", shape));
        known.extend(self.names.materials.get(hit.material as usize).map(|name| ("material", name.clone())));
        known
    }
}

fn numbers<const N: usize>(values: [f32; N]) -> String {
    values.map(|v| format!("{v}")).join("  ")
}

/// The bytes of a value that is shown as it is.
fn unit(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The bytes of linear RGB on a screen.
fn display(linear: Vec3) -> [u8; 3] {
    linear.to_array().map(|v| unit(v.clamp(0.0, 1.0).powf(1.0 / 2.2)))
}

fn display_all(pixels: &[Vec3]) -> Vec<u8> {
    bytes(pixels, |v| display(*v))
}

fn bytes<T: Sync>(pixels: &[T], color: impl Fn(&T) -> [u8; 3] + Sync) -> Vec<u8> {
    pixels.par_iter().with_min_len(1024).flat_map_iter(&color).collect()
}

/// The least and the greatest distance of a hit.
fn depths(hits: &[FirstHit]) -> (f32, f32) {
    let depths = hits.iter().filter(|hit| hit.shape != NOTHING).map(|hit| hit.depth);
    depths.fold((f32::MAX, 0.0), |(low, high), depth| (depth.min(low), depth.max(high)))
}

fn hit_color(view: View, hit: &FirstHit, (near, far): (f32, f32)) -> [u8; 3] {
    if hit.shape == NOTHING {
        return [0; 3];
    }
    match view {
        View::Normal => hit.normal.to_array().map(|v| unit(0.5 * v + 0.5)),
        // Near is bright; what is farthest stays brighter than nothing.
        View::Depth => [unit(1.0 - 0.85 * (hit.depth - near) / (far - near).max(f32::MIN_POSITIVE)); 3],
        View::Uv => [unit(fraction(hit.uv.x)), unit(fraction(hit.uv.y)), 64],
        _ => hue(hit.shape),
    }
}

/// The part behind the point, but 1 for 1: an edge at which a texture ends.
fn fraction(v: f32) -> f32 {
    if v == 1.0 { 1.0 } else { v - v.floor() }
}

/// A colour for a number: hues that are a golden ratio apart, so that near numbers look different.
fn hue(number: u32) -> [u8; 3] {
    let h = (f64::from(number) * 0.618_033_988_749_895 + 0.06).fract() as f32 * 6.0;
    let (bright, dim) = if number % 2 == 0 { (0.92, 0.38) } else { (0.72, 0.2) };
    [0.0, 4.0, 2.0].map(|offset| {
        let share = (((h + offset) % 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        unit(dim + (bright - dim) * share)
    })
}

/// How many pixels differ in any bit, the largest difference of a channel, and a picture of the differences: `gain`
/// times as large, but never so small that they cannot be seen.
fn difference(gpu: &[Vec3], cpu: &[Vec3], gain: f32) -> (u64, f32, Vec<u8>) {
    const LEAST_VISIBLE: u8 = 48;
    let differ = |(a, b): &(&Vec3, &Vec3)| a.to_array().map(f32::to_bits) != b.to_array().map(f32::to_bits);
    let pairs = || gpu.par_iter().zip(cpu);
    let count = pairs().filter(differ).count() as u64;
    // A NaN is infinitely wrong: `max` would drop it.
    let largest = pairs().filter(differ).map(|(a, b)| (*a - *b).abs().to_array()).flatten_iter();
    let largest = largest.map(|d| if d.is_nan() { f32::INFINITY } else { d }).reduce(|| 0.0, f32::max);
    let color = |pair: (&Vec3, &Vec3)| {
        if !differ(&pair) {
            return [0; 3];
        }
        let bytes = ((*pair.0 - *pair.1).abs() * gain).to_array().map(|d| if d.is_nan() { 255 } else { unit(d) });
        if bytes.iter().all(|b| *b < LEAST_VISIBLE) { [LEAST_VISIBLE; 3] } else { bytes }
    };
    (count, largest, pairs().with_min_len(1024).flat_map_iter(color).collect())
}

/// A PNG file of 8-bit RGB, packed for speed.
pub fn png(width: u32, height: u32, rgb: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    // Writing to memory fails only if the sizes do not fit; the page then shows no picture, which the tests would see.
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(rgb));
    if let Err(error) = written {
        tracing::error!("a picture of {width} x {height} cannot be made: {error}");
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_difference_is_counted_and_seen() {
        let a = vec![Vec3::splat(0.5), Vec3::ZERO, Vec3::ONE, Vec3::ONE];
        let b = vec![Vec3::splat(0.5), -Vec3::ZERO, Vec3::new(1.0, 1.0 + f32::EPSILON, 1.0), Vec3::splat(f32::NAN)];
        let (count, largest, picture) = difference(&a, &b, 256.0);
        assert_eq!((count, largest), (3, f32::INFINITY));
        assert_eq!(picture, [0, 0, 0, 48, 48, 48, 48, 48, 48, 255, 255, 255]);
        let (count, largest, picture) = difference(&a[..1], &b[..1], 256.0);
        assert_eq!((count, largest, picture), (0, 0.0, vec![0; 3]));
        let (.., picture) = difference(&[Vec3::ZERO], &[Vec3::new(0.001, 0.0, 1.0)], 256.0);
        assert_eq!(picture, [65, 0, 255]);
    }

    #[test]
    fn a_coarse_picture_shows_where_the_film_is_empty() {
        let under = Linear { width: 1, height: 1, pixels: vec![Vec3::X] };
        let sums = [Vec4::ZERO, Vec4::new(0.0, 2.0, 4.0, 2.0)];
        let picture = Linear::of_film(2, 1, &sums, Some(&under));
        assert_eq!(picture.pixels, [Vec3::X, Vec3::new(0.0, 1.0, 2.0)]);
        assert_eq!(Linear::of_film(2, 1, &sums, None).pixels[0], Vec3::ZERO);
    }

    #[test]
    fn near_numbers_have_different_colors() {
        let colors: std::collections::HashSet<_> = (0..64).map(hue).collect();
        assert!(colors.len() >= 62, "{}", colors.len());
    }
}
