//! The functions of WGSL that call another one for each kind of primitive, with the kind as a constant: from the list of kinds.

use std::fmt::Write as _;

use crate::records::{Form, PRIMITIVE_KINDS, PrimitiveKind};

/// Loops over the primitives outside of the BVH, which are sorted by kind: the functions that a kernel with the scene as constants has
/// without loops.
pub fn linear_loops() -> String {
    let all = |_: &PrimitiveKind| true;
    let nearest = function(
        "closest_primitive(ray: Ray, left: u32, wall: u32) -> Hit",
        "var hit = no_hit();",
        "hit",
        all,
        |kind| {
            format!(
                "if (PRIMITIVES & (1u << {kind})) != 0u {{\n        hit = closest_of({kind}, hit, ray, left, wall);\n    }}"
            )
        },
    );
    let samples = function(
        "hidden_by_primitives(surface: Surface, light: Light, block: Block) -> u32",
        "let cone = cone_to_light(light, surface.start);\n    var bits = 0u;",
        "bits",
        all,
        |kind| {
            format!(
                "if (SHADOW_CASTERS & (1u << {kind})) != 0u {{\n        \
                 bits |= hidden_by({kind}, counts.primitives[{kind}].xy, surface, cone, light, block);\n    }}"
            )
        },
    );
    let segment = function(
        "is_hidden_by_primitives(before: bool, surface: Surface, to: vec3f, reach: f32, goal: u32) -> bool",
        "var hidden = before;",
        "hidden",
        all,
        |kind| {
            format!(
                "if (SHADOW_CASTERS & (1u << {kind})) != 0u {{\n        \
                 hidden = is_hidden_by({kind}, hidden, surface, to, reach, goal);\n    }}"
            )
        },
    );
    nearest + &samples + &segment
}

/// The tests of the primitive of an item in `tree.wgsl`: its hit, whether it occludes one sample of a light, and whether it cuts a segment. Loops
/// stand where an `if` would do, because software Vulkan skips them.
pub fn item_tests() -> String {
    let bounded = |kind: &PrimitiveKind| kind.form != Form::Infinite;
    let once = |kind: &str, statement: String| {
        format!("for (var once = has_kind(item, {kind}); once; once = false) {{\n        {statement}\n    }}")
    };
    let nearest = function(
        "closest_of_primitive_item(before: Hit, item: Item, ray: Ray, near: f32, left: vec2u, wall: vec2u) -> Hit",
        "var hit = before;",
        "hit",
        bounded,
        |kind| {
            let hit = format!("hit_by_itself({kind}, item.index, ray, near, left, wall)");
            once(kind, format!("hit = nearer_hit(hit, {hit});"))
        },
    );
    let sample = function(
        "hidden_by_primitive_item(item: Item, p: vec3f, wall: bool, light: Light, block: Block) -> u32",
        "var bits = 0u;",
        "bits",
        bounded,
        |kind| {
            let bits = format!("shadow_bits({kind}, primitives[item.index], p, wall, light, block)");
            once(kind, format!("bits = {bits};"))
        },
    );
    let segment = function(
        "is_cut_by_primitive_item(item: Item, surface: Surface, to: vec3f, reach: f32, goal: u32) -> bool",
        "var cut = false;",
        "cut",
        bounded,
        |kind| {
            let cut = format!("is_cut({kind}, primitives[item.index], item.index, surface, to, reach, goal)");
            once(kind, format!("cut = {cut};"))
        },
    );
    nearest + &sample + &segment
}

/// A function with a statement for each of some kinds.
fn function(
    signature: &str,
    start: &str,
    result: &str,
    is_in: impl Fn(&PrimitiveKind) -> bool,
    statement: impl Fn(&str) -> String,
) -> String {
    let mut out = format!("fn {signature} {{\n    {start}\n");
    for kind in PRIMITIVE_KINDS.iter().filter(|kind| is_in(kind)) {
        let _ = writeln!(out, "    {}", statement(kind.name));
    }
    let _ = writeln!(out, "    return {result};\n}}\n");
    out
}
