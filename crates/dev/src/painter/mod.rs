//! The painter: decides after each event what to compile, render, show and report.

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
use self::walk::CameraHistory;
use super::build::{Builder, Request, guarded};
use super::camera::merged;
use super::canvas::{Canvas, Limits};
use super::diagnostic::Diagnostic;
use super::display_settings::DisplayOverrides;
use super::history::History;
use super::messages::{Event, Report, State};
use super::object::SceneView;
use super::picture::{Frame, View};
use super::sliders::Sliders;
use super::source::{Constants, FileStamp, Loaded, Snapshot, Sources};
use super::times::Times;
use super::watch::Writes;
use wgray_render::gpu::Device;
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::sliders::Slider;
use wgray_scene::CameraDescription;

/// Minimum time between frames while an image is refined. At most a tenth of the time is spent on making frames.
const BETWEEN_FRAMES: Duration = Duration::from_millis(100);
/// Maximum number of successive attempts to open a device without rendering an image.
const ATTEMPTS: u32 = 3;
const GAIN: f32 = 256.0;

pub struct Painter {
    sources: Sources,
    builder: Builder,
    out: Option<PathBuf>,
    /// Number of viewers; `None` renders without viewers.
    looking: Option<Arc<AtomicUsize>>,
    /// The revision that was last written to the output file.
    written: Option<u64>,
    report: Box<dyn Fn(Report) + Send>,
    state_sender: watch::Sender<Arc<State>>,
    frame_sender: watch::Sender<Option<Arc<Frame>>>,
    seen_sender: watch::Sender<Option<Arc<SceneView>>>,
    state: State,

    /// The last valid scene.
    loaded: Option<Arc<Loaded>>,
    /// The newest readable shaders.
    shaders: Option<Arc<Shaders>>,
    /// The last shaders that rendered an image.
    good: Option<Arc<Shaders>>,
    /// Shaders that were refused for these constants.
    refused: Vec<(Arc<Shaders>, Constants)>,
    /// The last shaders whose loops the driver truncated. In a different scene, the driver may not truncate them.
    cut: Option<(Arc<Shaders>, Constants)>,
    device: Option<Device>,
    running: Option<Running>,
    /// The color kernel while a layer kernel runs; otherwise the last layer kernel.
    parked: Option<Running>,
    pending: Option<Pending>,
    requests: u64,
    /// The first request whose kernel may still be shown.
    oldest: u64,
    failures: u32,
    problems: Problems,

    /// The camera, if it differs from the camera in the file.
    camera: Option<CameraDescription>,
    sliders: Sliders,
    /// True if the camera or a slider moved since the image was started.
    camera_waits: bool,
    history: History,
    /// The changes that this session made to the scene file, so that the watcher need not read them again.
    writes: Arc<Mutex<Writes>>,
    files: Vec<(PathBuf, FileStamp)>,
    view: View,
    times: Times,
    gain: f32,
    marks: bool,
    look: DisplayOverrides,
    limits: Limits,
    paused: bool,
    walk: CameraHistory,
    comparison: Comparison,
    /// The inbox of the session, for results of other threads.
    events: SyncSender<Event>,
    /// The last reported sizes of an image that is too large to display: the full size, and the displayed size.
    smaller: Option<([u32; 2], [u32; 2])>,

    executed: u64,
    frames: u64,
    /// Number of images started so far.
    revision: u64,
    /// The time when the newest change that is not displayed yet was noticed, and whether the change was a save.
    since: Option<(Instant, bool)>,
    /// Seconds from the last change to its first image.
    latency: Option<f64>,
    /// Seconds spent on compiling for the next frame.
    compiled: Option<f64>,
    /// The time when the first image after a save was shown; `None` once the image is finished.
    first_frame: Option<Instant>,
    last_frame: Instant,
    frame_cost: Duration,
}

