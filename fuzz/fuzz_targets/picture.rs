//! The bytes of a picture that wgray diff reads.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wgray_image::compare::Picture;
use wgray_fuzz::file;

fuzz_target!(|bytes: &[u8]| {
    let _ = Picture::read(&file("a", bytes));
});
