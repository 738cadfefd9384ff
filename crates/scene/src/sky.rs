//! The environment `sky`: an analytic clear sky with a sun, computed with single scattering in a flat atmosphere.
//!
//! Extinction is by molecules (Hansen and Travis, "Light Scattering in Planetary Atmospheres", Space Science Reviews
//! 16, 1974, equation 2.30) and by haze (Ångström's formula, with the turbidity as in Preetham, Shirley and Smits, "A
//! Practical Analytic Model for Daylight", SIGGRAPH 1999, appendix A.1). The air mass is by Kasten and Young, "Revised
//! Optical Air Mass Tables and Approximation Formula", Applied Optics 28, 1989. A fixed fraction of the scattered
//! sunlight reaches the ground. Single scattering yields less; the difference is added to the sky in proportion to the
//! opacity of the air.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::texture::{Image, Texels};

/// Size of the environment map in texels.
const WIDTH: usize = 2048;
const HEIGHT: usize = 1024;
/// Wavelengths of red, green and blue in micrometers.
const WAVELENGTHS: DVec3 = DVec3::new(0.68, 0.55, 0.44);
/// Extraterrestrial irradiance at normal incidence: a white floor at noon has a radiance of about 1.
const ABOVE_AIR: f64 = 4.0;
/// Angular radius of the sun.
const SUN_RADIUS: f64 = 0.2666 * PI / 180.0;
/// Single-scattering albedo of haze, and its asymmetry g (Henyey-Greenstein).
const HAZE_ALBEDO: f64 = 0.9;
const HAZE_FORWARD: f64 = 0.75;
/// Fractions of the scattered light that reach the ground: for molecules, and for haze, which scatters forwards.
const MOLECULES_DOWN: f64 = 0.5;
const HAZE_DOWN: f64 = 0.8;
const GROUND: f64 = 0.25;
/// Number of sample points along each side of a texel, used to estimate the fraction that the sun covers.
const POINTS: usize = 8;

/// Parameters of a sky; angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Elevation of the sun, 0 to pi / 2.
    pub elevation: f64,
    /// Azimuth of the sun, from +x towards +y.
    pub azimuth: f64,
    /// Turbidity, 1 (clean air) to 10.
    pub turbidity: f64,
}

pub fn sky(sky: &Sky) -> Image {
    let air = Air::of(sky);
    let mut texels = Vec::with_capacity(WIDTH * HEIGHT);
    let rows: Vec<Row> = (0..HEIGHT / 2).map(|row| air.row((row as f64 + 0.5) * ROW)).collect();
    let azimuths: Vec<(f64, f64)> = (0..WIDTH)
        .map(|column| azimuth(column as f64 + 0.5).sin_cos())
        .collect();
    // Irradiance on the ground from single scattering, and from the added light at unit scale.
    let (mut once, mut added) = (DVec3::ZERO, DVec3::ZERO);
    for row in &rows {
        let angle = TAU / WIDTH as f64 * ROW * row.sine * row.cosine;
        for (sine, cosine) in &azimuths {
            let direction = DVec3::new(row.sine * cosine, row.sine * sine, row.cosine);
            let color = air.scattered_once(row, direction);
            once += color * angle;
            added += row.thickness * angle;
            texels.push(color);
        }
    }
    let beam = ABOVE_AIR * air.through;
    let height = air.sun.z;
    let down = (air.molecules * MOLECULES_DOWN + air.haze * HAZE_DOWN) / air.depth;
    let missing = ((ABOVE_AIR - beam) * height * down - once).max(DVec3::ZERO) / added;
    for (texel, i) in texels.iter_mut().zip(0..) {
        *texel += missing * rows[i / WIDTH].thickness;
    }
    let ground = GROUND / PI * (beam * height + once + missing * added);
    texels.resize(WIDTH * HEIGHT, ground);
    add_sun(&mut texels, air.sun, beam);
    Image {
        width: WIDTH as u32,
        height: HEIGHT as u32,
        texels: Texels::Floats(
            texels
                .into_iter()
                .map(|color| color.as_vec3())
                .map(Vec3::into)
                .collect(),
        ),
    }
}

