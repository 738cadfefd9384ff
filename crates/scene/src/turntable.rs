//! Turntables: camera orbits around the target point.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::problem::Problem;
use super::{CameraDescription, CameraKeyDescription, CameraPathDescription, Interpolation};

/// Maximum number of frames of an orbit.
pub(super) const MAX_FRAMES: u32 = 100_000;

/// Replaces a camera's path by an orbit around its target point, counter-clockwise as seen from `up`. The camera has
/// the original position in frame 1, and would return to this position in the frame after the last. Each frame has its
/// own key, so that the camera is exactly on the circle.
pub(super) fn with_orbit(camera: &CameraDescription, frames: u32) -> Result<CameraDescription, Problem> {
    if !(1..=MAX_FRAMES).contains(&frames) {
        return Err(Problem::new(format!("{frames} must be from 1 to {MAX_FRAMES}")));
    }
    let (position, look_at, up) = match camera {
        CameraDescription::Perspective(camera) => (camera.position, camera.look_at, camera.up),
        CameraDescription::Orthographic(camera) => (camera.position, camera.look_at, camera.up),
        CameraDescription::Panorama(_) => {
            let rule = "does not apply to a panorama camera, which has no orbit";
            return Err(Problem::new(rule));
        }
    };
    let offset = position - look_at;
    let key = |i: u32| {
        let rotation = rotation(up, f64::from(i) / f64::from(frames));
        let key_position = if i == 0 { position } else { look_at + rotation * offset };
        CameraKeyDescription {
            position: Some(key_position),
            ..CameraKeyDescription::new(f64::from(i) + 1.0)
        }
    };
    let path = CameraPathDescription::new(Interpolation::Linear, (0..frames).map(key));
    Ok(camera.clone().with_path(path))
}

/// Returns the rotation by a fraction of a full turn.
fn rotation(axis: DVec3, fraction: f64) -> DQuat {
    DQuat::from_axis_angle(axis.normalize_or(DVec3::Z), fraction * TAU)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera_path::CameraPath;
    use crate::{OrthographicDescription, PanoramaDescription, PerspectiveDescription};

    #[test]
    fn frames_lie_on_a_circle_about_up() {
        for (up, position) in [
            (DVec3::Z, DVec3::new(3.0, -4.0, 2.5)),
            (DVec3::Y * 7.0, DVec3::new(1.0, 2.0, 8.0)),
        ] {
            let look_at = DVec3::new(0.5, 0.25, 1.0);
            let camera = PerspectiveDescription {
                up,
                ..PerspectiveDescription::new(position, look_at, 40.0)
            };
            let orthographic = OrthographicDescription {
                up,
                ..OrthographicDescription::new(position, look_at, 4.0)
            };
            for camera in [CameraDescription::from(camera), orthographic.into()] {
                for frames in [1, 2, 3, 36, 100] {
                    let orbiting = with_orbit(&camera, frames).unwrap();
                    let path = CameraPath::of(&orbiting).unwrap();
                    assert_eq!(path.frames(), (1.0, f64::from(frames)));
                    let camera_at = |frame: u32| path.at(frame.into()).unwrap();
                    assert_eq!(
                        camera_at(1),
                        camera.validate().unwrap(),
                        "the first frame differs from the original view"
                    );
                    let axis = up.normalize();
                    let radial = |p: DVec3| (p - look_at) - axis * (p - look_at).dot(axis);
                    for frame in 1..=frames {
                        let current = camera_at(frame);
                        assert_eq!(
                            (current.look_at, current.projection),
                            (look_at, camera_at(1).projection)
                        );
                        let height = (current.position - position).dot(axis);
                        let radii = [current.position, position].map(|p| radial(p).length());
                        assert!(
                            height.abs() < 1e-12 && (radii[0] - radii[1]).abs() < 1e-12,
                            "{current:?}"
                        );
                        let next = camera_at(if frame == frames { 1 } else { frame + 1 });
                        let (a, b) = (radial(current.position), radial(next.position));
                        let angle = a.cross(b).dot(axis).atan2(a.dot(b));
                        let expected = TAU / f64::from(frames);
                        let difference = (angle - expected).rem_euclid(TAU);
                        assert!(difference.min(TAU - difference) < 1e-9, "{frame} of {frames}: {angle}");
                    }
                }
            }
        }
    }

    #[test]
    fn invalid_turntables_are_rejected() {
        let error = |camera: CameraDescription, frames| with_orbit(&camera, frames).unwrap_err().to_string();
        let camera = || PerspectiveDescription::new([0.0, -1.0, 0.0], [0.0; 3], 40.0).into();
        assert_eq!(error(camera(), 0), "0 must be from 1 to 100000");
        assert_eq!(error(camera(), 100_001), "100001 must be from 1 to 100000");
        with_orbit(&camera(), 100_000).unwrap();
        let panorama = PanoramaDescription::new([0.0, -1.0, 0.0], [0.0; 3]).into();
        assert!(error(panorama, 4).starts_with("does not apply to a panorama camera"));
    }
}
