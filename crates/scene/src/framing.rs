//! The automatic camera, which frames the entire scene from a direction.

use std::str::FromStr;

use glam::DVec3;

use super::PerspectiveDescription;

/// Vertical field of view in degrees, except in wide images.
const FOV: f64 = 35.0;
/// Maximum aspect ratio with a vertical field of view of [`FOV`]. Wider images have a constant horizontal field of
/// view, because perspective would stretch the sides of wider views.
const MAX_ASPECT: f64 = 2.0;
/// Fraction of the width or height that the scene fills: the margins are 5 % on each side.
const FILL: f64 = 0.9;
/// Minimum distance from the camera to the nearest point, relative to the scene's extent; only relevant for scenes that
/// are elongated along the view direction.
const MIN_DISTANCE: f64 = 0.1;
/// Range of the diagonal of a framed scene's bounding box, in scene units. The range keeps distances and coordinates
/// within their limits.
const EXTENTS: (f64, f64) = (1e-8, 4e8);
/// Minimum elevation in degrees of a view that counts as vertical, where the vertical axis cannot be up in the image.
const MIN_VERTICAL_ELEVATION: f64 = 89.9;

/// The side from which a scene is seen. The front is towards -y and the top towards +z, as in imported glTF files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum View {
    /// From the front, a little from the right and from above.
    #[default]
    Corner,
    /// From the front.
    Front,
    /// From behind.
    Back,
    /// From the left, as seen by a viewer in front.
    Left,
    /// From the right, as seen by a viewer in front.
    Right,
    /// From above; the front is at the image's lower edge.
    Top,
    /// From below; the front is at the image's upper edge.
    Bottom,
    /// Isometric: equally from the front, the right and above.
    Iso,
}

impl View {
    /// All views.
    pub const ALL: [View; 8] = [
        View::Corner,
        View::Front,
        View::Back,
        View::Left,
        View::Right,
        View::Top,
        View::Bottom,
        View::Iso,
    ];

    /// Returns the name in command-line options.
    pub const fn name(self) -> &'static str {
        match self {
            View::Corner => "corner",
            View::Front => "front",
            View::Back => "back",
            View::Left => "left",
            View::Right => "right",
            View::Top => "top",
            View::Bottom => "bottom",
            View::Iso => "iso",
        }
    }

    /// Returns the direction to the camera (not normalized), and the up direction of the image.
    fn direction(self) -> (DVec3, DVec3) {
        let upright = |x: f64, y: f64, z: f64| (DVec3::new(x, y, z), DVec3::Z);
        match self {
            // 30 degrees to the right and 20 degrees upwards. At 15 degrees upwards, the top of a cube would be
            // edge-on.
            View::Corner => upright(0.5, -0.866_025_403_784, 0.363_970_234_266),
            View::Front => upright(0.0, -1.0, 0.0),
            View::Back => upright(0.0, 1.0, 0.0),
            View::Left => upright(-1.0, 0.0, 0.0),
            View::Right => upright(1.0, 0.0, 0.0),
            View::Top => (DVec3::Z, DVec3::Y),
            View::Bottom => (DVec3::NEG_Z, DVec3::NEG_Y),
            View::Iso => upright(1.0, -1.0, 1.0),
        }
    }
}

/// The direction from the scene to the camera, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Rotation about the vertical axis, -360 to 360: 0 is the front, and 90 is the right.
    pub azimuth: f64,
    /// The angle above the horizon, from -90 to 90.
    pub elevation: f64,
}

impl Orbit {
    /// Returns the direction to the camera, and the up direction of the image.
    fn direction(self) -> (DVec3, DVec3) {
        let (sin, cos) = self.azimuth.to_radians().sin_cos();
        let (elevation_sin, elevation_cos) = self.elevation.to_radians().sin_cos();
        let to_camera = DVec3::new(sin * elevation_cos, -cos * elevation_cos, elevation_sin);
        // From straight above or below, the top of the image is towards the back or the front of the scene.
        match self.elevation.abs() < MIN_VERTICAL_ELEVATION {
            true => (to_camera, DVec3::Z),
            false => (to_camera, DVec3::new(-sin, cos, 0.0) * elevation_sin.signum()),
        }
    }
}

impl FromStr for Orbit {
    type Err = String;

    /// Parses `AZIMUTH,ELEVATION`.
    fn from_str(text: &str) -> Result<Orbit, String> {
        let rule = "must be AZIMUTH,ELEVATION in degrees, such as 30,15";
        let (azimuth, elevation) = text.split_once(',').ok_or(rule)?;
        let parse = |text: &str| text.trim().parse::<f64>().map_err(|_| rule.to_owned());
        let orbit = Orbit {
            azimuth: parse(azimuth)?,
            elevation: parse(elevation)?,
        };
        let is_within = |x: f64, limit: f64| (-limit..=limit).contains(&x);
        match (is_within(orbit.azimuth, 360.0), is_within(orbit.elevation, 90.0)) {
            (false, _) => Err(format!("the azimuth, {}, must be from -360 to 360", orbit.azimuth)),
            (_, false) => Err(format!("the elevation, {}, must be from -90 to 90", orbit.elevation)),
            _ => Ok(orbit),
        }
    }
}

/// Settings of the automatic camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// The view of the scene.
    pub view: View,
    /// A direction that replaces the direction of `view`.
    pub orbit: Option<Orbit>,
    /// The vertical field of view in degrees. If absent, 35, or less if the image is more than twice as wide as high.
    pub fov: Option<f64>,
    /// Width of the image, divided by its height.
    pub aspect: f64,
    /// True to keep the entire scene in the image while the camera orbits the scene's center.
    pub turns: bool,
}

