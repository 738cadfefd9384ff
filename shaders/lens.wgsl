// Thin lens cameras: depth of field by aperture shape (Kolb, Mitchell and Hanrahan, "A Realistic Camera Model for
// Computer Graphics", SIGGRAPH 1995, section 3.1).

// Returns the ray of the image point `raster` from the lens point p, in the unit disk. The rays from all lens points
// meet at one point, which is in focus. Lengths are divided by the focus distance, so that squares neither overflow nor
// vanish.
fn lens_ray(camera: Camera, raster: vec2f, p: vec2f) -> Ray {
    let start = camera.lens_u * p.x + camera.lens_v * p.y;
    let through_middle = camera.forward + image_plane_offset(camera, raster);
    return Ray(camera.position + start, normalize(through_middle - start * camera.inverse_focus));
}

// Samples the aperture uniformly: the unit disk, or a polygon of `blades` sides in the unit disk.
fn lens_sample(blades: u32, u: vec2f) -> vec2f {
    if blades == 0u {
        return disk_sample(u);
    }
    return polygon_sample(blades, u);
}

// Samples the regular polygon inscribed in the unit circle with a corner at (1, 0): selects a triangle between the
// center and a side, then a point of the triangle.
fn polygon_sample(corners: u32, u: vec2f) -> vec2f {
    let scaled = u.x * f32(corners);
    let side = floor(scaled);
    let b = triangle_sample(vec2f(scaled - side, u.y));
    let step = 2.0 / f32(corners);
    return circle_point(side * step) * b.x + circle_point((side + 1.0) * step) * b.y;
}

// Returns the point of the unit circle at an angle in units of pi.
fn circle_point(angle: f32) -> vec2f {
    return vec2f(sine(angle + 0.5), sine(angle));
}
