//! The shared functions and records, parsed from WGSL by naga and from Rust by syn.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use syn::{FnArg, Generics, Item, Pat, ReturnType, Type};
use wgray_render::gpu::compose::{DENOISE, KERNELS, Shaders, Source, built_in};
use wgray_render::gpu::naga;
use wgray_render::gpu::naga::{ArraySize, Module, ScalarKind, TypeInner};

/// Environment variable with the folder of the shaders to test, set by `scripts/mutation/twins.py`.
const SHADERS: &str = "WGRAY_TEST_SHADERS";

pub fn path(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

pub fn shaders() -> &'static Shaders {
    static SHADERS_UNDER_TEST: OnceLock<Shaders> = OnceLock::new();
    SHADERS_UNDER_TEST.get_or_init(|| match std::env::var_os(SHADERS) {
        Some(folder) => Shaders::read(Path::new(&folder)).expect("the shaders under test"),
        None => Shaders::built_in(),
    })
}

pub fn edited_shaders(file: &str, from: &str, to: &str) -> Shaders {
    shaders_with(file, &edited(shaders().text(file), from, to))
}

/// Replaces the first occurrence of `from`.
pub fn edited(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "'{from}' not found");
    text.replacen(from, to, 1)
}

pub fn shaders_with(file: &str, text: &str) -> Shaders {
    with(shaders(), file, text)
}

pub fn with(shaders: &Shaders, file: &str, text: &str) -> Shaders {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, _) in built_in() {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        let text = if name == file { text } else { shaders.text(name) };
        fs::write(path, text).expect("a copy of a shader");
    }
    Shaders::read(folder.path()).expect("the copies")
}

/// Returns only the shared files. naga accepts these files, so they use no binding and no override.
pub fn shared_source() -> Source {
    shaders().shared()
}

pub fn parse(source: &Source) -> Module {
    naga::front::wgsl::parse_str(&source.text)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string_with_path(&source.text, "composed.wgsl")))
}

pub fn file_of(source: &Source, span: naga::Span) -> String {
    let range = span.to_range().expect("a span for every item");
    source
        .locate(range.start)
        .expect("a span inside of the text")
        .0
        .to_string()
}

/// A name and a WGSL type, such as `vec3<f32>` or `Primitive`.
pub type Named = (String, String);

/// A function or a record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    pub name: String,
    /// Arguments or fields.
    pub members: Vec<Named>,
    pub result: Option<String>,
}

/// Returns the functions in source order.
pub fn wgsl_functions(module: &Module, source: &Source, file: &str) -> Vec<Signature> {
    let mut functions: Vec<(naga::Span, Signature)> = Vec::new();
    for (handle, function) in module.functions.iter() {
        let span = module.functions.get_span(handle);
        if file_of(source, span) == file {
            let argument = |a: &naga::FunctionArgument| (a.name.clone().unwrap_or_default(), type_name(module, a.ty));
            let signature = Signature {
                name: function.name.clone().unwrap_or_default(),
                members: function.arguments.iter().map(argument).collect(),
                result: function.result.as_ref().map(|result| type_name(module, result.ty)),
            };
            functions.push((span, signature));
        }
    }
    functions.sort_by_key(|(span, _)| span.to_range().map(|range| range.start));
    functions.into_iter().map(|(_, signature)| signature).collect()
}

/// Returns the records in source order.
pub fn wgsl_records(module: &Module, source: &Source, file: &str) -> Vec<Signature> {
    let mut records: Vec<(naga::Span, Signature)> = Vec::new();
    for (handle, ty) in module.types.iter() {
        let TypeInner::Struct { members, .. } = &ty.inner else {
            continue;
        };
        let span = module.types.get_span(handle);
        if file_of(source, span) == file {
            let field = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), type_name(module, m.ty));
            let name = ty.name.clone().unwrap_or_default();
            records.push((
                span,
                Signature {
                    name,
                    members: members.iter().map(field).collect(),
                    result: None,
                },
            ));
        }
    }
    records.sort_by_key(|(span, _)| span.to_range().map(|range| range.start));
    records.into_iter().map(|(_, signature)| signature).collect()
}

