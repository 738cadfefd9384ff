//! Triangulation of polygons: point-in-polygon tests confirm that the triangles cover exactly the polygon.

use std::f64::consts::TAU;

use wgray::DVec3;
use wgray::mesh::Mesh;

use super::{corners, load};
use crate::random::Random;

fn polygon(points: &[DVec3]) -> String {
    let vertices = points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    let face = (1..=points.len()).map(|i| format!(" {i}"));
    format!("{}f{}\n", vertices.collect::<String>(), face.collect::<String>())
}

fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
    points.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect()
}

fn areas(mesh: &Mesh) -> Vec<DVec3> {
    let area = |[a, b, c]: [[f64; 3]; 3]| {
        let [a, b, c] = [a, b, c].map(DVec3::from);
        (b - a).cross(c - a) / 2.0
    };
    corners(mesh).into_iter().map(area).collect()
}

/// Returns true if a point is inside according to the even-odd rule; z is ignored.
fn is_inside(points: &[DVec3], [x, y]: [f64; 2]) -> bool {
    let pairs = points.iter().zip(points.iter().cycle().skip(1));
    let crossings = pairs.filter(|(a, b)| (a.y > y) != (b.y > y) && x < (b.x - a.x) * (y - a.y) / (b.y - a.y) + a.x);
    crossings.count() % 2 == 1
}

/// Checks that the triangles cover a simple polygon exactly once, with its orientation.
fn assert_covers(mesh: &Mesh, points: &[DVec3], case: &str) {
    let random = Random::new(5);
    let triangles: Vec<Vec<DVec3>> = (corners(mesh).iter())
        .map(|triangle| triangle.iter().map(|corner| DVec3::from(*corner)).collect())
        .collect();
    let max_coordinate = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let mut mismatches = 0;
    for _ in 0..2000 {
        let point = [
            max_coordinate * random.between(-1.0, 1.0),
            max_coordinate * random.between(-1.0, 1.0),
        ];
        let count = triangles.iter().filter(|triangle| is_inside(triangle, point)).count();
        mismatches += usize::from(count != usize::from(is_inside(points, point)));
    }
    // Positions are rounded to f32, which may misclassify a point at an edge.
    assert!(mismatches <= 1, "{case}: misclassified points: {mismatches}");
    let total: DVec3 = areas(mesh).into_iter().sum();
    assert!(
        areas(mesh).iter().all(|area| area.dot(total) > 0.0),
        "{case}: flipped triangles"
    );
}

const ARROW: [[f64; 2]; 4] = [[0.0, 0.0], [2.0, -1.0], [1.0, 0.0], [2.0, 1.0]];
const L_SHAPE: [[f64; 2]; 6] = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];

#[test]
fn concave_polygons_are_covered() {
    for shape in [&ARROW[..], &L_SHAPE[..]] {
        for first in 0..shape.len() {
            for is_reversed in [false, true] {
                let mut points = flat(shape);
                points.rotate_left(first);
                if is_reversed {
                    points.reverse();
                }
                let mesh = load("a.obj", polygon(&points), None).unwrap();
                let case = format!("{first} {is_reversed}");
                assert_covers(&mesh, &points, &case);
                assert_eq!(mesh.triangles.len(), points.len() - 2, "{case}");
                assert!(mesh.notes.is_empty(), "{case}: {:?}", mesh.notes);
                assert_eq!(areas(&mesh)[0].z < 0.0, is_reversed, "{case}");
            }
        }
    }
}

#[test]
fn ply_polygons_are_covered() {
    let mut text = "ply\nformat ascii 1.0\nelement face 1\nproperty list int int vertex_indices\nelement vertex 6\n\
                    property float x\nproperty float y\nproperty float z\nend_header\n6 1 2 3 4 5 0\n"
        .to_owned();
    for [x, y] in L_SHAPE {
        text += &format!("{x} {y} 0\n");
    }
    assert_covers(&load("a.ply", text, None).unwrap(), &flat(&L_SHAPE), "PLY");
}

/// Returns a simple, star-shaped polygon with `count` corners at random radii from `min_radius` to 1.
fn star(random: &Random, count: usize, min_radius: f64) -> Vec<DVec3> {
    let corner = |i: usize| {
        let (sin, cos) = (TAU * i as f64 / count as f64).sin_cos();
        DVec3::new(cos, sin, 0.0) * random.between(min_radius, 1.0)
    };
    (0..count).map(corner).collect()
}

