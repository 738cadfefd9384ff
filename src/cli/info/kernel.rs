//! What a kernel is compiled for, in words.

use wgray::pack::{
    BACKGROUND, IMAGE_AROUND, LOBE_ANISOTROPY, LOBE_COAT, LOBE_SHEEN, LOBE_SPECULAR, LOBE_TRANSMISSION, Packed,
    Specialization,
};
use wgray::scene::Integrator;

/// All that a scene's kernel may have, with whether this one has it.
pub fn features(packed: &Packed) -> Vec<(&'static str, bool)> {
    let Specialization {
        in_tree,
        lens,
        panoramic,
        hidden,
        filter_bins,
        bounces,
        differentials,
        lookups,
        specular_lookups,
        normal_maps,
        uv_sets,
        vertex_colors,
        rough,
        anisotropic,
        lobes,
        sees_through,
        absorption,
        shines,
        light_tree,
        emission_textures,
        surroundings,
        most_indirect,
        alpha,
        ..
    } = packed.specialization;
    let is_path = packed.integrator == Integrator::Path;
    let mut all = vec![
        ("trees of boxes", in_tree != 0),
        ("lens", lens != 0),
        ("panorama", panoramic != 0),
        ("things hidden from the camera", hidden != 0),
        ("filter", filter_bins != 0),
        ("adaptive sampling", packed.adaptive),
        ("textures", lookups + specular_lookups != 0),
        ("footprints of rays", differentials != 0),
        ("normal maps", normal_maps != 0),
        ("further texture coordinates", uv_sets != 0),
        ("colours of vertices", vertex_colors != 0),
    ];
    if !is_path {
        all.push(("mirrors and glass", bounces != 0));
        return all;
    }
    let lobe = |lobe: u32| lobes & lobe != 0;
    all.extend([
        ("roughness", rough != 0),
        ("anisotropy", anisotropic != 0 || lobe(LOBE_ANISOTROPY)),
        ("specular lobe", lobe(LOBE_SPECULAR)),
        ("transmission", lobe(LOBE_TRANSMISSION)),
        ("clear coat", lobe(LOBE_COAT)),
        ("sheen", lobe(LOBE_SHEEN)),
        ("alpha of surfaces", sees_through != 0),
        ("absorption", absorption != 0),
        ("surfaces that shine", shines != 0),
        ("textures that shine", emission_textures != 0),
        ("tree of lights", light_tree != 0),
        ("image around the scene", surroundings & IMAGE_AROUND != 0),
        ("background of its own", surroundings & BACKGROUND != 0),
        ("clamped indirect light", most_indirect != 0),
        ("transparent background", alpha != 0),
    ]);
    all
}
