//! Compares images of spheres and flat shapes with images of the f64 oracle: shapes must not shadow themselves, and
//! must cast contact shadows. The scenes have sizes from 1e-3 to 1e3, at the origin and far away. Radii are from 1e-3
//! to 1e4 times [`Setting::size`].

use glam::DVec3;
use wgray::scene::Description;
use wgray_trace::cpu::camera::camera_ray;
use wgray_trace::cpu::geometry::closest_hit;
use wgray_trace::cpu::surface::surface_at;
use wgray_trace::records::{NO_INDEX, NO_PRIMITIVE};

use crate::oracle::{Flaw, Oracle};
use crate::pictures::{differing, exact_modes, means, reference, render};
use crate::random::Random;
use crate::scenes::packed;

/// The scale and position of a test scene. Coordinates and radii are in units of `size`.
struct Setting {
    size: f64,
    offset: DVec3,
}

impl Setting {
    fn point(&self, p: [f64; 3]) -> String {
        format!("{:?}", (DVec3::from(p) * self.size + self.offset).to_array())
    }

    fn sphere(&self, material: &str, center: [f64; 3], radius: f64) -> String {
        format!(
            "[[shapes]]\ntype = 'sphere'\nmaterial = '{material}'\ncenter = {}\nradius = {:?}\n",
            self.point(center),
            radius * self.size
        )
    }

    fn scene(&self, position: [f64; 3], look_at: [f64; 3], light: [f64; 3], shapes: &str) -> Description {
        let text = format!(
            "[image]\nwidth = 48\nheight = 36\n\
             [camera]\nposition = {}\nlook_at = {}\nfov = 40\n\
             [render]\nambient = [0.1, 0.1, 0.1]\nbackground = [0.2, 0.3, 0.4]\nmax_depth = 2\n\
             pixel_samples = {{ count = 1 }}\nlight_samples = {{ count = 1 }}\n\
             [materials.dull]\ntype = 'phong'\ncolor = [0.7, 0.6, 0.5]\nspecular = [0, 0, 0]\n\
             [materials.mirror]\ntype = 'mirror'\n[materials.glass]\ntype = 'glass'\nior = 1.4\n\
             [[lights]]\ntype = 'point'\nposition = {}\ncolor = [0.8, 0.8, 0.8]\n{shapes}",
            self.point(position),
            self.point(look_at),
            self.point(light)
        );
        Description::parse(&text, "test").unwrap_or_else(|error| panic!("{error}\n{text}"))
    }
}

fn settings() -> Vec<Setting> {
    let mut all = Vec::new();
    for size in [1e-3, 1.0, 1e3] {
        for offset in [DVec3::ZERO, DVec3::new(1000.3, -999.1, 577.7)] {
            let offset = offset * size;
            all.push(Setting { size, offset });
        }
    }
    all
}

const CAMERA: [f64; 3] = [0.3, -4.0, 1.5];
const LIGHT: [f64; 3] = [2.0, -2.5, 4.0];

fn assert_equal_on_all_backends(description: &Description) {
    let packed = packed(description);
    let cpu = reference(&packed);
    for mode in exact_modes() {
        assert_eq!(differing(&render(&packed, mode), &cpu), 0, "{mode:?}");
    }
}

/// A wrongly occluded light changes a value by 0.1. Rounding of the normal at the limb of a small sphere changes it
/// by less than this tolerance.
const TOLERANCE: f64 = 1e-3;

fn count_wrong_pixels(description: &Description) -> usize {
    let expected = Oracle::new(description, Flaw::None).picture();
    let cpu = reference(&packed(description));
    let is_close = |(a, b): (&f64, &f64)| (a - b).abs() <= TOLERANCE;
    let pixels = means(&cpu).into_iter().zip(&expected);
    pixels.filter(|(a, b)| !a.iter().zip(*b).all(is_close)).count()
}

/// Checks that at most `max_wrong` pixels differ for each radius.
fn check(radii: &[f64], max_wrong: usize, shapes: impl Fn(&Setting, f64) -> String) {
    for setting in settings() {
        for &radius in radii {
            let description = setting.scene(CAMERA, [0.0, 0.0, 0.2], LIGHT, &shapes(&setting, radius));
            let wrong_pixels = count_wrong_pixels(&description);
            if radius == 1e3 && setting.size == 1.0 && setting.offset != DVec3::ZERO {
                assert_equal_on_all_backends(&description);
            }
            let (size, offset) = (setting.size, setting.offset);
            assert!(
                wrong_pixels <= max_wrong,
                "radius {radius}, size {size}, offset {offset}: {wrong_pixels} pixels of 1,728 are wrong"
            );
        }
    }
}

