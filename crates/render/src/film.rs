//! The film: sums over the samples of each pixel, in linear f32.

use bytemuck::Zeroable;
use glam::{Vec3, Vec4, Vec4Swizzles};
use wgray_image::Region;

/// The optional lists of a film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilmLayout {
    /// Moments and pilot statistics.
    pub adaptive: bool,
    /// The sums of each [`Layer`].
    pub layers: bool,
}

impl FilmLayout {
    /// Returns the number of lists.
    pub fn lists(self) -> usize {
        let (adaptive, layers) = (usize::from(self.adaptive), usize::from(self.layers));
        1 + 2 * adaptive + Layer::ALL.len() * layers
    }

    /// Returns the number of bytes per pixel.
    pub fn bytes(self) -> usize {
        self.lists() * size_of::<Vec4>()
    }
}

/// A sum that the path integrator accumulates in addition to the radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Emitted radiance; a: sum of the weights of samples that hit anything.
    Emission,
    /// Radiance scattered once.
    Direct,
    /// Radiance scattered more than once.
    Indirect,
    /// Albedo of the first surface that is neither mirror nor glass, times the tints of the surfaces in front of it.
    Albedo,
    /// Outward shading normal.
    Normal,
}

impl Layer {
    /// All layers, in the order of a film's lists.
    pub const ALL: [Layer; 5] = [
        Layer::Emission,
        Layer::Direct,
        Layer::Indirect,
        Layer::Albedo,
        Layer::Normal,
    ];
}

/// Accumulated samples of a rectangle of pixels, in row-major order, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Region of the image that the film covers.
    pub region: Region,
    /// rgb: sum of weighted radiances; a: sum of weights.
    pub sums: Vec<Vec4>,
    /// rgb: summed squared deviations from the mean; a: number of samples. Empty without adaptive sampling.
    pub moments: Vec<Vec4>,
    /// Pilot statistics, which determine the sample counts of neighboring pixels. Empty without adaptive sampling.
    pub pilot_sums: Vec<Vec4>,
    /// Weighted sums of each [`Layer`]. Empty unless requested.
    pub layers: [Vec<Vec4>; Layer::ALL.len()],
}

impl Film {
    /// Returns an empty film without moments and layers.
    pub fn new(region: Region) -> Film {
        Film::of(region, FilmLayout::default())
    }

    /// Returns an empty film for adaptive sampling.
    pub fn adaptive(region: Region) -> Film {
        let film_layout = FilmLayout {
            adaptive: true,
            ..FilmLayout::default()
        };
        Film::of(region, film_layout)
    }

    /// Returns an empty film.
    pub fn of(region: Region, film_layout: FilmLayout) -> Film {
        let list = |exists: bool| match exists {
            true => vec![Vec4::zeroed(); region.pixels() as usize],
            false => Vec::new(),
        };
        Film {
            region,
            sums: list(true),
            moments: list(film_layout.adaptive),
            pilot_sums: list(film_layout.adaptive),
            layers: std::array::from_fn(|_| list(film_layout.layers)),
        }
    }

    /// Returns the layout; the default layout if the film has no pixels.
    pub fn film_layout(&self) -> FilmLayout {
        FilmLayout {
            adaptive: !self.moments.is_empty(),
            layers: self.has_layers(),
        }
    }

    /// Returns all lists, even empty ones: sums, moments, pilot statistics, layers.
    pub fn lists(&self) -> impl Iterator<Item = &Vec<Vec4>> {
        let Film {
            region: _,
            sums,
            moments,
            pilot_sums,
            layers,
        } = self;
        [sums, moments, pilot_sums].into_iter().chain(layers)
    }

    /// Returns [`Film::lists`] mutably.
    pub fn lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<Vec4>> {
        let Film {
            region: _,
            sums,
            moments,
            pilot_sums,
            layers,
        } = self;
        [sums, moments, pilot_sums].into_iter().chain(layers)
    }

    /// Returns the part of the film in a region, which must lie inside the film.
    pub fn part(self, region: Region) -> Film {
        if region == self.region {
            return self;
        }
        let width = self.region.width() as usize;
        let columns = (region.x0 - self.region.x0) as usize..(region.x1 - self.region.x0) as usize;
        let rows = (region.y0 - self.region.y0) as usize..(region.y1 - self.region.y0) as usize;
        let crop = |records: &[Vec4]| {
            let rows = records.chunks(width.max(1)).take(rows.end).skip(rows.start);
            rows.flat_map(|row| row[columns.clone()].to_vec()).collect()
        };
        Film {
            region,
            sums: crop(&self.sums),
            moments: crop(&self.moments),
            pilot_sums: crop(&self.pilot_sums),
            layers: self.layers.each_ref().map(|list| crop(list)),
        }
    }

    /// Returns a pixel's number of samples. Requires adaptive sampling.
    pub fn sample_count(&self, pixel: usize) -> u32 {
        self.moments[pixel].w as u32
    }

    /// Returns [`Film::sample_count`] of all pixels.
    pub fn sample_counts(&self) -> impl Iterator<Item = u32> {
        (0..self.moments.len()).map(|pixel| self.sample_count(pixel))
    }

    /// Returns the estimated variance of a pixel's mean per channel. Requires adaptive sampling. The estimate assumes
    /// independent samples; for stratified patterns it is, on average, an upper bound. The estimate
    /// is not biased by the choice of sample counts, which depends on the variance of a pixel's neighbors only.
    pub fn variance(&self, pixel: usize) -> [f32; 3] {
        variance_of_mean(self.sums[pixel], self.moments[pixel]).to_array()
    }

    /// Returns true if the film has pixels with layers.
    pub fn has_layers(&self) -> bool {
        self.layers.iter().all(|list| !list.is_empty())
    }

    /// Returns a layer's mean over a pixel's samples; 0 if the pixel has no samples or the film has no layers.
    pub fn layer(&self, layer: Layer, pixel: usize) -> [f32; 3] {
        let sum = self.layers[layer as usize].get(pixel).copied().unwrap_or_default();
        mean(sum.xyz().extend(self.sums[pixel].w))
    }

    /// Returns the fraction of a pixel's samples that hit anything; 0 if the pixel has no samples, 1 if the film has no
    /// layers. With filters that have negative weights, the fraction can be negative or greater than 1.
    pub fn alpha(&self, pixel: usize) -> f32 {
        let weight = self.sums[pixel].w;
        match self.layers[Layer::Emission as usize].get(pixel) {
            None => 1.0,
            Some(_) if weight == 0.0 => 0.0,
            Some(sum) => sum.w / weight,
        }
    }

    /// Returns all pixels' means in linear RGB.
    pub fn means(&self) -> impl Iterator<Item = [f32; 3]> {
        self.sums.iter().copied().map(mean)
    }
}

/// Returns the variance of a pixel's mean per channel, for independent samples.
pub fn variance_of_mean(sum: Vec4, moments: Vec4) -> Vec3 {
    let n = moments.w;
    let scale = n / ((n - 1.0) * sum.w * sum.w);
    moments.xyz() * scale
}

/// Returns a pixel's mean in linear RGB; black if the pixel has no samples.
pub fn mean(sum: Vec4) -> [f32; 3] {
    if sum.w == 0.0 {
        [0.0; 3]
    } else {
        [sum.x / sum.w, sum.y / sum.w, sum.z / sum.w]
    }
}
