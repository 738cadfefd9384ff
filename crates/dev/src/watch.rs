//! Watches the files of a session. After an event, the files are read, because only their content shows what changed.
//! Folders are watched instead of files, because editors save by rename.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode, EventKind, ModifyKind};
use notify::{RecommendedWatcher, RecursiveMode, Watcher as _};

use super::messages::Event;
use super::source::{FileStamp, Loaded, Snapshot, Sources};

/// Files are read after this time without a change, because saving in an editor causes several events.
const SETTLE_TIME: Duration = Duration::from_millis(20);
/// Maximum delay of reading while files keep changing.
const MAX_SETTLE_TIME: Duration = Duration::from_millis(150);

/// An error in the scene is reported after this time without a change, because the scene file may be incomplete.
const ERROR_DELAY: Duration = Duration::from_millis(100);
/// Maximum delay of an error while files keep changing.
const MAX_ERROR_DELAY: Duration = Duration::from_secs(1);

/// Incomplete or large models, meshes and textures are read after this time without a change, because a program may
/// still be writing the files.
const WRITE_SETTLE_TIME: Duration = Duration::from_millis(300);
/// Maximum delay of reading such files while they keep changing.
const MAX_WRITE_SETTLE_TIME: Duration = Duration::from_secs(10);
/// Minimum total size in bytes at which models, meshes and textures count as large.
const LARGE_BYTES: u64 = 1 << 20;

/// Changes of the scene file that this session made and that need not be read again.
#[derive(Default)]
pub struct Writes {
    pub count: u64,
    /// The scene after the last change, and its files, until the watcher uses them as its last state.
    pub written_scene: Option<WrittenScene>,
}

pub type WrittenScene = (Arc<Loaded>, Vec<(PathBuf, FileStamp)>);

enum Wake {
    /// The content of a file may have changed.
    Content,
    /// Files or folders may have been created, deleted or renamed.
    Names,
    Stop,
}

impl Wake {
    fn from(event: &notify::Result<notify::Event>) -> Option<Wake> {
        match event.as_ref().map(|event| event.kind) {
            Ok(EventKind::Access(AccessKind::Close(AccessMode::Write)) | EventKind::Modify(ModifyKind::Data(_))) => {
                Some(Wake::Content)
            }
            Ok(EventKind::Access(_)) => None, // reading, for example by this program
            Ok(_) => Some(Wake::Names),
            Err(_) => Some(Wake::Names), // any change may have been missed
        }
    }
}