const ROW: f64 = PI / HEIGHT as f64;

/// Returns the azimuth of a column, from the left edge.
fn azimuth(column: f64) -> f64 {
    PI - column * TAU / WIDTH as f64
}

struct Air {
    sun: DVec3,
    /// Air mass towards the sun, relative to the zenith.
    sun_mass: f64,
    /// Transmittance towards the sun.
    through: DVec3,
    /// Vertical optical depth, and the parts of it that are scattering by molecules and by haze.
    depth: DVec3,
    molecules: DVec3,
    haze: DVec3,
}

struct Row {
    /// Sine of the zenith angle.
    sine: f64,
    cosine: f64,
    mass: f64,
    through: DVec3,
    /// Opacity of the air: 1 - transmittance.
    thickness: DVec3,
}

impl Air {
    fn of(sky: &Sky) -> Air {
        let inverse = DVec3::ONE / (WAVELENGTHS * WAVELENGTHS);
        let fourth = inverse * inverse;
        let molecules = 0.008_569 * fourth * (DVec3::ONE + 0.0113 * inverse + 0.000_13 * fourth);
        let haze = (0.046_08 * sky.turbidity - 0.045_86) * WAVELENGTHS.powf(-1.3);
        let depth = molecules + haze;
        let (sine, cosine) = sky.elevation.sin_cos();
        let sun_mass = mass(PI / 2.0 - sky.elevation);
        Air {
            sun: DVec3::new(cosine * sky.azimuth.cos(), cosine * sky.azimuth.sin(), sine),
            sun_mass,
            through: (-depth * sun_mass).exp(),
            depth,
            molecules,
            haze: haze * HAZE_ALBEDO,
        }
    }

    /// Returns the row at a zenith angle.
    fn row(&self, angle: f64) -> Row {
        let (sine, cosine) = angle.sin_cos();
        let mass = mass(angle);
        let through = (-self.depth * mass).exp();
        Row {
            sine,
            cosine,
            mass,
            through,
            thickness: DVec3::ONE - through,
        }
    }

    /// Returns the radiance by single scattering. Sunlight that reaches the vertical optical depth t has passed t times
    /// the sun's air mass; scattered light then passes the remaining depth times the ray's air mass.
    fn scattered_once(&self, row: &Row, direction: DVec3) -> DVec3 {
        let cosine = direction.dot(self.sun);
        let g = HAZE_FORWARD;
        let by_molecules = 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
        let spread = 1.0 + g * g - 2.0 * g * cosine;
        let by_haze = (1.0 - g * g) / (4.0 * PI * spread * spread.sqrt());
        let sent = (self.molecules * by_molecules + self.haze * by_haze) / self.depth;
        let difference = row.mass - self.sun_mass;
        let along = match difference.abs() > 1e-6 {
            true => (self.through - row.through) / difference,
            false => self.depth * row.through,
        };
        ABOVE_AIR * sent * row.mass * along
    }
}

/// Returns the air mass at a zenith angle.
fn mass(angle: f64) -> f64 {
    1.0 / (angle.cos() + 0.505_72 * (96.079_95 - angle.to_degrees()).powf(-1.6364))
}

