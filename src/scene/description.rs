//! What a scene file says, field for field; `docs/scene-format.md` describes every key.
//!
//! Nothing here is checked but the types: [`Description::validate`] makes a [`Scene`](super::Scene) of it.
//! Serializing a `Description` with the `toml` crate gives a file that reads back as the same `Description`.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::Table;

pub use super::describe_texture::*;

/// A whole scene file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Description {
    /// `[image]`
    pub image: ImageDescription,
    /// `[camera]`
    pub camera: CameraDescription,
    /// `[render]`
    pub render: RenderDescription,
    /// `[textures.NAME]`
    pub textures: BTreeMap<String, TextureDescription>,
    /// `[materials.NAME]`
    pub materials: BTreeMap<String, MaterialDescription>,
    /// `[[lights]]`
    pub lights: Vec<LightDescription>,
    /// `[[shapes]]`
    pub shapes: Vec<ShapeDescription>,
}

/// The size of the picture.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ImageDescription {
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
}

/// The settings of a render.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct RenderDescription {
    /// What light is simulated.
    pub integrator: super::Integrator,
    /// The ambient light.
    pub ambient: DVec3,
    /// Radiance of rays that leave the scene.
    pub background: DVec3,
    /// Relative offset of shadow rays.
    pub shadow_epsilon: f64,
    /// Whether glass casts shadows.
    pub shadows: super::Shadows,
    /// Most bounces of a path by mirrors and glass.
    pub max_depth: u32,
    /// Whether textures are filtered over the footprint of each ray.
    pub ray_differentials: bool,
    /// Seed of all random patterns.
    pub seed: u32,
    /// Samples of every pixel.
    pub pixel_samples: SamplesDescription,
    /// Samples of every area light at every hit.
    pub light_samples: SamplesDescription,
    /// What a pixel's samples are weighted by.
    pub filter: PixelFilterDescription,
    /// Further samples where they are needed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveDescription>,
}

impl Default for RenderDescription {
    fn default() -> Self {
        let samples = SamplesDescription {
            pattern: Pattern::Grid,
            count: 16,
        };
        Self {
            integrator: super::Integrator::Phong,
            ambient: DVec3::ZERO,
            background: DVec3::ZERO,
            shadow_epsilon: 1e-5,
            shadows: super::Shadows::Opaque,
            max_depth: 8,
            ray_differentials: true,
            seed: 0,
            pixel_samples: samples.clone(),
            light_samples: samples,
            filter: PixelFilterDescription {
                kind: PixelFilterKind::Box,
                radius: None,
            },
            adaptive: None,
        }
    }
}

/// A pattern of samples.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SamplesDescription {
    /// How they are laid out.
    #[serde(default)]
    pub pattern: Pattern,
    /// How many.
    pub count: u32,
}

/// How samples are laid out on the unit square. In a file the names are in snake case: `"grid"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Pattern {
    /// The centres of n x n cells.
    #[default]
    Grid,
    /// The grid, turned by atan(1/2).
    RotatedGrid,
    /// A uniform position in each of n x n cells.
    Jittered,
    /// Independent and uniform.
    Random,
    /// Halton's sequence in bases 2 and 3, randomly rotated.
    Halton,
    /// Sobol's sequence, Owen-scrambled.
    Sobol,
}

impl Pattern {
    /// All of them.
    pub const ALL: [Pattern; 6] = [
        Pattern::Grid,
        Pattern::RotatedGrid,
        Pattern::Jittered,
        Pattern::Random,
        Pattern::Halton,
        Pattern::Sobol,
    ];

    /// The name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Pattern::Grid => "grid",
            Pattern::RotatedGrid => "rotated_grid",
            Pattern::Jittered => "jittered",
            Pattern::Random => "random",
            Pattern::Halton => "halton",
            Pattern::Sobol => "sobol",
        }
    }

    /// Whether the pattern is made of n x n cells, so that its count must be a square number.
    pub const fn needs_square(self) -> bool {
        matches!(self, Pattern::Grid | Pattern::RotatedGrid | Pattern::Jittered)
    }

    /// Whether the pattern has further positions when all of a set are used, so that sampling can be adaptive.
    pub const fn goes_on(self) -> bool {
        !matches!(self, Pattern::Grid | Pattern::RotatedGrid)
    }
}

