// The scene's geometry, as integrators know it. A ray meets it by `closest_hit`, and light is hidden by it as
// `occluded_samples` says. Primitives that are few are looked at one by one, in buffers (`buffers.wgsl`) or as constants; all else
// by trees (`bvh.wgsl`). What a hit is like is here.

// The nearest thing that a ray meets; not what it has left. It may start on the wall of a round primitive, inside of it.
fn closest_hit(ray: Ray, origin_prim: vec2u, inside_prim: vec2u) -> Hit {
    if TLAS_KINDS == 0u {
        return closest_primitive(ray, origin_prim.y, inside_prim.y);
    }
    return closest_in_tree(closest_primitive(ray, by_itself(origin_prim), by_itself(inside_prim)), ray, origin_prim, inside_prim);
}

// Bit i is set where anything hides sample i of the block from a surface. What the surface is of hides none that are above it,
// unless it is round and seen from inside. What is hidden or not of the samples whose bits are set in `unlit` does not matter:
// trees are not asked.
fn occluded_samples(surface: Surface, light: Light, block: SampleBlock, unlit: u32) -> u32 {
    let bits = occluded_by_primitives(surface, light, block);
    if TLAS_KINDS == 0u {
        return bits;
    }
    return occluded_by_bvh(bits | unlit, surface, light, block);
}

// Whether it is so `before`, or anything lies between where rays leave a surface on the viewer's side and `t_max` times the vector `to` from there, but for
// the primitive `target_prim`. What the surface is of does not, as for `occluded_samples`.
fn is_occluded(before: bool, surface: Surface, to: vec3f, t_max: f32, target_prim: u32) -> bool {
    let hidden = is_occluded_by_primitives(before, surface, to, t_max, target_prim);
    if TLAS_KINDS == 0u {
        return hidden;
    }
    return is_occluded_by_bvh(hidden, surface, to, t_max, target_prim);
}

// Whether a hit is on a mesh.
fn is_on_mesh(hit: Hit) -> bool {
    if (TLAS_KINDS & (1u << INSTANCE)) == 0u {
        return false;
    }
    return hit.instance != 0u;
}

// What was hit.
fn fetch_hit_primitive(hit: Hit) -> HitPrimitive {
    if is_on_mesh(hit) {
        return face_of(load_instance(hit.instance - 1u), hit);
    }
    return standalone_hit_primitive(load_primitive(hit.primitive));
}

// The point of a surface where a ray met it.
fn surface_of(prim: HitPrimitive, hit: Hit, ray: Ray) -> Surface {
    if is_on_mesh(hit) {
        let place = vec2u(hit.instance, hit.primitive);
        return face_surface(prim, place, hit.barycentric, ray.direction, environment.shadow_epsilon);
    }
    let q = prim.primitive;
    let surface = surface_at(q, hit.primitive, ray, hit.t, environment.shadow_epsilon);
    if LOOKUPS + SPECULAR_LOOKUPS + ANISOTROPIC == 0u {
        return surface;
    }
    return with_coordinates(surface, q);
}

// What it is made of, textures aside.
fn material_of(prim: HitPrimitive) -> Material {
    return load_material(prim.primitive.material);
}

// How the hit changes with the point of the picture.
fn hit_differential(prim: HitPrimitive, hit: Hit, surface: Surface, ray: Ray, differential: Differential) -> HitDifferential {
    if DIFFERENTIALS == 0u {
        return HitDifferential();
    }
    if is_on_mesh(hit) {
        return face_hit_differential(prim, hit.barycentric, differential, ray, hit.t, surface);
    }
    return arrival(prim.primitive, differential, ray, hit.t, surface);
}

// The part of the surface that the hit stands for, in texture coordinates.
fn footprint_of(prim: HitPrimitive, hit: Hit, surface: Surface, at: HitDifferential) -> Footprint {
    if is_on_mesh(hit) {
        return face_footprint(prim, surface, at.x.position, at.y.position);
    }
    return surface_footprint(prim.primitive, surface, at.x.position, at.y.position);
}

// The camera's ray through a point of the picture, and the middle of its lens.
fn view_ray(place: vec2f) -> Ray {
    if PANORAMIC != 0u {
        return panorama_ray(camera, place);
    }
    return camera_ray(camera, place);
}

// A path from the camera, from behind the last surface that is hidden from it and before all others.
fn skip_camera_invisible(start: Path) -> Path {
    var path = start;
    for (var i = 0u; i < MAX_CAMERA_SKIPS; i++) {
        let hit = closest_hit(path.ray, path.origin_prim, path.inside_prim);
        if hit.primitive == NO_INDEX {
            break;
        }
        let prim = fetch_hit_primitive(hit);
        let hidden = material_of(prim).hidden;
        if hidden == 0u {
            break;
        }
        let surface = surface_of(prim, hit, path.ray);
        if (hidden == CULL_BACKFACE) & (surface.side > 0.0) {
            break;
        }
        path = pass_through_path(path, surface, hit_differential(prim, hit, surface, path.ray, path.differential));
    }
    return path;
}

// What the ray through a pixel's centre meets.
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

// What a path meets first.
fn path_first_hit(path: Path) -> FirstHit {
    let ray = path.ray;
    var hit = closest_hit(ray, path.origin_prim, path.inside_prim);
    if ALPHA_SURFACES != 0u {
        hit = first_seen(ray, hit);
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
