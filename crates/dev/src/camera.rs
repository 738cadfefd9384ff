//! Interactive moves of a camera, and its text in a scene file.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use wgray_scene::CameraDescription;

/// A camera move, as the page sends it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Move {
    /// Orbits around the look-at point: the scene appears to rotate to the right and upwards, by angles in radians.
    Orbit(f64, f64),
    /// Pans: the scene appears to move to the right and upwards by these distances, in image heights.
    Pan(f64, f64),
    /// Moves towards the look-at point. The value is the logarithm of the factor by which the scene appears larger.
    Dolly(f64),
    /// Moves without turning: to the right, upwards and forwards, in multiples of the distance to the look-at point.
    Fly(f64, f64, f64),
    /// Turns the camera without moving it: angles to the right and upwards, in radians.
    #[serde(rename = "look")]
    Turn(f64, f64),
}

/// The viewpoint of a camera, as stored in a bookmark.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Viewpoint {
    /// The position.
    pub position: DVec3,
    /// The point that the camera looks at.
    pub look_at: DVec3,
    /// The up direction.
    pub up: DVec3,
    /// The vertical field of view in degrees, or the height of an orthographic view; `None` for a panorama.
    pub extent: Option<f64>,
}

impl Viewpoint {
    /// Returns the viewpoint of a camera.
    pub fn of(camera: &CameraDescription) -> Viewpoint {
        let Pose {
            position, look_at, up, ..
        } = pose(camera);
        let extent = match camera {
            CameraDescription::Perspective(c) => Some(c.fov),
            CameraDescription::Orthographic(c) => Some(c.height),
            CameraDescription::Panorama(_) => None,
        };
        Viewpoint {
            position,
            look_at,
            up,
            extent,
        }
    }
}

/// Returns the camera with another viewpoint.
///
/// # Errors
///
/// The rule that the resulting camera violates.
pub fn with_viewpoint(camera: &CameraDescription, viewpoint: Viewpoint) -> Result<CameraDescription, String> {
    let Viewpoint {
        position,
        look_at,
        up,
        extent,
    } = viewpoint;
    let mut new = camera.clone();
    match &mut new {
        CameraDescription::Perspective(c) => {
            (c.position, c.look_at, c.up, c.fov) = (position, look_at, up, extent.unwrap_or(c.fov));
        }
        CameraDescription::Orthographic(c) => {
            (c.position, c.look_at, c.up, c.height) = (position, look_at, up, extent.unwrap_or(c.height));
        }
        CameraDescription::Panorama(c) => (c.position, c.look_at, c.up) = (position, look_at, up),
    }
    match new.validate() {
        Ok(_) => Ok(new),
        Err(problem) => Err(format!("camera: {problem}")),
    }
}

/// Returns a camera that keeps the view direction of `camera`, looks at the center of a sphere, and shows the full
/// sphere.
pub fn framed(camera: &CameraDescription, center: DVec3, radius: f64) -> CameraDescription {
    let Pose { position, look_at, .. } = pose(camera);
    let back = (position - look_at).normalize_or_zero();
    let radius = radius.max(f64::MIN_POSITIVE);
    let mut viewpoint = Viewpoint::of(camera);
    let distance = match camera {
        // At a factor of 1, the sphere touches the view cone; 1.25 adds a margin.
        CameraDescription::Perspective(c) => 1.25 * radius / (c.fov.to_radians() / 2.0).sin(),
        CameraDescription::Orthographic(_) => {
            viewpoint.extent = Some(2.5 * radius);
            (position - look_at).length().max(2.0 * radius)
        }
        CameraDescription::Panorama(_) => 2.0 * radius,
    };
    (viewpoint.look_at, viewpoint.position) = (rounded(center, distance), rounded(center + back * distance, distance));
    with_viewpoint(camera, viewpoint).unwrap_or_else(|_| camera.clone())
}

/// Minimum angle between the view direction and the up direction or its opposite, in radians.
const MIN_POLE_ANGLE: f64 = 0.02;
/// Significant digits of camera coordinates, relative to the distance. Further digits have no visible effect and make
/// the text hard to read.
const DIGITS: i32 = 5;

/// Position and orientation of a camera of any kind.
struct Pose {
    position: DVec3,
    look_at: DVec3,
    up: DVec3,
    /// The image height at the distance of the look-at point.
    span: f64,
}

