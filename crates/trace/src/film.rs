//! The film: sums over the samples of each pixel, in linear f32.

use std::ops::Range;

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
    /// Half sums and moments, for estimates of the noise.
    pub noise: bool,
}

impl FilmLayout {
    /// Returns the number of lists.
    pub fn lists(self) -> usize {
        let count = |lists: usize, exist: bool| if exist { lists } else { 0 };
        1 + count(1, self.has_moments())
            + count(1, self.adaptive)
            + count(Layer::ALL.len(), self.layers)
            + count(1, self.noise)
            + count(2, self.has_layer_moments())
    }

    /// Returns true if the film has moments of the radiance.
    pub fn has_moments(self) -> bool {
        self.adaptive || self.noise
    }

    /// Returns true if the film has moments of albedo, normal and depth.
    pub fn has_layer_moments(self) -> bool {
        self.layers && self.noise
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
    /// Outward shading normal; a: sum of the weighted distances to the first hits if the film has noise estimates, else 0.
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
    /// rgb: summed squared deviations from the mean; a: number of samples. Empty without adaptive sampling and noise
    /// estimates.
    pub moments: Vec<Vec4>,
    /// Pilot statistics, which determine the sample counts of neighboring pixels. Empty without adaptive sampling.
    pub pilot_sums: Vec<Vec4>,
    /// Weighted sums of each [`Layer`]. Empty unless requested.
    pub layers: [Vec<Vec4>; Layer::ALL.len()],
    /// Like `sums`, over the [`Half::First`] of the samples. Empty without noise estimates.
    pub half_sums: Vec<Vec4>,
    /// rgb: summed squared deviations of the albedo from its mean. Empty unless the film has noise estimates and
    /// layers.
    pub albedo_moments: Vec<Vec4>,
    /// xyz: summed squared deviations of the normal from its mean; w: of the depth. Empty unless the film has noise
    /// estimates and layers.
    pub normal_moments: Vec<Vec4>,
    /// Denoised colors of a finished film in linear RGB, which are not accumulated and not one of the [`Film::lists`].
    /// Empty unless the film has been denoised.
    pub denoised: Vec<Vec3>,
}

/// A part of a pixel's samples: half of them if their number is a power of two. Aligned runs of 2^k points of a Sobol'
/// sequence are stratified, but points of even index are not, because the order of the points is scrambled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// The first 2^k samples, where 2^k is the largest power of two below their number.
    First,
    /// The samples after those.
    Second,
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
            moments: list(film_layout.has_moments()),
            pilot_sums: list(film_layout.adaptive),
            layers: std::array::from_fn(|_| list(film_layout.layers)),
            half_sums: list(film_layout.noise),
            albedo_moments: list(film_layout.has_layer_moments()),
            normal_moments: list(film_layout.has_layer_moments()),
            denoised: Vec::new(),
        }
    }

    /// Returns the layout; the default layout if the film has no pixels.
    pub fn film_layout(&self) -> FilmLayout {
        FilmLayout {
            adaptive: !self.pilot_sums.is_empty(),
            layers: self.has_layers(),
            noise: self.has_noise(),
        }
    }

    /// Returns all lists, even empty ones: sums, moments, pilot statistics, layers, half sums, and the moments of albedo
    /// and normal.
    pub fn lists(&self) -> impl Iterator<Item = &Vec<Vec4>> {
        let Film {
            region: _,
            sums,
            moments,
            pilot_sums,
            layers,
            half_sums,
            albedo_moments,
            normal_moments,
            denoised: _,
        } = self;
        let first = [sums, moments, pilot_sums].into_iter();
        first.chain(layers).chain([half_sums, albedo_moments, normal_moments])
    }

    /// Returns [`Film::lists`] mutably.
    pub fn lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<Vec4>> {
        let Film {
            region: _,
            sums,
            moments,
            pilot_sums,
            layers,
            half_sums,
            albedo_moments,
            normal_moments,
            denoised: _,
        } = self;
        let first = [sums, moments, pilot_sums].into_iter();
        first.chain(layers).chain([half_sums, albedo_moments, normal_moments])
    }

    /// Returns the part of the film in a region, which must lie inside the film.
    pub fn part(self, region: Region) -> Film {
        if region == self.region {
            return self;
        }
        let width = self.region.width() as usize;
        let columns = (region.x0 - self.region.x0) as usize..(region.x1 - self.region.x0) as usize;
        let rows = (region.y0 - self.region.y0) as usize..(region.y1 - self.region.y0) as usize;
        fn crop<T: Copy>(records: &[T], width: usize, rows: &Range<usize>, columns: &Range<usize>) -> Vec<T> {
            let rows = records.chunks(width.max(1)).take(rows.end).skip(rows.start);
            rows.flat_map(|row| row[columns.clone()].to_vec()).collect()
        }
        let denoised = crop(&self.denoised, width, &rows, &columns);
        let crop = |records: &[Vec4]| crop(records, width, &rows, &columns);
        Film {
            region,
            sums: crop(&self.sums),
            moments: crop(&self.moments),
            pilot_sums: crop(&self.pilot_sums),
            layers: self.layers.each_ref().map(|list| crop(list)),
            half_sums: crop(&self.half_sums),
            albedo_moments: crop(&self.albedo_moments),
            normal_moments: crop(&self.normal_moments),
            denoised,
        }
    }

    /// Copies the rows of a band, which must have the columns of this film and lie inside the film. Lists that this film
    /// lacks are ignored.
    pub fn copy_rows(&mut self, band: &Film) {
        let start = (band.region.y0 - self.region.y0) as usize * self.region.width() as usize;
        for (to, from) in self.lists_mut().zip(band.lists()) {
            if let Some(to) = to.get_mut(start..start + from.len()) {
                to.copy_from_slice(from);
            }
        }
    }

    /// Returns a pixel's number of samples. Requires adaptive sampling or noise estimates.
    pub fn sample_count(&self, pixel: usize) -> u32 {
        self.moments[pixel].w as u32
    }

    /// Returns [`Film::sample_count`] of all pixels.
    pub fn sample_counts(&self) -> impl Iterator<Item = u32> {
        (0..self.moments.len()).map(|pixel| self.sample_count(pixel))
    }

    /// Returns the estimated variance of a pixel's mean per channel. Requires adaptive sampling or noise estimates.
    /// Infinite if the pixel has fewer than two samples, whose variance is unknown, or a value that is not a number.
    ///
    /// The estimate is unbiased for independent samples of equal weights. Stratified patterns have less noise than
    /// independent samples, so that the estimate is, on average, an upper bound. The choice of sample counts does not bias
    /// the estimate, because it depends on the variance of a pixel's neighbors only.
    pub fn variance(&self, pixel: usize) -> [f32; 3] {
        self.variance_of(self.moments[pixel], pixel).truncate().to_array()
    }

    /// Returns true if the film has pixels with noise estimates.
    pub fn has_noise(&self) -> bool {
        !self.half_sums.is_empty()
    }

    /// Returns the mean over a half of a pixel's samples; black if the half has no samples. Requires noise estimates.
    pub fn half_mean(&self, half: Half, pixel: usize) -> [f32; 3] {
        let first = self.half_sums[pixel];
        mean(match half {
            Half::First => first,
            Half::Second => self.sums[pixel] - first,
        })
    }

    /// Returns the mean distance along the camera ray to the first hit; samples that hit nothing count as 0. Requires
    /// noise estimates and layers.
    pub fn depth(&self, pixel: usize) -> f32 {
        let sum = self.layers[Layer::Normal as usize][pixel];
        mean(Vec4::new(sum.w, 0.0, 0.0, self.sums[pixel].w))[0]
    }

    /// Returns the variance of [`Layer::Albedo`] like [`Film::variance`]. Requires noise estimates and layers.
    pub fn albedo_variance(&self, pixel: usize) -> [f32; 3] {
        self.variance_of(self.albedo_moments[pixel], pixel)
            .truncate()
            .to_array()
    }

    /// Returns the variance of [`Layer::Normal`] like [`Film::variance`]. Requires noise estimates and layers.
    pub fn normal_variance(&self, pixel: usize) -> [f32; 3] {
        self.variance_of(self.normal_moments[pixel], pixel)
            .truncate()
            .to_array()
    }

    /// Returns the variance of [`Film::depth`] like [`Film::variance`]. Requires noise estimates and layers.
    pub fn depth_variance(&self, pixel: usize) -> f32 {
        self.variance_of(self.normal_moments[pixel], pixel).w
    }

    fn variance_of(&self, deviations: Vec4, pixel: usize) -> Vec4 {
        let count = self.moments[pixel].w;
        let variance = deviations * variance_scale(self.sums[pixel], count);
        match count >= 2.0 {
            true => Vec4::select(variance.cmpge(Vec4::ZERO), variance, Vec4::INFINITY),
            false => Vec4::INFINITY,
        }
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

    /// Returns the color that is displayed, in linear RGB: the denoised color, or the mean of a film that is not denoised.
    pub fn color(&self, pixel: usize) -> [f32; 3] {
        match self.denoised.get(pixel) {
            Some(color) => color.to_array(),
            None => mean(self.sums[pixel]),
        }
    }

    /// Returns all pixels' means in linear RGB.
    pub fn means(&self) -> impl Iterator<Item = [f32; 3]> {
        self.sums.iter().copied().map(mean)
    }
}

/// Returns the variance of a pixel's mean per channel, for independent samples.
pub fn variance_of_mean(sum: Vec4, moments: Vec4) -> Vec3 {
    moments.xyz() * variance_scale(sum, moments.w)
}

/// Returns the variance of the mean of `n` samples per unit of summed squared deviations.
fn variance_scale(sum: Vec4, n: f32) -> f32 {
    n / ((n - 1.0) * sum.w * sum.w)
}

/// Returns a pixel's mean in linear RGB; black if the pixel has no samples.
pub fn mean(sum: Vec4) -> [f32; 3] {
    if sum.w == 0.0 {
        [0.0; 3]
    } else {
        [sum.x / sum.w, sum.y / sum.w, sum.z / sum.w]
    }
}
