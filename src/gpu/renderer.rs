//! A scene on a device: its buffers, its kernels, and the film that it accumulates.

use std::ops::Range;

use bytemuck::{Pod, bytes_of};
use glam::{UVec2, Vec4};
use wgpu::BufferUsages;

use super::bake::{MOST_PRIMITIVES, bake};
use super::compose::{Kernel, Shaders};
use super::device::Device;
use super::pipeline::{WORKGROUP, bind_group_layout, pipeline};
use super::rounding::Rounding;
use crate::error::RenderError;
use crate::film::{Film, Region};
use crate::job::Backend;
use crate::pack::{Camera, FirstHit, Packed, Specialization, Work};

/// How a scene is put on a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// SPIR-V that is computed as written, with quotients and square roots of whom; else plain WGSL through wgpu.
    pub exact: Option<Rounding>,
    /// The scene as constants of the kernel, if it is small.
    pub baked: bool,
}

impl Options {
    /// What is fastest on a device.
    pub fn best(device: &Device) -> Options {
        Options {
            exact: device.info.exact.then_some(Rounding::Device),
            baked: device.info.kind == "software",
        }
    }
}

/// A scene on a device.
pub struct Gpu {
    device: Device,
    kernels: Kernels,
    render: wgpu::ComputePipeline,
    /// The kernel of first hits, once it was asked for.
    aov: Option<wgpu::ComputePipeline>,
    scene: [wgpu::Buffer; 9],
    work: wgpu::Buffer,
    film: Option<Target>,
    adaptive: bool,
}

/// What it takes to compile another kernel for the same scene.
struct Kernels {
    shaders: Shaders,
    baked: Option<String>,
    constants: Specialization,
    layout: wgpu::BindGroupLayout,
    exact: Option<Rounding>,
}

/// A buffer with a record for each pixel of a region, bound for the kernel that writes it.
struct Target {
    region: Region,
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl Gpu {
    /// Compiles the kernel for a scene and uploads it. The device has run the kernel once, on nothing, when this
    /// returns: drivers compile at the first dispatch.
    pub fn new(device: &Device, packed: &Packed, shaders: &Shaders, options: Options) -> Result<Gpu, RenderError> {
        let kernels = Kernels {
            shaders: shaders.clone(),
            baked: (options.baked && packed.primitives.len() <= MOST_PRIMITIVES).then(|| bake(packed)),
            constants: packed.specialization,
            layout: bind_group_layout(device),
            exact: options.exact,
        };
        let render = match packed.adaptive {
            true => kernels.compile(device, Kernel::Adaptive)?,
            false => kernels.compile(device, Kernel::Render)?,
        };
        let scene = upload(device, packed)?;
        let work = device.buffer(size_of::<Work>() as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let mut gpu = Gpu {
            device: device.clone(),
            kernels,
            render,
            aov: None,
            scene,
            work,
            film: None,
            adaptive: packed.adaptive,
        };
        let nothing = Region {
            x0: 0,
            y0: 0,
            x1: 1,
            y1: 1,
        };
        gpu.begin(nothing)?;
        gpu.render(nothing, 0..0)?;
        Ok(gpu)
    }

    /// The device that it is on.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Uploads a changed scene that needs no other kernel. Returns whether it does not; if it does, nothing is done.
    /// The film is lost.
    pub fn update(&mut self, packed: &Packed) -> Result<bool, RenderError> {
        let same_kernel = self.kernels.baked.is_none()
            && (self.kernels.constants, self.adaptive) == (packed.specialization, packed.adaptive);
        if same_kernel {
            self.film = None;
            self.scene = upload(&self.device, packed)?;
        }
        Ok(same_kernel)
    }

    /// Changes the camera. Whoever does so starts a new film.
    pub fn set_camera(&mut self, camera: &Camera) -> Result<(), RenderError> {
        self.device
            .checked(|| self.device.queue.write_buffer(&self.scene[0], 0, bytes_of(camera)))
    }

    fn target<T: Pod>(&self, region: Region) -> Result<Target, RenderError> {
        let size = region.pixels() * size_of::<T>() as u64;
        self.device.checked(|| {
            let buffer = self.device.buffer(size, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
            let [
                camera,
                environment,
                primitives,
                bounds,
                materials,
                lights,
                textures,
                texels,
                filter_table,
            ] = &self.scene;
            let buffers = [
                &self.work,
                camera,
                environment,
                primitives,
                bounds,
                materials,
                lights,
                textures,
                texels,
                filter_table,
                &buffer,
            ];
            let entries: Vec<wgpu::BindGroupEntry> = (0..)
                .zip(buffers)
                .map(|(binding, buffer)| wgpu::BindGroupEntry {
                    binding,
                    resource: buffer.as_entire_binding(),
                })
                .collect();
            let group = self.device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.kernels.layout,
                entries: &entries,
            });
            Target { region, buffer, group }
        })
    }

    /// Runs a kernel over a tile of a target, and waits for its end.
    fn dispatch(
        &self,
        pipeline: &wgpu::ComputePipeline,
        target: &Target,
        tile: Region,
        samples: Range<u32>,
    ) -> Result<(), RenderError> {
        let work = Work {
            origin: UVec2::new(tile.x0, tile.y0),
            size: UVec2::new(tile.width(), tile.height()),
            film_origin: UVec2::new(target.region.x0, target.region.y0),
            film_size: UVec2::new(target.region.width(), target.region.height()),
            samples: UVec2::new(samples.start, samples.end),
        };
        let Device { device, queue, .. } = &self.device;
        self.device.checked(|| {
            queue.write_buffer(&self.work, 0, bytes_of(&work));
            let mut encoder = device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &target.group, &[]);
            pass.dispatch_workgroups(tile.width().div_ceil(WORKGROUP), tile.height().div_ceil(WORKGROUP), 1);
            drop(pass);
            queue.submit([encoder.finish()]);
        })?;
        self.device.wait()
    }
}

