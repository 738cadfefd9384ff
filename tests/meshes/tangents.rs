//! Tangents of smooth meshes for normal maps match the surface and are continuous across edges.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DMat3, DVec3, Vec2, Vec3};
use wgray_trace::cpu::differential::HitDifferential;
use wgray_trace::cpu::geometry::{fetch_hit_primitive, material_of, surface_of};
use wgray_trace::cpu::mesh::{HitPrimitive, face_frame, face_tangents, face_uv};
use wgray_trace::cpu::normal_map::mapped_normal;
use wgray_trace::cpu::primitive::Tangents;
use wgray_trace::cpu::ray::{Hit, Ray};
use wgray_trace::cpu::texture::evaluate_material;
use wgray_trace::records::{NO_INDEX, Packed};

use super::procedural::{SCENE_START, Sheet, scene};
use crate::pictures::reference;
use crate::textures::write_exr;

/// The tangent-space normal of the normal map.
const MAP_NORMAL: Vec3 = Vec3::new(0.6, 0.0, 0.8);

/// Returns a mesh with a constant, tilted normal map.
fn pack_tilted(obj: &str, texture: &str, shape: &str) -> Packed {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mesh.obj"), obj).unwrap();
    write_exr(&folder.path().join("lean.exr"), 2, 2, |_, _| {
        (MAP_NORMAL * 0.5 + 0.5).to_array()
    });
    let head = SCENE_START.replace("width = 48, height = 36", "width = 192, height = 144");
    let head = head.replace("fov = 40", "fov = 8");
    let text = format!(
        "{head}
        [textures.lean]
        type = 'image'
        file = 'lean.exr'
        {texture}
        [materials.leaning]
        type = 'phong'
        ambient = [0, 0, 0]
        diffuse = [1, 1, 1]
        specular = [0, 0, 0]
        normal_map = {{ texture = 'lean' }}
        [[shapes]]
        type = 'mesh'
        file = 'mesh.obj'
        material = 'leaning'
        {shape}"
    );
    scene(&text, folder.path())
}

fn hit(packed: &Packed, slot: usize, barycentric: Vec2) -> Hit {
    Hit {
        t: 1.0,
        instance: 1,
        primitive: packed.bvh.meshes[0].triangles[slot].w,
        slot: slot as u32,
        barycentric,
    }
}

/// Barycentric coordinates at corners, on edges and inside.
const BARYCENTRICS: [Vec2; 7] = [
    Vec2::new(0.0, 0.0),
    Vec2::new(1.0, 0.0),
    Vec2::new(0.0, 1.0),
    Vec2::new(0.5, 0.5),
    Vec2::new(0.3, 0.3),
    Vec2::new(0.1, 0.6),
    Vec2::new(0.0, 0.4),
];

/// Returns the maximum errors in degrees: with interpolated tangents, and with tangents per triangle.
fn errors(packed: &Packed, surface: impl Fn(f64, f64) -> Option<[DVec3; 2]>) -> [f64; 2] {
    let instance = &packed.bvh.instances[0];
    let to_world = DMat3::from_cols(instance.u.as_dvec3(), instance.v.as_dvec3(), instance.w.as_dvec3());
    let mut max_errors = [0.0; 2];
    for slot in 0..packed.bvh.meshes[0].triangles.len() {
        for b in BARYCENTRICS {
            let prim = fetch_hit_primitive(packed, hit(packed, slot, b));
            let uv = face_uv(&prim, b);
            let Some(exact) = surface(f64::from(uv.x), f64::from(uv.y)) else {
                continue;
            };
            for (max_error, found) in max_errors.iter_mut().zip([face_frame(&prim, b), face_tangents(&prim)]) {
                for (found, exact) in [found.u, found.v].into_iter().zip(exact) {
                    let angle = found.as_dvec3().angle_between(to_world * exact).to_degrees();
                    *max_error = f64::max(*max_error, angle);
                }
            }
        }
    }
    max_errors
}

fn derivatives(surface: impl Fn(f64, f64) -> DVec3, u: f64, v: f64) -> [DVec3; 2] {
    let h = 1e-5;
    [
        (surface(u + h, v) - surface(u - h, v)) / (2.0 * h),
        (surface(u, v + h) - surface(u, v - h)) / (2.0 * h),
    ]
}

