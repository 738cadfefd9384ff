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
use crate::save::{replace_known, wait_settled, with_camera};
use crate::source::{FileStamp, Loaded};
use wgray_image::sanitize::escape_control;
use wgray_scene::{Field, KeyPath, PendingScene, Segment, cut, folder_of, read_text};

impl Painter {
    pub(super) fn set(&mut self, set: &Set) {
        // The error is escaped because the terminal prints it, and it contains text from the viewer.
        let result = self.try_set(set).map_err(|why| escape_control(&why).into_owned());
        match &result {
            Ok(()) => self.taken(),
            Err(_) => self.notice(&result, String::new()),
        }
        // While a slider is dragged, only errors are reported.
        if result.is_err() || set.gesture.is_none() {
            (self.report)(Report::Wrote(escape_control(&cut(&set.path)).into_owned(), result));
        }
    }

    fn try_set(&mut self, set: &Set) -> Result<(), String> {
        let path: KeyPath = set.path.parse().map_err(|problem| format!("{problem}"))?;
        let (file, before) = self.settled_file("values")?;
        let loaded = self.read_again(&before)?;
        let seen = SceneView {
            camera: self.packed_camera(&loaded),
            loaded: Arc::clone(&loaded),
            sources: self.sources.clone(),
        };
        let whole = || Some((path.clone(), seen.field(&path)?, set.value.clone()));
        let found = whole().or_else(|| with_element(&seen, &path, &set.value));
        let (Some(object), Some((path, field, given))) = (object_of(&path), found) else {
            return Err(format!("{path}: cannot be changed"));
        };
        let value = match (&given, &field.fixed) {
            (_, Some(why)) => Err(why.clone()),
            (Json::Null, None) if field.required => Err("is required".to_owned()),
            (Json::Null, None) => Ok(None),
            (given, None) => field.value_of(given, &seen.names()).map(Some),
        };
        let value = value.map_err(|why| format!("{path}: {why}"))?;
        let origin = self.sources.scene.display();
        let after = edited_in(&loaded.pieces(), &path, value.as_ref()).map_err(|why| format!("{origin}: {why}"))?;
        let step = Step::new(path.to_string(), object, set.gesture);
        self.write(&file, (&loaded, &before), after, step)
    }

    pub(super) fn save_camera(&mut self) {
        let result = self.try_save_camera();
        self.notice(&result, format!("Camera saved to {}", self.sources.scene.display()));
        (self.report)(Report::Wrote("camera".to_owned(), result));
    }

    fn try_save_camera(&mut self) -> Result<(), String> {
        let (file, before) = self.settled_file("the camera")?;
        let loaded = self.read_again(&before)?;
        let camera = self.camera.as_ref().unwrap_or(&loaded.camera);
        let after = with_camera(&before, &self.sources.scene.display().to_string(), camera)?;
        let at = KeyPath(vec![Segment::from("camera")]);
        let mut step = Step::new("camera".to_owned(), at, None);
        step.is_camera = true;
        self.write(&file, (&loaded, &before), after, step)
    }

    pub(super) fn turn(&mut self, again: bool) {
        let Some(what) = self.history.last(again).map(|step| step.what.clone()) else {
            if let Some(reason) = self.state.undo_blocked.clone() {
                self.notice(&Err(reason), String::new());
            }
            return;
        };
        let result = self.try_turn(again);
        let done = if again { "Redid" } else { "Undid" };
        self.notice(&result, format!("{done}: {what}"));
        let action = if again { "Redo" } else { "Undo" };
        let text = if result.is_ok() { done } else { action };
        (self.report)(Report::Turned(format!("{text}: {what}"), result));
    }

    pub(super) fn forget_writes(&mut self) {
        if self.history.forget() {
            let place = self.sources.scene.display();
            let reason = format!("Undo is not possible: {place} was changed by another program");
            self.state.undo_blocked = Some(reason);
        }
    }

    fn try_turn(&mut self, again: bool) -> Result<(), String> {
        let (file, before) = self.scene_file("values")?;
        let place = self.sources.scene.display().to_string();
        let others = || format!("{place}: another program has changed the file; nothing was undone");
        let loaded = self
            .loaded
            .clone()
            .filter(|loaded| loaded.text == before)
            .ok_or_else(others)?;
        let after = self.history.turned(&before, again).ok_or_else(others)?;
        let step = self.history.last(again).ok_or_else(others)?;
        let (at, keeps_view) = (step.at.clone(), step.is_camera && !again);
        let read = self.read_change(&loaded, &at, after)?;
        self.replace(&file, &before, &read)?;
        self.history.turn(again);
        // If saving the camera is undone, the image keeps showing the saved camera.
        let view = keeps_view.then(|| self.camera.clone().unwrap_or(loaded.camera.clone()));
        let shown_otherwise = self.take_written(read);
        if let (Some(view), Some(loaded)) = (view, &self.loaded) {
            self.camera = (view != loaded.camera).then_some(view);
        }
        self.show_files(Instant::now(), shown_otherwise);
        Ok(())
    }

