//! Rendering on the CPU: instead of software Vulkan, which traverses BVHs more slowly, and while a kernel is compiled.
//! Only the built-in shaders have twins on the CPU, so edited shaders never run on the CPU.

use std::sync::Arc;
use std::time::Instant;

use super::{Painter, Running};
use crate::build::guarded;
use crate::canvas::Canvas;
use crate::engine::Engine;
use crate::source::{KernelChoice, Loaded};
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::{Gpu, GpuInfo};

impl Painter {
    /// Returns the kernel choice for the selected view.
    pub(super) fn kernel_choice(&self, loaded: &Loaded, shaders: &Shaders) -> KernelChoice {
        let on_cpu = self.is_faster_on_cpu(loaded) && self.is_unedited(shaders) && !self.view.is_rendered_twice();
        KernelChoice::of(&loaded.packed, self.view, on_cpu)
    }

    /// Returns true if the CPU renders the scene faster than the adapter.
    fn is_faster_on_cpu(&self, loaded: &Loaded) -> bool {
        self.may_use_cpu && self.adapter.is_software() && has_bvh(loaded)
    }

    fn is_unedited(&self, shaders: &Shaders) -> bool {
        shaders.has_same_code(&self.built_in)
    }

    pub(super) fn is_on_cpu(&self) -> bool {
        self.running.as_ref().is_some_and(|running| running.canvas.is_on_cpu())
    }

    /// Starts to render on the CPU.
    pub(super) fn run_on_cpu(
        &mut self,
        loaded: &Loaded,
        shaders: Arc<Shaders>,
        kernel_choice: KernelChoice,
        change: (Instant, bool),
    ) {
        let (packed, limits) = (self.packed(loaded), self.limits);
        let view = kernel_choice.supported_view(self.view);
        self.park(&shaders, &kernel_choice);
        match guarded(|| Canvas::new(Engine::cpu(&packed), packed, view, limits)) {
            Ok(canvas) => {
                self.running = Some(Running {
                    canvas,
                    halted: false,
                    shaders,
                    kernel_choice,
                    sliders: Vec::new(),
                    slider_values: Vec::new(),
                });
                self.record_start(change);
            }
            Err(error) => self.fail(&error),
        }
    }

    /// Renders on the CPU while the kernel is compiled, unless an earlier kernel still shows its image. Scenes without
    /// a BVH wait for their kernels, because the compilation takes less than a second.
    pub(super) fn render_on_cpu_while_compiling(
        &mut self,
        loaded: &Loaded,
        shaders: Arc<Shaders>,
        kernel_choice: KernelChoice,
        change: (Instant, bool),
    ) {
        let is_replaceable = self.running.as_ref().is_none_or(|running| self.is_interim(running));
        if !is_replaceable || !has_bvh(loaded) || !self.is_unedited(&shaders) {
            return;
        }
        let kernel_choice = KernelChoice {
            on_cpu: true,
            ..kernel_choice
        };
        let is_on_cpu_already =
            |running: &Running| running.shaders == shaders && running.kernel_choice == kernel_choice;
        if self.running.as_ref().is_some_and(is_on_cpu_already) {
            self.draw_scene(change);
        } else {
            self.run_on_cpu(loaded, shaders, kernel_choice, change);
        }
    }

    /// Returns true if the CPU renders only until a kernel is compiled.
    fn is_interim(&self, running: &Running) -> bool {
        let is_faster_on_cpu = self.loaded.as_ref().is_some_and(|loaded| self.is_faster_on_cpu(loaded));
        running.canvas.is_on_cpu() && !is_faster_on_cpu
    }

    /// Stops rendering on the CPU if the CPU renders only until a kernel is compiled.
    pub(super) fn drop_interim(&mut self) {
        if self.running.as_ref().is_some_and(|running| self.is_interim(running)) {
            self.stop_running();
        }
    }

    /// Continues the CPU's image on `gpu` if its kernel computes the same image, bit for bit. Otherwise, returns `gpu`.
    pub(super) fn continue_on(
        &mut self,
        gpu: Gpu,
        shaders: &Arc<Shaders>,
        kernel_choice: &KernelChoice,
        loaded: &Loaded,
    ) -> Option<Gpu> {
        let packed = self.packed(loaded);
        let view = kernel_choice.supported_view(self.view);
        let computes_same_image = |running: &Running| {
            let same_kernel = running.shaders == *shaders
                && *kernel_choice
                    == KernelChoice {
                        on_cpu: false,
                        ..running.kernel_choice
                    };
            same_kernel && gpu.device().info.exact && !view.is_rendered_twice() && running.canvas.renders(&packed)
        };
        let is_continued = self
            .running
            .as_ref()
            .is_some_and(|running| self.is_interim(running) && computes_same_image(running));
        let Some(running) = self.running.as_mut().filter(|_| is_continued) else {
            return Some(gpu);
        };
        running.kernel_choice = *kernel_choice;
        running.sliders = gpu.sliders().to_vec();
        running.slider_values = self.sliders.bits(&running.sliders);
        let result = guarded(|| {
            let mut gpu = Box::new(gpu);
            self.times.measure("upload", || gpu.update(&packed))?; // the scene may have changed since the upload
            gpu.set_sliders(&running.slider_values)?;
            running.canvas.continue_on(gpu, view)
        });
        match result {
            Ok(()) => self.problems.device = None,
            Err(error) => self.fail(&error),
        }
        None
    }

    /// Describes the device that renders the image.
    pub(super) fn device_text(&self) -> String {
        let GpuInfo { name, driver, .. } = &self.adapter;
        let Some(running) = self.running.as_ref().filter(|running| running.canvas.is_on_cpu()) else {
            return format!("{name}, {driver}");
        };
        let threads = match rayon::current_num_threads() {
            1 => "1 thread".to_owned(),
            threads => format!("{threads} threads"),
        };
        match self.is_interim(running) {
            true => format!("CPU, {threads}, until the kernel for {name} is compiled"),
            false => format!("CPU, {threads}; edited shaders run on {name}"),
        }
    }
}

fn has_bvh(loaded: &Loaded) -> bool {
    loaded.packed.specialization.tlas_kinds != 0
}
