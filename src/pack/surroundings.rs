//! The image that surrounds a scene, as texels and the table by which samples of its light are taken.

use glam::{DVec3, Vec3};

use super::{BACKGROUND, Environment, IMAGE_AROUND, UNSEEN_AROUND};
use crate::scene::halves::linear;
use crate::scene::{self, EnvironmentImage, Scene};

/// Darker surroundings count as black: what the densities of samples are made of would be beside the normal numbers.
const DARKEST: f64 = 1e-25;

/// Where an image that surrounds the scene is among the texels, if there is one.
#[derive(Default)]
pub struct Surroundings(Option<Around>);

struct Around {
    rows: [Vec3; 3],
    width: u32,
    height: u32,
    texels: usize,
    cells: usize,
    /// The integral over all directions of the mean of the colours' components, as the cells have it.
    sum: f64,
}

impl Surroundings {
    /// Adds the image's texels and its cells' table to the scene's texels.
    pub fn of(scene: &Scene, texels: &mut Vec<u32>) -> Surroundings {
        let image = scene
            .environment
            .as_ref()
            .and_then(|environment| environment.image.as_ref());
        Surroundings(image.and_then(|image| around(image, texels)))
    }

    /// What it sends from all directions together.
    pub fn sum(&self) -> Option<f64> {
        self.0.as_ref().map(|around| around.sum)
    }

    /// What kernels know of it as a constant.
    pub fn bits(&self, scene: &Scene) -> u32 {
        let any = |test: fn(&scene::Environment) -> bool| scene.environment.as_ref().is_some_and(test);
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        bit(self.0.is_some(), IMAGE_AROUND)
            | bit(any(|environment| !environment.visible), UNSEEN_AROUND)
            | bit(any(|environment| environment.background.is_some()), BACKGROUND)
    }

    /// Its part of the record, where so large a share of all samples of light is of it.
    pub fn record(&self, share: f64) -> Environment {
        let Some(around) = &self.0 else {
            return bytemuck::Zeroable::zeroed();
        };
        let [x, y, z] = around.rows;
        Environment {
            x,
            texels: around.texels as u32,
            y,
            width: around.width,
            z,
            height: around.height,
            cells: around.cells as u32,
            // Of the sum of four corners' three components.
            density: (share / around.sum / 12.0) as f32,
            ..bytemuck::Zeroable::zeroed()
        }
    }
}

fn around(around: &EnvironmentImage, texels: &mut Vec<u32>) -> Option<Around> {
    let image = &*around.image;
    let (width, height) = (image.width as usize, image.height as usize);
    let start = texels.len();
    let cells = start + 3 * width * (height + 2);
    texels.reserve_exact(cells + 2 * width * (height + 1) - start);
    let texel = linear(image);
    let color = |i: usize| texel(i) * around.scale;
    let pole = |row: usize| (0..width).map(|column| color(row * width + column)).sum::<DVec3>() / width as f64;
    let mut add = |color: DVec3| texels.extend(color.as_vec3().to_array().map(f32::to_bits));
    (0..width).for_each(|_| add(pole(0)));
    (0..width * height).for_each(|i| add(color(i)));
    (0..width).for_each(|_| add(pole(height - 1)));
    let mut weights = weights(&texels[start..], width, height);
    let sum: f64 = weights.iter().sum();
    if !(sum >= DARKEST) {
        texels.truncate(start);
        return None;
    }
    let mean = sum / weights.len() as f64;
    weights.iter_mut().for_each(|weight| *weight /= mean);
    write_table(weights, texels);
    Some(Around {
        rows: [around.to_world.x_axis, around.to_world.y_axis, around.to_world.z_axis].map(|axis| axis.as_vec3()),
        width: image.width,
        height: image.height,
        texels: start,
        cells,
        sum,
    })
}

/// Of each cell the mean of its corners times its solid angle.
fn weights(texels: &[u32], width: usize, height: usize) -> Vec<f64> {
    let value = |i: usize| {
        let parts = &texels[3 * i..3 * i + 3];
        parts.iter().map(|bits| f64::from(f32::from_bits(*bits))).sum::<f64>() / 3.0
    };
    let mut weights = Vec::with_capacity(width * (height + 1));
    let mut upper: Vec<f64> = (0..width).map(value).collect();
    for row in 0..=height {
        let lower: Vec<f64> = (0..width).map(|column| value((row + 1) * width + column)).collect();
        let angle = solid_angle(row, width, height) / 4.0;
        for column in 0..width {
            let next = (column + 1) % width;
            weights.push((upper[column] + upper[next] + lower[column] + lower[next]) * angle);
        }
        upper = lower;
    }
    weights
}