    /// Returns the path of the scene file, with symbolic links resolved, and the text.
    fn scene_file(&self, what: &str) -> Result<(PathBuf, String), String> {
        let scene = &self.sources.scene;
        let place = scene.display();
        if let Some(reason) = self.sources.read_only() {
            return Err(format!("{place}: cannot save {what}: {reason}"));
        }
        let file = fs::canonicalize(scene).map_err(|error| format!("{place}: {error}"))?;
        let text = read_text(scene).map_err(|error| error.to_string())?;
        Ok((file, text))
    }

    /// Like [`Self::scene_file`], but waits while another program is writing the file.
    fn settled_file(&self, what: &str) -> Result<(PathBuf, String), String> {
        let (file, text) = self.scene_file(what)?;
        if self.loaded.as_ref().is_some_and(|loaded| loaded.text == text) {
            return Ok((file, text));
        }
        wait_settled(&self.sources.scene)?;
        self.scene_file(what)
    }

    /// Returns the scene for the text of the file: the loaded scene, unless another program changed the file.
    fn read_again(&self, text: &str) -> Result<Arc<Loaded>, String> {
        if let Some(loaded) = self.loaded.as_ref().filter(|loaded| loaded.text == text) {
            return Ok(Arc::clone(loaded));
        }
        let origin = self.sources.scene.display().to_string();
        let folder = folder_of(&self.sources.scene);
        let read = PendingScene::read(text, &origin, folder, &self.sources.overrides);
        let read = read.and_then(|draft| draft.check(&mut BTreeSet::new()));
        let (scene, description) = read.map_err(|error| {
            let (errors, _) = error.each();
            format!("fix the file first: {}", errors.first().unwrap_or(&error))
        })?;
        Ok(Arc::new(Loaded::new(text.to_owned(), scene, description)))
    }

    /// Returns the scene for a text that differs from the known scene's text only inside one table.
    fn read_change(&self, known: &Loaded, at: &KeyPath, text: String) -> Result<Arc<Loaded>, String> {
        let origin = self.sources.scene.display().to_string();
        let folder = folder_of(&self.sources.scene);
        let known = (&known.description, at);
        let read = PendingScene::change(&text, &origin, folder, &self.sources.overrides, known);
        let read = read.and_then(|(draft, places)| Ok((draft.check(&mut BTreeSet::new())?, places)));
        let ((scene, description), places) = read.map_err(|error| error.to_string())?;
        Ok(Arc::new(Loaded::new(text, scene, description).with_places(places)))
    }

    fn write(
        &mut self,
        file: &Path,
        (known, before): (&Loaded, &str),
        after: String,
        step: Step,
    ) -> Result<(), String> {
        if after == before {
            return Ok(());
        }
        let read = self.read_change(known, &step.at, after)?;
        self.replace(file, before, &read)?;
        if self.loaded.as_ref().is_none_or(|loaded| loaded.text != before) {
            self.forget_writes();
        }
        self.state.undo_blocked = None;
        self.history.add(step, before, &read.text);
        let shown_otherwise = self.take_written(read);
        self.show_files(Instant::now(), shown_otherwise);
        Ok(())
    }

    fn replace(&self, file: &Path, before: &str, read: &Loaded) -> Result<(), String> {
        let place = self.sources.scene.display();
        replace_known(file, before.as_bytes(), read.text.as_bytes())
            .map_err(|error| format!("{place}: cannot be written: {error}"))
    }

    /// Takes over a scene that this session has written, so that the file is not read again.
    fn take_written(&mut self, read: Arc<Loaded>) -> bool {
        if let Some((_, stamp)) = self.files.first_mut() {
            *stamp = FileStamp::Content(read.text.clone().into_bytes());
        }
        {
            let mut writes = self.writes.lock().unwrap_or_else(PoisonError::into_inner);
            writes.count += 1;
            writes.known = (!self.files.is_empty()).then(|| (Arc::clone(&read), self.files.clone()));
        }
        self.take_scene(Ok(read))
    }
}

/// Changes one number of a list; returns the path, the field and the new value of the list.
fn with_element(seen: &SceneView, path: &KeyPath, given: &Json) -> Option<(KeyPath, Field, Json)> {
    let (Segment::Index(i), list) = path.0.split_last()? else {
        return None;
    };
    let list = KeyPath(list.to_vec());
    let field = seen.field(&list)?;
    let mut numbers = field.value.as_ref().or(field.default.as_ref())?.as_array()?.clone();
    *numbers.get_mut(*i)? = given.clone();
    Some((list, field, numbers.into()))
}