#[test]
fn tangents_match_the_surface() {
    let sphere = |u: f64, v: f64| {
        let (angle, height) = (TAU * u, TAU / 2.0 * (v - 0.5));
        DVec3::new(height.cos() * angle.cos(), height.cos() * angle.sin(), height.sin())
    };
    let torus = |u: f64, v: f64| {
        let ((sin, cos), (up, out)) = ((TAU * u).sin_cos(), (TAU * v).sin_cos());
        DVec3::new((1.0 + 0.4 * out) * cos, (1.0 + 0.4 * out) * sin, 0.4 * up)
    };
    // Tangents of an instance are derivatives of the transformed surface.
    for (shape, max_error) in [
        ("", 1.5),
        ("matrix = [[1, 0.3, 0, 5], [-0.2, 2, 0.4, 0], [0, 0.5, -0.7, 3]]", 3.0),
        ("scale = 1e-5", 1.5),
    ] {
        let packed = pack_tilted(&Sheet::sphere(32, 16).obj(), "", shape);
        // The derivative with respect to u vanishes at the poles.
        let found = errors(&packed, |u, v| {
            (0.12..0.88).contains(&v).then(|| derivatives(sphere, u, v))
        });
        println!("sphere, {shape}: {found:?}");
        assert!(found[0] < max_error && found[1] > 10.0, "{shape}: {found:?}");
        let packed = pack_tilted(&Sheet::torus(40, 20).obj(), "", shape);
        let found = errors(&packed, |u, v| Some(derivatives(torus, u, v)));
        println!("torus, {shape}: {found:?}");
        assert!(found[0] < max_error && found[1] > 10.0, "{shape}: {found:?}");
    }
}

/// Returns the mapped normals: with interpolated tangents, and with tangents per triangle.
fn normals(packed: &Packed, slot: usize, b: Vec2) -> [Vec3; 2] {
    let hit = hit(packed, slot, b);
    let prim = fetch_hit_primitive(packed, hit);
    let q = &prim.primitive;
    let ray = Ray {
        origin: q.anchor + q.z * 3.0,
        direction: -q.z,
    };
    let surface = surface_of(packed, &prim, hit, ray);
    let material = material_of(packed, &prim);
    let found = evaluate_material(packed, &prim, hit, material, surface, HitDifferential::default(), 1).normal;
    let Tangents { u, v } = face_tangents(&prim);
    let triangle_surface = wgray_trace::cpu::surface::Surface {
        du: u,
        dv: v,
        ..surface
    };
    let texture = &packed.textures.records[packed.textures.lookups[material.lookups.x as usize].texture as usize];
    [found, mapped_normal(triangle_surface, texture, MAP_NORMAL)]
}

/// Returns the maximum angles in degrees between the normals on both sides of edges and seams (with interpolated
/// tangents, and with tangents per triangle), and the number of edges.
fn max_normal_jumps(packed: &Packed, is_compared: impl Fn(Vec3) -> bool) -> ([f32; 2], usize) {
    let mesh = &packed.bvh.meshes[0];
    let mut sides: HashMap<_, Vec<[Vec3; 2]>> = HashMap::new();
    for (slot, triangle) in mesh.triangles.iter().enumerate() {
        let corners = [triangle.x, triangle.y, triangle.z].map(|vertex| mesh.vertices[vertex as usize].truncate());
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let barycentrics = [Vec2::ZERO, Vec2::X, Vec2::Y];
            let mut points = [(corners[i], barycentrics[i]), (corners[j], barycentrics[j])];
            points.sort_by_key(|(point, _)| point.to_array().map(f32::to_bits));
            let [(from, b), (to, c)] = points;
            if is_compared(from) && is_compared(to) {
                let key = [from, to].map(|point| point.to_array().map(f32::to_bits));
                sides
                    .entry(key)
                    .or_default()
                    .push(normals(packed, slot, b.lerp(c, 0.3)));
            }
        }
    }
    let mut max_jumps = [0.0; 2];
    let mut edges = 0;
    for normals in sides.values() {
        if let [a, b] = normals[..] {
            edges += 1;
            for (max_jump, (a, b)) in max_jumps.iter_mut().zip(a.into_iter().zip(b)) {
                *max_jump = f32::max(*max_jump, a.angle_between(b).to_degrees());
            }
        }
    }
    (max_jumps, edges)
}

