//! Errors of shaders, devices and renders.

use std::fmt;
use std::ops::Range;

use thiserror::Error;
use wgray_image::Region;

/// An error in a shader.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{place}: {message}")]
pub struct ShaderError {
    /// Source file, line and column, such as `camera.wgsl:12:9`, or the failed stage.
    pub place: String,
    /// The rule that the shader violates, without the location.
    pub message: String,
    /// The source line with marks below the error, if known.
    pub excerpt: Option<String>,
}

/// All errors found in the shaders, at least one.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub struct ShaderErrors(pub Vec<ShaderError>);

impl fmt::Display for ShaderErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, error) in self.0.iter().enumerate() {
            let separator = if i == 0 { "" } else { "\n" };
            write!(f, "{separator}{error}")?;
        }
        Ok(())
    }
}

/// Advice for systems without an adapter.
pub const HOW_TO_GET_VULKAN: &str =
    "on Debian, 'apt-get install mesa-vulkan-drivers' installs software Vulkan (lavapipe)";

/// The reason why no device matches a request.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum DeviceError {
    /// The system has no adapter.
    #[error("no Vulkan, Metal or DX12 adapter found; {HOW_TO_GET_VULKAN}")]
    NoneFound,
    /// No adapter has the requested name.
    #[error(
        "no adapter's name, driver or type contains '{requested}'; available: cpu, gpu, auto, {}",
        available.join("; ")
    )]
    NoMatch {
        /// The requested name.
        requested: String,
        /// The number, name and driver of each adapter.
        available: Vec<String>,
    },
    /// Adapters with different names match the request.
    #[error(
        "'{requested}' matches several adapters; use a longer name, a driver or a number: {}",
        matching.join("; ")
    )]
    Ambiguous {
        /// The requested name.
        requested: String,
        /// The number, name and driver of each matching adapter.
        matching: Vec<String>,
    },
    /// No adapter could be opened.
    #[error("{0}")]
    NotOpened(String),
    /// The library was built without the feature `gpu`.
    #[error("{requested}: only the CPU is available, because the crate was built without the feature \"gpu\"")]
    NotBuilt {
        /// The requested name in quotes, or `a GPU`.
        requested: String,
    },
}

/// An error that stops a render.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// No device matches the request.
    #[error(transparent)]
    NoDevice(#[from] DeviceError),
    /// A shader is invalid.
    #[error(transparent)]
    Shader(#[from] ShaderError),
    /// The driver reported an error.
    #[error("{device}: {message}")]
    Device {
        /// The adapter's name.
        device: String,
        /// The driver's message.
        message: String,
    },
    /// The device and its memory were lost, for example because the driver was reset. The caller can open a device
    /// again.
    #[error("{device}: the device was lost: {message}")]
    Lost {
        /// The adapter's name.
        device: String,
        /// The driver's message.
        message: String,
    },
    /// The device has too little memory.
    #[error("{device}: out of memory: {}", message.as_deref().unwrap_or("the driver has no more memory"))]
    OutOfMemory {
        /// The adapter's name.
        device: String,
        /// The failed allocation and the memory in use, if known.
        message: Option<String>,
    },
    /// The driver ends long loops early, even for a single sample of a pixel.
    #[error(
        "{device}: this driver ends long loops early, even for a single sample of a pixel; use fewer shapes, lights or \
         light samples, or the CPU"
    )]
    LoopTruncated {
        /// The adapter's name.
        device: String,
    },
    /// The scene exceeds a device limit.
    #[error("{device}: {message}; the CPU has no such limit")]
    TooLarge {
        /// The adapter's name.
        device: String,
        /// The size and the limit.
        message: String,
    },
    /// A method that needs a film was called before a film existed.
    #[error("no film exists; begin or resume a film first")]
    NoFilm,
    /// A method was called while a dispatch was pending.
    #[error("a dispatch is pending; call wait, or poll until poll returns true")]
    Pending,
    /// A region extends outside of the film or the image.
    #[error("the {what} x0,y0,x1,y1 = {region} must lie within the {of} {limits}")]
    Outside {
        /// Name of the region.
        what: &'static str,
        /// The region.
        region: Region,
        /// Name of the containing region.
        of: &'static str,
        /// The containing region.
        limits: Region,
    },
    /// The film cannot be resumed for this scene.
    #[error("the film does not fit the scene: {0}")]
    FilmMismatch(String),
    /// With adaptive sampling, further samples were requested before every pixel had its pilot samples, which determine
    /// the sample counts.
    #[error(
        "samples {} to {} were requested too early: some pixels of the film lack some of their first {pilot_samples} samples",
        samples.start, samples.end
    )]
    PilotIncomplete {
        /// The requested samples.
        samples: Range<u32>,
        /// Pilot samples per pixel.
        pilot_samples: u32,
    },
    /// An image of this size in bytes does not fit into memory.
    #[error("not enough memory: the image needs {} MiB; render a crop", .0 >> 20)]
    Memory(u64),
    /// A checkpoint or part cannot be read.
    #[error(transparent)]
    Input(std::io::Error),
    /// The caller cancelled the render.
    #[error("cancelled")]
    Cancelled,
    /// The output could not be written.
    #[error(transparent)]
    Output(#[from] std::io::Error),
}
