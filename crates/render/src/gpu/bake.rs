//! Baking: a small scene is embedded in the kernel as constants, and the functions of `buffers.wgsl` become
//! straight-line code with a statement per primitive. Software Vulkan loads buffers lane by lane, but constants at no
//! cost.

use std::fmt::Write;

use bytemuck::cast_slice;
use glam::UVec4;

use crate::pack::MAX_LINEAR_PRIMITIVES;
use wgray_trace::records::{
    BvhItem, Emitter, Field as _, Instance, Light, LightNode, Lookup, Material, Node, Packed, Record, SAMPLE_BLOCK,
    Texture,
};

/// Maximum number of materials, lights and textures of a baked scene: compile time grows faster than linearly.
pub const MAX_RECORDS: usize = 512;

/// Returns the result of [`bake`], if the scene is small enough.
pub fn bake_if_small(packed: &Packed) -> Option<String> {
    // Lights in a light tree are read from buffers.
    let lights = if packed.lighting.nodes.is_empty() {
        packed.lighting.lights.len()
    } else {
        0
    };
    let shading_records = packed.materials.len() + packed.textures.lookups.len() + packed.textures.records.len();
    let records = shading_records + lights + packed.lighting.emitters.len();
    (packed.primitives.len() <= MAX_LINEAR_PRIMITIVES && records <= MAX_RECORDS).then(|| bake(packed))
}

/// Returns WGSL with a scene as constants: the functions of `buffers.wgsl`, and functions that load records.
pub fn bake(packed: &Packed) -> String {
    let mut out = String::new();
    let records: Vec<String> = packed.primitives.iter().map(Record::constant).collect();
    write_function(
        &mut out,
        "closest_primitive(ray: Ray, origin_prim: u32, inside_prim: u32) -> Hit",
        "var hit = no_hit();",
        "hit",
        |body| {
            for (i, (p, record)) in packed.primitives.iter().zip(&records).enumerate() {
                let kind = p.kind;
                let _ = writeln!(
                    body,
                    "    hit = closer(hit, intersect({kind}u, {record}, {i}u == inside_prim, ray, hit.t), {i}u, origin_prim);"
                );
            }
        },
    );
    write_function(
        &mut out,
        "occluded_by_primitives(surface: Surface, light: Light, block: SampleBlock) -> u32",
        "let frustum = light_frustum(light, surface.ray_origin);\n    var bits = 0u;",
        "bits",
        |body| {
            for (kind, range) in packed.shadow_casters() {
                let (start, end) = (range.start, range.end);
                let _ = writeln!(
                    body,
                    "    bits |= occluded_by({kind}u, vec2u({start}u, {end}u), surface, frustum, light, block);"
                );
            }
        },
    );
    let signature = "shadow_candidates(first: u32, end: u32, frustum: ShadowFrustum) -> u32";
    write_function(&mut out, signature, "var bits = 0u;", "bits", |body| {
        for (_, range) in packed.shadow_casters() {
            for first in range.clone().step_by(SAMPLE_BLOCK as usize) {
                let _ = writeln!(body, "    if first == {first}u {{");
                for i in first..range.end.min(first + SAMPLE_BLOCK as usize) {
                    let (bit, sphere) = (i - first, packed.bounds[i].constant());
                    let _ = writeln!(
                        body,
                        "        bits |= select(0u, {}u, may_block({sphere}, frustum));",
                        1u32 << bit
                    );
                }
                let _ = writeln!(body, "    }}");
            }
        }
    });
    write_function(
        &mut out,
        "load_blocker(kind: u32, i: u32) -> Primitive",
        "var r = Primitive();",
        "r",
        |body| {
            for (kind, range) in packed.shadow_casters() {
                for (k, i) in range.enumerate() {
                    let test = if k == 0 {
                        String::new()
                    } else {
                        format!(" & (i == {i}u)")
                    };
                    let _ = writeln!(body, "    if (kind == {kind}u){test} {{ r = {}; }}", records[i]);
                }
            }
        },
    );
    write_function(
        &mut out,
        "is_occluded_by_primitives(already_occluded: bool, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool",
        "var occluded = already_occluded;",
        "occluded",
        |body| {
            for (kind, range) in packed.shadow_casters() {
                for i in range {
                    let record = &records[i];
                    let _ = writeln!(
                        body,
                        "    occluded |= is_occluded_by_primitive({kind}u, {record}, {i}u, surface, to_light, t_max, target_prim);"
                    );
                }
            }
        },
    );
    let emitters = packed.lighting.emitters.len();
    let _ = writeln!(out, "fn emitter_count() -> u32 {{\n    return {emitters}u;\n}}");
    let lights = packed.counts.lights.constant();
    let _ = writeln!(out, "fn light_counts() -> vec2u {{\n    return {lights};\n}}");
    write_table(&mut out, "load_primitive", &packed.primitives);
    write_table(&mut out, "load_material", &packed.materials);
    match packed.lighting.nodes.is_empty() {
        true => write_table(&mut out, "load_light", &packed.lighting.lights),
        false => write_loader::<Light>(&mut out, "load_light", "records", "counts.tables.x"),
    }
    write_table(&mut out, "load_texture", &packed.textures.records);
    write_table(&mut out, "load_emitter", &packed.lighting.emitters);
    write_table(&mut out, "load_lookup", &packed.textures.lookups);
    out
}

