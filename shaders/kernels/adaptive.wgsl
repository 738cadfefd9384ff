// Renders like `render.wgsl`, but gives a pixel further rounds of samples only while its error is too large. The film
// has a second half: each pixel's moments. All decisions are the pixel's own, at the ends of its rounds, so that every
// cut of the work gives the same.

@group(0) @binding(10) var<storage, read_write> film: array<vec4f>;

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
    if work.samples.x == 0u && work.samples.y > 0u {
        moments = pixel_corners(pixel);
    }
    for (var sample = work.samples.x; sample < work.samples.y; sample++) {
        if is_done(sum, moments, sample) {
            break;
        }
        let value = pixel_radiance(pixel, sample);
        moments = moments_with(moments, sum, value);
        sum += value;
    }
    film[index] = sum;
    film[pixels + index] = moments;
    sign(local);
}
