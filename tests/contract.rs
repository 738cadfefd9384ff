//! Tests every sentence of the contract of `wgray_render::backend::Backend` on CPU and GPU, with baked and buffered
//! scenes. Deliberately wrong backends must fail.

use std::ops::Range;

use wgray::error::RenderError;
use wgray::scene::{AdaptiveDescription, Description};
use wgray_image::Region;
use wgray_render::backend::Backend;
use wgray_render::cpu::Cpu;
use wgray_trace::film::Film;
use wgray_trace::records::{FirstHit, Packed};

use crate::pictures::{backend, exact_modes};
use crate::{patterns, scenes};

const SIZE: (u32, u32) = (20, 12);
const SAMPLES: u32 = 40;

/// Returns variants of a small scene: direct lighting, and path tracing with layers, each with uniform and with adaptive
/// sampling; then some of them with noise estimates.
pub fn subjects() -> [Packed; 7] {
    let mut base = scenes::scene("cornell.toml");
    (base.image.width, base.image.height) = SIZE;
    base.render.pixel_samples = patterns::samples(wgray::scene::Pattern::Sobol, SAMPLES);
    base.render.light_samples = patterns::samples(wgray::scene::Pattern::Sobol, 2);
    let mut adaptive = base.clone();
    adaptive.render.pixel_samples = patterns::samples(wgray::scene::Pattern::Sobol, 8);
    adaptive.render.adaptive = Some(AdaptiveDescription {
        error: 0.02,
        max_samples: Some(SAMPLES),
    });
    let paths = [&base, &adaptive].map(|scene| scenes::packed(&with_path_integrator(scene)).with_layers());
    let [layered, layered_adaptive] = paths;
    let (base, adaptive) = (scenes::packed(&base), scenes::packed(&adaptive));
    [
        base.clone(),
        adaptive,
        layered.clone(),
        layered_adaptive.clone(),
        base.with_noise(),
        layered.with_noise(),
        layered_adaptive.with_noise(),
    ]
}

fn with_path_integrator(scene: &Description) -> Description {
    let mut scene = scene.clone();
    scene.render.integrator = Some(wgray::scene::Integrator::Path);
    scene.render.ambient = wgray::DVec3::ZERO;
    scene.render.max_depth = 3;
    scene
}

fn full_region() -> Region {
    Region::whole(SIZE.0, SIZE.1)
}

fn region(x0: u32, y0: u32, x1: u32, y1: u32) -> Region {
    Region { x0, y0, x1, y1 }
}

pub fn bits(film: &Film) -> (Region, Vec<u32>) {
    let words = film.lists().map(|list| bytemuck::cast_slice(list).to_vec());
    (film.region, words.collect::<Vec<_>>().concat())
}

fn film_bits(backend: &mut dyn Backend) -> (Region, Vec<u32>) {
    bits(&backend.film().expect("a film"))
}

/// Renders all samples: the pilot pass, then the further samples.
fn complete_film(backend: &mut dyn Backend) -> Film {
    let pilot = backend.unskippable_samples().min(SAMPLES);
    backend.begin(full_region()).expect("a film");
    backend.render(full_region(), 0..pilot).expect("pilot samples");
    backend.render(full_region(), pilot..SAMPLES).expect("further samples");
    backend.film().expect("a film")
}

