//! A checkpoint: a file that gets every finished piece of a picture, and now and then the one that is being rendered, so that
//! a job that ended early can go on. One process writes it at a time; others wait.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;
use thiserror::Error;

use super::identity::Identity;
use super::piece::{CheckpointStore, Piece, StoredPiece};
use super::pieces_file::{self, Entry, FORMAT, Header, Key};
use crate::error::RenderError;
use crate::film::Form;
use crate::image::Output;

/// Why a checkpoint cannot be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// There is one, and nobody asked to go on from it.
    #[error("{}: is there already; --resume goes on from it, another name starts anew", .0.display())]
    Exists(PathBuf),
    /// It is of another job.
    #[error("{}: is of {what}; choose another name, or remove it", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is of.
        what: String,
    },
    /// It is no checkpoint that this program can read.
    #[error("{}: cannot be gone on from: {what}; choose another name, or remove it", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// Somebody gave up waiting for the process that writes it.
    #[error("{}: another process writes it still", .0.display())]
    Busy(PathBuf),
    /// It cannot be read or written.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// How a checkpoint is opened.
pub struct Opening<'a> {
    /// Where it is; in a folder each job has one of its own.
    pub path: PathBuf,
    /// Whether to go on from one that is there.
    pub resume: bool,
    /// How often the piece that is being rendered is written.
    pub interval: Duration,
    /// Called now and then while another process writes it: whether to wait on.
    pub wait: Box<dyn FnMut() -> bool + 'a>,
    /// RenderMetadata what went wrong where the work goes on.
    pub tell: Box<dyn FnMut(&str) + 'a>,
}

/// An open checkpoint.
pub struct Checkpoint<'a> {
    /// What messages call it.
    name: PathBuf,
    path: PathBuf,
    file: File,
    header: Header,
    key: Key,
    form: Form,
    entries: Vec<Entry>,
    /// By their first rows, the pieces that no later one stands in for.
    latest: BTreeMap<u32, usize>,
    /// One past the last whole piece.
    end: u64,
    interval: Duration,
    tell: Box<dyn FnMut(&str) + 'a>,
    /// The length up to which the file is not written anew, after that has failed.
    untidy: u64,
    /// Whether somebody was told that pieces could not be written, and that the file has gone.
    told: [bool; 2],
}

/// What is no longer needed of a file is left in it until it is more than what is, and more than this.
const WASTE: u64 = 64 << 20;
/// How long to wait between two looks at a file that another process writes.
const PATIENCE: Duration = Duration::from_millis(50);
/// So many looks are made before somebody is told.
const MOMENT: u32 = 20;

