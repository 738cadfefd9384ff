//! Hits and occlusion do not depend on the BVH: brute force as in `docs/decisions/trees.md`, the built BVHs and
//! arbitrary BVHs give the same bits.

use std::sync::Arc;

use glam::{UVec2, Vec3, Vec4Swizzles as _};
use proptest::strategy::{Strategy as _, ValueTree as _};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use wgray_trace::bvh::{self, Aabb, DecodedOnce};
use wgray_trace::cpu::geometry::{closest_hit, occluded_samples};
use wgray_trace::cpu::light::{segment, segments_to_light};
use wgray_trace::cpu::linear_primitives::{closest_primitive, occluded_by_primitives};
use wgray_trace::cpu::mesh::{highest, lowest, mesh_pad, point_to_mesh, shear_of, triangle_crossing, vector_to_mesh};
use wgray_trace::cpu::primitive::intersect;
use wgray_trace::cpu::ray::{Hit, Ray, nearer_hit, no_hit, standalone_prim};
use wgray_trace::cpu::shadow::{SampleBlock, block_sample, occlusion_mask};
use wgray_trace::cpu::slab::{box_interval, interval_hits, slabs};
use wgray_trace::cpu::surface::{Surface, largest};
use wgray_trace::records::{
    BvhItem, CASTS_SHADOW, INFINITE_T, INSTANCE, Instance, Light, NO_INDEX, NO_PRIMITIVE, NO_SHADOW, Packed, RANDOM,
    SAMPLE_BLOCK,
};

use super::procedural::{SCENE_START, TriangleMesh, scene};
use crate::random::Random;
use crate::random_scenes::any_scene;
use crate::scenes;

/// Returns the corners of a triangle in object space.
fn corners(scene: &Packed, instance: &Instance, slot: usize) -> [Vec3; 3] {
    let mesh = &scene.bvh.meshes[instance.mesh as usize];
    let triangle = mesh.triangles[slot];
    [triangle.x, triangle.y, triangle.z].map(|vertex| mesh.vertices[vertex as usize].xyz())
}

fn padding(scene: &Packed, origin: Vec3) -> f32 {
    scene.counts.item_padding.x * (largest(origin) + scene.counts.item_padding.y)
}

/// Returns the closest hit by brute force, without culling by distance.
fn brute_force_hit(scene: &Packed, ray: Ray, origin_prim: UVec2, inside_prim: UVec2) -> Hit {
    let mut hit = closest_primitive(scene, ray, standalone_prim(origin_prim), standalone_prim(inside_prim));
    let world = slabs(ray.origin, ray.direction, padding(scene, ray.origin));
    for item in &scene.bvh.items {
        let interval = box_interval(item.low, item.high, world);
        if !interval_hits(interval, INFINITE_T) {
            continue;
        }
        let kind = item.kind & 0xff;
        if kind != INSTANCE {
            let from_inside = item.index == standalone_prim(inside_prim);
            let t = intersect(
                kind,
                &scene.primitives[item.index as usize],
                from_inside,
                ray,
                INFINITE_T,
            );
            if t < INFINITE_T && item.index != standalone_prim(origin_prim) {
                let found = Hit {
                    t: t.max(interval.x),
                    primitive: item.index,
                    ..no_hit()
                };
                hit = nearer_hit(hit, found);
            }
            continue;
        }
        let instance = &scene.bvh.instances[item.index as usize];
        let t_min = interval.x.max(0.0);
        let direction = vector_to_mesh(instance, ray.direction);
        let origin = point_to_mesh(instance, ray.origin) + direction * t_min;
        let s = slabs(origin, direction, mesh_pad(instance, origin));
        for (slot, triangle) in scene.bvh.meshes[instance.mesh as usize].triangles.iter().enumerate() {
            let [v0, v1, v2] = corners(scene, instance, slot);
            let crossing = triangle_crossing(v0, v1, v2, origin, shear_of(direction), s);
            let found = Hit {
                t: t_min + crossing.t.max(0.0),
                instance: item.index + 1,
                primitive: triangle.w,
                slot: slot as u32,
                barycentric: crossing.barycentric,
            };
            let is_origin = origin_prim == UVec2::new(found.instance, found.primitive);
            if crossing.is_hit && found.t > 0.0 && !is_origin {
                hit = nearer_hit(hit, found);
            }
        }
    }
    hit
}

