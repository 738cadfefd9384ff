//! The life cycle of a kernel: its start, its rejection after an error, the loss of its device, and its replacement.

use std::sync::Arc;
use std::time::Instant;

use super::{MAX_ATTEMPTS, Painter, Running};
use crate::build::{BuildResult, guarded};
use crate::canvas::Canvas;
use crate::diagnostic::Diagnostic;
use crate::engine::Engine;
use crate::source::KernelChoice;
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
            self.reject((pending.shaders.clone(), pending.kernel_choice), problems);
        }
        match built.result {
            Some(Ok((gpu, shaders))) => {
                self.state.compile_seconds = Some(built.duration.as_secs_f64());
                self.run(*gpu, shaders, pending.kernel_choice, built.noticed_at);
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
                self.reject_truncated((shaders, pending.kernel_choice), &error);
            }
            Some(Err(error)) => {
                let (view, running) = (self.shown_view(), &mut self.running);
                let is_alive = |running: &mut Running| guarded(|| running.canvas.content(view)).is_ok();
                let is_on_cpu = running.as_ref().is_some_and(|running| running.canvas.is_on_cpu());
                if is_on_cpu && self.failures < MAX_ATTEMPTS {
                    self.lose_device(&error); // the CPU's image does not show whether the device works
                } else if is_on_cpu || running.as_mut().is_some_and(is_alive) {
                    // The driver rejected the kernel although naga accepted it; the device still works.
                    self.reject((pending.shaders, pending.kernel_choice), Vec::new());
                    self.problems.device = Some((&error).into());
                    self.change = None;
                    self.synchronize((Instant::now(), true));
                } else {
                    self.fail(&error);
                }
            }
        }
    }

    /// Handles the result of an outdated request. If the kernel fits the scene, the kernel renders until a newer kernel
    /// is compiled.
    fn handle_outdated_build(&mut self, built: BuildResult) {
        let kernel_choice = self
            .loaded
            .as_ref()
            .map(|loaded| KernelChoice::of(&loaded.packed, self.view, false));
        let is_useful = self.pending.is_some()
            && built.id >= self.first_valid_request
            && kernel_choice == Some(built.kernel_choice);
        match built.result {
            Some(Ok((gpu, shaders))) if is_useful && built.shader_errors.is_none() => {
                self.state.compile_seconds = Some(built.duration.as_secs_f64());
                self.run(*gpu, shaders, built.kernel_choice, built.noticed_at);
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
    fn run(&mut self, gpu: Gpu, shaders: Arc<Shaders>, kernel_choice: KernelChoice, noticed_at: Instant) {
        let Some(loaded) = self.loaded.clone() else { return };
        self.adapter = gpu.device().info.clone();
        self.device = Some(gpu.device().clone());
        let Some(mut gpu) = self.continue_on(gpu, &shaders, &kernel_choice, &loaded) else {
            return;
        };
        self.next_compile_seconds = self.state.compile_seconds;
        self.drop_interim();
        let (packed, limits) = (self.packed(&loaded), self.limits);
        let view = kernel_choice.supported_view(self.view);
        let sliders = gpu.sliders().to_vec();
        let slider_values = self.sliders.bits(&sliders);
        self.park(&shaders, &kernel_choice);
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
                    kernel_choice,
                    sliders,
                    slider_values,
                });
                self.problems.device = None;
                self.record_start((noticed_at, true));
            }
            Err(error) => self.fail(&error),
        }
    }

    /// Records that the shaders have errors with this kernel choice.
    fn reject(&mut self, kernel: (Arc<Shaders>, KernelChoice), problems: Vec<Diagnostic>) {
        self.rejected.push(kernel);
        self.problems.shader = problems;
    }

    /// Rejects shaders whose loops the driver truncates, until the scene or the shaders change.
    fn reject_truncated(&mut self, kernel: (Arc<Shaders>, KernelChoice), error: &RenderError) {
        let problem = self.render_diagnostic(error);
        self.truncated = Some(kernel.clone());
        self.reject(kernel, vec![problem]);
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
    /// without such shaders, rendering halts. After other errors, the device counts as lost.
    pub(super) fn fail(&mut self, error: &RenderError) {
        if let (RenderError::LoopTruncated { .. } | RenderError::Shader(_), Some(running)) = (error, &mut self.running)
        {
            if self
                .last_good
                .as_ref()
                .is_some_and(|shaders| *shaders != running.shaders)
            {
                let kernel = (running.shaders.clone(), running.kernel_choice);
                self.stop_running();
                self.reject_truncated(kernel, error);
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

    /// Drops the lost device and renders on the CPU or requests a new device; gives up after more than [`MAX_ATTEMPTS`]
    /// failures.
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
            Some((loaded, shaders, kernel_choice)) if kernel_choice.on_cpu => {
                self.run_on_cpu(&loaded, shaders, kernel_choice, change);
            }
            Some((loaded, shaders, kernel_choice)) => self.request(&loaded, shaders, kernel_choice, change),
            None => {}
        }
    }

    pub(super) fn stop_running(&mut self) {
        drop_guarded(self.running.take());
    }

    /// Keeps the running kernel if it differs from the new kernel only in the supported views, because viewers often
    /// switch back.
    pub(super) fn park(&mut self, shaders: &Arc<Shaders>, kernel_choice: &KernelChoice) {
        let is_reusable = |kernel: &Running| {
            let only_views_differ = kernel.kernel_choice.differs_only_in_views(kernel_choice);
            kernel.shaders == *shaders && only_views_differ && kernel.kernel_choice != *kernel_choice
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
