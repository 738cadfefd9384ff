//! Tests of BVH traversals against brute force, for rays and groups of segments, at every SIMD level.

use std::ops::Range;

use glam::{DVec3, Vec3};

use fearless_simd::dispatch;

use super::{
    Directions, Level, Line, Mesh, MeshRay, Nearest, Next, NodeStack, RAYS, RaySource, Segments, Traced, closest,
    leaves, levels, occluded, occluded_items, trace,
};
use crate::bvh::{Aabb, DecodedMesh, Tree, build};
use crate::cases;

const NONE: Nearest = Nearest {
    t: f32::INFINITY,
    triangle: u32::MAX,
    slot: 0,
};

struct Random(u64);

impl Random {
    fn bits(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// Returns a number from -1 to 1.
    fn number(&mut self) -> f32 {
        self.bits() as f32 / (1u64 << 31) as f32 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.number(), self.number(), self.number())
    }

    fn below(&mut self, n: usize) -> usize {
        self.bits() as usize % n
    }
}

struct Scene {
    tree: Tree,
    vertices: Vec<[f32; 4]>,
    triangles: Vec<[u32; 4]>,
    decoded: DecodedMesh,
}

impl Scene {
    fn new(corners: &[Vec3], triangles: &[[u32; 3]], max_leaf_size: u32) -> Scene {
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| corners[i as usize]);
                Aabb {
                    low: a.min(b).min(c),
                    high: a.max(b).max(c),
                }
            })
            .collect();
        let tree = build(&boxes, max_leaf_size);
        let with_index = |i: &u32| {
            let [a, b, c] = triangles[*i as usize];
            [a, b, c, *i]
        };
        let triangles: Vec<[u32; 4]> = tree.order.iter().map(with_index).collect();
        let vertices: Vec<[f32; 4]> = corners.iter().map(|v| v.extend(0.0).to_array()).collect();
        Scene {
            decoded: DecodedMesh::new(&tree.nodes, &vertices, &triangles),
            triangles,
            vertices,
            tree,
        }
    }

    fn mesh(&self) -> Mesh<'_> {
        Mesh {
            nodes: &self.tree.nodes,
            vertices: &self.vertices,
            triangles: &self.triangles,
            decoded: None,
        }
    }

    /// Returns the mesh in both forms.
    fn meshes(&self) -> [Mesh<'_>; 2] {
        let decoded = Mesh {
            decoded: Some(&self.decoded),
            ..self.mesh()
        };
        [self.mesh(), decoded]
    }

    fn t(&self, triangle: &[u32; 4], line: &Line) -> Option<f32> {
        let vertices = [0, 1, 2].map(|i| &self.vertices[triangle[i] as usize]);
        line.triangle(vertices)
    }

    /// Brute-force [`closest`], from the line's origin.
    fn closest(&self, line: &Line, skip: u32, best: Nearest) -> Nearest {
        let triangles = (0..).zip(&self.triangles).filter(|(_, t)| t[3] != skip);
        triangles.fold(best, |best, (slot, triangle)| match self.t(triangle, line) {
            Some(t) if (t, triangle[3]) < (best.t, best.triangle) => Nearest {
                t,
                triangle: triangle[3],
                slot,
            },
            _ => best,
        })
    }

    /// Brute-force [`occluded`].
    fn occluded(&self, segments: &Segments, mask: u32) -> u32 {
        let mut bits = 0;
        for i in 0..segments.directions.count {
            let line = Line::new(segments.o, segments.directions.get(i), segments.pad);
            let occludes = |triangle: &[u32; 4]| {
                triangle[3] != segments.skip && self.t(triangle, &line).is_some_and(|t| t < segments.t_max)
            };
            bits |= u32::from(self.triangles.iter().any(occludes)) << i;
        }
        bits & mask
    }
}

/// Counts of outcomes, to show that a test covers all cases.
#[derive(Debug, Default)]
struct Outcomes {
    hits: u32,
    misses: u32,
    occluded: u32,
    unoccluded: u32,
}

