//! The painter: decides after each event what to compile, render, show and report.

mod commands;
mod comparison;
mod cpu;
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
use super::source::{FileStamp, KernelChoice, Loaded, Snapshot, Sources};
use super::times::Times;
use super::watch::Writes;
use wgray_render::gpu::compose::Shaders;
use wgray_render::gpu::sliders::Slider;
use wgray_render::gpu::{Device, GpuInfo};
use wgray_scene::CameraDescription;

/// Minimum time between frames while an image is refined. At most a tenth of the time is spent on making frames.
const FRAME_INTERVAL: Duration = Duration::from_millis(100);
/// Maximum number of successive attempts to open a device that end before an image is rendered.
const MAX_ATTEMPTS: u32 = 3;
const DEFAULT_GAIN: f32 = 256.0;

pub struct Painter {
    sources: Sources,
    builder: Builder,
    out: Option<PathBuf>,
    /// Number of viewers; rendering pauses at 0. `None` never pauses rendering.
    viewers: Option<Arc<AtomicUsize>>,
    /// The revision that was last written to the output file.
    written: Option<u64>,
    report: Box<dyn Fn(Report) + Send>,
    state_sender: watch::Sender<Arc<State>>,
    frame_sender: watch::Sender<Option<Arc<Frame>>>,
    scene_view_sender: watch::Sender<Option<Arc<SceneView>>>,
    state: State,

    /// The last valid scene.
    loaded: Option<Arc<Loaded>>,
    /// The newest shaders whose files could be read.
    shaders: Option<Arc<Shaders>>,
    /// The last shaders that rendered a complete image.
    last_good: Option<Arc<Shaders>>,
    /// Shaders with errors, each with the kernel choice for which the errors occur.
    rejected: Vec<(Arc<Shaders>, KernelChoice)>,
    /// The last shaders whose loops the driver truncated. In a different scene, the loops may be shorter.
    truncated: Option<(Arc<Shaders>, KernelChoice)>,
    device: Option<Device>,
    /// The adapter of the last device.
    adapter: GpuInfo,
    /// True if the CPU may render in place of a software Vulkan adapter.
    may_use_cpu: bool,
    /// The built-in shaders, which have twins on the CPU.
    built_in: Shaders,
    running: Option<Running>,
    /// The color kernel while a layer kernel runs; otherwise the last layer kernel.
    parked: Option<Running>,
    pending: Option<Pending>,
    requests: u64,
    /// The number of the first request whose kernel may still be shown.
    first_valid_request: u64,
    failures: u32,
    problems: Problems,

    /// The camera, if it differs from the camera in the file.
    camera: Option<CameraDescription>,
    sliders: Sliders,
    /// True if the image must be restarted, for example after a move of the camera or a slider.
    restart_pending: bool,
    history: History,
    /// The changes that this session made to the scene file. The watcher does not read these changes again.
    writes: Arc<Mutex<Writes>>,
    files: Vec<(PathBuf, FileStamp)>,
    view: View,
    times: Times,
    gain: f32,
    marks: bool,
    display_overrides: DisplayOverrides,
    limits: Limits,
    paused: bool,
    camera_history: CameraHistory,
    comparison: Comparison,
    /// Sends results of other threads to the painter.
    events: SyncSender<Event>,
    /// The full size and the displayed size of an image that is too large to display, as last reported.
    reported_sizes: Option<([u32; 2], [u32; 2])>,

    executed_commands: u64,
    frames: u64,
    /// Number of changes of the image so far, for example of the scene, the camera or the view.
    revision: u64,
    /// The oldest change that is not displayed yet: the time when it was noticed, and whether it was a save.
    change: Option<(Instant, bool)>,
    /// Seconds from the last change to its first image.
    latency: Option<f64>,
    /// Seconds spent on compiling the kernel of the next frame, for the report about this frame.
    next_compile_seconds: Option<f64>,
    /// The time when the first image after a save was shown; `None` once the image is finished.
    first_frame: Option<Instant>,
    last_frame: Instant,
    frame_cost: Duration,
}

/// A canvas that renders, and the kernel of the canvas.
struct Running {
    canvas: Canvas,
    /// True after the driver truncated loops of the kernel, or a shader failed to compile, without earlier shaders to
    /// use instead. Rendering resumes when the scene, the view, the limits or a slider changes.
    halted: bool,
    shaders: Arc<Shaders>,
    kernel_choice: KernelChoice,
    /// The sliders of the kernel, as declared in the current shaders.
    sliders: Vec<Slider>,
    /// The slider values as bits.
    slider_values: Vec<u32>,
}

