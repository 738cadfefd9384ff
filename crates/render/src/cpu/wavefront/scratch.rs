//! Memory for the traversals of a batch, reused from batch to batch.

use glam::Vec3;

use super::super::slab::{Slabs, slabs};
use super::super::traversal::{RAYS, Stack};
use super::items::Items;

/// Stacks of the interleaved rays.
#[derive(Default)]
pub struct Scratch {
    pub stacks: [Stack; RAYS],
    pub lanes: [RayLane; RAYS],
}

/// A ray of a batch that traverses the scene's BVH.
pub struct RayLane {
    /// Position of the ray in its queue; `None` before the first ray.
    pub position: Option<usize>,
    pub slabs: Slabs,
    pub items: Items,
    /// Index of the instance whose mesh the ray traverses.
    pub instance: u32,
}

impl Default for RayLane {
    fn default() -> RayLane {
        RayLane {
            position: None,
            slabs: slabs(Vec3::ZERO, Vec3::ONE, 0.0),
            items: Items::default(),
            instance: 0,
        }
    }
}

impl Scratch {
    /// Prepares for another batch.
    pub fn clear(&mut self) {
        for lane in &mut self.lanes {
            lane.position = None;
        }
    }
}
