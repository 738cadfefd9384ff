//! What those who look ask for: the camera and the view.

use std::time::Instant;

use super::Painter;
use crate::dev::build::guarded;
use crate::dev::camera::{Move, moved};
use crate::dev::messages::{Command, Notice, Report};
use crate::dev::picture::{LayerName, View};
use crate::dev::save::save_camera;
use crate::dev::source::{Constants, Loaded, constants};
use crate::pack::{Camera, Packed, pack_camera};

impl Painter {
    pub(super) fn take_command(&mut self, command: Command) {
        match command {
            Command::Move(by) => self.move_camera(by),
            Command::ResetCamera => {
                if self.camera.take().is_some() {
                    self.camera_moved();
                }
            }
            Command::SaveCamera => self.save_camera(),
            Command::UndoSave => self.undo_save(),
            Command::View(view) => {
                let old = std::mem::replace(&mut self.view, view);
                self.keep_view();
                let other_layer = self.view.layer() != old.layer();
                let view = self.seen();
                if let Some(running) = &mut self.running {
                    running.halted = false;
                    match guarded(|| running.canvas.change_view(view)) {
                        Ok(()) => self.changed((Instant::now(), false)), // the camera may have moved meanwhile
                        Err(error) => return self.fail(&error),
                    }
                    if self.is_done() {
                        self.show();
                    }
                }
                if other_layer {
                    self.settle((Instant::now(), false)); // it takes a kernel of its own
                }
            }
            Command::Gain(gain) => {
                self.gain = gain.clamp(1.0, 1e9);
                if self.view == View::Compare && self.running.is_some() {
                    self.show();
                }
            }
            Command::Slide { file, name, value } => self.slide(&file, &name, value),
            Command::ResetSlider(file, name) => self.reset_sliders(Some((&file, &name))),
            Command::ResetSliders => self.reset_sliders(None),
            Command::WriteSliders => self.write_sliders(),
            Command::UndoSliders => self.take_back_sliders(),
            Command::Marks(marks) => {
                self.marks = marks;
                if self.running.is_some() {
                    self.show();
                }
            }
        }
    }

    fn move_camera(&mut self, by: Move) {
        let Some(loaded) = &self.loaded else { return };
        let old = self.camera.as_ref().unwrap_or(&loaded.camera);
        let new = moved(old, by);
        if new != *old {
            self.camera = (new != loaded.camera).then_some(new);
            self.camera_moved();
        }
    }

    fn camera_moved(&mut self) {
        self.camera_waits = true;
        if let Some(running) = &mut self.running {
            running.halted = false;
        }
        self.since.get_or_insert((Instant::now(), false));
    }

    fn save_camera(&mut self) {
        let Some(loaded) = &self.loaded else { return };
        let camera = self.camera.as_ref().unwrap_or(&loaded.camera);
        let result = save_camera(&self.sources.scene, camera).map(|saved| {
            self.saved = saved.or(self.saved.take());
        });
        self.notice(&result, format!("camera saved into {}", self.sources.scene.display()));
        (self.report)(Report::Saved(result));
    }

    /// Takes the last save back; the camera stays where it is.
    fn undo_save(&mut self) {
        let (Some(saved), Some(loaded)) = (self.saved.take(), &self.loaded) else {
            return;
        };
        let result = saved.undo();
        if result.is_ok() {
            self.camera.get_or_insert_with(|| loaded.camera.clone());
            self.taken_back = true;
        }
        self.notice(
            &result,
            format!("{} is as it was before the save", self.sources.scene.display()),
        );
        (self.report)(Report::Unsaved(result));
    }

    pub(super) fn notice(&mut self, result: &Result<(), String>, good: String) {
        let number = self.state.notice.as_ref().map_or(0, |notice| notice.number) + 1;
        let (text, bad) = match result {
            Ok(()) => (good, false),
            Err(error) => (error.clone(), true),
        };
        self.state.notice = Some(Notice { number, text, bad });
    }

    /// The camera that is looked through, for a scene.
    pub(super) fn packed_camera(&self, loaded: &Loaded) -> Camera {
        let (own, origin) = (loaded.packed.camera, loaded.packed.origin);
        let camera = self.camera.as_ref().and_then(|camera| camera.validate().ok());
        camera.map_or(own, |camera| {
            pack_camera(&camera, origin, own.width, own.height, own.seed)
        })
    }

    /// What a scene's kernel is compiled for, to show what is asked for.
    pub(super) fn constants(&self, loaded: &Loaded) -> Constants {
        constants(
            &loaded.packed,
            self.layer().and_then(|layer| LayerName::new(&layer.name)),
        )
    }

    /// A scene with the camera that is looked through, sampled as what is asked for needs it.
    pub(super) fn packed(&self, loaded: &Loaded) -> Packed {
        Packed {
            camera: self.packed_camera(loaded),
            adaptive: self.constants(loaded).2,
            ..loaded.packed.clone()
        }
    }
}
