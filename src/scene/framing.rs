//! A camera that frames what there is: from a direction, all of it in the picture.

use glam::DVec3;

use super::PerspectiveDescription;

/// Vertical field of view of pictures that are not wide, in degrees.
const FOV: f64 = 35.0;
/// Wider pictures, relative to their height, do not see more to the sides: what is there would be drawn out.
const WIDEST: f64 = 2.0;
/// How much of the picture from its middle to an edge is for what is framed: 5 % of the whole are free on each side.
const INSIDE: f64 = 0.9;
/// How near the camera may come to the nearest point, relative to the extent of all: long things are not seen from their ends.
const NEAREST: f64 = 0.1;

/// Where a scene is seen from. Its front is towards -y and its upper side towards +z, as a glTF file's is once it is upright here. In
/// options the names are those of [`View::name`].
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
    /// From the left of who looks at the front.
    Left,
    /// From the right of who looks at the front.
    Right,
    /// From above; the front is at the picture's lower edge.
    Top,
    /// From below; the front is at the picture's upper edge.
    Bottom,
    /// From the front, the right and above alike.
    Iso,
}

impl View {
    /// All of them.
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

    /// The name in options.
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

    /// The direction from what is seen to the camera, not of unit length, and what is up.
    fn direction(self) -> (DVec3, DVec3) {
        let from = |x: f64, y: f64, z: f64| (DVec3::new(x, y, z), DVec3::Z);
        match self {
            // 30 degrees to the right, 15 upwards.
            View::Corner => from(0.5, -0.866_025_403_784, 0.267_949_192_431),
            View::Front => from(0.0, -1.0, 0.0),
            View::Back => from(0.0, 1.0, 0.0),
            View::Left => from(-1.0, 0.0, 0.0),
            View::Right => from(1.0, 0.0, 0.0),
            View::Top => (DVec3::Z, DVec3::Y),
            View::Bottom => (DVec3::NEG_Z, DVec3::NEG_Y),
            View::Iso => from(1.0, -1.0, 1.0),
        }
    }
}

/// How a scene is framed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    /// Where it is seen from.
    pub view: View,
    /// Width of the picture over its height.
    pub aspect: f64,
    /// Whether it is to be in the picture from all around, as the camera turns about its middle.
    pub turns: bool,
}

