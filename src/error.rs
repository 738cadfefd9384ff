//! What can go wrong, as types.

use thiserror::Error;

use crate::gpu::compose::Source;

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
    pub(crate) fn parse(source: &Source, error: &naga::front::wgsl::ParseError) -> ShaderError {
        let mut labels = error.labels();
        let (span, label) = labels.next().unzip();
        let label = label
            .filter(|label| !label.is_empty())
            .map(|label| format!(" ({label})"))
            .unwrap_or_default();
        ShaderError::at(source, span, format!("{}{label}", error.message()))
    }

    pub(crate) fn invalid(source: &Source, error: &naga::WithSpan<naga::valid::ValidationError>) -> ShaderError {
        let span = error.spans().map(|(span, _)| *span).last();
        ShaderError::at(source, span, chain(error.as_inner()))
    }

    pub(crate) fn other(stage: &str, error: &dyn std::error::Error) -> ShaderError {
        ShaderError {
            place: stage.to_string(),
            message: chain(error),
            excerpt: None,
        }
    }

    fn at(source: &Source, span: Option<naga::Span>, message: String) -> ShaderError {
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

/// An error's message with those of its causes.
fn chain(error: &dyn std::error::Error) -> String {
    let mut message = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        message.push_str(": ");
        message.push_str(&cause.to_string());
        source = cause.source();
    }
    message
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
    /// The work was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// Whatever takes the picture failed.
    #[error(transparent)]
    Output(#[from] std::io::Error),
}
