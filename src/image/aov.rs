//! What a picture can show besides radiance ("arbitrary output variables"): the first hit through each pixel's centre.

use glam::{UVec4, Vec3};

use crate::cpu::rng::hash4;
use crate::pack::{FirstHit, NOTHING};

/// A value of the first hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// The outward normal.
    Normal,
    /// The distance along the ray.
    Depth,
    /// The texture coordinates.
    Uv,
    /// The number of the shape in the scene file; lights follow the shapes.
    Primitive,
}

/// One channel of a layer.
pub enum Channel {
    /// A number for each first hit.
    Float(&'static str, fn(&FirstHit) -> f32),
    /// A whole number for each first hit.
    Whole(&'static str, fn(&FirstHit) -> u32),
}

impl Aov {
    /// All of them.
    pub const ALL: [Aov; 4] = [Aov::Normal, Aov::Depth, Aov::Uv, Aov::Primitive];

    /// The name in options, files and layers.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Normal => "normal",
            Aov::Depth => "depth",
            Aov::Uv => "uv",
            Aov::Primitive => "primitive",
        }
    }

    /// The channels of an EXR layer.
    pub(super) fn channels(self) -> Vec<Channel> {
        match self {
            Aov::Normal => vec![
                Channel::Float("normal.X", |hit| hit.normal.x),
                Channel::Float("normal.Y", |hit| hit.normal.y),
                Channel::Float("normal.Z", |hit| hit.normal.z),
            ],
            Aov::Depth => vec![Channel::Float("depth.Z", |hit| hit.depth)],
            Aov::Uv => vec![
                Channel::Float("uv.U", |hit| hit.uv.x),
                Channel::Float("uv.V", |hit| hit.uv.y),
            ],
            Aov::Primitive => vec![Channel::Whole("primitive.ID", |hit| hit.shape)],
        }
    }

    /// The colour in a PNG, before rounding to 8 bits; black where nothing is hit. The normal is moved from [-1, 1] to
    /// [0, 1]; the depth d is `1 / (1 + (d / middle)^4)`, near is bright; of texture coordinates the fraction is shown in
    /// red and green; a shape has a colour that its number is hashed to.
    pub fn color(self, hit: &FirstHit, middle_depth: f32) -> Vec3 {
        if hit.shape == NOTHING {
            return Vec3::ZERO;
        }
        match self {
            Aov::Normal => hit.normal * 0.5 + 0.5,
            Aov::Depth => Vec3::splat(1.0 / (1.0 + (hit.depth / middle_depth).powi(4))),
            Aov::Uv => (hit.uv - hit.uv.floor()).extend(0.0),
            Aov::Primitive => {
                let bits = hash4(UVec4::new(hit.shape, 0, 0, 0)).truncate();
                bits.as_vec3() * (0.75 / u32::MAX as f32) + 0.25 // never as dark as nothing is
            }
        }
    }
}
