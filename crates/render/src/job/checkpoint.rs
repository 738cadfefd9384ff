//! Checkpoints: a file that receives finished pieces of an image and, at intervals, the unfinished piece, so that an
//! interrupted job can be resumed. One process writes the file at a time; others wait.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;
use thiserror::Error;

use super::identity::Identity;
use super::piece::{CheckpointStore, FilmPiece, StoredPiece};
use super::pieces_file::{self, Entry, FORMAT, Header, Key};
use crate::error::RenderError;
use wgray_image::Output;
use wgray_trace::film::FilmLayout;

/// Reasons why a checkpoint cannot be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file exists, and resuming was not requested.
    #[error("{}: already exists; pass --resume to continue it, or choose another name", .0.display())]
    Exists(PathBuf),
    /// The checkpoint belongs to another job.
    #[error("{}: {what}; choose another name or delete it", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The difference.
        what: String,
    },
    /// The file is not a checkpoint that this program can read.
    #[error("{}: cannot resume from this file: {what}; choose another name or delete it", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error.
        what: String,
    },
    /// The caller stopped waiting for another process.
    #[error("{}: still in use by another process", .0.display())]
    Busy(PathBuf),
    /// The file cannot be read or written.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        error: io::Error,
    },
}

/// Options for opening a checkpoint.
pub struct CheckpointOptions<'a> {
    /// Path of the file, or of a folder with a file per job.
    pub path: PathBuf,
    /// Resume from an existing file.
    pub resume: bool,
    /// Interval between writes of the unfinished piece.
    pub interval: Duration,
    /// Called while another process writes the file; returns true to keep waiting.
    pub wait: Box<dyn FnMut() -> bool + 'a>,
    /// Receives messages about problems that do not stop the render.
    pub report: Box<dyn FnMut(&str) + 'a>,
}

/// An open checkpoint.
pub struct Checkpoint<'a> {
    /// Name in messages.
    name: PathBuf,
    path: PathBuf,
    file: File,
    header: Header,
    key: Key,
    film_layout: FilmLayout,
    entries: Vec<Entry>,
    /// Indices of the entries that no later entry replaces; the key is the first row of the piece.
    latest: BTreeMap<u32, usize>,
    /// End of the last complete piece.
    end: u64,
    interval: Duration,
    report: Box<dyn FnMut(&str) + 'a>,
    /// Minimum length of the file at which rewriting is tried again after a failure.
    retry_length: u64,
    /// First rows of pieces whose latest state could not be written.
    unsaved: BTreeSet<u32>,
    /// True for each problem that was already reported: [`WRITE_FAILED`], [`LOST`].
    reported: [bool; 2],
}

/// The file is rewritten once replaced pieces take this many bytes more than the pieces in use.
const MAX_REPLACED_BYTES: u64 = 64 << 20;
/// Interval between attempts to lock a file in use.
const RETRY_INTERVAL: Duration = Duration::from_millis(50);
/// Number of failed attempts after which the wait is reported.
const QUIET_RETRIES: u32 = 20;

/// Indices of problems.
const WRITE_FAILED: usize = 0;
const LOST: usize = 1;

