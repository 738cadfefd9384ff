//! The plain bytes that both backends read, and the constants that a kernel is compiled for.
//!
//! The structs are those of `shaders/layout.wgsl`: rows of 16 bytes, a `vec3f` followed by a scalar.

mod appearance;
mod blocking;
mod bounds;
pub mod filter;
mod pyramid;

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, UVec2, UVec4, Vec2, Vec3};

use self::appearance::Appearances;
use crate::scene::{self, Geometry, Parallelogram, Pattern, PixelFilter, PixelFilterKind, Projection, Samples, Scene};

/// [`Camera::projection`] of a camera whose rays start at one point.
pub const PERSPECTIVE: u32 = 0;
/// [`Camera::projection`] of a camera whose rays are parallel.
pub const ORTHOGRAPHIC: u32 = 1;

/// [`Primitive::kind`]: |x| <= 1, |y| <= 1, z = 0 in local space.
pub const RECTANGLE: u32 = 0;
/// [`Primitive::kind`]: x >= 0, y >= 0, x + y <= 1, z = 0 in local space.
pub const TRIANGLE: u32 = 1;
/// [`Primitive::kind`]: the unit sphere of local space.
pub const ELLIPSOID: u32 = 2;
/// [`Primitive::kind`]: z = 0 in local space.
pub const PLANE: u32 = 3;

/// [`Material::kind`]: Phong's reflection model.
pub const PHONG: u32 = 0;
/// [`Material::kind`]: a light's surface, of one colour.
pub const EMITTER: u32 = 1;
/// [`Material::kind`]: a mirror.
pub const MIRROR: u32 = 2;
/// [`Material::kind`]: clear glass.
pub const GLASS: u32 = 3;

/// Glass splits a path at the first so many bounces.
pub const SPLITS: u32 = 2;
/// A path so has at most so many ends.
pub const LEAVES: u32 = 4;

/// [`Texture::kind`]: two colours that alternate.
pub const CHECKER: u32 = 0;
/// [`Texture::kind`]: lines.
pub const LINES: u32 = 1;
/// [`Texture::kind`]: an image, by its nearest texel.
pub const NEAREST: u32 = 2;
/// [`Texture::kind`]: an image, between its texels.
pub const BILINEAR: u32 = 3;
/// [`Texture::kind`]: an image, between its texels and levels.
pub const TRILINEAR: u32 = 4;
/// [`Texture::kind`]: an image, by the elliptical weighted average.
pub const EWA: u32 = 5;

/// [`Texture::format`]: 8 bits by the sRGB curve.
pub const SRGB8: u32 = 0;
/// [`Texture::format`]: 8 bits.
pub const LINEAR8: u32 = 1;
/// [`Texture::format`]: 32-bit floats.
pub const FLOAT: u32 = 2;

/// [`Texture::wrap`]: the image again and again.
pub const REPEAT: u32 = 0;
/// [`Texture::wrap`]: the colour of the nearest edge.
pub const CLAMP: u32 = 1;
/// [`Texture::wrap`]: the image again and again, every other one mirrored.
pub const MIRRORED: u32 = 2;

/// The bits of [`Material::lookups`] that are the texture's number.
pub const TEXTURE_NUMBER: u32 = 0xff_ffff;
/// In [`Material::lookups`]: gives [`Material::ambient`].
pub const FOR_AMBIENT: u32 = 0x100_0000;
/// In [`Material::lookups`]: gives [`Material::diffuse`].
pub const FOR_DIFFUSE: u32 = 0x200_0000;
/// In [`Material::lookups`]: gives [`Material::specular`].
pub const FOR_SPECULAR: u32 = 0x400_0000;
/// In [`Material::lookups`]: gives the normal.
pub const FOR_NORMAL: u32 = 0x800_0000;

/// [`Pattern::Grid`].
pub const GRID: u32 = 0;
/// [`Pattern::Random`].
pub const RANDOM: u32 = 1;
/// [`Pattern::RotatedGrid`].
pub const ROTATED_GRID: u32 = 2;
/// [`Pattern::Jittered`].
pub const JITTERED: u32 = 3;
/// [`Pattern::Halton`].
pub const HALTON: u32 = 4;
/// [`Pattern::Sobol`].
pub const SOBOL: u32 = 5;

