//! What can go wrong, as types.

use std::fmt;

use thiserror::Error;

use crate::gpu::compose::Source;
use crate::gpu::wording::chain;

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

impl ShaderError {
    pub(crate) fn other(stage: &str, error: &dyn std::error::Error) -> ShaderError {
        ShaderError {
            place: stage.to_string(),
            message: chain(error),
            excerpt: None,
        }
    }

    pub(crate) fn at(source: &Source, span: Option<naga::Span>, message: String) -> ShaderError {
        let range = span.and_then(|span| span.to_range());
        let Some((file, text, offset)) = range.clone().and_then(|range| source.locate(range.start)) else {
            return ShaderError {
                place: "shader".to_string(),
                message,
                excerpt: None,
            };
        };
        let before = &text[..offset];
        let line = before.matches('\n').count() + 1;
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        let column = text[start..offset].chars().count() + 1;
        let line_text = text[start..].lines().next().unwrap_or("");
        let length = range
            .map_or(1, |range| range.len())
            .min(line_text.len().saturating_sub(offset - start))
            .max(1);
        let excerpt = format!(
            "{line:>5} | {line_text}\n      | {}{}",
            " ".repeat(column - 1),
            "^".repeat(length)
        );
        ShaderError {
            place: format!("{file}:{line}:{column}"),
            message,
            excerpt: Some(excerpt),
        }
    }
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
    /// The driver ends loops before their time, and did so in a kernel that renders a single sample of a pixel.
    #[error(
        "{device}: this driver ends long loops early, and a single sample of a pixel has longer ones: the scene has too \
         many shapes, lights or light samples for it, or a shader was edited"
    )]
    CutShort {
        /// The adapter's name.
        device: String,
    },
    /// The device cannot see all of the scene.
    #[error("{device}: {message}; --device cpu has no such limit")]
    TooLarge {
        /// The adapter's name.
        device: String,
        /// What is too large, and what would fit.
        message: String,
    },
    /// The work was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// Whatever takes the picture failed.
    #[error(transparent)]
    Output(#[from] std::io::Error),
}
