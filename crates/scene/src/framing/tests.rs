//! Tests of the automatic camera.

use super::*;
use crate::{Camera, CameraDescription, Projection};

/// Returns the image position of a point, from -1 (left and lower edges) to 1.
fn image_position(camera: &Camera, aspect: f64, point: DVec3) -> [f64; 2] {
    let Projection::Perspective { fov } = camera.projection else {
        panic!("the camera is not perspective")
    };
    let offset = point - camera.position;
    let ahead = offset.dot(camera.forward);
    assert!(ahead > 0.0, "{point} is behind the camera");
    let half_height = ahead * (fov / 2.0).tan();
    [
        offset.dot(camera.right) / (half_height * aspect),
        offset.dot(camera.up) / half_height,
    ]
}

fn camera(points: &[DVec3], framing: Framing) -> Camera {
    let description = framed(points.iter().copied(), framing);
    let text = format!("{framing:?} {description:?}");
    CameraDescription::from(description)
        .validate()
        .unwrap_or_else(|problem| panic!("{problem}: {text}"))
}

fn corners(low: [f64; 3], high: [f64; 3]) -> Vec<DVec3> {
    let side = |i: usize, axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
    (0..8).map(|i| DVec3::new(side(i, 0), side(i, 1), side(i, 2))).collect()
}

/// Boxes, flat boxes, lines, a point, and points that are not corners of their bounding box.
fn clouds() -> Vec<Vec<DVec3>> {
    let mut clouds = vec![
        corners([-1.0; 3], [1.0; 3]),
        corners([2.0, -3.0, 0.0], [2.5, 4.0, 0.25]),
        corners([0.0, 0.0, 1.0], [3.0, 3.0, 1.0]),
        corners([-1.0, 0.0, 0.0], [1.0, 0.0, 7.0]),
        corners([0.0, -50.0, 0.0], [0.0, 50.0, 0.0]),
        corners([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]),
        vec![DVec3::new(3.0, -4.0, 5.0)],
        vec![
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
        ],
        (0..500)
            .map(|i| {
                let angle = f64::from(i) * 2.4;
                DVec3::new(
                    angle.cos() * f64::from(i),
                    angle.sin() * f64::from(i),
                    f64::from(i % 7) * 30.0,
                )
            })
            .collect(),
    ];
    let scaled = |factor: f64| {
        clouds[..4]
            .iter()
            .map(move |cloud| cloud.iter().map(|p| *p * factor).collect())
    };
    let scaled: Vec<_> = scaled(1e-6).chain(scaled(1e6)).collect();
    clouds.extend(scaled);
    clouds
}

const ASPECTS: [f64; 6] = [1.0, 16.0 / 9.0, 9.0 / 16.0, 6.0, 1.0 / 6.0, 10.0];

#[test]
fn all_points_are_in_the_image_and_fill_it() {
    for points in clouds() {
        for view in View::ALL {
            for aspect in ASPECTS {
                let framing = Framing::new(view, aspect);
                let camera = camera(&points, framing);
                let (mut max_position, mut ends) = (0.0_f64, [[f64::INFINITY, f64::NEG_INFINITY]; 2]);
                for point in &points {
                    let position = image_position(&camera, aspect, *point);
                    assert!(
                        position.iter().all(|x| x.abs() <= FILL + 1e-6),
                        "{framing:?}: {point} at {position:?}"
                    );
                    max_position = max_position.max(position[0].abs()).max(position[1].abs());
                    for (ends, x) in ends.iter_mut().zip(position) {
                        *ends = [ends[0].min(x), ends[1].max(x)];
                    }
                }
                // The tolerance is 0.001 pixels in an image of 2000 x 2000 pixels.
                let [x, y] = ends.map(|[low, high]| (low + high).abs());
                assert!(x.max(y) < 1e-6, "{framing:?}: off center by {x}, {y}");
                // The points reach the margins, unless the camera would be too close.
                let size = (0..3).map(|i| {
                    let coordinates = || points.iter().map(|p| p[i]);
                    coordinates().fold(f64::MIN, f64::max) - coordinates().fold(f64::MAX, f64::min)
                });
                let size = size.map(|side| side * side).sum::<f64>().sqrt();
                let depths = || points.iter().map(|p| (*p - camera.position).dot(camera.forward));
                let (nearest, farthest) = (depths().fold(f64::MAX, f64::min), depths().fold(0.0, f64::max));
                let min_distance = if size > 0.0 { MIN_DISTANCE * size } else { 1.0 };
                if nearest > min_distance * (1.0 + 1e-9) {
                    assert!((max_position - FILL).abs() < 1e-6, "{framing:?}: {max_position}");
                } else {
                    assert!(nearest > min_distance * (1.0 - 1e-6), "{framing:?}: {nearest}");
                    assert!(
                        farthest - nearest >= 0.8 * size,
                        "the camera is at its minimum distance although the scene is not elongated along the view \
                         direction"
                    );
                }
            }
        }
    }
}

