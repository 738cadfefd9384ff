// The records that the host uploads. `src/pack/layout.rs` has the same structs; a test compares them field by field.

// Rays start at `position` and pass through the image plane, which is one unit ahead (perspective) or at it
// (orthographic).
struct Camera {
    position: vec3f,
    projection: u32,       // PERSPECTIVE or ORTHOGRAPHIC
    right: vec3f,          // half the image plane's width
    width: u32,            // of the whole picture, in pixels
    up: vec3f,             // half the image plane's height
    height: u32,
    forward: vec3f,        // unit length
    seed: u32,
}

// What belongs to the scene as a whole.
struct Environment {
    ambient: vec3f,
    shadow_epsilon: f32,   // how far above a surface rays start, relative to the largest coordinate
    background: vec3f,
    light_weight: f32,     // 1 / (samples of an area light)
}

// Any primitive: local = (x, y, z) (p - anchor) - middle, by the rows of the inverse linear map. In local space it is the
// canonical shape of its kind. An ellipsoid's anchor is on its surface, near the origin, so that the points there keep
// their digits however large it is; of the others it is the centre, and `middle` is 0.
struct Primitive {
    anchor: vec3f,
    material: u32,
    x: vec3f,
    shape: u32,            // the number of its shape in the scene file
    y: vec3f,
    kind: u32,             // RECTANGLE, TRIANGLE, ELLIPSOID or PLANE
    z: vec3f,
    determinant: f32,      // of the three rows
    middle: vec3f,         // an ellipsoid's centre, by the same rows: (x, y, z) (centre - anchor)
    level: f32,            // |middle|^2 - 1, which is how far the anchor is off the ellipsoid
}

// A sphere around a primitive that can cast a shadow.
struct Sphere {
    center: vec3f,
    radius: f32,
}

struct Material {
    ambient: vec3f,        // EMITTER: its colour
    kind: u32,             // PHONG, EMITTER, MIRROR or GLASS
    diffuse: vec3f,
    shininess: f32,        // GLASS: the index of refraction
    specular: vec3f,       // MIRROR: factor of reflected light; GLASS: of light that passes the surface
    exponent: u32,         // the shininess, where it is a whole number
    lookups: vec4u,        // in textures: number and purposes, 0 for none
}

// A texture: first + (second - first) x, where x is what the pattern or the image gives.
struct Texture {
    first: vec3f,
    kind: u32,             // CHECKER, LINES, NEAREST, BILINEAR, TRILINEAR or EWA
    second: vec3f,
    parameter: f32,        // LINES: their width; EWA: the largest ratio of an ellipse's axes
    u: vec3f,              // rows of the map from a surface's (u, v, 1) to the texture's (u, v)
    format: u32,           // SRGB8, LINEAR8 or FLOAT
    v: vec3f,
    wrap: u32,             // REPEAT, CLAMP or MIRRORED
    texels: u32,           // where the table of its levels' places starts
    width: u32,            // of its finest level, in texels
    height: u32,
    levels: u32,
}

// A light: the points center + a u + b v for a, b in -1..=1. A point light has no u and v; a directional one has the
// direction to the light as its center.
struct Light {
    center: vec3f,
    reach: f32,            // where shadow rays end, as a multiple of the way to the light's sample
    u: vec3f,
    finite: f32,           // 1, or 0 if the center is a direction
    v: vec3f,
    area: f32,
    color: vec3f,
    number: u32,           // in the scene file
}

// What the ray through a pixel's centre meets first; depth 0 and shape NOTHING where that is nothing.
struct FirstHit {
    normal: vec3f,         // outward, unit length
    depth: f32,            // distance along the ray
    uv: vec2f,             // texture coordinates
    shape: u32,            // its number in the scene file; lights follow the shapes
    material: u32,
}

// One dispatch's share of the work: a rectangle of pixels and a range of their samples.
struct Work {
    origin: vec2u,         // its first pixel, in the picture
    size: vec2u,           // in pixels
    film_origin: vec2u,    // the film's first pixel, in the picture
    film_size: vec2u,      // in pixels
    samples: vec2u,        // first, and one past the last
    proof: vec2u,          // the range of the loop that proves a pixel whole
}
