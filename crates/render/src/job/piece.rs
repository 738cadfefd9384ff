//! Pieces of an image, finished or not, and the interface of checkpoint stores.

use std::time::Duration;

use super::steps::SampleProgress;
use crate::error::RenderError;
use wgray_image::Region;
use wgray_trace::film::Film;

/// Rows of an image with the samples rendered so far. Any backend can continue a piece, and gives the same bits.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmPiece {
    /// Whole rows of the job's region.
    pub region: Region,
    /// Samples that the film's pixels have so far.
    pub reached: SampleProgress,
    /// Film of the region; if unfinished, with the neighbors that determine its sample counts.
    pub film: Film,
}

impl FilmPiece {
    /// Returns the number of samples over all pixels so far; with adaptive sampling, as if no pixel skipped samples.
    pub fn requested_rays(&self) -> u64 {
        let region = self.region;
        let SampleProgress { pass, next: [x, y] } = &self.reached;
        let (rows, columns) = (
            u64::from(y.saturating_sub(region.y0)),
            u64::from(x.saturating_sub(region.x0)),
        );
        let ahead = (rows * u64::from(region.width()) + columns).min(region.pixels());
        region.pixels() * u64::from(pass.start) + ahead * pass.len() as u64
    }
}

/// Description of a piece in a store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredPiece {
    /// Key for [`CheckpointStore::load`].
    pub number: usize,
    /// Rows of the piece.
    pub region: Region,
    /// Region of the piece's film.
    pub film: Region,
    /// Samples that the film's pixels have so far.
    pub reached: SampleProgress,
}

/// Storage of rendered pieces.
pub trait CheckpointStore {
    /// Returns the pieces, which share no rows, from top to bottom.
    fn pieces(&self) -> Vec<StoredPiece>;

    /// Loads a piece.
    ///
    /// # Errors
    ///
    /// The piece cannot be read.
    fn load(&mut self, number: usize) -> Result<FilmPiece, RenderError>;

    /// Stores a piece, replacing earlier pieces of the same rows. Reports a failure without stopping the render.
    fn keep(&mut self, piece: &FilmPiece);

    /// Flushes all stored pieces to the disk.
    fn sync(&mut self);

    /// Interval between checkpoints of unfinished pieces.
    fn interval(&self) -> Duration;

    /// Returns true if rendering a piece should take about one interval.
    fn small_pieces(&self) -> bool;
}

impl<T: CheckpointStore + ?Sized> CheckpointStore for &mut T {
    fn pieces(&self) -> Vec<StoredPiece> {
        (**self).pieces()
    }

    fn load(&mut self, number: usize) -> Result<FilmPiece, RenderError> {
        (**self).load(number)
    }

    fn keep(&mut self, piece: &FilmPiece) {
        (**self).keep(piece);
    }

    fn sync(&mut self) {
        (**self).sync();
    }

    fn interval(&self) -> Duration {
        (**self).interval()
    }

    fn small_pieces(&self) -> bool {
        (**self).small_pieces()
    }
}

/// A store that keeps nothing. A render survives the loss of a device, but not the end of the process.
#[derive(Debug)]
pub struct NoCheckpoint;

/// Default interval between checkpoints.
pub const INTERVAL: Duration = Duration::from_secs(30);

impl CheckpointStore for NoCheckpoint {
    fn pieces(&self) -> Vec<StoredPiece> {
        Vec::new()
    }

    fn load(&mut self, _: usize) -> Result<FilmPiece, RenderError> {
        Err(RenderError::NoFilm)
    }

    fn keep(&mut self, _: &FilmPiece) {}

    fn sync(&mut self) {}

    fn interval(&self) -> Duration {
        INTERVAL
    }

    fn small_pieces(&self) -> bool {
        false
    }
}
