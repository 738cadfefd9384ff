//! Compares every shared function on GPU and CPU, bit for bit, for thousands of inputs.

use glam::{UVec2, UVec3, UVec4, Vec2, Vec3, Vec4};
use wgray_render::gpu::Device;
use wgray_render::gpu::naga::ScalarKind;
use wgray_trace::cpu::adaptive::{
    display_slope_squared, display_variance, layer_mean, layer_moments_with, mean_of, moments_with, pilot_add,
    pilot_finish, proportional_samples, samples_wanted, squared_deviation, variance_of_mean,
};
use wgray_trace::cpu::bvh_node::{
    children_hit, children_in_interval, far_side, four_hit, four_in_interval, hit_bits, in_order, larger, leaf_items,
    octant_of, smaller, step_length, steps,
};
use wgray_trace::cpu::camera::{camera_derivative, camera_differential, camera_ray, image_plane_offset};
use wgray_trace::cpu::cylinder::{
    cap_side, cylinder_bitangent, cylinder_gradient, cylinder_gradient_derivative, cylinder_height, cylinder_interval,
    cylinder_levels, cylinder_occludes, cylinder_tangent, cylinder_uv, cylinder_uv_derivative, intersect_cylinder,
    is_on_cap,
};
use wgray_trace::cpu::denoise::{color_distance, denoise_weight, feature_distance, noise_of};
use wgray_trace::cpu::dielectric::{DielectricSample, dielectric_sample, eta_of, refracts_inwards, transmittance};
use wgray_trace::cpu::differential::{
    Derivative, Differential, HitDifferential, normal_derivative, primitive_hit_differential, reflected_derivative,
    reflected_differential, refracted_derivative, refracted_differential, transferred,
};
use wgray_trace::cpu::diffuse::{
    Angles, albedo_growth, angles_at, diffuse_eval, diffuse_pdf, diffuse_sample, rough_diffuse_eval,
};
use wgray_trace::cpu::disk::{disk_occludes, intersect_disk};
use wgray_trace::cpu::ellipsoid::{
    ellipsoid_discriminant, ellipsoid_level, ellipsoid_occludes, intersect_ellipsoid, longitude,
};
use wgray_trace::cpu::equirect::{
    EnvironmentCell, cap_above, cell_towards, column_after, direction_in_cell, normal_bin,
};
use wgray_trace::cpu::filter::{filter_bin, filter_offset};
use wgray_trace::cpu::footprint::{
    Ellipse, Footprint, footprint_ellipse, surface_footprint, texture_footprint, wrap_u, wrap_v,
};
use wgray_trace::cpu::ggx::{
    ggx_albedo, ggx_albedo_along, ggx_albedo_fit, ggx_d, ggx_g1, ggx_g2, ggx_length, ggx_pdf, ggx_sample,
};
use wgray_trace::cpu::lens::{circle_point, lens_ray, lens_sample, polygon_sample};
use wgray_trace::cpu::light::{LightSegments, segment, segments_to_light, segments_to_local, spot_falloff};
use wgray_trace::cpu::light_sample::{
    CylinderPart, CylinderPoint, cylinder_height_ratio, cylinder_part, cylinder_sample, cylinder_share, ellipsoid_area,
    ellipsoid_cap, ellipsoid_pdf, ellipsoid_sample, power_heuristic, solid_angle_pdf, uniform_below,
};
use wgray_trace::cpu::light_tree::{light_child, light_importances, light_shares, mean_above};
use wgray_trace::cpu::lobe::{
    LobeSample, aniso_table_position, direction_turn, facet_alpha, facet_eval, facet_loss, facet_pdf, facet_weight,
    half_vector, is_polished, lobe_frame, plain_alpha, vector_from_lobe, vector_to_lobe,
};
use wgray_trace::cpu::math::{
    atan2, cross, dot, exp2, floor, log2, max, max4, min, normalize, positive_zero, power, power_whole, sine,
};
use wgray_trace::cpu::mesh::{
    Crossing, HitPrimitive, Shear, color_between, face_direction_allowed, face_first_hit, face_footprint, face_frame,
    face_hit_differential, face_normal, face_normal_derivative, face_primitive, face_surface, face_tangents,
    face_terminator_offset, face_uv, face_uv_derivative, flipped_to, highest, lift, lowest, mesh_pad, normal_from_mesh,
    permuted, point_to_mesh, shear_of, sheared, standalone_hit_primitive, triangle_crossing, vector_from_mesh,
    vector_to_mesh,
};
use wgray_trace::cpu::metal::{conductor_fresnel, metal_eval, metal_factor, metal_fresnel, metal_pdf, metal_sample};
use wgray_trace::cpu::modified_phong::{
    PhongFactors, modified_phong_eval, modified_phong_pdf, modified_phong_sample, phong_factors, phong_lobe,
};
use wgray_trace::cpu::normal_map::mapped_normal;
use wgray_trace::cpu::panorama::{panorama_angles, panorama_differential, panorama_ray};
use wgray_trace::cpu::path::{
    Path, SpecularSplit, glass_path, is_specular, is_usable, mirrored_path, pass_through_path, reflected_path,
    refracted_path, usable_normal,
};
use wgray_trace::cpu::phong::{Lobes, is_lit, phong_block, phong_lobes, phong_power, unlit_mask};
use wgray_trace::cpu::plane::{intersect_plane, plane_occludes};
use wgray_trace::cpu::primitive::{
    Tangents, intersect, is_centered, is_solid, local_tangents, occludes, primitive_gradient, primitive_height,
    primitive_normal, primitive_uv, solid_gradient, solid_gradient_derivative, solid_levels, uv_derivative,
};
use wgray_trace::cpu::principled::{
    PrincipledLobes, bounded_color, coat_eval, evaluated_sample, facets_eval, glass_eval, glass_fresnel, glass_pdf,
    glass_probability, half_between, is_flat, luminance, mirrored_pdf, principled_direction, principled_eval,
    principled_mixture, principled_pdf, principled_sample, refracting_density, refracting_half, schlick, sheen_albedo,
    sheen_lobe, sheen_probability, to_frame_around, transmits_straight,
};
use wgray_trace::cpu::procedural::{
    edge_integral, far_product, nearest_step, phase, procedural_share, product_integral, sine_ratio, wave_integral,
    wave_integral_2, wave_mean, wave_value, widened_edge,
};
use wgray_trace::cpu::ray::{
    Hit, Ray, closer, crosses_plane, nearer_hit, no_hit, plane_distance, point_to_local, scaled_crossing,
    standalone_prim, vector_to_local, vector_to_world,
};
use wgray_trace::cpu::rectangle::{intersect_rectangle, rectangle_occludes};
use wgray_trace::cpu::rng::{hash4, unit_float};
use wgray_trace::cpu::rough_dielectric::{
    dielectric_gain, refracting_normal, rough_dielectric_eval, rough_dielectric_pdf, rough_dielectric_sample,
};
use wgray_trace::cpu::sampling::{
    decision_bits, grid_sample, jittered_sample, random_sample, rotated_grid_sample, sample_key, sample_square, wrap,
};
use wgray_trace::cpu::sequence::{
    halton_sample, radical_inverse_3, scramble, shuffled_index, sobol_bits, sobol_reversed, sobol_sample,
};
use wgray_trace::cpu::shadow::{
    SampleBlock, ShadowFrustum, block_sample, light_frustum, may_block, occludes_segment, occlusion_mask,
};
use wgray_trace::cpu::slab::{
    RayInterval, Slabs, box_interval, interval_hits, inverse_of, ray_interval, ray_interval_box, slabs,
};
use wgray_trace::cpu::solid::{interval_occludes, levels_on_surface, nearest_end};
use wgray_trace::cpu::specular::{fresnel, reflected_direction, refracted_cosine, refracted_direction};
use wgray_trace::cpu::surface::{Surface, first_hit, largest, surface_at, with_coordinates, with_positive_zeros};
use wgray_trace::cpu::texel::{
    gaussian_weight, level_size, near_coordinate, srgb_to_linear, unpacked_color, wrapped_index,
};
use wgray_trace::cpu::thin::{thin_eval, thin_pdf, thin_reflectance, thin_sample, to_upper_side};
use wgray_trace::cpu::triangle::{intersect_triangle, triangle_occludes};
use wgray_trace::cpu::warp::{
    cap_sample, disk_sample, frame_around, hemisphere_sample, triangle_sample, vector_around,
};
use wgray_trace::records::{
    Camera, FirstHit, Instance, Light, LightNode, Material, NO_INDEX, Node, Primitive, Sphere, Texture,
};

