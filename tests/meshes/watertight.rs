//! Closed meshes are watertight: no ray towards an edge or a vertex leaks through the mesh, at any position and scale.

use glam::{DMat3, DVec3, UVec2, Vec3, Vec4Swizzles as _};
use rayon::prelude::*;
use wgray_trace::cpu::geometry::{closest_hit, occluded_samples};
use wgray_trace::cpu::ray::Ray;
use wgray_trace::cpu::shadow::SampleBlock;
use wgray_trace::cpu::surface::Surface;
use wgray_trace::records::{CASTS_SHADOW, GRID, INFINITE_T, Instance, Light, NO_INDEX, NO_PRIMITIVE, Packed};

use super::procedural::{SCENE_START, TriangleMesh, scene};
use crate::random::Random;
use crate::sources;

/// Transforms of a mesh. The distance from the origin is up to 2e6 times the size of the mesh.
const TRANSFORMS: &[&str] = &[
    "",
    "rotate = [30, 40, 50]",
    "rotate = { axis = [1, 2, 3], degrees = 17 }\nscale = [1, 2.5, -0.6]",
    "rotate = [0, 45, 45]\ntranslate = [1000, -700, 300]",
    "rotate = [10, 20, 30]\ntranslate = [3e4, 1e5, -2e4]",
    "rotate = [70, 80, 90]\ntranslate = [1e6, 1e6, 1e6]",
    "rotate = [1, 2, 3]\nscale = 1e-6",
    "rotate = [1, 2, 3]\nscale = 1e6",
    "rotate = [4, 5, 6]\nscale = 1e-6\ntranslate = [1e-3, 0, 1e-2]",
    "matrix = [[1, 0.6, 0, 0], [0, 1, 0.4, 0], [0.2, 0, 1, 3]]",
];

fn pack_mesh(obj: &str, transform: &str) -> Packed {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.obj"), obj).expect("a mesh");
    scene(
        &format!("{SCENE_START}[[shapes]]\ntype = 'mesh'\nfile = 'a.obj'\nmaterial = 'm'\n{transform}\n"),
        folder.path(),
    )
}

/// A mesh in world space in double precision.
struct Solid {
    corners: Vec<[DVec3; 3]>,
    center: DVec3,
    /// Radius of an inscribed ball, if the mesh is convex.
    radius: f64,
    /// Maximum rounding error of a coordinate.
    rounding: f64,
}

impl Solid {
    fn new(scene: &Packed) -> Solid {
        let (instance, mesh): (&Instance, _) = (&scene.bvh.instances[0], &scene.bvh.meshes[0]);
        let columns = DMat3::from_cols(instance.u.as_dvec3(), instance.v.as_dvec3(), instance.w.as_dvec3());
        let corner = |vertex: u32| {
            let p = mesh.vertices[vertex as usize].xyz().as_dvec3();
            instance.anchor.as_dvec3() + columns * p
        };
        let corners: Vec<[DVec3; 3]> = mesh.triangles.iter().map(|t| [t.x, t.y, t.z].map(corner)).collect();
        let center = corners.iter().flatten().sum::<DVec3>() / (3.0 * corners.len() as f64);
        let height = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).normalize().dot(center - a).abs();
        Solid {
            center,
            radius: corners.iter().map(height).fold(f64::INFINITY, f64::min),
            rounding: corners
                .iter()
                .flatten()
                .map(|p| p.abs().max_element())
                .fold(0.0, f64::max)
                / 16_777_216.0,
            corners,
        }
    }

    /// Returns a vertex or a point on an edge.
    fn target(&self, random: &Random) -> DVec3 {
        let [a, b, _] = self.triangle(random);
        match random.below(4) {
            0 => a,
            1 => a.lerp(b, 0.5),
            2 => a.lerp(b, f64::from(random.below(257)) / 256.0),
            _ => a.lerp(b, random.unit()),
        }
    }

    fn triangle(&self, random: &Random) -> [DVec3; 3] {
        let mut corners = self.corners[random.below(self.corners.len() as u32) as usize];
        corners.rotate_left(random.below(3) as usize);
        corners
    }
}

/// Returns the number of random rays that leak through a convex mesh. From outside, a ray towards the inscribed ball
/// must hit the mesh before the point nearest to the center. From inside, a ray must hit the mesh at its target, up to
/// the precision of slivers.
fn count_leaks(scene: &Packed, rays: u32, from_inside: bool) -> u32 {
    let solid = Solid::new(scene);
    let chunks = (0..64u64).into_par_iter().map(|seed| {
        let random = Random::new(seed + if from_inside { 100 } else { 0 });
        (0..rays / 64)
            .filter(|_| leaks(scene, &solid, from_inside, &random))
            .count() as u32
    });
    chunks.sum()
}