/// A requested kernel.
struct Pending {
    id: u64,
    shaders: Arc<Shaders>,
    kernel_choice: KernelChoice,
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
    pub scene_views: watch::Sender<Option<Arc<SceneView>>>,
    pub events: SyncSender<Event>,
}

impl Painter {
    pub fn new(
        sources: Sources,
        (device, may_use_cpu): (Device, bool),
        builder: Builder,
        (out, viewers): (Option<PathBuf>, Option<Arc<AtomicUsize>>),
        writes: Arc<Mutex<Writes>>,
        channels: SessionChannels,
    ) -> Painter {
        let SessionChannels {
            report,
            state: state_sender,
            frames: frame_sender,
            times,
            editor,
            scene_views: scene_view_sender,
            events,
        } = channels;
        let state = State {
            scene: sources.scene.display().to_string(),
            shaders: sources.shaders.as_ref().map(|folder| folder.display().to_string()),
            read_only: sources.read_only(),
            gain: DEFAULT_GAIN,
            editor,
            ..State::default()
        };
        Painter {
            sources,
            builder,
            out,
            viewers,
            written: None,
            report,
            state_sender,
            frame_sender,
            scene_view_sender,
            state,
            loaded: None,
            shaders: None,
            last_good: None,
            rejected: Vec::new(),
            truncated: None,
            adapter: device.info.clone(),
            device: Some(device),
            may_use_cpu,
            built_in: Shaders::built_in(),
            running: None,
            parked: None,
            pending: None,
            requests: 0,
            first_valid_request: 0,
            failures: 0,
            problems: Problems::default(),
            camera: None,
            sliders: Sliders::default(),
            restart_pending: false,
            history: History::default(),
            writes,
            files: Vec::new(),
            view: View::default(),
            times,
            gain: DEFAULT_GAIN,
            marks: true,
            display_overrides: DisplayOverrides::default(),
            limits: Limits::default(),
            paused: false,
            camera_history: CameraHistory::default(),
            comparison: Comparison::default(),
            events,
            reported_sizes: None,
            executed_commands: 0,
            frames: 0,
            revision: 0,
            change: None,
            latency: None,
            next_compile_seconds: None,
            first_frame: None,
            last_frame: Instant::now(),
            frame_cost: Duration::ZERO,
        }
    }

    pub fn handle(&mut self, event: Event) {
        match event {
            Event::Files(snapshot, noticed_at, writes) => self.handle_files(*snapshot, noticed_at, writes),
            Event::BuildResult(built) => self.handle_build(*built),
            Event::Command(command) => {
                self.execute(command);
                self.executed_commands += 1;
            }
            Event::Reference(reference) => self.set_reference(reference),
            Event::Measured(errors) => self.set_errors(errors),
            Event::Viewers => {
                // Restarts the latency measurement: no viewer has been waiting for the image, or for a compilation that
                // has already finished.
                if self.pending.is_none() {
                    self.change = self.change.map(|(_, saved)| (Instant::now(), saved));
                    self.next_compile_seconds = None;
                }
            }
            Event::Reading(reading) => self.state.reading = reading,
            #[cfg(test)]
            Event::Lose => self.device.iter().for_each(|device| device.wgpu().0.destroy()),
            Event::Stop => {}
        }
        self.publish();
    }

    fn handle_files(&mut self, snapshot: Snapshot, noticed_at: Instant, writes: u64) {
        self.state.reading = false;
        for (stage, duration) in ["read files", "pack"].into_iter().zip(snapshot.durations) {
            if !duration.is_zero() {
                self.times.record_stage(stage, duration);
            }
        }
        // Snapshots from before the last write are outdated.
        let is_new = writes == self.writes.lock().unwrap_or_else(PoisonError::into_inner).count;
        let loaded_text = self.loaded.as_ref().map(|loaded| loaded.text.as_bytes());
        if let (true, Some((_, FileStamp::Content(content)))) = (is_new, snapshot.files.first())
            && loaded_text != Some(content)
        {
            self.forget_writes();
        }
        let mut display_changed = false;
        if is_new {
            self.files = snapshot.files;
            display_changed = self.set_scene(snapshot.scene);
        }
        match snapshot.shaders {
            Ok(shaders) => {
                self.problems.files = None;
                self.set_shaders(shaders);
            }
            Err(problem) => self.problems.files = Some(*problem),
        }
        self.apply_changed_files(noticed_at, display_changed);
    }

