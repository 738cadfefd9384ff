//! Options for a model file that is rendered without a scene file: the up axis, the automatic camera, and a ground.

use std::fmt;
use std::str::FromStr;

use glam::{DMat3, DVec3};

use super::problem::Problem;
use super::{
    Description, DiffuseDescription, DiskDescription, Framing, Orbit, Rotation, RotationAbout, Scene, ShapeDescription,
    View,
};

/// Range of the automatic camera's field of view, in degrees.
const FOVS: (f64, f64) = (1.0, 170.0);
/// Name of the material of the ground.
const GROUND: &str = "ground";
/// The albedo of the ground.
const GRAY: [f64; 3] = [0.5; 3];
/// The radius of the ground, relative to the diagonal of the model's bounds. The ground has to receive the long shadows
/// of low lights.
const RADIUS: f64 = 5.0;
/// The gap between ground and model, relative to the diagonal of the model's bounds, so that no face coincides with the
/// ground.
const GAP: f64 = 1e-4;

/// Options for a model file that is rendered without a scene file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Presentation {
    /// The vertical field of view of the automatic camera, from 1 to 170 degrees.
    pub fov: Option<f64>,
    /// The direction from which the automatic camera looks, instead of a [`View`].
    pub orbit: Option<Orbit>,
    /// The up axis of the file, instead of the axis that the file format defines.
    pub up: Option<UpAxis>,
    /// True to put a disk below the model.
    pub ground: bool,
}

impl Presentation {
    /// Returns the name of the first option that is set.
    pub(super) fn first_option(&self) -> Option<&'static str> {
        self.camera_option()
            .or(self.orbit.map(|_| "orbit"))
            .or(self.ground.then_some("ground"))
    }

    /// Returns the name of the first option that is set and only adjusts the automatic camera.
    pub(super) fn camera_option(&self) -> Option<&'static str> {
        self.fov.map(|_| "fov").or(self.up.map(|_| "up"))
    }

    pub(super) fn framing(&self, view: Option<View>, aspect: f64) -> Result<Framing, Problem> {
        if let Some(fov) = self.fov
            && !(FOVS.0..=FOVS.1).contains(&fov)
        {
            let (low, high) = FOVS;
            return Err(Problem::of(
                "fov",
                format!("{fov} must be from {low} to {high} degrees"),
            ));
        }
        Ok(Framing {
            orbit: self.orbit,
            fov: self.fov,
            ..Framing::new(view.unwrap_or_default(), aspect)
        })
    }

    /// Adds the ground below these points, if requested.
    pub(super) fn add_ground(&self, description: &mut Description, points: &[DVec3]) {
        if !self.ground {
            return;
        }
        let (low, high) = points
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| {
                (low.min(*point), high.max(*point))
            });
        let size = (high - low).length();
        if !(size > 0.0) {
            return;
        }
        let center = (0.5 * (low + high)).with_z(low.z - GAP * size);
        let disk = DiskDescription::new(GROUND, center, RADIUS * size, DVec3::Z);
        description.shapes.push(ShapeDescription::Disk(disk));
        let material = DiffuseDescription::new(GRAY);
        description.materials.insert(GROUND.to_owned(), material.into());
    }
}

impl Presentation {
    /// Returns a warning if the camera is below the ground.
    pub(super) fn ground_warning(&self, scene: &Scene) -> Option<String> {
        let ground = self.ground.then(|| scene.ground()).flatten()?;
        let (low, _) = scene.shapes[ground].geometry.bounds()?;
        let warning =
            "the camera is below the ground, which hides the model; choose a view from above, or leave out the ground";
        (scene.camera.position.z < low.z).then(|| warning.to_owned())
    }
}

impl Scene {
    /// Returns the index of the ground among the shapes.
    fn ground(&self) -> Option<usize> {
        let is_ground = |material: usize| self.material_names.get(material).is_some_and(|name| name == GROUND);
        self.shapes.iter().position(|shape| is_ground(shape.material))
    }

    /// Copies the ground from another frame, so that the ground does not move while the model is animated.
    pub fn keep_ground(&mut self, before: &Scene) {
        if let (Some(ground), Some(ground_before)) = (self.ground(), before.ground()) {
            self.shapes[ground].geometry = before.shapes[ground_before].geometry.clone();
        }
    }
}

/// A coordinate axis of a model file, in its positive or negative direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UpAxis {
    /// 0 is x, 1 is y, 2 is z.
    axis: usize,
    is_negative: bool,
}

impl UpAxis {
    /// Returns the rotation, in scene space, that turns this axis to +z; `None` if it already is +z there. `to_scene`
    /// maps directions of the file to the scene. An axis that is -z in the scene is turned about y, the axis from front
    /// to back, so that the front stays in front.
    pub(super) fn rotation(self, to_scene: impl Fn(DVec3) -> DVec3) -> Option<(Rotation, DMat3)> {
        let sign = if self.is_negative { -1.0 } else { 1.0 };
        let up = to_scene(DVec3::AXES[self.axis] * sign);
        let (axis, degrees) = match (up.x.round(), up.y.round(), up.z.round()) {
            (1.0, ..) => (DVec3::Y, -90.0),
            (-1.0, ..) => (DVec3::Y, 90.0),
            (_, 1.0, _) => (DVec3::X, 90.0),
            (_, -1.0, _) => (DVec3::X, -90.0),
            (.., -1.0) => (DVec3::Y, 180.0),
            _ => return None,
        };
        let matrix = DMat3::from_axis_angle(axis, f64::to_radians(degrees));
        // Removes rounding errors: the exact elements are 0, 1 and -1.
        let matrix = DMat3::from_cols(matrix.x_axis.round(), matrix.y_axis.round(), matrix.z_axis.round());
        Some((Rotation::About(RotationAbout { axis, degrees }), matrix))
    }
}

impl FromStr for UpAxis {
    type Err = String;

    fn from_str(text: &str) -> Result<UpAxis, String> {
        let (is_negative, name) = match text.strip_prefix('-') {
            Some(name) => (true, name),
            None => (false, text.strip_prefix('+').unwrap_or(text)),
        };
        let axis = ["x", "y", "z"]
            .iter()
            .position(|axis_name| name.eq_ignore_ascii_case(axis_name));
        let axis = axis.ok_or("must be x, y, z, -x, -y or -z")?;
        Ok(UpAxis { axis, is_negative })
    }
}

impl fmt::Display for UpAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.is_negative { "-" } else { "" };
        write!(f, "{sign}{}", ["x", "y", "z"][self.axis])
    }
}
