// Ray queries of integrators. A few primitives are tested one by one, from buffers (`buffers.wgsl`) or as constants;
// all others are in BVHs (`bvh.wgsl`).

// Returns the closest hit except on `origin_prim`. The ray starts on the solid `inside_prim`, if any, and goes inwards.
fn closest_hit(ray: Ray, origin_prim: vec2u, inside_prim: vec2u) -> Hit {
    if TLAS_KINDS == 0u {
        return closest_primitive(ray, origin_prim.y, inside_prim.y);
    }
    return closest_in_bvh(closest_primitive(ray, standalone_prim(origin_prim), standalone_prim(inside_prim)), ray, origin_prim, inside_prim);
}

// Returns the mask of occluded samples. The surface's own primitive does not occlude samples above the surface, unless
// the primitive is a solid seen from inside. Samples in the mask `unlit` are not tested against the BVH, and their bits
// have no meaning.
fn occluded_samples(surface: Surface, light: Light, block: SampleBlock, unlit: u32) -> u32 {
    let bits = occluded_by_primitives(surface, light, block);
    if TLAS_KINDS == 0u {
        return bits;
    }
    return occluded_by_bvh(bits | unlit, surface, light, block);
}

// Returns true if `already_occluded` is true, or if a primitive except `target_prim` occludes the segment from the
// surface along `t_max * to_light`. The surface's own primitive counts as in `occluded_samples`.
fn is_occluded(already_occluded: bool, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool {
    let occluded = is_occluded_by_primitives(already_occluded, surface, to_light, t_max, target_prim);
    if TLAS_KINDS == 0u {
        return occluded;
    }
    return is_occluded_by_bvh(occluded, surface, to_light, t_max, target_prim);
}

fn is_on_mesh(hit: Hit) -> bool {
    if (TLAS_KINDS & (1u << INSTANCE)) == 0u {
        return false;
    }
    return hit.instance != 0u;
}

fn fetch_hit_primitive(hit: Hit) -> HitPrimitive {
    if is_on_mesh(hit) {
        return face_of(load_instance(hit.instance - 1u), hit);
    }
    return standalone_hit_primitive(load_primitive(hit.primitive));
}

fn surface_of(prim: HitPrimitive, hit: Hit, ray: Ray) -> Surface {
    if is_on_mesh(hit) {
        let prim_id = vec2u(hit.instance, hit.primitive);
        return face_surface(prim, prim_id, hit.barycentric, ray.direction, environment.shadow_epsilon);
    }
    let q = prim.primitive;
    let surface = surface_at(q, hit.primitive, ray, hit.t, environment.shadow_epsilon);
    if LOOKUPS + SPECULAR_LOOKUPS + ANISOTROPIC == 0u {
        return surface;
    }
    return with_coordinates(surface, q);
}

fn material_of(prim: HitPrimitive) -> Material {
    return load_material(prim.primitive.material);
}

fn hit_differential(prim: HitPrimitive, hit: Hit, surface: Surface, ray: Ray, differential: Differential) -> HitDifferential {
    if DIFFERENTIALS == 0u {
        return HitDifferential();
    }
    if is_on_mesh(hit) {
        return face_hit_differential(prim, hit.barycentric, differential, ray, hit.t, surface);
    }
    return primitive_hit_differential(prim.primitive, differential, ray, hit.t, surface);
}

// Returns the footprint in texture coordinates.
fn footprint_of(prim: HitPrimitive, hit: Hit, surface: Surface, hit_diff: HitDifferential) -> Footprint {
    if is_on_mesh(hit) {
        return face_footprint(prim, surface, hit_diff.x.position, hit_diff.y.position);
    }
    return surface_footprint(prim.primitive, surface, hit_diff.x.position, hit_diff.y.position);
}

// Returns the camera ray through an image point and the lens center.
fn view_ray(raster: vec2f) -> Ray {
    if PANORAMIC != 0u {
        return panorama_ray(camera, raster);
    }
    return camera_ray(camera, raster);
}

// Continues a camera path behind the surfaces at its start that are invisible to the camera.
fn skip_camera_invisible(start: Path) -> Path {
    var path = start;
    for (var i = 0u; i < MAX_CAMERA_SKIPS; i++) {
        let hit = closest_hit(path.ray, path.origin_prim, path.inside_prim);
        if hit.primitive == NO_INDEX {
            break;
        }
        let prim = fetch_hit_primitive(hit);
        let culling = material_of(prim).camera_culling;
        if culling == 0u {
            break;
        }
        let surface = surface_of(prim, hit, path.ray);
        if (culling == CULL_BACKFACE) & (surface.side > 0.0) {
            break;
        }
        path = pass_through_path(path, surface, hit_differential(prim, hit, surface, path.ray, path.differential));
    }
    return path;
}

fn pixel_first_hit(pixel: vec2u) -> FirstHit {
    let start = view_ray(vec2f(pixel) + 0.5);
    var path = Path(start, Differential(), vec3f(1.0), 0u, 0u, NO_PRIMITIVE, NO_PRIMITIVE);
    if CAMERA_INVISIBLE != 0u {
        path = skip_camera_invisible(path);
    }
    var found = path_first_hit(path);
    if (CAMERA_INVISIBLE != 0u) & (found.shape != NO_INDEX) {
        found.depth += dot(path.ray.origin - start.origin, start.direction);
    }
    return found;
}

fn path_first_hit(path: Path) -> FirstHit {
    let ray = path.ray;
    var hit = closest_hit(ray, path.origin_prim, path.inside_prim);
    if ALPHA_SURFACES != 0u {
        hit = skip_transparent(ray, hit);
    }
    if hit.primitive == NO_INDEX {
        let zero = vec3f(0.0);
        return FirstHit(zero, 0.0, zero.xy, NO_INDEX, NO_INDEX, zero, NO_INDEX, zero.xy, vec2u(0u));
    }
    let prim = fetch_hit_primitive(hit);
    if is_on_mesh(hit) {
        return face_first_hit(prim, hit);
    }
    return first_hit(prim.primitive, ray, hit.t);
}
