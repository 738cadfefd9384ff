//! Writing the camera into the scene file, whose comments and layout stay as they are.

use std::fs;
use std::io::Write;
use std::path::Path;

use toml_edit::{DocumentMut, Item, TableLike, Value};

use super::camera::{Entry, entries};
use crate::scene::{CameraDescription, Description};

/// Puts a camera into the file, which is replaced in one step. Values that are as they were are not touched.
///
/// # Errors
///
/// What to tell the user: the file cannot be read or written, or is no scene that this camera fits.
pub fn save_camera(path: &Path, camera: &CameraDescription) -> Result<(), String> {
    let place = path.display();
    // A link stays one: what it leads to is replaced.
    let path = fs::canonicalize(path).map_err(|error| format!("{place}: {error}"))?;
    let text = fs::read_to_string(&path).map_err(|error| format!("{place}: {error}"))?;
    let new = with_camera(&text, &place.to_string(), camera)?;
    if new == text {
        return Ok(());
    }
    replace(&path, new.as_bytes()).map_err(|error| format!("{place}: cannot be written: {error}"))
}

/// Replaces a file in one step: whoever reads it sees the old content or the new.
pub fn replace(path: &Path, content: &[u8]) -> std::io::Result<()> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let permissions = fs::metadata(path).map(|data| data.permissions()).ok();
    let mut builder = tempfile::Builder::new();
    builder.prefix(".wgray-");
    #[cfg(unix)]
    if permissions.is_none() {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666)); // less what the user's mask takes
    }
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(content)?;
    if let Some(permissions) = permissions {
        file.as_file().set_permissions(permissions)?;
    }
    file.persist(path)?;
    Ok(())
}

fn with_camera(text: &str, origin: &str, camera: &CameraDescription) -> Result<String, String> {
    let described = Description::parse(text, origin).map_err(|error| format!("mend the file first: {error}"))?;
    if std::mem::discriminant(&described.camera) != std::mem::discriminant(camera) {
        return Err(format!("{origin}: the file has another type of camera by now"));
    }
    let mut document: DocumentMut = text.parse().map_err(|error| format!("{origin}: {error}"))?;
    let table: &mut dyn TableLike = document
        .get_mut("camera")
        .and_then(Item::as_table_like_mut)
        .ok_or_else(|| format!("{origin}: camera is no table"))?;
    for ((key, old), (_, new)) in entries(&described.camera).into_iter().zip(entries(camera)) {
        if old != new {
            set(table, key, new);
        }
    }
    Ok(document.to_string())
}

fn set(table: &mut dyn TableLike, key: &str, entry: Entry) {
    match (table.get_mut(key).and_then(Item::as_value_mut), entry) {
        (Some(Value::Array(array)), Entry::Point(point)) if array.len() == 3 => {
            for (old, new) in array.iter_mut().zip(point.to_array()) {
                put(old, number(new));
            }
        }
        (Some(old), Entry::Number(x)) => put(old, number(x)),
        (_, Entry::Number(x)) => drop(table.insert(key, Item::Value(number(x)))),
        (_, Entry::Point(point)) => {
            drop(table.insert(
                key,
                Item::Value(Value::Array(point.to_array().map(number).into_iter().collect())),
            ));
        }
    }
}

/// Changes a value but not what is written around it; one that is the same is not even written otherwise.
fn put(old: &mut Value, new: Value) {
    let as_float = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
    if as_float(old) != as_float(&new) {
        let decor = old.decor().clone();
        *old = new;
        *old.decor_mut() = decor;
    }
}

/// Whole numbers without a point, as people write them.
fn number(x: f64) -> Value {
    if x.fract() == 0.0 && x.abs() < 1e15 {
        Value::from(x as i64)
    } else {
        Value::from(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "# a scene\n[image]\nwidth = 4 # wide\nheight = 4\n\n[camera] # the view\nfov=45   # degrees\n\
        position = [ 0,  -3.0, # back\n 1.3 ]\nlook_at = [0, 0, 1]\n\n# the end\n";

    fn camera(text: &str) -> CameraDescription {
        Description::parse(&format!("image = {{ width = 4, height = 4 }}\n[camera]\n{text}"), "c")
            .unwrap()
            .camera
    }

    #[test]
    fn comments_and_layout_stay() {
        let new = camera("position = [0, -2, 1.25]\nlook_at = [0.5, 0, 1]\nfov = 45");
        let saved = with_camera(SCENE, "s.toml", &new).unwrap();
        let wanted = SCENE
            .replace(" 0,  -3.0, # back\n 1.3 ", " 0,  -2, # back\n 1.25 ")
            .replace("look_at = [0, 0, 1]", "look_at = [0.5, 0, 1]");
        assert_eq!(saved, wanted);
        assert_eq!(Description::parse(&saved, "s.toml").unwrap().camera, new);
    }

    #[test]
    fn nothing_is_written_for_the_same_camera() {
        let same = camera("position = [0, -3, 1.3]\nlook_at = [0, 0, 1]\nfov = 45");
        assert_eq!(with_camera(SCENE, "s.toml", &same).unwrap(), SCENE);
    }

    #[test]
    fn inline_tables_and_absent_keys_are_written_too() {
        let text =
            "image = { width = 4, height = 4 }\ncamera = { position = [0, 1, 0], look_at = [0, 0, 0], fov = 40 } # c\n";
        let new = camera("position = [0, 1, 2]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 40");
        let saved = with_camera(text, "s.toml", &new).unwrap();
        assert_eq!(Description::parse(&saved, "s.toml").unwrap().camera, new);
        assert!(saved.ends_with(" } # c\n"), "{saved}");
    }

    #[test]
    fn a_broken_file_and_another_camera_are_refused() {
        let new = camera("type = 'orthographic'\nposition = [0, 1, 2]\nlook_at = [0, 0, 0]\nheight = 2");
        assert!(with_camera(SCENE, "s.toml", &new).unwrap_err().contains("another type"));
        assert!(
            with_camera("[image", "s.toml", &new)
                .unwrap_err()
                .starts_with("mend the file first: s.toml:1:")
        );
    }

    #[cfg(unix)]
    #[test]
    fn the_file_keeps_its_permissions_and_links() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("s.toml"), folder.path().join("link.toml"));
        fs::write(&file, SCENE).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink("s.toml", &link).unwrap();
        let new = camera("position = [0, -2, 1.25]\nlook_at = [0, 0, 1]\nfov = 45");
        save_camera(&link, &new).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_ne!(fs::read_to_string(&file).unwrap(), SCENE);
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(
            fs::read_dir(folder.path()).unwrap().count(),
            2,
            "nothing is left behind"
        );
    }
}
