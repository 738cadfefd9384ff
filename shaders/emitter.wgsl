// Emitter selection and light sampling for next-event estimation (NEE).

// Light from a sampled emitter that may arrive at a point.
struct LightSample {
    to: vec3f,             // vector to the sampled point; direction to distant light
    radiance: vec3f,       // for a delta light, the contribution at a pdf of 1
    pdf: f32,              // per solid angle, including the selection; for a delta light, only the selection probability
    is_delta: bool,        // BSDF samples cannot hit the light
    t_max: f32,            // end of shadow rays, as a multiple of `to`
    primitive: u32,        // emitting primitive, which does not occlude itself, or NO_INDEX
}

// Selects an emitter by power with two 32-bit random numbers: Walker's alias method, "An Efficient Method for
// Generating Discrete Random Variables with General Distributions", ACM TOMS 3(3), 1977.
fn select_emitter(bits: vec2u) -> Emitter {
    let count = emitter_count();
    if EMITTERS == 1u {
        return load_emitter(0u);
    }
    let first = uniform_below(bits.x, count);
    let emitter = load_emitter(first);
    return load_emitter(select(emitter.alias_index, first, unit_float(bits.y) < emitter.threshold));
}

// Samples the light that arrives at p. `normal` is the surface normal, or 0 if light may arrive from both sides.
fn sample_emitter(selection: EmitterSelection, p: vec3f, normal: vec3f, u: vec2f) -> LightSample {
    let emitter = selection.emitter;
    if (EMITTER_KINDS & (1u << INSTANCE)) != 0u {
        if emitter.instance != 0u {
            return sample_face(selection, p, u);
        }
    }
    var light = load_light(emitter.index);
    if (EMITTER_KINDS & (1u << ENVIRONMENT)) != 0u {
        if (EMITTER_KINDS == (1u << ENVIRONMENT)) | (light.kind == ENVIRONMENT) {
            return sample_environment(light, normal, u);
        }
    }
    if LIGHT_TREE != 0u {
        light.density = select(light.density, selection.density, selection.density > 0.0);
    }
    return sample_light(light, p, u);
}

fn sample_light(light: Light, p: vec3f, u: vec2f) -> LightSample {
    var position = vec2f(0.0);
    if (EMITTER_KINDS & (1u << RECTANGLE)) != 0u {
        position = select(position, u * 2.0 - 1.0, light.kind == RECTANGLE);
    }
    if (EMITTER_KINDS & (1u << DISK)) != 0u {
        position = select(position, disk_sample(u), light.kind == DISK);
    }
    if (EMITTER_KINDS & (1u << TRIANGLE)) != 0u {
        position = select(position, triangle_sample(u), light.kind == TRIANGLE);
    }
    var to_light = (light.center - p * light.finite) + light.u * position.x + light.v * position.y;
    var pdf = light.density;
    var radiance = light.color;
    let is_delta = light.kind >= POINT;
    var behind = false;
    if (EMITTER_KINDS & (1u << POINT)) != 0u {
        radiance = select(radiance, light.color / dot(to_light, to_light), light.kind == POINT);
    }
    if (EMITTER_KINDS & (1u << SPOT)) != 0u {
        radiance = select(radiance, light.color * (spot_falloff(light, to_light) / dot(to_light, to_light)), light.kind == SPOT);
    }
    if (EMITTER_KINDS & ((1u << RECTANGLE) | (1u << DISK) | (1u << TRIANGLE))) != 0u {
        pdf = select(solid_angle_pdf(pdf, to_light, light.normal), pdf, is_delta);
        behind = (light.sides == 1u) & (dot(light.normal, to_light) >= 0.0);
    }
    if (EMITTER_KINDS & (1u << ELLIPSOID)) != 0u {
        if light.kind == ELLIPSOID {
            let q = load_primitive(light.primitive);
            to_light = ellipsoid_sample(q, p, u);
            pdf = light.density * ellipsoid_area(q) * ellipsoid_pdf(q, p, normalize(to_light));
        }
    }
    if (EMITTER_KINDS & (1u << CYLINDER)) != 0u {
        if light.kind == CYLINDER {
            let q = load_primitive(light.primitive);
            let point = cylinder_sample(q, p, u);
            to_light = point.to;
            pdf = solid_angle_pdf(light.density * cylinder_share(q, p), to_light, point.normal);
        }
    }
    if EMISSION_TEXTURES != 0u {
        if !is_delta {
            let q = load_primitive(light.primitive);
            let uv = primitive_uv(q, point_to_local(q, p + to_light));
            let hit = hit_on_primitive(light.primitive);
            radiance = emission_at(load_material(q.material), standalone_hit_primitive(q), hit, uv);
        }
    }
    if ALPHA_SURFACES != 0u {
        if !is_delta {
            let q = load_primitive(light.primitive);
            let hit = hit_on_primitive(light.primitive);
            radiance *= opacity_at(load_material(q.material), standalone_hit_primitive(q), hit, primitive_uv(q, point_to_local(q, p + to_light)));
        }
    }
    radiance = select(radiance, vec3f(0.0), behind);
    return LightSample(to_light, radiance, pdf, is_delta, light.t_max, light.primitive);
}

