//! Watching the files of a session. An event only means "look again": what then counts is what the files say, so no
//! order or kind of events can lead astray. Folders are watched, not files, because editors save by rename.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode, EventKind, ModifyKind};
use notify::{RecommendedWatcher, RecursiveMode, Watcher as _};

use super::source::{Loaded, Snapshot, Sources, Stamp};

/// Files are read once nothing has happened to them for so long: an editor's save is several events.
const QUIET: Duration = Duration::from_millis(20);
/// Files are read after so long, even if something still happens to them.
const PATIENCE: Duration = Duration::from_millis(150);

/// A scene that is wrong is told of once nothing has happened to the files for so long: it may be half of one.
const DOUBT: Duration = Duration::from_millis(100);
/// Or after so long, even if something still happens.
const DOUBTS: Duration = Duration::from_secs(1);

/// What a session has written into the scene file itself: the watcher need not read that again.
#[derive(Default)]
pub struct Writes {
    /// How many there were.
    pub count: u64,
    /// What the scene is since the last one, and the files that it is made of, until the watcher has taken it over.
    pub known: Option<Known>,
}

/// A scene, and the state of its files.
pub type Known = (Arc<Loaded>, Vec<(PathBuf, Stamp)>);

/// What wakes the watcher.
enum Wake {
    /// The content of a file may have changed.
    Content,
    /// Files or folders may have come, gone or been renamed.
    Names,
    Stop,
}

impl Wake {
    fn from(event: &notify::Result<notify::Event>) -> Option<Wake> {
        match event.as_ref().map(|event| event.kind) {
            Ok(EventKind::Access(AccessKind::Close(AccessMode::Write)) | EventKind::Modify(ModifyKind::Data(_))) => {
                Some(Wake::Content)
            }
            Ok(EventKind::Access(_)) => None, // files are read all the time, by us too
            Ok(_) => Some(Wake::Names),
            Err(_) => Some(Wake::Names), // it may hide anything
        }
    }
}

/// A running watch; it ends when this is dropped.
pub struct Watch {
    stop: std::sync::mpsc::Sender<Wake>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Watch {
    /// Watches the files of `sources`, and gives `changed` every new state of them with the time at which a change was
    /// noticed, and the count of `writes` before it was read, until it returns false. `first` is the state that is known.
    pub fn start(
        sources: Sources,
        first: Snapshot,
        writes: Arc<Mutex<Writes>>,
        changed: impl FnMut(Snapshot, Instant, u64) -> bool + Send + 'static,
    ) -> notify::Result<Watch> {
        let (sender, receiver) = channel();
        let stop = sender.clone();
        let watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            if let Some(wake) = Wake::from(&event) {
                let _ = sender.send(wake); // nobody listens once the watch has ended
            }
        })?;
        let mut folders = Folders {
            watcher,
            watched: BTreeMap::new(),
        };
        folders.follow(&sources, &first);
        let thread = std::thread::Builder::new()
            .name("watch".to_string())
            .spawn(move || run(&receiver, &mut folders, &sources, first, &writes, changed))
            .map_err(notify::Error::io)?;
        Ok(Watch {
            stop,
            thread: Some(thread),
        })
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.stop.send(Wake::Stop); // it may have ended by itself
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
    mut changed: impl FnMut(Snapshot, Instant, u64) -> bool,
) {
    let mut again = None; // what woke us in doubt, and when the first change was noticed
    loop {
        let Some((wake, noticed)) = again.take().or_else(|| Some((wakes.recv().ok()?, Instant::now()))) else {
            return;
        };
        let woken = Instant::now();
        let mut next = Ok(wake);
        let mut names = false;
        loop {
            match next {
                Ok(Wake::Content) => {}
                Ok(Wake::Names) => names = true,
                Err(RecvTimeoutError::Timeout) => break,
                Ok(Wake::Stop) | Err(RecvTimeoutError::Disconnected) => return,
            }
            if woken.elapsed() > PATIENCE {
                break;
            }
            next = wakes.recv_timeout(QUIET);
        }
        if names {
            folders.forget(); // a folder made anew under an old name is another one
        }
        folders.follow(sources, &last);
        let count = {
            let mut writes = writes.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some((scene, files)) = writes.known.take() {
                (last.scene, last.files) = (Ok(scene), files);
            }
            writes.count
        };
        if let Some(new) = sources.reread(&last) {
            let is_doubtful = new.scene.is_err() && new.scene.as_ref().err() != last.scene.as_ref().err();
            if is_doubtful
                && noticed.elapsed() < DOUBTS
                && let Ok(wake) = wakes.recv_timeout(DOUBT)
            {
                again = Some((wake, noticed));
                continue;
            }
            // The scene may use other files now. They are stamped already: a change since then wakes us or shows here.
            folders.follow(sources, &new);
            last = new.clone();
            if !changed(new, noticed, count) {
                return;
            }
        }
    }
}

/// The folders that are watched.
struct Folders {
    watcher: RecommendedWatcher,
    watched: BTreeMap<PathBuf, RecursiveMode>,
}

impl Folders {
    /// Watches what must be watched now.
    fn follow(&mut self, sources: &Sources, snapshot: &Snapshot) {
        let wanted = wanted(sources, snapshot);
        self.watched.retain(|path, mode| {
            let keep = wanted.get(path) == Some(mode);
            if !keep {
                let _ = self.watcher.unwatch(path); // it may have gone with its folder
            }
            keep
        });
        for (path, mode) in wanted {
            if self.watched.contains_key(&path) {
                continue;
            }
            // One that vanishes just now is an event of its parent.
            match self.watcher.watch(&path, mode) {
                Ok(()) => drop(self.watched.insert(path, mode)),
                Err(error) => tracing::warn!("{} cannot be watched: {error}", path.display()),
            }
        }
    }

    fn forget(&mut self) {
        for path in std::mem::take(&mut self.watched).into_keys() {
            let _ = self.watcher.unwatch(&path); // it may have gone
        }
    }
}

/// The folders to watch, by their real names: that of the shaders with all below it, those of all files, and of what
/// links lead to. Of the scene's folder nothing below is watched: it may be a home folder.
fn wanted(sources: &Sources, snapshot: &Snapshot) -> BTreeMap<PathBuf, RecursiveMode> {
    let files = snapshot
        .files
        .iter()
        .map(|(path, _)| path.clone())
        .chain(sources.shader_files());
    // The shaders' folder may itself be renamed: its parent says so.
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

/// The nearest folder above a path that there is.
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