#[test]
fn normals_do_not_jump_at_edges_and_seams() {
    let sphere = Sheet::sphere(16, 8);
    // The normals are continuous for any texture transform.
    for texture in ["", "rotate = 45", "rotate = 90\nscale = [3, 0.5]", "scale = [-1, 1]"] {
        let packed = pack_tilted(&sphere.obj(), texture, "");
        let (found, edges) = max_normal_jumps(&packed, |p| p.z.abs() < 0.99);
        println!("sphere, {texture}: {found:?} at {edges} edges");
        assert!(edges > 250 && found[0] < 0.05 && found[1] > 4.0, "{texture}: {found:?}");
        let packed = pack_tilted(&Sheet::torus(16, 12).obj(), texture, "scale = [1, 2, 1]");
        let (found, edges) = max_normal_jumps(&packed, |_| true);
        println!("torus, {texture}: {found:?} at {edges} edges");
        assert!(
            edges == 16 * 12 * 3 && found[0] < 0.05 && found[1] > 4.0,
            "{texture}: {found:?}"
        );
    }
}

fn max_pixel_step(packed: &Packed) -> f32 {
    let pixels: Vec<[f32; 3]> = reference(packed).means().collect();
    let (width, height) = (192, 144);
    let mut max_step = 0.0;
    for (x, y) in (0..height - 1).flat_map(|y| (0..width - 1).map(move |x| (x, y))) {
        let value = pixels[y * width + x][0];
        for neighbor in [pixels[y * width + x + 1][0], pixels[(y + 1) * width + x][0]] {
            max_step = f32::max(max_step, (value - neighbor).abs());
        }
    }
    max_step
}

#[test]
fn triangles_of_a_smooth_mesh_are_not_visible() {
    let light = "[[lights]]\ntype = 'directional'\ndirection = [0.2, 1, -0.7]\ncolor = [1, 1, 1]";
    // The camera faces the seam.
    let shape = format!("rotate = [0, 0, -80]\n{light}");
    let mut packed = pack_tilted(&Sheet::sphere(16, 8).obj(), "", &shape);
    let found = max_pixel_step(&packed);
    // Negative control: tangents per triangle make the triangles visible.
    packed.bvh.instances[0].tangents = NO_INDEX;
    let per_triangle = max_pixel_step(&packed);
    println!(
        "largest step between pixels: {found} with tangents per vertex, {per_triangle} with tangents per triangle"
    );
    assert!(found < 0.005 && per_triangle > 0.015, "{found} {per_triangle}");
}

#[test]
fn tangents_of_mirrored_texture_coordinates_are_not_averaged() {
    // A bent sheet whose u increases from the middle in both directions.
    let mut sheet = Sheet::of(8, 4, |u, v| {
        let (sin, cos) = (u - 0.5).sin_cos();
        let normal = DVec3::new(sin, 0.0, cos);
        [normal + DVec3::Y * (v - 0.5), normal]
    });
    let plain = pack_tilted(&sheet.obj(), "", "");
    assert_eq!(plain.bvh.meshes[0].vertices.len(), 9 * 5);
    for uv in &mut sheet.uvs {
        uv[0] = (uv[0] - 0.5).abs();
    }
    let packed = pack_tilted(&sheet.obj(), "", "");
    let mesh = &packed.bvh.meshes[0];
    // The shared vertices on the middle line are split.
    assert_eq!(mesh.vertices.len(), 9 * 5 + 5);
    assert_eq!(mesh.attributes.len(), mesh.vertices.len());
    assert_eq!(mesh.tangents.len(), mesh.vertices.len());
    for slot in 0..mesh.triangles.len() {
        for b in BARYCENTRICS {
            let prim = fetch_hit_primitive(&packed, hit(&packed, slot, b));
            let point = prim.primitive.anchor + prim.edge_1 * b.x + prim.edge_2 * b.y;
            let middle = prim.primitive.anchor + (prim.edge_1 + prim.edge_2) / 3.0;
            // u increases along +x where x > 0, and along -x where x < 0; v increases along +y.
            let tangent = Vec3::new(point.z, 0.0, -point.x).normalize() * middle.x.signum();
            let found = face_frame(&prim, b);
            assert!(found.u.angle_between(tangent) < 0.01, "{point}: {} {tangent}", found.u);
            assert!(found.v.angle_between(Vec3::Y) < 0.01, "{point}: {}", found.v);
            let normal = normals(&packed, slot, b)[0];
            let outward = Vec3::new(point.x, 0.0, point.z).normalize();
            let expected = tangent * MAP_NORMAL.x + outward * MAP_NORMAL.z;
            assert!(normal.angle_between(expected) < 0.01, "{point}: {normal} {expected}");
        }
    }
}

