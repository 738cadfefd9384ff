//! Records the paths of temporary files, so that a program that ends without unwinding can delete them.

use std::path::Path;
use std::sync::{Mutex, TryLockError};

#[cfg(unix)]
type Name = std::ffi::CString;
#[cfg(not(unix))]
type Name = std::path::PathBuf;

static NAMES: Mutex<Vec<Name>> = Mutex::new(Vec::new());

/// Minimum length of the list at which the names of deleted files are removed from it.
const MIN_PRUNED_NAMES: usize = 64;

pub(super) fn register(path: &Path) {
    let Some(name) = name(path) else { return };
    let Ok(mut names) = NAMES.lock() else { return };
    if names.len() >= MIN_PRUNED_NAMES {
        names.retain(exists);
    }
    // The allocation is marked `fallible`. Otherwise, its failure would end the program here, while this thread holds
    // the lock that `remove_temporary_files` needs.
    if crate::memory::fallible(|| names.try_reserve(1)).is_ok() {
        names.push(name);
    }
}

/// Removes the registered files, without allocating.
pub fn remove_temporary_files() {
    const MAX_ATTEMPTS: usize = 1000;
    for _ in 0..MAX_ATTEMPTS {
        let names = match NAMES.try_lock() {
            Ok(names) => names,
            Err(TryLockError::Poisoned(names)) => names.into_inner(),
            Err(TryLockError::WouldBlock) => {
                std::thread::yield_now();
                continue;
            }
        };
        names.iter().for_each(remove);
        return;
    }
}

#[cfg(unix)]
fn name(path: &Path) -> Option<Name> {
    use std::os::unix::ffi::OsStrExt as _;
    let path = std::path::absolute(path).ok()?;
    Name::new(path.as_os_str().as_bytes()).ok()
}

#[cfg(unix)]
fn exists(name: &Name) -> bool {
    rustix::fs::access(name.as_c_str(), rustix::fs::Access::EXISTS).is_ok()
}

#[cfg(unix)]
fn remove(name: &Name) {
    let _ = rustix::fs::unlink(name.as_c_str());
}

#[cfg(not(unix))]
fn name(path: &Path) -> Option<Name> {
    std::path::absolute(path).ok()
}

#[cfg(not(unix))]
fn exists(name: &Name) -> bool {
    name.exists()
}

#[cfg(not(unix))]
fn remove(name: &Name) {
    let _ = std::fs::remove_file(name);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_registered_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let paths: Vec<_> = (0..MIN_PRUNED_NAMES + 3)
            .map(|i| folder.path().join(i.to_string()))
            .collect();
        for path in &paths {
            std::fs::write(path, "").unwrap();
            register(path);
        }
        let unregistered = folder.path().join("other");
        std::fs::write(&unregistered, "").unwrap();
        // The files of other tests stay.
        let names = NAMES.lock().unwrap();
        names
            .iter()
            .filter(|registered| paths.iter().any(|path| name(path).as_ref() == Some(*registered)))
            .for_each(remove);
        drop(names);
        assert!(paths.iter().all(|path| !path.exists()) && unregistered.exists());
    }
}
