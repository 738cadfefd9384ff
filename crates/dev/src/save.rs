//! Atomic file writes, and replacement of the camera in the text of a scene file.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use toml::Value;

use super::camera::{Entry, entries};
use super::edit::edited;
use wgray_scene::{CameraDescription, Description, KeyPath, Segment};

/// Assumed maximum time that a program takes to write a file.
const MAX_SAVE_DURATION: Duration = Duration::from_millis(100);
/// Maximum time to wait until another program has saved the file.
const MAX_WAIT: Duration = Duration::from_millis(500);

/// Replaces a file atomically: a reader sees either the old or the new content.
pub fn replace(path: &Path, content: &[u8]) -> std::io::Result<()> {
    write_temporary(path, content)?.persist(path)?;
    Ok(())
}

/// Like [`replace`], but fails if the file no longer contains `expected`.
pub fn replace_unchanged(path: &Path, expected: &[u8], content: &[u8]) -> std::io::Result<()> {
    let file = write_temporary(path, content)?;
    if fs::read(path)? != expected {
        return Err(std::io::Error::other(
            "another program changed the file at the same time; nothing was written",
        ));
    }
    file.persist(path)?;
    Ok(())
}

/// Waits until a file has not changed for a short time. If wgray replaced the file while another program is writing it,
/// the rest of that program's data would be lost.
///
/// # Errors
///
/// The file keeps changing.
pub fn wait_settled(path: &Path) -> Result<(), String> {
    let changed = || fs::metadata(path).and_then(|data| data.modified()).ok();
    wait_while_young(path, || changed().and_then(|changed| changed.elapsed().ok()))
}

/// Like [`wait_settled`], with the time since the last change of the file; `None` if it is unknown.
fn wait_while_young(path: &Path, age: impl Fn() -> Option<Duration>) -> Result<(), String> {
    let start = Instant::now();
    loop {
        match age().and_then(|age| MAX_SAVE_DURATION.checked_sub(age)) {
            Some(remaining) if start.elapsed() < MAX_WAIT => sleep(remaining.max(Duration::from_millis(1))),
            Some(_) => {
                return Err(format!(
                    "{}: another program is writing this file; nothing was written",
                    path.display()
                ));
            }
            None => return Ok(()),
        }
    }
}

/// Writes a temporary file next to `path`, with the permissions of `path`.
fn write_temporary(path: &Path, content: &[u8]) -> std::io::Result<tempfile::NamedTempFile> {
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
        builder.permissions(fs::Permissions::from_mode(0o666)); // before the umask
    }
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(content)?;
    if let Some(permissions) = permissions {
        file.as_file().set_permissions(permissions)?;
    }
    Ok(file)
}

