//! Writing the camera into the scene file, and taking it back. Only the numbers that differ are touched: comments, layout,
//! line ends and a byte-order mark stay, byte for byte.

use std::fs;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml_edit::{Document, Item, TableLike, Value};

use super::camera::{Entry, entries};
use crate::scene::{CameraDescription, Description, is_course, is_gltf};

/// What a file was before a save and is after it.
#[derive(Debug)]
pub struct Saved {
    path: PathBuf,
    before: String,
    after: String,
}

impl Saved {
    /// Whether a file's content is what was saved.
    pub fn is(&self, content: &[u8]) -> bool {
        self.after.as_bytes() == content
    }

    /// Gives the file the text that it had.
    ///
    /// # Errors
    ///
    /// What to tell the user: the file has been changed since, or cannot be read or written.
    pub fn undo(&self) -> Result<(), String> {
        let place = self.path.display();
        let now = fs::read(&self.path).map_err(|error| format!("{place}: {error}"))?;
        if !self.is(&now) {
            return Err(format!(
                "{place}: has been changed since the camera was saved, and stays as it is"
            ));
        }
        replace(&self.path, self.before.as_bytes()).map_err(|error| format!("{place}: cannot be written: {error}"))
    }
}

/// Puts a camera into the file, which is replaced in one step. Values that are as they were are not touched; `None` if
/// all are.
///
/// # Errors
///
/// What to tell the user: the file cannot be read or written, or is no scene that this camera fits.
pub fn save_camera(path: &Path, camera: &CameraDescription) -> Result<Option<Saved>, String> {
    let place = path.display();
    if is_gltf(path) {
        let rule = "must be TOML for a camera to be saved into it; it is glTF, and wgray convert makes a scene of it";
        return Err(format!("{place}: {rule}"));
    }
    // A link stays one: what it leads to is replaced.
    let path = fs::canonicalize(path).map_err(|error| format!("{place}: {error}"))?;
    let before = fs::read_to_string(&path).map_err(|error| format!("{place}: {error}"))?;
    let after = with_camera(&before, &place.to_string(), camera)?;
    if after == before {
        return Ok(None);
    }
    replace(&path, after.as_bytes()).map_err(|error| format!("{place}: cannot be written: {error}"))?;
    Ok(Some(Saved { path, before, after }))
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
    if is_course(Path::new(origin)) {
        return Err(format!(
            "{origin}: must be TOML for a camera to be saved into it; it is JSON"
        ));
    }
    let described = Description::parse(text, origin).map_err(|error| format!("mend the file first: {error}"))?;
    if std::mem::discriminant(&described.camera) != std::mem::discriminant(camera) {
        return Err(format!("{origin}: the file has another type of camera by now"));
    }
    let document = Document::parse(text).map_err(|error| format!("{origin}: {error}"))?;
    let table: &dyn TableLike = document
        .get("camera")
        .and_then(Item::as_table_like)
        .ok_or_else(|| format!("{origin}: camera is no table"))?;
    let mut changes = Vec::new();
    for ((key, old), (_, new)) in entries(&described.camera).into_iter().zip(entries(camera)) {
        if old != new {
            changes.extend(edits(text, table, key, new).ok_or_else(|| format!("{origin}: camera.{key} has no place"))?);
        }
    }
    // From the end: what comes before a change stays where it is.
    changes.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let mut text = text.to_string();
    for (range, new) in changes {
        text.replace_range(range, &new);
    }
    Ok(text)
}

/// What to put where in a text.
type Edit = (Range<usize>, String);

/// The edits that give a key of the camera a value; `None` if the text has no place for it.
fn edits(text: &str, table: &dyn TableLike, key: &str, entry: Entry) -> Option<Vec<Edit>> {
    let number_at = |old: &Value, new: f64| Some((!is(old, new)).then_some((old.span()?, written(new))));
    let whole = match entry {
        Entry::Number(x) => written(x),
        Entry::Point(p) => format!("[{}]", p.to_array().map(written).join(", ")),
    };
    match (table.get(key).and_then(Item::as_value), entry) {
        (Some(Value::Array(array)), Entry::Point(point)) if array.len() == 3 => {
            let pairs = array.iter().zip(point.to_array());
            let edits: Option<Vec<Option<Edit>>> = pairs.map(|(old, new)| number_at(old, new)).collect();
            Some(edits?.into_iter().flatten().collect())
        }
        (Some(old), Entry::Number(x)) => Some(number_at(old, x)?.into_iter().collect()),
        (Some(old), Entry::Point(_)) => Some(vec![(old.span()?, whole)]),
        (None, _) => Some(vec![added(text, table, key, &whole)?]),
    }
}

