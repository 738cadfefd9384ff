//! Closest-hit and occlusion queries of the scene's BVHs: the results of `shaders/bvh.wgsl`, computed by [`traversal`].

use std::rc::Rc;

use bytemuck::cast_slice;
use glam::{UVec2, Vec2, Vec3, Vec4Swizzles as _};

use super::bits::bits_of;
use super::geometry::triangle_casts;
use super::lanes::{Vector3, constant};
use super::light::{LightSegments, segments_to_light};
use super::linear_primitives::is_occluded_by_primitive;
use super::math::max;
use super::mesh::{mesh_pad, point_to_mesh, shear_of, triangle_crossing, vector_to_mesh};
use super::primitive::intersect;
use super::ray::{Hit, Ray, nearer_hit, no_hit, standalone_prim};
use super::samples::{LEVEL, Samples, box_hits};
use super::shadow::{SampleBlock, occlusion_mask};
use super::slab::{Slabs, box_interval, interval_hits, slabs};
use super::surface::{Surface, largest};
use super::traversal::{self, Directions, Line, MeshRay, Nearest};
use crate::bvh::{Aabb, Node};
use crate::records::{
    BvhItem, CASTS_SHADOW, INFINITE_T, INSTANCE, Instance, Light, NO_INDEX, Packed, PackedMesh, SOME_SHADOWS,
    with_primitive_kind,
};

/// Maximum number of items tested without the BVH: in a small BVH, rays hit most nodes.
pub const FEW_ITEMS: usize = 4;

#[inline(always)]
pub fn item_pad<V: Vector3>(scene: &Packed, origin: V) -> V::Real {
    constant(scene.counts.item_padding.x) * (largest(origin) + scene.counts.item_padding.y)
}

pub fn closest_in_bvh(scene: &Packed, before: Hit, ray: Ray, origin_prim: UVec2, inside_prim: UVec2) -> Hit {
    let mut hit = before;
    let pad = item_pad(scene, ray.origin);
    let s = slabs(ray.origin, ray.direction, pad);
    if scene.bvh.items.len() <= FEW_ITEMS {
        for item in &scene.bvh.items {
            hit = closest_of_item(scene, hit, item, ray, s, origin_prim, inside_prim);
        }
        return hit;
    }
    let line = Line::new(ray.origin, ray.direction, pad);
    let nodes: &[Node] = cast_slice(&scene.bvh.nodes);
    traversal::leaves(*LEVEL, nodes, &line, hit.t, |items, _| {
        for item in &scene.bvh.items[items] {
            hit = closest_of_item(scene, hit, item, ray, s, origin_prim, inside_prim);
        }
        hit.t
    });
    hit
}

fn closest_of_item(
    scene: &Packed,
    before: Hit,
    item: &BvhItem,
    ray: Ray,
    s: Slabs,
    origin_prim: UVec2,
    inside_prim: UVec2,
) -> Hit {
    let interval = box_interval(item.low, item.high, s);
    if !interval_hits(interval, before.t) {
        return before;
    }
    match item.kind & 0xff {
        INSTANCE => closest_of_mesh(scene, before, item.index, ray, max(interval.x, 0.0), origin_prim),
        _ => closest_of_primitive(scene, before, item, ray, interval.x, origin_prim, inside_prim),
    }
}

/// Intersects a ray with an item that is a primitive, and returns this hit or `before`, whichever is closer. `near` is
/// the distance to the item's box.
pub fn closest_of_primitive(
    scene: &Packed,
    before: Hit,
    item: &BvhItem,
    ray: Ray,
    near: f32,
    origin_prim: UVec2,
    inside_prim: UVec2,
) -> Hit {
    let i = item.index;
    let is_inside = i == standalone_prim(inside_prim);
    let t = with_primitive_kind!(item.kind & 0xff, |kind| intersect(
        kind,
        &scene.primitives[i as usize],
        is_inside,
        ray,
        INFINITE_T
    ));
    let found = Hit {
        t: if i == standalone_prim(origin_prim) {
            INFINITE_T
        } else {
            max(t, near)
        },
        primitive: i,
        ..no_hit()
    };
    nearer_hit(before, found)
}

