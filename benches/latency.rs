//! Latency of the development mode: the time from its start, or from a change of a scene or shader, to the new image. The
//! benchmark changes copies in a temporary folder. A model is not changed.
//!
//! ```sh
//! cargo bench --bench latency                              # scenes/cornell.toml
//! cargo bench --bench latency -- scenes/mirror-glass.toml  # any scene that refers to no other files
//! cargo bench --bench latency -- model.glb                 # the start with a model
//! ```

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use tempfile::NamedTempFile;
use wgray_dev::{Command, Move, Session, Set, Settings, Sources};
use wgray_render::gpu::AdapterChoice;
use wgray_render::gpu::compose::{Shaders, built_in};
use wgray_scene::Overrides;

/// Number of changes of each kind.
const ROUNDS: usize = 7;
/// Maximum time to wait for an image.
const TIMEOUT: Duration = Duration::from_secs(120);
/// The expression of `kernels/render.wgsl` that a shader change multiplies by a new factor.
const EXPRESSION: &str = "path_value(path)";

/// Times from a change until the old image is discarded, until the first new image, and until each pixel has a sample.
type Times = [Duration; 3];

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench"); // cargo adds --bench
    let scene = arguments.next().unwrap_or_else(|| "scenes/cornell.toml".to_owned());
    let header = || {
        println!(
            "{:<14}{:>16}{:>18}{:>22}",
            "change", "old discarded", "first image", "every pixel sampled"
        )
    };
    println!("{scene}: milliseconds, median and maximum");
    if !scene.ends_with(".toml") {
        let times: Vec<Times> = (0..ROUNDS).map(|_| start(Path::new(&scene), None).1).collect();
        header();
        return print_times("start", &times);
    }
    let text = fs::read_to_string(&scene).unwrap_or_else(|error| panic!("{scene}: {error}"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("scene.toml");
    fs::write(&file, &text).expect("a copy of the scene");
    let shaders = folder.path().join("shaders");
    for (name, text) in built_in() {
        let path = shaders.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a copy of a shader");
    }
    let (session, times) = start(&file, Some(&shaders));
    header();
    print_times("start", &[times]);
    // Seeds and factors differ in every run, so that no cache contains their kernels.
    let now = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |time| time.as_millis() as usize % 65_536);
    let number = |i: usize| 7_361_000 + now * ROUNDS + i;
    let scene_with_new_seed = |i: usize| {
        let mut table: toml::Table = text.parse().expect("a scene in TOML");
        let render = table.entry("render").or_insert(toml::Table::new().into());
        let render = render.as_table_mut().expect("a table");
        render.insert("seed".to_owned(), ((number(i) + ROUNDS) as i64).into());
        table.to_string()
    };
    let kernel = Shaders::built_in().text("kernels/render.wgsl").to_owned();
    assert!(kernel.contains(EXPRESSION));
    let scaled_kernel = |i: usize| {
        let factor = 1.0 + number(i) as f64 / f64::from(1 << 23);
        kernel.replace(EXPRESSION, &format!("({EXPRESSION} * vec4f(vec3f({factor:?}), 1.0))"))
    };
    rounds(&session, "value set", |i| {
        session.send(Command::Set(Set {
            path: "render.seed".to_owned(),
            value: (number(i) as i64).into(),
            gesture: None,
        }));
    });
    rounds(&session, "scene save", |i| replace(&file, &scene_with_new_seed(i)));
    rounds(&session, "camera move", |_| {
        session.send(Command::Move(Move::Orbit(0.05, 0.0)));
    });
    rounds(&session, "shader save", |i| {
        replace(&shaders.join("kernels/render.wgsl"), &scaled_kernel(i))
    });
}

/// Starts the development mode with built-in shaders or those of a folder. Returns the session, and the times until its
/// first images.
fn start(scene: &Path, shaders: Option<&Path>) -> (Session, Times) {
    let begin = Instant::now();
    let session = Session::start(Settings {
        sources: Sources {
            scene: scene.to_owned(),
            overrides: Overrides::default(),
            shaders: shaders.map(Path::to_owned),
        },
        device: AdapterChoice::Auto,
        out: None,
        only_for_viewers: false,
        editor: None,
        report: Box::new(|_| ()),
    })
    .unwrap_or_else(|error| panic!("{}: {error}", scene.display()));
    let times = wait(&session, begin, None);
    (session, times)
}

/// Replaces a file atomically, like an editor.
fn replace(path: &Path, text: &str) {
    let mut file = NamedTempFile::new_in(path.parent().expect("a folder")).expect("a file");
    file.write_all(text.as_bytes()).expect("a written file");
    file.persist(path).expect("a replaced file");
}

/// Repeats a change and prints its times.
fn rounds(session: &Session, name: &str, change: impl Fn(usize)) {
    let times: Vec<Times> = (0..ROUNDS)
        .map(|i| {
            let times = measure(session, || change(i));
            std::thread::sleep(Duration::from_millis(200)); // the next change interrupts a render
            times
        })
        .collect();
    print_times(name, &times);
}

fn print_times(name: &str, times: &[Times]) {
    let cells = [0, 1, 2].map(|column| {
        let mut column: Vec<u128> = times.iter().map(|times| times[column].as_millis()).collect();
        column.sort_unstable();
        format!("{} {:>6}", column[column.len() / 2], column[column.len() - 1])
    });
    println!("{name:<14}{:>16}{:>18}{:>22}", cells[0], cells[1], cells[2]);
}

/// Applies a change and waits until its image has a sample in each pixel.
fn measure(session: &Session, change: impl FnOnce()) -> Times {
    let revision = session.frames.borrow().as_ref().map(|frame| frame.header.revision);
    let begin = Instant::now();
    change();
    wait(session, begin, revision)
}

/// Waits until the image of a newer revision has a sample in each pixel. Returns the times since `begin`.
fn wait(session: &Session, begin: Instant, revision: Option<u64>) -> Times {
    let frame = || session.frames.borrow().clone();
    let (mut discarded, mut first) = (None, None);
    while begin.elapsed() < TIMEOUT {
        let state = session.state.borrow().clone();
        assert!(state.problems.is_empty(), "{}", state.problems[0].message);
        assert!(
            state.notice.as_ref().is_none_or(|notice| !notice.bad),
            "{:?}",
            state.notice.as_ref().map(|n| &n.text)
        );
        if state.compiling {
            discarded.get_or_insert(begin.elapsed());
        }
        if let Some(frame) = frame().filter(|frame| Some(frame.header.revision) > revision) {
            let first = *first.get_or_insert(begin.elapsed());
            if frame.header.sent == frame.header.finest && frame.header.samples > 0 {
                return [discarded.unwrap_or(first), first, begin.elapsed()];
            }
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("no image within {} s", TIMEOUT.as_secs());
}
