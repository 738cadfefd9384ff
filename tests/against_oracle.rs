//! Compares images and first hits of all scenes with the oracle (`oracle.rs`).

use glam::{DVec2, DVec3};
use wgray::scene::{Description, Pattern, SamplesDescription};
use wgray_render::records::{FirstHit, NO_INDEX};

use crate::oracle::{Flaw, Meeting, Oracle};
use crate::pictures::{both, first_hits, means, render};
use crate::scenes;

/// Tolerance of a value `v`, relative to `1 + v`. Rounding errors of f32 reach this size after a specular exponent of 50.
const TOLERANCE: f64 = 1e-5;

/// Maximum fraction of differing pixels. At an edge, rounding can move a sample to the other side.
const EDGES: f64 = 0.0005;

/// Scenes with more edges: name, maximum fraction of differing pixels, reason.
const MORE_EDGES: &[(&str, f64, &str)] = &[
    (
        "balls-checker.toml",
        0.003,
        "a checker without filter up to the horizon",
    ),
    (
        "twisted-tube.toml",
        0.003,
        "shadows on meshes end at edges of thousands of triangles, and a mirror shows them again",
    ),
];

fn edges(scene: &str) -> f64 {
    MORE_EDGES
        .iter()
        .find(|(name, ..)| *name == scene)
        .map_or(EDGES, |(_, share, _)| *share)
}

/// Scenes with features that the oracle lacks: name, features.
const BEYOND: &[(&str, &str)] = &[
    ("textures.toml", "images and normal maps"),
    ("ground-grid.toml", "an image"),
    ("cornell-path.toml", "light from surface to surface"),
    ("pillars.toml", "light from surface to surface"),
    ("lens.toml", "the same, and a lens"),
    ("panorama.toml", "the same, and another camera"),
    ("materials.toml", "the same, and all its materials"),
];

fn small(description: &Description) -> Description {
    let mut d = description.clone();
    let scale = f64::from(d.image.width) / 96.0;
    d.image.width = 96;
    d.image.height = (f64::from(d.image.height) / scale) as u32;
    d.render.pixel_samples = SamplesDescription {
        pattern: Some(Pattern::Grid),
        count: 4,
    };
    // The oracle point-samples textures and follows both branches at glass, as the renderer does up to depth 2.
    d.render.ray_differentials = false;
    d.render.max_depth = 2;
    d.render.light_samples = SamplesDescription {
        pattern: Some(Pattern::Grid),
        count: 16,
    };
    d
}

/// Cylinders with each material of the oracle, one in a mirror, seen from outside and inside.
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
# Around the camera and all else.
[[shapes]]
type = "cylinder"
material = "checks"
start = [0, 0, -20]
end = [0, 0, 20]
radius = 30
"#;

fn known() -> impl Iterator<Item = (String, Description)> {
    let cylinders = Description::parse(CYLINDERS, "cylinders").expect("a scene");
    let scenes = scenes::descriptions()
        .into_iter()
        .chain([("cylinders".to_owned(), cylinders)]);
    scenes
        .filter(|(name, _)| !BEYOND.iter().any(|(beyond, _)| beyond == name))
        .map(|(name, d)| (name, small(&d)))
}

fn differing(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let agree = |a: &f64, b: &f64| (a - b).abs() <= TOLERANCE * (1.0 + b.abs());
    let differ = a
        .iter()
        .zip(b)
        .filter(|(a, b)| !a.iter().zip(*b).all(|(a, b)| agree(a, b)))
        .count();
    differ as f64 / a.len() as f64
}

#[test]
fn images_match_the_oracle() {
    for (name, description) in known() {
        let truth = Oracle::new(&description, Flaw::None).picture();
        for way in both() {
            let picture = means(&render(&scenes::packed(&description), way));
            let share = differing(&picture, &truth);
            let worst = picture
                .iter()
                .flatten()
                .zip(truth.iter().flatten())
                .map(|(a, b)| (a - b).abs());
            let mean = |p: &[[f64; 3]]| p.iter().flatten().sum::<f64>() / p.len() as f64;
            println!(
                "{name} {way:?}: {} of {} pixels differ by more than {TOLERANCE}, worst {:.1e}, mean by {:.1e}",
                (share * truth.len() as f64).round(),
                truth.len(),
                worst.fold(0.0, f64::max),
                mean(&picture) / mean(&truth) - 1.0
            );
            assert!(share <= edges(&name), "{name}, {way:?}: {share} of the pixels differ");
            let drift = (mean(&picture) / mean(&truth) - 1.0).abs();
            assert!(
                drift < 0.2 * edges(&name),
                "{name}, {way:?}: the mean differs by {drift}"
            );
        }
    }
}

