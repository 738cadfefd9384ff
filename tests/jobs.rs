//! Interrupted and resumed jobs: neither the interruption nor the backend that resumes the job changes the bits of the
//! film. Damaged pieces in a checkpoint are rejected.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use wgray::error::RenderError;
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
use wgray_render::job::checkpoint::{Checkpoint, CheckpointError, CheckpointOptions};
use wgray_render::job::{
    Bands, CheckpointStore, FilmPiece, Flow, Identity, NoCheckpoint, Order, PassEnds, StoredPiece, Tile, WorkSplit,
};
use wgray_render::noise::next_decision;
use wgray_trace::film::Film;
use wgray_trace::records::Packed;

use crate::contract::{bits, subjects};
use crate::pictures::{self, RenderMode, whole};
use crate::scenes;

/// A checkpoint store in memory, written at every opportunity.
#[derive(Default)]
struct MemoryStore {
    pieces: BTreeMap<u32, FilmPiece>,
    /// True for a negative control that loses the progress of unfinished pieces.
    forgetful: bool,
}

impl CheckpointStore for MemoryStore {
    fn pieces(&self) -> Vec<StoredPiece> {
        let stored_piece = |(y, piece): (&u32, &FilmPiece)| StoredPiece {
            number: *y as usize,
            region: piece.region,
            film: piece.film.region,
            reached: piece.reached.clone(),
        };
        self.pieces.iter().map(stored_piece).collect()
    }

    fn load(&mut self, number: usize) -> Result<FilmPiece, RenderError> {
        Ok(self.pieces[&(number as u32)].clone())
    }

    fn keep(&mut self, piece: &FilmPiece) {
        let Region { y0, y1, .. } = piece.region;
        self.pieces
            .retain(|_, other| other.region.y1 <= y0 || other.region.y0 >= y1);
        let mut piece = piece.clone();
        if self.forgetful && !piece.reached.pass.is_empty() {
            piece.reached.next = [piece.film.region.x0, piece.film.region.y0];
        }
        self.pieces.insert(y0, piece);
    }

    fn sync(&mut self) {}

    fn interval(&self) -> Duration {
        Duration::ZERO
    }

    fn small_pieces(&self) -> bool {
        true
    }
}

/// Renders up to `max_dispatches` dispatches. Returns the film if it is complete.
fn render_dispatches(
    packed: &Packed,
    backend: &mut dyn Backend,
    store: &mut dyn CheckpointStore,
    split: &WorkSplit,
    at_once: bool,
    max_dispatches: usize,
) -> Option<Film> {
    let (region, order) = (whole(packed), if at_once { Order::Pixels } else { Order::Rows });
    let mut bands = Bands::new(
        region,
        packed.sampling.pixel_samples,
        split,
        order,
        backend.largest_film(),
        store,
    );
    if at_once {
        bands = bands.as_a_whole(packed.film_layout()).expect("memory");
    }
    let mut dispatches = 0;
    let mut watch = |_: &mut dyn Backend, _: Region, fraction: f64| {
        assert!((0.0..=1.0 + 1e-9).contains(&fraction), "{fraction}");
        dispatches += 1;
        Ok(Flow::from(dispatches < max_dispatches))
    };
    let mut film = Film::of(region, packed.film_layout());
    loop {
        match bands.render_next(backend, &mut watch, &mut || {}) {
            Ok(Some(band)) => {
                let start = (band.film.region.y0 * region.width()) as usize;
                for (to, from) in film.lists_mut().zip(band.film.lists()) {
                    if let Some(to) = to.get_mut(start..start + from.len()) {
                        to.copy_from_slice(from);
                    }
                }
            }
            Ok(None) => return Some(film),
            Err(RenderError::Cancelled) => return None,
            Err(error) => panic!("{error}"),
        }
    }
}

/// Interrupts a job after every `max_dispatches` dispatches. Returns `None` if the job does not complete.
fn render_interrupted(
    packed: &Packed,
    store: &mut dyn CheckpointStore,
    split: &WorkSplit,
    at_once: bool,
    max_dispatches: usize,
) -> Option<Film> {
    (0..1000).find_map(|round| {
        let mut backend: Box<dyn Backend> = match round % 3 {
            0 => pictures::backend(packed, RenderMode::Buffers),
            1 => Box::new(Cpu::new(packed)),
            _ => pictures::backend(packed, RenderMode::Baked),
        };
        render_dispatches(packed, &mut *backend, store, split, at_once, max_dispatches)
    })
}

