//! Axis-aligned bounding boxes of shapes and scenes.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Geometry, Scene};

/// The minimum and maximum corner of a box.
pub type Bounds = (DVec3, DVec3);

impl Scene {
    /// Returns the bounding box of all shapes except planes, or `None` if there are only planes.
    pub fn bounds(&self) -> Option<Bounds> {
        let all = self.shapes.iter().filter_map(|shape| shape.geometry.bounds());
        all.reduce(join)
    }
}

impl Geometry {
    /// Returns the bounding box, or `None` for a plane, which is infinite.
    pub fn bounds(&self) -> Option<Bounds> {
        of(self)
    }
}

fn join((low, high): Bounds, (other_low, other_high): Bounds) -> Bounds {
    (low.min(other_low), high.max(other_high))
}

fn around(center: DVec3, reach: DVec3) -> Option<Bounds> {
    Some((center - reach, center + reach))
}

fn of(geometry: &Geometry) -> Option<Bounds> {
    // The extent of a disk or an ellipsoid along an axis is the norm of its half axes' components there.
    let round = |axes: &[DVec3]| axes.iter().map(|axis| axis * axis).sum::<DVec3>().map(f64::sqrt);
    match geometry {
        Geometry::Rectangle(shape) => around(shape.center, shape.u.abs() + shape.v.abs()),
        Geometry::Disk(shape) => around(shape.center, round(&[shape.u, shape.v])),
        Geometry::Ellipsoid { center, axes } => around(*center, round(axes)),
        Geometry::Triangles(triangles) => {
            let points = triangles.iter().flatten().map(|point| (*point, *point));
            points.reduce(join)
        }
        Geometry::Mesh { mesh, to_world, .. } => {
            let place = |point: &Vec3| to_world.transform_point3(point.as_dvec3() + mesh.center);
            let points = mesh.positions.par_iter().map(place);
            points.map(|point| (point, point)).reduce_with(join)
        }
        Geometry::Plane { .. } => None,
    }
}
