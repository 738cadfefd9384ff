// The film: consecutive lists with one vector per pixel. The layers follow the lists of the kernel; the half sums and the
// moments of albedo and normal, if enabled, are last.

@group(0) @binding(1) var<storage, read_write> film: array<vec4f>;

// Returns a pixel's layers. `first_layer` is the index of the first list that is a layer.
fn stored_layers(index: u32, first_layer: u32) -> Layers {
    let pixels = params.film_size.x * params.film_size.y;
    let start = first_layer * pixels + index;
    return Layers(film[start], film[start + pixels], film[start + 2u * pixels], film[start + 3u * pixels],
                  film[start + 4u * pixels]);
}

fn store_layers(layers: Layers, index: u32, first_layer: u32) {
    let pixels = params.film_size.x * params.film_size.y;
    let start = first_layer * pixels + index;
    film[start] = layers.emission;
    film[start + pixels] = layers.direct;
    film[start + 2u * pixels] = layers.indirect;
    film[start + 3u * pixels] = layers.albedo;
    film[start + 4u * pixels] = layers.normal;
}

// Accumulators for the noise estimates of a pixel, except the moments of the radiance, which have their own list.
struct Noise {
    half_sum: vec4f,       // like the pixel's sum, over the first 2^k samples: the largest power of two below their number
    albedo_moments: vec4f, // rgb: squared deviations of the albedo
    normal_moments: vec4f, // xyz: squared deviations of the normal; w: of the depth
}

fn stored_noise(index: u32, first_layer: u32) -> Noise {
    let pixels = params.film_size.x * params.film_size.y;
    if LAYERS == 0u {
        return Noise(film[first_layer * pixels + index], vec4f(0.0), vec4f(0.0));
    }
    let start = (first_layer + 5u) * pixels + index;
    return Noise(film[start], film[start + pixels], film[start + 2u * pixels]);
}

fn store_noise(noise: Noise, index: u32, first_layer: u32) {
    let pixels = params.film_size.x * params.film_size.y;
    if LAYERS == 0u {
        film[first_layer * pixels + index] = noise.half_sum;
        return;
    }
    let start = (first_layer + 5u) * pixels + index;
    film[start] = noise.half_sum;
    film[start + pixels] = noise.albedo_moments;
    film[start + 2u * pixels] = noise.normal_moments;
}

// Adds a path with its value. `layers` and `sum` do not include the path.
fn noise_with(noise: Noise, layers: Layers, sum: vec4f, path: PathState, value: vec4f) -> Noise {
    let half_sum = select(noise.half_sum, sum, countOneBits(path.sample) == 1u);
    if LAYERS == 0u {
        return Noise(half_sum, vec4f(0.0), vec4f(0.0));
    }
    let sample = path_layers(path);
    return Noise(half_sum,
                 layer_moments_with(noise.albedo_moments, layers.albedo, sum.w, sample.albedo, value.w),
                 layer_moments_with(noise.normal_moments, layers.normal, sum.w, sample.normal, value.w));
}

fn layers_sum(a: Layers, b: Layers) -> Layers {
    return Layers(a.emission + b.emission, a.direct + b.direct, a.indirect + b.indirect, a.albedo + b.albedo,
                  a.normal + b.normal);
}
