//! What renders: the choice among the CPU and the adapters of the machine, the device that is opened anew where one was lost,
//! and the CPU that takes over where an adapter cannot do the work.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::backend::Backend;
use crate::contain::contained;
use crate::cpu::Cpu;
use crate::error::{Error, RenderError};
#[cfg(feature = "gpu")]
use crate::gpu::{self, Gpu, Rounding, compose::Shaders};
use crate::pack::Packed;
use crate::render::Options;
#[cfg(feature = "gpu")]
use crate::scene::Problem;

/// Which device a render asks for. Without the feature `gpu` only the CPU is available.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Device {
    /// A real GPU; else software Vulkan for scenes without trees (meshes, or more than 64 bounded primitives), and the CPU for
    /// those with, which it walks faster; the CPU where there is no adapter.
    #[default]
    Auto,
    /// The CPU, without any driver.
    Cpu,
    /// Any adapter: a real GPU, else software Vulkan.
    Gpu,
    /// The adapter with this text as part of its name, driver or type, or with this number in the list of all adapters,
    /// counted from 1.
    Named(String),
}

impl From<&str> for Device {
    /// `auto`, `cpu` and `gpu`, in any case of letters, are those choices; any other text is an adapter's name.
    fn from(name: &str) -> Device {
        match name.to_lowercase().as_str() {
            "auto" => Device::Auto,
            "cpu" => Device::Cpu,
            "gpu" => Device::Gpu,
            _ => Device::Named(name.to_string()),
        }
    }
}

/// What a picture is rendered on.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceInfo {
    /// The adapter's name, or `cpu`.
    pub name: String,
    /// The driver's name and version; for the CPU those of this crate, and the number of threads.
    pub driver: String,
    /// The interface to the driver, such as `vulkan`, or `cpu`.
    pub interface: String,
}

type Ready<'a> = (Box<dyn Backend + 'a>, DeviceInfo);

/// What is done about a fault of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recovery {
    /// The device is opened anew.
    Reopen,
    /// The CPU renders from now on.
    Cpu,
}

/// What is told of a fault that does not end the work.
pub type Tell<'a> = Box<dyn FnMut(&RenderError, Recovery) + 'a>;

/// Whom a renderer turns to at a fault.
pub struct FaultHandler<'a> {
    /// Is told of a fault that does not end the work, and what is done about it.
    pub tell: Tell<'a>,
    /// Tells whether to give up while a lost device is waited for.
    pub stopped: Box<dyn Fn() -> bool + 'a>,
}

/// So long a lost device is given to come back before it is opened anew, time after time without any progress in between.
const PAUSES: [Duration; 3] = [Duration::ZERO, Duration::from_millis(500), Duration::from_secs(2)];

/// So often a pause is looked up from.
const LOOK: Duration = Duration::from_millis(20);

/// Tells a renderer, in the midst of its work, that the work has come further in a way that a loss of the device does not undo.
/// Losses are counted from there: work that comes on between them goes on, however many there are.
#[derive(Clone, Debug, Default)]
pub struct Progress(Arc<AtomicU64>);

