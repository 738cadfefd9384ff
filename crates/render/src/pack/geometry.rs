//! Builds the TLAS over primitives and mesh instances.

use std::collections::HashSet;
use std::sync::Arc;

use bytemuck::cast_vec;
use glam::{DAffine3, DVec3, Vec3, Vec4};

use super::mesh::packed_mesh;
use super::primitive::bounding_box;
use super::{BOX_PAD, BvhItem, CASTS_SHADOW, INSTANCE, Instance, NO_SHADOW, Primitive, SOME_SHADOWS};
use wgray_scene::mesh::Mesh;
use wgray_scene::{Geometry, Scene, Shape};
use wgray_trace::bvh::{Aabb, build};
use wgray_trace::records::{PackedBvh, PackedMesh};

/// Maximum number of bounded primitives without a BVH: a few primitives are faster without one.
pub const MAX_LINEAR_PRIMITIVES: usize = 64;

/// Builds the BVH over mesh instances and primitives. Each entry of `primitives` has an index, a primitive, and a flag
/// that is true if the primitive casts a shadow. `casts` returns true if a material casts shadows. Also returns
/// [`Counts::item_padding`](super::Counts::item_padding).
pub fn build_bvh(
    scene: &Scene,
    primitives: &[(u32, &Primitive, bool)],
    casts: impl Fn(usize) -> bool,
) -> (PackedBvh, Vec4) {
    let mut bvh = PackedBvh::default();
    let meshes_with_tangents = meshes_with_tangents(scene);
    let mut meshes: Vec<*const Mesh> = Vec::new();
    let mut items = Vec::new();
    for (number, shape) in scene.shapes.iter().enumerate() {
        let Geometry::Mesh {
            mesh,
            to_world,
            materials,
        } = &shape.geometry
        else {
            continue;
        };
        let mesh_index = meshes.iter().position(|other| *other == Arc::as_ptr(mesh));
        let mesh_index = mesh_index.unwrap_or_else(|| {
            meshes.push(Arc::as_ptr(mesh));
            let with_tangents = meshes_with_tangents.contains(&Arc::as_ptr(mesh));
            bvh.meshes.push(packed_mesh(mesh, with_tangents));
            meshes.len() - 1
        });
        let word = |material: &usize| *material as u32 | if casts(*material) { 0 } else { NO_SHADOW };
        let words: Vec<u32> = materials.iter().map(word).collect();
        let casters = words.iter().filter(|word| **word & NO_SHADOW == 0).count();
        let packed = &bvh.meshes[mesh_index];
        let kind = INSTANCE | if casters > 0 { CASTS_SHADOW } else { 0 };
        items.push(item(kind, bvh.instances.len() as u32, box_in_world(mesh, to_world)));
        bvh.instances.push(Instance {
            mesh: mesh_index as u32,
            first_group_word: bvh.group_words.len() as u32,
            shape: number as u32,
            shadows: if casters < words.len() { SOME_SHADOWS } else { 0 },
            has_uvs: (!mesh.uvs.is_empty()).into(),
            uv_sets: mesh.more_uvs.len() as u32,
            ..instance(packed, mesh.center, to_world)
        });
        bvh.group_words.extend(words);
    }
    for (number, primitive, casts) in primitives {
        let kind = primitive.kind | if *casts { CASTS_SHADOW } else { 0 };
        items.push(item(kind, *number, bounding_box(primitive)));
    }
    let boxes: Vec<Aabb> = items
        .iter()
        .map(|item| Aabb {
            low: item.low,
            high: item.high,
        })
        .collect();
    let tree = build(&boxes, 1);
    bvh.items = tree.order.iter().map(|i| items[*i as usize]).collect();
    bvh.nodes = cast_vec(tree.nodes);
    let condition_number = bvh.instances.iter().map(|i| i.condition_number).fold(1.0, f32::max);
    let farthest = boxes
        .iter()
        .map(|b| b.low.abs().max(b.high.abs()).max_element())
        .fold(0.0, f32::max);
    bvh.set_mesh_rows();
    (bvh, Vec4::new(BOX_PAD * condition_number, farthest, 0.0, 0.0))
}

/// Returns the meshes that are packed with vertex tangents: meshes with a normal map in any instance, and meshes that
/// have both tangents and a material with tangent directions (anisotropy, coat normal map), which would otherwise use
/// the tangents of the triangles.
fn meshes_with_tangents(scene: &Scene) -> HashSet<*const Mesh> {
    let needs_tangents = |mesh: &Mesh, material: &usize| {
        let material = &scene.materials[*material];
        material.normal_map.is_some() || !mesh.tangents.is_empty() && material.has_direction()
    };
    let mesh = |shape: &Shape| match &shape.geometry {
        Geometry::Mesh { mesh, materials, .. } if materials.iter().any(|m| needs_tangents(mesh, m)) => {
            Some(Arc::as_ptr(mesh))
        }
        _ => None,
    };
    scene.shapes.iter().filter_map(mesh).collect()
}

fn item(kind: u32, index: u32, (low, high): (DVec3, DVec3)) -> BvhItem {
    // Rounded outward to f32.
    let down = |x: f64| (x as f32).next_down();
    let up = |x: f64| (x as f32).next_up();
    BvhItem {
        low: Vec3::new(down(low.x), down(low.y), down(low.z)),
        kind,
        high: Vec3::new(up(high.x), up(high.y), up(high.z)),
        index,
    }
}

fn box_in_world(mesh: &Arc<Mesh>, to_world: &DAffine3) -> (DVec3, DVec3) {
    let corners = mesh.corners().map(|corner| to_world.transform_point3(corner));
    corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    })
}

fn instance(mesh: &PackedMesh, center: DVec3, to_world: &DAffine3) -> Instance {
    let columns = to_world.matrix3;
    let rows = columns.inverse().transpose();
    let pairs = [
        (rows.x_axis, columns.x_axis),
        (rows.y_axis, columns.y_axis),
        (rows.z_axis, columns.z_axis),
    ];
    let condition_number = pairs.map(|(row, column)| row.length() * column.length());
    Instance {
        x: rows.x_axis.as_vec3(),
        y: rows.y_axis.as_vec3(),
        z: rows.z_axis.as_vec3(),
        anchor: to_world.transform_point3(center).as_vec3(),
        u: columns.x_axis.as_vec3(),
        v: columns.y_axis.as_vec3(),
        w: columns.z_axis.as_vec3(),
        size: mesh.size(),
        condition_number: condition_number.into_iter().fold(1.0, f64::max) as f32,
        side: if columns.determinant() < 0.0 { -1.0 } else { 1.0 },
        ..bytemuck::Zeroable::zeroed()
    }
}
