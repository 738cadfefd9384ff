//! Parts of an image, each rendered by its own process: files of finished pieces, with first hits if layers need them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::identity::Identity;
use super::piece::FilmPiece;
use super::pieces_file::{self, Entry, FORMAT, Header, Key};
use super::steps::SampleProgress;
use crate::error::RenderError;
use crate::output::{Aov, AovSource, Band, Layout, Metadata, Sink};
use wgray_image::Pending;
use wgray_image::Region;
use wgray_image::blocking_path;
use wgray_scene::{Integrator, ViewSettings, ViewTransform};
use wgray_trace::film::FilmLayout;

/// Data for the merged image besides the films.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartHeader {
    /// Number of the part, and number of parts.
    pub tile: Tile,
    /// Names of the layers.
    pub aovs: Vec<String>,
    /// True if the image has alpha.
    pub alpha: bool,
    /// Bits (f32) of the distance that a PNG of the depth maps to half brightness.
    pub middle_depth: u32,
    /// Name of the view transform.
    pub view_transform: String,
    /// Bits (f64) of the exposure in stops.
    pub exposure: u64,
    /// Metadata of the image, without the device.
    pub metadata: Vec<(String, String)>,
}

impl PartHeader {
    /// Returns the reason why another part does not belong to the same image; `None` if the part belongs to it.
    fn difference(&self, other: &PartHeader, ignores_view: bool) -> Option<&'static str> {
        let view = |header: &PartHeader| (header.view_transform.clone(), header.exposure);
        if (&self.aovs, self.alpha) != (&other.aovs, other.alpha) {
            Some("has different layers")
        } else if !ignores_view && view(self) != view(other) {
            Some("has a different view transform or exposure")
        } else if self.middle_depth != other.middle_depth || self.metadata != other.metadata {
            Some("was rendered with different settings")
        } else {
            None
        }
    }

    /// Rejects headers that this program never writes: unfinished pieces, layers without data, invalid depths and
    /// exposures.
    fn check(&self, identity: &Identity, entries: &[Entry]) -> Result<(), String> {
        let samples = identity.pixel_samples;
        for Entry {
            region,
            film_region,
            reached,
            ..
        } in entries
        {
            if film_region != region || reached.pass != (samples..samples) {
                return Err(format!("its piece of the pixels {region} is not finished"));
            }
        }
        let aov_named = |name: &String| Aov::ALL.into_iter().find(|aov| aov.name() == name);
        for aov in self.aovs.iter().filter_map(aov_named) {
            let has_values = match aov.source(Integrator::Phong) {
                AovSource::Statistics if aov == Aov::Denoised => identity.film_layout().noise,
                AovSource::Statistics => identity.film_layout().has_moments(),
                AovSource::Samples => identity.layers,
                AovSource::FirstHit => {
                    entries.iter().all(|entry| entry.has_hits) || aov == Aov::ShadingNormal && identity.layers
                }
            };
            if !has_values {
                return Err(format!("has no values for its layer {}", aov.name()));
            }
        }
        let depth = f32::from_bits(self.middle_depth);
        if !(depth > 0.0 && depth.is_finite()) {
            return Err(format!("its depth, {depth}, must be finite and greater than 0"));
        }
        let exposure = ViewSettings::check_exposure(f64::from_bits(self.exposure));
        exposure.map(drop).map_err(|rule| format!("its exposure {rule}"))
    }

    /// Returns the header of a part.
    pub fn of(tile: Tile, layout: &Layout, metadata: Metadata) -> PartHeader {
        PartHeader {
            tile,
            aovs: layout.aovs.iter().map(|aov| aov.name().to_owned()).collect(),
            alpha: layout.alpha,
            middle_depth: layout.middle_depth.to_bits(),
            view_transform: layout.view.transform.name().to_owned(),
            exposure: layout.view.exposure.to_bits(),
            metadata: metadata.pairs,
        }
    }
}

/// One of the parts of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tile {
    /// Number of the part, counted from 1.
    pub number: u32,
    /// Number of parts.
    pub of: u32,
}

impl Tile {
    /// Returns the part's rows of a region; `None` if the number is invalid, or if the region has fewer rows than the
    /// image has parts. The heights of parts differ by at most one row.
    pub fn rows(self, region: Region) -> Option<Region> {
        let Tile { number, of } = self;
        let height = u64::from(region.height());
        let row = |i: u32| region.y0 + (height * u64::from(i) / u64::from(of.max(1))) as u32;
        let is_part = 1 <= number && number <= of && u64::from(of) <= height;
        is_part.then(|| Region {
            y0: row(number - 1),
            y1: row(number),
            ..region
        })
    }
}