/// Returns the mask of occluded samples by brute force.
fn brute_force_occlusion(scene: &Packed, surface: &Surface, light: &Light, block: SampleBlock) -> u32 {
    let mut bits = occluded_by_primitives(scene, surface, light, block);
    let origin = surface.ray_origin;
    let segments = segments_to_light(light, origin);
    for item in scene.bvh.items.iter().filter(|item| item.kind & CASTS_SHADOW != 0) {
        for sample in 0..block.count {
            let point = block_sample(block, sample);
            let world = slabs(origin, segment(segments, point), padding(scene, origin));
            if !interval_hits(box_interval(item.low, item.high, world), light.t_max) {
                continue;
            }
            let is_occluded = if item.kind & 0xff == INSTANCE {
                let instance = &scene.bvh.instances[item.index as usize];
                let mesh_origin = point_to_mesh(instance, origin);
                let [towards, u, v] = [segments.towards, segments.u, segments.v].map(|v| vector_to_mesh(instance, v));
                let direction = segment(wgray_trace::cpu::light::LightSegments { towards, u, v }, point);
                let s = slabs(mesh_origin, direction, mesh_pad(instance, mesh_origin));
                let mesh = &scene.bvh.meshes[instance.mesh as usize];
                mesh.triangles.iter().enumerate().any(|(slot, triangle)| {
                    let group = mesh.groups.get(slot).copied().unwrap_or(0);
                    let casts_shadows =
                        scene.bvh.group_words[(instance.first_group_word + group) as usize] & NO_SHADOW == 0;
                    let [v0, v1, v2] = corners(scene, instance, slot);
                    let crossing = triangle_crossing(v0, v1, v2, mesh_origin, shear_of(direction), s);
                    let is_origin = surface.exclude_front == UVec2::new(item.index + 1, triangle.w);
                    casts_shadows && !is_origin && crossing.is_hit && crossing.t > 0.0 && crossing.t < light.t_max
                })
            } else {
                let (origin_prim, from_inside) = (
                    standalone_prim(surface.exclude_front),
                    item.index == standalone_prim(surface.exclude_back),
                );
                let q = &scene.primitives[item.index as usize];
                item.index != origin_prim
                    && occlusion_mask(item.kind & 0xff, q, origin, from_inside, light, block) >> sample & 1 == 1
            };
            bits |= u32::from(is_occluded) << sample;
        }
    }
    bits
}

/// Random rays from and to points on triangles, edges, vertices and box corners.
struct RaySampler<'a> {
    scene: &'a Packed,
    random: &'a Random,
    low: Vec3,
    high: Vec3,
}