impl<'a> Checkpoint<'a> {
    /// Creates a job's checkpoint, or resumes it once no other process writes it.
    ///
    /// # Errors
    ///
    /// [`CheckpointError`].
    pub fn open(
        options: CheckpointOptions<'a>,
        identity: Identity,
        film_layout: FilmLayout,
    ) -> Result<Checkpoint<'a>, CheckpointError> {
        let CheckpointOptions {
            path: name,
            resume,
            interval,
            mut wait,
            mut report,
        } = options;
        let name = match name.is_dir() {
            true => name.join(identity.file_name()),
            false => name,
        };
        let io_error = |error| CheckpointError::Io {
            path: name.clone(),
            error,
        };
        // Symbolic links are followed, and the links themselves are not replaced.
        let output = Output::find(&name).map_err(io_error)?;
        let not_a_file = || CheckpointError::Unreadable {
            path: name.clone(),
            what: "it is not a regular file".to_owned(),
        };
        let path = output.path().ok_or_else(not_a_file)?;
        let header = Header {
            format: FORMAT,
            identity,
            part: None,
        };
        let mut retries = 0;
        loop {
            match fs::metadata(path) {
                Ok(_) if !resume => return Err(CheckpointError::Exists(name)),
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    match create(path, &header) {
                        Ok((file, key, end)) => {
                            return Ok(Checkpoint {
                                name,
                                path: path.to_owned(),
                                file,
                                header,
                                key,
                                film_layout,
                                entries: Vec::new(),
                                latest: BTreeMap::new(),
                                end,
                                interval,
                                report,
                                retry_length: 0,
                                unsaved: BTreeSet::new(),
                                reported: [false; 2],
                            });
                        }
                        // Another process has created the file in the meantime.
                        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                        Err(error) => return Err(io_error(error)),
                    }
                }
                Err(error) => return Err(io_error(error)),
            }
            let file = match File::options().read(true).write(true).open(path) {
                Ok(file) => file,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(io_error(error)),
            };
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    // A killed process ends within a second, so a short wait is not reported.
                    retries += 1;
                    if retries == QUIET_RETRIES {
                        report(&format!(
                            "{}: in use by another process; waiting until it ends",
                            name.display()
                        ));
                    }
                    if !wait() {
                        return Err(CheckpointError::Busy(name));
                    }
                    std::thread::sleep(RETRY_INTERVAL);
                    continue;
                }
                // Some file systems have no locks.
                Err(TryLockError::Error(_)) | Ok(()) => {}
            }
            // The process with the lock may have replaced the file.
            if !is_file_at(&file, path) {
                continue;
            }
            return Checkpoint::continue_from(name, path, file, header, film_layout, interval, report);
        }
    }

    /// Returns true if the latest state of every piece is in the file.
    pub fn is_current(&self) -> bool {
        self.unsaved.is_empty() && !self.reported[LOST]
    }

    /// Returns the path of the checkpoint as in messages.
    pub fn name(&self) -> &Path {
        &self.name
    }

    fn continue_from(
        name: PathBuf,
        path: &Path,
        mut file: File,
        header: Header,
        film_layout: FilmLayout,
        interval: Duration,
        mut report: Box<dyn FnMut(&str) + 'a>,
    ) -> Result<Checkpoint<'a>, CheckpointError> {
        let unreadable = |error: io::Error| CheckpointError::Unreadable {
            path: name.clone(),
            what: error.to_string(),
        };
        let io_error = |error| CheckpointError::Io {
            path: name.clone(),
            error,
        };
        // Removes files of processes that were killed while they rewrote the checkpoint.
        wgray_image::remove_stale_beside(path);
        let (existing, key, header_end) = pieces_file::read_header(&mut file).map_err(unreadable)?;
        let difference = match existing.part {
            Some(_) => Some("is a part of an image, which wgray merge reads, and not a checkpoint".to_owned()),
            None => {
                (header.identity.difference(&existing.identity)).map(|what| format!("belongs to another job: {what}"))
            }
        };
        if let Some(what) = difference {
            return Err(CheckpointError::Foreign { path: name, what });
        }
        let contents = pieces_file::scan(&file, &header.identity, &key, header_end).map_err(io_error)?;
        if contents.damaged > 0 {
            report(&format!(
                "{}: the file is damaged or incomplete after byte {}; bytes dropped: {}",
                name.display(),
                contents.end,
                contents.damaged
            ));
            file.set_len(contents.end).map_err(io_error)?;
        }
        let latest = pieces_file::latest(&contents.entries);
        let latest = latest.into_iter().map(|i| (contents.entries[i].region.y0, i)).collect();
        Ok(Checkpoint {
            name,
            path: path.to_owned(),
            file,
            header: existing,
            key,
            film_layout,
            entries: contents.entries,
            latest,
            end: contents.end,
            interval,
            report,
            retry_length: 0,
            unsaved: BTreeSet::new(),
            reported: [false; 2],
        })
    }

    fn append(&mut self, piece: &FilmPiece) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.end))?;
        let mut out = BufWriter::with_capacity(1 << 20, &self.file);
        let bytes = pieces_file::write_piece(&mut out, &self.key, piece, &[])?;
        out.flush()?;
        drop(out);
        let entry = Entry::of(piece, self.end, bytes);
        self.end += bytes;
        let number = self.entries.len();
        self.entries.push(entry);
        pieces_file::replace(&mut self.latest, &self.entries, number, piece.region);
        Ok(())
    }

    /// Rewrites the file without replaced pieces if they exceed the pieces in use by [`MAX_REPLACED_BYTES`].
    fn remove_replaced_pieces(&mut self) {
        let lengths = self
            .latest
            .values()
            .map(|i| self.entries[*i].end - self.entries[*i].start);
        let needed: u64 = lengths.sum();
        let limit = (2 * needed + MAX_REPLACED_BYTES).max(self.retry_length);
        if self.end > limit && self.rewrite(|temporary, path| temporary.persist(path)).is_err() {
            // The disk may be full, or the file cannot be replaced. The old file stays in use; the next attempt is made
            // when the file has doubled in length.
            self.retry_length = 2 * self.end;
        }
    }

    /// Writes the pieces in use to a new file, and renames it into place.
    fn rewrite(
        &mut self,
        persist: impl Fn(NamedTempFile, &Path) -> Result<File, tempfile::PersistError>,
    ) -> io::Result<()> {
        let (mut temporary, key, mut end) = temporary(&self.path, &self.header)?;
        let mut entries = Vec::new();
        for i in self.latest.values() {
            let entry = &self.entries[*i];
            let bytes = entry.end - entry.start;
            self.file.seek(SeekFrom::Start(entry.start))?;
            io::copy(&mut io::Read::take(&self.file, bytes), temporary.as_file_mut())?;
            entries.push(Entry {
                start: end,
                end: end + bytes,
                ..entry.clone()
            });
            end += bytes;
        }
        temporary
            .as_file()
            .set_permissions(self.file.metadata()?.permissions())?;
        temporary.as_file().sync_data()?;
        self.file = persist(temporary, &self.path)?;
        self.latest = (0..).zip(&entries).map(|(i, entry)| (entry.region.y0, i)).collect();
        (self.entries, self.key, self.end) = (entries, key, end);
        Ok(())
    }

    /// Writes the file again if it was deleted. Keeps and reports a different file at the same path.
    fn restore_if_deleted(&mut self) -> io::Result<()> {
        if is_file_at(&self.file, &self.path) && self.file.metadata()?.len() >= self.end {
            return Ok(());
        }
        let is_gone = fs::symlink_metadata(&self.path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
        if is_gone
            && self
                .rewrite(|temporary, path| temporary.persist_noclobber(path))
                .is_ok()
        {
            return Ok(());
        }
        self.report_once(
            LOST,
            "was changed or replaced by another program; this render can no longer be resumed from it",
        );
        Ok(())
    }

    fn report_once(&mut self, problem: usize, message: &str) {
        if !std::mem::replace(&mut self.reported[problem], true) {
            (self.report)(&format!("{}: {message}", self.name.display()));
        }
    }

    /// Reports the first piece that could not be written. The caller continues with later pieces.
    fn report_failure(&mut self, result: io::Result<()>) {
        if let Err(error) = result {
            // Readers drop an incomplete piece, but the piece takes space.
            let _ = self.file.set_len(self.end);
            self.report_once(
                WRITE_FAILED,
                &format!("progress could not be saved: {error}; rendering continues"),
            );
        }
    }
}

