// Single-scattering albedo of microfacet lobes, from tables (`crates/render/src/pack/energy.rs`).

// Returns the albedo of rough glass. Rows are by roughness, columns by the cosine of wo.
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

// Returns the albedo of an anisotropic lobe from a part of its table, interpolated by direction and by textured
// roughness and anisotropy.
fn single_scatter_albedo_aniso(material: Material, alpha: vec2f, wo: vec3f, part: u32) -> f32 {
    let start = material.aniso_table - 1u;
    let rows = vec2u(texel_word(start), texel_word(start + 1u));
    let rough = min(max(material.roughness, 0.0), 1.0) * f32(rows.x - 1u);
    let long = min(max(material.anisotropy, 0.0), 1.0) * f32(rows.y - 1u);
    let position = aniso_table_position(alpha, wo);
    let line = position.x * f32(ANISO_LINES - 1u);
    let column = position.y * f32(ANISO_COLUMNS - 1u);
    let r = max(min(floor(rough), f32(rows.x) - 2.0), 0.0);
    let s = max(min(floor(long), f32(rows.y) - 2.0), 0.0);
    let i = min(floor(line), f32(ANISO_LINES) - 2.0);
    let j = min(floor(column), f32(ANISO_COLUMNS) - 2.0);
    let first = start + 2u + part * rows.x * rows.y * (ANISO_LINES * ANISO_COLUMNS);
    var sum = 0.0;
    for (var k = 0u; k < select(1u, 2u, rows.x > 1u); k++) {
        for (var l = 0u; l < select(1u, 2u, rows.y > 1u); l++) {
            let row = (u32(r) + k) * rows.y + u32(s) + l;
            let at = first + (row * ANISO_LINES + u32(i)) * ANISO_COLUMNS + u32(j);
            let across = bitcast<vec2f>(vec2u(texel_word(at), texel_word(at + 1u)));
            let along = bitcast<vec2f>(vec2u(texel_word(at + ANISO_COLUMNS), texel_word(at + ANISO_COLUMNS + 1u)));
            let both = across + (along - across) * (line - i);
            let rougher = select(1.0 - (rough - r), rough - r, k == 1u);
            let longer = select(1.0 - (long - s), long - s, l == 1u);
            sum += (both.x + (both.y - both.x) * (column - j)) * (rougher * longer);
        }
    }
    return sum;
}

// Returns the albedo of rough glass from its table.
fn single_scatter_albedo_glass(material: Material, alpha: vec2f, wo: vec3f, side: f32) -> f32 {
    if ANISOTROPIC != 0u {
        if material.aniso_table != 0u {
            // The last two parts are the sides of glass.
            let behind = select(2u, 0u, material.kind == ROUGH_GLASS) + select(1u, 0u, side > 0.0);
            return single_scatter_albedo_aniso(material, alpha, wo, behind);
        }
    }
    return single_scatter_albedo(material.energy, alpha, wo, side);
}

// Returns a principled material's tabulated albedos, else 1: x and y of the anisotropic specular lobe as in
// `ggx_albedo`, z of rough glass.
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
