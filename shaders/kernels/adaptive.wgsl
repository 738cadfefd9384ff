// Adaptive rendering: like `render.wgsl`, but takes more than the pilot samples only where the neighbors' pilot
// statistics require it. Two further parts of the film hold moments and pilot statistics. A dispatch renders either
// pilot samples or later ones, which require all pilot samples of the film. A pixel's own samples do not affect their
// number: a mean with such a stopping rule is biased.

@compute @workgroup_size(8, 8)
fn adaptive(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let pixel = params.origin + id.xy;
    let place = pixel - params.film_origin;
    let index = place.y * params.film_size.x + place.x;
    let pixels = params.film_size.x * params.film_size.y;
    var sum = film[index];
    var moments = film[pixels + index];
    var pilot = film[2u * pixels + index];
    var end = params.samples.y;
    let is_pilot = params.samples.x < PILOT_SAMPLES;
    if !is_pilot {
        end = samples_wanted(neighbor_pilot_sum(place), PILOT_SAMPLES, bitcast<f32>(SQUARED_ERROR), end);
    }
    var layers = Layers();
    if LAYERS != 0u {
        layers = stored_layers(index, 3u);
    }
    var sample = params.samples.x;
    var path = begin_path(pixel, sample);
    while sample < end {
        path = advance(path, pixel);
        if path.ended {
            let value = path_value(path);
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
    film[pixels + index] = moments;
    if is_pilot {
        film[2u * pixels + index] = pilot_finish(pilot, sum, moments);
    }
    report_completion(local);
}

// Returns the pilot statistics of up to four neighbors.
fn neighbor_pilot_sum(place: vec2u) -> vec4f {
    let width = params.film_size.x;
    let index = 2u * width * params.film_size.y + place.y * width + place.x;
    var sum = vec4f(0.0);
    if place.y > 0u {
        sum += film[index - width];
    }
    if place.x > 0u {
        sum += film[index - 1u];
    }
    if place.x + 1u < width {
        sum += film[index + 1u];
    }
    if place.y + 1u < params.film_size.y {
        sum += film[index + width];
    }
    return sum;
}
