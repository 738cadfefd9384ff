//! A validated scene: all names are resolved and all values are in range.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::camera_path::CameraPath;
use crate::description::{Integrator, Pattern, PixelFilterKind, Shadows};
use crate::geometry::{Bounds, Parallelogram, Shape, join};
use crate::gltf::Imported;
use crate::material::Material;
use crate::note::Note;
use crate::texture::{Image, Texture};
use wgray_image::ViewSettings;

/// A validated scene. Lengths have no unit, colors are linear RGB, and angles are in radians unless noted otherwise.
///
/// Do not edit a scene: rendering values that are not validated may panic. Edit the [`Description`](crate::Description)
/// and validate it again.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Scene {
    /// Width of the image in pixels, 1 to 65,536.
    pub width: u32,
    /// Height of the image in pixels, 1 to 65,536.
    pub height: u32,
    /// Display settings.
    pub view: ViewSettings,
    /// The camera.
    pub camera: Camera,
    /// Animation of the camera, evaluated by [`Scene::camera_at`].
    pub camera_path: Option<CameraPath>,
    /// Render settings.
    pub render: Render,
    /// Textures, to which materials refer by index: first the textures of the scene file, sorted by name, then the
    /// textures of MTL files.
    pub textures: Vec<Texture>,
    /// Materials, to which shapes refer by index: first the materials of the scene file, sorted by name, then the
    /// materials of MTL files.
    pub materials: Vec<Material>,
    /// Names of the materials.
    pub material_names: Vec<String>,
    /// The environment; `None` with [`Integrator::Phong`], or if the environment neither emits light nor has a
    /// background.
    pub environment: Option<Environment>,
    /// Lights, in file order.
    pub lights: Vec<Light>,
    /// Shapes in file order, then instances of meshes in file order.
    pub shapes: Vec<Shape>,
    /// Number of instances of meshes, which are the last elements of `shapes`.
    pub instances: usize,
    /// All files of the scene, sorted, including the files that meshes and glTF files refer to.
    pub files: Vec<PathBuf>,
    /// Warnings, such as `rock.ply: 1 of 12 triangles is a duplicate and was removed`.
    pub notes: Vec<Note>,
    /// Imported glTF files, kept alive so that later loads of the files can reuse them.
    pub imported: Vec<Arc<Imported>>,
}

/// A camera: a position, an orthonormal basis and a projection.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Camera {
    /// Center of projection; for an orthographic camera, the center of the image plane.
    pub position: DVec3,
    /// Point at the center of the image.
    pub look_at: DVec3,
    /// Unit vector to the right of the image.
    pub right: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Unit vector into the scene.
    pub forward: DVec3,
    /// The projection.
    pub projection: Projection,
    /// The lens; only for perspective cameras.
    pub lens: Option<Lens>,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Lens {
    /// Radius of a round aperture, or distance of the corners of a polygonal aperture from its center, in scene units.
    pub radius: f64,
    /// Distance of the plane in focus, along the view direction, in scene units.
    pub focus: f64,
    /// Number of corners of the aperture, 3 to 16; 0 for a round aperture.
    pub blades: u32,
    /// Rotation of the corners in radians, counter-clockwise in the image. At 0, a corner is at the top.
    pub rotation: f64,
}

/// The projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Perspective projection.
    Perspective {
        /// Vertical field of view in radians, in (0, pi).
        fov: f64,
    },
    /// Orthographic projection.
    Orthographic {
        /// Height of the image plane in scene units.
        height: f64,
    },
    /// Equirectangular projection of all directions: longitude from left to right, latitude from top to bottom.
    Panorama,
}

