//! A validated scene: what the file describes, with every name resolved and every value in range.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::camera_path::CameraPath;
use crate::description::{AlphaMode, Integrator, Pattern, PixelFilterKind, Shadows, VertexColors};
use crate::geometry::{Bounds, Parallelogram, Shape, join};
use crate::gltf::Imported;
use crate::metals::MetalIndex;
use crate::note::Note;
use crate::texture::{Color, Image, NormalMap, Texture, Value};
use wgray_image::ViewSettings;

/// A checked scene. Lengths have no unit; colours are linear RGB; angles are radians.
///
/// Its fields are there to be read. A scene that is edited is not checked again, and may end a render in a panic: edit the
/// [`Description`](crate::Description), and validate that.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Scene {
    /// Width of the picture in pixels, 1 to 65,536.
    pub width: u32,
    /// Height of the picture in pixels, 1 to 65,536.
    pub height: u32,
    /// How it is shown.
    pub view: ViewSettings,
    /// Where the picture is seen from.
    pub camera: Camera,
    /// How the camera moves from frame to frame, if it does; [`Scene::camera_at`] has it at a frame.
    pub camera_path: Option<CameraPath>,
    /// How it is rendered.
    pub render: Render,
    /// The textures that materials name by index: those of the scene file in the order of their names, then those of MTL files.
    pub textures: Vec<Texture>,
    /// The materials that shapes name by index: those of the scene file in the order of their names, then those that meshes
    /// bring in MTL files.
    pub materials: Vec<Material>,
    /// The materials' names.
    pub material_names: Vec<String>,
    /// What surrounds the scene, where that shines. Under [`Integrator::Phong`] there is none.
    pub environment: Option<Environment>,
    /// The lights, in file order.
    pub lights: Vec<Light>,
    /// The shapes, in file order, and then the instances of meshes, in theirs.
    pub shapes: Vec<Shape>,
    /// How many of the shapes are instances, the last ones.
    pub instances: usize,
    /// The files that the scene is made of, in order: its textures' images, meshes, and what these name.
    pub files: Vec<PathBuf>,
    /// Warnings about the scene and its meshes: `rock.ply: 1 of 12 triangles is a duplicate and was removed`.
    pub notes: Vec<Note>,
    /// The glTF files, as long as what was made of them is in use.
    pub imported: Vec<Arc<Imported>>,
}

/// A camera: a position, an orthonormal basis and a projection.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Camera {
    /// The centre of projection; for an orthographic camera the middle of the image plane.
    pub position: DVec3,
    /// What is in the middle of the picture.
    pub look_at: DVec3,
    /// Unit vector to the right in the picture.
    pub right: DVec3,
    /// Unit vector upwards in the picture.
    pub up: DVec3,
    /// Unit vector into the scene.
    pub forward: DVec3,
    /// How points are projected.
    pub projection: Projection,
    /// Its lens, if it has one: perspective cameras alone do.
    pub lens: Option<Lens>,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Lens {
    /// Radius of the opening, that of its corners if it has any, in scene units.
    pub radius: f64,
    /// Distance of the plane that is sharp, along the view, in scene units.
    pub focus: f64,
    /// Corners of the opening, 3 to 16; 0 if it is round.
    pub blades: u32,
    /// In radians, how far the corners are turned to the left, as seen in the picture; at 0 one is at the top.
    pub rotation: f64,
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays start at the camera's position.
    Perspective {
        /// Vertical field of view in radians, in (0, pi).
        fov: f64,
    },
    /// All rays are parallel.
    Orthographic {
        /// Height of the seen rectangle in scene units.
        height: f64,
    },
    /// The picture shows all directions: longitude from left to right, latitude from the top down.
    Panorama,
}

/// The settings of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Render {
    /// What light is simulated.
    pub integrator: Integrator,
    /// The ambient light that every Phong material reflects by its ambient colour; black under [`Integrator::Path`].
    pub ambient: DVec3,
    /// Radiance of rays that leave the scene; under [`Integrator::Path`] that of the environment.
    pub background: DVec3,
    /// How far above a surface rays start at least, relative to the largest coordinate there.
    pub shadow_epsilon: f64,
    /// Whether glass casts shadows; under [`Integrator::Path`] always [`Shadows::Opaque`].
    pub shadows: Shadows,
    /// Most bounces of a path. Under [`Integrator::Phong`] those by mirrors and glass, 1 to 64; under [`Integrator::Path`] all
    /// of them, 0 to 1024: with 0 only what shines is seen, with 1 direct light too.
    pub max_depth: u32,
    /// From which bounce on a path may end at random, 0 to 1024. For [`Integrator::Path`] alone.
    pub rr_depth: u32,
    /// The largest component of what one sample of indirect light, of two bounces or more, may add to a pixel's sample:
    /// greater than 0, to 1e6. For [`Integrator::Path`] alone.
    pub clamp: Option<f64>,
    /// Whether the background is transparent in the picture. For [`Integrator::Path`] alone.
    pub alpha: bool,
    /// Whether textures are filtered over the footprint of each ray, or at its point alone.
    pub ray_differentials: bool,
    /// Seed of all random patterns.
    pub seed: u32,
    /// Samples of every pixel's area.
    pub pixel_samples: Samples,
    /// Samples of every area light, at every hit; without effect under [`Integrator::Path`].
    pub light_samples: Samples,
    /// What a pixel's samples are weighted by.
    pub filter: PixelFilter,
    /// Further samples of the pixels whose error is large; then `pixel_samples` are those of one round.
    pub adaptive: Option<Adaptive>,
}