/// The solid angle of each cell of a row.
fn solid_angle(row: usize, width: usize, height: usize) -> f64 {
    let border = |row: f64| (row - 0.5).clamp(0.0, height as f64) / height as f64 * std::f64::consts::PI;
    let (above, below) = (border(row as f64), border(row as f64 + 1.0));
    // cos a - cos b, where both may be nearly 1.
    let zone = 2.0 * ((above + below) / 2.0).sin() * ((below - above) / 2.0).sin();
    std::f64::consts::TAU / width as f64 * zone
}

/// The table by which one of the weights' indices is chosen, of weights whose mean is 1: Vose, "A Linear Algorithm for Generating Random Numbers with
/// a Given Distribution", IEEE TSE 17(9), 1991, without lists of the small and of the large ones, which would take as much memory as the
/// table. What is small is filled up by the first large one that is left.
fn write_table(mut rest: Vec<f64>, words: &mut Vec<u32>) {
    let start = words.len();
    words.extend((0..rest.len() as u32).flat_map(|i| [u32::MAX, i]));
    let next_large = |rest: &[f64], from: usize| (from..rest.len()).find(|i| rest[*i] >= 1.0);
    let mut large = next_large(&rest, 0);
    for i in 0..rest.len() {
        let mut small = i;
        // One that has become small behind `i` is filled up at once; those before it are met later.
        while let Some(filling) = large
            && rest[small] < 1.0
        {
            // None that has any weight is never chosen.
            words[start + 2 * small] = (rest[small] * 4_294_967_296.0).ceil() as u32;
            words[start + 2 * small + 1] = filling as u32;
            rest[filling] -= 1.0 - rest[small];
            if rest[filling] >= 1.0 {
                break;
            }
            large = next_large(&rest, filling + 1);
            if filling > i {
                break;
            }
            small = filling;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probabilities that a table gives.
    fn probabilities(words: &[u32]) -> Vec<f64> {
        let count = words.len() / 2;
        let mut out = vec![0.0; count];
        for (i, pair) in words.chunks(2).enumerate() {
            let own = if pair[1] as usize == i {
                1.0
            } else {
                f64::from(pair[0]) / 4_294_967_296.0
            };
            out[i] += own / count as f64;
            out[pair[1] as usize] += (1.0 - own) / count as f64;
        }
        out
    }

    #[test]
    fn a_table_gives_the_weights_that_it_was_made_of() {
        let random = |i: usize| ((i as f64 * 0.618_033_988_749) % 1.0).powi(9);
        for weights in [
            vec![1.0],
            vec![2.0, 0.0],
            vec![0.0, 2.0],
            vec![0.0, 0.0, 3.0, 1.0],
            vec![3.0, 0.5, 0.5, 0.0],
            vec![1.5, 0.4, 1.6, 0.5],
            vec![1e-12, 1.0, 1e6],
            (0..1000).map(random).collect(),
            (0..1000).rev().map(random).collect(),
        ] {
            let sum: f64 = weights.iter().sum();
            let mean = sum / weights.len() as f64;
            let mut words = vec![7, 7];
            write_table(weights.iter().map(|weight| weight / mean).collect(), &mut words);
            for (found, weight) in probabilities(&words[2..]).into_iter().zip(&weights) {
                assert!((found - weight / sum).abs() < 1e-9, "{found} for {weight} of {sum}");
                assert!((found > 0.0) == (*weight > 0.0), "{found} for {weight} of {sum}");
            }
        }
    }

    #[test]
    fn cells_cover_all_directions() {
        for (width, height) in [(1, 1), (2, 1), (3, 2), (64, 32), (5, 101)] {
            let all: f64 = (0..=height)
                .map(|row| width as f64 * solid_angle(row, width, height))
                .sum();
            assert!(
                (all - 4.0 * std::f64::consts::PI).abs() < 1e-12,
                "{width} x {height}: {all}"
            );
        }
    }
}
