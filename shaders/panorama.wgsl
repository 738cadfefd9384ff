// Equirectangular camera: longitude along the image width, latitude along its height.

// Returns the ray of the image point `raster`. Points beyond the image wrap around poles and edges.
fn panorama_ray(camera: Camera, raster: vec2f) -> Ray {
    let east = circle_point(panorama_angles(camera, raster).x);
    let north = circle_point(panorama_angles(camera, raster).y);
    let horizontal = camera.forward * east.x + camera.right * east.y;
    return Ray(camera.position, normalize(horizontal * north.x + camera.up * north.y));
}

// Returns the differential for samples `spacing` pixels apart.
fn panorama_differential(camera: Camera, raster: vec2f, spacing: f32) -> Differential {
    let east = circle_point(panorama_angles(camera, raster).x);
    let north = circle_point(panorama_angles(camera, raster).y);
    let horizontal = camera.forward * east.x + camera.right * east.y;
    let eastward = camera.right * east.x - camera.forward * east.y;
    let dx = eastward * (north.x * (6.2831853 / f32(camera.width) * spacing));
    let dy = (horizontal * north.y - camera.up * north.x) * (3.1415927 / f32(camera.height) * spacing);
    return Differential(Derivative(vec3f(0.0), dx), Derivative(vec3f(0.0), dy));
}

// Returns longitude, to the right from the center, and latitude, in units of pi.
fn panorama_angles(camera: Camera, raster: vec2f) -> vec2f {
    return vec2f(raster.x * (2.0 / f32(camera.width)) - 1.0, 0.5 - raster.y * (1.0 / f32(camera.height)));
}
