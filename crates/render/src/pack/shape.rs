//! Primitives' records.

use glam::{DMat3, DVec3};

use super::{DISK, ELLIPSOID, PLANE, Primitive, RECTANGLE, TRIANGLE};
use wgray_scene::{Geometry, Parallelogram, Scene};

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
                let [a, b, c] = *axes;
                primitives.push(primitive(
                    ELLIPSOID,
                    *center,
                    DMat3::from_cols(a, b, c),
                    material,
                    number,
                ));
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

pub(super) fn parallelogram(kind: u32, p: &Parallelogram, material: u32, shape: u32) -> Primitive {
    primitive(
        kind,
        p.center,
        DMat3::from_cols(p.u, p.v, p.u.cross(p.v).normalize()),
        material,
        shape,
    )
}

/// The primitive whose local space is mapped to the world by `columns` and then `center`. An ellipsoid's anchor is the
/// point of it on the way from its centre to the origin.
pub(crate) fn primitive(kind: u32, center: DVec3, columns: DMat3, material: u32, shape: u32) -> Primitive {
    let to_local = columns.inverse();
    let rows = to_local.transpose();
    let (mut anchor, mut middle) = (center.as_vec3(), DVec3::ZERO);
    if kind == ELLIPSOID {
        let outwards = (to_local * -center).normalize_or(DVec3::X);
        anchor = (center + columns * outwards).as_vec3();
        middle = to_local * (center - anchor.as_dvec3());
    }
    Primitive {
        anchor,
        material,
        x: rows.x_axis.as_vec3(),
        shape,
        y: rows.y_axis.as_vec3(),
        kind,
        z: rows.z_axis.as_vec3(),
        determinant: rows.determinant() as f32,
        middle: middle.as_vec3(),
        level: (middle.length_squared() - 1.0) as f32,
    }
}
