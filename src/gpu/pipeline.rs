//! Pipelines: a kernel, compiled for a scene, as a device runs it.

use std::borrow::Cow;

use wgpu::{BindingType, BufferBindingType};

use super::compile::check;
use super::compose::{Kernel, Source};
use super::device::Device;
use super::rounding::Rounding;
use crate::error::RenderError;
use crate::pack::Specialization;

/// Side of a workgroup, as the kernels declare it.
pub const WORKGROUP: u32 = 8;

const UNIFORM: BufferBindingType = BufferBindingType::Uniform;
const READ: BufferBindingType = BufferBindingType::Storage { read_only: true };
const WRITE: BufferBindingType = BufferBindingType::Storage { read_only: false };

/// How the buffers of `shaders/bindings.wgsl` are bound: what the kernel writes, and its receipt, are the last.
pub const BINDINGS: [BufferBindingType; 12] = [
    UNIFORM, UNIFORM, UNIFORM, READ, READ, READ, READ, READ, READ, UNIFORM, WRITE, WRITE,
];

/// How many of them are storage buffers.
pub const STORAGE_BUFFERS: usize = {
    let (mut count, mut i) = (0, 0);
    while i < BINDINGS.len() {
        if !matches!(BINDINGS[i], BufferBindingType::Uniform) {
            count += 1;
        }
        i += 1;
    }
    count
};

/// The bindings of every kernel, and behind them those of so many further buffers of texels.
pub fn bind_group_layout(device: &Device, more_texels: usize) -> wgpu::BindGroupLayout {
    let more = std::iter::repeat_n(READ, more_texels);
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(BINDINGS.into_iter().chain(more))
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
    device
        .device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &entries,
        })
}

/// Compiles a kernel: to SPIR-V that is computed as written (`exact`), or as plain WGSL through wgpu. naga checks it
/// on either way, so that messages are the same.
pub fn pipeline(
    device: &Device,
    layout: &wgpu::BindGroupLayout,
    kernel: Kernel,
    source: &Source,
    constants: &Specialization,
    exact: Option<Rounding>,
) -> Result<wgpu::ComputePipeline, RenderError> {
    let checked = check(source)?;
    let exact = exact
        .map(|rounding| checked.exact_spirv(kernel, constants, rounding, device.info.float_controls))
        .transpose()?;
    let constants = constants.constants();
    let mut constants: Vec<(&str, f64)> = constants.iter().map(|(name, v)| (*name, f64::from(*v))).collect();
    device.checked(|| {
        let module = match exact {
            Some(spirv) => {
                constants.clear(); // resolved already
                let descriptor = wgpu::ShaderModuleDescriptorPassthrough {
                    entry_points: Cow::Owned(vec![wgpu::PassthroughShaderEntryPoint {
                        name: Cow::Borrowed(kernel.entry_point()),
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
        let pipeline_layout = device.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        });
        device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(kernel.entry_point()),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        })
    })
}