fn closest_of_mesh(scene: &Packed, before: Hit, instance_index: u32, ray: Ray, start: f32, origin_prim: UVec2) -> Hit {
    let MeshRay {
        line,
        start,
        skip,
        best,
        ..
    } = closest_mesh_ray(scene, before, instance_index, ray, start, origin_prim);
    let mesh = instance_mesh(scene, instance_index);
    let found = traversal::closest(*LEVEL, &mesh, &line, start, skip, best);
    if found.slot == NO_INDEX {
        return before;
    }
    let [a, b, c, _] = mesh.triangles[found.slot as usize];
    let vertices = [
        &mesh.vertices[a as usize],
        &mesh.vertices[b as usize],
        &mesh.vertices[c as usize],
    ];
    mesh_hit(instance_index, found, line.barycentric(vertices))
}

/// Returns a ray in the object space of an instance, from `start` on, that searches for hits closer than `before`.
#[inline(always)]
pub fn closest_mesh_ray(
    scene: &Packed,
    before: Hit,
    instance_index: u32,
    ray: Ray,
    start: f32,
    origin_prim: UVec2,
) -> MeshRay {
    let i = &scene.bvh.instances[instance_index as usize];
    let direction = vector_to_mesh(i, ray.direction);
    let origin = point_to_mesh(i, ray.origin) + direction * start;
    // At equal distance, a hit wins if its triangle index is smaller than `best.triangle`. Instances must win only over
    // instances with larger indices.
    let best = Nearest {
        t: before.t,
        triangle: if instance_index + 1 < before.instance {
            NO_INDEX
        } else {
            0
        },
        slot: NO_INDEX,
    };
    let skip = excluded_triangle(origin_prim, instance_index);
    MeshRay::new(origin, direction, mesh_pad(i, origin), start, skip, best)
}

fn instance_mesh(scene: &Packed, instance_index: u32) -> traversal::Mesh<'_> {
    traversal_mesh(&scene.bvh.meshes[scene.bvh.instances[instance_index as usize].mesh as usize])
}

/// Returns the hit that a ray of [`closest_mesh_ray`] has found.
#[inline(always)]
pub fn mesh_hit(instance_index: u32, found: Nearest, barycentric: [f32; 2]) -> Hit {
    Hit {
        t: found.t,
        instance: instance_index + 1,
        primitive: found.triangle,
        slot: found.slot,
        barycentric: Vec2::from_array(barycentric),
    }
}

/// Returns the index of the instance's triangle that a ray or segment from `origin_prim` must not hit, if any.
#[inline(always)]
fn excluded_triangle(origin_prim: UVec2, instance_index: u32) -> u32 {
    if origin_prim.x == instance_index + 1 {
        origin_prim.y
    } else {
        NO_INDEX
    }
}

pub fn traversal_mesh(mesh: &PackedMesh) -> traversal::Mesh<'_> {
    traversal::Mesh {
        nodes: cast_slice(&mesh.nodes),
        vertices: cast_slice(&mesh.vertices),
        triangles: cast_slice(&mesh.triangles),
        decoded: mesh.decoded.get(),
    }
}

fn corners(mesh: &PackedMesh, slot: usize) -> [Vec3; 3] {
    let triangle = mesh.triangles[slot];
    [triangle.x, triangle.y, triangle.z].map(|vertex| mesh.vertices[vertex as usize].xyz())
}

/// The shadow rays from a surface to a block of light samples.
struct Rays<'a> {
    surface: &'a Surface,
    light: &'a Light,
    block: SampleBlock,
    light_segments: LightSegments,
    samples: Rc<Samples>,
}