/// No distance of a hit is larger.
pub const FAR: f32 = f32::MAX;
/// The number of a primitive that is none.
pub const NOTHING: u32 = u32::MAX;
/// Shadow rays are traced in blocks of so many, a bit of a word for each.
pub const BLOCK: u32 = 32;

/// Rays through a pixel's corners, under adaptive sampling.
pub const CORNERS: u32 = 4;

/// How far shadow rays to a directional light go: beyond any scene, yet small enough to be squared.
const DISTANT: f32 = 1e10;

/// A camera; rays start at `position` and pass through the image plane, which is one unit ahead (perspective) or at it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Camera {
    /// The start of perspective rays, the middle of the orthographic image plane.
    pub position: Vec3,
    /// [`PERSPECTIVE`] or [`ORTHOGRAPHIC`].
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
}

/// What belongs to the scene as a whole.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Environment {
    /// Ambient light.
    pub ambient: Vec3,
    /// Offset of shadow rays, relative to the largest coordinate.
    pub shadow_epsilon: f32,
    /// Radiance of rays that leave the scene.
    pub background: Vec3,
    /// 1 / (samples of an area light).
    pub light_weight: f32,
}

/// Any primitive: local = (x, y, z) (p - center), by the rows of the inverse linear map.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Primitive {
    /// Origin of local space.
    pub center: Vec3,
    /// Index of its material.
    pub material: u32,
    /// First row.
    pub x: Vec3,
    /// The number of its shape in the scene file; lights follow the shapes.
    pub shape: u32,
    /// Second row.
    pub y: Vec3,
    /// [`RECTANGLE`], [`TRIANGLE`], [`ELLIPSOID`] or [`PLANE`].
    pub kind: u32,
    /// Third row.
    pub z: Vec3,
    /// Determinant of the three rows.
    pub determinant: f32,
}

/// A sphere around a primitive that can cast a shadow.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Sphere {
    /// The middle.
    pub center: Vec3,
    /// Infinite for a plane.
    pub radius: f32,
}

/// A surface's appearance.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Factor of the ambient light; the colour of an emitter.
    pub ambient: Vec3,
    /// [`PHONG`], [`EMITTER`], [`MIRROR`] or [`GLASS`].
    pub kind: u32,
    /// Factor of the diffuse term.
    pub diffuse: Vec3,
    /// Exponent of the specular term; the index of refraction of glass.
    pub shininess: f32,
    /// Factor of the specular term; of what a mirror reflects; of what passes the surface of glass.
    pub specular: Vec3,
    /// The exponent, where it is a whole number.
    pub exponent: u32,
    /// Lookups in textures: a texture's number and the bits of what it is for, 0 for none.
    pub lookups: UVec4,
}

/// A texture: first + (second - first) x, where x is what the pattern or the image gives.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
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
    /// [`REPEAT`], [`CLAMP`] or [`MIRRORED`].
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

/// A light: the points center + a u + b v for a, b in -1..=1.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// The middle; the direction to a directional light.
    pub center: Vec3,
    /// Where shadow rays end, as a multiple of the way to the light's sample.
    pub reach: f32,
    /// Half the first edge.
    pub u: Vec3,
    /// 1, or 0 if the center is a direction.
    pub finite: f32,
    /// Half the second edge.
    pub v: Vec3,
    /// Its area.
    pub area: f32,
    /// Its colour.
    pub color: Vec3,
    /// Its number in the scene file.
    pub number: u32,
}

/// What the ray through a pixel's centre meets first; depth 0 and shape [`NOTHING`] where that is nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
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
}

/// One dispatch's share of the work: a rectangle of pixels and a range of their samples.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Work {
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
}

