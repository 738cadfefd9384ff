//! Wavefront path tracing: the integrator `path` for batches of paths. In each bounce, a batch passes through four
//! stages: closest hits, shading, occlusion of shadow rays, and compaction. Each path has the bits of the scalar
//! [`advance`](super::integrators::path::advance). Batches are faster, because their rays are traced interleaved and
//! their hits are shaded in SIMD lanes.

mod batch;
mod begin;
mod bounce;
mod closest_hits;
mod culling;
mod environment;
mod hit_materials;
mod items;
mod light_tree;
mod lights;
mod linear;
mod materials;
mod occlusion;
mod rows;
mod scratch;
mod shade;
mod smooth;
mod surfaces;

use glam::UVec2;

use self::begin::begin_paths;
use self::closest_hits::closest_hits;
use self::culling::pass_invisible_hits;
use self::occlusion::occluded_rays;
use self::scratch::Scratch;
pub use self::shade::{LaneHits, MaterialKind, SurfaceKind};
use self::shade::{ShadingQueues, shade_hits};
pub use self::smooth::SmoothKind;
use super::decoded_bvhs::are_decoded;
use super::integrators::path::{PathState, add_radiance};
use super::ray::Hit;
use super::shadow_ray::ShadowRay;
use crate::records::Packed;

/// Maximum number of paths in a batch. Their states fit into a core's level-2 cache.
pub const MAX_PATHS: usize = 1024;

/// A batch of paths with the queues of its stages. The memory is reused from batch to batch.
pub struct Wavefront {
    paths: Vec<PathState>,
    pixels: Vec<UVec2>,
    /// Indices of the paths that have not ended.
    active: Vec<u32>,
    /// Closest hits of the active paths.
    hits: Vec<Hit>,
    shadow_rays: Vec<QueuedShadowRay>,
    occluded: Vec<bool>,
    scratch: Scratch,
    shading: ShadingQueues,
    lane_hits: LaneHits,
}

/// A shadow ray and the index of its path.
struct QueuedShadowRay {
    path: u32,
    ray: ShadowRay,
}

impl Wavefront {
    /// Creates an empty batch for a scene. Rays are traced one by one if its meshes are not decoded.
    pub fn new(scene: &Packed) -> Wavefront {
        Wavefront {
            paths: Vec::new(),
            pixels: Vec::new(),
            active: Vec::new(),
            hits: Vec::new(),
            shadow_rays: Vec::new(),
            occluded: Vec::new(),
            scratch: Scratch::new(are_decoded(scene)),
            shading: ShadingQueues::default(),
            lane_hits: LaneHits::default(),
        }
    }

    /// Traces a path for each camera sample, and returns the ended paths in the order of the samples. A camera sample
    /// is a pixel and a sample number.
    pub fn trace(&mut self, scene: &Packed, samples: impl Iterator<Item = (UVec2, u32)>) -> &[PathState] {
        self.begin(scene, samples);
        while !self.active.is_empty() {
            self.shade(scene);
            self.trace_shadow_rays(scene);
            self.compact();
            self.find_closest_hits(scene);
        }
        &self.paths
    }

    /// Returns the state before the first hit, and this hit, for the path of each camera sample.
    pub fn first_hits(
        &mut self,
        scene: &Packed,
        samples: impl Iterator<Item = (UVec2, u32)>,
    ) -> impl Iterator<Item = (&PathState, Hit)> {
        self.begin(scene, samples);
        self.paths.iter().zip(self.hits.iter().copied())
    }

    /// Returns the numbers of hits that were shaded in lanes, summed over all batches.
    pub fn lane_hits(&self) -> LaneHits {
        self.lane_hits
    }

    /// Begins the paths, and finds the closest hits of the camera rays.
    fn begin(&mut self, scene: &Packed, samples: impl Iterator<Item = (UVec2, u32)>) {
        let has_invisible_hits = begin_paths(scene, samples, &mut self.paths, &mut self.pixels);
        self.active.clear();
        self.active.extend(0..self.paths.len() as u32);
        self.find_closest_hits(scene);
        if has_invisible_hits {
            pass_invisible_hits(scene, &mut self.paths, &mut self.hits);
        }
    }

    fn find_closest_hits(&mut self, scene: &Packed) {
        closest_hits(scene, &self.paths, &self.active, &mut self.hits, &mut self.scratch);
    }

    /// Ends each active path or samples its next ray, and queues its shadow ray, if any.
    fn shade(&mut self, scene: &Packed) {
        self.lane_hits += shade_hits(
            scene,
            &mut self.paths,
            &self.pixels,
            &self.active,
            &self.hits,
            &mut self.shadow_rays,
            &mut self.shading,
        );
    }

    /// Adds the contribution of each shadow ray that is not occluded, before the path's next hit is shaded.
    fn trace_shadow_rays(&mut self, scene: &Packed) {
        occluded_rays(
            scene,
            &self.paths,
            &self.pixels,
            &self.shadow_rays,
            &mut self.occluded,
            &mut self.scratch,
        );
        for (QueuedShadowRay { path, ray }, occluded) in self.shadow_rays.iter().zip(&self.occluded) {
            add_radiance(
                scene,
                &mut self.paths[*path as usize],
                ray.contribution,
                !occluded,
                ray.bounces,
            );
        }
    }

    /// Removes ended paths from the active paths.
    fn compact(&mut self) {
        let paths = &self.paths;
        self.active.retain(|path| !paths[*path as usize].ended);
    }
}
