//! Validated materials.

use glam::DVec3;

use crate::description::{AlphaMode, VertexColors};
use crate::metals::MetalIndex;
use crate::texture::{Color, NormalMap, Value};

/// A surface material.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Material {
    /// Reflection and transmission.
    pub reflection: Reflection,
    /// Radiance emitted on both sides; black with [`Integrator::Phong`](crate::Integrator::Phong).
    pub emission: Color,
    /// Normal map.
    pub normal_map: Option<NormalMap>,
    /// True if the camera sees the surface. If false, camera rays pass through the surface, and other rays hit it.
    pub visible: bool,
}

/// The BSDF of a material.
#[derive(Clone, Debug, PartialEq)]
pub enum Reflection {
    /// Phong reflection model.
    Phong {
        /// Factor of the ambient light.
        ambient: Color,
        /// Factor of the diffuse term.
        diffuse: Color,
        /// Factor of the specular term.
        specular: Color,
        /// Exponent of the specular term, greater than 0.
        shininess: f64,
    },
    /// A perfect mirror.
    Mirror {
        /// Factor of the reflected light.
        tint: Color,
    },
    /// Clear glass; reflection and transmission follow the Fresnel equations.
    Glass {
        /// Index of refraction on the side opposite to the outward normal, relative to the other side.
        ior: f64,
        /// Factor of the transmitted light, on entry and on exit.
        tint: Color,
    },
    /// A diffuse surface. This and the following variants are only valid for
    /// [`Integrator::Path`](crate::Integrator::Path).
    Diffuse {
        /// Albedo, 0 to 1.
        color: Color,
        /// Roughness, 0 to 1.
        roughness: Value,
    },
    /// Metal.
    Conductor {
        /// Reflectance, 0 to 1; white if `index` is set.
        color: Color,
        /// Complex index of refraction. If `None`, the reflectance does not depend on the angle.
        index: Option<MetalIndex>,
        /// Roughness of the microfacets.
        facets: Facets,
    },
    /// Clear glass or liquid; reflection and transmission follow the Fresnel equations.
    Dielectric {
        /// Index of refraction on the side opposite to the outward normal, relative to the other side.
        ior: f64,
        /// Factor of the transmitted light, on entry and on exit, 0 to 1.
        color: Color,
        /// Absorption coefficient a per unit of length: the transmittance over a length of 1 is exp(-a).
        absorption: DVec3,
        /// True for a thin sheet with the same medium on both sides.
        thin: bool,
        /// Roughness of the microfacets.
        facets: Facets,
    },
    /// glTF's metallic-roughness material with its extensions.
    Principled(Box<Principled>),
}

/// The material `principled`. Numbers are from 0 to 1 unless noted otherwise.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Principled {
    /// Albedo of the dielectric's diffuse base, or reflectance of the metal at normal incidence; 0 to 1.
    pub base_color: Color,
    /// Metallic weight.
    pub metallic: Value,
    /// Roughness: the square root of GGX's alpha.
    pub roughness: Value,
    /// Increase of the roughness along the tangent.
    pub anisotropy: Value,
    /// Rotation of the tangent, counter-clockwise in radians.
    pub anisotropy_rotation: f64,
    /// Index of the texture that contains the unrotated tangent: red and green, mapped from 0 ... 1 to -1 ... 1, are
    /// the components along u and v.
    pub anisotropy_direction: Option<usize>,
    /// Index of refraction of the dielectric, 1 to 100.
    pub ior: f64,
    /// Factor of the dielectric's reflection.
    pub specular: Value,
    /// Color factor of the dielectric's reflection at normal incidence.
    pub specular_color: Color,
    /// Fraction of the dielectric's light that is transmitted.
    pub transmission: Value,
    /// True for a thin sheet, which does not refract.
    pub thin: bool,
    /// Absorption coefficient behind a surface that is not thin, per unit of length: 0 to 1e6.
    pub absorption: DVec3,
    /// Weight of the clear coat.
    pub clearcoat: Value,
    /// Roughness of the clear coat.
    pub clearcoat_roughness: Value,
    /// Normal map of the clear coat.
    pub clearcoat_normal_map: Option<NormalMap>,
    /// Color of the sheen, 0 to 1.
    pub sheen_color: Color,
    /// Roughness of the sheen.
    pub sheen_roughness: Value,
    /// Opacity.
    pub alpha: Value,
    /// Effect of `alpha`.
    pub alpha_mode: AlphaMode,
    /// Minimum alpha of opaque points, with [`AlphaMode::Mask`].
    pub alpha_cutoff: f64,
    /// Use of a mesh's vertex colors.
    pub vertex_colors: VertexColors,
    /// If false, back faces are invisible to the camera, but not to other rays.
    pub double_sided: bool,
}

