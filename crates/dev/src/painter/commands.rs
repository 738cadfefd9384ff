//! Execution of commands for the camera, the view and the limits.

use std::num::NonZeroU32;
use std::time::Instant;

use super::Painter;
use crate::build::guarded;
use crate::canvas::Limits;
use crate::messages::{Command, Notice};
use crate::picture::View;
use crate::source::{KernelChoice, Loaded};
use wgray_render::pack::pack_camera;
use wgray_trace::records::{Camera, Packed};

impl Painter {
    pub(super) fn execute(&mut self, command: Command) {
        match command {
            Command::Grab => self.camera_history.end_step(),
            Command::Move(camera_move) => self.move_camera(camera_move),
            Command::Viewpoint(viewpoint) => self.set_viewpoint(viewpoint),
            Command::Frame(pixel) => self.frame_object(pixel),
            Command::Back => self.retrace(false),
            Command::Forth => self.retrace(true),
            Command::ResetCamera => self.reset_camera(),
            Command::SaveCamera => self.save_camera(),
            Command::Set(set) => self.set(&set),
            Command::UndoWrite => self.undo_or_redo(false),
            Command::RedoWrite => self.undo_or_redo(true),
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
            Command::DisplaySettings(overrides) => match overrides.checked() {
                Ok(overrides) => {
                    self.display_overrides = overrides;
                    self.show();
                }
                Err(error) => self.notice(&Err(error), String::new()),
            },
            Command::Pause(paused) => self.paused = paused,
            Command::Restart => {
                self.restart_pending = true;
                if let Some(running) = &mut self.running {
                    running.halted = false;
                }
            }
            Command::Samples(max) => {
                let samples = max.map_or(u32::MAX, NonZeroU32::get);
                self.set_limits(Limits { samples, ..self.limits });
            }
            Command::Preview(preview) => {
                let scale = preview.scale();
                self.set_limits(Limits { scale, ..self.limits });
            }
            Command::Keep => self.keep_reference(),
        }
    }

    fn set_limits(&mut self, limits: Limits) {
        if limits == self.limits {
            return;
        }
        self.limits = limits;
        let view = self.shown_view();
        let Some(running) = &mut self.running else { return };
        match guarded(|| running.canvas.set_limits(limits, view)) {
            Ok(()) => self.record_start((Instant::now(), false)),
            Err(error) => return self.fail(&error),
        }
        if self.is_done() {
            self.show();
        }
    }

    /// Shows a notice: the error of `result`, or `message`.
    pub(super) fn notice(&mut self, result: &Result<(), String>, message: String) {
        let number = self.state.notice.as_ref().map_or(0, |notice| notice.number) + 1;
        let (text, bad) = match result {
            Ok(()) => (message, false),
            Err(error) => (error.clone(), true),
        };
        self.state.notice = Some(Notice {
            number,
            command: self.executed_commands + 1,
            text,
            bad,
        });
    }

    /// Withdraws an error notice, after a later value was accepted.
    pub(super) fn clear_error(&mut self) {
        if self.state.notice.as_ref().is_some_and(|notice| notice.bad) {
            self.notice(&Ok(()), String::new());
        }
    }

    pub(super) fn packed_camera(&self, loaded: &Loaded) -> Camera {
        let (file_camera, origin) = (loaded.packed.camera, loaded.packed.origin);
        let moved = self.camera.as_ref().and_then(|camera| camera.validate().ok());
        moved.map_or(file_camera, |camera| {
            pack_camera(&camera, origin, file_camera.width, file_camera.height, file_camera.seed)
        })
    }

    /// Returns the packed scene with the current camera, for the selected view.
    pub(super) fn packed(&self, loaded: &Loaded) -> Packed {
        let KernelChoice { specialization, .. } = KernelChoice::of(&loaded.packed, self.view, false);
        Packed {
            camera: self.packed_camera(loaded),
            specialization,
            ..loaded.packed.clone()
        }
    }
}
