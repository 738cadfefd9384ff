//! Spheres around primitives.

use glam::{DMat3, DVec3, Vec3};

use super::{DISK, ELLIPSOID, Primitive, RECTANGLE, Sphere, TRIANGLE};

/// Room for the rounding of the records, relative to the radius.
const EXTRA: f64 = 1.0 + 1e-5;

/// A sphere around a primitive; around a plane one without bound.
pub fn sphere(primitive: &Primitive) -> Sphere {
    let [x, y, z] = [primitive.x, primitive.y, primitive.z].map(Vec3::as_dvec3);
    let axes = DMat3::from_cols(x, y, z).transpose().inverse();
    let (a, b) = (axes.x_axis, axes.y_axis);
    let center = primitive.anchor.as_dvec3() + axes * primitive.middle.as_dvec3();
    let (center, radius) = match primitive.kind {
        RECTANGLE => (center, (a + b).length().max((a - b).length())),
        TRIANGLE => {
            let middle = (a + b) / 3.0;
            (
                center + middle,
                middle.length().max((a - middle).length()).max((b - middle).length()),
            )
        }
        ELLIPSOID => (center, largest_stretch(axes)),
        DISK => (center, largest_stretch(DMat3::from_cols(a, b, DVec3::ZERO))),
        _ => (center, UNBOUNDED),
    };
    Sphere {
        center: center.as_vec3(),
        radius: (radius * EXTRA) as f32,
    }
}

/// Larger than any scene, and its square is a number.
const UNBOUNDED: f64 = 1e18;

/// The largest factor by which a linear map stretches any vector: the root of the largest eigenvalue of its square, a
/// symmetric matrix (Smith, "Eigenvalues of a Symmetric 3 x 3 Matrix", CACM 4(4), 1961).
fn largest_stretch(map: DMat3) -> f64 {
    let square = map.transpose() * map;
    let trace = |m: &DMat3| m.x_axis.x + m.y_axis.y + m.z_axis.z;
    let mean = trace(&square) / 3.0;
    let rest = square - DMat3::from_diagonal(glam::DVec3::splat(mean));
    let spread = (trace(&(rest * rest)) / 6.0).sqrt();
    if !(spread > 0.0) {
        return mean.sqrt();
    }
    let angle = ((rest * (1.0 / spread)).determinant() / 2.0).clamp(-1.0, 1.0).acos() / 3.0;
    (mean + 2.0 * spread * angle.cos()).sqrt()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_map_stretches_by_its_longest_axis() {
        let turn = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
        for axes in [[1.0, 1.0, 1.0], [3.0, 1.0, 1.0], [0.5, 2.0, 1.0], [1e-4, 1.0, 1e3]] {
            let map = turn * DMat3::from_diagonal(DVec3::from_array(axes)) * turn.transpose();
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