#[test]
fn rotating_scenes_stay_in_the_image() {
    for points in clouds() {
        for view in View::ALL {
            for aspect in ASPECTS {
                let framing = Framing {
                    turns: true,
                    ..Framing::new(view, aspect)
                };
                let camera_at_start = camera(&points, framing);
                let (_, up) = view.direction();
                let mut max_position = 0.0_f64;
                for turn in 0..72 {
                    let rotation = glam::DQuat::from_axis_angle(up, f64::from(turn).to_radians() * 5.0);
                    for point in &points {
                        // Rotates the points instead of the camera.
                        let point = camera_at_start.look_at + rotation * (*point - camera_at_start.look_at);
                        let position = image_position(&camera_at_start, aspect, point);
                        assert!(
                            position.iter().all(|x| x.abs() <= FILL + 1e-6),
                            "{framing:?}: {point} at {position:?}"
                        );
                        max_position = max_position.max(position[0].abs()).max(position[1].abs());
                    }
                }
                assert!(
                    max_position > 0.85 || points.len() == 1 || !(max_position > 0.5),
                    "{framing:?}: {max_position}"
                );
            }
        }
    }
}

#[test]
fn views_look_at_the_side_that_they_are_named_after() {
    let points = corners([0.0; 3], [1.0; 3]);
    let camera_of = |view: View| camera(&points, Framing::new(view, 1.0));
    for (view, forward, right) in [
        (View::Front, DVec3::Y, DVec3::X),
        (View::Back, DVec3::NEG_Y, DVec3::NEG_X),
        (View::Left, DVec3::X, DVec3::NEG_Y),
        (View::Right, DVec3::NEG_X, DVec3::Y),
        (View::Top, DVec3::NEG_Z, DVec3::X),
        (View::Bottom, DVec3::Z, DVec3::X),
    ] {
        let camera = camera_of(view);
        assert!((camera.forward - forward).length() < 1e-12, "{view:?}: {camera:?}");
        assert!((camera.right - right).length() < 1e-12, "{view:?}: {camera:?}");
    }
    for view in [View::Corner, View::Iso] {
        let to_camera = -camera_of(view).forward;
        assert!(
            to_camera.x > 0.0 && to_camera.y < 0.0 && to_camera.z > 0.0,
            "{view:?}: {to_camera}"
        );
        assert!(camera_of(view).up.z > 0.0);
    }
    assert!((DVec3::new(1.0, -1.0, 1.0).normalize() + camera_of(View::Iso).forward).length() < 1e-12);
}

#[test]
fn the_margins_of_a_leaning_triangle_are_equal() {
    // Seen from the front: the base at z = 0 is 2 wide and lies at depth D + 1; the tip at (0, -1, 3) is nearer by 1.
    let points = [-1.0, 1.0].map(|x| DVec3::new(x, 0.0, 0.0)).into_iter();
    let points: Vec<DVec3> = points.chain([DVec3::new(0.0, -1.0, 3.0)]).collect();
    for aspect in [0.25, 4.0] {
        let camera = camera(&points, Framing::new(View::Front, aspect));
        // The lower end is at depth D + 1, and the upper end is at depth D (`near`). For a camera at height h,
        // -(0 - h) / (D + 1) = (3 - h) / D.
        let near = -1.0 - camera.position.y;
        let height = 3.0 * (near + 1.0) / (2.0 * near + 1.0);
        assert!(
            (camera.position.z - height).abs() < 1e-9,
            "{aspect}: {camera:?}, {height}"
        );
        assert!(camera.position.x.abs() < 1e-9);
    }
}

