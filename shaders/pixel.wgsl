// Camera samples of a pixel, and the interface of integrators: `begin_path` starts a path, and each call of `advance`
// extends it to the next surface. Once `PathState::ended` is true, `path_value` and `path_layers` return the path's
// contribution. Lanes in lockstep thus begin their next samples without waiting for the longest path.

struct CameraSample {
    ray: Ray,
    differential: Differential,
    weight: f32,
}

fn camera_sample(pixel: vec2u, sample: u32) -> CameraSample {
    let round = sample / PIXEL_SAMPLES;
    let index = sample % PIXEL_SAMPLES;
    let u = sample_square(PIXEL_PATTERN, PIXEL_SIDE, index, round, sample_key(pixel, camera.seed, 0u));
    let position = filtered(u);
    let raster = vec2f(pixel) + position.xy;
    var ray = view_ray(raster);
    if LENS != 0u {
        ray = lens_ray(camera, raster, lens_point(pixel, sample));
    }
    return CameraSample(ray, differential_at(raster), position.z);
}

// Returns a sample's point on the lens, from a separate point set over the pixel's samples.
fn lens_point(pixel: vec2u, sample: u32) -> vec2f {
    let key = hash4(vec4u(pixel.x, pixel.y, camera.seed, 0u)).zw;
    var u = sobol_sample(sample, key);
    if PIXEL_PATTERN == RANDOM {
        u = random_sample(sample, 0u, key);
    }
    return lens_sample(camera.blades, u);
}

// Further outputs of a pixel, as sums of weighted colors.
struct Layers {
    emission: vec4f,       // emitted radiance; w: coverage of the pixel
    direct: vec4f,         // radiance scattered once
    indirect: vec4f,       // radiance scattered more than once
    albedo: vec4f,         // albedo of the first surface that is neither mirror nor glass
    normal: vec4f,         // outward shading normal of the first hit; w: its distance, if noise is estimated
}

// Returns the differential of the ray through the lens center with respect to the image position.
fn differential_at(raster: vec2f) -> Differential {
    if DIFFERENTIALS == 0u {
        return Differential();
    }
    let spacing = 1.0 / sqrt(f32(PIXEL_SAMPLES));
    if PANORAMIC != 0u {
        return panorama_differential(camera, raster, spacing);
    }
    return camera_differential(camera, raster, spacing);
}

// Warps a uniform position in the pixel to the filter. x and y are relative to the pixel corner; z is the weight.
fn filtered(u: vec2f) -> vec3f {
    if FILTER_BINS == 0u {
        return vec3f(u, 1.0);
    }
    let i = filter_bin(u.x, FILTER_BINS);
    let j = filter_bin(u.y, FILTER_BINS);
    let x = filter_offset(u.x, i, FILTER_BINS, filter_table[i].x, filter_table[i].y);
    let y = filter_offset(u.y, j, FILTER_BINS, filter_table[j].x, filter_table[j].y);
    return vec3f(0.5 + x, 0.5 + y, filter_table[i].z * filter_table[j].z);
}
