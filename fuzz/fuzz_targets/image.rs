//! Reads arbitrary bytes as an image file for `wgray diff`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray_image::compare::Picture;
use wgray_fuzz::file;

fuzz_target!(|bytes: &[u8]| {
    let _ = Picture::read(&file("a", bytes));
});
