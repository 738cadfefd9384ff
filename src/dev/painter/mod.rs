//! What a session does with what happens: decides what is rendered, compiled, shown and told.

mod commands;
mod comparison;
mod kernels;
mod shader;
mod show;
mod view;
mod walk;
mod writing;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;

use self::comparison::Comparison;
use self::show::Problems;
use self::walk::Walk;
use super::build::{Builder, Request, guarded};
use super::camera::merged;
use super::canvas::{Canvas, Limits};
use super::diagnostic::Diagnostic;
use super::history::History;
use super::look::Choice;
use super::messages::{Event, Report, State};
use super::object::Seen;
use super::picture::{Frame, View};
use super::sliders::Sliders;
use super::source::{Constants, Loaded, Snapshot, Sources, Stamp};
use super::times::Times;
use super::watch::Writes;
use crate::gpu::Device;
use crate::gpu::compose::Shaders;
use crate::scene::CameraDescription;

/// Pictures of more samples are shown no more often than this, and a tenth of the time is spent on them at most.
const BETWEEN_FRAMES: Duration = Duration::from_millis(100);
/// So often a device is opened anew without any picture in between.
const ATTEMPTS: u32 = 3;
/// The factor of differences at first.
const GAIN: f32 = 256.0;

/// The state of a session.
pub struct Painter {
    sources: Sources,
    builder: Builder,
    out: Option<PathBuf>,
    /// How many look, if nothing is rendered while nobody does.
    looking: Option<Arc<AtomicUsize>>,
    /// The picture that the file was last written for.
    written: Option<u64>,
    report: Box<dyn Fn(Report) + Send>,
    state_sender: watch::Sender<Arc<State>>,
    frame_sender: watch::Sender<Option<Arc<Frame>>>,
    seen_sender: watch::Sender<Option<Arc<Seen>>>,
    state: State,

    /// The last scene that was right.
    loaded: Option<Arc<Loaded>>,
    /// The newest shaders that could be read, with the values of sliders that are compiled in.
    shaders: Option<Arc<Shaders>>,
    /// The last shaders that made a picture.
    good: Option<Arc<Shaders>>,
    /// Shaders that were refused for these constants.
    refused: Vec<(Arc<Shaders>, Constants)>,
    /// The last that were refused because the driver cut them short: in another scene it may not.
    cut: Option<(Arc<Shaders>, Constants)>,
    device: Option<Device>,
    running: Option<Running>,
    /// The kernel of light where the running one is for layers; else the one for layers that ran before, if any.
    parked: Option<Running>,
    pending: Option<Pending>,
    requests: u64,
    failures: u32,
    problems: Problems,

    /// The camera, where it is not the file's.
    camera: Option<CameraDescription>,
    sliders: Sliders,
    /// Whether the camera or a slider moved since the picture was begun.
    camera_waits: bool,
    /// What was written into the scene file, while it can be taken back.
    history: History,
    /// What the watcher is told of that.
    writes: Arc<Mutex<Writes>>,
    /// The files that the scene is made of.
    files: Vec<(PathBuf, Stamp)>,
    view: View,
    times: Times,
    gain: f32,
    marks: bool,
    look: Choice,
    limits: Limits,
    /// Whether nothing but first pictures is rendered.
    paused: bool,
    walk: Walk,
    comparison: Comparison,
    /// What happens elsewhere on behalf of this.
    events: SyncSender<Event>,
    /// The sizes that were told last, asked for and shown, of a picture that is too large.
    smaller: Option<([u32; 2], [u32; 2])>,

    /// Counts the commands that were followed.
    heard: u64,
    /// Counts the frames.
    frames: u64,
    /// Counts the pictures.
    revision: u64,
    /// When the change was noticed that the picture does not show yet, and whether a file was saved.
    since: Option<(Instant, bool)>,
    /// Seconds from the last change to the first picture of it.
    latency: Option<f64>,
    /// What compiling took, if the next frame needed it.
    compiled: Option<f64>,
    /// When the first picture of a saved file was shown, until it is finished.
    first_frame: Option<Instant>,
    last_frame: Instant,
    frame_cost: Duration,
}