/// Returns WGSL functions that load records from the rows of one buffer, in the order of [`rows`].
pub fn record_loaders() -> String {
    let mut out = String::new();
    write_loader::<Material>(&mut out, "load_material", "records", "0u");
    write_loader::<Light>(&mut out, "load_light", "records", "counts.tables.x");
    write_loader::<Texture>(&mut out, "load_texture", "records", "counts.tables.y");
    write_loader::<Emitter>(&mut out, "load_emitter", "records", "counts.emitters.x");
    write_loader::<Lookup>(&mut out, "load_lookup", "records", "counts.lookups.x");
    out
}

/// Returns WGSL functions that load records of BVHs and meshes, which are never baked.
pub fn bvh_loaders() -> String {
    let mut out = String::new();
    write_loader::<BvhItem>(&mut out, "load_item", "nodes", "counts.tree.x");
    write_loader::<Instance>(&mut out, "load_instance", "nodes", "counts.tree.y");
    write_loader::<LightNode>(&mut out, "load_light_node", "records", "counts.emitters.z");
    let _ = writeln!(out, "fn load_node(at: u32) -> Node {{");
    write_loader_body::<Node>(&mut out, "nodes");
    out
}

/// Returns the rows of materials, lights, textures, emitters, lookups, light-tree nodes and leaf indices.
pub fn rows(packed: &Packed) -> Vec<UVec4> {
    let bytes = [
        cast_slice(&packed.materials),
        cast_slice(&packed.lighting.lights),
        cast_slice::<_, u8>(&packed.textures.records),
        cast_slice(&packed.lighting.emitters),
        cast_slice(&packed.textures.lookups),
        cast_slice(&packed.lighting.nodes),
    ];
    let mut rows: Vec<UVec4> = bytemuck::pod_collect_to_vec(&bytes.concat());
    rows.extend(to_rows(&packed.lighting.leaves));
    rows
}

/// Returns the rows of BVHs, items and instances.
pub fn node_rows(packed: &Packed) -> Vec<UVec4> {
    let mut out: Vec<UVec4> = cast_slice(&packed.bvh.nodes).to_vec();
    out.extend(cast_slice::<_, UVec4>(&packed.bvh.items));
    out.extend(cast_slice::<_, UVec4>(&packed.bvh.instances));
    out.extend(to_rows(&packed.bvh.group_words));
    for mesh in &packed.bvh.meshes {
        out.extend(cast_slice::<_, UVec4>(&mesh.nodes));
    }
    out
}

