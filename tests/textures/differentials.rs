//! Ray differentials against finite differences in f64.

use std::path::Path as File;

use glam::{DMat3, DVec2, DVec3, UVec2, Vec2, Vec3};
use wgray_trace::cpu::camera::{camera_differential, camera_ray};
use wgray_trace::cpu::differential::{HitDifferential, reflected_derivative};
use wgray_trace::cpu::footprint::surface_footprint;
use wgray_trace::cpu::geometry::{
    closest_hit, fetch_hit_primitive, footprint_of, hit_differential, material_of, surface_of,
};
use wgray_trace::cpu::integrators::phong::scatter;
use wgray_trace::cpu::path::Path;
use wgray_trace::cpu::path::is_specular;
use wgray_trace::cpu::surface::{Surface, with_coordinates};
use wgray_trace::records::{NO_INDEX, NO_PRIMITIVE, Packed, Primitive};

use super::scene;
use crate::meshes::procedural::Sheet;

const PERSPECTIVE: &str = "camera = { position = [0.3, -4, 1.6], look_at = [0, 0, 0.6], fov = 40 }";
const ORTHOGRAPHIC: &str =
    "camera = { type = 'orthographic', position = [0.3, -4, 1.6], look_at = [0, 0, 0.6], height = 3 }";

fn ellipsoid_over_plane(camera: &str, ellipsoid: &str) -> Packed {
    let text = format!(
        "image = {{ width = 64, height = 48 }}
        {camera}
        [textures.t]
        type = 'checker'
        even = [0, 0, 0]
        odd = [1, 1, 1]
        [materials.floor]
        type = 'phong'
        color = {{ texture = 't' }}
        [materials.mirror]
        type = 'mirror'
        [materials.glass]
        type = 'glass'
        ior = 1.5
        [[shapes]]
        type = 'plane'
        material = 'floor'
        point = [0, 0, 0]
        normal = [0, 0, 1]
        tangent = [1, 0, 0]
        {ellipsoid}"
    );
    scene(&text, File::new("."))
}

fn ellipsoid(material: &str) -> String {
    format!(
        "[[shapes]]
        type = 'ellipsoid'
        material = '{material}'
        center = [0.1, 0.2, 0.8]
        a = [0.9, 0.2, 0]
        b = [-0.1, 0.6, 0.1]
        c = [0, 0.1, 0.7]"
    )
}

/// The scene of [`ellipsoid_over_plane`] in f64.
struct Exact<'a> {
    scene: &'a Packed,
    /// `None` without an ellipsoid, true for a glass ellipsoid, false for a mirror.
    ellipsoid: Option<bool>,
}

/// Traces rays that end at the plane, after specular bounces at the ellipsoid.
impl Exact<'_> {
    fn center_and_inverse() -> (DVec3, DMat3) {
        let (a, b, c) = (
            DVec3::new(0.9, 0.2, 0.0),
            DVec3::new(-0.1, 0.6, 0.1),
            DVec3::new(0.0, 0.1, 0.7),
        );
        (DVec3::new(0.1, 0.2, 0.8), DMat3::from_cols(a, b, c).inverse())
    }

    fn camera(&self, pixel: DVec2) -> (DVec3, DVec3) {
        let camera = &self.scene.camera;
        let [right, up, forward] = [camera.right, camera.up, camera.forward].map(Vec3::as_dvec3);
        let (x, y) = (
            pixel.x * 2.0 / f64::from(camera.width) - 1.0,
            1.0 - pixel.y * 2.0 / f64::from(camera.height),
        );
        let offset = right * x + up * y;
        if camera.projection == wgray_trace::records::ORTHOGRAPHIC {
            return (camera.position.as_dvec3() + offset, forward);
        }
        (camera.position.as_dvec3(), (forward + offset).normalize())
    }

    fn ellipsoid(o: DVec3, d: DVec3) -> Option<f64> {
        let (center, m) = Self::center_and_inverse();
        let (o, d) = (m * (o - center), m * d);
        let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
        let root = (b * b - a * c).sqrt();
        [(-b - root) / a, (-b + root) / a].into_iter().find(|t| *t > 1e-4)
    }

    fn end(&self, pixel: DVec2) -> DVec3 {
        let (mut o, mut d) = self.camera(pixel);
        for _ in 0..8 {
            let plane = -o.z / d.z;
            let hit = self.ellipsoid.and_then(|glass| Some((glass, Self::ellipsoid(o, d)?)));
            let Some((glass, t)) = hit.filter(|(_, t)| plane <= 0.0 || *t < plane) else {
                return o + d * plane;
            };
            let (center, m) = Self::center_and_inverse();
            o += d * t;
            let outward = (m.transpose() * (m * (o - center))).normalize();
            let n = if outward.dot(d) > 0.0 { -outward } else { outward };
            let eta = if outward.dot(d) > 0.0 { 1.5 } else { 1.0 / 1.5 };
            let cosine = -d.dot(n);
            let square = 1.0 - eta * eta * (1.0 - cosine * cosine);
            d = if glass && square > 0.0 {
                d * eta + n * (eta * cosine - square.sqrt())
            } else {
                d + n * (2.0 * cosine)
            };
        }
        DVec3::NAN
    }
}