/// Render settings.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Render {
    /// Light transport algorithm.
    pub integrator: Integrator,
    /// Ambient light of Phong materials; black with [`Integrator::Path`].
    pub ambient: DVec3,
    /// Radiance of rays that leave the scene; with [`Integrator::Path`], the radiance of the environment.
    pub background: DVec3,
    /// Minimum offset of ray origins above a surface, relative to the largest coordinate of the origin.
    pub shadow_epsilon: f64,
    /// Shadows of glass; always [`Shadows::Opaque`] with [`Integrator::Path`].
    pub shadows: Shadows,
    /// Maximum number of bounces. With [`Integrator::Phong`], 1 to 64, and only bounces at mirrors and glass count.
    /// With [`Integrator::Path`], 0 to 1024: 0 is emission only, 1 adds direct light.
    pub max_depth: u32,
    /// First bounce with Russian roulette, 0 to 1024; only for [`Integrator::Path`].
    pub rr_depth: u32,
    /// Maximum component of a sample's indirect light (two bounces or more), in (0, 1e6]; only for
    /// [`Integrator::Path`].
    pub clamp: Option<f64>,
    /// Transparent background; only for [`Integrator::Path`].
    pub alpha: bool,
    /// Filter textures over the footprint of each ray, instead of evaluating them at a point.
    pub ray_differentials: bool,
    /// Seed of all random patterns.
    pub seed: u32,
    /// Samples per pixel.
    pub pixel_samples: Samples,
    /// Samples per area light and hit; unused with [`Integrator::Path`].
    pub light_samples: Samples,
    /// Reconstruction filter.
    pub filter: PixelFilter,
    /// Adaptive sampling; `pixel_samples` is then the number of samples per round.
    pub adaptive: Option<Adaptive>,
    /// Denoise the image.
    pub denoise: bool,
}

/// A set of sample positions in the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Samples {
    /// Layout of the samples.
    pub pattern: Pattern,
    /// Number of samples, 1 to 65,536; a square number for patterns of n x n cells.
    pub count: u32,
}

/// Adaptive sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Adaptive {
    /// Target standard error of a pixel's displayed value, 0 to 1.
    pub error: f64,
    /// Maximum number of samples per pixel, from the count of [`Render::pixel_samples`] to 65,536.
    pub max_samples: u32,
}

/// A reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PixelFilter {
    /// Shape of the filter.
    pub kind: PixelFilterKind,
    /// Radius along x and y in pixels, 0.01 to 16.
    pub radius: f64,
}

/// The environment: radiance from infinitely far away.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Environment {
    /// Constant radiance; black if `image` is set.
    pub color: DVec3,
    /// Environment map.
    pub image: Option<EnvironmentImage>,
    /// True if the camera sees the environment. Reflections and refractions always show the environment.
    pub visible: bool,
    /// Radiance that the camera sees instead of the environment.
    pub background: Option<DVec3>,
}

/// An equirectangular environment map. Without rotation, the center of the map is towards +x, the left and right edges
/// are towards -x, and the upper edge is towards +z.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct EnvironmentImage {
    /// Texels; radiance is interpolated bilinearly between the centers of texels.
    pub image: Arc<Image>,
    /// Factor of the radiance.
    pub scale: f64,
    /// Rotation from the map to world space.
    pub to_world: DMat3,
}

/// A light source.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// An area light. With [`Integrator::Phong`], the light emits from both sides, does not cast shadows, and is
    /// displayed in its unshaded color. With [`Integrator::Path`], the light emits along its normal, u x v, and
    /// occludes other lights.
    Rectangle {
        /// Position and size.
        rectangle: Parallelogram,
        /// Color; with [`Integrator::Path`], the radiance.
        color: DVec3,
        /// True if the camera sees the light. Mirrors always reflect the light.
        visible: bool,
    },
    /// A point light, invisible to the camera.
    Point {
        /// Position.
        position: DVec3,
        /// With [`Integrator::Path`], the intensity (power per unit solid angle), so that the light falls off with the
        /// squared distance. With [`Integrator::Phong`], the color at any distance.
        color: DVec3,
    },
    /// A directional light, invisible to the camera.
    Directional {
        /// Unit vector of propagation.
        direction: DVec3,
        /// Color; with [`Integrator::Path`], the irradiance on a perpendicular surface.
        color: DVec3,
    },
    /// A spot light, invisible to the camera.
    Spot {
        /// Position.
        position: DVec3,
        /// Unit vector of the axis, away from the light.
        direction: DVec3,
        /// Color on the axis, with the same meaning as for a point light.
        color: DVec3,
        /// Angle between axis and edge of the cone in radians, in (0, pi].
        cone: f64,
        /// Angle from the axis where the falloff starts, 0 to `cone`.
        inner: f64,
    },
}

impl Scene {
    /// Returns the bounding box of all shapes except planes, or `None` if there are no such shapes.
    pub fn bounds(&self) -> Option<Bounds> {
        let bounds = self.shapes.iter().filter_map(|shape| shape.geometry.bounds());
        bounds.reduce(join)
    }
}
