//! GPU adapters: listing, selection and opening.

use std::sync::mpsc;

use bytemuck::{Pod, bytes_of, cast_slice};
use wgpu::{Backends, BufferUsages, DeviceType};

use super::controls::FloatControls;
use super::failure::{Failure, error_of_opening};
use crate::error::RenderError;
use wgray_image::contain::{DropContained, catch_panic};

/// Advice for systems without an adapter.
pub const HOW_TO_GET_VULKAN: &str =
    "on Debian, 'apt-get install mesa-vulkan-drivers' installs software Vulkan (lavapipe)";

/// Requested device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// A physical GPU, else software Vulkan.
    Auto,
    /// Any adapter.
    Gpu,
    /// The adapter with this number in [`adapters`], from 1, or with this text in its name, driver or type. A number
    /// outside the list must be a whole word of a name, such as 7900. Of several adapters with the same name, the first
    /// that can be opened is used.
    Named(String),
}

/// Properties of an adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Info {
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
    /// Maximum size of a storage buffer binding in bytes.
    pub largest_binding: u64,
    /// Maximum size of a buffer in bytes.
    pub largest_buffer: u64,
    /// Maximum number of storage buffers in a shader.
    pub storage_buffers: u32,
}

impl Info {
    /// Returns true if the adapter computes on the CPU, such as lavapipe and SwiftShader.
    pub fn is_software(&self) -> bool {
        self.kind == SOFTWARE
    }
}

const SOFTWARE: &str = "software";

/// An open device. Clones are handles to the same device.
#[derive(Clone)]
pub struct Device {
    // Dropped in this order. wgpu may panic if the device is lost.
    pub(super) queue: DropContained<wgpu::Queue>,
    pub(super) device: DropContained<wgpu::Device>,
    failure: Failure,
    /// Properties of its adapter.
    pub info: Info,
}

/// Returns all adapters that wgpu finds, in the order of preference.
pub fn adapters() -> Vec<Info> {
    enumerate().iter().map(info).collect()
}

/// Opens the best matching adapter that can be opened.
///
/// # Errors
///
/// [`RenderError::NoDevice`] if no adapter matches, or if adapters of different names do. If no matching adapter can be
/// opened, the error of the last one.
pub fn choose(choice: &Choice) -> Result<Device, RenderError> {
    choose_among(choice, &|_| true)
}

/// Like [`choose`], but only among the adapters for which `wanted` is true.
///
/// # Errors
///
/// The errors of [`choose`].
pub fn choose_among(choice: &Choice, wanted: &dyn Fn(&Info) -> bool) -> Result<Device, RenderError> {
    let adapters = enumerate();
    let infos: Vec<Info> = adapters.iter().map(info).collect();
    let mut failure = None;
    let fitting = fitting(&infos, choice).map_err(RenderError::NoDevice)?;
    for i in fitting.into_iter().filter(|i| wanted(&infos[*i])) {
        match open(&adapters[i]) {
            Ok(device) => return Ok(device),
            Err(error) => failure = Some(error),
        }
    }
    Err(failure.unwrap_or_else(|| RenderError::NoDevice(NONE_FOUND.to_owned() + HOW_TO_GET_VULKAN)))
}

/// Returns the adapter that [`choose`] would try first, without opening it.
///
/// # Errors
///
/// The errors of [`choose`].
pub fn preferred(choice: &Choice) -> Result<Info, RenderError> {
    let infos = adapters();
    let fitting = fitting(&infos, choice).map_err(RenderError::NoDevice)?;
    let first = fitting.first().and_then(|i| infos.get(*i)).cloned();
    first.ok_or_else(|| RenderError::NoDevice(NONE_FOUND.to_owned() + HOW_TO_GET_VULKAN))
}

const NONE_FOUND: &str = "no Vulkan, Metal or DX12 adapter found; ";