use crate::adapter::{self, ROUNDED_TWICE, allowed, judge};
use crate::inputs::inputs;
use crate::kernel::{Function, functions, scalars};
use crate::probe_words::{Argument, ProbeWords};
use crate::random::Random;
use crate::sources::{parse, shared_source};

/// Environment variable that selects one function by name; without it, all functions are compared.
const FUNCTION: &str = "WGRAY_TEST_FUNCTION";

/// Number of calls of each function.
const CALLS: usize = 8192;

/// A twin whose arguments and results are read and written as words.
pub struct Probe {
    pub name: &'static str,
    arguments: &'static [&'static str],
    pub run: fn(&mut &[u32], &mut Vec<u32>),
}

macro_rules! probes {
    ($($name:ident($($argument:ident: $ty:ty),* $(,)?) -> $result:ty;)*) => {
        /// The probed twins. A test fails if a shared function has no entry.
        pub const PROBES: &[Probe] = &[$(Probe {
            name: stringify!($name),
            arguments: &[$(stringify!($argument)),*],
            run: |words, out| {
                $(let $argument = <<$ty as Argument>::Owned as ProbeWords>::read(words);)*
                let result: $result = $name($(<$ty as Argument>::of(&$argument)),*);
                result.write(out);
            },
        }),*];
    };
}

