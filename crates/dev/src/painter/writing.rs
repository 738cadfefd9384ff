//! Writes changes to the scene file: the camera, and values that are set on the page. Each change is validated before
//! it is written, and can be undone.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};
use std::time::Instant;

use serde_json::Value as Json;

use super::Painter;
use crate::edit::edited_in;
use crate::history::Step;
use crate::messages::{Report, Set};
use crate::object::{SceneView, object_of};
use crate::save::{replace_unchanged, wait_settled, with_camera};
use crate::source::{FileStamp, Loaded};
use wgray_image::sanitize::escape_control;
use wgray_scene::{Field, KeyPath, PendingScene, Segment, cut, folder_of, read_text};

impl Painter {
    pub(super) fn set(&mut self, set: &Set) {
        // The error is escaped because the terminal prints it, and it contains text from the viewer.
        let result = self.try_set(set).map_err(|error| escape_control(&error).into_owned());
        match &result {
            Ok(()) => self.clear_error(),
            Err(_) => self.notice(&result, String::new()),
        }
        // While a slider is dragged, only errors are reported.
        if result.is_err() || set.gesture.is_none() {
            (self.report)(Report::Saved(escape_control(&cut(&set.path)).into_owned(), result));
        }
    }

    fn try_set(&mut self, set: &Set) -> Result<(), String> {
        let path: KeyPath = set.path.parse().map_err(|problem| format!("{problem}"))?;
        let (file, before) = self.settled_file("values")?;
        let loaded = self.scene_for(&before)?;
        let view = SceneView {
            camera: self.packed_camera(&loaded),
            loaded: Arc::clone(&loaded),
            sources: self.sources.clone(),
        };
        let field = || Some((path.clone(), view.field(&path)?, set.value.clone()));
        let target = field().or_else(|| with_element(&view, &path, &set.value));
        let (Some(object), Some((path, field, new_value))) = (object_of(&path), target) else {
            return Err(format!("{path}: cannot be changed"));
        };
        let value = match (&new_value, &field.fixed) {
            (_, Some(reason)) => Err(reason.clone()),
            (Json::Null, None) if field.required => Err("is required".to_owned()),
            (Json::Null, None) => Ok(None),
            (new_value, None) => field.value_of(new_value, &view.names()).map(Some),
        };
        let value = value.map_err(|rule| format!("{path}: {rule}"))?;
        let origin = self.sources.scene.display();
        let after =
            edited_in(&loaded.pieces(), &path, value.as_ref()).map_err(|reason| format!("{origin}: {reason}"))?;
        let step = Step::new(path.to_string(), object, set.gesture);
        self.write(&file, (&loaded, &before), after, step)
    }

    pub(super) fn save_camera(&mut self) {
        let result = self.try_save_camera();
        self.notice(&result, format!("Camera saved to {}", self.sources.scene.display()));
        (self.report)(Report::Saved("camera".to_owned(), result));
    }

    fn try_save_camera(&mut self) -> Result<(), String> {
        let (file, before) = self.settled_file("the camera")?;
        let loaded = self.scene_for(&before)?;
        let camera = self.camera.as_ref().unwrap_or(&loaded.camera);
        let after = with_camera(&before, &self.sources.scene.display().to_string(), camera)?;
        let table = KeyPath(vec![Segment::from("camera")]);
        let mut step = Step::new("camera".to_owned(), table, None);
        step.is_camera = true;
        self.write(&file, (&loaded, &before), after, step)
    }

    pub(super) fn undo_or_redo(&mut self, redo: bool) {
        let Some(key) = self.history.last(redo).map(|step| step.key.clone()) else {
            if let Some(reason) = self.state.undo_blocked.clone() {
                self.notice(&Err(reason), String::new());
            }
            return;
        };
        let result = self.try_undo_or_redo(redo);
        let done = if redo { "Redid" } else { "Undid" };
        self.notice(&result, format!("{done}: {key}"));
        let action = if redo { "Redo" } else { "Undo" };
        let text = if result.is_ok() { done } else { action };
        (self.report)(Report::UndoRedo(format!("{text}: {key}"), result));
    }

    pub(super) fn forget_writes(&mut self) {
        if self.history.forget() {
            let file = self.sources.scene.display();
            let reason = format!("Undo is not possible: {file} was changed by another program");
            self.state.undo_blocked = Some(reason);
        }
    }

    fn try_undo_or_redo(&mut self, redo: bool) -> Result<(), String> {
        let (file, before) = self.scene_file("values")?;
        let origin = self.sources.scene.display().to_string();
        let changed = || format!("{origin}: another program has changed the file; undo and redo are not possible");
        let loaded = self
            .loaded
            .clone()
            .filter(|loaded| loaded.text == before)
            .ok_or_else(changed)?;
        let after = self.history.text_after(&before, redo).ok_or_else(changed)?;
        let step = self.history.last(redo).ok_or_else(changed)?;
        let (table, keeps_view) = (step.table.clone(), step.is_camera && !redo);
        let new = self.read_change(&loaded, &table, after)?;
        self.replace(&file, &before, &new)?;
        self.history.complete(redo);
        // If saving the camera is undone, the image keeps showing the saved camera.
        let view = keeps_view.then(|| self.camera.clone().unwrap_or(loaded.camera.clone()));
        let display_changed = self.adopt_written(new);
        if let (Some(view), Some(loaded)) = (view, &self.loaded) {
            self.camera = (view != loaded.camera).then_some(view);
        }
        self.apply_changed_files(Instant::now(), display_changed);
        Ok(())
    }