impl<'a> RaySampler<'a> {
    fn new(scene: &'a Packed, random: &'a Random) -> RaySampler<'a> {
        let boxes = scene.bvh.items.iter().map(|item| (item.low, item.high));
        let (low, high) = boxes.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), (l, h)| {
            (low.min(l), high.max(h))
        });
        RaySampler {
            scene,
            random,
            low,
            high,
        }
    }

    fn unit(&self) -> f32 {
        self.random.unit() as f32
    }

    fn random_point(&self) -> Vec3 {
        let center = (self.low + self.high) * 0.5;
        let relative = Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0;
        center + relative * (self.high - center) * self.random.pick(&[1.0, 2.0, 20.0])
    }

    /// Returns a point and the triangle that it lies on, if any.
    fn random_target(&self) -> (Vec3, UVec2) {
        let (scene, random) = (self.scene, self.random);
        let item: &BvhItem = &scene.bvh.items[random.below(scene.bvh.items.len() as u32) as usize];
        if item.kind & 0xff != INSTANCE || random.once_in(8) {
            let corner = Vec3::select(
                glam::BVec3::new(random.once_in(2), random.once_in(2), random.once_in(2)),
                item.low,
                item.high,
            );
            let point = if random.once_in(4) {
                corner
            } else {
                item.low + (item.high - item.low) * self.unit()
            };
            return (point, NO_PRIMITIVE);
        }
        let instance = &scene.bvh.instances[item.index as usize];
        let slot = random.below(scene.bvh.meshes[instance.mesh as usize].triangles.len() as u32) as usize;
        let [a, b, c] = corners(scene, instance, slot);
        let p = match random.below(4) {
            0 => a,
            1 => a + (b - a) * self.unit(),
            _ => {
                let (x, y) = (self.unit() * 0.5, self.unit() * 0.5);
                a + (b - a) * x + (c - a) * y
            }
        };
        let point = instance.anchor + instance.u * p.x + instance.v * p.y + instance.w * p.z;
        (
            point,
            UVec2::new(
                item.index + 1,
                scene.bvh.meshes[instance.mesh as usize].triangles[slot].w,
            ),
        )
    }

    fn ray(&self) -> (Ray, UVec2) {
        let (start, start_prim) = if self.random.once_in(3) {
            self.random_target()
        } else {
            (self.random_point(), NO_PRIMITIVE)
        };
        let (target, _) = self.random_target();
        let direction = match self.random.below(8) {
            0 => self.random.pick(&Vec3::AXES) * self.random.pick(&[1.0, -1.0]),
            1 => target - start,
            2 => Vec3::new(target.x - start.x, target.y - start.y, 0.0).normalize_or(Vec3::X),
            _ => (target - start).normalize_or(Vec3::X),
        };
        let origin_prim = if self.random.once_in(2) {
            start_prim
        } else {
            NO_PRIMITIVE
        };
        (
            Ray {
                origin: start,
                direction,
            },
            origin_prim,
        )
    }

    fn shadow(&self) -> (Surface, Light, SampleBlock) {
        let (start, start_prim) = if self.random.once_in(2) {
            self.random_target()
        } else {
            (self.random_point(), NO_PRIMITIVE)
        };
        let (end, _) = self.random_target();
        let size = (self.high - self.low).max_element() * self.random.pick(&[0.0, 0.1, 1.0]);
        let edge = || (Vec3::new(self.unit(), self.unit(), self.unit()) - 0.5) * size;
        let mut light: Light = bytemuck::Zeroable::zeroed();
        light.primitive = NO_INDEX;
        (light.u, light.v) = (edge(), edge());
        if self.random.once_in(4) {
            (light.center, light.finite, light.t_max) = ((end - start).normalize_or(Vec3::Z), 0.0, 1e10);
        } else {
            light.center = start + (end - start) * self.random.pick(&[0.5, 1.0, 2.0]);
            (light.finite, light.t_max) = (1.0, 1.0 - 1e-5);
        }
        let mut surface = unused_surface();
        surface.ray_origin = start;
        (surface.exclude_front, surface.exclude_back) = (start_prim, start_prim);
        let key = UVec2::new(self.random.bits() as u32, self.random.bits() as u32);
        let count = self.random.pick(&[1, 7, SAMPLE_BLOCK]);
        let block = SampleBlock {
            pattern: RANDOM,
            side: 1,
            first: 0,
            count,
            group: 3,
            key,
        };
        (surface, light, block)
    }
}

fn unused_surface() -> Surface {
    let zero = Vec3::ZERO;
    Surface {
        position: zero,
        normal: Vec3::Z,
        smooth_normal: Vec3::Z,
        shading_normal: Vec3::Z,
        wo: Vec3::Z,
        ray_origin: zero,
        terminator_offset: zero,
        side: 1.0,
        exclude_front: NO_PRIMITIVE,
        exclude_back: NO_PRIMITIVE,
        uv: zero.truncate(),
        du: zero,
        dv: zero,
    }
}

/// Returns the bits of a hit except the slot, which depends on the BVH.
fn bits(hit: Hit) -> [u32; 5] {
    let [u, v] = hit.barycentric.to_array().map(f32::to_bits);
    [hit.t.to_bits(), hit.instance, hit.primitive, u, v]
}