/// Every flaw is detected in some scene; a flaw that affects all scenes is detected in each of them.
#[test]
fn a_flawed_oracle_is_found() {
    let way = *both().last().expect("the CPU at least");
    let mut found = Vec::new();
    for (name, description) in known() {
        let picture = means(&render(&scenes::packed(&description), way));
        for flaw in [
            Flaw::MissingCosine,
            Flaw::SwappedAxes,
            Flaw::ShiftedPixel,
            Flaw::CornerSamples,
            Flaw::NoShadows,
            Flaw::Exponent,
            Flaw::InvertedIndex,
            Flaw::TransposedTexture,
            Flaw::Facets,
            Flaw::StretchedNormals,
        ] {
            let everywhere = matches!(flaw, Flaw::MissingCosine | Flaw::ShiftedPixel | Flaw::CornerSamples);
            if !everywhere && found.contains(&flaw) {
                continue;
            }
            let share = differing(&picture, &Oracle::new(&description, flaw).picture());
            if share > 10.0 * EDGES {
                found.push(flaw);
            }
            assert!(
                !everywhere || share > 10.0 * EDGES,
                "{name}: {flaw:?} differs in {share} of the pixels only"
            );
        }
    }
    for flaw in [
        Flaw::SwappedAxes,
        Flaw::NoShadows,
        Flaw::Exponent,
        Flaw::InvertedIndex,
        Flaw::TransposedTexture,
        Flaw::Facets,
        Flaw::StretchedNormals,
    ] {
        assert!(found.contains(&flaw), "{flaw:?} is found in no scene");
    }
}

fn same_first_hit(hit: &FirstHit, meeting: &Option<Meeting>) -> bool {
    let Some(meeting) = meeting else {
        return hit.shape == NO_INDEX && hit.depth == 0.0;
    };
    let close = |a: f64, b: f64| (a - b).abs() <= 2e-5 * (1.0 + b.abs());
    let (normal, uv): (DVec3, DVec2) = (hit.normal.as_dvec3(), hit.uv.as_dvec2());
    // The angle u wraps around from 1 to 0, and is undefined at the poles.
    let around = |a: f64, b: f64| close(a, b) || close((a - b).abs(), 1.0);
    let pole = (meeting.uv.y - 0.5).abs() > 0.49;
    hit.shape as usize == meeting.shape
        && close(f64::from(hit.depth), meeting.t)
        && (normal - meeting.normal).length() < 1e-4
        && (hit.shading_normal.as_dvec3() - meeting.shading).length() < 1e-4
        && (pole || around(uv.x, meeting.uv.x))
        && close(uv.y, meeting.uv.y)
}

#[test]
fn first_hits_match_the_oracle() {
    for (name, description) in known() {
        let truth = Oracle::new(&description, Flaw::None).meetings();
        let shifted = Oracle::new(&description, Flaw::ShiftedPixel).meetings();
        for way in both() {
            let hits = first_hits(&scenes::packed(&description), way);
            let differing = |truth: &[Option<Meeting>]| {
                assert_eq!(hits.len(), truth.len());
                let differ = hits
                    .iter()
                    .zip(truth)
                    .filter(|(hit, meeting)| !same_first_hit(hit, meeting))
                    .count();
                differ as f64 / hits.len() as f64
            };
            let share = differing(&truth);
            println!("{name} {way:?}: the first hits of {share} of the pixels differ");
            assert!(
                share <= EDGES,
                "{name}, {way:?}: the first hits of {share} of the pixels differ"
            );
            assert!(differing(&shifted) > 0.1, "{name}: a shifted pixel is not found");
        }
    }
}
