//! Camera moves, and the history of viewpoints.

use std::time::Instant;

use glam::DVec3;

use super::Painter;
use crate::camera::{Move, Viewpoint, dollied, framed, moved, with_viewpoint};
use wgray_image::Region;
use wgray_render::backend::Backend as _;
use wgray_render::cpu::Cpu;
use wgray_scene::{Bounds, CameraDescription, Geometry, Light, Scene};
use wgray_trace::records::NO_INDEX;

/// Maximum number of steps in the history.
const MAX_STEPS: usize = 256;

#[derive(Default)]
pub struct CameraHistory {
    /// Cameras before each step of the history, oldest first.
    back: Vec<CameraDescription>,
    /// Cameras that redo restores, the next one last.
    forward: Vec<CameraDescription>,
    /// True if the next move belongs to the current step.
    in_step: bool,
}

impl CameraHistory {
    pub fn steps(&self) -> [bool; 2] {
        [!self.back.is_empty(), !self.forward.is_empty()]
    }

    /// Ends the current step: the next move starts a new one.
    pub fn end_step(&mut self) {
        self.in_step = false;
    }

    fn push(&mut self, camera: &CameraDescription) {
        if !std::mem::replace(&mut self.in_step, true) {
            self.forward.clear();
            if self.back.len() == MAX_STEPS {
                self.back.remove(0);
            }
            self.back.push(camera.clone());
        }
    }
}

impl Painter {
    fn current_camera(&self) -> Option<&CameraDescription> {
        self.camera
            .as_ref()
            .or(self.loaded.as_ref().map(|loaded| &loaded.camera))
    }

    pub(super) fn move_camera(&mut self, camera_move: Move) {
        let (Some(old), Some(loaded)) = (self.current_camera().cloned(), &self.loaded) else {
            return;
        };
        let new = match camera_move {
            Move::Dolly(amount) => dollied(&old, amount, &loaded.camera),
            camera_move => moved(&old, camera_move),
        };
        self.move_to(&old, new);
    }

    pub(super) fn set_viewpoint(&mut self, viewpoint: Viewpoint) {
        let Some(old) = self.current_camera().cloned() else {
            return;
        };
        match with_viewpoint(&old, viewpoint) {
            Ok(new) => self.step(&old, new),
            Err(error) => self.notice(&Err(error), String::new()),
        }
    }

    pub(super) fn reset_camera(&mut self) {
        let (Some(old), Some(loaded)) = (self.camera.clone(), &self.loaded) else {
            return;
        };
        let new = loaded.camera.clone();
        self.step(&old, new);
    }

    /// Frames the finite object at a pixel, or the whole scene.
    pub(super) fn frame_object(&mut self, pixel: Option<[u32; 2]>) {
        let (Some(loaded), Some(old)) = (self.loaded.clone(), self.current_camera().cloned()) else {
            return;
        };
        let object = pixel.and_then(|pixel| self.bounds_at(pixel, &loaded.scene));
        match object.or_else(|| loaded.scene.bounds()) {
            Some((low, high)) => {
                let (center, radius) = (0.5 * low + 0.5 * high, 0.5 * (high - low).length());
                self.step(&old, framed(&old, center, radius));
            }
            None => self.notice(
                &Err("The scene has no object of finite extent".to_string()),
                String::new(),
            ),
        }
    }

    fn bounds_at(&self, [x, y]: [u32; 2], scene: &Scene) -> Option<Bounds> {
        let packed = self.packed(self.loaded.as_ref()?);
        let pixel = Region {
            x0: x,
            y0: y,
            x1: x.checked_add(1)?,
            y1: y.checked_add(1)?,
        };
        let hit = *Cpu::new(&packed).first_hits(pixel).ok()?.first()?;
        if hit.shape == NO_INDEX {
            return None;
        }
        let index = hit.shape as usize;
        match scene.shapes.get(index) {
            Some(shape) => shape.geometry.bounds(),
            None => match scene.lights.get(index - scene.shapes.len())? {
                Light::Rectangle { rectangle, .. } => Geometry::Rectangle(*rectangle).bounds(),
                Light::Point { position, .. } | Light::Spot { position, .. } => {
                    Some((*position - DVec3::ONE, *position + DVec3::ONE))
                }
                Light::Directional { .. } => None,
            },
        }
    }

    pub(super) fn retrace(&mut self, forward: bool) {
        let Some(current) = self.current_camera().cloned() else {
            return;
        };
        let history = &mut self.camera_history;
        let (from, to) = match forward {
            true => (&mut history.forward, &mut history.back),
            false => (&mut history.back, &mut history.forward),
        };
        let Some(camera) = from.pop() else { return };
        history.in_step = false;
        // The camera in the file may be of a different kind.
        if std::mem::discriminant(&camera) == std::mem::discriminant(&current) {
            to.push(current);
            self.set_camera(camera);
        } else {
            *history = CameraHistory::default();
        }
    }

    /// Moves the camera as a separate step of the viewpoint history.
    fn step(&mut self, old: &CameraDescription, new: CameraDescription) {
        self.camera_history.in_step = false;
        self.move_to(old, new);
        self.camera_history.in_step = false;
    }

    fn move_to(&mut self, old: &CameraDescription, new: CameraDescription) {
        if new != *old {
            self.camera_history.push(old);
            self.set_camera(new);
        }
    }

    fn set_camera(&mut self, camera: CameraDescription) {
        let file_camera = self.loaded.as_ref().map(|loaded| &loaded.camera);
        self.camera = Some(camera).filter(|camera| Some(camera) != file_camera);
        self.restart_pending = true;
        self.comparison.before = None; // the image shows the scene from another viewpoint
        if let Some(running) = &mut self.running {
            running.halted = false;
        }
        self.change.get_or_insert((Instant::now(), false));
    }
}
