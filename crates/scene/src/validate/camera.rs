//! Validation of cameras and their paths.

use glam::DVec3;

use super::{Checked, MIN_SINE, between, check, length, number, point, show, unit};
use crate::camera_path::CameraPath;
use crate::limits::{APERTURES, BLADES, F_NUMBERS, FOVS, FRAMES, LENGTHS, ROTATIONS};
use crate::problem::{At, Collector, Problem, Problems, both};
use crate::{Camera, CameraDescription, CameraKeyDescription, Lens, PerspectiveDescription, Projection};

/// Minimum distance between keys in frames, which keeps slopes finite.
const MIN_KEY_DISTANCE: f64 = 1e-6;
/// Up vector of a vertical view along the default `up`.
const VERTICAL_UP: DVec3 = DVec3::Y;

impl CameraDescription {
    /// Validates the camera without its path.
    ///
    /// # Errors
    ///
    /// The first invalid value.
    pub fn validate(&self) -> Result<Camera, Problem> {
        camera(self, VERTICAL_UP).map_err(|problems| problems.first)
    }

    /// Validates the camera at a frame of its path. A view along `up` is an error, because replacing `up` at this frame
    /// would make the image jump.
    pub(crate) fn validate_frame(&self) -> Result<Camera, Problem> {
        camera(self, DVec3::Z).map_err(|problems| problems.first)
    }
}

/// Returns the camera. `vertical_up` replaces the default `up`, +z, if the view is along +z.
fn camera(description: &CameraDescription, vertical_up: DVec3) -> Result<Camera, Problems> {
    let (position, look_at, up) = match description {
        CameraDescription::Perspective(camera) => (camera.position, camera.look_at, camera.up),
        CameraDescription::Panorama(camera) => (camera.position, camera.look_at, camera.up),
        CameraDescription::Orthographic(camera) => (camera.position, camera.look_at, camera.up),
    };
    let points = both(point(position).at("position"), point(look_at).at("look_at"));
    let view = both(points, unit(up).at("up")).and_then(|(_, up)| {
        let forward = look_at - position;
        check(forward.length() >= LENGTHS.0, || {
            format!("{} must differ from the camera's position", show(look_at))
        })
        .at("look_at")?;
        let distance = forward.length();
        let forward = forward.normalize();
        let is_vertical = up == DVec3::Z && forward.cross(up).length() <= MIN_SINE;
        let right = forward.cross(if is_vertical { vertical_up } else { up });
        check(right.length() > MIN_SINE, || {
            let (look_at, up) = (show(look_at), show(up));
            format!("{look_at} makes the view parallel to up, {up}; choose another up")
        })
        .at("look_at")?;
        Ok((distance, forward, right.normalize()))
    });
    let optics = match description {
        CameraDescription::Perspective(camera) => {
            let fov = between(camera.fov, FOVS).at("fov");
            let projection = fov.map(|fov| Projection::Perspective { fov: fov.to_radians() });
            both(projection, lens_of(camera))
        }
        CameraDescription::Panorama(_) => Ok((Projection::Panorama, None)),
        CameraDescription::Orthographic(camera) => {
            let height = length(camera.height).at("height").map_err(Problems::from);
            height.map(|height| (Projection::Orthographic { height }, None))
        }
    };
    let ((projection, mut lens), (distance, forward, right)) = both(optics, view)?;
    if let (Some(lens), CameraDescription::Perspective(camera)) = (&mut lens, description) {
        lens.focus = camera.focus_distance.unwrap_or(distance);
    }
    Ok(Camera {
        position,
        look_at,
        right,
        up: right.cross(forward),
        forward,
        projection,
        lens,
    })
}

