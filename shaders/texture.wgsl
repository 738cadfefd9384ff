// Texture lookups and filters.

fn texture_color(t: Texture, surface: Footprint) -> vec3f {
    let f = texture_footprint(t, surface);
    var factor = vec3f(0.0);
    if (TEXTURE_KINDS & 3u) != 0u {
        if t.kind <= LINES {
            factor = vec3f(procedural_share(t.kind, t.parameter, f));
        }
    }
    if (TEXTURE_KINDS & 4u) != 0u {
        if t.kind == NEAREST {
            factor = nearest_color(t, f.uv);
        }
    }
    if (TEXTURE_KINDS & 24u) != 0u {
        if (t.kind == BILINEAR) | (t.kind == TRILINEAR) {
            factor = linear_color(t, f);
        }
    }
    if (TEXTURE_KINDS & 32u) != 0u {
        if t.kind == EWA {
            factor = ewa_color(t, f);
        }
    }
    return t.first + (t.second - t.first) * factor;
}

// A level of an image pyramid.
struct Level {
    start: u32,            // offset of the first texel
    width: u32,
    height: u32,
}

fn level_of(t: Texture, i: u32) -> Level {
    return Level(texel_word(t.texels + i), level_size(t.width, i), level_size(t.height, i));
}

fn load_texel(t: Texture, level: Level, x: i32, y: i32) -> vec3f {
    let i = wrapped_index(y, level.height, wrap_v(t)) * level.width + wrapped_index(x, level.width, wrap_u(t));
    var color = vec3f(0.0);
    if (TEXEL_FORMATS & 4u) != 0u {
        if t.format == FLOAT {
            let texel = level.start + 3u * i;
            color = vec3f(bitcast<f32>(texel_word(texel)), bitcast<f32>(texel_word(texel + 1u)), bitcast<f32>(texel_word(texel + 2u)));
        }
    }
    if (TEXEL_FORMATS & 3u) != 0u {
        if t.format != FLOAT {
            color = unpacked_color(texel_word(level.start + i), t.format);
        }
    }
    return color;
}

fn nearest_color(t: Texture, uv: vec2f) -> vec3f {
    let level = level_of(t, 0u);
    let x = floor(near_coordinate(uv.x, wrap_u(t)) * f32(level.width));
    let y = floor(near_coordinate(uv.y, wrap_v(t)) * f32(level.height));
    return load_texel(t, level, i32(x), i32(y));
}

// Returns log2 of `length` (in texels of the finest level), clamped to the levels that exist: the fractional level whose
// texels are as long as `length`.
fn level_of_length(t: Texture, length: f32) -> f32 {
    let coarsest = f32(t.levels - 1u);
    let level = max(log2(max(length, 1.0)), 0.0);
    return select(coarsest, level, (length < 1e9) & (level < coarsest));
}

// Interpolates the finest level bilinearly. TRILINEAR blends the two levels whose texels match the footprint's longer
// edge: Williams, "Pyramidal Parametrics", SIGGRAPH 1983.
fn linear_color(t: Texture, f: Footprint) -> vec3f {
    let size = vec2f(f32(t.width), f32(t.height));
    let dx = f.dx * size;
    let dy = f.dy * size;
    let longest = sqrt(max(dx.x * dx.x + dx.y * dx.y, dy.x * dy.x + dy.y * dy.y));
    let lod = select(0.0, level_of_length(t, longest), t.kind == TRILINEAR);
    let finer = floor(lod);
    let blend = lod - finer;
    var color = vec3f(0.0);
    for (var i = 0u; i < select(1u, 2u, blend > 0.0); i++) {
        let sampled = bilinear_color(t, level_of(t, u32(i32(finer)) + i), f.uv);
        color = select(color + (sampled - color) * blend, sampled, i == 0u);
    }
    return color;
}

fn bilinear_color(t: Texture, level: Level, uv: vec2f) -> vec3f {
    let x = near_coordinate(uv.x, wrap_u(t)) * f32(level.width) - 0.5;
    let y = near_coordinate(uv.y, wrap_v(t)) * f32(level.height) - 0.5;
    let x0 = floor(x);
    let y0 = floor(y);
    var rows = array(vec3f(0.0), vec3f(0.0));
    for (var i = 0; i < 2; i++) {
        let left = load_texel(t, level, i32(x0), i32(y0) + i);
        let right = load_texel(t, level, i32(x0) + 1, i32(y0) + i);
        rows[i] = left + (right - left) * (x - x0);
    }
    return rows[0] + (rows[1] - rows[0]) * (y - y0);
}