    /// Sets the scene or its errors. Returns true if the display settings changed.
    fn set_scene(&mut self, scene: Result<Arc<Loaded>, Vec<Diagnostic>>) -> bool {
        let mut display_changed = false;
        match scene {
            Ok(loaded) => {
                self.problems.scene.clear();
                // Camera values that were edited in the file replace the values of the moved camera.
                if let (Some(camera), Some(old)) = (&self.camera, &self.loaded) {
                    self.camera = merged(camera, &old.camera, &loaded.camera);
                }
                if self.loaded.as_ref().is_some_and(|old| old.packed != loaded.packed) {
                    self.keep_previous_image();
                    let truncated = self.truncated.take();
                    self.rejected.retain(|shaders| Some(shaders) != truncated.as_ref());
                }
                let old = self.loaded.as_ref();
                let old_notes = old.map_or(&[][..], |old| &old.scene.notes);
                for note in loaded.scene.notes.iter().filter(|note| !old_notes.contains(note)) {
                    (self.report)(Report::Note(note.to_string()));
                }
                display_changed = old.is_some_and(|old| old.scene.view != loaded.scene.view);
                let denoised_before = old.is_some_and(|old| old.scene.render.denoise);
                self.view = match (denoised_before, loaded.scene.render.denoise, self.view) {
                    (false, true, View::Color) => View::Denoised,
                    (true, false, View::Denoised) => View::Color,
                    (.., view) => view,
                };
                self.loaded = Some(loaded);
                self.state.scene_revision += 1;
            }
            Err(problems) => self.problems.scene = problems,
        }
        display_changed
    }

    /// Applies changed files: shows the changes of the display settings, and renders the other changes.
    fn apply_changed_files(&mut self, noticed_at: Instant, display_changed: bool) {
        self.failures = 0;
        self.replace_unavailable_view();
        self.synchronize((noticed_at, true));
        self.upload_sliders((noticed_at, true));
        // If only the display settings changed, shows the current image again. The first image of a new rendering is
        // shown later.
        let has_image = self.running.as_ref().is_some_and(|running| !running.canvas.is_new());
        if display_changed && (self.pending.is_none() || self.is_on_cpu()) && has_image {
            self.record_change((noticed_at, true));
            self.show();
        }
    }

    /// Returns the scene, the shaders and the kernel choice to render: the newest shaders, or the last good shaders if
    /// the newest shaders have errors.
    fn target(&self) -> Option<(Arc<Loaded>, Arc<Shaders>, KernelChoice)> {
        let (loaded, newest) = (self.loaded.clone()?, self.shaders.clone()?);
        let candidates = [Some(newest), self.last_good.clone()].into_iter().flatten();
        let mut kernels = candidates.map(|shaders| {
            let kernel_choice = self.kernel_choice(&loaded, &shaders);
            (shaders, kernel_choice)
        });
        let (shaders, kernel_choice) = kernels.find(|kernel| !self.rejected.contains(kernel))?;
        Some((loaded, shaders, kernel_choice))
    }

    /// Makes the rendering match the current scene and shaders.
    fn synchronize(&mut self, change: (Instant, bool)) {
        let Some((loaded, shaders, kernel_choice)) = self.target() else {
            return;
        };
        if self.shaders.as_ref() == Some(&shaders) {
            self.problems.shader.clear();
        }
        let matches =
            |other_shaders: &Arc<Shaders>, other_choice| *other_shaders == shaders && kernel_choice == other_choice;
        let running = self.running.as_ref();
        let is_running = running.is_some_and(|running| matches(&running.shaders, running.kernel_choice));
        if is_running || self.unpark(&shaders, &kernel_choice) {
            self.pending = None;
            self.first_valid_request = self.requests + 1;
            if !is_running {
                self.show_parked(change);
            }
            self.draw_scene(change);
        } else if kernel_choice.on_cpu {
            self.pending = None;
            self.first_valid_request = self.requests + 1;
            self.run_on_cpu(&loaded, shaders, kernel_choice, change);
        } else if !(self.pending.as_ref()).is_some_and(|pending| matches(&pending.shaders, pending.kernel_choice)) {
            self.change.get_or_insert(change);
            self.request(&loaded, shaders, kernel_choice, change);
        } else {
            self.render_on_cpu_while_compiling(&loaded, shaders, kernel_choice, change);
        }
    }

