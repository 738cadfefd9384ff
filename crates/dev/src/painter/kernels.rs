//! The life cycle of a kernel: it is run, may be refused, truncated by the driver or lost, and is replaced.

use std::sync::Arc;
use std::time::Instant;

use super::{ATTEMPTS, Painter, Running};
use crate::build::{BuildResult, guarded};
use crate::canvas::Canvas;
use crate::diagnostic::Diagnostic;
use crate::source::{Constants, are_of_one_scene, shown};
use wgray_render::error::{RenderError, ShaderError};
use wgray_render::gpu::Gpu;
use wgray_render::gpu::compose::Shaders;

impl Painter {
    pub(super) fn take_built(&mut self, built: BuildResult) {
        let Some(pending) = self.pending.take_if(|pending| pending.id == built.id) else {
            return self.take_overtaken(built);
        };
        if let Some(errors) = &built.refused {
            let shaders = pending.shaders.clone();
            let problems = errors.0.iter().map(|error| self.of_shader(error, &shaders)).collect();
            self.refuse((pending.shaders.clone(), pending.constants), problems);
        }
        match built.result {
            Some(Ok((gpu, shaders))) => {
                self.state.compile_seconds = Some(built.took.as_secs_f64());
                self.compiled = self.state.compile_seconds;
                self.run(*gpu, shaders, pending.constants, built.noticed);
            }
            None => {
                self.since = None;
                self.settle((Instant::now(), true)); // the scene may have changed meanwhile, which the running kernel can show
            }
            Some(Err(error @ (RenderError::LoopTruncated { .. } | RenderError::Shader(_)))) => {
                let tried = match built.refused {
                    Some(_) => self.good.clone().unwrap_or(pending.shaders),
                    None => pending.shaders,
                };
                self.refuse_cut((tried, pending.constants), &error);
            }
            Some(Err(error)) => {
                let (view, running) = (self.seen(), &mut self.running);
                let lives = |running: &mut Running| guarded(|| running.canvas.content(view)).is_ok();
                if running.as_mut().is_some_and(lives) {
                    // The driver rejected the kernel although naga accepted it; the device still works.
                    self.refuse((pending.shaders, pending.constants), Vec::new());
                    self.problems.device = Some((&error).into());
                    self.since = None;
                    self.settle((Instant::now(), true));
                } else {
                    self.fail(&error);
                }
            }
        }
    }

    /// Takes a kernel although a newer one was requested. If the kernel fits the scene, it renders until the newer
    /// kernel is compiled.
    fn take_overtaken(&mut self, built: BuildResult) {
        let constants = self.loaded.as_ref().map(|loaded| self.constants(loaded));
        let is_useful = self.pending.is_some() && built.id >= self.oldest && constants == Some(built.constants);
        match built.result {
            Some(Ok((gpu, shaders))) if is_useful && built.refused.is_none() => {
                self.state.compile_seconds = Some(built.took.as_secs_f64());
                self.compiled = self.state.compile_seconds;
                self.run(*gpu, shaders, built.constants, built.noticed);
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
    fn run(&mut self, mut gpu: Gpu, shaders: Arc<Shaders>, constants: Constants, noticed: Instant) {
        let Some(loaded) = self.loaded.clone() else { return };
        let info = &gpu.device().info;
        self.state.device = format!("{}, {}", info.name, info.driver);
        self.device = Some(gpu.device().clone());
        let (packed, limits) = (self.packed(&loaded), self.limits);
        let view = shown(&constants, self.view);
        let sliders = gpu.sliders().to_vec();
        let slider_values = self.sliders.bits(&sliders);
        self.park(&shaders, &constants);
        let canvas = guarded(|| {
            self.times.of("upload", || gpu.update(&packed))?; // the scene may have changed since it was uploaded
            gpu.set_sliders(&slider_values)?;
            Canvas::new(gpu, packed, view, limits)
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
                self.begun((noticed, true));
            }
            Err(error) => self.fail(&error),
        }
    }

    /// Remembers that the shaders are refused for these constants.
    fn refuse(&mut self, shaders: (Arc<Shaders>, Constants), problems: Vec<Diagnostic>) {
        self.refused.push(shaders);
        self.problems.shader = problems;
    }

    /// Refuses shaders whose loops the driver truncates, until the scene or the shaders change.
    fn refuse_cut(&mut self, shaders: (Arc<Shaders>, Constants), error: &RenderError) {
        let problem = self.of_render(error);
        self.cut = Some(shaders.clone());
        self.refuse(shaders, vec![problem]);
        self.since = None;
        self.settle((Instant::now(), true));
    }

    /// Converts a render error to a diagnostic with advice.
    fn of_render(&self, error: &RenderError) -> Diagnostic {
        match error {
            RenderError::Shader(error) => match &self.shaders {
                Some(shaders) => self.of_shader(error, shaders),
                None => Diagnostic::plain("shader", error.to_string()),
            },
            error => {
                let edited = self
                    .shaders
                    .as_ref()
                    .is_some_and(|shaders| **shaders != Shaders::built_in());
                let way_out = match edited {
                    true => {
                        "; shorten the loops, and call `report_completion(local)` for every pixel at the end of each kernel"
                    }
                    false => "",
                };
                Diagnostic::plain(if edited { "shader" } else { "scene" }, format!("{error}{way_out}"))
            }
        }
    }

    /// Converts a shader error to a diagnostic that contains the user's path of the file.
    fn of_shader(&self, error: &ShaderError, shaders: &Shaders) -> Diagnostic {
        Diagnostic::shader(error, shaders, self.sources.shaders.as_deref())
    }

    /// Handles a render error. Opens a lost device again, up to a maximum number of attempts. If the driver truncates
    /// the loops of the kernel, uses the last good shaders; halts if no good shaders exist.
    pub(super) fn fail(&mut self, error: &RenderError) {
        if let (RenderError::LoopTruncated { .. } | RenderError::Shader(_), Some(running)) = (error, &mut self.running)
        {
            if self.good.as_ref().is_some_and(|good| *good != running.shaders) {
                let shaders = (running.shaders.clone(), running.constants);
                self.stop_running();
                self.refuse_cut(shaders, error);
            } else {
                running.halted = true;
                self.problems.cut = Some(self.of_render(error));
            }
            return self.tell();
        }
        self.stop_running();
        drop_contained(self.parked.take());
        self.problems.device = Some(error.into());
        self.device = None;
        self.pending = None;
        self.oldest = self.requests + 1;
        self.refused.clear(); // another device may accept them
        self.failures += 1;
        if let Some((loaded, shaders)) = self.wanted().filter(|_| self.failures <= ATTEMPTS) {
            self.request(&loaded, shaders, Instant::now());
        }
        self.tell();
    }

    pub(super) fn stop_running(&mut self) {
        drop_contained(self.running.take());
    }

    /// Keeps the running kernel if it differs from the new one only in its layers, because viewers often switch back.
    fn park(&mut self, shaders: &Arc<Shaders>, constants: &Constants) {
        let is_sibling = |known: &Running| {
            let same_scene = are_of_one_scene(&known.constants, constants);
            known.shaders == *shaders && same_scene && known.constants != *constants
        };
        for known in [self.parked.take(), self.running.take()].into_iter().flatten() {
            let dropped = match is_sibling(&known) {
                true => self.parked.replace(known),
                false => Some(known),
            };
            drop_contained(dropped);
        }
    }
}

/// Drops a kernel. Catches the panic that may occur if the device is lost.
fn drop_contained(running: Option<Running>) {
    let _ = guarded(|| {
        drop(running);
        Ok(())
    });
}
