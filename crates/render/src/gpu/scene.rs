//! GPU buffers of a scene.

use bytemuck::bytes_of;
use glam::{UVec4, Vec4};
use wgpu::BufferUsages;

use super::bake::{mesh_rows, mesh_rows_count, node_rows, node_rows_count, rows};
use super::device::Device;
use super::memory::MemoryUse;
use super::pipeline::bind_group;
use super::texels::TexelParts;
use crate::error::RenderError;
use crate::records::{Camera, FILTER_BINS_MAX, Packed};

/// Returns a scene's memory on a device, in bytes.
pub fn bytes_of_scene(packed: &Packed) -> u64 {
    let row_count = rows(packed).len() + node_rows_count(packed) + mesh_rows_count(packed);
    let sizes = [
        size_of_val(packed.textures.texels.as_slice()),
        row_count * size_of::<UVec4>(),
        size_of_val(packed.primitives.as_slice()),
        size_of_val(packed.bounds.as_slice()),
        FILTER_BINS_MAX as usize * size_of::<Vec4>(),
    ];
    sizes.iter().map(|size| *size as u64).sum()
}

pub struct SceneBuffers {
    camera: wgpu::Buffer,
    /// Groups 1 and 2 of `shaders/bindings.wgsl`: the scene, and the scene's shapes.
    pub groups: [wgpu::BindGroup; 2],
    /// Memory in bytes.
    pub bytes: u64,
}

impl SceneBuffers {
    /// Uploads a scene. `texels` is the division of the scene's texels into storage buffers.
    pub fn upload(
        device: &Device,
        packed: &Packed,
        texels: TexelParts,
        layouts: &[wgpu::BindGroupLayout],
    ) -> Result<SceneBuffers, RenderError> {
        let storage = BufferUsages::STORAGE;
        let (rows, nodes, meshes) = (rows(packed), node_rows(packed), mesh_rows(packed));
        let mut filter_table = packed.sampling.filter_table.clone();
        filter_table.resize(FILTER_BINS_MAX as usize, Vec4::ZERO);
        let bytes = bytes_of_scene(packed);
        let upload = || {
            let texels = texels.split(&packed.textures.texels);
            let texels = texels.map(|part| device.checked(|| device.upload(storage, part)));
            let texels: Vec<wgpu::Buffer> = texels.collect::<Result<_, _>>()?;
            device.checked(|| {
                let camera = device.upload(BufferUsages::UNIFORM | BufferUsages::COPY_DST, &[packed.camera]);
                let buffers = [
                    device.upload(BufferUsages::UNIFORM, &[packed.environment]),
                    device.upload(BufferUsages::UNIFORM, &[packed.counts]),
                    device.upload(BufferUsages::UNIFORM, &filter_table),
                    device.upload(storage, &rows),
                ];
                let scene_buffers: Vec<_> = [&camera].into_iter().chain(&buffers).chain(&texels).collect();
                let primitives = device.upload(storage, &packed.primitives);
                let bounds = device.upload(storage, &packed.bounds);
                let nodes = device.upload(storage, &nodes);
                let meshes = device.upload(storage, &meshes);
                let groups = [
                    bind_group(device, &layouts[1], &scene_buffers),
                    bind_group(device, &layouts[2], &[&primitives, &bounds, &nodes, &meshes]),
                ];
                SceneBuffers { camera, groups, bytes }
            })
        };
        upload().map_err(|error| MemoryUse::default().explain(error, Some(&("the scene".to_string(), bytes))))
    }

    pub fn set_camera(&self, device: &Device, camera: &Camera) {
        device.queue.write_buffer(&self.camera, 0, bytes_of(camera));
    }
}
