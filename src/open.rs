//! Opens the requested device for a scene: the CPU or an adapter.

use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
#[cfg(feature = "gpu")]
use wgray_render::gpu::{self, Gpu, Rounding, compose::Shaders};
use wgray_render::records::Packed;
#[cfg(feature = "gpu")]
use wgray_scene::Problem;

use crate::device::{Device, DeviceInfo};
use crate::error::{Error, RenderError};

pub(crate) type Ready<'a> = (Box<dyn Backend + 'a>, DeviceInfo);

pub(crate) fn cpu(scene: &Packed) -> Ready<'_> {
    (Box::new(Cpu::new(scene)), DeviceInfo::cpu())
}

/// Returns the reason if the CPU is faster than any adapter for this scene; `docs/performance.md` has the measurements.
#[cfg(feature = "gpu")]
pub(crate) fn faster_on_cpu(scene: &Packed) -> Option<String> {
    if scene.specialization.tlas_kinds == 0 {
        return None;
    }
    let adapter = gpu::adapters().into_iter().next()?;
    adapter.is_software().then(|| {
        let name = adapter.name;
        format!("no GPU found, and the CPU traverses the BVH faster than {name}; use --device gpu to override")
    })
}

#[cfg(not(feature = "gpu"))]
pub(crate) fn faster_on_cpu(_: &Packed) -> Option<String> {
    None
}

#[cfg(feature = "gpu")]
pub(crate) fn choice_of(device: &Device) -> gpu::AdapterChoice {
    match device {
        Device::Named(name) => gpu::AdapterChoice::Named(name.clone()),
        Device::Auto => gpu::AdapterChoice::Auto,
        Device::Gpu | Device::Cpu => gpu::AdapterChoice::Gpu,
    }
}

/// Opens the first matching adapter that `wanted` accepts. `wanted` gets the name, and whether the adapter is software.
#[cfg(feature = "gpu")]
pub(crate) fn adapter<'a>(
    scene: &'a Packed,
    device: &Device,
    exact_rounding: bool,
    wanted: &dyn Fn(&str, bool) -> bool,
) -> Result<Ready<'a>, Error> {
    let choice = choice_of(device);
    let wanted = |info: &gpu::GpuInfo| wanted(&info.name, info.is_software());
    let opened = gpu::choose_among(&choice, &wanted).map_err(|error| match device {
        Device::Auto => RenderError::NoDevice(error.to_string()),
        _ => error,
    })?;
    let info = DeviceInfo::from(&opened.info);
    tracing::info!(device = info.name, driver = info.driver, "device open");
    let mut options = gpu::Options::best(&opened);
    if exact_rounding {
        if !opened.info.exact {
            let rule = format!("needs a Vulkan device; {} uses {}", info.name, info.interface);
            return Err(Error::Option(Problem::of("exact_rounding", rule)));
        }
        options.exact = Some(Rounding::Software);
    }
    let gpu = Gpu::new(&opened, scene, &Shaders::built_in(), options)?;
    Ok((Box::new(gpu), info))
}

#[cfg(not(feature = "gpu"))]
pub(crate) fn adapter<'a>(
    _: &'a Packed,
    device: &Device,
    _: bool,
    _: &dyn Fn(&str, bool) -> bool,
) -> Result<Ready<'a>, Error> {
    let asked = match device {
        Device::Named(name) => format!("'{name}'"),
        _ => "a GPU".to_string(),
    };
    Err(Error::Render(RenderError::NoDevice(format!(
        "{asked}: only the CPU is available, because the crate was built without the feature \"gpu\""
    ))))
}