/// Returns the lens of a camera. The caller sets the focus distance.
fn lens_of(camera: &PerspectiveDescription) -> Result<Option<Lens>, Problems> {
    let mut problems = Collector::default();
    let focal_length = problems.or_default(length(camera.focal_length).at("focal_length"));
    let f_number = camera.f_number.map(|f_number| {
        check(camera.aperture.is_none(), || {
            "cannot be combined with aperture: both set the diameter of the lens".to_owned()
        })?;
        between(f_number, F_NUMBERS)
    });
    let f_number = problems.or_default(f_number.transpose().at("f_number"));
    let aperture = problems.or_default(camera.aperture.map(aperture).transpose().at("aperture"));
    problems.value(camera.focus_distance.map(length).transpose().at("focus_distance"));
    let blades = camera.blades;
    let checked = check(blades == 0 || (BLADES.0..=BLADES.1).contains(&blades), || {
        format!("{blades} must be 0 or a whole number from {} to {}", BLADES.0, BLADES.1)
    });
    problems.value(checked.at("blades"));
    let rotation = problems.or_default(between(camera.blade_rotation, ROTATIONS).at("blade_rotation"));
    let diameter = aperture.or(f_number.map(|n| focal_length / n)).unwrap_or(0.0);
    problems.end((diameter > 0.0).then(|| Lens {
        radius: diameter / 2.0,
        focus: 1.0,
        blades,
        rotation: rotation.to_radians(),
    }))
}

fn aperture(diameter: f64) -> Checked<f64> {
    between(diameter, APERTURES)
}

/// Validates the keys of the path, the camera itself, and the camera at the frame of each key.
pub(super) fn with_path(description: &CameraDescription) -> Result<(Camera, Option<CameraPath>), Problems> {
    let Some(path) = description.path() else {
        return Ok((camera(description, VERTICAL_UP)?, None));
    };
    let mut problems = Collector::default();
    problems.value(check(!path.keys.is_empty(), || {
        "[] must have at least one key".to_owned()
    }));
    let mut previous_frame = None;
    for (i, key) in path.keys.iter().enumerate() {
        problems.value(check_key(key, description, previous_frame).at(i));
        previous_frame = Some(key.frame);
    }
    // The camera may take values from the first key, so the camera is validated only if all keys are valid.
    problems.end(()).at("keys").at("path")?;
    let camera = camera(description, VERTICAL_UP)?;
    let camera_path = CameraPath::of(description);
    if let Some(camera_path) = &camera_path {
        for key in &path.keys {
            camera_path.at(key.frame)?;
        }
    }
    Ok((camera, camera_path))
}

/// Validates a key. The frame of the key must be greater than the frame of the previous key.
fn check_key(key: &CameraKeyDescription, camera: &CameraDescription, previous_frame: Option<f64>) -> Checked<()> {
    let CameraKeyDescription {
        frame,
        position,
        look_at,
        up,
        fov,
        height,
        aperture: diameter,
        focus_distance,
    } = *key;
    between(frame, FRAMES).at("frame")?;
    if let Some(previous_frame) = previous_frame {
        check(frame - previous_frame >= MIN_KEY_DISTANCE, || {
            let (frame, previous_frame, min) = (number(frame), number(previous_frame), number(MIN_KEY_DISTANCE));
            format!("{frame} must be greater than the frame of the previous key, {previous_frame}, by at least {min}")
        })
        .at("frame")?;
    }
    let type_keys: &[&str] = match camera {
        CameraDescription::Perspective(_) => &["fov", "aperture", "focus_distance"],
        CameraDescription::Orthographic(_) => &["height"],
        CameraDescription::Panorama(_) => &[],
    };
    for (name, is_set) in [
        ("fov", fov.is_some()),
        ("height", height.is_some()),
        ("aperture", diameter.is_some()),
        ("focus_distance", focus_distance.is_some()),
    ] {
        check(!is_set || type_keys.contains(&name), || match type_keys {
            [] => "does not apply to a camera of this type".to_owned(),
            type_keys => format!(
                "does not apply to a camera of this type, which has {}",
                join_names(type_keys, "and")
            ),
        })
        .at(name)?;
    }
    position.map(point).transpose().at("position")?;
    look_at.map(point).transpose().at("look_at")?;
    up.map(unit).transpose().at("up")?;
    let fov = fov.map(|fov| between(fov, FOVS)).transpose().at("fov")?;
    let height = height.map(length).transpose().at("height")?;
    let diameter = diameter.map(aperture).transpose().at("aperture")?;
    let focus_distance = focus_distance.map(length).transpose().at("focus_distance")?;
    let points = [position, look_at, up];
    let numbers = [fov, height, diameter, focus_distance];
    check(
        points.iter().any(Option::is_some) || numbers.iter().any(Option::is_some),
        || {
            format!(
                "must have {}",
                join_names(&[&["position", "look_at", "up"], type_keys].concat(), "or")
            )
        },
    )
}

