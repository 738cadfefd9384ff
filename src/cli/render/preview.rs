//! `--preview`: intermediate images, written to the files of the complete image.

use std::io;
use std::time::{Duration, Instant};

use crate::image::{Format, Output, Pending, Target};

use super::once_log::OnceLog;
use crate::cli::log::Level;
use crate::cli::metadata::samples_of;

/// Minimum time between two writes of the image.
const INTERVAL: Duration = Duration::from_secs(2);

pub struct Previews {
    images: Vec<(Format, Vec<Output>)>,
    /// Time of the last write.
    last_write: Option<Instant>,
}

impl Previews {
    pub fn new(images: Vec<(Format, Vec<Output>)>) -> Previews {
        Previews {
            images,
            last_write: None,
        }
    }

    /// Returns true if the image should be written after this number of samples per pixel.
    pub fn is_due(&self, samples: u32) -> bool {
        samples.is_power_of_two()
            && self
                .last_write
                .is_none_or(|last_write| last_write.elapsed() >= INTERVAL)
    }

    /// Starts writing the files, except files that already have more samples.
    pub fn start(&self, samples: u32, log: &OnceLog) -> io::Result<Vec<Target>> {
        let mut targets = Vec::new();
        for (format, files) in &self.images {
            if let Some(reason) = files.iter().find_map(|file| reason_to_keep(file, samples)) {
                log.log_once(Level::Note, &reason);
                continue;
            }
            let files = files.iter().map(|file| Pending::start(file.again()?));
            targets.push(Target {
                format: *format,
                files: files.collect::<io::Result<_>>()?,
            });
        }
        Ok(targets)
    }

    pub fn record_write(&mut self) {
        self.last_write = Some(Instant::now());
    }
}

/// Returns a message if a preview must not replace the existing file.
fn reason_to_keep(file: &Output, samples: u32) -> Option<String> {
    let path = file.path().filter(|path| path.exists())?;
    let reason = match samples_of(path) {
        Some(existing) if existing <= samples => return None,
        Some(existing) => format!("has {existing} samples per pixel; a preview with fewer samples does not replace it"),
        None => "was not written by wgray; a preview does not replace it, but the complete image will".to_owned(),
    };
    Some(format!("{}: {reason}", file.name()))
}
