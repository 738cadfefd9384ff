//! A scene on a GPU: its buffers, kernels and film.

use std::ops::Range;
use std::time::Duration;

use bytemuck::{bytes_of, cast_slice};
use glam::{UVec2, Vec3, Vec4};
use wgpu::BufferUsages;

use super::compose::{ADAPTIVE, FIRST_HITS, Kernel, RENDER, Shaders};
use super::device::Device;
use super::film_rows::FilmRows;
use super::kernels::{Kernels, Options};
use super::loop_budget::samples_per_dispatch;
use super::mapping::Mapping;
use super::memory::{FailedAllocation, MemoryUse};
use super::pipeline::{WORKGROUP, bind_group};
use super::scene::SceneBuffers;
use super::sliders::Slider;
use super::texels::TexelParts;
use super::timer::{TIMESTAMP_BYTES, Timer};
use crate::backend::{Backend, FilmState, Rules};
use crate::clock::Instant;
use crate::denoise::denoise;
use crate::error::RenderError;
use wgray_image::Region;
use wgray_trace::film::{Film, FilmLayout};
use wgray_trace::records::{Camera, DispatchParams, FirstHit, Packed};

/// A scene on a GPU.
pub struct Gpu {
    device: Device,
    kernels: Kernels,
    render: wgpu::ComputePipeline,
    /// Compiled on first use.
    first_hits: Option<wgpu::ComputePipeline>,
    scene: SceneBuffers,
    params: wgpu::Buffer,
    /// The kernel's completion record, and a mappable copy of the record.
    completion: [wgpu::Buffer; 2],
    /// Film rows as they were before the last dispatch, for `undo`.
    saved_rows: Option<wgpu::Buffer>,
    film: Option<(Target, FilmState)>,
    pending: Option<Pending>,
    rules: Rules,
    /// Estimated maximum number of samples for which the driver truncates no loops.
    samples_per_dispatch: u32,
    slider_values: Option<wgpu::Buffer>,
    timer: Option<Timer>,
    dispatches: Vec<Dispatch>,
}

/// A timed dispatch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dispatch {
    /// Entry point of the kernel.
    pub kernel: &'static str,
    /// Duration.
    pub took: Duration,
    /// True if the device measured the duration; otherwise the duration ends when completion is observed.
    pub by_device: bool,
    /// Number of pixel samples; number of pixels for kernels that take no samples.
    pub samples: u64,
}

/// A submitted tile, of which one dispatch is running.
struct Pending {
    tile: Region,
    /// Samples that are not yet complete in the film.
    samples: Range<u32>,
    /// End of the samples of the running dispatch.
    end: u32,
    start: Instant,
    /// Completes when the dispatch has ended.
    completion: Mapping,
}

/// A buffer with a record for each pixel of a region, and the bind group of the kernel that writes the buffer.
struct Target {
    region: Region,
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
}

const FIRST_HIT_BYTES: usize = size_of::<FirstHit>();

/// Range of the loop that detects truncation: a driver that truncates loops ends this loop after one iteration.
const LOOP_PROBE: UVec2 = UVec2::new(0, 4);

impl Gpu {
    /// Compiles the kernel, uploads the scene and dispatches the kernel with no samples, since drivers compile at the
    /// first dispatch.
    pub fn new(device: &Device, packed: &Packed, shaders: &Shaders, options: Options) -> Result<Gpu, RenderError> {
        Gpu::with_sliders(device, packed, shaders, options, Vec::new())
    }

    /// Like [`Gpu::new`], as a future that does not block in browsers.
    pub async fn new_async(
        device: &Device,
        packed: &Packed,
        shaders: &Shaders,
        options: Options,
    ) -> Result<Gpu, RenderError> {
        Gpu::with_sliders_async(device, packed, shaders, options, Vec::new()).await
    }

