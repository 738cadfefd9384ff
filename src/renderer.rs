//! A scene on a device, which is opened again if it is lost, with the CPU as a fallback.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tracing::warn;
use web_time::Instant;
use wgray_image::panic_guard::catch_panic;
use wgray_render::backend::Backend;
use wgray_render::records::Packed;

use crate::context::Context;
use crate::device::{Device, DeviceInfo};
use crate::error::{Error, RenderError};
use crate::open::{AcceptAdapter, Engine, faster_on_cpu, open_adapter};
use crate::options::Options;

/// Prefix of messages that explain why the CPU is used.
const ON_CPU: &str = "rendering on the CPU: ";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recovery {
    Reopen,
    Cpu,
}

/// The callback that reports a fault from which the renderer recovers.
pub type Tell<'a> = Box<dyn FnMut(&RenderError, Recovery) + 'a>;

pub struct FaultHandler<'a> {
    pub tell: Tell<'a>,
    /// Returns true to give up waiting for a lost device.
    pub stopped: Box<dyn Fn() -> bool + 'a>,
}

/// Pauses before successive attempts to open a lost device; the attempts are counted again after any progress.
const PAUSES: [Duration; 3] = [Duration::ZERO, Duration::from_millis(500), Duration::from_secs(2)];

/// Interval at which the stop callback is polled during a pause.
const STOP_INTERVAL: Duration = Duration::from_millis(20);

/// Counts results that remain valid if the device is lost. The work is only given up after several losses without
/// progress in between.
#[derive(Clone, Debug, Default)]
pub struct Progress(Arc<AtomicU64>);

