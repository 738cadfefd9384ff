//! Compute pipelines: kernels compiled for a scene.

use std::borrow::Cow;

use wgpu::{BindingType, BufferBindingType};

use super::compile::check;
use super::compose::{Kernel, Source};
use super::device::Device;
use super::pipeline_cache::Key;
use super::rounding::Rounding;
use crate::error::RenderError;
use wgray_trace::records::Specialization;

/// Side of a workgroup; the kernels declare the same size.
pub const WORKGROUP: u32 = 8;

const UNIFORM: BufferBindingType = BufferBindingType::Uniform;
const READ: BufferBindingType = BufferBindingType::Storage { read_only: true };
const WRITE: BufferBindingType = BufferBindingType::Storage { read_only: false };

/// Types of the bindings in `shaders/bindings.wgsl`, by bind group: dispatch, scene, and shapes of the scene.
pub const GROUPS: [&[BufferBindingType]; 3] = [
    &[UNIFORM, WRITE, WRITE],
    &[UNIFORM, UNIFORM, UNIFORM, UNIFORM, READ, READ],
    &[READ, READ, READ, READ],
];

/// Index of the bind group of the dispatch. The buffer of slider values, if any, follows the bindings in [`GROUPS`].
pub const DISPATCH_GROUP: usize = 0;
/// Index of the bind group of the scene. Further texel buffers, if any, follow the bindings in [`GROUPS`].
pub const SCENE_GROUP: usize = 1;

/// Number of storage buffers, not counting further texel buffers.
pub const STORAGE_BUFFERS: usize = {
    let (mut count, mut group) = (0, 0);
    while group < GROUPS.len() {
        let mut i = 0;
        while i < GROUPS[group].len() {
            if !matches!(GROUPS[group][i], BufferBindingType::Uniform) {
                count += 1;
            }
            i += 1;
        }
        group += 1;
    }
    count
};

/// WebGPU guarantees 8 storage buffers per shader stage by default.
const _: () = assert!(STORAGE_BUFFERS <= 8);

/// Returns the bind group layouts of all kernels, with `more_texels` further texel buffers and, if `sliders` is true, a
/// buffer of slider values.
pub fn bind_group_layouts(device: &Device, more_texels: usize, sliders: bool) -> Vec<wgpu::BindGroupLayout> {
    let layout = |(group, types): (usize, &&[BufferBindingType])| {
        let added = match group {
            DISPATCH_GROUP => std::iter::repeat_n(UNIFORM, usize::from(sliders)),
            SCENE_GROUP => std::iter::repeat_n(READ, more_texels),
            _ => std::iter::repeat_n(READ, 0),
        };
        layout_of(device, types.iter().copied().chain(added))
    };
    GROUPS.iter().enumerate().map(layout).collect()
}

/// Returns the layout of a bind group with buffers of these types, in binding order.
pub fn layout_of(device: &Device, types: impl IntoIterator<Item = BufferBindingType>) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(types)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &entries,
    };
    device.device.create_bind_group_layout(&descriptor)
}

/// Creates a bind group of buffers, which are in binding order.
pub fn bind_group(device: &Device, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        })
        .collect();
    device.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout,
        entries: &entries,
    })
}

/// Compiles a kernel: with `exact` to SPIR-V that is executed as written, else from WGSL by wgpu. naga validates the
/// source first in both cases, so that error messages do not depend on `exact`. Pipelines in the device's cache are
/// returned immediately.
pub fn pipeline(
    device: &Device,
    layouts: &[wgpu::BindGroupLayout],
    kernel: &Kernel,
    source: &Source,
    constants: &Specialization,
    exact: Option<Rounding>,
) -> Result<wgpu::ComputePipeline, RenderError> {
    let key = Key::new(kernel, source, constants, exact);
    if let Some(pipeline) = device.pipelines.get(key) {
        return Ok(pipeline);
    }
    let _span = tracing::debug_span!("compile").entered();
    let checked = check(source)?;
    let exact = exact
        .map(|rounding| checked.exact_spirv(kernel, constants, rounding, device.info.float_controls))
        .transpose()?;
    let constants = constants.constants();
    let mut constants: Vec<(&str, f64)> = constants.iter().map(|(name, v)| (*name, f64::from(*v))).collect();
    let pipeline = device.checked(|| {
        let module = match exact {
            Some(spirv) => {
                constants.clear(); // already resolved in the SPIR-V
                let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
                    entry_points: Cow::Owned(vec![wgpu::PassthroughShaderEntryPoint {
                        name: Cow::Borrowed(kernel.entry_point),
                        workgroup_size: (WORKGROUP, WORKGROUP, 1),
                    }]),
                    spirv: Some(Cow::Owned(spirv)),
                    ..Default::default()
                };
                // SAFETY: naga wrote this SPIR-V, with bounds checks, from a module that it validated.
                unsafe { device.device.create_shader_module_passthrough(descriptor) }
            }
            None => device.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(&source.text)),
            }),
        };
        let layouts: Vec<_> = layouts.iter().map(Some).collect();
        let pipeline_layout = device.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(kernel.entry_point),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        })
    })?;
    device.pipelines.add(key, &pipeline);
    Ok(pipeline)
}
