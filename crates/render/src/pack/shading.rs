//! The part of a packed scene that is independent of shapes, lights and camera.

use std::sync::Arc;

use super::environment_map::EnvironmentMap;
use super::materials::Appearances;
use wgray_scene::{Environment, Scene};

/// Packed materials, textures and environment map. A session reuses them while only shapes, lights or the camera change,
/// because computing texels (mip pyramids, and tables of the environment and of materials) takes most of the time of packing.
#[derive(Debug)]
pub struct PackedShading {
    pub(super) appearances: Appearances,
    pub(super) environment_map: EnvironmentMap,
    pub(super) texels: Arc<Vec<u32>>,
}

impl PackedShading {
    /// Packs materials, textures and environment map.
    pub fn of(scene: &Scene) -> PackedShading {
        let mut appearances = Appearances::of(scene);
        let mut texels = std::mem::take(&mut appearances.texels);
        PackedShading {
            appearances,
            environment_map: EnvironmentMap::of(scene, &mut texels),
            texels: Arc::new(texels),
        }
    }

    /// Returns true if both scenes are packed to the same materials, textures and environment map.
    pub fn is_shared(a: &Scene, b: &Scene) -> bool {
        let map = |scene: &'_ Scene| {
            scene
                .environment
                .as_ref()
                .and_then(|Environment { image, .. }| image.clone())
        };
        (a.render.integrator, &a.materials, &a.textures) == (b.render.integrator, &b.materials, &b.textures)
            && map(a) == map(b)
    }
}