const RADII: &[f64] = &[0.3, 1.0, 100.0, 1e3, 1e4];

#[test]
fn spheres_do_not_shadow_themselves() {
    check(RADII, 1, |s, radius| s.sphere("dull", [0.0, 0.0, -radius], radius));
}

#[test]
fn small_spheres_on_large_spheres_cast_contact_shadows() {
    check(&[100.0, 1e3, 1e4], 4, |s, radius| {
        let on_ground = |x: f64, r: f64| {
            let height = ((radius + r).powi(2) - x * x).sqrt() - radius;
            s.sphere("dull", [x, 0.0, height], r)
        };
        let ground = s.sphere("dull", [0.0, 0.0, -radius], radius);
        ground + &on_ground(-0.6, 0.5) + &on_ground(0.4, 0.2) + &on_ground(0.9, 0.05)
    });
}

/// The camera is near a grain of radius 1e-3. The sphere below the grain is up to ten million times as large.
#[test]
fn a_grain_on_a_huge_sphere_casts_a_contact_shadow() {
    for offset in [DVec3::ZERO, DVec3::splat(1000.7)] {
        let setting = Setting { size: 1.0, offset };
        for radius in [1.0, 1e4] {
            let shapes =
                setting.sphere("dull", [0.0, 0.0, -radius], radius) + &setting.sphere("dull", [0.0, 0.0, 1e-3], 1e-3);
            let description = setting.scene([0.0, -0.006, 0.003], [0.0, 0.0, 0.0005], LIGHT, &shapes);
            let found = count_wrong_pixels(&description);
            assert!(found <= 4, "radius {radius}, offset {offset}: {found} pixels");
        }
    }
}

#[test]
fn mirrors_and_glass_of_all_radii_match_the_oracle() {
    for material in ["mirror", "glass"] {
        check(RADII, 14, |s, radius| {
            let ground = s.sphere(material, [0.0, 0.0, -radius], radius);
            ground + &s.sphere("dull", [0.2, 0.5, 0.6], 0.5)
        });
    }
}

#[test]
fn the_inside_of_a_sphere_is_lit_from_inside_only() {
    for setting in settings() {
        for radius in [1.0, 100.0, 1e4] {
            let at_height = |height: f64| [0.1, 0.0, height - radius];
            let shapes = setting.sphere("dull", [0.0, 0.0, -radius], radius);
            let outside = setting.scene(at_height(radius - 0.3), [0.0, 0.2, 0.0], [0.0, 0.0, 0.5], &shapes);
            let inside = setting.scene(at_height(radius - 0.3), [0.0, 0.2, 0.0], [0.0, 0.0, -0.5], &shapes);
            if radius == 100.0 && setting.size == 1.0 {
                assert_equal_on_all_backends(&outside);
            }
            for description in [outside, inside] {
                let found = count_wrong_pixels(&description);
                assert!(found <= 1, "radius {radius}, size {}: {found} pixels", setting.size);
            }
        }
    }
}

