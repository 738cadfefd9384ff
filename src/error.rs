//! What can go wrong, as types.

use std::fmt;
use std::ops::Range;

use thiserror::Error;

use crate::film::Region;
use crate::scene::{Problem, SceneError};

/// What can go wrong between a scene and its picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene file that is no scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A description, made in code, that is no scene.
    #[error(transparent)]
    Description(#[from] Problem),
    /// An option of a render that does not fit the scene or the device.
    #[error("{0}")]
    Option(Problem),
    /// A picture that could not be rendered or written.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// A shader that naga refuses: where and why.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{place}: {message}")]
pub struct ShaderError {
    /// File, line and column that the author wrote, `camera.wgsl:12:9`; or the stage that failed.
    pub place: String,
    /// What is wrong.
    pub message: String,
    /// The source around the place, with the place marked, if there is one.
    pub excerpt: Option<String>,
}

/// All that is wrong with shaders: one mistake at least.
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

/// Why a picture could not be rendered.
#[derive(Debug, Error)]
pub enum RenderError {
    /// No device fits what was asked for.
    #[error("{0}")]
    NoDevice(String),
    /// The shaders are wrong.
    #[error(transparent)]
    Shader(#[from] ShaderError),
    /// The driver refused or lost something.
    #[error("{device}: {message}")]
    Device {
        /// The adapter's name.
        device: String,
        /// What it says.
        message: String,
    },
    /// The device is gone, as when its driver was reset: what was on it is lost. Another one may be opened.
    #[error("{device}: the device was lost: {message}")]
    Lost {
        /// The adapter's name.
        device: String,
        /// What its driver says.
        message: String,
    },
    /// The device has no memory left for what is needed.
    #[error("{device}: out of memory: {message}")]
    OutOfMemory {
        /// The adapter's name.
        device: String,
        /// What takes how much.
        message: String,
    },
    /// The driver ends loops before their time, and did so in a kernel that renders a single sample of a pixel.
    #[error(
        "{device}: this driver ends long loops early, even for a single sample of a pixel; use fewer shapes, lights or \
         light samples, or the CPU"
    )]
    CutShort {
        /// The adapter's name.
        device: String,
    },
    /// The device cannot see all of the scene.
    #[error("{device}: {message}; the CPU has no such limit")]
    TooLarge {
        /// The adapter's name.
        device: String,
        /// What is too large, and what would fit.
        message: String,
    },
    /// Work or a look at a film where there is none.
    #[error("no film; begin or resume one first")]
    NoFilm,
    /// A call while another is pending.
    #[error("a call is pending; wait for it, or poll until it is done")]
    Pending,
    /// Work outside of the pixels that there are.
    #[error("the {what} x0,y0,x1,y1 = {region} must lie within the {of} {limits}")]
    Outside {
        /// What lies outside.
        what: &'static str,
        /// Its pixels.
        region: Region,
        /// What it should lie in.
        of: &'static str,
        /// Its pixels.
        limits: Region,
    },
    /// A film that cannot be gone on from.
    #[error("the film does not fit the scene: {0}")]
    WrongFilm(String),
    /// Further samples under adaptive sampling, which the first ones of the pixels around decide on, before those.
    #[error(
        "samples {} to {} come too early: some pixels of the film do not have their first {first} yet",
        samples.start, samples.end
    )]
    TooEarly {
        /// The samples.
        samples: Range<u32>,
        /// How many all pixels get first.
        first: u32,
    },
    /// There is no memory for a picture of so many bytes.
    #[error("an image in memory needs {} MiB, which are not available; render a crop", .0 >> 20)]
    Memory(u64),
    /// What the work goes on from cannot be read.
    #[error("{0}")]
    Input(std::io::Error),
    /// The work was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// Whatever takes the picture failed.
    #[error(transparent)]
    Output(#[from] std::io::Error),
}
