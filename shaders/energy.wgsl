// Directional albedo of microfacet lobes by single scattering, from tables (`crates/render/src/pack/energy.rs`).

// Directional albedo of rough glass, reflected and transmitted: interpolated in its table, rows by roughness and columns by the cosine.
fn single_scatter_albedo(energy: u32, alpha: vec2f, wo: vec3f, side: f32) -> f32 {
    let last = f32(ENERGY_SIZE - 1u);
    let square = 0.5 * (alpha.x * alpha.x + alpha.y * alpha.y);
    let row = min(sqrt(sqrt(square)), 1.0) * last;
    let column = min(max(wo.z, 0.0), 1.0) * last;
    let i = min(floor(row), last - 1.0);
    let j = min(floor(column), last - 1.0);
    let start = energy + select(ENERGY_SIZE * ENERGY_SIZE, 0u, side > 0.0) + u32(i) * ENERGY_SIZE + u32(j);
    let finer = bitcast<vec2f>(vec2u(texel_word(start), texel_word(start + 1u)));
    let rougher = bitcast<vec2f>(vec2u(texel_word(start + ENERGY_SIZE), texel_word(start + ENERGY_SIZE + 1u)));
    let both = finer + (rougher - finer) * (row - i);
    return both.x + (both.y - both.x) * (column - j);
}

// The same of facets that are rougher along one axis: from one of the parts of their table, between its rows by roughness and by anisotropy,
// where textures give these, its lines and its columns.
fn single_scatter_albedo_aniso(material: Material, alpha: vec2f, wo: vec3f, part: u32) -> f32 {
    let start = material.aniso_table - 1u;
    let rows = vec2u(texel_word(start), texel_word(start + 1u));
    let rough = min(max(material.roughness, 0.0), 1.0) * f32(rows.x - 1u);
    let long = min(max(material.anisotropy, 0.0), 1.0) * f32(rows.y - 1u);
    let place = streak_place(alpha, wo);
    let line = place.x * f32(STREAK_LINES - 1u);
    let column = place.y * f32(STREAK_COLUMNS - 1u);
    let r = max(min(floor(rough), f32(rows.x) - 2.0), 0.0);
    let s = max(min(floor(long), f32(rows.y) - 2.0), 0.0);
    let i = min(floor(line), f32(STREAK_LINES) - 2.0);
    let j = min(floor(column), f32(STREAK_COLUMNS) - 2.0);
    let first = start + 2u + part * rows.x * rows.y * (STREAK_LINES * STREAK_COLUMNS);
    var sum = 0.0;
    for (var k = 0u; k < select(1u, 2u, rows.x > 1u); k++) {
        for (var l = 0u; l < select(1u, 2u, rows.y > 1u); l++) {
            let row = (u32(r) + k) * rows.y + u32(s) + l;
            let at = first + (row * STREAK_LINES + u32(i)) * STREAK_COLUMNS + u32(j);
            let across = bitcast<vec2f>(vec2u(texel_word(at), texel_word(at + 1u)));
            let along = bitcast<vec2f>(vec2u(texel_word(at + STREAK_COLUMNS), texel_word(at + STREAK_COLUMNS + 1u)));
            let both = across + (along - across) * (line - i);
            let rougher = select(1.0 - (rough - r), rough - r, k == 1u);
            let longer = select(1.0 - (long - s), long - s, l == 1u);
            sum += (both.x + (both.y - both.x) * (column - j)) * (rougher * longer);
        }
    }
    return sum;
}

// What rough glass reflects and lets pass at once, by whichever table it has.
fn single_scatter_albedo_glass(material: Material, alpha: vec2f, wo: vec3f, side: f32) -> f32 {
    if ANISOTROPIC != 0u {
        if material.aniso_table != 0u {
            // Those of the two sides come last.
            let behind = select(2u, 0u, material.kind == ROUGH_GLASS) + select(1u, 0u, side > 0.0);
            return single_scatter_albedo_aniso(material, alpha, wo, behind);
        }
    }
    return single_scatter_albedo(material.energy, alpha, wo, side);
}

// What is known of a principled material's facets: the two parts of what those reflect that are rougher along one axis, as `ggx_albedo` has
// them, x and y; and what it reflects and lets pass as rough glass, z.
fn principled_energy(material: Material, wo: vec3f, side: f32) -> vec3f {
    var found = vec3f(1.0);
    let alpha = facet_alpha(material);
    if ANISOTROPIC != 0u {
        if material.aniso_table != 0u {
            found.x = single_scatter_albedo_aniso(material, alpha, wo, 0u);
            found.y = single_scatter_albedo_aniso(material, alpha, wo, 1u);
        }
    }
    if (LOBES & LOBE_TRANSMISSION) != 0u {
        if (material.thin == 0u) & (material.transmission > 0.0) {
            found.z = single_scatter_albedo_glass(material, alpha, wo, side);
        }
    }
    return found;
}
