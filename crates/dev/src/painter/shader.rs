//! The shaders of the session, the values of their sliders, and the previously shown kernel.

use std::sync::Arc;
use std::time::Instant;

use super::{Painter, Running};
use crate::build::guarded;
use crate::source::Constants;
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::sliders::{Value, sliders};

impl Painter {
    pub(super) fn take_shaders(&mut self, shaders: Arc<Shaders>) {
        if self.shaders.as_ref() == Some(&shaders) {
            return;
        }
        if self
            .shaders
            .as_ref()
            .is_some_and(|known| !known.has_same_code(&shaders))
        {
            self.keep_before();
        }
        let good = self.good.as_ref();
        self.refused
            .retain(|(known, _)| *known == shaders || Some(known) == good);
        // A kernel with unchanged code keeps running, but errors and sliders refer to the new text.
        let kernels = [&mut self.running, &mut self.parked].into_iter().flatten();
        for kernel in kernels.filter(|kernel| kernel.shaders.has_same_code(&shaders)) {
            let (_, integrator, adaptive) = kernel.constants;
            kernel.sliders = sliders(&shaders, integrator, adaptive);
            kernel.shaders = shaders.clone();
        }
        if let Some(good) = self.good.as_mut().filter(|good| good.has_same_code(&shaders)) {
            *good = shaders.clone();
        }
        self.shaders = Some(shaders);
    }

    pub(super) fn slide(&mut self, file: &str, name: &str, value: Value) {
        let sliders = self.running.as_ref().map_or(&[][..], |running| &running.sliders);
        match self.sliders.slide(sliders, file, name, value) {
            Ok(is_new) => {
                self.taken();
                if is_new {
                    self.upload_sliders((Instant::now(), false));
                }
            }
            Err(error) => self.notice(&Err(error), String::new()),
        }
    }

    pub(super) fn reset_sliders(&mut self, one: Option<(String, String)>) {
        self.sliders.reset(one);
        self.upload_sliders((Instant::now(), false));
    }

    /// Uploads the slider values, which apply from the next image on.
    pub(super) fn upload_sliders(&mut self, since: (Instant, bool)) {
        let Some(running) = &mut self.running else { return };
        if self.sliders.bits(&running.sliders) != running.slider_values {
            running.halted = false;
            self.camera_waits = true;
            self.since.get_or_insert(since);
        }
    }

    /// Switches back to the previous kernel, if needed.
    pub(super) fn take_parked(&mut self, shaders: &Arc<Shaders>, constants: &Constants) -> bool {
        let fits = |parked: &Running| parked.shaders == *shaders && parked.constants == *constants;
        let found = self.parked.as_ref().is_some_and(fits);
        if found {
            std::mem::swap(&mut self.running, &mut self.parked);
        }
        found
    }

    /// Shows the parked kernel with its current image.
    pub(super) fn show_parked(&mut self, since: (Instant, bool)) {
        let (view, limits) = (self.seen(), self.limits);
        let packed = self.loaded.as_ref().map(|loaded| self.packed(loaded));
        let Some(running) = &mut self.running else { return };
        running.halted = false;
        let shown = guarded(|| {
            running.canvas.set_limits(limits, view)?;
            running.canvas.change_view(view)
        });
        // If the scene or the camera changed, the image restarts immediately.
        let is_current = packed.is_some_and(|packed| running.canvas.shows(&packed));
        match shown {
            Ok(()) => {
                self.changed(since);
                self.upload_sliders(since);
                if is_current {
                    self.show_what_is_there();
                }
            }
            Err(error) => self.fail(&error),
        }
    }
}
