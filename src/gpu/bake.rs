//! A small scene written into its kernel as constants: the functions of `scene.wgsl`, with a statement for each primitive
//! instead of a loop. Software Vulkan reads a buffer lane by lane, constants for free.

use std::fmt::Write;
use std::ops::Range;

use glam::Vec3;

use crate::pack::{BLOCK, ELLIPSOID, Light, Material, Packed, Primitive, Specialization, Sphere, Texture};

/// Larger scenes are read from buffers: compiling grows with every primitive.
pub const MOST_PRIMITIVES: usize = 64;
/// Likewise with every material, light and texture, and faster than in proportion.
pub const MOST_RECORDS: usize = 512;

/// [`bake`], if the scene is small enough.
pub fn bake_if_small(packed: &Packed) -> Option<String> {
    let records = packed.materials.len() + packed.lights.len() + packed.textures.len();
    (packed.primitives.len() <= MOST_PRIMITIVES && records <= MOST_RECORDS).then(|| bake(packed))
}

/// What the shaders call a primitive of each kind, by [`Primitive::kind`].
const KINDS: [&str; 4] = ["rectangle", "triangle", "ellipsoid", "plane"];

/// The WGSL text of a scene's `closest_hit`, `shadow_candidates`, `load_primitive`, `load_blocker`, `load_material`,
/// `load_light` and `load_texture`.
pub fn bake(packed: &Packed) -> String {
    let mut out = String::new();
    let records: Vec<String> = packed.primitives.iter().map(primitive).collect();
    write_function(
        &mut out,
        "closest_hit(ray: Ray, left: u32, wall: u32) -> Hit",
        "var hit = Hit(FAR, NOTHING);",
        "hit",
        |body| {
            for (i, (p, record)) in packed.primitives.iter().zip(&records).enumerate() {
                let kind = KINDS[p.kind as usize];
                let wall = match p.kind {
                    ELLIPSOID => format!("{i}u == wall, "),
                    _ => String::new(),
                };
                let _ = writeln!(
                    body,
                    "    hit = closer(hit, intersect_{kind}({record}, {wall}ray, hit.t), {i}u, left);"
                );
            }
        },
    );
    let signature = "shadow_candidates(first: u32, end: u32, cone: Cone) -> u32";
    write_function(&mut out, signature, "var bits = 0u;", "bits", |body| {
        for range in blocking(&packed.specialization) {
            for first in range.clone().step_by(BLOCK as usize) {
                let _ = writeln!(body, "    if first == {first}u {{");
                for i in first..range.end.min(first + BLOCK as usize) {
                    let (bit, sphere) = (i - first, sphere(&packed.bounds[i]));
                    let _ = writeln!(
                        body,
                        "        bits |= select(0u, {}u, may_block({sphere}, cone));",
                        1u32 << bit
                    );
                }
                let _ = writeln!(body, "    }}");
            }
        }
    });
    write_table(&mut out, "load_primitive", "Primitive", &records);
    write_function(
        &mut out,
        "load_blocker(kind: u32, i: u32) -> Primitive",
        "var r = Primitive();",
        "r",
        |body| {
            for range in blocking(&packed.specialization) {
                for (k, i) in range.clone().enumerate() {
                    let kind = packed.primitives[i].kind;
                    let test = if k == 0 {
                        String::new()
                    } else {
                        format!(" & (i == {i}u)")
                    };
                    let _ = writeln!(body, "    if (kind == {kind}u){test} {{ r = {}; }}", records[i]);
                }
            }
        },
    );
    write_table(
        &mut out,
        "load_material",
        "Material",
        &packed.materials.iter().map(material).collect::<Vec<_>>(),
    );
    write_table(
        &mut out,
        "load_light",
        "Light",
        &packed.lights.iter().map(light).collect::<Vec<_>>(),
    );
    write_table(
        &mut out,
        "load_texture",
        "Texture",
        &packed.textures.iter().map(texture).collect::<Vec<_>>(),
    );
    out
}

/// The primitives of each kind that can cast a shadow.
fn blocking(s: &Specialization) -> [Range<usize>; 4] {
    let (triangles, ellipsoids) = (s.rectangles, s.rectangles + s.triangles);
    let planes = ellipsoids + s.ellipsoids;
    [
        0..s.blocking_rectangles,
        triangles..triangles + s.blocking_triangles,
        ellipsoids..ellipsoids + s.blocking_ellipsoids,
        planes..planes + s.blocking_planes,
    ]
    .map(|range| range.start as usize..range.end as usize)
}

fn write_function(out: &mut String, signature: &str, start: &str, result: &str, body: impl FnOnce(&mut String)) {
    let _ = writeln!(out, "fn {signature} {{\n    {start}");
    body(out);
    let _ = writeln!(out, "    return {result};\n}}");
}

/// A function from an index to a constant record, by a chain of selections.
fn write_table(out: &mut String, name: &str, record: &str, records: &[String]) {
    let first = records.first().map_or(format!("{record}()"), Clone::clone);
    write_function(
        out,
        &format!("{name}(i: u32) -> {record}"),
        &format!("var r = {first};"),
        "r",
        |body| {
            for (i, constant) in records.iter().enumerate().skip(1) {
                let _ = writeln!(body, "    if i == {i}u {{ r = {constant}; }}");
            }
        },
    );
}

fn vector(v: Vec3) -> String {
    format!("vec3f({:?}f, {:?}f, {:?}f)", v.x, v.y, v.z)
}

fn primitive(p: &Primitive) -> String {
    format!(
        "Primitive({}, {}u, {}, {}u, {}, {}u, {}, {:?}f, {}, {:?}f)",
        vector(p.anchor),
        p.material,
        vector(p.x),
        p.shape,
        vector(p.y),
        p.kind,
        vector(p.z),
        p.determinant,
        vector(p.middle),
        p.level
    )
}

fn sphere(s: &Sphere) -> String {
    format!("Sphere({}, {:?}f)", vector(s.center), s.radius)
}

fn material(m: &Material) -> String {
    format!(
        "Material({}, {}u, {}, {:?}f, {}, {}u, vec4u({}u, {}u, {}u, {}u))",
        vector(m.ambient),
        m.kind,
        vector(m.diffuse),
        m.shininess,
        vector(m.specular),
        m.exponent,
        m.lookups.x,
        m.lookups.y,
        m.lookups.z,
        m.lookups.w
    )
}

fn texture(t: &Texture) -> String {
    format!(
        "Texture({}, {}u, {}, {:?}f, {}, {}u, {}, {}u, {}u, {}u, {}u, {}u)",
        vector(t.first),
        t.kind,
        vector(t.second),
        t.parameter,
        vector(t.u),
        t.format,
        vector(t.v),
        t.wrap,
        t.texels,
        t.width,
        t.height,
        t.levels
    )
}

fn light(l: &Light) -> String {
    format!(
        "Light({}, {:?}f, {}, {:?}f, {}, {:?}f, {}, {}u)",
        vector(l.center),
        l.reach,
        vector(l.u),
        l.finite,
        vector(l.v),
        l.area,
        vector(l.color),
        l.number
    )
}