    /// Like [`Gpu::new`], with overrides that are read from a buffer. Their values are 0 until [`Gpu::set_sliders`].
    pub fn with_sliders(
        device: &Device,
        packed: &Packed,
        shaders: &Shaders,
        options: Options,
        sliders: Vec<Slider>,
    ) -> Result<Gpu, RenderError> {
        pollster::block_on(Gpu::with_sliders_async(device, packed, shaders, options, sliders))
    }

    async fn with_sliders_async(
        device: &Device,
        packed: &Packed,
        shaders: &Shaders,
        options: Options,
        sliders: Vec<Slider>,
    ) -> Result<Gpu, RenderError> {
        let texels = TexelParts::of(&device.info, packed)?;
        let kernels = Kernels::new(device, packed, texels, shaders, options, sliders);
        let render = kernels.compile(device, kernel_of(packed.sampling.adaptive))?;
        let scene = SceneBuffers::upload(device, packed, texels, &kernels.layouts, None)?;
        let params = device.buffer(
            size_of::<DispatchParams>() as u64,
            BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        );
        let value_bytes = kernels.sliders.len().div_ceil(4) as u64 * size_of::<[u32; 4]>() as u64;
        let slider_values =
            (value_bytes > 0).then(|| device.buffer(value_bytes, BufferUsages::UNIFORM | BufferUsages::COPY_DST));
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let completion = [device.buffer(COMPLETION_BYTES, usage), completion_staging(device)];
        let mut gpu = Gpu {
            samples_per_dispatch: samples_per_dispatch(packed, kernels.is_baked()),
            device: device.clone(),
            kernels,
            render,
            first_hits: None,
            scene,
            params,
            completion,
            saved_rows: None,
            film: None,
            pending: None,
            rules: Rules::of(packed),
            slider_values,
            timer: None,
            dispatches: Vec::new(),
        };
        let single_pixel = Region {
            x0: 0,
            y0: 0,
            x1: 1,
            y1: 1,
        };
        gpu.begin(single_pixel)?;
        gpu.dispatch_part(single_pixel, 0..0)?;
        gpu.finished().await?;
        gpu.film = None;
        Ok(gpu)
    }

    /// Returns the overrides that are read from a buffer, in the order of the buffer.
    pub fn sliders(&self) -> &[Slider] {
        &self.kernels.sliders
    }

    /// Sets the values of the sliders, given as bits, and discards the film.
    ///
    /// # Errors
    ///
    /// [`RenderError::Pending`] while a dispatch is pending.
    pub fn set_sliders(&mut self, values: &[u32]) -> Result<(), RenderError> {
        self.check_idle()?;
        self.film = None;
        match &self.slider_values {
            Some(buffer) => self
                .device
                .checked(|| self.device.queue.write_buffer(buffer, 0, cast_slice(values))),
            None => Ok(()),
        }
    }

    /// Denoises a finished film with noise estimates. On software Vulkan, the CPU denoises, which is faster and gives
    /// the same bits.
    ///
    /// # Errors
    ///
    /// The device is lost, or its driver reports an error.
    pub fn denoise(&self, film: &Film) -> Result<Vec<Vec3>, RenderError> {
        pollster::block_on(self.denoise_async(film))
    }

    /// Like [`Gpu::denoise`], as a future that does not block in browsers.
    ///
    /// # Errors
    ///
    /// The errors of [`Gpu::denoise`].
    pub async fn denoise_async(&self, film: &Film) -> Result<Vec<Vec3>, RenderError> {
        match self.device.info.is_software() {
            true => Ok(denoise(film)),
            false => super::denoise::denoise_async(&self.device, film, self.kernels.exact).await,
        }
    }

    /// Ends when no dispatch is pending. Does not block in browsers.
    ///
    /// # Errors
    ///
    /// The errors of [`Backend::wait`].
    pub async fn finished(&mut self) -> Result<(), RenderError> {
        while let Some(pending) = &self.pending {
            let result = self.device.mapped(&pending.completion).await;
            let result = result.and_then(|()| self.step());
            self.discard_film_on_error(result)?;
        }
        Ok(())
    }