impl Progress {
    pub fn made(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn count(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// A scene on an open device.
pub struct OpenScene {
    context: Context,
    device: Device,
    exact_rounding: bool,
    engine: Engine,
    info: DeviceInfo,
    why: Option<String>,
    /// Maximum size of a film in pixels, which divides the work; a replacement device must support this size.
    largest_film: u64,
    /// The lost device and the reason, while no device is open.
    gone: Option<(String, String)>,
    losses: usize,
    progress: Progress,
    /// Value of `progress` at the last loss.
    known_progress: u64,
}

/// Renders an open scene, and recovers from faults of its device.
pub struct Renderer<'a> {
    open: &'a mut OpenScene,
    on_fault: FaultHandler<'a>,
}

impl OpenScene {
    /// Opens a device for a scene. With [`Device::Auto`] the CPU renders if no adapter exists, if the scene is too
    /// large for the adapter, or if the adapter is lost permanently; `on_fault` reports the reason.
    ///
    /// # Errors
    ///
    /// No device matches the request, the scene does not fit, the driver fails, or [`Options::exact_rounding`] is set
    /// for an adapter that does not use Vulkan.
    pub fn new(
        context: &Context,
        scene: Arc<Packed>,
        options: &Options,
        on_fault: &mut FaultHandler,
    ) -> Result<OpenScene, Error> {
        let why = match options.device {
            Device::Auto => faster_on_cpu(context, &scene).map(|why| format!("{ON_CPU}{why}")),
            _ => None,
        };
        let mut open = OpenScene {
            context: context.clone(),
            device: options.device.clone(),
            exact_rounding: options.exact_rounding,
            engine: Engine::cpu(scene),
            info: DeviceInfo::cpu(),
            why,
            largest_film: 0,
            gone: None,
            losses: 0,
            progress: Progress::default(),
            known_progress: 0,
        };
        let on_cpu = match &options.device {
            Device::Cpu => true,
            Device::Auto => !cfg!(feature = "gpu") || open.why.is_some(),
            _ => false,
        };
        if !on_cpu {
            match open.adapter(None) {
                Ok((engine, info)) => open.take(engine, info),
                Err(Error::Render(why @ RenderError::NoDevice(_))) if options.device == Device::Auto => {
                    open.go_on_cpu(&why, on_fault);
                }
                Err(Error::Render(error)) => open.mend(error, on_fault)?,
                Err(error) => return Err(error),
            }
        }
        open.largest_film = open.engine.backend().largest_film();
        let reason = match (&open.why, &options.device) {
            (Some(why), _) => why.strip_prefix(ON_CPU).unwrap_or(why),
            (None, Device::Auto) if open.info == DeviceInfo::cpu() => "no adapter can render the scene",
            (None, Device::Auto) => "it is the best device",
            (None, _) => "it was requested",
        };
        tracing::info!(device = open.info.name, reason, "device selected");
        Ok(open)
    }

    /// Returns true if a render with these options can use this device and kernel. `layers`: the film has layers.
    pub fn suits(&self, options: &Options, layers: bool) -> bool {
        let requested = (&options.device, options.exact_rounding);
        (&self.device, self.exact_rounding) == requested
            && self.gone.is_none()
            && self.engine.scene().film_layout().layers == layers
    }

    /// Closes the scene and returns it. The device stays open in the context.
    pub fn into_scene(self) -> Arc<Packed> {
        self.engine.into_scene()
    }

    pub fn scene(&self) -> &Arc<Packed> {
        self.engine.scene()
    }

    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    pub fn progress(&self) -> Progress {
        self.progress.clone()
    }

    /// Edits the camera; the kernel must stay the same.
    ///
    /// # Errors
    ///
    /// The driver of the device reports an error or a loss.
    pub fn edit_camera(&mut self, edit: impl FnOnce(&mut Packed)) -> Result<(), RenderError> {
        self.engine.edit_camera(edit)
    }

    fn adapter(&self, wanted: Option<AcceptAdapter>) -> Result<(Engine, DeviceInfo), Error> {
        let scene = self.engine.scene();
        open_adapter(&self.context, scene, &self.device, self.exact_rounding, wanted)
    }

    /// Recovers from an error so that the work can be repeated, or returns the error.
    fn mend(&mut self, error: RenderError, on_fault: &mut FaultHandler) -> Result<(), RenderError> {
        match error {
            RenderError::Lost { device, message } => self.reopen(device, message, on_fault),
            RenderError::LoopTruncated { .. } => {
                self.go_on_cpu(&error, on_fault);
                Ok(())
            }
            RenderError::OutOfMemory { .. } | RenderError::TooLarge { .. } if self.device == Device::Auto => {
                self.go_on_cpu(&error, on_fault);
                Ok(())
            }
            other => Err(other),
        }
    }

    /// Opens the lost device again, or a replacement.
    fn reopen(&mut self, lost: String, message: String, on_fault: &mut FaultHandler) -> Result<(), RenderError> {
        let progress = self.progress.count();
        if progress > std::mem::replace(&mut self.known_progress, progress) {
            self.losses = 0;
        }
        let of = |message: String| RenderError::Lost {
            device: lost.clone(),
            message,
        };
        self.release(&lost, &message);
        let mut reason = None;
        while let Some(pause) = PAUSES.get(self.losses) {
            self.losses += 1;
            if reason.is_none() {
                (on_fault.tell)(&of(message.clone()), Recovery::Reopen);
            }
            on_fault.pause(*pause)?;
            let last = self.losses == PAUSES.len();
            let wanted = |name: &str, is_software: bool| match &self.device {
                _ if name == lost => true,
                Device::Gpu => last,
                Device::Auto => last && !is_software, // the CPU is faster
                Device::Named(_) | Device::Cpu => false,
            };
            match self.adapter(Some(&wanted)) {
                Ok((mut engine, info)) => {
                    if self.largest_film <= engine.backend().largest_film() {
                        self.take(engine, info);
                        return Ok(());
                    }
                    reason = Some(format!("{} has too little memory for the film", info.name));
                }
                Err(Error::Render(RenderError::Lost { message, .. })) => reason = Some(message),
                Err(why) => reason = Some(why.to_string()),
            }
        }
        let message = match reason {
            Some(why) => format!("{message}; it could not be opened again: {why}"),
            None => format!("{message}, repeatedly"),
        };
        let error = of(message.clone());
        match self.device {
            Device::Auto => {
                self.go_on_cpu(&error, on_fault);
                Ok(())
            }
            _ => {
                self.gone = Some((lost, message));
                Err(error)
            }
        }
    }

    fn release(&mut self, lost: &str, message: &str) {
        let scene = Arc::clone(self.engine.scene());
        let engine = std::mem::replace(&mut self.engine, Engine::cpu(scene));
        let _ = catch_panic(|| drop(engine)); // wgpu may panic, which has no consequence here
        #[cfg(feature = "gpu")]
        self.context.devices.remove(lost);
        self.gone = Some((lost.to_string(), message.to_string()));
    }

    fn take(&mut self, engine: Engine, info: DeviceInfo) {
        (self.engine, self.info) = (engine, info);
        self.gone = None;
    }

    fn go_on_cpu(&mut self, why: &RenderError, on_fault: &mut FaultHandler) {
        (on_fault.tell)(why, Recovery::Cpu);
        let scene = Arc::clone(self.engine.scene());
        self.take(Engine::cpu(scene), DeviceInfo::cpu());
    }
}

impl FaultHandler<'_> {
    fn pause(&self, length: Duration) -> Result<(), RenderError> {
        let start = Instant::now();
        loop {
            if (self.stopped)() {
                return Err(RenderError::Cancelled);
            }
            match length.saturating_sub(start.elapsed()) {
                Duration::ZERO => return Ok(()),
                left => std::thread::sleep(left.min(STOP_INTERVAL)),
            }
        }
    }
}

impl<'a> Renderer<'a> {
    pub fn new(open: &'a mut OpenScene, on_fault: FaultHandler<'a>) -> Renderer<'a> {
        Renderer { open, on_fault }
    }