/// A set of sample positions on the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Samples {
    /// How they are laid out.
    pub pattern: Pattern,
    /// How many, 1 to 65,536; a square for patterns of n x n cells.
    pub count: u32,
}

/// Adaptive sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Adaptive {
    /// The standard error of a pixel's displayed value that is aimed at, 0 to 1.
    pub error: f64,
    /// The most samples of a pixel, from the count of [`Render::pixel_samples`] to 65,536.
    pub max_samples: u32,
}

/// A reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PixelFilter {
    /// Its form.
    pub kind: PixelFilterKind,
    /// How far it reaches along x and y, in pixels, 0.01 to 16.
    pub radius: f64,
}

/// What surrounds a scene, infinitely far away.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Environment {
    /// The radiance that comes from everywhere; black beside an image.
    pub color: DVec3,
    /// What shines from each direction, if it is not the same from everywhere.
    pub image: Option<EnvironmentImage>,
    /// Whether the camera sees it. What mirrors or refracts shows it in either case.
    pub visible: bool,
    /// What the camera sees in its place, if that is something else.
    pub background: Option<DVec3>,
}

/// An equirectangular image around a scene: without a turn its middle is towards +x, its left and right edges towards -x, its
/// upper edge towards +z.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct EnvironmentImage {
    /// The texels; radiance is bilinear between their centres.
    pub image: Arc<Image>,
    /// Factor of the radiance.
    pub scale: f64,
    /// How it is turned.
    pub to_world: DMat3,
}

/// A surface's appearance.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Material {
    /// What it does to light that arrives.
    pub reflection: Reflection,
    /// The radiance that it sends out by itself, on both sides; black under [`Integrator::Phong`].
    pub emission: Color,
    /// What bends its normals.
    pub normal_map: Option<NormalMap>,
    /// Whether the camera sees it. Its rays go through what it does not see; all other rays do not.
    pub visible: bool,
}

/// What a surface does to light that arrives.
#[derive(Clone, Debug, PartialEq)]
pub enum Reflection {
    /// Phong's reflection model.
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
    /// A mirror.
    Mirror {
        /// Factor of the reflected light.
        tint: Color,
    },
    /// Clear glass, by Fresnel's equations.
    Glass {
        /// Index of refraction of what is on the side away from the outward normal, relative to the other side.
        ior: f64,
        /// Factor of the light that passes the surface, on the way in and on the way out.
        tint: Color,
    },
    /// A surface that is equally bright from everywhere if it is smooth. For [`Integrator::Path`] alone, as all below.
    Diffuse {
        /// The share of the light that it reflects, 0 to 1.
        color: Color,
        /// How rough it is, 0 to 1.
        roughness: Value,
    },
    /// Metal.
    Conductor {
        /// The share of the light that it reflects, 0 to 1; white where it has an index of refraction.
        color: Color,
        /// Its complex index of refraction; without one it reflects the same share at every angle.
        index: Option<MetalIndex>,
        /// How rough it is.
        facets: Facets,
    },
    /// Clear glass or liquid, by Fresnel's equations.
    Dielectric {
        /// Index of refraction of what is on the side away from the outward normal, relative to the other side.
        ior: f64,
        /// Factor of the light that passes the surface, on the way in and on the way out, 0 to 1.
        color: Color,
        /// How much light it swallows on the way through it, for each unit of length: of every component x, exp(-x) is left
        /// after a length of 1.
        absorption: DVec3,
        /// Whether it is a thin sheet, behind which all is as before it.
        thin: bool,
        /// How rough it is.
        facets: Facets,
    },
    /// glTF's metallic-roughness material with its extensions.
    Principled(Box<Principled>),
}