impl std::fmt::Display for Tile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// Writes a part: the finished bands that `render` passes to the sink.
///
/// # Errors
///
/// Errors of `render`, and [`RenderError::Output`] if the file cannot be written.
pub fn write_part(
    mut file: Pending,
    identity: &Identity,
    part: &PartHeader,
    render: &mut dyn FnMut(&mut Sink) -> Result<(), RenderError>,
) -> Result<(), RenderError> {
    let header = Header {
        format: FORMAT,
        identity: identity.clone(),
        part: Some(part.clone()),
    };
    let (key, _) = pieces_file::write_header(&mut file, &header)?;
    let samples = identity.pixel_samples;
    render(&mut |Band { film, hits }| {
        let region = film.region;
        let piece = FilmPiece {
            region,
            reached: SampleProgress {
                pass: samples..samples,
                next: [region.x0, region.y0],
            },
            film: film.clone(),
        };
        pieces_file::write_piece(&mut file, &key, &piece, hits)?;
        Ok(())
    })?;
    file.flush()?;
    Ok(file.finish()?)
}

/// Returns the job and the header of a part.
///
/// # Errors
///
/// Files that are unreadable, damaged, truncated or not parts.
pub fn read_part(path: &Path) -> Result<(Identity, PartHeader), PartError> {
    let (_, header, part, _) = open(path)?;
    Ok((header.identity, part))
}

/// Reasons why parts cannot be merged.
#[derive(Debug, Error)]
pub enum PartError {
    /// A damaged file, or one that is not a part of this image.
    #[error("{}: {what}", path.display())]
    Bad {
        /// The file.
        path: PathBuf,
        /// The error.
        what: String,
    },
    /// Missing rows.
    #[error("{0}")]
    Gap(String),
}

/// All parts of an image.
#[derive(Debug)]
pub struct Parts {
    /// The job.
    pub identity: Identity,
    /// The header; all its fields except the tile are equal in all parts.
    pub header: PartHeader,
    /// Path of each part, and the key of the hashes of its pieces. Each read opens its file again, because the number
    /// of open files is limited.
    files: Vec<(PathBuf, Key)>,
    /// Each piece's file and entry, by first row.
    pieces: BTreeMap<u32, (usize, Entry)>,
}

impl Parts {
    /// Opens all parts of an image, listed in any order. Checks that the parts are complete, belong to one job, and
    /// cover every row exactly once. With `ignores_view`, the view settings of the parts may differ.
    ///
    /// # Errors
    ///
    /// [`PartError`].
    pub fn open(paths: &[PathBuf], ignores_view: bool) -> Result<Parts, PartError> {
        let mut parts: Option<Parts> = None;
        let mut tiles = Vec::new();
        for path in paths {
            let error = |what: String| PartError::Bad {
                path: path.clone(),
                what,
            };
            let (key, header, part, entries) = open(path)?;
            tiles.push(part.tile);
            let merged = parts.get_or_insert_with(|| Parts {
                identity: header.identity.clone(),
                header: part.clone(),
                files: Vec::new(),
                pieces: BTreeMap::new(),
            });
            let first_path = || merged.files.first().map_or(path, |(path, _)| path).display();
            if let Some(what) = merged.identity.difference(&header.identity) {
                return Err(error(format!(
                    "belongs to a different image than {}: {what}",
                    first_path()
                )));
            }
            if let Some(what) = merged.header.difference(&part, ignores_view) {
                return Err(error(format!("{what} than {}", first_path())));
            }
            for entry in entries {
                let Region { y0, y1, .. } = entry.region;
                let last_above = merged.pieces.range(..y1).next_back();
                if let Some((_, (number, overlapping))) = last_above.filter(|(_, (_, piece))| piece.region.y1 > y0) {
                    let first_row = y0.max(overlapping.region.y0);
                    let last_row = y1.min(overlapping.region.y1) - 1;
                    let other_file = merged.files.get(*number).map_or(path, |(path, _)| path).display();
                    return Err(error(format!(
                        "overlaps {other_file} in rows {first_row} to {last_row}"
                    )));
                }
                merged.pieces.insert(y0, (merged.files.len(), entry));
            }
            merged.files.push((path.clone(), key));
        }
        let parts = parts.ok_or_else(|| PartError::Gap("no parts to merge".to_owned()))?;
        match parts.gap() {
            None => Ok(parts),
            Some((first_row, last_row)) => Err(PartError::Gap(missing(first_row, last_row, &tiles))),
        }
    }

