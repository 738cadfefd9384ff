//! What a device would have to do for a scene, known without opening it.

use super::bake::bake_if_small;
use super::compose::{ADAPTIVE, RENDER, Shaders};
use super::device::Info;
use super::scene::bytes_of_scene;
use crate::pack::Packed;

/// The kernel of a scene, and what the scene takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelPlan {
    /// The kernel's entry point.
    pub entry: &'static str,
    /// Whether the scene is written into it as constants.
    pub baked: bool,
    /// Lines of WGSL.
    pub lines: usize,
    /// What the scene's buffers take, in bytes.
    pub scene_bytes: u64,
}

/// Looks ahead.
pub fn plan_kernel(packed: &Packed, info: &Info) -> KernelPlan {
    let kernel = if packed.adaptive { &ADAPTIVE } else { &RENDER };
    let baked = (info.kind == "software").then(|| bake_if_small(packed)).flatten();
    let source = Shaders::built_in().compose(kernel, packed.integrator, baked.as_deref());
    KernelPlan {
        entry: kernel.entry_point,
        baked: baked.is_some(),
        lines: source.text.lines().count(),
        scene_bytes: bytes_of_scene(packed),
    }
}
