// The samples of a pixel, whatever the integrator.

// One sample of a pixel: its radiance times its weight, and its weight.
fn pixel_radiance(pixel: vec2u, sample: u32) -> vec4f {
    let round = sample / PIXEL_SAMPLES;
    let index = sample % PIXEL_SAMPLES;
    let u = sample_square(PIXEL_PATTERN, PIXEL_SIDE, index, round, sample_key(pixel, camera.seed, 0u));
    let at = filtered(u);
    let place = vec2f(pixel) + at.xy;
    return vec4f(radiance(camera_ray(camera, place), differential_at(place), pixel, sample) * at.z, at.z);
}

// How the camera's ray changes with its place in the picture.
fn differential_at(place: vec2f) -> Differential {
    if DIFFERENTIALS == 0u {
        return Differential();
    }
    return camera_differential(camera, place, 1.0 / sqrt(f32(PIXEL_SAMPLES)));
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
