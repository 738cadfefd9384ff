//! Records that the host uploads and the shaders declare, in rows of 16 bytes, such as a `vec3f` and a scalar.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

#[cfg(doc)]
use super::constants::*;
use super::primitive_kinds::*;
use super::record::{Field, Record, records, words_of_row};

records! {
    /// A camera.
    pub struct Camera {
        /// Origin of rays; for [`ORTHOGRAPHIC`] the center of the image plane.
        pub position: Vec3,
        /// [`PERSPECTIVE`], [`ORTHOGRAPHIC`] or [`PANORAMA`], whose `right` and `up` are unit vectors.
        pub projection: u32,
        /// Half the image plane's width; at distance 1 for [`PERSPECTIVE`].
        pub right: Vec3,
        /// Image width in pixels.
        pub width: u32,
        /// Half the image plane's height.
        pub up: Vec3,
        /// Image height in pixels.
        pub height: u32,
        /// Viewing direction, unit length.
        pub forward: Vec3,
        /// Seed of all random patterns.
        pub seed: u32,
        /// Vector from the center of the lens to its edge or first corner; 0 if the camera has no lens.
        pub lens_u: Vec3,
        /// Number of corners of the lens; 0 if the lens is round.
        pub blades: u32,
        /// Perpendicular to `lens_u`, of the same length.
        pub lens_v: Vec3,
        /// 1 / (focus distance); 0 if the camera has no lens.
        pub inverse_focus: f32,
    }

    /// Values that apply to the whole scene, and the environment map.
    pub struct Environment {
        /// Ambient light.
        pub ambient: Vec3,
        /// Offset of ray origins above a surface, as a multiple of the largest absolute coordinate at the hit.
        pub shadow_epsilon: f32,
        /// Radiance of rays that leave the scene; with `path` only for camera rays, if [`BACKGROUND`] is set.
        pub background: Vec3,
        /// 1 / (samples of an area light).
        pub light_weight: f32,
        /// Constant radiance of the environment, for `path`.
        pub radiance: Vec3,
        /// `t_max` of shadow rays to a point on a surface, relative to the distance of the point.
        pub t_max: f32,
        /// World-space direction to the center of the map. 0 without a map, like all following fields.
        pub x: Vec3,
        /// Offset of the texels: three floats each, in row-major order, top row first. The first and last row contain
        /// the means at the poles.
        pub texels: u32,
        /// World-space direction a quarter turn left of the center.
        pub y: Vec3,
        /// Texels per row.
        pub width: u32,
        /// World-space direction to the upper edge.
        pub z: Vec3,
        /// Number of rows, not counting the rows of the poles.
        pub height: u32,
        /// Offset of the cells' alias tables in the texels, block by block. A cell has two words: its own probability
        /// times 2^32, and the row (bits 16 to 31) and column of its alias.
        pub cells: u32,
        /// Probability of sampling the map, divided by 12: kernels multiply by the sum of three components at four
        /// corners.
        pub density: f32,
        /// Offset of 1 / (integrated radiance) of the blocks, [`ENVIRONMENT_BLOCKS`] per row. The cumulative
        /// distributions of each bin of normals follow: the distribution of the block rows, then the distributions of
        /// the blocks in each row.
        pub blocks: u32,
        /// log2 of a block's columns (bits 0 to 7) and rows (from bit 8).
        pub shifts: u32,
    }

    /// A primitive: a world-space point p is (x, y, z) (p - anchor) - middle in object space.
    pub struct Primitive {
        /// In world space. Solids: the surface point that faces the world origin, so that coordinates near it are
        /// precise. Others: the origin of object space.
        pub anchor: Vec3,
        /// Material index.
        pub material: u32,
        /// First row of the world-to-object matrix.
        pub x: Vec3,
        /// Index in the scene file; lights follow the shapes.
        pub shape: u32,
        /// Second row.
        pub y: Vec3,
        /// A kind such as [`RECTANGLE`].
        pub kind: u32,
        /// Third row.
        pub z: Vec3,
        /// Matrix determinant.
        pub determinant: f32,
        /// Solids: object-space vector from the anchor to the center. Else 0.
        pub middle: Vec3,
        /// Solids: constant term of the implicit equation, such as `|middle|² - 1`.
        pub level: f32,
    }

    /// The bounding sphere of a primitive.
    pub struct Sphere {
        /// Center.
        pub center: Vec3,
        /// Radius; for a plane, larger than any scene.
        pub radius: f32,
    }

    /// A material. Unused fields are 0.
    pub struct Material {
        /// [`PHONG`]: ambient reflectance.
        pub ambient: Vec3,
        /// A kind from [`PHONG`] to [`PRINCIPLED`].
        pub kind: u32,
        /// [`PHONG`], [`DIFFUSE`]: diffuse reflectance.
        pub diffuse: Vec3,
        /// [`PHONG`]: exponent of the specular term.
        pub shininess: f32,
        /// [`PHONG`]: specular reflectance.
        pub specular: Vec3,
        /// [`PHONG`]: `shininess`, if it is an integer.
        pub exponent: u32,
        /// [`MIRROR`], [`METAL`]: reflectance. [`GLASS`], [`ROUGH_GLASS`], [`THIN`]: transmittance.
        pub tint: Vec3,
        /// Index of refraction behind the surface, relative to the index in front of it.
        pub ior: f32,
        /// Emitted radiance: with `phong` only of [`EMITTER`], with `path` of any kind.
        pub emission: Vec3,
        /// Emitters with `path`: pdf of light samples per area (for ellipsoids, `ellipsoid_area`), or 1 with a light
        /// tree. Otherwise 0.
        pub density: f32,
        /// [`GLASS`], [`ROUGH_GLASS`], [`PRINCIPLED`]: absorption coefficient behind the surface, per unit length.
        pub absorption: Vec3,
        /// Kinds except [`PHONG`], [`EMITTER`], [`MIRROR`] and [`GLASS`]: roughness, 0 to 1.
        pub roughness: f32,
        /// Index of the first texture lookup (x), and number of lookups (y).
        pub lookups: UVec2,
        /// [`ROUGH_GLASS`], [`PRINCIPLED`] with a volume: offset of the albedo table in the texels; [`NO_INDEX`]
        /// without multiple-scattering compensation.
        pub energy: u32,
        /// Multiple-scattering loss relative to single-scattering albedo at a hit; 0 in the packed record.
        pub loss: f32,
        /// [`METAL`]: real part of the complex index of refraction; 0 without an index.
        pub eta: Vec3,
        /// Microfacet kinds: additional roughness along the first tangent, 0 to 1.
        pub anisotropy: f32,
        /// [`METAL`]: imaginary part of the complex index of refraction.
        pub k: Vec3,
        /// Rotation of the first tangent from u towards v, in half turns.
        pub rotation: f32,
        /// [`PRINCIPLED`], like the next fields: sheen color. `diffuse` is the base color.
        pub sheen: Vec3,
        /// Sheen roughness.
        pub sheen_roughness: f32,
        /// Fraction of metal.
        pub metallic: f32,
        /// Fraction of light that dielectrics transmit.
        pub transmission: f32,
        /// Clear coat weight.
        pub clearcoat: f32,
        /// Clear coat roughness.
        pub clearcoat_roughness: f32,
        /// Factor of dielectric reflectance.
        pub specular_weight: f32,
        /// Opacity (alpha).
        pub opacity: f32,
        /// Minimum opacity at which the surface exists, for [`MASK`].
        pub cutoff: f32,
        /// [`OPAQUE`], [`MASK`] or [`BLEND`].
        pub alpha_mode: u32,
        /// 1 for a thin sheet, else 0.
        pub thin: u32,
        /// Faces that camera rays skip: [`CULL_BOTH_FACES`], [`CULL_BACKFACE`] or 0.
        pub camera_culling: u32,
        /// 1 + offset of the anisotropic albedo table in the texels, or 0 without a table.
        pub aniso_table: u32,
        /// [`COLORS_OF_BASE`], [`COLORS_OF_EMISSION`] or [`NO_COLORS`].
        pub vertex_colors: u32,
    }

    /// A texture lookup of a material.
    pub struct Lookup {
        /// Texture index.
        pub texture: u32,
        /// Parameters that the lookup sets: flags such as [`FOR_DIFFUSE`].
        pub purposes: u32,
        /// Channel of each scalar parameter in two bits: 0 red, 1 green, 2 blue.
        pub channels: u32,
        /// Index of the texture coordinates.
        pub uv_set: u32,
    }

    /// A texture: first + (second - first) x, where x is the pattern or image value.
    pub struct Texture {
        /// Color for x = 0.
        pub first: Vec3,
        /// [`CHECKER`], [`LINES`], [`NEAREST`], [`BILINEAR`], [`TRILINEAR`] or [`EWA`].
        pub kind: u32,
        /// Color for x = 1.
        pub second: Vec3,
        /// [`LINES`]: line width. [`EWA`]: maximum ratio of the ellipse's axes.
        pub parameter: f32,
        /// First row of the matrix from (u, v, 1) to texture coordinates.
        pub u: Vec3,
        /// [`SRGB8`], [`LINEAR8`] or [`FLOAT`].
        pub format: u32,
        /// Second row of the matrix.
        pub v: Vec3,
        /// [`REPEAT`], [`CLAMP`] or [`MIRRORED`] along u, plus four times the value along v.
        pub wrap: u32,
        /// Offset of the level table in the texels.
        pub texels: u32,
        /// Width of the finest level.
        pub width: u32,
        /// Height of the finest level.
        pub height: u32,
        /// Number of levels.
        pub levels: u32,
    }

    /// A light: the points center + a u + b v. a and b are in -1..=1 or, with `path`, in the range of local coordinates
    /// of the primitive's kind.
    pub struct Light {
        /// Center, or direction of a directional light.
        pub center: Vec3,
        /// `t_max` of shadow rays, relative to the vector to the light sample.
        pub t_max: f32,
        /// Half the first edge.
        pub u: Vec3,
        /// 1, or 0 if the center is a direction.
        pub finite: f32,
        /// Half the second edge.
        pub v: Vec3,
        /// Primitive index, or [`NO_INDEX`].
        pub primitive: u32,
        /// Color.
        pub color: Vec3,
        /// Index in the scene file.
        pub number: u32,
        /// Flat emitters: unit normal of the emitting side. [`SPOT`]: unit direction of the axis.
        pub normal: Vec3,
        /// Kind of the primitive (for `path`), or [`POINT`], [`DIRECTIONAL`], [`SPOT`] or [`ENVIRONMENT`].
        pub kind: u32,
        /// With `path`: area lights: pdf of light samples per area, like [`Material::density`]; other lights: the
        /// probability of selecting the light, or 0 for lights in a light tree.
        pub density: f32,
        /// Emitting sides: 1 (front) or 2.
        pub sides: u32,
        /// [`SPOT`]: 1 minus the cosine of the outer half angle.
        pub cone: f32,
        /// [`SPOT`]: 1 / (cosine of the inner half angle - cosine of the outer half angle).
        pub falloff: f32,
    }

    /// An entry of Walker's alias table of emitters: random numbers below the threshold select the entry itself, others
    /// its alias.
    pub struct Emitter {
        /// Probability of selecting the entry itself, 0 to 1.
        pub threshold: f32,
        /// Alias index.
        pub alias_index: u32,
        /// 0 for a light, else 1 + mesh instance.
        pub instance: u32,
        /// Light index, or position of the triangle in its mesh; [`NO_INDEX`] for the light tree.
        pub index: u32,
    }

    /// A light-tree node (`light_tree.rs`) with up to four children, one per component.
    pub struct LightNode {
        /// Centers of the bounding spheres: x.
        pub x: Vec4,
        /// Centers: y.
        pub y: Vec4,
        /// Centers: z.
        pub z: Vec4,
        /// Radii of the spheres.
        pub radius: Vec4,
        /// Unit axes of the cones that contain the normals: x.
        pub axis_x: Vec4,
        /// Axes: y.
        pub axis_y: Vec4,
        /// Axes: z.
        pub axis_z: Vec4,
        /// Cosines of the cones' half angles.
        pub cosine: Vec4,
        /// Maximum intensities as fractions of the total, 0 to 1; 0 for a missing child.
        pub intensity: Vec4,
        /// Cosines of the angles to a normal beyond which nothing is emitted.
        pub edge: Vec4,
        /// 1, or 2 if the opposite directions emit too.
        pub sides: UVec4,
        /// Indices of inner nodes; [`NO_INDEX`] for an emitter (see below) or a missing child.
        pub children: UVec4,
        /// Emitters: pdf per area (1 without extent), times the probability of the tree.
        pub density: Vec4,
        /// Emitters: 0 for a light, else 1 + mesh instance.
        pub instance: UVec4,
        /// Emitters: light index, or position of the triangle in its mesh.
        pub index: UVec4,
        /// x: 4 times the parent's index plus the number of this child; [`NO_INDEX`] for the root. Other components: 0.
        pub parent: UVec4,
    }

    /// Counts and first rows of records, for kernels that read buffers.
    pub struct Counts {
        /// Primitives of each kind outside of the BVH: first (x), end of shadow casters (y), end (z).
        pub primitives: [UVec4; KINDS as usize],
        /// Number of area lights (x), which come first, and of all lights (y).
        pub lights: UVec2,
        /// First rows of lights (x) and textures (y); the first row of materials is 0.
        pub tables: UVec2,
        /// First rows of the scene BVH's items (x), instances (y) and group words (z).
        pub tree: UVec4,
        /// Alias table: first row (x), length (y). First rows of light-tree nodes (z) and leaves (w).
        pub emitters: UVec4,
        /// First row of texture lookups (x).
        pub lookups: UVec4,
        /// Padding of items' boxes, relative to coordinates (x); largest absolute coordinate of any box (y).
        pub item_padding: Vec4,
    }

    /// A BVH node with up to eight children, each an inner node or a leaf, with quantized boxes.
    pub struct Node {
        /// Grid origin.
        pub base: Vec3,
        /// Biased exponents of the grid steps along x, y, z, a byte each; bit 24 + i is set for an inner node i.
        pub scales: u32,
        /// Index of the first inner child; the children are contiguous.
        pub first_child: u32,
        /// First item of the node's leaves; the items are contiguous.
        pub first_item: u32,
        /// A byte per leaf: number of items (upper three bits) and offset of the first item.
        pub leaves: UVec2,
        /// Lower bounds along x in grid steps, a byte each.
        pub low_x: UVec2,
        /// Lower bounds along y.
        pub low_y: UVec2,
        /// Lower bounds along z.
        pub low_z: UVec2,
        /// Upper bounds along x.
        pub high_x: UVec2,
        /// Upper bounds along y.
        pub high_y: UVec2,
        /// Upper bounds along z.
        pub high_z: UVec2,
    }

    /// An item of the scene's BVH: a primitive or a mesh instance.
    pub struct BvhItem {
        /// Lower corner of the bounding box.
        pub low: Vec3,
        /// [`INSTANCE`] or the primitive's kind, and the flag [`CASTS_SHADOW`].
        pub kind: u32,
        /// Upper corner of the bounding box.
        pub high: Vec3,
        /// Index of the instance or primitive.
        pub index: u32,
    }

    /// An instance of a mesh: a world-space point p is (x, y, z) (p - anchor) in object space.
    pub struct Instance {
        /// First row of the world-to-object matrix.
        pub x: Vec3,
        /// First row of nodes.
        pub nodes: u32,
        /// Second row.
        pub y: Vec3,
        /// First row of triangles.
        pub triangles: u32,
        /// Third row.
        pub z: Vec3,
        /// First row of vertices.
        pub vertices: u32,
        /// World-space origin of the mesh.
        pub anchor: Vec3,
        /// First row of triangle groups; [`NO_INDEX`] for a single group.
        pub groups: u32,
        /// First column of the object-to-world matrix.
        pub u: Vec3,
        /// Index of the mesh's first group word in `PackedBvh::group_words`. A group word contains the material index
        /// of a triangle group and the flag [`NO_SHADOW`].
        pub first_group_word: u32,
        /// Second column.
        pub v: Vec3,
        /// Index of the shape in the scene file.
        pub shape: u32,
        /// Third column.
        pub w: Vec3,
        /// First row of the vertex normals and of the texture coordinate v; [`NO_INDEX`] if the mesh has neither
        /// normals nor texture coordinates.
        pub attributes: u32,
        /// Largest absolute object-space coordinate.
        pub size: f32,
        /// Condition number of the transform: amplification of rounding errors.
        pub condition_number: f32,
        /// 1, or -1 for a mirroring transform.
        pub side: f32,
        /// 1 if the mesh has texture coordinates, else 0.
        pub has_uvs: u32,
        /// [`SOME_SHADOWS`] if some groups cast no shadow, else 0.
        pub shadows: u32,
        /// Mesh index.
        pub mesh: u32,
        /// First row of vertex tangents, two per vertex, or [`NO_INDEX`].
        pub tangents: u32,
        /// Offset of the triangles in `Lighting::leaves`; [`NO_INDEX`] if no triangle is emissive; 0 without a light
        /// tree.
        pub leaves: u32,
        /// First row of vertex colors, or [`NO_INDEX`].
        pub colors: u32,
        /// First row of further texture coordinates, two sets per row, or [`NO_INDEX`].
        pub more_uvs: u32,
        /// Number of further sets of texture coordinates.
        pub uv_sets: u32,
        /// Unused, 0.
        pub unused: u32,
    }

    /// The first hit through a pixel's center. A miss has depth 0 and shape [`NO_INDEX`].
    pub struct FirstHit {
        /// Outward geometric normal, unit length.
        pub normal: Vec3,
        /// Distance along the ray.
        pub depth: f32,
        /// Texture coordinates.
        pub uv: Vec2,
        /// Index in the scene file; lights follow the shapes.
        pub shape: u32,
        /// Material index.
        pub material: u32,
        /// Outward shading normal without normal maps, unit length.
        pub shading_normal: Vec3,
        /// Triangle index in the mesh; else `shape`.
        pub primitive: u32,
        /// Barycentric coordinates of a mesh triangle's second and third vertex.
        pub barycentric: Vec2,
        /// Unused, 0.
        pub unused: UVec2,
    }

    /// Parameters of a dispatch: the tile, the film and the samples.
    pub struct DispatchParams {
        /// First pixel of the tile, in image coordinates.
        pub origin: UVec2,
        /// Tile size in pixels.
        pub size: UVec2,
        /// First pixel of the film, in image coordinates.
        pub film_origin: UVec2,
        /// Film size in pixels.
        pub film_size: UVec2,
        /// Range of samples.
        pub samples: UVec2,
        /// Start and end of the loop that detects truncated loops (`shaders/completion.wgsl`).
        pub loop_probe: UVec2,
    }

    /// Parameters of the denoiser.
    pub struct DenoiseParams {
        /// Size of the rows in pixels, without margins.
        pub size: UVec2,
        /// Number of floats per row of a plane, with margins.
        pub stride: u32,
        /// Number of floats per plane.
        pub plane: u32,
    }
}
