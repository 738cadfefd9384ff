//! GPU adapters: listing and selection.

use wgpu::{Backends, DeviceType};

use super::float_controls::FloatControls;
use crate::error::{DeviceError, RenderError};
use wgray_image::panic_guard::catch_panic_of_future;

/// A requested device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The best adapter: a GPU, else software Vulkan. Callers may use the CPU instead of software Vulkan.
    Auto,
    /// The same adapter as [`AdapterChoice::Auto`]. Callers do not use the CPU instead.
    Gpu,
    /// The adapter with this number in [`adapters`], counted from 1, or with this text in its name, driver or type. A
    /// number that is not in the list, such as 7900, must match a whole word of a name. Of several adapters with the
    /// same name, the first that can be opened is used.
    Named(String),
}

/// Properties of an adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GpuInfo {
    /// Name.
    pub name: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Graphics API, such as `vulkan`.
    pub backend: String,
    /// Type: `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// True if SPIR-V is passed through, so that shaders are executed as written.
    pub exact: bool,
    /// Supported float controls, requested if `exact`.
    pub float_controls: FloatControls,
    /// Maximum storage buffer binding in bytes.
    pub largest_binding: u64,
    /// Maximum buffer size in bytes.
    pub largest_buffer: u64,
    /// Maximum number of storage buffers in a shader.
    pub storage_buffers: u32,
}

impl GpuInfo {
    /// Returns true for adapters on the CPU, such as lavapipe and SwiftShader.
    pub fn is_software(&self) -> bool {
        self.kind == SOFTWARE
    }
}

const SOFTWARE: &str = "software";

/// Returns all adapters, in the order of preference.
pub fn adapters() -> Vec<GpuInfo> {
    pollster::block_on(enumerate()).iter().map(info).collect()
}

/// Returns the adapter that [`choose`](super::choose) would try first, without opening it.
///
/// # Errors
///
/// The errors of [`choose`](super::choose).
pub fn preferred(choice: &AdapterChoice) -> Result<GpuInfo, RenderError> {
    let infos = adapters();
    let matching = matching(&infos, choice)?;
    let first = matching.first().and_then(|i| infos.get(*i)).cloned();
    first.ok_or(RenderError::NoDevice(DeviceError::NoneFound))
}

/// Returns the matching adapters, best first.
pub(super) fn matching(infos: &[GpuInfo], choice: &AdapterChoice) -> Result<Vec<usize>, DeviceError> {
    let AdapterChoice::Named(name) = choice else {
        return Ok((0..infos.len()).collect());
    };
    if infos.is_empty() {
        return Ok(Vec::new());
    }
    if let Some(number) = name.parse().ok().filter(|number| (1..=infos.len()).contains(number)) {
        return Ok(vec![number - 1]);
    }
    let indices_where =
        |test: &dyn Fn(&GpuInfo) -> bool| -> Vec<usize> { (0..infos.len()).filter(|i| test(&infos[*i])).collect() };
    let same_name = indices_where(&|info| info.name.to_lowercase() == name.to_lowercase());
    let found = match same_name.is_empty() {
        // A number outside the list must not match a digit of a version.
        true if name.bytes().all(|byte| byte.is_ascii_digit()) => indices_where(&|info| has_word(&info.name, name)),
        true => indices_where(&|info| matches(info, name)),
        false => same_name,
    };
    let line = |i: usize| format!("{}: {}, {}", i + 1, infos[i].name, infos[i].driver);
    match found.as_slice() {
        [] => Err(DeviceError::NoMatch {
            requested: name.clone(),
            available: (0..infos.len()).map(line).collect(),
        }),
        [first, rest @ ..] if rest.iter().any(|i| infos[*i].name != infos[*first].name) => {
            Err(DeviceError::Ambiguous {
                requested: name.clone(),
                matching: found.into_iter().map(line).collect(),
            })
        }
        _ => Ok(found),
    }
}

pub(super) async fn enumerate() -> Vec<wgpu::Adapter> {
    // wgpu may panic while a driver is being reset; the list is empty in this case.
    let adapters = catch_panic_of_future(async {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        instance.enumerate_adapters(Backends::PRIMARY).await
    });
    let mut adapters = adapters.await.unwrap_or_default();
    adapters.sort_by_key(|adapter| preference(&adapter.get_info()));
    adapters
}

/// Returns the sort key of an adapter, lowest first. Lavapipe precedes SwiftShader, since it is many times faster.
/// Otherwise, adapters of the same type keep the system's order.
fn preference(info: &wgpu::AdapterInfo) -> (u8, bool) {
    let kind = match info.device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    };
    (kind, !is_lavapipe(&info.name))
}

/// Returns true for Mesa's software Vulkan, lavapipe, which reports the name llvmpipe.
pub fn is_lavapipe(name: &str) -> bool {
    name.starts_with("llvmpipe")
}

pub(super) fn info(adapter: &wgpu::Adapter) -> GpuInfo {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    GpuInfo {
        driver: [info.driver, info.driver_info].join(" ").trim().to_string(),
        backend: info.backend.to_string(),
        kind: match info.device_type {
            DeviceType::DiscreteGpu => "discrete",
            DeviceType::IntegratedGpu => "integrated",
            DeviceType::VirtualGpu => "virtual",
            DeviceType::Cpu => SOFTWARE,
            DeviceType::Other => "other",
        },
        exact: adapter.features().contains(wgpu::Features::PASSTHROUGH_SHADERS)
            && info.backend == wgpu::Backend::Vulkan,
        float_controls: FloatControls::of(adapter),
        largest_binding: limits.max_storage_buffer_binding_size,
        largest_buffer: limits.max_buffer_size,
        storage_buffers: limits.max_storage_buffers_per_shader_stage,
        name: info.name,
    }
}

