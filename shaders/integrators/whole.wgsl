// Path interface of `pixel.wgsl` for integrators that evaluate a complete sample in one function, `radiance`.

struct PathState {
    value: vec4f,
    sample: u32,
    ended: bool,
}

fn begin_path(pixel: vec2u, sample: u32) -> PathState {
    return PathState(vec4f(0.0), sample, false);
}

fn advance(path: PathState, pixel: vec2u) -> PathState {
    let start = camera_sample(pixel, path.sample);
    let sample_radiance = radiance(start.ray, start.differential, pixel, path.sample);
    return PathState(vec4f(sample_radiance * start.weight, start.weight), path.sample, true);
}

fn path_value(path: PathState) -> vec4f {
    return path.value;
}

fn path_layers(path: PathState) -> Layers {
    return Layers();
}