    fn request(
        &mut self,
        loaded: &Loaded,
        shaders: Arc<Shaders>,
        kernel_choice: KernelChoice,
        (noticed_at, is_save): (Instant, bool),
    ) {
        let running = self.running.as_ref();
        let can_show_scene = running.is_some_and(|running| running.kernel_choice == kernel_choice);
        let needs_kernel = |shaders: &Arc<Shaders>| !self.kernel_choice(loaded, shaders).on_cpu;
        let fallback = self
            .last_good
            .clone()
            .filter(|last_good| !can_show_scene && *last_good != shaders && needs_kernel(last_good));
        self.requests += 1;
        self.builder.request(Request {
            id: self.requests,
            device: self.device.clone(),
            packed: self.packed(loaded),
            shaders: shaders.clone(),
            fallback,
            kernel_choice,
            noticed_at,
        });
        self.pending = Some(Pending {
            id: self.requests,
            shaders: Arc::clone(&shaders),
            kernel_choice,
        });
        self.render_on_cpu_while_compiling(loaded, shaders, kernel_choice, (noticed_at, is_save));
    }

    fn draw_scene(&mut self, change: (Instant, bool)) {
        let Some(loaded) = self.loaded.clone() else { return };
        let packed = self.packed(&loaded);
        let (view, times) = (self.shown_view(), self.times.clone());
        let Some(running) = &mut self.running else { return };
        if running.canvas.renders(&packed) {
            if !self.restart_pending {
                self.change = None;
            }
            return;
        }
        running.halted = false;
        match guarded(|| times.measure("upload", || running.canvas.update(&packed, view))) {
            Ok(true) => self.record_start(change),
            Ok(false) => {} // impossible, because the kernel matches the scene
            Err(error) => self.fail(&error),
        }
    }

    /// Records that an image was started with the current camera.
    fn record_start(&mut self, change: (Instant, bool)) {
        self.restart_pending = false;
        self.report_size();
        self.record_change(change);
    }

    /// Records that a different image is shown from now on.
    fn record_change(&mut self, change: (Instant, bool)) {
        self.revision += 1;
        self.change.get_or_insert(change);
    }

    pub fn has_next_step(&self) -> bool {
        if self
            .viewers
            .as_ref()
            .is_some_and(|viewers| viewers.load(Ordering::SeqCst) == 0)
        {
            return false;
        }
        self.running
            .as_ref()
            .filter(|running| !running.halted)
            .is_some_and(|running| {
                let is_unfinished = !running.canvas.is_done(self.shown_view());
                let is_first = running.canvas.is_new();
                // While a kernel is compiled, only camera moves are rendered; on the CPU, also the first samples.
                let needs_samples = running.canvas.is_on_cpu() && !running.canvas.is_complete(self.shown_view());
                let may_refine = !self.paused && (self.pending.is_none() || needs_samples);
                self.restart_pending || (is_unfinished && (is_first || may_refine))
            })
    }

    pub fn render_step(&mut self) {
        let view = self.shown_view();
        let Some(loaded) = self.loaded.clone() else { return };
        let camera = self.packed_camera(&loaded);
        let Some(running) = &mut self.running else { return };
        // The first image after a restart is never interrupted, so that images are shown while the camera moves.
        if self.restart_pending && (!running.canvas.is_new() || running.canvas.is_done(view)) {
            running.slider_values = self.sliders.bits(&running.sliders);
            let restarted = guarded(|| {
                running.canvas.set_sliders(&running.slider_values)?;
                running.canvas.restart(camera, view)
            });
            match restarted {
                Ok(()) => self.record_start((Instant::now(), false)),
                Err(error) => self.fail(&error),
            }
            return;
        }
        let stepped = guarded(|| self.times.measure("render", || running.canvas.step(view)));
        running
            .canvas
            .dispatches()
            .iter()
            .for_each(|dispatch| self.times.record_dispatch(dispatch));
        match stepped {
            Ok(show) => {
                let is_due = self.last_frame.elapsed() > FRAME_INTERVAL.max(10 * self.frame_cost);
                if show || (is_due && !running.canvas.is_new()) {
                    self.show();
                }
            }
            Err(error) => self.fail(&error),
        }
    }
}
