// The film: consecutive lists with one vector per pixel. The last lists are the layers.

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

fn layers_sum(a: Layers, b: Layers) -> Layers {
    return Layers(a.emission + b.emission, a.direct + b.direct, a.indirect + b.indirect, a.albedo + b.albedo,
                  a.normal + b.normal);
}
