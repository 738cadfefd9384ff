// Texels in a single buffer. If the texels need several buffers, `crates/render/src/gpu/texels.rs` generates this
// function instead.

fn texel_word(i: u32) -> u32 {
    return texels[i];
}
