//! URIs in glTF files: data URIs (RFC 2397) and relative paths (specification, section 2.8).

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::error::quoted;
use crate::file_system::FileSystem;

/// Base64 with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

pub(super) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|start| start.eq_ignore_ascii_case("data:"))
}

/// Decodes a data URI; the error is the violated rule.
pub(super) fn data(uri: &str) -> Result<Vec<u8>, String> {
    let rule = "a data URI must be data:[type][;base64],data";
    let (head, body) = uri.get(5..).and_then(|rest| rest.split_once(',')).ok_or(rule)?;
    let body: Cow<[u8]> = percent_decode_str(body).into();
    let is_base64 = head.rsplit(';').next().is_some_and(|last| {
        let last = last.trim();
        last.eq_ignore_ascii_case("base64")
    });
    match is_base64 {
        false => Ok(body.into_owned()),
        true => BASE64
            .decode(&body)
            .map_err(|error| format!("the data URI must be base64: {error}")),
    }
}

/// The reason why a file is not read: the value and the violated rule.
#[derive(Debug)]
pub(super) enum UriError {
    /// The file is missing or unreadable.
    Absent(String),
    /// The URI or the file violates a rule.
    Invalid(String),
}

impl From<String> for UriError {
    fn from(rule: String) -> Self {
        UriError::Invalid(rule)
    }
}

