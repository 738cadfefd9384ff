//! The two paths make the same picture, bit for bit, whatever its size and however the work is cut.

use wgray::cpu::Cpu;
use wgray::film::{Film, Region};
use wgray::job::{self, Backend, Cut};
use wgray::pack::{FirstHit, Packed};
use wgray::scene::Description;

use crate::backends::{BAKED, BUFFERS, PLAIN, crop, differing, film, gpu, packed, reference, scene, scenes, whole};

/// Sizes that are no multiples of the workgroup's 8 x 8, but for one.
const SIZES: [(u32, u32); 4] = [(67, 41), (1, 1), (9, 130), (64, 48)];

/// A scene at a size, with so few samples that a picture takes a moment.
fn small(description: &Description, (width, height): (u32, u32)) -> Packed {
    let mut description = description.clone();
    (description.image.width, description.image.height) = (width, height);
    let count = |count: u32| if count > 16 { 16 } else { count };
    description.render.pixel_samples.count = 4;
    description.render.light_samples.count = count(description.render.light_samples.count);
    packed(&description)
}

#[test]
fn every_scene_has_the_same_bits_on_both_paths() {
    for (name, description) in scenes() {
        for size in SIZES {
            let scene = small(&description, size);
            let expected = reference(&scene);
            for options in [BAKED, BUFFERS] {
                let found = film(&mut gpu(&scene, options), &scene, whole(&scene), &Cut::default());
                assert_eq!(differing(&found, &expected), 0, "{name} at {size:?}, {options:?}");
            }
        }
    }
}

#[test]
fn one_ulp_or_one_pixel_is_a_difference() {
    let description = scene("cornell.toml");
    let scene = small(&description, SIZES[0]);
    let expected = reference(&scene);

    let mut nudged = expected.clone();
    nudged.sums[700].y = nudged.sums[700].y.next_up();
    assert_eq!(differing(&nudged, &expected), 1);

    let mut shifted = expected.clone();
    shifted.sums.rotate_right(1);
    assert!(differing(&shifted, &expected) > 1000, "a picture shifted by a pixel");

    let mut moved = scene.clone();
    moved
        .primitives
        .iter_mut()
        .for_each(|primitive| primitive.center += 1e-6);
    let found = film(&mut gpu(&moved, BUFFERS), &moved, whole(&scene), &Cut::default());
    assert!(differing(&found, &expected) > 0, "a scene moved by a millionth");
}

#[test]
fn any_cut_gives_the_same_bits() {
    let scene = small(&scene("lights.toml"), SIZES[0]);
    let expected = reference(&scene);
    let cuts = [
        Cut {
            band_pixels: 67 * 5,
            samples_per_call: Some(3),
            rows_per_call: Some(2),
        },
        Cut {
            band_pixels: 1,
            samples_per_call: Some(1),
            rows_per_call: None,
        }, // a band has a row at least
        Cut {
            band_pixels: u64::MAX,
            samples_per_call: None,
            rows_per_call: Some(40),
        },
    ];
    let mut device = gpu(&scene, BAKED);
    for cut in cuts {
        let backends: [&mut dyn Backend; 2] = [&mut device, &mut Cpu::new(&scene)];
        for backend in backends {
            assert_eq!(
                differing(&film(backend, &scene, whole(&scene), &cut), &expected),
                0,
                "{cut:?}"
            );
        }
    }
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let scene = small(&scene("ellipsoids.toml"), SIZES[0]);
    let expected = reference(&scene);
    let crops = [
        (0, 0, 1, 1),
        (3, 7, 60, 29),
        (66, 0, 67, 41),
        (0, 40, 67, 41),
        (11, 5, 30, 37),
    ];
    let mut device = gpu(&scene, BAKED);
    for (x0, y0, x1, y1) in crops {
        let region = Region { x0, y0, x1, y1 };
        let backends: [&mut dyn Backend; 2] = [&mut device, &mut Cpu::new(&scene)];
        for backend in backends {
            let found = film(backend, &scene, region, &Cut::default());
            assert_eq!(differing(&found, &crop(&expected, region)), 0, "{region:?}");
        }
    }
    let beside = Region {
        x0: 4,
        y0: 7,
        x1: 61,
        y1: 29,
    };
    let moved = Film {
        region: beside,
        ..crop(
            &expected,
            Region {
                x0: 3,
                y0: 7,
                x1: 60,
                y1: 29,
            },
        )
    };
    assert!(
        differing(&moved, &crop(&expected, beside)) > 0,
        "the crop beside is another picture"
    );
}