type MakeBackend<'a> = dyn Fn() -> Box<dyn Backend + 'a> + 'a;
/// A sentence and its test, which returns the deviation as an error.
type Sentence = (&'static str, fn(&Packed, &MakeBackend) -> Result<(), String>);

fn check(condition: bool, deviation: &str) -> Result<(), String> {
    match condition {
        true => Ok(()),
        false => Err(deviation.to_string()),
    }
}

const SENTENCES: &[Sentence] = &[
    ("a new backend has no film", |_, make| {
        let mut backend = make();
        check(
            matches!(backend.film(), Err(RenderError::NoFilm)),
            "a film can be read before `begin`",
        )?;
        let rendered = backend.render(full_region(), 0..1);
        check(
            matches!(rendered, Err(RenderError::NoFilm)),
            "samples are accepted without a film",
        )
    }),
    ("a film starts empty", |_, make| {
        let mut backend = make();
        complete_film(&mut *backend);
        backend.begin(region(2, 3, 7, 9)).map_err(|e| e.to_string())?;
        let film = backend.film().map_err(|e| e.to_string())?;
        check(film.region == region(2, 3, 7, 9), "the film has another region")?;
        check(
            film.lists().flatten().all(|sum| *sum == glam::Vec4::ZERO),
            "the sums of the previous film remain",
        )
    }),
    ("a film has the scene's layout", |packed, make| {
        let mut backend = make();
        for film_region in [full_region(), region(2, 3, 7, 9)] {
            backend.begin(film_region).map_err(|e| e.to_string())?;
            let film = backend.film().map_err(|e| e.to_string())?;
            let lengths = |film: &Film| film.lists().map(Vec::len).collect::<Vec<_>>();
            check(
                lengths(&film) == lengths(&Film::of(film_region, packed.film_layout())),
                "lists have the wrong length",
            )?;
            check(
                film.film_layout() == packed.film_layout(),
                "layers or noise estimates are missing, or were not requested",
            )?;
        }
        Ok(())
    }),
    ("layers do not change the other lists", |packed, make| {
        let film = complete_film(&mut *make());
        let mut without_layers = packed.clone();
        without_layers.specialization.layers = 0;
        let film_without_layers = complete_film(&mut Cpu::new(&without_layers));
        let has_equal_bits =
            |a: &[glam::Vec4], b: &[glam::Vec4]| bytemuck::cast_slice::<_, u32>(a) == bytemuck::cast_slice::<_, u32>(b);
        check(has_equal_bits(&film.sums, &film_without_layers.sums), "the sums differ")?;
        check(
            has_equal_bits(&film.moments, &film_without_layers.moments),
            "the moments differ",
        )?;
        check(
            has_equal_bits(&film.pilot_sums, &film_without_layers.pilot_sums),
            "the pilot sums differ",
        )
    }),
    ("noise estimates do not change the other lists", |packed, make| {
        let mut film = complete_film(&mut *make());
        let mut other = complete_film(&mut Cpu::new(&packed.clone().without_noise()));
        if !packed.sampling.adaptive {
            film.moments.clear();
        }
        for film in [&mut film, &mut other] {
            (film.half_sums, film.albedo_moments, film.normal_moments) = Default::default();
            film.layers[4].iter_mut().for_each(|normal| normal.w = 0.0); // the depth
        }
        check(bits(&film) == bits(&other), "a list differs")
    }),
    ("reading a film changes nothing", |_, make| {
        let mut backend = make();
        backend.begin(full_region()).map_err(|e| e.to_string())?;
        backend.render(full_region(), 0..4).map_err(|e| e.to_string())?;
        let first_copy = film_bits(&mut *backend);
        check(first_copy == film_bits(&mut *backend), "the second copy differs")?;
        backend.render(full_region(), 4..8).map_err(|e| e.to_string())?;
        let mut uninterrupted = make();
        uninterrupted.begin(full_region()).map_err(|e| e.to_string())?;
        uninterrupted.render(full_region(), 0..8).map_err(|e| e.to_string())?;
        check(
            film_bits(&mut *backend) == film_bits(&mut *uninterrupted),
            "samples after a copy differ",
        )
    }),
    ("any backend resumes a film", |packed, make| {
        let mut backend = make();
        let expected = bits(&complete_film(&mut *backend));
        let pilot = backend.unskippable_samples().min(SAMPLES);
        for sample in [1, pilot / 2, pilot, pilot + (SAMPLES - pilot) / 2] {
            let mut interrupted = Cpu::new(packed);
            interrupted.begin(full_region()).map_err(|e| e.to_string())?;
            interrupted
                .render(full_region(), 0..sample.min(pilot))
                .map_err(|e| e.to_string())?;
            interrupted
                .render(full_region(), pilot..sample.max(pilot))
                .map_err(|e| e.to_string())?;
            let film = interrupted.film().map_err(|e| e.to_string())?;
            let mut backend = make();
            backend.resume(film.clone()).map_err(|e| e.to_string())?;
            check(film_bits(&mut *backend) == bits(&film), "resuming changes the film")?;
            backend
                .render(full_region(), sample..pilot.max(sample))
                .map_err(|e| e.to_string())?;
            backend
                .render(full_region(), sample.max(pilot)..SAMPLES)
                .map_err(|e| e.to_string())?;
            check(
                film_bits(&mut *backend) == expected,
                "a resumed and completed film differs",
            )?;
        }
        Ok(())
    }),
    ("a film of another layout is rejected", |packed, make| {
        let mut backend = make();
        let film = complete_film(&mut *backend);
        let before = film_bits(&mut *backend);
        for wrong in [
            Film {
                sums: film.sums[1..].to_vec(),
                ..film.clone()
            },
            Film {
                moments: vec![glam::Vec4::ZERO; 3],
                ..film.clone()
            },
            Film {
                pilot_sums: vec![glam::Vec4::ZERO; 3],
                ..film.clone()
            },
            Film {
                half_sums: vec![glam::Vec4::ZERO; 3],
                ..film.clone()
            },
            Film {
                albedo_moments: vec![glam::Vec4::ZERO; 3],
                ..film.clone()
            },
            Film {
                normal_moments: vec![glam::Vec4::ZERO; 3],
                ..film.clone()
            },
            Film {
                layers: film.layers.clone().map(|mut layer| {
                    layer.push(glam::Vec4::ZERO);
                    layer
                }),
                ..film.clone()
            },
            Film {
                layers: std::array::from_fn(|i| match (i, packed.film_layout().layers) {
                    (4, true) => Vec::new(),
                    (4, false) => film.sums.clone(),
                    _ => film.layers[i].clone(),
                }),
                ..film.clone()
            },
        ] {
            let result = backend.resume(wrong);
            check(
                matches!(result, Err(RenderError::FilmMismatch(_))),
                "a film of another layout is accepted",
            )?;
        }
        check(film_bits(&mut *backend) == before, "a rejection changes the film")
    }),
    ("every partition of the work gives the same film", |_, make| {
        let mut backend = make();
        let expected = bits(&complete_film(&mut *backend));
        let pilot = backend.unskippable_samples().min(SAMPLES);
        let tiles = [region(0, 0, 20, 1), region(0, 1, 9, 12), region(9, 1, 20, 12)];
        backend.begin(full_region()).map_err(|e| e.to_string())?;
        for (start, end) in [(0, pilot), (pilot, SAMPLES)] {
            for tile in tiles.iter().rev() {
                let mut first = start;
                for length in (1..).map(|i| i * i) {
                    let next = (first + length).min(end);
                    backend.render(*tile, first..next).map_err(|e| e.to_string())?;
                    first = next;
                    if first >= end {
                        break;
                    }
                }
            }
        }
        check(
            film_bits(&mut *backend) == expected,
            "small tiles and ranges change the film",
        )
    }),
    ("empty tiles and ranges change nothing", |_, make| {
        let mut backend = make();
        let expected = bits(&complete_film(&mut *backend));
        for (tile, samples) in [
            (full_region(), 7..7),
            (region(3, 3, 3, 9), 0..4),
            (region(99, 99, 99, 99), 0..4),
            (full_region(), Range { start: 9, end: 3 }),
        ] {
            backend.render(tile, samples).map_err(|e| e.to_string())?;
        }
        check(
            film_bits(&mut *backend) == expected,
            "an empty tile or range changes the film",
        )?;
        backend.begin(region(5, 5, 5, 5)).map_err(|e| e.to_string())?;
        let film = backend.film().map_err(|e| e.to_string())?;
        check(film.sums.is_empty(), "an empty film has pixels")
    }),
    ("regions outside are rejected", |_, make| {
        let mut backend = make();
        let is_outside_error = |result: Result<(), RenderError>| matches!(result, Err(RenderError::Outside { .. }));
        check(
            is_outside_error(backend.begin(region(0, 0, 21, 12))),
            "a film may exceed the image",
        )?;
        backend.begin(region(4, 4, 10, 10)).map_err(|e| e.to_string())?;
        for tile in [region(3, 4, 10, 10), region(4, 4, 11, 10), full_region()] {
            check(
                is_outside_error(backend.render(tile, 0..1)),
                "a tile may exceed the film",
            )?;
        }
        let hits = backend.first_hits(region(0, 0, 20, 13)).map(|_| ());
        check(is_outside_error(hits), "first hits may exceed the image")?;
        let film = backend.film().map_err(|e| e.to_string())?;
        check(
            film.sums.iter().all(|sum| *sum == glam::Vec4::ZERO),
            "a rejection changes the film",
        )
    }),
    ("submitted work is pending until polled or waited for", |_, make| {
        let mut backend = make();
        check(
            backend.poll().map_err(|e| e.to_string())?,
            "work is pending before a submit",
        )?;
        backend.wait().map_err(|e| e.to_string())?;
        backend.begin(full_region()).map_err(|e| e.to_string())?;
        backend.submit(full_region(), 0..8).map_err(|e| e.to_string())?;
        let is_pending_error = |result: Result<(), RenderError>| matches!(result, Err(RenderError::Pending));
        check(
            is_pending_error(backend.submit(full_region(), 8..9)),
            "a second submit is accepted",
        )?;
        check(
            is_pending_error(backend.film().map(|_| ())),
            "a film is read while work is pending",
        )?;
        check(
            is_pending_error(backend.begin(full_region())),
            "a film is begun while work is pending",
        )?;
        check(
            is_pending_error(backend.resume(Film::new(full_region()))),
            "a film is resumed while work is pending",
        )?;
        check(
            is_pending_error(backend.first_hits(full_region()).map(|_| ())),
            "first hits are computed while work is pending",
        )?;
        while !backend.poll().map_err(|e| e.to_string())? {
            std::thread::yield_now();
        }
        let polled = film_bits(&mut *backend);
        backend.begin(full_region()).map_err(|e| e.to_string())?;
        backend.render(full_region(), 0..8).map_err(|e| e.to_string())?;
        check(
            film_bits(&mut *backend) == polled,
            "polling and waiting give different films",
        )
    }),
    (
        "the pilot samples of all pixels precede further samples",
        |packed, make| {
            if !packed.sampling.adaptive {
                return Ok(());
            }
            let mut backend = make();
            let pilot = backend.unskippable_samples();
            backend.begin(full_region()).map_err(|e| e.to_string())?;
            backend
                .render(region(0, 0, 20, 11), 0..pilot)
                .map_err(|e| e.to_string())?;
            let result = backend.render(region(0, 0, 20, 1), pilot..pilot + 1);
            check(
                matches!(result, Err(RenderError::PilotIncomplete { .. })),
                "further samples are accepted before the pilot samples are complete",
            )?;
            backend
                .render(region(0, 11, 20, 12), 0..pilot)
                .map_err(|e| e.to_string())?;
            backend
                .render(region(0, 0, 20, 1), pilot..pilot + 1)
                .map_err(|e| e.to_string())?;
            let expected = bits(&complete_film(&mut *backend));
            backend.begin(full_region()).map_err(|e| e.to_string())?;
            let upper_rows = region(0, 0, 20, 11);
            backend.render(upper_rows, 0..pilot).map_err(|e| e.to_string())?;
            backend
                .render(region(0, 11, 20, 12), 0..SAMPLES)
                .map_err(|e| e.to_string())?;
            backend.render(upper_rows, pilot..SAMPLES).map_err(|e| e.to_string())?;
            check(
                film_bits(&mut *backend) == expected,
                "a range with pilot and further samples of the last tile changes the film",
            )
        },
    ),
    ("first hits need no film and do not change it", |_, make| {
        let mut backend = make();
        let hits = backend.first_hits(full_region()).map_err(|e| e.to_string())?;
        check(hits.len() == 240, "wrong number of first hits")?;
        let before = bits(&complete_film(&mut *backend));
        let upper_hits = backend.first_hits(region(0, 0, 20, 2)).map_err(|e| e.to_string())?;
        check(
            bytemuck::cast_slice::<_, u8>(&upper_hits) == bytemuck::cast_slice::<_, u8>(&hits[..40]),
            "the first hits of the upper rows differ",
        )?;
        check(film_bits(&mut *backend) == before, "first hits change the film")
    }),
];

/// Returns the violated sentences with the deviations.
fn violations<'a>(packed: &'a Packed, make: &MakeBackend<'a>) -> Vec<String> {
    let found = SENTENCES.iter().filter_map(|(sentence, test)| {
        let deviation = test(packed, make).err()?;
        Some(format!("{sentence}: {deviation}"))
    });
    found.collect()
}

