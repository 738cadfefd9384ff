//! Twin of `shaders/camera.wgsl`.

use glam::{Vec2, Vec3};

use super::differential::{Derivative, Differential};
use super::lanes::{Real, Vector2, constant};
use super::math::{dot, normalize};
use super::ray::Ray;
use crate::records::{Camera, ORTHOGRAPHIC};

#[inline(always)]
pub fn camera_ray<V: Vector2>(camera: &Camera, raster: V) -> Ray<<V::Real as Real>::Vec3> {
    let offset = image_plane_offset(camera, raster);
    let (position, forward) = (
        raster.x().broadcast(camera.position),
        raster.x().broadcast(camera.forward),
    );
    if camera.projection == ORTHOGRAPHIC {
        return Ray {
            origin: position + offset,
            direction: forward,
        };
    }
    Ray {
        origin: position,
        direction: normalize(forward + offset),
    }
}

pub fn camera_differential(camera: &Camera, raster: Vec2, spacing: f32) -> Differential {
    Differential {
        x: camera_derivative(camera, raster, camera.right * (2.0 / camera.width as f32 * spacing)),
        y: camera_derivative(camera, raster, camera.up * (-2.0 / camera.height as f32 * spacing)),
    }
}

pub fn camera_derivative(camera: &Camera, raster: Vec2, step: Vec3) -> Derivative {
    if camera.projection == ORTHOGRAPHIC {
        return Derivative {
            position: step,
            direction: Vec3::ZERO,
        };
    }
    let d = camera.forward + image_plane_offset(camera, raster);
    let dd = dot(d, d);
    Derivative {
        position: Vec3::ZERO,
        direction: (step * dd - d * dot(d, step)) / (dd * dd.sqrt()),
    }
}

#[inline(always)]
pub fn image_plane_offset<V: Vector2>(camera: &Camera, at: V) -> <V::Real as Real>::Vec3 {
    let x = at.x() * (2.0 / camera.width as f32) - 1.0;
    let y = constant(1.0) - at.y() * (2.0 / camera.height as f32);
    x.broadcast(camera.right) * x + x.broadcast(camera.up) * y
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use glam::Vec3;

    use super::*;
    use crate::records::PERSPECTIVE;

    /// Returns a camera that looks along +y, +x to the right and +z up; the image plane is 4 x 2, one unit ahead.
    fn camera(projection: u32) -> Camera {
        Camera {
            position: Vec3::new(1.0, 2.0, 3.0),
            projection,
            right: Vec3::X * 2.0,
            width: 8,
            up: Vec3::Z,
            height: 4,
            forward: Vec3::Y,
            ..Camera::zeroed()
        }
    }

    #[test]
    fn perspective_rays_start_at_the_camera() {
        let camera = camera(PERSPECTIVE);
        for (raster, direction) in [
            ((4.0, 2.0), (0.0, 1.0, 0.0)),
            ((0.0, 0.0), (-2.0, 1.0, 1.0)),
            ((8.0, 4.0), (2.0, 1.0, -1.0)),
        ] {
            let ray = camera_ray(&camera, Vec2::from(raster));
            assert_eq!(ray.origin, camera.position);
            assert!(
                (ray.direction - Vec3::from(direction).normalize()).length() < 1e-6,
                "{raster:?}: {}",
                ray.direction
            );
        }
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let camera = camera(ORTHOGRAPHIC);
        for (raster, origin) in [
            ((4.0, 2.0), (1.0, 2.0, 3.0)),
            ((0.0, 0.0), (-1.0, 2.0, 4.0)),
            ((8.0, 4.0), (3.0, 2.0, 2.0)),
        ] {
            let ray = camera_ray(&camera, Vec2::from(raster));
            assert_eq!((ray.origin, ray.direction), (origin.into(), Vec3::Y), "{raster:?}");
        }
    }
}