/// Tests a square of two triangles, a box of rectangles on a floor, and a tetrahedron.
#[test]
fn adjacent_faces_do_not_shadow_each_other_at_shared_edges() {
    for setting in settings() {
        let p = |p: [f64; 3]| setting.point(p);
        let triangle = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
            let vertices = [a, b, c].map(p).join(", ");
            format!("[[shapes]]\ntype = 'triangle'\nmaterial = 'dull'\nvertices = [{vertices}]\n")
        };
        // A tilted square of two triangles, and below it a triangle that receives its shadow.
        let tilt = |x: f64, y: f64| [x, y, 0.3 * x + 0.1 * y];
        let corners = [tilt(-3.0, -3.0), tilt(3.0, -3.0), tilt(3.0, 3.0), tilt(-3.0, 3.0)];
        let receiver = triangle([-1.0, -1.0, -3.0], [1.0, -1.0, -3.0], [0.0, 1.0, -3.0]);
        let square = triangle(corners[0], corners[1], corners[2]) + &triangle(corners[0], corners[2], corners[3]);
        let description = setting.scene(
            [0.0, -0.01, 5.0],
            [0.0, 0.0, 0.0],
            [-6.0, 5.5, 2.0],
            &(receiver + &square),
        );
        assert_eq!(
            count_wrong_pixels(&description),
            0,
            "a square of triangles, size {}",
            setting.size
        );
        // A box of rectangles on a floor, and a tetrahedron next to the box.
        let face = |center: [f64; 3], side: f64, normal: [f64; 3], tangent: [f64; 3]| {
            format!(
                "[[shapes]]\ntype = 'rectangle'\nmaterial = 'dull'\ncenter = {}\nsize = [{side:?}, {side:?}]\n\
                 normal = {normal:?}\ntangent = {tangent:?}\n",
                p(center),
                side = side * setting.size
            )
        };
        let (c, s) = (0.8, 0.6);
        let box_faces = face([0.0, 0.0, 1.0], 1.0, [0.0, 0.0, 1.0], [c, s, 0.0])
            + &face([0.5 * c, 0.5 * s, 0.5], 1.0, [c, s, 0.0], [0.0, 0.0, 1.0])
            + &face([-0.5 * s, 0.5 * c, 0.5], 1.0, [-s, c, 0.0], [0.0, 0.0, 1.0])
            + &face([-0.5 * c, -0.5 * s, 0.5], 1.0, [-c, -s, 0.0], [0.0, 0.0, 1.0])
            + &face([0.5 * s, -0.5 * c, 0.5], 1.0, [s, -c, 0.0], [0.0, 0.0, 1.0])
            + &face([0.0, 0.0, 0.0], 9.0, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let corners = [[1.0, -1.5, 0.0], [1.7, -1.3, 0.0], [1.2, -0.8, 0.0], [1.3, -1.2, 0.9]].map(p);
        let solid = format!(
            "[[shapes]]\ntype = 'tetrahedron'\nmaterial = 'dull'\nvertices = [{}]\n",
            corners.join(", ")
        );
        let description = setting.scene(CAMERA, [0.2, 0.0, 0.4], [-3.0, -2.0, 3.0], &(box_faces + &solid));
        let found = count_wrong_pixels(&description);
        assert!(
            found <= 2,
            "a box, size {}, offset {}: {found} pixels",
            setting.size,
            setting.offset
        );
    }
}

/// In f64, `ray_origin` is above the surface for all sizes, by less than 1e-5 of the coordinates.
#[test]
fn ray_origins_are_slightly_above_the_surface() {
    let random = Random::new(5);
    let mut max_height = 0.0f64;
    for setting in settings() {
        for radius in [1e-3, 0.1, 1.0, 1e2, 1e4] {
            let shapes = setting.sphere("dull", [0.0, 0.0, -radius], radius);
            let distance = 3.0 * radius.min(1.0);
            let description = setting.scene([0.0, -distance, 0.4 * distance], [0.0, 0.0, 0.0], LIGHT, &shapes);
            let (scene, size) = (packed(&description), setting.size);
            let center = DVec3::new(0.0, 0.0, -radius) * size + setting.offset - scene.origin;
            for _ in 0..2000 {
                let pixel = glam::Vec2::new((random.unit() * 48.0) as f32, (random.unit() * 36.0) as f32);
                let ray = camera_ray(&scene.camera, pixel);
                let hit = closest_hit(&scene, ray, NO_PRIMITIVE, NO_PRIMITIVE);
                if hit.primitive == NO_INDEX {
                    continue;
                }
                let epsilon = scene.environment.shadow_epsilon;
                let surface = surface_at(&scene.primitives[0], hit.primitive, ray, hit.t, epsilon);
                let height = surface.ray_origin.as_dvec3().distance(center) - radius * size;
                let position = surface.position.as_dvec3();
                let offset = (surface.ray_origin - surface.position).length();
                assert!(height > 0.0, "radius {radius}, size {size}: {height:e} of {offset:e}");
                max_height = max_height.max(height / position.abs().max_element().max(distance * size));
            }
        }
    }
    println!(
        "the maximum height of ray origins above the surface is {max_height:.1e}, relative to the largest coordinate or the distance"
    );
    assert!(max_height < 1e-5, "{max_height}");
}
