// Renders like `render.wgsl`, but after a first look at all pixels gives further samples only to those that need them,
// as their neighbours' first looks tell. The film has two further parts: each pixel's moments, and its first look. A
// dispatch is for samples of the first look or for later ones, and these come after all first looks of the film. A
// pixel's own samples have no say in how many there are of them: a mean of samples that decide on themselves is biased.

@compute @workgroup_size(8, 8)
fn adaptive(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if id.x >= work.size.x || id.y >= work.size.y {
        return;
    }
    let pixel = work.origin + id.xy;
    let place = pixel - work.film_origin;
    let index = place.y * work.film_size.x + place.x;
    let pixels = work.film_size.x * work.film_size.y;
    var sum = film[index];
    var moments = film[pixels + index];
    var look = film[2u * pixels + index];
    var end = work.samples.y;
    let looks = work.samples.x < FIRST_LOOK;
    if !looks {
        end = samples_wanted(looks_around(place), FIRST_LOOK, bitcast<f32>(SQUARED_ERROR), end);
    }
    var layers = Layers();
    if LAYERS != 0u {
        layers = stored_layers(index, 3u);
    }
    var sample = work.samples.x;
    var path = begin_path(pixel, sample);
    while sample < end {
        path = advance(path, pixel);
        if path.ended {
            let value = path_value(path);
            look = look_with(look, sum, value);
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
    if looks {
        film[2u * pixels + index] = whole_look(look, sum, moments);
    }
    sign(local);
}

// The sum of the first looks at a pixel's four neighbours, as far as they are in the picture.
fn looks_around(place: vec2u) -> vec4f {
    let width = work.film_size.x;
    let index = 2u * width * work.film_size.y + place.y * width + place.x;
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
    if place.y + 1u < work.film_size.y {
        sum += film[index + width];
    }
    return sum;
}