/// Returns each mesh's rows: triangles, vertices, vertex attributes, tangents, triangle groups, vertex colors and
/// further texture coordinates.
pub fn mesh_rows(packed: &Packed) -> Vec<UVec4> {
    let mut out = Vec::new();
    for mesh in &packed.bvh.meshes {
        out.extend(&mesh.triangles);
        out.extend(cast_slice::<_, UVec4>(&mesh.vertices));
        out.extend(cast_slice::<_, UVec4>(&mesh.attributes));
        out.extend(cast_slice::<_, UVec4>(&mesh.tangents));
        out.extend(to_rows(&mesh.groups));
        out.extend(cast_slice::<_, UVec4>(&mesh.colors));
        out.extend(cast_slice::<_, UVec4>(&mesh.more_uvs));
    }
    out
}

pub fn node_rows_count(packed: &Packed) -> usize {
    let rows = |nodes: &[Node]| size_of_val(nodes) / size_of::<UVec4>();
    let mesh_rows: usize = packed.bvh.meshes.iter().map(|mesh| rows(&mesh.nodes)).sum();
    let records = size_of_val(packed.bvh.items.as_slice()) + size_of_val(packed.bvh.instances.as_slice());
    rows(&packed.bvh.nodes) + records / size_of::<UVec4>() + packed.bvh.group_words.len().div_ceil(4) + mesh_rows
}

pub fn mesh_rows_count(packed: &Packed) -> usize {
    let rows = packed.bvh.meshes.iter().map(|mesh| {
        let vertex_rows = mesh.vertices.len()
            + mesh.attributes.len()
            + 2 * mesh.tangents.len()
            + mesh.colors.len()
            + mesh.more_uvs.len();
        mesh.triangles.len() + vertex_rows + mesh.groups.len().div_ceil(4)
    });
    rows.sum()
}

/// Packs words in rows of four, zero-padded.
fn to_rows(words: &[u32]) -> impl Iterator<Item = UVec4> {
    words.chunks(4).map(|words| {
        let word = |i: usize| words.get(i).copied().unwrap_or(0);
        UVec4::new(word(0), word(1), word(2), word(3))
    })
}

/// Writes a function that loads record `i` of a table in a buffer.
fn write_loader<R: Record>(out: &mut String, name: &str, buffer: &str, start: &str) {
    let (record, size) = (R::NAME, size_of::<R>() / size_of::<UVec4>());
    let _ = writeln!(
        out,
        "fn {name}(i: u32) -> {record} {{\n    let at = {start} + i * {size}u;"
    );
    write_loader_body::<R>(out, buffer);
}

fn write_loader_body<R: Record>(out: &mut String, buffer: &str) {
    for row in 0..size_of::<R>() / size_of::<UVec4>() {
        let _ = writeln!(out, "    let r{row} = {buffer}[at + {row}u];");
    }
    let _ = writeln!(out, "    return {};\n}}", R::from_rows());
}

fn write_function(out: &mut String, signature: &str, start: &str, result: &str, body: impl FnOnce(&mut String)) {
    let _ = writeln!(out, "fn {signature} {{\n    {start}");
    body(out);
    let _ = writeln!(out, "    return {result};\n}}");
}

/// Writes a function that returns the constant record with a given index: a chain of selections.
fn write_table<R: Record>(out: &mut String, name: &str, records: &[R]) {
    let record = R::NAME;
    let first = records.first().map_or(format!("{record}()"), R::constant);
    write_function(
        out,
        &format!("{name}(i: u32) -> {record}"),
        &format!("var r = {first};"),
        "r",
        |body| {
            for (i, constant) in records.iter().map(R::constant).enumerate().skip(1) {
                let _ = writeln!(body, "    if i == {i}u {{ r = {constant}; }}");
            }
        },
    );
}
