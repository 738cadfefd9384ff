//! The shader files in the program. Builds without the feature `gpu` need them too: their hash is part of a job's identity.

// Without the feature `gpu` only the list of all files is read.
#![cfg_attr(not(feature = "gpu"), allow(dead_code))]

/// A shader file: its name in `shaders/` and its text at build time.
pub type File = (&'static str, &'static str);

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../shaders/", $name)))),*]
    };
}

/// The shared mathematics: pure functions and records, each with a twin in `src/cpu/`.
pub static SHARED: &[File] = files![
    "math.wgsl",
    "rng.wgsl",
    "sampling.wgsl",
    "sequence.wgsl",
    "warp.wgsl",
    "ray.wgsl",
    "rectangle.wgsl",
    "triangle.wgsl",
    "ellipsoid.wgsl",
    "plane.wgsl",
    "disk.wgsl",
    "primitive.wgsl",
    "camera.wgsl",
    "lens.wgsl",
    "panorama.wgsl",
    "surface.wgsl",
    "light.wgsl",
    "light_tree.wgsl",
    "shadow.wgsl",
    "phong.wgsl",
    "differential.wgsl",
    "specular.wgsl",
    "path.wgsl",
    "diffuse.wgsl",
    "modified_phong.wgsl",
    "principled.wgsl",
    "dielectric.wgsl",
    "ggx.wgsl",
    "lobe.wgsl",
    "metal.wgsl",
    "rough_dielectric.wgsl",
    "thin.wgsl",
    "light_sample.wgsl",
    "surroundings.wgsl",
    "footprint.wgsl",
    "procedural.wgsl",
    "texel.wgsl",
    "normal_map.wgsl",
    "filter.wgsl",
    "adaptive.wgsl",
    "slab.wgsl",
    "node.wgsl",
    "mesh.wgsl",
];
/// Software quotients and square roots. First in a kernel, since naga requires functions before their calls.
pub static ROUNDING_FILE: &[File] = files!["rounding.wgsl"];
/// The buffers and the scene traversal, which every kernel adds to [`SHARED`].
pub static KERNEL: &[File] = files![
    "bindings.wgsl",
    "receipt.wgsl",
    "traverse.wgsl",
    "meshes.wgsl",
    "tree.wgsl",
    "geometry.wgsl",
    "vertices.wgsl",
    "texture.wgsl",
    "alpha.wgsl",
];
/// The sampling of a pixel.
pub static SAMPLES: &[File] = files!["pixel.wgsl"];
pub static PHONG: &[File] = files!["integrators/whole.wgsl", "integrators/phong.wgsl"];
pub static PATH: &[File] = files![
    "environment.wgsl",
    "light_choice.wgsl",
    "emitter.wgsl",
    "energy.wgsl",
    "scattering.wgsl",
    "integrators/path.wgsl"
];
/// Loops that read the scene from buffers. `bake` writes the same functions with the scene's records as constants.
pub static FROM_BUFFERS: &[File] = files!["buffers.wgsl"];
/// Access to texels in a single buffer.
pub static TEXELS: &[File] = files!["texels.wgsl"];
pub static RENDER_FILE: &[File] = files!["film.wgsl", "kernels/render.wgsl"];
pub static ADAPTIVE_FILE: &[File] = files!["film.wgsl", "kernels/adaptive.wgsl"];
pub static FIRST_HITS_FILE: &[File] = files!["kernels/first_hits.wgsl"];

/// Returns every file of `shaders/`, in the order in which the shader hash reads them.
pub fn built_in() -> impl Iterator<Item = File> {
    let scene = [
        ROUNDING_FILE,
        SHARED,
        KERNEL,
        SAMPLES,
        PHONG,
        PATH,
        FROM_BUFFERS,
        TEXELS,
    ];
    let kernels = [RENDER_FILE, &ADAPTIVE_FILE[1..], FIRST_HITS_FILE];
    scene.into_iter().chain(kernels).flatten().copied()
}
