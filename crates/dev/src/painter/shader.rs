//! The shaders of the session, the values of their sliders, and the previously shown kernel.

use std::sync::Arc;
use std::time::Instant;

use super::{Painter, Running};
use crate::build::guarded;
use crate::source::KernelChoice;
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::sliders::{Value, sliders};

impl Painter {
    pub(super) fn set_shaders(&mut self, shaders: Arc<Shaders>) {
        if self.shaders.as_ref() == Some(&shaders) {
            return;
        }
        if self.shaders.as_ref().is_some_and(|old| !old.has_same_code(&shaders)) {
            self.keep_previous_image();
        }
        let last_good = self.last_good.as_ref();
        self.rejected
            .retain(|(rejected, _)| *rejected == shaders || Some(rejected) == last_good);
        // A kernel with unchanged code keeps running, but errors and sliders refer to the new text.
        let kernels = [&mut self.running, &mut self.parked].into_iter().flatten();
        for kernel in kernels.filter(|kernel| kernel.shaders.has_same_code(&shaders)) {
            let KernelChoice {
                integrator, adaptive, ..
            } = kernel.kernel_choice;
            kernel.sliders = sliders(&shaders, integrator, adaptive);
            kernel.shaders = shaders.clone();
        }
        if let Some(last_good) = self.last_good.as_mut().filter(|old| old.has_same_code(&shaders)) {
            *last_good = shaders.clone();
        }
        self.shaders = Some(shaders);
    }

    pub(super) fn slide(&mut self, file: &str, name: &str, value: Value) {
        let sliders = self.running.as_ref().map_or(&[][..], |running| &running.sliders);
        match self.sliders.slide(sliders, file, name, value) {
            Ok(is_new) => {
                self.clear_error();
                if is_new {
                    self.upload_sliders((Instant::now(), false));
                }
            }
            Err(error) => self.notice(&Err(error), String::new()),
        }
    }

    /// Resets all sliders, or one slider, given by file and name.
    pub(super) fn reset_sliders(&mut self, slider: Option<(String, String)>) {
        self.sliders.reset(slider);
        self.upload_sliders((Instant::now(), false));
    }

    /// Uploads the slider values, which apply from the next image on.
    pub(super) fn upload_sliders(&mut self, change: (Instant, bool)) {
        let Some(running) = &mut self.running else { return };
        if self.sliders.bits(&running.sliders) != running.slider_values {
            running.halted = false;
            self.restart_pending = true;
            self.change.get_or_insert(change);
        }
    }

    /// Switches to the parked kernel if it has these shaders and this kernel choice. Returns true if the kernel was
    /// switched.
    pub(super) fn unpark(&mut self, shaders: &Arc<Shaders>, kernel_choice: &KernelChoice) -> bool {
        let matches = |parked: &Running| parked.shaders == *shaders && parked.kernel_choice == *kernel_choice;
        let is_parked = self.parked.as_ref().is_some_and(matches);
        if is_parked {
            std::mem::swap(&mut self.running, &mut self.parked);
        }
        is_parked
    }

    /// Shows the current image of a kernel that was parked.
    pub(super) fn show_parked(&mut self, change: (Instant, bool)) {
        let (view, limits) = (self.shown_view(), self.limits);
        let packed = self.loaded.as_ref().map(|loaded| self.packed(loaded));
        let Some(running) = &mut self.running else { return };
        running.halted = false;
        let result = guarded(|| {
            running.canvas.set_limits(limits, view)?;
            running.canvas.change_view(view)
        });
        // If the scene or the camera changed, the caller restarts the image, and the old image is not shown.
        let is_current = packed.is_some_and(|packed| running.canvas.renders(&packed));
        match result {
            Ok(()) => {
                self.record_change(change);
                self.upload_sliders(change);
                if is_current {
                    self.show_if_available();
                }
            }
            Err(error) => self.fail(&error),
        }
    }
}
