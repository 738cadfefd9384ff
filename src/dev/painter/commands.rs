//! What those who look ask for: the camera and the view.

use std::time::Instant;

use super::Painter;
use crate::dev::build::guarded;
use crate::dev::camera::{Move, moved};
use crate::dev::messages::{Command, Notice};
use crate::dev::picture::View;
use crate::dev::source::Loaded;
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
            Command::Set(set) => self.set(&set),
            Command::UndoWrite => self.turn(false),
            Command::RedoWrite => self.turn(true),
            Command::View(view) => {
                self.view = view;
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
            }
            Command::Gain(gain) => {
                self.gain = gain.clamp(1.0, 1e9);
                if self.view == View::Compare && self.running.is_some() {
                    self.show();
                }
            }
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

    pub(super) fn notice(&mut self, result: &Result<(), String>, good: String) {
        let number = self.state.notice.as_ref().map_or(0, |notice| notice.number) + 1;
        let (text, bad) = match result {
            Ok(()) => (good, false),
            Err(error) => (error.clone(), true),
        };
        self.state.notice = Some(Notice {
            number,
            command: self.heard + 1,
            text,
            bad,
        });
    }

    /// The camera that is looked through, for a scene.
    pub(super) fn packed_camera(&self, loaded: &Loaded) -> Camera {
        let (own, origin) = (loaded.packed.camera, loaded.packed.origin);
        let camera = self.camera.as_ref().and_then(|camera| camera.validate().ok());
        camera.map_or(own, |camera| {
            pack_camera(&camera, origin, own.width, own.height, own.seed)
        })
    }

    /// A scene with the camera that is looked through.
    pub(super) fn packed(&self, loaded: &Loaded) -> Packed {
        Packed {
            camera: self.packed_camera(loaded),
            ..loaded.packed.clone()
        }
    }
}