probes! {
    dot(a: Vec3, b: Vec3) -> f32;
    cross(a: Vec3, b: Vec3) -> Vec3;
    normalize(v: Vec3) -> Vec3;
    max(a: f32, b: f32) -> f32;
    min(a: f32, b: f32) -> f32;
    positive_zero(x: f32) -> f32;
    floor(x: f32) -> f32;
    power_whole(x: f32, n: u32, bits: u32) -> f32;
    power(x: f32, y: f32) -> f32;
    log2(x: f32) -> f32;
    exp2(x: f32) -> f32;
    atan2(y: f32, x: f32) -> f32;
    sine(x: f32) -> f32;
    hash4(key: UVec4) -> UVec4;
    unit_float(bits: u32) -> f32;
    sample_square(pattern: u32, side: u32, index: u32, group: u32, key: UVec2) -> Vec2;
    grid_sample(side: u32, index: u32) -> Vec2;
    rotated_grid_sample(side: u32, index: u32) -> Vec2;
    wrap(x: f32) -> f32;
    jittered_sample(side: u32, index: u32, group: u32, key: UVec2) -> Vec2;
    random_sample(index: u32, group: u32, key: UVec2) -> Vec2;
    sample_key(pixel: UVec2, seed: u32, purpose: u32) -> UVec2;
    decision_bits(pixel: UVec2, seed: u32, sample: u32, bounce: u32, purpose: u32) -> UVec4;
    sobol_sample(index: u32, key: UVec2) -> Vec2;
    sobol_bits(index: u32, key: UVec2) -> UVec2;
    disk_sample(u: Vec2) -> Vec2;
    triangle_sample(u: Vec2) -> Vec2;
    frame_around(n: Vec3) -> Tangents;
    vector_around(n: Vec3, v: Vec3) -> Vec3;
    hemisphere_sample(n: Vec3, u: Vec2) -> Vec3;
    cap_sample(p: Vec2, cap_height: f32) -> Vec3;
    sobol_reversed(i: u32) -> u32;
    scramble(digits: u32, seed: u32) -> u32;
    shuffled_index(index: u32, seed: u32) -> u32;
    halton_sample(index: u32, key: UVec2) -> Vec2;
    radical_inverse_3(i: u32) -> u32;
    filter_bin(u: f32, bins: u32) -> u32;
    filter_offset(u: f32, bin: u32, bins: u32, low: f32, high: f32) -> f32;
    moments_with(moments: Vec4, sum: Vec4, sample: Vec4) -> Vec4;
    layer_moments_with(moments: Vec4, layer: Vec4, weight_sum: f32, sample: Vec4, weight: f32) -> Vec4;
    layer_mean(layer: Vec4, weight_sum: f32) -> Vec4;
    squared_deviation(sum: Vec4, sample: Vec4) -> Vec3;
    pilot_add(pilot: Vec4, sum: Vec4, sample: Vec4) -> Vec4;
    pilot_finish(pilot: Vec4, sum: Vec4, moments: Vec4) -> Vec4;
    proportional_samples(pilot_sum: Vec4, pilot_samples: u32, step: u32, squared_error: f32, max_samples: u32) -> u32;
    samples_wanted(pilot_sum: Vec4, pilot_samples: u32, squared_error: f32, max_samples: u32) -> u32;
    mean_of(sum: Vec4) -> Vec3;
    variance_of_mean(sum: Vec4, moments: Vec4) -> Vec3;
    display_variance(sum: Vec4, moments: Vec4) -> f32;
    display_slope_squared(value: f32) -> f32;
    point_to_local(q: &Primitive, p: Vec3) -> Vec3;
    vector_to_local(q: &Primitive, v: Vec3) -> Vec3;
    plane_distance(q: &Primitive, ray: Ray) -> f32;
    crosses_plane(o: Vec3, d: Vec3, t_max: f32) -> bool;
    scaled_crossing(o: Vec3, d: Vec3) -> Vec2;
    closer(hit: Hit, t: f32, i: u32, origin_prim: u32) -> Hit;
    intersect_rectangle(q: &Primitive, ray: Ray, limit: f32) -> f32;
    rectangle_occludes(o: Vec3, d: Vec3, t_max: f32) -> bool;
    intersect_disk(q: &Primitive, ray: Ray, limit: f32) -> f32;
    disk_occludes(o: Vec3, d: Vec3, t_max: f32) -> bool;
    intersect_triangle(q: &Primitive, ray: Ray, limit: f32) -> f32;
    triangle_occludes(o: Vec3, d: Vec3, t_max: f32) -> bool;
    ellipsoid_level(q: &Primitive, from_anchor: Vec3) -> f32;
    ellipsoid_discriminant(o: Vec3, d: Vec3, start_level: f32) -> f32;
    intersect_ellipsoid(q: &Primitive, from_inside: bool, ray: Ray, limit: f32) -> f32;
    ellipsoid_occludes(o: Vec3, d: Vec3, start_level: f32, t_max: f32) -> bool;
    longitude(local: Vec3) -> f32;
    levels_on_surface(levels: Vec2, surface_level: f32) -> Vec2;
    nearest_end(interval: Vec2, limit: f32) -> f32;
    interval_occludes(interval: Vec2, t_max: f32) -> bool;
    cylinder_levels(q: &Primitive, from_anchor: Vec3) -> Vec2;
    cylinder_interval(o: Vec3, d: Vec3, levels: Vec2) -> Vec2;
    intersect_cylinder(q: &Primitive, from_inside: bool, ray: Ray, limit: f32) -> f32;
    cylinder_occludes(o: Vec3, d: Vec3, levels: Vec2, t_max: f32) -> bool;
    is_on_cap(local: Vec3) -> bool;
    cap_side(local: Vec3) -> f32;
    cylinder_gradient(local: Vec3) -> Vec3;
    cylinder_gradient_derivative(local: Vec3, d: Vec3) -> Vec3;
    cylinder_height(q: &Primitive, from_anchor: Vec3) -> f32;
    cylinder_uv(local: Vec3) -> Vec2;
    cylinder_uv_derivative(local: Vec3, d: Vec3) -> Vec2;
    cylinder_tangent(local: Vec3) -> Vec3;
    cylinder_bitangent(local: Vec3) -> Vec3;
    intersect_plane(q: &Primitive, ray: Ray, limit: f32) -> f32;
    plane_occludes(o: Vec3, d: Vec3, t_max: f32) -> bool;
    camera_ray(camera: &Camera, raster: Vec2) -> Ray;
    primitive_gradient(q: &Primitive, local: Vec3) -> Vec3;
    primitive_normal(q: &Primitive, local: Vec3) -> Vec3;
    largest(v: Vec3) -> f32;
    surface_at(q: &Primitive, i: u32, ray: Ray, t: f32, epsilon: f32) -> Surface;
    with_coordinates(surface: Surface, q: &Primitive) -> Surface;
    intersect(kind: u32, q: &Primitive, from_inside: bool, ray: Ray, limit: f32) -> f32;
    is_solid(kind: u32) -> bool;
    is_centered(kind: u32) -> bool;
    primitive_uv(q: &Primitive, local: Vec3) -> Vec2;
    first_hit(q: &Primitive, ray: Ray, t: f32) -> FirstHit;
    segments_to_light(light: &Light, p: Vec3) -> LightSegments;
    spot_falloff(light: &Light, to_light: Vec3) -> f32;
    max4(a: Vec4, b: Vec4) -> Vec4;
    mean_above(m: Vec4, r: Vec4) -> Vec4;
    light_importances(node: &LightNode, p: Vec3, n: Vec3) -> Vec4;
    light_shares(importances: Vec4) -> Vec4;
    light_child(shares: Vec4, random: f32) -> u32;
    segments_to_local(q: &Primitive, segments: LightSegments) -> LightSegments;
    segment(segments: LightSegments, at: Vec2) -> Vec3;
    occlusion_mask(kind: u32, q: &Primitive, p: Vec3, from_inside: bool, light: &Light, block: SampleBlock) -> u32;
    block_sample(block: SampleBlock, i: u32) -> Vec2;
    occludes_segment(kind: u32, q: &Primitive, p: Vec3, from_inside: bool, to_light: Vec3, t_max: f32) -> bool;
    occludes(kind: u32, o: Vec3, d: Vec3, levels: Vec2, t_max: f32) -> bool;
    solid_levels(kind: u32, q: &Primitive, from_anchor: Vec3, from_inside: bool) -> Vec2;
    solid_gradient(kind: u32, local: Vec3) -> Vec3;
    solid_gradient_derivative(kind: u32, local: Vec3, d: Vec3) -> Vec3;
    primitive_height(q: &Primitive, from_anchor: Vec3) -> f32;
    light_frustum(light: &Light, p: Vec3) -> ShadowFrustum;
    may_block(sphere: &Sphere, frustum: &ShadowFrustum) -> bool;
    phong_lobes(surface: &Surface, material: &Material, to_light: Vec3, exponent_bits: u32) -> Lobes;
    phong_power(x: f32, material: &Material, exponent_bits: u32) -> f32;
    is_lit(surface: &Surface, direction: Vec3) -> bool;
    unlit_mask(prim: &HitPrimitive, surface: &Surface, segments: LightSegments, block: SampleBlock) -> u32;
    phong_block(surface: &Surface, material: &Material, segments: LightSegments, block: SampleBlock, occluded: u32, exponent_bits: u32,
                sum: Lobes) -> Lobes;
    camera_differential(camera: &Camera, raster: Vec2, spacing: f32) -> Differential;
    camera_derivative(camera: &Camera, raster: Vec2, step: Vec3) -> Derivative;
    image_plane_offset(camera: &Camera, at: Vec2) -> Vec3;
    lens_ray(camera: &Camera, raster: Vec2, p: Vec2) -> Ray;
    lens_sample(blades: u32, u: Vec2) -> Vec2;
    polygon_sample(corners: u32, u: Vec2) -> Vec2;
    circle_point(angle: f32) -> Vec2;
    panorama_ray(camera: &Camera, raster: Vec2) -> Ray;
    panorama_differential(camera: &Camera, raster: Vec2, spacing: f32) -> Differential;
    panorama_angles(camera: &Camera, raster: Vec2) -> Vec2;
    transferred(derivative: Derivative, ray: Ray, t: f32, normal: Vec3) -> Derivative;
    normal_derivative(q: &Primitive, local: Vec3, dp: Vec3) -> Vec3;
    reflected_derivative(derivative: Derivative, d: Vec3, n: Vec3, dn: Vec3) -> Derivative;
    refracted_derivative(derivative: Derivative, d: Vec3, n: Vec3, dn: Vec3, eta: f32, cosine: f32) -> Derivative;
    primitive_hit_differential(q: &Primitive, differential: Differential, ray: Ray, t: f32, surface: Surface) -> HitDifferential;
    reflected_differential(hit_diff: HitDifferential, d: Vec3, n: Vec3) -> Differential;
    refracted_differential(hit_diff: HitDifferential, d: Vec3, n: Vec3, eta: f32, cosine: f32) -> Differential;
    reflected_direction(d: Vec3, n: Vec3) -> Vec3;
    refracted_direction(d: Vec3, n: Vec3, eta: f32, cosine_i: f32, cosine_t: f32) -> Vec3;
    refracted_cosine(cosine_i: f32, eta: f32) -> f32;
    fresnel(cosine_i: f32, cosine_t: f32, eta: f32) -> f32;
    pass_through_path(path: Path, surface: Surface, hit_diff: HitDifferential) -> Path;
    mirrored_path(path: Path, surface: Surface, hit_diff: HitDifferential, material: &Material) -> SpecularSplit;
    usable_normal(surface: Surface, normal: Vec3) -> Vec3;
    is_usable(surface: Surface, normal: Vec3) -> bool;
    glass_path(path: Path, surface: Surface, hit_diff: HitDifferential, material: &Material, random: f32) -> SpecularSplit;
    reflected_path(path: Path, surface: Surface, hit_diff: HitDifferential, throughput: Vec3) -> Path;
    refracted_path(path: Path, surface: Surface, hit_diff: HitDifferential, throughput: Vec3, eta: f32, cosine_i: f32,
                   cosine_t: f32) -> Path;
    is_specular(material: &Material) -> bool;
    angles_at(normal: Vec3, wo: Vec3, wi: Vec3) -> Angles;
    diffuse_eval(material: &Material, angles: Angles) -> Vec3;
    rough_diffuse_eval(material: &Material, angles: Angles) -> Vec3;
    albedo_growth(cosine: f32) -> f32;
    diffuse_pdf(angles: Angles) -> f32;
    diffuse_sample(normal: Vec3, u: Vec2) -> Vec3;
    phong_factors(material: &Material) -> PhongFactors;
    phong_lobe(material: &Material, angles: Angles) -> f32;
    modified_phong_eval(material: &Material, angles: Angles) -> Vec3;
    modified_phong_pdf(material: &Material, angles: Angles) -> f32;
    modified_phong_sample(material: &Material, normal: Vec3, wo: Vec3, u: Vec2, random: f32) -> Vec3;
    transmittance(absorption: Vec3, distance: f32) -> Vec3;
    eta_of(surface: &Surface, material: &Material) -> f32;
    refracts_inwards(surface: &Surface, material: &Material, normal: Vec3) -> bool;
    dielectric_sample(path: Path, surface: Surface, hit_diff: HitDifferential, material: &Material, random: f32) -> DielectricSample;
    principled_mixture(
        material: &Material, wo: Vec3, outside: bool, coat_normal: Vec3, lobes: u32, energy: Vec3,
    ) -> PrincipledLobes;
    bounded_color(color: Vec3) -> Vec3;
    glass_fresnel(m: &PrincipledLobes, cosine: f32) -> Vec3;
    glass_probability(m: &PrincipledLobes, cosine: f32) -> f32;
    luminance(color: Vec3) -> f32;
    sheen_probability(m: &PrincipledLobes) -> f32;
    schlick(f0: Vec3, f90: Vec3, cosine: f32) -> Vec3;
    transmits_straight(m: &PrincipledLobes) -> bool;
    is_flat(alpha: Vec2) -> bool;
    facets_eval(alpha: Vec2, wo: Vec3, wi: Vec3, half: Vec3) -> f32;
    half_between(wo: Vec3, wi: Vec3) -> Vec3;
    refracting_half(wo: Vec3, wi: Vec3, eta: f32) -> Vec3;
    refracting_density(wo: Vec3, wi: Vec3, half: Vec3, eta: f32) -> f32;
    principled_eval(m: &PrincipledLobes, wo: Vec3, wi: Vec3, lobes: u32) -> Vec3;
    glass_eval(m: &PrincipledLobes, wo: Vec3, wi: Vec3) -> Vec3;
    glass_pdf(m: &PrincipledLobes, wo: Vec3, wi: Vec3) -> f32;
    coat_eval(m: &PrincipledLobes, wo: Vec3, wi: Vec3) -> f32;
    to_frame_around(n: Vec3, v: Vec3) -> Vec3;
    principled_pdf(m: &PrincipledLobes, wo: Vec3, wi: Vec3, lobes: u32) -> f32;
    mirrored_pdf(alpha: Vec2, wo: Vec3, half: Vec3) -> f32;
    principled_direction(m: &PrincipledLobes, wo: Vec3, u: Vec2, random: f32, lobes: u32) -> LobeSample;
    evaluated_sample(direction: LobeSample, value: Vec3, pdf: f32) -> LobeSample;
    principled_sample(m: &PrincipledLobes, wo: Vec3, u: Vec2, random: f32, lobes: u32) -> LobeSample;
    sheen_lobe(alpha: f32, wo: Vec3, wi: Vec3) -> f32;
    sheen_albedo(roughness: f32, cosine: f32) -> f32;
    ggx_d(alpha: Vec2, m: Vec3) -> f32;
    ggx_length(alpha: Vec2, w: Vec3) -> f32;
    ggx_g1(alpha: Vec2, w: Vec3) -> f32;
    ggx_g2(alpha: Vec2, wo: Vec3, wi: Vec3) -> f32;
    ggx_sample(alpha: Vec2, wo: Vec3, u: Vec2) -> Vec3;
    ggx_pdf(alpha: Vec2, wo: Vec3, m: Vec3) -> f32;
    ggx_albedo(alpha: f32, mu: f32) -> Vec2;
    ggx_albedo_along(alpha: Vec2, w: Vec3) -> Vec2;
    ggx_albedo_fit(alpha: f32, t: f32, l: f32) -> Vec2;
    plain_alpha(material: &Material) -> Vec2;
    is_polished(material: &Material) -> bool;
    facet_alpha(material: &Material) -> Vec2;
    lobe_frame(surface: &Surface, rotation: f32) -> Tangents;
    direction_turn(color: Vec3) -> f32;
    vector_to_lobe(frame: Tangents, n: Vec3, w: Vec3) -> Vec3;
    vector_from_lobe(frame: Tangents, n: Vec3, w: Vec3) -> Vec3;
    half_vector(wo: Vec3, wi: Vec3) -> Vec3;
    facet_eval(alpha: Vec2, wo: Vec3, wi: Vec3) -> f32;
    facet_pdf(alpha: Vec2, wo: Vec3, wi: Vec3) -> f32;
    facet_weight(alpha: Vec2, wo: Vec3, wi: Vec3) -> f32;
    aniso_table_position(alpha: Vec2, w: Vec3) -> Vec2;
    facet_loss(alpha: Vec2, wo: Vec3) -> f32;
    conductor_fresnel(eta: f32, k: f32, cosine: f32) -> f32;
    metal_fresnel(material: &Material, cosine: f32) -> Vec3;
    metal_factor(material: &Material, cosine: f32) -> Vec3;
    metal_eval(material: &Material, wo: Vec3, wi: Vec3) -> Vec3;
    metal_pdf(material: &Material, wo: Vec3, wi: Vec3) -> f32;
    metal_sample(material: &Material, wo: Vec3, u: Vec2) -> LobeSample;
    dielectric_gain(material: &Material) -> f32;
    refracting_normal(material: &Material, wo: Vec3, wi: Vec3) -> Vec3;
    rough_dielectric_eval(material: &Material, wo: Vec3, wi: Vec3) -> Vec3;
    rough_dielectric_pdf(material: &Material, wo: Vec3, wi: Vec3) -> f32;
    rough_dielectric_sample(material: &Material, wo: Vec3, u: Vec2, random: f32) -> LobeSample;
    thin_reflectance(ior: f32, cosine: f32) -> f32;
    to_upper_side(wi: Vec3) -> Vec3;
    thin_eval(material: &Material, wo: Vec3, wi: Vec3) -> Vec3;
    thin_pdf(material: &Material, wo: Vec3, wi: Vec3) -> f32;
    thin_sample(material: &Material, wo: Vec3, u: Vec2, random: f32) -> LobeSample;
    solid_angle_pdf(density: f32, to_light: Vec3, normal: Vec3) -> f32;
    ellipsoid_area(q: &Primitive) -> f32;
    ellipsoid_cap(level: f32) -> f32;
    ellipsoid_sample(q: &Primitive, p: Vec3, u: Vec2) -> Vec3;
    ellipsoid_pdf(q: &Primitive, p: Vec3, wi: Vec3) -> f32;
    cylinder_part(q: &Primitive, o: Vec3, levels: Vec2) -> CylinderPart;
    cylinder_height_ratio(q: &Primitive) -> f32;
    cylinder_sample(q: &Primitive, p: Vec3, u: Vec2) -> CylinderPoint;
    cylinder_share(q: &Primitive, p: Vec3) -> f32;
    power_heuristic(pdf: f32, other_pdf: f32) -> f32;
    uniform_below(bits: u32, count: u32) -> u32;
    cell_towards(d: Vec3, width: u32, height: u32) -> EnvironmentCell;
    column_after(column: u32, width: u32) -> u32;
    cap_above(row: u32, height: u32) -> f32;
    normal_bin(normal: Vec3) -> u32;
    direction_in_cell(column: u32, row: u32, u: Vec2, width: u32, height: u32) -> Vec3;
    surface_footprint(q: &Primitive, surface: Surface, dx: Vec3, dy: Vec3) -> Footprint;
    uv_derivative(q: &Primitive, local: Vec3, d: Vec3) -> Vec2;
    wrap_u(t: &Texture) -> u32;
    wrap_v(t: &Texture) -> u32;
    texture_footprint(t: &Texture, f: Footprint) -> Footprint;
    footprint_ellipse(dx: Vec2, dy: Vec2, anisotropy: f32) -> Ellipse;
    procedural_share(kind: u32, line_width: f32, f: Footprint) -> f32;
    phase(x: f32) -> f32;
    widened_edge(long: Vec2, short: Vec2) -> Vec2;
    nearest_step(x: f32, duty: f32) -> f32;
    wave_value(x: f32, duty: f32, near: bool) -> f32;
    wave_integral(x: f32, duty: f32, near: bool) -> f32;
    wave_integral_2(x: f32, duty: f32, near: bool) -> f32;
    wave_mean(x: f32, a: f32, b: f32, duty: f32, near: bool) -> f32;
    product_integral(center: Vec2, a: Vec2, b: Vec2, duty: f32, near: bool) -> f32;
    far_product(center: Vec2, long: Vec2, short: Vec2, duty: f32) -> f32;
    sine_ratio(x: f32) -> f32;
    edge_integral(tail: Vec2, head: Vec2, duty: f32, near: bool) -> f32;
    near_coordinate(u: f32, wrap: u32) -> f32;
    wrapped_index(i: i32, size: u32, wrap: u32) -> u32;
    level_size(size: u32, level: u32) -> u32;
    unpacked_color(word: u32, format: u32) -> Vec3;
    srgb_to_linear(x: f32) -> f32;
    gaussian_weight(r2: f32) -> f32;
    vector_to_world(q: &Primitive, v: Vec3) -> Vec3;
    local_tangents(q: &Primitive, local: Vec3) -> Tangents;
    mapped_normal(surface: Surface, t: &Texture, n: Vec3) -> Vec3;
    standalone_prim(prim_id: UVec2) -> u32;
    nearer_hit(a: Hit, b: Hit) -> Hit;
    with_positive_zeros(v: Vec3) -> Vec3;
    color_distance(squared: f32, p: f32, q: f32, limit: f32) -> f32;
    feature_distance(squared: f32, p: f32, q: f32, scale: f32) -> f32;
    noise_of(p: f32, q: f32) -> f32;
    denoise_weight(distance: f32) -> f32;
    slabs(origin: Vec3, direction: Vec3, pad: f32) -> Slabs;
    inverse_of(x: f32) -> f32;
    box_interval(low: Vec3, high: Vec3, s: Slabs) -> Vec2;
    interval_hits(interval: Vec2, limit: f32) -> bool;
    ray_interval(origin: Vec3, min_direction: Vec3, max_direction: Vec3, pad: f32) -> RayInterval;
    ray_interval_box(low: Vec3, high: Vec3, rays: RayInterval) -> Vec2;
    steps(word: u32) -> Vec4;
    step_length(node: &Node, axis: u32) -> f32;
    larger(a: Vec4, b: Vec4) -> Vec4;
    smaller(a: Vec4, b: Vec4) -> Vec4;
    hit_bits(near: Vec4, far: Vec4, limit: f32) -> u32;
    children_hit(node: &Node, s: Slabs, limit: f32) -> u32;
    four_hit(node: &Node, low: UVec3, high: UVec3, s: Slabs, limit: f32) -> u32;
    children_in_interval(node: &Node, rays: RayInterval, limit: f32) -> u32;
    four_in_interval(node: &Node, low: UVec3, high: UVec3, rays: RayInterval, limit: f32) -> u32;
    far_side(low: Vec4, high: Vec4, far_low: f32, far_high: f32) -> Vec4;
    in_order(bits: u32, octant: u32) -> u32;
    octant_of(direction: Vec3) -> u32;
    leaf_items(node: &Node, slot: u32) -> UVec2;
    shear_of(direction: Vec3) -> Shear;
    permuted(v: Vec3, axis: u32) -> Vec3;
    sheared(v: Vec3, shear: Shear) -> Vec3;
    triangle_crossing(v0: Vec3, v1: Vec3, v2: Vec3, origin: Vec3, shear: Shear, s: Slabs) -> Crossing;
    lowest(a: Vec3, b: Vec3, c: Vec3) -> Vec3;
    highest(a: Vec3, b: Vec3, c: Vec3) -> Vec3;
    point_to_mesh(i: &Instance, p: Vec3) -> Vec3;
    vector_to_mesh(i: &Instance, v: Vec3) -> Vec3;
    vector_from_mesh(i: &Instance, v: Vec3) -> Vec3;
    normal_from_mesh(i: &Instance, n: Vec3) -> Vec3;
    mesh_pad(i: &Instance, origin: Vec3) -> f32;
    standalone_hit_primitive(q: &Primitive) -> HitPrimitive;
    face_primitive(i: &Instance, v0: Vec3, edge_1: Vec3, edge_2: Vec3, material: u32) -> Primitive;
    face_direction_allowed(face: &HitPrimitive, surface: &Surface, direction: Vec3) -> bool;
    flipped_to(v: Vec3, side: Vec3) -> Vec3;
    face_surface(face: &HitPrimitive, prim_id: UVec2, b: Vec2, d: Vec3, epsilon: f32) -> Surface;
    face_uv(face: &HitPrimitive, b: Vec2) -> Vec2;
    color_between(c0: Vec4, c1: Vec4, c2: Vec4, b: Vec2) -> Vec4;
    face_normal(face: &HitPrimitive, b: Vec2) -> Vec3;
    face_terminator_offset(face: &HitPrimitive, b: Vec2, side: f32) -> Vec3;
    lift(n: Vec3, from_vertex: Vec3, up: Vec3) -> Vec3;
    face_tangents(face: &HitPrimitive) -> Tangents;
    face_frame(face: &HitPrimitive, b: Vec2) -> Tangents;
    face_uv_derivative(face: &HitPrimitive, d: Vec3) -> Vec2;
    face_normal_derivative(face: &HitPrimitive, b: Vec2, d: Vec3) -> Vec3;
    face_hit_differential(face: &HitPrimitive, b: Vec2, differential: Differential, ray: Ray, t: f32, surface: Surface) -> HitDifferential;
    face_footprint(face: &HitPrimitive, surface: Surface, dx: Vec3, dy: Vec3) -> Footprint;
    face_first_hit(face: &HitPrimitive, hit: Hit) -> FirstHit;
}

