//! Rendering on GPUs: WGSL kernels, executed by wgpu. Only this module uses wgpu.

mod adapter;
mod bake;
mod compile;
pub mod compose;
mod denoise;
mod device;
mod dispatch;
mod failure;
mod film_rows;
mod float_controls;
mod functions;
mod interface;
mod kernel_plan;
mod kernels;
mod loop_budget;
mod mapping;
mod memory;
mod naga_messages;
mod nesting_limit;
mod pipeline;
mod pipeline_cache;
mod prune;
mod renderer;
mod rounding;
mod scene;
mod shader_error;
pub mod sliders;
pub mod spirv;
mod texels;
mod timer;
mod validate;

pub use adapter::{AdapterChoice, GpuInfo, adapters, is_lavapipe, preferred};
pub use bake::bake;
pub use compile::{ValidKernel, check};
pub use denoise::denoise;
pub use device::{Device, choose, choose_among, choose_among_async};
pub use float_controls::FloatControls;
pub use kernel_plan::{KernelPlan, plan_kernel};
pub use kernels::Options;
pub use renderer::{Dispatch, Gpu};
pub use rounding::Rounding;
pub use validate::{Forms, check_kernels};
// Exported for kernels other than the renderer's.
pub use {naga, wgpu};
