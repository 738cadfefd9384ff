//! Generator of the images in `scenes/textures/`. A test compares the files with the generator, and writes the files if
//! the environment variable `WGRAY_WRITE_TEXTURES` is 1.

use std::path::Path;

use super::write_png;

const SIDE: u32 = 512;

/// Returns a texel of an image of tiles with dark joints and fine lines. Tiles are 64 texels wide; some are colored.
fn grid(x: u32, y: u32) -> [u8; 3] {
    if x % 64 < 4 || y % 64 < 4 {
        return [30, 30, 40];
    }
    if x % 16 < 1 || y % 16 < 1 {
        return [150, 150, 160];
    }
    let (column, row) = (x / 64, y / 64);
    if (column + row) % 2 == 0 {
        return [235, 235, 230];
    }
    [[235, 235, 230], [225, 190, 120], [130, 180, 215]][((column + 2 * row) % 3) as usize]
}

const BUMP_SIDE: u32 = 64;

/// Returns a texel of a normal map: a low dome on a plane.
fn bump(x: u32, y: u32) -> [u8; 3] {
    let coordinate = |i: u32| (f64::from(i) + 0.5) / f64::from(BUMP_SIDE) * 2.0 - 1.0;
    let (u, v) = (coordinate(x), -coordinate(y));
    let (nx, ny) = if u * u + v * v < 0.64 { (u, v) } else { (0.0, 0.0) };
    let nz = (1.0 - nx * nx - ny * ny).sqrt();
    [nx, ny, nz].map(|n: f64| ((n * 0.5 + 0.5) * 255.0).round() as u8)
}

#[test]
fn the_texture_files_match_the_generator() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/textures");
    let write = std::env::var_os("WGRAY_WRITE_TEXTURES").is_some_and(|value| value == "1");
    let mut names = Vec::new();
    for (name, side, texel) in [
        ("grid.png", SIDE, grid as fn(u32, u32) -> [u8; 3]),
        ("bumps.png", BUMP_SIDE, bump),
    ] {
        if write {
            write_png(&folder.join(name), side, side, texel);
        }
        let file = image::open(folder.join(name)).unwrap().into_rgb8();
        assert_eq!(file.dimensions(), (side, side), "{name}");
        for (x, y, found) in file.enumerate_pixels() {
            assert_eq!(found.0, texel(x, y), "{name} at ({x}, {y})");
        }
        names.push(name.to_string());
    }
    let found = std::fs::read_dir(&folder).unwrap();
    let mut found: Vec<_> = found
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    found.sort();
    names.sort();
    assert_eq!(found, names);
    assert_ne!(grid(0, 0), grid(8, 8)); // negative control: the generator is not constant
}