struct Running {
    canvas: Canvas,
    /// Whether the driver cuts it short: it rests until something changes.
    halted: bool,
    shaders: Arc<Shaders>,
    constants: Constants,
    /// The values of its sliders.
    sliders: Vec<[u32; 4]>,
}

struct Pending {
    id: u64,
    shaders: Arc<Shaders>,
    constants: Constants,
}

/// Who is told what happens.
pub struct Told {
    /// The terminal.
    pub report: Box<dyn Fn(Report) + Send>,
    /// Those who are told the state.
    pub state: watch::Sender<Arc<State>>,
    /// Those who are sent the picture.
    pub frames: watch::Sender<Option<Arc<Frame>>>,
    /// Where the time goes.
    pub times: Times,
    /// The form of links that open an editor.
    pub editor: Option<String>,
    /// Those who ask about the scene.
    pub seen: watch::Sender<Option<Arc<Seen>>>,
    /// The session's own inbox.
    pub events: SyncSender<Event>,
}

impl Painter {
    /// A session that knows no files yet.
    pub fn new(
        sources: Sources,
        device: Device,
        builder: Builder,
        (out, looking): (Option<PathBuf>, Option<Arc<AtomicUsize>>),
        writes: Arc<Mutex<Writes>>,
        told: Told,
    ) -> Painter {
        let Told {
            report,
            state: state_sender,
            frames: frame_sender,
            times,
            editor,
            seen: seen_sender,
            events,
        } = told;
        let state = State {
            scene: sources.scene.display().to_string(),
            shaders: sources.shaders.as_ref().map(|folder| folder.display().to_string()),
            device: format!("{}, {}", device.info.name, device.info.driver),
            read_only: sources.read_only(),
            gain: GAIN,
            editor,
            ..State::default()
        };
        Painter {
            sources,
            builder,
            out,
            looking,
            written: None,
            report,
            state_sender,
            frame_sender,
            seen_sender,
            state,
            loaded: None,
            shaders: None,
            good: None,
            refused: Vec::new(),
            cut: None,
            device: Some(device),
            running: None,
            parked: None,
            pending: None,
            requests: 0,
            failures: 0,
            problems: Problems::default(),
            camera: None,
            sliders: Sliders::default(),
            camera_waits: false,
            history: History::default(),
            writes,
            files: Vec::new(),
            view: View::default(),
            times,
            gain: GAIN,
            marks: true,
            look: Choice::default(),
            limits: Limits::default(),
            paused: false,
            walk: Walk::default(),
            comparison: Comparison::default(),
            events,
            smaller: None,
            heard: 0,
            frames: 0,
            revision: 0,
            since: None,
            latency: None,
            compiled: None,
            first_frame: None,
            last_frame: Instant::now(),
            frame_cost: Duration::ZERO,
        }
    }

    /// Takes something that happened.
    pub fn take(&mut self, event: Event) {
        match event {
            Event::Files(snapshot, noticed, writes) => self.take_files(*snapshot, noticed, writes),
            Event::Built(built) => self.take_built(*built),
            Event::Command(command) => {
                self.take_command(command);
                self.heard += 1;
            }
            Event::Reference(reference) => self.take_reference(reference),
            Event::Measured(apart) => self.take_measured(apart),
            Event::Viewers => {
                // Nobody has waited for the picture until now.
                self.since = self.since.map(|(_, saved)| (Instant::now(), saved));
            }
            #[cfg(test)]
            Event::Lose => self.device.iter().for_each(Device::destroy),
            Event::Stop => {}
        }
        self.tell();
    }

