//! The film: what a render accumulates, in linear f32.

use bytemuck::Zeroable;
use glam::{Vec3, Vec4, Vec4Swizzles};
use wgray_image::Region;

/// What a film has beside its sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Form {
    /// Moments and looks, for adaptive sampling.
    pub adaptive: bool,
    /// The layers.
    pub layers: bool,
}

impl Form {
    /// How many lists of pixels such a film has.
    pub fn lists(self) -> usize {
        let (adaptive, layers) = (usize::from(self.adaptive), usize::from(self.layers));
        1 + 2 * adaptive + Layer::ALL.len() * layers
    }

    /// The bytes of a pixel.
    pub fn bytes(self) -> usize {
        self.lists() * size_of::<Vec4>()
    }
}

/// What the samples of a pixel show besides their radiance, as the integrator `path` sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Light that was not reflected; a is the share of the samples whose rays meet anything.
    Emission,
    /// Light that was reflected once.
    Direct,
    /// Light that was reflected more often.
    Indirect,
    /// The share of light that the surface reflects.
    Albedo,
    /// The normal that the surface is shaded by, outwards.
    Normal,
}

impl Layer {
    /// All of them, in the order of a film's lists.
    pub const ALL: [Layer; 5] = [
        Layer::Emission,
        Layer::Direct,
        Layer::Indirect,
        Layer::Albedo,
        Layer::Normal,
    ];
}

/// The sums of a rectangle of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Which pixels of the picture these are.
    pub region: Region,
    /// Row by row from the top: in rgb the sum of the samples' radiances, in a the sum of their weights.
    pub sums: Vec<Vec4>,
    /// Under adaptive sampling the moments of the same pixels, else nothing: in rgb the sum of the samples' squared
    /// deviations from their mean, in a the number of samples.
    pub moments: Vec<Vec4>,
    /// Under adaptive sampling what the first samples of the same pixels tell their neighbours, else nothing.
    pub looks: Vec<Vec4>,
    /// Where layers were asked for, the sums of each [`Layer`] of the same pixels, weighted as the radiances are; else nothing.
    pub layers: [Vec<Vec4>; Layer::ALL.len()],
}

impl Film {
    /// A film without any sample, and without moments and layers.
    pub fn new(region: Region) -> Film {
        Film::of(region, Form::default())
    }

    /// A film without any sample, for adaptive sampling.
    pub fn adaptive(region: Region) -> Film {
        let form = Form {
            adaptive: true,
            ..Form::default()
        };
        Film::of(region, form)
    }

    /// A film without any sample.
    pub fn of(region: Region, form: Form) -> Film {
        let list = |there: bool| match there {
            true => vec![Vec4::zeroed(); region.pixels() as usize],
            false => Vec::new(),
        };
        Film {
            region,
            sums: list(true),
            moments: list(form.adaptive),
            looks: list(form.adaptive),
            layers: std::array::from_fn(|_| list(form.layers)),
        }
    }

    /// What it has beside its sums; a film without pixels has nothing.
    pub fn form(&self) -> Form {
        Form {
            adaptive: !self.moments.is_empty(),
            layers: self.has_layers(),
        }
    }

    /// Every list of its pixels, also those that are empty: sums, moments, looks, layers.
    pub fn lists(&self) -> impl Iterator<Item = &Vec<Vec4>> {
        let Film {
            region: _,
            sums,
            moments,
            looks,
            layers,
        } = self;
        [sums, moments, looks].into_iter().chain(layers)
    }

    /// The same, to be changed.
    pub fn lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<Vec4>> {
        let Film {
            region: _,
            sums,
            moments,
            looks,
            layers,
        } = self;
        [sums, moments, looks].into_iter().chain(layers)
    }

    /// A part of the film, which must lie in it.
    pub fn part(self, part: Region) -> Film {
        if part == self.region {
            return self;
        }
        let width = self.region.width() as usize;
        let columns = (part.x0 - self.region.x0) as usize..(part.x1 - self.region.x0) as usize;
        let rows = (part.y0 - self.region.y0) as usize..(part.y1 - self.region.y0) as usize;
        let of_part = |records: &[Vec4]| {
            let of_rows = records.chunks(width.max(1)).take(rows.end).skip(rows.start);
            of_rows.flat_map(|row| row[columns.clone()].to_vec()).collect()
        };
        Film {
            region: part,
            sums: of_part(&self.sums),
            moments: of_part(&self.moments),
            looks: of_part(&self.looks),
            layers: self.layers.each_ref().map(|list| of_part(list)),
        }
    }

    /// How many samples a pixel has, under adaptive sampling.
    pub fn sample_count(&self, pixel: usize) -> u32 {
        self.moments[pixel].w as u32
    }

    /// How many samples the pixels have, row by row from the top, under adaptive sampling.
    pub fn sample_counts(&self) -> impl Iterator<Item = u32> {
        (0..self.moments.len()).map(|pixel| self.sample_count(pixel))
    }

    /// The variance of a pixel's mean in red, green and blue, under adaptive sampling, estimated from its samples as if they
    /// were independent: on average an upper bound for patterns that are more even. Where all samples are the same it is
    /// 0. It is not what decided on the pixel's samples, which is what its neighbours are like.
    pub fn variance(&self, pixel: usize) -> [f32; 3] {
        variance_of_mean(self.sums[pixel], self.moments[pixel]).to_array()
    }

    /// Whether it has layers, which a film without pixels has not.
    pub fn has_layers(&self) -> bool {
        self.layers.iter().all(|list| !list.is_empty())
    }

    /// The mean of a layer over a pixel's samples; 0 if there are no samples, or no layers.
    pub fn layer(&self, layer: Layer, pixel: usize) -> [f32; 3] {
        let sum = self.layers[layer as usize].get(pixel).copied().unwrap_or_default();
        mean(sum.xyz().extend(self.sums[pixel].w))
    }

    /// The share of a pixel's samples whose rays meet anything; 0 if there are no samples, 1 if there are no layers. A filter with
    /// weights of either sign may take it out of 0 to 1.
    pub fn alpha(&self, pixel: usize) -> f32 {
        let all = self.sums[pixel].w;
        match self.layers[Layer::Emission as usize].get(pixel) {
            None => 1.0,
            Some(_) if all == 0.0 => 0.0,
            Some(sum) => sum.w / all,
        }
    }

    /// The means of all pixels: linear RGB, row by row from the top.
    pub fn means(&self) -> impl Iterator<Item = [f32; 3]> {
        self.sums.iter().copied().map(mean)
    }
}

/// The variance of a pixel's mean in red, green and blue, by its sum and its moments, if its samples were independent.
pub fn variance_of_mean(sum: Vec4, moments: Vec4) -> Vec3 {
    let n = moments.w;
    let scale = n / ((n - 1.0) * sum.w * sum.w);
    moments.xyz() * scale
}

/// The mean of a pixel's samples: linear RGB, black if there are none.
pub fn mean(sum: Vec4) -> [f32; 3] {
    if sum.w == 0.0 {
        [0.0; 3]
    } else {
        [sum.x / sum.w, sum.y / sum.w, sum.z / sum.w]
    }
}