fn pose(camera: &CameraDescription) -> Pose {
    match camera {
        CameraDescription::Perspective(c) => Pose {
            position: c.position,
            look_at: c.look_at,
            up: c.up,
            span: 2.0 * (c.fov.to_radians() / 2.0).tan() * c.position.distance(c.look_at),
        },
        CameraDescription::Orthographic(c) => Pose {
            position: c.position,
            look_at: c.look_at,
            up: c.up,
            span: c.height,
        },
        CameraDescription::Panorama(c) => Pose {
            position: c.position,
            look_at: c.look_at,
            up: c.up,
            span: std::f64::consts::PI * c.position.distance(c.look_at),
        },
    }
}

/// Returns the moved camera, or the unchanged camera if the moved one is invalid.
pub fn moved(camera: &CameraDescription, camera_move: Move) -> CameraDescription {
    let mut new = camera.clone();
    let Pose {
        mut position,
        mut look_at,
        up,
        span,
    } = pose(camera);
    let up = up.normalize();
    let offset = position - look_at;
    let right = (-offset).cross(up).normalize();
    match camera_move {
        Move::Orbit(x, y) => {
            let rotated_offset = DQuat::from_axis_angle(up, -x) * offset;
            let right = DQuat::from_axis_angle(up, -x) * right;
            let angle = rotated_offset.angle_between(up);
            // A higher viewpoint has a smaller angle to the up direction.
            let new_angle = (angle - y).clamp(MIN_POLE_ANGLE, std::f64::consts::PI - MIN_POLE_ANGLE);
            position = look_at + DQuat::from_axis_angle(right, new_angle - angle) * rotated_offset;
        }
        Move::Pan(x, y) => {
            let upwards = right.cross(-offset).normalize();
            let shift = (right * -x + upwards * -y) * span;
            position += shift;
            look_at += shift;
        }
        Move::Dolly(amount) => position = look_at + offset * (-amount).exp(),
        Move::Fly(x, y, z) => {
            let forwards = -offset.normalize();
            let shift = (right * x + right.cross(forwards) * y + forwards * z) * offset.length();
            position += shift;
            look_at += shift;
        }
        Move::Turn(x, y) => {
            let forwards = DQuat::from_axis_angle(up, -x) * -offset;
            let right = DQuat::from_axis_angle(up, -x) * right;
            let angle = forwards.angle_between(up);
            let new_angle = (angle - y).clamp(MIN_POLE_ANGLE, std::f64::consts::PI - MIN_POLE_ANGLE);
            look_at = position + DQuat::from_axis_angle(right, angle - new_angle) * forwards;
        }
    }
    let scale = position.distance(look_at);
    match &mut new {
        CameraDescription::Perspective(c) => {
            (c.position, c.look_at) = (rounded(position, scale), rounded(look_at, scale));
        }
        CameraDescription::Panorama(c) => {
            (c.position, c.look_at) = (rounded(position, scale), rounded(look_at, scale));
        }
        CameraDescription::Orthographic(c) => {
            if let Move::Dolly(amount) = camera_move {
                // An orthographic view does not depend on the distance.
                c.height = round(c.height * (-amount).exp(), c.height);
            } else {
                (c.position, c.look_at) = (rounded(position, scale), rounded(look_at, scale));
            }
        }
    }
    if new.validate().is_ok() { new } else { camera.clone() }
}

/// Minimum and maximum distance to the look-at point after a dolly move, as factors of the file camera's distance.
const DOLLY_RANGE: [f64; 2] = [0.01, 1000.0];

/// Dollies like [`moved`], but within [`DOLLY_RANGE`]. At the near bound, the look-at point moves together with the
/// camera; at the far bound, the camera stops.
pub fn dollied(camera: &CameraDescription, amount: f64, file: &CameraDescription) -> CameraDescription {
    let extent = |camera: &CameraDescription| match camera {
        CameraDescription::Orthographic(c) => c.height,
        camera => {
            let Pose { position, look_at, .. } = pose(camera);
            position.distance(look_at)
        }
    };
    let [near, far] = DOLLY_RANGE.map(|factor| factor * extent(file));
    let current = extent(camera);
    let requested = current * (-amount).exp();
    let clamped = requested.max(near.min(current)).min(far.max(current));
    let dollied = moved(camera, Move::Dolly((current / clamped).ln()));
    if requested < clamped && !matches!(camera, CameraDescription::Orthographic(_)) {
        return moved(&dollied, Move::Fly(0.0, 0.0, 1.0 - requested / clamped));
    }
    dollied
}

