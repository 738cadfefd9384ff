//! `wgray dev`: renders a scene again whenever the scene or a shader is saved, and shows the image on a web page.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use crate::error::RenderError;
use crate::image::Output;
use crate::scene::{Define, Description, Overrides, Scene, SceneError};
use anyhow::anyhow;
use clap::ValueHint;
use clap::builder::NonEmptyStringValueParser;
use wgray_dev::{Diagnostic, Listener, Report, Session, Settings, Sources, StartError};
use wgray_render::gpu::AdapterChoice;

use super::Usage;
use super::log::{self, Facts, Level};
use super::outputs::protect_inputs;
use super::render::parse_size;
use super::scene_options::SceneOptions;

/// Arguments of `wgray dev`.
#[derive(Debug, clap::Args)]
#[command(after_help = super::EXIT_CODES)]
pub struct Args {
    /// Scene or model file
    scene: PathBuf,

    /// Serve the page at this address
    ///
    /// Anyone who can reach the address can view the scene and edit values of the scene file.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7878", value_parser = NonEmptyStringValueParser::new())]
    listen: String,

    /// Write the image to this file after each reload
    #[arg(short, long, value_name = "FILE.png")]
    out: Option<PathBuf>,

    /// Override the image size, in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,

    /// Watch the shaders in this folder [default: ./shaders if it exists, else the built-in shaders]
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    shaders: Option<PathBuf>,

    /// Render on this device
    ///
    /// auto and gpu prefer a GPU over software Vulkan; with auto, the CPU replaces software Vulkan for scenes with a BVH
    /// and unedited shaders. NAME is a part of an adapter's name, driver or type, or its number in `wgray devices`.
    #[arg(long, value_name = "auto|gpu|NAME", default_value = "auto", value_parser = NonEmptyStringValueParser::new())]
    device: String,

    /// Override a scene value: -D render.seed=3
    #[arg(short = 'D', long, value_name = "KEY=VALUE")]
    define: Vec<Define>,

    /// Allow the scene to read files from this folder instead of its own
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    asset_root: Option<PathBuf>,

    /// Use this URL to open source lines in an editor
    ///
    /// The URL contains {file} and optionally {line} and {column}, such as idea://open?file={file}&line={line}. off
    /// disables the links.
    #[arg(long, value_name = "URL|off", default_value = "vscode://file/{file}:{line}:{column}", value_parser = NonEmptyStringValueParser::new())]
    editor: String,

    /// Serve no page; requires --out
    #[arg(long, conflicts_with = "listen")]
    no_page: bool,

    #[command(flatten)]
    options: SceneOptions,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let sources = Sources {
        scene: args.scene,
        overrides: args.options.add_to(Overrides {
            size: args.size,
            asset_root: args.asset_root,
            define: args.define,
            ..Overrides::default()
        }),
        shaders: shaders(args.shaders)?,
    };
    let device = match args.device.to_lowercase().as_str() {
        "auto" => AdapterChoice::Auto,
        "gpu" => AdapterChoice::Gpu,
        "cpu" => {
            return Err(Usage(
                "--device: cpu cannot run shaders; use a GPU or software Vulkan, such as lavapipe".to_string(),
            )
            .into());
        }
        _ => AdapterChoice::Named(args.device),
    };
    if args.no_page && args.out.is_none() {
        return Err(Usage("--no-page requires --out FILE.png".to_string()).into());
    }
    let scene = args
        .out
        .as_ref()
        .and_then(|_| Scene::load_with(&sources.scene, &sources.overrides).ok());
    let out = (args.out.as_deref()).map(|out| check_output(out, &sources, scene.as_ref()));
    let out = out.transpose()?;
    let listener = if args.no_page {
        None
    } else {
        Some(Listener::open(&args.listen).map_err(|error| listen_error(&args.listen, &error))?)
    };
    let editor = editor(&args.editor)?;
    let terminal = Terminal::new();
    // The cache of meshes keeps a mesh only while a scene uses the mesh. This scene is kept until the first report, when
    // the session has read the scene, so that meshes are read only once.
    let scene = Mutex::new(scene);
    let watch_message = format!("Watching {}", watched_paths(&sources));
    let session = Session::start(Settings {
        sources,
        device,
        out,
        only_for_viewers: true,
        editor,
        report: Box::new(move |report| {
            drop(scene.lock().unwrap_or_else(PoisonError::into_inner).take());
            terminal.report(&report);
        }),
    })
    .map_err(|error| match error {
        StartError::Device(error) => anyhow::Error::from(error),
        StartError::NoScene(path, error) => SceneError::Read { path, error }.into(),
        error => anyhow::Error::from(error),
    })?;
    terminal.line("", &watch_message);
    let Some(listener) = listener else {
        Terminal::new().line("", &format!("Writing {}", args.out.unwrap_or_default().display()));
        loop {
            std::thread::park(); // until the user interrupts the program
        }
    };
    let address = listener.address()?;
    Terminal::new().line("", &format!("Open http://{address}/ (Ctrl+C to quit)"));
    if !address.ip().is_loopback() {
        let warning = format!(
            "{address} is not a loopback address: anyone who can reach it can view the scene and edit values of the scene \
             file"
        );
        log::print(Level::Warning, &warning);
    }
    listener.serve(&session)?;
    Ok(ExitCode::SUCCESS)
}

