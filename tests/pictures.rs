//! Renders test scenes on all backends: CPU, and GPU with the scene as constants, with buffers, and with plain WGSL.

use glam::Vec4;
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::{Gpu, Options, Rounding};
use wgray_render::job::WorkSplit;
use wgray_trace::film::Film;
use wgray_trace::records::{FirstHit, Packed};

use crate::{adapter, sources};

/// A backend configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RenderMode {
    Cpu,
    /// Exact SPIR-V with the scene as constants.
    Baked,
    /// Exact SPIR-V with the scene in buffers.
    Buffers,
    /// Like `Buffers`, with software quotients and square roots.
    Rounded,
    /// Plain WGSL through wgpu, with the scene in buffers.
    Plain,
}

/// Returns one configuration per backend: CPU, and GPU if a device is available.
pub fn both() -> Vec<RenderMode> {
    let mut modes = vec![RenderMode::Cpu];
    modes.extend(adapter::device().map(|_| RenderMode::Baked));
    modes
}

/// Returns the configurations that must be bit-identical.
pub fn exact_modes() -> Vec<RenderMode> {
    let exact = adapter::device().is_some_and(adapter::bit_exact);
    if exact {
        vec![RenderMode::Cpu, RenderMode::Baked, RenderMode::Buffers]
    } else {
        vec![RenderMode::Cpu]
    }
}

/// Creates a backend. Panics if `mode` needs a device and none is available.
pub fn backend<'a>(packed: &'a Packed, mode: RenderMode) -> Box<dyn Backend + 'a> {
    backend_with(packed, mode, sources::shaders())
}

pub fn backend_with<'a>(packed: &'a Packed, mode: RenderMode, shaders: &Shaders) -> Box<dyn Backend + 'a> {
    if mode == RenderMode::Cpu {
        return Box::new(Cpu::new(packed));
    }
    let device = adapter::device().expect("a device");
    let options = Options {
        exact: match mode {
            RenderMode::Plain => None,
            RenderMode::Rounded => device.info.exact.then_some(Rounding::Software),
            _ => device.info.exact.then_some(Rounding::Device),
        },
        baked: mode == RenderMode::Baked,
    };
    let gpu = Gpu::new(device, packed, shaders, options);
    Box::new(gpu.unwrap_or_else(|error| panic!("{mode:?}: {error}")))
}

pub fn whole(packed: &Packed) -> Region {
    Region::whole(packed.camera.width, packed.camera.height)
}

/// Renders a region and joins its bands.
pub fn film(backend: &mut dyn Backend, packed: &Packed, region: Region, split: &WorkSplit) -> Film {
    let mut joined = Film {
        sums: Vec::new(),
        ..Film::new(region)
    };
    let mut output = |band: Film| {
        for (list, band_list) in joined.lists_mut().zip(band.lists()) {
            list.extend(band_list);
        }
        Ok(())
    };
    let result = wgray_render::job::render(
        backend,
        region,
        packed.sampling.pixel_samples,
        split,
        &mut |_| true,
        &mut output,
    );
    result.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        joined.sums.len() as u64,
        region.pixels(),
        "the bands do not cover the region"
    );
    joined
}

pub fn render(packed: &Packed, mode: RenderMode) -> Film {
    film(
        &mut *backend(packed, mode),
        packed,
        whole(packed),
        &WorkSplit::default(),
    )
}

pub fn render_with(packed: &Packed, mode: RenderMode, shaders: &Shaders) -> Film {
    film(
        &mut *backend_with(packed, mode, shaders),
        packed,
        whole(packed),
        &WorkSplit::default(),
    )
}

pub fn reference(packed: &Packed) -> Film {
    render(packed, RenderMode::Cpu)
}

pub fn first_hits(packed: &Packed, mode: RenderMode) -> Vec<FirstHit> {
    let hits = wgray_render::job::first_hits(&mut *backend(packed, mode), whole(packed));
    hits.unwrap_or_else(|error| panic!("{mode:?}: {error}"))
}

/// Counts the records that are not bit-identical: pixels, moments, layers and noise estimates.
pub fn differing(a: &Film, b: &Film) -> usize {
    let layout = |film: &Film| {
        let lengths = (film.sums.len(), film.moments.len());
        (film.region, lengths, film.has_layers(), film.has_noise())
    };
    assert_eq!(layout(a), layout(b), "films of different regions or layouts");
    let bits = |sum: &Vec4| sum.to_array().map(f32::to_bits);
    let records = image_records(a).zip(image_records(b));
    records.filter(|(a, b)| bits(a) != bits(b)).count()
}

/// Iterates over all records except those that only scheduling uses.
fn image_records(film: &Film) -> impl Iterator<Item = &Vec4> {
    let noise = [&film.half_sums, &film.albedo_moments, &film.normal_moments];
    let lists = [&film.sums, &film.moments].into_iter().chain(&film.layers).chain(noise);
    lists.flatten()
}

pub fn crop(film: &Film, region: Region) -> Film {
    film.clone().part(region)
}

pub fn means(film: &Film) -> Vec<[f64; 3]> {
    film.means().map(|mean| mean.map(f64::from)).collect()
}
