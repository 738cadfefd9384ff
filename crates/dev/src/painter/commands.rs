//! Execution of commands for the camera, the view and the limits.

use std::num::NonZeroU32;
use std::time::Instant;

use super::Painter;
use crate::build::guarded;
use crate::canvas::Limits;
use crate::messages::{Command, Notice};
use crate::picture::View;
use crate::source::{Constants, Loaded, constants};
use wgray_render::pack::pack_camera;
use wgray_render::records::{Camera, Packed};

impl Painter {
    pub(super) fn take_command(&mut self, command: Command) {
        match command {
            Command::Grab => self.walk.end_step(),
            Command::Move(by) => self.move_camera(by),
            Command::Viewpoint(viewpoint) => self.place_camera(viewpoint),
            Command::Frame(pixel) => self.frame(pixel),
            Command::Back => self.retrace(false),
            Command::Forth => self.retrace(true),
            Command::ResetCamera => self.reset_camera(),
            Command::SaveCamera => self.save_camera(),
            Command::Set(set) => self.set(&set),
            Command::UndoWrite => self.turn(false),
            Command::RedoWrite => self.turn(true),
            Command::View(view) => self.choose_view(view),
            Command::Gain(gain) => {
                self.gain = gain.clamp(1.0, 1e9);
                if matches!(self.view, View::Compare(_)) {
                    self.show();
                }
            }
            Command::Slide { file, name, value } => self.slide(&file, &name, value),
            Command::ResetSlider(file, name) => self.reset_sliders(Some((file, name))),
            Command::ResetSliders => self.reset_sliders(None),
            Command::Marks(marks) => {
                self.marks = marks;
                self.show();
            }
            Command::DisplaySettings(choice) => match choice.checked() {
                Ok(look) => {
                    self.look = look;
                    self.show();
                }
                Err(error) => self.notice(&Err(error), String::new()),
            },
            Command::Pause(paused) => self.paused = paused,
            Command::Restart => {
                self.camera_waits = true; // starts again from the current camera
                if let Some(running) = &mut self.running {
                    running.halted = false;
                }
            }
            Command::Samples(most) => {
                let samples = most.map_or(u32::MAX, NonZeroU32::get);
                self.limit(Limits { samples, ..self.limits });
            }
            Command::Preview(preview) => {
                let scale = preview.scale();
                self.limit(Limits { scale, ..self.limits });
            }
            Command::Keep => self.keep(),
        }
    }

    fn limit(&mut self, limits: Limits) {
        if limits == self.limits {
            return;
        }
        self.limits = limits;
        let view = self.seen();
        let Some(running) = &mut self.running else { return };
        match guarded(|| running.canvas.set_limits(limits, view)) {
            Ok(()) => self.begun((Instant::now(), false)),
            Err(error) => return self.fail(&error),
        }
        if self.is_done() {
            self.show();
        }
    }

    pub(super) fn notice(&mut self, result: &Result<(), String>, good: String) {
        let number = self.state.notice.as_ref().map_or(0, |notice| notice.number) + 1;
        let (text, bad) = match result {
            Ok(()) => (good, false),
            Err(error) => (error.clone(), true),
        };
        self.state.notice = Some(Notice {
            number,
            command: self.executed + 1,
            text,
            bad,
        });
    }

    /// A value was accepted: withdraws earlier errors.
    pub(super) fn taken(&mut self) {
        if self.state.notice.as_ref().is_some_and(|notice| notice.bad) {
            self.notice(&Ok(()), String::new());
        }
    }

    pub(super) fn packed_camera(&self, loaded: &Loaded) -> Camera {
        let (own, origin) = (loaded.packed.camera, loaded.packed.origin);
        let camera = self.camera.as_ref().and_then(|camera| camera.validate().ok());
        camera.map_or(own, |camera| {
            pack_camera(&camera, origin, own.width, own.height, own.seed)
        })
    }

    /// For the selected view.
    pub(super) fn constants(&self, loaded: &Loaded) -> Constants {
        constants(&loaded.packed, self.view)
    }

    /// With the current camera, for the selected view.
    pub(super) fn packed(&self, loaded: &Loaded) -> Packed {
        let (specialization, ..) = self.constants(loaded);
        Packed {
            camera: self.packed_camera(loaded),
            specialization,
            ..loaded.packed.clone()
        }
    }
}
