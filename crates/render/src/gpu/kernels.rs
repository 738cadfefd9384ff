//! The kernels of a scene: everything that their source and bindings depend on.

use super::bake::bake_if_small;
use super::compose::{Kernel, Shaders};
use super::device::Device;
use super::pipeline::{bind_group_layouts, pipeline};
use super::rounding::Rounding;
use super::sliders::{Slider, with_buffer};
use super::texels::TexelParts;
use crate::error::RenderError;
use wgray_scene::Integrator;
use wgray_trace::records::{Packed, Specialization};

/// Compilation options of kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// SPIR-V that is executed as written, with this rounding of quotients and square roots. `None` lets wgpu compile
    /// the WGSL.
    pub exact: Option<Rounding>,
    /// Embeds a small scene in the kernel as constants.
    pub baked: bool,
}

impl Options {
    /// Returns the fastest options for a device.
    pub fn best(device: &Device) -> Options {
        Options {
            exact: device.info.exact.then_some(Rounding::Device),
            baked: device.info.is_software(),
        }
    }
}

/// The kernels of a scene.
pub struct Kernels {
    shaders: Shaders,
    integrator: Integrator,
    /// The scene as constants; `None` if the kernels read it from buffers.
    baked: Option<String>,
    constants: Specialization,
    /// Layouts of the bind groups.
    pub layouts: Vec<wgpu::BindGroupLayout>,
    /// See [`Options::exact`].
    pub exact: Option<Rounding>,
    texels: TexelParts,
    /// Overrides that are read from a buffer.
    pub sliders: Vec<Slider>,
}

impl Kernels {
    /// Describes the kernels of a scene, without compiling one.
    pub fn new(
        device: &Device,
        packed: &Packed,
        texels: TexelParts,
        shaders: &Shaders,
        options: Options,
        sliders: Vec<Slider>,
    ) -> Kernels {
        Kernels {
            shaders: shaders.clone(),
            integrator: packed.integrator,
            baked: options.baked.then(|| bake_if_small(packed)).flatten(),
            constants: packed.specialization,
            layouts: bind_group_layouts(device, texels.count - 1, !sliders.is_empty()),
            exact: options.exact,
            texels,
            sliders,
        }
    }

    /// Returns true if the scene is embedded in the kernels.
    pub fn is_baked(&self) -> bool {
        self.baked.is_some()
    }

    /// Returns true if the kernels can also render another scene.
    pub fn suit(&self, packed: &Packed, texels: TexelParts) -> bool {
        self.baked.is_none()
            && self.constants == packed.specialization
            && (self.integrator, self.texels) == (packed.integrator, texels)
    }

    /// Compiles a kernel.
    ///
    /// # Errors
    ///
    /// The source is invalid, or the device reports an error.
    pub fn compile(&self, device: &Device, kernel: &Kernel) -> Result<wgpu::ComputePipeline, RenderError> {
        let texels = self.texels.wgsl();
        let (baked, texels) = (self.baked.as_deref(), texels.as_deref());
        let source = self.shaders.compose_with_texels(kernel, self.integrator, baked, texels);
        let source = with_buffer(source, kernel, &self.sliders)?;
        pipeline(device, &self.layouts, kernel, &source, &self.constants, self.exact)
    }
}
