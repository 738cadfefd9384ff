//! The default material of meshes.

use glam::DVec3;

use super::super::{Color, Integrator, Material, Principled, Reflection, VertexColors};
use super::principled::dielectric;

/// Albedo of meshes without vertex colors.
const GRAY: f64 = 0.8;
/// Phong exponent, which has no effect because the specular factor is black.
const SHININESS: f64 = 16.0;
/// Roughness of the material for the path tracer.
const ROUGHNESS: f64 = 0.5;

/// Returns the default materials of meshes without and with vertex colors; the Phong integrator ignores the colors.
pub(super) fn default_materials(integrator: Integrator) -> [Material; 2] {
    [false, true].map(|has_colors| Material {
        reflection: match integrator.follows_paths() {
            false => phong(),
            true => Reflection::Principled(Box::new(principled(has_colors))),
        },
        emission: Color::BLACK,
        normal_map: None,
        visible: true,
    })
}

fn phong() -> Reflection {
    let gray = Color::Plain(DVec3::splat(GRAY));
    Reflection::Phong {
        ambient: gray,
        diffuse: gray,
        specular: Color::BLACK,
        shininess: SHININESS,
    }
}

fn principled(has_colors: bool) -> Principled {
    let (color, vertex_colors) = match has_colors {
        true => (1.0, VertexColors::BaseColor),
        false => (GRAY, VertexColors::None),
    };
    Principled {
        vertex_colors,
        ..dielectric(Color::Plain(DVec3::splat(color)), ROUGHNESS)
    }
}