/// Joins names, with a conjunction before the last name: "a", "b" or "c".
fn join_names(names: &[&str], conjunction: &str) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
    match quoted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, before)) => format!("{} {conjunction} {last}", before.join(", ")),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::{
        CameraKeyDescription, CameraPathDescription, Description, Interpolation, Overrides, PerspectiveDescription,
        Projection, Scene, SceneError,
    };

    /// Parses a scene whose camera begins in line 2.
    fn scene(camera: &str) -> Result<Scene, SceneError> {
        let text = format!("image = {{ width = 4, height = 4 }}\n{camera}");
        Scene::parse(&text, "s.toml")
    }

    const STATIC_CAMERA: &str = "[camera]\nposition = [0, -4, 0]\nlook_at = [0, 0, 0]\nfov = 40\n";

    #[test]
    fn each_value_is_interpolated_between_the_keys_that_set_it() {
        let scene = scene(&format!(
            "{STATIC_CAMERA}[camera.path]\nkeys = [{{ frame = 1, position = [2, -4, 0] }}, {{ frame = 2, fov = 20 }}, \
             {{ frame = 5, position = [4, -8, 4], fov = 50 }}, {{ frame = 6, up = [1, 0, 0] }}]"
        ))
        .unwrap();
        assert_eq!(
            scene.camera.position,
            DVec3::new(0.0, -4.0, 0.0),
            "the path must not change the position that the camera sets"
        );
        assert_eq!(scene.camera_path.as_ref().unwrap().frames(), (1.0, 6.0));
        for (frame, position, fov) in [
            (-7.0, [2.0, -4.0, 0.0], 20.0),
            (1.0, [2.0, -4.0, 0.0], 20.0),
            (3.0, [3.0, -6.0, 2.0], 30.0),
            (4.5, [3.75, -7.5, 3.5], 45.0_f64),
            (5.0, [4.0, -8.0, 4.0], 50.0),
            (9.0, [4.0, -8.0, 4.0], 50.0),
        ] {
            let camera = scene.camera_at(frame).unwrap();
            assert_eq!(camera.position, DVec3::from(position), "{frame}");
            assert_eq!(camera.look_at, DVec3::ZERO);
            let Projection::Perspective { fov: found } = camera.projection else {
                panic!("the camera is not perspective");
            };
            assert!((found - fov.to_radians()).abs() < 1e-14, "{frame}: {found}");
            // A value that only one key sets applies to all frames.
            assert!(camera.up.x > 0.5, "{frame}: {}", camera.up);
        }
    }

    #[test]
    fn a_vertical_camera_has_a_different_up() {
        let camera = |position: [f64; 3], up: [f64; 3]| {
            let mut camera = PerspectiveDescription::new(position, [0.0; 3], 40.0);
            camera.up = up.into();
            crate::CameraDescription::from(camera).validate()
        };
        let down = camera([0.0, 0.0, 5.0], [0.0, 0.0, 2.0]).unwrap();
        assert_eq!((down.right, down.up), (DVec3::X, DVec3::Y));
        let up = camera([0.0, 0.0, -5.0], [0.0, 0.0, 1.0]).unwrap();
        assert_eq!((up.right, up.up), (-DVec3::X, DVec3::Y));
        let message = camera([0.0, 5.0, 0.0], [0.0, 1.0, 0.0]).unwrap_err().to_string();
        assert_eq!(
            message,
            "look_at: [0, 0, 0] makes the view parallel to up, [0, 1, 0]; choose another up"
        );
    }

    #[test]
    fn without_a_frame_the_first_keys_provide_missing_values() {
        let path = "[camera.path]\ninterpolation = 'smooth'\nkeys = [{ frame = 3, look_at = [1, 0, 0] }, \
                    { frame = 4, position = [0, -4, 2], fov = 30, look_at = [2, 0, 0] }]\n";
        let path_only = scene(path).unwrap();
        assert_eq!(path_only.camera, path_only.camera_at(3.0).unwrap());
        assert_eq!(path_only.camera.look_at, DVec3::X);
        let with_fov = scene(&format!("[camera]\nfov = 60\n{path}")).unwrap();
        assert_eq!(
            with_fov.camera.projection,
            Projection::Perspective {
                fov: 60_f64.to_radians()
            }
        );
        assert_eq!(with_fov.camera_at(0.0).unwrap(), path_only.camera);
        let orthographic = "[camera]\ntype = 'orthographic'\n[[camera.path.keys]]\nframe = 0\nposition = [0, -1, 0]\n\
                        look_at = [0, 0, 0]\nheight = 2\n[[camera.path.keys]]\nframe = 1\nheight = 4\n";
        let orthographic = scene(orthographic).unwrap();
        assert_eq!(orthographic.camera.projection, Projection::Orthographic { height: 2.0 });
        let between = orthographic.camera_at(0.5).unwrap();
        assert_eq!(between.projection, Projection::Orthographic { height: 3.0 });
    }

    #[test]
    fn an_override_chooses_the_frame() {
        let text = format!(
            "image = {{ width = 4, height = 4 }}\n{STATIC_CAMERA}path.keys = [{{ frame = 1, position = [0, -4, 0] }}, {{ frame = 3, \
             position = [0, 4, 0] }}]"
        );
        let load_at = |frame| {
            let overrides = Overrides {
                frame,
                ..Overrides::default()
            };
            Scene::parse_with(&text, "s.toml", &overrides)
        };
        assert_eq!(load_at(Some(1.5)).unwrap().camera.position, DVec3::new(0.0, -2.0, 0.0));
        assert_eq!(load_at(None).unwrap().camera.position, DVec3::new(0.0, -4.0, 0.0));
        let expected = "s.toml:6: camera.path: at frame 2, look_at: [0, 0, 0] must differ from the camera's position";
        assert_eq!(load_at(Some(2.0)).unwrap_err().to_string(), expected);
        for frame in [f64::NAN, f64::INFINITY] {
            let message = load_at(Some(frame)).unwrap_err().to_string();
            assert_eq!(message, format!("frame: {frame} must be finite"));
        }
        // A camera that was created in code has no line number.
        let keys = [[0.0, -4.0, 0.0], [0.0, 4.0, 0.0]].map(|position| CameraKeyDescription {
            position: Some(position.into()),
            ..CameraKeyDescription::new(position[1])
        });
        let mut camera = PerspectiveDescription::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0], 40.0);
        camera.path = Some(CameraPathDescription::new(Interpolation::Linear, keys));
        let scene = Description::new(4, 4, camera).validate().unwrap();
        assert_eq!(scene.camera.position, DVec3::X);
        assert_eq!(scene.camera_at(-1.0).unwrap().position, DVec3::NEG_Y);
        let message = scene.camera_at(0.0).unwrap_err().to_string();
        assert!(message.starts_with("camera.path: at frame 0, look_at: "), "{message}");
    }

    #[test]
    fn invalid_keys_are_reported_with_location_and_rule() {
        let start = "[camera.path]\nkeys = [\n{ frame = 1, position = [0, -4, 0] },\n";
        for (path, expected) in [
            (
                "[camera.path]\nkeys = []".to_owned(),
                "7: camera.path.keys: [] must have at least one key",
            ),
            ("[camera.path]".to_owned(), "6: camera.path.keys is missing"),
            ("path = 3".to_owned(), "6: camera.path: 3 must be a table"),
            (
                "path = { keys = [3] }".to_owned(),
                "6: camera.path.keys[0]: 3 must be a table",
            ),
            (
                "path = { interpolation = 'spline', keys = [] }".to_owned(),
                "6: camera.path.interpolation: \"spline\" must be \"linear\" or \"smooth\"",
            ),
            (
                format!("{start}{{ fov = 4 }}]"),
                "9: camera.path.keys[1].frame is missing",
            ),
            (
                format!("{start}{{ frame = 2 }}]"),
                "9: camera.path.keys[1]: must have \"position\", \"look_at\", \"up\", \"fov\", \"aperture\" or \"focus_distance\"",
            ),
            (
                format!("{start}{{ frame = 1, fov = 4 }}]"),
                "9: camera.path.keys[1].frame: 1 must be greater than the frame of the previous key, 1, by at least 1e-6",
            ),
            (
                format!("{start}{{ frame = 0.5, fov = 4 }}]"),
                "9: camera.path.keys[1].frame: 0.5 must be greater than the frame of the previous key, 1, by at least 1e-6",
            ),
            (
                format!("{start}{{ frame = 2e9, fov = 4 }}]"),
                "9: camera.path.keys[1].frame: 2e9 must be from -1e9 to 1e9",
            ),
            (
                format!("{start}{{ frame = nan, fov = 4 }}]"),
                "9: camera.path.keys[1].frame: nan must be from -1e9 to 1e9",
            ),
            (
                format!("{start}{{ frame = 2, fov = 180 }}]"),
                "9: camera.path.keys[1].fov: 180 must be from 0.001 to 179.999",
            ),
            (
                format!("{start}{{ frame = 2, height = 1 }}]"),
                "9: camera.path.keys[1].height: does not apply to a camera of this type, which has \"fov\"",
            ),
            (
                format!("{start}{{ frame = 2, position = [0, 2e9, 0] }}]"),
                "9: camera.path.keys[1].position: 2e9 must be from -1e9 to 1e9",
            ),
            (
                format!("{start}{{ frame = 2, up = [0, 0, 0] }}]"),
                "9: camera.path.keys[1].up: [0, 0, 0] must not be zero",
            ),
            (
                format!("{start}{{ frame = 2, look_at = [0, 0] }}]"),
                "9: camera.path.keys[1].look_at: [0, 0] must be a list of 3 numbers",
            ),
            (
                format!("{start}{{ frame = 2, speed = 1 }}]"),
                "9: camera.path.keys[1].speed: unknown key; expected one of \"frame\", \"position\", \"look_at\", \"up\"",
            ),
            (
                format!("{start}{{ frame = 2, position = [0, 0, 4] }}]"),
                "6: camera.path: at frame 2, look_at: [0, 0, 0] makes the view parallel to up",
            ),
        ] {
            let message = scene(&format!("{STATIC_CAMERA}{path}")).unwrap_err().to_string();
            assert!(
                message.starts_with(&format!("s.toml:{expected}")),
                "{message}\n{expected}"
            );
        }
        let orthographic = "[camera]\ntype = 'orthographic'\nposition = [0, -4, 0]\nlook_at = [0, 0, 0]\nheight = 1\n\
                        path.keys = [{ frame = 1, fov = 40 }]";
        let expected =
            "s.toml:7: camera.path.keys[0].fov: does not apply to a camera of this type, which has \"height\"";
        assert_eq!(scene(orthographic).unwrap_err().to_string(), expected);
        // The distance of these keys is twice MIN_KEY_DISTANCE.
        let close_keys = format!("{start}{{ frame = 1.000002, fov = 4 }}]");
        scene(&format!("{STATIC_CAMERA}{close_keys}")).unwrap();
    }

    #[test]
    fn a_serialized_path_parses_to_the_same_description() {
        let path = "[[camera.path.keys]]\nframe = 1.5\nup = [0, 1, 1]\n[[camera.path.keys]]\nframe = 3\nfov = 7.5\n";
        let text = format!("image = {{ width = 4, height = 4 }}\n{STATIC_CAMERA}path.interpolation = 'smooth'\n{path}");
        let description = Description::parse(&text, "s.toml").unwrap();
        let written = toml::to_string(&description).unwrap();
        assert_eq!(
            Description::parse(&written, "s.toml").unwrap(),
            description,
            "{written}"
        );
    }
}