fn splits() -> [WorkSplit; 3] {
    let split = WorkSplit::default();
    [
        split,
        WorkSplit {
            band_pixels: 70,
            samples_per_dispatch: Some(7),
            rows_per_dispatch: Some(2),
        },
        WorkSplit {
            band_pixels: 100,
            samples_per_dispatch: Some(1),
            ..split
        },
    ]
}

#[test]
fn interrupted_and_resumed_jobs_give_the_same_film() {
    for packed in subjects() {
        let expected = bits(&pictures::film(
            &mut Cpu::new(&packed),
            &packed,
            whole(&packed),
            &WorkSplit::default(),
        ));
        for (split, max_dispatches) in splits().into_iter().zip([1, 23, 57]) {
            for at_once in [false, true] {
                let mut store = MemoryStore::default();
                let film =
                    render_interrupted(&packed, &mut store, &split, at_once, max_dispatches).expect("a complete film");
                assert!(
                    bits(&film) == expected,
                    "{split:?}, all at once: {at_once}, {:?}",
                    packed.film_layout()
                );
            }
        }
    }
}

/// Negative control: the film differs, or the job does not complete.
#[test]
fn a_store_that_loses_progress_is_detected() {
    let [packed, ..] = subjects();
    let expected = bits(&pictures::film(
        &mut Cpu::new(&packed),
        &packed,
        whole(&packed),
        &WorkSplit::default(),
    ));
    let mut store = MemoryStore {
        forgetful: true,
        ..MemoryStore::default()
    };
    let [_, split, _] = splits();
    let film = render_interrupted(&packed, &mut store, &split, false, 23);
    assert!(film.is_none_or(|film| bits(&film) != expected));
}

#[test]
fn at_the_time_limit_every_pixel_has_a_sample() {
    for packed in subjects() {
        let split = WorkSplit {
            band_pixels: 70,
            samples_per_dispatch: Some(1),
            rows_per_dispatch: Some(1),
        };
        let (mut cpu, mut store) = (Cpu::new(&packed), MemoryStore::default());
        let region = whole(&packed);
        let max_pixels = cpu.largest_film();
        let bands = Bands::new(
            region,
            packed.sampling.pixel_samples,
            &split,
            Order::Pixels,
            max_pixels,
            &mut store,
        );
        let mut bands = bands.as_a_whole(packed.film_layout()).expect("memory");
        let mut watch = |_: &mut dyn Backend, _: Region, _: f64| Ok(Flow::TimeIsUp);
        let mut pixels = 0;
        while let Some(band) = bands.render_next(&mut cpu, &mut watch, &mut || {}).expect("bands") {
            assert!(band.min_samples >= 1);
            assert!(band.film.sums.iter().all(|sum| sum.w != 0.0));
            pixels += band.film.region.pixels();
        }
        assert_eq!(pixels, region.pixels());
    }
}

/// Returns the film of the first `samples` samples of all pixels.
fn film_of_samples(packed: &Packed, samples: u32) -> Film {
    let (mut cpu, region) = (Cpu::new(packed), whole(packed));
    let pilot = cpu.unskippable_samples().min(samples);
    cpu.begin(region).expect("a film");
    cpu.render(region, 0..pilot).expect("samples");
    cpu.render(region, pilot..samples).expect("samples");
    cpu.film().expect("a film")
}

fn last_pass(bands: &mut Bands<impl CheckpointStore>) -> Film {
    let mut films = Vec::new();
    let mut output = |band: wgray_render::job::FinishedBand| {
        films.push(band.film);
        Ok(())
    };
    bands.output_last_pass(&mut output).expect("a pass");
    let mut films = films.into_iter();
    let mut joined = films.next().expect("a band");
    for film in films {
        joined.region.y1 = film.region.y1;
        for (list, band_list) in joined.lists_mut().zip(film.lists()) {
            list.extend(band_list);
        }
    }
    joined
}

