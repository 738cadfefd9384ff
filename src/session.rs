//! Renders of one scene that share a device, its kernels, and the packed scene.

use std::ops::ControlFlow;
use std::sync::Arc;
#[cfg(not(target_family = "wasm"))]
use std::sync::mpsc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use wgray_render::pack::{self, PackedShading};
use wgray_scene::{Camera, Scene};
use wgray_trace::records::Packed;

use crate::cancel::CancelToken;
use crate::context::Context;
use crate::device_cost::Workload;
use crate::error::{Error, RenderError};
use crate::options::{Options, set_film_layout};
use crate::picture::Picture;
use crate::progressive::{ProgressiveRender, Status};
use crate::render::{ImageSetup, Progressive, render_progressive_with, render_with};
use crate::renderer::{FaultHandler, OpenScene, Renderer, warnings};
#[cfg(not(target_family = "wasm"))]
use crate::task::{Task, spawn_thread};

/// Number of images for which [`Device::Auto`](crate::Device::Auto) selects the device of a session.
const IMAGES: usize = 16;

/// A scene to be rendered several times. The first render packs the scene (BVHs, textures, tables of the environment)
/// and opens the device; later renders reuse both. Every image has the bits of [`render`](crate::render()).
///
/// [`Device::Auto`](crate::Device::Auto) selects a device for 16 images of the scene.
///
/// ```
/// # fn main() -> Result<(), wgray::Error> {
/// # let smaller = wgray::Overrides { size: Some((16, 16)), ..Default::default() };
/// # let scene = wgray::Scene::load_with("scenes/turntable.toml", &smaller)?;
/// let mut session = wgray::Session::new(&wgray::Context::new(), scene);
/// for frame in 1..=3 {
///     let camera = session.scene().camera_at(frame.into())?;
///     session.set_camera(camera)?;
///     let image = session.render(&wgray::Options::default())?;
///     assert_eq!(image.width(), 16);
/// }
/// # Ok(())
/// # }
/// ```
pub struct Session {
    context: Context,
    scene: Arc<Scene>,
    /// The work that the device is selected for, if it is known.
    workload: Option<Workload>,
    state: SceneState,
    /// The preparation of a cancelled render, which continues in the background; the next render uses its result.
    cancelled: Option<Receiver<(SceneState, Result<ImageSetup, Error>)>>,
}

impl Session {
    /// Starts a session for a scene. The scene is packed by the first render.
    pub fn new(context: &Context, scene: impl Into<Arc<Scene>>) -> Session {
        Session {
            context: context.clone(),
            scene: scene.into(),
            workload: None,
            state: SceneState::default(),
            cancelled: None,
        }
    }

    /// Sets the work that [`Device::Auto`](crate::Device::Auto) selects a device for.
    #[cfg(feature = "cli")]
    pub(crate) fn set_workload(&mut self, workload: Workload) {
        self.workload = Some(workload);
    }

