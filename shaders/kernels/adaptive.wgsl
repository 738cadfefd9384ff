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
        end = samples_wanted(neighbor_pilot_sum(film_pixel), PILOT_SAMPLES, bitcast<f32>(SQUARED_ERROR), end);
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

// Returns the pilot statistics of up to four neighbors.
fn neighbor_pilot_sum(film_pixel: vec2u) -> vec4f {
    let width = params.film_size.x;
    let index = 2u * width * params.film_size.y + film_pixel.y * width + film_pixel.x;
    var sum = vec4f(0.0);
    if film_pixel.y > 0u {
        sum += film[index - width];
    }
    if film_pixel.x > 0u {
        sum += film[index - 1u];
    }
    if film_pixel.x + 1u < width {
        sum += film[index + 1u];
    }
    if film_pixel.y + 1u < params.film_size.y {
        sum += film[index + width];
    }
    return sum;
}
