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
    /// The message.
    pub message: String,
    /// The marked source line and its neighbors, if known.
    pub excerpt: Option<String>,
}

/// All errors of the shaders; at least one.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub struct ShaderErrors(pub Vec<ShaderError>);

impl fmt::Display for ShaderErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, error) in self.0.iter().enumerate() {
            let line = if i == 0 { "" } else { "\n" };
            write!(f, "{line}{error}")?;
        }
        Ok(())
    }
}

/// Why an image could not be rendered.
#[derive(Debug, Error)]
pub enum RenderError {
    /// No device matches the request.
    #[error("{0}")]
    NoDevice(String),
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
    /// The device was lost with all of its memory, for example because its driver was reset. Another device may be
    /// opened.
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
        /// The failed allocation and the memory in use, once known.
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
    #[error("no film; begin or resume one first")]
    NoFilm,
    /// A method was called while a dispatch was pending.
    #[error("a call is pending; wait for it, or poll until it is done")]
    Pending,
    /// A region extends outside of the film or the image.
    #[error("the {what} x0,y0,x1,y1 = {region} must lie within the {of} {limits}")]
    Outside {
        /// Name of the region.
        what: &'static str,
        /// Its pixels.
        region: Region,
        /// Name of the region that must contain it.
        of: &'static str,
        /// Its pixels.
        limits: Region,
    },
    /// The film cannot be resumed for this scene.
    #[error("the film does not fit the scene: {0}")]
    FilmMismatch(String),
    /// With adaptive sampling, further samples were requested before every pixel had its pilot samples, which determine
    /// the number of samples needed.
    #[error(
        "samples {} to {} come too early: some pixels of the film do not have their first {first} yet",
        samples.start, samples.end
    )]
    PilotIncomplete {
        /// The requested samples.
        samples: Range<u32>,
        /// Pilot samples per pixel.
        first: u32,
    },
    /// An image of this size in bytes does not fit into memory.
    #[error("an image in memory needs {} MiB, which are not available; render a crop", .0 >> 20)]
    Memory(u64),
    /// A checkpoint or part cannot be read.
    #[error("{0}")]
    Input(std::io::Error),
    /// The work was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The output failed.
    #[error(transparent)]
    Output(#[from] std::io::Error),
}
