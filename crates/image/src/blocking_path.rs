//! Rejects input files that may block forever when opened, or that never end.

use std::fs::{self, FileType};
use std::io;
use std::path::Path;

/// Rejects devices and named pipes; opening a named pipe blocks until a writer opens it. Accepts anonymous pipes
/// (standard input, `<(...)` of a shell), which have a writer, and missing files, which fail when opened.
pub fn reject(path: &Path) -> io::Result<()> {
    let Ok(data) = fs::metadata(path) else { return Ok(()) };
    let invalid = |rule| Err(io::Error::new(io::ErrorKind::InvalidInput, rule));
    match kind(data.file_type()) {
        Kind::Device => invalid("it is a device; it must be a file"),
        // The link of an anonymous pipe does not resolve.
        Kind::Pipe if path.canonicalize().is_ok() => {
            invalid("it is a named pipe, which may never deliver data; it must be a file")
        }
        _ => Ok(()),
    }
}

#[cfg_attr(not(unix), expect(dead_code))]
enum Kind {
    Device,
    Pipe,
    Other,
}

#[cfg(unix)]
fn kind(file_type: FileType) -> Kind {
    use std::os::unix::fs::FileTypeExt as _;
    match () {
        () if file_type.is_char_device() || file_type.is_block_device() => Kind::Device,
        () if file_type.is_fifo() => Kind::Pipe,
        () => Kind::Other,
    }
}

#[cfg(not(unix))]
fn kind(_: FileType) -> Kind {
    Kind::Other
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn named_pipes_and_devices_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let status = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(status.success());
        assert!(reject(&pipe).unwrap_err().to_string().contains("a named pipe"));
        assert!(
            reject(Path::new("/dev/zero"))
                .unwrap_err()
                .to_string()
                .contains("a device")
        );
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        for path in [&file, folder.path(), &folder.path().join("none")] {
            reject(path).unwrap();
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn anonymous_pipes_are_accepted() {
        use std::os::fd::AsRawFd as _;
        let (reader, _writer) = io::pipe().unwrap();
        reject(Path::new(&format!("/proc/self/fd/{}", reader.as_raw_fd()))).unwrap();
    }
}