/// Returns the indices of the matching adapters, best first. The error is a message for the user.
fn fitting(infos: &[Info], choice: &Choice) -> Result<Vec<usize>, String> {
    let Choice::Named(name) = choice else {
        return Ok((0..infos.len()).collect());
    };
    if infos.is_empty() {
        return Ok(Vec::new());
    }
    if let Some(number) = name.parse().ok().filter(|number| (1..=infos.len()).contains(number)) {
        return Ok(vec![number - 1]);
    }
    let all = |fits: &dyn Fn(&Info) -> bool| -> Vec<usize> { (0..infos.len()).filter(|i| fits(&infos[*i])).collect() };
    let whole = all(&|info| info.name.to_lowercase() == name.to_lowercase());
    let found = match whole.is_empty() {
        // A number outside the list must not match a digit of a version.
        true if name.bytes().all(|byte| byte.is_ascii_digit()) => all(&|info| has_word(&info.name, name)),
        true => all(&|info| matches(info, name)),
        false => whole,
    };
    let listed = |found: &[usize]| {
        let lines = found
            .iter()
            .map(|i| format!("{}: {}, {}", i + 1, infos[*i].name, infos[*i].driver));
        lines.collect::<Vec<_>>().join("; ")
    };
    let everything: Vec<usize> = (0..infos.len()).collect();
    match found.as_slice() {
        [] => {
            let there = listed(&everything);
            Err(format!(
                "no adapter's name, driver or type contains '{name}'; available: cpu, gpu, auto, {there}"
            ))
        }
        [first, rest @ ..] if rest.iter().any(|i| infos[*i].name != infos[*first].name) => {
            let there = listed(&found);
            Err(format!(
                "'{name}' matches several adapters; use a longer name, a driver or a number: {there}"
            ))
        }
        _ => Ok(found),
    }
}

fn enumerate() -> Vec<wgpu::Adapter> {
    // wgpu may panic while a driver is being reset. No adapter is listed then.
    let adapters = catch_panic(|| {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        pollster::block_on(instance.enumerate_adapters(Backends::PRIMARY))
    });
    let mut adapters = adapters.unwrap_or_default();
    adapters.sort_by_key(|adapter| preference(&adapter.get_info()));
    adapters
}

/// Sort key of an adapter; the minimum is the best. Lavapipe precedes SwiftShader, since it is many times faster. Other
/// adapters of the same type keep the order of the system.
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

/// Mesa's software Vulkan reports the name llvmpipe.
fn is_lavapipe(name: &str) -> bool {
    name.starts_with("llvmpipe")
}

