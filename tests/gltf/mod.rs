//! The glTF importer: one generated file per feature, which `scripts/check-gltf` also passes to the Khronos validator.

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
