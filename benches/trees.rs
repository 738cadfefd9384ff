//! Benchmarks of BVH construction over triangles and of BVH traversal, using all threads: `cargo bench --bench trees`.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use fearless_simd::dispatch;
use glam::Vec3;
use rayon::prelude::*;
use wgray_trace::bvh::{Aabb, DecodedMesh, MAX_LEAF_SIZE, Tree, build};
use wgray_trace::cpu::traversal::{
    Directions, Level, Line, Mesh, MeshRay, Nearest, Next, NodeStack, RAYS, RaySource, Segments, Traced, closest,
    occluded, trace,
};

/// An indexed triangle mesh.
struct Surface {
    corners: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Returns a grid of `columns` x `rows` cells of two triangles each. `position` maps (u, v), each
    /// from 0 to 1, to the position of a vertex.
    fn grid(columns: u32, rows: u32, position: impl Fn(f32, f32) -> Vec3) -> Surface {
        let mut surface = Surface {
            corners: Vec::new(),
            triangles: Vec::new(),
        };
        for y in 0..=rows {
            for x in 0..=columns {
                surface
                    .corners
                    .push(position(x as f32 / columns as f32, y as f32 / rows as f32));
            }
        }
        for y in 0..rows {
            for x in 0..columns {
                let i = y * (columns + 1) + x;
                surface.triangles.push([i, i + 1, i + columns + 2]);
                surface.triangles.push([i, i + columns + 2, i + columns + 1]);
            }
        }
        surface
    }

    fn bumpy_sphere(rows: u32) -> Surface {
        Surface::grid(2 * rows, rows, |x, y| {
            let (a, b) = (y * std::f32::consts::PI, x * std::f32::consts::TAU);
            let d = Vec3::new(a.sin() * b.cos(), a.sin() * b.sin(), a.cos());
            d * (1.0 + 0.03 * (20.0 * d.x).sin() * (23.0 * d.y).sin() * (17.0 * d.z).cos())
        })
    }

    fn terrain(side: u32) -> Surface {
        Surface::grid(side, side, |x, y| {
            let (x, y) = (10.0 * x, 10.0 * y);
            let hills = 0.5 * (1.3 * x).sin() * (1.7 * y).cos() + 0.1 * (9.0 * x).sin() * (11.0 * y).sin();
            Vec3::new(x, y, hills + 0.02 * (57.0 * x + 31.0 * y).sin())
        })
    }

    /// Returns the bounding box of each triangle.
    fn boxes(&self) -> Vec<Aabb> {
        let bounds = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| self.corners[i as usize]);
            Aabb {
                low: a.min(b).min(c),
                high: a.max(b).max(c),
            }
        };
        self.triangles.iter().map(bounds).collect()
    }
}

fn builds(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("build a BVH");
    group.sample_size(10);
    let surfaces = [
        ("sphere of 70k", Surface::bumpy_sphere(132)),
        ("sphere of 1M", Surface::bumpy_sphere(500)),
        ("terrain of 1M", Surface::terrain(707)),
    ];
    for (name, surface) in surfaces {
        let boxes = surface.boxes();
        group.throughput(Throughput::Elements(boxes.len() as u64));
        group.bench_function(name, |b| b.iter(|| build(black_box(&boxes), MAX_LEAF_SIZE)));
    }
    group.finish();
}

/// Width and height of the image in pixels.
const SIDE: usize = 512;
/// Padding of the boxes, for rounding errors.
const PAD: f32 = 1e-6;

/// A scene with a bumpy sphere on a floor, a camera and a square area light. The benchmark traces a camera ray per
/// pixel, and 16 shadow rays from each hit to the light.
struct View {
    surface: Surface,
    tree: Tree,
    vertices: Vec<[f32; 4]>,
    triangles: Vec<[u32; 4]>,
    decoded: DecodedMesh,
}

