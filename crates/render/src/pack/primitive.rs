//! Records of primitives, bounds and areas.

use glam::{DMat3, DVec3, Vec3};

use super::{CYLINDER, DISK, ELLIPSOID, PLANE, Primitive, RECTANGLE, Sphere, TRIANGLE, primitive};
use wgray_scene::{Bounds, Geometry, Parallelogram, Scene};

/// Factor that enlarges bounding spheres, because records are rounded.
const SPHERE_MARGIN: f64 = 1.0 + 1e-5;

/// Radius of a plane's bounding sphere: larger than any scene, but with a finite square.
const PLANE_RADIUS: f64 = 1e18;

pub(super) fn pack_shapes(scene: &Scene) -> Vec<Primitive> {
    let mut primitives = Vec::new();
    for (number, shape) in scene.shapes.iter().enumerate() {
        let (material, number) = (shape.material as u32, number as u32);
        match &shape.geometry {
            Geometry::Rectangle(rectangle) => {
                primitives.push(parallelogram(RECTANGLE, rectangle, material, number));
            }
            Geometry::Disk(disk) => primitives.push(parallelogram(DISK, disk, material, number)),
            Geometry::Ellipsoid { center, axes } => {
                primitives.push(primitive(ELLIPSOID, *center, matrix_of(axes), material, number));
            }
            Geometry::Cylinder { center, axes } => {
                primitives.push(primitive(CYLINDER, *center, matrix_of(axes), material, number));
            }
            Geometry::Triangles(triangles) => {
                for &[v0, v1, v2] in triangles {
                    let (a, b) = (v1 - v0, v2 - v0);
                    let columns = DMat3::from_cols(a, b, a.cross(b).normalize());
                    primitives.push(primitive(TRIANGLE, v0, columns, material, number));
                }
            }
            Geometry::Mesh { .. } => {}
            Geometry::Plane {
                point,
                tangent,
                bitangent,
            } => {
                let columns = DMat3::from_cols(*tangent, *bitangent, tangent.cross(*bitangent));
                primitives.push(primitive(PLANE, *point, columns, material, number));
            }
        }
    }
    primitives
}

fn matrix_of([a, b, c]: &[DVec3; 3]) -> DMat3 {
    DMat3::from_cols(*a, *b, *c)
}

pub(super) fn parallelogram(kind: u32, p: &Parallelogram, material: u32, shape: u32) -> Primitive {
    primitive(
        kind,
        p.center,
        DMat3::from_cols(p.u, p.v, p.u.cross(p.v).normalize()),
        material,
        shape,
    )
}

/// Returns the local axes in world space.
pub fn axes(primitive: &Primitive) -> [DVec3; 3] {
    let columns = columns(primitive);
    [columns.x_axis, columns.y_axis, columns.z_axis]
}

fn columns(primitive: &Primitive) -> DMat3 {
    let [x, y, z] = [primitive.x, primitive.y, primitive.z].map(Vec3::as_dvec3);
    DMat3::from_cols(x, y, z).transpose().inverse()
}

fn center(primitive: &Primitive) -> DVec3 {
    primitive.anchor.as_dvec3() + columns(primitive) * primitive.middle.as_dvec3()
}

/// Returns the bounding box, infinite for a plane.
pub fn bounding_box(primitive: &Primitive) -> Bounds {
    let [a, b, c] = axes(primitive);
    let center = center(primitive);
    let root = |squares: DVec3| squares.map(f64::sqrt);
    let half = match primitive.kind {
        RECTANGLE => a.abs() + b.abs(),
        DISK => root(a * a + b * b),
        CYLINDER => root(a * a + b * b) + c.abs(),
        ELLIPSOID => root(a * a + b * b + c * c),
        TRIANGLE => {
            let zero = DVec3::ZERO;
            return (center + zero.min(a).min(b), center + zero.max(a).max(b));
        }
        PLANE => DVec3::INFINITY,
        kind => unreachable!("primitive kind {kind}"),
    };
    (center - half, center + half)
}

/// Returns a bounding sphere, larger than any scene for a plane.
pub fn bounding_sphere(primitive: &Primitive) -> Sphere {
    let [a, b, c] = axes(primitive);
    let center = center(primitive);
    let (center, radius) = match primitive.kind {
        RECTANGLE => (center, (a + b).length().max((a - b).length())),
        TRIANGLE => {
            let middle = (a + b) / 3.0;
            (
                center + middle,
                middle.length().max((a - middle).length()).max((b - middle).length()),
            )
        }
        ELLIPSOID => (center, largest_stretch(DMat3::from_cols(a, b, c))),
        DISK => (center, largest_stretch(DMat3::from_cols(a, b, DVec3::ZERO))),
        CYLINDER => (center, a.length().max(b.length()).hypot(c.length())),
        PLANE => (center, PLANE_RADIUS),
        kind => unreachable!("primitive kind {kind}"),
    };
    Sphere {
        center: center.as_vec3(),
        radius: (radius * SPHERE_MARGIN) as f32,
    }
}

/// Returns the area for light samples: for an ellipsoid, the value of `ellipsoid_area` in WGSL; for a plane, 0.
pub fn area(primitive: &Primitive) -> f64 {
    let [u, v, w] = axes(primitive);
    let span = u.cross(v).length();
    match primitive.kind {
        RECTANGLE => 4.0 * span,
        DISK => std::f64::consts::PI * span,
        TRIANGLE => 0.5 * span,
        CYLINDER => std::f64::consts::PI * (4.0 * u.length() * w.length() + 2.0 * span),
        ELLIPSOID => {
            let rows = [primitive.x, primitive.y, primitive.z].map(|row| row.as_dvec3().length_squared());
            let squares: f64 = rows.iter().sum();
            4.0 * std::f64::consts::PI * (squares / 3.0).sqrt() / f64::from(primitive.determinant).abs()
        }
        PLANE => 0.0,
        kind => unreachable!("primitive kind {kind}"),
    }
}

/// Returns a linear map's largest singular value: the root of the largest eigenvalue of its transpose times itself, a
/// symmetric matrix (Smith, "Eigenvalues of a Symmetric 3 x 3 Matrix", CACM 4(4), 1961).
fn largest_stretch(map: DMat3) -> f64 {
    let square = map.transpose() * map;
    let trace = |m: &DMat3| m.x_axis.x + m.y_axis.y + m.z_axis.z;
    let mean = trace(&square) / 3.0;
    let deviation = square - DMat3::from_diagonal(glam::DVec3::splat(mean));
    let spread = (trace(&(deviation * deviation)) / 6.0).sqrt();
    if !(spread > 0.0) {
        return mean.sqrt();
    }
    let angle = ((deviation * (1.0 / spread)).determinant() / 2.0)
        .clamp(-1.0, 1.0)
        .acos()
        / 3.0;
    (mean + 2.0 * spread * angle.cos()).sqrt()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn the_largest_singular_value_is_the_longest_axis() {
        let rotation = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        for axes in [[1.0, 1.0, 1.0], [3.0, 1.0, 1.0], [0.5, 2.0, 1.0], [1e-4, 1.0, 1e3]] {
            let map = rotation * DMat3::from_diagonal(DVec3::from_array(axes)) * rotation.transpose();
            let longest = axes.into_iter().fold(0.0, f64::max);
            assert!(
                (largest_stretch(map) / longest - 1.0).abs() < 1e-6,
                "{axes:?}: {}",
                largest_stretch(map)
            );
        }
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Z);
        assert!((largest_stretch(shear) - (1.0 + 5f64.sqrt()) / 2.0).abs() < 1e-12);
    }
}