/// After an interrupted pass, the film of the previous pass remains.
#[test]
fn the_last_pass_is_a_complete_image() {
    for packed in subjects() {
        assert!(
            bits(&film_of_samples(&packed, 3)) != bits(&film_of_samples(&packed, 4)),
            "3 and 4 samples give the same film"
        );
        for mode in pictures::exact_modes() {
            for split in splits() {
                let mut backend = pictures::backend(&packed, mode);
                let (region, max_pixels) = (whole(&packed), backend.largest_film());
                let mut no_checkpoint = NoCheckpoint;
                let order = Order::Pixels;
                let bands = Bands::new(
                    region,
                    packed.sampling.pixel_samples,
                    &split,
                    order,
                    max_pixels,
                    &mut no_checkpoint,
                );
                let mut bands = bands.in_passes(packed.film_layout()).expect("memory");
                let (mut dispatches, mut passes, mut interrupted) = (0, vec![0], 0);
                let mut watch = |_: &mut dyn Backend, _: Region, _: f64| {
                    dispatches += 1;
                    Ok(Flow::from(dispatches % 3 != 0))
                };
                loop {
                    match bands.next_pass(&mut *backend, &mut watch, &mut || {}) {
                        Ok(None) => break,
                        Ok(Some(samples)) => assert_eq!(samples, bands.completed_samples()),
                        Err(RenderError::Cancelled) => interrupted += 1,
                        Err(error) => panic!("{error}"),
                    }
                    let samples = bands.completed_samples();
                    if passes.last() != Some(&samples) {
                        passes.push(samples);
                    }
                    if samples > 0 {
                        let (found, expected) = (last_pass(&mut bands), film_of_samples(&packed, samples));
                        assert!(
                            bits(&found) == bits(&expected),
                            "{mode:?}, {split:?}, {samples} samples"
                        );
                    }
                }
                assert!(interrupted > 0 && passes.is_sorted(), "{interrupted}, {passes:?}");
                for samples in [1, 2, 4, 8, 16, 32, packed.sampling.pixel_samples] {
                    assert!(passes.contains(&samples), "{passes:?}");
                }
            }
        }
    }
}

/// Passes to given numbers of samples end nowhere else, even if they are interrupted.
#[test]
fn passes_end_where_the_noise_decides() {
    let mut scene = scenes::scene("cornell.toml");
    (scene.image.width, scene.image.height) = (20, 10);
    scene.render.pixel_samples.count = 49;
    let packed = scenes::packed(&scene);
    for split in splits() {
        for order in [Order::Rows, Order::Pixels] {
            let mut cpu = Cpu::new(&packed);
            let max_pixels = cpu.largest_film();
            let bands = Bands::new(whole(&packed), 49, &split, order, max_pixels, NoCheckpoint);
            let bands = bands.in_passes_to(PassEnds::At(next_decision), packed.film_layout());
            let mut bands = bands.expect("memory");
            let (mut dispatches, mut ends, mut interrupted) = (0, Vec::new(), 0);
            let mut watch = |_: &mut dyn Backend, _: Region, _: f64| {
                dispatches += 1;
                Ok(Flow::from(dispatches % 3 != 0))
            };
            while bands.uniform_samples() != Some(49) {
                match bands.next_pass(&mut cpu, &mut watch, &mut || {}) {
                    Ok(_) => assert!(bands.uniform_samples().is_some(), "{split:?}, {order:?}"),
                    Err(RenderError::Cancelled) => interrupted += 1,
                    Err(error) => panic!("{error}"),
                }
                let Some(samples) = bands.uniform_samples() else {
                    continue;
                };
                ends.push(samples);
                let mut found = Film::of(whole(&packed), packed.film_layout());
                bands.films(&mut |film| found.copy_rows(&film));
                let expected = film_of_samples(&packed, samples);
                assert!(
                    bits(&found) == bits(&expected),
                    "{split:?}, {order:?}, {samples} samples"
                );
            }
            assert_eq!(ends, [16, 32, 49], "{split:?}, {order:?}");
            assert!(interrupted > 0, "{split:?}, {order:?}");
        }
    }
}

fn cornell() -> (Packed, Identity) {
    let mut scene = scenes::scene("cornell.toml");
    (scene.image.width, scene.image.height) = (24, 40);
    scene.render.pixel_samples.count = 4;
    let packed = scenes::packed(&scene);
    let identity = Identity::of(&packed, whole(&packed), false);
    (packed, identity)
}

fn open(
    path: &Path,
    packed: &Packed,
    identity: &Identity,
) -> Result<(Checkpoint<'static>, Vec<String>), CheckpointError> {
    let (sender, warnings) = std::sync::mpsc::channel();
    let mut rounds = 0;
    let options = CheckpointOptions {
        path: path.to_owned(),
        resume: true,
        interval: Duration::ZERO,
        // A child process of another test may inherit the file and the lock for a short time.
        wait: Box::new(move || {
            rounds += 1;
            assert!(rounds < 200, "another process still writes the checkpoint");
            true
        }),
        report: Box::new(move |warning| sender.send(warning.to_owned()).expect("a receiver")),
    };
    let checkpoint = Checkpoint::open(options, identity.clone(), packed.film_layout())?;
    Ok((checkpoint, warnings.try_iter().collect()))
}