/// Adaptive sampling.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveDescription {
    /// The standard error of a pixel's displayed value that is aimed at.
    pub error: f64,
    /// The most samples of a pixel; absent, 16 times their count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_samples: Option<u32>,
}

/// A reconstruction filter.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PixelFilterDescription {
    /// Its form.
    #[serde(rename = "type")]
    pub kind: PixelFilterKind,
    /// How far it reaches, in pixels; absent, what is usual for its form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
}

/// The form of a reconstruction filter, a product of the same function of x and of y. In a file the names are in snake
/// case: `"blackman_harris"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum PixelFilterKind {
    /// Constant.
    Box,
    /// Linear from the middle to the radius.
    Triangle,
    /// The bell, with a standard deviation of a third of the radius.
    Gaussian,
    /// The cubic of Mitchell and Netravali with B = C = 1/3, with negative lobes.
    Mitchell,
    /// The window of Blackman and Harris, of four terms.
    BlackmanHarris,
}

impl PixelFilterKind {
    /// The usual radius in pixels.
    pub const fn radius(self) -> f64 {
        match self {
            PixelFilterKind::Box => 0.5,
            PixelFilterKind::Triangle => 1.0,
            PixelFilterKind::Gaussian | PixelFilterKind::BlackmanHarris => 1.5,
            PixelFilterKind::Mitchell => 2.0,
        }
    }
}

/// An enum whose variants a file tells apart by the key `type`.
pub(super) trait Tagged: Sized {
    /// The values that `type` may have.
    const TYPES: &'static [&'static str];

    /// Reads the table without its `type`, which is `tag`; `None` if there is no such type.
    fn read(tag: &str, body: Table) -> Option<Result<Self, ReadError>>;
}

/// An error of serde with the path that leads to it.
pub(super) type ReadError = serde_path_to_error::Error<toml::de::Error>;

/// Defines a [`Tagged`] enum. It is not left to serde's `tag` alone because that forgets, while reading, in
/// which key of the table an error is.
macro_rules! tagged {
    ($(#[$doc:meta])* $name:ident {
        $($(#[$variant_doc:meta])* $tag:literal => $variant:ident($body:ident),)+
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[serde(tag = "type")]
        #[non_exhaustive]
        pub enum $name {
            $($(#[$variant_doc])* #[serde(rename = $tag)] $variant($body),)+
        }

        impl Tagged for $name {
            const TYPES: &'static [&'static str] = &[$($tag),+];

            fn read(tag: &str, body: Table) -> Option<Result<Self, ReadError>> {
                match tag {
                    $($tag => Some(serde_path_to_error::deserialize(body).map(Self::$variant)),)+
                    _ => None,
                }
            }
        }
    };
}

pub(super) use tagged;

tagged! {
    /// `[camera]`
    CameraDescription {
        /// All rays start at the camera's position.
        "perspective" => Perspective(PerspectiveDescription),
        /// All rays are parallel.
        "orthographic" => Orthographic(OrthographicDescription),
    }
}

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PerspectiveDescription {
    /// The centre of projection.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    pub up: DVec3,
    /// Vertical field of view in degrees.
    pub fov: f64,
    /// Distance of the image plane, without effect in a pinhole camera.
    #[serde(default = "one")]
    pub focal_length: f64,
}

/// A camera of parallel rays.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OrthographicDescription {
    /// The middle of the image plane, where the rays start.
    pub position: DVec3,
    /// The point in the middle of the picture.
    pub look_at: DVec3,
    /// Which way is up.
    #[serde(default = "z_up")]
    pub up: DVec3,
    /// Height of the seen rectangle in scene units.
    pub height: f64,
}

tagged! {
    /// `[materials.NAME]`
    MaterialDescription {
        /// Phong's reflection model.
        "phong" => Phong(PhongDescription),
        /// A mirror.
        "mirror" => Mirror(MirrorDescription),
        /// Clear glass.
        "glass" => Glass(GlassDescription),
    }
}

/// Phong's reflection model. A factor that is absent is `color`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PhongDescription {
    /// Short for the three factors.
    pub color: Option<ColorDescription>,
    /// Factor of the ambient light.
    pub ambient: Option<ColorDescription>,
    /// Factor of the diffuse term.
    pub diffuse: Option<ColorDescription>,
    /// Factor of the specular term.
    pub specular: Option<ColorDescription>,
    /// Exponent of the specular term.
    #[serde(default = "sixteen")]
    pub shininess: f64,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
}

/// A mirror.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct MirrorDescription {
    /// Factor of the reflected light.
    #[serde(default)]
    pub tint: ColorDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
}

/// Clear glass.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GlassDescription {
    /// Index of refraction.
    pub ior: f64,
    /// Factor of the light that passes the surface.
    #[serde(default)]
    pub tint: ColorDescription,
    /// What bends its normals.
    pub normal_map: Option<NormalMapDescription>,
}