impl Framing {
    /// Creates settings for a view, with the default field of view.
    pub fn new(view: View, aspect: f64) -> Framing {
        Framing {
            view,
            orbit: None,
            fov: None,
            aspect,
            turns: false,
        }
    }

    fn direction(&self) -> (DVec3, DVec3) {
        self.orbit.map_or(self.view.direction(), Orbit::direction)
    }
}

/// Checks that a model's extent is within the limits of the automatic camera. Returns the violated rule as the error.
pub fn check_extent(points: impl Iterator<Item = DVec3>) -> Result<(), String> {
    let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    let size = (high - low).length();
    let (min, max) = EXTENTS;
    match size > 0.0 && low.x <= high.x && !(min..=max).contains(&size) {
        true => Err(format!(
            "the diagonal of the model's bounds is {size:.3e} units; the automatic camera needs {min:e} to {max:e}: scale the model"
        )),
        false => Ok(()),
    }
}

/// Returns the nearest camera that sees all points with equal margins on opposite sides. Without points, the camera
/// frames the origin.
pub fn framed(points: impl Iterator<Item = DVec3> + Clone, framing: Framing) -> PerspectiveDescription {
    let (to_camera, up) = framing.direction();
    let forward = -to_camera.normalize();
    let right = forward.cross(up).normalize();
    let upwards = right.cross(forward);
    let tan_y = match framing.fov {
        Some(fov) => (fov.to_radians() / 2.0).tan(),
        None => (FOV.to_radians() / 2.0).tan() * (MAX_ASPECT / framing.aspect).min(1.0),
    };
    let tan_x = tan_y * framing.aspect;
    let (low, high) = points
        .clone()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    if !(low.x <= high.x) {
        return framed(std::iter::once(DVec3::ZERO), framing);
    }
    let center = 0.5 * low + 0.5 * high;
    let extent = Extent {
        points: &points,
        center,
        axis: framing.turns.then_some(up),
    };
    let support = |n: DVec3| extent.support(n, DVec3::ZERO).0;
    // A point p does not exceed the right margin if right . (p - camera) <= w forward . (p - camera). The inequalities
    // of the other margins have -right, upwards or -upwards in place of right.
    let (w, h) = (FILL * tan_x, FILL * tan_y);
    let width = support(right - w * forward) + support(-right - w * forward);
    let height = support(upwards - h * forward) + support(-upwards - h * forward);
    let (far_depth, near_depth) = (support(forward), support(-forward));
    let size = (high - low).length();
    let min_distance = if size > 0.0 { MIN_DISTANCE * size } else { 1.0 };
    let distance = (width / (2.0 * w))
        .max(height / (2.0 * h))
        .max(near_depth + min_distance);
    let offset_up = extent.offset(upwards, forward, distance);
    let (offset_right, target_ahead) = match framing.turns {
        true => (0.0, offset_up * up.dot(forward) / up.dot(upwards)), // the target point lies on the axis
        false => (extent.offset(right, forward, distance), (far_depth - near_depth) / 2.0),
    };
    let offset = right * offset_right + upwards * offset_up;
    let fov = 2.0 * tan_y.atan().to_degrees();
    PerspectiveDescription {
        up,
        ..PerspectiveDescription::new(
            center + offset - forward * distance,
            center + offset + forward * target_ahead,
            fov,
        )
    }
}

/// Maximum number of Newton steps of [`Extent::offset`], which needs far fewer.
const MAX_STEPS: usize = 64;

/// The extent of points relative to the center of their bounding box.
struct Extent<'a, I> {
    points: &'a I,
    center: DVec3,
    /// Axis of rotation, if any. Each point then represents its circle around the axis.
    axis: Option<DVec3>,
}

impl<I: Iterator<Item = DVec3> + Clone> Extent<'_, I> {
    /// Returns the support function of the points at `n` (the maximum of `p . n` over all points `p`), and the
    /// derivative of the function along `step`.
    fn support(&self, n: DVec3, step: DVec3) -> (f64, f64) {
        let point_support = |point: DVec3| {
            let p = point - self.center;
            let Some(axis) = self.axis else {
                return (p.dot(n), p.dot(step));
            };
            let perpendicular = |v: DVec3| v - axis * v.dot(axis);
            let (radius, length) = (perpendicular(p).length(), perpendicular(n).length());
            let slope = if length > 0.0 {
                perpendicular(n).dot(step) / length
            } else {
                0.0
            };
            let height = p.dot(axis);
            (
                radius * length + height * n.dot(axis),
                radius * slope + height * step.dot(axis),
            )
        };
        let farther = |a: (f64, f64), b: (f64, f64)| if b.0 > a.0 { b } else { a };
        self.points
            .clone()
            .map(point_support)
            .fold((f64::NEG_INFINITY, 0.0), farther)
    }

    /// Returns the offset along `side` of a camera at distance `distance` that makes both margins along `side` equal.
    ///
    /// Let w be the tangent of half of the angle that the points subtend at the camera. The points touch both planes
    /// that bound the angle: `support(side - w forward) + support(-side - w forward) = 2 w distance`. The left-hand
    /// side minus the right-hand side is convex and decreasing in w, so Newton's method, started at w = 0, converges to
    /// the root from below.
    fn offset(&self, side: DVec3, forward: DVec3, distance: f64) -> f64 {
        let (mut w, mut offset) = (0.0, 0.0);
        for _ in 0..MAX_STEPS {
            let (right, right_slope) = self.support(side - w * forward, -forward);
            let (left, left_slope) = self.support(-side - w * forward, -forward);
            offset = (right - left) / 2.0;
            let step = (right + left - 2.0 * w * distance) / (2.0 * distance - right_slope - left_slope);
            if !(step > 1e-12 * w) {
                break;
            }
            w += step;
        }
        offset
    }
}

#[cfg(test)]
mod tests;
