// Camera rays (perspective, orthographic) and their differentials.

// Returns the ray through the image point `raster`, in pixels from the top left corner.
fn camera_ray(camera: Camera, raster: vec2f) -> Ray {
    let offset = image_plane_offset(camera, raster);
    if camera.projection == ORTHOGRAPHIC {
        return Ray(camera.position + offset, camera.forward);
    }
    return Ray(camera.position, normalize(camera.forward + offset));
}

// Returns the differential for samples `spacing` pixels apart (Igehy 1999, section 3).
fn camera_differential(camera: Camera, raster: vec2f, spacing: f32) -> Differential {
    return Differential(camera_derivative(camera, raster, camera.right * (2.0 / f32(camera.width) * spacing)),
                        camera_derivative(camera, raster, camera.up * (-2.0 / f32(camera.height) * spacing)));
}

fn camera_derivative(camera: Camera, raster: vec2f, step: vec3f) -> Derivative {
    if camera.projection == ORTHOGRAPHIC {
        return Derivative(step, vec3f(0.0));
    }
    let d = camera.forward + image_plane_offset(camera, raster);
    let dd = dot(d, d);
    return Derivative(vec3f(0.0), (step * dd - d * dot(d, step)) / (dd * sqrt(dd)));
}

// Returns the vector from the center of the image plane to the image point `at`.
fn image_plane_offset(camera: Camera, at: vec2f) -> vec3f {
    let x = at.x * (2.0 / f32(camera.width)) - 1.0;
    let y = 1.0 - at.y * (2.0 / f32(camera.height));
    return camera.right * x + camera.up * y;
}
