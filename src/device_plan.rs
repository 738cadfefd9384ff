//! Determines the device that a render would use, without opening the device.

#[cfg(feature = "gpu")]
use wgray_render::gpu;
use wgray_render::records::Packed;

use crate::context::Context;
use crate::device::{Device, DeviceInfo};
use crate::device_cost::{Workload, faster_on_cpu};
use crate::error::RenderError;
#[cfg(feature = "gpu")]
use crate::open::choice_of;
#[cfg(not(feature = "gpu"))]
use crate::open::gpu_missing;

/// The device of a render, and the reason for its choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DevicePlan {
    pub info: DeviceInfo,
    pub reason: String,
    /// `None` for the CPU.
    #[cfg(feature = "gpu")]
    pub adapter: Option<(gpu::GpuInfo, gpu::KernelPlan)>,
}

/// Returns the device that a render of the full image would use. If this device cannot be opened or has too little memory, a render falls
/// back to the next device or to the CPU.
///
/// # Errors
///
/// [`RenderError::NoDevice`] if no device matches the request.
pub fn plan_device(scene: &Packed, device: &Device) -> Result<DevicePlan, RenderError> {
    let on_cpu = |reason: String| DevicePlan {
        info: DeviceInfo::cpu(),
        reason,
        #[cfg(feature = "gpu")]
        adapter: None,
    };
    match device {
        Device::Cpu => return Ok(on_cpu("requested".to_owned())),
        Device::Auto if !cfg!(feature = "gpu") => {
            return Ok(on_cpu("this build has no GPU support (feature \"gpu\")".to_owned()));
        }
        Device::Auto => {
            if let Some(reason) = faster_on_cpu(&Context::new(), scene, Workload::image(scene)) {
                return Ok(on_cpu(reason));
            }
        }
        _ => {}
    }
    match preferred(scene, device) {
        Err(RenderError::NoDevice(reason)) if *device == Device::Auto => Ok(on_cpu(reason.to_string())),
        other => other,
    }
}

#[cfg(feature = "gpu")]
fn preferred(scene: &Packed, device: &Device) -> Result<DevicePlan, RenderError> {
    let info = gpu::preferred(&choice_of(device))?;
    let reason = match (device, info.is_software()) {
        (Device::Named(_), _) => "requested",
        (_, true) => "no hardware GPU found, and software Vulkan is faster than the CPU for this scene",
        _ => "the first hardware GPU",
    };
    let reason = match device {
        Device::Gpu if info.is_software() => "no hardware GPU found",
        _ => reason,
    };
    let kernel = gpu::plan_kernel(scene, &info);
    Ok(DevicePlan {
        info: DeviceInfo::from(&info),
        reason: reason.to_owned(),
        adapter: Some((info, kernel)),
    })
}

#[cfg(not(feature = "gpu"))]
fn preferred(_: &Packed, device: &Device) -> Result<DevicePlan, RenderError> {
    Err(gpu_missing(device))
}