// Returns the elliptical weighted average: Greene and Heckbert, "Creating Raster Omnimax Images from Multiple
// Perspective Views Using the Elliptical Weighted Average Filter", IEEE CG&A 6(6), 1986; over a pyramid as in Pharr,
// Jakob and Humphreys, "Physically Based Rendering", 3rd edition, 10.4.5, but on finer levels: the minor semi-axis is
// 2.2 to 4.4 texels. Levels blend over the last quarter.
fn ewa_color(t: Texture, f: Footprint) -> vec3f {
    let size = vec2f(f32(t.width), f32(t.height));
    let minor = footprint_ellipse(f.dx * size, f.dy * size, t.parameter).minor;
    let lod = level_of_length(t, 0.45 * minor);
    let finer = floor(lod);
    let blend = max(4.0 * (lod - finer) - 3.0, 0.0);
    let coarsest = lod >= f32(t.levels - 1u); // a single texel needs no footprint, which may be unbounded
    let dx = select(f.dx, vec2f(0.0), coarsest);
    let dy = select(f.dy, vec2f(0.0), coarsest);
    var color = vec3f(0.0);
    for (var i = 0u; i < select(1u, 2u, blend > 0.0); i++) {
        let sampled = ewa_level_color(t, level_of(t, u32(i32(finer)) + i), f.uv, dx, dy);
        color = select(color + (sampled - color) * blend, sampled, i == 0u);
    }
    return color;
}

// Returns the mean of a level over the footprint ellipse, resized so that the filter has the same variance as on the
// finest level: r^2 for a semi-axis r, plus q^2 for the reconstruction filter, where q is the side of a finest texel in
// texels of this level. Texels of this level are box means of finest texels, which already adds (1 - q^2) / 3.
// Semi-axes are at least 1, so that every ellipse contains a texel. Differences from one texel are averaged, so that
// constant colors stay exact.
fn ewa_level_color(t: Texture, level: Level, uv: vec2f, dx: vec2f, dy: vec2f) -> vec3f {
    let size = vec2f(f32(level.width), f32(level.height));
    let q = size / vec2f(f32(t.width), f32(t.height));
    let edges = vec2f(select(size.x, 0.0, level.width == 1u), select(size.y, 0.0, level.height == 1u));
    let ellipse = footprint_ellipse(dx * edges, dy * edges, t.parameter);
    let m = ellipse.m;
    let min_increase = 1.0 - ellipse.minor * ellipse.minor;
    let xx = m.x + max((4.0 * (q.x * q.x) - 1.0) / 3.0, min_increase);
    let yy = m.z + max((4.0 * (q.y * q.y) - 1.0) / 3.0, min_increase);
    let slope = m.y / yy;
    let half_width2 = xx - m.y * slope; // squared half-width of the ellipse in the row through its center
    let x = near_coordinate(uv.x, wrap_u(t)) * size.x - 0.5;
    let y = near_coordinate(uv.y, wrap_v(t)) * size.y - 0.5;
    let half_height = sqrt(yy);
    let first_row = -i32(floor(half_height - y));
    let last_row = i32(floor(y + half_height));
    var base = vec3f(0.0);
    var sum = vec3f(0.0);
    var total = 0.0;
    for (var row = first_row; row <= last_row; row++) {
        let h = f32(row) - y;
        let row_r2 = h * h / yy;
        let middle = x + h * slope;
        let half = sqrt(half_width2 * max(1.0 - row_r2, 0.0));
        let last = i32(floor(middle + half));
        for (var column = -i32(floor(half - middle)); column <= last; column++) {
            let w = f32(column) - middle;
            let weight = max(gaussian_weight(row_r2 + w * w / half_width2), 0.0);
            let color = load_texel(t, level, column, row);
            base = select(base, color, total == 0.0);
            sum += (color - base) * weight;
            total += weight;
        }
    }
    return base + sum * select(0.0, 1.0 / total, total > 0.0);
}

// Returns the channel of a scalar parameter.
fn channel_of(color: vec3f, lookup: Lookup, slot: u32) -> f32 {
    let channel = (lookup.channels >> (2u * slot)) & 3u;
    return select(select(color.x, color.y, channel == 1u), color.z, channel == 2u);
}

