//! A session: the files of a scene, watched and rendered by a thread of their own.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use tokio::sync::watch;

use super::build::Builder;
use super::messages::{Command, Event, Report, State};
use super::object::Seen;
use super::painter::{Painter, Told};
use super::picture::Frame;
use super::reference::Reference;
use super::source::Sources;
use super::times::Times;
use super::watch::Watch;
use crate::error::RenderError;
use crate::gpu::{Choice, choose};

/// What a session is told at its start.
pub struct Settings {
    /// The files.
    pub sources: Sources,
    /// What renders.
    pub device: Choice,
    /// A PNG file that is replaced after each reload.
    pub out: Option<PathBuf>,
    /// Whether nothing is rendered while nobody looks ([`Session::viewers`]) and there is no `out`.
    pub only_for_viewers: bool,
    /// The form of links that open an editor; none for no such links.
    pub editor: Option<String>,
    /// Is told what happens, for the terminal.
    pub report: Box<dyn Fn(Report) + Send>,
}

/// So many events may wait for one call to end.
const WAITING: usize = 256;

/// A running session; it ends when this is dropped.
pub struct Session {
    events: SyncSender<Event>,
    /// How many commands were given.
    asked: Arc<Mutex<u64>>,
    /// What is known.
    pub state: watch::Receiver<Arc<State>>,
    /// The newest picture, once there is one. A slow reader misses some.
    pub frames: watch::Receiver<Option<Arc<Frame>>>,
    /// Where the time goes.
    pub times: Times,
    /// The scene and how it is looked at, once there is one.
    pub seen: watch::Receiver<Option<Arc<Seen>>>,
    viewers: Viewers,
    watch: Option<Watch>,
    thread: Option<JoinHandle<()>>,
}

/// Counts those who look.
#[derive(Clone)]
pub struct Viewers {
    looking: Arc<AtomicUsize>,
    events: SyncSender<Event>,
}

/// Someone who looks, until this is dropped.
pub struct Viewer(Viewers);