/// Traces a random ray and a shadow ray. Returns true if one of them leaks through the convex mesh.
fn leaks(scene: &Packed, solid: &Solid, from_inside: bool, random: &Random) -> bool {
    let target = solid.target(random);
    let offset = DVec3::from_array([(); 3].map(|()| random.between(-0.3, 0.3))) * solid.radius;
    let out = target - solid.center;
    let origin = match from_inside {
        true => solid.center + offset,
        false => target + (out - offset) * random.magnitude(-1.0, 3.0),
    };
    let origin = origin.as_vec3();
    let direction = (target - origin.as_dvec3()).as_vec3();
    let ray = Ray {
        origin,
        direction: if random.once_in(2) {
            direction
        } else {
            direction.normalize()
        },
    };
    let d = ray.direction.as_dvec3();
    // Ray parameters nearest to the center and to the target. Rounding may move the hit behind the target.
    let to_center = (solid.center - origin.as_dvec3()).dot(d) / d.length_squared();
    let to_target = (target - origin.as_dvec3()).dot(d) / d.length_squared();
    let tolerance = 30.0 * solid.rounding / d.length();
    let limit = if from_inside {
        to_target * 1.05 + tolerance
    } else {
        to_center
    };
    let hit = closest_hit(scene, ray, NO_PRIMITIVE, NO_PRIMITIVE);
    let casts_shadows = scene.bvh.items.iter().any(|item| item.kind & CASTS_SHADOW != 0);
    let light_t = if from_inside { 2.0 } else { 1.0 + to_center / to_target };
    !(f64::from(hit.t) <= limit) || casts_shadows && !is_occluded(scene, origin, direction, light_t)
}

/// Returns true if a point light at `origin + light_t * direction` is occluded.
fn is_occluded(scene: &Packed, origin: Vec3, direction: Vec3, light_t: f64) -> bool {
    let zero = Vec3::ZERO;
    let surface = Surface {
        position: origin,
        normal: Vec3::Z,
        smooth_normal: Vec3::Z,
        shading_normal: Vec3::Z,
        wo: Vec3::Z,
        ray_origin: origin,
        terminator_offset: zero,
        side: 1.0,
        exclude_front: NO_PRIMITIVE,
        exclude_back: NO_PRIMITIVE,
        uv: zero.truncate(),
        du: zero,
        dv: zero,
    };
    let light = Light {
        center: (origin.as_dvec3() + direction.as_dvec3() * light_t).as_vec3(),
        finite: 1.0,
        t_max: 1.0 - 1e-5,
        primitive: NO_INDEX,
        ..bytemuck::Zeroable::zeroed()
    };
    let block = SampleBlock {
        pattern: GRID,
        side: 1,
        first: 0,
        count: 1,
        group: 0,
        key: UVec2::ZERO,
    };
    occluded_samples(scene, &surface, &light, block, 0) == 1
}