/// Shared functions without a probe, with reasons.
const EXCEPTIONS: &[(&str, &str)] = &[("no_hit", "has no arguments"), ("no_sample", "has no arguments")];

pub fn twin(name: &str) -> &'static Probe {
    PROBES
        .iter()
        .find(|probe| probe.name == name)
        .unwrap_or_else(|| panic!("{name} has no probe"))
}

impl Probe {
    /// Returns the results of many calls with the arguments `words`.
    pub fn results(&self, words: &[u32], words_out: usize) -> Vec<u32> {
        let mut words = words;
        let mut out = Vec::new();
        while !words.is_empty() {
            let start = out.len();
            (self.run)(&mut words, &mut out);
            assert_eq!(
                out.len() - start,
                words_out,
                "{}: the twin's result has a different number of words",
                self.name
            );
        }
        out
    }

    /// Returns true if an operand or any intermediate result is denormal.
    fn involves_denormals(&self, words: &[u32], words_out: usize) -> bool {
        processor::clear_denormal_flags();
        let results = self.results(words, words_out);
        processor::denormals_occurred() || results.iter().any(|word| f32::from_bits(*word).is_subnormal())
    }
}

/// Exception flags of the processor.
#[cfg(target_arch = "x86_64")]
mod processor {
    use std::arch::asm;