impl From<UriError> for String {
    fn from(error: UriError) -> Self {
        match error {
            UriError::Absent(reason) | UriError::Invalid(reason) => reason,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Folder {
    pub file_system: FileSystem,
    /// Folder that paths are relative to.
    pub folder: PathBuf,
    /// Asset root: the folder that must contain all files.
    pub root: PathBuf,
}

impl Folder {
    /// Resolves a URI to a canonical path in the asset root.
    pub fn find(&self, uri: &str) -> Result<PathBuf, UriError> {
        if let Some(scheme) = scheme(uri) {
            let rule = "it must be a relative path, or a data URI";
            return Err(format!("{} begins with \"{scheme}:\"; {rule}", quoted(uri)).into());
        }
        let decoded = percent_decode_str(uri)
            .decode_utf8()
            .map_err(|_| format!("{} must be UTF-8 where it is percent-encoded", quoted(uri)))?;
        // Allows unencoded percent signs, and the backslashes of Windows paths.
        let with_slashes = decoded.replace('\\', "/");
        let names = [&*decoded, uri, &with_slashes];
        for name in names {
            if name.starts_with(['/', '\\']) || Path::new(name).has_root() || Path::new(name).is_absolute() {
                return Err(format!("{} must be a relative path", quoted(uri)).into());
            }
        }
        if decoded.is_empty() {
            return Err("\"\" must be the path of a file".to_owned().into());
        }
        let mut paths = (names.iter()).map(|name| self.file_system.canonical_file(&self.folder.join(name)));
        let first = paths.next().unwrap_or_else(|| Err(io::ErrorKind::NotFound.into()));
        let path = match first {
            Err(error) if error.kind() == io::ErrorKind::NotFound => paths.find_map(Result::ok).ok_or(error),
            first => first,
        };
        let path = path.map_err(|error| UriError::Absent(format!("{} cannot be read: {error}", quoted(uri))))?;
        let root = self.file_system.canonical_folder(&self.root).map_err(|error| {
            let root = self.root.display();
            format!("{} must lie in {root}, which cannot be found: {error}", quoted(uri))
        })?;
        if !path.starts_with(&root) {
            let root = self.root.display();
            return Err(format!("{} must not leave the folder {root}", quoted(uri)).into());
        }
        if !self.file_system.is_file(&path) {
            return Err(format!("{} must be a file", quoted(uri)).into());
        }
        Ok(path)
    }

    pub fn read(&self, path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
        self.file_system.read(path, max_bytes)
    }
}

/// Returns the scheme (RFC 3986, section 3.1).
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let is_scheme = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    is_scheme.then_some(scheme)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn data_uris_are_base64_or_percent_encoded() {
        for (uri, bytes) in [
            ("data:application/octet-stream;base64,AAECA/8=", &[0, 1, 2, 3, 255][..]),
            ("data:application/gltf-buffer;base64,AAECA/8", &[0, 1, 2, 3, 255]),
            ("DATA:;BASE64,AAECA%2F8%3D", &[0, 1, 2, 3, 255]),
            ("data:;base64,", &[]),
            ("data:,a%20b%00", b"a b\0"),
            ("data:text/plain;charset=utf-8,a,b", b"a,b"),
        ] {
            assert!(is_data(uri));
            assert_eq!(data(uri).unwrap(), bytes, "{uri}");
        }
        for uri in [
            "data:",
            "data:;base64",
            "data:;base64,A",
            "data:;base64,AA*A",
            "data:;base64,é",
        ] {
            assert!(data(uri).is_err(), "{uri}");
        }
        assert!(!is_data("daté"));
        assert!(!is_data("file.bin"));
    }

    #[test]
    fn files_outside_of_the_root_are_rejected() {
        let temp_folder = tempfile::tempdir().unwrap();
        let root = temp_folder.path().join("model");
        fs::create_dir_all(root.join("sub dir")).unwrap();
        fs::write(temp_folder.path().join("secret.bin"), b"no").unwrap();
        for name in ["a b.bin", "100%.bin", "sub dir/c.bin"] {
            fs::write(root.join(name), b"yes").unwrap();
        }
        let folder = Folder {
            file_system: FileSystem::Disk,
            folder: root.clone(),
            root: root.clone(),
        };
        for uri in [
            "a%20b.bin",
            "a b.bin",
            "./a%20b.bin",
            "100%.bin",
            "100%25.bin",
            "sub%20dir/c.bin",
            "sub dir\\c.bin",
            "sub%20dir/../a%20b.bin",
            "../model/a b.bin",
        ] {
            let path = folder.find(uri).unwrap();
            assert_eq!(folder.read(&path, 3).unwrap(), b"yes", "{uri}");
        }
        let error_of = |uri: &str| String::from(folder.find(uri).unwrap_err());
        let outside = "must not leave the folder";
        for uri in [
            "../secret.bin",
            "..%2fsecret.bin",
            "%2e%2e/secret.bin",
            "sub dir/../../secret.bin",
            "..\\secret.bin",
        ] {
            assert!(error_of(uri).contains(outside), "{uri}: {}", error_of(uri));
        }
        for uri in [
            "/etc/passwd",
            "%2fetc/passwd",
            "//host/file",
            "\\\\host\\file",
            "\\file",
        ] {
            assert!(
                error_of(uri).ends_with("must be a relative path"),
                "{uri}: {}",
                error_of(uri)
            );
        }
        for uri in [
            "file:///etc/passwd",
            "http://host/a.bin",
            "HTTPS://host/a.bin",
            "c:\\a.bin",
            "blob:x",
        ] {
            assert!(error_of(uri).contains("begins with"), "{uri}: {}", error_of(uri));
        }
        for uri in ["none.bin", "a\0b", "a b.bin/x", "%00"] {
            assert!(error_of(uri).contains("cannot be read"), "{uri}: {}", error_of(uri));
        }
        assert!(error_of("%ff").contains("UTF-8"));
        assert!(error_of("").contains("path of a file"));
        assert!(error_of("sub%20dir").ends_with("must be a file"));
        assert!(error_of(".").ends_with("must be a file"));
        assert!(folder.read(&root.join("a b.bin"), 2).is_err());
        assert!(folder.read(&root, 9).is_err());
        let wider_folder = Folder {
            file_system: FileSystem::Disk,
            folder: root,
            root: temp_folder.path().to_owned(),
        };
        assert!(wider_folder.find("../secret.bin").is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn links_to_the_outside_and_pipes_are_rejected() {
        let temp_folder = tempfile::tempdir().unwrap();
        let root = temp_folder.path().join("model");
        fs::create_dir(&root).unwrap();
        fs::write(temp_folder.path().join("secret.bin"), b"no").unwrap();
        fs::write(root.join("a.bin"), b"yes").unwrap();
        std::os::unix::fs::symlink("../secret.bin", root.join("out.bin")).unwrap();
        std::os::unix::fs::symlink("a.bin", root.join("in.bin")).unwrap();
        std::os::unix::fs::symlink("..", root.join("up")).unwrap();
        let folder = Folder {
            file_system: FileSystem::Disk,
            folder: root.clone(),
            root: root.clone(),
        };
        assert!(folder.find("in.bin").is_ok());
        for uri in ["out.bin", "up/secret.bin"] {
            assert!(
                String::from(folder.find(uri).unwrap_err()).contains("must not leave"),
                "{uri}"
            );
        }
        let mkfifo_status = std::process::Command::new("mkfifo").arg(root.join("pipe")).status();
        if mkfifo_status.is_ok_and(|status| status.success()) {
            assert!(String::from(folder.find("pipe").unwrap_err()).ends_with("must be a file"));
            assert!(folder.read(&root.join("pipe"), 9).is_err());
        }
    }
}
