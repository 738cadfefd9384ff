//! Prediction of the kernel for a scene on a device, without opening the device.

use super::adapter::GpuInfo;
use super::bake::bake_if_small;
use super::compose::{ADAPTIVE, RENDER, Shaders};
use super::scene::bytes_of_scene;
use wgray_trace::records::Packed;

/// The kernel of a scene and its memory use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelPlan {
    /// Entry point.
    pub entry: &'static str,
    /// True if the source contains the scene as constants.
    pub baked: bool,
    /// Number of lines of WGSL.
    pub lines: usize,
    /// Size of the scene's buffers in bytes.
    pub scene_bytes: u64,
}

/// Predicts the kernel that the device of `info` uses for a scene.
pub fn plan_kernel(packed: &Packed, info: &GpuInfo) -> KernelPlan {
    let kernel = if packed.sampling.adaptive { &ADAPTIVE } else { &RENDER };
    let baked = info.is_software().then(|| bake_if_small(packed)).flatten();
    let source = Shaders::built_in().compose(kernel, packed.integrator, baked.as_deref());
    KernelPlan {
        entry: kernel.entry_point,
        baked: baked.is_some(),
        lines: source.text.lines().count(),
        scene_bytes: bytes_of_scene(packed),
    }
}
