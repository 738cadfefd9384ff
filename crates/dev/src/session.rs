//! A session: watches the files of a scene, and renders the scene on its own thread.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use tokio::sync::watch;

use super::build::Builder;
use super::messages::{Command, Event, Report, State};
use super::object::SceneView;
use super::painter::{Painter, SessionChannels};
use super::picture::Frame;
use super::reference::Reference;
use super::source::Sources;
use super::times::Times;
use super::watch::Watch;
use wgray_render::error::RenderError;
use wgray_render::gpu::{AdapterChoice, choose};

/// The settings of a session.
pub struct Settings {
    /// The scene file, the overrides of its values, and the shaders.
    pub sources: Sources,
    /// The device to render on.
    pub device: AdapterChoice,
    /// A PNG file that is replaced after each reload.
    pub out: Option<PathBuf>,
    /// True to pause rendering while no viewer exists ([`Session::viewers`]), unless `out` is set.
    pub only_for_viewers: bool,
    /// The template of links to an editor; `None` for no links.
    pub editor: Option<String>,
    /// Receives reports for the terminal.
    pub report: Box<dyn Fn(Report) + Send>,
}

/// Maximum number of events in the queue while a dispatch runs.
const MAX_EVENTS: usize = 256;

/// A running session; ends when dropped.
pub struct Session {
    events: SyncSender<Event>,
    command_count: Arc<Mutex<u64>>,
    /// The newest state.
    pub state: watch::Receiver<Arc<State>>,
    /// The newest frame, if any. A slow receiver skips frames.
    pub frames: watch::Receiver<Option<Arc<Frame>>>,
    /// The timings of kernels and stages.
    pub times: Times,
    /// The scene and the camera for queries, once a scene is loaded.
    pub scene_views: watch::Receiver<Option<Arc<SceneView>>>,
    viewers: Viewers,
    watch: Option<Watch>,
    thread: Option<JoinHandle<()>>,
}

/// The counter of viewers.
#[derive(Clone)]
pub struct Viewers {
    count: Arc<AtomicUsize>,
    events: SyncSender<Event>,
}

/// A viewer; counted until dropped.
pub struct Viewer(Viewers);

impl Viewers {
    /// Adds a viewer.
    pub fn enter(&self) -> Viewer {
        self.count.fetch_add(1, Ordering::SeqCst);
        let _ = self.events.try_send(Event::Viewers); // if the queue is full, its events wake the painter
        Viewer(self.clone())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.0.count.fetch_sub(1, Ordering::SeqCst);
    }
}