fn folder_with_checkpoint(packed: &Packed, identity: &Identity) -> (tempfile::TempDir, PathBuf, Film) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("c");
    let (mut checkpoint, warnings) = open(&path, packed, identity).expect("a checkpoint");
    assert!(warnings.is_empty(), "{warnings:?}");
    let [_, split, _] = splits();
    let film = render_dispatches(
        packed,
        &mut Cpu::new(packed),
        &mut checkpoint,
        &split,
        false,
        usize::MAX,
    );
    (folder, path, film.expect("a film"))
}

/// With adaptive sampling, the film of an unfinished piece is larger than its region.
#[test]
fn unfinished_pieces_are_read_from_the_file() {
    let mut borders = Vec::new();
    for packed in subjects() {
        let identity = Identity::of(&packed, whole(&packed), false);
        let region = Region {
            y0: 4,
            y1: 7,
            ..whole(&packed)
        };
        let mut cpu = Cpu::new(&packed);
        let around = cpu.around(region);
        borders.push(region.y0 - around.y0);
        cpu.begin(around).expect("a film");
        cpu.render(around, 0..1).expect("samples");
        let piece = FilmPiece {
            region,
            reached: wgray_render::job::SampleProgress {
                pass: 1..2,
                next: [around.x0, around.y0],
            },
            film: cpu.film().expect("a film"),
        };
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("c");
        let (mut checkpoint, _) = open(&path, &packed, &identity).expect("a checkpoint");
        checkpoint.keep(&piece);
        checkpoint.sync();
        drop(checkpoint);
        let (mut checkpoint, warnings) = open(&path, &packed, &identity).expect("a checkpoint");
        assert_eq!(warnings, Vec::<String>::new());
        let [stored] = checkpoint.pieces().try_into().expect("one piece");
        let loaded = checkpoint.load(stored.number).expect("a piece");
        assert_eq!((loaded.region, loaded.reached), (piece.region, piece.reached));
        assert!(bits(&loaded.film) == bits(&piece.film), "the films differ");
    }
    assert!([0, 1, 2].iter().all(|border| borders.contains(border)), "{borders:?}");
}

#[test]
fn pieces_before_the_damage_are_used() {
    let (packed, identity) = cornell();
    let (_folder, path, film) = folder_with_checkpoint(&packed, &identity);
    let intact = std::fs::read(&path).expect("the file");
    let (checkpoint, _) = open(&path, &packed, &identity).expect("a checkpoint");
    let all_pieces = checkpoint.pieces();
    drop(checkpoint);
    assert!(all_pieces.len() > 2, "{}", all_pieces.len());
    let header = {
        let length = u32::from_le_bytes(intact[16..20].try_into().expect("four bytes")) as usize;
        16 + 4 + length + 32
    };
    for offset in (0..intact.len()).step_by(intact.len() / 211) {
        for truncate in [false, true] {
            let mut bytes = intact.clone();
            match truncate {
                true => bytes.truncate(offset),
                false => bytes[offset] ^= 0x10,
            }
            std::fs::write(&path, &bytes).expect("a file");
            match open(&path, &packed, &identity) {
                Err(error) => {
                    assert!(offset < header, "byte {offset}: {error}");
                    assert!(
                        matches!(error, CheckpointError::Unreadable { .. }),
                        "byte {offset}: {error}"
                    );
                }
                Ok((mut checkpoint, warnings)) => {
                    assert!(offset >= header, "a damaged header was accepted: byte {offset}");
                    // A truncation between two pieces is not damage.
                    assert!(
                        warnings.len() == 1 || (truncate && warnings.is_empty()),
                        "byte {offset}: {warnings:?}"
                    );
                    let remaining = checkpoint.pieces();
                    assert_ne!(remaining, all_pieces);
                    // On a slow machine, an older unfinished piece may replace a damaged piece.
                    for piece in remaining.into_iter().filter(|piece| all_pieces.contains(piece)) {
                        let FilmPiece {
                            region, film: found, ..
                        } = checkpoint.load(piece.number).expect("a piece");
                        assert_eq!(bits(&film.clone().part(region)), bits(&found.part(region)));
                    }
                    let [_, split, _] = splits();
                    let completed = render_dispatches(
                        &packed,
                        &mut Cpu::new(&packed),
                        &mut checkpoint,
                        &split,
                        false,
                        usize::MAX,
                    );
                    assert_eq!(bits(&completed.expect("a film")), bits(&film));
                }
            }
        }
    }
}

