//! Records, constants and overrides of `crates/trace/src/records/`, compared with the WGSL that naga parses.

use wgray_render::gpu::compose::{KERNELS, Source, built_in};
use wgray_render::gpu::naga::proc::Layouter;
use wgray_render::gpu::naga::{Expression, Literal, Module, TypeInner};
use wgray_trace::records::{
    BvhItem, Camera, Counts, DenoiseParams, DispatchParams, Emitter, Environment, FirstHit, Instance, Light, LightNode,
    Lookup, Material, Node, Primitive, Record, Specialization, Sphere, Texture,
};

use wgray::scene::Integrator;

use crate::sources::{self, parse, shared_source};

fn name_and_size<R: Record>() -> (&'static str, u32) {
    (R::NAME, size_of::<R>() as u32)
}

/// Returns the errors in the WGSL layout of a record (WGSL, section 14.4.1); `bytemuck::Pod` proves that the Rust
/// struct has no padding.
fn layout_problems(module: &Module, (name, bytes): (&str, u32)) -> Vec<String> {
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let Some((_, ty)) = found else {
        return vec![format!("{name} is not in WGSL")];
    };
    let TypeInner::Struct { members, span } = &ty.inner else {
        return vec![format!("{name} is not a struct")];
    };
    let mut layouter = Layouter::default();
    layouter.update(module.to_ctx()).expect("layouts");
    let (mut problems, mut offset) = (Vec::new(), 0);
    for member in members {
        if member.offset != offset {
            problems.push(format!(
                "{name}.{:?} is at byte {}, not {offset}",
                member.name, member.offset
            ));
        }
        offset = member.offset + layouter[member.ty].size;
    }
    if (offset, *span) != (bytes, bytes) {
        problems.push(format!(
            "{name} ends at byte {offset} and has a size of {span} bytes in WGSL, {bytes} bytes in Rust"
        ));
    }
    problems
}

#[test]
fn records_have_the_same_layout_in_wgsl_and_rust() {
    let module = parse(&shared_source());
    let records = [
        name_and_size::<Camera>(),
        name_and_size::<Environment>(),
        name_and_size::<Primitive>(),
        name_and_size::<Sphere>(),
        name_and_size::<Material>(),
        name_and_size::<Lookup>(),
        name_and_size::<Texture>(),
        name_and_size::<Light>(),
        name_and_size::<Emitter>(),
        name_and_size::<LightNode>(),
        name_and_size::<Counts>(),
        name_and_size::<Node>(),
        name_and_size::<BvhItem>(),
        name_and_size::<Instance>(),
        name_and_size::<FirstHit>(),
        name_and_size::<DispatchParams>(),
        name_and_size::<DenoiseParams>(),
    ];
    let declared = wgray_trace::records::declarations().matches("struct ").count();
    assert_eq!(records.len(), declared, "some records are not compared");
    for record in records {
        assert_eq!(layout_problems(&module, record), Vec::<String>::new());
    }
}

#[test]
fn a_record_with_padding_is_detected() {
    for text in [
        "struct Odd { a: f32, b: vec3f, c: f32 }",
        "struct Odd { a: vec3f, b: u32, c: vec2u }",
        "struct Odd { a: vec4f }",
        "struct Other { a: vec3f, b: u32, c: u32 }",
    ] {
        let mut source = Source::default();
        source.append("odd.wgsl", text);
        assert!(!layout_problems(&parse(&source), ("Odd", 20)).is_empty(), "{text}");
    }
}

#[test]
fn constants_match_in_wgsl_and_rust() {
    let module = parse(&shared_source());
    let value = |name: &str| {
        let (_, constant) = module
            .constants
            .iter()
            .find(|(_, c)| c.name.as_deref() == Some(name))
            .expect(name);
        match module.global_expressions[constant.init] {
            Expression::Literal(Literal::F32(x)) => x.to_bits(),
            Expression::Literal(Literal::U32(n)) => n,
            ref other => panic!("a shared constant is a number, not {other:?}"),
        }
    };
    assert_eq!(value("INFINITE_T"), f32::MAX.to_bits());
    assert_eq!(
        value("EFFECTIVE_SAMPLES_PER_MULTIPLE"),
        wgray_trace::records::EFFECTIVE_SAMPLES_PER_MULTIPLE.to_bits()
    );
    assert_eq!(value("NO_INDEX"), u32::MAX);
    assert_eq!(value("PLANE"), wgray_trace::records::PLANE);
    assert_eq!(value("FOR_NORMAL"), wgray_trace::records::FOR_NORMAL);
}

#[test]
fn overrides_are_the_fields_of_the_specialization() {
    let constants = Specialization::default().constants();
    let names: Vec<&str> = constants.iter().map(|(name, _)| *name).collect();
    for (kernel, integrator) in KERNELS
        .into_iter()
        .flat_map(|kernel| Integrator::ALL.map(|i| (kernel, i)))
    {
        let module = parse(&sources::shaders().compose(kernel, integrator, None));
        let declared: Vec<_> = module.overrides.iter().filter_map(|(_, o)| o.name.as_deref()).collect();
        assert_eq!(declared, names);
    }
    let debug = format!("{:?}", Specialization::default());
    let fields: Vec<&str> = debug.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    for name in names {
        let field = name.to_lowercase();
        assert!(
            fields.contains(&field.as_str()),
            "{name} is not the upper case of a field's name"
        );
    }
}

#[test]
fn every_shader_file_is_built_in() {
    let mut files = Vec::new();
    for folder in ["", "integrators/", "kernels/"] {
        for entry in std::fs::read_dir(sources::path("shaders").join(folder)).expect("the shaders") {
            let name = entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("a plain name");
            if name.ends_with(".wgsl") {
                files.push(format!("{folder}{name}"));
            }
        }
    }
    files.sort();
    let mut built_in_files: Vec<&str> = built_in().map(|(name, _)| name).collect();
    built_in_files.sort_unstable();
    assert_eq!(files, built_in_files);
}