    /// MXCSR: denormal operand and underflow.
    const DENORMAL_FLAGS: u32 = 1 << 1 | 1 << 4;

    fn flags() -> u32 {
        let mut flags = 0u32;
        // SAFETY: stores 32 bits to a `u32`.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut flags) };
        flags
    }

    pub fn clear_denormal_flags() {
        let cleared = flags() & !DENORMAL_FLAGS;
        // SAFETY: changes only exception flags of MXCSR, which inline assembly may change.
        unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const cleared) };
    }

    pub fn denormals_occurred() -> bool {
        flags() & DENORMAL_FLAGS != 0
    }
}

/// On other processors, no difference is attributed to denormal numbers.
#[cfg(not(target_arch = "x86_64"))]
mod processor {
    pub fn clear_denormal_flags() {}

    pub fn denormals_occurred() -> bool {
        false
    }
}

/// Returns true for equal bits, or for two NaN, since no device guarantees the bits of NaN.
fn same(kind: ScalarKind, a: u32, b: u32) -> bool {
    a == b || kind == ScalarKind::Float && f32::from_bits(a).is_nan() && f32::from_bits(b).is_nan()
}

fn differing(kinds: &[ScalarKind], a: &[u32], b: &[u32]) -> Vec<usize> {
    assert_eq!(a.len(), b.len());
    let calls = a.chunks_exact(kinds.len()).zip(b.chunks_exact(kinds.len())).enumerate();
    let differing_calls =
        calls.filter(|(_, (a, b))| !kinds.iter().zip(*a).zip(*b).all(|((kind, a), b)| same(*kind, *a, *b)));
    differing_calls.map(|(call, _)| call).collect()
}

