//! Integration tests of the program, of images, and of the agreement of GPU and CPU (`docs/agreement.md`), in one
//! binary that links once.

mod adapter;
mod against_oracle;
mod analytic;
mod bounds;
mod building;
mod choices;
mod cli;
mod compare;
mod contract;
mod cost;
mod culling;
mod denoise;
#[cfg(feature = "dev")]
mod dev;
mod documents;
#[cfg(target_os = "linux")]
mod faults;
mod gltf;
mod grounds;
#[cfg(unix)]
mod hostile;
mod inputs;
mod integrator;
mod jobs;
mod kernel;
mod layers;
mod layout;
mod lens;
mod loops;
mod memory;
mod meshes;
mod model;
mod mutations;
mod nearly;
mod noise;
mod oracle;
mod panorama;
mod path;
mod patterns;
mod pictures;
mod probe_words;
mod probes;
mod radiance;
mod random;
mod random_scenes;
mod render;
mod robust;
mod rounding;
mod sampling;
mod scenes;
mod schema;
mod sessions;
mod sources;
mod statistics;
mod structure;
mod test_folder;
mod textures;
mod twins;
mod unchanged;
mod wavefront;
