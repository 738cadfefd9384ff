//! Files from strangers, through the real program: files of every kind that are changed at random, and small ones that ask for much.
//! `scripts/test-slow hostile` changes a thousand of each kind.

#[path = "../../crates/scene/src/gltf/changed.rs"]
mod changed;
#[path = "../../crates/scene/src/gltf/everything.rs"]
mod everything;
mod limits;
mod mutation;
mod roots;
mod seeds;
mod table;

use std::io::Read as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// What a run of the program left.
struct Ran {
    code: i32,
    said: String,
    seconds: f64,
}

/// The address space that a run may have, in KiB: the picture's own, the program's and the stacks of two threads are in it.
const MEMORY: u64 = 1 << 20;
/// The seconds of both cores that a run may take, and after which it is ended whatever it does.
const SECONDS: u64 = 10;
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs the program with its limits in a folder.
///
/// # Panics
///
/// If it ends by a signal or takes too long, or says what a panic says.
fn run(folder: &Path, arguments: &[&str]) -> Ran {
    let script = format!("ulimit -v {MEMORY} -t {SECONDS}; exec \"$0\" \"$@\"");
    let start = Instant::now();
    let mut child = Command::new("bash")
        .args(["-c", &script, env!("CARGO_BIN_EXE_wgray")])
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "2")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut streams: [Box<dyn std::io::Read + Send>; 2] = [
        Box::new(child.stdout.take().unwrap()),
        Box::new(child.stderr.take().unwrap()),
    ];
    let readers = streams.each_mut().map(|stream| {
        let mut stream = std::mem::replace(stream, Box::new(std::io::empty()));
        thread::spawn(move || {
            let mut bytes = Vec::new();
            stream.read_to_end(&mut bytes).map(|_| bytes)
        })
    });
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{arguments:?} hangs");
        }
        thread::sleep(Duration::from_millis(2));
    };
    let bytes = readers.map(|reader| reader.join().unwrap().unwrap()).concat();
    let said = String::from_utf8_lossy(&bytes).into_owned();
    let code = status
        .code()
        .unwrap_or_else(|| panic!("{arguments:?} ended by {status}: {said}"));
    assert!(!said.contains("panicked"), "{arguments:?}: {said}");
    let acts = |c: char| c.is_control() && c != '\n';
    assert!(!said.contains(acts), "{arguments:?}: {said:?}");
    assert!(said.len() < 1 << 16, "{arguments:?} says {} bytes", said.len());
    Ran {
        code,
        said,
        seconds: start.elapsed().as_secs_f64(),
    }
}

/// Renders a scene as a picture of a few pixels.
fn render(folder: &Path, scene: &str) -> Ran {
    render_with(folder, scene, &[])
}

fn render_with(folder: &Path, scene: &str, more: &[&str]) -> Ran {
    let small = [
        "render",
        scene,
        "--device",
        "cpu",
        "--threads",
        "2",
        "--size",
        "8x6",
        "--spp",
        "1",
        "-o",
        "out.png",
    ];
    run(folder, &[&small, more].concat())
}
