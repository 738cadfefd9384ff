//! The development mode without a browser. After any change of the files, a session shows the image that `render` makes
//! of the current files, or the last valid image together with the error.

mod cpu;
mod faults;
mod film_layers;
mod gltf;
mod hostile;
mod kernels;
mod large;
mod pauses;
mod picking;
mod reload;
mod responsive;
mod running;
mod server;
mod shader_sliders;
mod slow_viewer;
mod viewer;
mod views;
mod writing;
