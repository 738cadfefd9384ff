//! All kernels of a scene, checked without a device.

use super::bake::bake_if_small;
use super::compile::check;
use super::compose::{Kernel, Shaders};
use super::rounding::Rounding;
use crate::error::ShaderError;
use crate::pack::Packed;

/// Compiles every kernel for a scene, to SPIR-V, as far as that goes without a driver: with the scene in buffers and, if
/// it is small enough, as constants.
pub fn check_kernels(packed: &Packed, shaders: &Shaders) -> Result<(), ShaderError> {
    let baked = bake_if_small(packed);
    for kernel in [Kernel::Render, Kernel::Aov] {
        for scene in [None, baked.as_deref()]
            .into_iter()
            .take(1 + usize::from(baked.is_some()))
        {
            check(&shaders.compose(kernel, scene))?.exact_spirv(kernel, &packed.specialization, Rounding::Device)?;
        }
    }
    Ok(())
}
