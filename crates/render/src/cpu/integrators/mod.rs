//! Integrators. Each is the twin of the file with its name in `shaders/integrators/`.

pub mod path;
pub mod phong;
