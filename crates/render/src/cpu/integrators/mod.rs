//! Integrators. Each is the twin of the file of the same name in `shaders/integrators/`.

pub mod path;
pub mod phong;
