//! Packs meshes into records.

use std::sync::Arc;

use bytemuck::cast_vec;
use glam::{UVec4, Vec4};
use rayon::prelude::*;

use wgray_scene::mesh::{Mesh, VertexTangents};
use wgray_trace::bvh::{Aabb, DecodedOnce, build};
use wgray_trace::records::PackedMesh;

const MAX_LEAF_SIZE: u32 = 4;

/// Packs a mesh, with tangents for normal maps if the mesh has texture coordinates and normals. The mesh caches the
/// result.
pub fn packed_mesh(mesh: &Arc<Mesh>, with_tangents: bool) -> Arc<PackedMesh> {
    struct WithTangents(Arc<PackedMesh>);
    if with_tangents && !mesh.uvs.is_empty() && !mesh.normals.is_empty() {
        let pack = |mesh: &Mesh| {
            let tangents = VertexTangents::of(mesh).unwrap_or_default();
            WithTangents(Arc::new(pack_mesh(mesh, Some(tangents))))
        };
        return Arc::clone(&mesh.cached(pack).0);
    }
    mesh.cached(|mesh| pack_mesh(mesh, None))
}

fn pack_mesh(mesh: &Mesh, tangents: Option<VertexTangents>) -> PackedMesh {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
    let boxes: Vec<Aabb> = mesh.triangles.par_iter().map(|t| Aabb::around(&corners(t))).collect();
    let bounds = boxes.iter().fold(Aabb::EMPTY, |bounds, b| bounds.with(b));
    let _span = tracing::debug_span!("bvh", triangles = boxes.len()).entered();
    let tree = build(&boxes, MAX_LEAF_SIZE);
    let (triangles, copies, tangents) = match &tangents {
        Some(generated) => (
            &generated.triangles,
            generated.copies.as_slice(),
            generated.tangents.as_slice(),
        ),
        None => (&mesh.triangles, &[][..], &[][..]),
    };
    let triangles = tree.order.par_iter().map(|&number| {
        let [a, b, c] = triangles[number as usize];
        UVec4::new(a, b, c, number)
    });
    let uv = |i: usize| mesh.uvs.get(i).copied().unwrap_or_default();
    let normal = |i: usize| mesh.normals.get(i).copied().unwrap_or_default();
    let original_count = mesh.positions.len();
    let count = original_count + copies.len();
    let original = |i: usize| match i < original_count {
        true => i,
        false => copies[i - original_count] as usize,
    };
    let vertices = (0..count).into_par_iter().map(original);
    let vertices = vertices.map(|i| mesh.positions[i].extend(uv(i).x));
    let attribute_count = match mesh.normals.is_empty() && mesh.uvs.is_empty() {
        true => 0,
        false => count,
    };
    let attributes = (0..attribute_count).into_par_iter().map(original);
    let attributes = attributes.map(|i| normal(i).extend(uv(i).y));
    let tangents = tangents
        .par_iter()
        .map(|frame| [frame.u.extend(0.0), frame.v.extend(0.0)]);
    let colors = (0..if mesh.colors.is_empty() { 0 } else { count })
        .into_par_iter()
        .map(original);
    let colors = colors.map(|i| mesh.colors.get(i).copied().unwrap_or(Vec4::ONE));
    let uv_of_set = |set: usize, i: usize| {
        let uvs = mesh.more_uvs.get(set);
        uvs.and_then(|uvs| uvs.get(i)).copied().unwrap_or_default()
    };
    let pairs = mesh.more_uvs.len().div_ceil(2);
    let more_uvs = (0..count * pairs).into_par_iter().map(|row| {
        let (i, first) = (original(row / pairs), 2 * (row % pairs));
        let [a, b] = [uv_of_set(first, i), uv_of_set(first + 1, i)];
        Vec4::new(a.x, a.y, b.x, b.y)
    });
    let group = |&number: &u32| mesh.group_of.get(number as usize).copied();
    PackedMesh {
        triangles: triangles.collect(),
        vertices: vertices.collect(),
        attributes: attributes.collect(),
        tangents: tangents.collect(),
        colors: colors.collect(),
        more_uvs: more_uvs.collect(),
        groups: tree.order.iter().filter_map(group).collect(),
        low: bounds.low,
        high: bounds.high,
        nodes: cast_vec(tree.nodes),
        decoded: DecodedOnce::default(),
    }
}