tagged! {
    /// `[[lights]]`
    LightDescription {
        /// An area light.
        "rectangle" => Rectangle(RectangleLightDescription),
        /// Light from one point.
        "point" => Point(PointLightDescription),
        /// Light from infinitely far away.
        "directional" => Directional(DirectionalLightDescription),
    }
}

/// A rectangle that shines to both sides.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleLightDescription {
    /// The middle.
    pub center: DVec3,
    /// Lengths along the tangent and along the bitangent.
    pub size: [f64; 2],
    /// Perpendicular to the rectangle; any length.
    pub normal: DVec3,
    /// Along the first edge; any length.
    pub tangent: DVec3,
    /// Linear RGB.
    pub color: DVec3,
}

/// Light from one point, without falloff.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PointLightDescription {
    /// Where it is.
    pub position: DVec3,
    /// Linear RGB.
    pub color: DVec3,
}

/// Light from infinitely far away.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLightDescription {
    /// In which the light travels; any length.
    pub direction: DVec3,
    /// Linear RGB.
    pub color: DVec3,
}

tagged! {
    /// `[[shapes]]`
    ShapeDescription {
        /// A rectangle.
        "rectangle" => Rectangle(RectangleDescription),
        /// An ellipsoid by its half axes.
        "ellipsoid" => Ellipsoid(EllipsoidDescription),
        /// A sphere.
        "sphere" => Sphere(SphereDescription),
        /// A triangle.
        "triangle" => Triangle(TriangleDescription),
        /// Four triangles.
        "tetrahedron" => Tetrahedron(TetrahedronDescription),
        /// An infinite plane.
        "plane" => Plane(PlaneDescription),
    }
}

/// A rectangle.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    pub center: DVec3,
    /// Lengths along the tangent and along the bitangent.
    pub size: [f64; 2],
    /// Perpendicular to the rectangle; any length.
    pub normal: DVec3,
    /// Along the first edge; any length.
    pub tangent: DVec3,
}

/// An ellipsoid: the image of the unit sphere under the linear map with the columns a, b, c.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    pub center: DVec3,
    /// First half axis.
    pub a: DVec3,
    /// Second half axis.
    pub b: DVec3,
    /// Third half axis, the pole of the texture coordinates.
    pub c: DVec3,
}

/// A sphere.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SphereDescription {
    /// Name of its material.
    pub material: String,
    /// The middle.
    pub center: DVec3,
    /// Its radius.
    pub radius: f64,
}

/// A triangle.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TriangleDescription {
    /// Name of its material.
    pub material: String,
    /// Counter-clockwise as seen from outside.
    pub vertices: [DVec3; 3],
}

/// A tetrahedron.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TetrahedronDescription {
    /// Name of its material.
    pub material: String,
    /// Its corners.
    pub vertices: [DVec3; 4],
}

/// An infinite plane.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneDescription {
    /// Name of its material.
    pub material: String,
    /// A point of it, the origin of its texture coordinates.
    pub point: DVec3,
    /// Perpendicular to the plane; any length.
    pub normal: DVec3,
    /// Direction of the texture coordinate u; any length.
    pub tangent: DVec3,
}

fn z_up() -> DVec3 {
    DVec3::Z
}

fn one() -> f64 {
    1.0
}

fn sixteen() -> f64 {
    16.0
}
