//! Weights of the texels in an EWA footprint, computed once for all textures of a size that a material looks up at a point. The textures of a
//! model are mostly of one size, and the weights take most of the time of a lookup.

use std::cell::RefCell;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::footprint::{footprint_ellipse, wrap_u, wrap_v};
use super::math::{floor, max};
use super::texel::{gaussian_weight, near_coordinate, unpacked_color, wrapped_index};
use super::texture::Level;
use crate::pack::{FLOAT, LINEAR8, Packed, SRGB8, Texture};

/// Everything that the weights depend on.
#[derive(Clone, Copy, PartialEq)]
struct Key {
    /// Width and height of the texture, and of the level.
    sizes: [u32; 4],
    wrap: u32,
    /// Position, footprint and maximum anisotropy, as bits.
    place: [u32; 7],
}

/// The texels in a footprint and their weights.
struct Weights {
    key: Key,
    /// Index within the level.
    texels: Vec<u32>,
    weights: Vec<f32>,
    /// Index of the first texel with a weight above 0: the sum is of differences to it.
    base: usize,
    /// Inverse of the sum of the weights; 0 if that is 0.
    scale: f32,
}

impl Weights {
    const NONE: Weights = Weights {
        key: Key {
            sizes: [0; 4],
            wrap: 0,
            place: [0; 7],
        },
        texels: Vec::new(),
        weights: Vec::new(),
        base: 0,
        scale: 0.0,
    };

    fn set(&mut self, key: Key, t: &Texture, level: Level, uv: Vec2, dx: Vec2, dy: Vec2) {
        self.key = key;
        self.texels.clear();
        self.weights.clear();
        let size = Vec2::new(level.width as f32, level.height as f32);
        let q = size / Vec2::new(t.width as f32, t.height as f32);
        let edges = Vec2::new(
            if level.width == 1 { 0.0 } else { size.x },
            if level.height == 1 { 0.0 } else { size.y },
        );
        let ellipse = footprint_ellipse(dx * edges, dy * edges, t.parameter);
        let m = ellipse.m;
        let least = 1.0 - ellipse.minor * ellipse.minor;
        let xx = m.x + max((4.0 * (q.x * q.x) - 1.0) / 3.0, least);
        let yy = m.z + max((4.0 * (q.y * q.y) - 1.0) / 3.0, least);
        let slope = m.y / yy;
        let across = xx - m.y * slope;
        let x = near_coordinate(uv.x, wrap_u(t)) * size.x - 0.5;
        let y = near_coordinate(uv.y, wrap_v(t)) * size.y - 0.5;
        let reach = yy.sqrt();
        let first_row = -(floor(reach - y) as i32);
        let last_row = floor(y + reach) as i32;
        let mut total = 0.0;
        self.base = 0;
        for row in first_row..=last_row {
            let start = wrapped_index(row, level.height, wrap_v(t)) * level.width;
            let h = row as f32 - y;
            let along = h * h / yy;
            let middle = x + h * slope;
            let half = (across * max(1.0 - along, 0.0)).sqrt();
            let last = floor(middle + half) as i32;
            for column in -(floor(half - middle) as i32)..=last {
                let w = column as f32 - middle;
                let weight = max(gaussian_weight(along + w * w / across), 0.0);
                if total == 0.0 {
                    self.base = self.texels.len();
                }
                self.texels.push(start + wrapped_index(column, level.width, wrap_u(t)));
                self.weights.push(weight);
                total += weight;
            }
        }
        self.scale = if total > 0.0 { 1.0 / total } else { 0.0 };
    }

    /// Returns the weighted mean of the colors of a level.
    fn mean(&self, color: impl Fn(u32) -> Vec3) -> Vec3 {
        let Some(base) = self.texels.get(self.base) else {
            return Vec3::ZERO;
        };
        let base = color(*base);
        let mut sum = Vec3::ZERO;
        for (texel, weight) in self.texels.iter().zip(&self.weights).skip(self.base) {
            sum += (color(*texel) - base) * *weight;
        }
        base + sum * self.scale
    }
}

thread_local! {
    /// The last two: of the two levels that a lookup mixes.
    static LAST: RefCell<[Weights; 2]> = const { RefCell::new([Weights::NONE, Weights::NONE]) };
}

/// Returns the mean over one level's texels in the footprint: `ewa_level_color` in `shaders/texture.wgsl`, with the same bits.
pub fn level_color(scene: &Packed, t: &Texture, level: Level, uv: Vec2, dx: Vec2, dy: Vec2) -> Vec3 {
    let key = Key {
        sizes: [t.width, t.height, level.width, level.height],
        wrap: t.wrap,
        place: [uv.x, uv.y, dx.x, dx.y, dy.x, dy.y, t.parameter].map(f32::to_bits),
    };
    LAST.with_borrow_mut(|last| {
        if last[0].key != key {
            last.swap(0, 1);
            if last[0].key != key {
                last[0].set(key, t, level, uv, dx, dy);
            }
        }
        if t.format == FLOAT {
            let texels: &[f32] = bytemuck::cast_slice(&scene.texels[level.start as usize..]);
            return last[0].mean(|i| Vec3::from_slice(&texels[3 * i as usize..3 * i as usize + 3]));
        }
        let texels = &scene.texels[level.start as usize..];
        let table = if t.format == SRGB8 { &*SRGB } else { &*LINEAR };
        last[0].mean(|i| table.color(texels[i as usize]))
    })
}

static SRGB: LazyLock<Table> = LazyLock::new(|| Table::new(SRGB8));
static LINEAR: LazyLock<Table> = LazyLock::new(|| Table::new(LINEAR8));

/// The values of [`unpacked_color`], for each exponent and each nine digits.
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