/// Returns true for a whole word: `7900` in "Radeon RX 7900 XT", but not `15` in "llvmpipe (LLVM 15.0.6)".
fn has_word(text: &str, word: &str) -> bool {
    let mut words = text.split(|c: char| !c.is_alphanumeric() && c != '.');
    words.any(|candidate| candidate == word)
}

/// Returns true if an adapter's name, driver or type contains a name, ignoring case.
fn matches(info: &GpuInfo, name: &str) -> bool {
    let name = name.to_lowercase();
    let lavapipe = if is_lavapipe(&info.name) { "lavapipe" } else { "" };
    [info.name.as_str(), info.driver.as_str(), info.kind, lavapipe]
        .iter()
        .any(|text| text.to_lowercase().contains(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(name: &str, driver: &str, kind: &'static str) -> GpuInfo {
        GpuInfo {
            name: name.to_string(),
            driver: driver.to_string(),
            backend: "vulkan".to_string(),
            kind,
            exact: true,
            float_controls: FloatControls::NONE,
            largest_binding: 1,
            largest_buffer: 1,
            storage_buffers: 8,
        }
    }

    #[test]
    fn adapters_are_sorted_gpus_first_then_lavapipe_then_other_software() {
        let (swiftshader, lavapipe) = ("SwiftShader Device (Subzero)", "llvmpipe (LLVM 15.0.6, 256 bits)");
        let sorted_names = |adapters: &[(&'static str, DeviceType)]| {
            let mut infos: Vec<wgpu::AdapterInfo> = adapters
                .iter()
                .map(|(name, kind)| wgpu::AdapterInfo {
                    name: name.to_string(),
                    ..wgpu::AdapterInfo::new(*kind, wgpu::Backend::Vulkan)
                })
                .collect();
            infos.sort_by_key(preference);
            infos.into_iter().map(|info| info.name).collect::<Vec<_>>()
        };
        let cpu = DeviceType::Cpu;
        assert_eq!(
            sorted_names(&[(swiftshader, cpu), (lavapipe, cpu)]),
            [lavapipe, swiftshader]
        );
        assert_eq!(
            sorted_names(&[(lavapipe, cpu), (swiftshader, cpu)]),
            [lavapipe, swiftshader]
        );
        assert_eq!(
            sorted_names(&[
                (swiftshader, cpu),
                (lavapipe, cpu),
                ("Radeon", DeviceType::IntegratedGpu),
                ("virtio", DeviceType::VirtualGpu),
                ("GeForce B", DeviceType::DiscreteGpu),
                ("GeForce A", DeviceType::DiscreteGpu),
            ]),
            ["GeForce B", "GeForce A", "Radeon", "virtio", lavapipe, swiftshader],
            "the order within a type changed"
        );
    }

    #[test]
    fn unknown_and_ambiguous_names_are_rejected_with_the_candidates() {
        let infos = [
            adapter("Radeon RX 7900", "radv Mesa 25", "discrete"),
            adapter("Radeon RX 7900 XT", "radv Mesa 25", "discrete"),
            adapter("Radeon 780M", "radv Mesa 25", "integrated"),
            adapter("Radeon 780M", "amdvlk", "integrated"),
            adapter("llvmpipe (LLVM 15)", "Mesa 22", "software"),
        ];
        let found = |name: &str| matching(&infos, &AdapterChoice::Named(name.to_string()));
        assert_eq!(
            found("radeon rx 7900"),
            Ok(vec![0]),
            "a partial match was preferred to the exact name"
        );
        assert_eq!(found("XT"), Ok(vec![1]));
        assert_eq!(found("780m"), Ok(vec![2, 3]), "one card with two drivers was ambiguous");
        assert_eq!(found("amdvlk"), Ok(vec![3]));
        assert_eq!(found("lavapipe"), Ok(vec![4]));
        assert_eq!(found("SOFTWARE"), Ok(vec![4]));
        for (number, i) in [("1", 0), ("4", 3), ("5", 4)] {
            assert_eq!(found(number), Ok(vec![i]));
        }
        for number in ["0", "6", "7", "23"] {
            let message = found(number).unwrap_err().to_string();
            assert!(message.contains(&format!("contains '{number}'")), "{message}");
        }
        assert_eq!(found("15"), Ok(vec![4]), "a whole word of a name did not match");
        assert!(
            found("7900")
                .unwrap_err()
                .to_string()
                .starts_with("'7900' matches several adapters")
        );
        let message = found("discrete").unwrap_err().to_string();
        assert_eq!(
            message,
            "'discrete' matches several adapters; use a longer name, a driver or a number: 1: Radeon RX 7900, radv \
             Mesa 25; 2: Radeon RX 7900 XT, radv Mesa 25"
        );
        let message = found("geforce").unwrap_err().to_string();
        assert!(
            message.starts_with(
                "no adapter's name, driver or type contains 'geforce'; available: cpu, gpu, auto, 1: Radeon"
            ),
            "{message}"
        );
        assert_eq!(matching(&infos, &AdapterChoice::Auto), Ok(vec![0, 1, 2, 3, 4]));
        assert_eq!(matching(&[], &AdapterChoice::Named("1".to_string())), Ok(Vec::new()));
    }
}
