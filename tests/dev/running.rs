//! A temporary folder with a scene and shaders, and a development session that watches it.

use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wgray::image::Pixels;
use wgray::scene::{Overrides, Scene};
use wgray_dev::{Content, Diagnostic, Frame, Listener, Session, Settings, Sources, State};
use wgray_image::Region;
use wgray_render::gpu::compose::{Shaders, built_in};
use wgray_render::gpu::{AdapterChoice, Gpu, Options, choose};
use wgray_render::job::{self, WorkSplit};
use wgray_render::pack::pack;
use wgray_trace::film::{Film, mean};
use wgray_trace::records::Packed;

/// Timeout of all waits, long enough for a busy machine.
pub const TIMEOUT: Duration = Duration::from_secs(40);
/// Time after which a session has handled all events and is idle.
pub const IDLE_TIME: Duration = Duration::from_millis(400);

pub const SCENE: &str = "# a small scene
[image]
width = 40
height = 30

[camera] # looks from the front
position = [0, -4, 1] # a comment
look_at = [0, 0, 0.5]
fov = 40

[render]
ambient = [0.2, 0.2, 0.2]
pixel_samples = { pattern = \"grid\", count = 4 }
light_samples = { pattern = \"grid\", count = 4 }

[materials.red]
type = \"phong\"
color = [0.8, 0.1, 0.1]
shininess = 16

[[lights]]
type = \"rectangle\"
center = [0, 0, 3]
size = [1, 1]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [0.8, 0.8, 0.8]

[[shapes]]
type = \"sphere\"
material = \"red\"
center = [0, 0, 0.5]
radius = 0.5

[[shapes]]
type = \"plane\"
material = \"red\"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
";

/// The kernel that computes the color of every pixel.
pub const KERNEL: &str = "shaders/kernels/render.wgsl";
/// The expression in the kernel whose values are summed.
pub const RADIANCE: &str = "path_value(path)";

/// A temporary folder with a scene and shaders.
pub struct Files {
    pub folder: TempDir,
}

impl Files {
    pub fn new(scene: &str) -> Files {
        let files = Files {
            folder: tempfile::tempdir().unwrap(),
        };
        files.write_shaders();
        files.write("scene.toml", scene);
        files
    }

    /// Writes all built-in shaders.
    pub fn write_shaders(&self) {
        for (name, text) in built_in() {
            let file = self.path(&format!("shaders/{name}"));
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, text).unwrap();
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// Saves a file as most editors do: writes a new file and renames it.
    pub fn save_by_rename(&self, name: &str, text: &str) {
        self.write("new~", text);
        fs::rename(self.path("new~"), self.path(name)).unwrap();
    }

    pub fn edit(&self, name: &str, old: &str, new: &str) {
        let text = self.read(name);
        assert!(text.contains(old), "{name} has no '{old}'");
        self.write(name, &text.replacen(old, new, 1));
    }

    /// Saves a kernel that multiplies the colors of the image by `factor`.
    pub fn tint(&self, factor: f64) {
        let kernel = Shaders::built_in().text("kernels/render.wgsl").to_string();
        assert!(kernel.contains(RADIANCE));
        self.write(
            KERNEL,
            &kernel.replace(RADIANCE, &format!("({RADIANCE} * vec4f(vec3f({factor:?}), 1.0))")),
        );
    }

    pub fn sources(&self) -> Sources {
        Sources {
            scene: self.path("scene.toml"),
            overrides: Overrides::default(),
            shaders: Some(self.path("shaders")),
        }
    }

    pub fn start(&self) -> TestSession {
        TestSession::start(self.sources(), None)
    }

    pub fn packed(&self) -> Packed {
        pack(&Scene::load(self.path("scene.toml")).unwrap())
    }

    /// Returns the image that `render` makes of the files.
    pub fn rendered_image(&self) -> Pixels {
        let packed = self.packed();
        let (width, height) = (packed.camera.width, packed.camera.height);
        let colors = self.render_values(&packed, &|film, i| mean(film.sums[i]));
        Pixels { width, height, colors }
    }

    /// Returns `value` of each pixel of the film that `render` makes.
    pub fn render_values<T>(&self, packed: &Packed, value: &dyn Fn(&Film, usize) -> T) -> Vec<T> {
        let device = choose(&AdapterChoice::Auto).unwrap();
        let shaders = Shaders::read(&self.path("shaders")).unwrap();
        let options = Options {
            baked: false,
            ..Options::best(&device)
        };
        let mut gpu = Gpu::new(&device, packed, &shaders, options).unwrap();
        let mut values = Vec::new();
        let region = Region::whole(packed.camera.width, packed.camera.height);
        job::render(
            &mut gpu,
            region,
            packed.sampling.pixel_samples,
            &WorkSplit::default(),
            &mut |_| true,
            &mut |film| {
                values.extend((0..film.sums.len()).map(|i| value(&film, i)));
                Ok(())
            },
        )
        .unwrap();
        values
    }
}

pub struct TestSession {
    pub inner: Session,
}

/// Serves a session until the process ends, and returns the session and its address.
pub fn serve(session: TestSession) -> (&'static TestSession, SocketAddr) {
    let listener = Listener::open("127.0.0.1:0").unwrap();
    let address = listener.address().unwrap();
    let session: &'static TestSession = Box::leak(Box::new(session));
    std::thread::spawn(move || listener.serve(&session.inner).unwrap());
    (session, address)
}

impl TestSession {
    pub fn start(sources: Sources, out: Option<PathBuf>) -> TestSession {
        TestSession::start_on(sources, out, AdapterChoice::Auto)
    }

    pub fn start_on(sources: Sources, out: Option<PathBuf>, device: AdapterChoice) -> TestSession {
        let settings = Settings {
            sources,
            device,
            only_for_viewers: out.is_some(), // has no effect if there is an output file
            out,
            editor: None,
            report: Box::new(|_| ()),
        };
        TestSession {
            inner: Session::start(settings).unwrap(),
        }
    }

    /// Returns a state that is not older than the newest frame: sessions publish a frame before its state.
    #[track_caller]
    pub fn state(&self) -> Arc<State> {
        let newest = self.frame().map_or(0, |frame| frame.header.number);
        self.wait("the state of the newest frame", |session| {
            Some(session.published_state()).filter(|state| state.frame >= newest)
        })
    }

    fn published_state(&self) -> Arc<State> {
        self.inner.state.borrow().clone()
    }

    pub fn frame(&self) -> Option<Arc<Frame>> {
        self.inner.frames.borrow().clone()
    }

    #[track_caller]
    pub fn wait<T>(&self, event: &str, ready: impl Fn(&TestSession) -> Option<T>) -> T {
        let start = Instant::now();
        while start.elapsed() < TIMEOUT {
            if let Some(value) = ready(self) {
                return value;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        panic!(
            "{event}: not within {TIMEOUT:?}; state: {:?}, frame: {:?}",
            self.published_state(),
            self.frame().map(|frame| frame.header.clone())
        );
    }

    /// Waits for a complete image that is newer than `revision`.
    #[track_caller]
    pub fn wait_for_complete_image(&self, revision: u64) -> Arc<Frame> {
        self.wait("a finished image", |session| {
            session
                .frame()
                .filter(|frame| frame.header.done && frame.header.revision > revision)
        })
    }

    /// Waits until the complete image equals the image that `render` makes.
    #[track_caller]
    pub fn wait_for_rendered_image(&self, files: &Files) {
        let expected = files.rendered_image();
        self.wait("the image that render makes", |session| {
            let frame = session.frame()?;
            matches!(&frame.content, Content::Color(pixels) if frame.header.done && *pixels == expected).then_some(())
        });
        assert_eq!(self.state().problems, []);
    }

    #[track_caller]
    pub fn wait_for_problem(&self) -> Diagnostic {
        self.wait("a problem", |session| session.state().problems.first().cloned())
    }

    #[track_caller]
    pub fn wait_for_no_problem(&self) {
        self.wait("no problem", |session| {
            (session.state().problems.is_empty() && !session.state().compiling).then_some(())
        });
    }

    pub fn revision(&self) -> u64 {
        self.frame().map_or(0, |frame| frame.header.revision)
    }

    pub fn colors(&self) -> Pixels {
        match &self.frame().unwrap().content {
            Content::Color(pixels) => pixels.clone(),
            other => panic!("{other:?}"),
        }
    }
}