    fn gap(&self) -> Option<(u32, u32)> {
        let Region { y0, y1, .. } = self.identity.region();
        let mut next = y0;
        for (_, entry) in self.pieces.values() {
            if entry.region.y0 > next {
                return Some((next, entry.region.y0 - 1));
            }
            next = entry.region.y1;
        }
        (next < y1).then(|| (next, y1 - 1))
    }

    /// Returns the layout of the merged image, omitting names that this version does not know.
    pub fn layout(&self) -> Layout {
        let Identity {
            picture, pixel_samples, ..
        } = self.identity;
        let aov_named = |name: &String| Aov::ALL.into_iter().find(|aov| aov.name() == name);
        let transform = ViewTransform::ALL
            .into_iter()
            .find(|view| view.name() == self.header.view_transform);
        Layout {
            picture: picture.into(),
            region: self.identity.region(),
            aovs: self.header.aovs.iter().filter_map(aov_named).collect(),
            alpha: self.header.alpha,
            middle_depth: f32::from_bits(self.header.middle_depth),
            max_samples: pixel_samples,
            view: ViewSettings {
                transform: transform.unwrap_or_default(),
                exposure: f64::from_bits(self.header.exposure),
            },
        }
    }

    /// Returns the layout of the parts' films.
    pub fn film_layout(&self) -> FilmLayout {
        self.identity.film_layout()
    }

    /// Returns the metadata of the merged image.
    pub fn metadata(&self) -> Metadata {
        Metadata {
            pairs: self.header.metadata.clone(),
        }
    }

    /// Passes all pieces to a sink, from top to bottom.
    ///
    /// # Errors
    ///
    /// Errors of the sink, and unreadable files.
    pub fn read(&self, sink: &mut Sink) -> Result<(), RenderError> {
        let film_layout = self.identity.film_layout();
        for (number, entry) in self.pieces.values() {
            let Some((path, key)) = self.files.get(*number) else {
                continue;
            };
            let read = File::open(path).and_then(|file| pieces_file::read_piece(&file, key, entry, film_layout));
            let (piece, hits) = read.map_err(|error| {
                let message = format!("{}: cannot be read: {error}", path.display());
                RenderError::Input(io::Error::new(error.kind(), message))
            })?;
            sink(Band {
                film: &piece.film,
                hits: &hits,
            })?;
        }
        Ok(())
    }
}

/// Describes missing rows, and lists the missing parts if all files agree on the number of parts.
fn missing(first_row: u32, last_row: u32, tiles: &[Tile]) -> String {
    let rows = match first_row == last_row {
        true => format!("row {first_row} is missing"),
        false => format!("rows {first_row} to {last_row} are missing"),
    };
    let Some(count) = tiles
        .first()
        .map(|tile| tile.of)
        .filter(|count| tiles.iter().all(|tile| tile.of == *count))
    else {
        return rows;
    };
    const MAX_NAMES: usize = 20;
    let present: BTreeSet<u32> = tiles.iter().map(|tile| tile.number).collect();
    let absent = (1..=count).filter(|number| !present.contains(number));
    let mut names: Vec<String> = absent
        .take(MAX_NAMES + 1)
        .map(|number| Tile { number, of: count }.to_string())
        .collect();
    let dots = if names.len() > MAX_NAMES { " ..." } else { "" };
    names.truncate(MAX_NAMES);
    let listed = names.join(", ");
    format!("{rows}: add part {listed}{dots}")
}