/// Returns the mask of the block's samples that an item occludes or that are set in `already_occluded`.
pub fn occluded_by_bvh(
    scene: &Packed,
    already_occluded: u32,
    surface: &Surface,
    light: &Light,
    block: SampleBlock,
) -> u32 {
    let all_samples = u32::MAX >> (32 - block.count);
    let untested = all_samples & !already_occluded;
    if untested == 0 {
        return all_samples;
    }
    let rays = Rays {
        surface,
        light,
        block,
        light_segments: segments_to_light(light, surface.ray_origin),
        samples: Samples::of(block),
    };
    let mut directions = Directions::EMPTY;
    rays.samples
        .write_segments(*LEVEL, rays.light_segments, &mut directions);
    let pad = item_pad(scene, surface.ray_origin);
    let mut occluded = already_occluded & all_samples;
    if scene.bvh.items.len() <= FEW_ITEMS {
        for item in scene.bvh.items.iter().filter(|item| item.kind & CASTS_SHADOW != 0) {
            let hits = box_hits(item.low, item.high, surface.ray_origin, pad, &directions, light.t_max);
            let candidates = hits & !occluded;
            if candidates != 0 {
                occluded |= occluded_by_item(scene, item, candidates, &rays);
            }
        }
        return occluded;
    }
    let segments = traversal::Segments {
        o: surface.ray_origin,
        pad,
        directions: &directions,
        t_max: light.t_max,
        skip: NO_INDEX,
    };
    let bounds = |i: usize| {
        let BvhItem { low, high, kind, .. } = scene.bvh.items[i];
        (kind & CASTS_SHADOW != 0).then_some(Aabb { low, high })
    };
    let visit = |i: usize, candidates| occluded_by_item(scene, &scene.bvh.items[i], candidates, &rays);
    occluded |= traversal::occluded_items(*LEVEL, cast_slice(&scene.bvh.nodes), &segments, untested, bounds, visit);
    occluded
}

fn occluded_by_item(scene: &Packed, item: &BvhItem, candidates: u32, rays: &Rays) -> u32 {
    let i = item.index;
    let kind = item.kind & 0xff;
    if kind != INSTANCE && i == standalone_prim(rays.surface.exclude_front) {
        return 0;
    }
    let is_inside = i == standalone_prim(rays.surface.exclude_back);
    let q = scene.primitives.get(i as usize);
    candidates
        & match kind {
            INSTANCE => occluded_by_mesh(scene, i, candidates, rays),
            kind => with_primitive_kind!(kind, |kind| {
                let start = rays.surface.ray_origin;
                q.map_or(0, |q| occlusion_mask(kind, q, start, is_inside, rays.light, rays.block))
            }),
        }
}

fn occluded_by_mesh(scene: &Packed, instance_index: u32, candidates: u32, rays: &Rays) -> u32 {
    let i = &scene.bvh.instances[instance_index as usize];
    let mesh = &*scene.bvh.meshes[i.mesh as usize];
    let origin = point_to_mesh(i, rays.surface.ray_origin);
    let mesh_segments = LightSegments {
        towards: vector_to_mesh(i, rays.light_segments.towards),
        u: vector_to_mesh(i, rays.light_segments.u),
        v: vector_to_mesh(i, rays.light_segments.v),
    };
    let mut directions = Directions::EMPTY;
    rays.samples.write_segments(*LEVEL, mesh_segments, &mut directions);
    let segments = traversal::Segments {
        o: origin,
        pad: mesh_pad(i, origin),
        directions: &directions,
        t_max: rays.light.t_max,
        skip: excluded_triangle(rays.surface.exclude_front, instance_index),
    };
    if i.shadows == SOME_SHADOWS {
        return occluded_by_groups(scene, i, mesh, &segments, candidates);
    }
    traversal::occluded(*LEVEL, &traversal_mesh(mesh), &segments, candidates)
}

