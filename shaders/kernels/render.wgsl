// Renders a range of samples of a rectangle of pixels into the film: rgb the sum of weighted radiances, a that of the
// weights.
// The sum goes on from the film's own value, one sample after the other, so that every cut of the work gives the same.

@group(0) @binding(1) var<storage, read_write> film: array<vec4f>;

@compute @workgroup_size(8, 8)
fn render(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    if id.x >= work.size.x || id.y >= work.size.y {
        return;
    }
    let pixel = work.origin + id.xy;
    let place = pixel - work.film_origin;
    let index = place.y * work.film_size.x + place.x;
    var sum = film[index];
    for (var sample = work.samples.x; sample < work.samples.y; sample++) {
        sum += pixel_radiance(pixel, sample);
    }
    film[index] = sum;
    sign(local);
}
