//! Memory for the traversals of a batch, reused from batch to batch.

use super::super::traversal::{NodeStack, RAYS};
use super::items::Items;

/// Stacks and states of the interleaved rays, and the queue that they are taken from.
pub struct Scratch {
    pub is_decoded: bool,
    pub stacks: [NodeStack; RAYS],
    pub lanes: [RayLane; RAYS],
    pub queue: Vec<QueuedRay>,
}

/// A ray to trace through a mesh or through the BVH of the scene.
#[derive(Clone, Copy, Debug)]
pub struct QueuedRay {
    /// Position of the ray in its batch.
    pub position: u32,
    /// Index of the instance; [`NO_INDEX`](crate::records::NO_INDEX) for the BVH of the scene.
    pub instance: u32,
    /// Distance to the box of the instance; 0 for the BVH of the scene, and for shadow rays.
    pub near: f32,
}

/// State of an interleaved ray: one that traverses the BVH of the scene, or a single instance.
#[derive(Default)]
pub struct RayLane {
    /// Position of the ray in its batch.
    pub position: usize,
    /// True if the ray traverses the BVH of the scene, false if it traverses a single instance.
    pub in_bvh: bool,
    pub items: Items,
    /// Index of the instance whose mesh the ray traverses.
    pub instance: u32,
}

impl Scratch {
    pub fn new(is_decoded: bool) -> Scratch {
        Scratch {
            is_decoded,
            stacks: Default::default(),
            lanes: Default::default(),
            queue: Vec::new(),
        }
    }

    /// Prepares for another batch.
    pub fn clear(&mut self) {
        for lane in &mut self.lanes {
            lane.in_bvh = false;
        }
        self.queue.clear();
    }
}
