// Specular paths from the camera: reflection, refraction, and splitting at glass.

struct Path {
    ray: Ray,
    differential: Differential,
    throughput: vec3f,     // factor of the radiance that arrives along the ray
    depth: u32,            // number of bounces
    branch: u32,           // bit i is set for the reflection at the split of bounce i
    origin_prim: vec2u,    // instance and primitive that the ray cannot hit again, else NO_PRIMITIVE
    inside_prim: vec2u,    // solid that the ray starts on and passes through, else NO_PRIMITIVE
}

struct SpecularSplit {
    primary: Path,
    secondary: Path,       // the other branch, if the path splits
    splits: bool,
}

fn is_specular(material: Material) -> bool {
    return (material.kind == MIRROR) | (material.kind == GLASS);
}

fn mirrored_path(path: Path, surface: Surface, hit_diff: HitDifferential, material: Material) -> SpecularSplit {
    let primary = reflected_path(path, surface, hit_diff, path.throughput * material.tint);
    return SpecularSplit(primary, primary, false);
}

// Returns `normal` if it is usable, else the smooth normal if it is usable, else the geometric normal.
fn usable_normal(surface: Surface, normal: vec3f) -> vec3f {
    let fallback = select(surface.normal, surface.smooth_normal, is_usable(surface, surface.smooth_normal));
    return select(fallback, normal, is_usable(surface, normal));
}

// Returns true if a normal faces the viewer and reflects to the viewer's side of the surface.
fn is_usable(surface: Surface, normal: vec3f) -> bool {
    let outward = dot(reflected_direction(-surface.wo, normal), surface.normal) > 0.0;
    return outward & (dot(surface.wo, normal) > 0.0);
}

// Returns both branches at the first MAX_SPLIT_DEPTH bounces, later the branch that `random` in [0, 1) selects.
fn glass_path(path: Path, surface: Surface, hit_diff: HitDifferential, material: Material, random: f32) -> SpecularSplit {
    let eta = select(material.ior, 1.0 / material.ior, surface.side > 0.0);
    let cosine_i = max(dot(surface.wo, surface.shading_normal), 1e-6);
    let cosine_t = refracted_cosine(cosine_i, eta);
    let reflectance = fresnel(cosine_i, cosine_t, eta);
    let splits = (path.depth < MAX_SPLIT_DEPTH) & (reflectance > 0.0) & (reflectance < 1.0);
    let reflected_share = select(1.0, reflectance, splits);
    var reflection = reflected_path(path, surface, hit_diff, path.throughput * reflected_share);
    let refracted_share = select(1.0, 1.0 - reflectance, splits);
    let refraction = refracted_path(path, surface, hit_diff, path.throughput * material.tint * refracted_share, eta, cosine_i, cosine_t);
    if splits {
        reflection.branch |= 1u << path.depth;
        return SpecularSplit(refraction, reflection, true);
    }
    if random < reflectance {
        return SpecularSplit(reflection, reflection, false);
    }
    return SpecularSplit(refraction, refraction, false);
}

fn reflected_path(path: Path, surface: Surface, hit_diff: HitDifferential, throughput: vec3f) -> Path {
    let d = path.ray.direction;
    let ray = Ray(surface.ray_origin, reflected_direction(d, surface.shading_normal));
    let differential = reflected_differential(hit_diff, d, surface.shading_normal);
    return Path(ray, differential, throughput, path.depth + 1u, path.branch, surface.exclude_front, surface.exclude_back);
}

fn refracted_path(path: Path, surface: Surface, hit_diff: HitDifferential, throughput: vec3f, eta: f32, cosine_i: f32,
                  cosine_t: f32) -> Path {
    let d = path.ray.direction;
    let origin = surface.position - (surface.ray_origin - surface.position);
    let ray = Ray(origin, refracted_direction(d, surface.shading_normal, eta, cosine_i, cosine_t));
    let differential = refracted_differential(hit_diff, d, surface.shading_normal, eta, cosine_t);
    return Path(ray, differential, throughput, path.depth + 1u, path.branch, surface.exclude_back, surface.exclude_front);
}

// Continues a path in the same direction behind an ignored surface.
fn pass_through_path(path: Path, surface: Surface, hit_diff: HitDifferential) -> Path {
    let origin = surface.position - (surface.ray_origin - surface.position);
    let ray = Ray(origin, path.ray.direction);
    return Path(ray, Differential(hit_diff.x, hit_diff.y), path.throughput, path.depth, path.branch, surface.exclude_back, surface.exclude_front);
}
