//! Integrators. Each file is the twin of the file with the same name in `shaders/integrators/`.

pub mod path;
pub mod phong;
