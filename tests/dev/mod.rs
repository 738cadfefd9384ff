//! The development mode without a browser: whatever happens to the files, the picture is the one that `render` makes of
//! what they say last, or the last good one with the error beside it.

mod faults;
mod film_layers;
mod gltf;
mod hostile;
mod kernels;
mod large;
mod measure;
mod pauses;
mod picking;
mod reload;
mod responsive;
mod running;
mod server;
mod shader_layers;
mod shader_sliders;
mod views;
mod writing;