/// The material `principled`: of every number the range is 0 to 1, if nothing else is said.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Principled {
    /// The share of light that a dielectric's ground spreads, or a metal reflects head-on; 0 to 1.
    pub base_color: Color,
    /// How much of it is metal.
    pub metallic: Value,
    /// How rough it is: the square root of GGX's alpha.
    pub roughness: Value,
    /// How much rougher it is along the tangent.
    pub anisotropy: Value,
    /// The tangent's angle, counter-clockwise in radians.
    pub anisotropy_rotation: f64,
    /// Index of an image whose red and green, from 0 to 1 as -1 to 1, are the tangent along u and v that is turned so.
    pub anisotropy_direction: Option<usize>,
    /// Index of refraction of the dielectric, 1 to 100.
    pub ior: f64,
    /// Factor of what the dielectric reflects.
    pub specular: Value,
    /// Factor of what it reflects head-on.
    pub specular_color: Color,
    /// How much of the dielectric's light passes the surface.
    pub transmission: Value,
    /// Whether the surface is a thin sheet, which bends no light.
    pub thin: bool,
    /// How much light is swallowed behind a surface that is not thin, for each unit of length: 0 to 1e6.
    pub absorption: DVec3,
    /// How much there is of a clear coat.
    pub clearcoat: Value,
    /// How rough that is.
    pub clearcoat_roughness: Value,
    /// What bends the coat's normals.
    pub clearcoat_normal_map: Option<NormalMap>,
    /// The colour of the sheen of cloth, 0 to 1.
    pub sheen_color: Color,
    /// How rough the sheen is.
    pub sheen_roughness: Value,
    /// How much of the surface there is.
    pub alpha: Value,
    /// What `alpha` does.
    pub alpha_mode: AlphaMode,
    /// The least alpha of what is there, under [`AlphaMode::Mask`].
    pub alpha_cutoff: f64,
    /// What the colours of a mesh's vertices are factors of.
    pub vertex_colors: VertexColors,
    /// Whether the camera sees its back. All else does.
    pub double_sided: bool,
}

impl Material {
    /// The textures that it looks up.
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

    /// Whether it has a direction along the surface beside that of its normal map: that of facets, or of the map of a coat.
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
    /// The colours.
    pub fn colors(&self) -> [&Color; 3] {
        [&self.base_color, &self.specular_color, &self.sheen_color]
    }

    /// The numbers that may come from textures.
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

/// How rough a surface of small facets is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Facets {
    /// 0 to 1; the facets' alpha is its square.
    pub roughness: Value,
    /// How much rougher the surface is along its first axis, 0 to 1.
    pub anisotropy: f64,
    /// How far that axis is turned from the direction of the texture's u towards that of its v, in degrees.
    pub rotation: f64,
    /// Whether light that bounces between facets is given back.
    pub compensated: bool,
}

impl Default for Facets {
    /// None: polished.
    fn default() -> Self {
        Facets {
            roughness: Value::Plain(0.0),
            anisotropy: 0.0,
            rotation: 0.0,
            compensated: true,
        }
    }
}

/// A source of light.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A rectangle that casts no shadow under [`Integrator::Phong`]: both of its sides shine, seen by the camera as its plain
    /// colour. Under [`Integrator::Path`] the side of its normal, u x v, shines, and it hides what is behind it.
    Rectangle {
        /// Its place and size.
        rectangle: Parallelogram,
        /// Its colour: under [`Integrator::Path`] its radiance.
        color: DVec3,
        /// Whether the camera sees it; mirrors do.
        visible: bool,
    },
    /// A point, not seen by the camera.
    Point {
        /// Where it is.
        position: DVec3,
        /// Its colour: under [`Integrator::Path`] its intensity, power for each unit of solid angle, which falls off with the
        /// square of the distance; else without falloff.
        color: DVec3,
    },
    /// Light from infinitely far away, not seen by the camera.
    Directional {
        /// Unit vector in which the light travels.
        direction: DVec3,
        /// Its colour: under [`Integrator::Path`] the irradiance of a surface that faces it.
        color: DVec3,
    },
    /// A cone of light from one point, not seen by the camera.
    Spot {
        /// Where it is.
        position: DVec3,
        /// Unit vector in which the middle of its light travels.
        direction: DVec3,
        /// Its colour in the middle, as that of a point.
        color: DVec3,
        /// The angle between the middle and the edge in radians, greater than 0, to pi.
        cone: f64,
        /// The angle up to which it is as bright as in the middle, 0 to `cone`.
        inner: f64,
    },
}

impl Scene {
    /// Returns the bounding box of all shapes except planes, or `None` if there are only planes.
    pub fn bounds(&self) -> Option<Bounds> {
        let all = self.shapes.iter().filter_map(|shape| shape.geometry.bounds());
        all.reduce(join)
    }
}