#[test]
fn tangents_are_averaged_only_across_continuous_textures() {
    // Two sheets that meet at x = 1; the right sheet has a different texture transform.
    let directions = |rotation: f64, shift: f64| {
        let sheet = |left: f64| Sheet::of(2, 2, |u, v| [DVec3::new(left + u, v, 0.0), DVec3::Z]);
        let (mut joined, right) = (sheet(0.0), sheet(1.0));
        let (sin, cos) = rotation.to_radians().sin_cos();
        let offset = joined.triangle_mesh.points.len() as u32;
        for p in &right.triangle_mesh.points {
            let (x, y) = (p.x - 1.0, p.y - 0.5);
            joined
                .uvs
                .push([1.0 + shift + x * cos + y * sin, 0.5 + y * cos - x * sin]);
        }
        joined.triangle_mesh.points.extend(right.triangle_mesh.points);
        joined.normals.extend(right.normals);
        let triangles = right.triangle_mesh.triangles.into_iter();
        joined
            .triangle_mesh
            .triangles
            .extend(triangles.map(|t| t.map(|i| offset + i)));
        let packed = pack_tilted(&joined.obj(), "", "");
        let mesh = &packed.bvh.meshes[0];
        let mut directions: Vec<f32> = mesh
            .vertices
            .iter()
            .zip(&mesh.tangents)
            .filter(|(position, _)| (position.x, position.y) == (1.0, 0.5))
            .map(|(_, [u, _])| u.y.atan2(u.x).to_degrees().round())
            .collect();
        directions.sort_by(f32::total_cmp);
        directions
    };
    assert_eq!(directions(30.0, -1.0), [15.0, 15.0]);
    assert_eq!(directions(30.0, 0.3), [0.0, 30.0]);
    assert_eq!(directions(70.0, -1.0), [0.0, 70.0]);
}

#[test]
fn only_smooth_meshes_with_normal_maps_have_tangents() {
    let sphere = Sheet::sphere(16, 8);
    let (smooth, count) = (pack_tilted(&sphere.obj(), "", ""), 17 * 9);
    assert_eq!(smooth.bvh.meshes[0].tangents.len(), count - 2); // one vertex of each pole is unused
    assert!(smooth.bvh.instances[0].tangents != NO_INDEX);
    let flat = pack_tilted(&sphere.obj(), "", "normals = 'flat'");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mesh.obj"), sphere.obj()).unwrap();
    let text = format!("{SCENE_START}[[shapes]]\ntype = 'mesh'\nfile = 'mesh.obj'\nmaterial = 'm'");
    for packed in [flat, scene(&text, folder.path())] {
        assert!(packed.bvh.meshes[0].tangents.is_empty());
        assert_eq!(packed.bvh.instances[0].tangents, NO_INDEX);
        let prim: HitPrimitive = fetch_hit_primitive(&packed, hit(&packed, 0, Vec2::ZERO));
        assert_eq!(prim.tangents_0, Tangents::default());
        assert_eq!(face_frame(&prim, Vec2::ZERO), face_tangents(&prim));
    }
}

/// The texture coordinates are constant, discontinuous or extreme, or the tangents of adjacent triangles cancel.
#[test]
fn degenerate_texture_coordinates_give_unit_normals() {
    let scale_uv = |factor: f64| move |[u, v]: [f64; 2]| [u * factor, v * factor];
    let maps: [&dyn Fn([f64; 2]) -> [f64; 2]; 8] = [
        &|_| [0.5, 0.5],
        &|[u, _]| [u, 0.0],
        &|[u, v]| [u, v * 1e-12],
        &|[u, v]| [(7.0 * u).fract(), (5.0 * v).fract()],
        &|[u, v]| [(u * 8.0).round() / 8.0, v],
        &scale_uv(1e-30),
        &scale_uv(1e30),
        &|[u, v]| [u.mul_add(91.0, v * 17.0).sin(), (u * 53.0).cos()],
    ];
    for (case, map) in maps.into_iter().enumerate() {
        let mut sheet = Sheet::torus(16, 12);
        sheet.uvs.iter_mut().for_each(|uv| *uv = map(*uv));
        let packed = pack_tilted(&sheet.obj(), "rotate = 30", "scale = 1e-6");
        for slot in 0..packed.bvh.meshes[0].triangles.len() {
            for b in BARYCENTRICS {
                let normal = normals(&packed, slot, b)[0];
                assert!(
                    (normal.length() - 1.0).abs() < 1e-5,
                    "{case}: {slot}, {b}: {normal}, {:?}",
                    fetch_hit_primitive(&packed, hit(&packed, slot, b))
                );
            }
        }
    }
}
