//! Which view is shown: what is asked for, what the scene has, and what the running kernel can show.

use std::time::Instant;

use super::Painter;
use crate::dev::build::guarded;
use crate::dev::picture::{LayerName, View};
use crate::dev::source::shown;

impl Painter {
    pub(super) fn choose_view(&mut self, view: View) {
        let kernel = |painter: &Painter| painter.loaded.as_ref().map(|loaded| painter.constants(loaded));
        let before = kernel(self);
        self.view = view;
        self.keep_view();
        let view = self.seen();
        if let Some(running) = &mut self.running {
            running.halted = false;
            match guarded(|| running.canvas.change_view(view)) {
                Ok(()) => self.changed((Instant::now(), false)), // the camera may have moved meanwhile
                Err(error) => return self.fail(&error),
            }
            self.show_what_is_there();
        }
        if kernel(self) != before {
            self.settle((Instant::now(), false)); // it takes a kernel of its own
        }
    }

    /// Shows what is rendered of a view already.
    pub(super) fn show_what_is_there(&mut self) {
        if self.is_done() || self.running.as_ref().is_some_and(|running| !running.canvas.is_new()) {
            self.show();
        }
    }

    /// A view that the scene or the shaders do not have is colour's.
    pub(super) fn keep_view(&mut self) {
        if self.loaded.is_none() {
            return;
        }
        let told = match self.view {
            View::Layer(name) if self.layer().is_none() => {
                let there = self.layers();
                let there = match there.is_empty() {
                    true => "there is none".to_string(),
                    false => {
                        let names: Vec<&str> = there.iter().map(LayerName::as_str).collect();
                        format!("there are {}", names.join(", "))
                    }
                };
                format!("the shaders have no layer `{}`: {there}", name.as_str())
            }
            view => match (view.aov(), self.missing(view)) {
                (Some(aov), Some(rule)) => format!("view `{}`: {rule}", aov.name()),
                _ => return,
            },
        };
        self.view = View::Color;
        self.notice(&Err(told), String::new());
    }

    /// Why the scene does not have what a view shows; `None` if it does.
    fn missing(&self, view: View) -> Option<&'static str> {
        let packed = &self.loaded.as_ref()?.packed;
        view.aov()?.missing(packed.integrator, packed.adaptive)
    }

    /// The views that the scene does not have, and why.
    pub(super) fn missing_views(&self) -> Vec<(View, &'static str)> {
        let rules = View::LAYERS.iter().map(|view| (*view, self.missing(*view)));
        rules.filter_map(|(view, rule)| Some((view, rule?))).collect()
    }

    /// What the running kernel shows: what is asked for, unless that takes another one.
    pub(super) fn seen(&self) -> View {
        match &self.running {
            Some(running) => shown(&running.constants, self.view),
            None => View::Color,
        }
    }
}
