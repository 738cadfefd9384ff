//! Packs a camera into its record.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::{Camera, ORTHOGRAPHIC, PANORAMA, PERSPECTIVE};
use wgray_scene::{self as scene, Projection};

/// Packs a camera, with coordinates relative to `origin`.
pub fn pack_camera(camera: &scene::Camera, origin: DVec3, width: u32, height: u32, seed: u32) -> Camera {
    let aspect = match camera.projection {
        Projection::Panorama => 1.0, // right and up are unit vectors
        _ => f64::from(width) / f64::from(height),
    };
    let (projection, half_height) = match camera.projection {
        Projection::Perspective { fov } => (PERSPECTIVE, (fov / 2.0).tan()),
        Projection::Orthographic { height } => (ORTHOGRAPHIC, height / 2.0),
        Projection::Panorama => (PANORAMA, 1.0),
    };
    let lens = camera.lens;
    // The aperture polygon's first corner is at the top.
    let (sin, cos) = lens
        .filter(|lens| lens.blades > 0)
        .map_or((0.0, 1.0), |lens| (FRAC_PI_2 + lens.rotation).sin_cos());
    let radius = lens.map_or(0.0, |lens| lens.radius);
    Camera {
        position: (camera.position - origin).as_vec3(),
        projection,
        right: (camera.right * half_height * aspect).as_vec3(),
        width,
        up: (camera.up * half_height).as_vec3(),
        height,
        forward: camera.forward.as_vec3(),
        seed,
        lens_u: ((camera.right * cos + camera.up * sin) * radius).as_vec3(),
        blades: lens.map_or(0, |lens| lens.blades),
        lens_v: ((camera.up * cos - camera.right * sin) * radius).as_vec3(),
        inverse_focus: lens.map_or(0.0, |lens| 1.0 / lens.focus) as f32,
    }
}
