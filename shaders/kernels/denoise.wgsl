// Denoises rows of an image: each pixel becomes a weighted mean of the pixels in a window around it. The weight depends
// on the colors of the patches around both pixels, and on the normals, albedos and depths of both pixels. The planes have
// a margin that the window and its patches reach.

@group(0) @binding(0) var<uniform> params: DenoiseParams;
@group(0) @binding(1) var<storage, read_write> filtered: array<vec4f>;
@group(0) @binding(2) var<storage, read> guides: array<f32>;

@compute @workgroup_size(8, 8)
fn denoise(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let margin = DENOISE_RADIUS + DENOISE_PATCH_RADIUS;
    let p = (id.y + margin) * params.stride + id.x + margin;
    let window_start = p - DENOISE_RADIUS * (params.stride + 1u);
    var sum = vec4f(0.0);
    for (var dy = 0u; dy <= 2u * DENOISE_RADIUS; dy++) {
        for (var dx = 0u; dx <= 2u * DENOISE_RADIUS; dx++) {
            let q = window_start + dy * params.stride + dx;
            let weight = denoise_weight(pixel_distance(p, q));
            sum += vec4f(guide_vector(GUIDE_COLOR, q) * weight, weight);
        }
    }
    filtered[id.y * params.size.x + id.x] = vec4f(sum.rgb / sum.w, 0.0);
}

// Returns the largest distance of the pixels' patches and features.
fn pixel_distance(p: u32, q: u32) -> f32 {
    let vectors = max(vector_distance(GUIDE_NORMAL, p, q), vector_distance(GUIDE_ALBEDO, p, q));
    return max(max(patch_distance(p, q), vectors), max(depth_distance(p, q), 0.0));
}

fn patch_distance(p: u32, q: u32) -> f32 {
    let corner = DENOISE_PATCH_RADIUS * (params.stride + 1u);
    let side = 2u * DENOISE_PATCH_RADIUS + 1u;
    var sum = 0.0;
    for (var y = 0u; y < side; y++) {
        var row_sum = 0.0;
        for (var x = 0u; x < side; x++) {
            let offset = y * params.stride + x;
            let i = p - corner + offset;
            let j = q - corner + offset;
            let variances = vec2f(guide(GUIDE_COLOR_VARIANCE, i), guide(GUIDE_COLOR_VARIANCE, j));
            row_sum += color_distance(squared_difference(GUIDE_COLOR, i, j), variances.x, variances.y, guide(GUIDE_VARIANCE_LIMIT, i));
        }
        sum += row_sum;
    }
    return sum * (1.0 / f32(side * side));
}

// A vector has three planes, followed by its variance and its scale.
fn vector_distance(plane: u32, p: u32, q: u32) -> f32 {
    return feature_distance(squared_difference(plane, p, q), guide(plane + 3u, p), guide(plane + 3u, q), guide(plane + 4u, p));
}

fn depth_distance(p: u32, q: u32) -> f32 {
    let difference = guide(GUIDE_DEPTH, p) - guide(GUIDE_DEPTH, q);
    return feature_distance(difference * difference, guide(GUIDE_DEPTH + 1u, p), guide(GUIDE_DEPTH + 1u, q), guide(GUIDE_DEPTH + 2u, p));
}

fn squared_difference(plane: u32, p: u32, q: u32) -> f32 {
    let difference = guide_vector(plane, p) - guide_vector(plane, q);
    return dot(difference, difference);
}

fn guide_vector(plane: u32, i: u32) -> vec3f {
    return vec3f(guide(plane, i), guide(plane + 1u, i), guide(plane + 2u, i));
}

fn guide(plane: u32, i: u32) -> f32 {
    return guides[plane * params.plane + i];
}
