//! What the tests of whole pictures share: scenes, the device, and films from both paths.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use wgray::cpu::Cpu;
use wgray::film::{Film, Region};
use wgray::gpu::{self, Device, Gpu, Options, compose::Shaders};
use wgray::job::{self, Backend, Cut};
use wgray::pack::{Packed, pack};
use wgray::scene::Description;

/// A path in the project.
pub fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The scene files of the project, by name.
pub fn scenes() -> Vec<(String, Description)> {
    let entries = fs::read_dir(project("scenes")).expect("the project has scenes");
    let paths = entries.map(|entry| entry.expect("a readable folder").path());
    let mut paths: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|end| end == "toml"))
        .collect();
    paths.sort();
    assert!(paths.len() >= 3, "scenes were not found");
    paths
        .iter()
        .map(|path| (path.display().to_string(), describe(path)))
        .collect()
}

fn describe(path: &Path) -> Description {
    let text = fs::read_to_string(path).expect("a readable scene");
    Description::parse(&text, &path.display().to_string()).unwrap_or_else(|error| panic!("{error}"))
}

/// One scene of the project.
pub fn scene(name: &str) -> Description {
    describe(&project("scenes").join(name))
}

/// A scene from its text.
pub fn parse(text: &str) -> Packed {
    packed(&Description::parse(text, "test").unwrap_or_else(|error| panic!("{error}")))
}

/// What both paths read.
pub fn packed(description: &Description) -> Packed {
    pack(&description.validate().unwrap_or_else(|problem| panic!("{problem}")))
}

/// The device of all tests. Without one they fail: nothing is skipped.
pub fn device() -> &'static Device {
    static DEVICE: OnceLock<Device> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let device = gpu::choose(&gpu::Choice::Auto).unwrap_or_else(|error| panic!("no device to test on: {error}"));
        eprintln!(
            "tested on {}, {}, by {}",
            device.info.name, device.info.driver, device.info.backend
        );
        device
    })
}

/// The ways a scene reaches the device: by constants and by buffers exactly as written, and the plain WGSL.
pub const BAKED: Options = Options {
    exact: true,
    baked: true,
};
pub const BUFFERS: Options = Options {
    exact: true,
    baked: false,
};
pub const PLAIN: Options = Options {
    exact: false,
    baked: false,
};

pub fn gpu(scene: &Packed, options: Options) -> Gpu {
    Gpu::new(device(), scene, &Shaders::built_in(), options).unwrap_or_else(|error| panic!("{error}"))
}

/// The whole of a scene's picture.
pub fn whole(scene: &Packed) -> Region {
    Region::whole(scene.camera.width, scene.camera.height)
}

/// A region rendered in bands, put together.
pub fn film(backend: &mut dyn Backend, scene: &Packed, region: Region, cut: &Cut) -> Film {
    let mut all = Film {
        region,
        sums: Vec::new(),
    };
    let mut output = |band: Film| {
        all.sums.extend(band.sums);
        Ok(())
    };
    let result = job::render(backend, region, scene.pixel_samples, cut, &mut |_| true, &mut output);
    result.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        all.sums.len() as u64,
        region.pixels(),
        "the bands do not make up the region"
    );
    all
}

/// The reference: the whole picture on the CPU.
pub fn reference(scene: &Packed) -> Film {
    film(&mut Cpu::new(scene), scene, whole(scene), &Cut::default())
}

/// How many pixels are not the same bits.
pub fn differing(a: &Film, b: &Film) -> usize {
    assert_eq!(a.region, b.region, "films of different regions");
    let bits = |film: &Film| {
        film.sums
            .iter()
            .map(|sum| sum.to_array().map(f32::to_bits))
            .collect::<Vec<_>>()
    };
    bits(a).iter().zip(&bits(b)).filter(|(a, b)| a != b).count()
}

/// A part of a film.
pub fn crop(film: &Film, region: Region) -> Film {
    let width = film.region.width() as usize;
    let rows = film
        .sums
        .chunks(width)
        .skip((region.y0 - film.region.y0) as usize)
        .take(region.height() as usize);
    let columns = (region.x0 - film.region.x0) as usize..(region.x1 - film.region.x0) as usize;
    Film {
        region,
        sums: rows.flat_map(|row| row[columns.clone()].to_vec()).collect(),
    }
}
