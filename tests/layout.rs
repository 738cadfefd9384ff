//! The records, constants and overrides that the host and the shaders share are the same on both sides.
//!
//! Both lists are read from the sources, so that a field, constant or override that one side lacks is found.

use std::collections::BTreeMap;

use naga::{Expression, Literal, Module, TypeInner};
use syn::{BinOp, Expr, Item, Lit, UnOp, Visibility};
use wgray::gpu::compose::Source;
use wgray::pack::Specialization;

use crate::sources::{self, Signature, file_of, parse, shared_source};

const LAYOUT: &str = "layout.wgsl";
const CONSTANTS: &str = "constants.wgsl";

/// A record's fields with their offsets, and its size, in bytes.
type Layout = (Vec<(String, String, u32)>, u32);

/// The layouts that WGSL's rules give (WGSL, section 14.4.1).
fn wgsl_layouts(source: &Source) -> BTreeMap<String, Layout> {
    let module = parse(source);
    let mut layouts = BTreeMap::new();
    for (handle, ty) in module.types.iter() {
        let TypeInner::Struct { members, span } = &ty.inner else {
            continue;
        };
        if file_of(source, module.types.get_span(handle)) == LAYOUT {
            let field = |m: &naga::StructMember| {
                (
                    m.name.clone().unwrap_or_default(),
                    sources::type_name(&module, m.ty),
                    m.offset,
                )
            };
            layouts.insert(
                ty.name.clone().unwrap_or_default(),
                (members.iter().map(field).collect(), *span),
            );
        }
    }
    layouts
}

/// The layouts of the Rust records: each field directly behind the one before, which `bytemuck::Pod` proves for all of
/// them, as it refuses to compile padding; so that the sizes of the fields' types give offsets and size.
fn rust_layouts(records: &[Signature]) -> BTreeMap<String, Layout> {
    let layout = |record: &Signature| {
        let mut offset = 0;
        let fields = record.parts.iter().map(|(name, ty)| {
            let at = offset;
            offset += size(ty);
            (name.clone(), ty.clone(), at)
        });
        let fields = fields.collect();
        (record.name.clone(), (fields, offset))
    };
    records.iter().map(layout).collect()
}

/// In bytes, of a scalar, vector or array as glam has them.
fn size(ty: &str) -> u32 {
    if let Some((element, length)) = ty
        .strip_prefix("array<")
        .and_then(|t| t.strip_suffix('>')?.rsplit_once(", "))
    {
        return size(element) * length.parse::<u32>().expect("a length");
    }
    match ty.split_once('<').map_or(ty, |(vector, _)| vector) {
        "f32" | "u32" | "i32" => 4,
        "vec2" => 8,
        "vec3" => 12,
        "vec4" => 16,
        other => panic!("{other} has no place in a shared record"),
    }
}

fn pack_records() -> Vec<Signature> {
    sources::rust_records(&sources::rust("src/pack/layout.rs"))
}

fn layout_differences(source: &Source, records: &[Signature]) -> Vec<String> {
    let (wgsl, rust) = (wgsl_layouts(source), rust_layouts(records));
    let mut problems = Vec::new();
    for name in wgsl.keys().chain(rust.keys().filter(|name| !wgsl.contains_key(*name))) {
        let (Some(w), Some(r)) = (wgsl.get(name), rust.get(name)) else {
            problems.push(format!("{name} is on one side only"));
            continue;
        };
        for i in 0..w.0.len().max(r.0.len()) {
            let (w, r) = (w.0.get(i), r.0.get(i));
            if w != r {
                problems.push(format!("{name}, field {i}: WGSL {w:?}, Rust {r:?}"));
            }
        }
        if w.1 != r.1 {
            problems.push(format!("{name}: {} bytes in WGSL, {} in Rust", w.1, r.1));
        }
    }
    problems
}

