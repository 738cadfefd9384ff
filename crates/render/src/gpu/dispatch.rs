//! Generated WGSL functions that call another function once for each kind of primitive, with the kind as a constant.

use std::fmt::Write as _;

use wgray_trace::records::{PRIMITIVE_KINDS, PrimitiveForm};

/// Returns WGSL loops over the primitives outside of the BVH, sorted by kind. Baked scenes have straight-line code
/// instead.
pub fn linear_loops() -> String {
    functions(
        true,
        &[
            (
                "closest_primitive(ray: Ray, origin_prim: u32, inside_prim: u32) -> Hit",
                "var hit = no_hit();",
                "if (PRIMITIVES & (1u << KIND)) != 0u { hit = closest_of(KIND, hit, ray, origin_prim, inside_prim); }",
                "hit",
            ),
            (
                "occluded_by_primitives(surface: Surface, light: Light, block: SampleBlock) -> u32",
                "let frustum = light_frustum(light, surface.ray_origin);\n    var bits = 0u;",
                "if (SHADOW_CASTERS & (1u << KIND)) != 0u {
        bits |= occluded_by(KIND, counts.primitives[KIND].xy, surface, frustum, light, block);
    }",
                "bits",
            ),
            (
                "is_occluded_by_primitives(already_occluded: bool, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool",
                "var occluded = already_occluded;",
                "if (SHADOW_CASTERS & (1u << KIND)) != 0u { occluded = is_occluded_by(KIND, occluded, surface, to_light, t_max, target_prim); }",
                "occluded",
            ),
        ],
    )
}

/// Returns the WGSL source of the functions with which `bvh.wgsl` intersects the primitive of a BVH item: closest hit,
/// occlusion of light samples, and occlusion of a segment. Loops replace `if`, because software Vulkan skips a loop that no lane enters.
pub fn item_intersections() -> String {
    functions(
        false,
        &[
            (
                "closest_of_primitive_item(before: Hit, item: BvhItem, ray: Ray, near: f32, origin_prim: vec2u, inside_prim: vec2u) -> Hit",
                "var hit = before;",
                "for (var once = has_kind(item, KIND); once; once = false) {
        hit = nearer_hit(hit, standalone_hit(KIND, item.index, ray, near, origin_prim, inside_prim));
    }",
                "hit",
            ),
            (
                "occluded_by_primitive_item(item: BvhItem, p: vec3f, from_inside: bool, light: Light, block: SampleBlock) -> u32",
                "var bits = 0u;",
                "for (var once = has_kind(item, KIND); once; once = false) {
        bits = occlusion_mask(KIND, primitives[item.index], p, from_inside, light, block);
    }",
                "bits",
            ),
            (
                "is_occluded_by_primitive_item(item: BvhItem, surface: Surface, to_light: vec3f, t_max: f32, target_prim: u32) -> bool",
                "var occluded = false;",
                "for (var once = has_kind(item, KIND); once; once = false) {
        occluded = is_occluded_by_primitive(KIND, primitives[item.index], item.index, surface, to_light, t_max, target_prim);
    }",
                "occluded",
            ),
        ],
    )
}

/// Writes functions, each described by signature, first statement, statement per kind (named `KIND`) and result.
/// `with_planes` is false for BVH items, because infinite planes are not in a BVH.
fn functions(with_planes: bool, functions: &[(&str, &str, &str, &str)]) -> String {
    let mut out = String::new();
    for (signature, start, statement, result) in functions {
        let _ = writeln!(out, "fn {signature} {{\n    {start}");
        for kind in PRIMITIVE_KINDS {
            if with_planes || kind.form != PrimitiveForm::Infinite {
                let _ = writeln!(out, "    {}", statement.replace("KIND", kind.name));
            }
        }
        let _ = writeln!(out, "    return {result};\n}}\n");
    }
    out
}
