//! What reaches the thread that renders, and what it tells those who look.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::build::Built;
use super::camera::Move;
use super::diagnostic::Diagnostic;
use super::picture::View;
use super::source::Snapshot;

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// Something is wrong.
    Problem(Diagnostic),
    /// Nothing is wrong any more.
    Mended,
    /// The first picture of a saved file was shown, so many seconds after the save was noticed; if a kernel was compiled,
    /// that took so many.
    Reloaded {
        /// From the save to the picture.
        seconds: f64,
        /// To compile.
        compiled: Option<f64>,
    },
    /// The picture has all its samples.
    Finished {
        /// Since the first picture.
        seconds: f64,
    },
    /// Something to know of the scene.
    Note(String),
    /// The picture is larger than what can be shown: the size asked for, and the size of what is shown.
    Smaller([u32; 2], [u32; 2]),
    /// Something was written into the scene file, the camera or a value; or why it could not be.
    Wrote(String, Result<(), String>),
    /// What was written last was taken back, or what was taken back last was made again; or why not.
    Turned(String, Result<(), String>),
}

/// A value for a key of the scene file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// The way to it: `materials.red.color`.
    pub path: String,
    /// The value; null takes the key out of the file.
    pub value: serde_json::Value,
    /// Changes of the same key with the same number are one step of undo.
    #[serde(default)]
    pub gesture: Option<u64>,
}

/// What someone who looks asks for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// To move the camera.
    Move(Move),
    /// The scene file's camera.
    ResetCamera,
    /// To write the camera into the scene file.
    SaveCamera,
    /// To write a value into the scene file.
    Set(Set),
    /// To take back what was written into the scene file last.
    UndoWrite,
    /// To write again what was taken back last.
    RedoWrite,
    /// Another view.
    View(View),
    /// The factor of the difference of [`View::Compare`].
    Gain(f32),
    /// Whether pixels that are no light are marked.
    Marks(bool),
}

/// What is known beside the picture; it goes to the page as JSON.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct State {
    /// The scene file.
    pub scene: String,
    /// The shaders' folder; the program's own if absent.
    pub shaders: Option<String>,
    /// The device and its driver.
    pub device: String,
    /// What is shown.
    pub view: View,
    /// The factor of the difference of [`View::Compare`].
    pub gain: f32,
    /// Whether pixels that are no light are marked.
    pub marks: bool,
    /// The camera, as the section of a scene file.
    pub camera: String,
    /// Whether it is not that of the file.
    pub camera_moved: bool,
    /// Counts the scenes that were right.
    pub scenes: u64,
    /// What was written into the scene file last, and can be taken back: `camera`, `materials.red.color`.
    pub undo: Option<String>,
    /// What was taken back last, and can be written again.
    pub redo: Option<String>,
    /// What is wrong now.
    pub problems: Vec<Diagnostic>,
    /// Whether a kernel is being compiled.
    pub compiling: bool,
    /// Seconds that the last one took.
    pub compile_seconds: Option<f64>,
    /// How many commands have been followed.
    pub heard: u64,
    /// The number of the last frame.
    pub frame: u64,
    /// Whether there will be more frames without anything happening.
    pub busy: bool,
    /// The last thing that was said, and how many were before it.
    pub notice: Option<Notice>,
}

/// An answer to a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Notice {
    /// Counts them.
    pub number: u64,
    /// Which command it answers, counted as [`State::heard`] does.
    pub command: u64,
    /// What is said.
    pub text: String,
    /// Whether it is bad.
    pub bad: bool,
}

/// What reaches the thread that renders.
pub enum Event {
    /// The files have changed; noticed at that time, when so many writes of this session were known.
    Files(Box<Snapshot>, Instant, u64),
    /// A kernel has been compiled.
    Built(Box<Built>),
    /// Someone asks for something.
    Command(Command),
    /// Someone came who looks.
    Viewers,
    /// A driver loses its device.
    #[cfg(test)]
    Lose,
    /// The session ends.
    Stop,
}
