//! Compute kernels for single shader functions, compiled like the renderer's kernels and run over a list of inputs.

use std::fmt::Write as _;

use wgray_render::gpu::compose::Source;
use wgray_render::gpu::naga;
use wgray_render::gpu::naga::{Handle, Module, ScalarKind, Type, TypeInner};
use wgray_render::gpu::wgpu;
use wgray_render::gpu::wgpu::util::DeviceExt;
use wgray_render::gpu::{Device, Rounding, check};

use crate::sources::{file_of, shared_source, type_name};

/// Returns the scalar kinds of the components of a type.
pub fn scalars(module: &Module, ty: Handle<Type>) -> Vec<ScalarKind> {
    match &module.types[ty].inner {
        TypeInner::Scalar(s) => vec![s.kind],
        TypeInner::Vector { size, scalar } => vec![scalar.kind; *size as usize],
        TypeInner::Struct { members, .. } => members.iter().flat_map(|m| scalars(module, m.ty)).collect(),
        TypeInner::Array {
            base,
            size: naga::ArraySize::Constant(n),
            ..
        } => scalars(module, *base).repeat(n.get() as usize),
        other => panic!("no kernel can be generated for a function with the type {other:?}"),
    }
}

pub struct Function<'a> {
    pub module: &'a Module,
    pub function: &'a naga::Function,
}

/// Returns the functions of the shared files, each with the name of its file.
pub fn functions<'a>(module: &'a Module, source: &Source) -> Vec<(String, Function<'a>)> {
    let with_file = |(handle, function)| {
        (
            file_of(source, module.functions.get_span(handle)),
            Function { module, function },
        )
    };
    module.functions.iter().map(with_file).collect()
}

impl Function<'_> {
    pub fn name(&self) -> &str {
        self.function.name.as_deref().expect("a shared function has a name")
    }

    pub fn arguments(&self) -> Vec<(String, Handle<Type>)> {
        self.function
            .arguments
            .iter()
            .map(|a| (a.name.clone().unwrap_or_default(), a.ty))
            .collect()
    }

    pub fn result(&self) -> Handle<Type> {
        self.function
            .result
            .as_ref()
            .expect("a shared function has a result")
            .ty
    }

    pub fn words_in(&self) -> usize {
        self.arguments()
            .iter()
            .map(|(_, ty)| scalars(self.module, *ty).len())
            .sum()
    }

    pub fn words_out(&self) -> Vec<ScalarKind> {
        scalars(self.module, self.result())
    }

    /// Returns a kernel that reads the arguments of call `id.x` from `probe_in` and writes the result to `probe_out`.
    pub fn kernel(&self) -> String {
        let mut text = "@group(0) @binding(0) var<storage, read> probe_in: array<u32>;\n\
                        @group(0) @binding(1) var<storage, read_write> probe_out: array<u32>;\n\
                        @compute @workgroup_size(64)\n\
                        fn probe(@builtin(global_invocation_id) id: vec3u) {\n"
            .to_string();
        let (words_in, words_out) = (self.words_in(), self.words_out().len());
        let _ = writeln!(
            text,
            "    let i = id.x * {words_in}u;\n    let o = id.x * {words_out}u;"
        );
        let _ = writeln!(text, "    if i >= arrayLength(&probe_in) {{ return; }}");
        let mut next = 0;
        let arguments: Vec<String> = self
            .arguments()
            .iter()
            .map(|(_, ty)| self.read(*ty, &mut next))
            .collect();
        let _ = writeln!(text, "    let result = {}({});", self.name(), arguments.join(", "));
        self.write(self.result(), "result", &mut 0, &mut text);
        text.push_str("}\n");
        text
    }

    /// Returns an expression that reads a value of a type from `probe_in`, starting at word `next`.
    fn read(&self, ty: Handle<Type>, next: &mut u32) -> String {
        let list = |components: Vec<String>| format!("{}({})", type_name(self.module, ty), components.join(", "));
        match &self.module.types[ty].inner {
            TypeInner::Scalar(s) => read_word(s.kind, next),
            TypeInner::Vector { size, scalar } => {
                list((0..*size as u8).map(|_| read_word(scalar.kind, next)).collect())
            }
            TypeInner::Struct { members, .. } => list(members.iter().map(|m| self.read(m.ty, next)).collect()),
            TypeInner::Array {
                base,
                size: naga::ArraySize::Constant(n),
                ..
            } => list((0..n.get()).map(|_| self.read(*base, next)).collect()),
            other => panic!("no kernel can be generated for an argument of type {other:?}"),
        }
    }

    fn write(&self, ty: Handle<Type>, value: &str, next: &mut u32, text: &mut String) {
        match &self.module.types[ty].inner {
            TypeInner::Scalar(s) => write_word(s.kind, value, next, text),
            TypeInner::Vector { size, scalar } => {
                for component in 0..*size as u8 {
                    write_word(scalar.kind, &format!("{value}[{component}]"), next, text);
                }
            }
            TypeInner::Struct { members, .. } => {
                for member in members {
                    let field = member.name.as_deref().expect("a field has a name");
                    self.write(member.ty, &format!("{value}.{field}"), next, text);
                }
            }
            TypeInner::Array {
                base,
                size: naga::ArraySize::Constant(n),
                ..
            } => {
                for i in 0..n.get() {
                    self.write(*base, &format!("{value}[{i}]"), next, text);
                }
            }
            other => panic!("no kernel can be generated for a result of type {other:?}"),
        }
    }

    pub fn run(&self, device: &Device, words: &[u32]) -> Vec<u32> {
        self.run_in(device, &shared_source(), words)
    }

    /// Like [`Function::run`], but with other shared files.
    pub fn run_in(&self, device: &Device, shared: &Source, words: &[u32]) -> Vec<u32> {
        self.run_rounded(device, shared, words, Rounding::Device)
    }

    /// Like [`Function::run_in`], but `rounding` selects software or device division and square roots.
    pub fn run_rounded(&self, device: &Device, shared: &Source, words: &[u32], rounding: Rounding) -> Vec<u32> {
        let mut source = shared.clone();
        source.append("probe", &self.kernel());
        let call_count = words.len() / self.words_in();
        run(
            device,
            &source,
            rounding,
            words,
            call_count,
            call_count * self.words_out().len(),
        )
    }
}

