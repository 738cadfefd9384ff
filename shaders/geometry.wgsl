// The scene's geometry, as integrators know it. A ray meets it by `closest_hit`, and light is hidden by it as
// `hidden_samples` says; these two are written for each way to store a geometry (`buffers.wgsl`, or the scene as constants).
// What a hit is like is here.

// The point of a surface where a ray met it.
fn surface_of(hit: Hit, ray: Ray) -> Surface {
    let q = load_primitive(hit.primitive);
    let surface = surface_at(q, hit.primitive, ray, hit.t, environment.shadow_epsilon);
    if LOOKUPS + SPECULAR_LOOKUPS == 0u {
        return surface;
    }
    return with_coordinates(surface, q);
}

// What it is made of, textures aside.
fn material_of(hit: Hit) -> Material {
    return load_material(load_primitive(hit.primitive).material);
}

// How the hit changes with the point of the picture.
fn arrival_of(hit: Hit, surface: Surface, ray: Ray, differential: Differential) -> Arrival {
    if DIFFERENTIALS == 0u {
        return Arrival();
    }
    return arrival(load_primitive(hit.primitive), differential, ray, hit.t, surface);
}

// The part of the surface that the hit stands for, in texture coordinates.
fn footprint_of(hit: Hit, surface: Surface, at: Arrival) -> Footprint {
    return surface_footprint(load_primitive(hit.primitive), surface, at.x.position, at.y.position);
}

// What the ray through a pixel's centre meets.
fn pixel_first_hit(pixel: vec2u) -> FirstHit {
    let ray = camera_ray(camera, vec2f(pixel) + 0.5);
    let hit = closest_hit(ray, NOTHING, NOTHING);
    if hit.primitive == NOTHING {
        return FirstHit(vec3f(0.0), 0.0, vec2f(0.0), NOTHING, NOTHING);
    }
    return first_hit(load_primitive(hit.primitive), ray, hit.t);
}
