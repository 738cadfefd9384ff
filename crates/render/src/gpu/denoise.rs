//! The denoiser on a GPU. The bits are those of [`crate::denoise::denoise`].

use glam::{UVec2, Vec3, Vec4, Vec4Swizzles};
use wgpu::{BufferBindingType, BufferUsages};

use super::compose::{DENOISE, Shaders};
use super::device::Device;
use super::pipeline::{WORKGROUP, bind_group, layout_of, pipeline};
use super::rounding::Rounding;
use crate::denoise::Guides;
use crate::error::RenderError;
use wgray_trace::film::Film;
use wgray_trace::records::{DenoiseParams, Specialization};

/// Types of the bindings in `shaders/kernels/denoise.wgsl`.
const BINDINGS: [BufferBindingType; 3] = [
    BufferBindingType::Uniform,
    BufferBindingType::Storage { read_only: false },
    BufferBindingType::Storage { read_only: true },
];

/// Maximum number of pixels per dispatch, which keeps dispatches below the timeout of drivers.
const MAX_PIXELS: usize = 1 << 17;

/// Returns the denoised colors of a film with noise estimates.
///
/// # Errors
///
/// The device is lost, or its driver reports an error.
pub fn denoise(device: &Device, film: &Film, exact: Option<Rounding>) -> Result<Vec<Vec3>, RenderError> {
    pollster::block_on(denoise_async(device, film, exact))
}

/// Like [`denoise`], as a future that does not block in browsers.
pub async fn denoise_async(device: &Device, film: &Film, exact: Option<Rounding>) -> Result<Vec<Vec3>, RenderError> {
    if film.sums.is_empty() {
        return Ok(Vec::new());
    }
    let guides = Guides::of(film);
    let source = Shaders::built_in().compose_alone(&DENOISE);
    let layout = layout_of(device, BINDINGS);
    let layouts = [layout];
    let pipeline = pipeline(device, &layouts, &DENOISE, &source, &Specialization::default(), exact)?;
    let mut filtered = Vec::with_capacity(film.sums.len());
    let rows = (MAX_PIXELS / guides.width).max(1);
    for start in (0..guides.height).step_by(rows) {
        let rows = start..(start + rows).min(guides.height);
        let planes = guides.rows(rows.clone());
        let size = UVec2::new(guides.width as u32, rows.len() as u32);
        let params = DenoiseParams {
            size,
            stride: guides.stride as u32,
            plane: (planes.len() / Guides::PLANES) as u32,
        };
        let output = device.checked(|| {
            let params = device.upload(BufferUsages::UNIFORM, &[params]);
            let planes = device.upload(BufferUsages::STORAGE, &planes);
            let bytes = u64::from(size.element_product()) * size_of::<Vec4>() as u64;
            let output = device.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
            let group = bind_group(device, &layouts[0], &[&params, &output, &planes]);
            let mut encoder = device.device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(size.x.div_ceil(WORKGROUP), size.y.div_ceil(WORKGROUP), 1);
            drop(pass);
            device.queue.submit([encoder.finish()]);
            output
        })?;
        let colors: Vec<Vec4> = device.download(&output).await?;
        filtered.extend(colors.iter().map(|color| color.xyz()));
    }
    Ok(guides.colors(film, &filtered))
}