/// Compares queries of rays and of groups of segments with brute force. `random_ray` returns an origin and a direction.
fn compare(
    scene: &Scene,
    random: &mut Random,
    count: usize,
    mut random_ray: impl FnMut(&mut Random) -> (Vec3, Vec3),
) -> Outcomes {
    let mut outcomes = Outcomes::default();
    let levels = levels();
    for i in 0..count {
        let pad = [0.0, 1e-6, 1e-3][i % 3];
        let skip = if i % 4 == 0 {
            random.below(scene.triangles.len()) as u32
        } else {
            u32::MAX
        };
        let (o, d) = random_ray(random);
        let best = Nearest {
            t: if i % 7 == 0 {
                random.number().abs()
            } else {
                f32::INFINITY
            },
            triangle: random.bits(),
            slot: 0,
        };
        let line = Line::new(o, d, pad);
        let expected = scene.closest(&line, skip, best);
        for (level, mesh) in levels.iter().flat_map(|level| scene.meshes().map(|mesh| (level, mesh))) {
            let found = closest(*level, &mesh, &line, 0.0, skip, best);
            assert_eq!(found, expected, "{level:?} {o} {d}");
            assert_eq!(found.t.to_bits(), expected.t.to_bits());
        }
        if expected == best {
            outcomes.misses += 1
        } else {
            outcomes.hits += 1
        }

        // Segments close to the direction of the ray, or in any direction.
        let spread = [0.0, 0.01, 0.3, 10.0][i / 2 % 4];
        let directions: Vec<Vec3> = (0..random.below(33))
            .map(|_| {
                if spread < 1.0 {
                    d + random.vector() * (spread * d.length())
                } else {
                    random_ray(random).1
                }
            })
            .collect();
        let segments = Segments {
            o,
            pad,
            directions: &Directions::new(&directions),
            t_max: if i % 2 == 0 { 1.0 } else { 1e30 },
            skip,
        };
        let all = (0..directions.len()).fold(0, |bits, i| bits | 1 << i);
        let mask = all & if i % 3 == 1 { random.bits() } else { !0 };
        let expected = scene.occluded(&segments, mask);
        for (level, mesh) in levels.iter().flat_map(|level| scene.meshes().map(|mesh| (level, mesh))) {
            let bits = occluded(*level, &mesh, &segments, mask);
            assert_eq!(bits, expected, "{level:?} {segments:?}");
        }
        outcomes.occluded += expected.count_ones();
        outcomes.unoccluded += (mask & !expected).count_ones();
    }
    outcomes
}

/// Returns triangles of a given size at random points, with coordinates from -1 to 1.
fn soup(random: &mut Random, count: usize, size: f32) -> Scene {
    let mut corners = Vec::new();
    for _ in 0..count {
        let middle = random.vector();
        corners.extend((0..3).map(|_| middle + random.vector() * size));
    }
    let triangles: Vec<[u32; 3]> = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Scene::new(&corners, &triangles, 1 + random.bits() % 4)
}

#[test]
fn random_triangles_match_brute_force() {
    let random = &mut Random(1);
    for (count, size) in [(1, 1.0), (2, 1.0), (9, 0.8), (300, 0.1), (2000, 0.05), (500, 0.5)] {
        let scene = soup(random, count, size);
        let rays = 400_000 / (count + 100);
        let outcomes = compare(&scene, random, rays, |random| (random.vector() * 1.5, random.vector()));
        assert!(
            outcomes.hits > 5 && outcomes.misses > 5 && outcomes.occluded > 50 && outcomes.unoccluded > 50,
            "{outcomes:?}"
        );
    }
}

#[test]
fn empty_scenes_and_empty_masks_have_no_hits() {
    let scene = Scene::new(&[], &[], 4);
    let line = Line::new(Vec3::ZERO, Vec3::X, 0.0);
    for mesh in scene.meshes() {
        assert_eq!(closest(Level::new(), &mesh, &line, 0.0, u32::MAX, NONE), NONE);
    }
    let segments = Segments {
        o: Vec3::ZERO,
        pad: 0.0,
        directions: &Directions::new(&[Vec3::X, Vec3::Y]),
        t_max: 1.0,
        skip: u32::MAX,
    };
    for mesh in scene.meshes() {
        assert_eq!(occluded(Level::new(), &mesh, &segments, 3), 0);
    }
    let scene = soup(&mut Random(2), 10, 1.0);
    assert_eq!(occluded(Level::new(), &scene.mesh(), &segments, 0), 0);
}

