// Camera rays and their differentials.

// The ray through the point `at` of the picture, in pixels from its top left corner.
fn camera_ray(camera: Camera, at: vec2f) -> Ray {
    let offset = image_plane_offset(camera, at);
    if camera.projection == ORTHOGRAPHIC {
        return Ray(camera.position + offset, camera.forward);
    }
    return Ray(camera.position, normalize(camera.forward + offset));
}

// The differential of a camera's ray, section 3 of Igehy's paper, where samples are `spacing` pixels apart.
fn camera_differential(camera: Camera, at: vec2f, spacing: f32) -> Differential {
    return Differential(camera_derivative(camera, at, camera.right * (2.0 / f32(camera.width) * spacing)),
                        camera_derivative(camera, at, camera.up * (-2.0 / f32(camera.height) * spacing)));
}

// The derivative by a step on the image plane.
fn camera_derivative(camera: Camera, at: vec2f, step: vec3f) -> Derivative {
    if camera.projection == ORTHOGRAPHIC {
        return Derivative(step, vec3f(0.0));
    }
    let d = camera.forward + image_plane_offset(camera, at);
    let dd = dot(d, d);
    return Derivative(vec3f(0.0), (step * dd - d * dot(d, step)) / (dd * sqrt(dd)));
}

// From the middle of the image plane to the point `at` of the picture.
fn image_plane_offset(camera: Camera, at: vec2f) -> vec3f {
    let x = at.x * (2.0 / f32(camera.width)) - 1.0;
    let y = 1.0 - at.y * (2.0 / f32(camera.height));
    return camera.right * x + camera.up * y;
}
