//! Elliptical weighted average (EWA) with cached weights. Computing the weights takes most of the time of a lookup.
//! Textures of equal size share the weights if a material looks them up at the same point. Usually all textures of a
//! material have the same size. The results are bit-identical to [`super::texture::ewa_color`].

use std::cell::RefCell;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::footprint::{Footprint, footprint_ellipse, wrap_u, wrap_v};
use super::math::{floor, max};
use super::texel::{gaussian_weight, level_size, near_coordinate, unpacked_color, wrapped_index};
use super::texture::level_of_length;
use crate::records::{FLOAT, LINEAR8, Packed, SRGB8, Texture};

/// Like [`super::texture::ewa_color`], with cached weights.
pub fn color(scene: &Packed, t: &Texture, f: Footprint) -> Vec3 {
    CACHED.with_borrow_mut(|kernel| {
        let key = Key::of(t, f);
        if kernel.key != key {
            kernel.set(key, t, f);
        }
        kernel.color(scene, t)
    })
}

thread_local! {
    static CACHED: RefCell<Kernel> = const { RefCell::new(Kernel::NONE) };
}

/// The values that the weights depend on.
#[derive(Clone, Copy, PartialEq)]
struct Key {
    size: [u32; 2],
    levels: u32,
    wrap: u32,
    /// Footprint and maximum anisotropy, as bits.
    footprint: [u32; 7],
}

impl Key {
    fn of(t: &Texture, Footprint { uv, dx, dy }: Footprint) -> Key {
        Key {
            size: [t.width, t.height],
            levels: t.levels,
            wrap: t.wrap,
            footprint: [uv.x, uv.y, dx.x, dx.y, dy.x, dy.y, t.parameter].map(f32::to_bits),
        }
    }
}

struct Kernel {
    key: Key,
    /// Finer level, and the next coarser level if both are blended.
    levels: [Weights; 2],
    finer: u32,
    /// Weight of the coarser level.
    blend: f32,
}

struct Weights {
    /// Indices of the texels within the level.
    texels: Vec<u32>,
    weights: Vec<f32>,
    /// Position of the first texel with a positive weight. Differences from this texel are summed.
    base: usize,
    /// 1 / (sum of the weights), or 0.
    scale: f32,
}

impl Kernel {
    const NONE: Kernel = Kernel {
        key: Key {
            size: [0; 2],
            levels: 0,
            wrap: 0,
            footprint: [0; 7],
        },
        levels: [Weights::NONE, Weights::NONE],
        finer: 0,
        blend: 0.0,
    };

    fn set(&mut self, key: Key, t: &Texture, f: Footprint) {
        self.key = key;
        let size = Vec2::new(t.width as f32, t.height as f32);
        let minor = footprint_ellipse(f.dx * size, f.dy * size, t.parameter).minor;
        let lod = level_of_length(t, 0.45 * minor);
        let finer = floor(lod);
        self.finer = finer as u32;
        self.blend = max(4.0 * (lod - finer) - 3.0, 0.0);
        let coarsest = lod >= (t.levels - 1) as f32;
        let f = Footprint {
            uv: f.uv,
            dx: if coarsest { Vec2::ZERO } else { f.dx },
            dy: if coarsest { Vec2::ZERO } else { f.dy },
        };
        let count = if self.blend > 0.0 { 2 } else { 1 };
        for (level, weights) in (self.finer..).zip(&mut self.levels[..count]) {
            weights.set(t, level, f);
        }
    }

    fn color(&self, scene: &Packed, t: &Texture) -> Vec3 {
        let level = |i: u32| {
            let start = scene.textures.texels[(t.texels + self.finer + i) as usize] as usize;
            self.levels[i as usize].mean(&scene.textures.texels[start..], t.format)
        };
        let color = level(0);
        match self.blend > 0.0 {
            true => color + (level(1) - color) * self.blend,
            false => color,
        }
    }
}