#[test]
fn a_larger_picture_has_the_same_bits() {
    let scene = small(&scene("cornell.toml"), (401, 397));
    let found = film(&mut gpu(&scene, BAKED), &scene, whole(&scene), &Cut::default());
    assert_eq!(differing(&found, &reference(&scene)), 0);
}

/// The bound for devices and languages that may round otherwise: how many pixels differ by more than 1e-4 of their
/// value (an edge falls to the other side), and how far the means of the two pictures are apart, relatively.
fn loose(a: &Film, b: &Film) -> (usize, f64) {
    let mut beyond = 0;
    let (mut sum_a, mut sum_b) = (0.0, 0.0);
    for (a, b) in a.means().zip(b.means()) {
        let far = |(a, b): (&f32, &f32)| !((a - b).abs() <= 1e-4 * a.abs().max(b.abs()));
        beyond += usize::from(a.iter().zip(&b).any(far));
        sum_a += a.iter().map(|v| f64::from(*v)).sum::<f64>();
        sum_b += b.iter().map(|v| f64::from(*v)).sum::<f64>();
    }
    (beyond, (sum_a - sum_b).abs() / sum_b)
}

#[test]
fn plain_wgsl_is_within_its_bound() {
    for (name, description) in scenes() {
        let scene = small(&description, (160, 120));
        let expected = reference(&scene);
        let found = film(&mut gpu(&scene, PLAIN), &scene, whole(&scene), &Cut::default());
        let (beyond, mean) = loose(&found, &expected);
        assert!(
            beyond <= expected.sums.len() / 1000,
            "{name}: {beyond} pixels are beyond the bound"
        );
        assert!(mean <= 1e-5, "{name}: the means are {mean} apart");
    }
}

#[test]
fn the_bound_of_plain_wgsl_can_be_broken() {
    let scene = small(&scene("cornell.toml"), (160, 120));
    let expected = reference(&scene);
    let mut brighter = expected.clone();
    for sum in brighter.sums.iter_mut().step_by(500) {
        sum.x *= 1.001;
    }
    let (beyond, mean) = loose(&brighter, &expected);
    assert!(beyond > expected.sums.len() / 1000, "{beyond} pixels");
    brighter
        .sums
        .iter_mut()
        .for_each(|sum| *sum *= glam::Vec4::new(1.00003, 1.00003, 1.00003, 1.0));
    assert!(mean < 1e-5 && loose(&brighter, &expected).1 > 1e-5);
}

#[test]
fn first_hits_are_the_same_bits() {
    for (name, description) in scenes() {
        let scene = small(&description, SIZES[0]);
        let hits = |backend: &mut dyn Backend| {
            job::first_hits(backend, whole(&scene)).unwrap_or_else(|error| panic!("{name}: {error}"))
        };
        let bytes = |hits: &[FirstHit]| bytemuck::cast_slice::<FirstHit, u8>(hits).to_vec();
        let expected = hits(&mut Cpu::new(&scene));
        for options in [BAKED, BUFFERS] {
            let found = hits(&mut gpu(&scene, options));
            let same = bytes(&found) == bytes(&expected);
            assert!(same, "{name}, {options:?}");
        }
        assert!(expected.iter().any(|hit| hit.depth > 0.0), "{name}: nothing is seen");
    }
}