/// A key that is not there yet, after the last one of its table.
fn added(text: &str, table: &dyn TableLike, key: &str, value: &str) -> Option<Edit> {
    let values = table.iter().filter_map(|(_, item)| item.as_value()?.span());
    let last = values.map(|span| span.end).max()?;
    let first_key = table.iter().find_map(|(key, _)| table.key(key)?.span())?;
    let line_start = text[..first_key.start].rfind('\n').map_or(0, |i| i + 1);
    let before_key = &text[line_start..first_key.start];
    if before_key.contains('{') {
        return Some((last..last, format!(", {key} = {value}")));
    }
    // Its line begins as the first key's does: with blanks, or with `camera.`
    let line_end = text[last..].find('\n').map_or(text.len(), |i| last + i);
    let line_end = if text[..line_end].ends_with('\r') {
        line_end - 1
    } else {
        line_end
    };
    let line_break = if text[line_end..].starts_with('\r') {
        "\r\n"
    } else {
        "\n"
    };
    Some((line_end..line_end, format!("{line_break}{before_key}{key} = {value}")))
}

/// Whether a value is this number already, however it is written.
fn is(value: &Value, number: f64) -> bool {
    let known = value.as_float().or_else(|| value.as_integer().map(|i| i as f64));
    known == Some(number)
}

/// Whole numbers without a point, as people write them.
fn written(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e15 {
        format!("{x:.0}")
    } else {
        Value::from(x).to_string()
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

    #[test]
    fn line_ends_and_a_byte_order_mark_stay() {
        let new = camera("position = [0, -2, 1.25]\nlook_at = [0.5, 0, 1]\nup = [0, 1, 0]\nfov = 45");
        let unix = with_camera(SCENE, "s.toml", &new).unwrap();
        let dos = |text: &str| format!("\u{feff}{}", text.replace('\n', "\r\n"));
        assert_eq!(with_camera(&dos(SCENE), "s.toml", &new).unwrap(), dos(&unix));
        // Even where both kinds are in one file.
        let mixed = |text: &str| text.replacen("# degrees\n", "# degrees\r\n", 1);
        assert_eq!(with_camera(&mixed(SCENE), "s.toml", &new).unwrap(), mixed(&unix));
    }

    #[test]
    fn a_camera_of_dotted_keys_stays_one() {
        let text = "image = { width = 4, height = 4 }\ncamera.position = [0, 1, 0]\ncamera.look_at = [0, 0, 0]\n\
            camera.fov = 40 # wide";
        let new = camera("position = [0, 1.5, 0]\nlook_at = [0, 0, 0]\nup = [1, 0, 0]\nfov = 40");
        let saved = with_camera(text, "s.toml", &new).unwrap();
        assert_eq!(saved, text.replace("1, 0]\n", "1.5, 0]\n") + "\ncamera.up = [1, 0, 0]");
        assert_eq!(Description::parse(&saved, "s.toml").unwrap().camera, new);
    }

    #[test]
    fn a_path_stays_and_the_camera_is_saved_beside_it() {
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

    #[test]
    fn a_save_is_taken_back_unless_the_file_was_changed_since() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.toml");
        let text = SCENE.replace('\n', "\r\n");
        fs::write(&file, &text).unwrap();
        let new = camera("position = [0, -2, 1.25]\nlook_at = [0, 0, 1]\nfov = 45");
        let saved = save_camera(&file, &new).unwrap().unwrap();
        assert!(saved.is(&fs::read(&file).unwrap()));
        assert!(save_camera(&file, &new).unwrap().is_none(), "there is nothing to save");
        saved.undo().unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), text);
        assert!(saved.undo().unwrap_err().contains("has been changed since"));
        let saved = save_camera(&file, &new).unwrap().unwrap();
        fs::write(&file, "edited").unwrap();
        assert!(saved.undo().unwrap_err().contains("has been changed since"));
        assert_eq!(fs::read_to_string(&file).unwrap(), "edited");
    }
}
