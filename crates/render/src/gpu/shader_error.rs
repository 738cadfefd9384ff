//! Shader errors, with their location in the author's file.

use super::compose::Source;
use super::naga_messages::chain;
use crate::error::ShaderError;
use crate::excerpt;

impl ShaderError {
    pub(crate) fn at_stage(stage: &str, error: &dyn std::error::Error) -> ShaderError {
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
        let preceding = &text[..offset];
        let line = preceding.matches('\n').count() + 1;
        let start = preceding.rfind('\n').map_or(0, |newline| newline + 1);
        let column = text[start..offset].chars().count() + 1;
        let line_text = text[start..].lines().next().unwrap_or("");
        let marked = range.and_then(|range| text.get(offset..offset + range.len()));
        let length = marked.map_or(1, |marked| marked.chars().count());
        ShaderError {
            place: format!("{file}:{line}:{column}"),
            message,
            excerpt: Some(excerpt::marked(line, line_text, column - 1, length)),
        }
    }
}
