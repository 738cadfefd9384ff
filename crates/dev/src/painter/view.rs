//! The selected view, the views that the scene provides, and the views that the running kernel can show.

use std::time::Instant;

use super::Painter;
use crate::build::guarded;
use crate::picture::View;

impl Painter {
    pub(super) fn choose_view(&mut self, view: View) {
        let kernel = |painter: &Painter| painter.target().map(|(_, _, kernel_choice)| kernel_choice);
        let before = kernel(self);
        self.view = view;
        self.replace_unavailable_view();
        let view = self.shown_view();
        if let Some(running) = &mut self.running {
            running.halted = false;
            match guarded(|| running.canvas.change_view(view)) {
                Ok(()) => self.record_change((Instant::now(), false)), // the camera may have moved meanwhile
                Err(error) => return self.fail(&error),
            }
            self.show_if_available();
        }
        if kernel(self) != before {
            self.synchronize((Instant::now(), false)); // the view needs a different kernel
        }
    }

    /// Shows the current image, if the canvas has a result.
    pub(super) fn show_if_available(&mut self) {
        if self.is_done() || self.running.as_ref().is_some_and(|running| !running.canvas.is_new()) {
            self.show();
        }
    }

    /// Falls back to the color view if the scene does not provide the selected view.
    pub(super) fn replace_unavailable_view(&mut self) {
        if self.loaded.is_none() {
            return;
        }
        let (Some(aov), Some(rule)) = (self.view.aov(), self.missing(self.view)) else {
            return;
        };
        self.view = View::Color;
        self.notice(&Err(format!("view `{}`: {rule}", aov.name())), String::new());
    }

    /// Returns the reason if the scene does not provide a view.
    fn missing(&self, view: View) -> Option<&'static str> {
        let packed = &self.loaded.as_ref()?.packed;
        view.aov()?.missing(packed.integrator)
    }

    /// Returns the views that the scene does not provide, and the reasons.
    pub(super) fn missing_views(&self) -> Vec<(View, &'static str)> {
        let rules = View::LAYERS.iter().map(|view| (*view, self.missing(*view)));
        rules.filter_map(|(view, rule)| Some((view, rule?))).collect()
    }

    /// Returns the view that is shown: the selected view, unless it needs a different kernel.
    pub(super) fn shown_view(&self) -> View {
        match &self.running {
            Some(running) => running.kernel_choice.supported_view(self.view),
            None => View::Color,
        }
    }
}
