// Phong's reflection model: Phong, "Illumination for Computer Generated Pictures", CACM 18(6), 1975.

// The cosine of the diffuse term and the power of the specular term, each summed over the samples of a light.
struct Lobes {
    diffuse: f32,
    specular: f32,
}

// The lobes of one sample, in the direction of `to` (of any length); both are 0 where it is not lit.
fn phong_lobes(surface: Surface, material: Material, to: vec3f, exponent_bits: u32) -> Lobes {
    let inverse_length = 1.0 / sqrt(dot(to, to));
    let n_l = dot(surface.shading_normal, to);
    let n_v = dot(surface.shading_normal, surface.wo);
    let r_v = (2.0 * n_l * n_v - dot(surface.wo, to)) * inverse_length;
    let r_v_power = phong_power(max(r_v, 0.0), material, exponent_bits);
    let lit = is_lit(surface, to);
    return Lobes(select(0.0, n_l * inverse_length, lit), select(0.0, r_v_power, lit));
}

// Whether what comes from the direction of `to` lights the surface: not if it is behind it, or behind that which a normal map
// makes of it. On a mesh it is the smooth surface that counts, and not the triangle: else facets would show where light ends.
fn is_lit(surface: Surface, to: vec3f) -> bool {
    return (dot(surface.shading_normal, to) > 0.0) & (dot(surface.smooth_normal, to) > 0.0);
}

// Bit i is set where sample i of the block does not light the surface, which is one of `prim`: no shadow ray needs to be sent
// there.
fn unlit_mask(prim: HitPrimitive, surface: Surface, to: Segments, block: SampleBlock) -> u32 {
    var bits = 0u;
    for (var i = 0u; i < block.count; i++) {
        let d = segment(to, block_sample(block, i));
        bits |= select(1u << i, 0u, is_lit(surface, d) & face_lets_pass(prim, surface, d));
    }
    return bits;
}

fn phong_power(x: f32, material: Material, exponent_bits: u32) -> f32 {
    if exponent_bits > 0u {
        return power_whole(x, material.exponent, exponent_bits);
    }
    return power(x, material.shininess);
}

// What the unoccluded samples of a block add to the lobes, in order.
fn phong_block(surface: Surface, material: Material, to: Segments, block: SampleBlock, hidden: u32, exponent_bits: u32,
               sum: Lobes) -> Lobes {
    var lobes = sum;
    for (var i = 0u; i < block.count; i++) {
        let sample = phong_lobes(surface, material, segment(to, block_sample(block, i)), exponent_bits);
        let visible = ((hidden >> i) & 1u) == 0u;
        lobes.diffuse += select(0.0, sample.diffuse, visible);
        lobes.specular += select(0.0, sample.specular, visible);
    }
    return lobes;
}
