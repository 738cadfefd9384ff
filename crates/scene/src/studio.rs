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
struct Lamp {
    towards: DVec3,
    /// Half of the width, and half of the height.
    half: [f64; 2],
    radiance: f64,
}

/// For a view along +y: a key light on the left, a weaker fill light on the right, a light above, and a light behind.
const LAMPS: [Lamp; 4] = [
    Lamp {
        towards: DVec3::new(-0.75, -0.6, 0.65),
        half: [0.5, 0.45],
        radiance: 3.0,
    },
    Lamp {
        towards: DVec3::new(0.95, -0.35, 0.35),
        half: [0.3, 0.55],
        radiance: 1.1,
    },
    Lamp {
        towards: DVec3::new(0.0, 0.0, 1.0),
        half: [0.35, 0.6],
        radiance: 1.8,
    },
    Lamp {
        towards: DVec3::new(0.35, 0.95, 0.5),
        half: [0.12, 0.5],
        radiance: 2.2,
    },
];

pub fn studio() -> Image {
    let lamps = LAMPS.map(|lamp| lamp.facing());
    let azimuths: Vec<(f64, f64)> = (0..WIDTH)
        .map(|column| (PI - (0.5 + column as f64) * TAU / WIDTH as f64).sin_cos())
        .collect();
    let row = |row: usize| {
        let (sine, cosine) = ((0.5 + row as f64) * PI / HEIGHT as f64).sin_cos();
        let direction = move |(y, x): &(f64, f64)| DVec3::new(sine * x, sine * y, cosine);
        let texel = |azimuth| Vec3::splat(radiance(&lamps, direction(azimuth)) as f32).into();
        azimuths.iter().map(texel).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<[f32; 3]>> = (0..HEIGHT).into_par_iter().map(row).collect();
    Image {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        texels: Texels::Floats(rows.concat()),
    }
}

fn radiance(lamps: &[AreaLight], direction: DVec3) -> f64 {
    let z = direction.z;
    // The floor blends smoothly into the walls.
    let room = match z < 0.0 {
        true => WALL + (FLOOR - WALL) * smooth(-3.0 * z),
        false => WALL + (CEILING - WALL) * smooth(z),
    };
    let lamps = lamps.iter().map(|lamp| lamp.radiance * lamp.share(direction));
    lamps.fold(room, f64::max)
}

struct AreaLight {
    axis: DVec3,
    sides: [DVec3; 2],
    half: [f64; 2],
    radiance: f64,
}

impl Lamp {
    fn facing(&self) -> AreaLight {
        let axis = self.towards.normalize();
        let right = match axis.z.abs() < 0.99 {
            true => axis.cross(DVec3::Z).normalize(),
            false => DVec3::X,
        };
        AreaLight {
            axis,
            sides: [right, right.cross(axis)],
            half: self.half,
            radiance: self.radiance,
        }
    }
}

impl AreaLight {
    /// Returns the coverage of the emitter: 1 inside, 0 outside.
    fn share(&self, direction: DVec3) -> f64 {
        let ahead = direction.dot(self.axis);
        if ahead <= 0.0 {
            return 0.0;
        }
        let at = self.sides.map(|side| direction.dot(side).abs() / ahead);
        let inside = |i: usize| smooth((1.0 + EDGE - at[i] / self.half[i]) / EDGE);
        inside(0) * inside(1)
    }
}

/// Smoothstep.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}
