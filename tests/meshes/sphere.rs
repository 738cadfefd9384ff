//! A sphere of 80,000 triangles: hits and shadows lie between its circumscribed and inscribed spheres.

use glam::DVec3;
use wgray_trace::cpu::camera::camera_ray;
use wgray_trace::records::Packed;

use super::procedural::{TriangleMesh, scene};
use crate::pictures::{RenderMode, first_hits, reference, render};

const CENTER: DVec3 = DVec3::new(0.0, 0.0, 1.3);
const LIGHT: DVec3 = DVec3::new(0.3, 0.2, -1.0);
const CAMERA_OUTSIDE: &str = "[0.5, -6, 3.5]";

fn pack_above_floor(triangle_mesh: &TriangleMesh, normals: &str, camera: &str) -> Packed {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(
        folder.path().join("sphere.obj"),
        triangle_mesh.obj(Some(&triangle_mesh.points), None),
    )
    .expect("a mesh");
    let text = format!(
        "image = {{ width = 200, height = 150 }}
        camera = {{ position = {camera}, look_at = [0, 0, 0.9], fov = 40 }}
        [render]
        ambient = [0, 0, 0]
        pixel_samples = {{ pattern = 'grid', count = 1 }}
        [materials.m]
        type = 'phong'
        color = [1, 1, 1]
        shininess = 1
        [[lights]]
        type = 'directional'
        direction = [{}, {}, {}]
        color = [1, 1, 1]
        [[shapes]]
        type = 'mesh'
        file = 'sphere.obj'
        normals = '{normals}'
        material = 'm'
        translate = [{}, {}, {}]
        [[shapes]]
        type = 'plane'
        material = 'm'
        point = [0, 0, 0]
        normal = [0, 0, 1]
        tangent = [1, 0, 0]",
        LIGHT.x, LIGHT.y, LIGHT.z, CENTER.x, CENTER.y, CENTER.z
    );
    scene(&text, folder.path())
}

fn entry(origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    let from_center = origin - CENTER;
    let b = from_center.dot(direction);
    let discriminant = b * b - from_center.length_squared() + radius * radius;
    (discriminant >= 0.0)
        .then(|| -b - discriminant.sqrt())
        .filter(|t| *t > 0.0)
}

/// Numbers of pixels. The pixels of `wrong_` fields contradict the bounds.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    wrong_hits: usize,
    wrong_shadows: usize,
    wrong_light: usize,
    hits: usize,
    shadows: usize,
    /// Pixels that are neither certainly in shadow nor certainly lit.
    uncertain: usize,
}

/// Classifies all pixels; `inner_radius` is the radius of the inscribed sphere.
fn classify(triangle_mesh: &TriangleMesh, inner_radius: f64, normals: &str) -> Counts {
    let packed = pack_above_floor(triangle_mesh, normals, CAMERA_OUTSIDE);
    let hits = first_hits(&packed, RenderMode::Cpu);
    let radiances: Vec<[f32; 3]> = reference(&packed).means().collect();
    let to_light = -LIGHT.normalize();
    // Maximum angle between geometric and analytic normals.
    let max_angle = inner_radius.acos();
    let mut counts = Counts::default();
    for (i, (hit, radiance)) in hits.iter().zip(radiances).enumerate() {
        let pixel = glam::Vec2::new((i % 200) as f32, (i / 200) as f32) + 0.5;
        let ray = camera_ray(&packed.camera, pixel);
        let (origin, direction) = (ray.origin.as_dvec3() + packed.origin, ray.direction.as_dvec3());
        let (outer, inner_t) = (entry(origin, direction, 1.0), entry(origin, direction, inner_radius));
        let point = origin + direction * f64::from(hit.depth);
        let is_lit = radiance[0] > 0.0;
        if hit.shape == 0 {
            counts.hits += 1;
            let radial = (point - CENTER).normalize();
            let radius = point.distance(CENTER);
            let is_between = radius > inner_radius - 1e-5 && radius < 1.0 + 1e-5 && outer.is_some();
            // At grazing incidence, rounding moves the hit along the ray.
            let grazing = -radial.dot(direction);
            let has_valid_normals = (hit.shading_normal.as_dvec3() - radial).length() * grazing < 2e-5
                && hit.normal.as_dvec3().angle_between(radial) < 1.01 * max_angle + 1e-4;
            counts.wrong_hits += usize::from(!(is_between && has_valid_normals));
            let cosine = radial.dot(to_light);
            // The terminator of the mesh is the terminator of the sphere.
            counts.wrong_light += usize::from(cosine > 1e-3 && !is_lit || cosine < -1e-5 && is_lit);
        } else {
            counts.wrong_hits += usize::from(inner_t.is_some());
            if hit.shape == 1 && hit.depth < 20.0 {
                let [is_surely_occluded, is_possibly_occluded] =
                    [inner_radius, 1.0].map(|radius| entry(point, to_light, radius).is_some());
                counts.shadows += usize::from(is_surely_occluded);
                counts.uncertain += usize::from(is_possibly_occluded && !is_surely_occluded);
                counts.wrong_shadows += usize::from(is_surely_occluded && is_lit || !is_possibly_occluded && !is_lit);
            }
        }
    }
    counts
}

