//! All tests of the program and of whole pictures, in one binary: a test build links once.

mod backends;
mod cli;
mod radiance;
mod render;
mod robust;