// Sets the parameters that only principled materials have.
fn with_principled(before: Material, color: vec3f, lookup: Lookup) -> Material {
    var m = before;
    let purposes = lookup.purposes;
    m.sheen = select(m.sheen, color, (purposes & FOR_SHEEN) != 0u);
    m.metallic = select(m.metallic, channel_of(color, lookup, METALLIC_CHANNEL), (purposes & FOR_METALLIC) != 0u);
    m.anisotropy = select(m.anisotropy, channel_of(color, lookup, ANISOTROPY_CHANNEL), (purposes & FOR_ANISOTROPY) != 0u);
    if (LOBES & LOBE_ANISOTROPY) != 0u {
        m.rotation += select(0.0, direction_turn(color), (purposes & FOR_DIRECTION) != 0u);
    }
    m.specular_weight = select(m.specular_weight, channel_of(color, lookup, SPECULAR_WEIGHT_CHANNEL), (purposes & FOR_SPECULAR_WEIGHT) != 0u);
    m.transmission = select(m.transmission, channel_of(color, lookup, TRANSMISSION_CHANNEL), (purposes & FOR_TRANSMISSION) != 0u);
    m.clearcoat = select(m.clearcoat, channel_of(color, lookup, CLEARCOAT_CHANNEL), (purposes & FOR_CLEARCOAT) != 0u);
    let coat_roughness = channel_of(color, lookup, CLEARCOAT_ROUGHNESS_CHANNEL);
    m.clearcoat_roughness = select(m.clearcoat_roughness, coat_roughness, (purposes & FOR_CLEARCOAT_ROUGHNESS) != 0u);
    let sheen_roughness = channel_of(color, lookup, SHEEN_ROUGHNESS_CHANNEL);
    m.sheen_roughness = select(m.sheen_roughness, sheen_roughness, (purposes & FOR_SHEEN_ROUGHNESS) != 0u);
    m.opacity = select(m.opacity, channel_of(color, lookup, OPACITY_CHANNEL), (purposes & FOR_OPACITY) != 0u);
    return m;
}

// A material with the results of its texture lookups, and the shading normals.
struct EvaluatedMaterial {
    material: Material,
    normal: vec3f,
    coat_normal: vec3f,    // of the clearcoat
}

// Evaluates the textures and normal maps of a material with at most `lookups` texture lookups.
fn evaluate_material(prim: HitPrimitive, hit: Hit, material: Material, surface: Surface, hit_diff: HitDifferential, lookups: u32) -> EvaluatedMaterial {
    var shading = EvaluatedMaterial(material, surface.shading_normal, surface.shading_normal);
    if lookups == 0u {
        return shading;
    }
    let footprint = footprint_of(prim, hit, surface, hit_diff);
    for (var i = 0u; i < lookups; i++) {
        if i < material.lookups.y {
            let lookup = load_lookup(material.lookups.x + i);
            let t = load_texture(lookup.texture);
            let color = texture_color(t, footprint_in_set(footprint, prim, hit, hit_diff, lookup.uv_set));
            let purposes = lookup.purposes;
            shading.material.ambient = select(shading.material.ambient, color, (purposes & FOR_AMBIENT) != 0u);
            shading.material.diffuse = select(shading.material.diffuse, color, (purposes & FOR_DIFFUSE) != 0u);
            shading.material.specular = select(shading.material.specular, color, (purposes & FOR_SPECULAR) != 0u);
            shading.material.tint = select(shading.material.tint, color, (purposes & FOR_TINT) != 0u);
            shading.material.emission = select(shading.material.emission, color, (purposes & FOR_EMISSION) != 0u);
            shading.material.roughness = select(shading.material.roughness, channel_of(color, lookup, ROUGHNESS_CHANNEL), (purposes & FOR_ROUGHNESS) != 0u);
            if (MATERIALS & (1u << PRINCIPLED)) != 0u {
                shading.material = with_principled(shading.material, color, lookup);
                if (LOBES & LOBE_COAT) != 0u {
                    if (purposes & FOR_CLEARCOAT_NORMAL) != 0u {
                        shading.coat_normal = mapped_normal(surface, t, color);
                    }
                }
            }
            if NORMAL_MAPS == 1u {
                if (purposes & FOR_NORMAL) != 0u {
                    shading.normal = mapped_normal(surface, t, color);
                }
            }
        }
    }
    return shading;
}
