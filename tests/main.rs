//! Tests of the whole library. One binary: a test build links once.

mod textures;