#[test]
fn records_have_the_same_layout() {
    let source = shared_source();
    assert!(wgsl_layouts(&source).len() >= 7, "the records were not found");
    let problems = layout_differences(&source, &pack_records());
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn every_uploaded_record_is_known_to_have_no_padding() {
    for item in sources::rust("src/pack/layout.rs").items {
        let Item::Struct(record) = item else { continue };
        let derives = |a: &syn::Attribute| {
            a.path().is_ident("derive")
                && a.meta
                    .require_list()
                    .is_ok_and(|l| l.tokens.to_string().contains("Pod"))
        };
        assert!(record.attrs.iter().any(derives), "{} must derive Pod", record.ident);
    }
}

#[test]
fn a_changed_record_is_found() {
    let changes = [
        ("dropped", "    number: u32, ", "    // number: u32, "),
        ("renamed", "    number: u32, ", "    numbers: u32, "),
        ("of another type", "    seed: u32,", "    seed: i32,"),
        ("at another offset", "    reach: f32, ", "    @align(16) reach: f32, "),
        ("added", "    seed: u32,", "    seed: u32,\n    seed2: u32,"),
        (
            "moved",
            "    position: vec3f,\n    projection: u32, ",
            "    projection: u32,\n    position: vec3f, ",
        ),
        (
            "a new record",
            "struct Work {",
            "struct Other { a: u32 }\nstruct Work {",
        ),
    ];
    for (what, from, to) in changes {
        let mut source = shared_source();
        assert!(
            source.text.contains(from),
            "{what}: '{from}' is not there to be changed"
        );
        source = edited(&source, from, to);
        assert!(!layout_differences(&source, &pack_records()).is_empty(), "{what}");
    }
    let mut records = pack_records();
    records[0].parts.pop();
    assert!(
        !layout_differences(&shared_source(), &records).is_empty(),
        "a field dropped in Rust"
    );
    records.remove(0);
    assert!(
        !layout_differences(&shared_source(), &records).is_empty(),
        "a record dropped in Rust"
    );
}

/// The shared files with one place changed.
fn edited(source: &Source, from: &str, to: &str) -> Source {
    let mut result = Source::default();
    for file in wgray::gpu::compose::SHARED {
        result.append(file, &sources::shaders().text(file).replacen(from, to, 1));
    }
    assert_ne!(result.text, source.text);
    result
}

/// A constant's value: bits of an f32, or a whole number; a list where it is an array.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Float(u32),
    Whole(u32),
    List(Vec<Value>),
}

fn wgsl_constants(source: &Source) -> BTreeMap<String, Value> {
    let module = parse(source);
    let of_file = module.constants.iter().filter(|(handle, constant)| {
        constant.name.is_some() && file_of(source, module.constants.get_span(*handle)) == CONSTANTS
    });
    of_file
        .map(|(_, c)| (c.name.clone().unwrap_or_default(), wgsl_value(&module, c.init)))
        .collect()
}

fn wgsl_value(module: &Module, handle: naga::Handle<Expression>) -> Value {
    match &module.global_expressions[handle] {
        Expression::Literal(Literal::F32(x)) => Value::Float(x.to_bits()),
        Expression::Literal(Literal::U32(n)) => Value::Whole(*n),
        Expression::Constant(constant) => wgsl_value(module, module.constants[*constant].init),
        Expression::Compose { components, .. } => {
            Value::List(components.iter().map(|c| wgsl_value(module, *c)).collect())
        }
        other => panic!("a shared constant is a number, not {other:?}"),
    }
}

fn rust_constants(file: &syn::File) -> BTreeMap<String, Value> {
    let mut values = BTreeMap::new();
    for item in &file.items {
        let Item::Const(constant) = item else { continue };
        let name = constant.ident.to_string();
        if matches!(constant.vis, Visibility::Public(_)) {
            let float = matches!(&*constant.ty, syn::Type::Path(path) if path.path.is_ident("f32"));
            values.insert(name, rust_value(&constant.expr, float));
        }
    }
    values
}

fn rust_value(expression: &Expr, float: bool) -> Value {
    let text = || format!("cannot tell the value of {expression:?}: teach tests/layout.rs");
    match expression {
        Expr::Array(list) => Value::List(list.elems.iter().map(|e| rust_value(e, float)).collect()),
        _ if float => Value::Float((number(expression).unwrap_or_else(|| panic!("{}", text())) as f32).to_bits()),
        _ => Value::Whole(number(expression).unwrap_or_else(|| panic!("{}", text())) as u32),
    }
}