struct Running {
    canvas: Canvas,
    /// True if the driver truncates loops of the kernel; rendering halts until something changes.
    halted: bool,
    shaders: Arc<Shaders>,
    constants: Constants,
    /// The sliders of the kernel, as declared in the current shaders.
    sliders: Vec<Slider>,
    /// The bits of their values.
    slider_values: Vec<u32>,
}

struct Pending {
    id: u64,
    shaders: Arc<Shaders>,
    constants: Constants,
}

pub struct SessionChannels {
    /// Receives reports for the terminal.
    pub report: Box<dyn Fn(Report) + Send>,
    pub state: watch::Sender<Arc<State>>,
    pub frames: watch::Sender<Option<Arc<Frame>>>,
    pub times: Times,
    /// The template of links to an editor.
    pub editor: Option<String>,
    /// The scene and the camera, for queries about objects.
    pub seen: watch::Sender<Option<Arc<SceneView>>>,
    pub events: SyncSender<Event>,
}

impl Painter {
    pub fn new(
        sources: Sources,
        device: Device,
        builder: Builder,
        (out, looking): (Option<PathBuf>, Option<Arc<AtomicUsize>>),
        writes: Arc<Mutex<Writes>>,
        channels: SessionChannels,
    ) -> Painter {
        let SessionChannels {
            report,
            state: state_sender,
            frames: frame_sender,
            times,
            editor,
            seen: seen_sender,
            events,
        } = channels;
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
            oldest: 0,
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
            look: DisplayOverrides::default(),
            limits: Limits::default(),
            paused: false,
            walk: CameraHistory::default(),
            comparison: Comparison::default(),
            events,
            smaller: None,
            executed: 0,
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

    pub fn take(&mut self, event: Event) {
        match event {
            Event::Files(snapshot, noticed, writes) => self.take_files(*snapshot, noticed, writes),
            Event::BuildResult(built) => self.take_built(*built),
            Event::Command(command) => {
                self.take_command(command);
                self.executed += 1;
            }
            Event::Reference(reference) => self.take_reference(reference),
            Event::Measured(apart) => self.take_measured(apart),
            Event::Viewers => {
                // Restarts the latency measurement: no viewer has been waiting for the image, or for a compilation that
                // has already finished.
                if self.pending.is_none() {
                    self.since = self.since.map(|(_, saved)| (Instant::now(), saved));
                    self.compiled = None;
                }
            }
            Event::Reading(reading) => self.state.reading = reading,
            #[cfg(test)]
            Event::Lose => self.device.iter().for_each(|device| device.wgpu().0.destroy()),
            Event::Stop => {}
        }
        self.tell();
    }

    fn take_files(&mut self, snapshot: Snapshot, noticed: Instant, writes: u64) {
        self.state.reading = false;
        for (part, took) in ["read files", "pack"].into_iter().zip(snapshot.took) {
            if !took.is_zero() {
                self.times.part(part, took);
            }
        }
        // Snapshots from before the last write are outdated.
        let is_new = writes == self.writes.lock().unwrap_or_else(PoisonError::into_inner).count;
        let known = self.loaded.as_ref().map(|loaded| loaded.text.as_bytes());
        if let (true, Some((_, FileStamp::Content(content)))) = (is_new, snapshot.files.first())
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
                self.take_shaders(shaders);
            }
            Err(problem) => self.problems.files = Some(*problem),
        }
        self.show_files(noticed, shown_otherwise);
    }

    /// Takes a loaded scene or its errors. Returns true if the display settings changed.
    fn take_scene(&mut self, scene: Result<Arc<Loaded>, Vec<Diagnostic>>) -> bool {
        let mut shown_otherwise = false;
        match scene {
            Ok(loaded) => {
                self.problems.scene.clear();
                // Camera values that were edited in the file replace the values of the moved camera.
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
                    (self.report)(Report::Note(note.to_string()));
                }
                let known = self.loaded.as_ref();
                shown_otherwise = known.is_some_and(|old| old.scene.view != loaded.scene.view);
                self.loaded = Some(loaded);
                self.state.scenes += 1;
            }
            Err(problems) => self.problems.scene = problems,
        }
        shown_otherwise
    }

    fn show_files(&mut self, noticed: Instant, shown_otherwise: bool) {
        self.failures = 0;
        self.keep_view();
        self.settle((noticed, true));
        self.upload_sliders((noticed, true));
        // If only the display settings changed, shows the current image again. The first image of a new rendering is
        // shown later.
        let picture = self.running.as_ref().filter(|running| !running.canvas.is_new());
        if shown_otherwise && self.pending.is_none() && picture.is_some() {
            self.changed((noticed, true));
            self.show();
        }
    }

    /// Returns the scene and the shaders to render: the newest ones, or the last good ones if the newest have errors.
    fn wanted(&self) -> Option<(Arc<Loaded>, Arc<Shaders>)> {
        let (loaded, newest) = (self.loaded.clone()?, self.shaders.clone()?);
        let constants = self.constants(&loaded);
        let mut candidates = [Some(newest), self.good.clone()].into_iter().flatten();
        let shaders = candidates.find(|shaders| !self.refused.contains(&(shaders.clone(), constants)))?;
        Some((loaded, shaders))
    }

    /// Makes the rendering match the current scene and shaders.
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
            self.oldest = self.requests + 1;
            if !fitting {
                self.show_parked(since);
            }
            self.draw_scene(since);
        } else if !(self.pending.as_ref()).is_some_and(|pending| fits(&pending.shaders, pending.constants)) {
            self.since.get_or_insert(since);
            self.request(&loaded, shaders, since.0);
        }
    }

    fn request(&mut self, loaded: &Loaded, shaders: Arc<Shaders>, noticed: Instant) {
        let constants = self.constants(loaded);
        let running = self.running.as_ref();
        let stays = running.is_some_and(|running| running.constants == constants);
        let fallback = self.good.clone().filter(|good| !stays && *good != shaders);
        self.requests += 1;
        self.builder.request(Request {
            id: self.requests,
            device: self.device.clone(),
            packed: self.packed(loaded),
            shaders: shaders.clone(),
            fallback,
            constants,
            noticed,
        });
        self.pending = Some(Pending {
            id: self.requests,
            shaders,
            constants,
        });
    }

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
            Ok(false) => {} // impossible, because it fits
            Err(error) => self.fail(&error),
        }
    }

    /// Records that an image was started with the current camera.
    fn begun(&mut self, since: (Instant, bool)) {
        self.camera_waits = false;
        self.tell_size();
        self.changed(since);
    }

    /// Records that a different image is shown from now on.
    fn changed(&mut self, since: (Instant, bool)) {
        self.revision += 1;
        self.since.get_or_insert(since);
    }

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
                // While a kernel is compiled, only camera moves are rendered.
                self.camera_waits || (more && (first || (self.pending.is_none() && !self.paused)))
            })
    }

    pub fn work(&mut self) {
        let (view, waits) = (self.seen(), self.camera_waits);
        let Some(loaded) = self.loaded.clone() else { return };
        let camera = self.packed_camera(&loaded);
        let Some(running) = &mut self.running else { return };
        // A first image is only interrupted once it is complete, so that images are shown while the camera moves.
        if waits && (!running.canvas.is_new() || running.canvas.is_done(view)) {
            running.slider_values = self.sliders.bits(&running.sliders);
            let restarted = guarded(|| {
                running.canvas.set_sliders(&running.slider_values)?;
                running.canvas.restart(camera, view)
            });
            match restarted {
                Ok(()) => self.begun((Instant::now(), false)),
                Err(error) => self.fail(&error),
            }
            return;
        }
        let stepped = guarded(|| self.times.of("render", || running.canvas.step(view)));
        running
            .canvas
            .dispatches()
            .iter()
            .for_each(|call| self.times.call(call));
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
