//! Reads arbitrary bytes as a PLY file.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::mesh::{Mesh, Normals};
use wgray_fuzz::file;

fuzz_target!(|bytes: &[u8]| {
    let path = file("a.ply", bytes);
    for normals in [None, Some(Normals::Smooth), Some(Normals::File)] {
        let _ = Mesh::load(&path, normals);
    }
});
