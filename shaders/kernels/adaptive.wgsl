// Adaptive rendering: like `render.wgsl`, but takes more than the pilot samples only where the pilot statistics of
// neighboring pixels require more. Two further lists of the film contain moments and pilot statistics. A dispatch
// renders either pilot samples or later samples, which require all pilot samples of the film. A pixel's own samples do
// not affect the pixel's sample count: with such a stopping rule, the mean is biased.

@compute @workgroup_size(8, 8)
fn adaptive(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let pixel = params.origin + id.xy;
    let film_pixel = pixel - params.film_origin;
    let index = film_pixel.y * params.film_size.x + film_pixel.x;
    let pixels = params.film_size.x * params.film_size.y;
    var sum = film[index];
    var moments = film[pixels + index];
    var pilot = film[2u * pixels + index];
    var end = params.samples.y;
    let is_pilot = params.samples.x < PILOT_SAMPLES;
    if !is_pilot {
        end = further_samples_end(film_pixel, end);
    }
    var layers = Layers();
    if LAYERS != 0u {
        layers = stored_layers(index, 3u);
    }
    var noise = Noise();
    if NOISE != 0u {
        noise = stored_noise(index, 3u);
    }
    var sample = params.samples.x;
    var path = begin_path(pixel, sample);
    while sample < end {
        path = advance(path, pixel);
        if path.ended {
            let value = path_value(path);
            if NOISE != 0u {
                noise = noise_with(noise, layers, sum, path, value);
            }
            pilot = pilot_add(pilot, sum, value);
            moments = moments_with(moments, sum, value);
            sum += value;
            if LAYERS != 0u {
                layers = layers_sum(layers, path_layers(path));
            }
            sample++;
            path = begin_path(pixel, sample);
        }
    }
    film[index] = sum;
    if LAYERS != 0u {
        store_layers(layers, index, 3u);
    }
    if NOISE != 0u {
        store_noise(noise, index, 3u);
    }
    film[pixels + index] = moments;
    if is_pilot {
        film[2u * pixels + index] = pilot_finish(pilot, sum, moments);
    }
    report_completion(local);
}

fn further_samples_end(film_pixel: vec2u, end: u32) -> u32 {
    let squared_error = bitcast<f32>(SQUARED_ERROR);
    if SMOOTH_NOISE == 0u {
        return samples_wanted(neighbor_pilot_sum(film_pixel, EDGE_NEIGHBOR_RADIUS), PILOT_SAMPLES, squared_error, end);
    }
    // Whole rounds of patterns with cells, because the first cells of a round are not representative.
    let step = select((PILOT_SAMPLES + 1u) / 2u, PILOT_SAMPLES, PIXEL_PATTERN == JITTERED);
    return proportional_samples(neighbor_pilot_sum(film_pixel, SMOOTH_NEIGHBOR_RADIUS), PILOT_SAMPLES, step, squared_error, end);
}

// Returns the sum of the pilot statistics of the pixels at a distance of at most `max_distance`, without the pixel itself.
fn neighbor_pilot_sum(film_pixel: vec2u, max_distance: u32) -> vec4f {
    let size = vec2i(params.film_size);
    let radius = i32(max_distance);
    var sum = vec4f(0.0);
    for (var dy = -radius; dy <= radius; dy++) {
        for (var dx = -radius; dx <= radius; dx++) {
            let neighbor = vec2i(film_pixel) + vec2i(dx, dy);
            let squared_distance = dx * dx + dy * dy;
            let is_near = (squared_distance > 0) & (squared_distance <= radius * radius);
            if is_near & all(neighbor >= vec2i(0)) & all(neighbor < size) {
                sum += film[u32(2 * size.x * size.y + neighbor.y * size.x + neighbor.x)];
            }
        }
    }
    return sum;
}