/// Like [`traversal::occluded`], for a mesh with groups that cast no shadow.
fn occluded_by_groups(
    scene: &Packed,
    i: &Instance,
    mesh: &PackedMesh,
    segments: &traversal::Segments,
    candidates: u32,
) -> u32 {
    let bounds = |slot: usize| {
        let casts = mesh.triangles[slot].w != segments.skip && triangle_casts(scene, i, slot as u32);
        casts.then(|| Aabb::around(&corners(mesh, slot)))
    };
    traversal::occluded_items(
        *LEVEL,
        cast_slice(&mesh.nodes),
        segments,
        candidates,
        bounds,
        |slot, box_hits| {
            let [v0, v1, v2] = corners(mesh, slot);
            let mut occluded = 0;
            for sample in bits_of(box_hits) {
                let d = segments.directions.get(sample);
                let s = slabs(segments.o, d, segments.pad);
                let found = triangle_crossing(v0, v1, v2, segments.o, shear_of(d), s);
                if found.is_hit & (found.t > 0.0) & (found.t < segments.t_max) {
                    occluded |= 1 << sample;
                }
            }
            occluded
        },
    )
}

/// Returns true if an item, except `target_prim`, occludes the segment from the surface along `t_max * to_light`.
pub fn is_occluded_by_bvh(scene: &Packed, surface: &Surface, to_light: Vec3, t_max: f32, target_prim: u32) -> bool {
    let pad = item_pad(scene, surface.ray_origin);
    let s = slabs(surface.ray_origin, to_light, pad);
    let occludes = |item: &BvhItem| {
        let casts = item.kind & CASTS_SHADOW != 0;
        casts
            && interval_hits(box_interval(item.low, item.high, s), t_max)
            && is_occluded_by_item(scene, item, surface, to_light, t_max, target_prim)
    };
    if scene.bvh.items.len() <= FEW_ITEMS {
        return scene.bvh.items.iter().any(occludes);
    }
    let line = Line::new(surface.ray_origin, to_light, pad);
    let mut occluded = false;
    traversal::leaves(*LEVEL, cast_slice(&scene.bvh.nodes), &line, t_max, |items, limit| {
        occluded |= scene.bvh.items[items].iter().any(occludes);
        if occluded { f32::NEG_INFINITY } else { limit }
    });
    occluded
}

fn is_occluded_by_item(
    scene: &Packed,
    item: &BvhItem,
    surface: &Surface,
    to_light: Vec3,
    t_max: f32,
    target_prim: u32,
) -> bool {
    let i = item.index;
    match item.kind & 0xff {
        INSTANCE => {
            let MeshRay { line, skip, .. } = shadow_mesh_ray(scene, i, surface, to_light, t_max);
            traversal::any(*LEVEL, &instance_mesh(scene, i), &line, skip, t_max)
        }
        _ => is_occluded_by_primitive_item(scene, item, surface, to_light, t_max, target_prim),
    }
}

/// Like [`is_occluded_by_bvh`], for a single item that is a primitive.
pub fn is_occluded_by_primitive_item(
    scene: &Packed,
    item: &BvhItem,
    surface: &Surface,
    to_light: Vec3,
    t_max: f32,
    target_prim: u32,
) -> bool {
    let i = item.index;
    with_primitive_kind!(item.kind & 0xff, |kind| is_occluded_by_primitive(
        kind,
        &scene.primitives[i as usize],
        i,
        surface,
        to_light,
        t_max,
        target_prim,
    ))
}

/// Returns the segment in the object space of an instance, as a ray that searches for any hit.
#[inline(always)]
pub fn shadow_mesh_ray(scene: &Packed, instance_index: u32, surface: &Surface, to_light: Vec3, t_max: f32) -> MeshRay {
    let i = &scene.bvh.instances[instance_index as usize];
    let origin = point_to_mesh(i, surface.ray_origin);
    let direction = vector_to_mesh(i, to_light);
    let skip = excluded_triangle(surface.exclude_front, instance_index);
    let best = Nearest {
        t: t_max,
        triangle: NO_INDEX,
        slot: NO_INDEX,
    };
    MeshRay::new(origin, direction, mesh_pad(i, origin), 0.0, skip, best)
}