const MISS: Nearest = Nearest {
    t: f32::INFINITY,
    triangle: u32::MAX,
    slot: 0,
};
const EYE: Vec3 = Vec3::new(0.0, -4.5, 1.5);

impl View {
    fn new() -> View {
        let mut surface = Surface::bumpy_sphere(132);
        let first = surface.corners.len() as u32;
        for (x, y) in [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)] {
            surface.corners.push(Vec3::new(x, y, -1.05));
        }
        surface
            .triangles
            .extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
        let tree = build(&surface.boxes(), MAX_LEAF_SIZE);
        let corners_and_index = |i: &u32| {
            let [a, b, c] = surface.triangles[*i as usize];
            [a, b, c, *i]
        };
        let triangles: Vec<[u32; 4]> = tree.order.iter().map(corners_and_index).collect();
        let vertices: Vec<[f32; 4]> = surface.corners.iter().map(|v| v.extend(0.0).to_array()).collect();
        View {
            decoded: DecodedMesh::new(&tree.nodes, &vertices, &triangles),
            triangles,
            vertices,
            tree,
            surface,
        }
    }

    fn mesh(&self) -> Mesh<'_> {
        Mesh {
            nodes: &self.tree.nodes,
            vertices: &self.vertices,
            triangles: &self.triangles,
            decoded: Some(&self.decoded),
        }
    }

    fn direction(pixel: usize) -> Vec3 {
        let forward = (Vec3::new(0.0, 0.0, -0.1) - EYE).normalize();
        let right = forward.cross(Vec3::Z).normalize();
        let up = right.cross(forward);
        let offset = |i: usize| ((i as f32 + 0.5) / SIDE as f32 - 0.5) * 0.76;
        forward + right * offset(pixel % SIDE) - up * offset(pixel / SIDE)
    }

    fn first_hit(&self, level: Level, pixel: usize) -> Nearest {
        let line = Line::new(EYE, View::direction(pixel), PAD);
        closest(level, &self.mesh(), &line, 0.0, u32::MAX, MISS)
    }

    /// Returns a ray from the first hit of a pixel in a pseudorandom direction, distributed with the cosine.
    fn bounced(&self, pixel: usize, hit: Nearest) -> Option<MeshRay> {
        let triangle = self.surface.triangles.get(hit.triangle as usize)?;
        let [a, b, c] = triangle.map(|i| self.surface.corners[i as usize]);
        let ray_direction = View::direction(pixel);
        let normal = (b - a).cross(c - a).normalize();
        let normal = normal * -normal.dot(ray_direction).signum();
        let random = |salt: u32| {
            let mut x = (pixel as u32).wrapping_mul(0x9e37_79b9) ^ salt;
            for multiplier in [0x85eb_ca6b, 0xc2b2_ae35] {
                x = (x ^ x >> 15).wrapping_mul(multiplier);
            }
            (x >> 8) as f32 / 16_777_216.0
        };
        let (z, angle) = (1.0 - 2.0 * random(1), std::f32::consts::TAU * random(2));
        let r = (1.0 - z * z).sqrt();
        let on_sphere = Vec3::new(r * angle.cos(), r * angle.sin(), z);
        let origin = EYE + ray_direction * hit.t + normal * 1e-4;
        Some(MeshRay::new(origin, normal + on_sphere, PAD, 0.0, hit.triangle, MISS))
    }

    /// Returns the mask of occluded samples; `None` if the light is behind the surface or the ray misses.
    fn occluded(&self, level: Level, pixel: usize, hit: Nearest) -> Option<u32> {
        let triangle = self.surface.triangles.get(hit.triangle as usize)?;
        let [a, b, c] = triangle.map(|i| self.surface.corners[i as usize]);
        let ray_direction = View::direction(pixel);
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(ray_direction) > 0.0 {
            -normal
        } else {
            normal
        };
        let origin = EYE + ray_direction * hit.t + normal * 1e-4;
        let directions: [Vec3; 16] = std::array::from_fn(|i| {
            let (u, v) = ((i % 4) as f32 * 0.2 - 0.3, (i / 4) as f32 * 0.2 - 0.3);
            Vec3::new(2.0 + u, -2.0 + v, 4.0) - origin
        });
        if directions.iter().all(|d| d.dot(normal) <= 0.0) {
            return None;
        }
        let segments = Segments {
            o: origin,
            pad: PAD,
            directions: &Directions::new(&directions),
            t_max: 1.0,
            skip: hit.triangle,
        };
        Some(occluded(level, &self.mesh(), &segments, 0xffff))
    }
}

