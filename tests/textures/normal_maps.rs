//! Normal maps: directions of the mapped normals.

use glam::Vec3;
use wgray_trace::cpu::differential::HitDifferential;
use wgray_trace::cpu::geometry::{fetch_hit_primitive, material_of, surface_of};
use wgray_trace::cpu::path::usable_normal;
use wgray_trace::cpu::phong::phong_lobes;
use wgray_trace::cpu::ray::{Hit, Ray, no_hit};
use wgray_trace::cpu::surface::surface_at;
use wgray_trace::cpu::texture::evaluate_material;
use wgray_trace::records::Packed;

use super::{scene, write_exr};
use crate::random::Random;

/// Returns a scene of three shapes with a normal map that contains `normal` everywhere.
fn shapes(normal: Vec3, keys: &str, strength: f32) -> Packed {
    let folder = tempfile::tempdir().unwrap();
    let texel = normal * 0.5 + 0.5;
    write_exr(&folder.path().join("n.exr"), 2, 2, |_, _| texel.to_array());
    let text = format!(
        "image = {{ width = 4, height = 4 }}
        camera = {{ position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }}
        [textures.n]
        type = 'image'
        file = 'n.exr'
        {keys}
        [materials.m]
        type = 'phong'
        color = [1, 1, 1]
        normal_map = {{ texture = 'n', strength = {strength} }}
        [[shapes]]
        type = 'rectangle'
        material = 'm'
        center = [0, 0, 0]
        size = [2, 3]
        normal = [0, 0, 1]
        tangent = [1, 0, 0]
        [[shapes]]
        type = 'sphere'
        material = 'm'
        center = [9, 0, 0]
        radius = 1
        [[shapes]]
        type = 'plane'
        material = 'm'
        point = [0, 0, -5]
        normal = [0, 0, 1]
        tangent = [0, 1, 0]"
    );
    scene(&text, folder.path())
}

/// Returns the mapped normal at `target`, seen from `origin`.
fn normal(scene: &Packed, primitive: usize, origin: Vec3, target: Vec3) -> Vec3 {
    let ray = Ray {
        origin,
        direction: (target - origin).normalize(),
    };
    let hit = Hit {
        t: (target - origin).length(),
        primitive: primitive as u32,
        ..no_hit()
    };
    let prim = fetch_hit_primitive(scene, hit);
    let surface = surface_of(scene, &prim, hit, ray);
    let material = material_of(scene, &prim);
    evaluate_material(scene, &prim, hit, material, surface, HitDifferential::default(), 1).normal
}

fn is_near(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1e-5
}

#[test]
fn red_and_green_tilt_along_the_tangent_and_the_bitangent() {
    let n = Vec3::new(0.6, 0.0, 0.8);
    let scene = shapes(n, "", 1.0);
    let (above, below) = (Vec3::new(0.3, 0.2, 3.0), Vec3::new(0.3, 0.2, -3.0));
    assert!(is_near(normal(&scene, 0, above, Vec3::ZERO), n));
    // From behind, the mapped normal is flipped.
    assert!(is_near(normal(&scene, 0, below, Vec3::ZERO), -n));
    // The tangent of the plane is +y.
    assert!(is_near(
        normal(&scene, 2, above, Vec3::new(0.0, 0.0, -5.0)),
        Vec3::new(0.0, 0.6, 0.8)
    ));
    // On the sphere, u increases to the east and v to the north.
    let equator = Vec3::new(9.0, -1.0, 0.0);
    assert!(is_near(
        normal(&scene, 1, Vec3::new(9.0, -5.0, 0.0), equator),
        Vec3::new(0.6, -0.8, 0.0)
    ));
    let north = shapes(Vec3::new(0.0, 0.6, 0.8), "", 1.0);
    assert!(is_near(
        normal(&north, 1, Vec3::new(9.0, -5.0, 0.0), equator),
        Vec3::new(0.0, -0.8, 0.6)
    ));
    assert!(is_near(normal(&north, 0, above, Vec3::ZERO), Vec3::new(0.0, 0.6, 0.8)));
}

