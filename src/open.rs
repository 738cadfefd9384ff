//! Opens the requested device for a scene: the CPU or an adapter.

use std::sync::Arc;

use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
use wgray_render::denoise::denoise;
#[cfg(feature = "gpu")]
use wgray_render::gpu::{self, Gpu, Rounding, compose::Shaders};
#[cfg(feature = "gpu")]
use wgray_scene::Problem;
use wgray_trace::film::Film;
use wgray_trace::records::Packed;

use crate::context::Context;
use crate::device::{Device, DeviceInfo};
use crate::error::{DeviceError, Error, RenderError};

/// Returns true if an adapter may be used. The arguments are the name of the adapter and whether it is software.
pub(crate) type AcceptAdapter<'a> = &'a dyn Fn(&str, bool) -> bool;

/// A scene on the CPU or on an adapter.
pub(crate) enum Engine {
    Cpu(Box<Cpu<Arc<Packed>>>),
    #[cfg(feature = "gpu")]
    Gpu(Box<Gpu>, Arc<Packed>),
}

impl Engine {
    pub(crate) fn cpu(scene: Arc<Packed>) -> Engine {
        Engine::Cpu(Box::new(Cpu::new(scene)))
    }

    pub(crate) fn is_cpu(&self) -> bool {
        matches!(self, Engine::Cpu(_))
    }

    pub(crate) fn backend(&mut self) -> &mut dyn Backend {
        match self {
            Engine::Cpu(cpu) => &mut **cpu,
            #[cfg(feature = "gpu")]
            Engine::Gpu(gpu, _) => &mut **gpu,
        }
    }

    /// Does what the first dispatch would do otherwise.
    pub(crate) fn prepare(&self) {
        match self {
            Engine::Cpu(cpu) => cpu.prepare(),
            #[cfg(feature = "gpu")]
            Engine::Gpu(..) => {}
        }
    }

    /// Denoises a finished film with noise estimates.
    pub(crate) fn denoise(&self, film: &mut Film) -> Result<(), RenderError> {
        film.denoised = match self {
            Engine::Cpu(_) => denoise(film),
            #[cfg(feature = "gpu")]
            Engine::Gpu(gpu, _) => gpu.denoise(film)?,
        };
        Ok(())
    }

    pub(crate) fn scene(&self) -> &Arc<Packed> {
        match self {
            Engine::Cpu(cpu) => cpu.scene(),
            #[cfg(feature = "gpu")]
            Engine::Gpu(_, scene) => scene,
        }
    }

    pub(crate) fn into_scene(self) -> Arc<Packed> {
        match self {
            Engine::Cpu(cpu) => cpu.into_scene(),
            #[cfg(feature = "gpu")]
            Engine::Gpu(_, scene) => scene,
        }
    }

    /// Edits the camera and discards the film. The kernel must stay the same.
    pub(crate) fn edit_camera(&mut self, edit: impl FnOnce(&mut Packed)) -> Result<(), RenderError> {
        match self {
            Engine::Cpu(cpu) => {
                cpu.edit_scene(|scene| edit(Arc::make_mut(scene)));
                Ok(())
            }
            #[cfg(feature = "gpu")]
            Engine::Gpu(gpu, scene) => {
                let scene = Arc::make_mut(scene);
                edit(scene);
                gpu.set_camera(&scene.camera)
            }
        }
    }
}

#[cfg(feature = "gpu")]
pub(crate) fn choice_of(device: &Device) -> gpu::AdapterChoice {
    match device {
        Device::Named(name) => gpu::AdapterChoice::Named(name.clone()),
        Device::Auto => gpu::AdapterChoice::Auto,
        Device::Gpu | Device::Cpu => gpu::AdapterChoice::Gpu,
    }
}

/// Opens the first adapter that matches `device` and that `accept` accepts, and creates an engine for the scene.
/// Without `accept`, uses a device that the context has already opened for this request.
#[cfg(feature = "gpu")]
pub(crate) fn open_adapter(
    context: &Context,
    scene: &Arc<Packed>,
    device: &Device,
    exact_rounding: bool,
    accept: Option<AcceptAdapter>,
) -> Result<(Engine, DeviceInfo), Error> {
    let opened = match accept {
        None => context.devices.get(device),
        Some(_) => None,
    };
    let opened = match opened {
        Some(opened) => opened,
        None => {
            let is_accepted = |info: &gpu::GpuInfo| accept.is_none_or(|accept| accept(&info.name, info.is_software()));
            let opened = gpu::choose_among(&choice_of(device), &is_accepted).map_err(|error| match device {
                Device::Auto => RenderError::NoDevice(DeviceError::NotOpened(error.to_string())),
                _ => error,
            })?;
            context.devices.add(device, &opened);
            tracing::info!(device = opened.info.name, driver = opened.info.driver, "device open");
            opened
        }
    };
    let info = DeviceInfo::from(&opened.info);
    let mut options = gpu::Options::best(&opened);
    if exact_rounding {
        if !opened.info.exact {
            let rule = format!("needs a Vulkan device; {} uses {}", info.name, info.interface);
            return Err(Error::Option(Problem::of("exact_rounding", rule)));
        }
        options.exact = Some(Rounding::Software);
    }
    let gpu = Gpu::new(&opened, scene, &Shaders::built_in(), options)?;
    Ok((Engine::Gpu(Box::new(gpu), Arc::clone(scene)), info))
}

#[cfg(not(feature = "gpu"))]
pub(crate) fn open_adapter(
    _: &Context,
    _: &Arc<Packed>,
    device: &Device,
    _: bool,
    _: Option<AcceptAdapter>,
) -> Result<(Engine, DeviceInfo), Error> {
    Err(Error::Render(gpu_missing(device)))
}

#[cfg(not(feature = "gpu"))]
pub(crate) fn gpu_missing(device: &Device) -> RenderError {
    let requested = match device {
        Device::Named(name) => format!("'{name}'"),
        _ => "a GPU".to_string(),
    };
    RenderError::NoDevice(DeviceError::NotBuilt { requested })
}