fn info(adapter: &wgpu::Adapter) -> Info {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    Info {
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

/// Returns true if a text contains a whole word: `7900` in "Radeon RX 7900 XT", but not `15` in "llvmpipe (LLVM
/// 15.0.6)".
fn has_word(text: &str, word: &str) -> bool {
    let mut words = text.split(|c: char| !c.is_alphanumeric() && c != '.');
    words.any(|known| known == word)
}

/// Returns true if part of the name, driver or type matches, ignoring case.
fn matches(info: &Info, name: &str) -> bool {
    let name = name.to_lowercase();
    let lavapipe = if is_lavapipe(&info.name) { "lavapipe" } else { "" };
    [info.name.as_str(), info.driver.as_str(), info.kind, lavapipe]
        .iter()
        .any(|known| known.to_lowercase().contains(&name))
}

fn open(adapter: &wgpu::Adapter) -> Result<Device, RenderError> {
    let info = info(adapter);
    let (features, experimental) = if info.exact {
        // SAFETY: the only experimental feature is SPIR-V passthrough, and naga generates all SPIR-V.
        (wgpu::Features::PASSTHROUGH_SHADERS, unsafe {
            wgpu::ExperimentalFeatures::enabled()
        })
    } else {
        (wgpu::Features::empty(), wgpu::ExperimentalFeatures::disabled())
    };
    let clock = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
    let descriptor = wgpu::DeviceDescriptor {
        label: None,
        required_features: features | clock,
        required_limits: adapter.limits(),
        experimental_features: experimental,
        memory_hints: wgpu::MemoryHints::MemoryUsage,
        trace: wgpu::Trace::Off,
    };
    let opened = catch_panic(|| pollster::block_on(adapter.request_device(&descriptor)));
    let (device, queue) = match opened {
        Ok(Ok(opened)) => opened,
        Ok(Err(error)) => return Err(error_of_opening(&info.name, &error)),
        Err(message) => {
            return Err(RenderError::Device {
                device: info.name,
                message,
            });
        }
    };
    let failure = Failure::default();
    failure.listen(&device);
    Ok(Device {
        queue: DropContained::new(queue),
        device: DropContained::new(device),
        failure,
        info,
    })
}

impl Device {
    /// Returns the wgpu handles, for other kernels than those of the renderer.
    pub fn wgpu(&self) -> (&wgpu::Device, &wgpu::Queue) {
        (&self.device, &self.queue)
    }

    /// Makes wgpu calls and returns the first error that they raise.
    pub(super) fn checked<T>(&self, calls: impl FnOnce() -> T) -> Result<T, RenderError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let value = catch_panic(calls);
        let errors = [validation.pop(), internal.pop(), memory.pop()].map(pollster::block_on);
        let [validation, internal, memory] = errors;
        // A failed allocation also invalidates later uses of the buffer. Report the cause.
        let first = [memory, validation, internal].into_iter().flatten().next();
        self.failure.judge(&self.info.name, value, first.as_ref())
    }

    /// Returns an error with this message, or the device loss that caused it.
    pub(super) fn error(&self, error: impl std::fmt::Display) -> RenderError {
        self.failure.error(&self.info.name, &error)
    }

    /// Processes finished work without blocking.
    pub(super) fn poll(&self) -> Result<(), RenderError> {
        self.poll_for(wgpu::PollType::Poll)
    }

    pub(super) fn wait(&self) -> Result<(), RenderError> {
        self.poll_for(wgpu::PollType::wait_indefinitely())
    }

    /// wgpu panics here if the device is lost.
    fn poll_for(&self, what: wgpu::PollType) -> Result<(), RenderError> {
        match catch_panic(|| self.device.poll(what)) {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(error)) => Err(self.error(error)),
            Err(message) => Err(self.error(message)),
        }
    }

    pub(super) fn buffer(&self, size: u64, usage: BufferUsages) -> wgpu::Buffer {
        let descriptor = wgpu::BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        };
        self.device.create_buffer(&descriptor)
    }

    /// Creates a buffer with these records. An empty list becomes one zeroed record, since bindings cannot be empty.
    pub(super) fn upload<T: Pod>(&self, usage: BufferUsages, records: &[T]) -> wgpu::Buffer {
        let none = T::zeroed();
        let contents = if records.is_empty() {
            bytes_of(&none)
        } else {
            cast_slice(records)
        };
        let descriptor = wgpu::BufferDescriptor {
            label: None,
            size: (contents.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage,
            mapped_at_creation: true,
        };
        let buffer = self.device.create_buffer(&descriptor);
        // A buffer without memory cannot be mapped. The enclosing `checked` reports the reason.
        if let Ok(mut view) = buffer.get_mapped_range_mut(..) {
            view.slice(..contents.len()).copy_from_slice(contents);
            drop(view);
            buffer.unmap();
        }
        buffer
    }

    pub(super) fn download<T: Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, RenderError> {
        let staging = self.checked(|| {
            let staging = self.buffer(buffer.size(), BufferUsages::COPY_DST | BufferUsages::MAP_READ);
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
            self.queue.submit([encoder.finish()]);
            staging
        })?;
        self.read(&staging)
    }

    /// Returns the contents of a mappable buffer after all submitted work.
    pub(super) fn read<T: Pod>(&self, staging: &wgpu::Buffer) -> Result<Vec<T>, RenderError> {
        let mapping = self.checked(|| self.map(staging))?;
        self.wait_for(&mapping)?;
        self.mapped(staging)
    }

    /// Starts mapping a buffer, which completes after the work submitted so far.
    pub(super) fn map(&self, staging: &wgpu::Buffer) -> Mapping {
        let (sender, receiver) = mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = sender.send(result); // fails if the wait has failed and dropped the receiver
        });
        Mapping(receiver)
    }

    pub(super) fn wait_for(&self, mapping: &Mapping) -> Result<(), RenderError> {
        self.wait()?;
        // Another thread that waits for the same device may run the callback a little later.
        let told = mapping.0.recv().map_err(|error| self.error(error))?;
        told.map_err(|error| self.error(error))
    }

    /// Returns the contents of a mapped buffer, and unmaps it.
    pub(super) fn mapped<T: Pod>(&self, staging: &wgpu::Buffer) -> Result<Vec<T>, RenderError> {
        let view = staging.get_mapped_range(..).map_err(|error| self.error(error))?;
        let records = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        staging.unmap();
        Ok(records)
    }
}

pub(super) struct Mapping(mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>);

