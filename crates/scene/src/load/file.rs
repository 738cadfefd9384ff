//! Reads scene files, up to a maximum size.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use crate::error::SceneError;
use crate::parse::{NOT_UTF8, encoding, syntax_error};
use wgray_image::blocking_path;

/// Maximum size of a scene file in bytes, far above the size of handwritten files.
pub(super) const MAX_FILE_BYTES: u64 = 64 << 20;

/// Returns the folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new("."))
}

/// Reads a file of UTF-8 text.
pub fn read_text(path: &Path) -> Result<String, SceneError> {
    let bytes = read_bytes(path).map_err(|error| SceneError::Read {
        path: path.to_owned(),
        error,
    })?;
    decode_text(bytes, path)
}

/// Decodes UTF-8; `path` is the name of the file in messages.
pub(super) fn decode_text(bytes: Vec<u8>, path: &Path) -> Result<String, SceneError> {
    String::from_utf8(bytes).map_err(|error| {
        let text = String::from_utf8_lossy(error.as_bytes());
        // Up to this byte, the lossy text is identical to the file.
        let valid_len = error.utf8_error().valid_up_to();
        let name = path.display().to_string();
        match encoding(error.as_bytes()) {
            Some(message) => SceneError::Syntax {
                origin: name,
                line: 1,
                column: 1,
                message,
            },
            None => syntax_error(&text, &name, valid_len, NOT_UTF8),
        }
    })
}

/// Reads a file of at most 64 MiB; pipes and devices that may block are refused.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    blocking_path::reject(path)?;
    if path.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "it is a folder, not a scene file",
        ));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it is larger than 64 MiB"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;

    const SCENE: &str = "\
image = { width = 4, height = 3 }
camera = { position = [0, 1, 0], look_at = [1, 0, 0], fov = 40 }
";

    #[test]
    fn files_are_read_or_the_message_states_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let load = |name: &str| Scene::load(folder.path().join(name));
        let message_of = |name: &str| load(name).unwrap_err().to_string();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
        write("valid.toml", SCENE.as_bytes());
        assert_eq!(load("valid.toml").unwrap().width, 4);
        write("latin.toml", b"# \xc3\xa9t\xc3\xa9\n# \xc3\xa9t\xe9");
        assert_eq!(
            message_of("latin.toml"),
            format!("{}:2:5: not valid UTF-8", path("latin.toml"))
        );
        for (name, bytes, encoding) in [
            ("little.toml", &b"\xff\xfe[\0"[..], "UTF-16 (little-endian)"),
            ("big.toml", b"\xfe\xff\0[", "UTF-16 (big-endian)"),
        ] {
            write(name, bytes);
            let message = format!(
                "{}:1:1: the file is encoded in {encoding}; save it as UTF-8",
                path(name)
            );
            assert_eq!(message_of(name), message);
        }
        for (name, bytes, format) in [
            ("model.toml", &b"glTF\x02\0\0\0\xff"[..], "binary glTF"),
            ("image.toml", b"\x89PNG\r\n\x1a\n", "PNG"),
        ] {
            write(name, bytes);
            let message = format!("{}:1:1: the file has the format {format}, not TOML or JSON", path(name));
            assert_eq!(message_of(name), message);
        }
        write("image.gltf", b"\x89PNG\r\n\x1a\n");
        assert_eq!(
            message_of("image.gltf"),
            format!("{}: the file has the format PNG, not glTF", path("image.gltf"))
        );
        assert!(message_of("none.toml").starts_with(&format!("{}: cannot be read: ", path("none.toml"))));
        File::create(folder.path().join("huge.toml"))
            .unwrap()
            .set_len(MAX_FILE_BYTES + 1)
            .unwrap();
        assert_eq!(
            message_of("huge.toml"),
            format!("{}: cannot be read: it is larger than 64 MiB", path("huge.toml"))
        );
    }
}
