// Single-scattering albedo of microfacet lobes, from tables that `crates/render/src/pack/energy.rs` computes.

// Returns the albedo of isotropic rough glass. Rows of the table differ in roughness, columns in the cosine of wo.
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
    let pair = finer + (rougher - finer) * (row - i);
    return pair.x + (pair.y - pair.x) * (column - j);
}

// Returns the albedo of an anisotropic lobe, interpolated by direction, roughness and anisotropy. Each part of the
// table contains one albedo; `part` is the index of the part.
fn single_scatter_albedo_aniso(material: Material, alpha: vec2f, wo: vec3f, part: u32) -> f32 {
    let start = material.aniso_table - 1u;
    let rows = vec2u(texel_word(start), texel_word(start + 1u));
    let roughness_row = min(max(material.roughness, 0.0), 1.0) * f32(rows.x - 1u);
    let anisotropy_row = min(max(material.anisotropy, 0.0), 1.0) * f32(rows.y - 1u);
    let position = aniso_table_position(alpha, wo);
    let line = position.x * f32(ANISO_LINES - 1u);
    let column = position.y * f32(ANISO_COLUMNS - 1u);
    let r = max(min(floor(roughness_row), f32(rows.x) - 2.0), 0.0);
    let s = max(min(floor(anisotropy_row), f32(rows.y) - 2.0), 0.0);
    let i = min(floor(line), f32(ANISO_LINES) - 2.0);
    let j = min(floor(column), f32(ANISO_COLUMNS) - 2.0);
    let first = start + 2u + part * rows.x * rows.y * (ANISO_LINES * ANISO_COLUMNS);
    var sum = 0.0;
    for (var k = 0u; k < select(1u, 2u, rows.x > 1u); k++) {
        for (var l = 0u; l < select(1u, 2u, rows.y > 1u); l++) {
            let row = (u32(r) + k) * rows.y + u32(s) + l;
            let entry = first + (row * ANISO_LINES + u32(i)) * ANISO_COLUMNS + u32(j);
            let line_values = bitcast<vec2f>(vec2u(texel_word(entry), texel_word(entry + 1u)));
            let next_values = bitcast<vec2f>(vec2u(texel_word(entry + ANISO_COLUMNS), texel_word(entry + ANISO_COLUMNS + 1u)));
            let pair = line_values + (next_values - line_values) * (line - i);
            let roughness_weight = select(1.0 - (roughness_row - r), roughness_row - r, k == 1u);
            let anisotropy_weight = select(1.0 - (anisotropy_row - s), anisotropy_row - s, l == 1u);
            sum += (pair.x + (pair.y - pair.x) * (column - j)) * (roughness_weight * anisotropy_weight);
        }
    }
    return sum;
}

// Returns the albedo of rough glass, isotropic or not.
fn single_scatter_albedo_glass(material: Material, alpha: vec2f, wo: vec3f, side: f32) -> f32 {
    if ANISOTROPIC != 0u {
        if material.aniso_table != 0u {
            // The table of rough glass has two parts: outside and inside. The table of a principled material has two
            // parts for reflection before these two parts.
            let part = select(2u, 0u, material.kind == ROUGH_GLASS) + select(1u, 0u, side > 0.0);
            return single_scatter_albedo_aniso(material, alpha, wo, part);
        }
    }
    return single_scatter_albedo(material.energy, alpha, wo, side);
}

// Returns a principled material's tabulated albedos, or 1 without a table: x and y for the anisotropic specular lobe as
// in `ggx_albedo`, z for rough glass.
fn principled_energy(material: Material, wo: vec3f, side: f32) -> vec3f {
    var albedos = vec3f(1.0);
    let alpha = facet_alpha(material);
    if ANISOTROPIC != 0u {
        if material.aniso_table != 0u {
            albedos.x = single_scatter_albedo_aniso(material, alpha, wo, 0u);
            albedos.y = single_scatter_albedo_aniso(material, alpha, wo, 1u);
        }
    }
    if (LOBES & LOBE_TRANSMISSION) != 0u {
        if (material.thin == 0u) & (material.transmission > 0.0) {
            albedos.z = single_scatter_albedo_glass(material, alpha, wo, side);
        }
    }
    return albedos;
}
