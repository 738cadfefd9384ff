//! The part of a packed scene that is independent of shapes, lights and camera.

use std::sync::Arc;

use super::environment_map::EnvironmentMap;
use super::materials::Appearances;
use wgray_scene::{EnvironmentImage, Scene};

/// Packed materials, textures and environment map. A session reuses them while only shapes, lights or the camera change,
/// because computing texels (mip pyramids, and tables of the environment and of materials) takes most of the time of packing.
#[derive(Debug)]
pub struct PackedShading {
    pub(super) appearances: Appearances,
    pub(super) environment_map: EnvironmentMap,
    /// Texels of the textures, followed by those of the environment map.
    pub(super) texels: Arc<Vec<u32>>,
    texture_texels: usize,
}

impl PackedShading {
    /// Packs materials, textures and environment map.
    pub fn of(scene: &Scene) -> PackedShading {
        let mut appearances = Appearances::of(scene);
        let mut texels = std::mem::take(&mut appearances.texels);
        PackedShading {
            appearances,
            texture_texels: texels.len(),
            environment_map: EnvironmentMap::of(scene, &mut texels),
            texels: Arc::new(texels),
        }
    }

    /// Packs materials, textures and environment map. `previous` is the packed shading of `previous_scene`. Its
    /// environment map is reused if both scenes have the same map, and all its texels are shared if they are equal.
    pub fn of_changed(scene: &Scene, (previous_scene, previous): (&Scene, &PackedShading)) -> PackedShading {
        if environment_image(scene) != environment_image(previous_scene) {
            return PackedShading::of(scene);
        }
        let mut appearances = Appearances::of(scene);
        let texels = std::mem::take(&mut appearances.texels);
        let (previous_texels, map_texels) = previous.texels.split_at(previous.texture_texels);
        PackedShading {
            appearances,
            texture_texels: texels.len(),
            environment_map: previous.environment_map.with_start(texels.len()),
            texels: match texels == previous_texels {
                true => Arc::clone(&previous.texels),
                false => Arc::new([&texels, map_texels].concat()),
            },
        }
    }

    /// Returns true if both scenes are packed to the same materials, textures and environment map.
    pub fn is_shared(a: &Scene, b: &Scene) -> bool {
        (a.render.integrator, &a.materials, &a.textures) == (b.render.integrator, &b.materials, &b.textures)
            && environment_image(a) == environment_image(b)
    }
}

fn environment_image(scene: &Scene) -> Option<&EnvironmentImage> {
    scene
        .environment
        .as_ref()
        .and_then(|environment| environment.image.as_ref())
}
