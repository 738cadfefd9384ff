//! Determines the device that a render would use, without opening the device.

#[cfg(feature = "gpu")]
use wgray_render::gpu;
use wgray_trace::records::Packed;

use crate::context::Context;
use crate::device::{Device, DeviceInfo};
use crate::device_cost::{Selection, Workload, select_without_gpu};
use crate::error::RenderError;
#[cfg(feature = "gpu")]
use crate::open::choice_of;
#[cfg(not(feature = "gpu"))]
use crate::open::gpu_missing;
use crate::options::Options;

/// The device of a render, and the reason for its choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DevicePlan {
    pub info: DeviceInfo,
    pub reason: String,
    /// `None` for the CPU.
    #[cfg(feature = "gpu")]
    pub adapter: Option<(gpu::GpuInfo, gpu::KernelPlan)>,
}

/// Returns the device that a render of the full image would use. If this device cannot be opened or has too little
/// memory, a render falls back to the next device or to the CPU.
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
    let mut selection = None;
    match device {
        Device::Cpu => return Ok(on_cpu("requested".to_owned())),
        Device::Auto if !cfg!(feature = "gpu") => {
            return Ok(on_cpu("this build has no GPU support (feature \"gpu\")".to_owned()));
        }
        Device::Auto => {
            let workload = Workload::new(scene, &Options::default(), 1);
            selection = select_without_gpu(&Context::new(), scene, workload);
            if let Some(selection) = selection.take_if(|selection| selection.is_cpu) {
                return Ok(on_cpu(selection.reason));
            }
        }
        _ => {}
    }
    match preferred(scene, device, selection) {
        Err(RenderError::NoDevice(reason)) if *device == Device::Auto => Ok(on_cpu(reason.to_string())),
        other => other,
    }
}

#[cfg(feature = "gpu")]
fn preferred(scene: &Packed, device: &Device, selection: Option<Selection>) -> Result<DevicePlan, RenderError> {
    let info = gpu::preferred(&choice_of(device))?;
    let reason = match (device, selection) {
        (Device::Named(_), _) => "requested".to_owned(),
        (_, Some(selection)) => selection.reason,
        _ if info.is_software() => "no hardware GPU found".to_owned(),
        _ => "the first hardware GPU".to_owned(),
    };
    let kernel = gpu::plan_kernel(scene, &info);
    Ok(DevicePlan {
        info: DeviceInfo::from(&info),
        reason,
        adapter: Some((info, kernel)),
    })
}

#[cfg(not(feature = "gpu"))]
fn preferred(_: &Packed, device: &Device, _: Option<Selection>) -> Result<DevicePlan, RenderError> {
    Err(gpu_missing(device))
}
