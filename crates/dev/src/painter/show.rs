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
    /// The driver truncates the image: it cannot be rendered completely.
    pub cut: Option<Diagnostic>,
    pub device: Option<Diagnostic>,
    pub out: Option<Diagnostic>,
}

impl Problems {
    fn all(&self) -> impl Iterator<Item = &Diagnostic> {
        let of_shaders = self.files.iter().chain(&self.shader).chain(&self.cut);
        of_shaders.chain(&self.scene).chain(&self.device).chain(&self.out)
    }
}

impl Painter {
    pub(super) fn is_done(&self) -> bool {
        self.running
            .as_ref()
            .is_some_and(|running| running.canvas.is_done(self.seen()))
    }

    pub(super) fn show(&mut self) {
        let (view, done) = (self.seen(), self.is_done());
        let Some(running) = &mut self.running else { return };
        let canvas = &mut running.canvas;
        let start = Instant::now();
        let (content, sent) = match guarded(|| self.times.of("read back", || canvas.content(view))) {
            Ok(content) => content,
            Err(error) => return self.fail(&error),
        };
        let ([width, height], (samples, total), speed) = (canvas.size(), canvas.samples(), canvas.speed());
        let finest = canvas.finest_size();
        let whole = sent == finest && samples > 0;
        let settings = (self.loaded.as_ref()).map_or(ViewSettings::default(), |loaded| loaded.scene.view);
        if let (Content::Color(colors), true) = (&content, whole) {
            let look = DisplaySettings {
                view: settings,
                ..DisplaySettings::default()
            };
            self.write_out(|| png_of(colors, look), done);
        }
        let (content, sides) = self.beside(content, finest);
        let since = self.since.take();
        self.latency = since
            .map(|(noticed, _)| noticed.elapsed().as_secs_f64())
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
        let bins = self
            .loaded
            .iter()
            .flat_map(|loaded| &loaded.packed.sampling.filter_table);
        let look = DisplaySettings {
            gain: self.gain,
            marks: self.marks,
            negative: bins.into_iter().any(|bin| bin.z < 0.0),
            view: self.look.over(settings),
            false_color: self.look.false_color,
        };
        let make = || Frame::new(header, content, names.unwrap_or_default(), look);
        let frame = Arc::new(self.times.of("make PNG", make));
        self.frame_sender.send_replace(Some(frame.clone()));
        self.measure(&frame);
        self.last_frame = Instant::now();
        self.frame_cost = start.elapsed();
        self.failures = 0;
        self.problems.cut = None;
        if let Some(running) = self.running.as_ref().filter(|_| done || whole) {
            self.good = Some(running.shaders.clone());
        }
        if let Some((noticed, saved)) = since {
            self.first_frame = saved.then_some(self.last_frame);
            if saved {
                let compiled = self.compiled.take();
                (self.report)(Report::Reloaded {
                    seconds: noticed.elapsed().as_secs_f64(),
                    compiled,
                });
            }
        }
        if let Some(first) = self.first_frame.take_if(|_| done && view == View::Color) {
            (self.report)(Report::Finished {
                seconds: first.elapsed().as_secs_f64(),
            });
        }
        self.tell();
    }

    /// Replaces the file of `--out` when each pixel has a sample, and when the image is finished.
    fn write_out(&mut self, png: impl FnOnce() -> Vec<u8>, done: bool) {
        let Some(out) = &self.out else { return };
        if done || self.written != Some(self.revision) {
            self.written = Some(self.revision);
            let failed = replace(out, &png()).err();
            let problem = |error| Diagnostic::plain("file", format!("{}: cannot be written: {error}", out.display()));
            self.problems.out = failed.map(problem);
        }
    }

    /// Reports once per size that an image is too large to display.
    pub(super) fn tell_size(&mut self) {
        let scale = self.limits.scale;
        let sizes = self
            .running
            .as_ref()
            .map(|running| (running.canvas.size(), running.canvas.finest_size()));
        // A reduction that a viewer requested with the preview scale is not reported.
        let smaller = sizes.filter(|(asked, shown)| asked.map(|side| side.div_ceil(scale)) != *shown);
        if self.smaller != smaller {
            self.smaller = smaller;
            if let Some((asked, shown)) = smaller {
                (self.report)(Report::Smaller(asked, shown));
            }
        }
    }

    /// Publishes the scene and the camera, for queries about objects.
    fn tell_seen(&self) {
        let Some(loaded) = &self.loaded else { return };
        let camera = self.packed_camera(loaded);
        let is_known = |seen: &Arc<SceneView>| Arc::ptr_eq(&seen.loaded, loaded) && seen.camera == camera;
        if !self.seen_sender.borrow().as_ref().is_some_and(is_known) {
            self.seen_sender.send_replace(Some(Arc::new(SceneView {
                loaded: Arc::clone(loaded),
                camera,
                sources: self.sources.clone(),
            })));
        }
    }

    pub(super) fn tell(&mut self) {
        self.tell_seen();
        let camera = self
            .camera
            .as_ref()
            .or(self.loaded.as_ref().map(|loaded| &loaded.camera));
        let problems: Vec<Diagnostic> = self.problems.all().cloned().collect();
        for problem in problems.iter().filter(|problem| !self.state.problems.contains(problem)) {
            (self.report)(Report::Problem(problem.clone()));
        }
        if problems.is_empty() && !self.state.problems.is_empty() {
            (self.report)(Report::Mended);
        }
        self.state.viewpoint = camera.map(Viewpoint::of);
        self.state.camera = camera.map(text).unwrap_or_default();
        self.state.steps = self.walk.steps();
        self.state.look = self.look;
        let scene = self.loaded.as_ref().map(|loaded| &loaded.scene);
        let settings = scene.map(|scene| scene.view).unwrap_or_default();
        self.state.scene_look = (settings.exposure, settings.transform);
        self.state.paused = self.paused;
        let most = NonZeroU32::new(self.limits.samples).filter(|most| most.get() != u32::MAX);
        let of_scene = self
            .loaded
            .as_ref()
            .map_or(0, |loaded| loaded.packed.sampling.pixel_samples);
        self.state.samples = (most, of_scene);
        self.state.preview = Preview::try_from(self.limits.scale).unwrap_or_default();
        self.state.comparable = self.comparison.comparable();
        self.state.no_comparison = self.no_comparison();
        self.state.apart = self.apart();
        self.state.camera_moved = self.camera.is_some();
        (self.state.executed, self.state.frame) = (self.executed, self.frames);
        let rests = self.paused && !self.running.as_ref().is_some_and(|running| running.canvas.is_new());
        let renders = self.running.is_some() && !self.is_done() && !rests;
        self.state.busy = self.camera_waits || self.pending.is_some() || renders;
        [self.state.undo, self.state.redo] =
            [false, true].map(|again| self.history.last(again).map(|step| step.what.clone()));
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