#[test]
fn replaced_pieces_do_not_accumulate() {
    let mut scene = scenes::scene("cornell.toml");
    (scene.image.width, scene.image.height) = (1024, 512);
    scene.render.pixel_samples.count = 64;
    let packed = scenes::packed(&scene);
    let identity = Identity::of(&packed, whole(&packed), false);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("c");
    let (mut checkpoint, _) = open(&path, &packed, &identity).expect("a checkpoint");
    let film = Film::of(whole(&packed), packed.film_layout());
    let bytes = film.region.pixels() * packed.film_layout().bytes() as u64;
    let mut largest = 0;
    for round in 1..40 {
        let piece = FilmPiece {
            region: film.region,
            reached: wgray_render::job::SampleProgress {
                pass: round - 1..round,
                next: [0, 0],
            },
            film: film.clone(),
        };
        checkpoint.keep(&piece);
        checkpoint.sync();
        largest = largest.max(std::fs::metadata(&path).expect("the file").len());
        let [stored] = checkpoint.pieces().try_into().expect("one piece");
        assert_eq!(checkpoint.load(stored.number).expect("a piece"), piece);
    }
    assert!(largest > 3 * bytes, "no replaced piece was ever in the file: {largest}");
    assert!(largest < 3 * bytes + (64 << 20) + 4096, "{largest}");
    drop(checkpoint);
    let (checkpoint, warnings) = open(&path, &packed, &identity).expect("a checkpoint");
    assert_eq!((checkpoint.pieces().len(), warnings), (1, Vec::new()));
}

type Change<'a, T> = (&'a str, &'a dyn Fn(&mut T));

#[test]
fn different_jobs_have_different_identities() {
    let scene = scenes::scene("cornell.toml");
    let identity_with = |change: &dyn Fn(&mut wgray::Description)| {
        let mut scene = scene.clone();
        change(&mut scene);
        let packed = scenes::packed(&scene);
        Identity::of(&packed, whole(&packed), false)
    };
    let identity = identity_with(&|_| ());
    assert_eq!(identity, identity_with(&|_| ()), "the identities of one scene differ");
    let changes: [Change<wgray::Description>; 6] = [
        ("its size is", &|scene| scene.image.width += 1),
        ("its number of samples is", &|scene| {
            scene.render.pixel_samples.count = 1
        }),
        ("its scene or an option", &|scene| scene.render.seed += 1),
        ("its scene or an option", &|scene| scene.render.ambient.x += 1e-3),
        ("its scene or an option", &|scene| scene.shapes.truncate(3)),
        ("its scene or an option", &|scene| scene.lights.truncate(0)),
    ];
    for (expected_start, change) in changes {
        let difference = identity.difference(&identity_with(change)).unwrap_or_default();
        assert!(difference.starts_with(expected_start), "{expected_start}: {difference}");
    }
    let changes: [Change<Identity>; 7] = [
        ("its version", &|job| job.version.push('1')),
        ("its crop is", &|job| job.region[0] = 1),
        ("its sampling is adaptive, not uniform", &|job| job.adaptive = true),
        ("its layers are means over the samples, not", &|job| job.layers = true),
        ("it was rendered with, not without, noise", &|job| job.noise = true),
        ("it was rendered with, not without, --exact", &|job| {
            job.exact_rounding = true
        }),
        ("its shaders differ", &|job| job.shaders.push('1')),
    ];
    for (expected_start, change) in changes {
        let mut changed = identity.clone();
        change(&mut changed);
        let difference = identity.difference(&changed).unwrap_or_default();
        assert!(difference.starts_with(expected_start), "{expected_start}: {difference}");
    }
    // Layers and noise estimates do not change the scene hash.
    let [_, _, layered, ..] = subjects();
    let plain = layered.clone().without_layers();
    let noisy = plain.clone().with_noise();
    let [layered, plain, noisy] = [layered, plain, noisy].map(|packed| Identity::of(&packed, whole(&packed), false));
    assert_eq!((&layered.scene, &noisy.scene), (&plain.scene, &plain.scene));
    let names = [layered, plain, noisy].map(|identity| identity.file_name());
    assert!(names[0] != names[1] && names[1] != names[2] && names[0] != names[2]);
}

#[test]
fn tiles_partition_the_rows() {
    for (height, count) in [(1, 1), (7, 3), (7, 7), (65_536, 1), (65_536, 65_536), (65_536, 9999)] {
        let region = Region {
            x0: 3,
            y0: 11,
            x1: 5,
            y1: 11 + height,
        };
        let mut next = region.y0;
        for number in 1..=count {
            let rows = Tile { number, of: count }.rows(region).expect("rows");
            assert_eq!((rows.x0, rows.x1, rows.y0), (3, 5, next));
            assert!(rows.height() == height / count || rows.height() == height / count + 1);
            next = rows.y1;
        }
        assert_eq!(next, region.y1);
        assert_eq!(
            Tile {
                number: 1,
                of: height + 1
            }
            .rows(region),
            None
        );
    }
}
