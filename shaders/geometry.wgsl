// The scene's geometry, as integrators know it. A ray meets it by `closest_hit`, and light is hidden by it as
// `hidden_samples` says. Primitives that are few are looked at one by one, in buffers (`buffers.wgsl`) or as constants; all else
// by trees (`tree.wgsl`). What a hit is like is here.

// The nearest thing that a ray meets; not what it has left. It may start on the wall of a round primitive, inside of it.
fn closest_hit(ray: Ray, left: vec2u, wall: vec2u) -> Hit {
    if IN_TREE == 0u {
        return closest_primitive(ray, left.y, wall.y);
    }
    return closest_in_tree(closest_primitive(ray, by_itself(left), by_itself(wall)), ray, left, wall);
}

// Bit i is set where anything hides sample i of the block from a surface. What the surface is of hides none that are above it,
// unless it is round and seen from inside. What is hidden or not of the samples whose bits are set in `unlit` does not matter:
// trees are not asked.
fn hidden_samples(surface: Surface, light: Light, block: Block, unlit: u32) -> u32 {
    let bits = hidden_by_primitives(surface, light, block);
    if IN_TREE == 0u {
        return bits;
    }
    return hidden_by_tree(bits | unlit, surface, light, block);
}

// Whether it is so `before`, or anything lies between where rays leave a surface on the viewer's side and `reach` times the vector `to` from there, but for
// the primitive `goal`. What the surface is of does not, as for `hidden_samples`.
fn is_hidden(before: bool, surface: Surface, to: vec3f, reach: f32, goal: u32) -> bool {
    let hidden = is_hidden_by_primitives(before, surface, to, reach, goal);
    if IN_TREE == 0u {
        return hidden;
    }
    return is_hidden_by_tree(hidden, surface, to, reach, goal);
}

// Whether a hit is on a mesh.
fn is_on_mesh(hit: Hit) -> bool {
    if (IN_TREE & (1u << INSTANCE)) == 0u {
        return false;
    }
    return hit.instance != 0u;
}

// What was hit.
fn spot_of(hit: Hit) -> Spot {
    if is_on_mesh(hit) {
        return face_of(load_instance(hit.instance - 1u), hit);
    }
    return spot_by_itself(load_primitive(hit.primitive));
}

// The point of a surface where a ray met it.
fn surface_of(spot: Spot, hit: Hit, ray: Ray) -> Surface {
    if is_on_mesh(hit) {
        let place = vec2u(hit.instance, hit.primitive);
        return face_surface(spot, place, hit.barycentric, ray.direction, environment.shadow_epsilon);
    }
    let q = spot.primitive;
    let surface = surface_at(q, hit.primitive, ray, hit.t, environment.shadow_epsilon);
    if LOOKUPS + SPECULAR_LOOKUPS + ANISOTROPIC == 0u {
        return surface;
    }
    return with_coordinates(surface, q);
}

// What it is made of, textures aside.
fn material_of(spot: Spot) -> Material {
    return load_material(spot.primitive.material);
}

// How the hit changes with the point of the picture.
fn arrival_of(spot: Spot, hit: Hit, surface: Surface, ray: Ray, differential: Differential) -> Arrival {
    if DIFFERENTIALS == 0u {
        return Arrival();
    }
    if is_on_mesh(hit) {
        return face_arrival(spot, hit.barycentric, differential, ray, hit.t, surface);
    }
    return arrival(spot.primitive, differential, ray, hit.t, surface);
}

// The part of the surface that the hit stands for, in texture coordinates.
fn footprint_of(spot: Spot, hit: Hit, surface: Surface, at: Arrival) -> Footprint {
    if is_on_mesh(hit) {
        return face_footprint(spot, surface, at.x.position, at.y.position);
    }
    return surface_footprint(spot.primitive, surface, at.x.position, at.y.position);
}

// The camera's ray through a point of the picture, and the middle of its lens.
fn view_ray(place: vec2f) -> Ray {
    if PANORAMIC != 0u {
        return panorama_ray(camera, place);
    }
    return camera_ray(camera, place);
}

// A path from the camera, from behind the last surface that is hidden from it and before all others.
fn seen_path(start: Path) -> Path {
    var path = start;
    for (var i = 0u; i < MOST_HIDDEN; i++) {
        let hit = closest_hit(path.ray, path.left, path.wall);
        if hit.primitive == NO_INDEX {
            break;
        }
        let spot = spot_of(hit);
        let hidden = material_of(spot).hidden;
        if hidden == 0u {
            break;
        }
        let surface = surface_of(spot, hit, path.ray);
        if (hidden == HIDDEN_BACK) & (surface.side > 0.0) {
            break;
        }
        path = passed_path(path, surface, arrival_of(spot, hit, surface, path.ray, path.differential));
    }
    return path;
}

// What the ray through a pixel's centre meets.
fn pixel_first_hit(pixel: vec2u) -> FirstHit {
    let start = view_ray(vec2f(pixel) + 0.5);
    var path = Path(start, Differential(), vec3f(1.0), 0u, 0u, NOWHERE, NOWHERE);
    if HIDDEN != 0u {
        path = seen_path(path);
    }
    var found = path_first_hit(path);
    if (HIDDEN != 0u) & (found.shape != NO_INDEX) {
        found.depth += dot(path.ray.origin - start.origin, start.direction);
    }
    return found;
}

// What a path meets first.
fn path_first_hit(path: Path) -> FirstHit {
    let ray = path.ray;
    var hit = closest_hit(ray, path.left, path.wall);
    if SEES_THROUGH != 0u {
        hit = first_seen(ray, hit);
    }
    if hit.primitive == NO_INDEX {
        let zero = vec3f(0.0);
        return FirstHit(zero, 0.0, zero.xy, NO_INDEX, NO_INDEX, zero, NO_INDEX, zero.xy, vec2u(0u));
    }
    let spot = spot_of(hit);
    if is_on_mesh(hit) {
        return face_first_hit(spot, hit);
    }
    return first_hit(spot.primitive, ray, hit.t);
}
