//! Making a scene ready on a device, on a thread of its own: a driver's compiler cannot be interrupted, and whoever looks
//! at the picture must not wait for it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::times::Times;
use crate::error::{RenderError, ShaderErrors};
use crate::gpu::compose::Shaders;
use crate::gpu::marks::Layer;
use crate::gpu::{Choice, Device, Forms, Gpu, Live, Options, check_kernels, choose};
use crate::pack::Packed;

/// What is to be made.
pub struct Request {
    /// Given back with the result, so that a late one is known as such.
    pub id: u64,
    /// The device; a new one is opened if there is none.
    pub device: Option<Device>,
    /// The scene.
    pub packed: Packed,
    /// The shaders.
    pub shaders: Arc<Shaders>,
    /// The layer that takes the place of light.
    pub layer: Option<Layer>,
    /// Shaders that are known to be right, to be used if those are wrong.
    pub fallback: Option<Arc<Shaders>>,
}

/// A scene on a device, and the shaders that it has.
pub type Ready = (Box<Gpu>, Arc<Shaders>);

/// What was made of a request.
pub struct Built {
    /// The request's.
    pub id: u64,
    /// The scene on a device; `None` if the request's are wrong, and have no fallback.
    pub result: Option<Result<Ready, RenderError>>,
    /// What is wrong with the request's shaders.
    pub refused: Option<ShaderErrors>,
    /// How long it took to compile.
    pub took: Duration,
}

/// The thread; it ends when this is dropped, after what it is doing.
pub struct Builder {
    requests: Option<Sender<Request>>,
    thread: Option<JoinHandle<()>>,
}

impl Builder {
    /// Starts the thread. It gives `done` its results, except those of requests that a newer one has overtaken.
    pub fn start(choice: Choice, times: Times, done: impl Fn(Built) + Send + 'static) -> std::io::Result<Builder> {
        let (sender, receiver) = channel();
        let thread = std::thread::Builder::new()
            .name("build".to_string())
            .spawn(move || run(&choice, &times, &receiver, done))?;
        Ok(Builder {
            requests: Some(sender),
            thread: Some(thread),
        })
    }

    /// Asks for something; what was asked for earlier and has not begun is dropped.
    pub fn request(&self, request: Request) {
        if let Some(requests) = &self.requests {
            let _ = requests.send(request); // the thread lives as long as this
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

fn run(choice: &Choice, times: &Times, requests: &Receiver<Request>, done: impl Fn(Built)) {
    while let Ok(mut request) = requests.recv() {
        while let Ok(newer) = requests.try_recv() {
            request = newer;
        }
        done(build(choice, times, request));
    }
}

fn build(choice: &Choice, times: &Times, request: Request) -> Built {
    let Request {
        id,
        device,
        packed,
        shaders,
        layer,
        fallback,
    } = request;
    let start = Instant::now();
    // Every kernel, whether it is used now or by another view later.
    let refused = times.of("check shaders", || {
        check_kernels(&packed, &shaders, Forms::Buffers).err()
    });
    let usable = if refused.is_some() { fallback } else { Some(shaders) };
    let result = usable.map(|shaders| {
        guarded(|| {
            let device = device.map_or_else(|| choose(choice), Ok)?;
            // In buffers: a change of the scene then needs no compiler.
            let options = Options {
                baked: false,
                ..Options::best(&device)
            };
            let gpu = times.of("compile", || {
                let live = Live::of(&shaders, packed.adaptive, packed.integrator, layer);
                let mut gpu = Gpu::with_live(&device, &packed, &shaders, options, live)?;
                gpu.time_calls()?;
                Ok::<_, RenderError>(gpu)
            })?;
            Ok((Box::new(gpu), shaders))
        })
    });
    Built {
        id,
        result,
        refused,
        took: start.elapsed(),
    }
}

/// Runs what calls a driver. wgpu panics when a device is lost while it waits: that is an error here.
pub fn guarded<T>(work: impl FnOnce() -> Result<T, RenderError>) -> Result<T, RenderError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let message = panic.downcast_ref::<String>().map(String::as_str);
        let message = message.or_else(|| panic.downcast_ref::<&str>().copied());
        Err(RenderError::Device {
            device: "device".to_string(),
            message: message.unwrap_or("lost").to_string(),
        })
    })
}
