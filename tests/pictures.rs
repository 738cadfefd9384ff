//! Pictures by every way to one: the CPU, and on the device the scene as constants, from buffers, and as plain WGSL.

use wgray::cpu::Cpu;
use wgray::film::{Film, Region};
use wgray::gpu::{Gpu, Options};
use wgray::job::{Backend, Cut};
use wgray::pack::{FirstHit, Packed};

use crate::{adapter, sources};

/// A way from a packed scene to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// The twins.
    Cpu,
    /// SPIR-V that is computed as written, the scene as constants.
    Baked,
    /// The same, the scene in buffers.
    Buffers,
    /// Plain WGSL through wgpu, the scene in buffers.
    Plain,
}

/// One of each path, for tests of what both compute. The CPU alone where there is no device.
pub fn both() -> Vec<Way> {
    let mut ways = vec![Way::Cpu];
    ways.extend(adapter::device().map(|_| Way::Baked));
    ways
}

/// A backend with a scene. Panics where the way asks for a device and there is none.
pub fn backend<'a>(packed: &'a Packed, way: Way) -> Box<dyn Backend + 'a> {
    if way == Way::Cpu {
        return Box::new(Cpu::new(packed));
    }
    let device = adapter::device().expect("a device");
    let options = Options {
        exact: way != Way::Plain && device.info.exact,
        baked: way == Way::Baked,
    };
    let gpu = Gpu::new(device, packed, sources::shaders(), options);
    Box::new(gpu.unwrap_or_else(|error| panic!("{way:?}: {error}")))
}

/// The whole picture of a backend, cut in some way.
pub fn film(backend: &mut dyn Backend, packed: &Packed, cut: &Cut) -> Film {
    let whole = Region::whole(packed.camera.width, packed.camera.height);
    let mut film = Film {
        region: whole,
        sums: Vec::new(),
    };
    let mut output = |band: Film| {
        film.sums.extend(band.sums);
        Ok(())
    };
    wgray::job::render(backend, whole, packed.pixel_samples, cut, &mut |_| true, &mut output)
        .unwrap_or_else(|error| panic!("{error}"));
    film
}

pub fn render(packed: &Packed, way: Way) -> Film {
    film(&mut *backend(packed, way), packed, &Cut::default())
}

pub fn first_hits(packed: &Packed, way: Way) -> Vec<FirstHit> {
    let whole = Region::whole(packed.camera.width, packed.camera.height);
    wgray::job::first_hits(&mut *backend(packed, way), whole).unwrap_or_else(|error| panic!("{way:?}: {error}"))
}

/// The means of the pixels as f64.
pub fn means(film: &Film) -> Vec<[f64; 3]> {
    film.means().map(|mean| mean.map(f64::from)).collect()
}
