//! The requested device, and the device that renders.

/// The requested device. Without the feature `gpu` only the CPU is available.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Device {
    /// A hardware GPU, if available. Otherwise software Vulkan or the CPU, whichever is predicted to take less time for
    /// the image.
    #[default]
    Auto,
    /// The CPU, without any driver.
    Cpu,
    /// Any adapter: a hardware GPU, else software Vulkan.
    Gpu,
    /// The adapter whose name, driver or type contains this text, or the adapter with this number in the list of
    /// adapters, counted from 1.
    Named(String),
}

impl From<&str> for Device {
    /// Parses `auto`, `cpu` and `gpu`, ignoring case; any other text is the name of an adapter.
    fn from(name: &str) -> Device {
        match name.to_lowercase().as_str() {
            "auto" => Device::Auto,
            "cpu" => Device::Cpu,
            "gpu" => Device::Gpu,
            _ => Device::Named(name.to_string()),
        }
    }
}

/// The device that renders an image.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceInfo {
    /// The adapter's name, or `cpu`.
    pub name: String,
    /// The name and version of the driver; for the CPU, the name and version of this crate, and the number of threads.
    pub driver: String,
    /// The interface to the driver, such as `vulkan`, or `cpu`.
    pub interface: String,
}

impl DeviceInfo {
    /// Returns the description of the CPU.
    pub(crate) fn cpu() -> DeviceInfo {
        let threads = rayon::current_num_threads();
        DeviceInfo {
            name: "cpu".to_owned(),
            driver: format!(
                "wgray {}, {threads} thread{}",
                env!("CARGO_PKG_VERSION"),
                if threads == 1 { "" } else { "s" }
            ),
            interface: "cpu".to_owned(),
        }
    }
}

#[cfg(feature = "gpu")]
impl From<&wgray_render::gpu::GpuInfo> for DeviceInfo {
    fn from(adapter: &wgray_render::gpu::GpuInfo) -> DeviceInfo {
        DeviceInfo {
            name: adapter.name.clone(),
            driver: adapter.driver.clone(),
            interface: adapter.backend.clone(),
        }
    }
}