fn listen_error(address: &str, error: &io::Error) -> anyhow::Error {
    match (error.kind(), address.rsplit_once(':')) {
        (io::ErrorKind::AddrInUse, Some((_, port))) => anyhow!("Port {port} is in use; choose another with --listen"),
        (io::ErrorKind::InvalidInput, _) => Usage(format!(
            "--listen: {address:?} must be ADDRESS:PORT, such as 127.0.0.1:7878: {error}"
        ))
        .into(),
        _ => anyhow!("--listen: {error}"),
    }
}

/// URL schemes that browsers and operating systems handle specially.
const NON_EDITOR_SCHEMES: [&str; 14] = [
    "javascript",
    "data",
    "http",
    "https",
    "vbscript",
    "file",
    "blob",
    "about",
    "ws",
    "wss",
    "ftp",
    "mailto",
    "tel",
    "view-source",
];

/// Parses the template of links to an editor; `None` disables the links.
fn editor(template: &str) -> anyhow::Result<Option<String>> {
    if template == "off" {
        return Ok(None);
    }
    let usage_error = |rule: &str| Err(Usage(format!("--editor: {template}: {rule}")).into());
    let (scheme, rest) = template.split_once(':').unwrap_or(("", template));
    let has_valid_chars = scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    if !scheme.starts_with(|c: char| c.is_ascii_alphabetic()) || !has_valid_chars {
        return usage_error("must start with the URL scheme of an editor, such as vscode:, or be off");
    }
    if NON_EDITOR_SCHEMES
        .iter()
        .any(|reserved| scheme.eq_ignore_ascii_case(reserved))
    {
        return usage_error(&format!("{scheme}: is not the URL scheme of an editor"));
    }
    if rest.contains(|c: char| c.is_whitespace() || c.is_control()) {
        return usage_error("must not contain white space");
    }
    let without_placeholders = ["{file}", "{line}", "{column}"]
        .iter()
        .fold(rest.to_string(), |rest, placeholder| rest.replace(placeholder, ""));
    if without_placeholders.contains(['{', '}']) || !rest.contains("{file}") {
        return usage_error("must contain {file}, may contain {line} and {column}, and must not contain other braces");
    }
    Ok(Some(template.to_string()))
}

/// Resolves symbolic links in `--out`. Rejects watched files and files other than PNG.
fn check_output(out: &Path, sources: &Sources, loaded: Option<&Scene>) -> anyhow::Result<PathBuf> {
    let is_png = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
    if !is_png(out) {
        return Err(Usage(format!("--out: {}: must end in .png", out.display())).into());
    }
    let output = Output::find(out).map_err(RenderError::Output)?;
    let Some(path) = output.path() else {
        return Err(Usage(format!("--out: {}: must be a regular file", out.display())).into());
    };
    let text = std::fs::read_to_string(&sources.scene).unwrap_or_default(); // empty for a binary file
    let description = Description::parse(&text, &sources.scene.display().to_string()).ok();
    let folder = sources.scene.parent().unwrap_or(Path::new(""));
    let referenced = description.iter().flat_map(|description| description.files(folder));
    let referenced = referenced.chain(loaded.iter().flat_map(|scene| scene.files.iter().cloned()));
    let scene = std::iter::once(sources.scene.clone());
    let inputs: Vec<PathBuf> = scene.chain(referenced).chain(sources.shader_files()).collect();
    protect_inputs("--out", &output, &inputs, "choose another name")?;
    Ok(path.to_owned())
}

/// Returns the folder of the shaders; `None` for the built-in shaders.
fn shaders(requested: Option<PathBuf>) -> anyhow::Result<Option<PathBuf>> {
    match requested {
        Some(folder) if folder.is_dir() => Ok(Some(folder)),
        Some(folder) => Err(Usage(format!("--shaders: {}: is not a folder", folder.display())).into()),
        None => Ok(Some(PathBuf::from("shaders")).filter(|folder| folder.join("kernels/render.wgsl").is_file())),
    }
}

fn watched_paths(sources: &Sources) -> String {
    let scene = sources.scene.display();
    match &sources.shaders {
        Some(folder) => format!("{scene} and {}", folder.join("").display()),
        None => format!("{scene} (built-in shaders)"),
    }
}

/// Reports events on standard error, one per line.
#[derive(Clone, Copy)]
struct Terminal {
    colored: bool,
}

const RED: &str = "31";
const GREEN: &str = "32";
const BOLD: &str = "1";

