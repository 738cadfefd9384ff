//! The environment `sky`: an analytic clear sky with a sun, computed with single scattering in a flat atmosphere.
//!
//! Extinction is by molecules (Hansen and Travis, "Light Scattering in Planetary Atmospheres", Space Science Reviews
//! 16, 1974, equation 2.30) and by haze (Ångström's formula, with the turbidity as in Preetham, Shirley and Smits, "A
//! Practical Analytic Model for Daylight", SIGGRAPH 1999, appendix A.1). The air mass is by Kasten and Young, "Revised
//! Optical Air Mass Tables and Approximation Formula", Applied Optics 28, 1989. The model assumes that a fixed fraction
//! of the scattered sunlight reaches the ground. Single scattering alone yields less light; the difference is added to
//! the sky in proportion to the opacity of the air.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::texture::{Image, Texels};

/// Size of the environment map in texels.
const WIDTH: usize = 2048;
const HEIGHT: usize = 1024;
/// Wavelengths of red, green and blue in micrometers.
const WAVELENGTHS: DVec3 = DVec3::new(0.68, 0.55, 0.44);
/// Extraterrestrial irradiance at normal incidence, chosen so that a white floor at noon has a radiance of about 1.
const SOLAR_IRRADIANCE: f64 = 4.0;
/// Angular radius of the sun.
const SUN_RADIUS: f64 = 0.2666 * PI / 180.0;
/// Single-scattering albedo of haze.
const HAZE_ALBEDO: f64 = 0.9;
/// Asymmetry parameter g of the Henyey-Greenstein phase function of haze.
const HAZE_ASYMMETRY: f64 = 0.75;
/// Fractions of the scattered light that reach the ground: for molecules, and for haze, which scatters forwards.
const MOLECULES_DOWN: f64 = 0.5;
const HAZE_DOWN: f64 = 0.8;
/// Albedo of the ground.
const GROUND_ALBEDO: f64 = 0.25;
/// Number of sample points along each side of a texel, used to estimate the fraction of the texel that the sun covers.
const SAMPLES_PER_SIDE: usize = 8;

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