impl Viewers {
    /// One more looks.
    pub fn enter(&self) -> Viewer {
        self.looking.fetch_add(1, Ordering::SeqCst);
        let _ = self.events.try_send(Event::Viewers); // a full inbox wakes the painter too
        Viewer(self.clone())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.0.looking.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Why there is no session.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// There is no scene file.
    #[error("{0}: cannot be read: {1}")]
    NoScene(PathBuf, std::io::Error),
    /// No device.
    #[error(transparent)]
    Device(#[from] RenderError),
    /// The system does not let files be watched.
    #[error("files cannot be watched: {0}")]
    Watch(#[from] notify::Error),
    /// The system gives no thread.
    #[error(transparent)]
    System(#[from] std::io::Error),
}

impl Session {
    /// Opens the device, reads the files and starts to render. Errors in the files are told, and waited for to be mended.
    ///
    /// # Errors
    ///
    /// No device, a scene file that does not exist, and what the system does not allow.
    pub fn start(settings: Settings) -> Result<Session, StartError> {
        let Settings {
            sources,
            device: choice,
            out,
            only_for_viewers,
            editor,
            report,
        } = settings;
        std::fs::metadata(&sources.scene).map_err(|error| StartError::NoScene(sources.scene.clone(), error))?;
        let device = choose(&choice)?;
        let snapshot = sources.read();
        let (events, inbox) = sync_channel(WAITING);
        let started = Instant::now();
        let first = Event::Files(Box::new(snapshot.clone()), started, 0);
        let _ = events.send(first); // the inbox is here
        let writes = Arc::default();
        let watch = Watch::start(sources.clone(), snapshot, Arc::clone(&writes), {
            let events = events.clone();
            move |snapshot, noticed, count| events.send(Event::Files(Box::new(snapshot), noticed, count)).is_ok()
        })?;
        let times = Times::default();
        let builder = Builder::start(choice, times.clone(), {
            let events = events.clone();
            move |built| {
                let _ = events.send(Event::Built(Box::new(built))); // after the session's end nobody wants it
            }
        })?;
        let (state_sender, state) = watch::channel(Arc::default());
        let (frame_sender, frames) = watch::channel(None);
        let (scene_sender, seen) = watch::channel(None);
        let looking = Arc::new(AtomicUsize::new(0));
        let wanted_by = (only_for_viewers && out.is_none()).then(|| looking.clone());
        let told = Told {
            report,
            state: state_sender,
            frames: frame_sender,
            times: times.clone(),
            editor,
            seen: scene_sender,
            events: events.clone(),
        };
        let painter = Painter::new(sources, device, builder, (out, wanted_by), writes, told);
        let thread = std::thread::Builder::new()
            .name("render".to_string())
            .spawn(move || run(painter, inbox))?;
        Ok(Session {
            viewers: Viewers {
                looking,
                events: events.clone(),
            },
            events,
            asked: Arc::default(),
            state,
            frames,
            times,
            seen,
            watch: Some(watch),
            thread: Some(thread),
        })
    }

    /// Asks for something.
    pub fn send(&self, command: Command) {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        *asked += 1;
        let _ = self.events.send(Event::Command(command)); // the thread lives as long as this
    }

    /// A way to give pictures to compare with from other threads, without ever waiting: whether there is room for it.
    pub fn references(&self) -> impl Fn(Reference) -> bool + Send + Sync + 'static {
        let events = self.events.clone();
        move |reference| events.try_send(Event::Reference(reference)).is_ok()
    }

    /// Counts those who look.
    pub fn viewers(&self) -> Viewers {
        self.viewers.clone()
    }

    /// A way to ask for things from other threads, without ever waiting: gives the number that [`State::heard`] reaches
    /// when it is followed, or nothing if too much is asked for already.
    pub fn commands(&self) -> impl Fn(Command) -> Option<u64> + Send + Sync + 'static {
        let (events, asked) = (self.events.clone(), self.asked.clone());
        move |command| {
            let mut asked = asked.lock().unwrap_or_else(PoisonError::into_inner);
            if let Err(TrySendError::Full(_)) = events.try_send(Event::Command(command)) {
                return None;
            }
            *asked += 1;
            Some(*asked)
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.watch = None;
        let _ = self.events.send(Event::Stop); // the thread may have ended by itself
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Takes what has come before any work is done, so that nothing waits for more than one call.
fn run(mut painter: Painter, inbox: Receiver<Event>) {
    loop {
        let event = if painter.has_work() {
            inbox.try_recv().ok()
        } else {
            inbox.recv().ok().or(Some(Event::Stop))
        };
        match event {
            Some(Event::Stop) => break,
            Some(event) => painter.take(event),
            None => painter.work(),
        }
    }
    drop(inbox); // first: other threads may wait for room in it, and the painter for them
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::time::Duration;

    use super::*;
    use crate::dev::camera::Move;
    use crate::dev::picture::Content;
    use crate::gpu::compose::{Shaders, built_in};
    use crate::image::Pixels;
    use crate::scene::Overrides;

    const SCENE: &str = "
        image = { width = 8, height = 8 }
        camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }
        render = { ambient = [1, 1, 1], pixel_samples = { count = 4 } }
        materials.m = { type = 'phong', color = [0.5, 0.5, 0.5] }
        shapes = [{ type = 'sphere', material = 'm', center = [0, 0, 0], radius = 1 }]
    ";

    fn wait<T>(what: &str, mut ready: impl FnMut() -> Option<T>) -> T {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(40) {
            if let Some(value) = ready() {
                return value;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        panic!("{what} does not come");
    }

    fn finished(session: &Session, after: u64) -> (u64, Pixels) {
        wait("a picture", || {
            let frame = session.frames.borrow().clone()?;
            let header = &frame.header;
            match &frame.content {
                Content::Color(pixels) if header.done && header.revision > after => {
                    Some((header.revision, pixels.clone()))
                }
                _ => None,
            }
        })
    }

    #[test]
    fn a_lost_device_is_opened_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (name, text) in built_in() {
            let file = path("shaders").join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, text).unwrap();
        }
        fs::write(path("scene.toml"), SCENE).unwrap();
        let (told, reports) = std::sync::mpsc::channel();
        let session = Session::start(Settings {
            sources: Sources {
                scene: path("scene.toml"),
                overrides: Overrides::default(),
                shaders: Some(path("shaders")),
            },
            device: Choice::Auto,
            out: None,
            only_for_viewers: false,
            editor: None,
            report: Box::new(move |report| drop(told.send(report))),
        })
        .unwrap();
        let (first, wanted) = finished(&session, 0);

        // Lost while nothing happens: the next move finds it out, and is shown all the same.
        session.events.send(Event::Lose).unwrap();
        session.send(Command::Move(Move::Orbit(0.1, 0.0)));
        let (second, _) = finished(&session, first);
        session.send(Command::ResetCamera);
        let (third, again) = finished(&session, second);
        assert_eq!(again, wanted);
        assert!(session.state.borrow().problems.is_empty());
        let lost = reports.try_iter().find_map(|report| match report {
            Report::Problem(problem) => Some(problem.kind),
            _ => None,
        });
        assert_eq!(lost, Some("device"), "it was lost indeed");

        // Lost while a kernel is compiled, with shaders that are wrong: the last good ones go on.
        let good = Shaders::built_in().text("kernels/render.wgsl").to_string();
        session.events.send(Event::Lose).unwrap();
        fs::write(path("shaders/kernels/render.wgsl"), good.replace("= sum;", "= sun;")).unwrap();
        wait("the shader's error", || {
            session
                .state
                .borrow()
                .problems
                .iter()
                .any(|problem| problem.kind == "shader")
                .then_some(())
        });
        session.send(Command::Move(Move::Orbit(0.1, 0.0)));
        session.send(Command::ResetCamera);
        let (_, again) = wait("the picture", || {
            Some(finished(&session, third)).filter(|(_, pixels)| *pixels == wanted)
        });
        assert_eq!(again, wanted);
        fs::write(path("shaders/kernels/render.wgsl"), good).unwrap();
        wait("no error", || session.state.borrow().problems.is_empty().then_some(()));
    }

    #[test]
    fn a_scene_that_does_not_exist_is_an_error_at_once() {
        let sources = Sources {
            scene: "/nowhere/scene.toml".into(),
            overrides: Overrides::default(),
            shaders: None,
        };
        let settings = Settings {
            sources,
            device: Choice::Auto,
            out: None,
            only_for_viewers: false,
            editor: None,
            report: Box::new(|_| ()),
        };
        let error = Session::start(settings).err().unwrap().to_string();
        assert!(error.starts_with("/nowhere/scene.toml: cannot be read: "), "{error}");
    }
}
