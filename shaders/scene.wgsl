// The scene's records, from the buffers.

fn load_primitive(i: u32) -> Primitive {
    return primitives[i];
}

fn load_material(i: u32) -> Material {
    return materials[i];
}

fn load_light(i: u32) -> Light {
    return lights[i];
}

fn load_texture(i: u32) -> Texture {
    return textures[i];
}