#[test]
fn texture_rotations_rotate_the_normals() {
    let n = Vec3::new(0.6, 0.0, 0.8);
    let origin = Vec3::new(0.3, 0.2, 3.0);
    // Rotated by 90 degrees, u of the texture is along -v of the surface, regardless of the scale.
    let rotated = normal(
        &shapes(n, "rotate = 90\nscale = [3, 0.5]", 1.0),
        2,
        origin,
        Vec3::new(0.0, 0.0, -5.0),
    );
    assert!(is_near(rotated, Vec3::new(0.6, 0.0, 0.8)), "{rotated}"); // the bitangent of the plane is -x
    let mirrored = normal(&shapes(n, "scale = [-1, 1]", 1.0), 0, origin, Vec3::ZERO);
    assert!(is_near(mirrored, Vec3::new(-0.6, 0.0, 0.8)), "{mirrored}");
}

#[test]
fn strength_scales_the_slope() {
    let origin = Vec3::new(0.3, 0.2, 3.0);
    let flat = normal(&shapes(Vec3::new(0.6, 0.0, 0.8), "", 0.0), 0, origin, Vec3::ZERO);
    assert!(is_near(flat, Vec3::Z));
    let steep = normal(&shapes(Vec3::new(0.6, 0.0, 0.8), "", 2.0), 0, origin, Vec3::ZERO);
    assert!(is_near(steep, Vec3::new(1.2, 0.0, 0.8).normalize()));
}

#[test]
fn a_flat_normal_map_does_not_change_normals() {
    let scene = shapes(Vec3::Z, "", 1.0);
    let numbers = Random::new(8);
    for _ in 0..200 {
        let random_unit_vector = || Vec3::from_array([0; 3].map(|_| numbers.between(-1.0, 1.0) as f32)).normalize();
        let target = Vec3::new(9.0, 0.0, 0.0) + random_unit_vector();
        let origin = target + (target - Vec3::new(9.0, 0.0, 0.0)) * 3.0 + random_unit_vector();
        let q = &scene.primitives[1];
        let ray = Ray {
            origin,
            direction: (target - origin).normalize(),
        };
        let unmapped_normal = surface_at(q, 0, ray, (target - origin).length(), 1e-5).normal;
        assert!(is_near(normal(&scene, 1, origin, target), unmapped_normal));
    }
}

#[test]
fn mirrors_reject_normals_that_reflect_into_the_surface() {
    let scene = shapes(Vec3::new(0.9, 0.0, 0.3).normalize(), "", 1.0);
    let q = &scene.primitives[0];
    let grazing = Ray {
        origin: Vec3::new(5.0, 0.0, 1.0),
        direction: Vec3::new(-5.0, 0.0, -1.0).normalize(),
    };
    let surface = surface_at(q, 0, grazing, 26f32.sqrt(), 1e-5);
    let usable = normal(&scene, 0, grazing.origin, Vec3::ZERO);
    assert_eq!(usable_normal(surface, usable), usable);
    let unusable = Vec3::new(-usable.x, 0.0, usable.z);
    assert_eq!(usable_normal(surface, unusable), surface.normal);
}

/// A shading normal tilted towards a light behind the surface receives no light. Shadow rays cannot detect such a
/// light, because a flat surface does not occlude its own points.
#[test]
fn tilted_shading_normals_receive_no_light_from_behind() {
    let scene = shapes(Vec3::new(0.9, 0.0, 0.3).normalize(), "", 1.0);
    let q = &scene.primitives[0];
    let ray = Ray {
        origin: Vec3::new(0.3, 0.2, 3.0),
        direction: Vec3::NEG_Z,
    };
    let mut surface = surface_at(q, 0, ray, 3.0, 1e-5);
    surface.shading_normal = normal(&scene, 0, ray.origin, Vec3::new(0.3, 0.2, 0.0));
    let material = &scene.materials[q.material as usize];
    let lobes = |height: f32| {
        phong_lobes(
            &surface,
            material,
            Vec3::new(surface.shading_normal.x.signum(), 0.0, height),
            0,
        )
    };
    assert!(surface.shading_normal.x.abs() > 0.5 && lobes(0.1).diffuse > 0.5);
    assert_eq!((lobes(-0.1).diffuse, lobes(-0.1).specular), (0.0, 0.0));
}