    /// Returns the scene, with the current camera.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Changes the camera. Only the camera's record is packed again, unless the camera's target moves so far that the
    /// coordinates need another origin. Then shapes and lights are packed again, too.
    ///
    /// # Errors
    ///
    /// The device is lost, or its driver reports an error. The next render opens the device again.
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), Error> {
        self.drop_cancelled();
        let scene = Arc::make_mut(&mut self.scene);
        scene.camera = camera;
        self.state.set_camera(scene)
    }

    /// Changes the scene. Materials, textures and the environment are packed again only if any of them differs, and the
    /// BVHs of meshes are built again only for other meshes (by `Arc` identity).
    pub fn set_scene(&mut self, scene: impl Into<Arc<Scene>>) {
        self.drop_cancelled();
        let former = std::mem::replace(&mut self.scene, scene.into());
        self.state.set_scene(&former, &self.scene);
    }

    /// Renders the scene. See [`render`](crate::render()).
    ///
    /// # Errors
    ///
    /// The errors of [`render`](crate::render()).
    pub fn render(&mut self, options: &Options) -> Result<Picture, Error> {
        options.region(&self.scene).map_err(Error::Option)?;
        let scene = Arc::clone(&self.scene);
        render_with(self.renderer(options, warnings())?, &scene, options)
    }

    /// Renders the scene progressively. See [`render_progressive`](crate::render_progressive).
    ///
    /// # Errors
    ///
    /// The errors of [`render_progressive`](crate::render_progressive).
    pub fn render_progressive(
        &mut self,
        options: &Options,
        watch: &mut dyn FnMut(&mut Progressive) -> Result<ControlFlow<()>, Error>,
    ) -> Result<Picture, Error> {
        options.region(&self.scene).map_err(Error::Option)?;
        let scene = Arc::clone(&self.scene);
        render_progressive_with(self.renderer(options, warnings())?, &scene, options, watch)
    }

    /// Starts a render that is continued step by step: packs the scene, opens the device, compiles the kernel and
    /// computes the first hits, if layers need them. No sample is rendered yet.
    ///
    /// This work runs on another thread, except on a thread of a rayon pool and on wasm32, where `cancel` is observed
    /// only before and after the work. Work that is cancelled continues in the background, and the next render uses its
    /// result.
    ///
    /// # Errors
    ///
    /// The errors of [`render`](crate::render()), and [`RenderError::Cancelled`].
    pub fn start(&mut self, options: &Options, cancel: &CancelToken) -> Result<ProgressiveRender<'_>, Error> {
        options.region(&self.scene).map_err(Error::Option)?;
        let setup = self.prepare(options, cancel)?;
        let open = self.state.open.as_mut().ok_or(RenderError::NoFilm)?; // not possible: `prepare` has opened it
        ProgressiveRender::new(open, setup)
    }

    /// Renders the scene on another thread, so that the future never blocks. On wasm32, which has no threads, the future
    /// packs the scene when it is polled first, and renders for about 50 ms each time it is polled. To keep a web page
    /// responsive, poll it from tasks of the event loop, for example from `setTimeout` or a `MessageChannel`.
    ///
    /// Dropping the future cancels the render; the next render packs the scene again.
    ///
    /// ```
    /// # async fn example() -> Result<(), wgray::Error> {
    /// use wgray::{CancelToken, Context, Options, Scene, Session};
    ///
    /// let scene = Scene::load("scene.glb")?;
    /// let mut session = Session::new(&Context::new(), scene);
    /// let image = session.render_async(&Options::default(), &CancelToken::new()).await?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// The errors of [`render`](crate::render()), and [`RenderError::Cancelled`].
    pub fn render_async<'s>(
        &'s mut self,
        options: &Options,
        cancel: &CancelToken,
    ) -> impl Future<Output = Result<Picture, Error>> + Send + use<'s> {
        self.start_async(options.clone(), cancel.child())
    }

    #[cfg(not(target_family = "wasm"))]
    fn start_async(
        &mut self,
        options: Options,
        cancel: CancelToken,
    ) -> impl Future<Output = Result<Picture, Error>> + Send {
        let mut worker = Session {
            context: self.context.clone(),
            scene: Arc::clone(&self.scene),
            workload: self.workload,
            state: std::mem::take(&mut self.state),
            cancelled: self.cancelled.take(),
        };
        let task = Task::spawn(&cancel.clone(), move || {
            let result = worker.render_until_cancelled(&options, &cancel);
            (worker, result)
        });
        async move {
            let (worker, result) = task.await;
            (self.state, self.cancelled) = (worker.state, worker.cancelled);
            result
        }
    }

    #[cfg(target_family = "wasm")]
    async fn start_async(&mut self, options: Options, cancel: CancelToken) -> Result<Picture, Error> {
        const POLL_DURATION: Duration = Duration::from_millis(50);
        let mut render = self.start(&options, &cancel)?;
        loop {
            match render.step_for(POLL_DURATION, &cancel)? {
                Status::Running => yield_now().await,
                Status::Cancelled => return Err(RenderError::Cancelled.into()),
                Status::Converged | Status::Finished => return Ok(render.finish()),
            }
        }
    }

    #[cfg(not(target_family = "wasm"))]
    fn render_until_cancelled(&mut self, options: &Options, cancel: &CancelToken) -> Result<Picture, Error> {
        let mut render = self.start(options, cancel)?;
        match render.run(cancel)? {
            Status::Cancelled => Err(RenderError::Cancelled.into()),
            Status::Running | Status::Converged | Status::Finished => Ok(render.finish()),
        }
    }

    fn prepare(&mut self, options: &Options, cancel: &CancelToken) -> Result<ImageSetup, Error> {
        self.receive_cancelled(cancel)?;
        if cancel.is_cancelled() {
            return Err(RenderError::Cancelled.into());
        }
        let (context, scene, options) = (self.context.clone(), Arc::clone(&self.scene), options.clone());
        let (mut state, workload) = (std::mem::take(&mut self.state), self.workload);
        let prepare = move || {
            let setup = state.prepare(&context, &scene, &options, workload);
            (state, setup)
        };
        #[cfg(not(target_family = "wasm"))]
        if rayon::current_thread_index().is_none() {
            let (sender, receiver) = mpsc::channel();
            spawn_thread(move || {
                // The receiver is dropped if the scene has changed since.
                let _ = sender.send(prepare());
            });
            return self.receive(receiver, cancel)?;
        }
        let (state, setup) = prepare();
        self.state = state;
        match cancel.is_cancelled() {
            true => Err(RenderError::Cancelled.into()),
            false => setup,
        }
    }

    /// Waits for a cancelled preparation. Its result is for the current scene, possibly with other options. A thread of a
    /// rayon pool does not wait, because the preparation runs tasks on the pool: an incomplete result is dropped.
    fn receive_cancelled(&mut self, cancel: &CancelToken) -> Result<(), Error> {
        if rayon::current_thread_index().is_some() {
            self.drop_cancelled();
        } else if let Some(cancelled) = self.cancelled.take() {
            self.receive(cancelled, cancel)?.ok();
        }
        Ok(())
    }

    /// Waits for a preparation. The outer error is [`RenderError::Cancelled`]; the inner result is the result of the
    /// preparation.
    fn receive(
        &mut self,
        receiver: Receiver<(SceneState, Result<ImageSetup, Error>)>,
        cancel: &CancelToken,
    ) -> Result<Result<ImageSetup, Error>, Error> {
        const INTERVAL: Duration = Duration::from_millis(5);
        loop {
            match receiver.recv_timeout(INTERVAL) {
                Ok((state, setup)) => {
                    self.state = state;
                    return Ok(setup);
                }
                Err(RecvTimeoutError::Timeout) if cancel.is_cancelled() => {
                    self.cancelled = Some(receiver);
                    return Err(RenderError::Cancelled.into());
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => panic!("the preparation of the render panicked"),
            }
        }
    }

    /// Ends the wait for a cancelled preparation. Keeps its result if the preparation is complete.
    fn drop_cancelled(&mut self) {
        if let Some((state, _)) = self.cancelled.take().and_then(|receiver| receiver.try_recv().ok()) {
            self.state = state;
        }
    }

    /// Packs the scene and opens the device, unless this has been done for the same options.
    pub(crate) fn renderer<'a>(
        &'a mut self,
        options: &Options,
        on_fault: FaultHandler<'a>,
    ) -> Result<Renderer<'a>, Error> {
        self.receive_cancelled(&CancelToken::new())?;
        self.state
            .renderer(&self.context, &self.scene, options, self.workload, on_fault)
    }

    /// Returns the scene, packed for these options.
    #[cfg(feature = "cli")]
    pub(crate) fn packed(&mut self, options: &Options) -> Arc<Packed> {
        self.state.packed(&self.scene, options)
    }
}