/// Returns four numbers: rays and shadow blocks that differ from brute force, hits, and occluded shadow blocks.
fn differing(scene: &Packed, rays: u32, seed: u64) -> [u32; 4] {
    let random = Random::new(seed);
    let sampler = RaySampler::new(scene, &random);
    let [mut wrong_hits, mut wrong_shadows, mut hit_count, mut occluded_count] = [0; 4];
    for _ in 0..rays {
        let (ray, origin_prim) = sampler.ray();
        let expected = brute_force_hit(scene, ray, origin_prim, NO_PRIMITIVE);
        let found = closest_hit(scene, ray, origin_prim, NO_PRIMITIVE);
        wrong_hits += u32::from(bits(expected) != bits(found) || expected.slot != found.slot);
        hit_count += u32::from(expected.primitive != NO_INDEX);
        let (surface, light, block) = sampler.shadow();
        let expected = brute_force_occlusion(scene, &surface, &light, block);
        // Unlit samples are not traced.
        let unlit = random.pick(&[0, random.pick(&[0x5555_5555, 0xffff_0000, 1])]) & u32::MAX >> (32 - block.count);
        wrong_shadows += u32::from(expected | unlit != occluded_samples(scene, &surface, &light, block, unlit));
        occluded_count += u32::from(expected != 0);
    }
    [wrong_hits, wrong_shadows, hit_count, occluded_count]
}

/// A function that builds a BVH over boxes and returns its nodes and the order of the boxes.
type Builder<'a> = &'a dyn Fn(&[Aabb]) -> (Vec<bvh::Node>, Vec<u32>);

fn with_bvhs(scene: &Packed, build: Builder) -> Packed {
    let mut scene = scene.clone();
    let boxes: Vec<Aabb> = scene
        .bvh
        .items
        .iter()
        .map(|item| Aabb {
            low: item.low,
            high: item.high,
        })
        .collect();
    let (nodes, order) = build(&boxes);
    scene.bvh.nodes = bytemuck::cast_vec(nodes);
    scene.bvh.items = order.iter().map(|i| scene.bvh.items[*i as usize]).collect();
    for mesh in &mut scene.bvh.meshes {
        let mesh = Arc::make_mut(mesh);
        mesh.decoded = DecodedOnce::default();
        let position = |vertex: u32| mesh.vertices[vertex as usize].xyz();
        let bounds = |t: &glam::UVec4| {
            let [a, b, c] = [t.x, t.y, t.z].map(position);
            Aabb {
                low: lowest(a, b, c),
                high: highest(a, b, c),
            }
        };
        let boxes: Vec<Aabb> = mesh.triangles.iter().map(bounds).collect();
        let (nodes, order) = build(&boxes);
        mesh.nodes = bytemuck::cast_vec(nodes);
        mesh.triangles = order.iter().map(|i| mesh.triangles[*i as usize]).collect();
        if !mesh.groups.is_empty() {
            mesh.groups = order.iter().map(|i| mesh.groups[*i as usize]).collect();
        }
    }
    scene
}

fn build_bvh(boxes: &[Aabb], max_leaf_size: u32) -> (Vec<bvh::Node>, Vec<u32>) {
    let tree = bvh::build(boxes, max_leaf_size);
    (tree.nodes, tree.order)
}

