//! Images with closed-form radiance.

use wgray_trace::film::Film;
use wgray_trace::records::Packed;

use crate::pictures::{both, render};
use crate::scenes::parse;

fn films(scene: &Packed) -> Vec<Film> {
    both().into_iter().map(|mode| render(scene, mode)).collect()
}

/// A camera that looks straight down on the ground; 40 x 30 pixels cover 4 x 3 units.
const VIEW_DOWN: &str = r#"
image = { width = 40, height = 30 }
camera = { type = "orthographic", position = [0, 0, 5], look_at = [0, 0, 0], up = [0, 1, 0], height = 3 }
[render]
ambient = [0.1, 0.2, 0.3]
background = [0.5, 0.25, 0.125]
pixel_samples = { count = 1 }
"#;

const GROUND: &str = r#"
[materials.ground]
type = "phong"
ambient = [0.5, 0.5, 1]
diffuse = [0.6, 0.4, 0.2]
specular = [0.25, 0.5, 0.75]
shininess = 6
[[shapes]]
type = "plane"
material = "ground"
point = [7, -3, 0]
normal = [0, 0, 1]
tangent = [1, 1, 0]
"#;

/// A light at height 1.5 above (0.4, -0.3).
const LIGHT: &str = r#"
[[lights]]
type = "point"
position = [0.4, -0.3, 1.5]
color = [1, 0.5, 2]
"#;

/// Returns the maximum error of all pixels. The arguments of `expected` are a pixel center: x to the right, y up.
fn largest_error(film: &Film, expected: impl Fn(f64, f64) -> [f64; 3]) -> f64 {
    let mut largest = 0.0f64;
    for (i, found) in film.means().enumerate() {
        let (column, row) = (i % 40, i / 40);
        let value = expected((column as f64 + 0.5) / 10.0 - 2.0, 1.5 - (row as f64 + 0.5) / 10.0);
        for (found, expected) in found.iter().zip(value) {
            largest = largest.max((f64::from(*found) - expected).abs());
        }
    }
    largest
}

/// Returns the radiance of the plane at (x, y) under the point light, at height h. For a view along the normal, the
/// cosines of the diffuse and the specular term are equal: h / sqrt(h^2 + dx^2 + dy^2).
fn point_light(x: f64, y: f64, power: i32) -> [f64; 3] {
    let (h, dx, dy) = (1.5, x - 0.4, y + 0.3);
    let cosine = h / (h * h + dx * dx + dy * dy).sqrt();
    let term = |color: f64, diffuse: f64, specular: f64| color * (diffuse * cosine + specular * cosine.powi(power));
    let ambient = [0.05, 0.1, 0.3];
    let direct = [term(1.0, 0.6, 0.25), term(0.5, 0.4, 0.5), term(2.0, 0.2, 0.75)];
    [0, 1, 2].map(|i| ambient[i] + direct[i])
}

#[test]
fn a_point_light_over_a_plane_matches_the_closed_form() {
    // Shading is evaluated at the origin of the shadow rays, and the formula has no offset, so the offset is set to 0.
    let down = VIEW_DOWN.replace("[render]", "[render]\nshadow_epsilon = 0");
    let scene = parse(&format!("{down}{GROUND}{LIGHT}"));
    for film in films(&scene) {
        let error = largest_error(&film, |x, y| point_light(x, y, 6));
        assert!(error < 2e-6, "{error}");
        let error_with_wrong_power = largest_error(&film, |x, y| point_light(x, y, 5));
        assert!(error_with_wrong_power > 0.01, "the wrong formula is accepted");
    }
}

#[test]
fn ambient_light_is_multiplied_by_the_ambient_factor() {
    let scene = parse(&format!("{VIEW_DOWN}{GROUND}"));
    for film in films(&scene) {
        let (expected, wrong) = ([0.1f32 * 0.5, 0.2 * 0.5, 0.3 * 1.0], [0.1f32, 0.2, 0.3]);
        assert!(film.means().all(|color| color == expected));
        assert!(
            !film.means().all(|color| color == wrong),
            "the material's factor has no effect"
        );
    }
}

#[test]
fn an_empty_scene_shows_only_the_background() {
    let scene = parse(&format!("{VIEW_DOWN}{LIGHT}"));
    for film in films(&scene) {
        assert!(film.means().all(|color| color == [0.5, 0.25, 0.125]));
    }
}

#[test]
fn the_ground_occludes_light_from_below() {
    let below = LIGHT.replace("1.5]", "-1.5]");
    let [lit, unlit] = [LIGHT, &below].map(|light| films(&parse(&format!("{VIEW_DOWN}{GROUND}{light}"))));
    for (lit, unlit) in lit.iter().zip(&unlit) {
        assert!(
            unlit.means().all(|color| color == [0.1 * 0.5, 0.2 * 0.5, 0.3]),
            "light from below the ground is visible"
        );
        assert!(lit.means().all(|color| color[0] > 0.1));
    }
}

