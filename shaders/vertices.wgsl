// Optional vertex attributes: colors, and further texture coordinates.

// Returns the interpolated vertex color; white if the mesh has no vertex colors.
fn vertex_color(hit: Hit) -> vec4f {
    if is_on_mesh(hit) {
        let i = load_instance(hit.instance - 1u);
        if i.colors != NO_INDEX {
            let corners = meshes[i.triangles + hit.slot];
            let c0 = bitcast<vec4f>(meshes[i.colors + corners.x]);
            let c1 = bitcast<vec4f>(meshes[i.colors + corners.y]);
            let c2 = bitcast<vec4f>(meshes[i.colors + corners.z]);
            return color_between(c0, c1, c2, hit.barycentric);
        }
    }
    return vec4f(1.0);
}

// Applies vertex colors as `vertex_colors` specifies.
fn with_vertex_colors(before: Material, hit: Hit) -> Material {
    var material = before;
    if material.vertex_colors != NO_COLORS {
        let color = vertex_color(hit);
        let factor = color.xyz;
        material.diffuse *= select(vec3f(1.0), factor, material.vertex_colors == COLORS_OF_BASE);
        material.emission *= select(vec3f(1.0), factor, material.vertex_colors == COLORS_OF_EMISSION);
        material.opacity *= color.w;
    }
    return material;
}

// Loads a vertex's texture coordinates of a further set, which must exist.
fn load_further_uv(i: Instance, vertex: u32, uv_set: u32) -> vec2f {
    let rows = (i.uv_sets + 1u) / 2u;
    let row = bitcast<vec4f>(meshes[i.more_uvs + rows * vertex + (uv_set - 1u) / 2u]);
    return select(row.zw, row.xy, (uv_set & 1u) == 1u);
}

// Returns the hit primitive with the texture coordinates of a further set instead of set 0; 0 if the mesh lacks the
// set.
fn hit_primitive_in_uv_set(prim: HitPrimitive, hit: Hit, uv_set: u32) -> HitPrimitive {
    var face = prim;
    if is_on_mesh(hit) {
        let i = load_instance(hit.instance - 1u);
        face.uv_0 = vec2f(0.0);
        face.uv_1 = vec2f(0.0);
        face.uv_2 = vec2f(0.0);
        if uv_set <= i.uv_sets {
            let corners = meshes[i.triangles + hit.slot];
            face.uv_0 = load_further_uv(i, corners.x, uv_set);
            face.uv_1 = load_further_uv(i, corners.y, uv_set);
            face.uv_2 = load_further_uv(i, corners.z, uv_set);
        }
    }
    return face;
}

// Returns the texture coordinates in a set; `first` are those of set 0.
fn uv_in_set(first: vec2f, prim: HitPrimitive, hit: Hit, uv_set: u32) -> vec2f {
    if UV_SETS == 0u {
        return first;
    }
    if uv_set == 0u {
        return first;
    }
    return face_uv(hit_primitive_in_uv_set(prim, hit, uv_set), hit.barycentric);
}

fn footprint_in_set(first: Footprint, prim: HitPrimitive, hit: Hit, hit_diff: HitDifferential, uv_set: u32) -> Footprint {
    if UV_SETS == 0u {
        return first;
    }
    if uv_set == 0u {
        return first;
    }
    let face = hit_primitive_in_uv_set(prim, hit, uv_set);
    let uv = face_uv(face, hit.barycentric);
    return Footprint(uv, face_uv_derivative(face, hit_diff.x.position), face_uv_derivative(face, hit_diff.y.position));
}