/// A running watch; ends when dropped.
pub struct Watch {
    stop: std::sync::mpsc::Sender<Wake>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Watch {
    /// Reads the files, then reports [`Event::Reading`] and [`Event::Files`] until `report` returns false.
    pub fn start(
        sources: Sources,
        writes: Arc<Mutex<Writes>>,
        mut report: impl FnMut(Event) -> bool + Send + 'static,
    ) -> notify::Result<Watch> {
        let (sender, receiver) = channel();
        let stop = sender.clone();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            if let Some(wake) = Wake::from(&event) {
                let _ = sender.send(wake); // fails only after the end of the watch
            }
        })?;
        let mut folders = Folders {
            watcher,
            watched: BTreeMap::new(),
        };
        let started = Instant::now();
        let thread = std::thread::Builder::new()
            .name("watch".to_string())
            .spawn(move || {
                let first = sources.read();
                let session_runs = report(Event::Files(Box::new(first.clone()), started, 0));
                folders.follow(&sources, &first);
                if session_runs {
                    run(&receiver, &mut folders, &sources, first, &writes, report);
                }
            })
            .map_err(notify::Error::io)?;
        Ok(Watch {
            stop,
            thread: Some(thread),
        })
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.stop.send(Wake::Stop); // the thread may have ended already
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(
    wakes: &Receiver<Wake>,
    folders: &mut Folders,
    sources: &Sources,
    mut last: Snapshot,
    writes: &Mutex<Writes>,
    mut report: impl FnMut(Event) -> bool,
) {
    let mut reading_reported = false; // true between reports of the start and the end of reading
    // The event during a possibly incomplete save, and the time of the save's first change. The initial value starts a
    // comparison with the states at the start, because the files were not watched while they were read.
    let mut deferred = Some((Wake::Content, Instant::now()));
    let mut has_errors = last.scene.is_err(); // whether the last scene that was read has errors, reported or not
    loop {
        let Some((wake, noticed_at)) = deferred.take().or_else(|| Some((wakes.recv().ok()?, Instant::now()))) else {
            return;
        };
        let woken = Instant::now();
        let mut next = Ok(wake);
        let mut names_changed = false;
        loop {
            match next {
                Ok(Wake::Content) => {}
                Ok(Wake::Names) => names_changed = true,
                Err(RecvTimeoutError::Timeout) => break,
                Ok(Wake::Stop) | Err(RecvTimeoutError::Disconnected) => return,
            }
            if woken.elapsed() > MAX_SETTLE_TIME {
                break;
            }
            next = wakes.recv_timeout(SETTLE_TIME);
        }
        let mut begin = || {
            reading_reported = reading_reported || report(Event::Reading(true));
        };
        let [old, new] = sources.assets(&last);
        let is_large = new.iter().map(FileStamp::size).sum::<u64>() >= LARGE_BYTES;
        let is_growing = old != new && (has_errors || is_large);
        if is_growing {
            begin();
            match wait_settled(wakes, new, || {
                let [_, current] = sources.assets(&last);
                current
            }) {
                Some(changed) => names_changed |= changed,
                None => return,
            }
        }
        if names_changed {
            folders.forget(); // a folder may have been replaced by a new folder of the same name
        }
        folders.follow(sources, &last);
        let count = {
            let mut writes = writes.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some((scene, files)) = writes.written_scene.take() {
                (last.scene, last.files) = (Ok(scene), files);
            }
            writes.count
        };
        if let Some(new) = sources.reread(&last, &mut begin) {
            has_errors = new.scene.is_err();
            let is_new_error = new.scene.is_err() && new.scene.as_ref().err() != last.scene.as_ref().err();
            if is_new_error
                && noticed_at.elapsed() < MAX_ERROR_DELAY
                && let Ok(wake) = wakes.recv_timeout(if is_growing { WRITE_SETTLE_TIME } else { ERROR_DELAY })
            {
                deferred = Some((wake, noticed_at));
                continue;
            }
            // The scene may now use files in other folders.
            folders.follow(sources, &new);
            last = new.clone();
            reading_reported = false;
            if !report(Event::Files(Box::new(new), noticed_at, count)) {
                return;
            }
        } else if std::mem::take(&mut reading_reported) && !report(Event::Reading(false)) {
            return;
        }
    }
}

/// Waits until files are unchanged for [`WRITE_SETTLE_TIME`]. Returns whether file names may have changed; `None` if
/// the watch ends.
fn wait_settled(wakes: &Receiver<Wake>, mut old: Vec<FileStamp>, stamps: impl Fn() -> Vec<FileStamp>) -> Option<bool> {
    let start = Instant::now();
    let (mut last_change, mut names_changed) = (start, false);
    loop {
        match wakes.recv_timeout(WRITE_SETTLE_TIME.saturating_sub(last_change.elapsed())) {
            Ok(Wake::Stop) | Err(RecvTimeoutError::Disconnected) => return None,
            Ok(Wake::Names) => names_changed = true,
            Ok(Wake::Content) | Err(RecvTimeoutError::Timeout) => {}
        }
        // An event may come from a different file in these folders, so the states are compared.
        let new = stamps();
        if new != old {
            (old, last_change) = (new, Instant::now());
        } else if last_change.elapsed() >= WRITE_SETTLE_TIME {
            return Some(names_changed);
        }
        if start.elapsed() >= MAX_WRITE_SETTLE_TIME {
            return Some(names_changed);
        }
    }
}

struct Folders {
    watcher: RecommendedWatcher,
    watched: BTreeMap<PathBuf, RecursiveMode>,
}

impl Folders {
    fn follow(&mut self, sources: &Sources, snapshot: &Snapshot) {
        let folders = folders_to_watch(sources, snapshot);
        self.watched.retain(|path, mode| {
            let keep = folders.get(path) == Some(mode);
            if !keep {
                let _ = self.watcher.unwatch(path); // fails if the folder was deleted
            }
            keep
        });
        for (path, mode) in folders {
            if self.watched.contains_key(&path) {
                continue;
            }
            // If the folder is deleted at this moment, its parent folder reports an event.
            match self.watcher.watch(&path, mode) {
                Ok(()) => drop(self.watched.insert(path, mode)),
                Err(error) => tracing::warn!("{} cannot be watched: {error}", path.display()),
            }
        }
    }

    fn forget(&mut self) {
        for path in std::mem::take(&mut self.watched).into_keys() {
            let _ = self.watcher.unwatch(&path); // fails if the folder was deleted
        }
    }
}

/// Returns the folders to watch, by canonical path: the shader folder including its subfolders, and the folders of all
/// files and link targets. Subfolders of the scene's folder are not watched, because this folder may be a home folder.
fn folders_to_watch(sources: &Sources, snapshot: &Snapshot) -> BTreeMap<PathBuf, RecursiveMode> {
    let files = snapshot
        .files
        .iter()
        .map(|(path, _)| path.clone())
        .chain(sources.shader_files());
    // The parent of the shader folder is also watched, to detect a rename of the shader folder.
    let paths = files.chain(sources.shaders.clone());
    let paths = paths
        .flat_map(|path| [fs::canonicalize(&path).ok(), Some(path)])
        .flatten();
    let mut folders: BTreeMap<_, _> = paths
        .filter_map(existing_parent)
        .map(|folder| (folder, RecursiveMode::NonRecursive))
        .collect();
    if let Some(shaders) = sources
        .shaders
        .as_ref()
        .and_then(|folder| fs::canonicalize(folder).ok())
    {
        folders.retain(|folder, _| !folder.starts_with(&shaders));
        folders.insert(shaders, RecursiveMode::Recursive);
    }
    folders
}

/// Returns the nearest existing folder above a path.
fn existing_parent(mut path: PathBuf) -> Option<PathBuf> {
    while path.pop() {
        let folder = if path.as_os_str().is_empty() {
            fs::canonicalize(".")
        } else {
            fs::canonicalize(&path)
        };
        if let Ok(folder) = folder {
            return Some(folder);
        }
    }
    None
}
