// Access to mesh buffers: `nodes` contains BVH nodes, items, instances and group words; `meshes` contains triangles and
// vertex attributes.

fn load_position(i: Instance, vertex: u32) -> vec3f {
    return bitcast<vec3f>(meshes[i.vertices + vertex].xyz);
}

fn load_tangents(i: Instance, vertex: u32) -> Tangents {
    let row = i.tangents + 2u * vertex;
    let u = bitcast<vec3f>(meshes[row].xyz);
    let v = bitcast<vec3f>(meshes[row + 1u].xyz);
    return Tangents(vector_from_mesh(i, u), vector_from_mesh(i, v));
}

fn word_of(row: vec4u, i: u32) -> u32 {
    return select(select(row.x, row.y, i == 1u), select(row.z, row.w, i == 3u), i >= 2u);
}

// Returns the word of a triangle's group: the material index, combined with the flag NO_SHADOW.
fn group_word(i: Instance, slot: u32) -> u32 {
    var group = i.first_group_word;
    if i.groups != NO_INDEX {
        group += word_of(meshes[i.groups + slot / 4u], slot % 4u);
    }
    return word_of(nodes[counts.tree.z + group / 4u], group % 4u);
}

fn triangle_casts(i: Instance, slot: u32) -> bool {
    if i.shadows != SOME_SHADOWS {
        return true;
    }
    return (group_word(i, slot) & NO_SHADOW) == 0u;
}

fn face_of(i: Instance, hit: Hit) -> HitPrimitive {
    let corners = meshes[i.triangles + hit.slot];
    let v0 = load_position(i, corners.x);
    let edge_1 = vector_from_mesh(i, load_position(i, corners.y) - v0);
    let edge_2 = vector_from_mesh(i, load_position(i, corners.z) - v0);
    let q = face_primitive(i, v0, edge_1, edge_2, group_word(i, hit.slot) & ~NO_SHADOW);
    let zero = vec3f(0.0);
    let none = Tangents(zero, zero);
    var face = HitPrimitive(q, edge_1, edge_2, vec2f(0.0), vec2f(1.0, 0.0), vec2f(0.0, 1.0), zero, zero, zero, none, none, none,
                    i.anchor, i.condition_number);
    if i.attributes != NO_INDEX {
        let row_0 = bitcast<vec4f>(meshes[i.attributes + corners.x]);
        let row_1 = bitcast<vec4f>(meshes[i.attributes + corners.y]);
        let row_2 = bitcast<vec4f>(meshes[i.attributes + corners.z]);
        face.normal_0 = normal_from_mesh(i, row_0.xyz);
        face.normal_1 = normal_from_mesh(i, row_1.xyz);
        face.normal_2 = normal_from_mesh(i, row_2.xyz);
        if i.has_uvs != 0u {
            face.uv_0 = vec2f(bitcast<f32>(meshes[i.vertices + corners.x].w), row_0.w);
            face.uv_1 = vec2f(bitcast<f32>(meshes[i.vertices + corners.y].w), row_1.w);
            face.uv_2 = vec2f(bitcast<f32>(meshes[i.vertices + corners.z].w), row_2.w);
        }
    }
    if (NORMAL_MAPS == 1u) | (ANISOTROPIC == 1u) {
        if i.tangents != NO_INDEX {
            face.tangents_0 = load_tangents(i, corners.x);
            face.tangents_1 = load_tangents(i, corners.y);
            face.tangents_2 = load_tangents(i, corners.z);
        }
    }
    return face;
}