    fn take_files(&mut self, snapshot: Snapshot, noticed: Instant, writes: u64) {
        for (part, took) in ["read files", "pack"].into_iter().zip(snapshot.took) {
            if !took.is_zero() {
                self.times.part(part, took);
            }
        }
        // What was read before this session wrote the file last is no news of the scene.
        let is_new = writes == self.writes.lock().unwrap_or_else(PoisonError::into_inner).count;
        let known = self.loaded.as_ref().map(|loaded| loaded.text.as_bytes());
        if let (true, Some((_, Stamp::Content(content)))) = (is_new, snapshot.files.first())
            && known != Some(content)
        {
            self.forget_writes();
        }
        let mut shown_otherwise = false;
        if is_new {
            self.files = snapshot.files;
            shown_otherwise = self.take_scene(snapshot.scene);
        }
        match snapshot.shaders {
            Ok(shaders) => {
                self.problems.files = None;
                if self.sliders.differ_from(&shaders) {
                    self.keep_before();
                }
                self.read_shaders(shaders);
            }
            Err(problem) => self.problems.files = Some(*problem),
        }
        self.show_files(noticed, shown_otherwise);
    }

    /// Takes a scene, or what is wrong with it. Gives whether what is rendered of it is shown otherwise.
    fn take_scene(&mut self, scene: Result<Arc<Loaded>, Diagnostic>) -> bool {
        let mut shown_otherwise = false;
        match scene {
            Ok(loaded) => {
                self.problems.scene = None;
                // Whoever changes the file's camera wants to see it.
                if let (Some(camera), Some(old)) = (&self.camera, &self.loaded) {
                    self.camera = merged(camera, &old.camera, &loaded.camera);
                }
                if self.loaded.as_ref().is_some_and(|old| old.packed != loaded.packed) {
                    self.keep_before();
                    let cut = self.cut.take();
                    self.refused.retain(|known| Some(known) != cut.as_ref());
                }
                let known = self.loaded.as_ref().map_or(&[][..], |old| &old.scene.notes);
                for note in loaded.scene.notes.iter().filter(|note| !known.contains(note)) {
                    (self.report)(Report::Note(note.clone()));
                }
                let known = self.loaded.as_ref();
                shown_otherwise = known.is_some_and(|old| old.scene.view != loaded.scene.view);
                self.loaded = Some(loaded);
                self.state.scenes += 1;
            }
            Err(problem) => self.problems.scene = Some(problem),
        }
        shown_otherwise
    }

    /// Sees to it that what the files say now is shown.
    fn show_files(&mut self, noticed: Instant, shown_otherwise: bool) {
        self.failures = 0;
        self.keep_view();
        self.settle((noticed, true));
        self.upload_sliders((noticed, true));
        // What is rendered may be the same; if it is not, its first picture comes by itself.
        let picture = self.running.as_ref().filter(|running| !running.canvas.is_new());
        if shown_otherwise && self.pending.is_none() && picture.is_some() {
            self.changed((noticed, true));
            self.show();
        }
    }

    /// The scene, and the shaders that it is to be rendered with: the newest, or where these are known to be wrong for
    /// it the last good ones.
    fn wanted(&self) -> Option<(Arc<Loaded>, Arc<Shaders>)> {
        let (loaded, newest) = (self.loaded.clone()?, self.shaders.clone()?);
        let constants = self.constants(&loaded);
        let mut candidates = [Some(newest), self.good.clone()].into_iter().flatten();
        let shaders = candidates.find(|shaders| !self.refused.contains(&(shaders.clone(), constants)))?;
        Some((loaded, shaders))
    }

    /// Sees to it that what is rendered is what the files say.
    fn settle(&mut self, since: (Instant, bool)) {
        let Some((loaded, shaders)) = self.wanted() else { return };
        if self.shaders.as_ref() == Some(&shaders) {
            self.problems.shader.clear();
        }
        let constants = self.constants(&loaded);
        let fits = |known: &Arc<Shaders>, of| *known == shaders && constants == of;
        let running = self.running.as_ref();
        let fitting = running.is_some_and(|running| fits(&running.shaders, running.constants));
        if fitting || self.take_parked(&shaders, &constants) {
            self.pending = None;
            if !fitting {
                self.show_parked(since);
            }
            self.draw_scene(since);
        } else if !(self.pending.as_ref()).is_some_and(|pending| fits(&pending.shaders, pending.constants)) {
            self.since.get_or_insert(since);
            self.request(&loaded, shaders);
        }
    }