/// Computes the environment map of a sky.
pub fn sky(sky: &Sky) -> Image {
    let air = Air::of(sky);
    let mut texels = Vec::with_capacity(WIDTH * HEIGHT);
    let rows: Vec<Row> = (0..HEIGHT / 2)
        .map(|row| air.row((row as f64 + 0.5) * ROW_ANGLE))
        .collect();
    let azimuths: Vec<(f64, f64)> = (0..WIDTH)
        .map(|column| azimuth(column as f64 + 0.5).sin_cos())
        .collect();
    // Irradiance on the ground by single scattering, and by added light whose radiance is the opacity of the air.
    let (mut single, mut added) = (DVec3::ZERO, DVec3::ZERO);
    for row in &rows {
        let projected_angle = TAU / WIDTH as f64 * ROW_ANGLE * row.sine * row.cosine;
        for (sine, cosine) in &azimuths {
            let direction = DVec3::new(row.sine * cosine, row.sine * sine, row.cosine);
            let color = air.scattered_once(row, direction);
            single += color * projected_angle;
            added += row.opacity * projected_angle;
            texels.push(color);
        }
    }
    let direct = SOLAR_IRRADIANCE * air.transmittance;
    let sun_height = air.sun.z;
    let ground_fraction = (air.molecules * MOLECULES_DOWN + air.haze * HAZE_DOWN) / air.depth;
    let added_scale = ((SOLAR_IRRADIANCE - direct) * sun_height * ground_fraction - single).max(DVec3::ZERO) / added;
    for (texel, i) in texels.iter_mut().zip(0..) {
        *texel += added_scale * rows[i / WIDTH].opacity;
    }
    let ground = GROUND_ALBEDO / PI * (direct * sun_height + single + added_scale * added);
    texels.resize(WIDTH * HEIGHT, ground);
    add_sun(&mut texels, air.sun, direct);
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

/// Angle between rows.
const ROW_ANGLE: f64 = PI / HEIGHT as f64;

/// Returns the azimuth at a column coordinate, which is 0 at the left edge.
fn azimuth(column: f64) -> f64 {
    PI - column * TAU / WIDTH as f64
}

/// Optical properties of the atmosphere, and the position of the sun.
struct Air {
    sun: DVec3,
    /// Air mass towards the sun, relative to the zenith.
    sun_mass: f64,
    /// Transmittance towards the sun.
    transmittance: DVec3,
    /// Vertical optical depth.
    depth: DVec3,
    /// Vertical optical depth of scattering by molecules.
    molecules: DVec3,
    /// Vertical optical depth of scattering by haze.
    haze: DVec3,
}

/// A row of the environment map above the horizon.
struct Row {
    /// Sine of the zenith angle.
    sine: f64,
    cosine: f64,
    /// Air mass towards the row, relative to the zenith.
    mass: f64,
    transmittance: DVec3,
    /// Opacity of the air: 1 - transmittance.
    opacity: DVec3,
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
            transmittance: (-depth * sun_mass).exp(),
            depth,
            molecules,
            haze: haze * HAZE_ALBEDO,
        }
    }

    /// Returns the row at a zenith angle.
    fn row(&self, angle: f64) -> Row {
        let (sine, cosine) = angle.sin_cos();
        let mass = mass(angle);
        let transmittance = (-self.depth * mass).exp();
        Row {
            sine,
            cosine,
            mass,
            transmittance,
            opacity: DVec3::ONE - transmittance,
        }
    }

    /// Returns the radiance by single scattering. Sunlight at the vertical optical depth t has passed an optical depth
    /// of t times the sun's air mass; the scattered light then passes the remaining depth times the ray's air mass.
    fn scattered_once(&self, row: &Row, direction: DVec3) -> DVec3 {
        let cosine = direction.dot(self.sun);
        let g = HAZE_ASYMMETRY;
        let molecule_phase = 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
        let spread = 1.0 + g * g - 2.0 * g * cosine;
        let haze_phase = (1.0 - g * g) / (4.0 * PI * spread * spread.sqrt());
        let scattering = (self.molecules * molecule_phase + self.haze * haze_phase) / self.depth;
        let difference = row.mass - self.sun_mass;
        let path_integral = match difference.abs() > 1e-6 {
            true => (self.transmittance - row.transmittance) / difference,
            false => self.depth * row.transmittance,
        };
        SOLAR_IRRADIANCE * scattering * row.mass * path_integral
    }
}

/// Returns the air mass at a zenith angle.
fn mass(angle: f64) -> f64 {
    1.0 / (angle.cos() + 0.505_72 * (96.079_95 - angle.to_degrees()).powf(-1.6364))
}