fn inner_radius(triangle_mesh: &TriangleMesh) -> f64 {
    let height = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| triangle_mesh.points[i as usize]);
        (b - a).cross(c - a).normalize().dot(a)
    };
    triangle_mesh.triangles.iter().map(height).fold(1.0, f64::min)
}

#[test]
fn a_fine_triangle_mesh_approximates_a_sphere() {
    let fine = TriangleMesh::icosphere(6);
    assert_eq!(fine.triangles.len(), 81_920);
    let fine_inner = inner_radius(&fine);
    let result = classify(&fine, fine_inner, "file");
    println!("between the radii {fine_inner} and 1: {result:?}");
    assert!(
        result.hits > 3000 && result.shadows > 1000 && result.uncertain < 100,
        "{result:?}"
    );
    assert_eq!(
        (result.wrong_hits, result.wrong_shadows, result.wrong_light),
        (0, 0, 0),
        "{result:?}"
    );
    // Negative control: a coarse flat-shaded mesh violates the bounds of the fine mesh. With vertex normals, the coarse
    // mesh satisfies the bounds for its own inner radius.
    let coarse = TriangleMesh::icosphere(2);
    let coarse_counts = classify(&coarse, fine_inner, "flat");
    assert!(
        coarse_counts.wrong_hits > 1000 && coarse_counts.wrong_shadows > 10 && coarse_counts.wrong_light > 10,
        "{coarse_counts:?}"
    );
    let smooth_counts = classify(&coarse, inner_radius(&coarse), "file");
    assert_eq!(
        (
            smooth_counts.wrong_hits,
            smooth_counts.wrong_shadows,
            smooth_counts.wrong_light
        ),
        (0, 0, 0),
        "{smooth_counts:?}"
    );
}

/// For a camera inside the mesh, the light is behind every surface.
#[test]
fn no_light_enters_a_closed_mesh() {
    for detail in [1, 2, 4] {
        let triangle_mesh = TriangleMesh::icosphere(detail);
        for camera in ["[0.2, -0.5, 1.6]", "[-0.3, 0.1, 0.8]", "[0, 0.6, 1.2]"] {
            let packed = pack_above_floor(&triangle_mesh, "smooth", camera);
            for mode in [RenderMode::Cpu, RenderMode::Baked] {
                let lit = render(&packed, mode)
                    .means()
                    .filter(|radiance| radiance[0] > 0.0)
                    .count();
                assert_eq!(lit, 0, "{detail} {camera} {mode:?}");
            }
        }
        let outside = pack_above_floor(&triangle_mesh, "smooth", CAMERA_OUTSIDE);
        let lit = reference(&outside).means().filter(|radiance| radiance[0] > 0.0).count();
        assert!(lit > 1000, "{detail}: {lit}");
    }
}