/// A sphere of radius 0.5 casts a shadow of radius 0.5. The camera is below the sphere, which would otherwise hide the
/// shadow; rays start in the image plane, at height 0.25.
#[test]
fn a_sphere_under_directional_light_casts_a_disk_shaped_shadow() {
    let scene = VIEW_DOWN.replace("position = [0, 0, 5]", "position = [0, 0, 0.25]");
    let sphere = "[[shapes]]\ntype = 'sphere'\nmaterial = 'ground'\ncenter = [0.2, 0.1, 1]\nradius = 0.5\n";
    let light = "[[lights]]\ntype = 'directional'\ndirection = [0, 0, -2]\ncolor = [1, 1, 1]\n";
    let disk = |radius: f64| {
        move |x: f64, y: f64| {
            let lit = (x - 0.2).hypot(y - 0.1) > radius;
            let color = [0.6 + 0.25, 0.4 + 0.5, 0.2 + 0.75];
            [0, 1, 2].map(|i| [0.05, 0.1, 0.3][i] + if lit { color[i] } else { 0.0 })
        }
    };
    for film in films(&parse(&format!("{scene}{GROUND}{sphere}{light}"))) {
        let error = largest_error(&film, disk(0.5));
        assert!(error < 1e-6, "{error}");
        assert!(largest_error(&film, disk(0.6)) > 0.5, "a larger disk is accepted");
    }
}

/// Returns a large shape of each kind, at the given heights. `all_dark_or_lit` adds a small shape above the large
/// shapes, because the renderer culls a shadow caster if all other shapes are on one side of the caster.
fn covers(heights: [f64; 4]) -> [String; 4] {
    let [a, b, c, d] = heights;
    [
        format!("type = 'rectangle'\ncenter = [0, 0, {a}]\nsize = [9, 9]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]"),
        format!("type = 'triangle'\nvertices = [[-9, -9, {b}], [9, -9, {b}], [0, 18, {b}]]"),
        format!("type = 'ellipsoid'\ncenter = [0, 0, {c}]\na = [9, 0, 0]\nb = [0, 9, 0]\nc = [0, 0, 0.02]"),
        format!("type = 'plane'\npoint = [0, 0, {d}]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]"),
    ]
    .map(|text| format!("[[shapes]]\nmaterial = 'ground'\n{text}\n"))
}

/// Returns whether all pixels below the covers are dark, and whether all are lit.
fn all_dark_or_lit(light: &str, covers: &str) -> (bool, bool) {
    let scene = VIEW_DOWN.replace("position = [0, 0, 5]", "position = [0, 0, 0.25]");
    let above = "[[shapes]]\ntype = 'sphere'\nmaterial = 'ground'\ncenter = [90, 90, 5]\nradius = 0.5\n";
    let films = films(&parse(&format!("{scene}{GROUND}{light}{above}{covers}")));
    let ambient = [0.1f32 * 0.5, 0.2 * 0.5, 0.3];
    let all_pixels_are = |dark: bool| {
        films
            .iter()
            .all(|film| film.means().all(|color| (color == ambient) == dark))
    };
    (all_pixels_are(true), all_pixels_are(false))
}

const DARK: (bool, bool) = (true, false);
const LIT: (bool, bool) = (false, true);

/// Each primitive occludes alone, and together with a primitive of another kind.
#[test]
fn primitives_occlude_alone_and_in_pairs() {
    let light = "[[lights]]\ntype = 'directional'\ndirection = [0, 0, -2]\ncolor = [1, 1, 1]\n";
    let kinds = covers([1.0, 1.5, 2.0, 3.0]);
    for (i, first) in kinds.iter().enumerate() {
        assert_eq!(all_dark_or_lit(light, first), DARK, "{first}");
        for second in &kinds[i + 1..] {
            assert_eq!(
                all_dark_or_lit(light, &format!("{first}{second}")),
                DARK,
                "{first}{second}"
            );
        }
    }
    assert_eq!(all_dark_or_lit(light, ""), LIT, "the light is occluded without covers");
}

/// A shape just in front of a light occludes the light; a shape behind the light does not.
#[test]
fn shapes_behind_a_light_do_not_occlude_it() {
    for (in_front, behind) in covers([1.45; 4]).iter().zip(&covers([1.55; 4])) {
        assert_eq!(all_dark_or_lit(LIGHT, in_front), DARK, "{in_front}");
        assert_eq!(all_dark_or_lit(LIGHT, behind), LIT, "{behind}");
    }
}
