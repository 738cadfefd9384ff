//! Untrusted files: random mutations of every format, and small files that request excessive resources.
//! `scripts/test-slow hostile` tries a thousand mutations of each format.

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

struct RunResult {
    code: i32,
    output: String,
    seconds: f64,
}

/// Maximum address space in KiB, including the executable and the stacks of two threads.
const MAX_MEMORY_KIB: u64 = 1 << 20;
/// Maximum CPU time in seconds, over all threads.
const MAX_CPU_SECONDS: u64 = 10;
const TIMEOUT: Duration = Duration::from_secs(60);

/// Runs the program with these limits.
///
/// # Panics
///
/// If the program is killed, hangs, panics, or prints control characters or more than 64 KiB.
fn run(folder: &Path, arguments: &[&str]) -> RunResult {
    let script = format!("ulimit -v {MAX_MEMORY_KIB} -t {MAX_CPU_SECONDS}; exec \"$0\" \"$@\"");
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
        if start.elapsed() > TIMEOUT {
            child.kill().unwrap();
            panic!("{arguments:?} hangs");
        }
        thread::sleep(Duration::from_millis(2));
    };
    let bytes = readers.map(|reader| reader.join().unwrap().unwrap()).concat();
    let output = String::from_utf8_lossy(&bytes).into_owned();
    let code = status
        .code()
        .unwrap_or_else(|| panic!("{arguments:?} ended by {status}: {output}"));
    assert!(!output.contains("panicked"), "{arguments:?}: {output}");
    let is_control = |c: char| c.is_control() && c != '\n';
    assert!(!output.contains(is_control), "{arguments:?}: {output:?}");
    assert!(output.len() < 1 << 16, "{arguments:?} prints {} bytes", output.len());
    RunResult {
        code,
        output,
        seconds: start.elapsed().as_secs_f64(),
    }
}

fn render(folder: &Path, scene: &str) -> RunResult {
    render_with(folder, scene, &[])
}

fn render_with(folder: &Path, scene: &str, extra_options: &[&str]) -> RunResult {
    let options = [
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
    run(folder, &[&options, extra_options].concat())
}
