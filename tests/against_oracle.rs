//! Compares images and first hits of all scenes with the oracle (`oracle.rs`).

use glam::{DVec2, DVec3};
use wgray::scene::{Description, Pattern, SamplesDescription};
use wgray_trace::records::{FirstHit, NO_INDEX};

use crate::oracle::{Flaw, Intersection, Oracle};
use crate::pictures::{both, first_hits, means, render};
use crate::scenes;

/// Tolerance of a value `v`, relative to `1 + v`: the size of f32 rounding errors after a specular exponent of 50.
const TOLERANCE: f64 = 1e-5;

/// Maximum fraction of differing pixels. Rounding can move a sample to the other side of an edge.
const MAX_EDGE_FRACTION: f64 = 0.0005;

/// Scenes with more edges: name, maximum fraction of differing pixels, and reason.
const EDGE_FRACTIONS_BY_SCENE: &[(&str, f64, &str)] = &[
    (
        "balls-checker.toml",
        0.003,
        "an unfiltered checkerboard extends to the horizon",
    ),
    (
        "twisted-tube.toml",
        0.003,
        "shadows on meshes end at the edges of thousands of triangles, and a mirror reflects the shadows",
    ),
];

fn max_edge_fraction(scene: &str) -> f64 {
    EDGE_FRACTIONS_BY_SCENE
        .iter()
        .find(|(name, ..)| *name == scene)
        .map_or(MAX_EDGE_FRACTION, |(_, fraction, _)| *fraction)
}

/// Scenes that the oracle does not support: name and unsupported features.
const UNSUPPORTED: &[(&str, &str)] = &[
    ("textures.toml", "image textures and normal maps"),
    ("ground-grid.toml", "an image texture"),
    ("cornell-path.toml", "indirect light"),
    ("pillars.toml", "indirect light"),
    ("lens.toml", "indirect light and a thin lens"),
    ("panorama.toml", "indirect light and a panorama camera"),
    ("materials.toml", "indirect light and most materials"),
];

fn reduced(description: &Description) -> Description {
    let mut description = description.clone();
    let scale = f64::from(description.image.width) / 96.0;
    description.image.width = 96;
    description.image.height = (f64::from(description.image.height) / scale) as u32;
    description.render.pixel_samples = SamplesDescription {
        pattern: Some(Pattern::Grid),
        count: 4,
    };
    // The oracle point-samples textures and follows both branches at glass, as the renderer does up to depth 2.
    description.render.ray_differentials = false;
    description.render.max_depth = 2;
    description.render.light_samples = SamplesDescription {
        pattern: Some(Pattern::Grid),
        count: 16,
    };
    description
}

/// Cylinders with each material that the oracle supports. The camera is inside one of them.
const CYLINDERS: &str = r#"
image = { width = 96, height = 72 }
camera = { position = [0.3, -6, 3], look_at = [0, 0, 0.7], fov = 40 }
lights = [
    { type = "rectangle", center = [-3, -4, 6], size = [2, 2], normal = [3, 4, -6], tangent = [1, 0, 0], color = [0.8, 0.8, 0.7] },
    { type = "point", position = [4, -2, 3], color = [0.2, 0.3, 0.4] },
]
textures.checks = { type = "checker", even = [0.8, 0.7, 0.6], odd = [0.1, 0.2, 0.3], scale = [8, 5] }
materials.floor = { type = "phong", color = [0.5, 0.5, 0.5] }
materials.checks = { type = "phong", diffuse = { texture = "checks" }, specular = [0.3, 0.3, 0.3], ambient = [0, 0, 0], shininess = 20 }
materials.mirror = { type = "mirror" }
materials.glass = { type = "glass", ior = 1.5 }

[[shapes]]
type = "plane"
material = "floor"
point = [0, 0, 0]
normal = [0, 0, 1]
[[shapes]]
type = "cylinder"
material = "checks"
start = [-1.4, 0, 0]
end = [-1.4, 0.2, 1.5]
radius = 0.6
tangent = [1, -2, 0]
[[shapes]]
type = "cylinder"
material = "mirror"
start = [-0.3, 1, 0.5]
end = [0.9, 0.6, 0.5]
radius = 0.5
[[shapes]]
type = "cylinder"
material = "glass"
start = [1.4, -0.6, 1.2]
end = [1.4, -0.6, 0.001]
radius = 0.5
# Encloses the camera and all other shapes.
[[shapes]]
type = "cylinder"
material = "checks"
start = [0, 0, -20]
end = [0, 0, 20]
radius = 30
"#;

fn supported_scenes() -> impl Iterator<Item = (String, Description)> {
    let cylinders = Description::parse(CYLINDERS, "cylinders").expect("a scene");
    let scenes = scenes::descriptions()
        .into_iter()
        .chain([("cylinders".to_owned(), cylinders)]);
    scenes
        .filter(|(name, _)| !UNSUPPORTED.iter().any(|(unsupported, _)| unsupported == name))
        .map(|(name, description)| (name, reduced(&description)))
}

fn differing_fraction(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let agree = |a: &f64, b: &f64| (a - b).abs() <= TOLERANCE * (1.0 + b.abs());
    let differing_count = a
        .iter()
        .zip(b)
        .filter(|(a, b)| !a.iter().zip(*b).all(|(a, b)| agree(a, b)))
        .count();
    differing_count as f64 / a.len() as f64
}