/// Applies the edits of the file's camera, from `old` to `new`, to a moved camera. Returns `None` if the result equals
/// `new` or is invalid, or if the kind of camera changed.
pub fn merged(
    moved: &CameraDescription,
    old: &CameraDescription,
    new: &CameraDescription,
) -> Option<CameraDescription> {
    let mut merged = moved.clone();
    match (&mut merged, old, new) {
        (
            CameraDescription::Perspective(c),
            CameraDescription::Perspective(old),
            CameraDescription::Perspective(new),
        ) => {
            apply_edit(&mut c.position, &old.position, &new.position);
            apply_edit(&mut c.look_at, &old.look_at, &new.look_at);
            apply_edit(&mut c.up, &old.up, &new.up);
            apply_edit(&mut c.fov, &old.fov, &new.fov);
            // Moves never change the lens, so the file's values apply.
            (c.focal_length, c.aperture, c.f_number) = (new.focal_length, new.aperture, new.f_number);
            (c.focus_distance, c.blades, c.blade_rotation) = (new.focus_distance, new.blades, new.blade_rotation);
            c.path.clone_from(&new.path);
        }
        (
            CameraDescription::Orthographic(c),
            CameraDescription::Orthographic(old),
            CameraDescription::Orthographic(new),
        ) => {
            apply_edit(&mut c.position, &old.position, &new.position);
            apply_edit(&mut c.look_at, &old.look_at, &new.look_at);
            apply_edit(&mut c.up, &old.up, &new.up);
            apply_edit(&mut c.height, &old.height, &new.height);
            c.path.clone_from(&new.path);
        }
        (CameraDescription::Panorama(c), CameraDescription::Panorama(old), CameraDescription::Panorama(new)) => {
            apply_edit(&mut c.position, &old.position, &new.position);
            apply_edit(&mut c.look_at, &old.look_at, &new.look_at);
            apply_edit(&mut c.up, &old.up, &new.up);
            c.path.clone_from(&new.path);
        }
        _ => return None, // the kind of camera changed
    }
    (merged != *new && merged.validate().is_ok()).then_some(merged)
}

fn apply_edit<T: Copy + PartialEq>(value: &mut T, old: &T, new: &T) {
    if old != new {
        *value = *new;
    }
}

fn rounded(point: DVec3, scale: f64) -> DVec3 {
    DVec3::from(point.to_array().map(|x| round(x, scale)))
}

/// Rounds a number to about [`DIGITS`] significant digits, counted from the magnitude of `scale`.
fn round(x: f64, scale: f64) -> f64 {
    let decimals = (DIGITS - scale.log10().floor() as i32).clamp(0, 15) as usize;
    let x = format!("{x:.decimals$}").parse().unwrap_or(x);
    if x == 0.0 { 0.0 } else { x } // no -0
}

/// Returns the keys and values that a move can change, as in a scene file.
pub fn entries(camera: &CameraDescription) -> Vec<(&'static str, Entry)> {
    match camera {
        CameraDescription::Perspective(c) => vec![
            ("position", Entry::Point(c.position)),
            ("look_at", Entry::Point(c.look_at)),
            ("up", Entry::Point(c.up)),
            ("fov", Entry::Number(c.fov)),
        ],
        CameraDescription::Orthographic(c) => vec![
            ("position", Entry::Point(c.position)),
            ("look_at", Entry::Point(c.look_at)),
            ("up", Entry::Point(c.up)),
            ("height", Entry::Number(c.height)),
        ],
        CameraDescription::Panorama(c) => vec![
            ("position", Entry::Point(c.position)),
            ("look_at", Entry::Point(c.look_at)),
            ("up", Entry::Point(c.up)),
        ],
    }
}

/// Returns the lens settings that differ from the defaults; moves do not change these settings.
fn settings(camera: &CameraDescription) -> Vec<(&'static str, f64)> {
    let CameraDescription::Perspective(c) = camera else {
        return Vec::new();
    };
    let settings = [
        ("focal_length", (c.focal_length != 1.0).then_some(c.focal_length)),
        ("aperture", c.aperture),
        ("f_number", c.f_number),
        ("focus_distance", c.focus_distance),
        ("blades", (c.blades != 0).then_some(c.blades.into())),
        ("blade_rotation", (c.blade_rotation != 0.0).then_some(c.blade_rotation)),
    ];
    settings
        .into_iter()
        .filter_map(|(key, value)| Some((key, value?)))
        .collect()
}