#[test]
fn every_backend_fulfills_the_contract() {
    for packed in &subjects() {
        for mode in exact_modes() {
            let problems = violations(packed, &|| backend(packed, mode));
            assert_eq!(problems, Vec::<String>::new(), "{mode:?}, {:?}", packed.film_layout());
        }
    }
}

/// A backend with one deliberate defect.
struct DefectiveBackend<'a> {
    inner: Cpu<&'a Packed>,
    defect: Defect,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Defect {
    KeepsTheFilm,
    EmptiesTheFilmByReading,
    IgnoresAMissingFilm,
    DropsTheResumedFilm,
    AddsASampleTwice,
    ClampsTiles,
    AcceptsASecondSubmit,
    FirstHitsEndTheFilm,
    AcceptsFurtherSamplesEarly,
    DropsResumedLayers,
    OmitsLayers,
    WritesLayersIntoTheSums,
    DropsResumedHalves,
    WritesHalvesIntoTheSums,
}

const DEFECTS: [Defect; 14] = [
    Defect::KeepsTheFilm,
    Defect::EmptiesTheFilmByReading,
    Defect::IgnoresAMissingFilm,
    Defect::DropsTheResumedFilm,
    Defect::AddsASampleTwice,
    Defect::ClampsTiles,
    Defect::AcceptsASecondSubmit,
    Defect::FirstHitsEndTheFilm,
    Defect::AcceptsFurtherSamplesEarly,
    Defect::DropsResumedLayers,
    Defect::OmitsLayers,
    Defect::WritesLayersIntoTheSums,
    Defect::DropsResumedHalves,
    Defect::WritesHalvesIntoTheSums,
];

