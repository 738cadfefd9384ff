//! The environment `studio`: an analytic photo studio with gray walls and rectangular area lights with soft edges.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::texture::{Image, Texels};

/// Size of the environment map in texels.
const WIDTH: usize = 1024;
const HEIGHT: usize = 512;
/// Radiance of the floor, of the walls at eye level, and of the ceiling.
const FLOOR: f64 = 0.08;
const WALL: f64 = 0.14;
const CEILING: f64 = 0.25;
/// Width of an emitter's soft edge, relative to half of the emitter's side.
const EDGE: f64 = 0.15;

/// A rectangular emitter at a distance of 1.
struct Emitter {
    /// Direction to the center, not normalized.
    direction_to_center: DVec3,
    /// Half of the width, and half of the height.
    half_size: [f64; 2],
    radiance: f64,
}

/// The emitters, for a view along +y: a key light on the left, a weaker fill light on the right, a light above, and a
/// light behind.
const EMITTERS: [Emitter; 4] = [
    Emitter {
        direction_to_center: DVec3::new(-0.75, -0.6, 0.65),
        half_size: [0.5, 0.45],
        radiance: 3.0,
    },
    Emitter {
        direction_to_center: DVec3::new(0.95, -0.35, 0.35),
        half_size: [0.3, 0.55],
        radiance: 1.1,
    },
    Emitter {
        direction_to_center: DVec3::new(0.0, 0.0, 1.0),
        half_size: [0.35, 0.6],
        radiance: 1.8,
    },
    Emitter {
        direction_to_center: DVec3::new(0.35, 0.95, 0.5),
        half_size: [0.12, 0.5],
        radiance: 2.2,
    },
];

/// Computes the environment map of the studio.
pub fn studio() -> Image {
    let emitters = EMITTERS.map(|emitter| emitter.oriented());
    let azimuths: Vec<(f64, f64)> = (0..WIDTH)
        .map(|column| (PI - (0.5 + column as f64) * TAU / WIDTH as f64).sin_cos())
        .collect();
    let texel_row = |row: usize| {
        let (sine, cosine) = ((0.5 + row as f64) * PI / HEIGHT as f64).sin_cos();
        let direction = move |(azimuth_sine, azimuth_cosine): &(f64, f64)| {
            DVec3::new(sine * azimuth_cosine, sine * azimuth_sine, cosine)
        };
        let texel = |azimuth| Vec3::splat(radiance(&emitters, direction(azimuth)) as f32).into();
        azimuths.iter().map(texel).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<[f32; 3]>> = (0..HEIGHT).into_par_iter().map(texel_row).collect();
    Image {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        texels: Texels::Floats(rows.concat()),
    }
}

fn radiance(emitters: &[OrientedEmitter], direction: DVec3) -> f64 {
    let z = direction.z;
    // The floor and the ceiling blend smoothly into the walls.
    let room = match z < 0.0 {
        true => WALL + (FLOOR - WALL) * smooth(-3.0 * z),
        false => WALL + (CEILING - WALL) * smooth(z),
    };
    let emitters = emitters
        .iter()
        .map(|emitter| emitter.radiance * emitter.coverage(direction));
    emitters.fold(room, f64::max)
}

/// An emitter with unit vectors to its center and along its sides.
struct OrientedEmitter {
    axis: DVec3,
    sides: [DVec3; 2],
    half_size: [f64; 2],
    radiance: f64,
}

impl Emitter {
    fn oriented(&self) -> OrientedEmitter {
        let axis = self.direction_to_center.normalize();
        let right = match axis.z.abs() < 0.99 {
            true => axis.cross(DVec3::Z).normalize(),
            false => DVec3::X,
        };
        OrientedEmitter {
            axis,
            sides: [right, right.cross(axis)],
            half_size: self.half_size,
            radiance: self.radiance,
        }
    }
}

impl OrientedEmitter {
    /// Returns the coverage of the emitter: 1 inside, 0 outside.
    fn coverage(&self, direction: DVec3) -> f64 {
        let ahead = direction.dot(self.axis);
        if ahead <= 0.0 {
            return 0.0;
        }
        let offsets = self.sides.map(|side| direction.dot(side).abs() / ahead);
        let edge_weight = |i: usize| smooth((1.0 + EDGE - offsets[i] / self.half_size[i]) / EDGE);
        edge_weight(0) * edge_weight(1)
    }
}

/// Returns the smoothstep function of `x`, clamped to 0 ... 1.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
