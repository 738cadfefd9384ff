//! The interface of `wavefront` on WebAssembly: paths are traced one by one. Without SIMD instructions, the lanes are
//! not faster, and compiling them for this target takes many minutes and gigabytes.

use glam::UVec2;

use crate::cpu::geometry::closest_hit;
use crate::cpu::integrators::path::{PathState, advance, begin_path};
use crate::cpu::ray::Hit;
use crate::records::Packed;

/// Maximum number of paths in a batch.
pub const MAX_PATHS: usize = 1024;

/// A batch of paths.
pub struct Wavefront {
    paths: Vec<PathState>,
}

impl Wavefront {
    pub fn new(_: &Packed) -> Wavefront {
        Wavefront { paths: Vec::new() }
    }

    /// Traces a path for each camera sample, and returns the ended paths in the order of the samples.
    pub fn trace(&mut self, scene: &Packed, samples: impl Iterator<Item = (UVec2, u32)>) -> &[PathState] {
        self.paths.clear();
        self.paths.extend(samples.map(|(pixel, sample)| {
            let mut path = begin_path(scene, pixel, sample);
            while !path.ended {
                advance(scene, &mut path, pixel);
            }
            path
        }));
        &self.paths
    }

    /// Returns the state before the first hit, and this hit, for the path of each camera sample.
    pub fn first_hits(
        &mut self,
        scene: &Packed,
        samples: impl Iterator<Item = (UVec2, u32)>,
    ) -> impl Iterator<Item = (&PathState, Hit)> {
        self.paths.clear();
        self.paths
            .extend(samples.map(|(pixel, sample)| begin_path(scene, pixel, sample)));
        self.paths.iter().map(|state| {
            let path = &state.path;
            let hit = closest_hit(scene, path.ray, path.origin_prim, path.inside_prim);
            (state, hit)
        })
    }
}
