//! The part of a packed scene that is independent of shapes, lights and camera.

use super::environment_map::EnvironmentMap;
use super::materials::Appearances;
use wgray_scene::{Environment, Scene};

/// Packed materials, textures and environment map, without their texels. A session reuses them together with the texels of
/// the previous packing while only shapes, lights or the camera change, because computing texels (mip pyramids, and tables
/// of the environment and of materials) takes most of the time of packing.
pub struct PackedShading {
    pub(super) appearances: Appearances,
    pub(super) environment_map: EnvironmentMap,
}

impl PackedShading {
    /// Packs materials, textures and environment map. Also returns their texels.
    pub fn of(scene: &Scene) -> (PackedShading, Vec<u32>) {
        let mut appearances = Appearances::of(scene);
        let mut texels = std::mem::take(&mut appearances.texels);
        let shading = PackedShading {
            appearances,
            environment_map: EnvironmentMap::of(scene, &mut texels),
        };
        (shading, texels)
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