/// Declares [`Specialization`] with the names that the shaders' overrides have.
macro_rules! specialization {
    ($($(#[$doc:meta])* $field:ident = $name:literal),* $(,)?) => {
        /// Everything that a kernel may take as constant; a kernel is compiled for one of these.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        pub struct Specialization { $($(#[$doc])* pub $field: u32,)* }

        impl Specialization {
            /// The values by the names of the overrides in `shaders/specialization.wgsl`.
            pub fn constants(&self) -> Vec<(&'static str, u32)> {
                vec![$(($name, self.$field)),*]
            }
        }
    };
}

specialization! {
    /// Rectangles, those of lights among them.
    rectangles = "RECTANGLES",
    /// The first of them, which can cast a shadow.
    blocking_rectangles = "BLOCKING_RECTANGLES",
    /// Triangles.
    triangles = "TRIANGLES",
    /// The first of them, which can cast a shadow.
    blocking_triangles = "BLOCKING_TRIANGLES",
    /// Ellipsoids.
    ellipsoids = "ELLIPSOIDS",
    /// The first of them, which can cast a shadow.
    blocking_ellipsoids = "BLOCKING_ELLIPSOIDS",
    /// Infinite planes.
    planes = "PLANES",
    /// The first of them, which can cast a shadow.
    blocking_planes = "BLOCKING_PLANES",
    /// Rectangular lights, the first of the lights.
    area_lights = "AREA_LIGHTS",
    /// Point and directional lights.
    delta_lights = "DELTA_LIGHTS",
    /// How the samples of a pixel are laid out.
    pixel_pattern = "PIXEL_PATTERN",
    /// Side of their grid of cells; how many there are in patterns without cells.
    pixel_side = "PIXEL_SIDE",
    /// How many samples a pixel has; under adaptive sampling in every round.
    pixel_samples = "PIXEL_SAMPLES",
    /// How the samples of an area light are laid out.
    light_pattern = "LIGHT_PATTERN",
    /// Side of their grid of cells; how many there are in patterns without cells.
    light_side = "LIGHT_SIDE",
    /// How many there are.
    light_samples = "LIGHT_SAMPLES",
    /// Bins of the filter's table; 0 if it is the box of the pixel.
    filter_bins = "FILTER_BINS",
    /// The bits, as an f32, of the square of the error that adaptive sampling aims at.
    squared_error = "SQUARED_ERROR",
    /// Bits of the largest shininess if all are whole numbers, else 0.
    exponent_bits = "EXPONENT_BITS",
    /// Most bounces of a path, 0 where nothing mirrors or refracts.
    bounces = "BOUNCES",
    /// 1 where rays carry differentials, else 0.
    differentials = "DIFFERENTIALS",
    /// Most lookups in textures of a material that neither mirrors nor refracts.
    lookups = "LOOKUPS",
    /// Most lookups of one that does.
    specular_lookups = "SPECULAR_LOOKUPS",
    /// 1 if any texture gives a normal, else 0.
    normal_maps = "NORMAL_MAPS",
    /// Bit i is set if a texture is of kind i.
    texture_kinds = "TEXTURE_KINDS",
    /// Bit i is set if texels are of format i.
    texel_formats = "TEXEL_FORMATS",
}

/// A scene as both backends read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// The camera.
    pub camera: Camera,
    /// What belongs to the scene as a whole.
    pub environment: Environment,
    /// The primitives, sorted by kind and in each kind by whether they can cast a shadow; lights' rectangles among them.
    pub primitives: Vec<Primitive>,
    /// A sphere around each primitive.
    pub bounds: Vec<Sphere>,
    /// The materials of the scene, then one for each area light.
    pub materials: Vec<Material>,
    /// The lights, rectangles first.
    pub lights: Vec<Light>,
    /// The textures that materials look up.
    pub textures: Vec<Texture>,
    /// Their images: tables of places, and texels.
    pub texels: Vec<u32>,
    /// The filter's bins ([`filter::table`]); none if it is the box of the pixel.
    pub filter_table: Vec<Vec2>,
    /// Samples of every pixel; under adaptive sampling the most that one gets.
    pub pixel_samples: u32,
    /// Whether sampling is adaptive.
    pub adaptive: bool,
    /// The constants.
    pub specialization: Specialization,
}

impl Packed {
    /// Samples of light at every hit, over all lights; a point or directional light counts 1.
    pub fn light_samples(&self) -> u64 {
        let s = &self.specialization;
        u64::from(s.area_lights) * u64::from(s.light_samples) + u64::from(s.delta_lights)
    }
}

/// Packs a scene.
pub fn pack(scene: &Scene) -> Packed {
    let appearances = Appearances::of(scene);
    let mut materials = appearances.materials.clone();
    let exponent_bits = exponent_bits(&scene.materials, &materials);
    let mut primitives = pack_shapes(scene);
    let mut lights = Vec::new();
    for (number, light) in scene.lights.iter().enumerate() {
        let number = number as u32;
        if let scene::Light::Rectangle { rectangle, color } = light {
            let shape = scene.shapes.len() as u32 + number;
            primitives.push(parallelogram(RECTANGLE, rectangle, materials.len() as u32, shape));
            materials.push(Material {
                ambient: color.as_vec3(),
                kind: EMITTER,
                ..Material::zeroed()
            });
        }
        lights.push(pack_light(light, number, scene.render.shadow_epsilon));
    }
    lights.sort_by_key(|light| light.area == 0.0);
    let blocking = blocking::can_cast_shadow(scene, &primitives);
    let mut order: Vec<(Primitive, bool)> = primitives.into_iter().zip(blocking).collect();
    order.sort_by_key(|(primitive, blocking)| (primitive.kind, !blocking));
    let count = |kind: u32, only_blocking: bool| {
        order
            .iter()
            .filter(|(p, b)| p.kind == kind && (*b || !only_blocking))
            .count() as u32
    };
    let area_lights = lights.iter().filter(|light| light.area > 0.0).count() as u32;
    let (pixels, light_samples) = (scene.render.pixel_samples, scene.render.light_samples);
    let adaptive = scene.render.adaptive;
    let filter_table = match is_pixel(scene.render.filter) {
        true => Vec::new(),
        false => filter::table(scene.render.filter),
    };
    let specialization = Specialization {
        rectangles: count(RECTANGLE, false),
        blocking_rectangles: count(RECTANGLE, true),
        triangles: count(TRIANGLE, false),
        blocking_triangles: count(TRIANGLE, true),
        ellipsoids: count(ELLIPSOID, false),
        blocking_ellipsoids: count(ELLIPSOID, true),
        planes: count(PLANE, false),
        blocking_planes: count(PLANE, true),
        area_lights,
        delta_lights: lights.len() as u32 - area_lights,
        pixel_pattern: pattern(pixels),
        pixel_side: side(pixels),
        pixel_samples: pixels.count,
        light_pattern: pattern(light_samples),
        light_side: side(light_samples),
        light_samples: light_samples.count,
        filter_bins: (filter_table.len() as u32).saturating_sub(1),
        squared_error: adaptive
            .map_or(0.0, |adaptive| (adaptive.error * adaptive.error) as f32)
            .to_bits(),
        exponent_bits,
        bounces: if scene.materials.iter().any(is_specular) {
            scene.render.max_depth
        } else {
            0
        },
        differentials: (scene.render.ray_differentials && appearances.needs_footprints()).into(),
        lookups: appearances.lookups().0,
        specular_lookups: appearances.lookups().1,
        normal_maps: appearances.has_normal_maps().into(),
        texture_kinds: appearances.kinds(),
        texel_formats: appearances.formats(),
    };
    let primitives: Vec<Primitive> = order.into_iter().map(|(primitive, _)| primitive).collect();
    Packed {
        camera: pack_camera(&scene.camera, scene.width, scene.height, scene.render.seed),
        environment: Environment {
            ambient: scene.render.ambient.as_vec3(),
            shadow_epsilon: scene.render.shadow_epsilon as f32,
            background: scene.render.background.as_vec3(),
            light_weight: 1.0 / light_samples.count as f32,
        },
        bounds: primitives.iter().map(bounds::sphere).collect(),
        primitives,
        materials,
        lights,
        textures: appearances.textures,
        texels: appearances.texels,
        filter_table,
        pixel_samples: adaptive.map_or(pixels.count, |adaptive| adaptive.max_samples),
        adaptive: adaptive.is_some(),
        specialization,
    }
}

/// Whether a filter is the pixel itself: the same weight for all samples inside.
fn is_pixel(filter: PixelFilter) -> bool {
    filter.kind == PixelFilterKind::Box && filter.radius == 0.5
}

fn pattern(samples: Samples) -> u32 {
    match samples.pattern {
        Pattern::Grid => GRID,
        Pattern::Random => RANDOM,
        Pattern::RotatedGrid => ROTATED_GRID,
        Pattern::Jittered => JITTERED,
        Pattern::Halton => HALTON,
        Pattern::Sobol => SOBOL,
    }
}

/// The side of a pattern's grid of cells, or else the number of its samples.
fn side(samples: Samples) -> u32 {
    if samples.pattern.needs_square() {
        samples.count.isqrt()
    } else {
        samples.count
    }
}

/// A camera for a picture of `width` x `height` pixels.
pub fn pack_camera(camera: &scene::Camera, width: u32, height: u32, seed: u32) -> Camera {
    let aspect = f64::from(width) / f64::from(height);
    let (projection, half_height) = match camera.projection {
        Projection::Perspective { fov } => (PERSPECTIVE, (fov / 2.0).tan()),
        Projection::Orthographic { height } => (ORTHOGRAPHIC, height / 2.0),
    };
    Camera {
        position: camera.position.as_vec3(),
        projection,
        right: (camera.right * half_height * aspect).as_vec3(),
        width,
        up: (camera.up * half_height).as_vec3(),
        height,
        forward: camera.forward.as_vec3(),
        seed,
    }
}

fn is_specular(material: &scene::Material) -> bool {
    matches!(material, scene::Material::Mirror { .. } | scene::Material::Glass { .. })
}

/// Bits of the largest shininess, if all are whole numbers so small that squaring beats the general power.
fn exponent_bits(described: &[scene::Material], packed: &[Material]) -> u32 {
    let whole = described.iter().all(|material| {
        if let scene::Material::Phong { shininess, .. } = material {
            return shininess.fract() == 0.0 && *shininess <= 4096.0;
        }
        true
    });
    let largest = packed.iter().map(|material| material.exponent).max().unwrap_or(1);
    if whole { u32::BITS - largest.leading_zeros() } else { 0 }
}

fn pack_light(light: &scene::Light, number: u32, shadow_epsilon: f64) -> Light {
    let reach = (1.0 - shadow_epsilon) as f32;
    let unit = Light {
        finite: 1.0,
        reach,
        number,
        ..Light::zeroed()
    };
    match light {
        scene::Light::Rectangle { rectangle, color } => Light {
            center: rectangle.center.as_vec3(),
            u: rectangle.u.as_vec3(),
            v: rectangle.v.as_vec3(),
            area: (4.0 * rectangle.u.cross(rectangle.v).length()) as f32,
            color: color.as_vec3(),
            ..unit
        },
        scene::Light::Point { position, color } => Light {
            center: position.as_vec3(),
            color: color.as_vec3(),
            ..unit
        },
        scene::Light::Directional { direction, color } => Light {
            center: -direction.as_vec3(),
            finite: 0.0,
            reach: DISTANT,
            color: color.as_vec3(),
            ..unit
        },
    }
}

fn pack_shapes(scene: &Scene) -> Vec<Primitive> {
    let mut primitives = Vec::new();
    for (number, shape) in scene.shapes.iter().enumerate() {
        let (material, number) = (shape.material as u32, number as u32);
        match &shape.geometry {
            Geometry::Rectangle(rectangle) => {
                primitives.push(parallelogram(RECTANGLE, rectangle, material, number));
            }
            Geometry::Ellipsoid { center, axes } => {
                let [a, b, c] = *axes;
                primitives.push(primitive(
                    ELLIPSOID,
                    *center,
                    DMat3::from_cols(a, b, c),
                    material,
                    number,
                ));
            }
            Geometry::Triangles(triangles) => {
                for &[v0, v1, v2] in triangles {
                    let (a, b) = (v1 - v0, v2 - v0);
                    let columns = DMat3::from_cols(a, b, a.cross(b).normalize());
                    primitives.push(primitive(TRIANGLE, v0, columns, material, number));
                }
            }
            Geometry::Plane {
                point,
                tangent,
                bitangent,
            } => {
                let columns = DMat3::from_cols(*tangent, *bitangent, tangent.cross(*bitangent));
                primitives.push(primitive(PLANE, *point, columns, material, number));
            }
        }
    }
    primitives
}

fn parallelogram(kind: u32, p: &Parallelogram, material: u32, shape: u32) -> Primitive {
    primitive(
        kind,
        p.center,
        DMat3::from_cols(p.u, p.v, p.u.cross(p.v).normalize()),
        material,
        shape,
    )
}

/// The primitive whose local space is mapped to the world by `columns` and then `center`.
pub(crate) fn primitive(kind: u32, center: DVec3, columns: DMat3, material: u32, shape: u32) -> Primitive {
    let rows = columns.inverse().transpose();
    Primitive {
        center: center.as_vec3(),
        material,
        x: rows.x_axis.as_vec3(),
        shape,
        y: rows.y_axis.as_vec3(),
        kind,
        z: rows.z_axis.as_vec3(),
        determinant: rows.determinant() as f32,
    }
}
