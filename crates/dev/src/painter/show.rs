//! Frames and states for all viewers, and reports for the terminal.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::Instant;

use super::Painter;
use crate::build::guarded;
use crate::camera::{Viewpoint, text};
use crate::diagnostic::Diagnostic;
use crate::display_settings::DisplaySettings;
use crate::messages::{Preview, Report};
use crate::object::SceneView;
use crate::picture::{Content, Frame, Header, Names, View, png_of};
use crate::save::replace;
use wgray_scene::ViewSettings;

/// The current errors, grouped by source.
#[derive(Default)]
pub struct Problems {
    pub scene: Vec<Diagnostic>,
    pub files: Option<Diagnostic>,
    pub shader: Vec<Diagnostic>,
    /// The error if the driver truncates loops of the kernel, so that the image is incomplete.
    pub truncated: Option<Diagnostic>,
    pub device: Option<Diagnostic>,
    pub out: Option<Diagnostic>,
}

impl Problems {
    fn all(&self) -> impl Iterator<Item = &Diagnostic> {
        let shader_problems = self.files.iter().chain(&self.shader).chain(&self.truncated);
        shader_problems.chain(&self.scene).chain(&self.device).chain(&self.out)
    }
}

impl Painter {
    pub(super) fn is_done(&self) -> bool {
        self.running
            .as_ref()
            .is_some_and(|running| running.canvas.is_done(self.shown_view()))
    }

    pub(super) fn show(&mut self) {
        let (view, done) = (self.shown_view(), self.is_done());
        let Some(running) = &mut self.running else { return };
        let canvas = &mut running.canvas;
        let start = Instant::now();
        let stage = match view {
            View::Denoised => "read back, denoise",
            _ => "read back",
        };
        let (content, sent) = match guarded(|| self.times.measure(stage, || canvas.content(view))) {
            Ok(content) => content,
            Err(error) => return self.fail(&error),
        };
        let ([width, height], (samples, total), speed) = (canvas.size(), canvas.samples(), canvas.speed());
        let finest = canvas.final_size();
        let is_complete = sent == finest && samples > 0;
        let settings = (self.loaded.as_ref()).map_or(ViewSettings::default(), |loaded| loaded.scene.view);
        if let (Content::Color(colors), true) = (&content, is_complete) {
            let display = DisplaySettings {
                view: settings,
                ..DisplaySettings::default()
            };
            self.write_out(|| png_of(colors, display), done);
        }
        let (content, sides) = self.with_counterpart(content, finest);
        let change = self.change.take();
        self.latency = change
            .map(|(noticed_at, _)| noticed_at.elapsed().as_secs_f64())
            .or(self.latency);
        self.frames += 1;
        let header = Header {
            number: self.frames,
            revision: self.revision,
            view,
            width,
            height,
            sent,
            finest,
            samples,
            total,
            done,
            speed,
            latency: self.latency,
            sides,
            ..Header::default()
        };
        let names = self.loaded.as_ref().map(|loaded| Names {
            shapes: (loaded.scene.shapes.len() - loaded.scene.instances) as u32,
            instances: loaded.scene.instances as u32,
            materials: loaded.scene.material_names.clone(),
        });
        let filter_bins = self
            .loaded
            .iter()
            .flat_map(|loaded| &loaded.packed.sampling.filter_table);
        let display = DisplaySettings {
            gain: self.gain,
            marks: self.marks,
            allow_negative: filter_bins.into_iter().any(|bin| bin.z < 0.0),
            view: self.display_overrides.apply_to(settings),
            false_color: self.display_overrides.false_color,
        };
        let encode = || Frame::new(header, content, names.unwrap_or_default(), display);
        let frame = Arc::new(self.times.measure("make PNG", encode));
        self.frame_sender.send_replace(Some(frame.clone()));
        self.measure(&frame);
        self.last_frame = Instant::now();
        self.frame_cost = start.elapsed();
        if !self.is_on_cpu() {
            self.failures = 0; // an image of the CPU does not show that the device works
        }
        self.problems.truncated = None;
        if let Some(running) = self.running.as_ref().filter(|_| done || is_complete) {
            self.last_good = Some(running.shaders.clone());
        }
        if let Some((noticed_at, saved)) = change {
            self.first_frame = saved.then_some(self.last_frame);
            if saved {
                let compiled = self.next_compile_seconds.take();
                (self.report)(Report::Reloaded {
                    seconds: noticed_at.elapsed().as_secs_f64(),
                    compiled,
                });
            }
        }
        if let Some(first) = self
            .first_frame
            .take_if(|_| done && matches!(view, View::Color | View::Denoised))
        {
            (self.report)(Report::Finished {
                seconds: first.elapsed().as_secs_f64(),
            });
        }
        self.publish();
    }

