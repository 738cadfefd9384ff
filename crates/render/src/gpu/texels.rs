//! Buffer limits of a device: texels are split across several buffers, and scenes that exceed the limits are rejected.

use std::fmt::Write as _;

use glam::UVec4;

use super::adapter::GpuInfo;
use super::bake::{mesh_rows_count, node_rows_count};
use super::pipeline::{GROUPS, SCENE_GROUP, STORAGE_BUFFERS};
use crate::error::RenderError;
use wgray_trace::records::Packed;

/// Division of texels into storage buffers. All buffers except the last have 2^shift words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexelParts {
    /// Number of buffers, at least 1.
    pub count: usize,
    shift: u32,
}

impl TexelParts {
    /// Returns the distribution for a scene, or an error if the scene exceeds the device's limits.
    pub fn of(info: &GpuInfo, packed: &Packed) -> Result<TexelParts, RenderError> {
        let largest = info.largest_binding.min(info.largest_buffer);
        let too_large = |message: String| RenderError::TooLarge {
            device: info.name.clone(),
            message,
        };
        let sizes = [
            ("shapes", size_of_val(packed.primitives.as_slice())),
            ("shapes' bounds", size_of_val(packed.bounds.as_slice())),
            ("BVHs", size_of::<UVec4>() * node_rows_count(packed)),
            ("meshes", size_of::<UVec4>() * mesh_rows_count(packed)),
            ("materials, lights and textures", {
                let (materials, lights) = (packed.materials.as_slice(), packed.lighting.lights.as_slice());
                size_of_val(materials) + size_of_val(lights) + size_of_val(packed.textures.records.as_slice())
            }),
        ];
        if let Some((name, size)) = sizes.into_iter().find(|(_, size)| *size as u64 > largest) {
            let (size, largest) = (mebibytes(size as u64), mebibytes(largest));
            return Err(too_large(format!(
                "the scene's {name} need {size} MiB; the limit of a buffer is {largest} MiB"
            )));
        }
        let shift = (largest / 4).max(1).ilog2().min(31);
        let count = packed.textures.texels.len().div_ceil(1 << shift).max(1);
        let max_count = 1 + (info.storage_buffers as usize).saturating_sub(STORAGE_BUFFERS);
        if count > max_count {
            let (size, buffer_size) = (
                mebibytes(4 * packed.textures.texels.len() as u64),
                mebibytes(4 << shift),
            );
            return Err(too_large(format!(
                "the scene's images need {size} MiB; the limit is {max_count} x {buffer_size} MiB"
            )));
        }
        Ok(TexelParts { count, shift })
    }

    /// Returns each buffer's texels.
    pub fn split<'a>(&self, texels: &'a [u32]) -> impl Iterator<Item = &'a [u32]> + use<'a> {
        let size = 1 << self.shift;
        (0..self.count)
            .map(move |i| texels.get(i * size..).unwrap_or_default())
            .map(move |tail| &tail[..tail.len().min(size)])
    }

    /// Returns WGSL with the function of `shaders/texels.wgsl` for several buffers, and the bindings of all buffers
    /// except the first. `None` for a single buffer.
    pub fn wgsl(&self) -> Option<String> {
        if self.count == 1 {
            return None;
        }
        let mut out = String::new();
        for i in 1..self.count {
            let binding = GROUPS[SCENE_GROUP].len() + i - 1;
            let _ = writeln!(
                out,
                "@group({SCENE_GROUP}) @binding({binding}) var<storage, read> texels_{i}: array<u32>;"
            );
        }
        let (shift, mask) = (self.shift, (1u32 << self.shift) - 1);
        let _ = writeln!(out, "fn texel_word(i: u32) -> u32 {{");
        let _ = writeln!(out, "    let part = i >> {shift}u;\n    let offset = i & {mask}u;");
        for i in 1..self.count {
            let _ = writeln!(out, "    if part == {i}u {{ return texels_{i}[offset]; }}");
        }
        let _ = writeln!(out, "    return texels[offset];\n}}");
        Some(out)
    }
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / f64::from(1 << 20))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::pack::pack;
    use wgray_scene::Scene;

    fn info(largest_binding: u64, storage_buffers: u32) -> GpuInfo {
        GpuInfo {
            name: "small".to_owned(),
            driver: String::new(),
            backend: String::new(),
            kind: "other",
            exact: false,
            float_controls: crate::gpu::FloatControls::NONE,
            largest_binding,
            largest_buffer: 1 << 31,
            storage_buffers,
        }
    }

    fn packed(shapes: usize, texels: usize) -> Packed {
        let start = "image = { width = 4, height = 4 }\ncamera = { position = [0, -3, 1], look_at = [0, 0, 1], fov = 45 }\n\
                     materials.m = { type = 'mirror' }\n";
        let sphere = "[[shapes]]\ntype = 'sphere'\nmaterial = 'm'\ncenter = [0, 0, 0]\nradius = 1\n";
        let text = format!("{start}{}", sphere.repeat(shapes));
        let mut packed = pack(&Scene::parse(&text, "s").unwrap());
        packed.textures.texels = Arc::new((0..texels as u32).collect());
        packed
    }

    #[test]
    fn texels_are_split_across_as_few_buffers_as_possible() {
        let storage = STORAGE_BUFFERS as u32;
        for (texels, buffers) in [(0, 1), (1, 1), (1024, 1), (1025, 2), (2048, 2), (4096, 4)] {
            let packed = packed(1, texels);
            let parts = TexelParts::of(&info(5000, storage + 3), &packed).unwrap();
            assert_eq!(parts.count, buffers, "{texels} texels");
            assert_eq!(parts.wgsl().is_some(), buffers > 1);
            let split: Vec<&[u32]> = parts.split(&packed.textures.texels).collect();
            assert_eq!(split.len(), buffers);
            assert!(split.iter().all(|part| part.len() <= 1024));
            assert_eq!(split.concat(), *packed.textures.texels);
        }
    }

    #[test]
    fn scenes_that_exceed_a_buffer_limit_are_rejected() {
        let storage = STORAGE_BUFFERS as u32;
        let message = |info: GpuInfo, packed: &Packed| TexelParts::of(&info, packed).unwrap_err().to_string();
        assert_eq!(
            message(info(1 << 20, storage), &packed(1, (1 << 18) + 1)),
            "small: the scene's images need 1.0 MiB; the limit is 1 x 1.0 MiB; the CPU has no such limit"
        );
        assert_eq!(
            message(info(1 << 18, storage), &packed(5000, 0)),
            "small: the scene's shapes need 0.4 MiB; the limit of a buffer is 0.2 MiB; the CPU has no such limit"
        );
        TexelParts::of(&info(1 << 18, storage), &packed(3000, 0)).unwrap();
    }
}
