// Writes the first hit of the ray through each pixel's center.

@group(0) @binding(1) var<storage, read_write> hits: array<FirstHit>;

@compute @workgroup_size(8, 8)
fn first_hits(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let pixel = params.origin + id.xy;
    let film_pixel = pixel - params.film_origin;
    hits[film_pixel.y * params.film_size.x + film_pixel.x] = pixel_first_hit(pixel);
    report_completion(local);
}
