//! Sliders and layers of shaders, and the kernels for them.

use std::sync::Arc;
use std::time::Instant;

use super::{Painter, Running};
use crate::build::guarded;
use crate::diagnostic::Diagnostic;
use crate::messages::Report;
use crate::picture::{LayerName, View};
use crate::source::Constants;
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::marks::{Layer, Value};
use wgray_render::gpu::{Forms, check_kernels};

impl Painter {
    /// Takes the current shaders of the files.
    pub(super) fn read_shaders(&mut self, shaders: Arc<Shaders>) {
        self.sliders.read(shaders.clone());
        let folder = self.sources.shaders.as_deref();
        let mistakes = self.sliders.marks().mistakes.iter();
        self.problems.marks = mistakes
            .map(|error| Diagnostic::shader(error, &shaders, folder))
            .collect();
        self.take_shaders();
    }

    /// Takes the shaders to compile: those of the files, with slider values that must be compiled in. Returns whether
    /// they changed.
    pub(super) fn take_shaders(&mut self) -> bool {
        let Some(shaders) = self.sliders.shaders() else {
            return false;
        };
        if self.shaders.as_ref().is_some_and(|known| Arc::ptr_eq(known, &shaders)) {
            return false;
        }
        let good = self.good.as_ref();
        self.refused
            .retain(|(known, _)| *known == shaders || Some(known) == good);
        // A kernel with the same code keeps running: later errors refer to the lines of the new text.
        let kernels = [&mut self.running, &mut self.parked].into_iter().flatten();
        let known = kernels.map(|kernel| &mut kernel.shaders).chain(&mut self.good);
        for known in known.filter(|known| known.has_same_code(&shaders)) {
            *known = shaders.clone();
        }
        self.shaders = Some(shaders);
        true
    }

    pub(super) fn slide(&mut self, file: &str, name: &str, value: Value) {
        match self.sliders.slide(file, name, value) {
            Ok(is_new) => {
                self.taken();
                if is_new {
                    self.slid();
                }
            }
            Err(error) => self.notice(&Err(error), String::new()),
        }
    }

    pub(super) fn reset_sliders(&mut self, one: Option<(&str, &str)>) {
        if self.sliders.reset(one) {
            self.slid();
        }
    }

    /// Renders with moved sliders: the running kernel gets their values, or another one is compiled.
    fn slid(&mut self) {
        if self.take_shaders() {
            self.settle((Instant::now(), false));
        }
        self.upload_sliders((Instant::now(), false));
    }

    /// Makes the running kernel use the values of its sliders, from the next image on.
    pub(super) fn upload_sliders(&mut self, since: (Instant, bool)) {
        let Some(running) = &mut self.running else { return };
        if self.sliders.values(running.canvas.live().sliders()) != running.sliders {
            running.halted = false;
            self.camera_waits = true;
            self.since.get_or_insert(since);
        }
    }

    /// Saves the slider values to the shader files.
    pub(super) fn write_sliders(&mut self) {
        let result = match &self.sources.shaders {
            None => Err("The built-in shaders cannot be changed; use --shaders DIR".to_string()),
            Some(_) if !self.sliders.are_moved() => Err("No slider has been moved".to_string()),
            Some(folder) => {
                let folder = folder.clone();
                self.check_written().and_then(|()| self.sliders.write(&folder))
            }
        };
        self.tell_written(result, "Saved sliders to shaders");
    }

    /// With a value from a buffer a kernel may compile that does not with the constant: 1 / c, where c is 0.
    fn check_written(&self) -> Result<(), String> {
        let (Some(loaded), Some(shaders)) = (&self.loaded, self.sliders.as_written()) else {
            return Ok(());
        };
        let first = |shaders: &Shaders| {
            let refused = check_kernels(&loaded.packed, shaders, Forms::Buffers).err();
            refused.and_then(|errors| errors.0.into_iter().next())
        };
        first(&shaders).map_or(Ok(()), |error| {
            let why = match self.sliders.files().and_then(first) {
                None => "with these values the shaders would not compile",
                Some(_) => "the shaders do not compile",
            };
            Err(format!("{why}; nothing was saved: {}: {}", error.place, error.message))
        })
    }

    /// Undoes the last save of sliders.
    pub(super) fn take_back_sliders(&mut self) {
        if self.sliders.can_take_back() {
            let result = self.sliders.take_back();
            self.tell_written(result, "Undid saving sliders");
        }
    }

    fn tell_written(&mut self, result: Result<usize, String>, what: &'static str) {
        let files = |count: &usize| format!("{what}: {count} {}", if *count == 1 { "file" } else { "files" });
        let told = result.as_ref().map(files).unwrap_or_default();
        let result = result.map(drop);
        self.notice(&result, told);
        (self.report)(Report::Written(what, result));
    }

    /// Returns the selected layer, if the shaders have it.
    pub(super) fn layer(&self) -> Option<&Layer> {
        let (View::Layer(name), Some(loaded)) = (self.view, &self.loaded) else {
            return None;
        };
        self.sliders
            .layers(loaded.packed.integrator)
            .find(|layer| layer.name == name.as_str())
    }

    /// Returns the names of the layers.
    pub(super) fn layers(&self) -> Vec<LayerName> {
        let Some(loaded) = &self.loaded else { return Vec::new() };
        let layers = self.sliders.layers(loaded.packed.integrator);
        let mut names: Vec<LayerName> = layers.filter_map(|layer| LayerName::new(&layer.name)).collect();
        names.dedup();
        names
    }

    /// Switches back to the previous kernel, if it is the one that is needed.
    pub(super) fn take_parked(&mut self, shaders: &Arc<Shaders>, constants: &Constants) -> bool {
        let fits = |parked: &Running| parked.shaders == *shaders && parked.constants == *constants;
        let found = self.parked.as_ref().is_some_and(fits);
        if found {
            std::mem::swap(&mut self.running, &mut self.parked);
        }
        found
    }

    /// Shows the kernel that was switched to, with its current image.
    pub(super) fn show_parked(&mut self, since: (Instant, bool)) {
        let (view, limits) = (self.seen(), self.limits);
        let packed = self.loaded.as_ref().map(|loaded| self.packed(loaded));
        let Some(running) = &mut self.running else { return };
        running.halted = false;
        let shown = guarded(|| {
            running.canvas.set_limits(limits, view)?;
            running.canvas.change_view(view)
        });
        // If the scene or the camera changed meanwhile, the image is started again at once.
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
