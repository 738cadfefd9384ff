//! A scene on a device. A lost device is opened again; if this fails, the CPU can replace it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tracing::warn;
use wgray_image::panic_guard::catch_panic;
use wgray_render::backend::Backend;
use wgray_render::clock::Instant;
use wgray_trace::film::{Film, FilmLayout};
use wgray_trace::records::Packed;

use crate::context::Context;
use crate::device::{Device, DeviceInfo};
use crate::device_cost::{Selection, Workload, select_without_gpu};
use crate::error::{Error, RenderError};
use crate::open::{AcceptAdapter, Engine, open_adapter};
use crate::options::Options;

/// The recovery from a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recovery {
    /// The lost device is opened again.
    Reopen,
    /// The CPU renders.
    Cpu,
}

/// The callback that reports a fault from which the renderer recovers.
pub type FaultCallback<'a> = Box<dyn FnMut(&RenderError, Recovery) + 'a>;

pub struct FaultHandler<'a> {
    pub report: FaultCallback<'a>,
    /// Returns true if the renderer should stop waiting for a lost device.
    pub is_stopped: Box<dyn Fn() -> bool + 'a>,
}

/// Pauses before successive attempts to open a lost device. Any progress resets the count of attempts.
const PAUSES: [Duration; 3] = [Duration::ZERO, Duration::from_millis(500), Duration::from_secs(2)];

/// Interval at which the stop callback is polled during a pause.
const STOP_INTERVAL: Duration = Duration::from_millis(20);

/// Counts results that remain valid if the device is lost. The renderer gives up only after several losses without
/// progress in between.
#[derive(Clone, Debug, Default)]
pub struct ProgressCounter(Arc<AtomicU64>);

impl ProgressCounter {
    pub fn increment(&self) {
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
    /// The selection of [`Device::Auto`] between the CPU and software Vulkan.
    selection: Option<Selection>,
    /// Maximum size of a film in pixels. The bands depend on it, so a replacement device must support this size.
    largest_film: u64,
    /// The lost device and the message of the loss, while no device is open.
    lost: Option<(String, String)>,
    /// Losses without progress in between.
    losses: usize,
    progress: ProgressCounter,
    /// Count of `progress` at the last loss.
    progress_at_loss: u64,
}

/// Renders an open scene, and recovers from faults of its device.
pub struct Renderer<'a> {
    open: &'a mut OpenScene,
    on_fault: FaultHandler<'a>,
}

impl OpenScene {
    /// Opens a device for a scene. With [`Device::Auto`] the CPU renders if no adapter exists, if the CPU is faster for
    /// this workload, if the scene is too large for the adapter, or if the adapter is lost permanently; `on_fault`
    /// reports the reason.
    ///
    /// # Errors
    ///
    /// No device matches the request, the scene does not fit, the driver fails, or [`Options::exact_rounding`] is set
    /// for an adapter that does not use Vulkan.
    pub fn new(
        context: &Context,
        scene: Arc<Packed>,
        options: &Options,
        workload: Workload,
        on_fault: &mut FaultHandler,
    ) -> Result<OpenScene, Error> {
        let selection = match options.device {
            Device::Auto => select_without_gpu(context, &scene, workload),
            _ => None,
        };
        let mut open = OpenScene {
            context: context.clone(),
            device: options.device.clone(),
            exact_rounding: options.exact_rounding,
            engine: Engine::cpu(scene),
            info: DeviceInfo::cpu(),
            selection,
            largest_film: 0,
            lost: None,
            losses: 0,
            progress: ProgressCounter::default(),
            progress_at_loss: 0,
        };
        let on_cpu = match &options.device {
            Device::Cpu => true,
            Device::Auto => !cfg!(feature = "gpu") || open.cpu_reason().is_some(),
            _ => false,
        };
        if !on_cpu {
            match open.open_adapter(None) {
                Ok((engine, info)) => open.use_engine(engine, info),
                Err(Error::Render(error @ RenderError::NoDevice(_))) if options.device == Device::Auto => {
                    open.fall_back_to_cpu(&error, on_fault);
                }
                Err(Error::Render(error)) => open.recover(error, on_fault)?,
                Err(error) => return Err(error),
            }
        }
        open.engine.prepare();
        open.largest_film = open.engine.backend().largest_film();
        let reason = match (&open.selection, &options.device) {
            (Some(selection), _) => &selection.reason,
            (None, Device::Auto) if open.info == DeviceInfo::cpu() => "no adapter can render the scene",
            (None, Device::Auto) => "it is the best device",
            (None, _) => "it was requested",
        };
        tracing::info!(device = open.info.name, reason, "device selected");
        Ok(open)
    }

