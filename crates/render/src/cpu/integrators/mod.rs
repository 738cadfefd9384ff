//! The integrators: what light is simulated. Each is the twin of the file of its name in `shaders/integrators/`.

pub mod path;
pub mod phong;
