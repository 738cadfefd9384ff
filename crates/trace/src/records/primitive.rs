//! The record of a primitive with a given transform.

use glam::{DMat3, DVec2, DVec3};

use super::{CYLINDER, ELLIPSOID, Primitive};

/// Returns the primitive whose object-to-world transform has these columns and the translation `center`. The anchor of
/// a solid is a surface point towards the origin, so that coordinates near the origin keep their precision for any
/// size.
pub fn primitive(kind: u32, center: DVec3, columns: DMat3, material: u32, shape: u32) -> Primitive {
    let to_local = columns.inverse();
    let rows = to_local.transpose();
    let (mut anchor, mut middle) = (center.as_vec3(), DVec3::ZERO);
    let origin = to_local * -center;
    let nearest = match kind {
        ELLIPSOID => Some(origin.normalize_or(DVec3::X)),
        CYLINDER => Some(nearest_of_cylinder(origin)),
        _ => None,
    };
    if let Some(local_point) = nearest {
        anchor = (center + columns * local_point).as_vec3();
        middle = to_local * (center - anchor.as_dvec3());
    }
    // The level of a cylinder is the level of its curved side, which does not depend on z.
    let square = match kind {
        CYLINDER => middle.truncate().length_squared(),
        _ => middle.length_squared(),
    };
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
        level: (square - 1.0) as f32,
    }
}

/// Returns a surface point near a local point: on a cap if the point is beyond the cap, otherwise on the side.
fn nearest_of_cylinder(point: DVec3) -> DVec3 {
    let radial = point.truncate();
    let radial = match point.z.abs() > 1.0 && radial.length() < 1.0 {
        true => radial,
        false => radial.normalize_or(DVec2::X),
    };
    radial.extend(point.z.clamp(-1.0, 1.0))
}