    /// Replaces the file of `--out` once every pixel has a sample, and again when the image is finished.
    fn write_out(&mut self, png: impl FnOnce() -> Vec<u8>, done: bool) {
        let Some(out) = &self.out else { return };
        if done || self.written != Some(self.revision) {
            self.written = Some(self.revision);
            let error = replace(out, &png()).err();
            let problem = |error| Diagnostic::plain("file", format!("{}: cannot be written: {error}", out.display()));
            self.problems.out = error.map(problem);
        }
    }

    /// Reports that the image is too large to display, once per size.
    pub(super) fn report_size(&mut self) {
        let scale = self.limits.scale;
        let sizes = self
            .running
            .as_ref()
            .map(|running| (running.canvas.size(), running.canvas.final_size()));
        // A reduction that a viewer requested with the preview scale is not reported.
        let reduced = sizes.filter(|(full, displayed)| full.map(|side| side.div_ceil(scale)) != *displayed);
        if self.reported_sizes != reduced {
            self.reported_sizes = reduced;
            if let Some((full, displayed)) = reduced {
                (self.report)(Report::ReducedImage(full, displayed));
            }
        }
    }

    /// Publishes the scene and the camera, for queries about objects.
    fn publish_scene_view(&self) {
        let Some(loaded) = &self.loaded else { return };
        let camera = self.packed_camera(loaded);
        let is_current = |view: &Arc<SceneView>| Arc::ptr_eq(&view.loaded, loaded) && view.camera == camera;
        if !self.scene_view_sender.borrow().as_ref().is_some_and(is_current) {
            self.scene_view_sender.send_replace(Some(Arc::new(SceneView {
                loaded: Arc::clone(loaded),
                camera,
                sources: self.sources.clone(),
            })));
        }
    }

    /// Publishes the state, and reports new errors.
    pub(super) fn publish(&mut self) {
        self.publish_scene_view();
        let camera = self
            .camera
            .as_ref()
            .or(self.loaded.as_ref().map(|loaded| &loaded.camera));
        let problems: Vec<Diagnostic> = self.problems.all().cloned().collect();
        for problem in problems.iter().filter(|problem| !self.state.problems.contains(problem)) {
            (self.report)(Report::Problem(problem.clone()));
        }
        if problems.is_empty() && !self.state.problems.is_empty() {
            (self.report)(Report::AllFixed);
        }
        self.state.device = self.device_text();
        self.state.viewpoint = camera.map(Viewpoint::of);
        self.state.camera = camera.map(text).unwrap_or_default();
        self.state.steps = self.camera_history.steps();
        self.state.look = self.display_overrides;
        let scene = self.loaded.as_ref().map(|loaded| &loaded.scene);
        let settings = scene.map(|scene| scene.view).unwrap_or_default();
        self.state.scene_look = (settings.exposure, settings.transform);
        self.state.paused = self.paused;
        let max_samples = NonZeroU32::new(self.limits.samples).filter(|max| max.get() != u32::MAX);
        let scene_samples = self
            .loaded
            .as_ref()
            .map_or(0, |loaded| loaded.packed.sampling.pixel_samples);
        self.state.samples = (max_samples, scene_samples);
        self.state.preview = Preview::try_from(self.limits.scale).unwrap_or_default();
        self.state.comparable = self.comparison.comparable();
        self.state.no_comparison = self.no_comparison();
        self.state.apart = self.errors();
        self.state.camera_moved = self.camera.is_some();
        (self.state.executed, self.state.frame) = (self.executed_commands, self.frames);
        let is_pausing = self.paused && !self.running.as_ref().is_some_and(|running| running.canvas.is_new());
        let is_rendering = self.running.is_some() && !self.is_done() && !is_pausing;
        self.state.busy = self.restart_pending || self.pending.is_some() || is_rendering;
        [self.state.undo, self.state.redo] =
            [false, true].map(|redo| self.history.last(redo).map(|step| step.key.clone()));
        self.state.problems = problems;
        self.state.compiling = self.pending.is_some();
        (self.state.view, self.state.gain, self.state.marks) = (self.view, self.gain, self.marks);
        let sliders = self.running.as_ref().map_or(&[][..], |running| &running.sliders);
        self.state.sliders = self.sliders.states(sliders, self.sources.shaders.as_deref());
        self.state.missing_views = self.missing_views();
        if **self.state_sender.borrow() != self.state {
            self.state_sender.send_replace(Arc::new(self.state.clone()));
        }
    }
}
