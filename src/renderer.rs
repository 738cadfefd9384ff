//! A scene on a device, which is opened again if it is lost, with the CPU as a fallback.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use web_time::Instant;
use wgray_image::panic_guard::catch_panic;
use wgray_render::backend::Backend;
use wgray_render::records::Packed;

use crate::device::{Device, DeviceInfo};
use crate::error::{Error, RenderError};
use crate::open::{Ready, adapter, cpu, faster_on_cpu};
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

pub struct Renderer<'a> {
    scene: &'a Packed,
    device: Device,
    exact_rounding: bool,
    backend: Box<dyn Backend + 'a>,
    info: DeviceInfo,
    why: Option<String>,
    on_fault: FaultHandler<'a>,
    /// The film size that was used to divide the work; a replacement device must support this size.
    needed_film: Option<u64>,
    /// The lost device and the reason, while no device is open.
    gone: Option<(String, String)>,
    losses: usize,
    progress: Progress,
    /// Value of `progress` at the last loss.
    known_progress: u64,
}

impl<'a> Renderer<'a> {
    /// Opens a device for a scene. With [`Device::Auto`] the CPU renders if no adapter exists, if the scene is too
    /// large for the adapter, or if the adapter is lost permanently; `on_fault` reports the reason.
    ///
    /// # Errors
    ///
    /// No device matches the request, the scene does not fit, the driver fails, or [`Options::exact_rounding`] is set for an adapter that
    /// does not use Vulkan.
    pub fn new(scene: &'a Packed, options: &Options, on_fault: FaultHandler<'a>) -> Result<Renderer<'a>, Error> {
        let (backend, info) = cpu(scene);
        let mut renderer = Renderer {
            scene,
            device: options.device.clone(),
            exact_rounding: options.exact_rounding,
            needed_film: None,
            gone: None,
            backend,
            info,
            why: match options.device {
                Device::Auto => faster_on_cpu(scene).map(|why| format!("{ON_CPU}{why}")),
                _ => None,
            },
            on_fault,
            losses: 0,
            progress: Progress::default(),
            known_progress: 0,
        };
        match &options.device {
            Device::Cpu => return Ok(renderer),
            Device::Auto if !cfg!(feature = "gpu") || renderer.why.is_some() => return Ok(renderer),
            _ => {}
        }
        match adapter(scene, &options.device, options.exact_rounding, &|_, _| true) {
            Ok(ready) => renderer.take(ready),
            Err(Error::Render(why @ RenderError::NoDevice(_))) if options.device == Device::Auto => {
                renderer.go_on_cpu(&why);
            }
            Err(Error::Render(error)) => renderer.mend(error)?,
            Err(error) => return Err(error),
        }
        renderer.needed_film = Some(renderer.backend.largest_film());
        Ok(renderer)
    }

    /// Returns the reason why [`Device::Auto`] chose the CPU although an adapter exists.
    #[cfg(feature = "cli")]
    pub fn why(&self) -> Option<&str> {
        self.why.as_deref()
    }

    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Returns the maximum size of a film in pixels. The value does not change if another device replaces this one.
    pub fn largest_film(&self) -> u64 {
        self.needed_film.unwrap_or_else(|| self.backend.largest_film())
    }

    pub fn progress(&self) -> Progress {
        self.progress.clone()
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
        loop {
            if let Some((device, message)) = self.gone.clone() {
                return Err(RenderError::Lost { device, message });
            }
            match work(self.backend.as_mut(), &self.info) {
                Ok(value) => {
                    self.losses = 0;
                    return Ok(value);
                }
                Err(error) => self.mend(error)?,
            }
        }
    }

    /// Recovers from an error so that the work can be repeated, or returns the error.
    fn mend(&mut self, error: RenderError) -> Result<(), RenderError> {
        match error {
            RenderError::Lost { device, message } => self.reopen(device, message),
            RenderError::LoopTruncated { .. } => {
                self.go_on_cpu(&error);
                Ok(())
            }
            RenderError::OutOfMemory { .. } | RenderError::TooLarge { .. } if self.device == Device::Auto => {
                self.go_on_cpu(&error);
                Ok(())
            }
            other => Err(other),
        }
    }

    /// Opens the lost device again, or a replacement.
    fn reopen(&mut self, lost: String, message: String) -> Result<(), RenderError> {
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
                (self.on_fault.tell)(&of(message.clone()), Recovery::Reopen);
            }
            self.pause(*pause)?;
            let last = self.losses == PAUSES.len();
            let wanted = |name: &str, is_software: bool| match &self.device {
                _ if name == lost => true,
                Device::Gpu => last,
                Device::Auto => last && !is_software, // the CPU is faster
                Device::Named(_) | Device::Cpu => false,
            };
            match adapter(self.scene, &self.device, self.exact_rounding, &wanted) {
                Ok((backend, info)) if self.needed_film.is_none_or(|needed| needed <= backend.largest_film()) => {
                    self.take((backend, info));
                    return Ok(());
                }
                Ok((_, info)) => reason = Some(format!("{} has too little memory for the film", info.name)),
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
                self.go_on_cpu(&error);
                Ok(())
            }
            _ => {
                self.gone = Some((lost, message));
                Err(error)
            }
        }
    }

    fn release(&mut self, lost: &str, message: &str) {
        let (cpu, _) = cpu(self.scene);
        let backend = std::mem::replace(&mut self.backend, cpu);
        let _ = catch_panic(|| drop(backend)); // wgpu may panic, which has no consequence here
        self.gone = Some((lost.to_string(), message.to_string()));
    }

    fn pause(&self, length: Duration) -> Result<(), RenderError> {
        let start = Instant::now();
        loop {
            if (self.on_fault.stopped)() {
                return Err(RenderError::Cancelled);
            }
            match length.saturating_sub(start.elapsed()) {
                Duration::ZERO => return Ok(()),
                left => std::thread::sleep(left.min(STOP_INTERVAL)),
            }
        }
    }

    fn take(&mut self, (backend, info): Ready<'a>) {
        (self.backend, self.info) = (backend, info);
        self.gone = None;
    }

    fn go_on_cpu(&mut self, why: &RenderError) {
        (self.on_fault.tell)(why, Recovery::Cpu);
        self.take(cpu(self.scene));
    }
}
