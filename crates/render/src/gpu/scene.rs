//! GPU buffers of a scene.

use std::sync::{Arc, Weak};

use bytemuck::bytes_of;
use glam::{UVec4, Vec4};
use wgpu::BufferUsages;

use super::bake::{mesh_rows, mesh_rows_count, node_rows, node_rows_count, rows};
use super::device::Device;
use super::memory::MemoryUse;
use super::pipeline::bind_group;
use super::texels::TexelParts;
use crate::error::RenderError;
use wgray_trace::records::{Camera, FILTER_TABLE_SIZE, Packed};

/// Returns a scene's memory on a device, in bytes.
pub fn bytes_of_scene(packed: &Packed) -> u64 {
    let row_count = rows(packed).len() + node_rows_count(packed) + mesh_rows_count(packed);
    let sizes = [
        size_of_val(packed.textures.texels.as_slice()),
        row_count * size_of::<UVec4>(),
        size_of_val(packed.primitives.as_slice()),
        size_of_val(packed.bounds.as_slice()),
        FILTER_TABLE_SIZE as usize * size_of::<Vec4>(),
    ];
    sizes.iter().map(|size| *size as u64).sum()
}

pub struct SceneBuffers {
    camera: wgpu::Buffer,
    /// Groups 1 and 2 of `shaders/bindings.wgsl`: the scene, and the scene's shapes.
    pub groups: [wgpu::BindGroup; 2],
    /// Memory in bytes.
    pub bytes: u64,
    /// The uploaded texels, and the buffers that contain them.
    texels: (Weak<Vec<u32>>, Vec<wgpu::Buffer>),
}

impl SceneBuffers {
    /// Uploads a scene. `texels` is the division of the scene's texels into storage buffers. The buffers of `previous` are
    /// used again if it has the same texels in the same division.
    pub fn upload(
        device: &Device,
        packed: &Packed,
        texels: TexelParts,
        layouts: &[wgpu::BindGroupLayout],
        previous: Option<&SceneBuffers>,
    ) -> Result<SceneBuffers, RenderError> {
        let storage = BufferUsages::STORAGE;
        let (rows, nodes, meshes) = (rows(packed), node_rows(packed), mesh_rows(packed));
        let mut filter_table = packed.sampling.filter_table.clone();
        filter_table.resize(FILTER_TABLE_SIZE as usize, Vec4::ZERO);
        let bytes = bytes_of_scene(packed);
        let upload = || {
            let shared = previous.and_then(|previous| previous.buffers_of(&packed.textures.texels));
            let texels: Vec<wgpu::Buffer> = match shared {
                Some(buffers) => buffers.to_vec(),
                None => {
                    let parts = texels.split(&packed.textures.texels);
                    let buffers = parts.map(|part| device.checked(|| device.upload(storage, part)));
                    buffers.collect::<Result<_, _>>()?
                }
            };
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
                SceneBuffers {
                    camera,
                    groups,
                    bytes,
                    texels: (Arc::downgrade(&packed.textures.texels), texels),
                }
            })
        };
        upload().map_err(|error| MemoryUse::default().explain(error, Some(&("the scene".to_string(), bytes))))
    }

    /// Returns the buffers of these texels, if they are uploaded.
    fn buffers_of(&self, texels: &Arc<Vec<u32>>) -> Option<&[wgpu::Buffer]> {
        let (uploaded, buffers) = &self.texels;
        std::ptr::eq(uploaded.as_ptr(), Arc::as_ptr(texels)).then_some(buffers)
    }

    pub fn set_camera(&self, device: &Device, camera: &Camera) {
        device.queue.write_buffer(&self.camera, 0, bytes_of(camera));
    }
}
