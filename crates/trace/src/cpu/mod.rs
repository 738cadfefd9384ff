//! The CPU backend: twins of the WGSL functions, with the same names, arguments and order of operations, run on several
//! threads. It is the reference for tests of the GPU backend.
//!
//! The WGSL files document the functions.
#![allow(missing_docs, reason = "documented in the WGSL files")]

pub mod accumulate;
pub mod adaptive;
pub mod alpha;
pub mod bits;
pub mod bvh;
pub mod bvh_node;
pub mod camera;
pub mod cylinder;
pub mod decoded_bvhs;
pub mod denoise;
pub mod dielectric;
pub mod differential;
pub mod diffuse;
pub mod disk;
pub mod ellipsoid;
pub mod emitter;
pub mod energy;
pub mod environment;
pub mod equirect;
mod ewa;
pub mod filter;
pub mod footprint;
pub mod geometry;
pub mod ggx;
pub mod integrators;
// WebAssembly has no wavefront, which uses the types.
pub mod lanes;
pub mod lens;
pub mod light;
pub mod light_choice;
pub mod light_sample;
pub mod light_tree;
pub mod linear_primitives;
pub mod lobe;
pub mod lobes;
pub mod math;
pub mod mesh;
pub mod metal;
pub mod modified_phong;
pub mod normal_map;
pub mod panorama;
pub mod path;
pub mod phong;
pub mod pixel;
pub mod plane;
pub mod prefetch;
pub mod primitive;
pub mod principled;
pub mod procedural;
pub mod ray;
pub mod rectangle;
pub mod rng;
pub mod rough_dielectric;
pub mod samples;
pub mod sampling;
pub mod scattering;
pub mod sequence;
pub mod shadow;
pub mod shadow_ray;
pub mod slab;
pub mod solid;
pub mod specular;
pub mod surface;
pub mod texel;
pub mod texture;
pub mod thin;
pub mod traversal;
pub mod triangle;
pub mod vertices;
pub mod warp;
#[cfg(not(target_arch = "wasm32"))]
pub mod wavefront;
#[cfg(target_arch = "wasm32")]
#[path = "wavefront/scalar.rs"]
pub mod wavefront;