fn convex_meshes() -> [(&'static str, TriangleMesh); 4] {
    let mut slivers = TriangleMesh::slivers(600, &Random::new(1));
    slivers.points.iter_mut().for_each(|p| p.z *= 0.7);
    [
        ("a cube", TriangleMesh::cube()),
        ("an icosahedron", TriangleMesh::icosphere(0)),
        ("an icosphere", TriangleMesh::icosphere(4)),
        ("slivers", slivers),
    ]
}

#[test]
fn no_ray_passes_through_a_closed_mesh() {
    let mut total = 0;
    for (name, triangle_mesh) in convex_meshes() {
        let obj = triangle_mesh.obj(None, None);
        for transform in TRANSFORMS {
            let scene = pack_mesh(&obj, transform);
            assert_eq!(
                scene.bvh.meshes[0].triangles.len(),
                triangle_mesh.triangles.len(),
                "{name}: triangles are missing"
            );
            for from_inside in [false, true] {
                let rays = 12_800;
                total += rays;
                assert_eq!(
                    count_leaks(&scene, rays, from_inside),
                    0,
                    "{name}, {transform:?}, from inside: {from_inside}"
                );
            }
        }
    }
    println!("{total} rays towards edges and vertices, and as many shadow rays: all hit");
    assert!(total > 1_000_000);
}

#[test]
fn a_hole_in_a_mesh_is_detected() {
    for (name, triangle_mesh) in convex_meshes() {
        let mut open = triangle_mesh.clone();
        open.triangles.pop();
        for transform in TRANSFORMS {
            let scene = pack_mesh(&open.obj(None, None), transform);
            let count = count_leaks(&scene, 64_000, true);
            assert!(count > 0, "{name}, {transform:?}");
        }
    }
}

/// Negative control: triangles outside of a mesh do not share edges.
#[test]
fn standalone_triangles_are_not_watertight() {
    let triangle_mesh = TriangleMesh::icosphere(2);
    let mesh = pack_mesh(&triangle_mesh.obj(None, None), "rotate = [30, 40, 50]");
    let mut text = SCENE_START.to_string();
    for corners in Solid::new(&mesh).corners {
        let [a, b, c] = corners.map(|p| p.to_array());
        text += &format!("[[shapes]]\ntype = 'triangle'\nmaterial = 'm'\nvertices = [{a:?}, {b:?}, {c:?}]\n");
    }
    let mut separate = scene(&text, sources::path("scenes").as_path());
    // The mesh provides the targets of the rays.
    (separate.bvh.instances, separate.bvh.meshes) = (mesh.bvh.instances.clone(), mesh.bvh.meshes.clone());
    let count = [false, true].map(|from_inside| count_leaks(&separate, 64_000, from_inside));
    println!("rays that leak between standalone triangles, of 64000 from outside and 64000 from inside: {count:?}");
    assert!(count[0] + count[1] > 0, "{count:?}");
    assert_eq!(
        [false, true].map(|from_inside| count_leaks(&mesh, 64_000, from_inside)),
        [0, 0]
    );
}

/// The knot is not convex: rays towards an edge whose triangles face the ray must hit the edge or an earlier
/// triangle; rays from inside may hit anywhere.
#[test]
fn no_ray_passes_through_the_knot() {
    let knot = std::fs::read_to_string(sources::path("scenes/meshes/knot.obj")).expect("the knot");
    for transform in &TRANSFORMS[..4] {
        let packed = pack_mesh(&knot, transform);
        let solid = Solid::new(&packed);
        let [outside, inside] = knot_rays(&packed, &solid, 40_000);
        println!("{transform:?}: {outside:?} from outside, {inside:?} from inside");
        assert!(
            outside.0 > 5000 && inside.0 > 20_000,
            "{transform:?}: {outside:?} {inside:?}"
        );
        assert_eq!((outside.1, inside.1), (0, 0), "{transform:?}");
    }
    // Negative control: every 50th triangle is removed.
    let mut face_count = 0;
    let remaining = knot.lines().filter(|line| {
        face_count += u32::from(line.starts_with("f "));
        !(line.starts_with("f ") && face_count % 50 == 0)
    });
    let packed = pack_mesh(&remaining.collect::<Vec<_>>().join("\n"), "");
    let full_solid = Solid::new(&pack_mesh(&knot, ""));
    let [outside, inside] = knot_rays(&packed, &full_solid, 40_000);
    assert!(outside.1 > 10 && inside.1 > 10, "{outside:?} {inside:?}");
}

/// Returns the number of rays and the number of leaking rays, first for rays from outside the knot, then for rays from
/// inside.
fn knot_rays(scene: &Packed, solid: &Solid, rays: u32) -> [(u32, u32); 2] {
    let side = f64::from(scene.bvh.instances[0].side);
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize() * side;
    let size = solid
        .corners
        .iter()
        .flatten()
        .map(|p| p.distance(solid.center))
        .fold(0.0, f64::max);
    let key = |p: DVec3| p.to_array().map(f64::to_bits);
    let mut normals_at = std::collections::HashMap::<_, Vec<DVec3>>::new();
    for corners in &solid.corners {
        corners
            .iter()
            .for_each(|p| normals_at.entry(key(*p)).or_default().push(normal(*corners)));
    }
    let random = Random::new(9);
    let [mut outside, mut inside] = [(0, 0); 2];
    for _ in 0..rays {
        let corners = solid.triangle(&random);
        let [a, b, c] = corners;
        let target = match random.below(3) {
            0 => a,
            1 => a.lerp(b, 0.5),
            _ => a.lerp(b, random.unit()),
        };
        let offset = DVec3::from_array([(); 3].map(|()| random.between(-1.0, 1.0)));
        let origin = (target + offset * size * random.pick(&[0.1, 1.0, 10.0])).as_vec3();
        let direction = (target - origin.as_dvec3()).as_vec3();
        let faces = [key(a), key(b)].into_iter().flat_map(|corner| &normals_at[&corner]);
        let d = direction.as_dvec3().normalize();
        if faces.map(|n| n.dot(d)).all(|cosine| cosine < -0.2) {
            let hit = closest_hit(scene, Ray { origin, direction }, NO_PRIMITIVE, NO_PRIMITIVE);
            let limit = 1.0 + 1e-4 + 30.0 * solid.rounding / f64::from(direction.length());
            outside.0 += 1;
            outside.1 += u32::from(!(f64::from(hit.t) <= limit));
        }
        // The origin inside of the knot is at a quarter of the distance to the opposite side.
        let middle = (a + b + c) / 3.0;
        let inwards = -normal(corners);
        let start = (middle + inwards * 1e-4 * size).as_vec3();
        let opposite = closest_hit(
            scene,
            Ray {
                origin: start,
                direction: inwards.as_vec3(),
            },
            NO_PRIMITIVE,
            NO_PRIMITIVE,
        );
        if opposite.t == INFINITE_T || f64::from(opposite.t) < 0.01 * size {
            continue;
        }
        let origin = (middle + inwards * 0.25 * f64::from(opposite.t)).as_vec3();
        let direction = (solid.target(&random) - origin.as_dvec3()).as_vec3();
        let hit = closest_hit(scene, Ray { origin, direction }, NO_PRIMITIVE, NO_PRIMITIVE);
        inside.0 += 1;
        inside.1 += u32::from(hit.t == INFINITE_T || !is_occluded(scene, origin, direction, 1e3));
    }
    [outside, inside]
}
