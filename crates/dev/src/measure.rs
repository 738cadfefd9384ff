//! Measurement of the time from a change to its image, on copies of a scene and of the shaders.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

use toml_edit::{DocumentMut, value};

use super::camera::Move;
use super::messages::{Command, Set};
use super::picture::Frame;
use super::save::replace;
use super::session::{Session, Settings};
use super::source::Sources;
use wgray_render::gpu::AdapterChoice;
use wgray_render::gpu::compose::{self, Shaders};
use wgray_scene::{Overrides, is_course, is_gltf, is_mesh};

/// Number of changes of each kind.
const ROUNDS: usize = 7;
/// The first seed, which hardly any scene uses.
const SEEDS: i64 = 7_361_000;
/// Maximum time to wait for an image.
const LONGEST: Duration = Duration::from_secs(120);
/// The expression in `kernels/render.wgsl` that is changed, so that the image changes and no cache contains the
/// kernel.
const PLACE: &str = "path_value(path)";

/// The times of one kind of change.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The kind of change.
    pub change: &'static str,
    /// Times until the rendering of the old image was given up.
    pub stopped: Vec<Duration>,
    /// Times until the first image, which may be coarse.
    pub first: Vec<Duration>,
    /// Times until each pixel has a sample.
    pub whole: Vec<Duration>,
}

/// Measures setting a value as on the page, saves of the scene, moves of the camera and saves of a shader. Copies are
/// saved, that of the scene in its own folder.
///
/// # Errors
///
/// The message for the user; `None` if it was stopped. The copies are removed in every case.
pub fn measure(
    sources: &Sources,
    device: AdapterChoice,
    stopped: &AtomicBool,
) -> Result<Vec<Measured>, Option<String>> {
    let told = |error: std::io::Error| Some(error.to_string());
    for (is_it, kind) in [
        (is_course as fn(&Path) -> bool, "JSON"),
        (is_gltf, "glTF"),
        (is_mesh, "a mesh"),
    ] {
        if is_it(&sources.scene) {
            let place = sources.scene.display();
            return Err(Some(format!("{place}: only TOML scenes can be measured, not {kind}")));
        }
    }
    let text =
        fs::read_to_string(&sources.scene).map_err(|error| Some(format!("{}: {error}", sources.scene.display())))?;
    let folder = sources
        .scene
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let scene = tempfile::Builder::new()
        .prefix(".wgray-measure-")
        .suffix(".toml")
        .tempfile_in(folder)
        .map_err(told)?;
    fs::write(scene.path(), &text).map_err(told)?;
    let shaders = match &sources.shaders {
        Some(folder) => Shaders::read(folder).map_err(told)?,
        None => Shaders::built_in(),
    };
    let copies = tempfile::tempdir().map_err(told)?;
    for (name, _) in compose::built_in() {
        let path = copies.path().join(name);
        fs::create_dir_all(path.parent().unwrap_or(copies.path())).map_err(told)?;
        fs::write(path, shaders.text(name)).map_err(told)?;
    }
    let session = Session::start(Settings {
        sources: Sources {
            scene: scene.path().to_owned(),
            overrides: Overrides {
                seed: None, // it is what changes
                ..sources.overrides.clone()
            },
            shaders: Some(copies.path().to_owned()),
        },
        device,
        out: None,
        only_for_viewers: false,
        editor: None,
        report: Box::new(|_| ()),
    })
    .map_err(|error| Some(error.to_string()))?;
    let mut clock = Clock { session, stopped };
    clock.after("start", || Ok(()))?;
    let kernel = copies.path().join("kernels/render.wgsl");
    let kernel_text = shaders.text("kernels/render.wgsl").to_string();
    if !kernel_text.contains(PLACE) {
        return Err(Some(format!(
            "kernels/render.wgsl must contain '{PLACE}', which the measurement changes"
        )));
    }
    // Each run has its own kernels: the factors differ as f32.
    let now = SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .map_or(0, |time| time.as_millis() % 65_536);
    Ok(vec![
        clock.all("value set", &mut |i, session| {
            session.send(Command::Set(Set {
                path: "render.seed".to_owned(),
                value: (SEEDS + i as i64).into(),
                gesture: None,
            }));
            Ok(())
        })?,
        clock.all("scene save", &mut |i, _| {
            // In one step: half of a large file would be read, and reported as an error.
            replace(scene.path(), reseeded(&text, i).as_bytes()).map_err(told)
        })?,
        clock.all("camera move", &mut |_, session| {
            session.send(Command::Move(Move::Orbit(0.05, 0.0)));
            Ok(())
        })?,
        clock.all("shader save", &mut |i, _| {
            let factor = 1.0 + (now as f64 * ROUNDS as f64 + i as f64) / f64::from(1 << 21);
            let text = kernel_text.replace(PLACE, &format!("({PLACE} * vec4f(vec3f({factor:?}), 1.0))"));
            replace(&kernel, text.as_bytes()).map_err(told)
        })?,
    ])
}

/// Returns the scene with another seed, which changes the image of any scene.
fn reseeded(text: &str, i: usize) -> String {
    let mut document: DocumentMut = text.parse().unwrap_or_default();
    document["render"]["seed"] = value(SEEDS + (ROUNDS + i) as i64);
    document.to_string()
}

/// Makes the change of a round.
type Change<'a> = dyn FnMut(usize, &Session) -> Result<(), Option<String>> + 'a;

struct Clock<'a> {
    session: Session,
    stopped: &'a AtomicBool,
}

impl Clock<'_> {
    fn all(&mut self, change: &'static str, make: &mut Change) -> Result<Measured, Option<String>> {
        let mut measured = Measured {
            change,
            stopped: Vec::new(),
            first: Vec::new(),
            whole: Vec::new(),
        };
        for i in 0..ROUNDS {
            let session = &self.session;
            let [stopped, first, whole] = self.after(change, || make(i, session))?;
            measured.stopped.push(stopped);
            measured.first.push(first);
            measured.whole.push(whole);
            std::thread::sleep(Duration::from_millis(200)); // into the middle of what is being rendered
        }
        Ok(measured)
    }

    /// Returns the times after a change.
    fn after(
        &self,
        change: &str,
        make: impl FnOnce() -> Result<(), Option<String>>,
    ) -> Result<[Duration; 3], Option<String>> {
        let revision = self.frame().map(|frame| frame.header.revision);
        let start = Instant::now();
        make()?;
        let (mut stopped, mut first) = (None, None);
        while start.elapsed() < LONGEST {
            if self.stopped.load(Ordering::Relaxed) {
                return Err(None);
            }
            if let Some(problem) = self.session.state.borrow().problems.first() {
                return Err(Some(format!("{change}: {}", problem.message)));
            }
            if let Some(refused) = self.session.state.borrow().notice.as_ref().filter(|notice| notice.bad) {
                return Err(Some(format!("{change}: {}", refused.text)));
            }
            if self.session.state.borrow().compiling {
                stopped.get_or_insert(start.elapsed());
            }
            if let Some(frame) = self.frame().filter(|frame| Some(frame.header.revision) > revision) {
                let first = *first.get_or_insert(start.elapsed());
                let header = &frame.header;
                if header.sent == header.finest && header.samples > 0 {
                    return Ok([stopped.unwrap_or(first), first, start.elapsed()]);
                }
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Err(Some(format!("{change}: no image within {} s", LONGEST.as_secs())))
    }

    fn frame(&self) -> Option<Arc<Frame>> {
        self.session.frames.borrow().clone()
    }
}
