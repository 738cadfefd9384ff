//! Compiles the kernels of a scene on a separate thread, because the compiler of a driver cannot be interrupted and
//! viewers must not wait for it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::source::KernelChoice;
use super::times::Times;
use wgray_render::error::{RenderError, ShaderErrors};
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::sliders::sliders;
use wgray_render::gpu::{AdapterChoice, Device, Forms, Gpu, Options, check_kernels, choose};
use wgray_trace::records::Packed;

pub struct Request {
    /// Copied to the result, so that outdated results can be recognized.
    pub id: u64,
    /// The device; `None` opens a new one.
    pub device: Option<Device>,
    pub packed: Packed,
    pub shaders: Arc<Shaders>,
    /// The last shaders without errors, which are used if `shaders` have errors.
    pub fallback: Option<Arc<Shaders>>,
    pub kernel_choice: KernelChoice,
    /// The time when the change was noticed.
    pub noticed_at: Instant,
}

/// The renderer of a scene on a device, and the shaders that it uses.
pub type Ready = (Box<Gpu>, Arc<Shaders>);

pub struct BuildResult {
    pub id: u64,
    pub kernel_choice: KernelChoice,
    pub noticed_at: Instant,
    /// `None` if the shaders have errors and no fallback exists.
    pub result: Option<Result<Ready, RenderError>>,
    pub shader_errors: Option<ShaderErrors>,
    /// Time spent on checking and compiling.
    pub duration: Duration,
}

/// The compiler thread. When dropped, the thread ends after the current compilation.
pub struct Builder {
    requests: Option<Sender<Request>>,
    thread: Option<JoinHandle<()>>,
}

impl Builder {
    /// Starts the thread, which passes results to `done`. A request is dropped if a newer request arrives before its
    /// compilation starts.
    pub fn start(
        choice: AdapterChoice,
        times: Times,
        done: impl Fn(BuildResult) + Send + 'static,
    ) -> std::io::Result<Builder> {
        let (sender, receiver) = channel();
        let thread = std::thread::Builder::new()
            .name("build".to_string())
            .spawn(move || run(&choice, &times, &receiver, done))?;
        Ok(Builder {
            requests: Some(sender),
            thread: Some(thread),
        })
    }

    pub fn request(&self, request: Request) {
        if let Some(requests) = &self.requests {
            let _ = requests.send(request); // the thread receives until the builder is dropped
        }
    }
}

impl Drop for Builder {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(choice: &AdapterChoice, times: &Times, requests: &Receiver<Request>, done: impl Fn(BuildResult)) {
    while let Ok(mut request) = requests.recv() {
        while let Ok(newer) = requests.try_recv() {
            request = newer;
        }
        done(build(choice, times, request));
    }
}

fn build(choice: &AdapterChoice, times: &Times, request: Request) -> BuildResult {
    let Request {
        id,
        device,
        packed,
        shaders,
        fallback,
        kernel_choice,
        noticed_at,
    } = request;
    let start = Instant::now();
    // Checks the kernels of all views.
    let shader_errors = times.measure("check shaders", || {
        check_kernels(&packed, &shaders, Forms::Buffers).err()
    });
    let usable = if shader_errors.is_some() {
        fallback
    } else {
        Some(shaders)
    };
    let result = usable.map(|shaders| {
        guarded(|| {
            let device = device.map_or_else(|| choose(choice), Ok)?;
            // The scene is not baked into the kernel, so that changing the scene does not require compilation.
            let options = Options {
                baked: false,
                ..Options::best(&device)
            };
            let gpu = times.measure("compile", || {
                let sliders = sliders(&shaders, packed.integrator, packed.sampling.adaptive);
                let mut gpu = Gpu::with_sliders(&device, &packed, &shaders, options, sliders)?;
                gpu.time_calls()?;
                Ok::<_, RenderError>(gpu)
            })?;
            Ok((Box::new(gpu), shaders))
        })
    });
    BuildResult {
        id,
        kernel_choice,
        noticed_at,
        result,
        shader_errors,
        duration: start.elapsed(),
    }
}

/// Runs code that calls a driver. If wgpu panics because the device is lost, returns an error.
pub fn guarded<T>(action: impl FnOnce() -> Result<T, RenderError>) -> Result<T, RenderError> {
    catch_unwind(AssertUnwindSafe(action)).unwrap_or_else(|panic| {
        let message = panic.downcast_ref::<String>().map(String::as_str);
        let message = message.or_else(|| panic.downcast_ref::<&str>().copied());
        Err(RenderError::Device {
            device: "device".to_string(),
            message: message.unwrap_or("lost").to_string(),
        })
    })
}