impl Backend for DefectiveBackend<'_> {
    fn begin(&mut self, region: Region) -> Result<(), RenderError> {
        match self.defect == Defect::KeepsTheFilm && self.inner.film().is_ok() {
            true => Ok(()),
            false => self.inner.begin(region),
        }
    }

    fn resume(&mut self, film: Film) -> Result<(), RenderError> {
        match self.defect {
            Defect::DropsTheResumedFilm => self.inner.begin(film.region),
            Defect::DropsResumedLayers => self.inner.resume(Film {
                layers: film.layers.map(|layer| vec![glam::Vec4::ZERO; layer.len()]),
                ..film
            }),
            Defect::DropsResumedHalves => self.inner.resume(Film {
                half_sums: vec![glam::Vec4::ZERO; film.half_sums.len()],
                ..film
            }),
            _ => self.inner.resume(film),
        }
    }

    fn submit(&mut self, tile: Region, samples: Range<u32>) -> Result<(), RenderError> {
        let (mut tile, mut samples) = (tile, samples);
        match self.defect {
            Defect::AddsASampleTwice if samples.start > 0 => samples.start -= 1,
            Defect::ClampsTiles => tile = tile.within(self.inner.film()?.region),
            Defect::AcceptsASecondSubmit => self.inner.wait()?,
            _ => {}
        }
        match self.inner.submit(tile, samples) {
            Err(RenderError::NoFilm) if self.defect == Defect::IgnoresAMissingFilm => Ok(()),
            Err(RenderError::PilotIncomplete { .. }) if self.defect == Defect::AcceptsFurtherSamplesEarly => Ok(()),
            result => result,
        }
    }

    fn poll(&mut self) -> Result<bool, RenderError> {
        self.inner.poll()
    }

    fn wait(&mut self) -> Result<(), RenderError> {
        self.inner.wait()
    }

    fn film(&mut self) -> Result<Film, RenderError> {
        let mut film = self.inner.film()?;
        match self.defect {
            Defect::OmitsLayers => film.layers = Film::new(film.region).layers,
            Defect::WritesHalvesIntoTheSums if film.has_noise() => film.sums = film.half_sums.clone(),
            Defect::WritesLayersIntoTheSums if film.has_layers() => film.sums = film.layers[0].clone(),
            _ => {}
        }
        if self.defect == Defect::EmptiesTheFilmByReading {
            self.inner.begin(film.region)?;
        }
        Ok(film)
    }

    fn first_hits(&mut self, region: Region) -> Result<Vec<FirstHit>, RenderError> {
        if self.defect == Defect::FirstHitsEndTheFilm {
            self.inner.begin(region)?;
        }
        self.inner.first_hits(region)
    }

    fn largest_film(&self) -> u64 {
        self.inner.largest_film()
    }

    fn unskippable_samples(&self) -> u32 {
        self.inner.unskippable_samples()
    }

    fn around(&self, region: Region) -> Region {
        self.inner.around(region)
    }
}

#[test]
fn a_contract_violation_is_detected() {
    let subjects = subjects();
    for defect in DEFECTS {
        let found = subjects.iter().any(|packed| {
            let make = || -> Box<dyn Backend> {
                Box::new(DefectiveBackend {
                    inner: Cpu::new(packed),
                    defect,
                })
            };
            !violations(packed, &make).is_empty()
        });
        assert!(found, "{defect:?}");
    }
}