impl CheckpointStore for Checkpoint<'_> {
    fn pieces(&self) -> Vec<StoredPiece> {
        let stored_piece = |i: &usize| {
            let entry = &self.entries[*i];
            StoredPiece {
                number: *i,
                region: entry.region,
                film: entry.film_region,
                reached: entry.reached.clone(),
            }
        };
        self.latest.values().map(stored_piece).collect()
    }

    fn load(&mut self, number: usize) -> Result<FilmPiece, RenderError> {
        let entry = self.entries.get(number).ok_or(RenderError::NoFilm)?;
        let read = pieces_file::read_piece(&self.file, &self.key, entry, self.film_layout);
        let with_path = |error: io::Error| {
            let message = format!("{}: cannot be read: {error}", self.name.display());
            RenderError::Input(io::Error::new(error.kind(), message))
        };
        Ok(read.map_err(with_path)?.0)
    }

    fn keep(&mut self, piece: &FilmPiece) {
        let result = self.append(piece);
        match result {
            Ok(()) => self.unsaved.remove(&piece.region.y0),
            Err(_) => self.unsaved.insert(piece.region.y0),
        };
        self.report_failure(result);
    }

    fn sync(&mut self) {
        let result = self.file.sync_data().and_then(|()| self.restore_if_deleted());
        self.remove_replaced_pieces();
        self.report_failure(result);
    }

    fn interval(&self) -> Duration {
        self.interval
    }

    fn small_pieces(&self) -> bool {
        true
    }
}

/// Creates the file. When the file appears, it is locked and has a complete header.
fn create(path: &Path, header: &Header) -> io::Result<(File, Key, u64)> {
    let (temporary, key, end) = temporary(path, header)?;
    temporary.as_file().sync_data()?;
    let file = temporary.persist_noclobber(path).map_err(|error| error.error)?;
    Ok((file, key, end))
}

fn temporary(path: &Path, header: &Header) -> io::Result<(NamedTempFile, Key, u64)> {
    let mut temporary = wgray_image::create_beside(path)?;
    let (key, end) = pieces_file::write_header(temporary.as_file_mut(), header)?;
    Ok((temporary, key, end))
}

/// Returns true if a path refers to this open file.
fn is_file_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        match (file.metadata(), fs::metadata(path)) {
            (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
            _ => false,
        }
    }
    #[cfg(not(unix))]
    {
        // Other systems do not replace open files.
        let _ = (file, path);
        true
    }
}
