//! Cache of the meshes that are in use.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::SystemTime;

use crate::file_system::{FileStamp, FileSystem};
use crate::mesh::{Mesh, MeshError, Normals};

/// A version of a file, and the options of the reader.
#[derive(PartialEq, Eq, Hash)]
struct Key {
    /// The [`FileSystem::id`] of the file system.
    file_system: u64,
    path: PathBuf,
    length: u64,
    modified: SystemTime,
    normals: Option<Normals>,
}

/// A mesh and the stamps of its MTL files.
struct CachedMesh {
    mesh: Weak<Mesh>,
    libraries: Vec<FileStamp>,
}

/// The meshes in use. A scene that is reloaded in development mode reuses the meshes and their BVHs.
static IN_USE: Mutex<Option<HashMap<Key, CachedMesh>>> = Mutex::new(None);

/// Reads a mesh; returns the existing mesh if it is in use and its files have not changed.
pub fn load(file_system: &FileSystem, path: &Path, normals: Option<Normals>) -> Result<Arc<Mesh>, MeshError> {
    let Some(key) = key(file_system, path, normals) else {
        // The file has no modification time, usually because it does not exist: reading it reports the error.
        return Mesh::load_from(file_system, path, normals).map(Arc::new);
    };
    if let Some(mesh) = cached_mesh(file_system, &key) {
        return Ok(mesh);
    }
    // The lock is not held while reading, because a thread of the reader may call this function for another scene.
    let loaded = Arc::new(Mesh::load_from(file_system, path, normals)?);
    let libraries = libraries(file_system, &loaded);
    if let Some(mesh) = cached_mesh(file_system, &key) {
        return Ok(mesh); // another thread was faster
    }
    let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    let mesh = Arc::downgrade(&loaded);
    in_use
        .get_or_insert_default()
        .insert(key, CachedMesh { mesh, libraries });
    Ok(loaded)
}

/// Returns the mesh if it is in use and its MTL files have not changed.
fn cached_mesh(file_system: &FileSystem, key: &Key) -> Option<Arc<Mesh>> {
    let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    let in_use = in_use.get_or_insert_default();
    in_use.retain(|_, cached| cached.mesh.strong_count() > 0);
    let cached = in_use.get(key)?;
    let mesh = cached.mesh.upgrade()?;
    (libraries(file_system, &mesh) == cached.libraries).then_some(mesh)
}

fn key(file_system: &FileSystem, path: &Path, normals: Option<Normals>) -> Option<Key> {
    let (length, modified) = file_system.stamp(path)?;
    Some(Key {
        file_system: file_system.id(),
        path: path.to_owned(),
        length,
        modified,
        normals,
    })
}

fn libraries(file_system: &FileSystem, mesh: &Mesh) -> Vec<FileStamp> {
    let files = mesh.libraries.iter().map(|library| &library.file);
    files.map(|file| file_system.stamp(file)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn load(path: &Path, normals: Option<Normals>) -> Result<Arc<Mesh>, MeshError> {
        super::load(&FileSystem::Disk, path, normals)
    }

    const SMALL: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    #[test]
    fn a_mesh_in_use_is_not_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        fs::write(&path, SMALL).unwrap();
        let first = load(&path, None).unwrap();
        assert!(Arc::ptr_eq(&first, &load(&path, None).unwrap()));
        // A different normals option requires a different mesh.
        let flat = load(&path, Some(Normals::Flat)).unwrap();
        assert!(!Arc::ptr_eq(&first, &flat));
        let smooth = load(&path, Some(Normals::Smooth)).unwrap();
        assert_eq!((smooth.normals.len(), flat.normals.len()), (3, 0));
        assert!(Arc::ptr_eq(&first, &load(&path, None).unwrap()));
        let copy = folder.path().join("b.obj");
        fs::copy(&path, &copy).unwrap();
        assert!(!Arc::ptr_eq(&first, &load(&copy, None).unwrap()));
    }

    #[test]
    fn nested_reads_do_not_deadlock() {
        use rayon::prelude::*;
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<PathBuf> = (0..32).map(|i| folder.path().join(format!("{i}.obj"))).collect();
        let large_text = SMALL.replace("1 2 3", "-3 -2 -1").repeat(2000);
        files.iter().for_each(|file| fs::write(file, &large_text).unwrap());
        let meshes = files.par_iter().chain(&files).map(|file| load(file, None).unwrap());
        let meshes: Vec<Arc<Mesh>> = meshes.collect();
        assert!(meshes.iter().all(|mesh| mesh.positions == meshes[0].positions));
        let is_cached = |file| meshes.iter().any(|mesh| Arc::ptr_eq(mesh, &load(file, None).unwrap()));
        assert!(files.iter().all(|file| is_cached(file)));
    }

    #[test]
    fn unused_meshes_are_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        fs::write(&path, SMALL).unwrap();
        let weak = Arc::downgrade(&load(&path, None).unwrap());
        assert_eq!(weak.strong_count(), 0);
        let other_path = folder.path().join("b.obj");
        fs::write(&other_path, SMALL).unwrap();
        let _other_mesh = load(&other_path, None).unwrap();
        let in_use = IN_USE.lock().unwrap();
        let cached = in_use.iter().flatten().filter(|(key, _)| key.path == path);
        assert_eq!(cached.count(), 0);
    }

    #[test]
    fn changed_files_are_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        fs::write(&path, SMALL).unwrap();
        let first = load(&path, None).unwrap();
        // The length of the file changes.
        fs::write(&path, format!("{SMALL}v 0 0 1\nf 1 2 4\n")).unwrap();
        let second = load(&path, None).unwrap();
        assert_eq!((first.triangles.len(), second.triangles.len()), (1, 2));
        // Only the content and the modification time change.
        fs::write(&path, format!("{SMALL}v 0 0 5\nf 1 2 4\n")).unwrap();
        let file = fs::File::options().write(true).open(&path).unwrap();
        file.set_modified(SystemTime::now() + std::time::Duration::from_secs(5))
            .unwrap();
        let third = load(&path, None).unwrap();
        assert_eq!(third.positions[3].z, 5.0);
        assert_eq!(second.positions[3].z, 1.0);
        // An invalid file is an error even if the mesh is in use.
        fs::write(&path, "v 0 0 0\n").unwrap();
        assert!(load(&path, None).is_err());
        fs::remove_file(&path).unwrap();
        let message = load(&path, None).unwrap_err().to_string();
        assert!(message.contains("cannot be read"), "{message}");
    }
}
