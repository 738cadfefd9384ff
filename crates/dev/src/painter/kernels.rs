//! The life cycle of a kernel: it runs, may be rejected, truncated by the driver or lost, and is replaced.

use std::sync::Arc;
use std::time::Instant;

use super::{MAX_ATTEMPTS, Painter, Running};
use crate::build::{BuildResult, guarded};
use crate::canvas::Canvas;
use crate::diagnostic::Diagnostic;
use crate::engine::Engine;
use crate::source::Constants;
use wgray_render::error::{RenderError, ShaderError};
use wgray_render::gpu::Gpu;
use wgray_render::gpu::compose::Shaders;

impl Painter {
    pub(super) fn handle_build(&mut self, built: BuildResult) {
        let Some(pending) = self.pending.take_if(|pending| pending.id == built.id) else {
            return self.handle_outdated_build(built);
        };
        if let Some(errors) = &built.shader_errors {
            let shaders = pending.shaders.clone();
            let problems = errors
                .0
                .iter()
                .map(|error| self.shader_diagnostic(error, &shaders))
                .collect();
            self.reject((pending.shaders.clone(), pending.constants), problems);
        }
        match built.result {
            Some(Ok((gpu, shaders))) => {
                self.state.compile_seconds = Some(built.duration.as_secs_f64());
                self.run(*gpu, shaders, pending.constants, built.noticed_at);
            }
            None => {
                self.change = None;
                self.synchronize((Instant::now(), true)); // the running kernel may be able to render a changed scene
            }
            Some(Err(error @ (RenderError::LoopTruncated { .. } | RenderError::Shader(_)))) => {
                let shaders = match built.shader_errors {
                    Some(_) => self.last_good.clone().unwrap_or(pending.shaders),
                    None => pending.shaders,
                };
                self.reject_truncated((shaders, pending.constants), &error);
            }
            Some(Err(error)) => {
                let (view, running) = (self.shown_view(), &mut self.running);
                let is_alive = |running: &mut Running| guarded(|| running.canvas.content(view)).is_ok();
                let is_on_cpu = running.as_ref().is_some_and(|running| running.canvas.is_on_cpu());
                if is_on_cpu && self.failures < MAX_ATTEMPTS {
                    self.lose_device(&error); // the CPU's image does not show whether the device works
                } else if is_on_cpu || running.as_mut().is_some_and(is_alive) {
                    // The driver rejected the kernel although naga accepted it; the device still works.
                    self.reject((pending.shaders, pending.constants), Vec::new());
                    self.problems.device = Some((&error).into());
                    self.change = None;
                    self.synchronize((Instant::now(), true));
                } else {
                    self.fail(&error);
                }
            }
        }
    }

    /// Handles a kernel although a newer kernel was requested. If the outdated kernel fits the scene, it renders until
    /// the newer kernel is compiled.
    fn handle_outdated_build(&mut self, built: BuildResult) {
        let constants = self
            .loaded
            .as_ref()
            .map(|loaded| Constants::of(&loaded.packed, self.view, false));
        let is_useful =
            self.pending.is_some() && built.id >= self.first_valid_request && constants == Some(built.constants);
        match built.result {
            Some(Ok((gpu, shaders))) if is_useful && built.shader_errors.is_none() => {
                self.state.compile_seconds = Some(built.duration.as_secs_f64());
                self.run(*gpu, shaders, built.constants, built.noticed_at);
            }
            result => {
                let _ = guarded(|| {
                    drop(result);
                    Ok(())
                });
            }
        }
    }

    /// Starts to render with a new kernel.
    fn run(&mut self, gpu: Gpu, shaders: Arc<Shaders>, constants: Constants, noticed_at: Instant) {
        let Some(loaded) = self.loaded.clone() else { return };
        self.adapter = gpu.device().info.clone();
        self.device = Some(gpu.device().clone());
        let Some(mut gpu) = self.continue_on(gpu, &shaders, &constants, &loaded) else {
            return;
        };
        self.compiled = self.state.compile_seconds;
        self.drop_interim();
        let (packed, limits) = (self.packed(&loaded), self.limits);
        let view = constants.supported_view(self.view);
        let sliders = gpu.sliders().to_vec();
        let slider_values = self.sliders.bits(&sliders);
        self.park(&shaders, &constants);
        let canvas = guarded(|| {
            self.times.measure("upload", || gpu.update(&packed))?; // the scene may have changed since the upload
            gpu.set_sliders(&slider_values)?;
            Canvas::new(Engine::Gpu(Box::new(gpu)), packed, view, limits)
        });
        match canvas {
            Ok(canvas) => {
                self.running = Some(Running {
                    canvas,
                    halted: false,
                    shaders,
                    constants,
                    sliders,
                    slider_values,
                });
                self.problems.device = None;
                self.record_start((noticed_at, true));
            }
            Err(error) => self.fail(&error),
        }
    }

