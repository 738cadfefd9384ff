//! Pieces of an image, finished or not, and the interface of checkpoint stores.

use std::time::Duration;

use super::steps::SampleProgress;
use crate::error::RenderError;
use crate::film::Film;
use wgray_image::Region;

/// Rows of an image with their samples so far. Any backend can continue the piece and gives the same bits.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmPiece {
    /// Whole rows of the job's region.
    pub region: Region,
    /// Samples of the film's pixels.
    pub reached: SampleProgress,
    /// Film of the region; if unfinished, with the neighbors that determine its sample counts.
    pub film: Film,
}

/// A piece in a store.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredPiece {
    /// Key for [`CheckpointStore::load`].
    pub number: usize,
    /// Rows of the piece.
    pub region: Region,
    /// Region of its film.
    pub film: Region,
    /// Samples of the film's pixels.
    pub reached: SampleProgress,
}

/// Storage of pieces while others are rendered.
pub trait CheckpointStore {
    /// Returns the pieces, which share no rows, from top to bottom.
    fn pieces(&self) -> Vec<StoredPiece>;

    /// Loads a piece.
    ///
    /// # Errors
    ///
    /// Unreadable pieces.
    fn load(&mut self, number: usize) -> Result<FilmPiece, RenderError>;

    /// Stores a piece, replacing earlier pieces of the same rows. Reports a failure without stopping the work.
    fn keep(&mut self, piece: &FilmPiece);

    /// Flushes all stored pieces to the disk.
    fn sync(&mut self);

    /// Interval between checkpoints of unfinished pieces.
    fn interval(&self) -> Duration;

    /// Returns true if rendering a piece should take about one interval.
    fn small_pieces(&self) -> bool;
}

/// Stores nothing: the work survives a lost device, but not the end of the process.
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