fn show(kinds: &[ScalarKind], words: &[u32]) -> String {
    let word = |(kind, word): (&ScalarKind, &u32)| match kind {
        ScalarKind::Float => format!("{:?}", f32::from_bits(*word)),
        _ => format!("{word}"),
    };
    kinds.iter().zip(words).map(word).collect::<Vec<_>>().join(" ")
}

const DENORMALS: &str = "denormal numbers";

/// Compares a function with its twin, and returns the number of skipped calls. On devices with a known difference for
/// denormal numbers, calls with such numbers may differ and are skipped.
fn compare(device: &Device, function: &Function) -> Result<usize, String> {
    let (name, kinds) = (function.name(), function.words_out());
    let words = inputs(function, CALLS, name.bytes().map(u64::from).sum());
    let (gpu, cpu) = (function.run(device, &words), twin(name).results(&words, kinds.len()));
    let info = &device.info;
    let call_words = |call: usize| &words[call * function.words_in()..(call + 1) * function.words_in()];
    let denormals_differ = allowed(adapter::KNOWN_DIFFERENCES, &info.name, &info.driver, DENORMALS).is_some();
    let known_difference = allowed(adapter::KNOWN_DIFFERENCES, &info.name, &info.driver, name);
    let arguments = function.arguments().into_iter();
    let kinds_in: Vec<ScalarKind> = arguments.flat_map(|(_, ty)| scalars(function.module, ty)).collect();
    let is_large = |(word, kind): (&u32, &ScalarKind)| *kind == ScalarKind::Uint && *word >= 1 << 31;
    // `sample_square` calls `jittered_sample`, which computes large integers from small ones.
    let converts_arguments = !matches!(name, "jittered_sample" | "sample_square");
    let is_rounded_twice = known_difference.is_some_and(|known_difference| known_difference.reason == ROUNDED_TWICE);
    let has_known_cause =
        |call: usize| is_rounded_twice && (!converts_arguments || call_words(call).iter().zip(&kinds_in).any(is_large));
    // The known cause is checked first: a compiled twin may raise the flags of denormal numbers in code whose result it
    // discards, so that the number of skipped calls depends on the compiler.
    let (skipped, differing_calls): (Vec<usize>, Vec<usize>) =
        differing(&kinds, &gpu, &cpu).into_iter().partition(|&call| {
            denormals_differ && !has_known_cause(call) && twin(name).involves_denormals(call_words(call), kinds.len())
        });
    if is_rounded_twice && !differing_calls.iter().all(|&call| has_known_cause(call)) {
        return Err(format!(
            "{name}: results differ for calls without integers of 2^31 or more"
        ));
    }
    judge(known_difference, name, differing_calls.len() as f64 / CALLS as f64).map_err(|message| {
        let Some(&call) = differing_calls.first() else {
            return message;
        };
        let result_start = call * kinds.len();
        let arguments = call_words(call);
        format!(
            "{message}, first call {call}:\n  arguments {}\n  GPU {}\n  CPU {}",
            show(&kinds_in, arguments),
            show(&kinds, &gpu[result_start..]),
            show(&kinds, &cpu[result_start..])
        )
    })?;
    Ok(skipped.len())
}