impl Progress {
    /// Something was finished for good.
    pub fn made(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn count(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// A scene on a device, which is opened anew if it is lost, with the CPU to fall back on.
pub struct Renderer<'a> {
    scene: &'a Packed,
    device: Device,
    exact_rounding: bool,
    backend: Box<dyn Backend + 'a>,
    info: DeviceInfo,
    why: Option<String>,
    on_fault: FaultHandler<'a>,
    /// The film that work may be cut for, once that is known: a device that takes the place of another must have room for it.
    needed_film: Option<u64>,
    /// The device that was lost, and why, while there is no other.
    gone: Option<(String, String)>,
    /// How often the device was lost since there was progress.
    losses: usize,
    progress: Progress,
    /// What it counted at the last loss.
    known_progress: u64,
}

impl<'a> Renderer<'a> {
    /// Makes a device ready for a scene. With [`Device::Auto`] the CPU renders where there is no adapter, where the scene is
    /// too large for it, and where it is lost and does not come back; `on_fault` is told why.
    ///
    /// # Errors
    ///
    /// No device that fits the choice, scenes that it has no room for, what its driver refuses or loses, and
    /// [`Options::exact_rounding`] on an adapter that is not reached by Vulkan.
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
                Device::Auto => faster_on_cpu(scene),
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

    /// Why [`Device::Auto`] chose the CPU though there is an adapter.
    pub fn why(&self) -> Option<&str> {
        self.why.as_deref()
    }

    /// What it renders on now.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// The largest film that the device can have, in pixels. It stays so when another device takes its place.
    pub fn largest_film(&self) -> u64 {
        self.needed_film.unwrap_or_else(|| self.backend.largest_film())
    }

    /// What work can tell its progress by.
    pub fn progress(&self) -> Progress {
        self.progress.clone()
    }

    /// Does work on the device, which is told what it is. If the device is lost, it is opened anew and does the work again.
    /// Where it does not come back, or has no memory for the work, and [`Device::Auto`] chose it, the CPU does it, and all that
    /// follows; so it does, whatever the choice, where the driver cuts the work short, as the CPU has no such limit.
    ///
    /// # Errors
    ///
    /// The errors of the work; [`RenderError::Lost`] if the device does not come back; [`RenderError::Cancelled`] if the
    /// renderer was told to stop while it waited for that.
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

    /// Does what there is to do about an error, after which work can be done again; or returns it.
    fn mend(&mut self, error: RenderError) -> Result<(), RenderError> {
        match error {
            RenderError::Lost { device, message } => self.open_anew(device, message),
            RenderError::CutShort { .. } => {
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

    /// Opens the lost device anew, or one that may take its place.
    fn open_anew(&mut self, lost: String, message: String) -> Result<(), RenderError> {
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
            let wanted = |name: &str, kind: &str| match &self.device {
                _ if name == lost => true,
                Device::Gpu => last,
                Device::Auto => last && kind != "software", // the CPU is faster
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

    /// Gives back what is on a lost device.
    fn release(&mut self, lost: &str, message: &str) {
        let (cpu, _) = cpu(self.scene);
        let backend = std::mem::replace(&mut self.backend, cpu);
        let _ = contained(|| drop(backend)); // wgpu may panic, and nothing is left to be done about that
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
                left => std::thread::sleep(left.min(LOOK)),
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

/// What a render would begin on, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Foreseen {
    /// The device.
    pub info: DeviceInfo,
    /// Why that one.
    pub why: String,
    /// The adapter, if it is one, and what it would do.
    #[cfg(feature = "gpu")]
    pub adapter: Option<(gpu::Info, gpu::Foreseen)>,
}

/// Says what a render would begin on. No device is opened. One that then cannot be opened, or has no room for the scene, gives way to
/// the next, or to the CPU.
///
/// # Errors
///
/// [`RenderError::NoDevice`] if no device fits.
pub fn foresee(scene: &Packed, device: &Device) -> Result<Foreseen, RenderError> {
    let on_cpu = |why: String| Foreseen {
        info: cpu_info(),
        why,
        #[cfg(feature = "gpu")]
        adapter: None,
    };
    match device {
        Device::Cpu => return Ok(on_cpu("requested".to_owned())),
        Device::Auto if !cfg!(feature = "gpu") => {
            return Ok(on_cpu("this build has no GPU support (feature \"gpu\")".to_owned()));
        }
        Device::Auto => {
            if let Some(why) = faster_on_cpu(scene) {
                let why = why.strip_prefix(ON_CPU).unwrap_or(&why).to_owned();
                return Ok(on_cpu(why));
            }
        }
        _ => {}
    }
    match preferred(scene, device) {
        Err(RenderError::NoDevice(why)) if *device == Device::Auto => Ok(on_cpu(why)),
        other => other,
    }
}

#[cfg(feature = "gpu")]
fn preferred(scene: &Packed, device: &Device) -> Result<Foreseen, RenderError> {
    let info = gpu::preferred(&choice_of(device))?;
    let why = match (device, info.kind) {
        (Device::Named(_), _) => "requested",
        (_, "software") => {
            "no hardware GPU found, and software Vulkan is faster than the CPU for a scene without a BVH"
        }
        _ => "the first hardware GPU",
    };
    let why = match device {
        Device::Gpu if info.kind == "software" => "no hardware GPU found",
        _ => why,
    };
    let foreseen = gpu::foresee(scene, &info);
    Ok(Foreseen {
        info: DeviceInfo {
            name: info.name.clone(),
            driver: info.driver.clone(),
            interface: info.backend.clone(),
        },
        why: why.to_owned(),
        adapter: Some((info, foreseen)),
    })
}

#[cfg(not(feature = "gpu"))]
fn preferred(scene: &Packed, device: &Device) -> Result<Foreseen, RenderError> {
    match adapter(scene, device, false, &|_, _| true) {
        Err(Error::Render(error)) => Err(error),
        _ => Err(RenderError::NoDevice("only the CPU is available".to_owned())),
    }
}

#[cfg(feature = "gpu")]
fn choice_of(device: &Device) -> gpu::Choice {
    match device {
        Device::Named(name) => gpu::Choice::Named(name.clone()),
        Device::Auto => gpu::Choice::Auto,
        Device::Gpu | Device::Cpu => gpu::Choice::Gpu,
    }
}

fn cpu_info() -> DeviceInfo {
    let threads = rayon::current_num_threads();
    DeviceInfo {
        name: "cpu".to_string(),
        driver: format!("wgray {}, {threads} threads", env!("CARGO_PKG_VERSION")),
        interface: "cpu".to_string(),
    }
}

/// How a message begins that says why the CPU was chosen.
const ON_CPU: &str = "rendering on the CPU: ";

fn cpu(scene: &Packed) -> Ready<'_> {
    (Box::new(Cpu::new(scene)), cpu_info())
}

/// Whether the CPU is faster for a scene than what else there is, and why: measured in `docs/performance.md`.
#[cfg(feature = "gpu")]
fn faster_on_cpu(scene: &Packed) -> Option<String> {
    if scene.specialization.in_tree == 0 {
        return None;
    }
    let adapter = gpu::adapters().into_iter().next()?;
    (adapter.kind == "software").then(|| {
        let name = adapter.name;
        format!("{ON_CPU}no GPU found, and the CPU traverses the BVH faster than {name}; use --device gpu to override")
    })
}

#[cfg(not(feature = "gpu"))]
fn faster_on_cpu(_: &Packed) -> Option<String> {
    None
}

/// A scene on an adapter that fits the choice, and whose name and type are wanted.
#[cfg(feature = "gpu")]
fn adapter<'a>(
    scene: &'a Packed,
    device: &Device,
    exact_rounding: bool,
    wanted: &dyn Fn(&str, &str) -> bool,
) -> Result<Ready<'a>, Error> {
    let choice = choice_of(device);
    let wanted = |info: &gpu::Info| wanted(&info.name, info.kind);
    let opened = gpu::choose_among(&choice, &wanted).map_err(|error| match device {
        Device::Auto => RenderError::NoDevice(error.to_string()),
        _ => error,
    })?;
    let info = DeviceInfo {
        name: opened.info.name.clone(),
        driver: opened.info.driver.clone(),
        interface: opened.info.backend.clone(),
    };
    tracing::info!(device = info.name, driver = info.driver, "device open");
    let mut options = gpu::Options::best(&opened);
    if exact_rounding {
        if !opened.info.exact {
            let rule = format!("needs a Vulkan device; {} uses {}", info.name, info.interface);
            return Err(Error::Option(Problem::of("exact_rounding", rule)));
        }
        options.exact = Some(Rounding::Software);
    }
    let gpu = Gpu::new(&opened, scene, &Shaders::built_in(), options)?;
    Ok((Box::new(gpu), info))
}

#[cfg(not(feature = "gpu"))]
fn adapter<'a>(_: &'a Packed, device: &Device, _: bool, _: &dyn Fn(&str, &str) -> bool) -> Result<Ready<'a>, Error> {
    let asked = match device {
        Device::Named(name) => format!("'{name}'"),
        _ => "a GPU".to_string(),
    };
    Err(Error::Render(RenderError::NoDevice(format!(
        "{asked}: only the CPU is available, because the crate was built without the feature \"gpu\""
    ))))
}
