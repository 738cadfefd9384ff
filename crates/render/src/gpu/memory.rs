//! Memory in use on a device, for messages about failed allocations.

use crate::error::RenderError;

/// Memory in use in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryUse {
    /// The scene's buffers.
    pub scene: u64,
    /// The film.
    pub film: u64,
    /// Copies of film rows.
    pub copies: u64,
}

/// Name and size in bytes of a failed allocation.
pub type FailedAllocation = (String, u64);

impl MemoryUse {
    /// Adds a message to an out-of-memory error that has none: the failed allocation, if known, and the memory in use.
    /// Returns other errors unchanged.
    pub fn explain(&self, error: RenderError, failed: Option<&FailedAllocation>) -> RenderError {
        match error {
            RenderError::OutOfMemory { device, message: None } => RenderError::OutOfMemory {
                device,
                message: Some(self.message(failed)),
            },
            other => other,
        }
    }

    fn message(&self, failed: Option<&FailedAllocation>) -> String {
        let cause = match failed {
            Some((name, bytes)) => format!("the driver cannot allocate {} MiB for {name}", mebibytes(*bytes)),
            None => "the driver has no more memory".to_owned(),
        };
        let used = [
            (self.scene, "for the scene"),
            (self.film, "for the film"),
            (self.copies, "for copies of film rows"),
        ];
        let used: Vec<String> = used
            .iter()
            .filter(|(bytes, _)| *bytes > 0)
            .map(|(bytes, purpose)| format!("{} MiB {purpose}", mebibytes(*bytes)))
            .collect();
        let in_use = match used.is_empty() {
            true => String::new(),
            false => format!(" in addition to {}", used.join(", ")),
        };
        format!("{cause}{in_use}; render a crop or a smaller image, or use the CPU")
    }
}

/// Formats MiB with one decimal, so that small sizes are not 0.
fn mebibytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / f64::from(1 << 20))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error() -> RenderError {
        RenderError::OutOfMemory {
            device: "gpu".to_owned(),
            message: None,
        }
    }

    #[test]
    fn out_of_memory_errors_are_explained_once() {
        let memory = MemoryUse {
            scene: 3 << 19,
            film: 64 << 20,
            copies: 0,
        };
        let failed = ("a copy of the film".to_string(), 64 << 20);
        let error_with_use = memory.explain(error(), Some(&failed));
        let advice = "render a crop or a smaller image, or use the CPU";
        let line = format!(
            "gpu: out of memory: the driver cannot allocate 64.0 MiB for a copy of the film in addition to 1.5 MiB for the \
             scene, 64.0 MiB for the film; {advice}"
        );
        assert_eq!(error_with_use.to_string(), line);
        assert_eq!(memory.explain(error_with_use, None).to_string(), line);
        let unknown = MemoryUse::default().explain(error(), None).to_string();
        assert_eq!(
            unknown,
            format!("gpu: out of memory: the driver has no more memory; {advice}")
        );
        let other = RenderError::Cancelled;
        assert!(matches!(memory.explain(other, Some(&failed)), RenderError::Cancelled));
    }
}