fn hit_on_primitive(primitive: u32) -> Hit {
    return Hit(0.0, 0u, primitive, 0u, vec2f(0.0));
}

fn sample_face(selection: EmitterSelection, p: vec3f, u: vec2f) -> LightSample {
    let emitter = selection.emitter;
    let b = triangle_sample(u);
    let hit = Hit(0.0, emitter.instance, 0u, emitter.index, b);
    let face = face_of(load_instance(emitter.instance - 1u), hit);
    let material = material_of(face);
    let to_light = face.primitive.anchor + (face.edge_1 * b.x + face.edge_2 * b.y) - p;
    var radiance = material.emission;
    if EMISSION_TEXTURES != 0u {
        radiance = emission_at(material, face, hit, face_uv(face, b));
    }
    if VERTEX_COLORS != 0u {
        if material.vertex_colors == COLORS_OF_EMISSION {
            radiance *= vertex_color(hit).xyz;
        }
    }
    if ALPHA_SURFACES != 0u {
        radiance *= opacity_at(material, face, hit, face_uv(face, b));
    }
    var density = material.density;
    if LIGHT_TREE != 0u {
        density = selection.density;
    }
    let pdf = solid_angle_pdf(density, to_light, face.primitive.z);
    return LightSample(to_light, radiance, pdf, false, environment.t_max, NO_INDEX);
}

// Returns the textured emission, without vertex colors.
fn emission_at(material: Material, prim: HitPrimitive, hit: Hit, uv: vec2f) -> vec3f {
    var emission = material.emission;
    for (var i = 0u; i < LOOKUPS; i++) {
        if i < material.lookups.y {
            let lookup = load_lookup(material.lookups.x + i);
            if (lookup.purposes & FOR_EMISSION) != 0u {
                let set_uv = uv_in_set(uv, prim, hit, lookup.uv_set);
                emission = texture_color(load_texture(lookup.texture), Footprint(set_uv, vec2f(0.0), vec2f(0.0)));
            }
        }
    }
    return emission;
}

// Returns the pdf of `sample_emitter` for a hit, per solid angle; `density` is per area. Both pdfs include the
// selection probability.
fn emitter_pdf(prim: HitPrimitive, hit: Hit, density: f32, ray: Ray, normal: vec3f) -> f32 {
    if (EMITTER_KINDS & (1u << ELLIPSOID)) != 0u {
        if prim.primitive.kind == ELLIPSOID {
            let q = prim.primitive;
            return density * ellipsoid_area(q) * ellipsoid_pdf(q, ray.origin, ray.direction);
        }
    }
    var per_area = density;
    if (EMITTER_KINDS & (1u << CYLINDER)) != 0u {
        if prim.primitive.kind == CYLINDER {
            per_area = density * cylinder_share(prim.primitive, ray.origin);
        }
    }
    return solid_angle_pdf(per_area, ray.direction * hit.t, normal);
}
