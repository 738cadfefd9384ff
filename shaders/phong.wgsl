// Phong's reflection model: Phong, "Illumination for Computer Generated Pictures", CACM 18(6), 1975.

// The diffuse cosine and the specular power, each summed over samples.
struct Lobes {
    diffuse: f32,
    specular: f32,
}

// Returns the lobes of one light sample, in the direction `to_light`, whose length is arbitrary; 0 if the sample does
// not light the surface.
fn phong_lobes(surface: Surface, material: Material, to_light: vec3f, exponent_bits: u32) -> Lobes {
    let inverse_length = 1.0 / sqrt(dot(to_light, to_light));
    let n_l = dot(surface.shading_normal, to_light);
    let n_v = dot(surface.shading_normal, surface.wo);
    let r_v = (2.0 * n_l * n_v - dot(surface.wo, to_light)) * inverse_length;
    let r_v_power = phong_power(max(r_v, 0.0), material, exponent_bits);
    let lit = is_lit(surface, to_light);
    return Lobes(select(0.0, n_l * inverse_length, lit), select(0.0, r_v_power, lit));
}

// Returns true if `direction` is on the side of both the shading normal and the smooth normal. The geometric normal of
// a mesh is ignored: otherwise, the triangles would be visible at the terminator.
fn is_lit(surface: Surface, direction: vec3f) -> bool {
    return (dot(surface.shading_normal, direction) > 0.0) & (dot(surface.smooth_normal, direction) > 0.0);
}

// Returns the mask of samples that do not light the surface of `prim` and need no shadow ray.
fn unlit_mask(prim: HitPrimitive, surface: Surface, segments: LightSegments, block: SampleBlock) -> u32 {
    var bits = 0u;
    for (var i = 0u; i < block.count; i++) {
        let d = segment(segments, block_sample(block, i));
        bits |= select(1u << i, 0u, is_lit(surface, d) & face_direction_allowed(prim, surface, d));
    }
    return bits;
}

fn phong_power(x: f32, material: Material, exponent_bits: u32) -> f32 {
    if exponent_bits > 0u {
        return power_whole(x, material.exponent, exponent_bits);
    }
    return power(x, material.shininess);
}

// Adds unoccluded samples to the lobes, in order.
fn phong_block(surface: Surface, material: Material, segments: LightSegments, block: SampleBlock, occluded: u32, exponent_bits: u32,
               sum: Lobes) -> Lobes {
    var lobes = sum;
    for (var i = 0u; i < block.count; i++) {
        let sample = phong_lobes(surface, material, segment(segments, block_sample(block, i)), exponent_bits);
        let visible = ((occluded >> i) & 1u) == 0u;
        lobes.diffuse += select(0.0, sample.diffuse, visible);
        lobes.specular += select(0.0, sample.specular, visible);
    }
    return lobes;
}
