//! What renders: the choice among the CPU and the adapters of the machine, and the CPU that takes over where an adapter
//! cannot do the work.

use crate::backend::Backend;
use crate::cpu::Cpu;
use crate::error::{Error, RenderError};
#[cfg(feature = "gpu")]
use crate::gpu::{self, Gpu, Rounding, compose::Shaders};
use crate::pack::Packed;
use crate::render::Options;
#[cfg(feature = "gpu")]
use crate::scene::Problem;

/// Which device a render asks for. Without the feature `gpu` there is the CPU alone.
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

/// A scene on a device, with the CPU to fall back on.
pub struct Renderer<'a> {
    scene: &'a Packed,
    backend: Box<dyn Backend + 'a>,
    info: DeviceInfo,
    why: Option<String>,
    on_cpu: Box<dyn FnMut(&RenderError) + 'a>,
}

impl<'a> Renderer<'a> {
    /// Makes a device ready for a scene. With [`Device::Auto`] the CPU renders where there is no adapter, and where the
    /// scene is too large for it; `on_cpu` is told why.
    ///
    /// # Errors
    ///
    /// No device that fits the choice, scenes that it has no room for, what its driver refuses, and
    /// [`Options::exact_rounding`] on an adapter that is not reached by Vulkan.
    pub fn new(
        scene: &'a Packed,
        options: &Options,
        mut on_cpu: Box<dyn FnMut(&RenderError) + 'a>,
    ) -> Result<Renderer<'a>, Error> {
        let device = &options.device;
        let why = match device {
            Device::Auto => faster_on_cpu(scene),
            _ => None,
        };
        let (backend, info) = match device {
            Device::Cpu => cpu(scene),
            Device::Auto if !cfg!(feature = "gpu") || why.is_some() => cpu(scene),
            _ => match adapter(scene, device, options.exact_rounding) {
                Err(Error::Render(why @ (RenderError::NoDevice(_) | RenderError::TooLarge { .. })))
                    if *device == Device::Auto =>
                {
                    on_cpu(&why);
                    cpu(scene)
                }
                ready => ready?,
            },
        };
        Ok(Renderer {
            scene,
            backend,
            info,
            why,
            on_cpu,
        })
    }

    /// Why [`Device::Auto`] chose the CPU though there is an adapter.
    pub fn why(&self) -> Option<&str> {
        self.why.as_deref()
    }

    /// What it renders on now.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// The largest film that the device can have, in pixels.
    pub fn largest_film(&self) -> u64 {
        self.backend.largest_film()
    }

    /// Does work on the device, which is told what it is. If the driver cuts it short, the CPU does it, and all that follows: it has no such limit.
    ///
    /// # Errors
    ///
    /// The errors of the work.
    pub fn work<T>(
        &mut self,
        mut work: impl FnMut(&mut dyn Backend, &DeviceInfo) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        match work(self.backend.as_mut(), &self.info) {
            Err(why @ RenderError::CutShort { .. }) => {
                (self.on_cpu)(&why);
                (self.backend, self.info) = cpu(self.scene);
                work(self.backend.as_mut(), &self.info)
            }
            other => other,
        }
    }
}

fn cpu(scene: &Packed) -> Ready<'_> {
    let threads = rayon::current_num_threads();
    let info = DeviceInfo {
        name: "cpu".to_string(),
        driver: format!("wgray {}, {threads} threads", env!("CARGO_PKG_VERSION")),
        interface: "cpu".to_string(),
    };
    (Box::new(Cpu::new(scene)), info)
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
        format!("rendering on the CPU: there is no GPU, and the CPU walks trees of boxes faster than {name}, which --device gpu asks for")
    })
}

#[cfg(not(feature = "gpu"))]
fn faster_on_cpu(_: &Packed) -> Option<String> {
    None
}

#[cfg(feature = "gpu")]
fn adapter<'a>(scene: &'a Packed, device: &Device, exact_rounding: bool) -> Result<Ready<'a>, Error> {
    let choice = match device {
        Device::Named(name) => gpu::Choice::Named(name.clone()),
        Device::Auto => gpu::Choice::Auto,
        Device::Gpu | Device::Cpu => gpu::Choice::Gpu,
    };
    let opened = gpu::choose(&choice).map_err(|error| match device {
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
            let rule = format!("needs a Vulkan device, {} is {}", info.name, info.interface);
            return Err(Error::Option(Problem::of("exact_rounding", rule)));
        }
        options.exact = Some(Rounding::Software);
    }
    let gpu = Gpu::new(&opened, scene, &Shaders::built_in(), options)?;
    Ok((Box::new(gpu), info))
}

#[cfg(not(feature = "gpu"))]
fn adapter<'a>(_: &'a Packed, device: &Device, _: bool) -> Result<Ready<'a>, Error> {
    let asked = match device {
        Device::Named(name) => format!("'{name}'"),
        _ => "a GPU".to_string(),
    };
    Err(Error::Render(RenderError::NoDevice(format!(
        "{asked}: there is the CPU alone, as the crate was built without its feature \"gpu\""
    ))))
}
