// Renders a range of samples of a rectangle of pixels into the film: rgb is the sum of weighted radiance, a the sum of
// weights; layers follow. Samples are added one by one, so that any division into dispatches gives the same bits.

@compute @workgroup_size(8, 8)
fn render(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let pixel = params.origin + id.xy;
    let film_pixel = pixel - params.film_origin;
    let index = film_pixel.y * params.film_size.x + film_pixel.x;
    var sum = film[index];
    var layers = Layers();
    if LAYERS != 0u {
        layers = stored_layers(index, 1u);
    }
    var sample = params.samples.x;
    var path = begin_path(pixel, sample);
    while sample < params.samples.y {
        path = advance(path, pixel);
        if path.ended {
            sum += path_value(path);
            if LAYERS != 0u {
                layers = layers_sum(layers, path_layers(path));
            }
            sample++;
            path = begin_path(pixel, sample);
        }
    }
    film[index] = sum;
    if LAYERS != 0u {
        store_layers(layers, index, 1u);
    }
    report_completion(local);
}