/// Replaces the camera in the text of a scene file. Unchanged values are not touched.
///
/// # Errors
///
/// A message for the user, if the file is not a scene or its camera is of a different type.
pub fn with_camera(text: &str, origin: &str, camera: &CameraDescription) -> Result<String, String> {
    let fix_first = |error| format!("fix the file first: {error}");
    let before = Description::parse_camera(text, origin).map_err(fix_first)?;
    if std::mem::discriminant(&before) != std::mem::discriminant(camera) {
        return Err(format!("{origin}: the type of the camera in the file has changed"));
    }
    let mut text = text.to_owned();
    for ((key, old), (_, new)) in entries(&before).into_iter().zip(entries(camera)) {
        if old != new {
            let path = KeyPath(["camera", key].map(Segment::from).to_vec());
            let value = match new {
                Entry::Number(x) => Value::from(x),
                Entry::Point(point) => Value::from(point.to_array().to_vec()),
            };
            text = edited(&text, &path, Some(&value)).map_err(|reason| format!("{origin}: {reason}"))?;
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use super::*;

    const SCENE: &str = "# a scene\n[image]\nwidth = 4 # wide\nheight = 4\n\n[camera] # the view\nfov=45   # degrees\n\
        position = [ 0,  -3.0, # back\n 1.3 ]\nlook_at = [0, 0, 1]\n\n# the end\n";

    fn camera(text: &str) -> CameraDescription {
        Description::parse(&format!("image = {{ width = 4, height = 4 }}\n[camera]\n{text}"), "c")
            .unwrap()
            .camera
    }

    #[test]
    fn comments_and_layout_are_preserved() {
        let new = camera("position = [0, -2, 1.25]\nlook_at = [0.5, 0, 1]\nfov = 45");
        let saved = with_camera(SCENE, "s.toml", &new).unwrap();
        let expected = SCENE
            .replace(" 0,  -3.0, # back\n 1.3 ", " 0,  -2, # back\n 1.25 ")
            .replace("look_at = [0, 0, 1]", "look_at = [0.5, 0, 1]");
        assert_eq!(saved, expected);
        assert_eq!(Description::parse(&saved, "s.toml").unwrap().camera, new);
    }

    #[test]
    fn nothing_is_written_for_the_same_camera() {
        let same = camera("position = [0, -3, 1.3]\nlook_at = [0, 0, 1]\nfov = 45");
        assert_eq!(with_camera(SCENE, "s.toml", &same).unwrap(), SCENE);
    }

    #[test]
    fn inline_tables_and_absent_keys_are_written() {
        let text =
            "image = { width = 4, height = 4 }\ncamera = { position = [0, 1, 0], look_at = [0, 0, 0], fov = 40 } # c\n";
        let new = camera("position = [0, 1, 2]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov = 40");
        let saved = with_camera(text, "s.toml", &new).unwrap();
        assert_eq!(Description::parse(&saved, "s.toml").unwrap().camera, new);
        assert!(saved.ends_with(" } # c\n"), "{saved}");
    }

    #[test]
    fn a_broken_file_and_another_type_of_camera_are_rejected() {
        let new = camera("type = 'orthographic'\nposition = [0, 1, 2]\nlook_at = [0, 0, 0]\nheight = 2");
        assert!(
            with_camera(SCENE, "s.toml", &new)
                .unwrap_err()
                .contains("type of the camera")
        );
        assert!(
            with_camera("[image", "s.toml", &new)
                .unwrap_err()
                .starts_with("fix the file first: s.toml:1:")
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_replaced_keeps_its_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.toml");
        fs::write(&file, SCENE).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        replace(&file, b"other").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "other");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(
            fs::read_dir(folder.path()).unwrap().count(),
            1,
            "a temporary file is left behind"
        );
    }

    #[test]
    fn changes_by_other_programs_are_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.toml");
        fs::write(&file, "theirs").unwrap();
        let error = replace_unchanged(&file, b"before", b"ours").unwrap_err();
        assert!(error.to_string().contains("another program"), "{error}");
        assert_eq!(fs::read_to_string(&file).unwrap(), "theirs");
        replace_unchanged(&file, b"theirs", b"ours").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "ours");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        let set_age = |age: Duration| {
            let file = fs::File::options().write(true).open(&file).unwrap();
            file.set_modified(SystemTime::now() - age).unwrap();
        };
        // A file that was modified recently is awaited; if it keeps changing, the wait ends with an error.
        for (age, must_wait) in [(2 * MAX_SAVE_DURATION, false), (MAX_SAVE_DURATION / 4, true)] {
            set_age(age);
            let start = Instant::now();
            wait_settled(&file).unwrap();
            assert_eq!(start.elapsed() > MAX_SAVE_DURATION / 2, must_wait, "{age:?}");
        }
        let error = wait_while_young(&file, || Some(Duration::ZERO)).unwrap_err();
        assert!(error.contains("s.toml: another program is writing"), "{error}");
    }

    #[test]
    fn line_endings_and_a_byte_order_mark_are_preserved() {
        let new = camera("position = [0, -2, 1.25]\nlook_at = [0.5, 0, 1]\nup = [0, 1, 0]\nfov = 45");
        let unix = with_camera(SCENE, "s.toml", &new).unwrap();
        let dos = |text: &str| format!("\u{feff}{}", text.replace('\n', "\r\n"));
        assert_eq!(with_camera(&dos(SCENE), "s.toml", &new).unwrap(), dos(&unix));
        // Also tests a file that contains both kinds of line endings.
        let mixed = |text: &str| text.replacen("# degrees\n", "# degrees\r\n", 1);
        assert_eq!(with_camera(&mixed(SCENE), "s.toml", &new).unwrap(), mixed(&unix));
    }

    #[test]
    fn a_camera_of_dotted_keys_is_edited_in_place() {
        let text = "image = { width = 4, height = 4 }\ncamera.position = [0, 1, 0]\ncamera.look_at = [0, 0, 0]\n\
            camera.fov = 40 # wide";
        let new = camera("position = [0, 1.5, 0]\nlook_at = [0, 0, 0]\nup = [1, 0, 0]\nfov = 40");
        let saved = with_camera(text, "s.toml", &new).unwrap();
        assert_eq!(saved, text.replace("1, 0]\n", "1.5, 0]\n") + "\ncamera.up = [1, 0, 0]");
        assert_eq!(Description::parse(&saved, "s.toml").unwrap().camera, new);
    }

    #[test]
    fn saving_the_camera_keeps_its_path() {
        let path = "path.keys = [{ frame = 1, position = [0, 1, 0] }, { frame = 9, position = [0, 3, 1] }]\n";
        let text = format!("image = {{ width = 4, height = 4 }}\n[camera]\nlook_at = [0, 0, 0]\nfov = 40\n{path}");
        let mut new = Description::parse(&text, "s.toml").unwrap().camera;
        assert_eq!(with_camera(&text, "s.toml", &new).unwrap(), text);
        let CameraDescription::Perspective(moved) = &mut new else {
            panic!("another type");
        };
        (moved.position, moved.fov) = ([0.0, 2.0, 0.5].into(), 50.0);
        let saved = with_camera(&text, "s.toml", &new).unwrap();
        assert!(
            saved.contains("fov = 50\n") && saved.contains("position = [0, 2, 0.5]\n"),
            "{saved}"
        );
        assert!(saved.contains(path.trim_end()), "{saved}");
        assert_eq!(Description::parse(&saved, "s.toml").unwrap().camera, new);
    }
}
