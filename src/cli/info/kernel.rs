//! Names of the optional features of a kernel.

use wgray_render::records::{BACKGROUND, LOBE_ANISOTROPY, LOBES, Packed, Specialization};

/// Returns all kernel features, each with a flag that is true if the scene uses it.
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
    let is_path = packed.integrator.follows_paths();
    let mut all = vec![
        ("BVH", in_tree != 0),
        ("lens", lens != 0),
        ("panorama", panoramic != 0),
        ("camera-invisible materials", hidden != 0),
        ("pixel filter", filter_bins != 0),
        ("adaptive sampling", packed.sampling.adaptive),
        ("textures", lookups + specular_lookups != 0),
        ("ray differentials", differentials != 0),
        ("normal maps", normal_maps != 0),
        ("several UV sets", uv_sets != 0),
        ("vertex colors", vertex_colors != 0),
    ];
    if !is_path {
        all.push(("mirrors and glass", bounces != 0));
        return all;
    }
    all.push(("roughness", rough != 0));
    all.extend(LOBES.iter().map(|lobe| {
        let is_in_metal = lobe.bit == LOBE_ANISOTROPY && anisotropic != 0;
        (lobe.name, lobes & lobe.bit != 0 || is_in_metal)
    }));
    all.extend([
        ("alpha", sees_through != 0),
        ("absorption", absorption != 0),
        ("emissive surfaces", shines != 0),
        ("emissive textures", emission_textures != 0),
        ("light tree", light_tree != 0),
        ("environment map", packed.specialization.has_environment_map()),
        ("separate background", surroundings & BACKGROUND != 0),
        ("clamp", most_indirect != 0),
        ("transparent background", alpha != 0),
    ]);
    all
}