fn number(expression: &Expr) -> Option<f64> {
    match expression {
        Expr::Lit(literal) => match &literal.lit {
            Lit::Int(n) => n.base10_parse().ok(),
            Lit::Float(x) => x.base10_parse().ok(),
            _ => None,
        },
        Expr::Path(path) => {
            let names: Vec<String> = path.path.segments.iter().map(|s| s.ident.to_string()).collect();
            match names.join("::").as_str() {
                "u32::MAX" => Some(f64::from(u32::MAX)),
                "f32::MAX" => Some(f64::from(f32::MAX)),
                _ => None,
            }
        }
        Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => Some(-number(&unary.expr)?),
        Expr::Binary(binary) => {
            let (a, b) = (number(&binary.left)?, number(&binary.right)?);
            match binary.op {
                BinOp::Add(_) => Some(a + b),
                BinOp::Sub(_) => Some(a - b),
                BinOp::Mul(_) => Some(a * b),
                BinOp::Shl(_) => Some(a * b.exp2()),
                _ => None,
            }
        }
        Expr::Paren(inner) => number(&inner.expr),
        _ => None,
    }
}

#[test]
fn constants_are_the_same() {
    let (wgsl, rust) = (
        wgsl_constants(&shared_source()),
        rust_constants(&sources::rust("src/pack/constants.rs")),
    );
    assert!(wgsl.len() >= 13, "the constants were not found");
    assert_eq!(wgsl, rust);
}

#[test]
fn a_changed_constant_is_found() {
    let rust = rust_constants(&sources::rust("src/pack/constants.rs"));
    for (from, to) in [
        ("const PLANE: u32 = 3u;", "const PLANE: u32 = 4u;"),
        ("const PLANE: u32 = 3u;", ""),
        ("3.4028234663852886e38", "3.4028232635611926e38"),
        (
            "const BLOCK: u32 = 32u;",
            "const BLOCK: u32 = 32u;\nconst OTHER: u32 = 1u;",
        ),
    ] {
        let source = without_users(from, to);
        assert_ne!(wgsl_constants(&source), rust, "'{to}' in place of '{from}'");
    }
}

/// The file of constants alone, changed: nothing is there that misses a constant.
fn without_users(from: &str, to: &str) -> Source {
    let text = sources::shaders().text(CONSTANTS);
    assert!(text.contains(from), "'{from}' is not there to be changed");
    let mut source = Source::default();
    source.append(CONSTANTS, &text.replacen(from, to, 1));
    source
}

/// What is wrong with a kernel's overrides, if its host gives them these values.
fn override_differences(source: &Source, given: &[&str]) -> Vec<String> {
    let module = parse(source);
    let mut problems = Vec::new();
    let mut declared = Vec::new();
    for (_, constant) in module.overrides.iter() {
        let name = constant.name.clone().unwrap_or_default();
        if sources::type_name(&module, constant.ty) != "u32" || constant.init.is_some() || constant.id.is_some() {
            problems.push(format!("{name} must be a u32 without a value or number of its own"));
        }
        declared.push(name);
    }
    if declared != given {
        problems.push(format!("WGSL has {declared:?}, Rust {given:?}"));
    }
    problems
}

#[test]
fn overrides_are_the_fields_of_the_specialization() {
    let constants = Specialization::default().constants();
    let names: Vec<&str> = constants.iter().map(|(name, _)| *name).collect();
    for kernel in sources::KERNELS {
        let source = sources::shaders().compose(kernel, None);
        assert_eq!(override_differences(&source, &names), Vec::<String>::new());
        // negative controls
        assert!(
            !override_differences(&source, &names[1..]).is_empty(),
            "one that Rust lacks"
        );
        let more: Vec<&str> = names.iter().copied().chain(["MORE"]).collect();
        assert!(!override_differences(&source, &more).is_empty(), "one that WGSL lacks");
    }
    let upper = |field: &str| field.to_uppercase();
    let debug = format!("{:?}", Specialization::default());
    for name in names {
        let field = debug
            .split(|c: char| !c.is_alphanumeric() && c != '_')
            .any(|field| upper(field) == name);
        assert!(field, "{name} is the upper case of a field's name");
    }
}

#[test]
fn every_shader_file_is_in_the_program() {
    let mut found = Vec::new();
    for folder in ["", "kernels/"] {
        for entry in std::fs::read_dir(sources::path("shaders").join(folder)).expect("the shaders") {
            let name = entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("a plain name");
            if name.ends_with(".wgsl") {
                found.push(format!("{folder}{name}"));
            }
        }
    }
    found.sort();
    let mut built_in: Vec<&str> = wgray::gpu::compose::BUILT_IN.iter().map(|(name, _)| *name).collect();
    built_in.sort_unstable();
    assert_eq!(found, built_in);
}