    /// Like [`Backend::film`], as a future that does not block in browsers.
    ///
    /// # Errors
    ///
    /// The errors of [`Backend::film`].
    pub async fn film_async(&mut self) -> Result<Film, RenderError> {
        self.check_idle()?;
        let (film, _) = self.film.as_ref().ok_or(RenderError::NoFilm)?;
        let region = film.region;
        if region.is_empty() {
            return Ok(self.rules.empty_film(region));
        }
        let result = self.device.download(&film.buffer).await;
        let result = self.explain(result, Some(("a copy of the film".to_string(), film.buffer.size())));
        let records: Vec<Vec4> = self.discard_film_on_error(result)?;
        Ok(film_of(region, self.rules.film_layout(), &records))
    }

    /// Like [`Backend::first_hits`], as a future that does not block in browsers.
    ///
    /// # Errors
    ///
    /// The errors of [`Backend::first_hits`].
    pub async fn first_hits_async(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        self.check_idle()?;
        self.rules.in_picture(region)?;
        if region.is_empty() {
            return Ok(Vec::new());
        }
        let result = self.find_first_hits(region).await;
        self.discard_film_on_error(result)
    }

    /// Enables timing of dispatches; see [`Gpu::dispatches`].
    pub fn time_calls(&mut self) -> Result<(), RenderError> {
        self.timer = Some(self.device.checked(|| Timer::new(&self.device))?);
        Ok(())
    }

    /// Returns the dispatches that ended since the last call.
    pub fn dispatches(&mut self) -> Vec<Dispatch> {
        std::mem::take(&mut self.dispatches)
    }

    /// Returns the device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Uploads a changed scene, except texels that are already uploaded, and discards the film. Returns false and changes nothing if the scene needs a different
    /// kernel.
    ///
    /// # Errors
    ///
    /// [`RenderError::Pending`] while a dispatch is pending.
    pub fn update(&mut self, packed: &Packed) -> Result<bool, RenderError> {
        self.check_idle()?;
        let texels = TexelParts::of(&self.device.info, packed)?;
        let same_kernel = self.kernels.suit(packed, texels) && self.rules.film_layout() == packed.film_layout();
        if same_kernel {
            self.film = None;
            let previous = Some(&self.scene);
            self.scene = SceneBuffers::upload(&self.device, packed, texels, &self.kernels.layouts, previous)?;
            self.samples_per_dispatch = samples_per_dispatch(packed, false);
            self.rules = Rules::of(packed);
        }
        Ok(same_kernel)
    }

    /// Changes the camera and discards the film.
    ///
    /// # Errors
    ///
    /// [`RenderError::Pending`] while a dispatch is pending.
    pub fn set_camera(&mut self, camera: &Camera) -> Result<(), RenderError> {
        self.check_idle()?;
        self.film = None;
        self.rules.set_size(camera.width, camera.height);
        self.device.checked(|| self.scene.set_camera(&self.device, camera))
    }

    fn target(&self, record: usize, region: Region) -> Result<Target, RenderError> {
        let size = region.pixels().max(1) * record as u64; // a binding cannot be empty
        let target = self.device.checked(|| {
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
            let buffer = self.device.buffer(size, usage);
            let buffers = [&self.params, &buffer, &self.completion[0]]
                .into_iter()
                .chain(&self.slider_values);
            let group = bind_group(&self.device, &self.kernels.layouts[0], &buffers.collect::<Vec<_>>());
            Target { region, buffer, group }
        });
        let name = format!("a film of {} x {} pixels", region.width(), region.height());
        self.explain(target, Some((name, size)))
    }