#[test]
fn every_shared_function_has_a_probe() {
    let source = shared_source();
    let module = parse(&source);
    let (mut names, mut missing) = (Vec::new(), Vec::new());
    for (file, function) in functions(&module, &source) {
        let name = function.name();
        names.push(name.to_string());
        if EXCEPTIONS.iter().any(|(exception, _)| *exception == name) {
            continue;
        }
        let arguments: Vec<String> = function.arguments().into_iter().map(|(name, _)| name).collect();
        match PROBES.iter().find(|probe| probe.name == name) {
            Some(probe) => assert_eq!(arguments, probe.arguments, "{file}: {name}"),
            None => missing.push(format!("{file}: {name}({})", arguments.join(", "))),
        }
    }
    assert!(
        missing.is_empty(),
        "add probes to tests/probes.rs for\n{}",
        missing.join("\n")
    );
    for name in PROBES
        .iter()
        .map(|probe| probe.name)
        .chain(EXCEPTIONS.iter().map(|(name, _)| *name))
    {
        assert!(
            names.iter().any(|n| n == name),
            "{name} has a probe but is in no shared file"
        );
    }
}

#[test]
fn functions_give_the_same_bits_on_gpu_and_cpu() {
    let Some(device) = adapter::device() else { return };
    let source = shared_source();
    let module = parse(&source);
    let functions = functions(&module, &source);
    let selected = std::env::var(FUNCTION).ok();
    let is_selected = |name: &str| selected.as_ref().is_none_or(|selected| selected == name);
    let probed: Vec<_> = functions
        .iter()
        .filter(|(_, f)| is_selected(f.name()) && !EXCEPTIONS.iter().any(|(exception, _)| *exception == f.name()))
        .collect();
    assert!(
        !probed.is_empty(),
        "{FUNCTION}: no shared function is called {selected:?}"
    );
    let (mut problems, mut skipped) = (Vec::new(), 0);
    for (file, f) in &probed {
        match compare(device, f) {
            Ok(calls) => skipped += calls,
            Err(message) => problems.push(format!("{file}: {message}")),
        }
    }
    if selected.is_none() {
        let known_difference = allowed(
            adapter::KNOWN_DIFFERENCES,
            &device.info.name,
            &device.info.driver,
            DENORMALS,
        );
        let fraction = skipped as f64 / (probed.len() * CALLS) as f64;
        problems.extend(judge(known_difference, DENORMALS, fraction).err());
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
    println!(
        "{} functions, {CALLS} calls each: the same bits; {skipped} calls with denormal numbers skipped",
        probed.len()
    );
}

/// Predicates are true for some inputs and false for others, and intersection functions have both hits and misses.
#[test]
fn inputs_cover_both_outcomes_of_predicates() {
    const CALLS: usize = 2048;
    let source = shared_source();
    let module = parse(&source);
    for (file, function) in functions(&module, &source) {
        let (name, kinds) = (function.name(), function.words_out());
        let Some(probe) = PROBES.iter().find(|probe| probe.name == name) else {
            continue;
        };
        let words = inputs(&function, CALLS, 1);
        let results = probe.results(&words, kinds.len());
        let fraction = |predicate: &dyn Fn(u32) -> bool| {
            results.iter().filter(|word| predicate(**word)).count() as f64 / results.len() as f64
        };
        if kinds[0] == ScalarKind::Bool {
            let true_fraction =
                results.iter().step_by(kinds.len()).filter(|word| **word != 0).count() as f64 / CALLS as f64;
            assert!(
                (0.05..0.95).contains(&true_fraction),
                "{file}: {name} is true for a fraction {true_fraction} of the inputs, which must be from 0.05 to 0.95: see tests/inputs.rs"
            );
        }
        if name.starts_with("intersect_") {
            let words_per_call = function.words_in();
            let limits = words.chunks_exact(words_per_call).map(|call| call[words_per_call - 1]);
            let hit_count = results
                .iter()
                .zip(limits)
                .filter(|(result, limit)| **result != *limit)
                .count();
            let hit_fraction = hit_count as f64 / CALLS as f64;
            assert!(
                (0.1..0.9).contains(&hit_fraction),
                "{file}: {name} hits for a fraction {hit_fraction} of the inputs, which must be from 0.1 to 0.9: see `local_point` in tests/inputs.rs"
            );
        }
        let nan_fraction = fraction(&|word| f32::from_bits(word).is_nan());
        assert!(
            kinds[0] != ScalarKind::Float || nan_fraction < 0.5,
            "{file}: {name} is NaN for a fraction {nan_fraction} of the inputs"
        );
    }
}

#[test]
fn a_difference_of_one_ulp_is_detected() {
    let Some(device) = adapter::device() else { return };
    for (name, from, to) in [
        ("log2", "2.8853900817779268", "2.8853903"),
        ("exp2", "0.6931471805599453", "0.69314724"),
        ("unit_float", "5.9604644775390625e-8", "5.9604652e-8"),
        (
            "dot",
            "a.x * b.x + a.y * b.y + a.z * b.z",
            "a.x * b.x + (a.y * b.y + a.z * b.z)",
        ),
        ("min", "select(b, a, a < b)", "select(b, a, a <= b)"), // signed zeros
        ("max", "select(b, a, a > b)", "select(a, b, a < b)"),  // NaN
    ] {
        let mut source = shared_source();
        assert!(source.text.contains(from), "{name}: '{from}' not found");
        let text = source.text.replacen(from, to, 1);
        source = wgray_render::gpu::compose::Source::default();
        source.append("changed", &text);
        let module = parse(&source);
        let (_, function) = functions(&module, &source)
            .into_iter()
            .find(|(_, f)| f.name() == name)
            .expect("the function");
        let kinds = function.words_out();
        let words = inputs(&function, CALLS, 1);
        let edited_results = function.run_in(device, &source, &words);
        let differing_calls = differing(&kinds, &edited_results, &twin(name).results(&words, kinds.len()));
        assert!(
            !differing_calls.is_empty(),
            "{name}: '{to}' instead of '{from}' is not detected"
        );
    }
}

/// For example, `max(NaN, 0)` is 0.
#[test]
fn nan_does_not_propagate() {
    assert_eq!(max(f32::NAN, 0.0), 0.0);
    assert_eq!(min(f32::NAN, 1.0), 1.0);
    assert_eq!(power(f32::NAN, 2.0), 0.0);
    let hit = Hit {
        t: 5.0,
        primitive: 3,
        ..no_hit()
    };
    assert_eq!(closer(hit, f32::NAN, 4, NO_INDEX), hit);
    let source = shared_source();
    let module = parse(&source);
    let random = Random::new(7);
    for (_, function) in functions(&module, &source) {
        // A ray with NaN hits nothing.
        if function.name().starts_with("intersect_") {
            let mut words = inputs(&function, 500, random.bits());
            let words_per_call = function.words_in();
            for call in words.chunks_exact_mut(words_per_call) {
                call[words_per_call - 1 - 6 + random.below(6) as usize] = f32::NAN.to_bits();
                call[words_per_call - 1] = 100f32.to_bits();
            }
            let results = twin(function.name()).results(&words, 1);
            assert!(results.iter().all(|r| *r == 100f32.to_bits()), "{}", function.name());
        }
    }
}

/// Denormal numbers are reported if an operand, a result or an intermediate result is denormal, and in no other case.
#[test]
#[cfg(target_arch = "x86_64")]
fn denormal_numbers_in_twins_are_detected() {
    let smallest = f32::MIN_POSITIVE;
    for (a, b, expected) in [
        ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], false),
        ([smallest, 0.0, -0.0], [1.0, 1e-45, 0.0], true), // an operand
        ([smallest, 0.0, 0.0], [0.3, 0.0, 0.0], true),    // a result
        ([smallest, 1.0, 0.0], [0.3, 1.0, 0.0], true),    // an intermediate result
        ([smallest, 1.0, 0.0], [1.0, 1.0, 0.0], false),
        ([f32::MAX, 1.0, 0.0], [f32::MAX, 1.0, f32::NAN], false),
    ] {
        let words: Vec<u32> = a.iter().chain(&b).map(|x: &f32| x.to_bits()).collect();
        assert_eq!(twin("dot").involves_denormals(&words, 1), expected, "{a:?} {b:?}");
    }
}