/// Returns a grid of squares of two triangles each, in the plane z = slope * (x + 1).
fn grid(side: u32, slope: f32) -> Scene {
    let vertex =
        |x: u32, y: u32| Vec3::new(x as f32, y as f32, slope * x as f32) / side as f32 * 2.0 - Vec3::new(1.0, 1.0, 0.0);
    let corners: Vec<Vec3> = (0..=side).flat_map(|y| (0..=side).map(move |x| vertex(x, y))).collect();
    let mut triangles = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let i = y * (side + 1) + x;
            triangles.push([i, i + 1, i + side + 2]);
            triangles.push([i, i + side + 2, i + side + 1]);
        }
    }
    Scene::new(&corners, &triangles, 4)
}

#[test]
fn edges_and_corners_of_a_grid_match_brute_force() {
    let random = &mut Random(3);
    for slope in [0.0, 0.25, -1.0] {
        let scene = grid(16, slope);
        // Rays from above, from and along the plane, through vertices and edges, and parallel to the axes.
        let grid_point = |random: &mut Random| {
            Vec3::new(random.below(33) as f32, random.below(33) as f32, 0.0) / 16.0 - Vec3::new(1.0, 1.0, 0.0)
        };
        let outcomes = compare(&scene, random, 300, |random| {
            let height = [0.0, 1.0, 0.125, -0.5][random.below(4)];
            let (from, to) = (grid_point(random) + Vec3::Z * height, grid_point(random));
            let axis = Vec3::AXES[random.below(3)];
            match random.below(4) {
                0 => (from, axis),
                1 => (from, -axis),
                2 => (from, Vec3::new(-0.0, axis.y, -1.0)),
                _ => (from, to - from),
            }
        });
        assert!(
            outcomes.hits > 20 && outcomes.misses > 20 && outcomes.occluded > 20 && outcomes.unoccluded > 20,
            "{outcomes:?}"
        );
    }
}

#[test]
fn no_ray_passes_between_adjacent_triangles() {
    let random = &mut Random(4);
    let scene = grid(16, 0.3);
    for _ in 0..2000 {
        // Rays from above to points on edges.
        let fraction = (random.number() + 1.0) * 0.5;
        let edge = random.below(scene.triangles.len());
        let [a, b] = [0, 1].map(|i| Vec3::from_slice(&scene.vertices[scene.triangles[edge][i] as usize][..3]));
        let to = a + (b - a) * fraction;
        if to.x.abs().max(to.y.abs()) > 0.999 {
            continue;
        }
        let from = random.vector() + Vec3::Z * 2.0;
        let line = Line::new(from, to - from, 0.0);
        let hit = closest(Level::new(), &scene.mesh(), &line, 0.0, u32::MAX, NONE);
        assert!((hit.t - 1.0).abs() < 1e-4, "{from} {to} {hit:?}");
    }
}

#[test]
fn degenerate_triangles_match_brute_force() {
    let random = &mut Random(5);
    let mut corners: Vec<Vec3> = (0..60).map(|_| random.vector()).collect();
    corners.push(Vec3::ZERO);
    let count = corners.len();
    // Points, needles and duplicate triangles.
    let mut triangles = Vec::new();
    for _ in 0..100 {
        let [a, b, c] = [0; 3].map(|_| random.below(count) as u32);
        triangles.extend([[a, a, a], [a, b, b], [a, b, a], [a, b, c], [a, b, c], [c, b, a]]);
    }
    let scene = Scene::new(&corners, &triangles, 4);
    let points = corners.clone();
    let outcomes = compare(&scene, random, 400, |random| {
        let from = points[random.below(count)];
        (from, points[random.below(count)] - from * [1.0, 0.0][random.below(2)])
    });
    assert!(
        outcomes.hits > 20 && outcomes.misses > 20 && outcomes.occluded > 20 && outcomes.unoccluded > 20,
        "{outcomes:?}"
    );
}