pub fn type_name(module: &Module, ty: naga::Handle<naga::Type>) -> String {
    let scalar = |scalar: naga::Scalar| match (scalar.kind, scalar.width) {
        (ScalarKind::Float, 4) => "f32",
        (ScalarKind::Uint, 4) => "u32",
        (ScalarKind::Sint, 4) => "i32",
        (ScalarKind::Bool, _) => "bool",
        other => panic!("no shared record or function has a scalar {other:?}"),
    };
    let inner = &module.types[ty];
    match &inner.inner {
        TypeInner::Scalar(s) => scalar(*s).to_string(),
        TypeInner::Vector { size, scalar: s } => format!("vec{}<{}>", *size as u8, scalar(*s)),
        TypeInner::Struct { .. } => inner.name.clone().unwrap_or_default(),
        TypeInner::Array {
            base,
            size: ArraySize::Constant(n),
            ..
        } => format!("array<{}, {n}>", type_name(module, *base)),
        TypeInner::Array { base, .. } => format!("array<{}>", type_name(module, *base)),
        other => format!("{other:?}"),
    }
}

pub fn rust(relative: &str) -> syn::File {
    let path = path(relative);
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns the functions outside of tests and `impl`s. A function that updates an argument in place has the signature
/// of the WGSL function that takes and returns this argument.
pub fn rust_functions(file: &syn::File) -> Vec<Signature> {
    let updated_type = |function: &syn::ItemFn| {
        let arguments = function.sig.inputs.iter();
        let mut exclusive = arguments.filter_map(|input| match input {
            FnArg::Typed(typed) => match &*typed.ty {
                Type::Reference(reference) if reference.mutability.is_some() => {
                    Some(rust_type(&reference.elem, &function.sig.generics))
                }
                _ => None,
            },
            FnArg::Receiver(_) => None,
        });
        exclusive.next()
    };
    let argument = |input: &FnArg, generics: &Generics| match input {
        FnArg::Typed(typed) => match &*typed.pat {
            Pat::Ident(name) => (name.ident.to_string(), rust_type(&typed.ty, generics)),
            other => panic!("a twin's argument has a name, not {other:?}"),
        },
        FnArg::Receiver(_) => unreachable!("a free function"),
    };
    let function = |item: &Item| match item {
        Item::Fn(function) => Some(Signature {
            name: function.sig.ident.to_string(),
            members: function
                .sig
                .inputs
                .iter()
                .map(|input| argument(input, &function.sig.generics))
                .collect(),
            result: match &function.sig.output {
                ReturnType::Default => updated_type(function),
                ReturnType::Type(_, ty) => Some(rust_type(ty, &function.sig.generics)),
            },
        }),
        _ => None,
    };
    file.items.iter().filter_map(function).collect()
}

/// Returns the structs in source order. A type parameter has the type of its default.
pub fn rust_records(file: &syn::File) -> Vec<Signature> {
    let field = |f: &syn::Field, generics: &Generics| {
        (
            f.ident.as_ref().map(|i| i.to_string()).unwrap_or_default(),
            rust_type(&f.ty, generics),
        )
    };
    let record = |item: &Item| match item {
        Item::Struct(s) => Some(Signature {
            name: s.ident.to_string(),
            members: s.fields.iter().map(|f| field(f, &s.generics)).collect(),
            result: None,
        }),
        _ => None,
    };
    file.items.iter().filter_map(record).collect()
}

/// Traits of numbers, vectors and records of one path or of several paths in lanes (`lanes.rs`) and the associated type
/// of conditions, with the WGSL types that they stand for. The associated types `Real` and `Word` have the types of the
/// traits, and other associated types those of glam's vectors with their names.
const NUMBER_TRAITS: &[(&str, &str)] = &[
    ("Real", "f32"),
    ("Word", "u32"),
    ("Vector2", "vec2<f32>"),
    ("Vector3", "vec3<f32>"),
    ("WordVector2", "vec2<u32>"),
    ("WordVector4", "vec4<u32>"),
    ("Vector4", "vec4<f32>"),
    ("Mask", "bool"),
    ("MaterialFields", "Material"),
    ("SurfaceVectors", "Surface"),
    ("LightNodes", "LightNode"),
    ("Children", "vec4<f32>"),
];

/// Returns the WGSL type of a type parameter.
fn parameter_type(name: &str, generics: &Generics) -> Option<String> {
    let parameter = generics.type_params().find(|parameter| parameter.ident == name)?;
    if let Some(default) = &parameter.default {
        return Some(rust_type(default, generics));
    }
    parameter.bounds.iter().find_map(|bound| match bound {
        syn::TypeParamBound::Trait(bound) => wgsl_type_of_trait(&bound.path.segments.last()?.ident.to_string()),
        _ => None,
    })
}

fn wgsl_type_of_trait(name: &str) -> Option<String> {
    let (_, wgsl) = NUMBER_TRAITS.iter().find(|(number, _)| *number == name)?;
    Some(wgsl.to_string())
}

/// Returns the WGSL type. Rust passes records by reference, WGSL by value.
fn rust_type(ty: &Type, generics: &Generics) -> String {
    match ty {
        Type::Reference(reference) => rust_type(&reference.elem, generics),
        Type::Array(array) => {
            let length = match &array.len {
                syn::Expr::Lit(syn::ExprLit {
                    lit: syn::Lit::Int(length),
                    ..
                }) => length.base10_digits().to_string(),
                other => format!("{other:?}"), // matches no WGSL type: a shared array has a literal length
            };
            format!("array<{}, {length}>", rust_type(&array.elem, generics))
        }
        Type::Path(path) => {
            let name = path.path.segments.last().expect("a path has a name").ident.to_string();
            if let Some(wgsl) = parameter_type(&name, generics).or_else(|| wgsl_type_of_trait(&name)) {
                return wgsl;
            }
            let (vector, scalar) = match name.strip_suffix(['2', '3', '4']) {
                Some("Vec") => (true, "f32"),
                Some("UVec") => (true, "u32"),
                Some("IVec") => (true, "i32"),
                _ => (false, ""),
            };
            if vector {
                format!("vec{}<{scalar}>", &name[name.len() - 1..])
            } else {
                name
            }
        }
        other => format!("{other:?}"), // matches no WGSL type
    }
}

/// Returns a message for each difference.
pub fn differences(file: &str, wgsl: &[Signature], rust: &[Signature]) -> Vec<String> {
    let mut problems = Vec::new();
    for w in wgsl {
        match rust.iter().find(|r| r.name == w.name) {
            None => problems.push(format!("{file}: {} is in WGSL, not in Rust", w.name)),
            Some(r) if r != w => problems.push(format!("{file}: {} differs:\n  WGSL {w:?}\n  Rust {r:?}", w.name)),
            Some(_) => {}
        }
    }
    for r in rust.iter().filter(|r| !wgsl.iter().any(|w| w.name == r.name)) {
        problems.push(format!("{file}: {} is in Rust, not in WGSL", r.name));
    }
    if problems.is_empty() && wgsl != rust {
        problems.push(format!("{file}: the order differs"));
    }
    problems
}

#[test]
fn every_kernel_is_tested() {
    for (file, _) in built_in() {
        if file.starts_with("kernels/") {
            assert!(
                KERNELS.iter().chain([&&DENOISE]).any(|kernel| kernel.file() == file),
                "{file} is not in `KERNELS`, and not the denoiser, which tests/denoise.rs tests"
            );
        }
    }
}