fn random_bvh(boxes: &[Aabb], random: &Random) -> (Vec<bvh::Node>, Vec<u32>) {
    let empty: bvh::Node = bytemuck::Zeroable::zeroed();
    let (mut nodes, mut order) = (vec![empty], Vec::new());
    let mut pending = std::collections::VecDeque::from([(0, (0..boxes.len() as u32).collect::<Vec<_>>())]);
    while let Some((node_index, items)) = pending.pop_front() {
        let union = |items: &[u32]| items.iter().fold(Aabb::EMPTY, |all, i| all.with(&boxes[*i as usize]));
        let bounds = union(&items);
        let mut node = grid(&bounds);
        node.first_item = order.len() as u32;
        node.first_child = nodes.len() as u32;
        let mut children: Vec<Vec<u32>> = vec![Vec::new(); 8];
        let used = 2 + random.below(7) as usize;
        for (i, item) in items.iter().enumerate() {
            children[(i * 5 + random.below(2) as usize) % used].push(*item);
        }
        for (slot, child) in children.iter().enumerate() {
            (0..3).for_each(|axis| (node.low[axis][slot], node.high[axis][slot]) = (255, 0));
            if child.is_empty() {
                continue;
            }
            set_bounds(&mut node, slot, &union(child));
            if child.len() <= 1 + random.below(4) as usize {
                node.leaves[slot] = (child.len() << 5 | (order.len() - node.first_item as usize)) as u8;
                order.extend(child);
            } else {
                node.inner |= 1 << slot;
                pending.push_back((nodes.len(), child.clone()));
                nodes.push(empty);
            }
        }
        nodes[node_index] = node;
    }
    (nodes, order)
}

/// Returns a node without children whose grid covers the bounds.
fn grid(bounds: &Aabb) -> bvh::Node {
    let mut node: bvh::Node = bytemuck::Zeroable::zeroed();
    node.base = bounds.low.to_array();
    node.exponents = [0, 1, 2].map(|axis| {
        let reaches = |e: &u8| bounds.low[axis] + 255.0 * f32::from_bits(u32::from(*e) << 23) >= bounds.high[axis];
        (0..=254).find(reaches).expect("a grid as large as a box")
    });
    node
}

fn set_bounds(node: &mut bvh::Node, slot: usize, bounds: &Aabb) {
    for axis in 0..3 {
        let step = f32::from_bits(u32::from(node.exponents[axis]) << 23);
        let coordinate = |q: u8| node.base[axis] + f32::from(q) * step;
        let low = (0..=255).rev().find(|q| coordinate(*q) <= bounds.low[axis]);
        let high = (0..=255).find(|q| coordinate(*q) >= bounds.high[axis]);
        node.low[axis][slot] = low.expect("a box inside the parent box");
        node.high[axis][slot] = high.expect("a box inside the parent box");
    }
}

/// Returns a BVH whose upper bounds are one grid step too small.
fn build_too_small(boxes: &[Aabb]) -> (Vec<bvh::Node>, Vec<u32>) {
    let (mut nodes, order) = build_bvh(boxes, 2);
    for node in &mut nodes {
        for (low, high) in node.low.iter().zip(&mut node.high) {
            for (low, high) in low.iter().zip(high) {
                *high -= u8::from(*high > *low);
            }
        }
    }
    (nodes, order)
}

/// Returns a scene with spheres and with instances of random triangles. Some instances are mirrored, sheared or tiny,
/// some have groups, and some are of glass and cast no shadow.
fn soups() -> Packed {
    let folder = tempfile::tempdir().expect("a folder");
    let random = Random::new(11);
    std::fs::write(
        folder.path().join("a.obj"),
        TriangleMesh::soup(300, &random).obj(None, None),
    )
    .expect("a mesh");
    std::fs::write(
        folder.path().join("b.obj"),
        TriangleMesh::soup(37, &random).obj(None, None),
    )
    .expect("a mesh");
    let mut text = format!(
        "{SCENE_START}[render]
        shadows = 'transparent'
        [meshes.a]
        file = 'a.obj'
        [meshes.b]
        file = 'b.obj'
        up = 'y'
        [[instances]]
        mesh = 'a'
        material = 'm'
        materials = {{ second = 'glass' }}
        [[instances]]
        mesh = 'a'
        material = 'm'
        scale = [-0.7, 1.2, 0.4]
        rotate = [20, 30, 40]
        [[instances]]
        mesh = 'b'
        material = 'm'
        matrix = [[0.5, 0.4, 0, 0.3], [0, 0.5, 0.1, -0.2], [0.3, 0, -0.9, 0.1]]
        [[instances]]
        mesh = 'b'
        material = 'glass'
        scale = 0.001
        translate = [0.2, 0.1, 0]
        [[instances]]
        mesh = 'a'
        material = 'm'
        scale = 1e3
        "
    );
    for _ in 0..80 {
        let [x, y, z] = [(); 3].map(|()| random.between(-1.0, 1.0));
        let material = random.pick(&["m", "glass"]);
        text += &format!(
            "[[shapes]]\ntype = 'sphere'\nmaterial = '{material}'\ncenter = [{x}, {y}, {z}]\nradius = {}\n",
            random.between(0.01, 0.3)
        );
    }
    scene(&text, folder.path())
}

