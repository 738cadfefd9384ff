// Texels in a single buffer. If they need several, `crates/render/src/gpu/texels.rs` generates this function.

fn texel_word(i: u32) -> u32 {
    return texels[i];
}