fn open(path: &Path) -> Result<(Key, Header, PartHeader, Vec<Entry>), PartError> {
    let error = |what: String| PartError::Bad {
        path: path.to_owned(),
        what,
    };
    let io_error = |cause: io::Error| error(cause.to_string());
    blocking_path::reject(path).map_err(io_error)?;
    let mut file = File::open(path).map_err(io_error)?;
    let data = file.metadata().map_err(io_error)?;
    if !data.is_file() {
        let what = if data.is_dir() {
            "it is a directory"
        } else {
            "it is not a regular file; parts must be regular files, because they are read twice"
        };
        return Err(error(what.to_owned()));
    }
    let (header, key, start) = pieces_file::read_header(&mut file).map_err(io_error)?;
    let Some(part) = header.part.clone() else {
        let what = "is a checkpoint, not a part; wgray merge reads the files that wgray render --tile writes";
        return Err(error(what.to_owned()));
    };
    let contents = pieces_file::scan(&file, &header.identity, &key, start).map_err(io_error)?;
    part.check(&header.identity, &contents.entries).map_err(error)?;
    let rows = part.tile.rows(header.identity.region());
    let height: u64 = contents
        .entries
        .iter()
        .map(|entry| u64::from(entry.region.height()))
        .sum();
    let is_complete = rows.is_some_and(|rows| u64::from(rows.height()) == height);
    if contents.damaged > 0 || !is_complete {
        return Err(error(format!(
            "is damaged or truncated at byte {}; render part {} again",
            contents.end, part.tile
        )));
    }
    Ok((key, header, part, contents.entries))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use wgray_trace::film::{Film, FilmLayout};

    /// Returns the error of a part of 4 x 3 pixels with a modified header and piece, or an empty text.
    fn error_of(change: impl Fn(&mut Header, &mut FilmPiece)) -> String {
        let region = Region::whole(4, 3);
        let mut header = Header {
            format: FORMAT,
            identity: Identity {
                version: "1".to_owned(),
                shaders: String::new(),
                scene: String::new(),
                picture: [4, 3],
                region: [0, 0, 4, 3],
                pixel_samples: 16,
                adaptive: false,
                layers: false,
                noise: false,
                exact_rounding: false,
            },
            part: Some(PartHeader {
                tile: Tile { number: 1, of: 1 },
                aovs: Vec::new(),
                alpha: false,
                middle_depth: 1f32.to_bits(),
                view_transform: "gamma22".to_owned(),
                exposure: 0f64.to_bits(),
                metadata: Vec::new(),
            }),
        };
        let mut piece = FilmPiece {
            region,
            reached: SampleProgress {
                pass: 16..16,
                next: [0, 0],
            },
            film: Film::of(region, FilmLayout::default()),
        };
        change(&mut header, &mut piece);
        let mut bytes = Vec::new();
        let (key, _) = pieces_file::write_header(&mut bytes, &header).unwrap();
        pieces_file::write_piece(&mut bytes, &key, &piece, &[]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.part");
        fs::write(&path, bytes).unwrap();
        let name = format!("{}: ", path.display());
        match Parts::open(&[path], false) {
            Ok(_) => String::new(),
            Err(error) => error.to_string().replace(&name, ""),
        }
    }

    fn part(header: &mut Header) -> &mut PartHeader {
        header.part.as_mut().unwrap()
    }

    /// Files with correct hashes that the program never writes. A fuzzer found a panic for layers without values.
    #[test]
    fn parts_that_the_program_never_writes_are_rejected() {
        assert_eq!(error_of(|_, _| ()), "");
        for aov in ["normal", "shading_normal", "albedo", "variance", "sample_count"] {
            let message = error_of(|header, _| part(header).aovs = vec![aov.to_owned()]);
            assert_eq!(message, format!("has no values for its layer {aov}"));
        }
        assert_eq!(error_of(|header, _| part(header).aovs = vec!["other".to_owned()]), "");
        for (depth, exposure, expected) in [
            (f32::NAN, 0.0, "its depth, NaN, must be"),
            (0.0, 0.0, "its depth, 0, must be"),
            (1.0, f64::INFINITY, "its exposure "),
        ] {
            let message = error_of(|header, _| {
                part(header).middle_depth = depth.to_bits();
                part(header).exposure = exposure.to_bits();
            });
            assert!(message.starts_with(expected), "{message}");
        }
        let unfinished = error_of(|_, piece| piece.reached.pass = 8..16);
        assert_eq!(unfinished, "its piece of the pixels 0,0,4,3 is not finished");
        let rows = error_of(|_, piece| piece.region.y1 = 2);
        assert_eq!(rows, "its piece of the pixels 0,0,4,2 is not finished");
        let huge = error_of(|header, _| {
            header.identity.picture = [1, u32::MAX];
            header.identity.region = [0, 0, 1, u32::MAX];
            part(header).tile.of = u32::MAX;
        });
        assert_eq!(
            huge,
            "its image size, 1 x 4294967295, must be from 1 to 65536 pixels along each side"
        );
    }
}
