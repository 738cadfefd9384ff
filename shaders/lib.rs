//! The WGSL shaders of wgray as text, and the hash of all shaders, which is part of the identity of a render on every
//! device.

/// Name and text of a shader file at build time.
pub type File = (&'static str, &'static str);

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!($name))),*]
    };
}

/// The shared mathematics: pure functions and records with Rust twins.
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
    "solid.wgsl",
    "cylinder.wgsl",
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
    "equirect.wgsl",
    "footprint.wgsl",
    "procedural.wgsl",
    "texel.wgsl",
    "normal_map.wgsl",
    "filter.wgsl",
    "adaptive.wgsl",
    "denoise.wgsl",
    "slab.wgsl",
    "bvh_node.wgsl",
    "mesh.wgsl",
];
/// Correctly rounded quotients and square roots. This file comes first, because naga requires that functions are
/// defined before they are called.
pub static ROUNDING_FILES: &[File] = files!["rounding.wgsl"];
/// Buffers and scene traversal. Every kernel contains these files and [`SHARED`].
pub static KERNEL: &[File] = files![
    "bindings.wgsl",
    "completion.wgsl",
    "linear_primitives.wgsl",
    "meshes.wgsl",
    "bvh.wgsl",
    "geometry.wgsl",
    "vertices.wgsl",
    "texture.wgsl",
    "alpha.wgsl",
];
/// Functions that sample a pixel.
pub static SAMPLES: &[File] = files!["pixel.wgsl"];
/// Files of the integrator `phong`.
pub static PHONG: &[File] = files!["integrators/whole.wgsl", "integrators/phong.wgsl"];
/// Files of the integrator `path`.
pub static PATH: &[File] = files![
    "environment.wgsl",
    "light_choice.wgsl",
    "emitter.wgsl",
    "energy.wgsl",
    "scattering.wgsl",
    "integrators/path.wgsl"
];
/// Loops that read the scene from buffers. Baked kernels have functions with constant records instead.
pub static FROM_BUFFERS: &[File] = files!["buffers.wgsl"];
/// Functions that read texels from a single buffer.
pub static TEXELS: &[File] = files!["texels.wgsl"];
/// Files of the kernel that accumulates samples.
pub static RENDER_FILES: &[File] = files!["film.wgsl", "kernels/render.wgsl"];
/// Files of the kernel that accumulates samples with adaptive sampling.
pub static ADAPTIVE_FILES: &[File] = files!["film.wgsl", "kernels/adaptive.wgsl"];
/// Files of the kernel that writes first hits.
pub static FIRST_HITS_FILES: &[File] = files!["kernels/first_hits.wgsl"];

/// Files of the kernel that denoises an image.
pub static DENOISE_FILES: &[File] = files!["kernels/denoise.wgsl"];

/// Returns every file once, in the order in which [`hash`] reads them.
pub fn built_in() -> impl Iterator<Item = File> {
    let scene = [
        ROUNDING_FILES,
        SHARED,
        KERNEL,
        SAMPLES,
        PHONG,
        PATH,
        FROM_BUFFERS,
        TEXELS,
    ];
    // `[1..]` omits film.wgsl, which `RENDER_FILES` contains too.
    let kernels = [RENDER_FILES, &ADAPTIVE_FILES[1..], FIRST_HITS_FILES, DENOISE_FILES];
    scene.into_iter().chain(kernels).flatten().copied()
}

/// Returns the BLAKE3 hash of all names and texts, in hexadecimal.
pub fn hash() -> String {
    hash_of(built_in())
}

/// Hashes the length of each name and text before its bytes, so that different lists of files never hash the same
/// bytes.
fn hash_of<T: AsRef<str>>(files: impl Iterator<Item = (&'static str, T)>) -> String {
    let mut hasher = blake3::Hasher::new();
    for (name, text) in files {
        for bytes in [name.as_bytes(), text.as_ref().as_bytes()] {
            hasher.update(&(bytes.len() as u64).to_le_bytes());
            hasher.update(bytes);
        }
    }
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    #[test]
    fn the_hash_matches_the_files_on_disk() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let hash_with = |suffix: &str| {
            let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap() + suffix;
            hash_of(built_in().map(|(name, _)| (name, read(name))))
        };
        assert_eq!(hash(), hash_with(""));
        assert_ne!(hash(), hash_with(" "));
    }

    #[test]
    fn the_table_lists_every_shader() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let files = ["", "kernels", "integrators"].into_iter().flat_map(|subfolder| {
            let entries = std::fs::read_dir(folder.join(subfolder)).unwrap().map(Result::unwrap);
            entries.map(move |entry| {
                Path::new(subfolder)
                    .join(entry.file_name())
                    .to_str()
                    .unwrap()
                    .to_owned()
            })
        });
        let shaders: BTreeSet<String> = files.filter(|name| name.ends_with(".wgsl")).collect();
        let table: BTreeSet<String> = built_in().map(|(name, _)| name.to_owned()).collect();
        assert_eq!(table, shaders);
        assert_eq!(table.len(), built_in().count());
    }
}