    fn kernel(&self) -> &'static Kernel {
        kernel_of(self.rules.film_layout().adaptive)
    }

    fn memory_use(&self) -> MemoryUse {
        MemoryUse {
            scene: self.scene.bytes,
            film: self.film.as_ref().map_or(0, |(film, _)| film.buffer.size()),
            copies: self.saved_rows.as_ref().map_or(0, |buffer| buffer.size()),
        }
    }

    /// Adds the memory in use to an out-of-memory error, and the failed allocation if known.
    fn explain<T>(&self, result: Result<T, RenderError>, failed: Option<FailedAllocation>) -> Result<T, RenderError> {
        result.map_err(|error| self.memory_use().explain(error, failed.as_ref()))
    }

    /// Encodes `copies`, then dispatches a kernel over a tile, and starts mapping the completion record.
    fn dispatch(
        &self,
        pipeline: &wgpu::ComputePipeline,
        target: &Target,
        tile: Region,
        samples: Range<u32>,
        copies: impl FnOnce(&mut wgpu::CommandEncoder),
    ) -> Result<Mapping, RenderError> {
        let params = DispatchParams {
            origin: UVec2::new(tile.x0, tile.y0),
            size: UVec2::new(tile.width(), tile.height()),
            film_origin: UVec2::new(target.region.x0, target.region.y0),
            film_size: UVec2::new(target.region.width(), target.region.height()),
            samples: UVec2::new(samples.start, samples.end),
            loop_probe: LOOP_PROBE,
        };
        let Device { device, queue, .. } = &self.device;
        let [written, read] = &self.completion;
        let [columns, rows] = groups(tile);
        self.device.checked(|| {
            queue.write_buffer(&self.params, 0, bytes_of(&params));
            let mut encoder = device.create_command_encoder(&Default::default());
            copies(&mut encoder);
            encoder.clear_buffer(written, 0, None);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: None,
                timestamp_writes: self.timer.as_ref().and_then(Timer::writes),
            });
            pass.set_pipeline(pipeline);
            let groups_of_bindings = [&target.group].into_iter().chain(&self.scene.groups);
            for (i, group) in (0..).zip(groups_of_bindings) {
                pass.set_bind_group(i, group, &[]);
            }
            pass.dispatch_workgroups(columns, rows, 1);
            drop(pass);
            encoder.copy_buffer_to_buffer(written, 0, read, 0, COMPLETION_BYTES);
            if let Some(timer) = &self.timer {
                timer.resolve(&mut encoder, read, COMPLETION_BYTES);
            }
            queue.submit([encoder.finish()]);
            Mapping::start(read)
        })
    }

    /// Returns true if the driver truncated no loop of a finished dispatch. Records the duration of the dispatch if
    /// timing is enabled.
    fn ran_completely(
        &mut self,
        kernel: &'static str,
        tile: Region,
        samples: u32,
        start: Instant,
    ) -> Result<bool, RenderError> {
        let elapsed = start.elapsed();
        let completion: Vec<u32> = self.device.read(&self.completion[1])?;
        let (completion, ticks) = completion.split_at((COMPLETION_BYTES / 4) as usize);
        if let Some(timer) = &self.timer {
            let measured = timer.duration(ticks);
            self.dispatches.push(Dispatch {
                kernel,
                took: measured.unwrap_or(elapsed),
                by_device: measured.is_some(),
                samples: tile.pixels() * u64::from(samples),
            });
        }
        let [columns, rows] = groups(tile);
        Ok(completion == [columns * rows, 0])
    }

    fn check_idle(&self) -> Result<(), RenderError> {
        match self.pending {
            Some(_) => Err(RenderError::Pending),
            None => Ok(()),
        }
    }

    /// Saves the film rows of a tile, and dispatches as many samples as the driver is expected to execute without
    /// truncating loops.
    fn dispatch_part(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        let (film, _) = self.film.as_ref().ok_or(RenderError::NoFilm)?;
        let rows = FilmRows::of(&film.buffer, film.region, tile);
        let saved_rows = match self.saved_rows.take().filter(|buffer| buffer.size() >= rows.bytes()) {
            Some(buffer) => buffer,
            None => {
                let usage = BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
                let buffer = self.device.checked(|| self.device.buffer(rows.bytes(), usage));
                let name = "a copy of the film rows of a tile".to_owned();
                self.explain(buffer, Some((name, rows.bytes())))?
            }
        };
        let max_samples = self.rules.end_of_part(&samples) - samples.start;
        let end = samples.start + self.samples_per_dispatch.min(max_samples);
        let save = |encoder: &mut wgpu::CommandEncoder| rows.save(encoder, &film.buffer, &saved_rows);
        let start = Instant::now();
        let completion = self.dispatch(&self.render, film, tile, samples.start..end, save)?;
        self.saved_rows = Some(saved_rows);
        self.pending = Some(Pending {
            tile,
            samples,
            end,
            start,
            completion,
        });
        Ok(())
    }

    /// Ends a finished dispatch and submits the next one. A truncated dispatch is repeated with half the samples.
    fn end_part(&mut self, pending: Pending) -> Result<(), RenderError> {
        let Pending {
            tile,
            samples,
            end,
            start,
            ..
        } = pending;
        let kernel = self.kernel().entry_point;
        let remaining = match self.ran_completely(kernel, tile, end - samples.start, start)? {
            true => end..samples.end,
            false => {
                self.undo(tile)?;
                let count = end - samples.start;
                if count <= 1 {
                    return Err(self.truncation_error());
                }
                self.samples_per_dispatch = count / 2;
                samples
            }
        };
        match remaining.is_empty() {
            true => Ok(()),
            false => self.dispatch_part(tile, remaining),
        }
    }

    /// Restores the film rows of a tile.
    fn undo(&self, tile: Region) -> Result<(), RenderError> {
        let (Some((film, _)), Some(saved_rows)) = (&self.film, &self.saved_rows) else {
            return Ok(());
        };
        let rows = FilmRows::of(&film.buffer, film.region, tile);
        self.device.checked(|| {
            let mut encoder = self.device.device.create_command_encoder(&Default::default());
            rows.restore(&mut encoder, saved_rows, &film.buffer);
            self.device.queue.submit([encoder.finish()]);
        })
    }

    fn step(&mut self) -> Result<(), RenderError> {
        let Some(pending) = self.pending.take() else {
            return Ok(());
        };
        match pending.completion.result() {
            None => {
                self.pending = Some(pending);
                Ok(())
            }
            Some(Ok(())) => self.end_part(pending),
            Some(Err(message)) => Err(self.device.error(message)),
        }
    }

    /// Discards the film after an error. Also replaces the completion buffer, because copies to a mapped buffer fail.
    fn discard_film_on_error<T>(&mut self, result: Result<T, RenderError>) -> Result<T, RenderError> {
        let result = self.explain(result, None);
        if result.is_err() {
            self.pending = None;
            self.film = None;
            self.completion[1] = completion_staging(&self.device);
        }
        result
    }

    async fn find_first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        let pipeline = match self.first_hits.take() {
            Some(pipeline) => pipeline,
            None => self.kernels.compile(&self.device, &FIRST_HITS)?,
        };
        let target = self.target(FIRST_HIT_BYTES, region)?;
        let start = Instant::now();
        let completion = self.dispatch(&pipeline, &target, region, 0..0, |_| ())?;
        self.first_hits = Some(pipeline);
        self.device.mapped(&completion).await?;
        match self.ran_completely(FIRST_HITS.entry_point, region, 1, start)? {
            true => self.device.download(&target.buffer).await,
            false => Err(self.truncation_error()),
        }
    }

    /// Returns the error for a single sample that exceeds the driver's loop limit.
    fn truncation_error(&self) -> RenderError {
        RenderError::LoopTruncated {
            device: self.device.info.name.clone(),
        }
    }
}

