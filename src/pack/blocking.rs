//! Which primitives can cast a shadow at all: a flat one with the whole scene on one side of its plane cannot, as no
//! segment from a surface to a light crosses it. The walls of a room are such.

use glam::DVec3;

use super::{ELLIPSOID, Primitive};
use crate::scene::{Geometry, Light, Material, Parallelogram, Scene, Shadows};

/// How far beyond a plane a point counts as on it, relative to the coordinates: the rounding of its record.
const TOLERANCE: f64 = 1e-6;

/// For each primitive, whether it can hide a point of a surface from a light.
pub fn can_cast_shadow(scene: &Scene, primitives: &[Primitive]) -> Vec<bool> {
    primitives
        .iter()
        .map(|p| match scene.shapes.get(p.shape as usize) {
            Some(shape) => casts_shadow(scene, shape.material) && blocks(scene, p),
            None => false, // a light
        })
        .collect()
}

fn casts_shadow(scene: &Scene, material: usize) -> bool {
    let is_glass = matches!(scene.materials[material], Material::Glass { .. });
    scene.render.shadows == Shadows::Opaque || !is_glass
}

fn blocks(scene: &Scene, primitive: &Primitive) -> bool {
    if primitive.kind == ELLIPSOID {
        return true;
    }
    let normal = primitive.z.as_dvec3().normalize();
    let center = primitive.anchor.as_dvec3();
    let mut range = Range {
        normal,
        center,
        below: false,
        above: false,
    };
    for shape in &scene.shapes {
        match &shape.geometry {
            Geometry::Rectangle(rectangle) => range.parallelogram(rectangle),
            Geometry::Ellipsoid { center, axes } => {
                let half = axes
                    .map(|axis| axis.dot(normal))
                    .iter()
                    .map(|h| h * h)
                    .sum::<f64>()
                    .sqrt();
                range.point(center + normal * half);
                range.point(center - normal * half);
            }
            Geometry::Triangles(triangles) => triangles.iter().flatten().for_each(|v| range.point(*v)),
            Geometry::Plane {
                point,
                tangent,
                bitangent,
            } => {
                range.point(*point);
                for direction in [tangent, bitangent] {
                    range.direction(*direction);
                    range.direction(-direction);
                }
            }
        }
    }
    for light in &scene.lights {
        match light {
            Light::Rectangle { rectangle, .. } => range.parallelogram(rectangle),
            Light::Point { position, .. } => range.point(*position),
            Light::Directional { direction, .. } => range.direction(-direction),
        }
    }
    range.below && range.above
}

/// On which sides of a plane things were seen.
struct Range {
    normal: DVec3,
    center: DVec3,
    below: bool,
    above: bool,
}

impl Range {
    fn point(&mut self, p: DVec3) {
        let size = p.abs().max(self.center.abs()).max_element();
        self.height((p - self.center).dot(self.normal), size);
    }

    /// A point infinitely far away.
    fn direction(&mut self, d: DVec3) {
        self.height(d.dot(self.normal), 1.0);
    }

    fn parallelogram(&mut self, p: &Parallelogram) {
        for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            self.point(p.center + p.u * a + p.v * b);
        }
    }

    fn height(&mut self, height: f64, size: f64) {
        self.below |= height < -TOLERANCE * size;
        self.above |= height > TOLERANCE * size;
    }
}