impl Material {
    /// Returns the indices of the material's textures.
    pub fn textures(&self) -> Vec<usize> {
        let (mut colors, mut values, mut maps) = (vec![&self.emission], Vec::new(), vec![&self.normal_map]);
        let mut direction = None;
        match &self.reflection {
            Reflection::Phong {
                ambient,
                diffuse,
                specular,
                ..
            } => colors.extend([ambient, diffuse, specular]),
            Reflection::Mirror { tint } | Reflection::Glass { tint, .. } => colors.push(tint),
            Reflection::Diffuse { color, roughness } => {
                colors.push(color);
                values.push(roughness);
            }
            Reflection::Conductor { color, facets, .. } | Reflection::Dielectric { color, facets, .. } => {
                colors.push(color);
                values.push(&facets.roughness);
            }
            Reflection::Principled(principled) => {
                colors.extend(principled.colors());
                values.extend(principled.values());
                maps.push(&principled.clearcoat_normal_map);
                direction = principled.anisotropy_direction;
            }
        }
        let colors = colors.into_iter().filter_map(|color| match color {
            Color::Texture(i) => Some(*i),
            Color::Plain(_) => None,
        });
        let values = values.into_iter().filter_map(|value| match value {
            Value::Texture(i, _) => Some(*i),
            Value::Plain(_) => None,
        });
        let maps = maps.into_iter().flatten().map(|map| map.texture);
        colors.chain(values).chain(maps).chain(direction).collect()
    }

    /// Returns true if anisotropy or the normal map of the clear coat needs a tangent in addition to the tangent of the
    /// normal map.
    pub fn has_direction(&self) -> bool {
        match &self.reflection {
            Reflection::Conductor { facets, .. } | Reflection::Dielectric { facets, .. } => facets.anisotropy > 0.0,
            Reflection::Principled(principled) => {
                principled.clearcoat_normal_map.is_some() || principled.anisotropy != Value::Plain(0.0)
            }
            _ => false,
        }
    }
}

impl Principled {
    /// Returns all colors that may be textures.
    pub fn colors(&self) -> [&Color; 3] {
        [&self.base_color, &self.specular_color, &self.sheen_color]
    }

    /// Returns all scalar values that may be textures.
    pub fn values(&self) -> [&Value; 9] {
        [
            &self.metallic,
            &self.roughness,
            &self.anisotropy,
            &self.specular,
            &self.transmission,
            &self.clearcoat,
            &self.clearcoat_roughness,
            &self.sheen_roughness,
            &self.alpha,
        ]
    }
}

/// Roughness of a microfacet surface.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Facets {
    /// Roughness, 0 to 1; the square root of alpha.
    pub roughness: Value,
    /// Increase of the roughness along the first axis, 0 to 1.
    pub anisotropy: f64,
    /// Rotation of the first axis from the direction of u towards the direction of v, in degrees.
    pub rotation: f64,
    /// True to compensate the energy that a single-scattering microfacet model loses.
    pub compensated: bool,
}

impl Default for Facets {
    /// A smooth surface.
    fn default() -> Self {
        Facets {
            roughness: Value::Plain(0.0),
            anisotropy: 0.0,
            rotation: 0.0,
            compensated: true,
        }
    }
}