/// Adds the sun as a disk with this irradiance at normal incidence.
fn add_sun(texels: &mut [DVec3], sun: DVec3, irradiance: DVec3) {
    let nearest = (sun.z.clamp(-1.0, 1.0).acos() / ROW) as usize;
    let reach = (SUN_RADIUS / ROW) as usize + 2;
    let least = SUN_RADIUS.cos();
    let mut covered = Vec::new();
    let mut all = 0.0;
    for row in nearest.saturating_sub(reach)..(nearest + reach).min(HEIGHT) {
        // Radiance is linear in the angle between rows, and constant up to the pole.
        let beside_pole = if row == 0 || row + 1 == HEIGHT {
            13.0 / 12.0
        } else {
            1.0
        };
        let solid_angle = beside_pole * TAU / WIDTH as f64 * ROW * ((row as f64 + 0.5) * ROW).sin();
        for column in 0..WIDTH {
            let at = |i: usize| (i as f64 + 0.5) / POINTS as f64;
            let direction = |x: f64, y: f64| {
                let (angle, turn) = ((row as f64 + y) * ROW, azimuth(column as f64 + x));
                DVec3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos())
            };
            if direction(0.5, 0.5).dot(sun) < (SUN_RADIUS + 2.0 * ROW).cos() {
                continue;
            }
            let points = (0..POINTS * POINTS).filter(|i| direction(at(i % POINTS), at(i / POINTS)).dot(sun) >= least);
            let share = points.count() as f64 / (POINTS * POINTS) as f64;
            covered.push((row * WIDTH + column, share));
            all += share * solid_angle;
        }
    }
    for (texel, share) in covered {
        texels[texel] += irradiance * share / all;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texels(sky: &Image) -> &[[f32; 3]] {
        match &sky.texels {
            Texels::Floats(texels) => texels,
            Texels::Bytes(..) => panic!("a sky of bytes"),
        }
    }

    /// Returns the solid angle of a texel. At a pole, it is larger by a twelfth, because the radiance is constant up to
    /// the pole.
    fn stands_for(row: usize) -> f64 {
        let square = ((row as f64 + 0.5) * ROW).sin() * ROW * TAU / WIDTH as f64;
        if row == 0 || row == HEIGHT - 1 {
            square * 13.0 / 12.0
        } else {
            square
        }
    }

    fn irradiance(image: &Image, normal: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (i, texel) in texels(image).iter().enumerate() {
            let (row, column) = (i / WIDTH, i % WIDTH);
            let (angle, turn) = ((row as f64 + 0.5) * ROW, azimuth(column as f64 + 0.5));
            let direction = DVec3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos());
            let color = DVec3::from_array(texel.map(f64::from));
            sum += color * direction.dot(normal).max(0.0) * stands_for(row);
        }
        sum
    }

    #[test]
    fn skies_are_valid_at_the_ends_of_the_parameter_ranges() {
        for elevation in [0.0, 1e-3, 30.0, 90.0] {
            for turbidity in [1.0, 3.0, 10.0] {
                let image = sky(&Sky {
                    elevation: f64::to_radians(elevation),
                    azimuth: -2.0,
                    turbidity,
                });
                let all = texels(&image).iter().flatten();
                assert!(
                    all.clone().all(|x| (0.0..1e6).contains(x)),
                    "elevation {elevation}, turbidity {turbidity}"
                );
                // The ground receives at most the light of the sun.
                let sun = f64::to_radians(elevation).sin() * ABOVE_AIR;
                let down = irradiance(&image, DVec3::Z);
                assert!(down.max_element() <= sun + 0.1, "{down} of {sun}");
                assert!(down.min_element() > 0.3 * sun, "{down} of {sun}");
            }
        }
    }

    #[test]
    fn the_sun_has_the_requested_direction_and_irradiance() {
        for (elevation, azimuth) in [(0.3, 0.0), (0.7, 2.0), (1.5, -1.0), (PI / 2.0, 1.0)] {
            let asked = Sky {
                elevation,
                azimuth,
                turbidity: 2.0,
            };
            let air = Air::of(&asked);
            let image = sky(&asked);
            // Irradiance at normal incidence from within twice the sun's radius.
            let near: DVec3 = {
                let mut sum = DVec3::ZERO;
                for (i, texel) in texels(&image).iter().enumerate() {
                    let (row, column) = (i / WIDTH, i % WIDTH);
                    let (angle, turn) = ((row as f64 + 0.5) * ROW, super::azimuth(column as f64 + 0.5));
                    let direction = DVec3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos());
                    if direction.dot(air.sun) > (2.0 * SUN_RADIUS).cos() {
                        sum += DVec3::from_array(texel.map(f64::from)) * stands_for(row);
                    }
                }
                sum
            };
            let expected = ABOVE_AIR * air.through;
            let ratio = near / expected;
            assert!((ratio - DVec3::ONE).abs().max_element() < 0.01, "{ratio}");
        }
    }
}