fn kernel_of(adaptive: bool) -> &'static Kernel {
    if adaptive { &ADAPTIVE } else { &RENDER }
}

const COMPLETION_BYTES: u64 = size_of::<[u32; 2]>() as u64;

/// Creates the mappable buffer for a completion record and timestamps.
fn completion_staging(device: &Device) -> wgpu::Buffer {
    device.buffer(
        COMPLETION_BYTES + TIMESTAMP_BYTES,
        BufferUsages::COPY_DST | BufferUsages::MAP_READ,
    )
}

/// Converts a kernel's records, the non-empty lists in order, to a film.
fn film_of(region: Region, film_layout: FilmLayout, records: &[Vec4]) -> Film {
    let mut film = Film::of(region, film_layout);
    let lists = film.lists_mut().filter(|list| !list.is_empty());
    for (list, records) in lists.zip(records.chunks(region.pixels() as usize)) {
        list.copy_from_slice(records);
    }
    film
}

fn groups(tile: Region) -> [u32; 2] {
    [tile.width(), tile.height()].map(|pixels| pixels.div_ceil(WORKGROUP))
}

impl Backend for Gpu {
    fn begin(&mut self, region: Region) -> Result<(), RenderError> {
        self.check_idle()?;
        let film_state = self.rules.begin(region)?;
        self.film = None; // frees the old film first, since two films may not fit into memory
        let film = self.target(self.rules.film_layout().bytes(), region)?;
        self.film = Some((film, film_state));
        Ok(())
    }