impl Terminal {
    fn new() -> Terminal {
        let allows_color = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
        Terminal {
            colored: allows_color && io::stderr().is_terminal(),
        }
    }

    fn report(self, report: &Report) {
        match report {
            Report::Problem(problem) => self.problem(problem),
            Report::AllFixed => self.line(GREEN, "All errors fixed"),
            Report::Reloaded {
                seconds,
                compiled: None,
            } => self.line("", &format!("Image after {}", time(*seconds))),
            Report::Reloaded {
                seconds,
                compiled: Some(compiled),
            } => {
                self.line(
                    "",
                    &format!("Image after {}, including {} to compile the shaders", time(*seconds), time(*compiled)),
                );
            }
            Report::Finished { seconds } => self.line("", &format!("Finished after another {}", time(*seconds))),
            Report::Note(note) => self.line("", &format!("note: {note}")),
            Report::ReducedImage([width, height], [shown_width, shown_height]) => self.line(
                "",
                &format!(
                    "{width} x {height} is too large to display; showing {shown_width} x {shown_height}. Use wgray render for the \
                     full size"
                ),
            ),
            Report::Saved(name, Ok(())) => self.line(GREEN, &format!("Saved {name} to the scene file")),
            Report::Saved(name, Err(error)) => self.line(RED, &format!("Cannot save {name}: {error}")),
            Report::UndoRedo(action, Ok(())) => self.line(GREEN, action),
            Report::UndoRedo(action, Err(error)) => self.line(RED, &format!("{action}: failed: {error}")),
        }
    }

    fn problem(self, problem: &Diagnostic) {
        let location = problem
            .place
            .as_ref()
            .map(|place| format!("{place}: "))
            .unwrap_or_default();
        if log::is_json() {
            let mut facts = Facts::new();
            facts.extend(
                problem
                    .marked_line()
                    .map(|excerpt| ("excerpt".to_owned(), excerpt.into())),
            );
            log::print_with(Level::Error, &format!("{location}{}", problem.message), facts);
            return;
        }
        let head = format!(
            "{} {}",
            self.painted(RED, "error:"),
            self.painted(BOLD, &format!("{location}{}", problem.message))
        );
        let excerpt = problem
            .marked_line()
            .map(|excerpt| self.marked(&excerpt))
            .unwrap_or_default();
        write(&format!("{} {head}\n{excerpt}", clock()));
    }

    /// Returns the excerpt with the error underlines in red.
    fn marked(self, excerpt: &str) -> String {
        let lines = excerpt.lines().map(|line| match line.find('^') {
            Some(start) if !line.starts_with(char::is_numeric) => {
                format!("{}{}\n", &line[..start], self.painted(RED, &line[start..]))
            }
            _ => format!("{line}\n"),
        });
        lines.collect()
    }

    fn line(self, color: &str, text: &str) {
        if log::is_json() {
            let level = if color == RED { Level::Error } else { Level::Info };
            return log::print(level, text);
        }
        write(&format!("{} {}\n", clock(), self.painted(color, text)));
    }

    fn painted(self, color: &str, text: &str) -> String {
        if self.colored && !color.is_empty() {
            format!("\x1b[{color}m{text}\x1b[0m")
        } else {
            text.to_string()
        }
    }
}

fn write(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes()); // a failure to write to standard error cannot be reported
}

/// Returns the time of day in UTC.
fn clock() -> String {
    let seconds = SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default()
        .as_secs();
    format!(
        "{:02}:{:02}:{:02}",
        seconds / 3600 % 24,
        seconds / 60 % 60,
        seconds % 60
    )
}

fn time(seconds: f64) -> String {
    if seconds < 1.0 {
        format!("{:.0} ms", seconds * 1000.0)
    } else {
        format!("{seconds:.2} s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn editor_links_need_an_editor_scheme_and_a_file_placeholder() {
        for valid in [
            "vscode://file/{file}:{line}:{column}",
            "vscode-insiders://file/{file}:{line}",
            "idea://open?file={file}&line={line}",
            "txmt://open?url=file://{file}",
        ] {
            assert_eq!(editor(valid).unwrap().as_deref(), Some(valid));
        }
        assert_eq!(editor("off").unwrap(), None);
        for invalid in [
            "",
            "vscode",
            "javascript:alert({file})",
            "JavaScript://{file}",
            "data:text/html,{file}",
            "http://evil.example/{file}",
            "HTTPS://evil.example/{file}",
            "file://{file}",
            "1code://{file}",
            " vscode://{file}",
            "vs code://{file}",
            "java\nscript:{file}",
            "vscode://file/{file} {line}",
            "vscode://file/",
            "vscode://file/{path}",
            "vscode://file/{file}{",
        ] {
            let error = editor(invalid).expect_err(invalid).to_string();
            assert!(error.starts_with("--editor: "), "{error}");
        }
    }
}
