// Renders a range of samples of a rectangle of pixels into the film: rgb is the sum of weighted radiance, a the sum of
// weights; moments, layers and further noise estimates follow if enabled. Samples are added one by one, so that any
// division into dispatches gives the same bits.

@compute @workgroup_size(8, 8)
fn render(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let pixel = params.origin + id.xy;
    let film_pixel = pixel - params.film_origin;
    let index = film_pixel.y * params.film_size.x + film_pixel.x;
    let pixels = params.film_size.x * params.film_size.y;
    let first_layer = select(1u, 2u, NOISE != 0u);
    var sum = film[index];
    var moments = vec4f(0.0);
    var layers = Layers();
    var noise = Noise();
    if LAYERS != 0u {
        layers = stored_layers(index, first_layer);
    }
    if NOISE != 0u {
        moments = film[pixels + index];
        noise = stored_noise(index, first_layer);
    }
    var sample = params.samples.x;
    var path = begin_path(pixel, sample);
    while sample < params.samples.y {
        path = advance(path, pixel);
        if path.ended {
            let value = path_value(path);
            if NOISE != 0u {
                noise = noise_with(noise, layers, sum, path, value);
                moments = moments_with(moments, sum, value);
            }
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
        store_layers(layers, index, first_layer);
    }
    if NOISE != 0u {
        film[pixels + index] = moments;
        store_noise(noise, index, first_layer);
    }
    report_completion(local);
}
