//! An open GPU device: opening, errors, buffers and transfers.

use bytemuck::{Pod, bytes_of, cast_slice};
use wgpu::BufferUsages;

use super::adapter::{AdapterChoice, GpuInfo, enumerate, info, matching};
use super::failure::{Failure, error_of_opening};
use super::mapping::Mapping;
use super::pipeline_cache::PipelineCache;
use crate::error::{DeviceError, RenderError};
use wgray_image::panic_guard::{CatchPanicOnDrop, catch_panic, catch_panic_of_future};

/// An open device. Clones are handles to the same device.
#[derive(Clone)]
pub struct Device {
    pub(super) pipelines: PipelineCache,
    // Rust drops fields in order. After a device loss, wgpu may panic in a drop.
    pub(super) queue: CatchPanicOnDrop<wgpu::Queue>,
    pub(super) device: CatchPanicOnDrop<wgpu::Device>,
    failure: Failure,
    /// The adapter.
    pub info: GpuInfo,
}

/// Opens the best matching adapter that can be opened.
///
/// # Errors
///
/// [`RenderError::NoDevice`] if no adapter matches, or if the choice is ambiguous because adapters with different names
/// match. If no matching adapter can be opened, the error of the last matching adapter.
pub fn choose(choice: &AdapterChoice) -> Result<Device, RenderError> {
    choose_among(choice, &|_| true)
}

/// Like [`choose`], but considers only adapters for which `is_eligible` returns true.
///
/// # Errors
///
/// The errors of [`choose`].
pub fn choose_among(choice: &AdapterChoice, is_eligible: &dyn Fn(&GpuInfo) -> bool) -> Result<Device, RenderError> {
    pollster::block_on(choose_among_async(choice, is_eligible))
}

/// Like [`choose_among`], as a future that does not block in browsers.
///
/// # Errors
///
/// The errors of [`choose`].
pub async fn choose_among_async(
    choice: &AdapterChoice,
    is_eligible: &dyn Fn(&GpuInfo) -> bool,
) -> Result<Device, RenderError> {
    let adapters = enumerate().await;
    let infos: Vec<GpuInfo> = adapters.iter().map(info).collect();
    let mut failure = None;
    let matching = matching(&infos, choice)?;
    for i in matching.into_iter().filter(|i| is_eligible(&infos[*i])) {
        match open(&adapters[i]).await {
            Ok(device) => return Ok(device),
            Err(error) => failure = Some(error),
        }
    }
    Err(failure.unwrap_or(RenderError::NoDevice(DeviceError::NoneFound)))
}

async fn open(adapter: &wgpu::Adapter) -> Result<Device, RenderError> {
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
    let (device, queue) = match catch_panic_of_future(adapter.request_device(&descriptor)).await {
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
        pipelines: PipelineCache::default(),
        queue: CatchPanicOnDrop::new(queue),
        device: CatchPanicOnDrop::new(device),
        failure,
        info,
    })
}

impl Device {
    /// Returns the wgpu handles, for kernels other than the renderer's.
    pub fn wgpu(&self) -> (&wgpu::Device, &wgpu::Queue) {
        (&self.device, &self.queue)
    }

    /// Makes wgpu calls and returns their error, if any.
    #[cfg(target_family = "wasm")]
    pub(super) fn checked<T>(&self, calls: impl FnOnce() -> T) -> Result<T, RenderError> {
        // Browsers report errors of scopes later, to futures. Without scopes, the errors are recorded, and the next check
        // returns them.
        self.failure.check(&self.info.name, Ok(calls()), None)
    }

    /// Makes wgpu calls and returns their error, if any.
    #[cfg(not(target_family = "wasm"))]
    pub(super) fn checked<T>(&self, calls: impl FnOnce() -> T) -> Result<T, RenderError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let value = catch_panic(calls);
        let errors = [validation.pop(), internal.pop(), memory.pop()].map(pollster::block_on);
        let [validation, internal, memory] = errors;
        // A failed allocation also causes validation errors for later uses of the buffer, so the memory error comes
        // first.
        let first = [memory, validation, internal].into_iter().flatten().next();
        self.failure.check(&self.info.name, value, first.as_ref())
    }

    /// Returns the device loss if the device is lost, otherwise the error.
    pub(super) fn error(&self, error: impl std::fmt::Display) -> RenderError {
        self.failure.error(&self.info.name, &error)
    }

    /// Processes finished work without blocking.
    pub(super) fn poll(&self) -> Result<(), RenderError> {
        self.poll_for(wgpu::PollType::Poll)
    }

    #[cfg(not(target_family = "wasm"))]
    pub(super) fn wait(&self) -> Result<(), RenderError> {
        self.poll_for(wgpu::PollType::wait_indefinitely())
    }

    /// Polls the device, and returns an error if wgpu panics because the device is lost.
    fn poll_for(&self, poll_type: wgpu::PollType) -> Result<(), RenderError> {
        match catch_panic(|| self.device.poll(poll_type)) {
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

    /// Creates a buffer. An empty list becomes a zeroed record, since bindings cannot be empty.
    pub(super) fn upload<T: Pod>(&self, usage: BufferUsages, records: &[T]) -> wgpu::Buffer {
        let zero = T::zeroed();
        let contents = if records.is_empty() {
            bytes_of(&zero)
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
        // If memory is exhausted, the buffer cannot be mapped. The enclosing `checked` reports the reason.
        if let Ok(mut view) = buffer.get_mapped_range_mut(..) {
            view.slice(..contents.len()).copy_from_slice(contents);
            drop(view);
            buffer.unmap();
        }
        buffer
    }

    /// Returns the contents of a buffer after all submitted work. In browsers, the future does not block; natively, it
    /// blocks, because wgpu maps buffers only while the device is polled.
    pub(super) async fn download<T: Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, RenderError> {
        let staging = self.checked(|| {
            let staging = self.buffer(buffer.size(), BufferUsages::COPY_DST | BufferUsages::MAP_READ);
            let mut encoder = self.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
            self.queue.submit([encoder.finish()]);
            staging
        })?;
        let mapping = self.checked(|| Mapping::start(&staging))?;
        self.mapped(&mapping).await?;
        self.read(&staging)
    }

    /// Ends when a buffer is mapped. Blocks natively, as [`Device::download`].
    pub(super) async fn mapped(&self, mapping: &Mapping) -> Result<(), RenderError> {
        #[cfg(not(target_family = "wasm"))]
        self.wait()?;
        // Another thread that waits for the device may run the callback a little later.
        mapping.await.map_err(|message| self.error(message))
    }

    /// Returns the contents of a mapped buffer, and unmaps it.
    pub(super) fn read<T: Pod>(&self, staging: &wgpu::Buffer) -> Result<Vec<T>, RenderError> {
        let view = staging.get_mapped_range(..).map_err(|error| self.error(error))?;
        let records = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        staging.unmap();
        Ok(records)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_outside_of_checks_are_reported_by_the_next_check() {
        let device = match choose(&AdapterChoice::Auto) {
            Ok(device) => device,
            Err(_) if std::env::var_os("WGRAY_TEST_WITHOUT_GPU").is_some() => return,
            Err(error) => panic!("{error}"),
        };
        assert!(device.checked(|| ()).is_ok());
        device.buffer(u64::MAX, BufferUsages::STORAGE); // more memory than any device has
        let error = device.checked(|| ()).expect_err("the recorded error").to_string();
        assert!(error.starts_with(&device.info.name), "{error}");
        assert!(device.checked(|| ()).is_ok(), "the error was reported twice");
    }
}