#[test]
fn huge_and_tiny_scenes_match_brute_force() {
    let random = &mut Random(6);
    for scale in [1e-30, 1e-18, 1e-6, 1e9, 1e15, 1e30] {
        let mut scene = soup(random, 200, 0.3);
        for vertex in &mut scene.vertices {
            *vertex = vertex.map(|x| x * scale);
        }
        let corners: Vec<Vec3> = scene.vertices.iter().map(|v| Vec3::from_slice(&v[..3])).collect();
        let triangles: Vec<[u32; 3]> = scene.triangles.iter().map(|t| [t[0], t[1], t[2]]).collect();
        let scene = Scene::new(&corners, &triangles, 4);
        for length in [1.0, 1e-20, 1e20] {
            compare(&scene, random, cases(60), |random| {
                (random.vector() * scale, random.vector() * length)
            });
        }
    }
    // Mixed sizes, near and far from the origin.
    let mut corners = Vec::new();
    for i in 0..300 {
        let offset = if i % 2 == 0 { Vec3::splat(1000.0) } else { Vec3::ZERO };
        let middle = random.vector() + offset;
        let size = 10f32.powi(i % 12 - 6);
        corners.extend((0..3).map(|_| middle + random.vector() * size));
    }
    let triangles: Vec<[u32; 3]> = (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let scene = Scene::new(&corners, &triangles, 4);
    let outcomes = compare(&scene, random, 400, |random| {
        let from = random.vector() * 2.0 + [Vec3::ZERO, Vec3::splat(1000.0)][random.below(2)];
        (from, random.vector())
    });
    assert!(
        outcomes.hits > 20 && outcomes.occluded > 20 && outcomes.unoccluded > 20,
        "{outcomes:?}"
    );
}

#[test]
fn directions_with_zeros_match_brute_force() {
    let random = &mut Random(7);
    let scene = soup(random, 300, 0.3);
    let component = |random: &mut Random| {
        let x = random.number();
        [0.0, -0.0, 1e-38, -1e-42, x, x, 1.0, -1.0][random.below(8)]
    };
    let outcomes = compare(&scene, random, 400, |random| {
        (
            random.vector(),
            Vec3::new(component(random), component(random), component(random)),
        )
    });
    assert!(
        outcomes.hits > 20 && outcomes.misses > 20 && outcomes.occluded > 20 && outcomes.unoccluded > 20,
        "{outcomes:?}"
    );
}

#[test]
fn visits_up_to_the_limit_find_the_hits_of_brute_force() {
    let random = &mut Random(8);
    let scene = soup(random, 500, 0.1);
    for level in levels() {
        for _ in 0..100 {
            let (o, d) = (random.vector(), random.vector());
            let line = Line::new(o, d, 0.0);
            let expected = scene.closest(&line, u32::MAX, NONE);
            let mut best = NONE;
            leaves(level, &scene.tree.nodes, &line, best.t, |items: Range<usize>, limit| {
                assert_eq!(limit, best.t);
                for (slot, triangle) in (items.start as u32..).zip(&scene.triangles[items]) {
                    let index = triangle[3];
                    if let Some(t) = scene.t(triangle, &line)
                        && (t, index) < (best.t, best.triangle)
                    {
                        best = Nearest {
                            t,
                            triangle: index,
                            slot,
                        };
                    }
                }
                best.t
            });
            assert_eq!(best, expected);

            let directions: Vec<Vec3> = (0..32).map(|_| d + random.vector() * 0.5).collect();
            let segments = Segments {
                o,
                pad: 0.0,
                directions: &Directions::new(&directions),
                t_max: 1.0,
                skip: u32::MAX,
            };
            let mask = random.bits();
            let mut visits = 0;
            let bounds = |i: usize| {
                let corners = [0, 1, 2].map(|k| scene.vertices[scene.triangles[i][k] as usize]);
                Some(Aabb::around(&corners.map(|v| Vec3::new(v[0], v[1], v[2]))))
            };
            let bits = occluded_items(level, &scene.tree.nodes, &segments, mask, bounds, |item, candidates| {
                assert_eq!(candidates & !mask, 0);
                visits += 1;
                let mut occluded = 0;
                for (i, d) in directions.iter().enumerate().filter(|(i, _)| candidates >> i & 1 == 1) {
                    let line = Line::new(o, *d, 0.0);
                    let occludes = scene.t(&scene.triangles[item], &line).is_some_and(|t| t < 1.0);
                    occluded |= u32::from(occludes) << i;
                }
                occluded
            });
            assert_eq!(bits, scene.occluded(&segments, mask));
            assert!(visits < 200, "{visits} visits");
        }
    }
}

/// A batch of rays and their results.
struct Batch<'a> {
    mesh: &'a DecodedMesh,
    rays: &'a [MeshRay],
    next: usize,
    /// For each lane, the index of its ray.
    traced: [usize; RAYS],
    found: Vec<Option<Nearest>>,
}

