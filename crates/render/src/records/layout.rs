//! Records that the host uploads and the shaders declare, in rows of 16 bytes: a `vec3f` and a scalar.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

#[cfg(doc)]
use super::constants::*;
use super::primitive_kinds::*;
use super::record::{Field, Record, records, words_of_row};

records! {
    /// A camera. Rays start at `position` (perspective, panorama) or on the image plane (orthographic).
    pub struct Camera {
        /// The origin of rays; for [`ORTHOGRAPHIC`] the center of the image plane.
        pub position: Vec3,
        /// [`PERSPECTIVE`], [`ORTHOGRAPHIC`] or [`PANORAMA`]. In the latter case `right` and `up` are unit vectors.
        pub projection: u32,
        /// Half the image plane's width, at distance 1 for [`PERSPECTIVE`].
        pub right: Vec3,
        /// Width of the whole image in pixels.
        pub width: u32,
        /// Half the image plane's height.
        pub up: Vec3,
        /// Height of the whole image in pixels.
        pub height: u32,
        /// The viewing direction, unit length.
        pub forward: Vec3,
        /// Seed of all random patterns.
        pub seed: u32,
        /// Vector from the center of the lens to its edge, or to its first corner; 0 without a lens.
        pub lens_u: Vec3,
        /// Number of corners of the lens; 0 if it is round.
        pub blades: u32,
        /// Vector of the same length, perpendicular to `lens_u`.
        pub lens_v: Vec3,
        /// 1 / (focus distance); 0 without a lens.
        pub inverse_focus: f32,
    }

    /// Values of the scene as a whole, and its environment map.
    pub struct Environment {
        /// Ambient light.
        pub ambient: Vec3,
        /// Offset of ray origins above a surface, relative to the largest coordinate.
        pub shadow_epsilon: f32,
        /// Radiance of rays that leave the scene; under `path` only as seen by the camera, with [`BACKGROUND`].
        pub background: Vec3,
        /// 1 / (samples of an area light).
        pub light_weight: f32,
        /// Constant radiance of the environment, under `path`.
        pub radiance: Vec3,
        /// `t_max` of shadow rays to a point on a surface, relative to its distance.
        pub t_max: f32,
        /// World-space direction to the center of the environment map. This and the following fields are 0 without a
        /// map.
        pub x: Vec3,
        /// Offset of its texels: three floats each, row by row from the top, between rows of the means at the poles.
        pub texels: u32,
        /// World-space direction a quarter turn left of the center.
        pub y: Vec3,
        /// Texels per row.
        pub width: u32,
        /// World-space direction to the upper edge.
        pub z: Vec3,
        /// Rows, without those of the poles.
        pub height: u32,
        /// Offset of the alias tables of cells in the texels, block by block. A cell has two words: its own probability
        /// times 2^32, and the row (bits 16 to 31) and column of its alias.
        pub cells: u32,
        /// A twelfth of the probability that a light sample is one of the map.
        pub density: f32,
        /// Offset of 1 / (integrated radiance) of the blocks, [`ENVIRONMENT_BLOCKS`] per row. The cumulative
        /// distributions of each bin of normals follow: that of rows, then those of the blocks of each row.
        pub blocks: u32,
        /// Binary logarithms of a block's columns (bits 0 to 7) and rows (from bit 8).
        pub shifts: u32,
    }

    /// A primitive. In object space, p is (x, y, z) (p - anchor) - middle, with matrix rows x, y and z.
    pub struct Primitive {
        /// Solids: a surface point towards the origin, for precision. Other primitives: the origin of object space.
        pub anchor: Vec3,
        /// Index of the material.
        pub material: u32,
        /// First row of the world-to-object matrix.
        pub x: Vec3,
        /// Index of the shape in the scene file; lights follow the shapes.
        pub shape: u32,
        /// Second row.
        pub y: Vec3,
        /// The kind, such as [`RECTANGLE`].
        pub kind: u32,
        /// Third row.
        pub z: Vec3,
        /// Determinant of the matrix.
        pub determinant: f32,
        /// Solids: object-space vector from the anchor to the center. Else 0.
        pub middle: Vec3,
        /// Solids: `|middle|² - 1`, for a cylinder without z.
        pub level: f32,
    }

    /// The bounding sphere of a primitive.
    pub struct Sphere {
        /// The center.
        pub center: Vec3,
        /// The radius; that of a plane exceeds any scene.
        pub radius: f32,
    }

    /// A material. Fields that its kind does not use are 0.
    pub struct Material {
        /// [`PHONG`]: ambient reflectance.
        pub ambient: Vec3,
        /// The kind, from [`PHONG`] to [`PRINCIPLED`].
        pub kind: u32,
        /// [`PHONG`], [`DIFFUSE`]: diffuse reflectance.
        pub diffuse: Vec3,
        /// [`PHONG`]: exponent of the specular term.
        pub shininess: f32,
        /// [`PHONG`]: specular reflectance.
        pub specular: Vec3,
        /// [`PHONG`]: the exponent, if it is an integer.
        pub exponent: u32,
        /// [`MIRROR`], [`METAL`]: reflectance. [`GLASS`], [`ROUGH_GLASS`], [`THIN`]: transmittance.
        pub tint: Vec3,
        /// Index of refraction of a dielectric: behind the surface, relative to that in front of it.
        pub ior: f32,
        /// Emitted radiance: under the integrator `phong` of [`EMITTER`] only, under `path` of any kind.
        pub emission: Vec3,
        /// Emitters under `path`: pdf of light samples per area (`ellipsoid_area`), or 1 with a light tree. Else 0.
        pub density: f32,
        /// [`GLASS`], [`ROUGH_GLASS`], [`PRINCIPLED`]: absorption coefficient behind the surface, per length.
        pub absorption: Vec3,
        /// Every kind except [`PHONG`], [`EMITTER`], [`MIRROR`] and [`GLASS`]: roughness, 0 to 1.
        pub roughness: f32,
        /// Index of the first texture lookup (x) and number of lookups (y).
        pub lookups: UVec2,
        /// [`ROUGH_GLASS`], [`PRINCIPLED`] with a volume: offset of the albedo table in the texels. [`NO_INDEX`]
        /// disables the compensation of multiple scattering.
        pub energy: u32,
        /// Ratio of multiple-scattering loss to single-scattering albedo at a hit; 0 in the packed record.
        pub loss: f32,
        /// [`METAL`]: real part of the index of refraction; 0 if it has none.
        pub eta: Vec3,
        /// Kinds with microfacets: additional roughness along the first tangent, 0 to 1.
        pub anisotropy: f32,
        /// [`METAL`]: imaginary part of the index of refraction.
        pub k: Vec3,
        /// Rotation of the first tangent from the texture's u towards its v, in half turns.
        pub rotation: f32,
        /// [`PRINCIPLED`], like the next fields: sheen color. `diffuse` is the base color.
        pub sheen: Vec3,
        /// Sheen roughness.
        pub sheen_roughness: f32,
        /// Fraction of metal.
        pub metallic: f32,
        /// Fraction of light that a dielectric transmits.
        pub transmission: f32,
        /// Weight of the clear coat.
        pub clearcoat: f32,
        /// Roughness of the clear coat.
        pub clearcoat_roughness: f32,
        /// Factor of a dielectric's reflectance.
        pub specular_weight: f32,
        /// Opacity (alpha).
        pub opacity: f32,
        /// Minimum opacity at which the surface exists under [`MASK`].
        pub cutoff: f32,
        /// [`OPAQUE`], [`MASK`] or [`BLEND`].
        pub alpha_mode: u32,
        /// 1 for a thin sheet, else 0.
        pub thin: u32,
        /// Any kind: 1 if it is invisible to the camera, [`CULL_BACKFACE`] if its back faces are, else 0.
        pub camera_visibility: u32,
        /// 1 + offset of the albedo table of anisotropic lobes in the texels; 0 without a table.
        pub aniso_table: u32,
        /// The use of vertex colors: [`COLORS_OF_BASE`], [`COLORS_OF_EMISSION`] or [`NO_COLORS`].
        pub vertex_colors: u32,
    }

    /// A texture lookup of a material.
    pub struct Lookup {
        /// Index of the texture.
        pub texture: u32,
        /// The material parameters that it sets: flags such as [`FOR_DIFFUSE`].
        pub purposes: u32,
        /// The channel of each scalar parameter in two bits: 0 red, 1 green, 2 blue.
        pub channels: u32,
        /// Index of the set of texture coordinates.
        pub uv_set: u32,
    }

    /// A texture: first + (second - first) x, where x is the value of the pattern or of the image.
    pub struct Texture {
        /// The color for x = 0.
        pub first: Vec3,
        /// [`CHECKER`], [`LINES`], [`NEAREST`], [`BILINEAR`], [`TRILINEAR`] or [`EWA`].
        pub kind: u32,
        /// The color for x = 1.
        pub second: Vec3,
        /// [`LINES`]: line width. [`EWA`]: maximum ratio of the ellipse's axes.
        pub parameter: f32,
        /// First row of the matrix from the surface's (u, v, 1) to texture coordinates.
        pub u: Vec3,
        /// [`SRGB8`], [`LINEAR8`] or [`FLOAT`].
        pub format: u32,
        /// Second row of the matrix.
        pub v: Vec3,
        /// [`REPEAT`], [`CLAMP`] or [`MIRRORED`] along u, plus four times that along v.
        pub wrap: u32,
        /// Offset of the table of its levels in the scene's texels.
        pub texels: u32,
        /// Width of the finest level in texels.
        pub width: u32,
        /// Height of the finest level in texels.
        pub height: u32,
        /// Number of levels.
        pub levels: u32,
    }

    /// A light: the points center + a u + b v, with a and b in -1..=1, or in the range of its kind under `path`.
    pub struct Light {
        /// The center; the direction to a directional light.
        pub center: Vec3,
        /// `t_max` of shadow rays, relative to the vector to the light sample.
        pub t_max: f32,
        /// Half the first edge.
        pub u: Vec3,
        /// 1, or 0 if the center is a direction.
        pub finite: f32,
        /// Half the second edge.
        pub v: Vec3,
        /// Index of its primitive, or [`NO_INDEX`].
        pub primitive: u32,
        /// Its color.
        pub color: Vec3,
        /// Its index in the scene file.
        pub number: u32,
        /// Flat emitters: unit normal of the emitting side. [`SPOT`]: unit direction of its axis.
        pub normal: Vec3,
        /// The kind of its primitive under `path`, or [`POINT`], [`DIRECTIONAL`], [`SPOT`] or [`ENVIRONMENT`].
        pub kind: u32,
        /// Under `path`: [`Material::density`], or the probability of a delta light or the environment; 0 in a light
        /// tree.
        pub density: f32,
        /// Number of emitting sides: 1 (the front) or 2.
        pub sides: u32,
        /// [`SPOT`]: 1 minus the cosine of the outer half angle.
        pub cone: f32,
        /// [`SPOT`]: 1 / (cosine of the inner half angle - cosine of the outer half angle).
        pub falloff: f32,
    }

    /// An entry of Walker's alias table of emitters. It selects itself below the threshold, else its alias.
    pub struct Emitter {
        /// Probability of selecting itself, 0 to 1.
        pub threshold: f32,
        /// Index of the alias.
        pub alias_index: u32,
        /// 0 for a light, else 1 plus the index of a mesh instance.
        pub instance: u32,
        /// Index of the light, or position of the triangle in its mesh; [`NO_INDEX`] for the light tree.
        pub index: u32,
    }

    /// A node of the light tree (`light_tree.rs`) with up to four children, one per vector component.
    pub struct LightNode {
        /// Centers of the children's bounding spheres: x.
        pub x: Vec4,
        /// y.
        pub y: Vec4,
        /// z.
        pub z: Vec4,
        /// Radii of the bounding spheres.
        pub radius: Vec4,
        /// Axes of the cones that bound the children's normals, unit length: x.
        pub axis_x: Vec4,
        /// y.
        pub axis_y: Vec4,
        /// z.
        pub axis_z: Vec4,
        /// Cosines of the half angles of these cones.
        pub cosine: Vec4,
        /// Intensities in the brightest direction, as fractions of the total, 0 to 1; 0 for a missing child.
        pub intensity: Vec4,
        /// Cosines of the angles to a normal beyond which nothing is emitted.
        pub edge: Vec4,
        /// 1, or 2 if the opposite directions emit too.
        pub sides: UVec4,
        /// Indices of children that are nodes; [`NO_INDEX`] for an emitter (see below) or a missing child.
        pub children: UVec4,
        /// Emitters: pdf of samples per area (1 without extent), times the probability of the tree.
        pub density: Vec4,
        /// Emitters: 0 for a light, else 1 plus the index of a mesh instance.
        pub instance: UVec4,
        /// Emitters: index of the light, or position of the triangle in its mesh.
        pub index: UVec4,
        /// x: 4 times the index of its parent plus its child number; [`NO_INDEX`] for the root. The rest is 0.
        pub parent: UVec4,
    }

    /// Numbers and positions of records, for kernels that read the scene from buffers.
    pub struct Counts {
        /// The primitives of each kind outside of the BVH: first (x), end of shadow casters (y), end (z).
        pub primitives: [UVec4; KINDS as usize],
        /// Number of area lights (x), which come first, and of all lights (y).
        pub lights: UVec2,
        /// First rows of the tables of lights (x) and of textures (y); that of materials is 0.
        pub tables: UVec2,
        /// First rows of the items (x), instances (y) and group words (z) of the scene's BVH.
        pub tree: UVec4,
        /// First row (x) and length (y) of the alias table; first rows of the light tree's nodes (z) and leaves (w).
        pub emitters: UVec4,
        /// First row of the table of texture lookups (x).
        pub lookups: UVec4,
        /// Padding of the boxes of items relative to coordinates (x), and the largest coordinate of any box (y).
        pub item_padding: Vec4,
    }

    /// A node of a BVH with up to eight children, each an inner node or a leaf. Child boxes are quantized.
    pub struct Node {
        /// The origin of the grid of child boxes.
        pub base: Vec3,
        /// Biased exponents of the grid steps along x, y, z, a byte each; bit 24 + i is set for an inner node i.
        pub scales: u32,
        /// Index of the first child that is an inner node; they are contiguous.
        pub first_child: u32,
        /// Index of the first item of its leaves; they are contiguous.
        pub first_item: u32,
        /// A byte for each child that is a leaf: number of items (upper three bits) and offset of the first.
        pub leaves: UVec2,
        /// Lower bounds of the children along x in grid steps, a byte each.
        pub low_x: UVec2,
        /// Along y.
        pub low_y: UVec2,
        /// Along z.
        pub low_z: UVec2,
        /// Upper bounds of the children along x.
        pub high_x: UVec2,
        /// Along y.
        pub high_y: UVec2,
        /// Along z.
        pub high_z: UVec2,
    }

    /// An item of the scene's BVH: a standalone primitive or an instance of a mesh.
    pub struct BvhItem {
        /// The lower corner of its box.
        pub low: Vec3,
        /// [`INSTANCE`] or the kind of the primitive, and the flag [`CASTS_SHADOW`].
        pub kind: u32,
        /// The upper corner of its box.
        pub high: Vec3,
        /// Index of the instance or the primitive.
        pub index: u32,
    }

    /// An instance of a mesh: a world-space point p is (x, y, z) (p - anchor) in object space.
    pub struct Instance {
        /// First row of the world-to-object matrix.
        pub x: Vec3,
        /// First row of the mesh's nodes.
        pub nodes: u32,
        /// Second row.
        pub y: Vec3,
        /// First row of the mesh's triangles.
        pub triangles: u32,
        /// Third row.
        pub z: Vec3,
        /// First row of the mesh's vertices.
        pub vertices: u32,
        /// The mesh's origin in world space.
        pub anchor: Vec3,
        /// First row of the groups of the triangles, or [`NO_INDEX`] if the mesh has a single group.
        pub groups: u32,
        /// First column of the object-to-world matrix.
        pub u: Vec3,
        /// Index of the word of its first group.
        pub materials: u32,
        /// Second column.
        pub v: Vec3,
        /// Index of the shape in the scene file.
        pub shape: u32,
        /// Third column.
        pub w: Vec3,
        /// First row of vertex normals and v, or [`NO_INDEX`] without normals and texture coordinates.
        pub attributes: u32,
        /// Largest coordinate of the mesh in object space.
        pub size: f32,
        /// Condition number of the transform, which bounds the amplification of rounding errors.
        pub condition_number: f32,
        /// 1, or -1 if the transform mirrors.
        pub side: f32,
        /// 1 if the vertices have texture coordinates, else 0.
        pub has_uvs: u32,
        /// [`SOME_SHADOWS`] if some groups cast no shadow, else 0.
        pub shadows: u32,
        /// Index of the mesh.
        pub mesh: u32,
        /// First row of vertex tangents, two per vertex, or [`NO_INDEX`] without tangents.
        pub tangents: u32,
        /// Offset of its triangles in `Lighting::leaves`, or [`NO_INDEX`] if none is emissive; 0 without a light tree.
        pub leaves: u32,
        /// First row of vertex colors, or [`NO_INDEX`] without vertex colors.
        pub colors: u32,
        /// First row of further texture coordinates, two sets per row; [`NO_INDEX`] if there is one set.
        pub more_uvs: u32,
        /// Number of further sets of texture coordinates.
        pub uv_sets: u32,
        /// 0.
        pub unused: u32,
    }

    /// The first hit of the ray through a pixel's center. A miss has depth 0 and shape [`NO_INDEX`].
    pub struct FirstHit {
        /// The outward geometric normal, unit length.
        pub normal: Vec3,
        /// Distance along the ray.
        pub depth: f32,
        /// Texture coordinates.
        pub uv: Vec2,
        /// Index of the shape in the scene file; lights follow the shapes.
        pub shape: u32,
        /// Index of the material.
        pub material: u32,
        /// The outward shading normal without normal maps, unit length.
        pub shading_normal: Vec3,
        /// Index of the triangle in its mesh; `shape` for other primitives.
        pub primitive: u32,
        /// Barycentric coordinates of a mesh triangle: those of its second and third vertex.
        pub barycentric: Vec2,
        /// 0.
        pub unused: UVec2,
    }

    /// The parameters of a dispatch: a rectangle of pixels and a range of samples.
    pub struct DispatchParams {
        /// Its first pixel, in the image.
        pub origin: UVec2,
        /// Its size in pixels.
        pub size: UVec2,
        /// The film's first pixel, in the image.
        pub film_origin: UVec2,
        /// The film's size in pixels.
        pub film_size: UVec2,
        /// The first sample and the end of the range.
        pub samples: UVec2,
        /// The range of the loop that detects truncated loops (`shaders/completion.wgsl`).
        pub loop_probe: UVec2,
    }
}