#[test]
fn a_turning_model_has_equal_vertical_margins() {
    for points in clouds() {
        for (view, aspect) in [
            (View::Corner, 0.5),
            (View::Iso, 1.0),
            (View::Front, 0.25),
            (View::Corner, 1.0),
        ] {
            let framing = Framing {
                turns: true,
                ..Framing::new(view, aspect)
            };
            let camera_at_start = camera(&points, framing);
            let center = camera_at_start.look_at;
            let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
            for turn in 0..3600 {
                let rotation = glam::DQuat::from_rotation_z(f64::from(turn).to_radians() / 10.0);
                for point in &points {
                    let [_, y] = image_position(&camera_at_start, aspect, center + rotation * (*point - center));
                    ends = [ends[0].min(y), ends[1].max(y)];
                }
            }
            let difference = (ends[0] + ends[1]).abs();
            assert!(difference < 1e-4, "{framing:?}: {ends:?}");
        }
    }
}

#[test]
fn an_orbit_is_a_direction_in_degrees() {
    let points = corners([0.0; 3], [1.0; 3]);
    let orbit_camera = |azimuth, elevation| {
        let framing = Framing {
            orbit: Some(Orbit { azimuth, elevation }),
            ..Framing::new(View::Back, 1.0)
        };
        camera(&points, framing)
    };
    for (view, azimuth, elevation) in [
        (View::Front, 0.0, 0.0),
        (View::Right, 90.0, 0.0),
        (View::Left, -90.0, 0.0),
        (View::Back, 180.0, 0.0),
        (View::Corner, 30.0, 20.0),
        (View::Top, 0.0, 90.0),
        (View::Bottom, 0.0, -90.0),
        (View::Iso, 45.0, 35.264_389_682_754_654),
    ] {
        let (orbit, named_view) = (
            orbit_camera(azimuth, elevation),
            camera(&points, Framing::new(view, 1.0)),
        );
        assert!(
            orbit.position.distance(named_view.position) < 1e-9,
            "{view:?}: {orbit:?}, {named_view:?}"
        );
        assert!(
            orbit.up.distance(named_view.up) < 1e-9,
            "{view:?}: {orbit:?}, {named_view:?}"
        );
    }
    for elevation in [-89.95, -89.0, 89.0, 89.95, 90.0] {
        for azimuth in [-360.0, -45.0, 33.0, 270.0] {
            orbit_camera(azimuth, elevation);
        }
    }
    let parse = |text: &str| text.parse::<Orbit>();
    assert_eq!(
        parse("30,-15").unwrap(),
        Orbit {
            azimuth: 30.0,
            elevation: -15.0
        }
    );
    for (text, rule) in [
        ("30", "must be AZIMUTH,ELEVATION in degrees, such as 30,15"),
        ("a,b", "must be AZIMUTH,ELEVATION in degrees, such as 30,15"),
        ("1,2,3", "must be AZIMUTH,ELEVATION in degrees, such as 30,15"),
        ("nan,0", "the azimuth, NaN, must be from -360 to 360"),
        ("361,0", "the azimuth, 361, must be from -360 to 360"),
        ("0,91", "the elevation, 91, must be from -90 to 90"),
    ] {
        assert_eq!(parse(text).unwrap_err(), rule, "{text}");
    }
}

#[test]
fn a_requested_field_of_view_is_used() {
    let points = corners([-1.0; 3], [1.0; 3]);
    for (fov, aspect) in [(1.0, 1.0), (60.0, 1.0), (60.0, 4.0), (170.0, 0.5)] {
        let framing = Framing {
            fov: Some(fov),
            ..Framing::new(View::Corner, aspect)
        };
        let camera = camera(&points, framing);
        let Projection::Perspective { fov: found } = camera.projection else {
            panic!("the camera is not perspective")
        };
        assert!((found.to_degrees() - fov).abs() < 1e-9, "{found}");
        let is_inside = |p: &DVec3| {
            image_position(&camera, aspect, *p)
                .iter()
                .all(|x| x.abs() <= FILL + 1e-6)
        };
        assert!(points.iter().all(is_inside), "{fov}");
    }
}

#[test]
fn empty_scenes_can_be_framed() {
    for turns in [false, true] {
        camera(
            &[],
            Framing {
                turns,
                ..Framing::new(View::Corner, 1.0)
            },
        );
    }
}