/// Returns the first non-specular hit, with its differential and depth.
fn first_nonspecular_hit(scene: &Packed, pixel: Vec2) -> Option<(Primitive, Surface, HitDifferential, u32)> {
    let differential = camera_differential(&scene.camera, pixel, 1.0);
    let ray = camera_ray(&scene.camera, pixel);
    let mut path = Path {
        ray,
        differential,
        throughput: Vec3::ONE,
        depth: 0,
        branch: 0,
        origin_prim: NO_PRIMITIVE,
        inside_prim: NO_PRIMITIVE,
    };
    loop {
        let hit = closest_hit(scene, path.ray, path.origin_prim, path.inside_prim);
        if hit.primitive == NO_INDEX {
            return None;
        }
        let prim = fetch_hit_primitive(scene, hit);
        if is_specular(material_of(scene, &prim)) {
            path = scatter(scene, &prim, hit, path, UVec2::ZERO, 0).primary;
            continue;
        }
        let surface = with_coordinates(surface_of(scene, &prim, hit, path.ray), &prim.primitive);
        let hit_diff = hit_differential(scene, &prim, hit, surface, path.ray, path.differential);
        return Some((prim.primitive, surface, hit_diff, path.depth));
    }
}

fn assert_differentials(scene: &Packed, glass: Option<bool>, bounces: u32) {
    let exact = Exact {
        scene,
        ellipsoid: glass,
    };
    let mut compared = 0;
    for y in 0..48 {
        for x in 0..64 {
            let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let Some((_, surface, hit_diff, depth)) = first_nonspecular_hit(scene, pixel) else {
                continue;
            };
            let end = exact.end(pixel.as_dvec2());
            let is_close = (surface.position.as_dvec3() - end).length() < 1e-3 * end.length().max(1.0);
            // Far from the camera, f32 is inaccurate at grazing angles.
            if depth != bounces || !is_close || end.length() > 30.0 {
                continue;
            }
            let h = 1e-3;
            for (step, found) in [(DVec2::X, hit_diff.x), (DVec2::Y, hit_diff.y)] {
                let neighbor = |side: f64| exact.end(pixel.as_dvec2() + step * (h * side));
                let expected = (neighbor(1.0) - neighbor(-1.0)) / (2.0 * h);
                let error = (found.position.as_dvec3() - expected).length();
                // Derivatives change within the step near silhouettes.
                let curvature = (neighbor(1.0) + neighbor(-1.0) - end * 2.0).length() / h;
                if curvature < 0.01 * expected.length() {
                    assert!(
                        error < 0.01 * expected.length(),
                        "({x}, {y}): {:?} {expected}",
                        found.position
                    );
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 300, "{compared}");
}

#[test]
fn differentials_on_a_plane_match_adjacent_rays() {
    for camera in [PERSPECTIVE, ORTHOGRAPHIC] {
        assert_differentials(&ellipsoid_over_plane(camera, ""), None, 0);
    }
}

#[test]
fn differentials_after_a_mirror_match_adjacent_rays() {
    for camera in [PERSPECTIVE, ORTHOGRAPHIC] {
        assert_differentials(&ellipsoid_over_plane(camera, &ellipsoid("mirror")), Some(false), 1);
    }
}

#[test]
fn differentials_through_glass_match_adjacent_rays() {
    for camera in [PERSPECTIVE, ORTHOGRAPHIC] {
        assert_differentials(&ellipsoid_over_plane(camera, &ellipsoid("glass")), Some(true), 2);
    }
}

#[test]
fn texture_differentials_on_an_ellipsoid_match_adjacent_rays() {
    let scene = ellipsoid_over_plane(PERSPECTIVE, &ellipsoid("floor"));
    let exact = Exact {
        scene: &scene,
        ellipsoid: None,
    };
    let (center, m) = Exact::center_and_inverse();
    let uv = |pixel: DVec2| {
        let (o, d) = exact.camera(pixel);
        let l = m * (o + d * Exact::ellipsoid(o, d)? - center);
        Some(DVec2::new(
            l.y.atan2(l.x) / std::f64::consts::TAU,
            0.5 + l.z.asin() / std::f64::consts::PI,
        ))
    };
    let mut compared = 0;
    for y in 0..48 {
        for x in 0..64 {
            let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let Some((q, surface, hit_diff, _)) = first_nonspecular_hit(&scene, pixel) else {
                continue;
            };
            if q.kind != wgray_trace::records::ELLIPSOID {
                continue;
            }
            let found = surface_footprint(&q, surface, hit_diff.x.position, hit_diff.y.position);
            let h = 1e-3;
            for (step, found) in [(DVec2::X, found.dx), (DVec2::Y, found.dy)] {
                let pixel = pixel.as_dvec2();
                let (Some(after), Some(before)) = (uv(pixel + step * h), uv(pixel - step * h)) else {
                    continue;
                };
                let expected = (after - before) / (2.0 * h);
                if expected.length() < 0.2 {
                    let error = (found.as_dvec2() - expected).length();
                    assert!(
                        error < 0.01 * expected.length() + 1e-5,
                        "({x}, {y}): {found} {expected}"
                    );
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 500, "{compared}");
}

/// Negative control: without the derivative of the normal, the error is large.
#[test]
fn differentials_at_a_curved_mirror_depend_on_the_curvature() {
    let scene = ellipsoid_over_plane(PERSPECTIVE, &ellipsoid("mirror"));
    let exact = Exact {
        scene: &scene,
        ellipsoid: Some(false),
    };
    let pixel = Vec2::new(33.0, 22.0);
    let differential = camera_differential(&scene.camera, pixel, 1.0);
    let ray = camera_ray(&scene.camera, pixel);
    let hit = closest_hit(&scene, ray, NO_PRIMITIVE, NO_PRIMITIVE);
    let prim = fetch_hit_primitive(&scene, hit);
    let surface = surface_of(&scene, &prim, hit, ray);
    let hit_diff = hit_differential(&scene, &prim, hit, surface, ray, differential);
    let reflected = |pixel: DVec2| {
        let (o, d) = exact.camera(pixel);
        let (center, m) = Exact::center_and_inverse();
        let p = o + d * Exact::ellipsoid(o, d).unwrap();
        d.reflect((m.transpose() * (m * (p - center))).normalize())
    };
    let expected =
        (reflected(pixel.as_dvec2() + DVec2::X * 1e-3) - reflected(pixel.as_dvec2() - DVec2::X * 1e-3)) / 2e-3;
    let error = |dn: Vec3| {
        let found = reflected_derivative(hit_diff.x, ray.direction, surface.normal, dn)
            .direction
            .as_dvec3();
        (found - expected).length() / expected.length()
    };
    assert!(error(hit_diff.normal_x) < 1e-3, "{}", error(hit_diff.normal_x));
    assert!(error(Vec3::ZERO) > 0.3, "{}", error(Vec3::ZERO));
}

fn torus(sheet: &Sheet, camera: &str, matrix: DMat3) -> Packed {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("torus.obj"), sheet.obj()).unwrap();
    let rows = matrix.transpose();
    let row = |row: DVec3| format!("[{}, {}, {}, 0.1]", row.x, row.y, row.z);
    let text = format!(
        "image = {{ width = 64, height = 48 }}
        {camera}
        [textures.t]
        type = 'checker'
        even = [0, 0, 0]
        odd = [1, 1, 1]
        [materials.m]
        type = 'phong'
        color = {{ texture = 't' }}
        [[shapes]]
        type = 'mesh'
        file = 'torus.obj'
        material = 'm'
        matrix = [{}, {}, {}]",
        row(rows.x_axis),
        row(rows.y_axis),
        row(rows.z_axis)
    );
    scene(&text, folder.path())
}

struct Point {
    position: DVec3,
    uv: DVec2,
    normal: DVec3,
}

/// Returns the intersection of a ray with the plane of a triangle.
fn hit_triangle_plane(sheet: &Sheet, matrix: DMat3, triangle: usize, (o, d): (DVec3, DVec3)) -> Point {
    let corners = sheet.triangle_mesh.triangles[triangle].map(|vertex| vertex as usize);
    let [p, q, r] = corners.map(|corner| matrix * sheet.triangle_mesh.points[corner] + 0.1);
    let (e, f) = (q - p, r - p);
    let normal_direction = e.cross(f);
    let position = o + d * ((p - o).dot(normal_direction) / d.dot(normal_direction));
    let offset = position - p;
    let b = offset.cross(f).dot(normal_direction) / normal_direction.length_squared();
    let c = e.cross(offset).dot(normal_direction) / normal_direction.length_squared();
    let weights = [1.0 - b - c, b, c];
    let to_world = matrix.inverse().transpose();
    let [mut uv, mut normal] = [DVec3::ZERO; 2];
    for (corner, weight) in corners.into_iter().zip(weights) {
        let [u, v] = sheet.uvs[corner];
        uv += DVec3::new(u, v, 0.0) * weight;
        normal += (to_world * sheet.normals[corner]).normalize() * weight;
    }
    let normal = normal.normalize();
    Point {
        position,
        uv: uv.truncate(),
        // The interpolated normal is flipped together with the geometric normal, which faces the viewer.
        normal: if d.dot(normal_direction) * matrix.determinant() > 0.0 {
            -normal
        } else {
            normal
        },
    }
}

#[test]
fn differentials_on_a_mesh_match_adjacent_rays() {
    let sheet = Sheet::torus(12, 8);
    let sheared = DMat3::from_cols(
        DVec3::new(0.9, 0.3, 0.2),
        DVec3::new(-0.2, 0.5, 0.5),
        DVec3::new(0.1, -0.6, 0.8),
    );
    let mirrored = DMat3::from_cols(sheared.x_axis, sheared.y_axis, -sheared.z_axis);
    // This camera is inside of the tube.
    let inside = "camera = { position = [1, 0.45, 0.4], look_at = [0.5, 0.75, 0.7], fov = 70 }";
    for (camera, matrix) in [
        (PERSPECTIVE, sheared),
        (PERSPECTIVE, mirrored),
        (ORTHOGRAPHIC, sheared),
        (inside, sheared),
    ] {
        let packed = torus(&sheet, camera, matrix);
        let exact = Exact {
            scene: &packed,
            ellipsoid: None,
        };
        let mut compared = 0;
        for (x, y) in (0..48).flat_map(|y| (0..64).map(move |x| (x, y))) {
            let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let ray = camera_ray(&packed.camera, pixel);
            let hit = closest_hit(&packed, ray, NO_PRIMITIVE, NO_PRIMITIVE);
            if hit.primitive == NO_INDEX {
                continue;
            }
            let prim = fetch_hit_primitive(&packed, hit);
            let surface = surface_of(&packed, &prim, hit, ray);
            if ray.direction.dot(surface.normal).abs() < 0.1 {
                continue;
            }
            let differential = camera_differential(&packed.camera, pixel, 1.0);
            let hit_diff = hit_differential(&packed, &prim, hit, surface, ray, differential);
            let footprint = footprint_of(&prim, hit, surface, hit_diff);
            let point = |pixel: DVec2| {
                let (o, d) = exact.camera(pixel);
                hit_triangle_plane(&sheet, matrix, hit.primitive as usize, (o + packed.origin, d))
            };
            let center = point(pixel.as_dvec2());
            let position = surface.position.as_dvec3() + packed.origin;
            assert!(
                (position - center.position).length() < 1e-4,
                "({x}, {y}): {position} {}",
                center.position
            );
            assert!(
                (surface.shading_normal.as_dvec3() - center.normal).length() < 1e-3,
                "({x}, {y})"
            );
            let h = 1e-3;
            for (step, found, uv, normal) in [
                (DVec2::X, hit_diff.x, footprint.dx, hit_diff.normal_x),
                (DVec2::Y, hit_diff.y, footprint.dy, hit_diff.normal_y),
            ] {
                let (after, before) = (point(pixel.as_dvec2() + step * h), point(pixel.as_dvec2() - step * h));
                let position_derivative = (after.position - before.position) / (2.0 * h);
                let uv_derivative = (after.uv - before.uv) / (2.0 * h);
                let normal_derivative = (after.normal - before.normal) / (2.0 * h);
                for (name, found, expected) in [
                    ("position", found.position.as_dvec3(), position_derivative),
                    ("uv", uv.as_dvec2().extend(0.0), uv_derivative.extend(0.0)),
                    ("normal", normal.as_dvec3(), normal_derivative),
                ] {
                    assert!(
                        (found - expected).length() < 1e-3 * expected.length() && expected.length() > 1e-4,
                        "({x}, {y}): {name}: {found} {expected}"
                    );
                    compared += 1;
                }
            }
        }
        assert!(compared > 3000, "{camera}: {compared}");
    }
}