/// A camera that sees all these points, as near as that goes; what it looks at is in their middle. Without a point it is somewhere.
pub fn framed(points: impl Iterator<Item = DVec3> + Clone, framing: Framing) -> PerspectiveDescription {
    let (towards, up) = framing.view.direction();
    let forward = -towards.normalize();
    let right = forward.cross(up).normalize();
    let upwards = right.cross(forward);
    let high = FOV.to_radians() / 2.0;
    let high = high.tan() * (WIDEST / framing.aspect).min(1.0);
    let wide = high * framing.aspect;
    let (low, top) = points
        .clone()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, top), p| {
            (low.min(p), top.max(p))
        });
    if !(low.x <= top.x) {
        return framed(std::iter::once(DVec3::ZERO), framing);
    }
    let middle = 0.5 * low + 0.5 * top;
    // How far the points reach in directions, from the middle. If they turn each goes around the axis on a circle.
    let reach = |directions: [DVec3; 6]| {
        points.clone().fold([f64::NEG_INFINITY; 6], |most, point| {
            let p = point - middle;
            let radius = (p - up * p.dot(up)).length();
            let far = directions.map(|n| match framing.turns {
                true => radius * (n - up * n.dot(up)).length() + p.dot(up) * n.dot(up),
                false => p.dot(n),
            });
            std::array::from_fn(|i| most[i].max(far[i]))
        })
    };
    // A point is in the picture if right . (p - camera) <= w forward . (p - camera), and so on for the other sides.
    let (w, h) = (INSIDE * wide, INSIDE * high);
    let [to_right, to_left, to_top, to_bottom, behind, before] = reach([
        right - w * forward,
        -right - w * forward,
        upwards - h * forward,
        -upwards - h * forward,
        forward,
        -forward,
    ]);
    let size = (top - low).length();
    let nearest = if size > 0.0 { NEAREST * size } else { 1.0 };
    let back = ((to_right + to_left) / (2.0 * w))
        .max((to_top + to_bottom) / (2.0 * h))
        .max(before + nearest);
    let higher = (to_top - to_bottom) / 2.0;
    let (sideways, ahead) = match framing.turns {
        true => (0.0, higher * up.dot(forward) / up.dot(upwards)), // to the axis
        false => ((to_right - to_left) / 2.0, (behind - before) / 2.0),
    };
    let aside = right * sideways + upwards * higher;
    let fov = 2.0 * high.atan().to_degrees();
    PerspectiveDescription {
        up,
        ..PerspectiveDescription::new(middle + aside - forward * back, middle + aside + forward * ahead, fov)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, CameraDescription, Projection};

    /// Where a point is in the picture, from -1 at the left and lower edges to 1.
    fn seen(camera: &Camera, aspect: f64, point: DVec3) -> [f64; 2] {
        let Projection::Perspective { fov } = camera.projection else {
            panic!("a perspective camera")
        };
        let to = point - camera.position;
        let ahead = to.dot(camera.forward);
        assert!(ahead > 0.0, "{point} is behind the camera");
        let high = ahead * (fov / 2.0).tan();
        [to.dot(camera.right) / (high * aspect), to.dot(camera.up) / high]
    }

    fn camera(points: &[DVec3], framing: Framing) -> Camera {
        let description = framed(points.iter().copied(), framing);
        let told = format!("{framing:?} {description:?}");
        CameraDescription::from(description)
            .validate()
            .unwrap_or_else(|problem| panic!("{problem}: {told}"))
    }

    fn corners(low: [f64; 3], top: [f64; 3]) -> Vec<DVec3> {
        let side = |i: usize, axis: usize| if i >> axis & 1 == 0 { low[axis] } else { top[axis] };
        (0..8).map(|i| DVec3::new(side(i, 0), side(i, 1), side(i, 2))).collect()
    }

    /// Boxes, flat ones, lines, a point, and points that no corner of their box is.
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
                    let turn = f64::from(i) * 2.4;
                    DVec3::new(
                        turn.cos() * f64::from(i),
                        turn.sin() * f64::from(i),
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
    fn all_is_in_the_picture_and_fills_it() {
        for points in clouds() {
            for view in View::ALL {
                for aspect in ASPECTS {
                    let framing = Framing {
                        view,
                        aspect,
                        turns: false,
                    };
                    let camera = camera(&points, framing);
                    let (mut most, mut ends) = (0.0_f64, [[0.0_f64; 2]; 2]);
                    for point in &points {
                        let at = seen(&camera, aspect, *point);
                        assert!(
                            at.iter().all(|x| x.abs() <= INSIDE + 1e-6),
                            "{framing:?}: {point} at {at:?}"
                        );
                        most = most.max(at[0].abs()).max(at[1].abs());
                        for (ends, x) in ends.iter_mut().zip(at) {
                            *ends = [ends[0].min(x), ends[1].max(x)];
                        }
                    }
                    // It is in the middle, and reaches the margins unless the camera would be too near.
                    let size = (0..3).map(|i| {
                        let along = || points.iter().map(|p| p[i]);
                        along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
                    });
                    let size = size.map(|side| side * side).sum::<f64>().sqrt();
                    let depths = || points.iter().map(|p| (*p - camera.position).dot(camera.forward));
                    let (nearest, farthest) = (depths().fold(f64::MAX, f64::min), depths().fold(0.0, f64::max));
                    let near = if size > 0.0 { NEAREST * size } else { 1.0 };
                    if nearest > near * (1.0 + 1e-9) {
                        assert!((most - INSIDE).abs() < 1e-6, "{framing:?}: {most}");
                        let [x, y] = ends.map(|[low, top]| (low + top).abs());
                        assert!(x.min(y) < 1e-6, "{framing:?}: {x} {y}");
                    } else {
                        assert!(nearest > near * (1.0 - 1e-6), "{framing:?}: {nearest}");
                        assert!(
                            farthest - nearest >= 0.8 * size,
                            "only what is long may be farther away"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn what_turns_stays_in_the_picture() {
        for points in clouds() {
            for view in View::ALL {
                for aspect in ASPECTS {
                    let framing = Framing {
                        view,
                        aspect,
                        turns: true,
                    };
                    let still = camera(&points, framing);
                    let (_, up) = view.direction();
                    let mut most = 0.0_f64;
                    for turn in 0..72 {
                        let turned = glam::DQuat::from_axis_angle(up, f64::from(turn).to_radians() * 5.0);
                        for point in &points {
                            // The points turn, in place of the camera.
                            let point = still.look_at + turned * (*point - still.look_at);
                            let at = seen(&still, aspect, point);
                            assert!(
                                at.iter().all(|x| x.abs() <= INSIDE + 1e-6),
                                "{framing:?}: {point} at {at:?}"
                            );
                            most = most.max(at[0].abs()).max(at[1].abs());
                        }
                    }
                    assert!(most > 0.85 || points.len() == 1 || !(most > 0.5), "{framing:?}: {most}");
                }
            }
        }
    }

    #[test]
    fn views_show_the_sides_that_they_name() {
        // Of a unit cube's corners, which is farthest to the right, the highest and the nearest.
        let points = corners([0.0; 3], [1.0; 3]);
        let at = |view: View| {
            let framing = Framing {
                view,
                aspect: 1.0,
                turns: false,
            };
            camera(&points, framing)
        };
        for (view, forward, right) in [
            (View::Front, DVec3::Y, DVec3::X),
            (View::Back, DVec3::NEG_Y, DVec3::NEG_X),
            (View::Left, DVec3::X, DVec3::NEG_Y),
            (View::Right, DVec3::NEG_X, DVec3::Y),
            (View::Top, DVec3::NEG_Z, DVec3::X),
            (View::Bottom, DVec3::Z, DVec3::X),
        ] {
            let camera = at(view);
            assert!((camera.forward - forward).length() < 1e-12, "{view:?}: {camera:?}");
            assert!((camera.right - right).length() < 1e-12, "{view:?}: {camera:?}");
        }
        for view in [View::Corner, View::Iso] {
            let towards = -at(view).forward;
            assert!(
                towards.x > 0.0 && towards.y < 0.0 && towards.z > 0.0,
                "{view:?}: {towards}"
            );
            assert!(at(view).up.z > 0.0);
        }
        assert!((DVec3::new(1.0, -1.0, 1.0).normalize() + at(View::Iso).forward).length() < 1e-12);
    }

    #[test]
    fn nothing_is_framed_somewhere() {
        for turns in [false, true] {
            camera(
                &[],
                Framing {
                    view: View::Corner,
                    aspect: 1.0,
                    turns,
                },
            );
        }
    }
}