fn read_word(kind: ScalarKind, next: &mut u32) -> String {
    let word = format!("probe_in[i + {next}u]");
    *next += 1;
    match kind {
        ScalarKind::Float => format!("bitcast<f32>({word})"),
        ScalarKind::Sint => format!("bitcast<i32>({word})"),
        ScalarKind::Bool => format!("({word} != 0u)"),
        _ => word,
    }
}

fn write_word(kind: ScalarKind, value: &str, next: &mut u32, text: &mut String) {
    let word = match kind {
        ScalarKind::Uint => value.to_string(),
        ScalarKind::Bool => format!("select(0u, 1u, {value})"),
        _ => format!("bitcast<u32>({value})"),
    };
    let _ = writeln!(text, "    probe_out[o + {next}u] = {word};");
    *next += 1;
}

/// Runs the entry point `probe`. On exact devices, the kernel is compiled to SPIR-V, like the kernels of the renderer.
fn run(
    device: &Device,
    source: &Source,
    rounding: Rounding,
    input_words: &[u32],
    calls: usize,
    output_words: usize,
) -> Vec<u32> {
    let (wgpu, queue) = device.wgpu();
    let checked =
        check(source).unwrap_or_else(|error| panic!("{error}\n{}", error.excerpt.clone().unwrap_or_default()));
    let module = if device.info.exact {
        let spirv = checked
            .exact_entry("probe", &[], rounding, device.info.float_controls)
            .expect("SPIR-V of a kernel that naga accepts");
        let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
            entry_points: vec![wgpu::PassthroughShaderEntryPoint {
                name: "probe".into(),
                workgroup_size: (64, 1, 1),
            }]
            .into(),
            spirv: Some(spirv.into()),
            ..Default::default()
        };
        // SAFETY: naga wrote this SPIR-V, with bounds checks, from a module that it validated.
        unsafe { wgpu.create_shader_module_passthrough(descriptor) }
    } else {
        let source = wgpu::ShaderSource::Wgsl(source.text.as_str().into());
        wgpu.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source })
    };
    let storage_entry = |binding, read_only| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let layout = wgpu.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[storage_entry(0, true), storage_entry(1, false)],
    });
    let pipeline_layout = wgpu.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = wgpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("probe"),
        compilation_options: Default::default(),
        cache: None,
    });
    let input_buffer = wgpu.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(input_words),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let buffer = |usage| wgpu::BufferDescriptor {
        label: None,
        size: output_words as u64 * 4,
        usage,
        mapped_at_creation: false,
    };
    let output_buffer = wgpu.create_buffer(&buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC));
    let staging = wgpu.create_buffer(&buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ));
    let group = wgpu.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: input_buffer.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: output_buffer.as_entire_binding(),
            },
        ],
    });
    let mut encoder = wgpu.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(calls.div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output_buffer, 0, &staging, 0, staging.size());
    queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |result| {
        result.expect("a buffer that can be mapped")
    });
    wgpu.poll(wgpu::PollType::wait_indefinitely())
        .expect("the end of the kernel");
    let view = staging.get_mapped_range(..).expect("a mapped buffer");
    bytemuck::pod_collect_to_vec(&view)
}