/// The packed scene, and the device on which it is open.
#[derive(Default)]
struct SceneState {
    /// Packed materials, textures and environment; `None` before the first render.
    shading: Option<PackedShading>,
    /// The packed scene while no device is open for it.
    packed: Option<Arc<Packed>>,
    open: Option<OpenScene>,
}

impl SceneState {
    fn set_camera(&mut self, scene: &Scene) -> Result<(), Error> {
        let camera = &scene.camera;
        if let Some(open) = self.open.as_mut().filter(|open| keeps_kernel(open, camera)) {
            let edited = open.edit_camera(|packed| pack::set_camera(packed, scene));
            if edited.is_err() {
                self.close();
            }
            return Ok(edited?);
        }
        self.close();
        if let (Some(mut packed), Some(shading)) = (self.packed.take(), &self.shading) {
            if packed.origin == pack::origin(camera) {
                pack::set_camera(Arc::make_mut(&mut packed), scene);
            } else {
                packed = Arc::new(pack::pack_with(scene, shading));
            }
            self.packed = Some(packed);
        }
        Ok(())
    }

    fn set_scene(&mut self, former: &Scene, scene: &Scene) {
        self.close();
        self.packed = None;
        match &self.shading {
            Some(shading) if PackedShading::is_shared(former, scene) => {
                self.packed = Some(Arc::new(pack::pack_with(scene, shading)));
            }
            _ => self.shading = None,
        }
    }

