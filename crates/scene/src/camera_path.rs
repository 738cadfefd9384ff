//! Animated cameras.

use glam::DVec3;

use super::spline::{Key, value};
use super::{CameraDescription, CameraKeyDescription, Interpolation};

/// The path of a scene's camera.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// The camera without its path, for values that have no keys.
    base: CameraDescription,
    interpolation: Interpolation,
    position: Vec<Key<DVec3>>,
    look_at: Vec<Key<DVec3>>,
    up: Vec<Key<DVec3>>,
    /// Field of view in degrees, or height in scene units.
    extent: Vec<Key<f64>>,
    aperture: Vec<Key<f64>>,
    focus_distance: Vec<Key<f64>>,
    frames: (f64, f64),
    /// The name of the scene file, and the line of the path.
    pub(crate) location: Option<(String, usize)>,
}

impl CameraPath {
    /// Returns the path of a validated camera; `None` if the camera has no path.
    pub(super) fn of(camera: &CameraDescription) -> Option<CameraPath> {
        let path = camera.path()?;
        let (first, last) = (path.keys.first()?, path.keys.last()?);
        let extent = |key: &CameraKeyDescription| match camera {
            CameraDescription::Perspective(_) => key.fov,
            CameraDescription::Orthographic(_) => key.height,
            CameraDescription::Panorama(_) => None,
        };
        Some(CameraPath {
            base: camera.clone().with_path(None),
            interpolation: path.interpolation,
            position: keys(&path.keys, |key| key.position),
            look_at: keys(&path.keys, |key| key.look_at),
            up: keys(&path.keys, |key| key.up),
            extent: keys(&path.keys, extent),
            aperture: keys(&path.keys, |key| key.aperture),
            focus_distance: keys(&path.keys, |key| key.focus_distance),
            frames: (first.frame, last.frame),
            location: None,
        })
    }

    /// Returns the frames of the first and last key. The camera does not move before the first or after the last of
    /// these frames.
    pub fn frames(&self) -> (f64, f64) {
        self.frames
    }

    pub(super) fn set_location(&mut self, origin: &str, line: usize) {
        self.location = Some((origin.to_owned(), line));
    }

    /// Returns the camera at a frame without validating it.
    pub(crate) fn description(&self, frame: f64) -> CameraDescription {
        let mut camera = self.base.clone();
        let interpolate = |keys: &[Key<f64>]| value(keys, frame, self.interpolation);
        let (position, look_at, up) = match &mut camera {
            CameraDescription::Perspective(c) => {
                c.fov = interpolate(&self.extent).unwrap_or(c.fov);
                if let Some(aperture) = interpolate(&self.aperture) {
                    // `aperture` and `f_number` both define the lens diameter, so the interpolated aperture replaces
                    // `f_number`.
                    (c.aperture, c.f_number) = (Some(aperture), None);
                }
                c.focus_distance = interpolate(&self.focus_distance).or(c.focus_distance);
                (&mut c.position, &mut c.look_at, &mut c.up)
            }
            CameraDescription::Orthographic(c) => {
                c.height = interpolate(&self.extent).unwrap_or(c.height);
                (&mut c.position, &mut c.look_at, &mut c.up)
            }
            CameraDescription::Panorama(c) => (&mut c.position, &mut c.look_at, &mut c.up),
        };
        for (target, keys) in [(position, &self.position), (look_at, &self.look_at), (up, &self.up)] {
            *target = value(keys, frame, self.interpolation).unwrap_or(*target);
        }
        camera
    }
}

fn keys<T>(keys: &[CameraKeyDescription], value: impl Fn(&CameraKeyDescription) -> Option<T>) -> Vec<Key<T>> {
    let frame_and_value = |key: &CameraKeyDescription| Some((key.frame, value(key)?));
    keys.iter().filter_map(frame_and_value).collect()
}