    /// Returns true if a render with these options and this layout of the film can use this device and kernel.
    pub fn suits(&self, options: &Options, film_layout: FilmLayout) -> bool {
        let requested = (&options.device, options.exact_rounding);
        (&self.device, self.exact_rounding) == requested
            && self.lost.is_none()
            && self.engine.scene().film_layout() == film_layout
    }

    /// Returns false if [`Device::Auto`] selected the CPU for less work, and an adapter is faster for these images.
    pub fn is_fast_enough(&self, workload: Workload) -> bool {
        let select = || select_without_gpu(&self.context, self.engine.scene(), workload);
        self.cpu_reason().is_none() || select().is_none_or(|selection| selection.is_cpu)
    }

    /// Returns the reason why [`Device::Auto`] selected the CPU although an adapter exists.
    fn cpu_reason(&self) -> Option<&str> {
        let selection = self.selection.as_ref().filter(|selection| selection.is_cpu);
        selection.map(|selection| &*selection.reason)
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

    pub fn progress_counter(&self) -> ProgressCounter {
        self.progress.clone()
    }

    /// Edits the camera; the kernel must stay the same.
    ///
    /// # Errors
    ///
    /// The device is lost, or its driver reports an error.
    pub fn edit_camera(&mut self, edit: impl FnOnce(&mut Packed)) -> Result<(), RenderError> {
        self.engine.edit_camera(edit)
    }

    /// Opens an adapter for the scene: any that matches the request, or with `accept` only one that is accepted.
    fn open_adapter(&self, accept: Option<AcceptAdapter>) -> Result<(Engine, DeviceInfo), Error> {
        let scene = self.engine.scene();
        open_adapter(&self.context, scene, &self.device, self.exact_rounding, accept)
    }

    /// Recovers from an error so that the work can be repeated, or returns the error.
    fn recover(&mut self, error: RenderError, on_fault: &mut FaultHandler) -> Result<(), RenderError> {
        match error {
            RenderError::Lost { device, message } => self.reopen(device, message, on_fault),
            RenderError::LoopTruncated { .. } => {
                self.fall_back_to_cpu(&error, on_fault);
                Ok(())
            }
            RenderError::OutOfMemory { .. } | RenderError::TooLarge { .. } if self.device == Device::Auto => {
                self.fall_back_to_cpu(&error, on_fault);
                Ok(())
            }
            error => Err(error),
        }
    }

    /// Opens the lost device again, or a replacement.
    fn reopen(&mut self, lost: String, message: String, on_fault: &mut FaultHandler) -> Result<(), RenderError> {
        let progress = self.progress.count();
        if progress > std::mem::replace(&mut self.progress_at_loss, progress) {
            self.losses = 0;
        }
        let lost_error = |message: String| RenderError::Lost {
            device: lost.clone(),
            message,
        };
        self.release(&lost, &message);
        let mut reason = None;
        while let Some(pause) = PAUSES.get(self.losses) {
            self.losses += 1;
            if reason.is_none() {
                (on_fault.report)(&lost_error(message.clone()), Recovery::Reopen);
            }
            on_fault.pause(*pause)?;
            let is_last = self.losses == PAUSES.len();
            let accept = |name: &str, is_software: bool| match &self.device {
                _ if name == lost => true,
                Device::Gpu => is_last,
                Device::Auto => is_last && !is_software, // the CPU is about as fast as software Vulkan
                Device::Named(_) | Device::Cpu => false,
            };
            match self.open_adapter(Some(&accept)) {
                Ok((mut engine, info)) => {
                    if self.largest_film <= engine.backend().largest_film() {
                        self.use_engine(engine, info);
                        return Ok(());
                    }
                    reason = Some(format!("{} has too little memory for the film", info.name));
                }
                Err(Error::Render(RenderError::Lost { message, .. })) => reason = Some(message),
                Err(error) => reason = Some(error.to_string()),
            }
        }
        let message = match reason {
            Some(reason) => format!("{message}; it could not be opened again: {reason}"),
            None => format!("{message}, repeatedly"),
        };
        let error = lost_error(message);
        match self.device {
            Device::Auto => {
                self.fall_back_to_cpu(&error, on_fault);
                Ok(())
            }
            _ => Err(error),
        }
    }

    /// Closes the lost device.
    fn release(&mut self, lost_device: &str, message: &str) {
        let scene = Arc::clone(self.engine.scene());
        let engine = std::mem::replace(&mut self.engine, Engine::cpu(scene));
        let _ = catch_panic(|| drop(engine)); // wgpu may panic; the device is lost anyway
        #[cfg(feature = "gpu")]
        self.context.devices.remove(lost_device);
        self.lost = Some((lost_device.to_string(), message.to_string()));
    }

    fn use_engine(&mut self, engine: Engine, info: DeviceInfo) {
        (self.engine, self.info) = (engine, info);
        self.lost = None;
    }

    fn fall_back_to_cpu(&mut self, error: &RenderError, on_fault: &mut FaultHandler) {
        (on_fault.report)(error, Recovery::Cpu);
        let scene = Arc::clone(self.engine.scene());
        self.use_engine(Engine::cpu(scene), DeviceInfo::cpu());
    }
}

impl FaultHandler<'_> {
    /// Waits; fails if the renderer is stopped.
    fn pause(&self, duration: Duration) -> Result<(), RenderError> {
        let start = Instant::now();
        loop {
            if (self.is_stopped)() {
                return Err(RenderError::Cancelled);
            }
            match duration.saturating_sub(start.elapsed()) {
                Duration::ZERO => return Ok(()),
                remaining => std::thread::sleep(remaining.min(STOP_INTERVAL)),
            }
        }
    }
}