/// The reason why a session cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The scene file does not exist.
    #[error("{0}: cannot be read: {1}")]
    NoScene(PathBuf, std::io::Error),
    /// No device is available.
    #[error(transparent)]
    Device(#[from] RenderError),
    /// The operating system does not allow watching files.
    #[error("files cannot be watched: {0}")]
    Watch(#[from] notify::Error),
    /// The operating system cannot start a thread.
    #[error(transparent)]
    System(#[from] std::io::Error),
}

impl Session {
    /// Opens the device, and starts to read the files and to render. Errors in the files are reported until they are
    /// fixed.
    ///
    /// # Errors
    ///
    /// No device is available, the scene file does not exist, or the operating system reports an error.
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
        let (events, inbox) = sync_channel(MAX_EVENTS);
        let writes = Arc::default();
        // The files are read while the device is opened, and while the page loads.
        let watch = Watch::start(sources.clone(), Arc::clone(&writes), {
            let events = events.clone();
            move |event| events.send(event).is_ok()
        })?;
        let device = choose(&choice)?;
        let may_use_cpu = choice == AdapterChoice::Auto;
        let times = Times::default();
        let builder = Builder::start(choice, times.clone(), {
            let events = events.clone();
            move |built| {
                let _ = events.send(Event::BuildResult(Box::new(built))); // fails only after the end of the session
            }
        })?;
        let (state_sender, state) = watch::channel(Arc::default());
        let (frame_sender, frames) = watch::channel(None);
        let (scene_sender, scene_views) = watch::channel(None);
        let count = Arc::new(AtomicUsize::new(0));
        let viewer_count = (only_for_viewers && out.is_none()).then(|| count.clone());
        let channels = SessionChannels {
            report,
            state: state_sender,
            frames: frame_sender,
            times: times.clone(),
            editor,
            scene_views: scene_sender,
            events: events.clone(),
        };
        let mut painter = Painter::new(
            sources,
            (device, may_use_cpu),
            builder,
            (out, viewer_count),
            writes,
            channels,
        );
        painter.handle(Event::Reading(true));
        let thread = std::thread::Builder::new()
            .name("render".to_string())
            .spawn(move || run(painter, inbox))?;
        Ok(Session {
            viewers: Viewers {
                count,
                events: events.clone(),
            },
            events,
            command_count: Arc::default(),
            state,
            frames,
            times,
            scene_views,
            watch: Some(watch),
            thread: Some(thread),
        })
    }

    /// Sends a command.
    pub fn send(&self, command: Command) {
        let mut command_count = self.command_count.lock().unwrap_or_else(PoisonError::into_inner);
        *command_count += 1;
        let _ = self.events.send(Event::Command(command)); // the thread lives as long as the session
    }

    /// Returns a function that submits reference images from any thread. The function does not block; it returns false
    /// if the session is busy.
    pub fn references(&self) -> impl Fn(Reference) -> bool + Send + Sync + 'static {
        let events = self.events.clone();
        move |reference| events.try_send(Event::Reference(reference)).is_ok()
    }

    /// Returns the counter of viewers.
    pub fn viewers(&self) -> Viewers {
        self.viewers.clone()
    }

    /// Returns a function that sends commands from any thread. The function does not block; it returns the value that
    /// [`State::executed`] has after the command, or `None` if the session is busy.
    pub fn commands(&self) -> impl Fn(Command) -> Option<u64> + Send + Sync + 'static {
        let (events, command_count) = (self.events.clone(), self.command_count.clone());
        move |command| {
            let mut command_count = command_count.lock().unwrap_or_else(PoisonError::into_inner);
            if let Err(TrySendError::Full(_)) = events.try_send(Event::Command(command)) {
                return None;
            }
            *command_count += 1;
            Some(*command_count)
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.watch = None;
        let _ = self.events.send(Event::Stop); // the thread may have ended already
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Handles all pending events before each dispatch, so that an event waits for at most one dispatch.
fn run(mut painter: Painter, inbox: Receiver<Event>) {
    loop {
        let event = if painter.has_next_step() {
            inbox.try_recv().ok()
        } else {
            inbox.recv().ok().or(Some(Event::Stop))
        };
        match event {
            Some(Event::Stop) => break,
            Some(event) => painter.handle(event),
            None => painter.render_step(),
        }
    }
    // The inbox is dropped first: the painter waits for its threads, which may be waiting for a free slot in the inbox.
    drop(inbox);
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::time::{Duration, Instant};

    use super::*;
    use crate::camera::Move;
    use crate::picture::Content;
    use wgray_image::Pixels;
    use wgray_render::gpu::compose::{Shaders, built_in};
    use wgray_scene::Overrides;

    const SCENE: &str = "
        image = { width = 8, height = 8 }
        camera = { position = [0, -4, 0], look_at = [0, 0, 0], fov = 40 }
        render = { ambient = [1, 1, 1], pixel_samples = { count = 4 } }
        materials.m = { type = 'phong', color = [0.5, 0.5, 0.5] }
        shapes = [{ type = 'sphere', material = 'm', center = [0, 0, 0], radius = 1 }]
    ";

    fn wait<T>(name: &str, mut ready: impl FnMut() -> Option<T>) -> T {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(40) {
            if let Some(value) = ready() {
                return value;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        panic!("timeout while waiting for {name}");
    }

    fn finished(session: &Session, old_revision: u64) -> (u64, Pixels) {
        wait("an image", || {
            let frame = session.frames.borrow().clone()?;
            let header = &frame.header;
            match &frame.content {
                Content::Color(pixels) if header.done && header.revision > old_revision => {
                    Some((header.revision, pixels.clone()))
                }
                _ => None,
            }
        })
    }

    #[test]
    fn a_lost_device_is_reopened() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (name, text) in built_in() {
            let file = path("shaders").join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, text).unwrap();
        }
        fs::write(path("scene.toml"), SCENE).unwrap();
        let (sender, reports) = std::sync::mpsc::channel();
        let session = Session::start(Settings {
            sources: Sources {
                scene: path("scene.toml"),
                overrides: Overrides::default(),
                shaders: Some(path("shaders")),
            },
            device: AdapterChoice::Auto,
            out: None,
            only_for_viewers: false,
            editor: None,
            report: Box::new(move |report| drop(sender.send(report))),
        })
        .unwrap();
        let (first, expected) = finished(&session, 0);

        // The device is lost while the session is idle. The session detects the loss at the next move, and shows the
        // image of the moved camera.
        session.events.send(Event::Lose).unwrap();
        session.send(Command::Move(Move::Orbit(0.1, 0.0)));
        let (second, _) = finished(&session, first);
        session.send(Command::ResetCamera);
        let (third, after_loss) = finished(&session, second);
        assert_eq!(after_loss, expected);
        assert!(session.state.borrow().problems.is_empty());
        let problem = reports.try_iter().find_map(|report| match report {
            Report::Problem(problem) => Some(problem.kind),
            _ => None,
        });
        assert_eq!(problem, Some("device"), "the device was not lost");

        // The device is lost while a kernel with invalid shaders is compiled: the session uses the last good shaders.
        let valid_code = Shaders::built_in().text("kernels/render.wgsl").to_string();
        session.events.send(Event::Lose).unwrap();
        fs::write(
            path("shaders/kernels/render.wgsl"),
            valid_code.replace("= sum;", "= sun;"),
        )
        .unwrap();
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
        let (_, after_error) = wait("the image", || {
            Some(finished(&session, third)).filter(|(_, pixels)| *pixels == expected)
        });
        assert_eq!(after_error, expected);
        fs::write(path("shaders/kernels/render.wgsl"), valid_code).unwrap();
        wait("no error", || session.state.borrow().problems.is_empty().then_some(()));
    }

    #[test]
    fn a_missing_scene_file_is_an_error() {
        let sources = Sources {
            scene: "/nowhere/scene.toml".into(),
            overrides: Overrides::default(),
            shaders: None,
        };
        let settings = Settings {
            sources,
            device: AdapterChoice::Auto,
            out: None,
            only_for_viewers: false,
            editor: None,
            report: Box::new(|_| ()),
        };
        let error = Session::start(settings).err().unwrap().to_string();
        assert!(error.starts_with("/nowhere/scene.toml: cannot be read: "), "{error}");
    }
}