/// Adds the sun as a disk with this irradiance at normal incidence.
fn add_sun(texels: &mut [DVec3], sun: DVec3, irradiance: DVec3) {
    let nearest = (sun.z.clamp(-1.0, 1.0).acos() / ROW_ANGLE) as usize;
    let row_radius = (SUN_RADIUS / ROW_ANGLE) as usize + 2;
    let min_cosine = SUN_RADIUS.cos();
    let mut covered = Vec::new();
    let mut total_solid_angle = 0.0;
    for row in nearest.saturating_sub(row_radius)..(nearest + row_radius).min(HEIGHT) {
        // Radiance is linear in the angle between rows, and constant up to the pole.
        let pole_factor = if row == 0 || row + 1 == HEIGHT {
            13.0 / 12.0
        } else {
            1.0
        };
        let solid_angle = pole_factor * TAU / WIDTH as f64 * ROW_ANGLE * ((row as f64 + 0.5) * ROW_ANGLE).sin();
        for column in 0..WIDTH {
            let sample_position = |i: usize| (i as f64 + 0.5) / SAMPLES_PER_SIDE as f64;
            let direction = |x: f64, y: f64| {
                let (angle, azimuth_angle) = ((row as f64 + y) * ROW_ANGLE, azimuth(column as f64 + x));
                DVec3::new(
                    angle.sin() * azimuth_angle.cos(),
                    angle.sin() * azimuth_angle.sin(),
                    angle.cos(),
                )
            };
            if direction(0.5, 0.5).dot(sun) < (SUN_RADIUS + 2.0 * ROW_ANGLE).cos() {
                continue;
            }
            let points = (0..SAMPLES_PER_SIDE * SAMPLES_PER_SIDE).filter(|i| {
                direction(
                    sample_position(i % SAMPLES_PER_SIDE),
                    sample_position(i / SAMPLES_PER_SIDE),
                )
                .dot(sun)
                    >= min_cosine
            });
            let coverage = points.count() as f64 / (SAMPLES_PER_SIDE * SAMPLES_PER_SIDE) as f64;
            covered.push((row * WIDTH + column, coverage));
            total_solid_angle += coverage * solid_angle;
        }
    }
    for (texel, coverage) in covered {
        texels[texel] += irradiance * coverage / total_solid_angle;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texels(sky: &Image) -> &[[f32; 3]] {
        match &sky.texels {
            Texels::Floats(texels) => texels,
            Texels::Bytes(..) => panic!("the texels of a sky must be floats"),
        }
    }

    /// Returns the solid angle of a texel, which is larger by a twelfth at a pole, because the radiance is constant up
    /// to the pole.
    fn solid_angle(row: usize) -> f64 {
        let area = ((row as f64 + 0.5) * ROW_ANGLE).sin() * ROW_ANGLE * TAU / WIDTH as f64;
        if row == 0 || row == HEIGHT - 1 {
            area * 13.0 / 12.0
        } else {
            area
        }
    }

    fn irradiance(image: &Image, normal: DVec3) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (i, texel) in texels(image).iter().enumerate() {
            let (row, column) = (i / WIDTH, i % WIDTH);
            let (angle, azimuth_angle) = ((row as f64 + 0.5) * ROW_ANGLE, azimuth(column as f64 + 0.5));
            let direction = DVec3::new(
                angle.sin() * azimuth_angle.cos(),
                angle.sin() * azimuth_angle.sin(),
                angle.cos(),
            );
            let color = DVec3::from_array(texel.map(f64::from));
            sum += color * direction.dot(normal).max(0.0) * solid_angle(row);
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
                let components = texels(&image).iter().flatten();
                assert!(
                    components.clone().all(|x| (0.0..1e6).contains(x)),
                    "elevation {elevation}, turbidity {turbidity}"
                );
                // The irradiance on the ground is at most that of the sun outside of the atmosphere.
                let sunlight = f64::to_radians(elevation).sin() * SOLAR_IRRADIANCE;
                let ground = irradiance(&image, DVec3::Z);
                assert!(ground.max_element() <= sunlight + 0.1, "{ground} of {sunlight}");
                assert!(ground.min_element() > 0.3 * sunlight, "{ground} of {sunlight}");
            }
        }
    }

    #[test]
    fn the_sun_has_the_requested_direction_and_irradiance() {
        for (elevation, azimuth) in [(0.3, 0.0), (0.7, 2.0), (1.5, -1.0), (PI / 2.0, 1.0)] {
            let requested = Sky {
                elevation,
                azimuth,
                turbidity: 2.0,
            };
            let air = Air::of(&requested);
            let image = sky(&requested);
            // At normal incidence, from directions within twice the sun's radius.
            let sun_irradiance: DVec3 = {
                let mut sum = DVec3::ZERO;
                for (i, texel) in texels(&image).iter().enumerate() {
                    let (row, column) = (i / WIDTH, i % WIDTH);
                    let (angle, azimuth_angle) = ((row as f64 + 0.5) * ROW_ANGLE, super::azimuth(column as f64 + 0.5));
                    let direction = DVec3::new(
                        angle.sin() * azimuth_angle.cos(),
                        angle.sin() * azimuth_angle.sin(),
                        angle.cos(),
                    );
                    if direction.dot(air.sun) > (2.0 * SUN_RADIUS).cos() {
                        sum += DVec3::from_array(texel.map(f64::from)) * solid_angle(row);
                    }
                }
                sum
            };
            let expected = SOLAR_IRRADIANCE * air.transmittance;
            let ratio = sun_irradiance / expected;
            assert!((ratio - DVec3::ONE).abs().max_element() < 0.01, "{ratio}");
        }
    }
}