impl<'a> Renderer<'a> {
    pub fn new(open: &'a mut OpenScene, on_fault: FaultHandler<'a>) -> Renderer<'a> {
        if open.engine.is_cpu() && open.lost.is_none() {
            open.info = DeviceInfo::cpu(); // the number of threads is that of the current pool
        }
        Renderer { open, on_fault }
    }

    /// Returns the reason why [`Device::Auto`] selected the CPU although an adapter exists.
    #[cfg(feature = "cli")]
    pub fn cpu_reason(&self) -> Option<&str> {
        self.open.cpu_reason()
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

    pub fn progress_counter(&self) -> ProgressCounter {
        self.open.progress_counter()
    }

    /// Denoises a finished film with noise estimates, and recovers from faults like [`Renderer::work`].
    ///
    /// # Errors
    ///
    /// The errors of [`Renderer::work`].
    pub fn denoise(&mut self, film: &mut Film) -> Result<(), RenderError> {
        while let Err(error) = self.open.engine.denoise(film) {
            self.open.recover(error, &mut self.on_fault)?;
        }
        Ok(())
    }

    /// Runs `work`, and repeats it after reopening a lost device. A device that an earlier call lost is opened first.
    /// With [`Device::Auto`], the CPU takes over permanently if reopening fails or memory is insufficient. With any
    /// device, the CPU takes over if the driver truncates loops.
    ///
    /// # Errors
    ///
    /// Any error returned by `work`; [`RenderError::Lost`] if the device cannot be opened again;
    /// [`RenderError::Cancelled`] if the renderer is stopped while it waits for a lost device.
    pub fn work<T>(
        &mut self,
        mut work: impl FnMut(&mut dyn Backend, &DeviceInfo) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        let open = &mut *self.open;
        loop {
            if let Some((device, message)) = open.lost.take() {
                open.losses = 0;
                open.reopen(device, message, &mut self.on_fault)?;
            }
            match work(open.engine.backend(), &open.info) {
                Ok(value) => {
                    open.losses = 0;
                    return Ok(value);
                }
                Err(error) if open.engine.is_cpu() => return Err(error),
                Err(error) => open.recover(error, &mut self.on_fault)?,
            }
        }
    }
}

/// Reports faults as `tracing` warnings.
pub(crate) fn warnings() -> FaultHandler<'static> {
    FaultHandler {
        report: Box::new(|error, recovery| match recovery {
            Recovery::Reopen => warn!("{error}; re-opening it"),
            Recovery::Cpu => warn!("rendering on the CPU: {error}"),
        }),
        is_stopped: Box::new(|| false), // the pauses are short
    }
}