    fn resume(&mut self, film: Film) -> Result<(), RenderError> {
        self.check_idle()?;
        let film_state = self.rules.resume(&film)?;
        self.begin(film.region)?;
        let result = match &self.film {
            Some((target, _)) => self.device.checked(|| {
                let mut offset = 0;
                for list in film.lists() {
                    self.device.queue.write_buffer(&target.buffer, offset, cast_slice(list));
                    offset += size_of_val(list.as_slice()) as u64;
                }
            }),
            None => Err(RenderError::NoFilm),
        };
        self.discard_film_on_error(result)?;
        self.film = self.film.take().map(|(target, _)| (target, film_state));
        Ok(())
    }

    fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        self.check_idle()?;
        let (_, film_state) = self.film.as_mut().ok_or(RenderError::NoFilm)?;
        if !self.rules.call(film_state, tile, &samples)? {
            return Ok(());
        }
        let result = self.dispatch_part(tile, samples);
        self.discard_film_on_error(result)
    }

    fn poll(&mut self) -> Result<bool, RenderError> {
        if self.pending.is_some() {
            let result = self.device.poll().and_then(|()| self.step());
            self.discard_film_on_error(result)?;
        }
        Ok(self.pending.is_none())
    }

    fn wait(&mut self) -> Result<(), RenderError> {
        pollster::block_on(self.finished())
    }

    fn film(&mut self) -> Result<Film, RenderError> {
        pollster::block_on(self.film_async())
    }

    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        pollster::block_on(self.first_hits_async(region))
    }

    fn unskippable_samples(&self) -> u32 {
        self.rules.unskippable_samples()
    }

    fn around(&self, region: Region) -> Region {
        self.rules.around(region)
    }

    fn largest_film(&self) -> u64 {
        let info = &self.device.info;
        let bytes = info.largest_binding.min(info.largest_buffer);
        let film_layout = self.rules.film_layout();
        let max_pixels = bytes / film_layout.bytes().max(FIRST_HIT_BYTES) as u64;
        if !film_layout.adaptive {
            return max_pixels;
        }
        let picture = self.rules.picture();
        let border = u64::from(self.rules.neighbor_radius());
        let neighbors = 2 * border * (u64::from(picture.width()) + u64::from(picture.height()) + 2 * border);
        match picture.pixels() <= max_pixels {
            true => max_pixels,
            false => max_pixels.saturating_sub(neighbors), // the film of a region includes neighbors of the region
        }
    }
}
