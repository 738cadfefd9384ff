//! Reads arbitrary bytes as the MTL file of a mesh and renders the scene.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray::{Overrides, Scene};
use wgray_fuzz::{file, render, small};

const MESH: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";
const SCENE: &[u8] = b"[image]\nwidth = 3\nheight = 2\n[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 50\n\
    [[lights]]\ntype = \"point\"\nposition = [0, 0, 3]\ncolor = [1, 1, 1]\n[[shapes]]\ntype = \"mesh\"\nfile = \"a.obj\"\n";

fuzz_target!(|bytes: &[u8]| {
    file("a.mtl", bytes);
    file("a.obj", MESH);
    let overrides = Overrides {
        pixel_samples: Some(1),
        ..small()
    };
    if let Ok(scene) = Scene::load_with(file("a.toml", SCENE), &overrides) {
        render(&scene);
    }
});
