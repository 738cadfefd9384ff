// The samples of a pixel, whatever the integrator. An integrator takes a sample's path from surface to surface: `begin_path`, then
// `advance` until it has `ended`; then `path_value` and `path_layers` say what it adds. So lanes that run in step need not wait for
// the longest path: each begins its next sample.

// The camera's ray of one sample, and its weight.
struct CameraSample {
    ray: Ray,
    differential: Differential,
    weight: f32,
}

fn camera_sample(pixel: vec2u, sample: u32) -> CameraSample {
    let round = sample / PIXEL_SAMPLES;
    let index = sample % PIXEL_SAMPLES;
    let u = sample_square(PIXEL_PATTERN, PIXEL_SIDE, index, round, sample_key(pixel, camera.seed, 0u));
    let at = filtered(u);
    let place = vec2f(pixel) + at.xy;
    var ray = view_ray(place);
    if LENS != 0u {
        ray = lens_ray(camera, place, lens_place(pixel, sample));
    }
    return CameraSample(ray, differential_at(place), at.z);
}

// Where on the lens a sample's ray starts: a decision of its own, and so a set over the pixel's samples.
fn lens_place(pixel: vec2u, sample: u32) -> vec2f {
    let key = hash4(vec4u(pixel.x, pixel.y, camera.seed, 0u)).zw;
    var u = sobol_sample(sample, key);
    if PIXEL_PATTERN == RANDOM {
        u = random_sample(sample, 0u, key);
    }
    return lens_sample(camera.blades, u);
}

// What a pixel's samples show besides their sum, each a sum of weighted colours.
struct Layers {
    emission: vec4f,       // light that was not reflected; w the share of the pixel where anything is hit
    direct: vec4f,         // light that was reflected once
    indirect: vec4f,       // light that was reflected more often
    albedo: vec4f,         // the share of light that the surface reflects
    normal: vec4f,         // the shading normal, outwards
}

// How the camera's ray, that through the middle of its lens, changes with its place in the picture.
fn differential_at(place: vec2f) -> Differential {
    if DIFFERENTIALS == 0u {
        return Differential();
    }
    let spacing = 1.0 / sqrt(f32(PIXEL_SAMPLES));
    if PANORAMIC != 0u {
        return panorama_differential(camera, place, spacing);
    }
    return camera_differential(camera, place, spacing);
}

// A uniform position as one that is distributed like the filter, from the pixel's corner, and its weight.
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