    fn request(&mut self, loaded: &Loaded, shaders: Arc<Shaders>) {
        let constants = self.constants(loaded);
        // A running kernel that fits the scene stays if the new one is wrong; else the last good shaders are compiled.
        let running = self.running.as_ref();
        let stays = running.is_some_and(|running| running.constants == constants);
        let fallback = self.good.clone().filter(|good| !stays && *good != shaders);
        self.requests += 1;
        self.builder.request(Request {
            id: self.requests,
            device: self.device.clone(),
            packed: self.packed(loaded),
            shaders: shaders.clone(),
            layer: self.layer().cloned(),
            fallback,
        });
        self.pending = Some(Pending {
            id: self.requests,
            shaders,
            constants,
        });
    }

    /// Renders the scene with the running kernel, which fits it.
    fn draw_scene(&mut self, since: (Instant, bool)) {
        let Some(loaded) = self.loaded.clone() else { return };
        let packed = self.packed(&loaded);
        let (view, times) = (self.seen(), self.times.clone());
        let Some(running) = &mut self.running else { return };
        if running.canvas.shows(&packed) {
            if !self.camera_waits {
                self.since = None;
            }
            return;
        }
        running.halted = false;
        match guarded(|| times.of("upload", || running.canvas.update(&packed, view))) {
            Ok(true) => self.begun(since),
            Ok(false) => {} // it fits, so this cannot be
            Err(error) => self.fail(&error),
        }
    }

    /// A picture has been begun, by the camera as it is now.
    fn begun(&mut self, since: (Instant, bool)) {
        self.camera_waits = false;
        self.tell_size();
        self.changed(since);
    }

    /// Another picture is shown from now on.
    fn changed(&mut self, since: (Instant, bool)) {
        self.revision += 1;
        self.since.get_or_insert(since);
    }

    /// Whether [`work`](Self::work) has anything to do.
    pub fn has_work(&self) -> bool {
        if self
            .looking
            .as_ref()
            .is_some_and(|looking| looking.load(Ordering::SeqCst) == 0)
        {
            return false;
        }
        self.running
            .as_ref()
            .filter(|running| !running.halted)
            .is_some_and(|running| {
                let more = !running.canvas.is_done(self.seen());
                let first = running.canvas.is_new();
                // While a kernel is compiled the processor is left to the compiler, but for the camera.
                self.camera_waits || (more && (first || (self.pending.is_none() && !self.paused)))
            })
    }

    /// Does one call's worth of work.
    pub fn work(&mut self) {
        let (view, waits) = (self.seen(), self.camera_waits);
        let Some(loaded) = self.loaded.clone() else { return };
        let camera = self.packed_camera(&loaded);
        let Some(running) = &mut self.running else { return };
        // A camera that never rests must not keep the first picture from being finished.
        if waits && (!running.canvas.is_new() || running.canvas.is_done(view)) {
            let sliders = self.sliders.values(running.canvas.live().sliders());
            let restarted = guarded(|| {
                running.canvas.set_sliders(&sliders)?;
                running.canvas.restart(camera, view)
            });
            running.sliders = sliders;
            match restarted {
                Ok(()) => self.begun((Instant::now(), false)),
                Err(error) => self.fail(&error),
            }
            return;
        }
        let stepped = guarded(|| self.times.of("render", || running.canvas.step(view)));
        running.canvas.calls().iter().for_each(|call| self.times.call(call));
        match stepped {
            Ok(show) => {
                let due = self.last_frame.elapsed() > BETWEEN_FRAMES.max(10 * self.frame_cost);
                if show || (due && !running.canvas.is_new()) {
                    self.show();
                }
            }
            Err(error) => self.fail(&error),
        }
    }
}