#[test]
fn images_match_the_oracle() {
    for (name, description) in supported_scenes() {
        let expected = Oracle::new(&description, Flaw::None).picture();
        for mode in both() {
            let picture = means(&render(&scenes::packed(&description), mode));
            let fraction = differing_fraction(&picture, &expected);
            let errors = picture
                .iter()
                .flatten()
                .zip(expected.iter().flatten())
                .map(|(a, b)| (a - b).abs());
            let mean = |p: &[[f64; 3]]| p.iter().flatten().sum::<f64>() / p.len() as f64;
            println!(
                "{name} {mode:?}: {} of {} pixels differ by more than {TOLERANCE}, the largest error is {:.1e}, the mean differs by {:.1e}",
                (fraction * expected.len() as f64).round(),
                expected.len(),
                errors.fold(0.0, f64::max),
                mean(&picture) / mean(&expected) - 1.0
            );
            assert!(
                fraction <= max_edge_fraction(&name),
                "{name}, {mode:?}: a fraction of {fraction} of the pixels differs"
            );
            let mean_error = (mean(&picture) / mean(&expected) - 1.0).abs();
            assert!(
                mean_error < 0.2 * max_edge_fraction(&name),
                "{name}, {mode:?}: the mean differs by {mean_error}"
            );
        }
    }
}

/// At least one scene detects each flaw; every scene detects the flaws that affect all scenes. A part of the pixels is
/// enough for that.
#[test]
fn flaws_of_the_oracle_are_detected() {
    const STEP: usize = 5;
    let mode = *both().last().expect("the CPU at least");
    let mut found = Vec::new();
    for (name, description) in supported_scenes() {
        let picture = means(&render(&scenes::packed(&description), mode));
        let pixels: Vec<[f64; 3]> = picture.into_iter().step_by(STEP).collect();
        for flaw in [
            Flaw::MissingCosine,
            Flaw::SwappedAxes,
            Flaw::ShiftedPixel,
            Flaw::CornerSamples,
            Flaw::NoShadows,
            Flaw::Exponent,
            Flaw::InvertedIndex,
            Flaw::TransposedTexture,
            Flaw::FlatShading,
            Flaw::StretchedNormals,
        ] {
            let affects_all_scenes = matches!(flaw, Flaw::MissingCosine | Flaw::ShiftedPixel | Flaw::CornerSamples);
            if !affects_all_scenes && found.contains(&flaw) {
                continue;
            }
            let fraction = differing_fraction(&pixels, &Oracle::new(&description, flaw).pixels(STEP));
            if fraction > 10.0 * MAX_EDGE_FRACTION {
                found.push(flaw);
            }
            assert!(
                !affects_all_scenes || fraction > 10.0 * MAX_EDGE_FRACTION,
                "{name}: {flaw:?} changes only a fraction of {fraction} of the pixels"
            );
        }
    }
    for flaw in [
        Flaw::SwappedAxes,
        Flaw::NoShadows,
        Flaw::Exponent,
        Flaw::InvertedIndex,
        Flaw::TransposedTexture,
        Flaw::FlatShading,
        Flaw::StretchedNormals,
    ] {
        assert!(found.contains(&flaw), "no scene detects {flaw:?}");
    }
}

fn same_first_hit(hit: &FirstHit, intersection: &Option<Intersection>) -> bool {
    let Some(intersection) = intersection else {
        return hit.shape == NO_INDEX && hit.depth == 0.0;
    };
    let is_close = |a: f64, b: f64| (a - b).abs() <= 2e-5 * (1.0 + b.abs());
    let (normal, uv): (DVec3, DVec2) = (hit.normal.as_dvec3(), hit.uv.as_dvec2());
    // The angle u wraps around from 1 to 0, and is undefined at the poles.
    let is_close_modulo_1 = |a: f64, b: f64| is_close(a, b) || is_close((a - b).abs(), 1.0);
    let is_pole = (intersection.uv.y - 0.5).abs() > 0.49;
    hit.shape as usize == intersection.object
        && is_close(f64::from(hit.depth), intersection.t)
        && (normal - intersection.normal).length() < 1e-4
        && (hit.shading_normal.as_dvec3() - intersection.shading_normal).length() < 1e-4
        && (is_pole || is_close_modulo_1(uv.x, intersection.uv.x))
        && is_close(uv.y, intersection.uv.y)
}

#[test]
fn first_hits_match_the_oracle() {
    for (name, description) in supported_scenes() {
        let expected = Oracle::new(&description, Flaw::None).intersections();
        let shifted = Oracle::new(&description, Flaw::ShiftedPixel).intersections();
        for mode in both() {
            let hits = first_hits(&scenes::packed(&description), mode);
            let differing_fraction = |expected: &[Option<Intersection>]| {
                assert_eq!(hits.len(), expected.len());
                let differing_count = hits
                    .iter()
                    .zip(expected)
                    .filter(|(hit, intersection)| !same_first_hit(hit, intersection))
                    .count();
                differing_count as f64 / hits.len() as f64
            };
            let fraction = differing_fraction(&expected);
            println!("{name} {mode:?}: the first hits of a fraction {fraction} of the pixels differ");
            assert!(
                fraction <= MAX_EDGE_FRACTION,
                "{name}, {mode:?}: the first hits of a fraction {fraction} of the pixels differ"
            );
            assert!(
                differing_fraction(&shifted) > 0.1,
                "{name}: an image shifted by one pixel is not detected"
            );
        }
    }
}
