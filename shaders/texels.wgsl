// The texels of images. Where they do not fit one buffer, `crates/render/src/gpu/texels.rs` writes the same function over several.

fn texel_word(i: u32) -> u32 {
    return texels[i];
}