impl<'a, S> RaySource<'a, S> for Batch<'a> {
    fn next(&mut self, _: S, lane: usize, traced: Option<Traced>) -> Next<'a> {
        if let Some(traced) = traced {
            let previous = self.found[self.traced[lane]].replace(traced.best);
            assert_eq!(previous, None, "each ray is traced once");
        }
        let Some(ray) = self.rays.get(self.next) else {
            return Next::Done;
        };
        self.traced[lane] = self.next;
        self.next += 1;
        Next::Trace(self.mesh, *ray)
    }
}

#[test]
fn batches_have_the_hits_of_brute_force() {
    let random = &mut Random(10);
    let mut stacks: [NodeStack; RAYS] = Default::default();
    let (mut hits, mut misses) = (0, 0);
    for (count, size) in [(1, 1.0), (9, 0.8), (300, 0.1), (2000, 0.05), (500, 0.5)] {
        let scene = soup(random, count, size);
        let mesh = &scene.decoded;
        for batch_size in [0, 1, 7, 8, 9, 100] {
            let rays: Vec<MeshRay> = (0..batch_size)
                .map(|i| {
                    let axis = Vec3::AXES[random.below(3)];
                    let direction = [random.vector(), random.vector(), axis, -axis][random.below(4)];
                    let origin = random.vector() * 1.5;
                    let skip = [u32::MAX, random.below(count) as u32][i % 2];
                    let best = Nearest {
                        t: [1e30, random.number().abs()][random.below(2)],
                        ..NONE
                    };
                    MeshRay::new(origin, direction, [0.0, 1e-6, 1e-3][i % 3], 0.0, skip, best)
                })
                .collect();
            for level in levels() {
                for any in [false, true] {
                    let mut batch = Batch {
                        mesh,
                        rays: &rays,
                        next: 0,
                        traced: [0; RAYS],
                        found: vec![None; rays.len()],
                    };
                    dispatch!(level, simd => match any {
                        true => trace::<_, true>(simd, &mut stacks, &mut batch),
                        false => trace::<_, false>(simd, &mut stacks, &mut batch),
                    });
                    for (ray, found) in rays.iter().zip(batch.found) {
                        let (expected, found) = (scene.closest(&ray.line, ray.skip, ray.best), found.unwrap());
                        if any {
                            assert_eq!(found == ray.best, expected == ray.best, "{level:?}");
                        } else {
                            assert_eq!(found, expected, "{level:?}");
                        }
                        hits += u32::from(expected != ray.best);
                        misses += u32::from(expected == ray.best);
                    }
                }
            }
        }
    }
    assert!(hits > 500 && misses > 500, "{hits} hits, {misses} misses");
}

/// Returns the distance and the smallest barycentric coordinate, in f64.
fn moller_trumbore_f64(o: DVec3, d: DVec3, [a, b, c]: [DVec3; 3]) -> Option<(f64, f64)> {
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let determinant = e1.dot(p);
    let s = o - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(e1);
    let v = d.dot(q) / determinant;
    Some((e2.dot(q) / determinant, u.min(v).min(1.0 - u - v))).filter(|_| determinant != 0.0)
}

#[test]
fn single_triangles_match_the_moller_trumbore_test() {
    let random = &mut Random(9);
    let (mut hits, mut misses) = (0, 0);
    for _ in 0..10_000 {
        let corners = [0; 3].map(|_| random.vector());
        let (o, d) = (random.vector() * 2.0, random.vector());
        let vertices = corners.map(|v| v.extend(0.0).to_array());
        let found = Line::new(o, d, 0.0).triangle([&vertices[0], &vertices[1], &vertices[2]]);
        match moller_trumbore_f64(o.as_dvec3(), d.as_dvec3(), corners.map(|v| v.as_dvec3())) {
            Some((t, min_barycentric)) if min_barycentric > 1e-3 && t > 1e-3 => {
                let found = f64::from(found.unwrap());
                assert!((found - t).abs() < 1e-3 * t, "{found} {t}");
                hits += 1;
            }
            Some((t, min_barycentric)) if min_barycentric < -1e-3 || t < -1e-3 => {
                assert_eq!(found, None);
                misses += 1;
            }
            _ => {}
        }
    }
    assert!(hits > 100 && misses > 100, "{hits} hits, {misses} misses");
}
