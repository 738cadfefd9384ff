//! Memory in use on a device, for messages about failed allocations.

use crate::error::RenderError;

/// Memory in use in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// The scene's buffers.
    pub scene: u64,
    /// The film.
    pub film: u64,
    /// Copies of parts of the film.
    pub copies: u64,
}

/// Name of an allocation, and size in bytes.
pub type FailedAllocation = (String, u64);

impl Held {
    /// Adds the failed allocation, if known, and the memory in use to an out-of-memory error without a message. Returns
    /// other errors unchanged.
    pub fn explain(&self, error: RenderError, asked: Option<&FailedAllocation>) -> RenderError {
        match error {
            RenderError::OutOfMemory { device, message: None } => RenderError::OutOfMemory {
                device,
                message: Some(self.message(asked)),
            },
            other => other,
        }
    }

    fn message(&self, asked: Option<&FailedAllocation>) -> String {
        let asked = match asked {
            Some((what, bytes)) => format!("the driver has no {} MiB for {what}", mebibytes(*bytes)),
            None => "the driver has no more memory".to_owned(),
        };
        let used = [
            (self.scene, "for the scene"),
            (self.film, "for the film"),
            (self.copies, "for copies of parts of it"),
        ];
        let used: Vec<String> = used
            .iter()
            .filter(|(bytes, _)| *bytes > 0)
            .map(|(bytes, what)| format!("{} {what}", mebibytes(*bytes)))
            .collect();
        let beside = match used.is_empty() {
            true => String::new(),
            false => format!(" in addition to {}", used.join(", ")),
        };
        format!("{asked}{beside}; render a crop or a smaller image, or use the CPU")
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
        let held = Held {
            scene: 3 << 19,
            film: 64 << 20,
            copies: 0,
        };
        let asked = ("a copy of it".to_string(), 64 << 20);
        let error_with_use = held.explain(error(), Some(&asked));
        let rest = "render a crop or a smaller image, or use the CPU";
        let line = format!(
            "gpu: out of memory: the driver has no 64.0 MiB for a copy of it in addition to 1.5 for the scene, 64.0 for the \
             film; {rest}"
        );
        assert_eq!(error_with_use.to_string(), line);
        assert_eq!(held.explain(error_with_use, None).to_string(), line);
        let unknown = Held::default().explain(error(), None).to_string();
        assert_eq!(
            unknown,
            format!("gpu: out of memory: the driver has no more memory; {rest}")
        );
        let other = RenderError::Cancelled;
        assert!(matches!(held.explain(other, Some(&asked)), RenderError::Cancelled));
    }
}