#[test]
fn bvhs_miss_no_hit_and_no_shadow() {
    for (name, scene, rays) in [
        ("soups", soups(), 6000),
        ("knots", scenes::packed(&scenes::scene("twisted-tube.toml")), 600),
    ] {
        assert!(!scene.bvh.items.is_empty());
        let [wrong_hits, wrong_shadows, hit_count, occluded_count] = differing(&scene, rays, 1);
        println!("{name}: {hit_count} of {rays} rays hit, {occluded_count} shadow blocks are occluded");
        assert!(
            hit_count > rays / 4 && occluded_count > rays / 10,
            "{name}: {hit_count} {occluded_count}"
        );
        assert_eq!((wrong_hits, wrong_shadows), (0, 0), "{name}: {rays} rays");
    }
}

/// Returns the numbers of rays and of shadow blocks that differ between two scenes.
fn differing_between(a: &Packed, b: &Packed, rays: u32) -> [u32; 2] {
    let random = Random::new(3);
    let sampler = RaySampler::new(a, &random);
    let [mut wrong_hits, mut wrong_shadows] = [0; 2];
    for _ in 0..rays {
        let (ray, origin_prim) = sampler.ray();
        let found = [a, b].map(|scene| bits(closest_hit(scene, ray, origin_prim, NO_PRIMITIVE)));
        wrong_hits += u32::from(found[0] != found[1]);
        let (surface, light, block) = sampler.shadow();
        let found = [a, b].map(|scene| occluded_samples(scene, &surface, &light, block, 0));
        wrong_shadows += u32::from(found[0] != found[1]);
    }
    [wrong_hits, wrong_shadows]
}

#[test]
fn any_other_bvh_gives_the_same_bits() {
    let random = Random::new(2);
    for (name, scene) in [
        ("soups", soups()),
        ("knots", scenes::packed(&scenes::scene("twisted-tube.toml"))),
    ] {
        for max_leaf_size in 1..=4 {
            let other_scene = with_bvhs(&scene, &|boxes| build_bvh(boxes, max_leaf_size));
            assert_eq!(
                differing_between(&scene, &other_scene, 4000),
                [0, 0],
                "{name}, at most {max_leaf_size} per leaf"
            );
        }
        let other_scene = with_bvhs(&scene, &|boxes| random_bvh(boxes, &random));
        assert_ne!(other_scene.bvh.nodes, scene.bvh.nodes);
        assert_eq!(
            differing_between(&scene, &other_scene, 250),
            [0, 0],
            "{name}, a random BVH"
        );
    }
}

#[test]
fn a_bvh_with_too_small_boxes_is_detected() {
    let scene = soups();
    let [hits, shadows] = differing_between(&scene, &with_bvhs(&scene, &build_too_small), 20_000);
    println!("{hits} hits and {shadows} shadow blocks of 20000 differ");
    assert!(hits > 10 && shadows > 10, "{hits} {shadows}");
}

#[test]
fn bvhs_of_random_scenes_miss_no_hit_and_no_shadow() {
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let strategy = any_scene::description();
    let mut with_bvh = 0;
    for case in 0..60 {
        let scene = any_scene::packed(&strategy.new_tree(&mut runner).expect("a scene").current());
        if scene.bvh.items.is_empty() {
            continue;
        }
        with_bvh += 1;
        let [hits, shadows, ..] = differing(&scene, 100, case);
        assert_eq!((hits, shadows), (0, 0), "random scene {case}");
    }
    assert!(with_bvh > 12, "{with_bvh} scenes have a BVH");
}
