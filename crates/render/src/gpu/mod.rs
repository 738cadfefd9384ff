//! The GPU path: kernels in WGSL, run by wgpu. Only this module names wgpu.

mod adapter;
mod bake;
mod compile;
pub mod compose;
mod controls;
mod depth;
mod device;
mod dispatch;
mod failure;
mod functions;
mod interface;
mod kernel_plan;
mod memory;
mod pipeline;
mod place;
mod prune;
mod renderer;
mod rounding;
mod rounds;
mod scene;
pub mod sliders;
pub mod spirv;
mod texels;
mod timer;
mod validate;
mod wording;

pub use adapter::{Choice, Choice as AdapterChoice, HOW_TO_GET_VULKAN, Info, adapters, preferred};
pub use bake::bake;
pub use compile::{Checked, check};
pub use controls::FloatControls;
pub use device::{Device, choose, choose_among};
pub use kernel_plan::{KernelPlan, plan_kernel};
pub use renderer::{Call, Gpu, Options};
pub use rounding::Rounding;
pub use validate::{Forms, check_kernels};
// for kernels other than the renderer's
pub use {naga, wgpu};
