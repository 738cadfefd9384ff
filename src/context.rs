//! Open devices, shared by sessions.

#[cfg(feature = "gpu")]
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

#[cfg(feature = "gpu")]
use wgray_render::gpu;

#[cfg(feature = "gpu")]
use crate::device::Device;

/// Keeps devices open, with their compiled kernels, so that later renders need not open a device or compile a kernel
/// again. Clones share the devices.
///
/// A device is opened by the first render that requests it, and closed with the last clone of the context. A lost
/// device is opened again.
#[derive(Clone, Debug, Default)]
pub struct Context {
    #[cfg(feature = "gpu")]
    pub(crate) devices: Arc<OpenDevices>,
}

impl Context {
    /// Returns a context without open devices.
    pub fn new() -> Context {
        Context::default()
    }
}

/// The devices that a context has opened, each with its request.
#[cfg(feature = "gpu")]
#[derive(Default)]
pub(crate) struct OpenDevices {
    opened: Mutex<Vec<(Device, gpu::Device)>>,
    /// The best adapter, determined at the first request.
    best: OnceLock<Option<gpu::GpuInfo>>,
}

#[cfg(feature = "gpu")]
impl std::fmt::Debug for OpenDevices {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        f.debug_list()
            .entries(opened.iter().map(|(_, device)| &device.info.name))
            .finish()
    }
}

#[cfg(feature = "gpu")]
impl OpenDevices {
    pub(crate) fn get(&self, request: &Device) -> Option<gpu::Device> {
        let opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        let found = opened.iter().find(|(opened_request, _)| opened_request == request);
        found.map(|(_, device)| device.clone())
    }

    pub(crate) fn add(&self, request: &Device, device: &gpu::Device) {
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        opened.retain(|(opened_request, _)| opened_request != request);
        opened.push((request.clone(), device.clone()));
    }

    /// Removes a lost device from the context. The device closes when no session uses it.
    pub(crate) fn remove(&self, name: &str) {
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        opened.retain(|(_, device)| device.info.name != name);
    }

    /// Returns the best adapter that existed at the first request; `None` if none did.
    pub(crate) fn best(&self) -> Option<&gpu::GpuInfo> {
        self.best.get_or_init(|| gpu::adapters().into_iter().next()).as_ref()
    }
}