    fn prepare(
        &mut self,
        context: &Context,
        scene: &Scene,
        options: &Options,
        workload: Option<Workload>,
    ) -> Result<ImageSetup, Error> {
        let mut renderer = self.renderer(context, scene, options, workload, warnings())?;
        ImageSetup::new(scene, &mut renderer, options)
    }

    fn renderer<'a>(
        &'a mut self,
        context: &Context,
        scene: &Scene,
        options: &Options,
        workload: Option<Workload>,
        mut on_fault: FaultHandler<'a>,
    ) -> Result<Renderer<'a>, Error> {
        let film_layout = options.film_layout(scene);
        let workload_of = |packed: &Packed| workload.unwrap_or_else(|| Workload::new(packed, options, IMAGES));
        let open = match self.open.take() {
            Some(open) if open.suits(options, film_layout) && open.is_fast_enough(workload_of(open.scene())) => open,
            other => {
                self.open = other;
                let packed = self.packed(scene, options);
                let workload = workload_of(&packed);
                OpenScene::new(context, packed, options, workload, &mut on_fault)?
            }
        };
        self.packed = None;
        Ok(Renderer::new(self.open.insert(open), on_fault))
    }

    fn packed(&mut self, scene: &Scene, options: &Options) -> Arc<Packed> {
        let film_layout = options.film_layout(scene);
        if let Some(open) = &self.open
            && open.suits(options, film_layout)
        {
            return Arc::clone(open.scene());
        }
        self.close();
        let packed = self.packed.get_or_insert_with(|| {
            let shading = self.shading.insert(PackedShading::of(scene));
            Arc::new(pack::pack_with(scene, shading))
        });
        if packed.film_layout() != film_layout {
            set_film_layout(Arc::make_mut(packed), film_layout);
        }
        Arc::clone(packed)
    }

    /// Closes the scene, but not its device, which the context keeps.
    fn close(&mut self) {
        if let Some(open) = self.open.take() {
            self.packed = Some(open.into_scene());
        }
    }
}

/// Returns a future that is pending once, and that can be polled again at once.
#[cfg(target_family = "wasm")]
fn yield_now() -> impl Future<Output = ()> + Send {
    let mut has_yielded = false;
    std::future::poll_fn(move |context| {
        if has_yielded {
            return std::task::Poll::Ready(());
        }
        has_yielded = true;
        context.waker().wake_by_ref();
        std::task::Poll::Pending
    })
}

/// Returns true if only the camera's record changes: neither the origin of coordinates nor the kernel.
fn keeps_kernel(open: &OpenScene, camera: &Camera) -> bool {
    let packed = open.scene();
    packed.origin == pack::origin(camera)
        && pack::with_camera_features(&packed.specialization, camera) == packed.specialization
}
