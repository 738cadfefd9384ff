//! Names of the optional features of a kernel.

use wgray_trace::records::{BACKGROUND, LOBE_ANISOTROPY, LOBES, Packed, Specialization};

/// Returns each kernel feature, and whether the scene uses the feature.
pub fn features(packed: &Packed) -> Vec<(&'static str, bool)> {
    let Specialization {
        tlas_kinds,
        lens,
        panoramic,
        camera_invisible,
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
        alpha_surfaces,
        absorption,
        emissive,
        light_tree,
        emission_textures,
        environment_flags,
        max_indirect,
        alpha,
        ..
    } = packed.specialization;
    let is_path = packed.integrator.follows_paths();
    let mut feature_list = vec![
        ("BVH", tlas_kinds != 0),
        ("lens", lens != 0),
        ("panorama", panoramic != 0),
        ("camera-invisible materials", camera_invisible != 0),
        ("pixel filter", filter_bins != 0),
        ("adaptive sampling", packed.sampling.adaptive),
        ("textures", lookups + specular_lookups != 0),
        ("ray differentials", differentials != 0),
        ("normal maps", normal_maps != 0),
        ("several UV sets", uv_sets != 0),
        ("vertex colors", vertex_colors != 0),
    ];
    if !is_path {
        feature_list.push(("mirrors and glass", bounces != 0));
        return feature_list;
    }
    feature_list.push(("roughness", rough != 0));
    feature_list.extend(LOBES.iter().map(|lobe| {
        let is_anisotropic_metal = lobe.bit == LOBE_ANISOTROPY && anisotropic != 0;
        (lobe.name, lobes & lobe.bit != 0 || is_anisotropic_metal)
    }));
    feature_list.extend([
        ("alpha", alpha_surfaces != 0),
        ("absorption", absorption != 0),
        ("emissive surfaces", emissive != 0),
        ("emissive textures", emission_textures != 0),
        ("light tree", light_tree != 0),
        ("environment map", packed.specialization.has_environment_map()),
        ("separate background", environment_flags & BACKGROUND != 0),
        ("clamp", max_indirect != 0),
        ("transparent background", alpha != 0),
    ]);
    feature_list
}