    /// Returns the path of the scene file, with symbolic links resolved, and the text. `values` names the values to
    /// save in an error message.
    fn scene_file(&self, values: &str) -> Result<(PathBuf, String), String> {
        let scene = &self.sources.scene;
        let origin = scene.display();
        if let Some(reason) = self.sources.read_only() {
            return Err(format!("{origin}: cannot save {values}: {reason}"));
        }
        let file = fs::canonicalize(scene).map_err(|error| format!("{origin}: {error}"))?;
        let text = read_text(scene).map_err(|error| error.to_string())?;
        Ok((file, text))
    }

    /// Like [`Self::scene_file`], but waits while another program is writing the file.
    fn settled_file(&self, values: &str) -> Result<(PathBuf, String), String> {
        let (file, text) = self.scene_file(values)?;
        if self.loaded.as_ref().is_some_and(|loaded| loaded.text == text) {
            return Ok((file, text));
        }
        wait_settled(&self.sources.scene)?;
        self.scene_file(values)
    }

    /// Returns the scene for the text of the file: the loaded scene, unless another program has changed the file.
    fn scene_for(&self, text: &str) -> Result<Arc<Loaded>, String> {
        if let Some(loaded) = self.loaded.as_ref().filter(|loaded| loaded.text == text) {
            return Ok(Arc::clone(loaded));
        }
        let origin = self.sources.scene.display().to_string();
        let folder = folder_of(&self.sources.scene);
        let pending = PendingScene::read(text, &origin, folder, &self.sources.overrides);
        let checked = pending.and_then(|pending| pending.check(&mut BTreeSet::new()));
        let (scene, description) = checked.map_err(|error| {
            let (errors, _) = error.each();
            format!("fix the file first: {}", errors.first().unwrap_or(&error))
        })?;
        let previous = self.loaded.as_deref();
        Ok(Arc::new(Loaded::new(text.to_owned(), scene, description, previous)))
    }

    /// Returns the scene for a text that differs from the text of the `old` scene only inside one table.
    fn read_change(&self, old: &Loaded, table: &KeyPath, text: String) -> Result<Arc<Loaded>, String> {
        let origin = self.sources.scene.display().to_string();
        let folder = folder_of(&self.sources.scene);
        let change = (&old.description, table);
        let pending = PendingScene::change(&text, &origin, folder, &self.sources.overrides, change);
        let checked = pending.and_then(|(pending, places)| Ok((pending.check(&mut BTreeSet::new())?, places)));
        let ((scene, description), places) = checked.map_err(|error| error.to_string())?;
        Ok(Arc::new(
            Loaded::new(text, scene, description, Some(old)).with_places(places),
        ))
    }

    fn write(&mut self, file: &Path, (old, before): (&Loaded, &str), after: String, step: Step) -> Result<(), String> {
        if after == before {
            return Ok(());
        }
        let new = self.read_change(old, &step.table, after)?;
        self.replace(file, before, &new)?;
        if self.loaded.as_ref().is_none_or(|loaded| loaded.text != before) {
            self.forget_writes();
        }
        self.state.undo_blocked = None;
        self.history.add(step, before, &new.text);
        let display_changed = self.adopt_written(new);
        self.apply_changed_files(Instant::now(), display_changed);
        Ok(())
    }

    fn replace(&self, file: &Path, before: &str, new: &Loaded) -> Result<(), String> {
        let origin = self.sources.scene.display();
        replace_unchanged(file, before.as_bytes(), new.text.as_bytes())
            .map_err(|error| format!("{origin}: cannot be written: {error}"))
    }

    /// Sets a scene that this session has written, so that the file is not read again. Returns true if the display
    /// settings changed.
    fn adopt_written(&mut self, written: Arc<Loaded>) -> bool {
        if let Some((_, stamp)) = self.files.first_mut() {
            *stamp = FileStamp::Content(written.text.clone().into_bytes());
        }
        {
            let mut writes = self.writes.lock().unwrap_or_else(PoisonError::into_inner);
            writes.count += 1;
            writes.written_scene = (!self.files.is_empty()).then(|| (Arc::clone(&written), self.files.clone()));
        }
        self.set_scene(Ok(written))
    }
}

/// If `path` leads to an element of a list, returns the path and the field of the list, and the list with `new` as that
/// element.
fn with_element(view: &SceneView, path: &KeyPath, new: &Json) -> Option<(KeyPath, Field, Json)> {
    let (Segment::Index(i), list) = path.0.split_last()? else {
        return None;
    };
    let list = KeyPath(list.to_vec());
    let field = view.field(&list)?;
    let mut numbers = field.value.as_ref().or(field.default.as_ref())?.as_array()?.clone();
    *numbers.get_mut(*i)? = new.clone();
    Some((list, field, numbers.into()))
}