impl Backend for Gpu {
    fn begin(&mut self, region: Region) -> Result<(), RenderError> {
        self.film = None; // before the next one: the two together may not fit
        self.film = Some(match self.adaptive {
            true => self.target::<[Vec4; 2]>(region)?,
            false => self.target::<Vec4>(region)?,
        });
        Ok(())
    }

    fn render(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        let Some(film) = &self.film else {
            return Ok(());
        };
        self.dispatch(&self.render, film, tile, samples)
    }

    fn film(&mut self) -> Result<Film, RenderError> {
        let Some(film) = &self.film else {
            return Ok(Film::new(Region::whole(0, 0)));
        };
        let mut sums: Vec<Vec4> = self.device.download(&film.buffer)?;
        let moments = sums.split_off(film.region.pixels() as usize);
        Ok(Film {
            region: film.region,
            sums,
            moments,
        })
    }

    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        let pipeline = match self.aov.take() {
            Some(pipeline) => pipeline,
            None => self.kernels.compile(&self.device, Kernel::Aov)?,
        };
        let target = self.target::<FirstHit>(region)?;
        self.dispatch(&pipeline, &target, region, 0..0)?;
        self.aov = Some(pipeline);
        self.device.download(&target.buffer)
    }

    fn samples_of_all(&self) -> u32 {
        self.kernels.constants.pixel_samples
    }

    fn largest_film(&self) -> u64 {
        let info = &self.device.info;
        info.largest_binding.min(info.largest_buffer) / size_of::<FirstHit>() as u64
    }
}

/// The buffers of a scene, in the order of their bindings.
fn upload(device: &Device, packed: &Packed) -> Result<[wgpu::Buffer; 9], RenderError> {
    device.checked(|| {
        [
            device.upload(BufferUsages::UNIFORM | BufferUsages::COPY_DST, &[packed.camera]),
            device.upload(BufferUsages::UNIFORM, &[packed.environment]),
            device.upload(BufferUsages::STORAGE, &packed.primitives),
            device.upload(BufferUsages::STORAGE, &packed.bounds),
            device.upload(BufferUsages::STORAGE, &packed.materials),
            device.upload(BufferUsages::STORAGE, &packed.lights),
            device.upload(BufferUsages::STORAGE, &packed.textures),
            device.upload(BufferUsages::STORAGE, &packed.texels),
            device.upload(BufferUsages::STORAGE, &packed.filter_table),
        ]
    })
}

impl Kernels {
    fn compile(&self, device: &Device, kernel: Kernel) -> Result<wgpu::ComputePipeline, RenderError> {
        let source = self.shaders.compose(kernel, self.baked.as_deref());
        pipeline(device, &self.layout, kernel, &source, &self.constants, self.exact)
    }
}
