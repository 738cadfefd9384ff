//! End-to-end tests of the `wgray` binary.

mod bad_input;
mod commands;
mod denoise;
mod diff;
mod farm;
mod files;
mod frames;
mod gltf;
mod golden;
mod help;
mod info;
mod jobs;
mod log;
mod manual;
mod messages;
mod noise;
mod options;
#[cfg(target_os = "linux")]
mod out_of_memory;
mod output;
mod outputs;
mod pictures;
#[cfg(unix)]
mod preview;
mod scene_options;
#[cfg(unix)]
mod summary;

use std::path::Path;

use crate::sources::path as project_path;
use crate::test_folder::TestFolder;

/// Restores the default actions of signals for child processes: shells ignore SIGINT for background jobs, `nohup`
/// ignores SIGHUP.
#[cfg(unix)]
pub fn restore_signal_defaults() {
    // SAFETY: setting the default action of a signal has no precondition; no handler of this process is lost.
    unsafe {
        libc::signal(libc::SIGINT, libc::SIG_DFL);
        libc::signal(libc::SIGHUP, libc::SIG_DFL);
    }
}

struct RunResult {
    code: i32,
    stdout: String,
    /// Standard error without the lines of `summary`.
    stderr: String,
    /// Summary lines, such as `box.png: 1024 x 1024, 64 spp, 12.3 s`, and progress lines, which slow machines print.
    summary: Vec<String>,
}

impl RunResult {
    fn new(code: Option<i32>, stdout: String, stderr: &str, arguments: &[&str]) -> RunResult {
        let requests_progress = arguments.contains(&"--progress");
        let (summary, messages): (Vec<&str>, Vec<&str>) = (stderr.split_inclusive('\n'))
            .partition(|line| is_summary(line) || !requests_progress && is_progress(line));
        RunResult {
            code: code.unwrap_or(-1),
            stdout,
            stderr: messages.concat(),
            summary: summary.iter().map(|line| line.trim_end().to_owned()).collect(),
        }
    }
}

/// Removes summary lines and progress lines.
pub fn without_summary(stderr: &str) -> String {
    let lines = stderr.split_inclusive('\n');
    lines.filter(|line| !is_summary(line) && !is_progress(line)).collect()
}

/// Returns true for progress lines, which the program prints after ten seconds without a terminal.
fn is_progress(line: &str) -> bool {
    line.contains(" % done after ") && !line.starts_with('{')
}

/// Returns true for `NAMES: WIDTH x HEIGHT, SAMPLES spp, SECONDS s`, also with the noise after the samples.
fn is_summary(line: &str) -> bool {
    let Some((_, rest)) = line.trim_end().rsplit_once(": ") else {
        return false;
    };
    let mut words: Vec<&str> = rest.split(' ').collect();
    if words.get(5) == Some(&"noise") {
        words.drain(5..9); // `noise 0.0187 (median 0.0041),`
    }
    let is_number = |text: &str| text.parse::<f64>().is_ok();
    match words.as_slice() {
        [width, "x", height, samples, "spp,", seconds, "s"] => {
            [*width, height.trim_end_matches(','), seconds]
                .into_iter()
                .all(is_number)
                && samples.split('-').all(is_number)
        }
        _ => false,
    }
}

/// A scene of 10 x 6 pixels with different random samples in each pixel.
const SCENE: &str = r#"image = { width = 10, height = 6 }
camera = { position = [0, -5, 1], look_at = [0, 0, 1], fov = 40 }
[render]
ambient = [0.1, 0.1, 0.1]
background = [0.2, 0.3, 2]
pixel_samples = { pattern = "random", count = 3 }
light_samples = { pattern = "grid", count = 4 }
[materials.gray]
type = "phong"
color = [0.5, 0.4, 0.3]
[[lights]]
type = "rectangle"
center = [0, -1, 4]
size = [2, 2]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [0.8, 0.8, 0.8]
[[shapes]]
type = "sphere"
material = "gray"
center = [0, 0, 1]
radius = 0.8
[[shapes]]
type = "plane"
material = "gray"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
"#;

impl TestFolder {
    fn new() -> TestFolder {
        TestFolder::with_file("small.toml", SCENE)
    }

    /// Returns the names of all files, including hidden files, except `small.toml`.
    fn files(&self) -> Vec<String> {
        self.files_except(|name| name == "small.toml")
    }

    fn run(&self, arguments: &[&str]) -> RunResult {
        self.run_with(arguments, &[])
    }

    fn run_with(&self, arguments: &[&str], variables: &[(&str, &str)]) -> RunResult {
        let mut command = assert_cmd::Command::new(program());
        command
            .current_dir(self.folder())
            .args(arguments)
            .envs(variables.iter().copied());
        let output = command
            .timeout(std::time::Duration::from_secs(120))
            .output()
            .expect("the program runs");
        let stdout = String::from_utf8(output.stdout).expect("UTF-8");
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        RunResult::new(output.status.code(), stdout, &stderr, arguments)
    }

    /// Runs a shell command in which `$0` is the program.
    #[cfg(unix)]
    fn shell(&self, shell: &str, line: &str) -> RunResult {
        let output = std::process::Command::new(shell)
            .current_dir(self.folder())
            .args(["-c", line])
            .arg(program())
            .output()
            .expect("a shell");
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        let stderr = String::from_utf8_lossy(&output.stderr);
        let arguments: Vec<&str> = line.split_whitespace().collect();
        RunResult::new(output.status.code(), stdout, &stderr, &arguments)
    }

    /// Runs the program, which must succeed without messages.
    fn run_quietly(&self, arguments: &[&str]) {
        let result = self.run(arguments);
        assert_eq!(
            (result.code, result.stdout.as_str(), result.stderr.as_str()),
            (0, "", ""),
            "{arguments:?}"
        );
    }
}

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_wgray"))
}

/// Environment variables with which the Vulkan loader finds no driver.
const NO_DRIVER: [(&str, &str); 2] = [
    ("VK_DRIVER_FILES", "/nonexistent.json"),
    ("VK_ICD_FILENAMES", "/nonexistent.json"),
];

/// Returns width, height and bytes of an 8-bit RGB PNG.
fn read_png(path: &Path) -> (u32, u32, Vec<u8>) {
    let picture = image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let image::DynamicImage::ImageRgb8(picture) = picture else {
        panic!("{} is not an 8-bit RGB image", path.display());
    };
    (picture.width(), picture.height(), picture.into_raw())
}

fn project_scene(name: &str) -> String {
    project_path("scenes").join(name).display().to_string()
}