    /// Records that the shaders have errors with these constants.
    fn reject(&mut self, shaders: (Arc<Shaders>, Constants), problems: Vec<Diagnostic>) {
        self.rejected.push(shaders);
        self.problems.shader = problems;
    }

    /// Rejects shaders whose loops the driver truncates, until the scene or the shaders change.
    fn reject_truncated(&mut self, shaders: (Arc<Shaders>, Constants), error: &RenderError) {
        let problem = self.render_diagnostic(error);
        self.truncated = Some(shaders.clone());
        self.reject(shaders, vec![problem]);
        self.change = None;
        self.synchronize((Instant::now(), true));
    }

    /// Converts a render error to a diagnostic with advice.
    fn render_diagnostic(&self, error: &RenderError) -> Diagnostic {
        match error {
            RenderError::Shader(error) => match &self.shaders {
                Some(shaders) => self.shader_diagnostic(error, shaders),
                None => Diagnostic::plain("shader", error.to_string()),
            },
            error => {
                let edited = self
                    .shaders
                    .as_ref()
                    .is_some_and(|shaders| **shaders != Shaders::built_in());
                let advice = match edited {
                    true => {
                        "; shorten the loops, and call `report_completion(local)` for every pixel at the end of each kernel"
                    }
                    false => "",
                };
                Diagnostic::plain(if edited { "shader" } else { "scene" }, format!("{error}{advice}"))
            }
        }
    }

    /// Converts a shader error to a diagnostic that contains the user's path of the file.
    fn shader_diagnostic(&self, error: &ShaderError, shaders: &Shaders) -> Diagnostic {
        Diagnostic::shader(error, shaders, self.sources.shaders.as_deref())
    }

    /// Handles a render error. If the running shaders caused the error, the last shaders without errors are used again;
    /// without such shaders, rendering halts. After other errors, a device is opened again, up to a maximum number of
    /// attempts.
    pub(super) fn fail(&mut self, error: &RenderError) {
        if let (RenderError::LoopTruncated { .. } | RenderError::Shader(_), Some(running)) = (error, &mut self.running)
        {
            if self
                .last_good
                .as_ref()
                .is_some_and(|shaders| *shaders != running.shaders)
            {
                let shaders = (running.shaders.clone(), running.constants);
                self.stop_running();
                self.reject_truncated(shaders, error);
            } else {
                running.halted = true;
                self.problems.truncated = Some(self.render_diagnostic(error));
            }
            return self.publish();
        }
        self.stop_running();
        self.lose_device(error);
        self.publish();
    }

    /// Opens a device again, up to a maximum number of attempts.
    fn lose_device(&mut self, error: &RenderError) {
        drop_guarded(self.parked.take());
        self.problems.device = Some(error.into());
        self.device = None;
        self.pending = None;
        self.first_valid_request = self.requests + 1;
        self.rejected.clear(); // another device may accept these shaders
        self.failures += 1;
        let change = (Instant::now(), true);
        match self.target().filter(|_| self.failures <= MAX_ATTEMPTS) {
            Some((loaded, shaders, constants)) if constants.on_cpu => {
                self.run_on_cpu(&loaded, shaders, constants, change);
            }
            Some((loaded, shaders, constants)) => self.request(&loaded, shaders, constants, change),
            None => {}
        }
    }

    pub(super) fn stop_running(&mut self) {
        drop_guarded(self.running.take());
    }

    /// Keeps the running kernel if only its views differ from the new kernel, because viewers often switch back.
    pub(super) fn park(&mut self, shaders: &Arc<Shaders>, constants: &Constants) {
        let is_reusable = |kernel: &Running| {
            let same_scene = kernel.constants.differ_only_in_view(constants);
            kernel.shaders == *shaders && same_scene && kernel.constants != *constants
        };
        for kernel in [self.parked.take(), self.running.take()].into_iter().flatten() {
            let dropped = match is_reusable(&kernel) {
                true => self.parked.replace(kernel),
                false => Some(kernel),
            };
            drop_guarded(dropped);
        }
    }
}

/// Drops a kernel. Catches the panic that may occur if the device is lost.
fn drop_guarded(running: Option<Running>) {
    let _ = guarded(|| {
        drop(running);
        Ok(())
    });
}
