// A thin lens: what lies in its focus plane is sharp, and all else is spread over the shape of its opening (Kolb, Mitchell and
// Hanrahan, "A Realistic Camera Model for Computer Graphics", SIGGRAPH 1995, section 3.1).

// The ray through the point `at` of the picture that starts at the point p of the lens, whose opening lies in the unit disk. It passes
// through the same point of the focus plane wherever it starts. Lengths are divided by the focus distance, so that the largest and the
// smallest have squares.
fn lens_ray(camera: Camera, at: vec2f, p: vec2f) -> Ray {
    let start = camera.lens_u * p.x + camera.lens_v * p.y;
    let through_middle = camera.forward + image_plane_offset(camera, at);
    return Ray(camera.position + start, normalize(through_middle - start * camera.inverse_focus));
}

// A uniform point of the opening: of the unit disk if it has no blades, else of a regular polygon in it.
fn lens_sample(blades: u32, u: vec2f) -> vec2f {
    if blades == 0u {
        return disk_sample(u);
    }
    return polygon_sample(blades, u);
}

// A uniform point of the regular polygon whose corners lie on the unit circle, the first at (1, 0): of one of the triangles that its
// centre makes with its sides.
fn polygon_sample(corners: u32, u: vec2f) -> vec2f {
    let scaled = u.x * f32(corners);
    let side = floor(scaled);
    let b = triangle_sample(vec2f(scaled - side, u.y));
    let step = 2.0 / f32(corners);
    return circle_point(side * step) * b.x + circle_point((side + 1.0) * step) * b.y;
}

// The point of the unit circle at an angle, in units of pi.
fn circle_point(angle: f32) -> vec2f {
    return vec2f(sine(angle + 0.5), sine(angle));
}
