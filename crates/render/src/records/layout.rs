//! The records that the host uploads, on both sides: rows of 16 bytes, a `vec3f` followed by a scalar.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, UVec4, Vec2, Vec3, Vec4};

#[cfg(doc)]
use super::constants::*;
use super::primitive_kinds::*;
use super::record::{Field, Record, records, words_of_row};

records! {
    /// A camera; rays start at `position` and pass through the image plane, which is one unit ahead (perspective) or at it.
    pub struct Camera {
        /// The start of perspective rays, the middle of the orthographic image plane.
        pub position: Vec3,
        /// [`PERSPECTIVE`], [`ORTHOGRAPHIC`] or [`PANORAMA`], where `right` and `up` are unit vectors.
        pub projection: u32,
        /// Half the image plane's width.
        pub right: Vec3,
        /// Width of the whole picture in pixels.
        pub width: u32,
        /// Half the image plane's height.
        pub up: Vec3,
        /// Height of the whole picture in pixels.
        pub height: u32,
        /// Unit vector into the scene.
        pub forward: Vec3,
        /// Seed of all random patterns.
        pub seed: u32,
        /// From the middle of the lens to its edge, or its first corner; 0 without a lens.
        pub lens_u: Vec3,
        /// Corners of the lens, 0 if it is round.
        pub blades: u32,
        /// From the middle of the lens to its edge, at right angles to the other way.
        pub lens_v: Vec3,
        /// 1 / (distance of what is sharp); 0 without a lens.
        pub inverse_focus: f32,
    }

    /// What belongs to the scene as a whole.
    pub struct Environment {
        /// Ambient light.
        pub ambient: Vec3,
        /// How far above a surface rays start, relative to the largest coordinate.
        pub shadow_epsilon: f32,
        /// Radiance of rays that leave the scene; under the integrator `path` what the camera sees there, if that is [`BACKGROUND`].
        pub background: Vec3,
        /// 1 / (samples of an area light).
        pub light_weight: f32,
        /// Radiance that comes from everywhere, under the integrator `path`.
        pub radiance: Vec3,
        /// Where shadow rays to a point of a surface end, as a multiple of the way.
        pub t_max: f32,
        /// Of the image that surrounds the scene, as all below and 0 where there is none: the image's direction to its middle.
        pub x: Vec3,
        /// Where its texels start among the scene's: three floats each, row by row from the upper edge, between rows of the poles' means.
        pub texels: u32,
        /// The direction to what is a quarter left of its middle.
        pub y: Vec3,
        /// Texels in a row.
        pub width: u32,
        /// The direction to its upper edge.
        pub z: Vec3,
        /// Rows, without those of the poles.
        pub height: u32,
        /// Where the tables start among the texels by which cells are chosen, those of a block together, block by block: two words for a cell,
        /// in how many of 2^32 cases it is chosen itself, and else the row, from bit 16 on, and the column of the cell that is.
        pub cells: u32,
        /// A twelfth of the probability that a sample of light is one of the map.
        pub density: f32,
        /// Where the blocks' 1 / (radiance times solid angle) start among the texels, [`ENVIRONMENT_BLOCKS`] for a row of blocks. Behind them
        /// lie, for each bin of normals, the cumulative distributions of the rows and of the blocks of each row.
        pub blocks: u32,
        /// The binary logarithms of a block's columns, and from bit 8 on of its rows.
        pub shifts: u32,
    }

    /// Any primitive: local = (x, y, z) (p - anchor) - middle, by the rows of the inverse linear map.
    pub struct Primitive {
        /// A point of an ellipsoid near the origin; of any other primitive the origin of local space.
        pub anchor: Vec3,
        /// Index of its material.
        pub material: u32,
        /// First row.
        pub x: Vec3,
        /// The number of its shape in the scene file; lights follow the shapes.
        pub shape: u32,
        /// Second row.
        pub y: Vec3,
        /// What kind it is, such as [`RECTANGLE`].
        pub kind: u32,
        /// Third row.
        pub z: Vec3,
        /// Determinant of the three rows.
        pub determinant: f32,
        /// From the anchor to an ellipsoid's centre, by the three rows; else 0.
        pub middle: Vec3,
        /// |middle|² - 1, of an ellipsoid.
        pub level: f32,
    }

    /// A sphere around a primitive that can cast a shadow.
    pub struct Sphere {
        /// The middle.
        pub center: Vec3,
        /// Infinite for a plane.
        pub radius: f32,
    }

    /// A surface's appearance: what its kind needs, and 0 elsewhere.
    pub struct Material {
        /// [`PHONG`]: factor of the ambient light.
        pub ambient: Vec3,
        /// [`PHONG`], [`EMITTER`], [`MIRROR`], [`GLASS`], [`DIFFUSE`], [`METAL`], [`ROUGH_GLASS`], [`THIN`] or [`PRINCIPLED`].
        pub kind: u32,
        /// [`PHONG`]: factor of the diffuse term. [`DIFFUSE`]: the share of light that is reflected.
        pub diffuse: Vec3,
        /// [`PHONG`]: exponent of the specular term.
        pub shininess: f32,
        /// [`PHONG`]: factor of the specular term.
        pub specular: Vec3,
        /// [`PHONG`]: the exponent, where it is a whole number.
        pub exponent: u32,
        /// [`MIRROR`], [`METAL`]: factor of the reflected light. [`GLASS`], [`ROUGH_GLASS`], [`THIN`]: of the light that passes the surface.
        pub tint: Vec3,
        /// [`GLASS`], [`ROUGH_GLASS`]: index of refraction of what is behind the surface, relative to what is before it. [`THIN`]: of the sheet.
        pub ior: f32,
        /// [`EMITTER`]: the light's colour. Under the integrator `path`, of any kind: the radiance that it sends out.
        pub emission: Vec3,
        /// Under `path`, of what shines: how densely samples of light lie on it, per area, or on an ellipsoid how likely they are on
        /// it, by its area as `ellipsoid_area` gives that; 1 where a tree chooses what shines, and knows that. Else 0.
        pub density: f32,
        /// [`GLASS`], [`ROUGH_GLASS`]: how strongly light is absorbed behind the surface, per length.
        pub absorption: Vec3,
        /// [`DIFFUSE`], [`METAL`], [`ROUGH_GLASS`], [`THIN`]: 0 to 1.
        pub roughness: f32,
        /// Its lookups in textures: the first, x, and how many there are, y.
        pub lookups: UVec2,
        /// [`ROUGH_GLASS`], and [`PRINCIPLED`] with a volume: the texel where the table of what it lets pass and reflects at once starts. Of [`METAL`] and [`THIN`], too, [`NO_INDEX`]
        /// where light that bounces between facets is lost.
        pub energy: u32,
        /// 0 here; of a surface that was met what facets lose at once, as a multiple of what they do not.
        pub loss: f32,
        /// [`METAL`]: the real part of the index of refraction; 0 where it has none.
        pub eta: Vec3,
        /// [`METAL`], [`ROUGH_GLASS`], [`THIN`], [`PRINCIPLED`]: how much rougher they are along their first axis, 0 to 1.
        pub anisotropy: f32,
        /// [`METAL`]: the imaginary part of the index of refraction.
        pub k: Vec3,
        /// How far the first axis is turned from the texture's u towards its v, in half turns.
        pub rotation: f32,
        /// [`PRINCIPLED`], as all below: the colour of its sheen. Its base is `diffuse`, what it reflects head-on has the factor `specular`.
        pub sheen: Vec3,
        /// How rough that is.
        pub sheen_roughness: f32,
        /// How much of it is metal.
        pub metallic: f32,
        /// How much of a dielectric's light passes.
        pub transmission: f32,
        /// How much there is of a coat.
        pub clearcoat: f32,
        /// How rough that is.
        pub clearcoat_roughness: f32,
        /// Factor of what a dielectric reflects.
        pub specular_weight: f32,
        /// How much of the surface there is.
        pub opacity: f32,
        /// The least of that which counts under [`MASK`].
        pub cutoff: f32,
        /// [`OPAQUE`], [`MASK`] or [`BLEND`].
        pub alpha_mode: u32,
        /// 1 where it is a thin sheet, else 0.
        pub thin: u32,
        /// Of any kind: 1 where the camera's rays go through it, [`CULL_BACKFACE`] where they go through its back alone, else 0.
        pub hidden: u32,
        /// Of any kind with facets: the texel where the table of those that are rougher along one axis starts, plus one; 0 where there is none.
        pub aniso_table: u32,
        /// What the colours of vertices are factors of: [`COLORS_OF_BASE`], [`COLORS_OF_EMISSION`], or [`NO_COLORS`].
        pub vertex_colors: u32,
    }

    /// A lookup in a texture, whatever a material wants it for.
    pub struct Lookup {
        /// The texture's number.
        pub texture: u32,
        /// What it gives: bits such as [`FOR_DIFFUSE`].
        pub purposes: u32,
        /// For each number that it gives, in two bits, which of the colour's values: 0 red, 1 green, 2 blue.
        pub channels: u32,
        /// By which set of texture coordinates the texture lies.
        pub uv_set: u32,
    }

    /// A texture: first + (second - first) x, where x is what the pattern or the image gives.
    pub struct Texture {
        /// The colour where x is 0.
        pub first: Vec3,
        /// [`CHECKER`], [`LINES`], [`NEAREST`], [`BILINEAR`], [`TRILINEAR`] or [`EWA`].
        pub kind: u32,
        /// The colour where x is 1.
        pub second: Vec3,
        /// The width of [`LINES`]; for [`EWA`] the largest ratio of an ellipse's axes.
        pub parameter: f32,
        /// First row of the map from a surface's (u, v, 1) to the texture's (u, v).
        pub u: Vec3,
        /// [`SRGB8`], [`LINEAR8`] or [`FLOAT`].
        pub format: u32,
        /// Second row of the map.
        pub v: Vec3,
        /// [`REPEAT`], [`CLAMP`] or [`MIRRORED`] along u, and four times that along v.
        pub wrap: u32,
        /// Where, in the scene's texels, the table of its levels' places starts.
        pub texels: u32,
        /// Width of its finest level in texels.
        pub width: u32,
        /// Height of its finest level in texels.
        pub height: u32,
        /// How many levels it has.
        pub levels: u32,
    }

    /// A light: the points center + a u + b v for a, b in -1..=1. Under the integrator `path` there is one for each primitive that
    /// shines, and (a, b) are as its kind has them.
    pub struct Light {
        /// The middle; the direction to a directional light.
        pub center: Vec3,
        /// Where shadow rays end, as a multiple of the way to the light's sample.
        pub t_max: f32,
        /// Half the first edge.
        pub u: Vec3,
        /// 1, or 0 if the center is a direction.
        pub finite: f32,
        /// Half the second edge.
        pub v: Vec3,
        /// The index of its emissive primitive, or [`NO_INDEX`].
        pub primitive: u32,
        /// Its colour.
        pub color: Vec3,
        /// Its number in the scene file.
        pub number: u32,
        /// Unit normal of a flat one, on the side that shines; of a [`SPOT`] the unit vector in which the middle of its light travels.
        pub normal: Vec3,
        /// Under `path` the primitive's kind, [`POINT`], [`DIRECTIONAL`], [`SPOT`] or [`ENVIRONMENT`].
        pub kind: u32,
        /// Under `path`: [`Material::density`] of what shines; of a light without extent and of the environment how likely its
        /// samples are. 0 where a tree chooses it.
        pub density: f32,
        /// 1 where the normal's side shines alone, else 2.
        pub sides: u32,
        /// Of a [`SPOT`]: 1 minus the cosine of the angle between its middle and its edge.
        pub cone: f32,
        /// Of a [`SPOT`]: 1 / (the difference of that number at its edge and where its light begins to fall off).
        pub falloff: f32,
    }

    /// A thing that shines, in the table by which one is chosen: it stands for itself up to the threshold, for another one above.
    pub struct Emitter {
        /// 0 to 1.
        pub threshold: f32,
        /// The number of the other one.
        pub other: u32,
        /// 0 for a light, else one more than the number of a mesh's instance.
        pub instance: u32,
        /// The index of the light, or of the triangle in its mesh; [`NO_INDEX`] for the light tree.
        pub index: u32,
    }

    /// A node of the tree over much that shines (`light_tree.rs`): up to four children, one to each component.
    pub struct LightNode {
        /// The middles of spheres around what is in the children: x.
        pub x: Vec4,
        /// y.
        pub y: Vec4,
        /// z.
        pub z: Vec4,
        /// The spheres' radii.
        pub radius: Vec4,
        /// The axes of cones around the normals of what is in the children, of unit length: x.
        pub axis_x: Vec4,
        /// y.
        pub axis_y: Vec4,
        /// z.
        pub axis_z: Vec4,
        /// The cosines of the angles between the axes and any of these normals.
        pub cosine: Vec4,
        /// The shares of all nodes' light that they send in their brightest direction, 0 to 1; 0 where there is no child.
        pub intensity: Vec4,
        /// The cosines of the angles to normals beyond which there is no light.
        pub edge: Vec4,
        /// 1, or 2 where the opposite directions get light too.
        pub sides: UVec4,
        /// The indices of children that are nodes; [`NO_INDEX`] for a single emitter, which the following fields describe, and for no child.
        pub children: UVec4,
        /// How densely samples of light lie on it once it is chosen, per area; 1 for what has no extent. Of these samples those of the tree
        /// alone, whose share it is multiplied by.
        pub density: Vec4,
        /// 0 for a light, else one more than the number of a mesh's instance.
        pub instance: UVec4,
        /// The number of the light, or where the triangle is in its mesh.
        pub index: UVec4,
        /// x: which child it is of which node, four times the node's number and 0 to 3; [`NO_INDEX`] for the first one of all. The rest is 0.
        pub parent: UVec4,
    }

    /// How many records a scene has, and where they are; read where the scene is in buffers.
    pub struct Counts {
        /// The primitives of each kind, which lie together: x is the first, y one past the last that can cast a shadow, z
        /// one past the last.
        pub primitives: [UVec4; KINDS as usize],
        /// The lights: x of those with an area, which come first, y of all.
        pub lights: UVec2,
        /// The rows where the tables of lights, x, and of textures, y, start; that of materials starts at 0.
        pub tables: UVec2,
        /// The rows, behind the nodes of the scene's tree, where its items, x, instances, y, and groups' words, z, start.
        pub tree: UVec4,
        /// The row where the table of emitters starts, x, and how many there are, y; the rows where the nodes of the tree over what shines, z,
        /// and the numbers of its leaves, w, start.
        pub emitters: UVec4,
        /// The row where the table of lookups starts, x.
        pub lookups: UVec4,
        /// How much larger items' boxes count, relative to the coordinates, x; and the largest coordinate of any, y.
        pub room: Vec4,
    }

    /// A node of a tree of boxes: eight children at most, each a node, a leaf or none.
    pub struct Node {
        /// The corner that its children's boxes are counted from.
        pub base: Vec3,
        /// The biased exponents of the steps along x, y and z, a byte for each; then bit i is set where child i is a node.
        pub scales: u32,
        /// The first of the children that are nodes; they lie together.
        pub first_child: u32,
        /// The first of the items in its leaves; they lie together.
        pub first_item: u32,
        /// A byte for each child that is a leaf: how many items it has, in three bits, and where from the first.
        pub leaves: UVec2,
        /// The lower sides of the children's boxes along x in steps from the corner, a byte for each.
        pub low_x: UVec2,
        /// Along y.
        pub low_y: UVec2,
        /// Along z.
        pub low_z: UVec2,
        /// The upper sides along x.
        pub high_x: UVec2,
        /// Along y.
        pub high_y: UVec2,
        /// Along z.
        pub high_z: UVec2,
    }

    /// What the scene's tree is over: a primitive by itself or an instance of a mesh.
    pub struct Item {
        /// The lower corner of its box.
        pub low: Vec3,
        /// [`INSTANCE`] or the primitive's kind, and [`CASTS_SHADOW`].
        pub kind: u32,
        /// The upper corner of its box.
        pub high: Vec3,
        /// Its number among the instances or the primitives.
        pub index: u32,
    }

    /// A mesh in the world: a point p is (x, y, z) (p - anchor) in the mesh's space.
    pub struct Instance {
        /// First row of the map to the mesh's space.
        pub x: Vec3,
        /// The row of its mesh's first node.
        pub nodes: u32,
        /// Second row.
        pub y: Vec3,
        /// The row of its mesh's first triangle.
        pub triangles: u32,
        /// Third row.
        pub z: Vec3,
        /// The row of its mesh's first vertex.
        pub vertices: u32,
        /// Where the mesh's origin is.
        pub anchor: Vec3,
        /// The row of the groups of its triangles, or [`NO_INDEX`] if it has a single group.
        pub groups: u32,
        /// First column of the map from the mesh's space.
        pub u: Vec3,
        /// Its first group's word.
        pub materials: u32,
        /// Second column.
        pub v: Vec3,
        /// The number of its shape in the scene file.
        pub shape: u32,
        /// Third column.
        pub w: Vec3,
        /// The row of normal and v of its first vertex, or [`NO_INDEX`] without normals and texture coordinates.
        pub attributes: u32,
        /// The largest coordinate of its mesh.
        pub size: f32,
        /// By how much the map to the mesh's space and back enlarges what is rounded.
        pub condition: f32,
        /// 1, or -1 if the map mirrors.
        pub side: f32,
        /// 1 if its vertices have texture coordinates, else 0.
        pub has_uvs: u32,
        /// [`SOME_SHADOWS`] where some of its groups cast none, else 0.
        pub shadows: u32,
        /// The number of its mesh.
        pub mesh: u32,
        /// The first of the two rows of the tangents of its first vertex, or [`NO_INDEX`] without tangents.
        pub tangents: u32,
        /// The offset of its triangles in `Lighting::leaves`, or [`NO_INDEX`] if none is emissive; 0 without a light tree.
        pub leaves: u32,
        /// The row of the color of its first vertex, or [`NO_INDEX`] without vertex colors.
        pub colors: u32,
        /// The first row of further texture coordinates of its first vertex, two sets per row; [`NO_INDEX`] if it has a single set.
        pub more_uvs: u32,
        /// How many further sets there are.
        pub uv_sets: u32,
        /// 0.
        pub unused: u32,
    }

    /// The first hit of the ray through the center of a pixel; depth 0 and shape [`NO_INDEX`] for a miss.
    pub struct FirstHit {
        /// The outward normal, unit length.
        pub normal: Vec3,
        /// Distance along the ray.
        pub depth: f32,
        /// Texture coordinates.
        pub uv: Vec2,
        /// The number of the shape in the scene file; lights follow the shapes.
        pub shape: u32,
        /// Index of the material.
        pub material: u32,
        /// The normal that it is shaded by, outwards, without normal maps; unit length.
        pub shading_normal: Vec3,
        /// The number of the triangle in its mesh; of any other shape `shape`.
        pub primitive: u32,
        /// Barycentric coordinates of a mesh's triangle, of its second and third vertex.
        pub barycentric: Vec2,
        /// 0.
        pub unused: UVec2,
    }

    /// One dispatch's share of the work: a rectangle of pixels and a range of their samples.
    pub struct DispatchParams {
        /// Its first pixel, in the picture.
        pub origin: UVec2,
        /// Its size in pixels.
        pub size: UVec2,
        /// The film's first pixel, in the picture.
        pub film_origin: UVec2,
        /// The film's size in pixels.
        pub film_size: UVec2,
        /// The first sample, and one past the last.
        pub samples: UVec2,
        /// The range of the loop that proves a pixel whole (`shaders/completion.wgsl`).
        pub loop_probe: UVec2,
    }
}
