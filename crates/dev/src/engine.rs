//! The device that renders a scene: an adapter with a compiled kernel, or the CPU.

use glam::Vec3;
use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
use wgray_render::denoise::denoise;
use wgray_render::error::RenderError;
use wgray_render::gpu::{Dispatch, Gpu};
use wgray_trace::film::Film;
use wgray_trace::records::{Camera, Packed};

/// A scene on the device that renders it.
pub enum Engine {
    /// An adapter.
    Gpu(Box<Gpu>),
    /// The CPU, which computes the bits of the built-in shaders without a kernel.
    Cpu(Box<Cpu<Box<Packed>>>),
}

impl Engine {
    /// Returns an engine that renders a scene on the CPU.
    pub fn cpu(scene: &Packed) -> Engine {
        Engine::Cpu(Box::new(Cpu::new(Box::new(scene.clone()))))
    }

    pub fn is_cpu(&self) -> bool {
        matches!(self, Engine::Cpu(_))
    }

    pub fn backend(&mut self) -> &mut dyn Backend {
        match self {
            Engine::Gpu(gpu) => &mut **gpu,
            Engine::Cpu(cpu) => &mut **cpu,
        }
    }

    /// Sets a changed scene and discards the film. Returns false and changes nothing if the scene needs a different
    /// kernel.
    pub fn update(&mut self, scene: &Packed) -> Result<bool, RenderError> {
        match self {
            Engine::Gpu(gpu) => gpu.update(scene),
            Engine::Cpu(cpu) => {
                cpu.edit_scene(|old| **old = scene.clone());
                Ok(true)
            }
        }
    }

    /// Changes the camera and discards the film.
    pub fn set_camera(&mut self, camera: &Camera) -> Result<(), RenderError> {
        match self {
            Engine::Gpu(gpu) => gpu.set_camera(camera),
            Engine::Cpu(cpu) => {
                cpu.set_camera(camera);
                Ok(())
            }
        }
    }

    /// Sets the slider values, given as bits, and discards the film. The built-in shaders have no sliders.
    pub fn set_sliders(&mut self, values: &[u32]) -> Result<(), RenderError> {
        match self {
            Engine::Gpu(gpu) => gpu.set_sliders(values),
            Engine::Cpu(_) => Ok(()),
        }
    }

    /// Denoises a film with noise estimates.
    pub fn denoise(&self, film: &Film) -> Result<Vec<Vec3>, RenderError> {
        match self {
            Engine::Gpu(gpu) => gpu.denoise(film),
            Engine::Cpu(_) => Ok(denoise(film)),
        }
    }

    /// Returns the timed dispatches that ended since the last call.
    pub fn dispatches(&mut self) -> Vec<Dispatch> {
        match self {
            Engine::Gpu(gpu) => gpu.dispatches(),
            Engine::Cpu(_) => Vec::new(),
        }
    }
}
