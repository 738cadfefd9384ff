//! What the program makes of glTF files, against what is known of them from elsewhere: each feature in a small file of its own,
//! which `scripts/check-gltf` has looked at by the Khronos validator too.

mod agreement;
mod animations;
pub mod build;
mod cameras;
mod damage;
mod geometry;
mod lights;
mod materials;
mod nodes;
mod page;
mod presentation;
mod read;
mod textures;