    /// Returns the reason why [`Device::Auto`] chose the CPU although an adapter exists.
    #[cfg(feature = "cli")]
    pub fn why(&self) -> Option<&str> {
        self.open.why.as_deref()
    }

    pub fn info(&self) -> &DeviceInfo {
        self.open.info()
    }

    /// Returns the packed scene.
    pub fn scene(&self) -> &Arc<Packed> {
        self.open.scene()
    }

    /// Returns the maximum size of a film in pixels. The value does not change if another device replaces this one.
    pub fn largest_film(&self) -> u64 {
        self.open.largest_film
    }

    pub fn progress(&self) -> Progress {
        self.open.progress()
    }

    /// Runs `work`, and repeats it after reopening a lost device. With [`Device::Auto`], the CPU takes over permanently
    /// if reopening fails or memory is insufficient. With any device, the CPU takes over if the driver truncates loops.
    ///
    /// # Errors
    ///
    /// Any error returned by `work`; [`RenderError::Lost`] if the device cannot be opened again;
    /// [`RenderError::Cancelled`] if the renderer was stopped while it waited.
    pub fn work<T>(
        &mut self,
        mut work: impl FnMut(&mut dyn Backend, &DeviceInfo) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        let open = &mut *self.open;
        loop {
            if let Some((device, message)) = open.gone.clone() {
                return Err(RenderError::Lost { device, message });
            }
            match work(open.engine.backend(), &open.info) {
                Ok(value) => {
                    open.losses = 0;
                    return Ok(value);
                }
                Err(error) => open.mend(error, &mut self.on_fault)?,
            }
        }
    }
}

/// Reports faults as `tracing` warnings.
pub(crate) fn warnings() -> FaultHandler<'static> {
    FaultHandler {
        tell: Box::new(|why, remedy| match remedy {
            Recovery::Reopen => warn!("{why}; re-opening it"),
            Recovery::Cpu => warn!("rendering on the CPU: {why}"),
        }),
        stopped: Box::new(|| false), // the pauses are short
    }
}