impl Weights {
    const NONE: Weights = Weights {
        texels: Vec::new(),
        weights: Vec::new(),
        base: 0,
        scale: 0.0,
    };

    fn set(&mut self, t: &Texture, level: u32, f: Footprint) {
        self.texels.clear();
        self.weights.clear();
        self.base = 0;
        let (width, height) = (level_size(t.width, level), level_size(t.height, level));
        let size = Vec2::new(width as f32, height as f32);
        let q = size / Vec2::new(t.width as f32, t.height as f32);
        let edges = Vec2::new(
            if width == 1 { 0.0 } else { size.x },
            if height == 1 { 0.0 } else { size.y },
        );
        let ellipse = footprint_ellipse(f.dx * edges, f.dy * edges, t.parameter);
        let m = ellipse.m;
        let min_increase = 1.0 - ellipse.minor * ellipse.minor;
        let xx = m.x + max((4.0 * (q.x * q.x) - 1.0) / 3.0, min_increase);
        let yy = m.z + max((4.0 * (q.y * q.y) - 1.0) / 3.0, min_increase);
        let slope = m.y / yy;
        let half_width2 = xx - m.y * slope;
        let x = near_coordinate(f.uv.x, wrap_u(t)) * size.x - 0.5;
        let y = near_coordinate(f.uv.y, wrap_v(t)) * size.y - 0.5;
        let half_height = yy.sqrt();
        let first_row = -(floor(half_height - y) as i32);
        let last_row = floor(y + half_height) as i32;
        let mut total = 0.0;
        for row in first_row..=last_row {
            let start = wrapped_index(row, height, wrap_v(t)) * width;
            let h = row as f32 - y;
            let row_r2 = h * h / yy;
            let middle = x + h * slope;
            let half = (half_width2 * max(1.0 - row_r2, 0.0)).sqrt();
            let last = floor(middle + half) as i32;
            for column in -(floor(half - middle) as i32)..=last {
                let w = column as f32 - middle;
                let weight = max(gaussian_weight(row_r2 + w * w / half_width2), 0.0);
                if total == 0.0 {
                    self.base = self.texels.len();
                }
                self.texels.push(start + wrapped_index(column, width, wrap_u(t)));
                self.weights.push(weight);
                total += weight;
            }
        }
        self.scale = if total > 0.0 { 1.0 / total } else { 0.0 };
    }

    fn mean(&self, texels: &[u32], format: u32) -> Vec3 {
        let table = match format {
            FLOAT => return self.mean_of(|i| Vec3::from_slice(bytemuck::cast_slice(&texels[3 * i..3 * i + 3]))),
            SRGB8 => &*SRGB,
            _ => &*LINEAR,
        };
        self.mean_of(|i| table.color(texels[i]))
    }

    fn mean_of(&self, color: impl Fn(usize) -> Vec3) -> Vec3 {
        let Some(base) = self.texels.get(self.base) else {
            return Vec3::ZERO;
        };
        let base = color(*base as usize);
        let mut sum = Vec3::ZERO;
        for (texel, weight) in self.texels.iter().zip(&self.weights).skip(self.base) {
            sum += (color(*texel as usize) - base) * *weight;
        }
        base + sum * self.scale
    }
}

static SRGB: LazyLock<Table> = LazyLock::new(|| Table::new(SRGB8));
static LINEAR: LazyLock<Table> = LazyLock::new(|| Table::new(LINEAR8));

/// Table of [`unpacked_color`], indexed by the exponent and the nine bits of a component.
struct Table(Box<[f32; 1 << 14]>);

impl Table {
    fn new(format: u32) -> Table {
        let value = |i: usize| unpacked_color(((i >> 9) << 27 | i & 511) as u32, format).x;
        Table(Box::new(std::array::from_fn(value)))
    }

    #[inline]
    fn color(&self, word: u32) -> Vec3 {
        let exponent = (word >> 27) << 9;
        let value = |shift: u32| self.0[(exponent | (word >> shift) & 511) as usize];
        Vec3::new(value(0), value(9), value(18))
    }
}