/// The value of a camera key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    Number(f64),
    Point(DVec3),
}

/// Formats a camera as a section of a scene file.
pub fn text(camera: &CameraDescription) -> String {
    let kind = match camera {
        CameraDescription::Perspective(_) => "",
        CameraDescription::Orthographic(_) => "type = \"orthographic\"\n",
        CameraDescription::Panorama(_) => "type = \"panorama\"\n",
    };
    let entries = entries(camera).into_iter().map(|(key, entry)| match entry {
        Entry::Number(x) => format!("{key} = {x}\n"),
        Entry::Point(p) => format!("{key} = [{}, {}, {}]\n", p.x, p.y, p.z),
    });
    let settings = settings(camera).into_iter().map(|(key, x)| format!("{key} = {x}\n"));
    format!("[camera]\n{kind}{}", entries.chain(settings).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgray_scene::Description;

    fn camera(text: &str) -> CameraDescription {
        let text = format!("image = {{ width = 4, height = 4 }}\n[camera]\n{text}");
        Description::parse(&text, "camera").unwrap().camera
    }

    fn perspective() -> CameraDescription {
        camera("position = [0, -4, 1]\nlook_at = [0, 0, 1]\nfov = 45")
    }

    /// Returns a perspective camera with an aperture, a perspective camera with an f-number, and a panorama.
    fn lens_cameras_and_panorama() -> [CameraDescription; 3] {
        let view = "position = [0, -4, 1]\nlook_at = [0, 0, 1]\n";
        [
            camera(&format!(
                "{view}fov = 45\naperture = 0.1\nfocus_distance = 3\nblades = 5\nblade_rotation = 12.5"
            )),
            camera(&format!("{view}fov = 45\nfocal_length = 0.05\nf_number = 1.4")),
            camera(&format!("type = 'panorama'\n{view}")),
        ]
    }

    fn orthographic() -> CameraDescription {
        camera("type = 'orthographic'\nposition = [3, -4, 1]\nlook_at = [0, 0, 1]\nheight = 2")
    }

    #[test]
    fn an_orbit_keeps_the_distance_and_the_look_at_point() {
        for (x, y) in [(0.3, 0.0), (0.0, 0.5), (-1.0, -0.7), (0.0, 9.0), (0.0, -9.0)] {
            for camera in [perspective(), orthographic()] {
                let (old, new) = (pose(&camera), pose(&moved(&camera, Move::Orbit(x, y))));
                assert_eq!(old.look_at, new.look_at);
                let [before, after] = [&old, &new].map(|pose| pose.position.distance(pose.look_at));
                assert!((before - after).abs() < 1e-4 * before, "{x} {y}: {before} {after}");
                assert_ne!(old.position, new.position);
            }
        }
    }

    #[test]
    fn the_scene_moves_with_the_drag() {
        // A drag to the right moves the camera to the left; a drag down moves it up.
        let dragged_right = pose(&moved(&perspective(), Move::Orbit(0.1, 0.0))).position;
        assert!(dragged_right.x < -0.3, "{dragged_right}");
        let dragged_down = pose(&moved(&perspective(), Move::Orbit(0.0, 0.1))).position;
        assert!(dragged_down.z > 1.3, "{dragged_down}");
        let panned = pose(&moved(&perspective(), Move::Pan(0.5, 0.25)));
        let height = 8.0 * 22.5f64.to_radians().tan();
        assert!(
            panned
                .look_at
                .abs_diff_eq(DVec3::new(-0.5 * height, 0.0, 1.0 - 0.25 * height), 1e-4)
        );
        let near = pose(&moved(&perspective(), Move::Dolly(2f64.ln()))).position;
        assert!(near.abs_diff_eq(DVec3::new(0.0, -2.0, 1.0), 1e-4), "{near}");
        let CameraDescription::Orthographic(near) = moved(&orthographic(), Move::Dolly(2f64.ln())) else {
            panic!()
        };
        assert_eq!(near.height, 1.0);
    }

    #[test]
    fn a_dolly_stays_within_its_distance_bounds() {
        let file = perspective();
        let distance = |camera: &CameraDescription| pose(camera).position.distance(pose(camera).look_at);
        let (mut near, mut far) = (file.clone(), file.clone());
        for _ in 0..80 {
            near = dollied(&near, 0.1, &file);
            far = dollied(&far, -0.1, &file);
        }
        assert!((distance(&near) - 0.04).abs() < 1e-3, "{}", distance(&near));
        let further = dollied(&near, 0.1, &file);
        let step = pose(&further).position.y - pose(&near).position.y;
        assert!((step - 0.04 * 0.095).abs() < 1e-3, "wrong step: {step}");
        assert!((distance(&further) - distance(&near)).abs() < 1e-4);
        assert!(distance(&dollied(&near, -0.1, &file)) > distance(&near));
        assert!(distance(&far) < 4001.0, "{}", distance(&far));
        assert_eq!(distance(&dollied(&far, -0.1, &file)), distance(&far));
        assert!(distance(&dollied(&far, 0.1, &file)) < distance(&far));
        for amount in [1e9, -1e9, f64::NAN] {
            dollied(&file, amount, &file).validate().unwrap();
            dollied(&orthographic(), amount, &orthographic()).validate().unwrap();
        }
    }

    #[test]
    fn flying_keeps_the_direction_and_turning_keeps_the_position() {
        for file in [perspective(), orthographic()] {
            let old = pose(&file);
            let distance = old.position.distance(old.look_at);
            for (x, y, z) in [(0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5), (-0.1, 0.2, -0.3)] {
                let new = pose(&moved(&file, Move::Fly(x, y, z)));
                let shift = new.position - old.position;
                assert!(shift.abs_diff_eq(new.look_at - old.look_at, 1e-3), "{shift}");
                assert!((shift.length() - distance * DVec3::new(x, y, z).length()).abs() < 1e-3 * distance);
                let forwards = (old.look_at - old.position) / distance;
                assert!((shift.dot(forwards) - distance * z).abs() < 1e-3 * distance);
                assert!((shift.dot(forwards.cross(old.up).normalize()) - distance * x).abs() < 1e-3 * distance);
            }
            for (x, y) in [(0.3, 0.0), (0.0, 0.2), (0.0, 9.0), (0.0, -9.0), (-0.4, 0.1)] {
                let new = pose(&moved(&file, Move::Turn(x, y)));
                assert_eq!(new.position, old.position);
                assert!((new.position.distance(new.look_at) - distance).abs() < 1e-4 * distance);
            }
            // Positive angles turn the view to the right and upwards.
            let right = (old.look_at - old.position).cross(old.up).normalize();
            let new = pose(&moved(&file, Move::Turn(0.2, 0.1)));
            assert!((new.look_at - old.look_at).dot(right) > 0.1 * distance);
            assert!((new.look_at - old.look_at).dot(old.up) > 0.05 * distance);
        }
    }

    #[test]
    fn a_framed_sphere_is_centered_and_fits_the_image() {
        let center = DVec3::new(10.0, -3.0, 2.0);
        for radius in [1e-6, 0.5, 1e6] {
            for file in [perspective(), orthographic()] {
                let new = framed(&file, center, radius);
                let (old_pose, new_pose) = (pose(&file), pose(&new));
                assert!(
                    new_pose.look_at.abs_diff_eq(center, 1e-3 * radius.max(1e-3)),
                    "{radius}: {}",
                    new_pose.look_at
                );
                let [old_offset, new_offset] = [&old_pose, &new_pose].map(|pose| pose.look_at - pose.position);
                assert!(
                    old_offset.angle_between(new_offset) < 1e-2,
                    "{radius}: the view direction changed"
                );
                match new {
                    CameraDescription::Perspective(c) => {
                        let angle = 2.0 * (radius / new_offset.length()).asin().to_degrees();
                        assert!(angle < c.fov && angle > 0.6 * c.fov, "{radius}: {angle}");
                    }
                    CameraDescription::Orthographic(c) => assert_eq!(c.height, 2.5 * radius),
                    CameraDescription::Panorama(_) => unreachable!(),
                }
            }
        }
    }

    #[test]
    fn a_camera_can_be_restored_from_its_viewpoint() {
        for file in lens_cameras_and_panorama()
            .into_iter()
            .chain([perspective(), orthographic()])
        {
            let camera = moved(&moved(&file, Move::Orbit(0.3, 0.2)), Move::Dolly(0.4));
            let json = serde_json::to_string(&Viewpoint::of(&camera)).unwrap();
            assert_eq!(
                with_viewpoint(&file, serde_json::from_str(&json).unwrap()).unwrap(),
                camera
            );
        }
        let invalid = Viewpoint {
            look_at: DVec3::new(0.0, -4.0, 1.0),
            ..Viewpoint::of(&perspective())
        };
        assert!(
            with_viewpoint(&perspective(), invalid).is_err(),
            "a camera at its own look-at point is accepted"
        );
    }

    #[test]
    fn moves_keep_the_lens_and_the_kind_of_camera() {
        for file in lens_cameras_and_panorama() {
            for camera_move in [Move::Orbit(0.3, 0.2), Move::Pan(0.1, 0.2), Move::Dolly(0.5)] {
                let new = moved(&file, camera_move);
                assert_ne!(pose(&new).position, pose(&file).position, "{camera_move:?}");
                assert_eq!(std::mem::discriminant(&new), std::mem::discriminant(&file));
                assert_eq!(settings(&new), settings(&file));
                assert_eq!(merged(&new, &file, &file), Some(new));
            }
        }
        let [with_aperture, with_f_number, _] = lens_cameras_and_panorama();
        let orbited = moved(&with_aperture, Move::Orbit(0.3, 0.2));
        let result = merged(&orbited, &with_aperture, &with_f_number).unwrap();
        assert_eq!(settings(&result), settings(&with_f_number), "the edited lens is lost");
        assert_eq!(pose(&result).position, pose(&orbited).position);
    }

    #[test]
    fn moved_cameras_are_valid_and_have_few_digits() {
        let mut camera = perspective();
        for i in 0..1000 {
            camera = moved(&camera, Move::Orbit(0.37, if i % 5 < 3 { 0.11 } else { -0.09 }));
            camera = moved(&camera, Move::Dolly(0.5));
            camera.validate().unwrap();
        }
        for camera_move in [Move::Dolly(1e9), Move::Dolly(-1e9), Move::Pan(1e300, 0.0)] {
            moved(&camera, camera_move).validate().unwrap();
        }
        let text = text(&moved(&perspective(), Move::Orbit(0.3, 0.2)));
        assert_eq!(
            text,
            "[camera]\nposition = [-1.15852, -3.74517, 1.79468]\nlook_at = [0, 0, 1]\nup = [0, 0, 1]\nfov = 45\n"
        );
    }

    #[test]
    fn edits_of_the_file_and_moves_are_merged() {
        let file = perspective();
        let orbited = moved(&file, Move::Orbit(0.3, 0.2));
        let wide = camera("position = [0, -4, 1]\nlook_at = [0, 0, 1]\nfov = 60");
        let result = merged(&orbited, &file, &wide).unwrap();
        assert_eq!(pose(&result).position, pose(&orbited).position);
        assert!(matches!(&result, CameraDescription::Perspective(c) if c.fov == 60.0));
        let path = "position = [0, -4, 1]\nlook_at = [0, 0, 1]\nfov = 45\npath.keys = [{ frame = 1, fov = 40 }]";
        let result = merged(&orbited, &file, &camera(path)).unwrap();
        assert_eq!(pose(&result).position, pose(&orbited).position);
        assert_eq!(
            result.path(),
            camera(path).path(),
            "the camera path of the file is lost"
        );
        let with_new_position = camera("position = [0, -5, 1]\nlook_at = [0, 0, 1]\nfov = 45");
        assert_eq!(
            merged(&orbited, &file, &with_new_position),
            None,
            "a moved position replaces an edited position"
        );
        assert_eq!(
            merged(&orbited, &file, &orbited),
            None,
            "a saved camera still differs from the file"
        );
        assert_eq!(merged(&orbited, &file, &orthographic()), None);
        let along_up = camera("position = [0, -4, 1]\nlook_at = [0, 0, 1]\nup = [1, 0, 0]\nfov = 45");
        let side = camera("position = [4, 0, 1]\nlook_at = [0, 0, 1]\nfov = 45");
        assert_eq!(
            merged(&side, &file, &along_up),
            None,
            "a view along the up direction is accepted"
        );
    }

    #[test]
    fn the_text_of_a_camera_parses_to_the_same_camera() {
        for camera in [perspective(), orthographic()]
            .into_iter()
            .chain(lens_cameras_and_panorama())
        {
            let camera = moved(&camera, Move::Orbit(0.1, 0.2));
            let text = format!("image = {{ width = 4, height = 4 }}\n{}", text(&camera));
            assert_eq!(Description::parse(&text, "camera").unwrap().camera, camera);
        }
    }
}