#[test]
fn random_polygons_are_covered() {
    let random = Random::new(9);
    for round in 0..60 {
        let points = star(&random, 5 + round, 0.2);
        let mesh = load("a.obj", polygon(&points), None).unwrap();
        assert_covers(&mesh, &points, &format!("{round}"));
        assert!(mesh.notes.is_empty(), "{round}: {:?}", mesh.notes);
        // A polygon in a tilted plane has the same area.
        let [u, v] = [DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.48, 0.8, 0.36)];
        let rotated: Vec<DVec3> = points.iter().map(|p| u * p.x + v * p.y).collect();
        let rotated_mesh = load("a.obj", polygon(&rotated), None).unwrap();
        let total_area = |mesh: &Mesh| areas(mesh).iter().map(|area| area.length()).sum::<f64>();
        assert!((total_area(&mesh) - total_area(&rotated_mesh)).abs() < 1e-5, "{round}");
    }
}

#[test]
fn a_polygon_of_ten_thousand_corners_is_covered() {
    let points = star(&Random::new(3), 10_000, 0.5);
    let mesh = load("a.obj", polygon(&points), None).unwrap();
    let polygon_area: f64 = (points.iter().zip(points.iter().cycle().skip(1)))
        .map(|(a, b)| (a.x * b.y - a.y * b.x) / 2.0)
        .sum();
    let covered_area: f64 = areas(&mesh).iter().map(|area| area.length()).sum();
    assert!(
        (covered_area / polygon_area - 1.0).abs() < 1e-5,
        "{covered_area} {polygon_area}"
    );
    assert!(mesh.notes.is_empty(), "{:?}", mesh.notes);
}

#[test]
fn convex_polygons_are_split_into_fans() {
    let regular = |count: usize| {
        let angle = |i: usize| TAU * i as f64 / count as f64;
        (0..count)
            .map(|i| DVec3::new(angle(i).cos(), angle(i).sin(), 0.25))
            .collect::<Vec<_>>()
    };
    for count in [4, 5, 64, 1000] {
        let mesh = load("a.obj", polygon(&regular(count)), None).unwrap();
        let fan: Vec<[u32; 3]> = (1..count as u32 - 1).map(|i| [0, i, i + 1]).collect();
        assert_eq!(mesh.triangles, fan, "{count}");
        assert!(mesh.notes.is_empty());
    }
}

#[test]
fn degenerate_polygons_are_reported() {
    let notes = |points: &[DVec3]| match load("a.obj", polygon(points), None) {
        Ok(mesh) => mesh.notes.iter().map(ToString::to_string).collect(),
        Err(message) => vec![message],
    };
    let bow_tie = flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
    assert_eq!(
        notes(&bow_tie)[0],
        "1 polygon intersects itself; split into a triangle fan"
    );
    let pentagram: Vec<DVec3> = (0..5)
        .map(|i| {
            DVec3::new(
                (f64::from(i) * 0.8 * std::f64::consts::PI).cos(),
                (f64::from(i) * 0.8 * std::f64::consts::PI).sin(),
                0.0,
            )
        })
        .collect();
    assert_eq!(
        notes(&pentagram)[0],
        "1 polygon intersects itself; split into a triangle fan"
    );
    let saddle =
        |height: f64| [[0.0, 0.0, height], [1.0, 0.0, 0.0], [1.0, 1.0, height], [0.0, 1.0, 0.0]].map(DVec3::from);
    assert_eq!(notes(&saddle(0.5)), ["1 polygon is not planar; split into triangles"]);
    assert!(notes(&saddle(0.01)).is_empty());
    // Duplicate and collinear points, and polygons of zero area.
    let doubled = flat(&[
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ]);
    let mesh = load("a.obj", polygon(&doubled), None).unwrap();
    assert_covers(&mesh, &doubled, "doubled");
    let with_collinear = flat(&[
        [0.0, 0.0],
        [1.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ]);
    assert_covers(
        &load("a.obj", polygon(&with_collinear), None).unwrap(),
        &with_collinear,
        "collinear",
    );
    let collinear = flat(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]);
    assert_eq!(
        notes(&collinear),
        ["a.obj: has no triangles with an area; degenerate triangles: 2"]
    );
    let coincident = flat(&[[1.0, 1.0]; 5]);
    assert_eq!(
        notes(&coincident),
        ["a.obj: has no triangles with an area; degenerate triangles: 3"]
    );
}

#[test]
fn polygons_with_random_corners_give_meshes_or_errors() {
    let random = Random::new(21);
    for round in 0..400 {
        let count = 3 + round % 90;
        let scale = [1.0, 1e-6, 1e8, 1e-30][round % 4];
        // With few distinct values, many points coincide or are collinear.
        let coordinate = || match round % 3 {
            0 => f64::from(random.below(4)) * scale,
            _ => random.between(-1.0, 1.0) * scale,
        };
        let points: Vec<DVec3> = (0..count)
            .map(|_| {
                DVec3::new(
                    coordinate(),
                    coordinate(),
                    if round % 2 == 0 { 0.0 } else { coordinate() },
                )
            })
            .collect();
        if let Ok(mesh) = load("a.obj", polygon(&points), None) {
            assert!(mesh.triangles.len() <= count - 2, "{round}");
        }
    }
}