impl Mapping {
    /// Returns the result of the mapping once; `None` while it is pending.
    pub(super) fn done(&self) -> Option<Result<(), String>> {
        match self.0.try_recv() {
            Ok(result) => Some(result.map_err(|error| error.to_string())),
            Err(mpsc::TryRecvError::Empty) => None,
            Err(error) => Some(Err(error.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_wrong_outside_of_checks_is_told_by_the_next_call() {
        let device = match choose(&Choice::Auto) {
            Ok(device) => device,
            Err(_) if std::env::var_os("WGRAY_TEST_WITHOUT_GPU").is_some() => return,
            Err(error) => panic!("{error}"),
        };
        assert!(device.checked(|| ()).is_ok());
        device.buffer(u64::MAX, BufferUsages::STORAGE); // no device has that much
        let told = device.checked(|| ()).expect_err("the error of before").to_string();
        assert!(told.starts_with(&device.info.name), "{told}");
        assert!(device.checked(|| ()).is_ok(), "it is told once");
    }

    fn adapter(name: &str, driver: &str, kind: &'static str) -> Info {
        Info {
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
    fn lavapipe_goes_before_other_software_and_real_gpus_before_both() {
        let (swiftshader, lavapipe) = ("SwiftShader Device (Subzero)", "llvmpipe (LLVM 15.0.6, 256 bits)");
        let in_order = |adapters: &[(&'static str, DeviceType)]| {
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
            in_order(&[(swiftshader, cpu), (lavapipe, cpu)]),
            [lavapipe, swiftshader]
        );
        assert_eq!(
            in_order(&[(lavapipe, cpu), (swiftshader, cpu)]),
            [lavapipe, swiftshader]
        );
        assert_eq!(
            in_order(&[
                (swiftshader, cpu),
                (lavapipe, cpu),
                ("Radeon", DeviceType::IntegratedGpu),
                ("virtio", DeviceType::VirtualGpu),
                ("GeForce B", DeviceType::DiscreteGpu),
                ("GeForce A", DeviceType::DiscreteGpu),
            ]),
            ["GeForce B", "GeForce A", "Radeon", "virtio", lavapipe, swiftshader],
            "the two of one type as they came"
        );
    }

    #[test]
    fn a_name_means_one_adapter_or_is_refused_with_those_that_it_fits() {
        let infos = [
            adapter("Radeon RX 7900", "radv Mesa 25", "discrete"),
            adapter("Radeon RX 7900 XT", "radv Mesa 25", "discrete"),
            adapter("Radeon 780M", "radv Mesa 25", "integrated"),
            adapter("Radeon 780M", "amdvlk", "integrated"),
            adapter("llvmpipe (LLVM 15)", "Mesa 22", "software"),
        ];
        let found = |name: &str| fitting(&infos, &Choice::Named(name.to_string()));
        assert_eq!(found("radeon rx 7900"), Ok(vec![0]), "the whole name goes before parts");
        assert_eq!(found("XT"), Ok(vec![1]));
        assert_eq!(
            found("780m"),
            Ok(vec![2, 3]),
            "the same card by two drivers is no doubt"
        );
        assert_eq!(found("amdvlk"), Ok(vec![3]));
        assert_eq!(found("lavapipe"), Ok(vec![4]));
        assert_eq!(found("SOFTWARE"), Ok(vec![4]));
        for (number, i) in [("1", 0), ("4", 3), ("5", 4)] {
            assert_eq!(found(number), Ok(vec![i]));
        }
        for digit in ["0", "6", "7", "23"] {
            let none = found(digit).unwrap_err();
            assert!(none.contains(&format!("contains '{digit}'")), "{none}");
        }
        assert_eq!(found("15"), Ok(vec![4]), "a word of a name");
        assert!(
            found("7900")
                .unwrap_err()
                .starts_with("'7900' matches several adapters")
        );
        let several = found("discrete").unwrap_err();
        assert_eq!(
            several,
            "'discrete' matches several adapters; use a longer name, a driver or a number: 1: Radeon RX 7900, radv \
             Mesa 25; 2: Radeon RX 7900 XT, radv Mesa 25"
        );
        let none = found("geforce").unwrap_err();
        assert!(
            none.starts_with(
                "no adapter's name, driver or type contains 'geforce'; available: cpu, gpu, auto, 1: Radeon"
            ),
            "{none}"
        );
        assert_eq!(fitting(&infos, &Choice::Auto), Ok(vec![0, 1, 2, 3, 4]));
        assert_eq!(fitting(&[], &Choice::Named("1".to_string())), Ok(Vec::new()));
    }
}
