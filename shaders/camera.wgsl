// Camera rays.

// The ray through the point `at` of the picture, in pixels from its top left corner.
fn camera_ray(camera: Camera, at: vec2f) -> Ray {
    let x = at.x * (2.0 / f32(camera.width)) - 1.0;
    let y = 1.0 - at.y * (2.0 / f32(camera.height));
    let offset = camera.right * x + camera.up * y;
    if camera.projection == ORTHOGRAPHIC {
        return Ray(camera.position + offset, camera.forward);
    }
    return Ray(camera.position, normalize(camera.forward + offset));
}