impl<'a> Checkpoint<'a> {
    /// Starts a checkpoint of a job, or goes on with one that is there, once no other process writes it.
    ///
    /// # Errors
    ///
    /// [`CheckpointError`].
    pub fn open(opening: Opening<'a>, identity: Identity, form: Form) -> Result<Checkpoint<'a>, CheckpointError> {
        let Opening {
            path: name,
            resume,
            interval,
            mut wait,
            mut tell,
        } = opening;
        let name = match name.is_dir() {
            true => name.join(identity.file_name()),
            false => name,
        };
        let failed = |error| CheckpointError::Io {
            path: name.clone(),
            error,
        };
        // Links stay: what they lead to is the file.
        let found = Output::find(&name).map_err(failed)?;
        let no_file = || CheckpointError::Unreadable {
            path: name.clone(),
            what: "it is no file".to_owned(),
        };
        let path = found.path().ok_or_else(no_file)?;
        let header = Header {
            format: FORMAT,
            identity,
            part: None,
        };
        let mut rounds = 0;
        loop {
            match fs::metadata(path) {
                Ok(_) if !resume => return Err(CheckpointError::Exists(name)),
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    match start(path, &header) {
                        Ok((file, key, end)) => {
                            return Ok(Checkpoint {
                                name,
                                path: path.to_owned(),
                                file,
                                header,
                                key,
                                form,
                                entries: Vec::new(),
                                latest: BTreeMap::new(),
                                end,
                                interval,
                                tell,
                                untidy: 0,
                                told: [false; 2],
                            });
                        }
                        // Somebody else was faster.
                        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                        Err(error) => return Err(failed(error)),
                    }
                }
                Err(error) => return Err(failed(error)),
            }
            let file = match File::options().read(true).write(true).open(path) {
                Ok(file) => file,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(failed(error)),
            };
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    // A process that is just being killed is gone in a moment.
                    rounds += 1;
                    if rounds == MOMENT {
                        tell(&format!(
                            "{}: another process writes it; waiting for its end",
                            name.display()
                        ));
                    }
                    if !wait() {
                        return Err(CheckpointError::Busy(name));
                    }
                    std::thread::sleep(PATIENCE);
                    continue;
                }
                // Some file systems have no locks.
                Err(TryLockError::Error(_)) | Ok(()) => {}
            }
            // Whoever had the lock may have put another file in its place.
            if !is_at(&file, path) {
                continue;
            }
            return Checkpoint::go_on(name, path, file, header, form, interval, tell);
        }
    }

    /// What messages call it.
    pub fn name(&self) -> &Path {
        &self.name
    }

    fn go_on(
        name: PathBuf,
        path: &Path,
        mut file: File,
        header: Header,
        form: Form,
        interval: Duration,
        mut tell: Box<dyn FnMut(&str) + 'a>,
    ) -> Result<Checkpoint<'a>, CheckpointError> {
        let unreadable = |error: io::Error| CheckpointError::Unreadable {
            path: name.clone(),
            what: error.to_string(),
        };
        let failed = |error| CheckpointError::Io {
            path: name.clone(),
            error,
        };
        // A process that was killed while it wrote the file anew.
        crate::image::remove_stale_beside(path);
        let (found, key, start) = pieces_file::read_header(&mut file).map_err(unreadable)?;
        let what = match found.part {
            Some(_) => Some("a part of a picture, which wgray merge takes".to_owned()),
            None => header.identity.difference(&found.identity),
        };
        if let Some(what) = what {
            return Err(CheckpointError::Foreign { path: name, what });
        }
        let contents = pieces_file::scan(&file, &header.identity, &key, start).map_err(failed)?;
        if contents.damaged > 0 {
            tell(&format!(
                "{}: {} bytes from byte {} on are damaged, or were not written to their end; they are dropped",
                name.display(),
                contents.damaged,
                contents.end
            ));
            file.set_len(contents.end).map_err(failed)?;
        }
        let latest = pieces_file::latest(&contents.entries);
        let latest = latest.into_iter().map(|i| (contents.entries[i].region.y0, i)).collect();
        Ok(Checkpoint {
            name,
            path: path.to_owned(),
            file,
            header: found,
            key,
            form,
            entries: contents.entries,
            latest,
            end: contents.end,
            interval,
            tell,
            untidy: 0,
            told: [false; 2],
        })
    }

    fn append(&mut self, piece: &Piece) -> io::Result<()> {
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

    /// Writes the file anew without the pieces that later ones stand in for, where these are the greater part.
    fn tidy(&mut self) {
        let lengths = self
            .latest
            .values()
            .map(|i| self.entries[*i].end - self.entries[*i].start);
        let needed: u64 = lengths.sum();
        let bound = (2 * needed + WASTE).max(self.untidy);
        if self.end > bound && self.write_anew(|temporary, path| temporary.persist(path)).is_err() {
            // There is no room for both, or the file must stay the same one. Nothing is lost; it is tried again later.
            self.untidy = 2 * self.end;
        }
    }

    /// Writes the file anew, with the pieces that are needed, and gives it its name.
    fn write_anew(
        &mut self,
        name: impl Fn(NamedTempFile, &Path) -> Result<File, tempfile::PersistError>,
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
        self.file = name(temporary, &self.path)?;
        self.latest = (0..).zip(&entries).map(|(i, entry)| (entry.region.y0, i)).collect();
        (self.entries, self.key, self.end) = (entries, key, end);
        Ok(())
    }

    /// Puts the file back where somebody has removed it; where there is another one, that stays, and somebody is told.
    fn still_there(&mut self) -> io::Result<()> {
        if is_at(&self.file, &self.path) && self.file.metadata()?.len() >= self.end {
            return Ok(());
        }
        let is_gone = fs::symlink_metadata(&self.path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
        if is_gone
            && self
                .write_anew(|temporary, path| temporary.persist_noclobber(path))
                .is_ok()
        {
            return Ok(());
        }
        self.tell_once(
            1,
            "is changed or replaced by somebody else: what this render keeps is lost with it",
        );
        Ok(())
    }

    fn tell_once(&mut self, which: usize, what: &str) {
        if !std::mem::replace(&mut self.told[which], true) {
            (self.tell)(&format!("{}: {what}", self.name.display()));
        }
    }

    /// Tells of a piece that could not be written; not of each, as the next ones are tried too.
    fn noted(&mut self, result: io::Result<()>) {
        if let Err(error) = result {
            // Half a piece at the end would be dropped when the file is read; it may fill the disk until then.
            let _ = self.file.set_len(self.end);
            self.tell_once(0, &format!("a piece could not be written, the work goes on: {error}"));
        }
    }
}

impl CheckpointStore for Checkpoint<'_> {
    fn pieces(&self) -> Vec<StoredPiece> {
        let kept = |i: &usize| {
            let entry = &self.entries[*i];
            StoredPiece {
                number: *i,
                region: entry.region,
                film: entry.film,
                reached: entry.reached.clone(),
            }
        };
        self.latest.values().map(kept).collect()
    }

    fn load(&mut self, number: usize) -> Result<Piece, RenderError> {
        let entry = self.entries.get(number).ok_or(RenderError::NoFilm)?;
        let read = pieces_file::read_piece(&self.file, &self.key, entry, self.form);
        let named = |error: io::Error| {
            let message = format!("{}: cannot be read: {error}", self.name.display());
            RenderError::Input(io::Error::new(error.kind(), message))
        };
        Ok(read.map_err(named)?.0)
    }

    fn keep(&mut self, piece: &Piece) {
        let result = self.append(piece);
        self.noted(result);
    }

    fn sync(&mut self) {
        let result = self.file.sync_data().and_then(|()| self.still_there());
        self.tidy();
        self.noted(result);
    }

    fn interval(&self) -> Duration {
        self.interval
    }

    fn small_pieces(&self) -> bool {
        true
    }
}

/// Starts the file where there is none: with its whole header, and locked, from the moment that it is there.
fn start(path: &Path, header: &Header) -> io::Result<(File, Key, u64)> {
    let (temporary, key, end) = temporary(path, header)?;
    temporary.as_file().sync_data()?;
    let file = temporary.persist_noclobber(path).map_err(|error| error.error)?;
    Ok((file, key, end))
}

/// A file beside another one, locked, with a header.
fn temporary(path: &Path, header: &Header) -> io::Result<(NamedTempFile, Key, u64)> {
    let mut temporary = crate::image::beside(path)?;
    let (key, end) = pieces_file::write_header(temporary.as_file_mut(), header)?;
    Ok((temporary, key, end))
}

/// Whether a path leads to an open file.
fn is_at(file: &File, path: &Path) -> bool {
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
        // A file that is open cannot be replaced there.
        let _ = (file, path);
        true
    }
}
