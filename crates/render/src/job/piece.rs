//! A piece of a picture: whole rows of it, as far as they are rendered, and what keeps pieces safe meanwhile.

use std::time::Duration;

use super::steps::Reached;
use crate::error::RenderError;
use crate::film::Film;
use wgray_image::Region;

/// Some rows of a picture, as far as they are rendered. It can be gone on from, on any backend, to the same bits.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Whole rows of the pixels that the job is for.
    pub region: Region,
    /// Which samples they have.
    pub reached: Reached,
    /// They, and as long as it is not finished the pixels around them that decide on their samples.
    pub film: Film,
}

/// A piece that is kept somewhere.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredPiece {
    /// What the store knows it by.
    pub number: usize,
    /// Its pixels.
    pub region: Region,
    /// The pixels of its film.
    pub film: Region,
    /// Which samples they have.
    pub reached: Reached,
}

/// What keeps pieces while others are rendered.
pub trait CheckpointStore {
    /// The pieces that it has, from the top. No two have a row in common.
    fn pieces(&self) -> Vec<StoredPiece>;

    /// One of its pieces.
    ///
    /// # Errors
    ///
    /// What cannot be read.
    fn load(&mut self, number: usize) -> Result<Piece, RenderError>;

    /// Keeps a piece, in place of one of the same rows. Where that fails the work goes on, and somebody is told.
    fn keep(&mut self, piece: &Piece);

    /// Makes sure that all kept so far outlives the machine.
    fn sync(&mut self);

    /// How often unfinished pieces are kept.
    fn interval(&self) -> Duration;

    /// Whether pieces should be small enough to be finished about as often.
    fn small_pieces(&self) -> bool;
}

/// Keeps nothing: what was rendered outlives a lost device, and not the program.
#[derive(Debug)]
pub struct NoCheckpoint;

/// How often unfinished pieces are kept, if nothing else is said.
pub const INTERVAL: Duration = Duration::from_secs(30);

impl CheckpointStore for NoCheckpoint {
    fn pieces(&self) -> Vec<StoredPiece> {
        Vec::new()
    }

    fn load(&mut self, _: usize) -> Result<Piece, RenderError> {
        Err(RenderError::NoFilm)
    }

    fn keep(&mut self, _: &Piece) {}

    fn sync(&mut self) {}

    fn interval(&self) -> Duration {
        INTERVAL
    }

    fn small_pieces(&self) -> bool {
        false
    }
}