/// Rays to trace interleaved, and the number of hits.
struct Rays<'a> {
    mesh: &'a DecodedMesh,
    rays: std::slice::Iter<'a, MeshRay>,
    hits: usize,
}

impl<'a, S> RaySource<'a, S> for Rays<'a> {
    #[inline(always)]
    fn next(&mut self, _simd: S, _lane: usize, traced: Option<Traced>) -> Next<'a> {
        self.hits += usize::from(traced.is_some_and(|traced| traced.best != MISS));
        match self.rays.next() {
            Some(ray) => Next::Trace(self.mesh, *ray),
            None => Next::Done,
        }
    }
}

/// Benchmarks rays after a bounce, with one thread. `benches/peers/embree.c` times Embree on the same rays.
fn bounced_rays(criterion: &mut Criterion) {
    let view = View::new();
    let level = Level::new();
    let pixels = (0..SIDE * SIDE).filter_map(|i| view.bounced(i, view.first_hit(level, i)));
    let rays: Vec<MeshRay> = pixels.collect();
    let mut group = criterion.benchmark_group("bounced rays, one thread");
    group.sample_size(20);
    group.throughput(Throughput::Elements(rays.len() as u64));
    let one_by_one = || {
        let found = rays
            .iter()
            .map(|ray| closest(level, &view.mesh(), &ray.line, 0.0, ray.skip, MISS));
        found.filter(|found| *found != MISS).count()
    };
    let mut stacks: [NodeStack; RAYS] = Default::default();
    let mut interleaved = || {
        let mut source = Rays {
            mesh: &view.decoded,
            rays: rays.iter(),
            hits: 0,
        };
        dispatch!(level, simd => trace::<_, false>(simd, &mut stacks, &mut source));
        source.hits
    };
    assert_eq!(one_by_one(), interleaved());
    println!("bounced rays: {} of {} hit", interleaved(), rays.len());
    group.bench_function("one by one", |b| b.iter(one_by_one));
    group.bench_function("interleaved", |b| b.iter(&mut interleaved));
    group.finish();
}

fn traversals(criterion: &mut Criterion) {
    let view = View::new();
    let level = Level::new();
    let pixels = SIDE * SIDE;
    let hits: Vec<Nearest> = (0..pixels).map(|i| view.first_hit(level, i)).collect();
    let lit_pixels = (0..pixels).filter_map(|i| view.occluded(level, i, hits[i])).count();
    let mut group = criterion.benchmark_group("traverse 70k triangles");
    group.sample_size(20);
    group.throughput(Throughput::Elements(pixels as u64));
    group.bench_function("camera rays", |b| {
        b.iter(|| -> usize {
            let rays = (0..pixels).into_par_iter().with_min_len(SIDE);
            rays.filter(|i| view.first_hit(level, *i).triangle != u32::MAX).count()
        });
    });
    group.throughput(Throughput::Elements(16 * lit_pixels as u64));
    group.bench_function("16 shadow rays to a light", |b| {
        b.iter(|| -> u32 {
            let rays = (0..pixels).into_par_iter().with_min_len(SIDE);
            rays.map(|i| view.occluded(level, i, hits[i]).unwrap_or(0).count_ones())
                .sum()
        });
    });
    group.finish();
}

criterion_group!(trees, builds, traversals, bounced_rays);
criterion_main!(trees);
